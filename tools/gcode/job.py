"""A job: a program that was run, and what the pins made of it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import ceil
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fresa.machines.gcode import AXES, GCodeSettings

from .path import Follower, Point, Segment
from .simulation import Simulation, Steps

__all__ = ["Deviation", "Job", "Motion", "asked_steps", "run"]

WINDOW_S = 0.01
"""Seconds over which a speed is the mean."""

SAMPLE_S = 0.0005
MOST_SAMPLES = 1 << 18

REST = 3
"""An axis rests between two steps that are so many times as far apart as those around them."""

SHORT_S = 0.01
"""Seconds that a step takes of which there is no other to compare it with."""


MOST_OFF, MOST_LEFT = 1.5, 2
"""Steps that a right job is off its path at most, where each axis is at its nearest step, and that
it leaves out at the end."""


class Deviation(NamedTuple):
    """How far the pins were from the path at most, in mm, and where; what of it they followed."""

    distance: float
    where: Point
    followed: float


@dataclass(frozen=True)
class Motion:
    """The path of the pins over time, in equal intervals.

    Attributes
    ----------
    time : array, shape (n,)
        Seconds from the begin of the job.
    place : array, shape (n, 3)
        Where the motors are then, in mm.
    speed, acceleration : array, shape (n,)
        Along the path, in mm/s and mm/s²: means over `WINDOW_S`.
    length : float
        Of the path, in mm.
    """

    time: NDArray[np.float64]
    place: NDArray[np.float64]
    speed: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    length: float


@dataclass(frozen=True)
class Job:
    """A program that was run.

    Attributes
    ----------
    lines : int
        How many it has, without empty ones.
    segments : list of Segment
        The path that it asks for.
    settings : GCodeSettings
        Of the machine.
    steps : Steps
        What came out of the pins.
    begin, seconds : float
        When the first line was sent, in seconds, and how long the job took.
    pauses : int
        How often M0 was ended at once.
    apart : int
        Steps that one motor of an axis with two has made without the other one, or another way.
    """

    lines: int
    segments: Sequence[Segment]
    settings: GCodeSettings
    steps: Steps
    begin: float
    seconds: float
    pauses: int
    apart: int = 0

    @property
    def per_mm(self) -> NDArray[np.float64]:
        """Steps per mm of each axis."""
        return np.array([float(each) for each in self.settings.steps_per_mm])

    def deviation(self, progress: Callable[[int], None] = lambda done: None) -> Deviation:
        """Return how far the pins were from the path.

        Parameters
        ----------
        progress : callable
            Called repeatedly with the rows of steps looked at since the last call.
        """
        per_mm = self.per_mm
        follower = Follower(self.segments, float((1 / per_mm).max()))
        worst, where, chunk = 0.0, (0.0, 0.0, 0.0), 1 << 14
        positions = self.steps.positions()
        for start in range(0, len(positions), chunk):
            points = positions[start:start + chunk] / per_mm
            for point in map(tuple, points.tolist()):
                distance = follower.distance(point)
                if distance > worst:
                    worst, where = distance, point
            progress(len(points))
        return Deviation(worst, where, follower.done)

    def motion(self) -> Motion:
        """Return speed and acceleration, from the times of the steps."""
        time = (self.steps.clock / self.settings.clock) - self.begin
        count = min(max(2, ceil(self.seconds / SAMPLE_S)), MOST_SAMPLES)
        at = np.linspace(0, self.seconds, count + 1)
        place = np.stack([
            np.interp(at, *_knots(time[rows], self.steps.change[rows, axis])) / self.per_mm[axis]
            for axis in range(AXES) for rows in [np.flatnonzero(self.steps.change[:, axis])]],
            axis=1)
        interval = self.seconds / count
        parts = np.sqrt((np.diff(place, axis=0) ** 2).sum(axis=1))
        length = np.concatenate([[0], parts.cumsum()])
        wide = max(interval, WINDOW_S)
        speed = _slope(at, length, wide)
        return Motion(at, place, speed, _slope(at, speed, wide), float(length[-1]))

    def facts(self, motion: Motion, deviation: Deviation) -> dict[str, Any]:
        """Return the figures for JSON, given what is slow to compute."""
        asked = sum(each.length for each in self.segments)
        end = np.array(self.steps.end) / self.per_mm
        moved = [steps for steps, made in zip(
            self.per_mm.tolist(), self.steps.made, strict=True) if made]
        coarsest = 1 / min(moved or self.per_mm.tolist())
        return {
            "right": (deviation.distance < MOST_OFF * coarsest and not self.apart
                      and asked - deviation.followed < MOST_LEFT * coarsest),
            "lines": self.lines,
            "segments": len(self.segments),
            "seconds": round(self.seconds, 4),
            "clock": self.settings.clock,
            "asked_mm": round(asked, 4),
            "made_mm": round(motion.length, 4),
            "top_speed_mm_min": round(float(motion.speed.max()) * 60, 1),
            "steps": dict(zip("xyz", self.steps.made, strict=True)),
            "followed_mm": round(deviation.followed, 4),
            "deviation_mm": round(deviation.distance, 6),
            "deviation_steps": round(deviation.distance / coarsest, 3),
            "deviation_at_mm": [round(each, 4) for each in deviation.where],
            "end_steps": list(self.steps.end),
            "end_mm": [round(float(each), 4) for each in end],
            "pauses": self.pauses,
            **({"second_motor": self.settings.second_motor, "steps_apart": self.apart}
               if self.settings.second_motor else {}),
        }


def _knots(time: NDArray, change: NDArray) -> tuple[NDArray, NDArray]:
    """Return times and positions between which an axis goes evenly, from the times of its steps.

    At a step the axis is half way between two positions. Where the next is far longer in coming
    than those around it, the axis stands meanwhile.
    """
    if not len(time):
        return np.zeros(1), np.zeros(1)
    after = change.cumsum(dtype=np.int64).astype(float)
    gaps = np.diff(time)
    around = np.concatenate([[np.inf], gaps, [np.inf]])
    near = np.minimum(around[:-2], around[2:])  # of each gap, the shorter of its neighbours
    rests = np.flatnonzero(gaps > REST * np.where(np.isfinite(near), near, SHORT_S))
    # What is before the first step and behind the last is a rest as well.
    before = np.minimum(np.concatenate([around[2:][rests], around[1:2]]), SHORT_S)
    behind = np.minimum(np.concatenate([around[:-2][rests], around[-2:-1]]), SHORT_S)
    most = np.append(gaps[rests] / 2, np.inf)
    stops = np.append(time[rests], time[-1]) + np.minimum(behind, most)
    starts = np.append(time[rests + 1], time[0]) - np.minimum(before, most)
    times = np.concatenate([time, stops, starts])
    places = np.concatenate([after - change / 2, after[rests], after[-1:], after[rests],
                             [0.0]])
    order = np.argsort(times, kind="stable")
    return times[order], places[order]


def _slope(at: NDArray, values: NDArray, wide: float) -> NDArray:
    """Return the rise of values around each time, `wide` seconds across."""
    before, after = (np.interp(at + shift, at, values) for shift in (-wide / 2, wide / 2))
    return (after - before) / wide


def asked_steps(segments: Sequence[Segment], settings: GCodeSettings) -> int:
    """Return about how many steps a path takes."""
    per_mm = [float(each) for each in settings.steps_per_mm]
    total = 0.0
    for segment in segments:
        points = np.array(segment.points(1 / max(per_mm)))
        total += float((np.abs(np.diff(points, axis=0)).sum(axis=0) * per_mm).sum())
    return round(total)


def run(simulation: Simulation, blocks: Sequence[tuple[int, str]], segments: Sequence[Segment],
        settings: GCodeSettings, progress: Callable[[int], None] = lambda made: None) -> Job:
    """Send a program as fast as the machine takes it, and wait until all of it is done.

    Raises
    ------
    MachineError
        If a line is refused, or an alarm is raised.
    """
    session = simulation.session
    simulation.do(session.open())
    begin = simulation.seconds
    simulation.do(session.stream(blocks), progress)
    end = simulation.finish(progress)
    return Job(len(blocks), segments, settings, simulation.steps(), begin, end - begin,
               simulation.pauses, simulation.apart)
