"""Model of the thesis' dialect: what its lines are in that of GRBL."""

from collections.abc import Iterable
from dataclasses import replace

from .gcode_line import Item, number

__all__ = ["in_grbl"]

SUPPORTED = {"G": (0, 1, 2, 3, 4, 28, 90, 91, 92), "M": (0, 3, 5)}


def in_grbl(items: Iterable[Item]) -> list[Item]:
    """Return the items that a machine of GRBL's dialect is given for some of the thesis'."""
    given, line = [], []
    for item in items:
        line.append(item)
        if item.kind == "END":
            given += _line(line)
            line = []
    return given


def _line(items: list[Item]) -> list[Item]:
    *words, end = items
    if end.system or any(item.system for item in words):
        return items
    codes = [_code(word) for word in words]
    if codes == [("G", 28)] and not end.status:
        return [*(Item("CHARACTER", True, character) for character in "$H"),
                replace(end, system=True)]
    if codes[:1] == [("G", 28)]:  # which is no word of the line, and spoils the others
        words, codes = words[1:], [("G", None)] * (len(words) - 1)
    changed = [
        replace(word, character="A") if codes[n] == ("G", None) or (
            word.character in SUPPORTED and (codes[n] or ("", 0))[1] not in SUPPORTED[
                word.character]) or codes[n] == ("G", 28)
        else _seconds(word) if word.character == "P" else word for n, word in enumerate(words)]
    moves = any(word.character in "XYZ" for word in words)
    if moves and not end.status and not {("G", 92), ("M", 3), ("M", 5), ("G", None)} & {*codes}:
        changed.append(Item("WORD", False, "M", number=number("3")))
    if ("G", 92) in codes and not moves and not end.status and ("G", None) not in codes:
        changed += [Item("WORD", False, axis, number=number("0")) for axis in "XYZ"]
    return [*changed, end]


def _code(word: Item) -> tuple[str, int | None] | None:
    """Return a letter and a code that is a whole number, if it is one."""
    if word.character not in SUPPORTED:
        return None
    found = word.number
    whole = found["integer"] and not found["overflow"] and found["value"] >= 0
    return (word.character, found["whole"]) if whole else (word.character, -1)


def _seconds(word: Item) -> Item:
    """Take milliseconds as seconds, towards zero."""
    found = word.number
    if found["overflow"] or found["value"] < 0:
        return word
    return replace(word, number={**found, "value": found["value"] // 1000})
