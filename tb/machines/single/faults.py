# amaranth: UnusedElaboratable=no

"""Fault injection into `single`: its motors, what a reset keeps, and work."""

import random

from fresa.machines.single import Single, SingleTiming
from tb import boards
from tb.faults.rows import Rows
from tb.faults.session import BIT, BYTE, OBEYED, Session, sessions_and_fuzz
from tb.faults.target import Coils, FaultTarget, Line

from .fuzz import FUZZ
from .fuzz.session import PHASES

__all__ = ["FAULTS", "target"]

ANSWER = 12 * BYTE
"""Within so many clocks an answer is out."""

OF_MEMORIES = "lines.fetch__data", "texts.fetch__data"
"""Registers that memories have at their outputs: block RAM gives something in every clock."""


def target() -> FaultTarget:
    """Return the machine, with every time shortened.

    A reset does not set the row and the coils of its motor, and the times since the last step; nor
    what its memories gave last, which nothing asks for before it is given anew.
    """
    timing = SingleTiming.real(clock=48_000, baud=3000)
    assert timing.bit == BIT
    design = boards.component("single", Single(timing=timing, greeting=b"!\r\n",
                                               help_text=b"?\r\n"))
    return FaultTarget(
        "single", design,
        (Coils("the motor", "move position", "coils", PHASES, "enable"),),
        idle=("moving", 0), fault="fault", origin={"rst": 1},
        kept=("driver.row", "driver.coils", "driver.rest", "accumulator", *OF_MEMORIES),
        work=lambda seed: _work(seed, 30),
        work_to_reset=sessions_and_fuzz(list(design.inputs), FUZZ, sessions),
        gap=6000, window=6000, timeout=20_000, line=Line(BIT, b"oe", _question()))


FAULTS = {None: target}
"""Its builds for fault injection; it has no guard."""


def _work(seed: int, count: int) -> Rows:
    """Give so many pieces of work, as a program sends them that waits for the machine.

    At the end the machine rests.
    """
    rng, s = random.Random(seed), Session()

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
    return s.written


def sessions(seed: int) -> Rows:
    """Give sessions of which each soon moves the motor; work begins one after each reset."""
    rng, s = random.Random(seed), Session()
    for _ in range(40):
        s.begin()
        s.send(b":v%d\r:x%d\r" % (rng.choice([6000, 20_000, 59_999]), rng.randrange(10_000)),
               rng.randint(1, 2000))
        s.send(rng.choice([b":x0\r", b":e0\r", b":e0\r:e1\r", b":x?\r", b":d\r", b":zz\r"]), 2000)
    return s.written


def _question() -> tuple[Rows, tuple[int, ...], tuple[int, ...]]:
    """Give frames, how many answers of each kind they have, and where the motor goes for them."""
    s = Session()
    s.hold(4 * BYTE)
    s.send(b":v9000\r:x5\r:zz\r", 6 * ANSWER)
    s.rest()
    return s.written, (2, 1), (5,)
