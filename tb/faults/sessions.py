"""Work for machines on a serial line: what is typed, switches, breaks and resets, as rows."""

import random

from ..fuzz.line import FRAME, levels
from .rows import Row, Rows

__all__ = ["BIT", "positioner_question", "positioner_sessions", "positioner_work",
           "single_question", "single_sessions", "single_work"]

BIT = 16
"""Clocks of a bit of the lines: the shortest there is, so that much happens in few clocks."""

BYTE = FRAME * BIT

OBEYED = 60
"""Clocks in which a line is obeyed, and more."""

REPORT = 40 * BYTE
"""Within so many clocks an answer of the positioner is out, be it behind a report."""

ANSWER = 12 * BYTE
"""And one of `single`."""


class _Session:
    """Writes down what happens on the line, and to other inputs behind it."""

    def __init__(self, *others: int) -> None:
        self.rows: list[Row] = []
        self._others = others
        self._begins = False

    def begin(self) -> None:
        """Let the work go on here after a reset."""
        self._begins = True
        self.hold(4 * BYTE)

    def hold(self, clocks: int, *, waits: bool = False, rx: int = 1, rst: int = 0) -> None:
        self.rows.append(Row((rst, rx, *self._others), clocks, waits, self._begins))
        self._begins = False

    def press(self, *others: int) -> None:
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
        self.hold(clocks, rst=1)
        self.hold(4 * BYTE)


def positioner_work(seed: int, count: int) -> Rows:
    """Give so many pieces of work for the positioner, as a program sends them that waits for it.

    No place is called otherwise on the way, so the positions are the steps from the last reset on.
    At the end the machine rests.
    """
    rng, s = random.Random(seed), _Session(0)

    def near() -> str:
        return "{} {} {}".format(*(rng.randrange(-40, 41) for _ in range(3)))

    def move(way: str) -> int:
        motor = rng.randint(1, 3)
        s.send(f"MOV MOT{motor} {way}\n".encode(), rng.randint(OBEYED, 1000))
        return motor

    s.hold(4 * BYTE)
    s.send(b"CONNECT\n")
    s.rest()
    for _ in range(count):
        kind, point, motor = rng.randrange(12), rng.randint(1, 7), rng.randint(1, 3)
        if kind < 4:
            s.send(f"P {point} {near()}\nGOTO {point}\n".encode())
        elif kind == 4:
            s.send(f"VEL MOT{motor} {rng.randint(80, 200)}\n".encode())
        elif kind == 5:
            s.send(f"STOP MOT{move(rng.choice(['C', 'CC']))}\n".encode())
        elif kind == 6:  # a switch ends it, which is told; away from it is free
            number = move("C")
            s.press(1 << number - 1)
            s.hold(200)
            s.rest(REPORT)
            s.send(f"MOV MOT{number} CC\n".encode())
            s.press(0)
            s.send(f"STOP MOT{number}\n".encode())
        elif kind == 7:  # another point on the way
            s.send(f"P 1 {near()}\nP 2 {near()}\nGOTO 1\nGOTO 2\n".encode())
        elif kind == 8:
            s.send(rng.choice([b"BYE\n", b"GOTO 8\n", b"P 1 2 3\n", b"VEL MOT1 0\n"]), REPORT)
        elif kind == 9:
            move(rng.choice(["C", "CC"]))
            s.send(b"DISCONNECT\nCONNECT\n")
        elif kind == 10:  # the line is low for more than two bytes: all movement ends
            move(rng.choice(["C", "CC"]))
            s.hold(24 * BIT, rx=0)
            s.hold(2 * BYTE)
            s.send(b"\n", REPORT)
        else:
            s.send(f"P {point} {near()}\nGOTO {point}\n".encode(), rng.randint(1, 800))
            s.reset(rng.choice([1, 1, 2, 20]))
            s.send(b"CONNECT\n")
        s.rest()
    s.rest()
    s.hold(OBEYED)
    return Rows.of(s.rows)


def positioner_sessions(seed: int) -> Rows:
    """Give sessions of which each soon moves all motors; work begins one after each reset."""
    rng, s = random.Random(seed), _Session(0)
    for _ in range(40):
        s.begin()
        s.send(b"CONNECT\n")
        for motor in rng.sample(range(1, 4), 3):
            s.send(f"MOV MOT{motor} {rng.choice(['C', 'CC'])}\n".encode(), rng.randint(1, 300))
        s.press(rng.choice([0, 0, rng.getrandbits(3)]))
        s.send(rng.choice([b"POS 5 -6 7\n", b"ORIGIN\n", b"P 1 9 8 7\nGOTO 1\n", b"BYE\n",
                           b"VEL MOT2 77\n", b"STOP MOT1\n", b"DISCONNECT\n"]), 2000)
        s.press(0)
    return Rows.of(s.rows)


def positioner_question() -> tuple[Rows, tuple[int, ...], tuple[int, ...]]:
    """Give lines, how many answers of each kind they have, and where the motors go for them."""
    s = _Session(0)
    s.hold(4 * BYTE)
    s.send(b"CONNECT\nP 3 2 -1 4\nGOTO 3\nBYE\n")
    s.rest(REPORT)
    return Rows.of(s.rows), (1,), (2, -1, 4)


def single_work(seed: int, count: int) -> Rows:
    """Give so many pieces of work for `single`, likewise."""
    rng, s = random.Random(seed), _Session()

    def go() -> bytes:
        return b":x%d\r" % rng.randrange(rng.choice([4, 100]))

    def start() -> None:
        s.hold(ANSWER)
        s.send(b":v9000\r", ANSWER)

    start()
    for _ in range(count):
        kind = rng.randrange(12)
        if kind < 5:
            s.send(go())
        elif kind == 5:
            s.send(b":v%d\r" % rng.randint(3000, 30_000))
        elif kind == 6:  # back on the way
            s.send(go() + go() + go(), 3 * ANSWER)
        elif kind == 7:
            s.send(go() + b":e0\r", rng.randint(OBEYED, 2 * ANSWER))
            s.send(b":e1\r", ANSWER)
        elif kind == 8:
            s.send(rng.choice([b":x?\r", b":v?\r", b":d\r"]), ANSWER)
        elif kind == 9:
            s.send(rng.choice([b":zz\r", b":x\r", b":x10000\r", b":v0\r"]), ANSWER)
        elif kind == 10:
            s.hold(24 * BIT, rx=0)
            s.hold(2 * BYTE)
            s.send(b"\r", ANSWER)
        else:
            s.send(go(), rng.randint(1, 500))
            s.reset(rng.choice([1, 1, 2, 20]))
            start()
        s.rest(ANSWER)
    s.rest()
    s.hold(OBEYED)
    return Rows.of(s.rows)


def single_sessions(seed: int) -> Rows:
    """Give sessions of which each soon moves the motor; work begins one after each reset."""
    rng, s = random.Random(seed), _Session()
    for _ in range(40):
        s.begin()
        s.send(b":v%d\r:x%d\r" % (rng.choice([6000, 20_000, 59_999]), rng.randrange(10_000)),
               rng.randint(1, 2000))
        s.send(rng.choice([b":x0\r", b":e0\r", b":e0\r:e1\r", b":x?\r", b":d\r", b":zz\r"]), 2000)
    return Rows.of(s.rows)


def single_question() -> tuple[Rows, tuple[int, ...], tuple[int, ...]]:
    """Give frames, how many answers of each kind they have, and where the motor goes for them."""
    s = _Session()
    s.hold(4 * BYTE)
    s.send(b":v9000\r:x5\r:zz\r", 6 * ANSWER)
    s.rest()
    return Rows.of(s.rows), (2, 1), (5,)
