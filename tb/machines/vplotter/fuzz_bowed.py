"""Bowed lines of `vplotter` in fuzzing: what leads to one, and how each is checked.

A bowed line is seen at the pins alone: the pen touches, and the strings change while nothing
moves that is planned, as in a homing cycle, in which the pen is off. Where the line ends is that of
the command, by the lengths of two strings; nothing is taken from the gateware.
"""

import random
import re
from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from math import hypot

import numpy as np
from numpy.typing import NDArray

from tb.fuzz.inputs import Input
from tb.fuzz.target import Seen
from tb.fuzz.trajectory import Failure
from tb.uart import high, levels

from . import SHORT

__all__ = ["ANEW", "BOWED", "Bow", "bows", "ends", "sequence", "without_pen"]

BOWED = replace(SHORT, bowed=True)
"""The build: as the default one, but for its lines."""

ANEW = b"~\x18" + bytes(400) + b"\n$X\n"
"""A reset, bytes of value 0, which are skipped, for the time in which it brakes; unlocked."""

REST = round(hypot(*SHORT.rest) * SHORT.steps_of_string)
"""Steps of either string at the place of rest, which is below the middle between the pulleys."""

WITHIN = (b"", b"", b"", b":S0\n:S1\n:S2\n", b"?", b"!~", b"\x85", b":S0\n", b":H\n", b":P0\n",
          b":P1\n", b":I00080008\n", b":F00080008\n", b"G91X.1\nG90\n", b":S1\nM3\n", b"$G\n", ANEW,
          ANEW, b"\x84:S0\n~$X\n" + ANEW)
"""What comes while a line is drawn. An open door ends it, and so does a reset."""

DRAWING, OUTCOMES = b"Drawing.", (b"Line drawn.", b"Stopped", b"Refused")
"""How texts begin: as a line begins, and as it has ended."""

Said = Sequence[tuple[int, bytes]]
Steps = tuple[NDArray[np.int64], NDArray[np.int64]]
"""Clocks of the steps of a string, and which way they go."""


def sequence(rng: random.Random, period: int) -> Input:
    """Give a piece in which it homes, most often, goes to a start point, and draws a line."""
    line, pressed = [], []

    def send(data: bytes, clocks: int, switches: int = 0, first: int = 0, last: int = 0) -> None:
        """Send bytes and wait; switches are on from a clock of that to another one."""
        bits = np.concatenate([levels(data, period), high(clocks)])
        sent.append(data)
        line.append(bits)
        pressed.append(np.zeros(len(bits), np.uint8))
        pressed[-1][len(bits) - clocks:][first:last] = switches

    def place(size: float) -> bytes:
        across, below = (round(each + rng.uniform(-size, size)) for each in SHORT.rest)
        return b"%04d%04d" % (min(max(across, 0), SHORT.wall_width),
                              min(max(below, SHORT.least_y), SHORT.wall_height))

    sent: list[bytes] = []
    if rng.random() < 0.7:
        send(ANEW, 2000)
    if rng.random() < 0.5:
        send(rng.choice([b":H\n", b"$H\n"]), 0)
        for switch in (1, 2):
            first = rng.randint(600, 3000)
            last = first + rng.randint(200, 2000)
            send(b"", last + 400, switch, first, last)
        send(b"", 3000 + REST * SHORT.pace)
    for _ in range(rng.choice([1, 1, 2, 3])):
        send(b":I" + place(rng.choice([0, 1, 2, 8])) + b"\n", rng.choice([50_000, 70_000, 120_000]))
        ends = rng.random() < 0.2
        if ends:  # an end switch is to end the line
            send(b"$21=1\n", 4000)
        send(b":F" + place(rng.choice([1, 8, 8])) + b"\n", rng.randint(1, 16_000))
        switch = (rng.choice([1, 2, 3]), *sorted(rng.sample(range(6000), 2))) if ends else ()
        send(rng.choice(WITHIN), rng.choice([6000, 20_000, 30_000]), *switch)
        if ends:
            send(ANEW + b"$21=0\n", 6000)
    return Input("sequence", b"".join(sent), np.concatenate(line), np.concatenate(pressed))


@dataclass(frozen=True)
class Bow:
    """A bowed line, from the clock in which the pen touches to that in which it is off again.

    Attributes
    ----------
    begin, end : int
        These clocks.
    drawn : bool or None
        Whether it was drawn to its end; None where it is not said.
    """

    begin: int
    end: int
    drawn: bool | None

    def failures(self, steps: Mapping[str, Steps], said: Said) -> Iterator[Failure]:
        """Check the steps of both strings, and what is said."""
        own = {name: _within(each, self.begin, self.end) for name, each in steps.items()}
        for name, (clocks, turns) in own.items():
            if len(turns) and (turns != turns[0]).any():
                yield Failure(int(clocks[0]), "bow", f"the {name} string goes to and fro")
        fast, slow = sorted((clocks for clocks, _ in own.values()), key=len, reverse=True)
        if (np.diff(fast) != SHORT.pace).any():
            yield Failure(int(fast[0]), "bow", f"its steps are not {SHORT.pace} clocks apart")
        if not np.isin(slow, fast).all():
            yield Failure(int(fast[0]), "bow", "the motors do not step together")
        if self.drawn:
            due = np.arange(1, len(fast) + 1) * (len(slow) / len(fast))
            if (abs(np.searchsorted(slow, fast, "right") - due) > 0.5 + 1e-9).any():
                yield Failure(int(fast[0]), "bow", "the steps of a string are not spread evenly")
        texts = [text for clock, text in said if clock > self.begin
                 and text.startswith((DRAWING, *OUTCOMES))]
        if texts and texts[0] != DRAWING:
            yield Failure(self.begin, "answer", f"a line is drawn, and it says {texts[0]!r}")
        alarms = [clock for clock, text in said if text.startswith(b"ALARM")]
        ended = bisect_left(alarms, self.begin)
        if self.drawn is False and (ended == len(alarms) or alarms[ended] > self.end + LONG):
            yield Failure(self.end, "bow", "a line has ended early, and there is no alarm")


LONG = 100_000
"""Clocks in which an alarm is said, behind whatever else is."""


def bows(seen: Seen, steps: Mapping[str, Steps], said: Said, few: int) -> list[Bow]:
    """Return the bowed lines of a session: of more than a few steps that a stop has left over."""
    found = []
    edges = np.flatnonzero(np.diff(seen["pen"].astype(np.int8), prepend=0, append=0))
    for begin, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        own = max(len(_within(each, begin, end)[0]) for each in steps.values())
        if own <= few or seen["moving"][begin - 1:end].any():
            continue
        outcome = next((text for clock, text in said
                        if clock > begin and text.startswith(OUTCOMES)), None)
        if end == len(seen["pen"]):  # the session ends within it
            outcome = None
        found.append(Bow(begin, end, None if outcome is None else outcome.startswith(OUTCOMES[0])))
    return found


def without_pen(seen: Seen, said: Said) -> Iterator[Failure]:
    """Find lines that are said to be drawn while the pen has never touched."""
    before = 0
    for clock, text in said:
        if text.startswith(OUTCOMES):
            if text.startswith(OUTCOMES[0]) and not seen["pen"][before:clock].any():
                yield Failure(clock, "pen", "a line is drawn, and the pen did not touch")
            before = clock


def ends(commands: Sequence[tuple[int, bytes]], said: Said, bow: Bow) -> set[tuple[int, int]]:
    """Return the lengths of both strings at the ends of lines that may be this one.

    Parameters
    ----------
    commands : sequence of tuple
        Lines of the host, and the clock in which each has come.
    said : sequence of tuple
        Lines of the machine, and the clock in which each begins.
    bow : Bow
        The line: its command came behind what was said of the one before.
    """
    before = max((clock for clock, text in said
                  if clock < bow.begin and text.startswith(OUTCOMES)), default=0)
    found = set()
    for clock, text in commands:
        if before < clock < bow.begin and (match := re.fullmatch(rb":[Ff](\d{4})(\d{4})", text)):
            x, y = map(int, match.groups())
            found.add((round(hypot(x, y) * SHORT.steps_of_string),
                       round(hypot(SHORT.wall_width - x, y) * SHORT.steps_of_string)))
    return found


def _within(steps: Steps, begin: int, end: int) -> Steps:
    first, last = np.searchsorted(steps[0], [begin, end])
    return steps[0][first:last], steps[1][first:last]
