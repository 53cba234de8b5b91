"""Work of machines that take G-code: what a program sends, and what may interrupt it."""

import random
from collections.abc import Sequence

from .session import BYTE, Session

__all__ = ["PLANNED", "GCodeSession"]

PLANNED = 6000
"""Clocks in which a line has begun to move, or was answered."""


class GCodeSession(Session):
    """A session whose other inputs are contacts.

    Parameters
    ----------
    rng : random.Random
        What it is drawn from.
    contacts : sequence of str
        Inputs beside the line.
    axes : str
        Letters of the axes that move.
    digits : int
        Of a distance, behind the point.
    feed : int
        Of its motions.
    brake : int
        Clocks in which a motion speeds up or slows down.
    """

    def __init__(self, rng: random.Random, contacts: Sequence[str], *, axes: str, digits: int,
                 feed: int, brake: int) -> None:
        super().__init__(*[0] * len(contacts))
        self._rng, self._contacts, self._axes, self._digits = rng, contacts, axes, digits
        self._feed, self._brake = feed, brake

    def set_contact(self, name: str, level: int = 1) -> None:
        """Set a contact from here on, and no other; none if there is no such."""
        self.press(*(level if each == name else 0 for each in self._contacts))

    def tap(self, name: str, clocks: int = 200) -> None:
        """Close a contact, and open it again."""
        self.set_contact(name)
        self.hold(clocks)
        self.set_contact("")
        self.hold(100)

    def distances(self, most: float) -> str:
        """Return words of a random motion of all axes."""
        return "".join(f"{axis}{self._rng.uniform(-most, most):.{self._digits}f}"
                       for axis in self._axes)

    def move(self, clocks: int = PLANNED) -> None:
        """Send a line, and give it some time."""
        self.send(f"G1{self.distances(0.4)}\n".encode(), clocks)

    def moving(self) -> int:
        """Return clocks in which a motion has begun, and may not have ended."""
        return PLANNED + self._rng.randint(1, self._brake)

    def unlock(self) -> None:
        """Begin anew after a reset, be it locked."""
        self.send(f"$X\nG91F{self._feed}\n".encode(), PLANNED)

    def move_several(self) -> None:
        """Send lines that are planned together."""
        for _ in range(self._rng.randint(1, 3)):
            self.move(BYTE)
        self.hold(PLANNED)

    def hold_feed(self) -> None:
        """Hold a motion, and go on."""
        self.move(self.moving())
        self.send(b"!", self._rng.randint(1, 8000))
        self.send(b"~", self._rng.randint(1, 2000))
        self.hold(2 * self._brake)
        self.send(b"~", 200)  # the one before does nothing while it still slows down

    def reset_softly(self) -> None:
        """Send the reset of GRBL."""
        self.move(self._rng.randint(1, 12_000))
        self.send(b"\x18", 5 * self._brake // 2)
        self.unlock()

    def stop(self, *names: str) -> None:
        """Stop at once by a contact, until a reset."""
        self.move(self.moving())
        self.tap(self._rng.choice(names))
        self.send(b"\x18", 2000)
        self.unlock()

    def jog(self) -> None:
        """Jog, and cancel it."""
        self.send(f"$J=G91F{self._feed}{self.distances(0.4)}\n".encode(), self.moving())
        self.send(b"\x85", 2 * self._brake)

    def reset_all(self) -> None:
        """Reset everything within a motion."""
        self.move(self._rng.randint(1, 12_000))
        self.reset(self._rng.choice([1, 1, 2, 20]))
        self.unlock()

    def interrupt(self, clocks: int, *lines: bytes) -> None:
        """Move all axes, set a contact within some clocks, and send one of some lines."""
        for _ in range(3):
            self.send(f"G1{self.distances(1)}\n".encode(), self._rng.randint(1, 2000))
        self.hold(self._rng.randint(1, clocks))
        self.set_contact(self._rng.choice(self._contacts), self._rng.choice([0, 1]))
        self.send(self._rng.choice(lines) + b"\n", 4000)
        self.set_contact("")
