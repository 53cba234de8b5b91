"""Orders over a serial line: what each line is answered, and where the tool may go."""

import re
from bisect import bisect_left, bisect_right
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .floods import PROMPT, Backlog, beyond_room, out_of_turn, unanswered
from .line import CUT, Text
from .order_lines import DOWN, GO, LONGEST, NUMBERS, OPEN, ROOM, TELL, UP, decode_request, with_crc
from .single_lines import Frame
from .trajectory import Failure, Steps

__all__ = ["OrderSession", "AcceptedOrder", "check_moves", "motors"]

WORDS = (0b0110, 0b0011, 0b1001, 0b1100)
"""Coil words, ascending."""

DEPTH = 2
"""Orders that may wait."""

ANSWER = re.compile(rb"=([0-9A-F]{30})\r\n")
(TOLD, OPENED, TAKEN, AGAIN, FULL, BUSY, UNEXPECTED, CLOSED, MANUAL, DAMAGED, UNKNOWN) = range(11)


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
    first = np.full(len(orders), CUT)
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


class OrderSession:
    """What lines ask for, and what they were answered.

    Parameters
    ----------
    output : Text
        What the machine said.
    floods : sequence of pairs
        From which clock to which there were more lines than could be answered.
    ends : sequence of int
        When bytes came that end a line.
    byte : int
        Clocks of a byte.

    Attributes
    ----------
    accepted : list of Taken
        Orders to be carried out.
    """

    def __init__(self, output: Text, floods: Sequence[tuple[int, int]], ends: Sequence[int],
                 byte: int) -> None:
        self._output, self._floods, self._ends, self._byte = output, floods, ends, byte
        self.accepted: list[AcceptedOrder] = []
        self.failures: list[Failure] = []
        self.answers = 0
        self._session = self._number = self._done = 0

    def run(self, given: Iterator[Frame]) -> None:
        """Look at all of it, up to the first answer that is wrong."""
        place, last, flooded = 0, -1, []
        backlog = Backlog(ROOM, self._byte)
        floods = iter([*self._floods, (1 << 62, 1 << 62)])
        begin, end = next(floods)
        for frame in given:
            while frame.clock >= end:
                place = self._flood(flooded, last, place, end)
                (begin, end), flooded, backlog = next(floods), [], Backlog(ROOM, self._byte)
            if frame.clock >= begin and not (end < CUT and backlog.fits(frame)):
                flooded.append(frame)
                continue
            place, last = self._answer(frame, place), frame.clock
            if self.failures:
                return
            if frame.clock >= begin:
                backlog.answered(frame, self._output.starts[place - 1])
        if begin < 1 << 62:
            place = self._flood(flooded, last, place, end)
        if place < len(self._output.text):
            self._fail(self._output.starts[place], f"an answer to no line: "
                       f"{self._output.text[place:place + 40]!r}")

    def _fail(self, clock: int, message: str) -> None:
        self.failures.append(Failure(clock, "answer", message))

    def _flood(self, flooded: Sequence[Frame], last: int, place: int, end: int) -> int:
        """Look at the answers to what is left of a flood behind the last line that had room.

        Each says what is so, or that a line was damaged.

        Lines may be lost; nothing is left to wait. Bytes may be lost between lines too: then what
        follows, up to a return, is a damaged line more.
        """
        stop = self._output.before(end)
        answers = list(ANSWER.finditer(self._output.text, place, stop))
        if sum(len(answer[0]) for answer in answers) != stop - place and end < CUT:
            self._fail(end, "a flood is answered by what is no answer")
        if flooded and not answers and end < CUT:
            self._fail(end, f"{len(flooded)} lines of a flood have no answer")
        begun = [(self._output.starts[answer.start()], answer[1]) for answer in answers]
        ends = self._ends[bisect_right(self._ends, last):bisect_left(self._ends, end)]
        wrong = out_of_turn(begun, ends, flooded, self._may)
        if wrong is not None:
            clock, text = begun[wrong]
            self._fail(clock, f"a flood is answered by {text!r}, which is out of turn")
        sizes = [(clock, 1 if int(text[:1], 16) == DAMAGED else LONGEST + 1)
                 for clock, text in begun]
        if (wrong := beyond_room(sizes, ends, ROOM)) is not None:
            self._fail(begun[wrong][0], "more lines are answered behind a flood than "
                       f"{ROOM} bytes can be")
        self.failures += unanswered(flooded, self._output, self._byte, end)
        for answer in answers:
            outcome, *_ = fields = self._fields(answer[1].decode())
            if outcome not in (TOLD, DAMAGED) or not self._is_so(fields):
                self._fail(end, f"a flood is answered by {answer[0]!r}")
        self.answers += len(answers)
        return stop

    def _may(self, answer: bytes, frame: Frame | None) -> bool:
        return int(answer[:1], 16) == DAMAGED or bool(
            frame and int(answer[:1], 16) in self._outcomes(frame))

    def _answer(self, frame: Frame, place: int) -> int:
        """Look at the answer to a line; say where it ends."""
        starts = self._output.starts
        found = ANSWER.match(self._output.text, place)
        before = (starts[place - 1] if place else 0) + self._byte
        due = max(frame.clock, before) + PROMPT * self._byte
        if not found or not frame.clock < starts[place] <= due:
            shown = self._output.text[place:place + 42]
            self._fail(starts[place] if shown else due, f"line {frame.text!r} is answered by "
                       f"{shown!r} {starts[place] - frame.clock if shown else ''} clocks later")
            return place
        self.answers += 1
        outcome, *_ = fields = self._fields(found[1].decode())
        right = self._outcomes(frame)
        before = self._session, self._number
        if outcome in right:
            self._do(frame, outcome)
        else:
            self._session, self._number = before
        if outcome not in right or not self._is_so(fields):
            self._fail(starts[place], f"line {frame.text!r} is answered by {found[0]!r}")
        return found.end()

    def _fields(self, digits: str) -> tuple[int, ...]:
        """Split an answer: outcome, state, session, taken, done; outcome -1 if it is damaged."""
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
        if kind == TELL:
            return {TOLD}
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
