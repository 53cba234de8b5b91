"""The mill as people run it: with switches, buttons, and where its orders come from."""

from typing import TypeAlias

from amaranth import Module, ResetInserter, Signal
from amaranth.lib.wiring import In, Out, Signature, connect

from ..drive import FULL_STEP
from ..motion import CoordinateGenerator, SquareGenerator, StartHandshake
from ..panel import GlitchFilter
from ..roles import BUTTON, COILS, DIGITS, RX, SEGMENTS, STATUS, STOP, SWITCH, TX, MachineComponent
from .mill import Z_TRAVEL, Mill, MillTiming
from .serial_orders import SerialOrders

__all__ = ["MillStation", "OrderSource"]

OrderSource: TypeAlias = CoordinateGenerator | SquareGenerator | SerialOrders
"""Where the orders of a mill may come from. Over RS-232, at 9600 baud, an order and its answer take
70 ms; a pixel takes 1.3 s."""

_COILS = COILS.resting(FULL_STEP[0])


class MillStation(MachineComponent):
    """The mill and an order source.

    All inputs are synchronous to the clock, and all but ``stop`` are clean. In manual mode the
    order source is held in reset, as the automatic part of the mill is; `SerialOrders` are not, as
    they go on to answer.

    Parameters
    ----------
    source : CoordinateGenerator, SquareGenerator or SerialOrders
        What to do when ``start`` is pressed; or where orders come from.
    timing, z_travel, guard
        See :class:`Mill`. The guard is for the mill, not for the order source.

    Members
    -------
    automatic : In(1)
        0 manual, 1 automatic mode.
    jog : In(6)
        Manual: x up, x down, y up, y down, z up, z down from bit 0. Automatic: bits 0 and 1 are the
        count to show, 0 main, 1 X, 2 Y, 3 Z.
    start : In(1)
        Automatic: where it rises, the order source starts. `SerialOrders` are not started.
    stop : In(1)
        May bounce: see :class:`GlitchFilter`. When it has been high for the timing's
        ``stop_period`` there is no step from the next clock on, until reset. A fault of the source
        stops the mill at once.
    axis_x, axis_y, axis_z : Out(4)
        Coil words.
    leds : Out(4)
        Coil word of the axis that is jogged.
    busy : Out(1)
        The order source is at work.
    error, ready : Out(1)
        See :class:`Mill`; a fault of the source is an error, too, until reset.
    segments, digits : Out(8), Out(4)
        The display, active low: in automatic mode the count chosen.
    rx, tx : In(1), Out(1)
        The line of `SerialOrders`; without them there is none.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, source: OrderSource, timing: MillTiming | None = None,
                 z_travel: int = Z_TRAVEL, guard: bool = False) -> None:
        self._source = source
        timing = timing or MillTiming.real()
        self._mill = Mill(timing=timing, z_travel=z_travel, guard=guard)
        self._stop_filter = GlitchFilter(period=timing.stop_period)
        pins = {
            "automatic": (In(1), SWITCH), "jog": (In(6), SWITCH),
            "start": (In(1), BUTTON), "stop": (In(1), STOP),
            "axis_x": (Out(4), _COILS), "axis_y": (Out(4), _COILS), "axis_z": (Out(4), _COILS),
            "leds": (Out(4), STATUS), "busy": (Out(1), STATUS), "error": (Out(1), STATUS),
            "ready": (Out(1), STATUS), "segments": (Out(8), SEGMENTS), "digits": (Out(4), DIGITS),
        }
        if isinstance(source, SerialOrders):
            pins |= {"rx": (In(1), RX), "tx": (Out(1), TX)}
        self.roles = {port: role for port, (_, role) in pins.items()}
        super().__init__(Signature({port: member for port, (member, _) in pins.items()}))

    def elaborate(self, platform) -> Module:
        m = Module()

        m.submodules.mill = mill = self._mill
        m.submodules.stop_filter = stop_filter = self._stop_filter
        m.submodules.handshake = ResetInserter(~self.automatic)(handshake := StartHandshake())
        source = self._source
        # Manual mode resets both, and leaves the mill stopped: the error shows as long.
        failed = Signal()
        fault = source.fault | handshake.fault | failed
        m.d.sync += failed.eq(fault)
        stop = stop_filter.o | fault
        if isinstance(source, SerialOrders):
            m.submodules.source = source
            stopped = Signal()
            with m.If(stop):
                m.d.sync += stopped.eq(1)
            m.d.comb += [
                source.rx.eq(self.rx),
                self.tx.eq(source.tx),
                source.enable.eq(self.automatic),
                source.error.eq(self.error),
                source.stopped.eq(stop | stopped),
            ]
        else:
            m.submodules.source = ResetInserter(~self.automatic)(source)
            # A button that is held while the machine is reset does not start it.
            began = Signal(reset_less=True)
            m.d.sync += began.eq(self.start)
            m.d.comb += source.start.eq(self.start & ~began)
        connect(m, source.orders, handshake.orders)
        m.d.comb += [
            mill.position_x.eq(handshake.order.x),
            mill.position_y.eq(handshake.order.y),
            mill.up.eq(handshake.order.up),
            mill.down.eq(handshake.order.down),
            mill.start.eq(handshake.start),
            handshake.ready.eq(mill.ready),
            handshake.error.eq(mill.error),
            mill.mode.eq(self.automatic),
            mill.jog.eq(self.jog),
            mill.counter_select.eq(self.jog[:2]),
            stop_filter.i.eq(self.stop),
            mill.stop.eq(stop),

            self.axis_x.eq(mill.axis_x),
            self.axis_y.eq(mill.axis_y),
            self.axis_z.eq(mill.axis_z),
            self.leds.eq(mill.leds),
            self.busy.eq(source.busy),
            self.error.eq(mill.error | fault),
            self.ready.eq(mill.ready),
            self.segments.eq(mill.segments),
            self.digits.eq(mill.digits),
        ]

        return m
