"""Which signal is meant: a whole path, its end, or a pattern."""

import difflib
import re
from collections import Counter
from collections.abc import Iterable, Sequence
from fnmatch import fnmatchcase

from ..console import UserError
from .reader import Signal, Wave

__all__ = ["ending", "found", "heads", "is_pattern", "listed", "matching", "one", "several"]

DEEPEST = 16
"""Parts of a path in which ends are looked for; beyond, signals have their whole path."""

SHOWN = 6
"""Names that an error tells at most."""


def one(wave: Wave, name: str) -> Signal:
    """Find the signal of that name.

    The end of its path is enough, such as ``x.count``, if no other signal ends so. Where several
    do, the one whose scope holds all the others is meant: the port of a design rather than those of
    its parts.

    Raises
    ------
    UserError
        If there is none, or none that is meant above others.
    """
    wanted = _parts(name)
    hits = ending(wave, name)
    if not hits:
        raise UserError(f"{wave.path} has no signal {name!r}{_near(wave, name)}")
    highest = min(hits, key=lambda signal: len(signal.parts))
    scope = highest.parts[:-len(wanted)]
    others = [signal for signal in hits if signal.id != highest.id]
    if all(len(other.parts) > len(highest.parts) and other.parts[:len(scope)] == scope
           for other in others):
        return highest
    raise UserError(f"{name!r} is one of {listed(signal.path for signal in hits)}: "
                    "say more of the path")


def ending(wave: Wave, name: str) -> list[Signal]:
    """Return the signals whose path ends so."""
    wanted = _parts(name)
    return [signal for signal in wave.signals if signal.parts[-len(wanted):] == wanted]


def found(wave: Wave, name: str) -> bool:
    """Say whether there is a signal of this name or like this pattern."""
    return bool(ending(wave, name) or matching(wave, name))


def several(wave: Wave, names: Sequence[str]) -> list[Signal]:
    """Find the signals of these names and patterns, in their order and each once.

    Raises
    ------
    UserError
        If one of them is not there.
    """
    chosen: dict[str, Signal] = {}
    for name in names:
        if is_pattern(wave, name):
            hits = matching(wave, name)
            if not hits:
                raise UserError(f"{wave.path} has no signal like {name!r}")
            chosen |= {signal.path: signal for signal in hits}
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
    """Return for each signal the shortest end of its path that no other here has."""
    lengths = range(1, DEEPEST)
    ends = Counter(signal.parts[-n:] for signal in signals for n in lengths
                   if n < len(signal.parts))
    return [".".join(next((signal.parts[-n:] for n in lengths if ends[signal.parts[-n:]] == 1),
                          signal.parts)) for signal in signals]


def _parts(name: str) -> tuple[str, ...]:
    return tuple(name.replace("\\", "").split("."))


def is_pattern(wave: Wave, name: str) -> bool:
    """Say whether a name is a pattern. A bracket may also belong to the name of a signal."""
    if re.search(r"[*?]", name):
        return True
    return "[" in name and not ending(wave, name)


def _near(wave: Wave, name: str) -> str:
    """Suggest signals that may be meant."""
    last = _parts(name)[-1].lower()
    # Amaranth numbers a second signal of the same name, count$3: who errs, errs in the first.
    names = {signal.name.lower(): signal.path for signal in reversed(wave.signals)
             if "$" not in signal.name}
    near = difflib.get_close_matches(last, list(names), 3)
    near += [known for known in names if last and last in known and known not in near]
    if not near:
        return f"; python -m tools.wave list {wave.path} shows what it has"
    return f"; is it {listed(names[known] for known in near)}?"


def listed(names: Iterable[str]) -> str:
    """Tell some names, each once, and how many there are beyond these."""
    unique = list(dict.fromkeys(names))
    more = len(unique) - SHOWN
    return ", ".join(unique[:SHOWN]) + (f" and {more} more" if more > 0 else "")
