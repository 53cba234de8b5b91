"""Signal names to signals: a whole path, the end of one, or a pattern."""

import difflib
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from fnmatch import fnmatchcase

from ..console import UserError
from .reader import Signal, Wave

__all__ = ["ending", "found", "heads", "is_pattern", "listed", "matching", "one", "several"]

DEEPEST = 16
"""Longest ends of paths that are compared, in parts; a longer path is written whole."""

SHOWN = 6
"""Most names that an error message lists."""


def one(wave: Wave, name: str) -> Signal:
    """Find the signal of that name.

    The end of its path is enough, such as ``x.count``, if it is unique. Of several matches the one
    whose scope contains all the others is chosen: the port of a design rather than those of its
    parts.

    Raises
    ------
    UserError
        If there is no match, or several and none that contains the others.
    """
    wanted = _parts(name)
    matches = ending(wave, name)
    if not matches:
        raise UserError(f"{wave.path} has no signal {name!r}{_near(wave, name)}")
    highest = min(matches, key=lambda signal: len(signal.parts))
    scope = highest.parts[:-len(wanted)]
    others = [signal for signal in matches if signal.id != highest.id]
    if all(len(other.parts) > len(highest.parts) and other.parts[:len(scope)] == scope
           for other in others):
        return highest
    raise UserError(f"{name!r} matches {listed(signal.path for signal in matches)}: "
                    "give more of the path")


def ending(wave: Wave, name: str) -> list[Signal]:
    """Return the signals whose path ends in this name."""
    wanted = _parts(name)
    return [signal for signal in wave.signals if signal.parts[-len(wanted):] == wanted]


def found(wave: Wave, name: str) -> bool:
    """Return whether any signal has this name or matches this pattern."""
    return bool(ending(wave, name) or matching(wave, name))


def several(wave: Wave, names: Sequence[str]) -> list[Signal]:
    """Find the signals of these names and patterns, in this order and each once.

    Raises
    ------
    UserError
        If one of them has no match.
    """
    chosen: dict[str, Signal] = {}
    for name in names:
        if is_pattern(wave, name):
            matches = matching(wave, name)
            if not matches:
                raise UserError(f"{wave.path} has no signal like {name!r}")
            chosen |= {signal.path: signal for signal in matches}
        else:
            signal = one(wave, name)
            chosen[signal.path] = signal
    return list(chosen.values())


def matching(wave: Wave, pattern: str) -> list[Signal]:
    """Return the signals whose path, or its end, matches a pattern with ``*``, ``?``, ``[``."""
    pattern = pattern.replace("\\", "")
    return [signal for signal in wave.signals
            if fnmatchcase(signal.path, pattern) or fnmatchcase(signal.path, f"*.{pattern}")]


def heads(signals: list[Signal]) -> list[str]:
    """Return for each signal the shortest end of its path that is unique among them."""
    lengths = range(1, DEEPEST)
    ends = Counter(signal.parts[-n:] for signal in signals for n in lengths
                   if n < len(signal.parts))
    return [".".join(next((signal.parts[-n:] for n in lengths if ends[signal.parts[-n:]] == 1),
                          signal.parts)) for signal in signals]


def _parts(name: str) -> tuple[str, ...]:
    return tuple(name.replace("\\", "").split("."))


def is_pattern(wave: Wave, name: str) -> bool:
    """Return whether a name is a pattern. A bracket may also belong to the name of a signal."""
    if re.search(r"[*?]", name):
        return True
    return "[" in name and not ending(wave, name)


def _near(wave: Wave, name: str) -> str:
    """Return suggestions for a name without a match."""
    last = _parts(name)[-1].lower()
    # Amaranth numbers a second signal of the same name, count$3: only the first is suggested.
    names = {signal.name.lower(): signal.path for signal in reversed(wave.signals)
             if "$" not in signal.name}
    near = difflib.get_close_matches(last, list(names), 3)
    near += [known for known in names if last and last in known and known not in near]
    if not near:
        return f"; python -m tools.wave list {wave.path} lists its signals"
    return f"; is it {listed(names[known] for known in near)}?"


def listed(names: Iterable[str]) -> str:
    """Join some names, each once, and the number of the others."""
    unique = list(dict.fromkeys(names))
    more = len(unique) - SHOWN
    return ", ".join(unique[:SHOWN]) + (f" and {more} more" if more > 0 else "")
