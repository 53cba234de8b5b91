"""Model of orders over a serial line."""

import zlib
from collections import deque

__all__ = ["LedgerModel", "OrdersModel", "checked", "unchecked"]

QUERY, OPEN, GO, UP, DOWN = range(5)
(REPORTED, OPENED, TAKEN, AGAIN, FULL, BUSY, UNEXPECTED, CLOSED, MANUAL, DAMAGED,
 UNKNOWN) = range(11)

NUMBERS = 1 << 24
REQUEST_DIGITS, CHECK_DIGITS = 24, 8


def checked(digits: str) -> str:
    """Return an even number of hexadecimal digits, followed by their CRC."""
    packed = bytes(int(digits[at + 1] + digits[at], 16) for at in range(0, len(digits), 2))
    return digits + f"{zlib.crc32(packed):08X}"[::-1]


def unchecked(line: str, digits: int) -> str | None:
    """Return the digits of a line, or None if its length, digits or CRC are wrong."""
    body = line[:digits]
    right = (len(line) == digits + CHECK_DIGITS and set(line) <= set("0123456789ABCDEF")
             and checked(body) == line)
    return body if right else None


class LedgerModel:
    """Sessions and sequence numbers; queued orders are a list."""

    def __init__(self, *, depth: int = 2) -> None:
        self.depth = depth
        self.reset()

    def reset(self) -> None:
        """Clear everything, as reset and manual mode do."""
        self.session = self.done = 0
        self.waiting: deque[tuple[int, int, int]] = deque()

    @property
    def taken(self) -> int:
        """Number of the last order taken."""
        return (self.done + len(self.waiting)) % NUMBERS

    def carry_out(self) -> tuple[int, int, int]:
        """Execute the first queued order, and return it: kind, x and y."""
        self.done = (self.done + 1) % NUMBERS
        return self.waiting.popleft()

    def request(self, kind: int | None, session: int = 0, number: int = 0, x: int = 0, y: int = 0,
                *, enable: int = 1) -> int:
        """Process a request, or None for a damaged line; return its outcome."""
        if kind is None:
            return DAMAGED
        if kind == QUERY:
            return REPORTED
        if kind == OPEN:
            if not enable:
                return MANUAL
            if session != self.session:
                if self.waiting:
                    return BUSY
                self.session, self.done = session, number
            return OPENED
        if kind > DOWN:
            return UNKNOWN
        if not (enable and self.session and session == self.session):
            return CLOSED
        if number == self.taken:
            return AGAIN
        if number != (self.taken + 1) % NUMBERS:
            return UNEXPECTED
        if len(self.waiting) == self.depth:
            return FULL
        self.waiting.append((kind, x, y))
        return TAKEN


class OrdersModel:
    """Bytes in, bytes out: lines to the ledger, and its answers.

    Attributes
    ----------
    ledger : LedgerModel
        The orders taken.
    enable, error, stopped : int
        As the machine's.
    """

    def __init__(self, *, depth: int = 2) -> None:
        self.ledger = LedgerModel(depth=depth)
        self.enable, self.error, self.stopped = 1, 0, 0
        self._line: bytearray | None = None

    def hear(self, data: bytes) -> bytes:
        """Process bytes; return the answers to the lines that end in them."""
        answers = b""
        for byte in data:
            if byte == ord(":"):
                self._line = bytearray()
            elif self._line is not None:
                if byte in b"\r\n":
                    answers += self._answer(self._line.decode("latin-1"))
                    self._line = None
                elif len(self._line) <= REQUEST_DIGITS + CHECK_DIGITS:  # one more than the longest
                    self._line.append(byte)
        return answers

    def _answer(self, line: str) -> bytes:
        body = unchecked(line, REQUEST_DIGITS)
        fields = [] if body is None else [
            int(body[at:to], 16) for at, to in [(2, 10), (10, 16), (16, 20), (20, 24)]]
        kind = None if body is None else int(body[:2], 16)
        outcome = self.ledger.request(kind, *fields, enable=self.enable)
        state = self.error | self.stopped << 1 | (not self.enable) << 2
        said = (f"{outcome:X}{state:X}{self.ledger.session:08X}{self.ledger.taken:06X}"
                f"{self.ledger.done:06X}")
        return f"={checked(said)}\r\n".encode()
