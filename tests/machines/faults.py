"""Resets of a machine with a mistake in it, and of one on a line without any."""

from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from tb.faults.rows import Rows
from tb.faults.session import BIT
from tb.faults.target import FaultTarget
from tb.faults.upsets import Trial
from tb.faults.verdicts import WrongReset
from tb.mistake import Mistake
from tb.uart import decode

__all__ = ["check_sessions", "resets_are_checked", "run_with_fault"]


def run_with_fault(mistake: Mistake, make: Callable[[], FaultTarget], rows: Rows, gap: int
           ) -> tuple[int, WrongReset | None]:
    """Reset a machine with a mistake in it; return the clocks that it took, and what is wrong."""
    machine = make()
    machine = replace(machine, design=mistake.planted(machine.design))
    rng = np.random.default_rng(1)
    with closing(Trial(machine)) as trial:
        trial.load(rows)
        questions = [machine.line is not None and place % 5 == 0 for place in range(500)]
        clocks, _, wrong = trial.resets(rng.integers(1, gap, 500).tolist(), [1] * 500, questions)
    return clocks, wrong


def resets_are_checked(make: Callable[[], FaultTarget], sessions: Callable[[int], Rows],
                       mistakes: Mapping[str, tuple[Mistake, str]], *, gap: int = 6000,
                       mark: pytest.MarkDecorator = pytest.mark.compiler) -> type:
    """Return the tests that mistakes in the resets of a machine on a line are found, and no other.

    Parameters
    ----------
    make : callable
        Makes the machine.
    sessions : callable
        Makes sessions of a seed.
    mistakes : mapping of str to tuple of Mistake and str
        Each with what is found, or how that begins; those behind the first take long.
    gap : int
        Clocks from reset to reset in which its motors move; mistakes have up to half as many more.
    mark : mark
        Of the tests, each of which compiles the machine or one with a mistake.
    """
    @pytest.mark.compiler
    class Tests:
        @mark
        @pytest.mark.parametrize("mistake", [
            pytest.param(mistake, marks=[pytest.mark.long] * (number > 0))
            for number, mistake in enumerate(mistakes)])
        def test_mistakes_are_found(self, mistake):
            planted, found = mistakes[mistake]
            _, wrong = run_with_fault(planted, make, sessions(1), gap * 3 // 2)
            assert wrong is not None and wrong.what.startswith(found)

        @mark
        def test_none_without_a_mistake(self):
            with closing(Trial(make())) as trial:
                trial.load(sessions(2))
                clocks, steps, wrong = trial.resets([gap] * 40, [3] * 40, [False, True] * 20)
                assert wrong is None
                assert clocks > 40 * (gap + 3) and steps > 1000

    return Tests


def check_sessions(sessions: Callable[[int], Rows], first: bytes, end: bytes) -> None:
    """Check that sessions are whole lines, and that each begins with the line at rest."""
    rows = sessions(3)
    begins = np.flatnonzero(rows.begins)
    for begin, stop in pairwise([*begins, len(rows)]):
        line = np.repeat(rows.levels[begin:stop, 1], rows.clocks[begin:stop])
        received = bytes(each.byte for each in decode(line.astype(np.uint8), BIT))
        assert received.startswith(first) and received.endswith(end)
    assert len(begins) == 40
