"""Sessions: play them, and make one that found something short."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count

import numpy as np
from numpy.typing import NDArray

from ..engines import CXXRTLEngine, Engine
from ..uart import FRAME, Levels, high
from .inputs import MOST_OWED, OPENING, Input
from .target import Findings, FuzzTarget
from .trajectory import NEVER

__all__ = ["SESSION", "Outcome", "fuzz", "run_session", "shortest"]

#: Bytes of a session. Each begins at power-up.
SESSION = 20_000

#: Clocks that an engine plays at once.
ROWS = 1 << 16


@dataclass
class Outcome:
    """What came of a session.

    Attributes
    ----------
    target : Target
        The machine, as it was built for it.
    seed : int
        Its seed.
    inputs : list of Input
        What was sent.
    findings : Findings
        What was found.
    clocks : int
        How long it took.
    """

    target: FuzzTarget
    seed: int
    inputs: list[Input]
    findings: Findings
    clocks: int


def fuzz(target: FuzzTarget, seed: int, amount: int, *, kind: type[Engine] = CXXRTLEngine
         ) -> Iterator[Outcome]:
    """Play sessions with so many bytes in all; the same seed gives the same sessions.

    Machines that are built in other ways take turns.
    """
    if amount <= 0:
        return
    builds = [target, *target.others]
    designs = [build.design() for build in builds[:-(-amount // SESSION)]]
    for number in count():
        own, build = seed << 32 | number, builds[number % len(builds)]
        with kind(designs[number % len(builds)]) as engine:
            outcome = run_session(build, engine, build.inputs(own, min(amount, SESSION)))
        outcome.seed = own
        yield outcome
        amount -= outcome.findings.bytes
        if amount <= 0:
            return


def run_session(target: FuzzTarget, engine: Engine, sent: Sequence[Input],
         advance: Callable[[int], None] = lambda clocks: None) -> Outcome:
    """Send pieces to a machine that has just been switched on, and look at what it does."""
    inputs = target.stimulus(sent)
    line = inputs["rx"]
    ends = np.cumsum([len(item.levels) for item in sent])
    floods = [(int(end) - len(item.levels), int(end) if end < len(line) else NEVER)
              for item, end in zip(sent, ends, strict=True) if item.kind == "flood"]
    engine.set(**target.levels)
    seen = {**inputs, **_run(target, engine, inputs)}
    return Outcome(target, 0, list(sent), target.check(line, seen, floods), len(line))


def _run(target: FuzzTarget, engine: Engine, inputs: Mapping[str, Levels]) -> Mapping[str, NDArray]:
    parts = []
    for start in range(0, len(inputs["rx"]), ROWS):
        rows = engine.apply({name: levels[start:start + ROWS] for name, levels in inputs.items()},
                           target.outputs)
        parts.append({name: row.astype(np.min_scalar_type(int(row.max(initial=0))))
                      for name, row in rows.items()})
    return {name: np.concatenate([part[name] for part in parts]) for name in target.outputs}


def shortest(target: FuzzTarget, sent: Sequence[Input], seconds: float, *,
             kind: type[Engine] = CXXRTLEngine) -> Outcome:
    """Leave out of what was sent as much as can be, so that something is still found.

    Parameters
    ----------
    target, sent
        What found something.
    seconds : float
        Time for it. What is the shortest by then is given.
    kind : type of Engine
        What plays it.
    """
    design, limit = target.design(), time.monotonic() + seconds

    def test(some: Sequence[Input]) -> Outcome:
        with kind(design) as engine:
            return run_session(target, engine, some)

    best = test(sent)
    clock, what, _ = best.findings.failures[0]
    reached = int(np.searchsorted(np.cumsum([len(item.levels) for item in sent]), clock)) + 1
    for more in (0, 10, 100):
        cut = test(_framed(target, sent, sent[OPENING:reached + more]))
        if any(failure.kind == what for failure in cut.findings.failures):
            best = cut
            break
    alone = test([replace(item, pressed=None) for item in best.inputs])
    if any(failure.kind == what for failure in alone.findings.failures):
        best = alone
    some = best.inputs[OPENING:-1]
    size = max(1, len(some) // 2)
    while time.monotonic() < limit:
        start, before = 0, len(some)
        while start < len(some) and time.monotonic() < limit:
            fewer = some[:start] + some[start + size:]
            found = test(_framed(target, sent, fewer))
            if any(failure.kind == what for failure in found.findings.failures):
                best, some = found, fewer
            else:
                start += size
        if size == 1 and len(some) == before:
            break
        size = max(1, size // 2)
    return best


def _framed(target: FuzzTarget, sent: Sequence[Input], some: Sequence[Input]) -> list[Input]:
    """Put the opening before some pieces, and time for answers behind them."""
    waiting = target.protocol.room // 4 or MOST_OWED
    clocks = waiting * target.protocol.answer * FRAME * target.period
    return [*sent[:OPENING], *some, Input("rest", b"", high(clocks))]
