"""The model of the G-code language against LinuxCNC's interpreter."""

import math
import subprocess
from collections.abc import Iterable, Iterator
from itertools import islice
from textwrap import dedent

import pytest

from tests.tb import linuxcnc
from tests.tb.gcode_programs import PROGRAMS, REFUSED
from tests.tb.linuxcnc import Expanded, Move, expand, packaged, run, written

pytestmark = pytest.mark.linuxcnc

STEP = 1 / 80
"""In mm."""

PRINTED = 0.5e-4
"""LinuxCNC prints so exactly, in the program's units; four numbers are added for a position."""

MOST_MOVES = 300
"""Of each program of LinuxCNC's."""


def moving(moves: Iterable[Move]) -> Iterator[Move]:
    """Give movements without lines that go nowhere: G28 makes one in LinuxCNC."""
    at = (0.0, 0.0, 0.0)
    for move in moves:
        if move.plane is not None or math.dist(move.end, at) > PRINTED:
            yield move
        at = move.end


def check(ours: Move, theirs: Move, tolerance: float) -> None:
    """Compare a movement of both."""
    assert ours.end == pytest.approx(theirs.end, abs=tolerance)
    assert ours.plane == theirs.plane and theirs.turns == 1
    assert ours.clockwise == theirs.clockwise
    assert ours.centre == pytest.approx(theirs.centre, abs=2 * tolerance)


def lines(text: str) -> list[str]:
    """Return the lines of a program, without those that begin and end its file."""
    return [line for line in text.splitlines() if line.strip() not in ("", "%")]


def check_moves(ours: Expanded, theirs: Expanded, text: str) -> int:
    """Compare the movements of a program; return how many there are."""
    assert not ours.refused and not theirs.refused
    tolerance = 4 * PRINTED * (25.4 if "G20" in text else 1)
    made = list(zip(moving(ours.moves), moving(theirs.moves), strict=True))
    for mine, other in made:
        check(mine, other, tolerance)
        if "G93" not in text and mine.feed is not None:
            assert mine.feed == pytest.approx(other.feed, abs=0.01)
    return len(made)


@pytest.mark.parametrize("name", PROGRAMS)
def test_both_make_the_same_of_a_program(name):
    text = dedent(PROGRAMS[name]).strip() + "\n"
    assert check_moves(run(lines(text)), expand(text), text) > 1


def test_both_make_the_same_of_linuxcnc_s_programs_that_have_codes_of_grbl_alone():
    moves = []
    for path in packaged():
        text = path.read_text(encoding="latin-1")
        ours = run(lines(text))
        if not ours.refused and ours.moves:
            moves.append(check_moves(ours, expand(path), text))
    assert max(moves) > 200


def test_both_refuse_what_is_wrong():
    taken = []
    for line in REFUSED:
        before = "G21 G90\n"
        ours, theirs = run([before, line]), expand(f"{before}{line}\nM2\n")
        taken += [(line, who) for who, found in [("ours", ours), ("theirs", theirs)]
                  if not found.refused]
    assert not taken


@pytest.mark.long
def test_programs_of_linuxcnc_end_where_they_should():
    """Expanded by LinuxCNC to movements, and written as plain lines."""
    programs, arcs = 0, set()
    for path in packaged():
        try:
            expanded = expand(path)
        except subprocess.TimeoutExpired:  # it waits for something, in a loop
            continue
        moves = list(islice(expanded.moves, MOST_MOVES))
        if not moves:  # a subroutine, or for a machine that has more
            continue
        programs += 1
        found = run(written(moves))
        assert not found.refused and len(found.moves) == len(moves), path
        for ours, theirs in zip(found.moves, moves, strict=True):
            assert math.dist(ours.end, theirs.end) < STEP, path
            check(ours, theirs, 1e-6)
            arcs.add((theirs.plane, theirs.clockwise))
    assert programs >= 50 and len(arcs) == 7  # lines, and both turns in three planes


def test_the_page_is_of_what_is_refused():
    assert linuxcnc.PAGE.read_text(encoding="utf-8") == linuxcnc.page()
