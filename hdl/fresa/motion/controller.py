"""Both modes, and one set of motors behind them."""

from amaranth import Module, Mux, ResetInserter, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out, connect

from ..drive import AxisDrivers, valid_period
from .automatic import AutomaticControl
from .manual import ManualControl
from .orders import Order
from .sequencer import MotionSequencer, valid_z_travel

__all__ = ["NumericalController"]


class NumericalController(wiring.Component):
    """Manual and automatic mode, and the multiplexer between them and the motors.

    *Módulo Principal* (thesis, 4.1.1). The multiplexer chooses whose step requests reach the one
    set of coil drivers, so that no change of mode, reset or stop can change a coil word by itself.
    In manual mode the automatic part is held in reset: its counters stay at 0, and where the tool
    is left is the origin.

    From ``stop`` on, in the same clock, no step reaches a driver, until reset. An upset state
    register of the automatic part has the same effect, but there manual mode is a reset.

    Parameters
    ----------
    period : int
        Least number of clocks between two steps of an axis, and exactly that within a movement.
    jog_period : int
        Clocks from one step request by hand to the next; with 1 the drivers' ``period`` sets the
        rate.
    z_travel : int
        Steps between the raised and the lowered tool.

    Members
    -------
    mode : In(1)
        0 manual, 1 automatic.
    order, start : In(Order), In(1)
        See :class:`MotionSequencer`.
    jog : In(6)
        See :class:`ManualControl`.
    stop : In(1)
        Make no step from here on, until reset.
    select : In(2)
        Count to show: 0 main, 1 X, 2 Y, 3 Z.
    ready, error : Out(1)
        See :class:`MotionSequencer`; never ready in manual mode or when stopped.
    axis_x, axis_y, axis_z : Out(4)
        Coil words.
    count : Out(16)
        The count chosen; 0 in manual mode.
    jogging : Out(3)
        Axes that are being moved by hand.

    Attributes
    ----------
    automatic : AutomaticControl
        The automatic part, which holds the position. Set by ``elaborate``.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    mode: In(1)
    order: In(Order)
    start: In(1)
    jog: In(6)
    stop: In(1)
    select: In(2)
    ready: Out(1)
    error: Out(1)
    axis_x: Out(4)
    axis_y: Out(4)
    axis_z: Out(4)
    count: Out(16)
    jogging: Out(3)

    def __init__(self, *, period: int, z_travel: int, jog_period: int = 1) -> None:
        self.period = valid_period(period)
        self.z_travel = valid_z_travel(z_travel)
        self.jog_period = valid_period(jog_period, name="jog_period")
        super().__init__()

    def elaborate(self, platform) -> Module:
        m = Module()

        m.submodules.drivers = drivers = AxisDrivers(period=self.period)
        m.submodules.manual = manual = ManualControl(period=self.jog_period)
        self.automatic = automatic = AutomaticControl(period=self.period)
        sequencer = MotionSequencer(z_travel=self.z_travel)
        m.submodules.automatic = ResetInserter(~self.mode)(automatic)
        m.submodules.sequencer = ResetInserter(~self.mode)(sequencer)

        stopped = Signal()
        hold = Signal()
        with m.If(self.stop):
            m.d.sync += stopped.eq(1)
        fault = sequencer.fault | automatic.fault
        m.d.comb += hold.eq(self.stop | stopped | fault)

        connect(m, sequencer.moves, automatic.moves)
        m.d.comb += [
            sequencer.order.eq(self.order),
            sequencer.start.eq(self.start),
            sequencer.hold.eq(hold | ~self.mode),
            sequencer.at_x.eq(automatic.at_x),
            sequencer.at_y.eq(automatic.at_y),
            sequencer.at_z.eq(automatic.at_z),
            self.ready.eq(sequencer.ready),
            self.error.eq(sequencer.error | fault),

            manual.enable.eq(~self.mode),
            manual.jog.eq(self.jog),
            self.jogging.eq(manual.active & (~hold).replicate(3)),

            drivers.step.eq(
                Mux(self.mode, automatic.step, manual.step) & (~hold).replicate(3)),
            drivers.direction.eq(Mux(self.mode, automatic.direction, manual.direction)),
            automatic.moved.eq(drivers.moved),
            self.axis_x.eq(drivers.axis_x),
            self.axis_y.eq(drivers.axis_y),
            self.axis_z.eq(drivers.axis_z),

            automatic.select.eq(self.select),
            self.count.eq(automatic.shown),
        ]

        return m
