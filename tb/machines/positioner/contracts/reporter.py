"""Contract of the reports of the positioner: each at its time, whole, and answers in between."""

from amaranth import Array, Cat, Fragment, Mux, signed

from fresa.machines.positioner import ANSWERS
from fresa.protocol import DecimalWriter, Reporter
from tb.contracts.contract import Bits, Case, Component, Contract

__all__ = ["REPORTER"]

PIECES = 7
"""Of a report: a text, a number, a text, and so on."""

BYTES = 20
"""Of the shortest report: a case in which these are longer than the period begins no report while
a line is being said, and states nothing about when."""

SHOWN = (5, -3, 0)
"""What covers report."""


class Line:
    """The line that must be sent, from what began it."""

    def __init__(self, c: Contract, dut: Reporter) -> None:
        self.texts, self.writer = c.part("texts"), c.part("writer")
        asks, spells = self.texts.numbers, self.writer.numbers
        self.asks, self.spells = asks.valid & asks.ready, spells.valid & spells.ready
        self.takes = dut.answers.valid & dut.answers.ready
        self.begins = c.past(dut.tick & dut.enable & ~c.rst)  # a report
        self.is_report = c.keep(1, name="is_report")
        self.left = c.keep(range(PIECES + 1), name="pieces_left")
        self.answer = c.keep(dut.answers.payload.shape(), name="answer")
        self.where = [c.keep(signed(32), name=f"where_{axis}") for axis in "xyz"]
        with c.m.If(c.rst):
            c.m.d.sync += self.left.eq(0)
        with c.m.Elif(self.begins):
            c.m.d.sync += [self.is_report.eq(1), self.left.eq(PIECES),
                           Cat(self.where).eq(Cat(dut.position))]
        with c.m.Elif(self.takes):
            c.m.d.sync += [self.is_report.eq(0), self.left.eq(1),
                           self.answer.eq(dut.answers.payload)]
        with c.m.Elif(self.asks | self.spells):
            c.m.d.sync += self.left.eq(self.left - 1)

    def text(self, left: Bits) -> Bits:
        """Return which text it is, where so many pieces are left with it."""
        return Mux(self.is_report, Mux(left == PIECES, 0, Mux(left == 1, 2, 1)), self.answer + 3)


def describe(c: Contract, dut: Reporter) -> None:
    """Every line is whole, and every report begins right after its tick."""
    byte = dut.quiet // (max(map(len, c.part("texts").texts[3:])) + 1)
    # A line takes a byte at the latest `byte` clocks after the one before, and waits for it.
    waited = c.keep(range(byte), name="waited")
    ready = dut.bytes.ready
    c.m.d.sync += waited.eq(Mux(ready | c.rst, 0, waited + 1))
    c.assume(ready | (waited < byte - 1))
    c.assume(~c.past(ready & ~dut.bytes.valid & ~c.rst) | ready)
    c.assume(dut.answers.payload < len(c.part("texts").texts) - 3)
    line = Line(c, dut)
    since = c.keep(range(dut.period), name="since_the_tick")
    c.m.d.sync += since.eq(Mux(c.rst | dut.tick, 0, since + 1))
    resting = c.state("reporter_state")("REST")
    hurried = dut.period < BYTES * byte
    if hurried:
        c.assume(~(dut.tick & dut.enable) | resting)
    # Covers see one way through it, with a reset in the second clock.
    c.restrict_covers((ready != c.past(dut.bytes.valid & ready)) & dut.answers.valid
                      & (dut.answers.payload == 1) & (c.rst == c.past(~c.past(1)))
                      & (dut.enable == (resting if hurried else 1))
                      & Cat(place == shown for place, shown in zip(dut.position, SHOWN,
                                                                   strict=True)).all())

    c.invariant("ticks", "It is time for a report once in `period` clocks, for ever.",
                dut.tick == (since == dut.period - 1), cover=dut.tick)
    if not hurried:
        _watch_begin(c, dut, line, since)
    c.implication("as-ordered", "A line has its pieces in their order: that of a report three "
                  "numbers.", when=line.asks | line.spells,
                  then=(line.left != 0) & Mux(
                      line.left[0],
                      line.asks & (line.texts.numbers.payload == line.text(line.left)),
                      line.spells))
    c.implication("as-it-was", "The numbers are the three positions of one clock, that after the "
                  "tick.", when=line.spells,
                  then=line.writer.numbers.payload == Array(
                      where[:len(line.writer.numbers.payload)].as_signed() for where in line.where)[
                          3 - (line.left >> 1)])
    c.implication("one-line-at-a-time", "An answer is taken when all lines before it have been "
                                        "sent.",
                  when=line.takes, then=(line.left == 0) & ~c.signal("texts.busy")
                  & ~dut.bytes.valid)
    c.implication("answered-at-once", "Where there is time for an answer it is begun at once.",
                  when=c.past(line.takes & ~c.rst),
                  then=line.asks & (line.left == 1) & ~line.is_report)
    c.implication("stream-keeps", "A byte that is offered stays until it is taken.",
                  when=c.past(dut.bytes.valid & ~ready & ~c.rst),
                  then=dut.bytes.valid & (dut.bytes.payload == c.past(dut.bytes.payload)))
    c.implication("reset-begins-anew", "Reset ends the line, and the first tick is `period` "
                  "clocks away.", when=c.past(c.rst),
                  then=c.state("reporter_state")("REST") & ~dut.bytes.valid
                  & (c.signal("time") == dut.period - 1) & ~c.signal("due"))
    c.implication("reset-forgets", "After reset no position is kept.", when=c.past(c.rst),
                  then=Cat(c.signal(f"number_{place}") == 0 for place in range(3)).all())
    _watch_inside(c, dut, line, since)
    if not hurried:
        _watch_time(c, dut, line, byte, waited)
    c.leaves_unused_codes(
        "reporter_state", fault=dut.fault,
        shows=~dut.answers.ready & ~line.texts.numbers.valid & ~line.writer.numbers.valid)


def _watch_begin(c: Contract, dut: Reporter, line: Line, since: Bits) -> None:
    """State when a report begins."""
    c.implication("on-time", "A report begins in the clock after its tick, whatever was sent "
                  "before.", when=line.begins & ~c.rst,
                  then=c.state("reporter_state")("REST")
                  & (line.left == 0)
                  & ~dut.answers.ready & ~dut.bytes.valid)
    busy, offered = c.signal("texts.busy"), dut.bytes.valid
    c.implication("first-byte-in-time", "Its first byte is offered four clocks after the tick.",
                  when=line.is_report & (line.left != 0) & (since < 4),
                  then=(since != 0) & Mux(
                      since == 1, line.asks & (line.left == PIECES),
                      busy & (line.left == PIECES - 1) & (c.signal("texts.place") == 0)
                      & (offered == (since == 3)) & (~offered | (dut.bytes.payload == ord("#")))))


def _watch_inside(c: Contract, dut: Reporter, line: Line, since: Bits) -> None:
    """State the invariants that this needs: the registers agree with what was sent."""
    state, left = c.state("reporter_state"), line.left
    writer, busy = c.state("writer.writer_state"), c.signal("texts.busy")
    c.invariant("knows-what-is-said", "The registers hold what is left of the line.",
                Mux(state("REST"), left == 0, (c.signal("left") == left >> 1)
                    & (left[0] == state("ASK", "DIGITS")) & (state("TEXT") | (left != 0))
                    & (line.is_report | ((left == state("ASK")) & state("ASK", "TEXT"))))
                & (~state("DIGITS") | (left < PIECES))
                & (line.answer < len(line.texts.texts) - 3), cover=left == 2)
    c.implication("knows-its-text", "The text register holds the text that is next, or being sent.",
                  when=state("ASK", "TEXT"),
                  then=c.signal("text") == line.text(left + state("TEXT")))
    c.invariant("knows-where", "It keeps the positions, those that are still to be sent before "
                "those that were.",
                state("REST") | ~line.is_report | Cat(
                    c.signal(f"number_{place}") == Array(line.where * 2)[3 - (left >> 1) + place]
                    for place in range(3)).all(), cover=left == 4)
    c.invariant("one-voice", "Text and number are never sent at once, and only in their states.",
                (state("TEXT") | ~busy) & (state("DIGITS") | writer("REST")), cover=writer("DIGIT"))
    sources = line.texts.texts
    rom, at = Array(b"".join(sources)), c.signal("texts.place")
    words = Array(byte | (number == len(words)) << 8 for words in sources
                  for number, byte in enumerate(words, start=1))
    (fetch,) = c.part("texts.rom").read_ports
    which = Array(number for number, words in enumerate(sources) for _ in words)
    c.invariant("knows-the-text", "A byte of a text is the one where it is.",
                (~line.texts.bytes.valid | (busy & (fetch.data == words[at])))
                & (~busy | ((at < len(rom)) & (which[at] == c.signal("text")))),
                cover=line.texts.bytes.valid)
    c.implication("says-it", "What is offered is a byte of that text, or of that number.",
                  when=dut.bytes.valid, then=Mux(
                      busy, dut.bytes.payload == rom[at],
                      dut.bytes.payload == Mux(writer("SIGN"), ord("-"), 0x30 | c.signal(
                          "writer.digit"))))
    digits, place, digit = line.writer.digits, c.signal("writer.place"), c.signal("writer.digit")
    power = Array(10**n for n in range(digits))[place]
    c.implication("digits-end", "A digit is counted in its time.", when=state("DIGITS"),
                  then=writer("REST") | (place < digits) & (digit <= 9) & Mux(
                      writer("SIGN"), (digit == 0) & (place == digits - 1),
                      (c.signal("writer.left") < power * (10 - digit))
                      & (writer("COUNT") | (c.signal("writer.left") < power))))
    c.invariant("writer-is-sound", "The writer of numbers is in a legal state.",
                ~writer("FAULT") & ~writer.is_unused(), cover=writer("DIGIT"))
    c.invariant("counts-to-the-tick", "The counter holds the clocks to the next tick.",
                (c.signal("time") == dut.period - 1 - since) & (c.signal("due") == line.begins)
                & (since < dut.period) & (~line.begins | (since == 0)), cover=since == 1)


def _watch_time(c: Contract, dut: Reporter, line: Line, byte: int, waited: Bits) -> None:
    """State that there is always time for the rest of a line, however slow it is taken."""
    state, writer = c.state("reporter_state"), c.state("writer.writer_state")
    busy, time = c.signal("texts.busy"), c.signal("time")
    sources = line.texts.texts
    digits, left = line.writer.digits, c.signal("left")
    place, digit = c.signal("writer.place"), c.signal("writer.digit")

    def bytes_of(count: Bits, most: int) -> Bits:
        return Array(byte * number for number in range(most + 1))[count]

    behind = [0]  # clocks from a state NUMBER to the end, by the numbers that are to come
    for number in range(1, 4):
        words = sources[2 if number == 1 else 1]
        behind.append(2 + byte * (digits + 1) + byte * len(words) + 3 + behind[-1])
    after = Array(behind)[left]
    longest = max(map(len, sources))
    soon = Mux(dut.bytes.ready, 0, byte - 1 - waited)  # clocks until a byte is taken
    ends = Array(sum(map(len, sources[:number + 1])) for number in range(len(sources)))
    rest = (ends[c.signal("text")] - c.signal("texts.place"))[:longest.bit_length()]
    text = Mux(busy, Mux(line.texts.bytes.valid, soon + 1, byte + 1) + bytes_of(
        (rest - 1)[:len(rest)], longest), 0)
    whole = bytes_of(Array(map(len, sources))[c.signal("text")], longest)
    most = Mux(soon > 10 - digit, soon, 10 - digit)
    number = Mux(writer("REST"), 0, Mux(
        writer("SIGN"), soon + 1 + byte * digits,
        Mux(writer("COUNT"), most, soon) + 1 + bytes_of(place, digits)))
    need = Mux(state("REST"), Mux(c.signal("due"), 4 + byte * len(sources[0]) + behind[3], 0), Mux(
        state("ASK"), whole + 3 + after, Mux(
            state("TEXT"), text + 1 + after, Mux(
                state("NUMBER"), after, number + 4 + Array(
                    [byte * len(sources[2]), *(byte * len(sources[1]) + clocks
                                               for clocks in behind[1:3])])[left]))))
    c.invariant("over-by-the-tick", "What is left of a line takes no longer than it is to the "
                "next tick, as long as a byte takes no longer than `byte`.", time >= need,
                cover=state("DIGITS"))


def make(*, answers: tuple[bytes, ...], period: int, byte: int, short: bool = False) -> Reporter:
    """Make one; with `short` numbers have two digits, and its period may be any."""
    if not short:
        return Reporter(answers=answers, period=period, byte=byte)
    dut = Reporter(answers=answers, period=1000 * byte, byte=byte)
    Fragment.get(dut._writer, None)  # else Amaranth says that it was made for nothing
    dut._writer, dut.period = DecimalWriter(width=5, is_signed=True), period
    return dut


TINY = {"answers": (b"\n", b"a\n"), "short": True}
REPORTER = Component(
    make=make, describe=describe, depth=300,
    cases=(Case({**TINY, "period": 16, "byte": 2}), Case({**TINY, "period": 241, "byte": 11}),
           Case({"answers": ANSWERS, "period": 5_000_000, "byte": 52_080}, real=True),
           Case({**TINY, "period": 16, "byte": 2}, upset=True)))
