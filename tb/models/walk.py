"""Models of the walk: lines and arcs by tick, and the gateware's pipeline by clock.

Positions are in steps. What a segment does tick by tick needs no clock: lines are computed at once,
for all steps, and the steps of an arc half turn by half turn.
"""

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["PathWalkModel", "PendingModel", "RatioModel", "Walked", "half_turns", "line_steps",
           "segment_steps", "steps_in", "turn_ticks"]

NO_CHANNEL = 3


@dataclass(frozen=True)
class Walked:
    """A segment, with the fields of :class:`fresa.motion.Segment`."""

    increment: Sequence[int] = (0, 0, 0)
    start: Sequence[int] = (128, 128, 128)
    end: Sequence[int] = (0, 0, 0)
    channel: Sequence[int] = (0, 1, 2)
    log2_ticks: int = 0
    arc: int = 0
    clockwise: int = 0
    turns: int = 0
    shift: int = 0
    x: int = 0
    y: int = 0
    residual: int = 0


def line_steps(start: int, increment: int, log2_ticks: int) -> NDArray:
    """Return the ticks of the steps of one channel, from 1, in one direction.

    After k ticks the position is ``start + k * increment / 2**log2_ticks``, in 1/256 step.
    """
    whole = abs(start + increment >> 8)
    numbers = np.arange(1, whole + 1)
    if (abs(increment) + 256).bit_length() + log2_ticks > 62:
        numbers = numbers.astype(object)
    if increment > 0:  # first k with start * S + k * increment >= number * 256 * S
        return -(-(((numbers << 8) - start) << log2_ticks) // increment)
    # first k with start * S + k * increment < (1 - number) * 256 * S
    return ((start + (numbers - 1 << 8)) << log2_ticks) // -increment + 1


def turn_ticks(turns: int, log2_ticks: int) -> Iterator[int]:
    """Yield the tick of each half turn, from 1: the first one has the first."""
    for turn in range(turns):
        yield (turn << log2_ticks) // turns + 1


def half_turns(x: Any, y: Any, shift: Any, clockwise: Any, turns: int) -> Iterator[tuple[int, Any]]:
    """Yield the channel that each half turn moves, 0 or 1, and how far, in 2**-44 step.

    Channel 1 is that of a counter-clockwise arc: a clockwise one is its mirror image. The numbers
    may be arrays, of many arcs.
    """
    x, y = x << 7, y << 7
    y = y ^ -clockwise
    for turn in range(turns):
        if turn % 2 == 0:
            yield 1, x
            amount = shift + (turn == 0)
            y = y + (x + (1 << amount - 1) >> amount)
        else:
            yield 0, ~y
            x = x - (y + (1 << shift - 1) >> shift)


class RatioModel:
    """Steps out of quarter steps, by the definition: the floor of a product."""

    def __init__(self, residual: int, fine: int, coarse: int) -> None:
        self.residual, self.fine, self.coarse = residual, fine, coarse
        self.quarters = self.place = 0

    def quarter(self, forward: int) -> int:
        """Make a quarter step; return the steps forward: -1, 0 or 1."""
        self.quarters += 1 if forward else -1
        place = (self.residual + self.quarters * self.coarse) // (4 * self.fine)
        step, self.place = place - self.place, place
        return step


class _ArcModel:
    """The channels u and v of an arc."""

    def __init__(self, segment: Walked, fine: int, coarse: int) -> None:
        self.ratio = RatioModel(segment.residual, fine, coarse)
        self.clockwise = segment.clockwise
        self.place = [segment.start[0] << 36, (32 - (segment.x >> 30)) % 256 << 36]
        self.turns = half_turns(segment.x, segment.y, segment.shift, segment.clockwise,
                                1 << 62)

    def turn(self) -> tuple[int, int]:
        """Make half a turn; return the channel, and its steps forward: -1, 0 or 1."""
        channel, distance = next(self.turns)
        before = self.place[channel]
        self.place[channel] = after = before + distance
        if channel == 0:
            return 0, (after >> 44) - (before >> 44)
        quarters = (after >> 42) - (before >> 42)
        if not quarters:
            return 1, 0
        return 1, self.ratio.quarter((quarters > 0) != self.clockwise)


def segment_steps(segment: Walked, fine: int = 1, coarse: int = 1) -> list[list[tuple[int, int]]]:
    """Return for each channel the ticks of its steps, from 1, with 1 for forward and -1 for back.

    Without corrective steps, which belong to axes.
    """
    steps: list[list[tuple[int, int]]] = [[], [], []]
    for channel in (2,) if segment.arc else (0, 1, 2):
        way = 1 if segment.increment[channel] > 0 else -1
        steps[channel] = [(int(tick), way) for tick in line_steps(
            segment.start[channel], segment.increment[channel], segment.log2_ticks)]
    if segment.arc:
        arc = _ArcModel(segment, fine, coarse)
        for tick in turn_ticks(segment.turns, segment.log2_ticks):
            channel, step = arc.turn()
            if step:
                steps[channel].append((tick, step))
    return steps


def steps_in(segment: Walked, ticks: int, fine: int = 1, coarse: int = 1) -> list[int]:
    """Return how many steps each axis makes in the first ticks, without corrective ones."""
    channels = [(start << 36) + (ticks * increment << 36 - segment.log2_ticks) >> 44
                for start, increment in zip(segment.start, segment.increment, strict=True)]
    if segment.arc:
        arc, channels[:2] = _ArcModel(segment, fine, coarse), [0, 0]
        for tick in turn_ticks(segment.turns, segment.log2_ticks):
            if tick > ticks:
                break
            channel, step = arc.turn()
            channels[channel] += step
    return [channels[channel] if channel != NO_CHANNEL else 0 for channel in segment.channel]


class PendingModel:
    """Requested position and position at the pins; the count is their difference."""

    def __init__(self, width: int) -> None:
        self.most = 1 << width - 1
        self.wanted = self.made = self.fault = 0

    def clock(self, *, step: int, direction: int, moved: int, rst: int = 0) -> dict[str, int]:
        """Advance one clock."""
        pending = self.wanted - self.made
        seen = {"driver_step": int(pending != 0), "driver_direction": int(pending >= 0),
                "pending": pending % (2 * self.most), "fault": self.fault}
        if rst:
            self.wanted = self.made = self.fault = 0
            return seen
        if moved:
            self.made += 1 if pending > 0 else -1
        if step:
            self.wanted += 1 if direction else -1
        if not -self.most <= self.wanted - self.made < self.most:
            self.wanted -= 1 if direction else -1
            self.fault = 1
        return seen


class PathWalkModel:
    """The pipeline, by the clocks in which things are due."""

    DELAY = 10

    def __init__(self) -> None:
        self.now = 0
        self.running = self.fault = 0
        self.prepared: int | None = None  # clock from which the next segment is
        self.free = 0  # clock from which the next one may be looked at
        self.taken = -1  # clock in which it is taken
        self.ticks = 0  # of the present segment
        self.turn_ticks: Iterator[int] = iter(())
        self.next_turn = 0
        self.queue: deque[tuple[int, Walked | None]] = deque()  # half turns and loads
        self.rotator_free = 0
        self.channels: dict[int, dict[int, int]] = {}  # clock, channel: step
        self.lines: dict[int, Walked] = {}  # changes, by clock
        self.places = [0, 0, 0]
        self.line = Walked()
        self.arc: _ArcModel | None = None
        self.delayed: set[int] = set()
        self.maps: dict[int, Walked] = {}
        self.map = Walked(channel=(NO_CHANNEL,) * 3)
        self.ends: dict[int, Sequence[int]] = {}
        self.counts = [0, 0, 0]
        self.due = [0, 0, 0]
        self.segment = Walked()
        self.active = -1  # last clock in which something is under way

    def clock(self, *, valid: int, segment: Walked, fine: int, coarse: int, tick: int, last: int
              ) -> dict[str, Any]:
        """Advance one clock."""
        now = self.now
        steps, directions = self._axes(now)
        seen = {"ready": self.running, "step": steps, "direction": directions,
                "fault": self.fault, "taken": int(self.taken == now),
                "busy": int(self.running or now <= self.active or steps != 0)}
        self._line(now)
        self._rotate(now, fine, coarse)
        ended = self._tick(now, tick, last)
        self._change(now, valid, segment, ended)
        self.now += 1
        return seen

    def _tick(self, now: int, tick: int, last: int) -> bool:
        if not tick:
            return False
        if not self.running:
            self.fault = 1
            return False
        self.ticks += 1
        while self.next_turn == self.ticks:
            self.queue.append((now + 2, None))
            self.next_turn = next(self.turn_ticks, 0)
        self.delayed.add(now + self.DELAY)
        self.active = max(self.active, now + self.DELAY)
        if last:
            self.ends[now + self.DELAY + 2] = self.segment.end
            self.active = now + self.DELAY + 2
            self.running = 0
        return bool(last)

    def _change(self, now: int, valid: int, segment: Walked, ended: bool) -> None:
        if self.prepared is None and now >= self.free and valid:
            self.prepared = now + 38 - segment.log2_ticks
        elif self.prepared is not None and now >= self.prepared and (ended or not self.running):
            self.segment, self.running, self.ticks = segment, 1, 0
            self.turn_ticks = turn_ticks(segment.turns, segment.log2_ticks)
            self.next_turn = next(self.turn_ticks, 0)
            self.queue.append((now + 2, segment))
            self.lines[now + self.DELAY] = segment
            self.maps[now + self.DELAY + 2] = segment
            self.taken = now + self.DELAY + 2
            self.active = max(self.active, self.taken)
            self.prepared, self.free = None, self.taken + 1

    def _line(self, now: int) -> None:
        if now in self.delayed:
            self.delayed.remove(now)
            for channel in (2,) if self.line.arc else (0, 1, 2):
                before = self.places[channel]
                self.places[channel] += self.line.increment[channel] << 36 - self.line.log2_ticks
                self._step(now + 1, channel, (self.places[channel] >> 44) - (before >> 44))
        if now in self.lines:
            self.line = self.lines.pop(now)
            self.places = [start << 36 for start in self.line.start]

    def _rotate(self, now: int, fine: int, coarse: int) -> None:
        if not self.queue or self.queue[0][0] > now or now < self.rotator_free:
            return
        _, loaded = self.queue.popleft()
        if loaded:
            self.arc = _ArcModel(loaded, fine, coarse)
            # Its channels are loaded later.
            self.rotator_free = next(clock for clock, line in self.lines.items()
                                     if line is loaded) + 1
            return
        assert self.arc
        channel, step = self.arc.turn()
        self._step(now + (3 if channel else 1), channel, step)
        self.rotator_free = now + 2

    def _step(self, clock: int, channel: int, step: int) -> None:
        if step:
            self.channels.setdefault(clock, {})[channel] = step

    def _axes(self, now: int) -> tuple[int, int]:
        """Return the steps of this clock and their directions, an axis a bit."""
        self.map = self.maps.pop(now, self.map)
        made, ends = self.channels.pop(now, {}), self.ends.pop(now, None)
        steps = directions = 0
        for axis, channel in enumerate(self.map.channel):
            step, corrective = made.get(channel, 0), 0 if made.get(channel) else self.due[axis]
            self.due[axis] -= corrective
            if ends is not None:
                self.due[axis] = (ends[axis] - self.counts[axis] + 1) % 4 - 1
                self.counts[axis] = ends[axis]
            self.counts[axis] += step
            steps |= bool(step or corrective) << axis
            directions |= (step or corrective) > 0 and 1 << axis
        return steps, directions
