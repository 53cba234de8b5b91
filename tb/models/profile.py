"""Model of the speed profile: granule by granule, to the clock of every tick."""

from bisect import bisect_right
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import isqrt

__all__ = ["Block", "Granule", "ProfileModel"]

MOST = 32
"""Most ticks of a granule."""

SAMPLED_NOMINAL, SAMPLED = 2, 6
"""Clocks from the decision to compute a granule to those in which nominal and exit are sampled."""


@dataclass(frozen=True)
class Block:
    """A part of a path, as the profile takes it."""

    energy: int
    modulus: int
    nominal: int
    log2_ticks: int


@dataclass
class Granule:
    """Ticks at one rate.

    Attributes
    ----------
    block : int
        Number of its block.
    decided, sampled, began : int
        Clocks: its computation is decided; the exit is sampled; it begins.
    phase, rate, step : int
        Phase at its begin, growth in a clock, and what a tick takes of it.
    size : int
        Number of ticks.
    first, last : bool
        The first and the last of its block.
    square : int
        Square of the speed at its end.
    ended : int
        Clock of its last tick.
    left : int
        Phase after that.
    """

    block: int
    decided: int
    sampled: int
    began: int
    phase: int
    rate: int
    step: int
    size: int
    first: bool
    last: bool
    square: int
    ended: int = 0
    left: int = 0

    def clock(self, tick: int) -> int:
        """Return the clock of a tick, from 1, where the rate is as the gateware demands."""
        return self.began - (self.phase - tick * self.step) // self.rate

    def clocks(self, backlog: int) -> list[int]:
        """Return the clocks of its ticks; a phase from `backlog` up is dropped with a tick.

        A tick's own clock adds nothing to the phase, and the next twice the rate: so no tick is
        in that.
        """
        phase, clock, made = self.phase, self.began, []
        for _ in range(self.size):
            phase += 2 * self.rate - self.step
            clock += 2
            if phase < 0:
                waits = -(phase // self.rate)
                phase += waits * self.rate
                clock += waits
            made.append(clock)
            if phase >= backlog:
                phase = 0
        self.ended, self.left = clock, phase
        return made

    def finish(self, backlog: int) -> None:
        """Find its end, without the ticks before where the rate allows."""
        if 2 * self.rate <= self.step and self.phase + self.rate < self.step:
            self.ended = self.clock(self.size)
            self.left = (self.phase + (self.ended - self.began) * self.rate
                         - self.size * self.step)
        else:
            self.clocks(backlog)


class ProfileModel:
    """The sequence of granules for a sequence of blocks.

    Parameters
    ----------
    blocks : sequence of (Block, int)
        Each with the clock from which it is offered, if the one before has been taken by then.
    exits : callable
        Highest square at the end of a block, given its number and a clock.
    holds : sequence of int
        Clocks in which hold changes, from 0.
    speed_bits, fraction_bits : int
        As of the gateware.
    nominals : callable, optional
        Square that is not exceeded, given the number of a block and a clock, if not that of the
        block.

    Attributes
    ----------
    taken : list of int
        Clocks in which blocks were taken.
    starved : list of int
        Clocks in which the speed was cut to 0.
    late : int
        Granules that began later than they should.
    """

    def __init__(self, blocks: Sequence[tuple[Block, int]], exits: Callable[[int, int], int],
                 holds: Sequence[int] = (), *, speed_bits: int = 31,
                 fraction_bits: int = 16,
                 nominals: Callable[[int, int], int] | None = None) -> None:
        self.blocks, self.exits, self.holds = blocks, exits, holds
        self.nominals = nominals or (lambda number, _: blocks[number][0].nominal)
        self.fraction_bits = fraction_bits
        self.backlog = 1 << speed_bits + fraction_bits + 1
        self.latency = 16 + speed_bits + fraction_bits
        self.taken: list[int] = []
        self.starved: list[int] = []
        self.late = 0

    def root(self, square: int) -> int:
        """Return the root, with its fraction."""
        return isqrt(square << 2 * self.fraction_bits)

    def _released(self, clock: int) -> int | None:
        """Return the first clock without hold from this one on."""
        place = bisect_right(self.holds, clock)
        if place % 2 == 0:
            return clock
        return self.holds[place] if place < len(self.holds) else None

    def granules(self, *, merge: bool = False) -> Iterator[Granule]:
        """Return all granules in their order, up to the last that nothing keeps from coming.

        Parameters
        ----------
        merge : bool
            Return granules of one size, at the nominal speed, as one: the clocks of their ticks are
            the same. There must be no hold then, and exits must not change.
        """
        square = root = before = rate = brake = ticks = done = 0
        decided, ended, phase, number = 0, -1, 0, -1
        block = Block(0, 0, 0, 0)
        while True:
            # When it is decided, and of which block it is
            opens = ticks == done
            if opens:
                number += 1
                if number == len(self.blocks):
                    if square:
                        self.starved.append(ended + 1)
                    return
                block, offered = self.blocks[number]
                if self.taken:
                    offered = max(offered, self.taken[-1] + 1)
                if offered > ended + 1 and square:
                    self.starved.append(ended + 1)
                    square = root = 0
                decided = max(decided, offered + 2 + block.log2_ticks)
            if not square:
                released = self._released(decided - 1)
                if released is None:
                    return
                decided = released + 1
            if opens:
                self.taken.append(decided + 1)
                ticks, done, brake = 1 << block.log2_ticks, 0, block.energy << block.log2_ticks
            hold = bisect_right(self.holds, decided - 1) % 2

            size, least = 1, block.modulus
            if square:
                while size < MOST and least * size < 64 * root and not (ticks - done) & size:
                    size *= 2
            change = block.energy * size
            sampled = decided + SAMPLED
            goal = 0 if hold else min(self.nominals(number, decided + SAMPLED_NOMINAL),
                                      self.exits(number, sampled) + brake - change)
            goal = min(max(goal, square - change), square + change)
            latency = self.latency
            if hold and 0 < square < change:  # an eighth of a root, in three clocks less
                new, latency = self.root(change // 2) >> 3, latency - 3
            else:
                new = self.root(goal if square or goal else change // 2)

            began = max(ended, decided + latency)
            if began == ended + 1:
                began += 1  # what a tick's clock does not add to the phase comes in the next
            going = ended == began
            self.late += not going and square > 0
            step = 2 * block.modulus
            count = 1
            if merge and goal == square == block.nominal and new == root == before and (
                    going and least * size >= 64 * root):
                count = min(brake, self.exits(number, sampled) + brake - goal) // change
            if not square:
                before = phase = 0
            elif not going:  # it has gone on at the rate of the granule before
                phase += (began - ended) * rate
                if phase >= self.backlog:
                    phase = 0
            granule = Granule(
                number, decided, sampled, began, phase=phase + (new - before >> 1),
                rate=root + new, step=step, size=count * size, first=opens,
                last=done + count * size == ticks, square=goal)
            granule.finish(self.backlog)
            yield granule

            before, root = root, new if goal else 0
            square, rate = goal, granule.rate
            brake, done = brake - count * change, done + count * size
            decided, ended, phase = granule.began, granule.ended, granule.left
            if count > 1:
                decided = granule.clock(granule.size - size)

    def ticks(self) -> Iterator[tuple[int, Granule]]:
        """Return the clock of each tick, and its granule."""
        for granule in self.granules():
            for clock in granule.clocks(self.backlog):
                yield clock, granule
