"""`single`, clock by clock, in plain Python.

It says what the pins do and nothing of how the gateware does it: a line is a list of levels that is
looked at in the middle of its bits, frames are bytes, what is still to be sent is a list.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

from ...models.drive import PhaseModel, RateModel
from ...models.motion import MoveToModel, RampModel

__all__ = ["BIPOLAR", "UNIPOLAR", "SingleInputs", "SingleModel", "SingleOutputs"]

BIPOLAR = (0b0001, 0b0101, 0b0100, 0b0110, 0b0010, 0b1010, 0b1000, 0b1001)
UNIPOLAR = (0b0001, 0b0011, 0b0010, 0b0110, 0b0100, 0b1100, 0b1000, 0b1001)
"""Coil words of half steps, forward."""

LONGEST = 126
ROOM = 127
"""Most bytes of a frame; bytes and ends of all frames that wait, and of the one that comes."""

GOOD, LONG, DAMAGED = range(0x100, 0x103)
DIGITS = b"0123456789"
STOPS = b" +-" + DIGITS
"""Bytes that end a word."""


@dataclass
class SingleInputs:
    """Levels of the input pins in one clock."""

    rst: int = 0
    rx: int = 0


@dataclass
class SingleOutputs:
    """Levels of the output pins in one clock."""

    tx: int
    coils: int
    enable: int
    position: int
    moving: int
    fault: int = 0


class _Receiver:
    """Bytes from the levels of a line: two of three looks into a bit decide."""

    def __init__(self, bit: int) -> None:
        self.bit, self.spread = bit, bit // 16
        self.line: list[int] = []  # since it was last found to be high
        self.high = 0  # clocks in a row
        self.settled = False
        self.held: int | None = None  # a byte, with 256 if it is not to be trusted
        self.lost = False

    def level(self, rx: int) -> int | None:
        """See a level; give the byte that is complete with it, with 512 without a stop bit."""
        self.high = self.high + 1 if rx else 0
        if not self.settled:
            self.settled = self.high > 2 * self.spread
            return None
        if rx and not self.line:
            return None
        self.line.append(rx)
        number, rest = divmod(len(self.line) - 1 - self.bit // 2 - self.spread, self.bit)
        if rest or number < 0:
            return None
        if number == 0 and self._vote(0):  # it was no start bit
            self.line = []
        if number < 9:
            return None
        byte, stop = sum(self._vote(n + 1) << n for n in range(8)), self._vote(9)
        self.line, self.high, self.settled = [], 0, bool(stop)
        return byte | (not stop) << 9

    def _vote(self, number: int) -> int:
        last = number * self.bit + self.bit // 2 + self.spread
        return int(sum(self.line[last - n * self.spread] for n in range(3)) >= 2)

    def edge(self, rx: int, taken: bool) -> None:
        """Go to the next clock."""
        byte = self.level(rx)
        if byte is not None and self.held is not None and not taken:
            self.lost = True
        elif byte is not None:
            self.held = byte & 0xFF | (byte >= 512 or self.lost) << 8
            self.lost = False
        elif taken:
            self.held = None


class _Frames:
    """Frames that wait: bytes, and an end of each."""

    def __init__(self) -> None:
        self.frame: list[int] | None = None
        self.verdict = GOOD
        self.waiting: list[int] = []
        self.fetching = 0  # clocks for which the next item waits

    def has_room(self) -> bool:
        return len(self.waiting) + len(self.frame or []) < ROOM

    def edge(self, item: int | None, taken: bool) -> None:
        """Go to the next clock; `item` is a byte that is read, with 256 if not to be trusted."""
        self.fetching = self.fetching + 1 if self.waiting else 0
        if taken:
            self.waiting.pop(0)
            self.fetching = 0
        if item is not None:
            self._read(item & 0xFF, item >> 8)

    def _read(self, byte: int, error: int) -> None:
        if byte == ord(":"):
            self.frame, self.verdict = [], DAMAGED if error else GOOD
        elif self.frame is not None or error:
            if error:  # outside it may be that a start was lost
                self.verdict = DAMAGED
            if byte == ord("\r"):
                self.waiting += [*(self.frame if self.frame and self.verdict == GOOD else []),
                                 self.verdict]
                self.frame, self.verdict = None, GOOD
                return
            frame = self.frame or []
            if self.verdict == GOOD and len(frame) == LONGEST:
                self.verdict = LONG
            self.frame = [*frame, byte] if self.verdict == GOOD else []


class SingleModel:
    """The pins of `single`.

    Call :meth:`outputs` and then :meth:`edge` with the inputs of a clock, for each clock.

    Parameters
    ----------
    bit : int
        Clocks of a bit of the line.
    modulus, rate : int
        At 1 rpm there are ``rate`` steps in ``modulus`` clocks.
    ramp : sequence of int
        Rates of the steps from standstill, if it has a ramp.
    phases : sequence of int
        Coil words, forward.
    greeting, help_text : bytes
        What is sent after reset; what ``:d`` prints.
    """

    Inputs: ClassVar[type] = SingleInputs

    def __init__(self, *, bit: int, modulus: int, rate: int = 1, ramp: Sequence[int] = (),
                 phases: Sequence[int] = BIPOLAR, greeting: bytes, help_text: bytes) -> None:
        self.bit, self.rate = bit, rate
        self.greeting, self.help_text = greeting, help_text
        self.steps = RateModel(modulus=modulus, max_rate=59_999 * rate)
        self.motor = PhaseModel(sequence=phases, period=modulus // (59_999 * rate))
        self.ramp = RampModel(steps=ramp, width=15) if ramp else None
        self.now = 0
        self._reset()

    def _reset(self) -> None:
        self.receiver = _Receiver(self.bit)
        self.frames = _Frames()
        self.place = self.ramp.place if self.ramp else MoveToModel(width=15)
        self.target, self.speed, self.enable = 0, 100, 1
        # What is to be said, a part as soon as that before is sent; what of it is left to be sent,
        # where None is a clock in which there is no byte.
        self.parts: list[Callable[[], list[int | None]]] = [
            lambda: [None, *self.greeting, *self.help_text]]
        self.sending: list[int | None] = []
        # Steps of reading a frame, a clock each: one that takes an item, one that only looks at
        # it, one that needs none. What to do at its end.
        self.reading: list[bool | None] = []
        self.command: Callable[[], list] = list
        self.on_line, self.since = 1, self.now - 10 * self.bit

    @property
    def answers(self) -> bool:
        """There is more to be sent."""
        return bool(self.parts or self.sending)

    def outputs(self, pins: SingleInputs) -> SingleOutputs:
        """Return the outputs in this clock."""
        bit = (self.now - self.since) // self.bit
        return SingleOutputs(
            tx=self.on_line >> bit & 1 if bit < 10 else 1, coils=self.motor.coils,
            enable=self.enable, position=self.place.position,
            moving=self._request()[0])

    def edge(self, pins: SingleInputs) -> None:
        """Go to the next clock."""
        taken = bool(self.receiver.held is not None and self.frames.has_room())
        item = self.receiver.held if taken else None
        self.receiver.edge(pins.rx, taken)
        shown = self.frames.waiting if self.frames.fetching >= 2 else []
        begins = bool(self.parts) and not self.sending
        reads = not self.parts and self._reads(shown)
        self._send()
        if begins:
            self.sending = self.parts.pop(0)()
        self._move(pins.rst)
        if reads and not self.reading:
            self.parts = self.command()
        self.frames.edge(item, reads)
        self.now += 1
        if pins.rst:
            self._reset()

    # The line

    def _send(self) -> None:
        """Let a clock pass, or put a byte on the line if that is free."""
        if self.sending and self.sending[0] is None:
            self.sending.pop(0)
        elif self.sending and self.now - self.since >= 10 * self.bit - 1:
            self.on_line, self.since = (0x100 | (self.sending.pop(0) or 0)) << 1, self.now + 1

    def _digits(self, number: int) -> list[int | None]:
        """A clock for each time that a power of ten goes into it, and one in which it does not."""
        plan: list[int | None] = []
        for digit in str(number).rjust(5):
            plan += [None] if digit == " " else [*[None] * (int(digit) + 1), ord(digit)]
        return plan

    # The frames

    def _reads(self, shown: list[int]) -> bool:
        """Read on in a frame; say whether a byte of it, or its end, is taken."""
        if not self.reading and shown:
            self._begin(shown[:next(n for n, item in enumerate(shown) if item >= GOOD) + 1])
        if not self.reading or (self.reading[0] is not None and not shown):
            return False
        return bool(self.reading.pop(0))

    def _begin(self, frame: list[int]) -> None:
        """Find out what a frame asks for, and how long that takes."""
        *text, end = frame
        letters = next((n for n, byte in enumerate(text) if byte in STOPS), len(text))
        word, rest = bytes(text[:letters]).upper(), bytes(text[letters:])
        self.reading = [True] * letters + [False, None]
        if word in (b"X", b"V", b"E"):
            digits = next((n for n, byte in enumerate(rest) if byte not in DIGITS), len(rest))
            self.reading += [True] * digits + [False, None] + [True] * (len(rest) - digits)
        else:
            self.reading += [True] * len(rest)
        self.reading.append(True)
        self.command = lambda: self._answer(word, rest, end)

    def _answer(self, word: bytes, rest: bytes, end: int) -> list:
        """Do what a frame asks for; return what is to be said."""
        def text(line: bytes) -> Callable[[], list[int | None]]:
            return lambda: [None, *line]

        error = {LONG: "length", DAMAGED: "command"}.get(end) or self._error(word, rest)
        if error:
            return [text(f"err {error}\r\n".encode())]
        if word == b"D":
            return [text(self.help_text + b"ok\r\n")]
        if word in (b"X?", b"V?"):
            return [text(word[:1].lower() + b":"), lambda: self._digits(
                self.place.position if word == b"X?" else self.speed), text(b"\r\nok\r\n")]
        number = int(rest)
        if word == b"X":
            self.target = number
        elif word == b"V":
            self.speed = number
        else:
            self.enable = number
        return [text(b"ok\r\n")]

    @staticmethod
    def _error(word: bytes, rest: bytes) -> str | None:
        legal = {b"X": range(10_000), b"V": range(1, 60_000), b"E": range(2)}.get(word)
        if legal is None:
            return None if word in (b"X?", b"V?", b"D") and not rest else "command"
        if not rest or set(rest) - set(DIGITS):
            return "number"
        return None if int(rest) in legal else "range"

    # The motor

    def _request(self) -> tuple[int, int]:
        """Return the step that is requested in this clock, and its direction."""
        if self.ramp:
            return self.ramp.request(target=self.target, run=self.enable)
        return self.place.request(target=self.target, run=self.enable, load=0)

    def _move(self, rst: int) -> None:
        """Make the step that is due, towards the set-point of this clock or as the ramp lets it."""
        step, up = self._request()
        requested = self.speed * self.rate
        rate = self.ramp.rate(requested) if self.ramp else requested
        moved = self.motor.clock(step=int(step and self.steps.is_due()), direction=up,
                                 enable=self.enable, rst=rst)["moved"]
        self.steps.clock(rate=rate, moved=moved)
        if self.ramp:
            self.ramp.clock(target=self.target, run=self.enable, requested_rate=requested,
                            moved=moved, rst=rst)
        else:
            self.place.clock(moved=moved, direction=up, load=0, place=0, rst=rst)
