"""Which signals of two waves correspond."""

from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ..console import UserError
from . import names
from .reader import Signal, Wave

__all__ = ["Pair", "Pairing", "alike", "paired", "pairing_of"]

Pair = tuple[Signal, Signal]
"""The signal of each wave."""


@dataclass(frozen=True)
class Pairing:
    """Signals of two waves, paired, and those without a partner.

    Attributes
    ----------
    same : list of Pair
        Signals to compare.
    other_width : list of Pair
        Signals that correspond but have different widths.
    only : pair of list of Signal
        Signals of the first wave only, and of the second.
    """

    same: list[Pair]
    other_width: list[Pair]
    only: tuple[list[Signal], list[Signal]]


def paired(one: Wave, two: Wave) -> Pairing:
    """Find the signals that are in both: the longest common end of their paths first.

    An end that several signals of a wave share is ambiguous, so these are no pair unless a longer
    end is unique. Those of equal width are paired first. Signals that correspond by several names
    are one pair, and an additional name in one wave is not missing in the other. Events have no
    values and are left out.
    """
    everything = _Leftover(one, two)
    same = everything.take(_as_wide)
    other_width = everything.take(lambda *_: True)
    taken = [{signal.id for signal in side}
             for side in zip(*same, *other_width, strict=True)] or [set(), set()]
    here, there = ([signal for signal in side if signal.id not in ids]
                   for side, ids in zip(everything.left, taken, strict=True))
    return Pairing(_once(same), _once(other_width), (_unique(here), _unique(there)))


class _Leftover:
    """The signals of two waves that have no partner yet."""

    def __init__(self, one: Wave, two: Wave) -> None:
        self.left = [[signal for signal in wave.signals if signal.kind != "event"]
                     for wave in (one, two)]
        self._order = {signal.path: place for place, signal in enumerate(one.signals)}

    def take(self, fit: Callable[[Signal, Signal], bool]) -> list[Pair]:
        """Take out the pairs that fit, in the order of the first wave."""
        pairs: list[Pair] = []
        longest = max((len(signal.parts) for side in self.left for signal in side), default=0)
        for length in range(min(longest, 64), 0, -1):
            here, there = (_ends(side, length) for side in self.left)
            found = [(signals[0], there[end][0]) for end, signals in here.items()
                     if len(signals) == 1 == len(there.get(end, ()))
                     and fit(signals[0], there[end][0])
                     # Amaranth numbers a second signal of a name: step$1 alone is ambiguous.
                     and (length > 1 or "$" not in end[0])]
            pairs += found
            for place, taken in enumerate(zip(*found, strict=True)):
                paths = {signal.path for signal in taken}
                self.left[place] = [signal for signal in self.left[place]
                                    if signal.path not in paths]
        return sorted(pairs, key=lambda pair: self._order[pair[0].path])


def _ends(signals: Sequence[Signal], length: int) -> dict[tuple[str, ...], list[Signal]]:
    ends = defaultdict(list)
    for signal in signals:
        if len(signal.parts) >= length:
            ends[signal.parts[-length:]].append(signal)
    return ends


def pairing_of(one: Wave, two: Wave, requested: Sequence[str], mapped: Sequence[str]) -> Pairing:
    """Pair the requested signals.

    Parameters
    ----------
    one, two : Wave
        The waves.
    requested : sequence of str
        Names and patterns of signals of either; all signals without them, unless some are mapped.
    mapped : sequence of str
        Such as ``count=counter_q``. These are the same whatever their widths.

    Raises
    ------
    UserError
        If one of these signals is in neither wave, or a mapped one not in its wave.
    """
    mapping: list[Pair] = []
    for item in mapped:
        here, _, there = item.partition("=")
        if not here or not there:
            raise UserError(f"--map is written A=B, not {item!r}")
        mapping.append((names.one(one, here), names.one(two, there)))
    if not requested:
        return Pairing(mapping, [], ([], [])) if mapping else paired(one, two)
    found = _named(one, two, requested, mapping)
    return Pairing(mapping + found.same, found.other_width, found.only)


def _named(one: Wave, two: Wave, requested: Sequence[str], mapping: Sequence[Pair]) -> Pairing:
    """Find the named signals that are not mapped."""
    known = paired(one, two)
    # A name belongs to the first wave if it is in it; a pattern to both.
    here = names.several(one, [name for name in requested
                               if names.found(one, name) or not names.found(two, name)])
    there = names.several(two, [name for name in requested if names.found(two, name) and (
        names.is_pattern(one, name) or not names.found(one, name))])
    ids = [{signal.id for signal in side} - {pair[place].id for pair in mapping}
           for place, side in enumerate((here, there))]

    def wanted(pairs: Sequence[Pair]) -> list[Pair]:
        return [pair for pair in pairs if pair[0].id in ids[0] or pair[1].id in ids[1]]

    same, other_width = wanted(known.same), wanted(known.other_width)
    alone: list[Signal] = []
    paired_here, paired_there = (
        {pair[place].id for pair in (*known.same, *known.other_width, *mapping)}
        for place in (0, 1))
    for signal in here:
        if signal.id in paired_here:
            continue
        like = {other.id: other for other in names.ending(two, signal.name)
                if other.id not in paired_there}
        if len(like) > 1:
            raise UserError(f"{signal.path} matches {names.listed(s.path for s in like.values())}: "
                            "--map A=B names one")
        for other in like.values():
            (same if _as_wide(signal, other) else other_width).append((signal, other))
        if not like:
            alone.append(signal)
    return Pairing(same, other_width, (alone, [
        signal for signal in there
        if signal.id not in paired_there | {pair[1].id for pair in (*same, *other_width)}]))


def alike(one: Signal, two: Signal) -> bool:
    """Return whether two signals have values that can be compared."""
    return _sort(one) == _sort(two)


def _as_wide(one: Signal, two: Signal) -> bool:
    return one.bits == two.bits or not _sort(one) == _sort(two) == "bits"


def _sort(signal: Signal) -> str:
    return "bits" if signal.kind == "signed" else signal.kind


def _once(pairs: Sequence[Pair]) -> list[Pair]:
    """Return each pair once, however many names its signals have."""
    return list({(one.id, two.id): (one, two) for one, two in reversed(pairs)}.values())[::-1]


def _unique(signals: Sequence[Signal]) -> list[Signal]:
    return list({signal.id: signal for signal in reversed(signals)}.values())[::-1]
