"""The one function that wires a machine to the pins of a board, or of a simulation."""

from collections.abc import Collection, Iterable, Mapping

from amaranth import Cat, ClockDomain, ClockSignal, Const, Module, ResetSignal, Signal, Value
from amaranth.lib import io
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In

from fresa.panel import Debouncer, SevenSegment
from fresa.roles import Machine

from .board import RESET, Allotment, Bit, Bits, role_of

__all__ = ["check_names", "simulation_ports", "wire"]

_INPUTS = {"clk", "rx", "switches", "buttons"}
_ACTIVE_LOW = {"segments", "digits"}


def wire(machine: Machine, ports: Mapping[str, io.PortLike], allotment: Allotment, *,
         debounce: int, scan_bits: int, inverted: Collection[str] = ()) -> Module:
    """Wire a machine to pins.

    Every input goes through two flip-flops, before which there is no inverter, and which begin with
    its level at rest; contacts that bounce go on through one debouncer. Outputs whose role says so
    come from flip-flops that no reset touches, with nothing behind them, so that they can be in the
    I/O blocks; they have the level at rest before the first clock, and follow the machine a clock
    later. An input without a pin stays at rest. A reset that is allotted is the reset of ``sync``.

    Parameters
    ----------
    machine : Machine
        What to wire. It becomes the submodule ``machine``.
    ports : mapping of str to PortLike
        ``clk`` and a port for each place, see :meth:`Board.request` and :func:`simulation_ports`.
    allotment : Allotment
        What the places are for.
    debounce : int
        Clocks for which a contact must be still.
    scan_bits : int
        See :class:`SevenSegment`; for a machine that has a number to show.
    inverted : collection of str
        Ports whose pins are on at the level at which they are off otherwise.

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
        m.submodules.display = display = SevenSegment(scan_bits=scan_bits)
        m.d.comb += [display.value.eq(levels[allotment.number]), display.enable.eq(1)]
        levels |= {"segments": display.segments, "digits": display.digits}
    levels[RESET] = reset = Signal()

    def rest(bit: Bit | None) -> int:
        return bit is not None and role_of(machine, bit.port).rest >> bit.index & 1

    def turned(bit: Bit | None, pin: bool) -> int:
        """Say whether a pin has the other level than the port of the machine."""
        return pin if bit is None else (
            pin ^ role_of(machine, bit.port).active_low ^ (bit.port in inverted))

    def synchronize(name: str, pins: Value, bits: Bits, turned: int) -> Value:
        level = Signal(len(bits), name=f"{name}_level")
        at_rest = _word(map(rest, bits)) ^ turned
        m.submodules[f"{name}_synchronizer"] = FFSynchronizer(pins, level, init=at_rest)
        return level ^ turned if turned else level

    def drive(bits: Bits, clean: Value) -> None:
        for index, bit in enumerate(bits):
            if bit is not None:
                m.d.comb += levels[bit.port][bit.index].eq(clean[index])

    contacts: list[tuple[Value, Bits, int]] = []
    for name, bits in places.items():
        port = ports[name]
        mask = _word(map(turned, bits, port.invert))
        roles = [role_of(machine, bit.port) for bit in bits if bit]
        if name == "leds":  # it shows levels, whatever they are for
            mask, roles = _word(port.invert), []
        if port.direction is io.Direction.Input:
            m.submodules[name] = pins = io.Buffer("i", _plain(port))
            if any(role.bounces for role in roles):
                contacts.append((pins.i, bits, mask))
            else:
                drive(bits, synchronize(name, pins.i, bits, mask))
            continue
        m.submodules[name] = pins = io.Buffer("o", _plain(port))
        value: Value = Cat(Const(0, 1) if bit is None else levels[bit.port][bit.index]
                           for bit in bits)
        value = value ^ mask if mask else value
        if any(role.registered for role in roles):
            register = Signal(len(bits), name=f"{name}_pins", init=_word(map(rest, bits)) ^ mask,
                              reset_less=True, attrs={"IOB": "TRUE"})
            m.d.sync += register.eq(value)
            value = register
        m.d.comb += pins.o.eq(value)

    if contacts:
        pins, words, masks = zip(*contacts, strict=True)
        bits = sum(words, ())
        m.submodules.debouncer = debouncer = Debouncer(width=len(bits), period=debounce)
        mask = _word([mask >> index & 1 for word, mask in zip(words, masks, strict=True)
                      for index in range(len(word))])
        m.d.comb += debouncer.i.eq(synchronize("contacts", Cat(*pins), bits, mask))
        drive(bits, debouncer.o)

    wired = {bit.port for name, bits in places.items() for bit in bits
             if bit and ports[name].direction is io.Direction.Input}
    m.d.comb += [levels[port].eq(role.rest) for port, role in machine.roles.items()
                 if role.rest and machine.signature.members[port].flow is In and port not in wired]

    m.domains.sync = ClockDomain()
    m.submodules.clk = clk = io.Buffer("i", ports["clk"])
    m.d.comb += [ClockSignal().eq(clk.i), ResetSignal().eq(reset)]
    return m


def simulation_ports(machine: Machine, allotment: Allotment) -> dict[str, io.SimulationPort]:
    """Make ports of a simulation that are like those of a board.

    A display is active low, and so is a contact to ground.
    """
    def port(name: str, bits: Bits) -> io.SimulationPort:
        if name in allotment.header:
            incoming = machine.signature.members[name].flow is In
            return io.SimulationPort("i" if incoming else "o", len(bits), name=name,
                                     invert=machine.roles[name].to_ground)
        return io.SimulationPort("i" if name in _INPUTS else "o", len(bits), name=name,
                                 invert=name in _ACTIVE_LOW)

    return {name: port(name, bits)
            for name, bits in {"clk": (None,), **allotment.places(machine)}.items()}


def check_names(machine: Machine, allotment: Allotment) -> dict[str, str]:
    """Map the bits of a machine to what tells of them on a board, by name: for checks.

    An output is the pin of a simulation, an input the register behind its debouncer or its pin.
    """
    contacts = [bit for name, bits in allotment.places(machine).items() for bit in bits
                if name in ("switches", "buttons")]
    names = {}
    for name, bits in allotment.places(machine).items():
        for index, bit in enumerate(bits):
            if bit is not None and bit not in contacts:
                names[str(bit)] = name if len(bits) == 1 else f"{name}[{index}]"
    for index, bit in enumerate(contacts):
        if bit is not None:
            names[str(bit)] = "debouncer.o" if len(contacts) == 1 else f"debouncer.level[{index}]"
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
