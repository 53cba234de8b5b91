"""Contract of the reader of words."""

from amaranth import Cat, Mux

from fresa.protocol import WordReader
from fresa.protocol.words import NUMBER_STARTS

from .contract import Bits, Case, Component, Contract

__all__ = ["WORDS"]


def describe(c: Contract, dut: WordReader) -> None:
    """The word that was read is the one of the table with its letters, or none."""
    byte, end = dut.items.p.byte, dut.items.p.end
    waits, known, index = dut.words.valid, dut.words.p.known, dut.words.p.index
    payload = dut.words.payload.as_value()
    taken, given = dut.items.valid & dut.items.ready, waits & dut.words.ready
    longest = max(map(len, dut.table))
    belongs = ~end & ~Cat(byte == stop for stop in b" " + NUMBER_STARTS).any()
    letter = Mux((byte >= ord("a")) & (byte <= ord("z")), byte - 32, byte)[:8] if dut.fold else byte

    count = c.keep(range(longest + 2), name="letters")
    letters = [c.keep(8, name=f"letter_{place}") for place in range(longest)]
    with c.m.If(c.rst | given):
        c.m.d.sync += count.eq(0)
    with c.m.Elif(taken & (count <= longest)):
        c.m.d.sync += count.eq(count + 1)
        for place, at in enumerate(letters):
            with c.m.If(count == place):
                c.m.d.sync += at.eq(letter)

    def begins(word: bytes) -> Bits:
        """Return whether the letters so far are the beginning of a word."""
        return (count <= len(word)) & Cat((count <= place) | (letters[place] == expected)
                                          for place, expected in enumerate(word)).all()

    is_word = [begins(word) & (count == len(word)) for word in dut.table]
    c.implication("takes-letters", "What belongs to a word is taken at once.",
                  when=dut.items.valid & ~waits & belongs, then=dut.items.ready)
    c.implication("leaves-the-rest", "A space, a number and the end of the line stay in it.",
                  when=dut.items.valid & ~belongs, then=~dut.items.ready)
    c.implication("one-at-a-time", "While a word waits nothing is taken.", when=waits,
                  then=~dut.items.ready)
    c.implication("ends", "A word is offered with the clock after its end was seen.",
                  when=c.past(dut.items.valid & ~belongs & ~waits & ~c.rst), then=waits)
    c.implication("not-before", "A word is not offered before its end was seen.",
                  when=waits & ~c.past(waits),
                  then=c.past(dut.items.valid & ~belongs))
    c.implication("stable-until-ready", "A word that is offered stays until it is taken.",
                  when=c.past(waits & ~dut.words.ready & ~c.rst),
                  then=waits & (payload == c.past(payload)))
    for number, (word, found) in enumerate(zip(dut.table, is_word, strict=True)):
        c.implication(f"word-{number}", f"{word.decode()} is recognised.",
                      when=waits & found, then=known & (index == number))
    c.implication("no-other", "Every other word is unknown.", when=waits & ~Cat(is_word).any(),
                  then=~known)
    c.implication("restarts", "After a word was taken, and after reset, no letter is left.",
                  when=c.past(given | c.rst),
                  then=~waits & c.signal("alive").all() & (c.signal("place") == 0))
    c.invariant("candidates-match-letters", "The candidates begin with the letters so far.",
                (c.signal("alive") == Cat(map(begins, dut.table))) & (c.signal("place") == count)
                & (count <= longest + 1), cover=count == longest + 1)


WORDS = Component(
    make=WordReader, describe=describe, depth=8,
    cases=(Case({"words": (b"C", b"CC", b"MO")}), Case({"words": (b"x?", b"x"), "fold": False}),
           Case({"words": (b"CONNECT", b"DISCONNECT", b"MOV", b"MOT", b"C", b"CC", b"STOP", b"VEL",
                           b"P", b"GOTO", b"ORIGIN", b"POS")}, real=True)))
