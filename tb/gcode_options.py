"""What people choose of a machine that reads G-code, out of the text of options."""

import re
from collections.abc import Sequence
from fractions import Fraction
from pathlib import Path

from fresa.protocol.stored_program import MAX_PROGRAM

from .models.gcode_language import Interpreter, RefusedLine, words

__all__ = ["read_number", "read_others", "read_program", "read_startup"]

LONGEST_NUMBER = 24
"""Characters of a number that is given as an option."""


def read_number(name: str, text: str) -> Fraction:
    """Return a number above 0 of an option, or raise `ValueError`."""
    try:
        value = _fraction(text)
    except (ValueError, ZeroDivisionError) as error:
        raise ValueError(f"{name} must be a number such as 250 or 26.667, not {text!r}") from error
    if value <= 0:
        raise ValueError(f"{name} must be above 0, not {text}")
    return value


def read_others(text: str) -> tuple[tuple[int, Fraction], ...]:
    """Return settings by number, of such as ``22=1,130=300``."""
    found: dict[int, Fraction] = {}
    for part in filter(None, text.split(",")):
        name, _, value = part.replace("$", "").partition("=")
        try:
            number, given = int(name), _fraction(value)
        except (ValueError, ZeroDivisionError) as error:
            raise ValueError(f"--settings must be such as 22=1,130=300, not {part!r}") from error
        if number in found:
            raise ValueError(f"--settings has ${number} twice")
        found[number] = given
    return tuple(found.items())


def _fraction(text: str) -> Fraction:
    """Return a number, unless it is one that takes for ever or has no place in a message."""
    if len(text) > LONGEST_NUMBER or not re.fullmatch(r"[^eE]*([eE][-+]?\d{1,2})?", text):
        raise ValueError("too large or small, or too long")
    return Fraction(text)


def _language(steps_per_mm: Sequence[Fraction], *, probing: bool) -> Interpreter:
    """Return the model of the language of a machine with these steps of X, Y and Z."""
    return Interpreter(probing=probing,
                       steps_per_metre=[round(each * 1000) for each in steps_per_mm])


def _plain(line: str) -> str:
    """Return a line without its comments."""
    return re.sub(r"\([^)]*(?:\)|$)|;.*", "", line)


def read_program(name: str, dialect: str, *, startup: Sequence[str], probing: bool,
                 steps_per_mm: Sequence[Fraction]) -> bytes:
    """Return the program in a file, without comments, after the model of the language took it.

    Startup lines have come before.
    """
    if not name:
        return b""
    try:
        text = Path(name).read_text(encoding="latin-1")  # a comment may have any bytes
    except OSError as error:
        raise ValueError(f"--program {name} cannot be read: {error.strerror}") from error
    language, lines = _language(steps_per_mm, probing=probing and dialect == "grbl"), []
    for line in startup:
        language.line(words(line))
    for number, line in enumerate(text.splitlines(), 1):
        kept = _plain(line).strip(" \t")
        if kept in ("", "%"):
            continue
        if bad := re.search(r"[^ -~]", kept.replace("\t", " ")):
            raise ValueError(f"--program {name}, line {number}: {bad[0]!r} may not be in a line")
        try:
            language.line(words(kept, dialect))
        except RefusedLine as refused:
            raise ValueError(f"--program {name}, line {number}: the machine would refuse {line!r} "
                             f"with error:{refused.args[0]}") from refused
        lines.append(f"{kept}\n")
    data = "".join(lines).encode()
    if not 0 < len(data) <= MAX_PROGRAM:
        raise ValueError(f"--program {name} has {len(data)} bytes without comments: from 1 to "
                         f"{MAX_PROGRAM} can be stored")
    return data


def read_startup(lines: Sequence[str], dialect: str, *, probing: bool,
                 steps_per_mm: Sequence[Fraction]) -> tuple[str, ...]:
    """Return startup lines as the machine would keep them, if it would take them."""
    language, kept = _language(steps_per_mm, probing=probing), []
    for line in lines:
        kept.append(re.sub(r"[ \t]", "", _plain(line)).upper())
        try:
            language.line(words(kept[-1], dialect))
        except RefusedLine as refused:
            raise ValueError(f"--startup: the machine would refuse {line!r} with "
                             f"error:{refused.args[0]}") from refused
    return tuple(kept) if any(kept) else ()
