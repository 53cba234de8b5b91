"""Sessions: play them, and make one that found something short."""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import count

import numpy as np
from numpy.typing import NDArray

from ..engines import CXXRTLEngine, Engine
from .line import Levels
from .pieces import Piece, pieces
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
    seed : int
        Its seed.
    pieces : list of Piece
        What was sent.
    judgement : Judgement
        What was found.
    clocks : int
        How long it took.
    """

    seed: int
    pieces: list[Piece]
    judgement: Judgement
    clocks: int


def fuzz(target: Target, seed: int, amount: int, *, kind: type[Engine] = CXXRTLEngine
         ) -> Iterator[Outcome]:
    """Play sessions with so many bytes in all; the same seed gives the same sessions."""
    design = target.design()
    for number in count():
        if amount <= 0:
            return
        own = seed << 32 | number
        sent = list(pieces(target.dialect, own, min(amount, SESSION), target.period))
        with kind(design) as engine:
            outcome = play(target, engine, sent)
        outcome.seed = own
        yield outcome
        amount -= outcome.judgement.bytes


def play(target: Target, engine: Engine, sent: Sequence[Piece],
         advance: Callable[[int], None] = lambda clocks: None) -> Outcome:
    """Send pieces to a machine that has just been switched on, and look at what it does."""
    line = np.concatenate([piece.levels for piece in sent])
    ends = np.cumsum([len(piece.levels) for piece in sent])
    floods = [(int(end) - len(piece.levels), int(end))
              for piece, end in zip(sent, ends, strict=True) if piece.kind == "flood"]
    engine.set(**target.inputs)
    seen = _played(target, engine, line)
    return Outcome(0, list(sent), target.judge(line, seen, floods), len(line))


def _played(target: Target, engine: Engine, line: Levels) -> Mapping[str, NDArray]:
    parts = []
    for start in range(0, len(line), ROWS):
        rows = engine.play({"rx": line[start:start + ROWS]}, target.outputs)
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
    """
    design, limit = target.design(), time.monotonic() + seconds

    def test(some: Sequence[Piece]) -> Outcome:
        with kind(design) as engine:
            return play(target, engine, some)

    best = test(sent)
    clock = best.judgement.failures[0].clock
    ends = np.cumsum([len(piece.levels) for piece in sent])
    most = [*sent[:int(np.searchsorted(ends, clock)) + 1], _REST]
    cut = test(most)
    best = cut if cut.judgement.failures else best
    size = max(1, len(best.pieces) // 2)
    while time.monotonic() < limit:
        start, before = 0, len(best.pieces)
        while start < len(best.pieces) and time.monotonic() < limit:
            fewer = best.pieces[:start] + best.pieces[start + size:]
            found = test(fewer) if fewer else None
            if found and found.judgement.failures:
                best = found
            else:
                start += size
        if size == 1 and len(best.pieces) == before:
            break
        size = max(1, size // 2)
    return best


_REST = Piece("rest", b"", np.ones(20_000, np.uint8))
