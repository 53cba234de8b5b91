"""`positioner`, clock by clock, in plain Python, from what it promises on its pins.

Who reads lines, and who writes them, is told as a story: what comes between two ``yield`` happens
in one clock.
"""

import re
from collections.abc import Generator, Sequence
from dataclasses import dataclass
from typing import ClassVar

from fresa.machines.positioner import LINE_LENGTH, PositionerTiming

from ...models.motion import AxisModel, LimitsModel
from ...models.protocol import GOOD, LONG, LineModel, ReceiverModel, bits

__all__ = ["CommandsModel", "PositionerInputs", "PositionerModel", "PositionerOutputs",
           "PositioningModel", "ReporterModel"]

Story = Generator[None, None, None]
Order = tuple[str, str, list[int]]
"""What is wrong with a line, or nothing; its first word; what follows it, as numbers: motors from
0, C as 1 and CC as 0."""

SYNTAX = {"CONNECT": "", "DISCONNECT": "", "MOV": "mw", "STOP": "m", "VEL": "mr", "P": "pnnn",
          "GOTO": "p", "ORIGIN": "", "POS": "nnn", "ACK": "f", "STATE": ""}
UP, DOWN = 2**31 - 1, -2**31


class CommandsModel:
    """Reads a line, an item a clock, and says what it is."""

    def __init__(self, *, top_speed: int) -> None:
        self.ranges = {"p": (1, 7), "r": (1, top_speed), "n": (DOWN, 2**32 - 1), "f": (0, 1)}
        self.reset()

    def reset(self) -> None:
        """Begin a line anew."""
        self.order: Order | None = None  # that is offered
        self.item: int | None = None
        self.took = self.taken = False
        self.story = self._lines()

    def clock(self, item: int | None, taken: bool) -> bool:
        """Make a clock, in which the order was taken or not; tell whether the item is."""
        self.item, self.taken, self.took = item, taken, False
        next(self.story)
        return self.took

    def _lines(self) -> Story:
        while True:
            numbers: list[int] = []
            word = yield from self._run("[^ 0-9+-]")
            yield
            wrong = yield from self._arguments(word, numbers)
            end = yield from self._end()
            self.order = ({GOOD: wrong, LONG: "LONG"}.get(end, "DAMAGED"), word, numbers)
            yield
            while not self.taken:
                yield
            self.order = None
            yield

    def _arguments(self, word: str, numbers: list[int]) -> Generator[None, None, str]:
        """Read what follows the first word; return what is wrong with it."""
        if word not in SYNTAX:
            return "COMMAND"
        for kind in SYNTAX[word]:
            space = yield from self._byte(" ")
            yield
            if not space:
                return "ARGUMENT"
            wrong = yield from getattr(self, {"m": "_motor", "w": "_way"}.get(kind, "_number"))(
                numbers, kind)
            yield
            if wrong:
                return wrong
        item = yield from self._next()
        yield
        return "" if item > 0xFF else "ARGUMENT"

    def _motor(self, numbers: list[int], kind: str) -> Generator[None, None, str]:
        if (yield from self._run("[^ 0-9+-]")) != "MOT":
            return "ARGUMENT"
        yield
        digit = yield from self._byte("123")
        numbers.append(int(digit or 0) - 1)
        return "" if digit else "ARGUMENT"

    def _way(self, numbers: list[int], kind: str) -> Generator[None, None, str]:
        way = yield from self._run("[^ 0-9+-]")
        numbers.append(int(way == "C"))
        return "" if way in ("C", "CC") else "ARGUMENT"

    def _number(self, numbers: list[int], kind: str) -> Generator[None, None, str]:
        text = yield from self._run("[0-9]", first="[-+0-9]")
        if not re.search("[0-9]", text):
            return "ARGUMENT"
        low, high = self.ranges[kind]
        if not low <= int(text) <= high:
            return "RANGE"
        # A position may be unsigned.
        numbers.append(int(text) - (2**32 if int(text) > UP else 0))
        return ""

    # A clock each

    def _next(self) -> Generator[None, None, int]:
        """Wait for an item."""
        while self.item is None:
            yield
        return self.item

    def _byte(self, allowed: str) -> Generator[None, None, str]:
        """Take one of these characters, if it is one."""
        item = yield from self._next()
        self.took = item < 0x100 and chr(item) in allowed
        return chr(item) if self.took else ""

    def _run(self, pattern: str, first: str | None = None) -> Generator[None, None, str]:
        """Take characters as long as they belong to a word or number; it is there a clock later."""
        text = ""
        while True:
            item = yield from self._next()
            if item > 0xFF or not re.fullmatch(pattern if text else first or pattern, chr(item),
                                               re.DOTALL):
                break
            self.took = True
            text += chr(item)
            yield
        yield
        return text

    def _end(self) -> Generator[None, None, int]:
        while True:
            item = yield from self._next()
            self.took = True
            if item > 0xFF:
                return item
            yield


class PositioningModel:
    """Does what orders say, to what the axes are told."""

    def __init__(self, *, top_speed: int, waiting: int = 32) -> None:
        self.top_speed, self.waiting = top_speed, waiting
        self.reset()

    def reset(self) -> None:
        """Forget everything."""
        self.connected = False
        self.rate = [min(200, self.top_speed)] * 3
        self.target = [-1, -1, -1]  # of no meaning until a motor moves
        self.movement = ["", "", ""]  # of each motor: MOV, GOTO or none
        self.points: dict[int, list[int]] = {}
        self.lookup_done = False
        self.acknowledges = False
        self.waiting_answers: list[str] = []
        self.answer = ""  # that is being handed on
        self.pending_limits: set[int] = set()  # motors whose limit is still to be told
        self.sound = 0  # ticks for which the buzzer is still on

    def refusal(self, order: Order) -> str:
        """Return why an order is refused; nothing if it is obeyed."""
        wrong, word, numbers = order
        if wrong or word not in ("MOV", "GOTO"):
            return wrong
        if not self.connected:
            return "DISCONNECTED"
        return "EMPTY" if word == "GOTO" and numbers[0] not in self.points else ""

    def takes(self, order: Order | None) -> bool:
        """Return whether the order that is offered is taken in this clock."""
        return bool(order and self.lookup_done)

    def load(self, order: Order | None) -> list[int] | None:
        """Return what this place is called from the next clock on, if it is called otherwise."""
        if order and self.lookup_done and not self.refusal(order) and order[1] in ("ORIGIN", "POS"):
            return order[2] or [0, 0, 0]
        return None

    def clock(self, order: Order | None, *, in_position: Sequence[int], limit_hit: Sequence[int],
              tick: bool, answer_taken: bool, halt: bool = False) -> None:
        """Make a clock."""
        taken = self.takes(order)
        refusal = self.refusal(order) if order and taken else ""
        answer = refusal
        if order and taken and not refusal:
            acknowledged = order[2][0] if order[1] == "ACK" else self.acknowledges
            answer = "STATE" if order[1] == "STATE" else "OK" if acknowledged else ""
        level = len(self.waiting_answers)
        if not self.answer or answer_taken:
            first = min(self.pending_limits, default=None)
            if first is None:
                self.answer = self.waiting_answers.pop(0) if level else ""
            else:
                self.answer = f"LIMIT MOT{first + 1}"
                self.pending_limits.remove(first)
        if answer and level < self.waiting:
            self.waiting_answers.append(answer if level < self.waiting - 1 else "OVERFLOW")
        self.sound -= bool(tick and self.sound)
        for motor in range(3):
            if self.movement[motor] and limit_hit[motor]:
                self.pending_limits.add(motor)
                self.sound = 2
            if in_position[motor] or limit_hit[motor]:
                self.movement[motor] = ""
        if order and taken and not refusal:
            self._obey(*order[1:])
        if halt:
            self.movement = [""] * 3
        self.lookup_done = bool(order and not taken)

    def _obey(self, word: str, numbers: list[int]) -> None:
        if word == "CONNECT":
            self.connected = True
        elif word == "DISCONNECT":
            self.connected, self.movement = False, ["", "", ""]
        elif word == "MOV":
            motor, clockwise = numbers
            self.movement[motor], self.target[motor] = word, UP if clockwise else DOWN
        elif word == "STOP":
            self.movement[numbers[0]] = ""
        elif word == "VEL":
            self.rate[numbers[0]] = numbers[1]
        elif word == "P":
            self.points[numbers[0]] = numbers[1:]
        elif word == "GOTO":
            self.movement, self.target = [word] * 3, list(self.points[numbers[0]])
        elif word == "ACK":
            self.acknowledges = bool(numbers[0])
        elif word != "STATE":
            self.movement = [way if way == "MOV" else "" for way in self.movement]


class ReporterModel:
    """Sends lines: when each begins is all there is to know, for then its bits follow."""

    def __init__(self, *, byte: int, period: int) -> None:
        self.byte, self.period = byte, period
        self.quiet = byte * len("! DISCONNECTED\n ")
        self.reset()

    def reset(self) -> None:
        """Cut what is being sent."""
        self.now = 0
        self.due = self.took = False
        self.answer = ""
        self.state: Sequence[int] = ()
        self.text, self.began, self.free = b"", 0, 0  # the line on the wire, and until when
        self.story = self._lines()

    @property
    def tick(self) -> bool:
        """It is time for a report."""
        return self.now % self.period == self.period - 1

    @property
    def tx(self) -> int:
        """The level of the line."""
        byte, clock = divmod(self.now - self.began, self.byte)
        if clock < 0 or not 0 <= byte < len(self.text):
            return 1
        return bits(self.text[byte])[clock * 10 // self.byte]

    def clock(self, *, enable: bool, state: Sequence[int], answer: str) -> bool:
        """Make a clock; tell whether the answer was taken. The last but one are the positions."""
        self.answer, self.state, self.took = answer, state, False
        next(self.story)
        if self.tick:
            self.due = enable or answer == "STATE"
        self.now += 1
        return self.took

    def _lines(self) -> Story:
        while True:
            if self.due:
                self.due = False
                if self.answer == "STATE":
                    self.took = True
                    text = " ".join(map(str, ("STATE", *self.state))) + "\n"
                else:
                    text = "# POS {} {} {} :".format(*self.state[-4:-1])
            elif (self.answer not in ("", "STATE")
                  and self.period - 1 - self.now % self.period > self.quiet):
                self.took = True
                text = "ok\n" if self.answer == "OK" else f"! {self.answer}\n"
            else:
                yield
                continue
            for _ in range(3):
                yield
            while self.now < self.free:
                yield
            self.text, self.began = text.encode(), self.now + 1
            last = self.now + self.byte * (len(text) - 1)
            self.free = last + self.byte
            while self.now < last + 2:
                yield


@dataclass
class PositionerInputs:
    """Levels of the input pins in one clock."""

    rst: int = 0
    rx: int = 0
    limits: int = 0


@dataclass
class PositionerOutputs:
    """Levels of the output pins in one clock."""

    tx: int
    step: int
    direction: int
    enable: int
    buzzer: int
    connected: int
    moving: int
    fault: int = 0


class PositionerModel:
    """The pins of `positioner`.

    Call :meth:`outputs` and then :meth:`edge` with the inputs of a clock, for each clock.

    The other parameters are those of the machine.
    """

    Inputs: ClassVar[type] = PositionerInputs

    def __init__(self, *, timing: PositionerTiming, bit: int, inverted: bool = False,
                 backlash: Sequence[int] = (0, 0, 0), original: bool = False,
                 limit_ends: Sequence[str] = ("X+", "Y+", "Z+")) -> None:
        self.bit = bit
        self.receiver = ReceiverModel(period=bit)
        self.lines = LineModel(length=LINE_LENGTH, depth=256, end=ord("\n"))
        self.commands = CommandsModel(top_speed=timing.top_speed)
        self.positioning = PositioningModel(top_speed=timing.top_speed)
        self.reporter = ReporterModel(byte=10 * bit, period=timing.report)
        times = {name: getattr(timing, name) for name in ("width", "low", "setup", "hold")}
        self.axes = [AxisModel(times=times, modulus=timing.clock, max_rate=timing.top_speed)
                     for _ in range(3)]
        self.limits = LimitsModel(axes=3, period=timing.settle)
        self.backlash, self.limit_ends, self.original = backlash, limit_ends, original
        self.clocks = self.seconds = 0
        self.hz = timing.clock
        self.flip = 7 * inverted
        self._axes: list[dict[str, int]] = []  # in this clock

    def outputs(self, pins: PositionerInputs) -> PositionerOutputs:
        """Return the outputs in this clock, once: the axes move on with it."""
        does = self.positioning
        self._axes = self._move(pins)
        step, direction, enable = (_word(axis[f"{name}_pin"] for axis in self._axes)
                                   for name in ("step", "direction", "enable"))
        return PositionerOutputs(
            tx=self.reporter.tx, step=step ^ self.flip, direction=direction ^ self.flip,
            enable=enable, buzzer=int(does.sound > 0), connected=int(does.connected),
            moving=_word(map(bool, does.movement)))

    def edge(self, pins: PositionerInputs) -> None:
        """Go to the next clock."""
        does, order, axes = self.positioning, self.commands.order, self._axes
        tick = self.reporter.tick
        answered = self.reporter.clock(
            enable=does.connected, answer="" if self.original else does.answer, state=(
                int(does.connected), *(int(bool(way)) for way in does.movement), *does.rate,
                *(pins.limits >> number & 1 for number in range(3)),
                *(axis["position"] for axis in axes), self.seconds))
        taken = does.takes(order)
        does.clock(order, in_position=[axis["in_position"] for axis in axes], tick=tick,
                   answer_taken=answered or self.original,
                   limit_hit=[axis["limit_hit"] for axis in axes],
                   halt=self.receiver.line_break)
        took = self.commands.clock(self.lines.head, taken)
        byte, room = self.receiver.byte, self.lines.room
        self.lines.clock(byte, took)
        self.receiver.clock(pins.rx, room)
        self.seconds += self.clocks > 0 and self.clocks % self.hz == 0
        self.clocks += 1
        if pins.rst:
            self.seconds = 0
            for part in (does, self.reporter, self.commands, self.lines, self.receiver):
                part.reset()

    def _move(self, pins: PositionerInputs) -> list[dict[str, int]]:
        does = self.positioning
        load = does.load(self.commands.order)
        pressed = {end: pins.limits >> number & 1 for number, end in enumerate(self.limit_ends)}
        low, high = (_word(pressed.get(f"{axis}{sign}", 0) for axis in "XYZ") for sign in "-+")
        on = self.limits.clock(low=low, high=high)
        return [axis.clock(
            target=does.target[index], run=int(bool(does.movement[index])),
            load=int(load is not None), place=load[index] if load else 0,
            rate=does.rate[index], backlash=self.backlash[index],
            enable=int(does.connected), low=on["at_low"] >> index & 1,
            high=on["at_high"] >> index & 1, rst=pins.rst)
            for index, axis in enumerate(self.axes)]


def _word(values) -> int:
    return sum(int(value) << place for place, value in enumerate(values))
