"""Sessions: play them, and make one that found something short."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import count

import numpy as np
from numpy.typing import NDArray

from ..engines import CXXRTLEngine, Engine
from .line import CUT, FRAME, Levels, high
from .pieces import MOST_OWED, OPENING, Piece, pieces
from .presses import pressing
from .targets import Judgement, Target

__all__ = ["SESSION", "Outcome", "fuzz", "play", "shortest"]

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
    pieces : list of Piece
        What was sent.
    judgement : Judgement
        What was found.
    clocks : int
        How long it took.
    """

    target: Target
    seed: int
    pieces: list[Piece]
    judgement: Judgement
    clocks: int


def fuzz(target: Target, seed: int, amount: int, *, kind: type[Engine] = CXXRTLEngine
         ) -> Iterator[Outcome]:
    """Play sessions with so many bytes in all; the same seed gives the same sessions.

    Machines that are built in other ways take turns.
    """
    if amount <= 0:
        return
    ways = [target, *target.others]
    designs = [way.design() for way in ways[:-(-amount // SESSION)]]
    for number in count():
        own, way = seed << 32 | number, ways[number % len(ways)]
        sent = pieces(way.dialect, own, min(amount, SESSION), way.period)
        if way.dialect.switches:
            sent = pressing(sent, way.dialect.switches, own, way.period)
        with kind(designs[number % len(ways)]) as engine:
            outcome = play(way, engine, list(sent))
        outcome.seed = own
        yield outcome
        amount -= outcome.judgement.bytes
        if amount <= 0:
            return


def play(target: Target, engine: Engine, sent: Sequence[Piece],
         advance: Callable[[int], None] = lambda clocks: None) -> Outcome:
    """Send pieces to a machine that has just been switched on, and look at what it does."""
    line = np.concatenate([piece.levels for piece in sent])
    ends = np.cumsum([len(piece.levels) for piece in sent])
    floods = [(int(end) - len(piece.levels), int(end) if end < len(line) else CUT)
              for piece, end in zip(sent, ends, strict=True) if piece.kind == "flood"]
    inputs = {"rx": line}
    if target.dialect.switches:
        inputs["limits"] = np.concatenate([
            np.zeros(len(piece.levels), np.uint8) if piece.pressed is None else piece.pressed
            for piece in sent])
    engine.set(**target.inputs)
    seen = {**inputs, **_played(target, engine, inputs)}
    return Outcome(target, 0, list(sent), target.judge(line, seen, floods), len(line))


def _played(target: Target, engine: Engine, inputs: Mapping[str, Levels]) -> Mapping[str, NDArray]:
    parts = []
    for start in range(0, len(inputs["rx"]), ROWS):
        rows = engine.apply({name: levels[start:start + ROWS] for name, levels in inputs.items()},
                           target.outputs)
        parts.append({name: row.astype(np.min_scalar_type(int(row.max(initial=0))))
                      for name, row in rows.items()})
    return {name: np.concatenate([part[name] for part in parts]) for name in target.outputs}


def shortest(target: Target, sent: Sequence[Piece], seconds: float, *,
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

    def test(some: Sequence[Piece]) -> Outcome:
        with kind(design) as engine:
            return play(target, engine, some)

    best = test(sent)
    clock, what, _ = best.judgement.failures[0]
    reached = int(np.searchsorted(np.cumsum([len(piece.levels) for piece in sent]), clock)) + 1
    for more in (0, 10, 100):
        cut = test(_framed(target, sent, sent[OPENING:reached + more]))
        if any(failure.kind == what for failure in cut.judgement.failures):
            best = cut
            break
    alone = test([replace(piece, pressed=None) for piece in best.pieces])
    if any(failure.kind == what for failure in alone.judgement.failures):
        best = alone
    some = best.pieces[OPENING:-1]
    size = max(1, len(some) // 2)
    while time.monotonic() < limit:
        start, before = 0, len(some)
        while start < len(some) and time.monotonic() < limit:
            fewer = some[:start] + some[start + size:]
            found = test(_framed(target, sent, fewer))
            if any(failure.kind == what for failure in found.judgement.failures):
                best, some = found, fewer
            else:
                start += size
        if size == 1 and len(some) == before:
            break
        size = max(1, size // 2)
    return best


def _framed(target: Target, sent: Sequence[Piece], some: Sequence[Piece]) -> list[Piece]:
    """Put the opening before some pieces, and time for answers behind them."""
    waiting = target.dialect.room // 4 or MOST_OWED
    clocks = waiting * target.dialect.answer * FRAME * target.period
    return [*sent[:OPENING], *some, Piece("rest", b"", high(clocks))]
