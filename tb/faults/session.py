"""Sessions on a serial line, as rows: bytes, breaks, resets, and other inputs meanwhile."""

from collections.abc import Callable, Sequence

import numpy as np

from ..fuzz import FuzzTarget
from ..uart import FRAME, levels
from .rows import Row, Rows, rows_of_stimulus

__all__ = ["BIT", "BYTE", "OBEYED", "Session", "sessions_and_fuzz"]

BIT = 16
"""Clocks of a bit of the lines: the shortest there is, so that much happens in few clocks."""

BYTE = FRAME * BIT

OBEYED = 120
"""Clocks in which a line is obeyed, and more."""


class Session:
    """Rows of a session: inputs are ``rst``, ``rx`` and `others`, in this order."""

    def __init__(self, *others: int) -> None:
        self.rows: list[Row] = []
        self._others = others
        self._begins = False

    def begin(self) -> None:
        """Let the work go on here after a reset."""
        self._begins = True
        self.hold(4 * BYTE)

    def hold(self, clocks: int, *, waits: bool = False, rx: int = 1, rst: int = 0) -> None:
        """Hold all inputs for some clocks; see `Row`."""
        self.rows.append(Row((rst, rx, *self._others), clocks, waits, self._begins))
        self._begins = False

    def press(self, *others: int) -> None:
        """Set the other inputs from here on."""
        self._others = others

    def send(self, data: bytes, clocks: int = OBEYED) -> None:
        """Send bytes, and give them some time."""
        line = levels(data, BIT)
        begin = 0
        for end in range(BIT, len(line) + 1, BIT):
            if end == len(line) or line[end] != line[begin]:
                self.hold(end - begin, rx=int(line[begin]))
                begin = end
        self.hold(clocks)

    def rest(self, clocks: int = OBEYED) -> None:
        """Wait until nothing moves, for some clocks at least."""
        self.hold(clocks, waits=True)

    def reset(self, clocks: int) -> None:
        """Reset for some clocks, and go on when the line has rested."""
        self.hold(clocks, rst=1)
        self.hold(4 * BYTE)

    @property
    def written(self) -> Rows:
        """All rows so far."""
        return Rows.of(self.rows)


def sessions_and_fuzz(inputs: Sequence[str], target: FuzzTarget, sessions: Callable[[int], Rows]
                      ) -> Callable[[int, int], Rows]:
    """Give work to reset: sessions that soon move the motors in one chunk, fuzz inputs in the next.

    Parameters
    ----------
    inputs : sequence of str
        The inputs of the design, in order.
    target : FuzzTarget
        How its line is fuzzed.
    sessions : callable
        Gives sessions of a seed.
    """
    def work(seed: int, number: int) -> Rows:
        own = seed * 1_000_003 + number
        if number % 2 == 0:
            return sessions(own)
        stimulus = target.stimulus(target.inputs(own, 2000))
        rest = np.zeros_like(stimulus["rx"])
        return rows_of_stimulus({**dict.fromkeys(inputs, rest), **stimulus}, inputs)

    return work
