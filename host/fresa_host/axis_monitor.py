"""Whether an axis goes where it was sent, by its reports alone.

A number that the line damages may be another number. Then nothing is refused, and the machine goes
there.
"""

__all__ = ["STILL", "AxisMonitor"]

#: Reports in which an axis goes farther off, one after the other. One may be damaged itself.
AWAY = 2

#: Reports after which an axis that stands still may not be on its way any more: 1 s.
STILL = 10


class AxisMonitor:
    """Watches an axis on its way to where it was sent.

    Parameters
    ----------
    target : int
        Where to, in steps.

    Attributes
    ----------
    leads_away : bool
        The axis goes farther off. One that goes where it is sent never does.
    """

    def __init__(self, target: int) -> None:
        self.target = target
        self._at: int | None = None
        self._farther = self._still = 0
        self.leads_away = False

    @property
    def stands(self) -> bool:
        """Whether it has not moved for `STILL` reports, and is not at its target."""
        return self._at != self.target and self._still > STILL

    def resume(self) -> None:
        """Note that it is on its way, and takes up backlash or is slow."""
        self._still = 0

    def update(self, at: int) -> None:
        """Take a report. The first must have been sent when the machine had obeyed."""
        before, self._at = self._at, at
        if before is None or at == before:
            self._still += 1
        else:
            self._still = 0
            farther = abs(at - self.target) > abs(before - self.target)
            self._farther = self._farther + 1 if farther else 0
        self.leads_away = self._farther >= AWAY
