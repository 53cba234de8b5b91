"""Who holds which axis, and what becomes of it."""

from collections.abc import Hashable

from .stage import AXES

__all__ = ["PATIENCE", "Jogging"]

#: Seconds after which a page that holds an axis, and says no more that it does, holds it no longer.
#: The computer may sleep, or the browser hang, with a finger on the button.
PATIENCE = 1.0

NOWHERE = (0,) * len(AXES)


class Jogging:
    """The axes that pages hold. Where some hold an axis up and others down, it stands still."""

    def __init__(self) -> None:
        self._held: dict[Hashable, tuple[tuple[int, ...], float]] = {}

    def hold(self, who: Hashable, ways: tuple[int, ...], now: float) -> None:
        """Note which way somebody holds each axis (1, -1, or 0), at a time in seconds."""
        if any(ways):
            self._held[who] = ways, now
        else:
            self._held.pop(who, None)

    def refresh(self, who: Hashable, now: float) -> None:
        """Note that somebody still holds what was held, if it still counts as held."""
        if who in self._held:
            self._held[who] = self._held[who][0], now

    def leave(self, who: Hashable) -> None:
        """Note that somebody is gone."""
        self._held.pop(who, None)

    def ways(self, now: float) -> tuple[int, ...]:
        """Give which way each axis shall move."""
        self._held = {who: (ways, since) for who, (ways, since) in self._held.items()
                      if now < since + PATIENCE}
        wanted = [ways for ways, _ in self._held.values()]
        together = [{way for way in axis if way} for axis in zip(NOWHERE, *wanted, strict=True)]
        return tuple(axis.pop() if len(axis) == 1 else 0 for axis in together)
