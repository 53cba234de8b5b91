"""Which page holds which axis, and what becomes of it."""

from collections.abc import Hashable

from .stage import AXES

__all__ = ["HOLD_TIMEOUT_S", "Jogging"]

#: Seconds after which a page that holds an axis, and says no more that it does, holds it no longer.
#: The computer may sleep, or the browser hang, with a finger on the button.
HOLD_TIMEOUT_S = 1.0

NOWHERE = (0,) * len(AXES)


class Jogging:
    """The axes that pages hold. Where some hold an axis up and others down, it stands still."""

    def __init__(self) -> None:
        self._held: dict[Hashable, tuple[tuple[int, ...], float]] = {}

    def hold(self, who: Hashable, directions: tuple[int, ...], now: float) -> None:
        """Note in which direction a page holds each axis (1, -1, or 0), at a time in seconds."""
        if any(directions):
            self._held[who] = directions, now
        else:
            self._held.pop(who, None)

    def refresh(self, who: Hashable, now: float) -> None:
        """Note that a page still holds what was held, if it still counts as held."""
        if who in self._held:
            self._held[who] = self._held[who][0], now

    def leave(self, who: Hashable) -> None:
        """Note that a page is gone."""
        self._held.pop(who, None)

    def directions(self, now: float) -> tuple[int, ...]:
        """Give in which direction each axis shall move."""
        self._held = {who: (directions, since) for who, (directions, since) in self._held.items()
                      if now < since + HOLD_TIMEOUT_S}
        wanted = [directions for directions, _ in self._held.values()]
        together = [set(axis) - {0} for axis in zip(NOWHERE, *wanted, strict=True)]
        return tuple(axis.pop() if len(axis) == 1 else 0 for axis in together)
