"""What axes were told last, and what their reports say of it."""

from dataclasses import dataclass

from fresa_host.heard import SETTLED
from fresa_host.positioner_lines import Steps
from fresa_host.positioner_way import Way

__all__ = ["Departure", "Order"]


@dataclass
class Order:
    """What an axis was told: to go on until it is stopped, or where to go.

    Attributes
    ----------
    way : int
        Which way it goes on; 0 if it goes to a place.
    to : Way or None
        Its way to a place.
    reports : int
        Reports since.
    """

    way: int = 0
    to: Way | None = None
    reports: int = 0

    @property
    def settled(self) -> bool:
        """Whether what is heard is of this order, and not of one before."""
        return self.reports >= SETTLED

    def hear(self, at: int) -> bool:
        """Take a report; say whether the axis has arrived, or will not."""
        to, settled = self.to, self.settled
        self.reports += 1
        if to is None or not settled:
            return False
        to.hear(at)
        return at == to.to or to.leads_away or to.stands


@dataclass
class Departure:
    """A point that the machine was told, to be gone to when it has not refused that.

    Attributes
    ----------
    number : int
        The point.
    steps : Steps
        Where it is.
    after : bytes
        What is to be sent behind the order to go.
    due : float
        When all of it will be on the line.
    heard : float
        When the last report came.
    left : int
        Reports still to come.
    """

    number: int
    steps: Steps
    after: bytes
    due: float
    heard: float
    left: int = SETTLED

    def hear(self, now: float) -> bool:
        """Take a report; say whether a refusal would have come."""
        self.heard = now
        self.left -= now >= self.due
        return self.left <= 0
