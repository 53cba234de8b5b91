"""Contract of the reader of G-code."""

from amaranth import Cat, Mux
from amaranth.lib import data

from fresa.protocol import GCodeKind, GCodeReader, GCodeStatus
from fresa.protocol.gcode_reader import CHARACTER

from .contract import Bits, Case, Component, Contract
from .fixed_point import FIXED_POINT

__all__ = ["GCODE_READER"]

NONE, LETTER, SIGN, DIGITS, POINT, DECIMALS = range(6)
"""What there is of a word: nothing, its letter, and how far its number has come."""

OPENED = 4
"""Place in a prefix: behind all of it."""


def describe(c: Contract, dut: GCodeReader) -> None:
    """Lines are read as an automaton reads them, a character at a time."""
    c.keeps("number", FIXED_POINT)
    out, offered, number = dut.words.p, dut.words.valid, c.part("number")
    finishing = c.signal("finishing")
    loads = dut.items.valid & dut.items.ready
    given = offered & dut.words.ready

    # The item that is held
    held, item = c.keep(1, name="holds"), c.keep(9, name="item")
    byte, end = item[:8], item[8]
    is_lower = (byte >= 0x61) & (byte <= 0x7A)
    text: Bits = Mux(is_lower & ~end, byte - 0x20, byte)[:8]

    def one_of(characters: bytes) -> Bits:
        return ~end & Cat(text == character for character in characters).any()

    digit = one_of(b"0123456789")
    comment = c.keep(2, name="comment")  # 1 in parentheses, 2 to the end of the line
    shown = ~end & (comment == 0) & (text > 0x20) & ~one_of(b"/(;")
    so_far = c.keep(range(6), name="so_far")
    point, sign = one_of(b"."), one_of(b"+-")
    goes_on = ((so_far != NONE) & digit) | (
        point & ((so_far == LETTER) | (so_far == SIGN) | (so_far == DIGITS))) | (
        sign & (so_far == LETTER))
    complete = (so_far == DIGITS) | (so_far == DECIMALS)
    passes = c.keep(1, name="passes")  # a character is offered in the next clock
    idle = ~offered & ~finishing & ~passes
    ends = complete & (end | (shown & ~goes_on))
    judges = c.keep(1, name="judges")  # so it was a clock ago, and is so anew
    judged = judges & ~ends
    c.m.d.sync += judges.eq(~c.rst & held & idle & ~judges)
    c.m.d.sync += held.eq(~c.rst & (loads | (held & ~judged)))
    with c.m.If(loads):
        c.m.d.sync += item.eq(dut.items.payload.as_value())
    with c.m.If(c.rst | (judged & end)):
        c.m.d.sync += comment.eq(0)
    with c.m.Elif(judged & (comment == 0)):
        c.m.d.sync += comment.eq(Mux(one_of(b"("), 1, Mux(one_of(b";"), 2, 0)))
    with c.m.Elif(judged & (comment == 1) & one_of(b")")):
        c.m.d.sync += comment.eq(0)

    # The line, and what is to come of it
    begun, system = c.keep(1, name="has_begun"), c.keep(1, name="is_system")
    prefix, status = c.keep(3, name="prefix"), c.keep(4, name="status_so_far")
    raw = Mux(begun, system & (prefix != OPENED), one_of(b"$"))
    counts = judged & shown
    # Of $J=, $N0= and $N1= the line has the character before, and what follows it is the next.
    following = Mux(~begun, 1, Mux(
        (prefix == 1) & one_of(b"J"), 2, Mux((prefix == 1) & one_of(b"N"), 3, Mux(
            (prefix == 3) & one_of(b"01"), 2, Mux((prefix == 2) & one_of(b"="), OPENED, 0)))))
    opens = raw & (prefix == 2) & one_of(b"=")
    letter = one_of(bytes(range(0x41, 0x5B)))
    good = status == GCodeStatus.GOOD.value
    fails = counts & ~raw & good & ~goes_on & ((so_far != NONE) | ~letter)
    starts = counts & ~goes_on & Mux(raw, ~opens, good & (so_far == NONE) & letter)
    over = given & (out.kind == GCodeKind.END)
    first = c.keep(8, name="first_character")
    kind, character = c.keep(2, name="kind"), c.keep(8, name="character")
    valid, minus = c.keep(1, name="offers"), c.keep(1, name="has_minus")
    done, finishes = number.done, c.keep(1, name="finishes")
    c.m.d.sync += [
        passes.eq(~c.rst & counts & raw),
        valid.eq(~c.rst & ((offered & ~given) | (judged & end) | passes | done)),
        finishes.eq(~c.rst & ~done & (finishes | (judges & ends))),
    ]
    with c.m.If(c.rst | over):
        c.m.d.sync += [begun.eq(0), system.eq(0), prefix.eq(0), so_far.eq(NONE), status.eq(0)]
    with c.m.Elif(judged & end):
        with c.m.If(good):
            c.m.d.sync += status.eq(Mux(byte != 0, GCodeStatus.DAMAGED.value, Mux(
                (so_far != NONE) & ~raw, GCodeStatus.NO_NUMBER.value, 0)))
    with c.m.Elif(counts):
        c.m.d.sync += begun.eq(1)
        with c.m.If(raw):
            c.m.d.sync += [system.eq(1), prefix.eq(following)]
        with c.m.If(fails):
            c.m.d.sync += [so_far.eq(NONE), status.eq(Mux(
                so_far == NONE, GCodeStatus.NO_LETTER.value, GCodeStatus.NO_NUMBER.value))]
        with c.m.Elif(starts):
            c.m.d.sync += [so_far.eq(LETTER), first.eq(text), minus.eq(0)]
        with c.m.Elif(opens):
            c.m.d.sync += so_far.eq(NONE)
        with c.m.Elif(goes_on):
            c.m.d.sync += so_far.eq(Mux(
                digit, Mux((so_far == POINT) | (so_far == DECIMALS), DECIMALS, DIGITS),
                Mux(sign, SIGN, Mux(so_far == DIGITS, DECIMALS, POINT))))
            with c.m.If(sign):
                c.m.d.sync += minus.eq(text == 0x2D)
    with c.m.Elif(done):
        c.m.d.sync += so_far.eq(NONE)
    with c.m.If(done):
        c.m.d.sync += [kind.eq(GCodeKind.WORD.value), character.eq(first)]
    with c.m.Elif(judged & end):
        c.m.d.sync += kind.eq(GCodeKind.END.value)
    with c.m.Elif(counts & raw):
        c.m.d.sync += [kind.eq(GCodeKind.CHARACTER.value), character.eq(text)]

    c.invariant("offered", "An item is offered for each end of a line, each character of a system "
                "line, and each number that has ended, and for nothing else.", offered == valid,
                cover=offered)
    for name, sentence, which in [
        ("word", "A word has the letter, or the character, before its number.", GCodeKind.WORD),
        ("character", "A character of a system line is passed on in upper case.",
         GCodeKind.CHARACTER),
    ]:
        c.implication(name, sentence, when=valid & (kind == which.value),
                      then=(out.kind == which) & (out.character == character))
    c.implication("end", "The end of a line has its status: the first error of the line.",
                  when=valid & (kind == GCodeKind.END.value),
                  then=(out.kind == GCodeKind.END) & (out.status.as_value() == status))
    c.implication("system", "An item shows whether its line is for a system command.",
                  when=valid, then=out.system == system)
    c.implication("no-word-after-error", "After an error of a line no word of it comes.",
                  when=offered & (out.kind == GCodeKind.WORD), then=status == 0)
    c.implication("stable-until-ready", "An offered item stays until it is taken.",
                  when=c.past(offered & ~dut.words.ready & ~c.rst),
                  then=offered & (dut.words.payload.as_value()
                                  == c.past(dut.words.payload.as_value())))
    c.invariant("ready", "An item is taken if none is held.", dut.items.ready == ~held,
                cover=loads)
    c.invariant("seen", "Each character that counts is seen once.",
                (dut.seen == counts) & (~counts | (dut.character == text)), cover=dut.seen)
    lines, answered = c.keep(4, name="lines"), c.keep(4, name="lines_out")
    c.m.d.sync += [lines.eq(Mux(c.rst, 0, lines + (loads & dut.items.p.end))),
                   answered.eq(Mux(c.rst, 0, answered + over))]
    c.invariant("each-line-ends-once", "Each line has one END.",
                (lines - answered)[:4] == (held & end) + (valid & (
                    kind == GCodeKind.END.value)), cover=answered == 2)
    wait = c.keep(range(16), name="wait")  # clocks for which an item is held and none offered
    c.m.d.sync += wait.eq(Mux(c.rst | ~held | offered | passes | judged | done, 0, wait + 1))
    c.invariant("goes-on", "An item is held for no longer than a number takes, once the one "
                "before it was taken.", wait <= number.decimals + 4,
                cover=wait == number.decimals + 2)
    c.invariant("waits-for-number", "Meanwhile decimals are added.",
                Mux(finishing, (wait > 1) & (
                    wait <= c.signal("number.places") + c.signal("number.turned") + 2),
                    wait == judges), cover=wait == 3, lemma=True)

    c.implication("digits-passed", "The digits of a number are added, and nothing else.",
                  when=number.take | (counts & digit & goes_on),
                  then=counts & digit & goes_on & number.take & (number.digit == text[:4]))
    clears = c.keep(1, name="clears")
    c.m.d.sync += clears.eq(~c.rst & starts)
    c.invariant("number-begins", "A number begins with its letter, a clock later.",
                number.clear == clears, cover=clears)
    c.invariant("number-ends", "It ends with what is no part of it, and with a digit at least.",
                (finishing == finishes) & (number.finish == finishing)
                & (~finishing | (complete & held & ends & ~offered)), cover=finishing)
    c.invariant("decimals-counted", "Decimals are those of a number that has not ended.",
                (so_far == DECIMALS) | finishing | (c.kept["number:places"] == 0)
                | c.kept["number:is_complete"], cover=so_far == DECIMALS, lemma=True)
    c.implication("sign-and-point", "Its point and its sign are those of the line.",
                  when=(so_far != NONE) & ~clears,
                  then=(number.decimal == ((so_far == POINT) | (so_far == DECIMALS)))
                  & (number.negative == minus))
    char = data.View(CHARACTER, c.signal("char"))
    c.implication("held", "What is held is an item of the line.", when=held,
                  then=(char.end == end) & (char.byte == text))
    classes = Cat(
        char.digit == digit, char.point == point, char.sign == sign,
        char.letter == letter, char.dollar == one_of(b"$"), char.opens == one_of(b"("),
        char.closes == one_of(b")"), char.semicolon == one_of(b";"),
        char.skipped == (end | (text <= 0x20) | one_of(b"/(;")))
    c.implication("classes", "It is classified by what it is.", when=held, then=classes.all())
    at_end = valid & (kind == GCodeKind.END.value)
    c.invariant("registers", "The registers hold the state of line, comment and number.",
                (c.signal("held") == held) & (c.signal("judges") == judges)
                & (~judges | (held & idle & (c.signal("ends") == ends)
                              & (c.signal("numeric") == goes_on)
                              & (c.signal("visible") == shown))) & (c.signal("passing") == passes)
                & (out.status.as_value() == status)
                & (c.signal("parenthesis") == (comment == 1)) & (c.signal("rest") == (comment == 2))
                & (c.signal("line_begun") == begun) & (out.system == system)
                & (c.signal("place") == prefix)
                & (c.signal("expects") == ((so_far != NONE) & ~clears))
                & (~clears | ((so_far == LETTER) & ~held & ~complete & good & begun
                              & (char.byte == first)))
                & (c.signal("digits") == complete) & (comment < 3) & (so_far <= DECIMALS)
                & (kind < 3)
                & (~passes | ((kind == GCodeKind.CHARACTER.value) & ~valid & ~finishing))
                & (~(valid | passes) | ~complete | (kind == GCodeKind.CHARACTER.value))
                & ((so_far == NONE) | clears | ((c.signal("begun") == (so_far > LETTER))
                                       & (c.signal("letter") == first) & begun
                                       & (good | at_end)
                                       & ~c.kept["number:is_complete"]))
                & (prefix <= OPENED) & (good | at_end | (begun & (~system | (prefix == OPENED))))
                & (begun | ~system) & (system | (prefix == 0)), cover=so_far == DECIMALS)


GCODE_READER = Component(
    make=GCodeReader, describe=describe, depth=26,
    cases=(Case({"width": 8, "decimals": 2}), Case({"width": 44, "decimals": 6}, real=True)))
