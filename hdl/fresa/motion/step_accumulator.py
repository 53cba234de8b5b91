"""The fraction of a step of one channel of a walk."""

from amaranth import Cat, Const, Module, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..choice import add_choice

__all__ = ["StepAccumulator"]


class StepAccumulator(wiring.Component):
    """Adds up parts of a step, and gives a step where the sum passes a whole number.

    It holds the fraction of a step of position + 1/2, so that steps are those of the rounded
    position. What is added is less than a step, so that there is one step at most, and it is that
    of the direction of what is added. Nothing is rounded. Reset changes nothing.

    Parameters
    ----------
    width : int
        Bits of the fraction, from 8.

    Members
    -------
    load : In(1)
        Begin with another fraction; what is added in the same clock is added to the old one, and
        its step comes.
    start : In(8)
        The upper bits of that fraction; zeros follow.
    add : In(1)
        Add.
    term : In(signed(width + 1))
        What is added, in 2**-width steps.
    step, quarter : Out(1)
        A clock later: a whole number of steps was passed; a whole number of quarter steps, if what
        is added is less than one.
    direction : Out(1)
        With these: 1 forward.

    Raises
    ------
    ValueError
        If ``width`` is not from 8 to 64.
    """

    def __init__(self, *, width: int = 44) -> None:
        self.width = in_range("width", width, 8, 64)
        super().__init__({
            "load": In(1), "start": In(8), "add": In(1), "term": In(signed(self.width + 1)),
            "step": Out(1), "quarter": Out(1), "direction": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()

        fraction = Signal(self.width, reset_less=True)
        total = Signal(self.width + 1)
        m.d.comb += total.eq(add_choice(fraction, self.term))
        step, quarter, direction = (
            Signal(name=name, reset_less=True) for name in ("passed", "passed_quarter", "forward"))
        m.d.comb += [self.step.eq(step), self.quarter.eq(quarter), self.direction.eq(direction)]
        m.d.sync += [
            # The bit above the fraction is the carry, or with a negative term the lack of one.
            step.eq(self.add & total[-1]),
            quarter.eq(self.add & (total[self.width - 2] != fraction[self.width - 2])),
            direction.eq(self.term[-1] == 0),
        ]
        with m.If(self.add):
            m.d.sync += fraction.eq(total)
        with m.If(self.load):
            m.d.sync += fraction.eq(Cat(Const(0, self.width - 8), self.start))

        return m
