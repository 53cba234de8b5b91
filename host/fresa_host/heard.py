"""What was heard of a positioner, for those who wait for it."""

import threading
import time
from collections.abc import Callable

from .errors import LimitReached, LineLost, Refused
from .positioner_lines import AXES, MEANINGS, Limit, Refusal, Steps

__all__ = ["SETTLED", "Heard", "Target", "reached"]

#: Where each axis is going to; None for one that may be anywhere.
Target = tuple[int | None, ...]

#: Reports after which what is heard is of what was said: a refusal of it would have come, and a
#: limit is of no movement before. The first may have been on its way.
SETTLED = 2

#: Refusals that are kept until somebody asks.
MOST_REFUSALS = 10


def reached(steps: Steps | None, target: Target) -> bool:
    """Whether all axes are where they are going to."""
    return steps is not None and all(
        to is None or at == to for at, to in zip(steps, target, strict=True))


class Heard:
    """What was heard, in a thread of the line's, and who waits for more. For several threads.

    Parameters
    ----------
    reported : callable, optional
        Called with each place that is reported, in the thread of the line.

    Attributes
    ----------
    reports : int
        Reports so far.
    refusals : list of Refusal
        What nobody was told of.
    target : Target or None
        Where it is going to. None if nowhere.
    lost : LineLost or None
        Why the line is gone, if it is.
    """

    def __init__(self, reported: Callable[[Steps], None] | None = None) -> None:
        self._reported = reported or (lambda steps: None)
        self._changed = threading.Condition()
        self._steps: Steps | None = None
        self._at = 0.0
        self._limits: set[str] = set()
        self._untold: set[str] = set()
        self._moved: dict[str, int] = {}  # the reports before each axis was told to move
        self.reports = 0
        self.refusals: list[Refusal] = []
        self.target: Target | None = None
        self.lost: LineLost | None = None

    def hear(self, said: Steps | Refusal | Limit) -> None:
        """Take what the machine says."""
        with self._changed:
            match said:
                case Steps():
                    self._steps, self._at = said, time.monotonic()
                    self.reports += 1
                case Refusal():
                    self.refusals = [*self.refusals, said][-MOST_REFUSALS:]
                case Limit():
                    self._limits.add(said.axis)
                    self._untold.add(said.axis)
                    self.drop(said.axis)
            self._changed.notify_all()
        if isinstance(said, Steps):
            self._reported(said)

    def lose(self, error: LineLost) -> None:
        """Take note that the line is gone."""
        with self._changed:
            self.lost = error
            self._changed.notify_all()

    def last(self) -> tuple[Steps | None, float]:
        """Give the place that was reported last, and how many seconds ago.

        Raises
        ------
        LineLost
            If the line is gone.
        """
        with self._changed:
            if self.lost is not None:
                raise self.lost
            return self._steps, time.monotonic() - self._at

    @property
    def limits(self) -> frozenset[str]:
        """Axes whose movement a limit switch has ended since `aim` named them."""
        with self._changed:
            return frozenset(self._limits)

    def doubts(self, axis: str) -> bool:
        """Whether a limit that is told now may be of a movement before the last."""
        with self._changed:
            return self.reports < self._moved.get(axis, -SETTLED) + SETTLED

    def forgive(self, *axes: str) -> None:
        """Note that limits of these axes are over."""
        with self._changed:
            self._limits -= set(axes)
            self._untold -= set(axes)

    def aim(self, there: Steps | None, *axes: str) -> None:
        """Set where it is going to, with these axes. Limits of theirs are over."""
        with self._changed:
            self.forgive(*axes)
            self._moved |= dict.fromkeys(axes, self.reports)
            self.target = there
            self._changed.notify_all()

    def drop(self, *axes: str) -> None:
        """Note that these axes do not go there any more. The others do."""
        with self._changed:
            if self.target is not None:
                left = tuple(None if axis in axes else to
                             for axis, to in zip(AXES, self.target, strict=True))
                self.target = None if left == (None,) * len(AXES) else left
            self._changed.notify_all()

    def leave(self, axis: str) -> None:
        """Note that an axis goes elsewhere, without end. Limits of it are over."""
        with self._changed:
            self.forgive(axis)
            self._moved[axis] = self.reports
            self.drop(axis)

    def wait(self, target: Target, seen: int, patience: float) -> None:
        """Wait until there is a report more, or it goes elsewhere, or something is wrong."""
        with self._changed:
            self._changed.wait_for(
                lambda: self.reports > seen or self.target != target or self._wrong, patience)

    def wait_for_reports(self, count: int, patience: float) -> bool:
        """Wait until there are so many reports; say whether there are.

        Raises
        ------
        LineLost, Refused, LimitReached
            See `complain`.
        """
        with self._changed:
            self.listen(count, patience)
            self.complain()
            return self.reports >= count

    def listen(self, count: int, patience: float) -> None:
        """Wait until there are so many reports, or something is wrong; raise nothing."""
        with self._changed:
            self._changed.wait_for(lambda: self.reports >= count or self._wrong, patience)

    def pardon(self) -> bool:
        """Forget what was refused; say whether anything was."""
        with self._changed:
            refused, self.refusals = self.refusals, []
            return bool(refused)

    @property
    def _wrong(self) -> bool:
        return bool(self.refusals or self.lost)

    def complain(self) -> None:
        """Raise what nobody was told of.

        Raises
        ------
        LineLost
            If the line is gone.
        Refused
            If the machine refused something, the first that it refused.
        LimitReached
            If a limit switch ended a movement.
        """
        with self._changed:
            if self.lost is not None:
                raise self.lost
            if self.refusals:
                reason = self.refusals.pop(0).reason
                raise Refused(reason, MEANINGS.get(reason, "it does not say more"))
            if self._untold:
                axes, self._untold = frozenset(self._untold), set()
                raise LimitReached(axes)
