"""Contract of the lines that are run at every start."""

from amaranth import Array, Cat, Const, Mux

from fresa.protocol import GCodeText, StoredLines

from .contract import Case, Component, Contract

__all__ = ["STORED_LINES"]

NUMBER = 3
"""Texts; the last is never run."""


def describe(c: Contract, dut: StoredLines) -> None:
    """By any one character of any one text, which is watched from power-up."""
    lines, items, answers = dut.lines, dut.items, dut.answers
    given = items.valid & items.ready
    taken = lines.valid & lines.ready
    answered = answers.valid & answers.ready
    began = c.past(1)
    begins = ~began | c.past(c.rst)
    state = c.state("lines_state")
    length = dut.length

    # What comes is a stream, an answer follows a line, and the gate keeps to its protocol.
    c.assume(begins | ~c.past(lines.valid & ~lines.ready)
             | (lines.valid & (lines.payload.as_value() == c.past(lines.payload.as_value()))))
    unanswered = c.keep(3, name="lines_without_answer")
    c.assume(~answers.valid | (unanswered != 0))
    c.assume(begins | ~c.past(answers.valid & ~answers.ready)
             | (answers.valid & (answers.payload == c.past(answers.payload))))
    waits = c.keep(1, name="all_are_awaited")  # behind a line with a $
    dollar = c.keep(1, name="has_dollar")
    c.m.d.sync += unanswered.eq(unanswered + (given & items.p.end) - answered)
    with c.m.If(unanswered == 0):
        c.m.d.sync += waits.eq(0)
    with c.m.If(taken):
        c.m.d.sync += dollar.eq(~items.p.end & (dollar | (items.p.byte == ord("$"))))
        with c.m.If(items.p.end & dollar):
            c.m.d.sync += waits.eq(1)
    with c.m.If(c.rst):
        c.m.d.sync += [unanswered.eq(0), waits.eq(0), dollar.eq(0)]
    slot = c.keep(2, name="slot_before")
    c.m.d.sync += slot.eq(Mux(c.rst, 0, dut.slot))
    c.assume((slot == 0) | (dut.slot == 0) | (dut.slot == slot))
    c.assume((dut.slot != 0) | ~(dut.writing | dut.keep))
    c.assume(~(dut.writing & dut.keep) & ((slot != 0) | ~dut.keep))
    c.assume(begins | ~c.past(dut.keep) | (dut.slot == 0))
    c.assume(~dut.restore | (dut.slot == 0))
    c.assume(~dut.seen | (dut.character != 0))

    # One character of one text
    watched, place = c.free(range(NUMBER + 1), name="text"), c.free(
        range(length + 1), name="place")
    c.assume((watched >= 1) & (place <= length)
             & (~began | ((watched == c.past(watched)) & (place == c.past(place)))))
    rows = length + 1
    texts = [b"", *dut.texts, *[b""] * (NUMBER - len(dut.texts))]
    initial = Array(Const(byte, 8) for text in texts for byte in text.ljust(rows, b"\0"))[
        Cat(place, watched)]
    count = c.keep(range(length + 2), name="characters")
    brought, present = c.keep(8, name="brought"), c.keep(8, name="present")
    known = c.keep(1, name="known")  # it has been written, or it is as it was
    started = c.keep(1, name="has_started")
    c.m.d.sync += started.eq(1)
    with c.m.If(~started):
        c.m.d.sync += [present.eq(initial), known.eq(1)]
    now, is_known = Mux(started, present, initial), Mux(started, known, 1)
    comes = dut.writing & dut.seen
    of_it = dut.slot == watched
    # Only the end that was kept behind a shorter text is of interest, and nothing behind it.
    with c.m.If(dut.keep & of_it):
        c.m.d.sync += [present.eq(Mux(count == place, 0, brought)), known.eq(count >= place)]
    with c.m.If(dut.restore):
        c.m.d.sync += [present.eq(initial), known.eq(1)]
    with c.m.If(comes & (count == place)):
        c.m.d.sync += brought.eq(dut.character)
    with c.m.If(comes & (count <= length)):
        c.m.d.sync += count.eq(count + 1)
    with c.m.If((dut.slot == 0) | c.rst):
        c.m.d.sync += count.eq(0)
    c.assume(~dut.keep | (count <= length))  # one that is too long is refused
    c.invariant("too-long", "It shows that a text has too many characters.",
                (dut.too_long == (count > length)) | (slot == 0), cover=dut.too_long)

    memory = Array(c.words("texts"))
    copies = [c.signal("copy")[2 * number:2 * number + 2] for number in range(NUMBER + 1)]
    stands = Array(copies)[watched]
    c.invariant("kept", "The memory has the text that was kept last.",
                ~is_known | (memory[Cat(place, stands, watched)] == now), cover=known, lemma=True)
    other = Mux(stands == 1, 2, 1)
    c.invariant("copies", "The texts of power-up are never written.",
                (memory[Cat(place, Const(0, 2), watched)] == initial)
                & Cat(each < 3 for each in copies).all(),
                cover=stands == 2, lemma=True)
    c.invariant("brought", "What comes is beside it.",
                (dut.slot != watched) | (count <= place) | (place == length)
                | (memory[Cat(place, other, watched)] == brought), cover=count > place, lemma=True)
    c.invariant("count", "The characters are counted.",
                (slot == 0) | (c.signal("count") == Mux(count > length, length, count)),
                cover=count > length, lemma=True)

    # A text that is run
    number, at = c.signal("number"), c.signal("run_place")
    runs = state("READ") & (number + 1 == watched) & ~dut.restore
    byte = c.signal("run_byte")
    c.implication("as-it-was-kept", "A text is run as it was kept: each of its characters, and "
                  "then the end of the line.",
                  when=runs & items.valid & (at == place) & is_known,
                  then=(items.p.byte == now) & (items.p.end == (now == 0)))
    held = c.past(is_known & ~dut.keep & ~dut.restore)
    c.implication("read", "A byte is that of its place.",
                  when=state("READ") & (number + 1 == watched) & (at == place) & is_known
                  & (c.signal("run_step") == 2) & held, then=byte == now, lemma=True)
    c.assume(~state("READ") | ~(dut.keep | dut.restore))  # these come with an answer, and before
    count_run = c.keep(range(length + 2), name="given")
    with c.m.If(state("READ") & given):
        c.m.d.sync += count_run.eq(Mux(items.p.end, 0, count_run + 1))
    with c.m.If(c.rst | ~state("READ")):
        c.m.d.sync += count_run.eq(0)
    c.invariant("in-order", "Its characters come one after the other.",
                ~state("READ") | (at == count_run[:len(at)]), cover=count_run == 1)
    c.implication("no-empty-line", "An empty text is not run.",
                  when=state("READ") & items.valid & items.p.end, then=at != 0)

    # One that is shown
    shown, shows = c.signal("shown_place"), dut.text.valid & dut.wanted
    was_wanted = c.keep(1, name="was_wanted")
    c.m.d.sync += was_wanted.eq(dut.wanted)
    c.assume(~was_wanted | ~dut.wanted | (dut.shown == c.past(dut.shown)))
    c.assume(~dut.wanted | ~(dut.keep | dut.restore))
    c.implication("shown-as-it-was-kept", "So it is shown.",
                  when=shows & (dut.shown == watched) & (shown == place) & is_known,
                  then=(dut.text.p.byte == now) & (dut.text.p.end == (now == 0)))
    c.implication("shown-from-the-begin", "From its first character.",
                  when=~began | c.past(~dut.wanted), then=(shown == 0) & ~dut.text.valid)
    c.implication("shown-byte", "A byte is that of its place.",
                  when=dut.wanted & was_wanted & (c.signal("shown_step") == 2)
                  & (dut.shown == watched) & (shown == place) & is_known,
                  then=c.signal("shown_byte") == now, lemma=True)

    # Lines and answers
    c.implication("lines-pass", "Otherwise what comes is passed as it is.",
                  when=(items.valid | taken) & ~state("READ"),
                  then=state("LINE") & lines.valid & (taken == given)
                  & (items.payload.as_value() == lines.payload.as_value()))
    c.implication("lines-wait", "While a text is run no line is taken.",
                  when=state("READ", "REPLY", "NEXT"), then=~lines.ready)
    c.implication("waits-for-all", "Behind a line with a $ the next begins when all are answered.",
                  when=waits, then=~items.valid)
    c.implication("alone", "So does a text.", when=state("READ", "NEXT"), then=unanswered == 0)
    c.implication("held", "A text does not begin while it is held.",
                  when=state("READ") & (at == 0) & dut.held, then=~items.valid)
    c.implication("answers-pass", "The answer of a line that came is said.",
                  when=dut.said.valid, then=state("LINE", "ANSWER") & answers.valid
                  & (dut.said.payload == answers.payload) & (dut.said.ready == answers.ready))
    c.implication("replies", "That of a text that was run is given with its number.",
                  when=dut.replies.valid, then=state("REPLY") & answers.valid
                  & (answers.ready == dut.replies.ready) & dut.replies.p.ends
                  & (dut.replies.p.code == answers.payload)
                  & (dut.replies.p.text.as_value() == Mux(
                      number == 0, Mux(answers.payload == 0, GCodeText.RAN_FIRST.value,
                                       GCodeText.REFUSED_FIRST.value),
                      Mux(answers.payload == 0, GCodeText.RAN_SECOND.value,
                          GCodeText.REFUSED_SECOND.value))))
    c.implication("no-answer-is-lost", "An answer that is taken is said or given.", when=answered,
                  then=(dut.said.valid & dut.said.ready)
                  | (dut.replies.valid & dut.replies.ready))
    c.implication("runs-when-asked", "Texts are run after a reset, unless it is locked, and after "
                  "the answer behind a request.",
                  when=~begins & state("READ") & c.past(~state("READ", "NEXT")),
                  then=c.past((state("CHOOSE") & ~dut.locked)
                              | (state("ANSWER") & (unanswered == 0) & c.signal("asked"))))
    c.implication("both", "Both, the first one first.",
                  when=~begins & c.past(state("NEXT")),
                  then=Mux(c.past(number) == 0, state("READ") & (number == 1),
                           state("LINE") & (number == 0)))
    c.invariant("states", "It waits for answers only behind lines, and begins with the first.",
                state("FAULT") | ((waits == state("ANSWER")) & (unanswered <= 3)
                                  & (state("LINE", "ANSWER") | (unanswered == state("REPLY")))
                                  & (c.signal("unanswered") == Mux(state("REPLY"), 0, unanswered))
                                  & (state("START", "CHOOSE", "LINE")
                                     | ~c.signal("system"))
                                  & (c.signal("system") == dollar)
                                  & (state("READ", "REPLY", "NEXT") | (number == 0))),
                cover=waits, lemma=True)
    steps = c.signal("run_step"), c.signal("shown_step")
    c.invariant("steps", "It counts three clocks.", (steps[0] < 3) & (steps[1] < 3)
                & (state("READ") | (steps[0] == 0) | begins | c.past(state("READ"))),
                cover=steps[0] == 2, lemma=True)
    c.leaves_unused_codes("lines_state", fault=dut.fault, shows=~items.valid)


FEW = {"texts": [b"A", b"", b"B"], "length": 1}

STORED_LINES = Component(make=StoredLines, describe=describe,
                         cases=(Case(FEW), Case({**FEW, "length": 3}, real=True),
                                Case(FEW, upset=True)), depth=30)
