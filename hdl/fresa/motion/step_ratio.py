"""Steps of one size out of steps of another."""

from amaranth import Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range

__all__ = ["StepRatio"]


class StepRatio(wiring.Component):
    """Makes steps of a coarser axis out of quarter steps of a finer one, without drift.

    A residual grows by ``coarse`` with a quarter step forward, and shrinks by it with one back;
    when it leaves the range from 0 to ``4 * fine`` a step is made, which brings it back into that
    range. So the steps are always the floor of the residual that was loaded and all quarter steps
    since, times ``coarse / (4 * fine)``: forward and back, nothing is rounded.

    A step comes two clocks after its quarter step. Reset changes nothing.

    Parameters
    ----------
    width : int
        Bits of the numbers of steps per metre.

    Members
    -------
    fine, coarse : In(width)
        Steps per metre: ``1 <= coarse <= fine``. They are kept while quarter steps come.
    load : In(1)
        Begin with a residual. Not with a quarter step, nor in the clock after one.
    residual : In(width + 2)
        Fraction of a step of the coarser axis, in parts of ``4 * fine``, below that.
    quarter : In(1)
        A quarter step of the finer axis. Not in two clocks in succession.
    forward : In(1)
        Its direction.
    step : Out(1)
        A step of the coarser axis.
    direction : Out(1)
        Its direction: 1 forward.

    Raises
    ------
    ValueError
        If ``width`` is not from 1 to 64.
    """

    def __init__(self, *, width: int = 27) -> None:
        self.width = in_range("width", width, 1, 64)
        super().__init__({
            "fine": In(self.width), "coarse": In(self.width), "load": In(1),
            "residual": In(self.width + 2), "quarter": In(1), "forward": In(1),
            "step": Out(1), "direction": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()

        # In the clock of a quarter step it is added; in the next one the residual is brought back.
        residual = Signal(signed(self.width + 4), reset_less=True)
        added = Signal(reset_less=True)
        below = Signal()
        outside = Signal()
        minus = Signal()
        term = Signal(signed(self.width + 4))
        total = Signal.like(residual)
        m.d.comb += [
            below.eq(residual[-1]),
            # Without a sign one below 0 is far above. It does not wait for the sum.
            outside.eq(added & (residual[2:] >= self.fine)),
            minus.eq(Mux(added, ~below, ~self.forward)),
            term.eq(Mux(added, self.fine << 2, self.coarse)),
            # The bit before them is the carry of a difference.
            total.eq(((residual << 1 | 1)
                      + ((term ^ minus.replicate(len(term))) << 1 | minus)) >> 1),
        ]
        step = Signal(reset_less=True)
        direction = Signal(reset_less=True)
        m.d.comb += [self.step.eq(step), self.direction.eq(direction)]
        m.d.sync += [
            added.eq(self.quarter),
            step.eq(outside),
            direction.eq(~below),
        ]
        with m.If(self.quarter | outside):
            m.d.sync += residual.eq(total)
        with m.If(self.load):
            m.d.sync += residual.eq(self.residual)

        return m
