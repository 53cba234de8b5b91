"""Whether axes go where they were sent, by their reports alone.

A number that the line damages may be another number. Then nothing is refused, and the machine goes
there.
"""

from collections.abc import Sequence

__all__ = ["STILL", "Way", "Ways"]

#: Reports in which an axis goes farther off, one after the other. One may be damaged itself.
AWAY = 2

#: Reports after which an axis that stands still does not take up play any more: 20 s.
STILL = 200


class Way:
    """The way of an axis to where it was sent.

    Parameters
    ----------
    to : int
        Where to, in steps.

    Attributes
    ----------
    leads_away : bool
        The axis goes farther off. One that goes where it is sent never does.
    stands : bool
        It has not moved for long, and is not there.
    """

    def __init__(self, to: int) -> None:
        self.to = to
        self._at: int | None = None
        self._farther = self._still = 0
        self.leads_away = self.stands = False

    def hear(self, at: int) -> None:
        """Take a report. The first must have been sent when the machine had obeyed."""
        before, self._at = self._at, at
        if before is None or at == before:
            self._still += 1
        else:
            self._still = 0
            self._farther = self._farther + 1 if abs(at - self.to) > abs(before - self.to) else 0
        self.leads_away = self._farther >= AWAY
        self.stands = at != self.to and self._still > STILL


class Ways:
    """The ways of all axes that were sent somewhere.

    Parameters
    ----------
    target : sequence of int or None
        Where each axis is going to; None for one that may be anywhere.
    """

    def __init__(self, target: Sequence[int | None]) -> None:
        self.target = target
        self._ways = {axis: Way(to) for axis, to in enumerate(target) if to is not None}

    def hear(self, steps: Sequence[int]) -> None:
        """Take a report. See `Way`."""
        for axis, way in self._ways.items():
            way.hear(steps[axis])

    @property
    def lead_away(self) -> bool:
        """Whether an axis goes farther off."""
        return any(way.leads_away for way in self._ways.values())

    @property
    def stand(self) -> bool:
        """Whether an axis has not moved for long, and is not there."""
        return any(way.stands for way in self._ways.values())
