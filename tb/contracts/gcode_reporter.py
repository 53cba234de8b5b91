"""Contract of the reporter of a G-code machine: what is taken is told, whole, once, in order."""

from typing import Any

from amaranth import Array, Cat, Fragment, Mux, Value

from fresa.protocol import GCodeReporter, TextSource

from .contract import Bits, Case, Component, Contract

__all__ = ["GCODE_REPORTER"]

FIELDS = 6
"""Fields of a report: always, pins, origin, overrides, accessories, end."""
MESSAGES, OK, ERROR, ALARM, BREAK, STATES, FIRST_FIELD, PARTS = 0, 12, 13, 14, 15, 16, 28, 32
"""Texts of answers, alarms and the end of an open line, and the first of messages, states, first
fields and parts of lists."""

FURTHER_FIELDS = 25, 26, 27, 54, 55
"""Texts of the other fields."""


def describe(c: Contract, dut: GCodeReporter) -> None:
    """A line is told from its first text to its last, and is that of what was taken."""
    state = c.state("reporter_state")
    # Behind a reset the past is of no interest.
    goes_on = c.past(~c.rst)
    if not c.upset:
        c.restrict_covers(~c.rst)
    text, code, value = (c.signal(name) for name in ("text", "code", "value"))
    fields, open_ = c.signal("fields"), c.signal("part_open")
    source, writer = c.part("texts"), c.part("writer")
    asked = source.numbers.valid & source.numbers.ready
    answers, alarms, messages, listed = dut.answers, dut.alarms, dut.messages, dut.listed
    took_answer, took_alarm, took_message, took_part = (
        each.valid & each.ready for each in (answers, alarms, messages, listed))
    readies: Bits = Cat(answers.ready, alarms.ready, messages.ready, listed.ready)
    quiet = source.numbers.ready & ~c.signal("full") & writer.numbers.ready
    sending = source.numbers.valid | dut.bytes.valid
    for each in (answers, alarms, messages):  # streams
        c.assume(c.past(0, init=1) | c.past(c.rst) | ~c.past(each.valid & ~each.ready)
                 | (each.valid & (Value.cast(each.payload) == c.past(Value.cast(each.payload)))))
    told = dut.stored_text
    c.assume(c.past(0, init=1) | c.past(c.rst) | ~c.past(told.valid & ~told.ready)
             | (told.valid & (told.payload.as_value() == c.past(told.payload.as_value()))))
    c.assume(~messages.valid | (Value.cast(messages.payload) < 10))
    c.assume(dut.state.as_value() < 9)

    c.implication("one-at-a-time", "No more than one line or part is taken in a clock, and none "
                  "while anything is sent.", when=readies.any(),
                  then=((readies & (readies - 1)[:4]) == 0) & quiet & ~sending)
    for name, taken, number in (
            ("answer", took_answer, Mux(answers.payload == 0, OK, ERROR)),
            ("alarm", took_alarm, ALARM),
            ("message", took_message, MESSAGES + Value.cast(messages.payload)),
            ("part", took_part, PARTS + Value.cast(listed.p.text))):
        c.implication(f"{name}-is-told", f"The text of {name} that was taken is asked for next.",
                      when=goes_on & c.past(taken), then=asked & (text == c.past(number)))
    c.implication("number-of-answer", "The number in an error or an alarm is that which was taken.",
                  when=goes_on & c.past(took_answer | took_alarm),
                  then=code == c.past(Mux(took_answer, answers.payload, alarms.payload)))
    c.implication("numbers-of-part", "Those in a part of a list are its own.",
                  when=goes_on & c.past(took_part),
                  then=(code == c.past(listed.p.code)) & (value == c.past(listed.p.value))
                  & (open_ == c.past(~listed.p.ends)))
    c.implication("numbers-stay", "They do not change while their text is sent.",
                  when=goes_on & c.past(~quiet),
                  then=(code == c.past(code)) & (value == c.past(value)))
    c.implication("asked-for-a-reason", "A text is asked for when something was taken, a report "
                  "begins or goes on, or the rest of a line does not come.", when=asked,
                  then=c.past(took_answer | took_alarm | took_message | took_part
                              | state("SAMPLE") | fields[1:].any()
                              | (state("PART") & c.signal("abandoned"))))
    c.implication("byte-stays", "A byte that is offered stays until it is taken.",
                  when=goes_on & c.past(dut.bytes.valid & ~dut.bytes.ready),
                  then=dut.bytes.valid & (dut.bytes.payload == c.past(dut.bytes.payload)))

    # A stored text
    c.implication("stored-text", "Each of its bytes is sent when it is taken, while it is wanted.",
                  when=told.valid & told.ready & ~told.p.end,
                  then=dut.stored_wanted & dut.bytes.valid & dut.bytes.ready
                  & (dut.bytes.payload == told.p.byte))
    c.implication("stored-text-to-its-end", "It is wanted until its end is taken.",
                  when=goes_on & c.past(dut.stored_wanted & ~(told.valid & told.ready
                                                              & told.p.end)) & ~dut.fault,
                  then=dut.stored_wanted & (dut.stored == c.past(dut.stored)))
    c.implication("nothing-more-of-it", "Then it is not, and nothing of it is taken.",
                  when=goes_on & c.past(told.valid & told.ready & told.p.end),
                  then=~dut.stored_wanted & ~told.ready)

    # A report
    began = state("SAMPLE")
    accessories = c.keep(4, name="accessories")
    with c.m.If(began):
        c.m.d.sync += accessories.eq(dut.accessories)
    c.implication("report-begins", "A report begins with the state of the machine.",
                  when=goes_on & c.past(began),
                  then=asked & (text == STATES + c.past(dut.state.as_value()))
                  & (code == c.past(dut.substate)) & (c.signal("pins") == c.past(dut.pins)))
    c.implication("report-is-whole", "It has its places and its end, and its pins if one is on.",
                  when=goes_on & c.past(began),
                  then=fields[0] & fields[FIELDS - 1] & (fields[1] == c.past(dut.pins.any()))
                  & (fields[4] == (fields[3] & c.past(dut.accessories.any()))))
    c.implication("accessories-wait", "They wait for the fields before.", when=fields.any(),
                  then=c.signal("accessories") == c.kept["accessories"], lemma=True)
    first = (text >= FIRST_FIELD) & (text < PARTS)
    field: Bits = Cat(first, *(text == number for number in FURTHER_FIELDS))
    c.implication("fields-in-order", "Its fields are asked for in their order, each once, and "
                  "the accessories are those of its begin.",
                  when=goes_on & c.past(fields.any()) & (fields != c.past(fields)),
                  then=asked & (fields == c.past(fields & (fields - 1))) & Mux(
                      fields == 0, 1, ~c.past(began)) & (field & c.past(fields)).any()
                  & ((field - 1)[:FIELDS] & c.past(fields) == 0)
                  & (~field[4] | (c.signal("pins") == c.kept["accessories"])))
    c.implication("shown", "The first is that which is to be shown.",
                  when=goes_on & c.past(fields[0]) & ~fields[0],
                  then=text == FIRST_FIELD + c.past(dut.shown))
    c.implication("reporting", "Places hold until the last field is asked for.",
                  when=dut.reporting | began | fields.any(),
                  then=dut.reporting & (began | fields[FIELDS - 1]))
    c.implication("nothing-within-a-report", "Nothing else is taken meanwhile.",
                  when=dut.reporting, then=~readies.any())

    # Units: marks of numbers say what their decimals depend on
    inches = c.keep(1, name="inches")
    with c.m.If(state("REST") | c.rst):
        c.m.d.sync += inches.eq(dut.inches & ~c.rst)
    c.invariant("unit", "That is what is kept.", c.signal("inches") == inches, cover=inches,
                lemma=True)
    c.invariant("decimals", "A number has the decimals of its unit, which is that before its line.",
                state("FAULT") | (writer.decimals == Array(
                    [0, inches, 3, 3 + inches])[c.signal("item")[4:6]]), cover=inches)

    # What comes first
    rests = goes_on & c.past(state("REST") & ~c.rst)
    none = ~alarms.valid & ~messages.valid
    c.implication("alarm-first", "Of what waits an alarm comes first.",
                  when=rests & c.past(alarms.valid), then=alarms.ready)
    c.implication("then-message", "Then a message.",
                  when=rests & c.past(messages.valid & ~alarms.valid), then=messages.ready)
    c.implication("answer-between-reports", "After a report an answer or part that waits comes "
                  "before the next.", when=rests & c.past(none & c.signal("answer_first") & (
                      answers.valid | (listed.valid & ~dut.abandon))),
                  then=answers.ready | listed.ready | dut.abandon)
    c.implication("report-when-asked-for", "A report comes if one was asked for, and as soon.",
                  when=rests & c.past(none & c.signal("waiting") & ~c.signal("answer_first")),
                  then=began)
    c.implication("only-when-asked-for", "There is no other report.", when=began,
                  then=c.past(c.signal("waiting")))

    # A line in parts
    c.implication("next-part", "Behind a part that ends no line comes the next, or its end.",
                  when=asked & c.past(state("PART")),
                  then=(c.past(took_part)) | ((text == BREAK) & ~open_))
    c.implication("nothing-between-parts", "Nothing else is taken there.",
                  when=open_ & ~state("FAULT"),
                  then=~answers.ready & ~alarms.ready & ~messages.ready & ~dut.reporting)
    c.implication("given-up", "The rest of a line that is abandoned is its end.",
                  when=goes_on & c.past(state("PART") & c.signal("abandoned")),
                  then=asked & (text == BREAK) & ~open_ & ~c.signal("abandoned"))

    c.invariant("quiet", "Between texts nothing is left of the last.",
                state("SEND", "FAULT") | (quiet & ~source.bytes.valid), cover=state("ASK"),
                lemma=True)
    c.invariant("texts", "The source of texts has a byte only while it sends one.",
                ~source.bytes.valid | ~source.numbers.ready, cover=source.bytes.valid, lemma=True)
    c.invariant("open", "A line is open where its text is sent, or the next part is awaited.",
                state("FAULT") | Mux(open_, state("ASK", "SEND", "PART") & (fields == 0),
                                     ~state("PART")), cover=open_, lemma=True)
    c.invariant("fields", "Fields are left only while a report is sent.",
                state("ASK", "SEND", "FAULT") | (fields == 0), cover=fields.any(), lemma=True)
    c.invariant("abandoned", "Only an open line is abandoned.",
                state("FAULT") | open_ | ~c.signal("abandoned"), cover=c.signal("abandoned"),
                lemma=True)
    c.invariant("last-field", "While fields are left, the end is.",
                (fields == 0) | fields[FIELDS - 1] | state("FAULT"), cover=fields[FIELDS - 1],
                lemma=True)
    c.leaves_unused_codes("reporter_state", fault=dut.fault, shows=~readies.any())


def make(*, brief: bool = False, **parameters: Any) -> GCodeReporter:
    """Make a reporter, of whose texts only a byte each is sent if it is to be brief.

    That is the first one, or the mark of a stored text.
    """
    dut = GCodeReporter(**parameters)
    if brief:
        Fragment.get(dut.texts, None)  # else Amaranth warns that it is unused
        dut.texts = TextSource([
            bytes([next((byte for byte in text if byte & 0xCF == 0x8B), text[0])])
            for text in dut.texts.texts])
    return dut


GCODE_REPORTER = Component(
    make=make, describe=describe, depth=40,
    cases=(Case({"position_bits": 12, "brief": True}), Case(real=True),
           Case({"position_bits": 12, "brief": True}, upset=True)))
