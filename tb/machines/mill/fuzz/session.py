"""Orders over a serial line: what each line is answered, and where the tool may go."""

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from tb.fuzz.answers import AnswerSession
from tb.fuzz.frames import Frame
from tb.fuzz.trajectory import NEVER, Failure, Steps
from tb.uart import Text

from .lines import DOWN, GO, LONGEST, NUMBERS, OPEN, QUERY, ROOM, UP, decode_request, with_crc

__all__ = ["AcceptedOrder", "OrderSession", "check_moves", "motors"]

WORDS = (0b0110, 0b0011, 0b1001, 0b1100)
"""Coil words, ascending."""

DEPTH = 2
"""Orders that may wait."""

ANSWER = rb"=[0-9A-F]{30}\r\n"
(REPORTED, OPENED, TAKEN, AGAIN, FULL, BUSY, UNEXPECTED, CLOSED, MANUAL, DAMAGED,
 UNKNOWN) = range(11)


class AcceptedOrder(NamedTuple):
    """An order that was taken, and the clock before which its line had not ended."""

    clock: int
    kind: int
    x: int
    y: int


def motors(seen: Mapping[str, NDArray]) -> tuple[list[Steps], list[Failure]]:
    """Count the steps of the three motors at their coils; say where they are no steps."""
    places = np.full(16, -1)
    places[list(WORDS)] = range(4)
    found, failures = [], []
    for name in "xyz":
        place = places[seen[f"axis_{name}"]]
        turned = np.diff(place)
        moved = np.flatnonzero(turned)
        direction = (turned[moved] + 1) % 4 - 1
        wrong = moved[(abs(direction) != 1) | (place[moved + 1] < 0)]
        failures += [Failure(int(n) + 1, "pins", f"what the coils of {name} do is no step")
                     for n in wrong[:1]]
        found.append(Steps.of(moved + 1, direction))
    return found, failures


def check_moves(orders: Sequence[AcceptedOrder], steps: Sequence[Steps], period: int, travel: int
           ) -> list[Failure]:
    """Hold the steps of the motors against the orders that were taken, in their turn, once each."""
    # Lowering steps back through the table of coil words.
    x = y = lowered = 0
    ways: list[list[NDArray]] = [[], [], []]
    for order in orders:
        to = (order.x, order.y) if order.kind == GO else (x, y)
        low = {UP: 0, DOWN: 1}.get(order.kind, lowered)
        for axis, turn in enumerate((to[0] - x, to[1] - y, (lowered - low) * travel)):
            ways[axis].append(np.full(abs(turn), np.sign(turn)))
        (x, y), lowered = to, low
    failures, last = [], np.full(len(orders), -1)
    first = np.full(len(orders), NEVER)
    for name, own, parts in zip("xyz", steps, ways, strict=True):
        of = np.arange(len(orders)).repeat([len(part) for part in parts])
        ordered = np.concatenate([*parts, np.zeros(1, int)])[:-1]
        same = min(len(ordered), len(own.clock))
        begun = np.array([order.clock for order in orders], np.int64)[of[:same]]
        wrong = np.flatnonzero((own.direction[:same] != ordered[:same])
                               | (own.clock[:same] <= begun))
        if wrong.size or len(own.clock) > len(ordered):
            clock = int(own.clock[wrong[0] if wrong.size else same])
            failures.append(Failure(clock, "step", f"a step of {name} that no order asked for"))
        elif same < len(ordered):
            failures.append(Failure(orders[of[same]].clock, "step", f"{name} makes {same} steps, "
                                    f"and {len(ordered)} were ordered"))
        apart = np.diff(own.clock[:same])[np.diff(of[:same]) == 0]
        if (apart != period).any():
            failures.append(Failure(int(own.clock[0]), "time", f"steps of {name} are not {period} "
                                    "clocks apart"))
        np.maximum.at(last, of[:same], own.clock[:same])
        np.minimum.at(first, of[:same], own.clock[:same])
    moves = np.flatnonzero(last >= 0)
    early = np.flatnonzero(first[moves[1:]] <= last[moves[:-1]])
    return failures + [Failure(int(first[moves[n + 1]]), "step", "an order begins before that "
                               "before it is over") for n in early[:1]]


class OrderSession(AnswerSession):
    """What lines ask for, and what they were answered; see `AnswerSession`.

    Attributes
    ----------
    accepted : list of AcceptedOrder
        Orders to be carried out.
    """

    room = ROOM
    longest_answer = len("=\r\n") + 30

    def __init__(self, output: Text, floods: Sequence[tuple[int, int]], ends: Sequence[int],
                 byte: int) -> None:
        super().__init__(output, floods, ends, byte)
        self.accepted: list[AcceptedOrder] = []
        self._session = self._number = self._done = 0

    def pattern(self, frame: Frame) -> bytes:
        """Give a regular expression for every answer."""
        return ANSWER

    def flood_pattern(self, frames: Sequence[Frame]) -> bytes:
        """Give a regular expression for every answer."""
        return ANSWER

    def may(self, answer: bytes, frame: Frame | None) -> bool:
        """Say whether an answer may be to a frame, or to what loss has left of some."""
        outcome = int(answer[1:2], 16)
        return outcome == DAMAGED or bool(frame and outcome in self._outcomes(frame))

    def least(self, answer: bytes, frames: Sequence[Frame]) -> int:
        """Give the bytes that wait, at least, of a line with an answer, with the end."""
        return 1 if int(answer[1:2], 16) == DAMAGED else LONGEST + 1

    def obey(self, frame: Frame, found: re.Match[bytes]) -> None:
        """Check the fields of the answer to a line, and note what it orders."""
        outcome, *_ = fields = self._fields(found[0])
        right = outcome in self._outcomes(frame)
        if right:
            self._do(frame, outcome)
        if not right or not self._is_so(fields):
            self.fail(self.output.starts[found.start()],
                      f"line {frame.text!r} is answered by {found[0]!r}")

    def may_obey(self, frame: Frame, end: int) -> None:
        """Do nothing: no line of a flood orders anything."""

    def check_flooded(self, answer: bytes, end: int) -> None:
        """Check that an answer in a flood gives the state, or says that a line was damaged."""
        outcome, *_ = fields = self._fields(answer)
        if outcome not in (REPORTED, DAMAGED) or not self._is_so(fields):
            self.fail(end, f"a flood is answered by {answer!r}")

    def _fields(self, answer: bytes) -> tuple[int, ...]:
        """Split an answer: outcome, state, session, taken, done; outcome -1 if it is damaged."""
        digits = answer.decode()[1:-2]
        if with_crc(digits[:-8]) != digits.encode():
            return (-1,) * 5
        return tuple(int(digits[a:b], 16) for a, b in [(0, 1), (1, 2), (2, 10), (10, 16), (16, 22)])

    def _is_so(self, fields: Sequence[int]) -> bool:
        """Compare what is told with what was taken; note what is done."""
        _, state, session, number, done = fields
        waiting, before = ((self._number - each) % NUMBERS for each in (done, self._done))
        if state or (session, number) != (self._session, self._number) or (
                waiting > min(before, DEPTH)):
            return False
        self._done = done
        return True

    def _outcomes(self, frame: Frame) -> set[int]:
        """Say what may become of a line."""
        request = decode_request(frame)
        if request is None:
            return {DAMAGED}
        kind, session, number, *_ = request
        idle = self._done == self._number
        if kind == QUERY:
            return {REPORTED}
        if kind == OPEN:
            return {OPENED} if idle or session == self._session else {OPENED, BUSY}
        if kind > DOWN:
            return {UNKNOWN}
        if not self._session or session != self._session:
            return {CLOSED}
        if number == self._number:
            return {AGAIN}
        if number != (self._number + 1) % NUMBERS:
            return {UNEXPECTED}
        full = (self._number - self._done) % NUMBERS >= DEPTH
        return {TAKEN, FULL} if full else {TAKEN}

    def _do(self, frame: Frame, outcome: int) -> None:
        request = decode_request(frame)
        if request is None:
            return
        kind, session, number, x, y = request
        if outcome == OPENED and session != self._session:
            self._session, self._number, self._done = session, number, number
        elif outcome == TAKEN:
            self._number = number
            self.accepted.append(AcceptedOrder(frame.clock, kind, x, y))
