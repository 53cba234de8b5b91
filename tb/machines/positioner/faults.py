# amaranth: UnusedElaboratable=no

"""Fault injection into `positioner`: its motors, what a reset keeps, and work."""

import random

from fresa.machines.positioner import Positioner, PositionerTiming
from tb import boards
from tb.faults.rows import Rows
from tb.faults.session import BIT, BYTE, OBEYED, Session, sessions_and_fuzz
from tb.faults.target import FaultTarget, Line, Pulses

from .fuzz import FUZZ

__all__ = ["FAULTS", "target"]

REPORT = 40 * BYTE
"""Within so many clocks an answer is out, be it behind a report."""

OF_MEMORIES = "lines.fetch__data", "texts.fetch__data", "points.read__data"
"""Registers that memories have at their outputs: block RAM gives something in every clock."""


def target() -> FaultTarget:
    """Return the machine, with the lowest of clocks.

    A reset does not set the pins of its driver modules and the timers of these; the times since the
    last step, nor which way it went, and what play there is still to take up; the switches as they
    were seen; nor what its memories gave last, which nothing asks for before it is given anew.
    """
    timing = PositionerTiming(clock=100 * BIT, baud=100, top_speed=200, width=2, low=3, setup=2,
                              hold=4,
                          settle=30, report=20_000)
    design = boards.component("positioner", Positioner(timing=timing))
    times = timing.width, timing.low, timing.setup, timing.hold
    return FaultTarget(
        "positioner", design,
        tuple(Pulses(name, f"{name} position", bit, times) for bit, name in enumerate("xyz")),
        idle=("moving", 0), fault="fault", origin={"rst": 1},
        kept=("driver.step_pin", "driver.direction_pin", "driver.enable_pin", "driver.wait",
              "accumulator",
              "backlash.way", "backlash.left", "switches.since", "switches.before",
              "switches.divider.count", "started", *OF_MEMORIES),
        work=lambda seed: _work(seed, 20),
        work_to_reset=sessions_and_fuzz(list(design.inputs), FUZZ, sessions),
        gap=12_000, window=12_000, timeout=20_000, line=Line(BIT, b"!", _question()))


FAULTS = {None: target}
"""Its builds for fault injection; it has no guard."""


def _work(seed: int, count: int) -> Rows:
    """Give so many pieces of work, as a program sends them that waits for the machine.

    No place is called otherwise on the way, so the positions are the steps from the last reset on.
    At the end the machine rests.
    """
    rng, s = random.Random(seed), Session(0)

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
    return s.written


def sessions(seed: int) -> Rows:
    """Give sessions of which each soon moves all motors; work begins one after each reset."""
    rng, s = random.Random(seed), Session(0)
    for _ in range(40):
        s.begin()
        s.send(b"CONNECT\n")
        for motor in rng.sample(range(1, 4), 3):
            s.send(f"MOV MOT{motor} {rng.choice(['C', 'CC'])}\n".encode(), rng.randint(1, 300))
        s.press(rng.choice([0, 0, rng.getrandbits(3)]))
        s.send(rng.choice([b"POS 5 -6 7\n", b"ORIGIN\n", b"P 1 9 8 7\nGOTO 1\n", b"BYE\n",
                           b"VEL MOT2 77\n", b"STOP MOT1\n", b"DISCONNECT\n"]), 2000)
        s.press(0)
    return s.written


def _question() -> tuple[Rows, tuple[int, ...], tuple[int, ...]]:
    """Give lines, how many answers of each kind they have, and where the motors go for them."""
    s = Session(0)
    s.hold(4 * BYTE)
    s.send(b"CONNECT\nP 3 2 -1 4\nGOTO 3\nBYE\n")
    s.rest(REPORT)
    return s.written, (1,), (2, -1, 4)
