"""Contract of the interpreter of frames."""

from amaranth import Array, Cat, Mux

from fresa.protocol import FrameInterpreter
from fresa.protocol.frames import POSITIONS, SPEEDS, START_SPEED, Answer
from fresa.protocol.line import LineEnd
from fresa.protocol.words import NUMBER_STARTS
from tb.contracts.contract import Bits, Case, Component, Contract

__all__ = ["FRAMES", "FRAMES_INSIDE"]


class Frame:
    """The frame that is read, from the bytes taken, and its answer."""

    def __init__(self, c: Contract, dut: FrameInterpreter) -> None:
        byte, end = dut.items.p.byte, dut.items.p.end
        taken = dut.items.valid & dut.items.ready
        self.ends, more = taken & end, taken & ~end
        self.count = count = c.keep(2, name="bytes_so_far")  # 3 is 3 or more
        self.first, self.second = c.keep(8, name="first_byte"), c.keep(8, name="second_byte")
        self.digits = c.keep(1, init=1, name="digits_behind_it")
        self.value, self.large = c.keep(16, name="number_so_far"), c.keep(1, name="too_large")
        small = (byte >= ord("a")) & (byte <= ord("z"))
        grown = self.value * 10 + (byte - ord("0"))[:4]
        is_digit = (byte >= ord("0")) & (byte <= ord("9"))
        with c.m.If(c.rst | self.ends):
            c.m.d.sync += [count.eq(0), self.digits.eq(1), self.value.eq(0), self.large.eq(0)]
        with c.m.Elif(more):
            c.m.d.sync += count.eq(count + (count != 3))
            with c.m.If(count == 0):
                c.m.d.sync += self.first.eq(Mux(small, byte - 32, byte))
            with c.m.Else():
                c.m.d.sync += [self.digits.eq(self.digits & is_digit), self.value.eq(grown),
                               self.large.eq(self.large | grown[16:].any())]
            with c.m.If(count == 1):
                c.m.d.sync += self.second.eq(byte)
        self.x, self.v, self.e, self.d = ((count > 0) & (self.first == ord(letter))
                                          for letter in "XVED")
        self.numeric = (self.x | self.v | self.e) & ((count == 1) | stops(self.second))
        self.queries = (self.x | self.v) & (count == 2) & (self.second == ord("?"))
        self.number = self.digits & (count > 1)
        self.at_stop = dut.items.valid & (end | stops(byte))
        legal = ~self.large & Mux(self.x, self.value < POSITIONS, Mux(
            self.v, (self.value > 0) & (self.value < SPEEDS), self.value < 2))
        self.good = Mux(self.numeric, Mux(
            self.number, Mux(legal, Answer.OK.value, Answer.RANGE.value), Answer.NUMBER.value), Mux(
            self.queries, Answer.VALUE.value, Mux(
                self.d & (count == 1), Answer.HELP.value, Answer.COMMAND.value)))
        self.verdict = Mux(byte == LineEnd.LONG, Answer.LENGTH.value, Mux(
            byte == LineEnd.GOOD, self.good, Answer.COMMAND.value))


def stops(byte: Bits) -> Bits:
    return Cat(byte == stop for stop in b" " + NUMBER_STARTS).any()


def describe(c: Contract, dut: FrameInterpreter) -> None:
    """A frame is answered once, by its kind; only a valid one has an effect."""
    state, texts = c.state("interpreter_state"), c.part("texts")
    item = dut.items.payload.as_value()
    held = c.past(dut.items.valid & ~dut.items.ready & ~c.rst)
    c.assume(~held | (dut.items.valid & (item == c.past(item))))  # the stream of items
    c.restrict_covers(dut.items.valid)
    frame = Frame(c, dut)
    begins = texts.numbers.valid & texts.numbers.ready
    answers = begins & state("ANSWER")
    reads = c.part("writer").numbers
    spells = reads.valid & reads.ready

    owed, due = c.keep(1, init=1, name="owed"), c.keep(4, name="answer_due")
    of_speed, sent = c.keep(1, name="of_speed"), c.keep(2, name="sent_before")
    with c.m.If(c.rst):
        c.m.d.sync += [owed.eq(1), due.eq(Answer.GREETING), sent.eq(0)]
    with c.m.Elif(frame.ends):
        c.m.d.sync += [owed.eq(1), due.eq(frame.verdict), of_speed.eq(frame.v), sent.eq(0)]
    with c.m.Elif(answers):
        c.m.d.sync += owed.eq(0)
    with c.m.Elif(begins | spells):
        c.m.d.sync += sent.eq(sent + 1)

    c.implication("answer-matches-frame", "The answer is that of the frame: `ok`, or "
                  "the right `err`, and the greeting after reset.", when=answers,
                  then=owed & (texts.numbers.payload == due))
    c.invariant("one-answer-per-frame", "Each frame, and each reset, has one answer.",
                owed == state("ANSWER", "NAME", "VALUE"), cover=owed)
    c.implication("answered-before-the-next", "No byte of a frame is read while an answer is "
                  "due.",
                  when=owed, then=~dut.items.ready)
    c.implication("value-before-ok", "The requested value, if any, comes before `ok`.",
                  when=answers, then=sent == Mux(due == Answer.VALUE.value, 2, 0))
    c.implication("names-the-value", "The name is that of the requested value.",
                  when=begins & state("NAME"), then=owed & (due == Answer.VALUE.value) & (sent == 0)
                  & (texts.numbers.payload == Mux(of_speed, Answer.SPEED.value,
                                                  Answer.POSITION.value)))
    c.implication("spells-the-value", "The value is the present one.", when=spells,
                  then=owed & (due == Answer.VALUE.value) & (sent == 1)
                  & (reads.payload == Mux(of_speed, dut.speed, dut.position)))
    idle = c.signal("idle")
    c.implication("answers-in-time", "An answer that is due begins as soon as all before it was "
                  "sent.",
                  when=owed & idle, then=begins | spells)

    # What frames do
    done = frame.ends & (frame.verdict == Answer.OK.value) & ~c.rst
    for name, kind, register, after_reset in [
        ("target", frame.x, dut.target, 0),
        ("speed", frame.v, dut.speed, START_SPEED),
        ("power", frame.e, dut.enable, 1),
    ]:
        sets = done & kind
        c.implication(f"{name}-is-set",
                      f"The {name} is the number of a valid frame from the clock after its end.",
                      when=c.past(sets), then=register == c.past(frame.value)[:len(register)])
        c.implication(f"{name}-stays", f"Nothing else changes the {name}: no invalid frame, no "
                      "part of a frame.",
                      when=c.past(~sets & ~c.rst), then=register == c.past(register,
                                                                           init=after_reset))
        c.implication(f"{name}-after-reset", f"Reset sets the {name} to its initial value.",
                      when=c.past(c.rst), then=register == after_reset)
    c.implication("next-target", "The set-point of a clock is given in the clock before.",
                  when=c.past(~c.rst), then=dut.target == c.past(dut.next_target))
    c.invariant("in-range", "Set-point and speed are always in range.",
                (dut.target < POSITIONS) & (dut.speed > 0) & (dut.speed < SPEEDS),
                cover=dut.target == 9)

    # What is sent
    writer = c.state("writer.writer_state")
    byte = dut.bytes.payload
    c.invariant("text-excludes-number", "Text and number are never sent at once.",
                ~c.signal("texts.busy") | writer("REST"), cover=c.signal("texts.busy"))
    c.implication("stable-until-ready", "A byte that is offered stays until it is taken.",
                  when=c.past(dut.bytes.valid & ~dut.bytes.ready & ~c.rst),
                  then=dut.bytes.valid & (byte == c.past(byte)))
    _watch_inside(c, dut, frame, owed, due, sent, of_speed)
    c.leaves_unused_codes("interpreter_state", fault=dut.fault,
                          shows=~dut.items.ready & ~texts.numbers.valid & ~reads.valid)


def _watch_inside(c: Contract, dut: FrameInterpreter, frame: Frame, owed: Bits, due: Bits,
                  sent: Bits, of_speed: Bits) -> None:
    """State the invariants that this needs: the registers agree with what was read."""
    state, writer = c.state("interpreter_state"), c.state("writer.writer_state")
    answer, command, value = c.signal("answer"), c.signal("command"), c.signal("value")
    count, alive = frame.count, c.signal("words.alive")
    letters = [Mux(count == 0, 1, Cat(frame.first == word[0], (count == 1) | (
        (count == 2) & (frame.second == word[-1]) & (len(word) == 2))).all())
        for word in c.part("words").table]
    words, number = c.part("words").words.valid, c.part("reader").numbers.valid
    c.invariant("candidates-match-letters", "While a word is read, the candidates begin with its "
                "letters.",
                Mux(state("COMMAND"), (c.signal("words.place") == count) & (alive == Cat(letters))
                    & (~words | frame.at_stop) & ((count < 1) | ~stops(frame.first))
                    & ((count < 2) | ~stops(frame.second)),
                    (c.signal("words.place") == 0) & alive.all() & ~words), cover=words)
    digit = dut.items.valid & ~dut.items.p.end & (dut.items.p.byte >= ord("0")) & (
        dut.items.p.byte <= ord("9"))
    which = Mux(frame.x, 0, Mux(frame.v, 1, 2))
    c.invariant("number-so-far", "While a number is read, the register holds its value so far.",
                Mux(state("NUMBER"), (c.signal("reader.value") == frame.value) & frame.digits
                    & (c.signal("reader.overflow") == frame.large) & frame.numeric
                    & (c.signal("reader.digits") == (count > 1)) & (command == which)
                    & ((count > 1) | frame.at_stop) & ~(number & digit) & (~number
                                                                           | dut.items.valid),
                    (c.signal("reader.value") == 0) & ~c.signal("reader.overflow")
                    & ~c.signal("reader.digits") & ~number) & ~c.signal("reader.negative"),
                cover=number)
    c.implication("answer-decided", "After the last argument the answer is decided, unless more "
                  "follows.", when=state("END"),
                  then=(answer == frame.good)
                  & (~frame.numeric | (command == which))
                  & (~frame.queries | (command == which + 4))
                  & ((answer != Answer.OK.value) | (value == frame.value))
                  & (~frame.numeric | ~frame.digits | (dut.items.valid & ~digit))
                  & ((count > 1) | ((count == 1) & ~frame.numeric) | frame.at_stop))
    c.implication("answer-pending", "The register holds the pending answer.", when=owed,
                  then=(answer == due) & (sent == Mux(state("NAME"), 0, Mux(
                      state("VALUE"), 1, Mux(due == Answer.VALUE.value, 2, 0))))
                  & (~state("NAME", "VALUE") | (due == Answer.VALUE.value))
                  & ((due != Answer.VALUE.value) | (command == of_speed + 4)))
    c.invariant("nothing-before-frame", "Before the first byte of a frame its registers are "
                "clear.",
                ((count > 0) | (frame.digits & (frame.value == 0) & ~frame.large))
                & ((count != 1) | (frame.digits & (frame.value == 0) & ~frame.large))
                & (~owed | (count == 0)), cover=count == 3)
    texts, busy = c.part("texts"), c.signal("texts.busy")
    rom, place = Array(b"".join(texts.texts)), c.signal("texts.place")
    c.invariant("text-in-place", "A byte of a text is the one at its address.",
                (~texts.bytes.valid | (busy & (texts.bytes.payload == rom[place])))
                & (~busy | (place < len(rom))),
                cover=texts.bytes.valid)
    c.invariant("writer-state-legal", "The writer of numbers is in a legal state, at a digit in "
                "range.",
                ~writer("FAULT") & (writer("REST") | (
             (c.signal("writer.place") < c.part("writer").digits)
             & ((c.signal("writer.place") != 0) | c.signal("writer.shown")))),
                cover=writer("DIGIT"))
    c.invariant("answers-of-frames", "The pending answer is never the name of a value.",
                answer <= Answer.VALUE.value, cover=answer == Answer.HELP.value)


def describe_alone(c: Contract, dut: FrameInterpreter) -> None:
    """State besides what a register keeps that has no effect any more."""
    describe(c, dut)
    numbers = c.part("reader").numbers
    kept = c.keep(len(dut.speed), init=START_SPEED, name="number_kept")
    with c.m.If(c.rst):
        c.m.d.sync += kept.eq(START_SPEED)
    with c.m.Elif(c.state("interpreter_state")("NUMBER") & numbers.valid):
        c.m.d.sync += kept.eq(numbers.p.value)
    c.invariant("number-kept", "The register holds the number that was read last.",
                c.signal("value") == kept, cover=kept == 9)


def make(*, short: bool = True) -> FrameInterpreter:
    """Make it, with texts of a letter or with its real ones."""
    return FrameInterpreter(greeting=b"g", help_text=b"h") if short else FrameInterpreter()


FRAMES = Component(
    make=make, describe=describe_alone, depth=16,
    cases=(Case(), Case({"short": False}, real=True), Case(upset=True)))

FRAMES_INSIDE = Component(make=make, describe=describe)
"""What a machine relies on."""
