"""Contract of the interpreter of G-code: an answer a line, and nothing of one that is refused."""

from unittest.mock import patch

from amaranth import Cat, Module, Mux, Value

from fresa.protocol import (
    GCodeActionKind,
    GCodeInterpreter,
    GCodeKind,
    GCodeStatus,
    Operand,
    gcode_interpreter,
)

from .contract import Bits, Case, Component, Contract, Unknown

__all__ = ["GCODE_INTERPRETER"]

PARTS = {"line": "GCodeLine", "coordinates": "GCodeCoordinates", "converter": "UnitConverter"}
"""What reads words, and what computes."""

STARTS = ["CLEAR_OFFSET", "CLEAR_LENGTH", "CLEAR_RATES", "CLEAR_PROBED", "SET_ORIGIN"]
"""States after a reset."""

SUMS = [*STARTS, "COMPUTE", "COMPARE", "STORE_TOOL", "STORE_SPEED", "STORE_FEED",
        "STORE_NON_MODAL", "COMPARE_ORIGIN", "ARRIVE_INTERMEDIATE", "FIND_HOME", "TAKE_HOME",
        "ARRIVE"]
"""States that wait for a sum."""

CHECKS = ["READ", "CHECK_WORDS", "CONVERT", "COMPUTE", "CHECK_LINE", "COMPARE", "CHECK_ARC",
          "CHECK_UNUSED", "CHECK_JOG"]
"""States in which a line may still be refused."""

SOON = 15
"""Clocks in which covers are reached that wait for something."""

JOGS = ["CHECK_WORDS", "CONVERT", "COMPUTE", "CHECK_LINE", "CHECK_UNUSED", "CHECK_JOG", "JOG",
        "ARRIVE", "ANSWER"]
"""States of a jog once its words are read."""


def describe(c: Contract, dut: GCodeInterpreter) -> None:
    """Each line is answered once, and what is refused has done nothing and changed no mode."""
    short = isinstance(c.part("converter"), Unknown)
    for path in PARTS if short else ():
        c.unknown(path)
    state, error = c.state("interpreter_state"), c.signal("error")
    actions, answers, words, position = dut.actions, dut.answers, dut.words, dut.position
    kept = c.past(~c.rst)
    answered = answers.valid & answers.ready
    jogs = actions.p.kind == GCodeActionKind.JOG
    checks = ((actions.p.kind == GCodeActionKind.CHECK_ARC)
              | (actions.p.kind == GCodeActionKind.CHECK_JOG))
    acts = actions.valid & actions.ready & ~checks
    ends = words.valid & words.ready & (words.p.kind == GCodeKind.END)

    ended = c.keep(1, name="ended")  # the end of a line is taken, and it is not answered yet
    acted = c.keep(1, name="acted")  # this line has done something
    begun = c.keep(1, name="begun")  # an item of a line is taken, and it is not answered yet
    # A feed holds, or none: like a mode, and 0 at power-up.
    present = Cat(dut.modes.as_value(), ~dut.feed_zero)
    before = c.keep(len(present), name="modes_before")
    c.m.d.sync += [ended.eq(~c.rst & (ended | ends) & ~answered),
                   acted.eq(~c.rst & (acted | acts) & ~answered),
                   begun.eq(~c.rst & (begun | (words.valid & words.ready)) & ~answered)]
    same = present == before
    urgent = (words.p.status == GCodeStatus.NOT_IDLE) | (words.p.status == GCodeStatus.LOCKED)
    with c.m.If(answered):
        c.m.d.sync += before.eq(present)
    with c.m.If(c.rst):
        c.m.d.sync += before.eq(0)

    of_jog = c.keep(1, name="of_jog")  # items of this line are of the system
    with c.m.If(words.valid & words.ready):
        c.m.d.sync += of_jog.eq(words.p.system)
    c.assume(~words.valid | ~begun | ended | (words.p.system == of_jog))
    c.assume(~kept | ~c.past(words.valid & ~words.ready)
             | (words.valid & (words.p.system == c.past(words.p.system))))
    c.implication("jogs-are-of-the-system", "Only a line of the system jogs.",
                  when=actions.valid & (jogs | (actions.p.kind == GCodeActionKind.CHECK_JOG)),
                  then=of_jog)
    c.implication("jog-jogs-alone", "It does nothing else, and changes no mode.",
                  when=ended & of_jog, then=same & ~(actions.valid & ~jogs & (
                      actions.p.kind != GCodeActionKind.CHECK_JOG)))
    jog, read = c.signal("jog"), c.signal("read")
    c.invariant("jog-known", "What a line is is known a clock before an item of it is taken, and "
                "stays known.", (~begun | (jog == of_jog))
                & (~read | (state("READ", "FAULT") & (~words.valid | (jog == words.p.system)))),
                cover=read, lemma=True)
    c.invariant("jog-states", "A jog has states of its own, and is no arc, and does not probe.",
                (~of_jog | ~ended | state(*JOGS, "FAULT"))
                & (~of_jog | ~state(*JOGS) | ~ended
                   | ~(c.signal("is_arc") | c.signal("is_probe")))
                & (~state("CHECK_JOG", "JOG") | of_jog), cover=state("JOG"), lemma=True)

    starting = c.signal("starting")
    c.invariant("line-at-a-time", "Words are taken only before the end of their line, and it is "
                "answered only after it.", ~(words.ready & ended) & ~(answers.valid & ~ended)
                & (ended == ~(state("READ", "FAULT") | starting)), cover=ended)
    c.invariant("starts", "After a reset nothing is offered or taken until the origin is set.",
                ~starting | (state(*STARTS) & ~begun & ~acted & ~words.ready & ~position.ready
                             & ~actions.valid & same & (error == 0)), cover=starting)
    c.invariant("starts-once", "What a reset clears is cleared once.",
                starting | ~state(*STARTS[:4]), cover=~starting, lemma=True)
    c.invariant("sums", "A sum runs in the states that wait for one, and in no other.",
                c.signal("computing") == state(*SUMS), cover=c.signal("computing"), lemma=True)
    c.implication("refused-line-does-nothing", "A line that is refused has done nothing, and the "
                  "modes are as before, and whether a feed holds.",
                  when=answers.valid & (answers.payload != 0), then=~acted & same)
    c.implication("nothing-before-the-checks", "Until a line is right it does nothing, and no mode "
                  "changes.", when=state(*CHECKS), then=~acted & same, lemma=True)
    c.invariant("right-line-has-no-error", "Only a line with an error is refused.",
                (error == 0) | state("ANSWER", "FAULT"), cover=state("FLOW"))
    c.invariant("nothing-with-an-error", "A line with an error has done nothing.",
                (error == 0) | (~acted & same), cover=error != 0, lemma=True)
    c.implication("first-error-answers", "A line with a wrong word is answered with its error.",
                  when=c.past(ends & ~c.rst & ~urgent & (c.part("line").error != 0)),
                  then=answers.valid & (answers.payload == c.past(c.part("line").error)))
    c.implication("status-answers", "A line whose words are right, or for which the machine is not "
                  "ready, is answered with its status.",
                  when=c.past(ends & ~c.rst & (urgent | (c.part("line").error == 0))
                              & (words.p.status.as_value() != 0)),
                  then=answers.valid & (answers.payload == c.past(words.p.status.as_value())))
    probed = c.keep(1, name="probed")  # a line of this line's probes, and has not ended
    probes, touches = (actions.valid & (actions.p.kind == kind)
                       for kind in (GCodeActionKind.PROBE, GCodeActionKind.PROBED))
    with c.m.If(actions.ready & (probes | touches)):
        c.m.d.sync += probed.eq(probes)
    with c.m.If(c.rst):
        c.m.d.sync += probed.eq(0)
    c.implication("probe-waits", "The end of a probing is offered only behind a probing of its "
                  "line.", when=touches, then=probed & ended)
    c.implication("probe-holds", "Until then no other action and no answer is offered.",
                  when=probed, then=~answers.valid & (~actions.valid | touches))
    c.invariant("awaits", "It is known in which states its end is awaited.",
                (c.signal("awaits") == probed) & (~state("PROBED") | probed)
                & (~probed | (ended & ~of_jog & state("ARRIVE", "PROBED", "FAULT"))),
                cover=state("PROBED"), lemma=True)
    c.invariant("position-first", "A position is taken before an item of a line, and only where "
                "none of the line was, or while the end of a probing is awaited.",
                position.ready == (((state("READ") & ~begun) | touches)
                                   & ~(dut.divide & ~dut.divided)),
                cover=position.ready & position.valid & words.valid)
    c.implication("position-before-item", "No item is taken in the clock of a position.",
                  when=position.valid & position.ready, then=~words.ready)
    store = c.part("coordinates")
    # A list is of a line that no other follows yet.
    c.assume(~dut.divide | touches | (state("READ") & ~begun & ~words.valid & ~dut.erase))
    c.assume(~c.past(dut.divide & ~dut.divided & ~c.rst) | dut.divide)
    c.assume(~c.past(dut.divide & ~c.rst) | ~dut.divide
             | (Value.cast(dut.division) == c.past(Value.cast(dut.division))))
    c.implication("lists", "A word that is divided for a list is read where it is.",
                  when=c.part("converter").divide,
                  then=~store.run & (store.address == dut.shown_address))
    c.implication("lists-undisturbed", "That goes on until it is divided.",
                  when=c.past(c.part("converter").divide & ~dut.divided & ~c.rst),
                  then=c.part("converter").divide)
    c.implication("lists-at-once", "It begins as soon as no word is stored.",
                  when=dut.divide & ~c.signal("stores"), then=c.part("converter").divide)
    axis = position.p.axis
    none = axis[:2] == 3
    c.implication("position-is-stored", "A clock later it is stored as that of its axis, or as "
                  "where the probe touched.",
                  when=c.past(position.valid & position.ready & ~none & ~c.rst),
                  then=store.write & ~store.run & (store.address == c.past((Mux(
                      axis[2], Operand.PROBED, Operand.POSITION) + axis[:2])[:6]))
                  & (store.data == c.past(position.p.value)))
    c.implication("no-axis-is-not-stored", "That of no axis is not.",
                  when=c.past(position.valid & position.ready & none & ~c.rst),
                  then=~c.signal("stores"))
    _waits(c, dut, state, acts)
    _line(c, dut, state, begun)
    _streams(c, dut, kept)
    _parts(c)
    if short:
        c.assume(~c.part("converter").fault)
        _let_lines_be_any(c, dut)
        if not c.upset:
            jogs_alone = c.free(1, name="jogs_alone")  # all lines are jogs, or none is
            # Either nothing is waited for, or anything; but then no longer than most covers take.
            soon = c.free(1, name="soon")
            clocks = c.keep(range(SOON + 2), name="clocks")
            c.m.d.sync += clocks.eq(Mux(clocks <= SOON, clocks + 1, clocks))
            store, converter, line = (c.part(name) for name in ("coordinates", "converter", "line"))
            c.restrict_covers(
                ~c.rst & (dut.words.p.system == jogs_alone)
                & (~c.past(1) | ((jogs_alone == c.past(jogs_alone)) & (soon == c.past(soon))))
                & (soon | (clocks <= SOON))
                & (~soon | (store.done & converter.done & ~converter.too_long & dut.words.valid
                            & (dut.words.p.kind.as_value() == Mux(
                                begun, GCodeKind.END.value, GCodeKind.WORD.value))
                            & ~dut.position.valid & ~dut.divide
                            & (dut.words.p.status.as_value() == 0) & (dut.verdict == 0)
                            & dut.actions.ready & (line.error == 0))))
    else:
        converter = c.state("converter.converter_state")
        c.invariant("converter-codes-in-use", "The converter has a state of its own.",
                    ~converter("FAULT") & ~converter.is_unused(), cover=c.rst, lemma=True)
    c.leaves_unused_codes("interpreter_state", fault=dut.fault,
                          shows=~actions.valid & ~answers.valid & ~words.ready & ~position.ready)


def _line(c: Contract, dut: GCodeInterpreter, state, begun: Bits) -> None:
    """State that a line begins with the present modes, and that modes are some."""
    line = c.part("line").line
    c.implication("line-begins-with-modes", "A line begins with the modes of the one before.",
                  when=~begun, then=Value.cast(line.modes) == Value.cast(dut.modes))
    c.invariant("begun", "Words belong to the line that has begun.",
                (c.signal("begun") == begun)
                & (begun | state("READ", "FAULT") | c.signal("starting"))
                & (~c.signal("starting") | (Value.cast(dut.modes) == 0)), cover=begun, lemma=True)
    for name, modes in [("modes", dut.modes), ("line-modes", line.modes)]:
        c.invariant(f"{name}-are-some", "Motion, plane and system are of those that there are; the "
                    "spindle turns in one direction.", _some(modes),
                    cover=modes.motion.as_value() == 4)


def _waits(c: Contract, dut: GCodeInterpreter, state, acts: Bits) -> None:
    """State what the last one was of all that is done or stored, by what each changes."""
    actions, kind = dut.actions, dut.actions.p.kind.as_value()
    at_once = Cat(kind == each for each in (0, 1, 2, 10, 12)).any()  # lines, arcs, jogs, probing
    neither = Cat(kind == each for each in (3, 11, 13)).any()  # checks, and the end of a probing
    stores = state("STORE_NON_MODAL")
    stored = stores & c.part("coordinates").done
    c.implication("waits", "GRBL would have waited behind what is stored of coordinates, and any "
                  "action but a motion.", when=c.past((stored | (acts & ~neither)) & ~c.rst),
                  then=dut.waits == c.past(stored | ~at_once))
    c.implication("waits-no-less", "That does not change before the next one is offered.",
                  when=c.past(~c.rst & ~stores & ~(actions.valid & ~neither)),
                  then=dut.waits == c.past(dut.waits))
    starting = c.signal("starting")
    c.invariant("waits-for-nothing", "A reset ends it.", ~starting | ~dut.waits, cover=starting)


def _some(modes) -> Bits:
    motion = modes.motion.as_value()
    return (((motion <= 4) | (motion >= 8) & (motion <= 11)) & (modes.plane <= 2)
            & (modes.system <= 5) & ~(modes.clockwise & modes.counter_clockwise))


def _streams(c: Contract, dut: GCodeInterpreter, kept: Bits) -> None:
    """State that what is offered stays until it is taken."""
    for name, stream in [("action", dut.actions), ("answer", dut.answers)]:
        payload = Value.cast(stream.payload)
        c.implication(f"{name}-stays", "It is offered until it is taken, and does not change.",
                      when=kept & c.past(stream.valid & ~stream.ready),
                      then=stream.valid & (payload == c.past(payload)))


def _parts(c: Contract) -> None:
    """State what the contracts of the parts assume."""
    store, converter, line = (c.part(name) for name in ("coordinates", "converter", "line"))
    text = Value.cast(line.line)
    computes = store.run & ~store.done
    c.implication("sum-undisturbed", "A sum runs until it is done, of the same words.",
                  when=c.past(computes & ~c.rst),
                  then=store.run & (Value.cast(store.sum) == c.past(Value.cast(store.sum)))
                  & (text == c.past(text)), lemma=True)
    converts = converter.run & ~converter.done & ~converter.too_long
    c.implication("conversion-undisturbed", "A conversion runs until it is over, of the same line.",
                  when=c.past(converts & ~c.rst), then=converter.run & (text == c.past(text)),
                  lemma=True)
    c.invariant("divides-alone", "Nothing is divided for a list while a line is converted.",
                ~(converter.run & converter.divide), cover=converter.divide, lemma=True)
    state = c.state("interpreter_state")
    c.invariant("converting", "A conversion runs while the interpreter waits for it, unless the "
                "line is too long.", Mux(
                    state("CONVERT"), converter.run == ~line.line.too_long,
                    ~converter.run | state("FAULT") | state.is_unused()),
                cover=state("CONVERT"), lemma=True)
    c.invariant("line-undisturbed", "A line is cleared, ended and added to in different clocks.",
                ~(line.take & line.clear) & ~(line.end_program & (line.take | line.clear)),
                cover=line.end_program, lemma=True)


def _let_lines_be_any(c: Contract, dut: GCodeInterpreter) -> None:
    """Let the line be what its own contract states, and anything else."""
    part = c.part("line")
    line = Value.cast(part.line)
    modes = Value.cast(part.line.modes)
    changes = part.take | part.clear | part.end_program
    c.assume(_some(part.line.modes))
    c.assume(c.past(changes | c.rst, init=1)
             | ((line == c.past(line)) & (part.error == c.past(part.error))))
    c.assume(~c.past(part.clear & ~c.rst)
             | ((modes == c.past(Value.cast(dut.modes))) & (part.error == 0)))
    c.assume(c.past(~c.rst) | ((modes == 0) & (part.error == 0)))


class _Short(GCodeInterpreter):
    """Without what computes: results come when, and as, the contract likes."""

    def elaborate(self, platform) -> Module:
        def instead(real):
            return lambda **parameters: Unknown(real(**parameters))

        with patch.dict(vars(gcode_interpreter), {
                name: instead(getattr(gcode_interpreter, name)) for name in PARTS.values()}):
            return super().elaborate(platform)


def make(*, width: int, computes: bool = True) -> GCodeInterpreter:
    """Make it, or without what computes."""
    return (GCodeInterpreter if computes else _Short)(width=width)


GCODE_INTERPRETER = Component(
    make=make, describe=describe, depth=29,
    cases=(Case({"width": 40, "computes": False}), Case({"width": 44}, real=True),
           Case({"width": 40, "computes": False}, upset=True)))
