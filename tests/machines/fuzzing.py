# amaranth: UnusedElaboratable=no

"""Short sessions on the line of a machine, with a mistake in its gateware or without."""

from collections.abc import Mapping

import numpy as np
import pytest
from amaranth import Mux

from tb.engines import AmaranthEngine
from tb.fuzz import run_session
from tb.fuzz.inputs import Input
from tb.fuzz.target import Findings
from tb.mistake import Mistake
from tb.registry import fuzz_targets
from tb.uart import FRAME, high, levels

__all__ = ["BIT", "BREAK", "drifts", "kinds", "mistakes_are_found", "run"]

BIT = 16
BREAK = (FRAME - 2) * BIT - BIT // 2 + BIT // 16 + 1 + FRAME * BIT
"""Clocks of the shortest break that begins with the second data bit of a byte."""


def run(name: str, text: bytes, pressed: int = 0, low: int = 0, other: bool = False,
        mistake: Mistake | None = None) -> Findings:
    """Send some bytes, wait for as long as some more would take, and check what came of it.

    Parameters
    ----------
    name : str
        The machine's.
    text : bytes
        What to send.
    pressed : int
        Limit switches that are pressed for a moment behind these bytes, a bit each.
    low : int
        Clocks for which the line is low then, from the second data bit of another byte on.
    other : bool
        Run the machine built in another way.
    mistake : Mistake, optional
        What is wrong in its gateware.
    """
    target = fuzz_targets()[name]
    if other:
        target = target.others[0]
    sent = [Input("rest", b"", high(99 + 3 * FRAME * BIT)),
            Input("bytes", text, levels(text, BIT)),
            Input("rest", b"", high(100)),
            Input("rest", b"", high(100), np.full(100, pressed, np.uint8)),
            Input("break", b"", np.concatenate([
                levels(b"\xFF", BIT)[:2 * BIT * (low > 0)], np.zeros(low, np.uint8)])),
            Input("rest", b"", high(35 * FRAME * BIT))]
    design = target.design() if mistake is None else mistake.planted(target.design())
    with AmaranthEngine(design) as engine:
        return run_session(target, engine, sent).findings


def kinds(name: str, text: bytes, **options) -> set[str]:
    """Return the kinds of failure that :func:`run` finds."""
    return {failure.kind for failure in run(name, text, **options).failures}


def mistakes_are_found(name: str, begin: bytes, mistakes: Mapping[str, tuple[bytes, str, Mistake]]
                       ) -> type:
    """Return the tests that each mistake in a machine's gateware is found, and no other.

    Parameters
    ----------
    name : str
        The machine's.
    begin : bytes
        What every session begins with.
    mistakes : mapping of str to tuple of bytes, str and Mistake
        A few bytes, the kind of failure that is found with them, and the mistake; those behind the
        first take long.
    """
    class Tests:
        def test_nothing_is_found_where_there_is_none(self):
            texts = dict.fromkeys(text for text, *_ in mistakes.values())
            found = run(name, begin + b"".join(texts), low=BREAK)
            assert found.failures == [] and found.steps

        @pytest.mark.parametrize("mistake", [
            pytest.param(mistake, marks=[pytest.mark.long] * (number > 0))
            for number, mistake in enumerate(mistakes)])
        def test_is_found_with_few_bytes(self, mistake):
            text, kind, planted = mistakes[mistake]
            assert kind in kinds(name, begin + text, mistake=planted)

    return Tests


def drifts(motor: str) -> Mistake:
    """With each step the next comes 40 parts of the modulus sooner."""
    return Mistake(f"{motor}rate.accumulator", lambda right, at: Mux(
        at(f"{motor}rate.due") & at(f"{motor}rate.moved"), right + 40, right))
