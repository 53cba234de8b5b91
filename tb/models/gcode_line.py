"""Models of the line of a G-code machine: line buffer and reader of words."""

import re
from collections import deque
from dataclasses import dataclass, field
from decimal import ROUND_HALF_UP, Decimal, localcontext

__all__ = ["GOOD", "DAMAGED", "GCodeReaderModel", "Item", "LineBufferModel", "number",
           "read_lines"]

GOOD, DAMAGED = 0x100, 0x102
"""Ends of lines, as items of a line."""

OPENED = re.compile(r"\$(J|N[01])=")
"""What is before the words of a system line that has some."""


class LineBufferModel:
    """A line buffer, clock by clock.

    Attributes
    ----------
    waiting : deque of int
        Items in the FIFO.
    offered : int, optional
        The item behind it.
    """

    def __init__(self, *, depth: int = 128, silence: int | None = None) -> None:
        self.depth, self.silence = depth, silence
        self.reset()

    def reset(self) -> None:
        """Reset."""
        self.waiting: deque[int] = deque()
        self.offered: int | None = None
        self.addressed = False  # in the last clock, what is first in the FIFO
        self.owed = 0
        self.damaged = self.begun = self.after_cr = False
        self.quiet = 0

    @property
    def free(self) -> int:
        """Room in the FIFO."""
        return self.depth - len(self.waiting)

    def outputs(self, byte: int | None) -> dict[str, int | None]:
        """Return the outputs, where `byte`, and 0x100 with an error, is offered or None."""
        room, pays = bool(self.free), bool(self.free and self.owed)
        item = None if pays else self._item(byte)
        return {"bytes_ready": int(not pays), "free": self.free,
                "overflow": int(item is not None and not room),
                "items_valid": int(self.offered is not None), "items_payload": self.offered}

    def _item(self, byte: int | None) -> int | None:
        """Return what a byte, or its absence, puts into the line."""
        if byte is None:
            over = self.silence is not None and self.quiet >= self.silence - 1
            return (DAMAGED if self.damaged else GOOD) if over and self.begun else None
        if byte == ord("\n") and self.after_cr:
            return None
        if byte & 0xFF in b"\r\n":
            return DAMAGED if self.damaged or byte >> 8 else GOOD
        return None if self.damaged or byte >> 8 else byte

    def clock(self, byte: int | None, taken: bool) -> None:
        """Advance one clock."""
        free, addressed = self.free, bool(self.waiting)
        leaves = self.addressed and (self.offered is None or taken)
        if self.offered is not None and taken:
            self.offered = None
        if leaves:
            self.offered = self.waiting.popleft()
        self.addressed = addressed and not leaves
        if free and self.owed:
            self.owed -= 1
            self.waiting.append(DAMAGED)
            self.quiet += 1
            return
        item = self._item(byte)
        if item is not None and free:
            self.waiting.append(item)
        elif item is not None and item >> 8:
            self.owed = min(self.owed + 1, (1 << self.depth.bit_length()) - 1)
        if item is not None and item >> 8:
            self.damaged = self.begun = False
        elif byte is not None and byte & 0xFF not in b"\r\n":
            self.begun = True
            self.damaged |= bool(byte >> 8 or not free)
        if byte is not None or item is not None:
            self.after_cr = byte is None or byte & 0xFF == ord("\r")
        self.quiet = 0 if byte is not None else self.quiet + 1


def number(text: str, *, width: int = 44, decimals: int = 6) -> dict[str, int]:
    """Return what the text of a number is; `value` is undefined where it overflows."""
    with localcontext() as context:
        context.prec = len(text) + 20
        exact = abs(Decimal(text))
        value = int((exact * 10**decimals).to_integral_value(ROUND_HALF_UP))
        whole = int(exact)
        cents = int(exact * 100) % 100
        return {
            "value": -value if text.startswith("-") else value,
            "overflow": int(value >= 1 << width - 1),
            "whole": whole if whole < min(1 << 24, 1 << width - 1) else (1 << 24) - 1,
            "hundredths": cents,
            "exact": int(exact * 100 == int(exact * 100)),
            "integer": int(exact == whole),
        }


@dataclass
class Item:
    """What the reader gives: the kind is ``WORD``, ``CHARACTER`` or ``END``."""

    kind: str
    system: bool
    character: str = ""
    status: int = 0
    number: dict[str, int] = field(default_factory=dict)


class GCodeReaderModel:
    """A reader of G-code, clock by clock.

    Attributes
    ----------
    offered : Item, optional
        The offered item.
    seen : list of str
        All characters that counted, in upper case.
    """

    def __init__(self, *, width: int = 44, decimals: int = 6) -> None:
        self.width, self.decimals = width, decimals
        self.reset()

    def reset(self) -> None:
        """Reset."""
        self.offered: Item | None = None
        self.held: int | None = None
        self.looked = False  # at what is held
        self.delay = 0  # clocks to the next item
        self.next: Item | None = None
        self.seen: list[str] = []  # every character that counts, of all lines
        self._begin()

    def _begin(self) -> None:
        self.line = ""  # its characters
        self.comment = ""
        self.status = 0
        self.letter: str | None = None
        self.text = ""

    @property
    def system(self) -> bool:
        """Whether the line is for a system command."""
        return self.line.startswith("$")

    @property
    def raw(self) -> bool:
        """Whether its characters are items."""
        return self.system and not OPENED.match(self.line)

    @property
    def ready(self) -> bool:
        """Whether an item is taken."""
        return self.held is None

    def clock(self, item: int | None, taken: bool) -> None:
        """Advance one clock, in which an item is offered, and the one of the reader is taken."""
        loads, held = item is not None and self.ready, self.held
        if self.delay:
            self.delay -= 1
            if not self.delay:
                self.offered = self.next
        elif self.offered:
            if taken:
                if self.offered.kind == "END":
                    self._begin()
                self.offered = None
        elif held is not None and not self.looked:
            self.looked = True
        elif held is not None and self._ends_number(held):
            self.looked = False
            assert self.letter is not None
            fraction = len(self.text.partition(".")[2])
            decimals = self.decimals // 2 if self.raw else self.decimals
            self.delay = 1 + max(0, decimals - fraction) + self.text.startswith("-")
            self.next = Item("WORD", self.system, self.letter, number=number(
                self.text, width=self.width, decimals=decimals))
            self.letter, self.text = None, ""
        elif held is not None:
            self.held, self.looked = None, False
            if held >> 8:
                self._end(held)
            else:
                self._read(chr(held))
        if loads:
            self.held = item

    def _end(self, item: int) -> None:
        """End the line."""
        if not self.status:
            self.status = 11 if item != GOOD else 2 * (self.letter is not None and not self.raw)
        self.offered = Item("END", self.system, status=self.status)

    def _has_digits(self) -> bool:
        return any("0" <= digit <= "9" for digit in self.text)

    def _shown(self, character: str) -> bool:
        return not self.comment and character > " " and character not in "/(;"

    def _goes_on(self, character: str) -> bool:
        return self.letter is not None and bool(
            re.fullmatch(r"[+-]?[0-9]*\.?[0-9]*", self.text + character))

    def _ends_number(self, item: int) -> bool:
        return self._has_digits() and (
            item >> 8 != 0 or (self._shown(chr(item)) and not self._goes_on(chr(item))))

    def _read(self, character: str) -> None:
        """Read a character of a line."""
        if self.comment:
            self.comment = "" if self.comment + character == "()" else self.comment
        elif character in "(;":
            self.comment = character
        elif self._shown(character):
            self.seen.append(character.upper() if character.isascii() else character)
            self._judge(self.seen[-1])

    def _judge(self, character: str) -> None:
        """Judge a character that counts."""
        goes_on = self._goes_on(character)
        self.line += character
        if self.raw or OPENED.fullmatch(self.line):
            self.next, self.delay = Item("CHARACTER", True, character), 1
        elif self.status:
            return
        if goes_on:
            self.text += character
        elif self.raw or (self.letter is None and "A" <= character <= "Z"):
            self.letter, self.text = character, ""
        else:
            if not OPENED.fullmatch(self.line):
                self.status = 1 if self.letter is None else 2
            self.letter = None


def read_lines(text: str) -> list[Item]:
    """Return what the reader makes of lines, which are good; each ends with a line feed."""
    reader, found = GCodeReaderModel(), []
    waiting = [GOOD if byte == ord("\n") else byte for byte in text.encode("latin-1")]
    ends = waiting.count(GOOD)
    while ends:
        if reader.offered is not None:
            found.append(reader.offered)
            ends -= reader.offered.kind == "END"
        takes = bool(waiting) and reader.ready
        reader.clock(waiting[0] if waiting else None, True)
        if takes:
            waiting.pop(0)
    return found
