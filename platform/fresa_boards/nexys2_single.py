"""`single` on a Nexys 2."""

from collections.abc import Mapping

from amaranth import Cat, Elaboratable, Module
from amaranth.build import Attrs, Pins, Resource
from amaranth.lib import io

from fresa.machines import Single
from fresa.panel import Debouncer, SevenSegment

from .nexys2 import display_segments, request_ports
from .nexys2_common import drive_pins, synchronize, wire_clock

__all__ = ["Nexys2Single", "single_ports"]


def single_ports(platform) -> dict:
    """Request the pins of `single` from a Nexys 2, under the names of :class:`Nexys2Single`.

    The coil word goes to JA1 to JA4, with bit 0 on JA1, and the enable of the bridge to JA7.
    """
    platform.add_resources([
        Resource(name, 0, Pins(pins, dir="o", conn=("pmod", 0)), Attrs(IOSTANDARD="LVCMOS33"))
        for name, pins in [("coils", "1 2 3 4"), ("bridge", "7")]
    ])
    ports = request_ports(platform, {
        "clk": "clk50",
        "button": ("button", 0),
        "serial": "uart",
        "leds": [("led", index) for index in range(8)],
        "digits": "display_7seg_an",
        "segments": "display_7seg",
        "coils": "coils",
        "bridge": "bridge",
    })
    serial = ports.pop("serial")
    return {**ports, "rx": serial.rx, "tx": serial.tx,
            "segments": display_segments(ports["segments"])}


class Nexys2Single(Elaboratable):
    """The machine, and the pins of a Nexys 2 around it.

    It requests no pin: it is given ports, of a board or of a simulation.

    ============  ==============================================================
    RS-232        the terminal
    BTN0          reset: this place is 0, power is on
    JA1 to JA4    coil word
    JA7           enable of the bridge
    LD0 to LD3    coil word
    LD5           it is on its way to the set-point
    LD6           a state register was upset: no step until reset
    LD7           the motor has power
    display       position, hexadecimal
    ============  ==============================================================

    Every input goes through two flip-flops, the button also through a debouncer. Coils, enable
    and line come from flip-flops in their I/O blocks, a clock after the machine's own. Until the
    first clock the motor has no power.

    Parameters
    ----------
    ports : mapping of str to PortLike
        ``clk``; inputs ``button`` and ``rx``; outputs ``tx``, ``leds`` (8), ``segments`` (8: a to
        g, point) and ``digits`` (4), which light with 1 or are declared inverted, ``coils`` (4)
        and ``bridge``.
    machine : Single
        What to wire.
    debounce : int
        Clocks for which the button must be still.
    scan_bits : int
        See :class:`SevenSegment`.
    """

    def __init__(self, ports: Mapping[str, io.PortLike], *, machine: Single, debounce: int,
                 scan_bits: int) -> None:
        self._ports = ports
        self._machine = machine
        self._debouncer = Debouncer(width=1, period=debounce)
        self._display = SevenSegment(scan_bits=scan_bits)

    def elaborate(self, platform) -> Module:
        m = Module()
        ports = self._ports

        # What comes in
        m.submodules.machine = machine = self._machine
        m.submodules.debouncer = debouncer = self._debouncer
        synchronize(m, "button", ports["button"], debouncer.i)
        synchronize(m, "rx", ports["rx"], machine.rx, init=1)
        wire_clock(m, ports, debouncer.o)

        # What people see
        m.submodules.display = display = self._display
        m.submodules.leds = leds = io.Buffer("o", ports["leds"])
        m.submodules.segments = segments = io.Buffer("o", ~ports["segments"])
        m.submodules.digits = digits = io.Buffer("o", ~ports["digits"])
        m.d.comb += [
            display.value.eq(machine.position),
            display.enable.eq(1),
            segments.o.eq(display.segments),
            digits.o.eq(display.digits),
            leds.o.eq(Cat(machine.coils, 0, machine.moving, machine.fault, machine.enable)),
        ]

        # What motor and terminal feel
        for name, value, idle in [("coils", machine.coils, 0), ("bridge", machine.enable, 0),
                                  ("tx", machine.tx, 1)]:
            drive_pins(m, name, ports[name], value, init=idle)

        return m
