"""Contract of the reports of the positioner: each at its time, whole, and answers in between.

A state is sent in place of a report, so both are called reports here, unless one is meant.
"""

from collections.abc import Iterable

from amaranth import Array, Cat, Fragment, Mux, Shape, signed
from amaranth.lib import data

from fresa.machines.positioner import ANSWERS, TOP_SPEED
from fresa.protocol import DecimalWriter, Reporter
from fresa.protocol.positioner import state_layout
from tb.contracts.contract import Bits, Case, Component, Contract

__all__ = ["REPORTER"]

AXES = 3

REPORT, BETWEEN, REPORT_END, STATE, STATE_END, ANSWERS_FROM = range(6)
"""Numbers of the texts."""

BYTES = 25
"""Of the shortest state: a case in which these are longer than the period begins no report while
a line is being sent, and states nothing about when."""

SHOWN = {"position_1": 5, "position_2": -3}
"""What covers report."""


class Line:
    """The line that must be sent, from what began it."""

    def __init__(self, c: Contract, dut: Reporter) -> None:
        self.texts, self.writer = c.part("texts"), c.part("writer")
        asks, spells = self.texts.numbers, self.writer.numbers
        self.asks, self.spells = asks.valid & asks.ready, spells.valid & spells.ready
        self.names = list(dut.layout.members)
        self.shapes = [Shape.cast(shape) for shape in dut.layout.members.values()]
        first, count = self.names.index("position_1"), len(self.names)
        # A text, a number, a text, and so on.
        self.wants_state = dut.answers.valid & (
            dut.answers.payload == len(self.texts.texts) - ANSWERS_FROM)
        self.takes = dut.answers.valid & dut.answers.ready
        self.due = dut.tick & (dut.enable | self.wants_state)
        self.begins = c.past(self.due & ~c.rst)
        self.is_report, self.is_state = c.keep(1, name="is_report"), c.keep(1, name="is_state")
        self.left = c.keep(range(2 * count + 2), name="pieces_left")
        self.answer = c.keep(dut.answers.payload.shape(), name="answer")
        state = Cat(getattr(dut, name) for name in self.names)
        self.sampled = c.keep(len(state), name="state")
        self.pieces = 2 * Mux(self.is_state, count, AXES) + 1  # of a report
        self.numbers_end = Mux(self.is_state, count, first + AXES)
        with c.m.If(c.rst):
            c.m.d.sync += self.left.eq(0)
        with c.m.Elif(self.begins):
            c.m.d.sync += [
                self.is_report.eq(1), self.is_state.eq(self.wants_state),
                self.left.eq(2 * Mux(self.wants_state, count, AXES) + 1),
                self.sampled.eq(state)]
        with c.m.Elif(self.takes):
            c.m.d.sync += [self.is_report.eq(0), self.left.eq(1),
                           self.answer.eq(dut.answers.payload)]
        with c.m.Elif(self.asks | self.spells):
            c.m.d.sync += self.left.eq(self.left - 1)

    def text(self, left: Bits) -> Bits:
        """Return which text it is, where so many pieces are left with it."""
        return Mux(self.is_report, Mux(
            left == self.pieces, Mux(self.is_state, STATE, REPORT), Mux(
                left == 1, Mux(self.is_state, STATE_END, REPORT_END), BETWEEN)),
            self.answer + ANSWERS_FROM)

    def digits_of(self, shape: Shape) -> int:
        """Return the most digits of a number of that shape."""
        return len(str(2 ** (shape.width - shape.signed) - (not shape.signed)))

    def most_digits(self) -> Bits:
        """Return the most digits of the number that is being sent."""
        return self._of_number(self.digits_of(shape) for shape in self.shapes)

    def is_signed(self) -> Bits:
        """Return whether the number that is being sent may have a sign."""
        return self._of_number(int(shape.signed) for shape in self.shapes)

    def _of_number(self, values: Iterable[int]) -> Bits:
        return Array(values)[self.numbers_end - (self.left >> 1) - 1]

    def numbers(self, dut: Reporter) -> Array:
        """Return the numbers that were sampled."""
        kept = data.View(dut.layout, self.sampled)
        return Array(kept[name] for name in self.names)


def describe(c: Contract, dut: Reporter) -> None:
    """Every line is whole, and every report begins right after its tick."""
    byte = dut.quiet // (max(map(len, c.part("texts").texts[ANSWERS_FROM:])) + 1)
    # A line takes a byte at the latest `byte` clocks after the one before, and waits for it.
    waited = c.keep(range(byte), name="waited")
    ready = dut.bytes.ready
    c.m.d.sync += waited.eq(Mux(ready | c.rst, 0, waited + 1))
    c.assume(ready | (waited < byte - 1))
    c.assume(~c.past(ready & ~dut.bytes.valid & ~c.rst) | ready)
    c.assume(dut.answers.payload <= len(c.part("texts").texts) - ANSWERS_FROM)
    line = Line(c, dut)
    since = c.keep(range(dut.period), name="since_the_tick")
    c.m.d.sync += since.eq(Mux(c.rst | dut.tick, 0, since + 1))
    resting = c.state("reporter_state")("REST")
    hurried = dut.period < BYTES * byte
    if hurried:
        c.assume(~line.due | resting)
    # Covers see one way through it, with a reset in the second clock: a report, then states.
    reported = c.keep(1, name="reported")
    c.m.d.sync += reported.eq((reported | line.begins) & ~c.rst)
    c.restrict_covers((ready != c.past(dut.bytes.valid & ready))
                      & (dut.answers.valid == (resting if hurried else 1))
                      & (dut.answers.payload == Mux(
                          reported, len(c.part("texts").texts) - ANSWERS_FROM, 1))
                      & (c.rst == c.past(~c.past(1)))
                      & (dut.enable == (resting if hurried else 1))
                      & Cat(getattr(dut, name) == SHOWN.get(name, 0)
                            for name in line.names).all())

    c.invariant("ticks", "It is time for a report once in `period` clocks, for ever.",
                dut.tick == (since == dut.period - 1), cover=dut.tick)
    if not hurried:
        _watch_begin(c, dut, line, since)
    c.implication("as-ordered", "A line has its pieces in their order: that of a report three "
                  "numbers, a state all, an answer none.", when=line.asks | line.spells,
                  then=(line.left != 0) & Mux(
                      line.left[0],
                      line.asks & (line.texts.numbers.payload == line.text(line.left)),
                      line.spells))
    c.implication("sampled-at-once", "The numbers are those of one clock, that after the tick: the "
                  "positions, or all.", when=line.spells,
                  then=line.writer.numbers.payload == line.numbers(dut)[
                      line.numbers_end - (line.left >> 1)])
    c.implication("state-at-a-tick", "A state is taken in the clock after a tick only.",
                  when=line.takes & line.wants_state, then=line.begins)
    c.implication("one-line-at-a-time", "An answer is taken when all lines before it have been "
                                        "sent.",
                  when=line.takes, then=(line.left == 0) & ~c.signal("texts.busy")
                  & ~dut.bytes.valid)
    c.implication("answered-at-once", "Where there is time for an answer it is begun at once.",
                  when=c.past(line.takes & ~line.wants_state & ~c.rst),
                  then=line.asks & (line.left == 1) & ~line.is_report)
    c.implication("stable-until-ready", "A byte that is offered stays until it is taken.",
                  when=c.past(dut.bytes.valid & ~ready & ~c.rst),
                  then=dut.bytes.valid & (dut.bytes.payload == c.past(dut.bytes.payload)))
    c.implication("reset-begins-anew", "Reset ends the line, and the first tick is `period` "
                  "clocks away.", when=c.past(c.rst),
                  then=c.state("reporter_state")("REST") & ~dut.bytes.valid
                  & (c.signal("time") == dut.period - 1) & ~c.signal("due"))
    c.implication("reset-clears", "After reset no number is kept.", when=c.past(c.rst),
                  then=c.signal("sampled") == 0)
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
                  & (dut.answers.ready == line.wants_state) & ~dut.bytes.valid)
    busy, offered = c.signal("texts.busy"), dut.bytes.valid
    c.implication("first-byte-in-time", "Its first byte is offered four clocks after the tick.",
                  when=line.is_report & (line.left != 0) & (since < 4),
                  then=(since != 0) & Mux(
                      since == 1, line.asks & (line.left == line.pieces),
                      busy & (line.left == line.pieces - 1) & (offered == (since == 3))
                      & (c.signal("texts.place") == Mux(line.is_state, sum(map(
                          len, line.texts.texts[:STATE])), 0))
                      & (~offered | (dut.bytes.payload == Mux(line.is_state, ord("S"), ord("#"))))))


def _watch_inside(c: Contract, dut: Reporter, line: Line, since: Bits) -> None:
    """State the invariants that this needs: the registers agree with what was sent."""
    state, left = c.state("reporter_state"), line.left
    writer, busy = c.state("writer.writer_state"), c.signal("texts.busy")
    c.invariant("line-left", "The registers hold what is left of the line.",
                Mux(state("REST"), left == 0, (c.signal("left") == left >> 1)
                    & (left[0] == state("ASK", "DIGITS")) & (state("TEXT") | (left != 0))
                    & Mux(line.is_report, c.signal("is_state") == line.is_state,
                          (left == state("ASK")) & state("ASK", "TEXT")))
                & (~state("DIGITS") | (left < line.pieces)) & (~line.is_report
                                                               | (left <= line.pieces))
                & (line.answer < len(line.texts.texts) - ANSWERS_FROM), cover=left == 2)
    c.implication("text-is-next", "The text register holds the text that is next, or being sent.",
                  when=state("ASK", "TEXT"),
                  then=c.signal("text") == line.text(left + state("TEXT")))
    c.invariant("sample-kept", "It keeps the numbers until the line has been sent.",
                state("REST") | ~line.is_report | (c.signal("sampled") == line.sampled),
                cover=left == 4)
    c.invariant("one-source", "Text and number are never sent at once, and only in their states.",
                (state("TEXT") | ~busy) & (state("DIGITS") | writer("REST")), cover=writer("DIGIT"))
    sources = line.texts.texts
    rom, at = Array(b"".join(sources)), c.signal("texts.place")
    words = Array(byte | (number == len(words)) << 8 for words in sources
                  for number, byte in enumerate(words, start=1))
    (fetch,) = c.part("texts.rom").read_ports
    which = Array(number for number, words in enumerate(sources) for _ in words)
    c.invariant("text-byte", "A byte of a text is the one where it is.",
                (~line.texts.bytes.valid | (busy & (fetch.data == words[at])))
                & (~busy | ((at < len(rom)) & (which[at] == c.signal("text")))),
                cover=line.texts.bytes.valid)
    c.implication("byte-of-it", "What is offered is a byte of that text, or of that number.",
                  when=dut.bytes.valid, then=Mux(
                      busy, dut.bytes.payload == rom[at],
                      dut.bytes.payload == Mux(writer("SIGN"), ord("-"), 0x30 | c.signal(
                          "writer.digit"))))
    digits, place, digit = line.writer.digits, c.signal("writer.place"), c.signal("writer.digit")
    most, value = line.most_digits(), c.signal("writer.left")
    powers = Array(10**n for n in range(digits + 1))
    power = Array(10**n for n in range(digits))[place]
    c.implication("digits-end", "A digit is counted in its time.", when=state("DIGITS"),
                  then=writer("REST") | (place < digits) & (digit <= 9) & Mux(
                      writer("SIGN"), (digit == 0) & (place == digits - 1),
                      (value < power * (10 - digit)) & (writer("COUNT") | (value < power)))
                  & (c.signal("writer.power") == Mux(writer("SIGN"), 1, power))
                  & ((place != 0) | c.signal("writer.shown")))
    c.implication("digits-of-its-shape", "A number has no more digits than its shape allows, and "
                  "no sign if that has none.", when=state("DIGITS") & ~writer("REST"),
                  then=Mux(place < most, 1, writer("COUNT") & (digit == 0) & (value < powers[most])
                           & ~c.signal("writer.shown"))
                  & (~writer("SIGN") | line.is_signed()))
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

    def behind(count: int, end: int, last: int) -> list[int]:
        """Return clocks from a state NUMBER to the end, by the numbers that are to come."""
        clocks = [0]
        for number in range(1, count + 1):
            shape = line.shapes[end - number]
            most = min(digits, line.digits_of(shape))
            words = sources[last if number == 1 else BETWEEN]
            clocks.append(2 + digits - most + byte * (most + shape.signed) + byte * len(words) + 3
                          + clocks[-1])
        return clocks

    count = len(line.names)
    report = behind(AXES, line.names.index("position_1") + AXES, REPORT_END)
    whole_state = behind(count, count, STATE_END)
    report += [0] * (count - AXES)

    def by_line(of_report: list[int], of_state: list[int]) -> Bits:
        return Mux(line.is_report & line.is_state, Array(of_state)[left], Array(of_report)[left])

    after = by_line(report, whole_state)
    longest = max(map(len, sources))
    soon = Mux(dut.bytes.ready, 0, byte - 1 - waited)  # clocks until a byte is taken
    ends = Array(sum(map(len, sources[:number + 1])) for number in range(len(sources)))
    rest = (ends[c.signal("text")] - c.signal("texts.place"))[:longest.bit_length()]
    text = Mux(busy, Mux(line.texts.bytes.valid, soon + 1, byte + 1) + bytes_of(
        (rest - 1)[:len(rest)], longest), 0)
    whole = bytes_of(Array(map(len, sources))[c.signal("text")], longest)
    counting = Mux(soon > 10 - digit, soon, 10 - digit)
    cap = line.most_digits()
    skipped = Mux(place < cap, 0, place - cap + 1)  # places that have no digit
    number = Mux(writer("REST"), 0, Mux(
        writer("SIGN"), soon + 1 + byte * digits,
        Mux(writer("COUNT"), counting, soon) + 1 + skipped + bytes_of(place - skipped, digits)))
    begin = max(byte * len(sources[REPORT]) + report[AXES],
                byte * len(sources[STATE]) + whole_state[count])
    need = Mux(state("REST"), Mux(c.signal("due"), 4 + begin, 0), Mux(
        state("ASK"), whole + 3 + after, Mux(
            state("TEXT"), text + 1 + after, Mux(
                state("NUMBER"), after, number + 4 + by_line(*(
                    [byte * len(sources[last]),
                     *(byte * len(sources[BETWEEN]) + each for each in clocks[1:])]
                    for last, clocks in ((REPORT_END, report), (STATE_END, whole_state))))))))
    c.invariant("over-by-the-tick", "What is left of a line takes no longer than it is to the "
                "next tick, as long as a byte takes no longer than `byte`.", time >= need,
                cover=state("DIGITS"))


def make(*, answers: tuple[bytes, ...], period: int, byte: int, short: bool = False) -> Reporter:
    """Make one; with `short` numbers have two digits, and its period may be any."""
    if not short:
        return Reporter(state=state_layout(TOP_SPEED), answers=answers, period=period, byte=byte)
    dut = Reporter(state=SHORT_STATE, answers=answers, period=1000 * byte, byte=byte)
    Fragment.get(dut._writer, None)  # else Amaranth says that it was made for nothing
    dut._writer, dut.period = DecimalWriter(width=5, is_signed=True), period
    return dut


SHORT_STATE = data.StructLayout({
    "connected": 1, **{f"position_{number}": signed(5) for number in (1, 2, 3)}, "seconds": 3})
TINY = {"answers": (b"\n", b"a\n"), "short": True}
REPORTER = Component(
    make=make, describe=describe, depth=360,
    cases=(Case({**TINY, "period": 16, "byte": 2}), Case({**TINY, "period": 300, "byte": 11}),
           Case({"answers": ANSWERS, "period": 5_000_000, "byte": 52_080}, real=True),
           Case({**TINY, "period": 16, "byte": 2}, upset=True)))
