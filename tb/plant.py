"""The plant: three motors and a tool, simulated from coil words.

Each motor is decoded separately, at the changes of its words; then the steps of the three are
merged in the order of their clocks, and everything else is derived from that list of positions. All
of it works on whole arrays, and results do not depend on where one array ends and the next begins.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import sqrt
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fresa.machines.mill import RESOLUTION

from .engines.base import Changes

__all__ = ["STEP", "WORDS", "Fault", "Motor", "Plant", "Polyline", "Travel", "Wrong"]

#: Coil words in ascending order: black, orange, brown, yellow.
WORDS = (0b0110, 0b0011, 0b1001, 0b1100)

#: Millimetres per step.
STEP = float(RESOLUTION)

#: Clock that stands for no step.
NEVER = -(1 << 62)


class Fault(NamedTuple):
    """A word that no motor can follow: not in the table, or two phases from the last."""

    clock: int
    axis: str
    kind: Literal["illegal", "jump"]
    word: int


class Wrong(NamedTuple):
    """A position in the plate where the picture has no pixel, and the clock of the step to it."""

    clock: int
    x: int
    y: int
    z: int


class Travel(NamedTuple):
    """Travel in the plane. A step of both axes at once is one step, the diagonal of a square."""

    steps: int
    mm: float


@dataclass(frozen=True)
class Polyline:
    """A segment of the tool's path in steps, one row (x, y) per corner, in plate or air."""

    cut: bool
    points: NDArray[np.int64]


class Motor:
    """Decodes the words of one axis.

    Attributes
    ----------
    steps : int
        Steps so far, in both directions.
    least : int or None
        Least clocks between two of them; None until there are two.
    """

    def __init__(self) -> None:
        self.word = -1
        self.phase = -1
        self.steps = 0
        self.last = NEVER
        self.least: int | None = None

    def feed(
        self, clock: NDArray, words: NDArray
    ) -> tuple[NDArray, NDArray[np.int64], NDArray, NDArray]:
        """Continue with these words.

        Parameters
        ----------
        clock, words : array of int64, shape (n,)
            Clocks of the changes, and the words from then on; at least one. A number that is not in
            the table is illegal, negative numbers too.

        Returns
        -------
        arrays of int
            Rows of steps, the sign of each; rows of illegal words; rows of jumps.
        """
        rows = np.flatnonzero(np.diff(words, prepend=self.word))
        self.word = int(words[-1])
        phases = _PHASES[np.minimum(words[rows].view(np.uint64), 16)]
        illegal = rows[phases < 0]
        rows, phases = rows[phases >= 0], phases[phases >= 0]
        if not len(rows):
            return rows, phases, illegal, rows
        first = self.phase if self.phase >= 0 else phases[0]
        turn = np.diff(phases, prepend=first) & 3
        self.phase = int(phases[-1])
        made = turn & 1 == 1
        steps, jumps = rows[made], rows[turn == 2]
        clocks = clock[steps]
        if len(clocks):
            apart = np.diff(clocks, prepend=self.last)
            least = int(apart.min())
            # The difference to NEVER is more than any clock.
            if least < -NEVER:
                self.least = least if self.least is None else min(self.least, least)
            self.last = int(clocks[-1])
            self.steps += len(steps)
        return steps, 2 - turn[made], illegal, jumps


class _Log:
    """Rows that are appended in blocks and read from some index on."""

    def __init__(self, width: int) -> None:
        self._blocks: list[NDArray[np.int64]] = []
        self._none = np.empty((0, width), np.int64)
        self.rows = 0

    def add(self, block: NDArray[np.int64]) -> None:
        if len(block):
            self._blocks.append(block)
            self.rows += len(block)

    def since(self, first: int) -> NDArray[np.int64]:
        """Return the rows from index `first` on, in time proportional to their number."""
        start, taken = self.rows, []
        for block in reversed(self._blocks):
            if start <= first:
                break
            start -= len(block)
            taken.append(block)
        return np.concatenate([*reversed(taken), self._none])[max(0, first - start):]


_PHASES = np.full(17, -1, np.int64)
_PHASES[list(WORDS)] = range(4)


class Plant:
    """Three motors, a tool and a plate.

    The first words define the position (0, 0, 0), with the tool on the plate's face. An illegal
    illegal word leaves a motor as it was; a jump may have turned it either way, so it only sets
    the phase.

    The plate is a picture, rows along x and columns along y, one pixel every `pitch` steps with the
    centre of the first at (0, 0). A pixel is cut when the tool is at full depth exactly on its
    centre: the path from centre to centre lies half in one pixel and half in the next, so that a
    tool which only grazes a pixel has not milled it. A step below the face is wrong if none of the
    pixels nearest to its end is a target. Half way between two centres both are nearest, and all
    four on a corner, which a diagonal from pixel to pixel passes.

    Parameters
    ----------
    target : array of bool, optional
        The picture: the pixels to be cut. Without one there are no wrong steps.
    pitch : int
        Steps from one pixel to the next.
    travel : int
        Steps of the tool from the plate's face down to full depth.
    axes : sequence of str
        Outputs with the coil words of X, Y and Z.

    Attributes
    ----------
    position : tuple of int
        Steps forward minus steps back, per axis.
    cut : array of bool
        The pixels that have been cut.
    wrong_steps : int
        Number of steps that ended in the plate where the picture has no pixel; the first
        `KEPT` are in `wrong`.
    lifts : int
        Number of times that the tool left the plate.
    """

    KEPT = 1000

    def __init__(
        self,
        target: ArrayLike | None = None,
        *,
        pitch: int = 128,
        travel: int = 1152,
        axes: Sequence[str] = ("axis_x", "axis_y", "axis_z"),
    ) -> None:
        if pitch < 1 or travel < 1 or len(axes) != 3:
            raise ValueError(
                f"Pitch and travel must be at least 1 with three axes, not {pitch!r}, {travel!r}, "
                f"{axes!r}"
            )
        self.judged = target is not None
        self.target = np.array(np.zeros((0, 0)) if target is None else target, bool)
        if self.target.ndim != 2:
            raise ValueError(f"Picture must be rows and columns, not the shape {self.target.shape}")
        self.pitch, self.travel, self.axes = pitch, travel, tuple(axes)
        self.position = (0, 0, 0)
        self.cut = np.zeros(self.target.shape, bool)
        self.wrong: list[Wrong] = []
        self.wrong_steps = 0
        self.lifts = 0
        self._motors = {axis: Motor() for axis in self.axes}
        self._faults: list[Fault] = []
        self._corners = _Log(3)
        self._milled = _Log(2)
        self._heading = np.zeros(3, np.int64)
        # Steps straight and diagonal, in the air and in the plate.
        self._plane = {False: [0, 0], True: [0, 0]}

    @property
    def steps(self) -> dict[str, int]:
        """Steps of each axis, in both directions."""
        return {axis: motor.steps for axis, motor in self._motors.items()}

    @property
    def least(self) -> dict[str, int | None]:
        """Least clocks between two steps of each axis; None with fewer than two."""
        return {axis: motor.least for axis, motor in self._motors.items()}

    @property
    def faults(self) -> list[Fault]:
        """All illegal words, once at each change, and all jumps."""
        return list(self._faults)

    @property
    def air(self) -> Travel:
        """Travel in the plane with the tool on the face or above."""
        return self._way(False)

    @property
    def milled(self) -> Travel:
        """Travel in the plane with the tool below the face."""
        return self._way(True)

    @property
    def corners(self) -> NDArray[np.int64]:
        """The tool's path: its start, its corners, and its present position; one row (x, y, z)."""
        return self.corners_from(0)

    def corners_from(self, first: int) -> NDArray[np.int64]:
        """Return the corners from index `first` on; the last one is the present position."""
        return np.concatenate([self._corners.since(first), np.array([self.position], np.int64)])

    def milled_from(self, first: int) -> NDArray[np.int64]:
        """Return the cut pixels in order, from index `first` on: (row, column)."""
        return self._milled.since(first)

    def forget_path(self) -> None:
        """Restart the path at the present position. All else stays."""
        self._corners = _Log(3)
        self._heading = np.zeros(3, np.int64)

    @property
    def turns(self) -> int:
        """Corners of the path so far, without the present position."""
        return self._corners.rows

    @property
    def path(self) -> list[Polyline]:
        """The tool's path in the plane, split into segments in plate and in air."""
        lines: list[Polyline] = []
        points: list[NDArray] = []
        was = False
        for here, there in pairwise(self.corners):
            if (here[:2] == there[:2]).all():
                continue
            cut = bool(min(here[2], there[2]) < 0)
            if points and cut != was:
                lines.append(Polyline(was, np.array(points)))
                points = []
            if not points:
                points = [here[:2]]
            points.append(there[:2])
            was = cut
        return [*lines, Polyline(was, np.array(points))] if points else lines

    def feed(self, changes: Changes) -> None:
        """Continue with these words; the first are those at present, or the next ones."""
        clock = changes.clock
        if not len(clock):
            return
        deltas = np.zeros((len(clock), 3), np.int64)
        faults: list[Fault] = []
        for column, (axis, motor) in enumerate(self._motors.items()):
            words = changes[axis].astype(np.int64)
            rows, signs, illegal, jumps = motor.feed(clock, words)
            deltas[rows, column] = signs
            faults += [Fault(int(clock[r]), axis, "illegal", int(words[r])) for r in illegal]
            faults += [Fault(int(clock[r]), axis, "jump", int(words[r])) for r in jumps]
        self._faults += sorted(faults)
        moves = np.flatnonzero(deltas.any(axis=1))
        if len(moves):
            self._move(clock[moves], deltas[moves])

    def _move(self, clock: NDArray, deltas: NDArray) -> None:
        before = np.array(self.position, np.int64)
        after = before + np.cumsum(deltas, axis=0)
        starts = np.concatenate([before[None], after[:-1]])

        headings = np.concatenate([self._heading[None], deltas])
        turns = (headings[1:] != headings[:-1]).any(axis=1)
        self._corners.add(starts[turns])
        self._heading = deltas[-1]

        below = after[:, 2] < 0
        self.lifts += int(np.count_nonzero((starts[:, 2] < 0) & ~below))
        axes = np.count_nonzero(deltas[:, :2], axis=1)
        inside = below | (starts[:, 2] < 0)
        for cut in (False, True):
            for ways in (1, 2):
                made = np.count_nonzero((axes == ways) & (inside == cut))
                self._plane[cut][ways - 1] += int(made)

        self.position = (int(after[-1, 0]), int(after[-1, 1]), int(after[-1, 2]))
        if self.judged:
            self._judge(clock[below], after[below])

    def _judge(self, clock: NDArray, places: NDArray) -> None:
        plane = places[:, :2]
        pixels, rest = np.divmod(plane, self.pitch)
        deep = (places[:, 2] == -self.travel) & (rest == 0).all(axis=1)
        deep &= ((pixels >= 0) & (pixels < self.target.shape)).all(axis=1)
        found = pixels[deep]
        found = found[~self.cut[found[:, 0], found[:, 1]]]
        if len(found):
            _, firsts = np.unique(found, axis=0, return_index=True)
            self._milled.add(found[np.sort(firsts)])
            self.cut[found[:, 0], found[:, 1]] = True

        # Nearest rounded up and rounded down: they differ half way between two.
        high = (2 * plane + self.pitch) // (2 * self.pitch)
        low = -((self.pitch - 2 * plane) // (2 * self.pitch))
        wrong = ~self._is_target(high[:, 0], high[:, 1])
        for rows, columns in ((high, low), (low, high), (low, low)):
            left = np.flatnonzero(wrong)
            wrong[left] = ~self._is_target(rows[left, 0], columns[left, 1])
        left = np.flatnonzero(wrong)
        self.wrong_steps += len(left)
        for n in left[: self.KEPT - len(self.wrong)]:
            x, y, z = (int(v) for v in places[n])
            self.wrong.append(Wrong(int(clock[n]), x, y, z))

    def _is_target(self, row: NDArray, column: NDArray) -> NDArray[np.bool_]:
        rows, columns = self.target.shape
        on = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
        on[on] = self.target[row[on], column[on]]
        return on

    def _way(self, cut: bool) -> Travel:
        straight, diagonal = self._plane[cut]
        return Travel(straight + diagonal, (straight + diagonal * sqrt(2)) * STEP)
