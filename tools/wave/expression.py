"""Conditions over signals, evaluated: from an expression tree and a wave to times.

All signals of a condition are sampled at the times at which any of them changes. A comparison with
an unknown value is neither true nor false, and a condition holds only where it is true. An event
(``rise``, ``fall``, ``change``) is true at one time, any other condition from one change to the
next.
"""

import operator
import re
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..console import UserError
from .parser import COMPARISONS, EDGES, Node
from .radix import Radixes
from .reader import Wave
from .source import Column, Source
from .trace import moments, unlike

__all__ = ["Condition", "evaluate"]

_COMPARE: dict[str, Callable] = dict(zip(COMPARISONS, (
    operator.eq, operator.ne, operator.lt, operator.le, operator.gt, operator.ge), strict=True))
_CODE = re.compile(r"/\d+$")
_BITWISE: dict[str, Callable] = {"&": operator.and_, "|": operator.or_, "^": operator.xor}
_NEVER = np.zeros(0, np.int64)


@dataclass(frozen=True)
class Condition:
    """Where a condition holds.

    Attributes
    ----------
    times : array of int64, shape (n,)
        When it becomes true or false, in ticks; or when the event happens.
    holds : array of bool, shape (n,)
        Whether it is true from then on.
    event : bool
        Whether it is an event.
    """

    times: NDArray[np.int64]
    holds: NDArray[np.bool_]
    event: bool

    def stretches(self, end: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return the times at which it becomes true, and false; `end` if it stays true.

        For an event both are equal.
        """
        if self.event:
            return self.times, self.times
        begins, ends = self.times[self.holds], self.times[~self.holds]
        return begins, np.append(ends, [end] * (len(begins) - len(ends))).astype(np.int64)


def evaluate(node: Node, wave: Wave, radixes: Radixes) -> Condition:
    """Answer a condition.

    Parameters
    ----------
    node : Node
        The condition.
    wave : Wave
        Where to look.
    radixes : Radixes
        Which signals go below 0.

    Raises
    ------
    UserError
        If it names what is not there, or compares what cannot be compared.
    """
    names = sorted(_signals(node))
    if not names:
        raise UserError("the condition names no signal")
    evaluation = _Evaluation({name: Source.of(wave, radixes, name) for name in names})
    begun = [source.trace for source in evaluation.sources.values() if len(source.trace)]
    blocks = moments(begun, min(int(trace.times[0]) for trace in begun),
                     max(int(trace.times[-1]) for trace in begun)) if begun else [_NEVER]
    times, holds = [_NEVER], [np.zeros(0, bool)]
    before, held, event = _NEVER, False, False
    for block in blocks:
        # An edge compares with the row before, which is therefore evaluated again.
        evaluation.times = np.append(before, block)
        answer = _truth(evaluation.column(node))
        event = answer.kind == "event"
        now = (answer.values & answer.known)[len(before):]
        # Of millions of rows, only those that change the result are kept.
        changed = now if event else now != np.append(held, now)[:-1]
        times.append(block[changed])
        holds.append(now[changed])
        before, held = block[-1:], bool(now[-1:].any())
    return Condition(np.concatenate(times), np.concatenate(holds), event)


def _signals(node: Node) -> set[str]:
    if node.what == "signal":
        return {str(node.value)}
    return {name for part in node.parts for name in _signals(part)}


class _Evaluation:
    """Evaluates the parts of a condition at some times."""

    def __init__(self, sources: dict[str, Source]) -> None:
        self.sources, self.times = sources, _NEVER

    def column(self, node: Node) -> Column:
        if node.what == "signal":
            return self.sources[str(node.value)].column(self.times)
        if node.what in ("number", "text"):
            values = np.array(node.value, float if isinstance(node.value, float) else object)
            return Column("number" if node.what == "number" else "text", values,
                           np.array(True))
        parts = [self.column(part) for part in node.parts]
        if node.what == "[]":
            assert isinstance(node.value, tuple)
            return _bits(parts[0], *node.value)
        if node.what in EDGES:
            return self._edge(node.what, parts[0])
        if node.what == "unknown":
            known = _spread(~parts[0].known, len(self.times))
            return Column("truth", known, np.ones_like(known))
        if node.what in _COMPARE:
            return self._compare(node.what, *parts)
        if node.what in _BITWISE:
            return self._bitwise(node.what, *parts)
        return self._logic(node.what, [_truth(part) for part in parts])

    def _edge(self, what: str, part: Column) -> Column:
        if part.kind == "event":
            raise UserError(f"{what} is of a value or a condition, and not of an event")
        count = len(self.times)
        known = _spread(part.known, count)
        happens = np.zeros(count, bool)
        if what == "change":
            values = _spread(part.values, count)
            happens[1:] = unlike(values[1:], values[:-1]) | (known[1:] != known[:-1])
        else:
            truth = _truth(part)
            high = _spread(truth.values, count)
            after, before = (high, ~high) if what == "rise" else (~high, high)
            happens[1:] = (before & known)[:-1] & (after & known)[1:]
        return Column("event", happens, np.ones(count, bool))

    def _compare(self, what: str, left: Column, right: Column) -> Column:
        if {left.kind, right.kind} not in ({"number"}, {"text"}):
            raise UserError(f"{what} cannot compare {_KINDS[left.kind]} with {_KINDS[right.kind]}")
        if left.kind == "text" and what not in ("==", "!="):
            raise UserError(f"names are the same or not: {what} does not compare them")
        values = np.asarray(_COMPARE[what](*_alike(*_uncoded(left.values, right.values))), bool)
        known = left.known & right.known
        return Column("truth", _spread(values, len(self.times)),
                       _spread(known, len(self.times)))

    def _bitwise(self, what: str, left: Column, right: Column) -> Column:
        if {left.kind, right.kind} != {"number"} or "f" in (
                left.values.dtype.kind, right.values.dtype.kind):
            raise UserError(f"{what} is of two whole numbers; conditions are joined by and, or")
        values = _BITWISE[what](left.values.astype(object), right.values.astype(object))
        return Column("number", np.asarray(values, object), left.known & right.known)

    def _logic(self, what: str, parts: list[Column]) -> Column:
        events = [part.kind == "event" for part in parts]
        if what == "not":
            if events[0]:
                raise UserError("an event has no opposite: not is of a condition")
            return Column("truth", ~parts[0].values, parts[0].known)
        left, right = parts
        if what == "or" and events[0] != events[1]:
            raise UserError("or joins two events or two conditions, not one of each")
        # What decides alone makes the answer known: false for and, true for or.
        alone = what == "or"
        values = (left.values | right.values) if alone else (left.values & right.values)
        known = (left.known & right.known) | (left.known & (left.values == alone)) | (
            right.known & (right.values == alone))
        return Column("event" if any(events) else "truth", _spread(values, len(self.times)),
                       _spread(known, len(self.times)))


_KINDS = {"number": "a number", "text": "a name", "truth": "a condition", "event": "an event"}


def _truth(part: Column) -> Column:
    """Take a number as a condition: it is not 0."""
    if part.kind in ("truth", "event"):
        return part
    if part.kind == "text":
        raise UserError('a name is no condition: compare it, as in state == "REST"')
    return Column("truth", np.asarray(part.values != 0, bool), part.known)


def _bits(part: Column, high: int, low: int) -> Column:
    if part.kind != "number" or part.values.dtype.kind == "f":
        raise UserError(f"only whole numbers have bits, not {_KINDS[part.kind]}")
    values = _cut(part.values, high, low)
    if part.unsure is None:
        return Column("number", values, part.known)
    unsure = _cut(part.unsure, high, low)
    return Column("number", values, np.asarray(unsure == 0, bool), unsure)


def _cut(values: NDArray, high: int, low: int) -> NDArray:
    """Extract the bits from `high` down to `low`."""
    return np.asarray(values.astype(object) >> low & (1 << high - low + 1) - 1, object)


def _alike(left: NDArray, right: NDArray) -> tuple[NDArray | int | str, NDArray | int | str]:
    """Make two columns comparable: numpy compares an array with Python's own number exactly."""
    one, other = (a.item() if not a.ndim else a for a in (left, right))
    if isinstance(one, np.ndarray) and isinstance(other, np.ndarray) and one.dtype != other.dtype:
        return one.astype(object), other.astype(object)
    return one, other


def _uncoded(left: NDArray, right: NDArray) -> tuple[NDArray, NDArray]:
    """Leave out the codes of states, REST/0, where they are compared with a name without one."""
    for given, names in ((left, right), (right, left)):
        if not given.ndim and names.ndim and isinstance(given.item(), str) and (
                not _CODE.search(given.item())):
            short = {name: _CODE.sub("", str(name)) for name in set(names.tolist())}
            plain = np.array([short[name] for name in names.tolist()], object)
            return (given, plain) if given is left else (plain, given)
    return left, right


def _spread(values: NDArray, count: int) -> NDArray:
    return np.broadcast_to(values, (count,))
