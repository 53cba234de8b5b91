"""The one function that wires a machine to the pins of a board, or of a simulation."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass

from amaranth import Cat, ClockDomain, ClockSignal, Module, ResetSignal, Signal, Value, ValueLike
from amaranth.lib import io
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In

from fresa import panel
from fresa.panel import Debouncer, SevenSegment, debounce_period
from fresa.roles import MachineComponent, Role

from .board import LEDS, RESET, Allotment, Bit, Bits, Board, role_of

__all__ = ["Plan", "check_names", "other_levels", "prepare", "simulation_ports", "wire"]


def wire(machine: MachineComponent, ports: Mapping[str, io.PortLike], allotment: Allotment, *,
         clock: int, debounce: int | None = None, scan_bits: int | None = None,
         inverted: Collection[str] = (), start_up: int = 0) -> Module:
    """Wire a machine to pins.

    Every input goes through two flip-flops, before which there is no inverter, and which begin with
    its level at rest; contacts whose role says that they bounce go on through one debouncer.
    Outputs whose role says so come from flip-flops that no reset touches, with nothing behind them,
    so that they can be in the I/O blocks; they have the level at rest before the first clock, and
    follow the machine a clock later. An input without a pin stays at rest, or as the allotment has
    it. A reset that is allotted is the reset of ``sync``.

    Parameters
    ----------
    machine : MachineComponent
        What to wire. It becomes the submodule ``machine``.
    ports : mapping of str to PortLike
        ``clk`` and a port for each place, see :meth:`Board.request` and :func:`simulation_ports`.
    allotment : Allotment
        What the places are for.
    clock : int
        The clock of the ports, in Hz: by it the times of people are counted.
    debounce : int, optional
        Clocks for which a contact must be still, unless `debounce_period` of the clock.
    scan_bits : int, optional
        See :class:`SevenSegment`; for a machine that has a number to show. Unless given, it is
        `fresa.panel.scan_bits` of the clock.
    inverted : collection of str
        Ports whose pins are on at the level at which they are off otherwise.
    start_up : int
        Clocks after power-up for which the machine stays in reset.

    Raises
    ------
    ValueError
        If a port that needs a pin has none, or a number is out of range.
    """
    m = Module()
    places = allotment.places(machine)
    m.submodules.machine = machine
    levels = {port: getattr(machine, port) for port in machine.roles}
    if allotment.number is not None:
        m.submodules.display = display = SevenSegment(
            scan_bits=panel.scan_bits(clock) if scan_bits is None else scan_bits)
        m.d.comb += [display.value.eq(levels[allotment.number]), display.enable.eq(1)]
        levels |= {"segments": display.segments, "digits": display.digits}
    reset = Signal()
    levels[RESET] = reset

    def lead_in(bits: Sequence[Bit | None], clean: Value) -> None:
        m.d.comb += [levels[bit.port][bit.index].eq(level)
                     for bit, level in zip(bits, clean, strict=True) if bit is not None]

    contacts: list[_Place] = []
    driven = set()
    for name, bits in places.items():
        place = _Place(m, machine, name, ports[name], bits, inverted)
        if place.is_input:
            driven |= {bit.port for bit in bits if bit}
            if place.bounces:
                contacts.append(place)
            else:
                lead_in(bits, _synchronize(m, name, place.pins, place.rest, place.mask))
        else:
            place.drive([0 if bit is None else levels[bit.port][bit.index] for bit in bits])
    if contacts:
        bits = sum((place.bits for place in contacts), ())
        slow, fast = _by_speed(machine, bits)
        m.submodules.debouncer = debouncer = Debouncer(
            width=len(slow), period=debounce_period(clock) if debounce is None else debounce)
        levels_in = _synchronize(m, "contacts", Cat(*(place.pins for place in contacts)),
                                sum((place.rest for place in contacts), ()),
                                sum((place.mask for place in contacts), ()))
        m.d.comb += debouncer.i.eq(Cat(levels_in[index] for index in slow))
        lead_in([bits[index] for index in slow], debouncer.o)
        lead_in([bits[index] for index in fast], Cat(levels_in[index] for index in fast))
    for port, role in machine.roles.items():
        level = allotment.constant.get(port, role.rest)
        if level and machine.signature.members[port].flow is In and port not in driven:
            m.d.comb += levels[port].eq(level)

    held = reset
    if start_up:
        # Some parts release their flip-flops in different clocks: the count may begin late by
        # that, but it cannot end early.
        count, running = Signal(range(start_up), reset_less=True), Signal(reset_less=True)
        over = running | (count == start_up - 1)
        # Thousands of registers wait for the reset, so that it is one itself.
        held = Signal(init=1, reset_less=True)
        m.d.sync += [count.eq(count + 1), running.eq(over), held.eq(reset | ~over)]
    m.domains.sync = ClockDomain()
    m.submodules.clk = clk = io.Buffer("i", ports["clk"])
    m.d.comb += [ClockSignal().eq(clk.i), ResetSignal().eq(held)]
    return m


class _Place:
    """A port, its buffer, and how its levels are those of the machine.

    Attributes
    ----------
    rest : tuple of int
        Levels of the machine at rest.
    mask : tuple of int
        Bits whose pin has the other level.
    """

    def __init__(self, m: Module, machine: MachineComponent, name: str, port: io.PortLike,
                 bits: Bits, inverted: Collection[str]) -> None:
        self._m, self.name, self.bits = m, name, bits
        roles = _roles(machine, name, bits)
        self.rest = tuple(0 if bit is None or role is None else role.rest >> bit.index & 1
                          for bit, role in zip(bits, roles, strict=True))
        self.mask = other_levels(machine, name, port, bits, inverted)
        self.bounces = _bounces(machine, port, bits)
        self._registered = any(role.registered for role in roles if role)
        self.is_input = port.direction is io.Direction.Input
        m.submodules[name] = self._buffer = io.Buffer("i" if self.is_input else "o", _plain(port))

    @property
    def pins(self) -> Value:
        """Levels of the pins of an input."""
        return self._buffer.i

    def drive(self, levels: Sequence[ValueLike]) -> None:
        """Give the machine's levels to an output."""
        m, init = self._m, _word(self.rest) ^ _word(self.mask)
        value = Cat(*(~Value.cast(level) if turned else Value.cast(level)
                      for level, turned in zip(levels, self.mask, strict=True)))
        if self._registered:
            pins = Signal(len(levels), name=f"{self.name}_pins", init=init, reset_less=True,
                          attrs={"IOB": "TRUE"})
            m.d.sync += pins.eq(value)
            value = pins
        m.d.comb += self._buffer.o.eq(value)


def other_levels(machine: MachineComponent, name: str, port: io.PortLike, bits: Bits,
                 inverted: Collection[str] = ()) -> tuple[int, ...]:
    """Say which bits of a place have another level at their pin than at the machine.

    Parameters
    ----------
    machine, inverted
        See :func:`wire`.
    name, port, bits
        The place, its port, and the bits there.
    """
    return tuple(
        int(turned if bit is None or role is None else
            turned ^ role.active_low ^ (bit.port in inverted))
        for bit, role, turned in zip(bits, _roles(machine, name, bits), port.invert, strict=True))


def _roles(machine: MachineComponent, name: str, bits: Bits) -> list[Role | None]:
    """Give the roles of bits at a place; LEDs show levels, whatever these are for."""
    return [None if bit is None or name == LEDS else role_of(machine, bit.port) for bit in bits]


def _bounces(machine: MachineComponent, port: io.PortLike, bits: Bits) -> bool:
    """Whether bits of a place go through the debouncer."""
    return port.direction is io.Direction.Input and any(
        role_of(machine, bit.port).bounces for bit in bits if bit)


def _by_speed(machine: MachineComponent, bits: Bits) -> tuple[list[int], list[int]]:
    """Give the places of the bits that go through the debouncer, and of those that pass it by."""
    slow = [index for index, bit in enumerate(bits)
            if bit is None or role_of(machine, bit.port).bounces]
    return slow, sorted({*range(len(bits))} - {*slow})


def _synchronize(m: Module, name: str, pins: Value, rest: Sequence[int],
                 mask: Sequence[int]) -> Value:
    """Lead pins inside through two flip-flops; give the machine's levels."""
    level = Signal(len(rest), name=f"{name}_level")
    m.submodules[f"{name}_synchronizer"] = FFSynchronizer(pins, level,
                                                          init=_word(rest) ^ _word(mask))
    return level ^ _word(mask) if any(mask) else level


@dataclass(frozen=True)
class Plan:
    """What a tool makes a bitstream of.

    Attributes
    ----------
    files : mapping of str to bytes
        By name.
    rtlil : str
        The design in them, in RTLIL.
    """

    files: Mapping[str, bytes]
    rtlil: str


def prepare(board: Board, name: str, machine: MachineComponent, *,
            inverted: Collection[str] = ()) -> Plan:
    """Wire a machine to a board, and plan its bitstream.

    Parameters
    ----------
    board : Board
        The board.
    name : str
        The machine's, by which its pins are found and its files are named.
    machine : MachineComponent
        The machine.
    inverted : collection of str
        See :func:`wire`.

    Raises
    ------
    ValueError
        If the board has no pins for the machine.
    """
    allotment, platform = board.allotment(name), board.platform()
    top = wire(machine, board.request(platform, machine, allotment), allotment,
               clock=board.clock, inverted=inverted, start_up=board.start_up)
    for number, (pin, level) in enumerate(board.held.items()):
        top.submodules[f"held_{number}"] = buffer = io.Buffer("o", board.port(platform, pin))
        top.d.comb += buffer.o.eq(level)
    files = platform.prepare(top, name, **(board.flow.options(name) if board.flow else {})).files
    files = {file: text.encode() if isinstance(text, str) else text
             for file, text in files.items() if not file.endswith(".debug.v")}
    return Plan(files, files[f"{name}.il"].decode() if board.flow else platform.rtlil)


def simulation_ports(board: Board, machine: MachineComponent,
                     allotment: Allotment) -> dict[str, io.SimulationPort]:
    """Make ports of a simulation with the directions and the polarity of those of a board."""
    ports = board.request(board.platform(), machine, allotment)
    return {name: io.SimulationPort(port.direction, len(port), name=name, invert=port.invert)
            for name, port in ports.items()}


def check_names(machine: MachineComponent, ports: Mapping[str, io.PortLike],
                allotment: Allotment) -> dict[str, str]:
    """Map the bits of a machine to where checks find their levels on a board, by name.

    A bit that is debounced is in a register of the debouncer, any other on its pin: a LED is the
    pin of a bit only if the bit has no other.

    Parameters
    ----------
    machine : MachineComponent
        The machine.
    ports : mapping of str to PortLike
        Those that :func:`wire` is given.
    allotment : Allotment
        What the places are for.
    """
    places = allotment.places(machine)
    contacts = sum((bits for name, bits in places.items()
                    if _bounces(machine, ports[name], bits)), ())
    slow, _ = _by_speed(machine, contacts)
    names = {str(contacts[index]): "debouncer.o" if len(slow) == 1 else f"debouncer.level[{place}]"
             for place, index in enumerate(slow) if contacts[index] is not None}
    for name in sorted(places, key=LEDS.__eq__):
        for index, bit in enumerate(places[name]):
            if bit is not None:
                names.setdefault(str(bit), name if len(places[name]) == 1 else f"{name}[{index}]")
    return names


def _word(bits: Iterable[int]) -> int:
    return sum(bool(bit) << index for index, bit in enumerate(bits))


def _plain(port: io.PortLike) -> io.PortLike:
    """The port without its inverters: they would stand between pin and flip-flop."""
    if not any(port.invert):
        return port
    if all(port.invert):
        return ~port
    parts = [~port[index] if turned else port[index] for index, turned in enumerate(port.invert)]
    whole = parts[0]
    for part in parts[1:]:
        whole += part
    return whole
