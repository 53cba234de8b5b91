"""Which page holds which axis, and the resulting directions."""

from collections.abc import Hashable

from .stage import AXES

__all__ = ["HOLD_TIMEOUT_S", "Jogging"]

#: Seconds without a message after which a page's hold of an axis ends. The computer may sleep, or
#: the browser hang, with a finger on the button.
HOLD_TIMEOUT_S = 1.0

NOWHERE = (0,) * len(AXES)


class Jogging:
    """The axes that pages hold. An axis that is held up and down at the same time stands still."""

    def __init__(self) -> None:
        self._held: dict[Hashable, tuple[tuple[int, ...], float]] = {}

    def hold(self, page: Hashable, directions: tuple[int, ...], now: float) -> None:
        """Set the direction in which a page holds each axis (1, -1, or 0), at a time in seconds."""
        if any(directions):
            self._held[page] = directions, now
        else:
            self._held.pop(page, None)

    def refresh(self, page: Hashable, now: float) -> None:
        """Renew a page's hold at a time in seconds, if it has not timed out."""
        if page in self._held:
            self._held[page] = self._held[page][0], now

    def leave(self, page: Hashable) -> None:
        """End the holds of a page that has disconnected."""
        self._held.pop(page, None)

    def directions(self, now: float) -> tuple[int, ...]:
        """Return the direction of each axis at a time in seconds."""
        self._held = {page: (directions, since) for page, (directions, since) in self._held.items()
                      if now < since + HOLD_TIMEOUT_S}
        wanted = [directions for directions, _ in self._held.values()]
        together = [set(axis) - {0} for axis in zip(NOWHERE, *wanted, strict=True)]
        return tuple(axis.pop() if len(axis) == 1 else 0 for axis in together)
