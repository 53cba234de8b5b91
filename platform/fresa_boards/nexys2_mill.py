"""The mill on a Nexys 2."""

from collections.abc import Mapping
from typing import TypeAlias

from amaranth import (
    Cat,
    Elaboratable,
    Module,
    ResetInserter,
    Signal,
    Value,
)
from amaranth.build import Attrs, Pins, Resource
from amaranth.lib import io
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import connect

from fresa.drive import FULL_STEP
from fresa.machines import SerialOrders
from fresa.machines.mill import Z_TRAVEL, Mill, MillTiming
from fresa.motion import CoordinateGenerator, SquareGenerator, StartHandshake
from fresa.panel import Debouncer

from .nexys2 import display_segments, request_ports
from .nexys2_common import debounce_period, drive_pins, synchronize, wire_clock

__all__ = ["Nexys2Mill", "OrderSource", "mill_ports"]

OrderSource: TypeAlias = CoordinateGenerator | SquareGenerator | SerialOrders
"""Where the orders of a mill may come from. Over RS-232, at 9600 baud, an order and its answer take
70 ms; a pixel takes 1.3 s."""

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
    its I/O block, a clock after the machine's own; so does what the RS-232 port sends. In manual
    mode the order source is held in reset, as the automatic part of the machine is; the RS-232 port
    is told, and goes on to answer.

    Parameters
    ----------
    ports : mapping of str to PortLike
        ``clk``; inputs ``switches`` (8) and ``buttons`` (4), active high; outputs ``leds`` (8),
        active high; ``segments`` (8: a to g, point) and ``digits`` (4), which light with 1 or are
        declared inverted; ``axis_x``, ``axis_y``, ``axis_z`` (4 each). With `SerialOrders` also
        ``rx`` and ``tx``.
    source : CoordinateGenerator, SquareGenerator or SerialOrders
        What to do when BTN1 is pressed; or where orders come from.
    timing : MillPace
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
        timing: MillTiming | None = None, debounce: int | None = None, z_travel: int = Z_TRAVEL,
        guard: bool = False,
    ) -> None:
        self._ports = ports
        self._source = source
        self._mill = Mill(timing=timing, z_travel=z_travel, guard=guard)
        self._debouncer = Debouncer(
            width=12, period=debounce_period() if debounce is None else debounce)

    def elaborate(self, platform) -> Module:
        m = Module()
        ports = self._ports

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
        wire_clock(m, ports, reset)

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
            drive_pins(m, name, ports[name], getattr(mill, name), init=FULL_STEP[0])

        return m

    def _wire_line(self, m: Module, source: SerialOrders, automatic: Value, error: Value,
                   stop: Value) -> None:
        """Join the RS-232 port to the source, and tell it how the machine is."""
        synchronize(m, "rx", self._ports["rx"], source.rx, init=1)
        drive_pins(m, "tx", self._ports["tx"], source.tx, init=1)
        stopped = Signal()
        with m.If(stop):
            m.d.sync += stopped.eq(1)
        m.d.comb += [
            source.enable.eq(automatic),
            source.error.eq(error),
            source.stopped.eq(stop | stopped),
        ]
