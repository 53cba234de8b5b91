"""A point that hangs from two strings: from steps of its coordinates to lengths of the strings."""

from amaranth import Cat, Module, ResetInserter, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..drive.pending import PendingSteps
from .string_length import StringLength

__all__ = ["Hanging"]


class Hanging(wiring.Component):
    """Moves a point by ticks to the right and up, and keeps the lengths of its two strings.

    The strings run over pulleys at the upper corners of a wall. A tick is an eighth of a step of a
    string, so that the lengths, in whole steps, are within half a step of the true ones whenever
    ``busy`` is 0: see :class:`StringLength`. Both strings take a tick in the same clock, when
    neither of them has one to work on; others wait, and one back cancels one forward that waits.

    Parameters
    ----------
    width : int
        Ticks from one pulley to the other.
    first_across, first_below : int
        Where the point is at first, in ticks from the left pulley.
    bits : int
        Bits of places in ticks.

    Members
    -------
    step, direction : In(2)
        A tick, across and up; with these to the right, and up. Never beyond the pulleys, nor to
        where `bits` end.
    begin : In(1)
        Be where it is at first.
    drop : In(1)
        Forget ticks that wait.
    across, below : Out(bits)
        Where the point is, in ticks from the left pulley.
    lengths : Out(bits - TICKS_LOG2 + 1) x 2
        Of the left and the right string, in steps.
    busy : Out(1)
        A tick waits, or the lengths are not those of where the point is.
    fault : Out(1)
        More ticks were to wait than there is room for, and are lost. Stays until reset, ``begin``
        or ``drop``.

    Raises
    ------
    ValueError
        If a parameter is out of range.

    Source: thesis of the hanging plotter, part 2, whose lines are bowed: it reckons lengths at
    their ends alone.
    """

    def __init__(self, *, width: int, first_across: int, first_below: int, bits: int = 19) -> None:
        self.width = in_range("width in ticks", width, 1, (1 << bits) - 1)
        in_range("first_across", first_across, 0, width)
        in_range("first_below", first_below, 0, (1 << bits) - 1)
        self.strings = [
            StringLength(bits=bits, first_across=place, first_below=first_below)
            for place in (first_across, width - first_across)]
        length = self.strings[0].length.shape()
        super().__init__({
            "step": In(2), "direction": In(2), "begin": In(1), "drop": In(1),
            "across": Out(bits), "below": Out(bits), "lengths": Out(length).array(2),
            "busy": Out(1), "fault": Out(1)})

    def elaborate(self, platform) -> Module:
        m = Module()
        left, right = self.strings
        m.submodules.left, m.submodules.right = left, right
        works = Signal()
        waits, faults = [], []
        m.d.comb += works.eq(left.busy | right.busy)
        for way, name in enumerate(("across", "up")):
            pending = PendingSteps()
            m.submodules[f"pending_{name}"] = ResetInserter(self.begin | self.drop)(pending)
            forward = pending.driver_direction
            m.d.comb += [
                pending.step.eq(self.step[way]), pending.direction.eq(self.direction[way]),
                pending.moved.eq(pending.driver_step & ~works),
                left.tick[way].eq(pending.moved), right.tick[way].eq(pending.moved),
                left.away[way].eq(forward if way == 0 else ~forward),
                right.away[way].eq(~forward),
            ]
            waits.append(pending.driver_step)
            faults.append(pending.fault)
        m.d.comb += [
            left.begin.eq(self.begin), right.begin.eq(self.begin),
            self.across.eq(left.across), self.below.eq(left.below),
            self.lengths[0].eq(left.length), self.lengths[1].eq(right.length),
            self.busy.eq(works | Cat(waits).any() | self.step.any()),
            self.fault.eq(Cat(faults).any()),
        ]
        return m
