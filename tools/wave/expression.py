"""Conditions over signals, answered: a tree and a wave to the times where it holds.

All signals of a condition are laid on the times at which any of them changes. A value that is
unknown makes a comparison neither true nor false, and a condition holds only where it is true. An
event (``rise``, ``fall``, ``change``) is true at a time, all else from one change to the next.
"""

import operator
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from ..console import UserError
from .names import one
from .parser import COMPARISONS, EDGES, Node
from .radix import Radixes
from .reader import Wave

__all__ = ["Condition", "evaluate"]

_COMPARE: dict[str, Callable] = dict(zip(COMPARISONS, (
    operator.eq, operator.ne, operator.lt, operator.le, operator.gt, operator.ge), strict=True))
_CODE = re.compile(r"/\d+$")
_BITWISE: dict[str, Callable] = {"&": operator.and_, "|": operator.or_, "^": operator.xor}


@dataclass(frozen=True)
class Condition:
    """Where a condition holds.

    Attributes
    ----------
    times : array of int64, shape (n,)
        When one of its signals changes, in ticks.
    holds : array of bool, shape (n,)
        Whether it holds from there, or for an event, at that time.
    event : bool
        Which of these.
    """

    times: NDArray[np.int64]
    holds: NDArray[np.bool_]
    event: bool

    def stretches(self, end: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Give the times where it begins to hold and where it ends to; `end` if it never does.

        Those of an event are the same.
        """
        if self.event:
            times = self.times[self.holds]
            return times, times
        edges = np.diff(self.holds.astype(np.int8), prepend=0)
        begins, ends = self.times[edges == 1], self.times[edges == -1]
        return begins, np.append(ends, [end] * (len(begins) - len(ends))).astype(np.int64)


@dataclass(frozen=True)
class _Column:
    """A part of a condition at every time: values, and whether they are known."""

    kind: Literal["number", "text", "truth", "event"]
    values: NDArray
    known: NDArray[np.bool_]


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
    times = np.unique(np.concatenate([wave.trace(one(wave, name)).times for name in names]))
    answer = _truth(_Evaluation(wave, radixes, times).column(node))
    return Condition(times, answer.values & answer.known, answer.kind == "event")


def _signals(node: Node) -> set[str]:
    if node.what == "signal":
        return {str(node.value)}
    return {name for part in node.parts for name in _signals(part)}


class _Evaluation:
    """Evaluates the parts of a condition at these times."""

    def __init__(self, wave: Wave, radixes: Radixes, times: NDArray[np.int64]) -> None:
        self._wave, self._radixes, self._times = wave, radixes, times

    def column(self, node: Node) -> _Column:
        if node.what == "signal":
            return self._signal(str(node.value))
        if node.what in ("number", "text"):
            values = np.array(node.value, float if isinstance(node.value, float) else object)
            return _Column("number" if node.what == "number" else "text", values,
                           np.array(True))
        parts = [self.column(part) for part in node.parts]
        if node.what == "[]":
            assert isinstance(node.value, tuple)
            return _bits(parts[0], *node.value)
        if node.what in EDGES:
            return self._edge(node.what, parts[0])
        if node.what == "unknown":
            known = _spread(~parts[0].known, len(self._times))
            return _Column("truth", known, np.ones_like(known))
        if node.what in _COMPARE:
            return self._compare(node.what, *parts)
        if node.what in _BITWISE:
            return self._bitwise(node.what, *parts)
        return self._logic(node.what, [_truth(part) for part in parts])

    def _signal(self, name: str) -> _Column:
        signal = one(self._wave, name)
        trace = self._wave.trace(signal)
        rows = trace.rows(self._times)
        seen = rows >= 0
        if not len(trace):
            return _Column("number", np.zeros(len(self._times), np.uint64), seen)
        if trace.kind == "event":
            return _Column("event", np.isin(self._times, trace.times), np.ones(len(rows), bool))
        if trace.kind == "text":
            words = np.array([*trace.words, ""], object)
            values = np.where(trace.codes >= 0, words[trace.codes], trace.numbers.astype(object))
            return _Column("text", values[rows], seen)
        numbers = trace.numbers
        if self._radixes.of(signal) == "signed" and 0 < signal.bits <= 64:
            # The sign is moved to the highest of 64 bits, and back.
            shift = np.int64(64 - signal.bits)
            numbers = numbers.astype(np.uint64).view(np.int64) << shift >> shift
        elif numbers.dtype != object and trace.kind != "real":
            numbers = numbers.astype(np.uint64)
        return _Column("number", numbers[rows], seen & ~trace.unknown[rows])

    def _edge(self, what: str, part: _Column) -> _Column:
        if part.kind == "event":
            raise UserError(f"{what} is of a value or a condition, and not of an event")
        count = len(self._times)
        known = _spread(part.known, count)
        happens = np.zeros(count, bool)
        if what == "change":
            values = _spread(part.values, count)
            happens[1:] = (values[1:] != values[:-1]) | (known[1:] != known[:-1])
        else:
            truth = _truth(part)
            high = _spread(truth.values, count)
            after, before = (high, ~high) if what == "rise" else (~high, high)
            happens[1:] = (before & known)[:-1] & (after & known)[1:]
        return _Column("event", happens, np.ones(count, bool))

    def _compare(self, what: str, left: _Column, right: _Column) -> _Column:
        if {left.kind, right.kind} not in ({"number"}, {"text"}):
            raise UserError(f"{what} cannot compare {_KINDS[left.kind]} with {_KINDS[right.kind]}")
        if left.kind == "text" and what not in ("==", "!="):
            raise UserError(f"names are the same or not: {what} does not compare them")
        values = np.asarray(_COMPARE[what](*_alike(*_uncoded(left.values, right.values))), bool)
        known = left.known & right.known
        return _Column("truth", _spread(values, len(self._times)),
                       _spread(known, len(self._times)))

    def _bitwise(self, what: str, left: _Column, right: _Column) -> _Column:
        if {left.kind, right.kind} != {"number"} or "f" in (
                left.values.dtype.kind, right.values.dtype.kind):
            raise UserError(f"{what} is of two whole numbers; conditions are joined by and, or")
        values = _BITWISE[what](left.values.astype(object), right.values.astype(object))
        return _Column("number", np.asarray(values, object), left.known & right.known)

    def _logic(self, what: str, parts: list[_Column]) -> _Column:
        events = [part.kind == "event" for part in parts]
        if what == "not":
            if events[0]:
                raise UserError("an event has no opposite: not is of a condition")
            return _Column("truth", ~parts[0].values, parts[0].known)
        left, right = parts
        if what == "or" and events[0] != events[1]:
            raise UserError("or joins two events or two conditions, not one of each")
        # What decides alone makes the answer known: false for and, true for or.
        alone = what == "or"
        values = (left.values | right.values) if alone else (left.values & right.values)
        known = (left.known & right.known) | (left.known & (left.values == alone)) | (
            right.known & (right.values == alone))
        return _Column("event" if any(events) else "truth", _spread(values, len(self._times)),
                       _spread(known, len(self._times)))


_KINDS = {"number": "a number", "text": "a name", "truth": "a condition", "event": "an event"}


def _truth(part: _Column) -> _Column:
    """Take a number as a condition: it is not 0."""
    if part.kind in ("truth", "event"):
        return part
    if part.kind == "text":
        raise UserError('a name is no condition: compare it, as in state == "REST"')
    return _Column("truth", np.asarray(part.values != 0, bool), part.known)


def _bits(part: _Column, high: int, low: int) -> _Column:
    if part.kind != "number" or part.values.dtype.kind == "f":
        raise UserError(f"only whole numbers have bits, not {_KINDS[part.kind]}")
    values = part.values.astype(object) >> low & (1 << high - low + 1) - 1
    return _Column("number", np.asarray(values, object), part.known)


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
