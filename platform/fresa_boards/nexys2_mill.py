"""The mill on a Nexys 2."""

from collections.abc import Mapping
from fractions import Fraction
from math import ceil
from typing import TypeAlias

from amaranth import (
    Cat,
    ClockDomain,
    ClockSignal,
    Elaboratable,
    Module,
    ResetInserter,
    ResetSignal,
    Signal,
    Value,
)
from amaranth.build import Attrs, Pins, Resource
from amaranth.lib import io
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import connect

from fresa.drive import FULL_STEP, MAX_PERIOD
from fresa.machines.mill import CLOCK, Z_TRAVEL, Mill, MillPace
from fresa.motion import CoordinateGenerator, SerialOrders, SquareGenerator, StartHandshake
from fresa.panel import Debouncer

from .nexys2 import display_segments, request_ports

__all__ = ["BAUD", "DEBOUNCE", "Nexys2Mill", "OrderSource", "debounce_period", "mill_ports"]

BAUD = 9_600
"""Bits a second of the line that orders come over: one and its answer take 70 ms, a pixel 1.3 s."""

OrderSource: TypeAlias = CoordinateGenerator | SquareGenerator | SerialOrders
"""Where the orders of a mill may come from."""

DEBOUNCE = Fraction(1, 100)
"""Time for which a contact must be still, in seconds."""


def debounce_period(seconds: Fraction | float = DEBOUNCE, clock: int = CLOCK) -> int:
    """Clocks in `seconds`, one more rather than one less.

    Raises
    ------
    ValueError
        If it takes no clock, or more than a debouncer counts.
    """
    if not 0 < seconds * clock <= MAX_PERIOD:
        raise ValueError(f"debounce time must be over 0 and at most {MAX_PERIOD / clock:g} s, "
                         f"not {seconds!r}")
    return ceil(Fraction(seconds) * clock)


def mill_ports(platform, *, serial: bool = False) -> dict:
    """Request the pins of the mill from a Nexys 2, under the names that :class:`Nexys2Mill` knows.

    The coil words go to the Pmod connectors with bit 0, YELLOW, on the lowest pin: X on JA1 to JA4,
    Y on JA7 to JA10, Z on JB1 to JB4. With `serial` the pins of the RS-232 port are among them.
    """
    platform.add_resources([
        Resource("coils", index, Pins(pins, dir="o", conn=("pmod", pmod)),
                 Attrs(IOSTANDARD="LVCMOS33"))
        for index, (pmod, pins) in enumerate([(0, "1 2 3 4"), (0, "7 8 9 10"), (1, "1 2 3 4")])
    ])
    ports = request_ports(platform, {
        "clk": "clk50",
        "switches": [("switch", index) for index in range(8)],
        "buttons": [("button", index) for index in range(4)],
        "leds": [("led", index) for index in range(8)],
        "digits": "display_7seg_an",
        "segments": "display_7seg",
        **{f"axis_{name}": ("coils", index) for index, name in enumerate("xyz")},
    })
    if serial:
        line = request_ports(platform, {"line": "uart"})["line"]
        ports |= {"rx": line.rx, "tx": line.tx}
    return {**ports, "segments": display_segments(ports["segments"])}


class Nexys2Mill(Elaboratable):
    """The mill, an order source, and the pins of a Nexys 2 between them.

    It requests no pin: it is given ports, of a board or of a simulation.

    ===============  ==============================================================
    SW7              0 manual, 1 automatic
    SW0 to SW5       manual: jog x up, x down, y up, y down, z up, z down
    SW0, SW1         automatic: the count to show, 0 main, 1 X, 2 Y, 3 Z
    BTN0             reset
    BTN1             automatic: starts the order source, unless that is the RS-232 port
    BTN3             stop: no step until reset; an upset state register of the source does so too
    LD0 to LD3       manual: coil word
    LD5              the order source is at work
    LD6, LD7         error, ready
    display          automatic: the count chosen
    ===============  ==============================================================

    Every input goes through two flip-flops and a debouncer. Every coil comes from a flip-flop in
    its I/O block, a clock after the machine's own. (``io.FFBuffer`` would do that too, but powers
    up at 0, which is no word of the coil table.) In manual mode the order source is held in reset,
    as the automatic part of the machine is; the RS-232 port is told, and goes on to answer.

    Parameters
    ----------
    ports : mapping of str to PortLike
        ``clk``; inputs ``switches`` (8) and ``buttons`` (4), active high; outputs ``leds`` (8),
        active high; ``segments`` (8: a to g, point) and ``digits`` (4), which light with 1 or are
        declared inverted; ``axis_x``, ``axis_y``, ``axis_z`` (4 each). With `SerialOrders` also
        ``rx`` and ``tx``.
    source : CoordinateGenerator, SquareGenerator or SerialOrders
        What to do when BTN1 is pressed; or where orders come from.
    pace : MillPace
        See :class:`Mill`.
    debounce : int
        Clocks for which a contact must be still.
    z_travel : int
        See :class:`Mill`.
    guard : bool
        See :class:`Mill`. It guards the machine, not the order source.
    """

    def __init__(
        self, ports: Mapping[str, io.PortLike], *, source: OrderSource,
        pace: MillPace | None = None, debounce: int | None = None, z_travel: int = Z_TRAVEL,
        guard: bool = False,
    ) -> None:
        self._ports = ports
        self._source = source
        self._mill = Mill(pace=pace, z_travel=z_travel, guard=guard)
        self._debouncer = Debouncer(
            width=12, period=debounce_period() if debounce is None else debounce)

    def elaborate(self, platform) -> Module:
        m = Module()
        ports = self._ports

        m.domains.sync = ClockDomain()
        m.submodules.clk = clk = io.Buffer("i", ports["clk"])
        m.d.comb += ClockSignal().eq(clk.i)

        # What people do
        m.submodules.switches = switches = io.Buffer("i", ports["switches"])
        m.submodules.buttons = buttons = io.Buffer("i", ports["buttons"])
        m.submodules.debouncer = debouncer = self._debouncer
        m.submodules.synchronizer = FFSynchronizer(Cat(switches.i, buttons.i), debouncer.i)
        switch, button = debouncer.o[:8], debouncer.o[8:]
        reset, begin, stop = button[0], button[1], button[3]
        automatic = switch[7]
        began = Signal(reset_less=True)
        m.d.sync += began.eq(begin)
        m.d.comb += ResetSignal().eq(reset)

        # The machine, and where its orders come from
        m.submodules.mill = mill = self._mill
        source = self._source
        m.submodules.handshake = ResetInserter(~automatic)(handshake := StartHandshake())
        fault = source.fault | handshake.fault
        if isinstance(source, SerialOrders):
            m.submodules.source = source
            self._wire_line(m, source, automatic, mill.error | fault, stop | fault)
        else:
            m.submodules.source = ResetInserter(~automatic)(source)
            m.d.comb += source.start.eq(begin & ~began)
        connect(m, source.orders, handshake.orders)
        m.d.comb += [
            mill.position_x.eq(handshake.order.x),
            mill.position_y.eq(handshake.order.y),
            mill.up.eq(handshake.order.up),
            mill.down.eq(handshake.order.down),
            mill.start.eq(handshake.start),
            handshake.ready.eq(mill.ready),
            handshake.error.eq(mill.error),
            mill.mode.eq(automatic),
            mill.jog.eq(switch[:6]),
            mill.counter_select.eq(switch[:2]),
            mill.stop.eq(stop | fault),
        ]

        # What people see
        m.submodules.leds = leds = io.Buffer("o", ports["leds"])
        m.submodules.segments = segments = io.Buffer("o", ~ports["segments"])
        m.submodules.digits = digits = io.Buffer("o", ~ports["digits"])
        m.d.comb += [
            leds.o.eq(Cat(mill.leds, 0, source.busy,
                          mill.error | fault, mill.ready)),
            segments.o.eq(mill.segments),
            digits.o.eq(mill.digits),
        ]

        # What the motors feel
        for name in ("axis_x", "axis_y", "axis_z"):
            m.submodules[name] = coils = io.Buffer("o", ports[name])
            pins = Signal(4, name=f"{name}_pins", init=FULL_STEP[0], reset_less=True,
                          attrs={"IOB": "TRUE"})
            m.d.sync += pins.eq(getattr(mill, name))
            m.d.comb += coils.o.eq(pins)

        return m

    def _wire_line(self, m: Module, source: SerialOrders, automatic: Value, error: Value,
                   stop: Value) -> None:
        """Join the RS-232 port to the source, and tell it how the machine is."""
        m.submodules.rx = rx = io.Buffer("i", self._ports["rx"])
        m.submodules.tx = tx = io.Buffer("o", self._ports["tx"])
        m.submodules.rx_synchronizer = FFSynchronizer(rx.i, source.rx, init=1)
        stopped = Signal()
        with m.If(stop):
            m.d.sync += stopped.eq(1)
        m.d.comb += [
            tx.o.eq(source.tx),
            source.enable.eq(automatic),
            source.error.eq(error),
            source.stopped.eq(stop | stopped),
        ]
