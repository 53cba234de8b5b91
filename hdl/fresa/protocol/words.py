"""Words of a line, looked up in a table."""

from collections.abc import Sequence

from amaranth import Cat, Module, Signal, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from .line import LineItem

__all__ = ["MAX_WORD", "MAX_WORDS", "NUMBER_STARTS", "WordReader"]

MAX_WORDS, MAX_WORD = 64, 16
"""Most words of a table, and most letters of a word."""

NUMBER_STARTS = b"0123456789+-"
"""Characters that begin a number; no word contains them."""


class WordReader(wiring.Component):
    """Reads a word, and looks it up in a table.

    It takes bytes from a line, one a clock, up to a space, the beginning of a number, or the end of
    the line: that stays in the stream for the next reader, and the word is valid one clock after it
    was seen. While a word waits to be taken nothing is read; offer the line to this reader only
    when a word is expected. Any other byte belongs to the word, which is then not in the table.

    Each word of the table is compared as the letters come, all at once. A word may be the beginning
    of another.

    Parameters
    ----------
    words : sequence of bytes
        The table. Letters are capitals where ``fold`` is true.
    fold : bool
        Lower case in the line is converted to upper case.

    Members
    -------
    items : In(stream.Signature(LineItem))
        A line.
    words : Out(stream.Signature)
        ``known``, 1 if the word is in the table, and ``index``, its place there.

    Raises
    ------
    ValueError
        If there are no words or more than ``MAX_WORDS``, two are the same, or one is empty, longer
        than ``MAX_WORD``, or has a byte that a word cannot have.
    """

    def __init__(self, words: Sequence[bytes], *, fold: bool = True) -> None:
        self.table = tuple(map(_valid, words))
        if not 1 <= len(self.table) <= MAX_WORDS or len(set(self.table)) < len(self.table):
            raise ValueError(f"a table has 1 to {MAX_WORDS} words, each once, not {words!r}")
        if fold and any(word != word.upper() for word in self.table):
            raise ValueError(f"with fold the words of a table are in capitals, not {words!r}")
        self.fold = fold
        super().__init__({
            "items": In(stream.Signature(LineItem)),
            "words": Out(stream.Signature(data.StructLayout(
                {"index": unsigned(max(1, (len(self.table) - 1).bit_length())), "known": 1}))),
        })

    def elaborate(self, platform) -> Module:
        m = Module()

        longest = max(map(len, self.table))
        place = Signal(range(longest + 2))  # letters so far, saturating above the longest word
        alive = Signal(len(self.table), init=~0)  # words that begin with these letters
        letter = Signal(8)
        stops = Signal()
        byte = self.items.p.byte
        m.d.comb += [
            stops.eq(self.items.p.end | (byte == ord(" "))
                     | Cat(byte == start for start in NUMBER_STARTS).any()),
            self.items.ready.eq(~self.words.valid & ~stops),
            letter.eq(byte),
        ]
        if self.fold:
            with m.If((byte >= ord("a")) & (byte <= ord("z"))):
                m.d.comb += letter.eq(byte & 0xDF)

        for index, word in enumerate(self.table):
            same = Signal(name=f"same_{index}")
            with m.Switch(place):
                for at, expected in enumerate(word):
                    with m.Case(at):
                        m.d.comb += same.eq(letter == expected)
            with m.If(self.items.valid & self.items.ready):
                m.d.sync += alive[index].eq(alive[index] & same)
            with m.If(alive[index] & (place == len(word))):
                m.d.comb += [self.words.p.known.eq(1), self.words.p.index.eq(index)]

        with m.If(self.items.valid & self.items.ready & (place <= longest)):
            m.d.sync += place.eq(place + 1)
        with m.If(self.items.valid & stops):
            m.d.sync += self.words.valid.eq(1)
        with m.If(self.words.valid & self.words.ready):
            m.d.sync += [self.words.valid.eq(0), place.eq(0), alive.eq(alive.init)]

        return m


def _valid(word: object) -> bytes:
    if not isinstance(word, bytes) or not 1 <= len(word) <= MAX_WORD:
        raise ValueError(f"a word of a table has 1 to {MAX_WORD} bytes, not {word!r}")
    if b" " in word or set(word) & set(NUMBER_STARTS):
        raise ValueError(f"a word of a table has no space, digit or sign, not {word!r}")
    return word
