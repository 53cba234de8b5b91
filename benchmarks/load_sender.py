"""A sender and the pins of the G-code machine at 1 Mbaud, for `benchmarks.load`."""

import random
import re
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from fractions import Fraction
from math import sqrt
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fresa.machines.gcode import AXES, GCodeSettings
from tb.engines import Engine
from tb.uart import FRAME, Decoder, Levels, levels

__all__ = ["BYTE", "PER_MM", "ROOM", "SETTINGS", "Line", "Machine", "Path", "Report", "Sender",
           "nearest", "ordered"]

PER_MM = (400, 320, 250)
"""Steps per mm: no two axes have the same."""

SETTINGS = GCodeSettings(
    clock=16_000_000, baud=1_000_000, deviation=Fraction(1, 10),
    steps_per_mm=[Fraction(each) for each in PER_MM], max_rate=(Fraction(60_000),) * AXES,
    acceleration=(Fraction(17_000),) * AXES)
"""16 clocks a bit, the fewest that the receiver takes."""

BYTE = FRAME * SETTINGS.bit
"""Clocks of a byte."""
ROOM = 128
"""Bytes of lines that a sender has under way: what GRBL's receive buffer has."""
BLOCKS = 63
"""Blocks for which the machine has room."""
SLICE = 16
"""Bytes after which a sender looks at the answers."""
POLL = SETTINGS.clock // 50
"""Clocks from a `?` to the next."""
CUBE = 5_000
"""Um from its middle to its faces, where a path turns back."""
WATCHED = ("step", "direction", "tx", "fault")
REPORT = re.compile(
    rb"<(Idle|Run|Jog|Hold:[01]|Door:[0-3])\|MPos:(-?\d+\.\d{3}),(-?\d+\.\d{3}),(-?\d+\.\d{3})"
    rb"\|Bf:(\d+),(\d+)\|FS:\d+,\d+(?:\|WCO:0\.000,0\.000,0\.000)?"
    rb"(?:\|Ov:\d+,\d+,\d+(?:\|A:\w+)?)?>")


class Line(NamedTuple):
    """A line of a program.

    Attributes
    ----------
    text : bytes
        The line, with its end.
    answer : bytes
        What it is answered if it comes whole.
    move : tuple of int
        By how many um it moves each axis.
    """

    text: bytes
    answer: bytes
    move: tuple[int, ...]


class Report(NamedTuple):
    """A status report, and whether it can be right.

    Attributes
    ----------
    state : str
        State of the machine.
    position : tuple of Fraction
        In steps.
    blocks, bytes : int
        For how many there is room.
    right : bool
        Its queue and its buffer are within their sizes, and its position is one that the pins had
        since it was asked for, within two steps.
    """

    state: str
    position: tuple[Fraction, ...]
    blocks: int
    bytes: int
    right: bool


class Machine:
    """The machine on an engine, and what left its pins and came on its line.

    Attributes
    ----------
    position, made : array
        Where the motors are, and how many steps each has made, both ways.
    last : int
        Clock of the last rising edge of STEP.
    answers : list of bytes
        Answers to lines, all of them.
    reports : list of Report
        Status reports.
    other : list of bytes
        Lines that are neither.
    fault : bool
        Whether the machine has shown a fault.
    """

    def __init__(self, engine: Engine, passed: Callable[[int], object] = lambda clocks: None
                 ) -> None:
        self.engine = engine
        self.position, self.made = np.zeros(AXES, np.int64), np.zeros(AXES, np.int64)
        self.last = 0
        self.answers: list[bytes] = []
        self.reports: list[Report] = []
        self.other: list[bytes] = []
        self.fault = False
        self.asked = 0
        self._passed = passed
        self._decoder = Decoder(SETTINGS.bit)
        self._text = b""
        self._high = 0
        self._asked_at: deque[int] = deque()
        self._places: deque[tuple[int, NDArray[np.int64]]] = deque(maxlen=2000)
        engine.set(rx=1)
        self.wait(20 * BYTE)

    def wait(self, clocks: int) -> None:
        """Let time pass while the line keeps its level."""
        start, before = self.engine.clock, self.engine.get(*WATCHED)
        changes = self.engine.run(clocks, WATCHED)
        self._take(np.concatenate([[start], changes.clock]), {
            name: np.concatenate([[level], changes[name]])
            for name, level in zip(WATCHED, before, strict=True)})

    def play(self, line: Levels) -> None:
        """Put levels on the line, one a clock."""
        start = self.engine.clock
        rows = self.engine.apply({"rx": line}, WATCHED)
        changed = np.zeros(len(line), bool)
        changed[0] = True
        for values in rows.values():
            changed[1:] |= values[1:] != values[:-1]
        where = np.flatnonzero(changed)
        self._take(start + where, {name: values[where] for name, values in rows.items()})

    def send(self, data: bytes) -> None:
        """Put bytes on the line, one after the other."""
        for _ in range(data.count(b"?")):
            self.asked += 1
            self._asked_at.append(self.engine.clock)
        self.play(levels(data, SETTINGS.bit))

    def rest(self, seconds: float = 2) -> bool:
        """Wait until nothing moves, if it is in so many seconds; return whether it is."""
        end = self.engine.clock + int(seconds * SETTINGS.clock)
        self.wait(100 * BYTE)  # of a line, until it is planned
        while self.engine.get("moving") and self.engine.clock < end:
            self.wait(10 * BYTE)
        self.wait(100 * BYTE)
        return not self.engine.get("moving")

    def report(self) -> Report | None:
        """Ask for a report, and return it if one comes."""
        before = len(self.reports)
        self.send(b"?")
        self.wait(150 * BYTE)
        return self.reports[before] if len(self.reports) > before else None

    def _take(self, clocks: NDArray[np.int64], rows: dict[str, NDArray]) -> None:
        step = rows["step"].astype(np.uint8)
        rises = step & ~np.concatenate([[np.uint8(self._high)], step[:-1]])
        self._high = int(step[-1])
        ahead = rows["direction"]
        for axis in range(AXES):
            where = np.flatnonzero(rises >> axis & 1)
            if len(where):
                self.made[axis] += len(where)
                self.position[axis] += int((2 * (ahead[where] >> axis & 1) - 1).sum())
                self.last = max(self.last, int(clocks[where[-1]]))
        self._places.append((self.engine.clock, self.position.copy()))
        self.fault |= bool(rows["fault"].any())
        tx = rows["tx"]
        where = np.concatenate([[0], np.flatnonzero(tx[1:] != tx[:-1]) + 1])
        received = [self._decoder.feed(clock, level) for clock, level in zip(
            clocks[where].tolist(), tx[where].tolist(), strict=True)]
        received.append(self._decoder.feed(self.engine.clock, int(tx[-1])))
        *lines, self._text = (self._text + b"".join(received)).split(b"\r\n")
        for line in lines:
            self._line(line)
        self._passed(self.engine.clock)

    def _line(self, line: bytes) -> None:
        if re.fullmatch(rb"ok|error:\d+", line):
            self.answers.append(line)
        elif found := REPORT.fullmatch(line):
            since = self._asked_at.popleft() if self._asked_at else 0
            position = tuple(Fraction(text.decode()) * per_mm for text, per_mm in zip(
                found.groups()[1:4], PER_MM, strict=True))
            first = next((row for row, (clock, _) in enumerate(reversed(self._places))
                          if clock <= since), len(self._places) - 1)
            places = np.array([at for _, at in list(self._places)[-first - 1:]])
            near = all(low - 2 <= at <= high + 2 for at, low, high in zip(
                position, places.min(axis=0), places.max(axis=0), strict=True))
            blocks, free = int(found[5]), int(found[6])
            self.reports.append(Report(found[1].decode(), position, blocks, free, near
                                       and blocks <= BLOCKS and free <= ROOM))
        else:
            self.other.append(line)


class Path:
    """Short lines that go on and on, through a cube, with no corner at which they would stop.

    Parameters
    ----------
    seed : str
        Of the random numbers.
    length : float
        Of a line, in um.
    turn : float
        How much the direction changes from one to the next: 0.1 is a few degrees, 9 is any.
    relative : bool
        Whether all are relative. Otherwise both are mixed, with lines that are refused.
    short : bool
        Whether they are as short as they can be written. Otherwise they are as CAM programs write
        them, with a G1 and all decimals.
    """

    def __init__(self, seed: str, *, length: float, turn: float, relative: bool = False,
                 short: bool = True) -> None:
        self._rng = random.Random(seed)
        self._length, self._turn, self._always, self._short = length, turn, relative, short
        self._relative = True
        self._at, self._way = [0] * AXES, [1.0, 0.0, 0.0]

    def line(self) -> Line:
        """Return the next line."""
        rng = self._rng
        draw = 1.0 if self._always else rng.random()
        if draw < 0.005:
            text, answer = rng.choice([("G5", 20), ("X1X2", 25), ("G1X", 2), ("G0G1X1", 24)])
            return Line(f"{text}\n".encode(), b"error:%d" % answer, (0,) * AXES)
        way = [way + rng.gauss(0, self._turn) - 0.3 * at / CUBE
               for way, at in zip(self._way, self._at, strict=True)]
        size = sqrt(sum(each * each for each in way)) or 1.0
        self._way = [each / size for each in way]
        move = tuple(round(each * self._length) for each in self._way)
        self._at = [at + by for at, by in zip(self._at, move, strict=True)]
        text = ""
        if draw < (0.3 if self._relative else 0.03) and not self._always:
            self._relative = not self._relative
            text = f"G{90 + self._relative}"
        words = zip("XYZ", move, move if self._relative else self._at, strict=True)
        if self._short:
            text += "".join(f"{name}{_mm(value)}" for name, by, value in words if by)
        else:
            text += "G1" + "".join(f"{name}{value / 1000:.3f}" for name, _, value in words)
        return Line(f"{text}\n".encode(), b"ok", move)


def _mm(um: int) -> str:
    """Return a length in mm, as short as it can be written."""
    whole, rest = divmod(abs(um), 1000)
    return f"{'-' * (um < 0)}{whole or ''}" + (f".{rest:03}".rstrip("0") if rest else "0" * (
        not whole))


class Sender:
    """Sends lines as long as the machine has room for them, by counting what is not yet answered.

    Parameters
    ----------
    machine : Machine
        To which it sends.
    path : Path
        The lines.
    room : int
        Bytes for which it takes the machine to have room.

    Attributes
    ----------
    lines : list of Line
        What was sent.
    used, clocks : int
        Clocks in which there was a byte on the line, and all.
    """

    def __init__(self, machine: Machine, path: Path, room: int = ROOM) -> None:
        self.machine, self.path, self.room = machine, path, room
        self.lines: list[Line] = []
        self.used = self.clocks = 0
        self._answered = len(machine.answers)
        self._first = self._answered
        self._under_way: deque[int] = deque()
        self._next = path.line()
        self._waiting = bytearray()
        self._poll = machine.engine.clock + POLL

    @property
    def answers(self) -> list[bytes]:
        """What came since it began."""
        return self.machine.answers[self._first:]

    def advance(self, command: bytes = b"") -> None:
        """Send some bytes, and first a real-time command; wait for a byte's time if none may be."""
        machine = self.machine
        for _ in range(min(len(machine.answers) - self._answered, len(self._under_way))):
            self._under_way.popleft()
        self._answered = len(machine.answers)
        while (len(self._waiting) < SLICE
               and sum(self._under_way) + len(self._next.text) <= self.room):
            self._under_way.append(len(self._next.text))
            self._waiting += self._next.text
            self.lines.append(self._next)
            self._next = self.path.line()
        if machine.engine.clock >= self._poll:
            self._poll += POLL
            command += b"?"
        begin = machine.engine.clock
        data = command + bytes(self._waiting[:SLICE])
        del self._waiting[:SLICE]
        if data:
            machine.send(data)
        else:
            machine.wait(BYTE)
        self.used += len(data) * BYTE
        self.clocks += machine.engine.clock - begin

    def drain(self, seconds: float = 2) -> None:
        """Send the rest of a line that has begun, and wait for all answers if they come in time."""
        end = self.machine.engine.clock + int(seconds * SETTINGS.clock)
        if self._waiting:
            self.machine.send(bytes(self._waiting))
            self._waiting.clear()
        while len(self.answers) < len(self.lines) and self.machine.engine.clock < end:
            self.machine.wait(10 * BYTE)


def nearest(um: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the nearest steps to places in um, a column an axis; of two the higher."""
    return (2 * um * np.array(PER_MM) + 1000) // 2000


def ordered(moves: Iterable[Sequence[int]]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return where motions by so many um from 0 end, and the steps of each axis, both ways."""
    ends = np.cumsum([(0,) * AXES, *moves], axis=0, dtype=np.int64)
    steps = nearest(ends)
    return steps[-1], np.abs(np.diff(steps, axis=0)).sum(axis=0)
