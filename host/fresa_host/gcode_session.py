"""The session of a machine that speaks the GRBL 1.1 protocol, without the line."""

import re
from collections import deque
from collections.abc import Sequence
from contextlib import suppress
from typing import NamedTuple

from .errors import JobStopped, TimedOut, WasReset
from .gcode_lines import (
    BAUD,
    BUFFER,
    HOLD,
    RESET,
    STATUS,
    Alarmed,
    BlockRefused,
    Message,
    Position,
    Status,
    block,
    decode,
)
from .lines import LineSplitter
from .session import Session, Waiting

__all__ = ["GCodeSession"]

#: Seconds from one request for status to the next.
POLL_S = 0.2

#: Lines of one answer that are kept; ``$$`` has some 40.
MOST_LINES = 512

#: States in which nothing moves until a line or a person makes it.
STANDS = {"Idle", "Alarm", "Check", "Sleep"}


class _Sent(NamedTuple):
    """A line whose answer is to come: its number in the program, if it is of one."""

    number: int | None
    text: str

    @property
    def size(self) -> int:
        return len(self.text) + 1

    @property
    def dwell(self) -> float:
        """Seconds that it stands still, in state ``Idle`` and without an answer."""
        found = re.search(r"G0?4(?![\d.]).*?P *([\d.]{1,12})", self.text.upper())
        try:
            return float(found[1]) if found else 0.0
        except ValueError:
            return 0.0


class GCodeSession(Session):
    """A machine on a line. All operations raise what `fresa_host.GCode` does.

    Lines are sent ahead of their answers as long as the machine's receive buffer surely has room
    for them: it counts the characters of those that are not answered. Answers come in the order of
    the lines, so each goes to the oldest.

    Parameters
    ----------
    name : str
        Name of the port, for errors.
    baud : int
        Bits a second of the line.
    timeout : float
        Seconds within which the machine must send something.

    Attributes
    ----------
    status : Status or None
        The last report.
    reports, resets : int
        Reports and greetings so far.
    offset : Position or None
        Origin of the work coordinates, once it was reported.
    done, total : int
        Lines answered of the program that is streamed, and all of them.
    stopping : bool
        A stop is requested: what waits ends. May be set at any time.
    """

    def __init__(self, *, name: str = "the port", baud: int = BAUD, timeout: float = 5.0) -> None:
        super().__init__(baud)
        self._name, self._timeout = name, timeout
        self._splitter = LineSplitter()
        self._sent: deque[_Sent] = deque()
        self._room = BUFFER
        self._texts: list[str] = []
        self._refused: BlockRefused | None = None
        self._answered_at = self._received_at = 0.0
        self.status: Status | None = None
        self.offset: Position | None = None
        self.reports = self.resets = self.done = self.total = 0
        self.stopping = False
        self._alarm: int | None = None  # not raised yet
        self._was_reset = False  # the same
        self._locked = False  # by an alarm, after which it resets itself

    def receive(self, data: bytes, now: float) -> None:
        """Take bytes of the line, and the time."""
        self.now = now
        for line in self._splitter.feed(data):
            if (message := decode(line)) is None:
                continue
            self._received_at = now
            if isinstance(message, Status):
                self.status = message
                self.reports += 1
                self.offset = message.offset or self.offset
            else:
                self._take(message)
            self._resume(None)
        self._resume(None)

    def _take(self, message: Message) -> None:
        if message.kind == "greeting":
            self._sent.clear()
            self._room = BUFFER
            self.resets += 1
            self._was_reset |= not self._locked
            self._locked = False
        elif message.kind == "alarm":
            self._alarm, self._locked = message.code, True
        elif message.kind == "text":
            if len(self._texts) < MOST_LINES:
                self._texts.append(message.text)
        elif self._sent:
            sent = self._sent.popleft()
            self._room += sent.size
            self._answered_at = self.now
            self.done += sent.number is not None
            if message.kind == "error" and self._refused is None:
                self._refused = BlockRefused(message.code, sent.text, sent.number)

    @property
    def waiting(self) -> int:
        """Bytes of the lines that are not answered yet."""
        return BUFFER - self._room

    def open(self) -> Waiting[None]:
        """Find the machine. It may have been switched on just before."""
        yield from self.report(tries=True)
        self._clear()

    def report(self, *, tries: bool = False) -> Waiting[Status]:
        """Ask for the status; with `tries` again and again, as it may be starting."""
        before, end = self.reports, self.now + self._timeout
        again = self.now
        while self.reports == before:
            if self.now >= end:
                raise TimedOut(f"no machine answers at {self._name}: is it on, and the rate right?")
            if self.now >= again:
                again = self.now + 2 * POLL_S if tries else end
                self._send(STATUS)
            yield min(again, end)
        assert self.status is not None
        return self.status

    def place(self, *, work: bool = True) -> Waiting[Position]:
        """Ask for the position, in work coordinates or the machine's.

        The offset between them is not in each report, so that it may take some.
        """
        end = self.now + self._timeout
        while True:
            status = yield from self.report()
            wanted, other = (status.work, status.machine) if work else (
                status.machine, status.work)
            if wanted is not None:
                return wanted
            if other is not None and self.offset is not None:
                sign = -1 if work else 1
                return Position(*(round(a + sign * b, 6)
                               for a, b in zip(other, self.offset, strict=True)))
            if self.now >= end:
                raise TimedOut("the machine does not report the origin of its work coordinates")

    def ask(self, line: str, timeout: float | None = None, *, clear: bool = False
            ) -> Waiting[list[str]]:
        """Send a line, when all before are answered; return what comes before its ``ok``.

        Parameters
        ----------
        line : str
            What to send.
        timeout : float, optional
            Seconds that it may take. None for as long as the machine reports its status.
        clear : bool
            Do not raise alarms and resets from before.
        """
        text = block(line)
        if clear:
            self._clear()
        self._begin()
        yield from self._answered(timeout)
        self._texts, self._refused = [], None
        self._submit(_Sent(None, text))
        yield from self._answered(timeout)
        if self._refused is not None:
            raise self._refused
        return self._texts

    def stream(self, blocks: Sequence[tuple[int, str]], *, line_by_line: bool = False
               ) -> Waiting[None]:
        """Send the lines of a program; end when all are answered.

        Parameters
        ----------
        blocks : sequence of tuple
            Number and text of each, as `fresa_host.gcode_lines.program` makes them.
        line_by_line : bool
            Send none before the one before it is answered.
        """
        self._begin()
        self.total = 0
        yield from self._answered()
        self._refused, self.done, self.total = None, 0, len(blocks)
        for number, text in blocks:
            sent = _Sent(number, text)
            yield from self._answered(room=BUFFER if line_by_line else sent.size)
            if self._refused is not None:
                break
            self._submit(sent)
        yield from self._answered()
        if self._refused is not None:
            raise self._refused

    def still(self, timeout: float | None = None) -> Waiting[None]:
        """Wait until it stands with all that it was sent done.

        Two reports in a row say so: the first may be from before the last line began.
        """
        self._begin()
        end, seen = None if timeout is None else self.now + timeout, 0
        while True:
            yield from self._answered(None if end is None else end - self.now)
            status = yield from self.report()
            self._check()
            if status.state == "Alarm":
                raise Alarmed(0)
            seen = seen + 1 if status.state in STANDS else 0
            if seen == 2:
                return
            if end is not None and self.now >= end:
                raise TimedOut(f"it is in state {status.state} after {timeout:g} s")
            yield from self._pause()

    def stop(self) -> Waiting[None]:
        """Hold, and reset when it stands: what it was sent is forgotten, the position is kept.

        If it does not stand within the time of an answer, it is reset as it moves; in a homing
        cycle, which no hold ends, at once: its position is lost.
        """
        resets = self.resets
        try:
            yield from self._stand()
            self._send(RESET)
            end = self.now + self._timeout
            while self.resets == resets:
                if self.now >= end:
                    raise TimedOut(f"the machine at {self._name} does not answer to a reset")
                yield end
            self._clear()
        finally:
            self.stopping = False

    def _stand(self) -> Waiting[None]:
        """Hold until it stands, or for the time of an answer; a homing cycle does not hold.

        Two reports in a row say so: the first may be from before the hold.
        """
        end, seen = self.now + self._timeout, 0
        self._send(HOLD)
        with suppress(TimedOut):  # it may answer nothing, as during homing
            while self.now < end:
                status = yield from self.report()
                if status.state == "Home":
                    return
                held = status.state in ("Hold", "Door") and not status.substate
                seen = seen + 1 if held or status.state in STANDS else 0
                if seen == 2:
                    return
                yield from self._pause()

    def _begin(self) -> None:
        self._answered_at = self._received_at = self.now

    def _clear(self) -> None:
        """Forget alarms and resets that were not raised."""
        self._alarm, self._was_reset = None, False

    def _submit(self, sent: _Sent) -> None:
        self._answered_at = max(self._answered_at, self.now)
        self._sent.append(sent)
        self._room -= sent.size
        self._send(f"{sent.text}\n".encode("ascii"))

    def _pause(self) -> Waiting[None]:
        """Wait for the time between two reports."""
        due = self.now + POLL_S
        while self.now < due:
            yield due

    def _answered(self, timeout: float | None = None, *, room: int = BUFFER) -> Waiting[None]:
        """Wait until so many bytes of the machine's buffer are surely free."""
        begun = self.now
        poll = begun + POLL_S
        while True:
            self._check()
            if self._room >= room:
                return
            if self.now >= poll:
                poll = self.now + POLL_S
                self._send(STATUS)
            if timeout is None:
                self._check_silence()
            elif self.now - begun >= timeout:
                raise TimedOut(f"{self._sent[0].text!r} is not answered after {timeout:g} s")
            yield poll

    def _check_silence(self) -> None:
        """Raise an error if nothing comes any more, or an answer was lost."""
        if self.now - self._received_at >= self._timeout:
            raise TimedOut(f"the machine at {self._name} is silent since {self._timeout:g} s")
        dwell = sum(sent.dwell for sent in self._sent)
        idle = self.status is not None and self.status.state in STANDS
        if idle and self.now - self._answered_at >= self._timeout + dwell:
            raise TimedOut(f"the answer to {self._sent[0].text!r} was lost: stop() begins anew")

    def _check(self) -> None:
        """Raise what ends all that waits; an alarm and a reset once."""
        if self.stopping:
            raise JobStopped("stopped, by stop()")
        alarm, was_reset = self._alarm, self._was_reset
        self._clear()
        if alarm is not None:
            raise Alarmed(alarm)
        if was_reset:
            raise WasReset("the machine was reset, and has forgotten what it was sent")
