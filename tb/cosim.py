"""Cosimulation: equal stimulus for several runners, and all outputs compared in every clock."""

import functools
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from .compare import Difference, first_difference
from .engines import UnknownLevelError
from .runners import Runner
from .stimulus import Stimulus, cut

__all__ = ["Finding", "Outcome", "Tally", "compare", "lockstep"]


@dataclass
class Tally:
    """Clocks that a runner has made, and the seconds that they took."""

    clocks: int = 0
    seconds: float = 0.0

    @property
    def speed(self) -> float:
        """Clocks per second."""
        return self.clocks / self.seconds if self.seconds else 0.0


@dataclass(frozen=True)
class Finding:
    """A difference between engines.

    Attributes
    ----------
    engine : str
        The engine that differs from most; of two, the second.
    reference : str
        The engine that it was compared with.
    difference : Difference
        Clock and outputs, with their levels in the reference and in the engine. An unknown level
        is -1.
    also : tuple of str
        Other engines that differ in the same clock.
    """

    engine: str
    reference: str
    difference: Difference
    also: tuple[str, ...] = ()

    def __str__(self) -> str:
        parts = [f"{name} is {_level(seen)}, not {_level(expected)}"
                 for name, (expected, seen) in self.difference.outputs.items()]
        also = f" ({', '.join(self.also)} too)" if self.also else ""
        return (f"{self.engine}{also} differs from {self.reference} at clock "
                f"{self.difference.clock}: {', '.join(parts)}")


def _level(value: int) -> str:
    return "X" if value < 0 else f"{value:#x}"


@dataclass
class Outcome:
    """Result of a comparison.

    Attributes
    ----------
    tallies : dict of str to Tally
        By runner.
    checksum : int
        Over every output of every clock, 64 bits. Equal for every engine and computer.
    finding : Finding or None
        The first difference.
    """

    tallies: dict[str, Tally]
    checksum: int = 0
    finding: Finding | None = None


def compare(runners: Mapping[str, Runner], stimulus: Stimulus, outputs: Sequence[str]
            ) -> Finding | None:
    """Run a stimulus on runners at power-up; return their first difference."""
    return lockstep(runners, [stimulus], outputs).finding


def lockstep(
    runners: Mapping[str, Runner], blocks: Iterable[Stimulus], outputs: Sequence[str], *,
    most: Mapping[str, int] | None = None, advance: Callable[[int], object] = lambda clocks: None,
) -> Outcome:
    """Run a stimulus on all runners and compare every output of every clock.

    Parameters
    ----------
    runners : mapping of str to Runner
        At least two, at power-up.
    blocks : iterable of mappings of str to array
        The stimulus.
    outputs : sequence of str
        The compared outputs.
    most : mapping of str to int, optional
        Clocks after which a runner drops out.
    advance : callable
        Called with the number of clocks done.
    """
    most = most or {}
    outcome = Outcome({name: Tally() for name in runners})
    clock = 0
    for block in _pieces(blocks, sorted(set(most.values()))):
        rows = len(next(iter(block.values())))
        seen = {}
        for name, runner in runners.items():
            if clock >= most.get(name, clock + 1):
                continue
            begun = time.perf_counter()
            try:
                seen[name] = runner.apply(block, outputs)
            except UnknownLevelError as error:
                seen[name] = _Unknown(error.output, error.clock - clock, error.before)
            outcome.tallies[name].seconds += time.perf_counter() - begun
            outcome.tallies[name].clocks += rows
        if found := _judge(seen):
            at = Difference(clock + found.difference.clock, found.difference.outputs)
            outcome.finding = replace(found, difference=at)
            return outcome
        outcome.checksum += _sum(clock, next(iter(seen.values())), outputs)
        outcome.checksum %= 1 << 64
        clock += rows
        advance(rows)
    return outcome


def _pieces(blocks: Iterable[Stimulus], ends: Sequence[int]) -> Iterator[Stimulus]:
    """Split blocks where a runner drops out."""
    clock = 0
    for block in blocks:
        rows = len(next(iter(block.values())))
        cuts = [0, *(end - clock for end in ends if 0 < end - clock < rows), rows]
        for start, stop in zip(cuts, cuts[1:], strict=False):
            yield cut(block, start, stop)
        clock += rows


@dataclass(frozen=True)
class _Unknown:
    """Stands for outputs with an X."""

    output: str
    clock: int
    before: Mapping[str, NDArray]


def _judge(seen: Mapping[str, Mapping[str, NDArray] | _Unknown]) -> Finding | None:
    """Find the first difference, and the engine that differs."""
    reference = next((name for name, rows in seen.items() if not isinstance(rows, _Unknown)), None)
    if reference is None:
        lost, engine = min(((rows, name) for name, rows in seen.items()
                            if isinstance(rows, _Unknown)), key=lambda item: item[0].clock)
        return Finding(engine, engine, Difference(lost.clock, {lost.output: (-1, -1)}))
    found: dict[str, Difference] = {}
    expected = seen[reference]
    assert not isinstance(expected, _Unknown)
    for name, rows in seen.items():
        if isinstance(rows, _Unknown):
            before = {name: expected[name][:rows.clock] for name in rows.before}
            known = int(expected[rows.output][rows.clock])
            found[name] = first_difference(before, rows.before) or Difference(
                rows.clock, {rows.output: (known, -1)})
        elif name != reference and (difference := first_difference(expected, rows)):
            found[name] = difference
    if not found:
        return None
    clock = min(difference.clock for difference in found.values())
    odd = [name for name, difference in found.items() if difference.clock == clock]
    outputs = found[odd[0]].outputs
    if len(odd) > 1 and len(odd) == len(seen) - 1 and all(found[n].outputs == outputs for n in odd):
        turned = {name: (there, here) for name, (here, there) in outputs.items()}
        return Finding(reference, odd[0], Difference(clock, turned))
    return Finding(odd[0], reference, found[odd[0]], tuple(odd[1:]))


_FACTOR = 0x9E37_79B9_7F4A_7C15


@functools.lru_cache(4)
def _powers(rows: int, outputs: int) -> NDArray[np.uint64]:
    step = np.full(rows, pow(_FACTOR, outputs, 1 << 64), np.uint64)
    step[:1] = 1
    return np.multiply.accumulate(step)


def _sum(clock: int, seen: Mapping[str, NDArray] | _Unknown, outputs: Sequence[str]) -> int:
    """Sum all outputs, weighted by powers, so that the split into blocks has no influence."""
    assert not isinstance(seen, _Unknown)
    powers = _powers(len(seen[outputs[0]]), len(outputs))
    total = 0
    for place, name in enumerate(outputs):
        share = int(np.dot(seen[name].astype(np.uint64), powers))
        total += share * pow(_FACTOR, clock * len(outputs) + place, 1 << 64)
    return total
