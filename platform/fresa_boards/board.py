"""What a board is, and which pin of it a machine has for what: data."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from amaranth.build import Attrs, Pins, PinsN, Resource
from amaranth.lib import io
from amaranth.lib.wiring import In

from fresa.roles import BUTTON, DIGITS, SEGMENTS, STATUS, MachineComponent, Role

from .flow import Flow

__all__ = ["LEDS", "RESET", "Allotment", "Bit", "Bits", "Board", "Capacity", "Layout", "Loader",
           "Pin", "PinRow", "pin_table", "role_of"]

RESET = "reset"
"""What the words of an allotment call the reset of a machine, which is no port of it."""

LEDS = "leds"
"""The part of a board that shows levels, whatever these are for; no port has its one pin there."""


@dataclass(frozen=True)
class Capacity:
    """What an FPGA holds.

    Attributes
    ----------
    luts : int
        4-input look-up tables.
    flip_flops : int
        Flip-flops beside them; those in the I/O blocks come on top.
    block_rams : int
        Block RAMs.
    multipliers : int
        Multipliers of 16 x 16 bits or more.
    block_ram_bits : int
        Bits of a block RAM, without those for parity.
    """

    luts: int
    flip_flops: int
    block_rams: int
    multipliers: int
    block_ram_bits: int = 16_384


@dataclass(frozen=True)
class Bit:
    """A bit of a port of a machine; `RESET` stands for its reset."""

    port: str
    index: int = 0
    width: int = 1

    def __str__(self) -> str:
        return self.port if self.width == 1 else f"{self.port}[{self.index}]"


Bits = tuple[Bit | None, ...]

OURS = {RESET: (BUTTON, 1), "segments": (SEGMENTS, 8), "digits": (DIGITS, 4)}
"""What a board has for a machine that has no such ports: roles and widths."""


def role_of(machine: MachineComponent, port: str) -> Role:
    """Return the role of a port of a machine, or of what the board has in its stead."""
    return machine.roles[port] if port in machine.roles else OURS[port][0]


@dataclass(frozen=True)
class Allotment:
    """Which place of a board each port of a machine has.

    It is written by a person and committed: machines are wired by it.

    Attributes
    ----------
    header : mapping of str to str
        For each port on a header the names of its pins, bit 0 first.
    panel : mapping of str to str
        For each part of the board what its bits are for, bit 0 first: ports of the machine, all of
        their bits each; ``reset``; or ``-`` for nothing. A LED may also show an input. Ports that
        a machine does not have with its options count as ``-``, and a part with nothing else has
        no pins.
    number : str, optional
        Port whose number ``segments`` and ``digits`` show, of a machine that does not scan a
        display itself.
    constant : mapping of str to int
        Inputs that have no pin on this board, and the level at which they stay.
    """

    header: Mapping[str, str] = field(default_factory=dict)
    panel: Mapping[str, str] = field(default_factory=dict)
    number: str | None = None
    constant: Mapping[str, int] = field(default_factory=dict)

    def places(self, machine: MachineComponent) -> dict[str, Bits]:
        """List the bits of a machine at each place: a part of the board, or a port on a header.

        Raises
        ------
        ValueError
            If a port that needs a pin has none, or as many pins as it has not bits.
        """
        ours = (RESET, "segments", "digits") if self.number else (RESET,)
        widths = {port: OURS[port][1] for port in ours} | {
            port: len(getattr(machine, port)) for port in machine.roles}

        def bits(port: str) -> Bits:
            width = widths.get(port)
            return (None,) if width is None else tuple(
                Bit(port, index, width) for index in range(width))

        header = {port: bits(port) for port in self.header if port in widths}
        for port, pins in header.items():
            if len(self.header[port].split()) != len(pins):
                raise ValueError(f"{port} has {len(pins)} bits, not those of {self.header[port]}")
        panel = {name: tuple(bit for word in words.split() for bit in bits(word))
                 for name, words in self.panel.items()}
        places = {name: place for name, place in (header | panel).items() if any(place)}
        wired = {bit.port for name, place in places.items() if name != LEDS
                 for bit in place if bit}
        for port, role in machine.roles.items():
            if not role.optional and port not in wired and port not in self.constant:
                raise ValueError(f"{port} of the machine, {role.name}, has no pin on the board")
        return places


@dataclass(frozen=True)
class Pin:
    """Pins that a board has in one place.

    Attributes
    ----------
    label : str
        What the board calls it.
    resource : str
        The platform's resource, its name.
    number : int
        And its number.
    part : str, optional
        The subsignal, where it has some.
    """

    label: str
    resource: str
    number: int = 0
    part: str | None = None


@dataclass(frozen=True)
class Layout:
    """A header as it is drawn for people, in two columns.

    Attributes
    ----------
    name : str
        What the board calls it.
    view : str
        How the board lies so that the pins are where they are drawn, in a few words.
    left, right : str
        The pins of the columns from top to bottom: names of the board's header, or what else is
        there, such as ``GND`` and ``3V3``.
    """

    name: str
    view: str
    left: str
    right: str


@dataclass(frozen=True)
class Loader:
    """How ``openFPGALoader`` finds a board.

    Attributes
    ----------
    board : str
        What it calls the board.
    usb : str
        Vendor and product of the USB chip, in hex.
    memory : bool
        A bitstream can be loaded into the FPGA alone, until the power goes.
    """

    board: str
    usb: str
    memory: bool = True

    def command(self, bitstream: str, *, flash: bool) -> list[str]:
        """Return what loads a bitstream into the board's flash, or until the power goes.

        Raises
        ------
        ValueError
            If the board is loaded by its flash alone.
        """
        if not (flash or self.memory):
            raise ValueError("the board is loaded by its flash alone")
        return ["openfpgaloader-cli", "-b", self.board, "-f" if flash else "-m", bitstream]


@dataclass(frozen=True)
class PinRow:
    """A pin of a machine on a board, for people.

    Attributes
    ----------
    port : str
        The bit of the machine.
    role : str
        What it is for, and what a contact on a header switches to.
    place : str
        What the board calls the pin.
    pin : str
        What its FPGA calls it.
    """

    port: str
    role: str
    place: str
    pin: str


@dataclass(frozen=True)
class Board:
    """A board.

    Attributes
    ----------
    name : str
        What people call it on a command line.
    family : str
        What boards have in common that are wired alike.
    platform : type of Platform
        Its FPGA, its resources and the tool that makes its bitstream. Has ``prepare`` of Amaranth,
        and then ``rtlil``, the design from which the plan was made.
    capacity : Capacity
        What its FPGA holds.
    header : mapping of str to str
        Header pins by the board's name, in the order in which they are wired; each as the platform
        spells it, ``CONNECTOR:PIN``.
    panel : mapping of str to tuple of Pin
        Its parts beside headers, bit 0 first: ``clk``, ``rx``, ``tx``, ``switches``, ``buttons``,
        ``leds``, ``segments``, ``digits``, those that it has.
    outputs, pulled_up : Attrs
        Attributes of header pins that are outputs, and inputs with a pull-up.
    allotments : mapping of str to Allotment
        The pins of each machine, by its name.
    title : str
        What its maker calls it, and its FPGA.
    source : str
        The published files that the pins were checked against.
    layouts : tuple of Layout
        Where the header pins are.
    held : mapping of Pin to int
        Pins that need a level while any machine runs.
    start_up_us : int
        For how long after power-up a machine stays in reset, in us.
    flow : Flow, optional
        The programs that make its bitstream, if they are open.
    loader : Loader, optional
        How the bitstream gets into it, if by ``openFPGALoader``.
    """

    name: str
    family: str
    platform: type[Any]
    capacity: Capacity
    header: Mapping[str, str]
    panel: Mapping[str, tuple[Pin, ...]]
    outputs: Attrs
    pulled_up: Attrs
    allotments: Mapping[str, Allotment]
    title: str
    source: str
    layouts: tuple[Layout, ...] = ()
    held: Mapping[Pin, int] = field(default_factory=dict)
    start_up_us: int = 0
    flow: Flow | None = None
    loader: Loader | None = None

    @property
    def clock(self) -> int:
        """Its clock, in Hz."""
        return round(self.platform().default_clk_frequency)

    @property
    def start_up(self) -> int:
        """For how long a machine stays in reset after power-up, in clocks."""
        return -(-self.start_up_us * self.clock // 1_000_000)

    def allotment(self, machine: str) -> Allotment:
        """Return the pins that a machine has, by its name.

        Raises
        ------
        ValueError
            If none are committed for this pair.
        """
        if machine not in self.allotments:
            raise ValueError(f"{self.name} has no pins allotted to {machine}")
        return self.allotments[machine]

    def request(self, platform, machine: MachineComponent,
                allotment: Allotment) -> dict[str, io.PortLike]:
        """Request the clock and the pins of a machine from an instance of the platform.

        Returns
        -------
        dict
            A port for ``clk`` and for each place; see :meth:`Allotment.places`. Each has the
            direction and the polarity that the board has there.
        """
        requested: dict[tuple[str, int], Any] = {}

        def part(name: str, width: int) -> io.PortLike:
            port = self.port(platform, self.panel[name][0], requested)
            for pin in self.panel[name][1:]:
                if len(port) < width:
                    port += self.port(platform, pin, requested)
            return port

        places = allotment.places(machine)
        platform.add_resources([self._resource(name, machine, allotment.header[name])
                                for name in places if name in allotment.header])
        return {"clk": part("clk", 1)} | {
            name: platform.request(name, dir="-") if name in allotment.header
            else part(name, len(bits)) for name, bits in places.items()}

    @staticmethod
    def port(platform, pin: Pin, requested: dict[tuple[str, int], Any] | None = None) -> Any:
        """Request a pin of an instance of the platform, or find it among those requested."""
        requested = {} if requested is None else requested
        key = pin.resource, pin.number
        if key not in requested:
            requested[key] = platform.request(*key, dir="-")
        return requested[key] if pin.part is None else getattr(requested[key], pin.part)

    def _resource(self, port: str, machine: MachineComponent, names: str) -> Resource:
        pins = " ".join(self.header[name] for name in names.split())
        contact = role_of(machine, port).to_ground
        direction = "i" if port == RESET or machine.signature.members[port].flow is In else "o"
        return Resource(port, 0, (PinsN if contact else Pins)(pins, dir=direction),
                        self.pulled_up if contact else self.outputs)

    def pin_rows(self, machine: MachineComponent, allotment: Allotment) -> list[PinRow]:
        """List the pins of a machine, in the order of the allotment, header first."""
        ports = self.request(self.platform(), machine, allotment)
        rows = []
        for name, bits in allotment.places(machine).items():
            labels = allotment.header[name] if name in allotment.header else " ".join(
                pin.label for pin in self.panel[name])
            pins = [bit.name for bit in ports[name].io.metadata]
            for bit, label, pin in zip(bits, labels.split(), pins, strict=False):
                if bit is not None:
                    role = STATUS if name == LEDS else role_of(machine, bit.port)
                    contact = name in allotment.header and role.to_ground
                    rows.append(PinRow(
                        str(bit), f"{role.name}, to GND" if contact else role.name, label, pin))
        return rows


def pin_table(board: Board, machine: MachineComponent, allotment: Allotment) -> str:
    """Write the pins of a machine on a board as a table in Markdown, for people."""
    rows = "".join(f"| {row.place} | {row.pin} | {row.port} | {row.role} |\n"
                   for row in board.pin_rows(machine, allotment))
    return f"| {board.name} | FPGA | machine | |\n| --- | --- | --- | --- |\n{rows}"
