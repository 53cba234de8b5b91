"""Simple movements, and the four counts."""

from amaranth import Module, Mux
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out, connect, flipped

from ..drive import valid_period
from .counter import StepCounter
from .order_control import OrderControl
from .orders import Move

__all__ = ["AutomaticControl"]


class AutomaticControl(wiring.Component):
    """Order control, the main counter, one counter an axis, and the choice of the count to show.

    *Control Automático* (thesis, 4.1.2). The thesis has the motor drivers in here, a second set in
    the manual control, and a multiplexer of coil words behind both. Here one set stands behind a
    multiplexer of step requests (:class:`NumericalController`): a change of mode cannot make a coil
    jump. So the requests leave by ``step``, and ``moved`` returns those that were granted; only
    these are counted, with the clock edge that moves the coils.

    The axis counters are the only register of the machine's position.

    Parameters
    ----------
    period : int
        Clocks from one step to the next.

    Members
    -------
    moves : In(stream.Signature(Move))
        Movements to make; ready exactly while at rest.
    step, direction : Out(3)
        Step requests.
    moved : In(3)
        Steps that are made in this clock.
    select : In(2)
        Count to show: 0 main, 1 X, 2 Y, 3 Z.
    shown : Out(16)
        That count.
    at_x, at_y, at_z : Out(16)
        Position in steps.
    fault : Out(1)
        A state register was upset.
    """

    moves: In(stream.Signature(Move))
    step: Out(3)
    direction: Out(3)
    moved: In(3)
    select: In(2)
    shown: Out(16)
    at_x: Out(16)
    at_y: Out(16)
    at_z: Out(16)
    fault: Out(1)

    def __init__(self, *, period: int) -> None:
        self.period = valid_period(period)
        super().__init__()

    def elaborate(self, platform) -> Module:
        m = Module()

        m.submodules.orders = orders = OrderControl(period=self.period)
        m.submodules.main = main = StepCounter()
        connect(m, flipped(self.moves), orders.moves)
        m.d.comb += [
            self.step.eq(orders.step),
            self.direction.eq(orders.direction),
            self.fault.eq(orders.fault),
            # Always up: how far the simple movement under way has come.
            main.step.eq(self.moved.any()),
            main.direction.eq(1),
            main.clear.eq(orders.clear),
            orders.count.eq(main.count),
        ]

        for index, (name, position) in enumerate(
            [("x", self.at_x), ("y", self.at_y), ("z", self.at_z)]):
            m.submodules[name] = counter = StepCounter()
            m.d.comb += [
                counter.step.eq(self.moved[index]),
                counter.direction.eq(orders.direction[index]),
                position.eq(counter.count),
            ]

        low, high = self.select
        m.d.comb += self.shown.eq(
            Mux(high, Mux(low, self.at_z, self.at_y), Mux(low, self.at_x, main.count)))
        return m
