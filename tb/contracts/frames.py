"""Contract of the interpreter of frames."""

from amaranth import Array, Cat, Mux

from fresa.protocol import FrameInterpreter, decimal_writer, frames, text
from fresa.protocol.frames import POSITIONS, SPEEDS, START_SPEED, Answer
from fresa.protocol.line import LineEnd
from fresa.protocol.words import NUMBER_STARTS

from .contract import Bits, Bug, Case, Component, Contract

__all__ = ["FRAMES", "FRAMES_INSIDE"]


class Frame:
    """The frame that is read, from what was taken of it, and what is to be answered."""

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
        self.asks = (self.x | self.v) & (count == 2) & (self.second == ord("?"))
        self.number = self.digits & (count > 1)
        self.at_stop = dut.items.valid & (end | stops(byte))
        legal = ~self.large & Mux(self.x, self.value < POSITIONS, Mux(
            self.v, (self.value > 0) & (self.value < SPEEDS), self.value < 2))
        self.good = Mux(self.numeric, Mux(
            self.number, Mux(legal, Answer.OK.value, Answer.RANGE.value), Answer.NUMBER.value), Mux(
            self.asks, Answer.VALUE.value, Mux(
                self.d & (count == 1), Answer.HELP.value, Answer.COMMAND.value)))
        self.verdict = Mux(byte == LineEnd.LONG, Answer.LENGTH.value, Mux(
            byte == LineEnd.GOOD, self.good, Answer.COMMAND.value))


def stops(byte: Bits) -> Bits:
    return Cat(byte == stop for stop in b" " + NUMBER_STARTS).any()


def describe(c: Contract, dut: FrameInterpreter) -> None:
    """A frame is answered once, by what it is; only a good one does what it asks for."""
    state, texts = c.state("interpreter_state"), c.part("texts")
    item = dut.items.payload.as_value()
    held = c.past(dut.items.valid & ~dut.items.ready & ~c.rst)
    c.assume(~held | (dut.items.valid & (item == c.past(item))))  # the stream of items
    c.usual(dut.items.valid)
    frame = Frame(c, dut)
    begins = texts.numbers.valid & texts.numbers.ready
    answers = begins & state("ANSWER")
    reads = c.part("writer").numbers
    spells = reads.valid & reads.ready

    owed, due = c.keep(1, init=1, name="owed"), c.keep(4, name="answer_due")
    of_speed, said = c.keep(1, name="of_speed"), c.keep(2, name="said_before")
    with c.m.If(c.rst):
        c.m.d.sync += [owed.eq(1), due.eq(Answer.GREETING), said.eq(0)]
    with c.m.Elif(frame.ends):
        c.m.d.sync += [owed.eq(1), due.eq(frame.verdict), of_speed.eq(frame.v), said.eq(0)]
    with c.m.Elif(answers):
        c.m.d.sync += owed.eq(0)
    with c.m.Elif(begins | spells):
        c.m.d.sync += said.eq(said + 1)

    c.holds("answers-what-it-is", "The answer is the one that the frame deserves: `ok`, or the "
            "right `err`, and the greeting after reset.", when=answers,
            then=owed & (texts.numbers.payload == due),
            bug=(Bug(frames, "command.eq(words.words.p.index)",
                     "command.eq(words.words.p.index ^ 1)"),
                 Bug(frames, "POSITIONS - 1", "7"), Bug(frames, "SPEEDS - 1", "7"),
                 Bug(frames, "(number.value == 0)", "(number.value == 3)"),
                 Bug(frames, "Answer.OK, Answer.RANGE, Answer.NUMBER", "Answer.RANGE"),
                 Bug(frames, "self.items.p.byte == LineEnd.LONG", "0")))
    c.always("one-answer", "Each frame, and each reset, has one answer.",
             owed == state("ANSWER", "NAME", "VALUE"), seen=owed,
             bug=Bug(frames, "with m.Elif(answer == Answer.VALUE):\n"
                     '                        m.next = "NAME"',
                     "with m.Elif(answer == Answer.VALUE):\n"
                     '                        m.next = "COMMAND"'))
    c.holds("answered-before-the-next", "Nothing of a frame is read before that.",
            when=owed, then=~dut.items.ready,
            bug=Bug(frames, '                    m.next = "ANSWER"\n                    with m.If('
                    "self.items.p", '                    m.next = "COMMAND"\n'
                    "                    with m.If(self.items.p"))
    c.holds("value-before-ok", "Before it comes the value that was asked for, where one was.",
            when=answers, then=said == Mux(due == Answer.VALUE.value, 2, 0),
            bug=Bug(frames, 'm.next = "VALUE"', 'm.next = "ANSWER"'))
    c.holds("names-the-value", "The name is that of the value.",
            when=begins & state("NAME"), then=owed & (due == Answer.VALUE.value) & (said == 0)
            & (texts.numbers.payload == Mux(of_speed, Answer.SPEED.value, Answer.POSITION.value)),
            bug=Bug(frames, "Mux(of_speed, Answer.SPEED, Answer.POSITION)", "Answer.POSITION"))
    c.holds("spells-the-value", "The value is that of this moment.", when=spells,
            then=owed & (due == Answer.VALUE.value) & (said == 1)
            & (reads.payload == Mux(of_speed, dut.speed, dut.position)),
            bug=Bug(frames, "Mux(of_speed, self.speed, self.position)", "self.position"))
    idle = c.signal("idle")
    c.holds("goes-on", "What is owed is said as soon as all before has been.",
            when=owed & idle, then=begins | spells,
            bug=Bug(frames, "m.d.comb += writer.numbers.valid.eq(idle)", "pass"))

    # What frames do
    done = frame.ends & (frame.verdict == Answer.OK.value) & ~c.rst
    for name, kind, register, after_reset, bug in [
        ("target", frame.x, dut.target, 0,
         Bug(frames, "self.target.eq(value)", "self.target.eq(value + 1)")),
        ("speed", frame.v, dut.speed, START_SPEED,
         Bug(frames, "self.speed.eq(value)", "self.speed.eq(value[1:])")),
        ("power", frame.e, dut.enable, 1,
         Bug(frames, "self.enable.eq(value[0])", "self.enable.eq(1)")),
    ]:
        sets = done & kind
        c.holds(f"{name}-is-set", "It is what a good frame says with the clock after its end.",
                when=c.past(sets), then=register == c.past(frame.value)[:len(register)], bug=bug)
        c.holds(f"{name}-stays", "Nothing else changes it: no bad frame, no part of a frame.",
                when=c.past(~sets & ~c.rst), then=register == c.past(register, init=after_reset),
                bug=Bug(frames, "with m.Elif(answer == Answer.OK):",
                        "with m.Elif(answer != Answer.COMMAND):"))
        c.holds(f"{name}-after-reset", "Reset brings back what it was at first.",
                when=c.past(c.rst), then=register == after_reset,
                bug=Bug(frames, "command = Signal(_Command)", "command = Signal(_Command); "
                        f"self.{'enable' if name == 'power' else name}._reset_less = True"))
    c.always("in-range", "Set-point and speed are always such as may be.",
             (dut.target < POSITIONS) & (dut.speed > 0) & (dut.speed < SPEEDS),
             seen=dut.target == 9,
             bug=(Bug(frames, "self.target.eq(value)", "self.target.eq(~value)"),
                  Bug(frames, "self.speed.eq(value)", "self.speed.eq(~value)")))

    # What is sent
    writer = c.state("writer.writer_state")
    byte = dut.bytes.payload
    c.always("one-voice", "Text and number never speak at once.",
             ~c.signal("texts.busy") | writer("REST"), seen=c.signal("texts.busy"),
             bug=Bug(frames, "texts.numbers.ready & writer.numbers.ready",
                     "writer.numbers.ready"))
    c.holds("stream-keeps", "A byte that is offered stays until it is taken.",
            when=c.past(dut.bytes.valid & ~dut.bytes.ready & ~c.rst),
            then=dut.bytes.valid & (byte == c.past(byte)),
            bug=Bug(frames, "texts.bytes.ready.eq(self.bytes.ready)", "texts.bytes.ready.eq(1)"))
    _watch_inside(c, dut, frame, owed, due, said, of_speed)
    c.leaves_unused_codes("interpreter_state", fault=dut.fault,
                          shows=~dut.items.ready & ~texts.numbers.valid & ~reads.valid,
                          reached=Bug(frames, 'm.next = "NAME"', 'm.next = "FAULT"'))


def _watch_inside(c: Contract, dut: FrameInterpreter, frame: Frame, owed: Bits, due: Bits,
                  said: Bits, of_speed: Bits) -> None:
    """Promise what makes it so: who reads knows what was read."""
    state, writer = c.state("interpreter_state"), c.state("writer.writer_state")
    answer, command, value = c.signal("answer"), c.signal("command"), c.signal("value")
    count, alive = frame.count, c.signal("words.alive")
    letters = [Mux(count == 0, 1, Cat(frame.first == word[0], (count == 1) | (
        (count == 2) & (frame.second == word[-1]) & (len(word) == 2))).all())
        for word in c.part("words").table]
    words, number = c.part("words").words.valid, c.part("reader").numbers.valid
    c.always("knows-the-word", "While it reads a word it knows which ones begin so.",
             Mux(state("COMMAND"), (c.signal("words.place") == count) & (alive == Cat(letters))
                 & (~words | frame.at_stop) & ((count < 1) | ~stops(frame.first))
                 & ((count < 2) | ~stops(frame.second)),
                 (c.signal("words.place") == 0) & alive.all() & ~words), seen=words,
             bug=Bug(frames, "words.words.ready.eq(1)", "words.words.ready.eq(~words.items.ready "
                     "& words.words.p.known)"))
    digit = dut.items.valid & ~dut.items.p.end & (dut.items.p.byte >= ord("0")) & (
        dut.items.p.byte <= ord("9"))
    which = Mux(frame.x, 0, Mux(frame.v, 1, 2))
    c.always("knows-the-number", "While it reads a number it knows what it is so far.",
             Mux(state("NUMBER"), (c.signal("reader.value") == frame.value) & frame.digits
                 & (c.signal("reader.overflow") == frame.large) & frame.numeric
                 & (c.signal("reader.digits") == (count > 1)) & (command == which)
                 & ((count > 1) | frame.at_stop) & ~(number & digit) & (~number | dut.items.valid),
                 (c.signal("reader.value") == 0) & ~c.signal("reader.overflow")
                 & ~c.signal("reader.digits") & ~number) & ~c.signal("reader.negative"),
             seen=number,
             bug=Bug(frames, "reader.items.valid.eq(self.items.valid)",
                             "reader.items.valid.eq(self.items.valid & ~self.items.p.byte[0])"))
    c.holds("knows-what-to-answer", "Behind it, it knows what the frame is if nothing follows.",
            when=state("END"), then=(answer == frame.good)
            & (~frame.numeric | (command == which)) & (~frame.asks | (command == which + 4))
            & ((answer != Answer.OK.value) | (value == frame.value))
            & (~frame.numeric | ~frame.digits | (dut.items.valid & ~digit))
            & ((count > 1) | ((count == 1) & ~frame.numeric) | frame.at_stop),
            bug=Bug(frames, "value.eq(reader.numbers.p.value)", "value.eq(1)"))
    c.holds("knows-what-is-owed", "It remembers the answer.", when=owed,
            then=(answer == due) & (said == Mux(state("NAME"), 0, Mux(
                state("VALUE"), 1, Mux(due == Answer.VALUE.value, 2, 0))))
            & (~state("NAME", "VALUE") | (due == Answer.VALUE.value))
            & ((due != Answer.VALUE.value) | (command == of_speed + 4)),
            bug=Bug(frames, "m.d.sync += answer.eq(Answer.LENGTH)", "pass"))
    c.always("frame-so-far", "Of a frame that is not begun nothing is known.",
             ((count > 0) | (frame.digits & (frame.value == 0) & ~frame.large))
             & ((count != 1) | (frame.digits & (frame.value == 0) & ~frame.large))
             & (~owed | (count == 0)), seen=count == 3,
             bug=Bug(frames, "texts.numbers.payload.eq(answer)]",
                     "texts.numbers.payload.eq(answer), self.items.ready.eq(1)]"))
    texts, busy = c.part("texts"), c.signal("texts.busy")
    rom, place = Array(b"".join(texts.texts)), c.signal("texts.place")
    c.always("knows-the-text", "A byte of a text is the one where it is.",
             (~texts.bytes.valid | (busy & (texts.bytes.payload == rom[place])))
             & (~busy | (place < len(rom))),
             seen=texts.bytes.valid, bug=Bug(text, "fetch.addr.eq(after)", "fetch.addr.eq(place)"))
    c.always("writer-is-sound", "The writer of numbers is not upset, and is at a digit that there "
             "is.", ~writer("FAULT") & (writer("REST") | (
                 c.signal("writer.place") < c.part("writer").digits)), seen=writer("DIGIT"),
             bug=(Bug(decimal_writer, 'm.next = "DIGIT"', 'm.next = "FAULT"'),
                  Bug(decimal_writer, "place.eq(self.digits - 1)", "place.eq(self.digits)")))
    c.always("answers-of-frames", "What is remembered is no name of a value.",
             answer <= Answer.VALUE.value, seen=answer == Answer.HELP.value,
             bug=Bug(frames, "answer.eq(Answer.HELP)", "answer.eq(Answer.SPEED)"))


def describe_alone(c: Contract, dut: FrameInterpreter) -> None:
    """Promise besides what is kept where nobody needs it."""
    describe(c, dut)
    numbers = c.part("reader").numbers
    kept = c.keep(len(dut.speed), init=START_SPEED, name="number_kept")
    with c.m.If(c.rst):
        c.m.d.sync += kept.eq(START_SPEED)
    with c.m.Elif(c.state("interpreter_state")("NUMBER") & numbers.valid):
        c.m.d.sync += kept.eq(numbers.p.value)
    c.always("keeps-its-number", "It keeps the number that it read last.",
             c.signal("value") == kept, seen=kept == 9,
             bug=Bug(frames, "value.eq(reader.numbers.p.value)",
                     "value.eq(~reader.numbers.p.value)"))


def make(*, short: bool = True) -> FrameInterpreter:
    """Make it, with texts of a letter or with those that people see."""
    return FrameInterpreter(greeting=b"g", help_text=b"h") if short else FrameInterpreter()


FRAMES = Component(
    make=make, describe=describe_alone, depth=16,
    cases=(Case(), Case({"short": False}, real=True), Case(upset=True)))

FRAMES_INSIDE = Component(make=make, describe=describe)
"""What a machine relies on."""
