"""Which page holds which axis."""

from collections.abc import Hashable

from .stage import AXES

__all__ = ["HOLD_TIMEOUT_S", "NOWHERE", "Jogging"]

#: Seconds without a message after which a page's hold of an axis ends. The computer may sleep, or
#: the browser hang, with a finger on the button.
HOLD_TIMEOUT_S = 1.0

NOWHERE = (0,) * len(AXES)


class Jogging:
    """The axes that a page holds. One page holds at a time: the last one that has begun to."""

    def __init__(self) -> None:
        self._page: Hashable = None
        self._directions = NOWHERE
        self._since = 0.0

    def hold(self, page: Hashable, directions: tuple[int, ...], now: float) -> None:
        """Set the direction in which a page holds each axis (1, -1, or 0), at a time in seconds."""
        if any(directions):
            self._page, self._directions, self._since = page, directions, now
        else:
            self.leave(page)

    def refresh(self, page: Hashable, now: float) -> None:
        """Renew a page's hold at a time in seconds, if it has not timed out."""
        if page == self._page:
            self._since = now

    def leave(self, page: Hashable) -> None:
        """End the hold of a page."""
        if page == self._page:
            self._page, self._directions = None, NOWHERE

    def directions(self, now: float) -> tuple[int, ...]:
        """Return the direction of each axis at a time in seconds."""
        if now >= self._since + HOLD_TIMEOUT_S:
            self.leave(self._page)
        return self._directions
