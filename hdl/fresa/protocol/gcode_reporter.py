"""Lines of a G-code machine to its host: answers, alarms, messages, status reports."""

from collections.abc import Sequence
from enum import IntEnum

from amaranth import Cat, Module, Mux, Signal, Value, signed
from amaranth.lib import enum, stream, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..choice import choice_code, choose, look_up
from ..fsm import leave_unused_codes
from .decimal_writer import DecimalWriter
from .gcode_lister import LISTED, GCodeText
from .gcode_settings import SETTING_BITS
from .line import LineItem
from .text import TextSource

__all__ = ["GCodeMessage", "GCodeReporter", "GCodeState", "ReportNumber"]


class GCodeState(enum.Enum, shape=4):
    """State of a G-code machine, as GRBL 1.1 names it."""

    IDLE = 0
    RUN = 1
    HOLD = 2
    JOG = 3
    ALARM = 4
    DOOR = 5
    CHECK = 6
    HOME = 7
    SLEEP = 8


class GCodeMessage(enum.Enum, shape=4):
    """Line that a G-code machine sends of itself."""

    GREETING = 0
    LOCKED = 1
    UNLOCKED = 2
    ENABLED = 3
    DISABLED = 4
    RESET_TO_CONTINUE = 5
    CHECK_DOOR = 6
    PROGRAM_END = 7
    SLEEPING = 8
    RESTORING = 9
    CHECK_LIMITS = 10
    RESTORING_SPINDLE = 11


class ReportNumber(IntEnum):
    """Number that the planner computes for reports, by its address there."""

    FEED = 3  # mm/min, or 1/10 inch/min
    SPINDLE = 4  # rev/min
    X = 8  # position of the machine, or of work, um, or 1/10000 inch
    Y = 9
    Z = 10
    ORIGIN_X = 12  # of the work coordinates, likewise
    ORIGIN_Y = 13
    ORIGIN_Z = 14


GREETINGS = {"grbl": b"Grbl 1.1h ['$' for help]", "thesis": b"start"}
"""What a machine says after power-up and reset, by dialect."""

NOTICES = {
    GCodeMessage.LOCKED: b"'$H'|'$X' to unlock",
    GCodeMessage.UNLOCKED: b"Caution: Unlocked",
    GCodeMessage.ENABLED: b"Enabled",
    GCodeMessage.DISABLED: b"Disabled",
    GCodeMessage.RESET_TO_CONTINUE: b"Reset to continue",
    GCodeMessage.CHECK_DOOR: b"Check Door",
    GCodeMessage.PROGRAM_END: b"Pgm End",
    GCodeMessage.SLEEPING: b"Sleeping",
    GCodeMessage.RESTORING: b"Restoring defaults",
    GCodeMessage.CHECK_LIMITS: b"Check Limits",
    GCodeMessage.RESTORING_SPINDLE: b"Restoring spindle",
}

# In texts a byte 10kknnnn stands for the number n, with decimals by its kind k, or for the stored
# text k; and 11xxxxxx for a letter, without the highest bit, that is sent if the next pin is on.
RATE, DECIMAL, LENGTH = 0x10, 0x20, 0x30
"""Kinds of numbers: one decimal in inches, otherwise none; three; four in inches, otherwise three.
Others have none."""

CODE, BLOCKS, BYTES, VALUE = 0x80, 0x81, 0x82, 0x85
SHOWN = tuple(0x80 | number for number in ReportNumber)
"""Marks of the numbers that are read."""

OVERRIDES = 0x86, 0x87, 0x8F
"""Marks of percentages."""

STORED = 0x8B
"""Mark of stored texts, with the number of one as its kind."""

FEED, SPEED = SHOWN[0] | RATE, SHOWN[1]
POSITION, ORIGIN = (tuple(mark | LENGTH for mark in SHOWN[first:first + 3]) for first in (2, 5))

FIRST_FIELDS = tuple(
    b"|%b:%c,%c,%c" % (name, *POSITION) + free + b"|FS:%c,%c" % (FEED, SPEED)
    for free in (b"", b"|Bf:%c,%c" % (BLOCKS, BYTES)) for name in (b"WPos", b"MPos"))
"""First field of a report, by what it is to show."""

FURTHER_FIELDS = (
    b"|Pn:" + bytes(0x80 | letter for letter in b"PXYZDRHS"),
    b"|WCO:%c,%c,%c" % ORIGIN,
    b"|Ov:%c,%c,%c" % OVERRIDES,
    b"|A:" + bytes(0x80 | letter for letter in b"SCFM"),
    b">\r\n",
)
"""The others; all but the last are intermittent."""

ALWAYS, HAS_PINS, HAS_ORIGIN, HAS_OVERRIDES, HAS_ACCESSORIES, HAS_END = range(
    1 + len(FURTHER_FIELDS))
MESSAGES, STATES, FIRST, LISTS = 0, 16, 28, 32
"""Numbers of the first texts of messages, states, first fields and lists: their own are the low
bits."""

OK, ERROR, ALARM, BREAK = range(MESSAGES + len(GCodeMessage), STATES)
"""Numbers of answers, alarms, and the end of a line whose rest does not come."""

FIELDS = (*range(STATES + len(GCodeState), FIRST),
          *range(LISTS + len(GCodeText), LISTS + len(GCodeText) + 2))
"""Those of `FURTHER_FIELDS`: what is left between the others, as each number takes room."""

REFRESH_ORIGIN, REFRESH_OVERRIDES, REFRESH_AT_REST = 30, 20, 10
"""Reports from one with that field to the next, in a state in which something may move; and in
the others, of both."""

AT_REST = (GCodeState.IDLE, GCodeState.ALARM, GCodeState.CHECK, GCodeState.SLEEP)


class GCodeReporter(wiring.Component):
    """Sends the lines of a G-code machine, one after the other, each ended by CR and LF.

    A line that has begun is sent to its end. Then, of what waits, comes first an alarm, then a
    message, a report, an answer or part of a list; but one of the last two that waits comes
    before a second report. So no rate of requests keeps them back. What is chosen is taken a clock
    later, if it is still there. Behind a part of a list that ends no line nothing else is sent but
    the next part, or, if the list is abandoned, the end of the line.

    A report is ``<state|MPos:x,y,z|Bf:blocks,bytes|FS:feed,speed>``, or what of it is to be
    ``shown``, with further fields before its end: ``Pn:`` and the letters of the pins that are on,
    if any is; ``WCO:`` in the first report, in the first after `origin_changed`, and in every 30th
    after that, every 10th in a state in which nothing moves; ``Ov:`` in the next report, in the
    first without ``WCO:`` after `overridden`, and then in every 20th or 10th that has no ``WCO:``,
    with ``A:`` and the letters of the accessories behind it, if any is on. Requests while one waits
    are dropped.

    The texts are in one ROM, together with marks where numbers and letters of pins belong, and one
    writer of decimal numbers serves them all. A number is read when its mark comes, or sampled when
    its digits begin, so that none needs a register here: those that belong together, the positions,
    must hold while ``reporting`` is 1. Pins and substate are sampled in the first clock of it.

    ========  ================================================================  ===================
    state     does                                                              next
    ========  ================================================================  ===================
    REST      chooses a line                                                    SAMPLE for a report,
                                                                                or TAKE
    TAKE      takes what was chosen, if it is still there                       ASK, or REST
    PART      waits for the rest of a line of a list                            ASK
    SAMPLE    samples the state, chooses the fields of the report               ASK
    ASK       requests a text                                                   SEND
    SEND      sends it with its numbers                                         ASK, PART, or REST
                                                                                after the last
    FAULT     shows ``fault``, takes nothing                                    stays until reset
    ========  ================================================================  ===================

    Parameters
    ----------
    dialect : str
        ``grbl`` or ``thesis``: the greeting.
    options : str
        Letters of what the machine is built with, of GRBL's, for ``$I``.
    blocks : int
        Blocks that it has room for, for ``$I``.
    receive : int
        Bytes that it has room for, for ``$I``.
    stores : bool
        It has stored texts: two startup lines, and one of the user.
    notes : sequence of str
        What else ``$I`` says, each in a message of its own: printable ASCII without brackets.
    position_bits : int
        Bits of a position in um, from 12 to 32; the other numbers have at most one bit less.

    Members
    -------
    answers : In(stream.Signature(8))
        0 for ``ok``, or the number of an ``error``.
    alarms : In(stream.Signature(5))
        Numbers of alarms.
    messages : In(stream.Signature(GCodeMessage))
        Messages.
    listed : In(stream.Signature(LISTED))
        Parts of lists, each taken when it begins to be sent.
    abandon : In(1)
        No further part of the list comes, for one clock.
    request : In(1)
        Send a report. A request in the clock in which one begins is for the next.
    reporting : Out(1)
        A report is being sent.
    state : In(GCodeState)
        State of the machine, sampled in the first clock of ``reporting``.
    substate : In(2)
        Its digit, for HOLD and DOOR.
    shown : In(2)
        ``MPos:``, otherwise ``WPos:``; ``Bf:``. Constant while ``reporting`` is 1.
    inches : In(1)
        Lengths are in 1/10000 inch, not in um, and rates in 1/10 inch a minute, not in mm; other
        values of parts are as they are. Sampled before each line.
    number_address, number_read, number : Out(4), Out(1), In(signed(position_bits))
        Read another number, a `ReportNumber`, which is there from the second clock on. At other
        addresses none is of interest. Never in two clocks in succession.
    origin_changed : In(1)
        The origin is another from this clock on.
    overridden : In(1)
        An override or an accessory is another from this clock on.
    overrides : In(8) x 3
        Of feed, rapids and spindle, in percent.
    accessories : In(4)
        Those that are on: spindle clockwise, counter-clockwise, flood, mist.
    free_blocks, free_bytes : In(8)
        Room in the queue of blocks and in the buffer of bytes.
    pins : In(8)
        Pins that are on: probe, X, Y and Z limits, door, reset, hold, start.
    stored, stored_wanted, stored_text : Out(2), Out(1), In(stream.Signature(LineItem))
        The stored text of a number, wanted until its end has come.
    bytes : Out(stream.Signature(8))
        The bytes of all lines.
    fault : Out(1)
        A state register was upset. Stays until reset.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, dialect: str = "grbl", options: str = "V", blocks: int = 63,
                 receive: int = 128, stores: bool = True, notes: Sequence[str] = (),
                 position_bits: int = 27) -> None:
        if dialect not in GREETINGS:
            raise ValueError(f"dialect must be {' or '.join(GREETINGS)}, not {dialect!r}")
        in_range("position_bits", position_bits, 12, 32)
        for note in notes:
            if not (note.isascii() and note.isprintable()) or "[" in note or "]" in note:
                raise ValueError(f"a note is printable ASCII without brackets, not {note!r}")
        stored = [bytes([STORED | number << 4]) if stores else b"" for number in range(4)]
        build = b"".join(b"[%b]\r\n" % line for line in (
            b"VER:1.1h.20190830:" + stored[3], f"OPT:{options},{blocks},{receive}".encode(),
            *(f"MSG:{note}".encode() for note in notes)))
        self.texts = TextSource(_texts(GREETINGS[dialect], build, stored), slot=32)
        self._writer = DecimalWriter(width=max(position_bits, SETTING_BITS + 1), is_signed=True,
                                     most_decimals=4)
        super().__init__({
            "answers": In(stream.Signature(8)),
            "alarms": In(stream.Signature(5)),
            "messages": In(stream.Signature(GCodeMessage)),
            "listed": In(stream.Signature(LISTED)), "abandon": In(1),
            "request": In(1), "reporting": Out(1),
            "state": In(GCodeState), "substate": In(2), "shown": In(2),
            "inches": In(1),
            "number_address": Out(4), "number_read": Out(1), "number": In(signed(position_bits)),
            "origin_changed": In(1), "overridden": In(1), "overrides": In(8).array(3),
            "accessories": In(4), "free_blocks": In(8), "free_bytes": In(8), "pins": In(8),
            "stored": Out(2), "stored_wanted": Out(1),
            "stored_text": In(stream.Signature(LineItem)),
            "bytes": Out(stream.Signature(8)),
            "fault": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()

        m.submodules.texts = texts = self.texts
        m.submodules.writer = writer = self._writer

        text = Signal.like(texts.numbers.payload)
        code = Signal(8)  # of an answer, an alarm or a part, or the substate
        pins = Signal(8)  # or accessories; the lowest is the next
        accessories = Signal(4)
        fields = Signal(HAS_END + 1)  # of the report, still to be sent
        waiting = Signal()  # a report
        answer_first = Signal()
        value = Signal.like(self.listed.p.value)
        part_open = Signal()  # the line of a list goes on with another part
        abandoned = Signal()  # which does not come
        inches = Signal()  # of this line
        samples = Signal()
        has_origin, has_overrides = self._intermittent(m, samples)
        with m.If(self.request):
            m.d.sync += waiting.eq(1)
        with m.If(self.abandon & part_open):
            m.d.sync += abandoned.eq(1)
        m.d.comb += self.reporting.eq(samples | fields[HAS_END])

        # A character, or what stands for one: a register behind the ROM.
        item = Signal(8)
        full = Signal()
        read, known = Signal(), Signal()  # the number that it may stand for: asked for, there
        done = Signal()
        m.d.comb += texts.bytes.ready.eq(~full)
        with m.If(texts.bytes.valid & ~full):
            m.d.sync += [item.eq(texts.bytes.payload), full.eq(1)]
        m.d.sync += [read.eq(full & ~done), known.eq(read & ~done)]
        with m.If(done):
            m.d.sync += full.eq(0)

        source = Signal(5)  # of a number, by a code
        codes = {mark & 0xF: choice_code(number)
                 for number, mark in enumerate((SHOWN[0], VALUE, CODE, BLOCKS, BYTES, *OVERRIDES))}
        codes |= {mark & 0xF: codes[SHOWN[0] & 0xF] for mark in SHOWN}
        m.d.comb += [self.number_address.eq(item), self.number_read.eq(full & ~read)]
        m.d.sync += source.eq(look_up([codes.get(mark, 0) for mark in range(16)],
                                      item[:4], len(source)))

        is_pin, is_sent, is_stored = Signal(), Signal(), Signal()
        m.d.comb += [
            is_pin.eq(item[6:8] == 0b11),
            is_stored.eq((item[:4] == STORED & 0xF) & (item[6:] == STORED >> 6)),
            is_sent.eq((item[7] == 0) | (is_pin & pins[0])),
            self.stored.eq(item[4:]), self.stored_wanted.eq(full & is_stored),
            texts.numbers.payload.eq(text),
            writer.numbers.payload.eq(choose(
                [self.number, value, code, self.free_blocks, self.free_bytes, *self.overrides],
                source, self._writer.shape.width)),
            writer.decimals.eq(Mux(item[5], Mux(item[4] & inches, 4, 3), item[4] & inches)),
            writer.bytes.ready.eq(self.bytes.ready),
            self.bytes.valid.eq(writer.bytes.valid),
            self.bytes.payload.eq(Mux(writer.numbers.ready, Mux(
                is_stored, self.stored_text.p.byte, item[:7]), writer.bytes.payload)),
        ]

        # What is taken: chosen a clock before, so that no source waits for all the others.
        takes_alarm, takes_message, takes_answer = Signal(), Signal(), Signal()
        has_part, takes_part = Signal(), Signal()
        m.d.comb += has_part.eq(self.listed.valid & ~self.abandon)
        part = self.listed.p
        # A part is looked at before it is known whether there is one, which is far.
        looks = Signal()
        with m.If(looks):
            m.d.sync += [text.eq(LISTS + part.text.as_value()), code.eq(part.code),
                         value.eq(part.value)]
        with m.If(takes_part):
            m.d.sync += part_open.eq(~part.ends)

        with m.FSM(name="reporter_state") as fsm:
            with m.State("REST"):
                m.d.sync += [takes_alarm.eq(0), takes_message.eq(0), takes_answer.eq(0),
                             inches.eq(self.inches)]
                with m.If(self.alarms.valid):
                    m.d.sync += takes_alarm.eq(1)
                    m.next = "TAKE"
                with m.Elif(self.messages.valid):
                    m.d.sync += takes_message.eq(1)
                    m.next = "TAKE"
                with m.Elif(waiting & ~(answer_first
                                        & (self.answers.valid | self.listed.valid))):
                    m.d.sync += [waiting.eq(self.request), answer_first.eq(1)]
                    m.next = "SAMPLE"
                with m.Elif(self.answers.valid):
                    m.d.sync += takes_answer.eq(1)
                    m.next = "TAKE"
                with m.Elif(has_part):
                    m.next = "TAKE"

            with m.State("TAKE"):
                m.next = "REST"
                with m.If(takes_alarm):
                    m.d.comb += self.alarms.ready.eq(1)
                    with m.If(self.alarms.valid):
                        m.d.sync += [text.eq(ALARM), code.eq(self.alarms.payload)]
                        m.next = "ASK"
                with m.Elif(takes_message):
                    m.d.comb += self.messages.ready.eq(1)
                    with m.If(self.messages.valid):
                        m.d.sync += text.eq(MESSAGES + self.messages.payload.as_value())
                        m.next = "ASK"
                with m.Elif(takes_answer):
                    m.d.comb += self.answers.ready.eq(1)
                    with m.If(self.answers.valid):
                        m.d.sync += [
                            text.eq(Mux(self.answers.payload == 0, OK, ERROR)),
                            code.eq(self.answers.payload),
                            answer_first.eq(0),
                        ]
                        m.next = "ASK"
                with m.Else():
                    m.d.comb += [self.listed.ready.eq(~self.abandon), looks.eq(1)]
                    with m.If(has_part):
                        m.d.comb += takes_part.eq(1)
                        m.d.sync += answer_first.eq(0)
                        m.next = "ASK"

            with m.State("PART"):
                with m.If(abandoned):
                    m.d.sync += [text.eq(BREAK), part_open.eq(0), abandoned.eq(0)]
                    m.next = "ASK"
                with m.Else():
                    m.d.comb += [self.listed.ready.eq(~self.abandon), looks.eq(1)]
                    with m.If(has_part):
                        m.d.comb += takes_part.eq(1)
                        m.next = "ASK"

            with m.State("SAMPLE"):
                m.d.comb += samples.eq(1)
                m.d.sync += [
                    text.eq(STATES + self.state.as_value()),
                    code.eq(self.substate),
                    pins.eq(self.pins), accessories.eq(self.accessories),
                    fields.eq(1 << ALWAYS | self.pins.any() << HAS_PINS | has_origin << HAS_ORIGIN
                              | has_overrides << HAS_OVERRIDES
                              | (has_overrides & self.accessories.any()) << HAS_ACCESSORIES
                              | 1 << HAS_END),
                ]
                m.next = "ASK"

            with m.State("ASK"):
                m.d.comb += texts.numbers.valid.eq(1)
                m.next = "SEND"

            with m.State("SEND"):
                with m.If(full & known & writer.numbers.ready):
                    m.d.comb += [
                        self.bytes.valid.eq(is_sent),
                        writer.numbers.valid.eq(item[7] & ~is_pin),
                        done.eq(~is_sent | self.bytes.ready),
                    ]
                    with m.If(is_stored):
                        ends = self.stored_text.p.end
                        m.d.comb += [
                            writer.numbers.valid.eq(0),
                            self.bytes.valid.eq(self.stored_text.valid & ~ends),
                            self.stored_text.ready.eq(self.bytes.ready | ends),
                            done.eq(self.stored_text.valid & ends),
                        ]
                    with m.If(done & is_pin):
                        m.d.sync += pins.eq(pins >> 1)
                with m.Elif(~full & texts.numbers.ready & writer.numbers.ready):
                    m.d.sync += fields.eq(fields & (fields - 1))
                    m.next = "REST"
                    with m.If(part_open):
                        m.next = "PART"
                    for number in reversed(range(len(fields))):
                        with m.If(fields[number]):
                            m.d.sync += text.eq(FIELDS[number - 1] if number
                                                else FIRST + self.shown)
                            m.next = "ASK"
                    with m.If(fields[:HAS_ACCESSORIES + 1] == 1 << HAS_ACCESSORIES):
                        m.d.sync += pins.eq(accessories)

            with m.State("FAULT"):
                pass

        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT") | writer.fault)
        return m

    def _intermittent(self, m: Module, samples: Value) -> tuple[Value, Value]:
        """Return whether a report that samples now has the origin, and the overrides."""
        origin_left = Signal(range(REFRESH_ORIGIN))  # reports until the next that has it
        overrides_left = Signal(range(REFRESH_OVERRIDES))
        at_rest = Signal()
        has_origin, has_overrides = Signal(), Signal()
        m.d.comb += [
            at_rest.eq(Cat(self.state == state for state in AT_REST).any()),
            has_origin.eq(origin_left == 0),
            has_overrides.eq((overrides_left == 0) & ~has_origin),
        ]
        with m.If(samples):
            m.d.sync += origin_left.eq(origin_left - 1)
            with m.If(has_origin):
                m.d.sync += origin_left.eq(Mux(at_rest, REFRESH_AT_REST, REFRESH_ORIGIN) - 1)
            with m.If(has_overrides):
                m.d.sync += overrides_left.eq(
                    Mux(at_rest, REFRESH_AT_REST, REFRESH_OVERRIDES) - 1)
            with m.Elif(overrides_left != 0):
                m.d.sync += overrides_left.eq(overrides_left - 1)
        with m.If(self.origin_changed):
            m.d.sync += origin_left.eq(0)
        with m.If(self.overridden):
            m.d.sync += overrides_left.eq(0)
        return has_origin, has_overrides


def _texts(greeting: bytes, build: bytes, stored: Sequence[bytes]) -> list[bytes]:
    """Return all texts by their numbers, with the marks of the stored ones."""
    messages = {GCodeMessage.GREETING: greeting,
                **{message: b"[MSG:%b]" % notice for message, notice in NOTICES.items()}}
    states = {state: b"<" + state.name.capitalize().encode() for state in GCodeState}
    for state in (GCodeState.HOLD, GCodeState.DOOR):
        states[state] += b":%c" % CODE
    end = b"\r\n"
    texts = dict(enumerate(
        (*(messages[each] + end for each in GCodeMessage),
         b"ok" + end, b"error:%c" % CODE + end, b"ALARM:%c" % CODE + end, end), MESSAGES))
    for first, others in ((STATES, [states[state] for state in GCodeState]),
                          (FIRST, FIRST_FIELDS),
                          (LISTS, [_lists(build, stored)[text] for text in GCodeText])):
        texts |= dict(enumerate(others, first))
    texts |= dict(zip(FIELDS, FURTHER_FIELDS, strict=True))
    return [texts[number] for number in range(len(texts))]


def _lists(build: bytes, stored: Sequence[bytes]) -> dict[GCodeText, bytes]:
    """Return what parts of lists say."""
    return {
        GCodeText.HELP: b"[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? "
                        b"ctrl-x]\r\n",
        GCodeText.BUILD: build,
        GCodeText.STARTUP: b"$N0=%b\r\n$N1=%b\r\n" % (stored[1], stored[2]),
        GCodeText.RAN_FIRST: b">%b:ok\r\n" % stored[1],
        GCodeText.REFUSED_FIRST: b">%b:error:%c\r\n" % (stored[1], CODE),
        GCodeText.RAN_SECOND: b">%b:ok\r\n" % stored[2],
        GCodeText.REFUSED_SECOND: b">%b:error:%c\r\n" % (stored[2], CODE),
        GCodeText.MOTION: b"[GC:G%c" % VALUE, GCodeText.G: b" G%c" % VALUE,
        GCodeText.M: b" M%c" % VALUE, GCodeText.TOOL: b" T%c" % VALUE,
        GCodeText.FEED: b" F%c" % (VALUE | RATE), GCodeText.SPEED: b" S%c]\r\n" % VALUE,
        GCodeText.COORDINATES: b"[G%c:%c" % (CODE, VALUE | LENGTH),
        GCodeText.AXIS: b",%c" % (VALUE | LENGTH),
        GCodeText.LAST_AXIS: b",%c]\r\n" % (VALUE | LENGTH),
        GCodeText.LENGTH: b"[TLO:%c]\r\n" % (VALUE | LENGTH),
        GCodeText.PROBED: b"[PRB:%c" % (VALUE | LENGTH),
        GCodeText.LAST_PROBED: b",%c:%c]\r\n" % (VALUE | LENGTH, CODE),
        GCodeText.PROBE_MOTION: b"[GC:G38.%c" % VALUE,
        GCodeText.WHOLE_SETTING: b"$%c=%c\r\n" % (CODE, VALUE),
        GCodeText.DECIMAL_SETTING: b"$%c=%c\r\n" % (CODE, VALUE | DECIMAL),
    }
