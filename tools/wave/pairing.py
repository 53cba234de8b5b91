"""Which signals of two waves are the same."""

from collections import defaultdict
from collections.abc import Sequence

from ..console import UserError
from . import names
from .reader import Signal, Wave

__all__ = ["alike", "paired", "pairs_of"]


def paired(one: Wave, two: Wave) -> list[tuple[Signal, Signal]]:
    """Find the signals that are in both: the longest common end of their paths first.

    An end that several signals of a wave share tells nothing, so these are no pair unless a longer
    end parts them. Those of other widths are no pair either, and signals that are the same in both
    waves by several names are one pair.
    """
    pairs: list[tuple[Signal, Signal]] = []
    left = [[signal for signal in wave.signals if signal.kind != "event"] for wave in (one, two)]
    longest = max((len(signal.parts) for signals in left for signal in signals), default=0)
    for length in range(min(longest, 64), 0, -1):
        ends: list[dict[tuple[str, ...], list[Signal]]] = []
        for signals in left:
            ends.append(defaultdict(list))
            for signal in signals:
                if len(signal.parts) >= length:
                    ends[-1][signal.parts[-length:]].append(signal)
        found = [(ends[0][end][0], ends[1][end][0]) for end in ends[0]
                 if len(ends[0][end]) == 1 and len(ends[1].get(end, [])) == 1
                 and _as_wide(ends[0][end][0], ends[1][end][0])
                 # Amaranth numbers a second signal of a name: step$1 alone tells nothing.
                 and (length > 1 or "$" not in end[0])]
        pairs += found
        for place, taken in enumerate(zip(*found, strict=True)):
            paths = {signal.path for signal in taken}
            left[place] = [signal for signal in left[place] if signal.path not in paths]
    order = {signal.path: place for place, signal in enumerate(one.signals)}
    pairs.sort(key=lambda pair: order[pair[0].path])
    # The same two by other names are compared once.
    return list({(one.id, two.id): (one, two) for one, two in reversed(pairs)}.values())[::-1]


def pairs_of(
    one: Wave, two: Wave, asked: Sequence[str], mapped: Sequence[str]
) -> list[tuple[Signal, Signal]]:
    """Find the pairs that are asked for.

    Parameters
    ----------
    one, two : Wave
        The waves.
    asked : sequence of str
        Names and patterns of signals of the first; all that are in both without them.
    mapped : sequence of str
        Such as ``count=counter_q``.

    Raises
    ------
    UserError
        If one of these signals is not there.
    """
    pairs = []
    for item in mapped:
        here, _, there = item.partition("=")
        if not here or not there:
            raise UserError(f"--map is written A=B, not {item!r}")
        pairs.append((names.one(one, here), names.one(two, there)))
    if mapped and not asked:
        return pairs
    known = paired(one, two)
    if not asked:
        return known
    by_path = {pair[0].path: pair for pair in known}
    for signal in names.several(one, asked):
        if signal.path in by_path:
            pairs.append(by_path[signal.path])
        elif any(pair[0] == signal for pair in pairs):
            continue
        else:
            pairs.append((signal, names.one(two, signal.name)))
    return pairs


def alike(one: Signal, two: Signal) -> bool:
    """Say whether two signals have values that can be compared."""
    return _sort(one) == _sort(two)


def _as_wide(one: Signal, two: Signal) -> bool:
    return one.bits == two.bits or not _sort(one) == _sort(two) == "bits"


def _sort(signal: Signal) -> str:
    return "bits" if signal.kind == "signed" else signal.kind


