# amaranth: UnusedElaboratable=no

"""Contract of the planner of G-code: procedures that end, and blocks that are whole.

The formulas are an unknown which keeps what their contract proves: what is in registers may be
anything, and a table takes any time. So nothing is stated of what formulas compute, nor by which
of them a word of a block has its value: that is for the models to say with which benches compare
every word of a block. Stated is what goes on, when, how often and in which order.

The first case has procedures of a few rows, in the order of the real ones, for covers and mutants;
the other has all rows.
"""

from typing import Any

from amaranth import Array, Cat, Mux, Value
from amaranth.lib import data

from fresa.motion import gcode_planner
from fresa.motion.blocks import BlockHeader, BlockKind, OverrideKind
from fresa.motion.gcode_planner import HomingRequest
from fresa.protocol import GCodeActionKind as Kind

from .contract import Bits, Case, Component, Contract
from .gcode_procedures import (
    ACTION,
    ADDRESSES,
    BEGIN,
    CONFIGURE,
    HOME,
    NONE,
    REPORT,
    PlannerControl,
    Procedures,
)

__all__ = ["GCODE_PLANNER"]

ROW_CLOCKS = 7
"""Most clocks of a row, without those for which it waits."""

SETTINGS, TABLES = 43, 24
"""How many there are."""

SOON = 12
"""Clocks in which covers are reached that wait for something."""

LATE = 18
"""Clocks in which covers are reached, but those of the longest procedures."""

BLOCKS = {
    Kind.RAPID: (0, 1), Kind.LINE: (0, 1), Kind.PROBE: (0, 1), Kind.JOG: (0, 1), Kind.ARC: (0, 2),
    Kind.CHECK_ARC: (0, 0), Kind.CHECK_JOG: (0, 0), Kind.OFFSETS: (0, 0), Kind.DWELL: (1, 1),
    Kind.SPINDLE: (1, 1), Kind.COOLANT: (1, 1), Kind.PAUSE: (1, 1), Kind.END: (1, 1)}
"""Fewest and most blocks of an action: a motion to where it starts has none."""

KINDS = {Kind.DWELL: BlockKind.DWELL, Kind.SPINDLE: BlockKind.OUTPUTS,
         Kind.COOLANT: BlockKind.OUTPUTS, Kind.PAUSE: BlockKind.PAUSE, Kind.END: BlockKind.END}
"""Of blocks that are no motion."""


def describe(c: Contract, dut: PlannerControl) -> None:
    """What is asked for is done one after the other, in an order, and answered once."""
    c.unknown("formulas")
    state, formulas = c.state("planner_state"), c.part("formulas")
    words, positions, actions = dut.words, dut.positions, dut.actions
    c.leaves_unused_codes("planner_state", fault=dut.fault, shows=~(
        words.valid | positions.valid | formulas.start | formulas.write | dut.beyond))
    c.implication("fault-of-formulas", "A fault of the formulas shows.", when=formulas.fault,
                  then=dut.fault, upset=True)
    answers = Cat(0, actions.ready, dut.configured, dut.begun, dut.reported, dut.homed)
    c.implication("fault-answers-nothing", "In the clock after a fault there is no answer.",
                  when=c.past(state("FAULT")), then=~answers.any(), upset=True)
    if c.upset:
        return
    c.assume(~formulas.fault)
    payload = Value.cast(actions.payload)
    c.assume(~actions.valid | (actions.p.kind.as_value() <= Kind.PROBE.value))
    computes, ends = c.keep(1, name="computes"), c.free(1, name="table_ends")
    _restrict(c, dut, formulas, ends)
    c.m.d.sync += computes.eq((formulas.start | (computes & ~ends)) & ~c.rst)
    c.assume(formulas.busy == computes)
    c.assume(formulas.done == c.past(computes & ends & ~c.rst))
    at = Procedures(c, dut, state)
    # An action stays from when it is seen at rest until it is taken.
    c.assume(~((at.under == ACTION) | (at.begins & (at.asked == ACTION)))
             | actions.valid & (payload == c.past(payload)))
    _answers(c, dut, state, at, answers)
    _time(c, dut, state, at, formulas)
    _blocks(c, dut, state, at, answers)
    _registers(c, dut, state, at, formulas)
    _kept(c, dut, state, at)


def _restrict(c: Contract, dut: PlannerControl, formulas: Any, ends: Bits) -> None:
    """Let covers have one request, and wait for nothing, or for anything while it is early."""
    actions, homing = dut.actions, dut.homing
    soon, clocks = c.free(1, name="soon"), c.keep(range(LATE + 2), name="clocks")
    c.m.d.sync += clocks.eq(Mux(clocks <= LATE, clocks + 1, clocks))
    requests = Cat(soon, Value.cast(actions.payload), actions.valid, dut.configure, dut.begin,
                   dut.report, Value.cast(homing.kind), homing.axis, dut.soft, dut.inches)
    numbers = Cat(dut.operand, dut.setting, *dut.steps, dut.spindle_speed, dut.speed,
                  homing.thousandths)
    longest = ~dut.configure & (dut.begin | ~dut.report & (Value.cast(homing.kind) == 0)
                                & (actions.p.kind == Kind.ARC))
    stays = ~c.past(1) | (requests == c.past(requests))
    waits = Mux(soon, dut.words.ready & dut.positions.ready & ends & ~dut.shown_read,
                clocks <= SOON)
    c.restrict_covers(~c.rst & dut.room & (numbers == 0) & (formulas.word <= 1) & stays & waits
                      & (longest | (clocks <= LATE)))


def _answers(c: Contract, dut: PlannerControl, state, at: Procedures, answers: Bits) -> None:
    """State that what is asked for is done and answered once."""
    c.implication("begins", "At rest what is asked for begins in the second clock, by its order.",
                  when=c.past(at.begins & ~c.rst), then=state("LOOK-UP"))
    c.implication("begins-nothing-else", "Nothing begins that was not asked for.",
                  when=c.past(~at.begins & (state("IDLE") | state("TELL")) | c.rst),
                  then=state("IDLE"))
    c.invariant("answers", "It is answered by its own answer, for one clock, when it is done.",
                answers == Mux(state("TELL"), 1 << at.under, 0)[:len(answers)],
                cover=answers.any())
    c.implication("rests-after-an-answer", "With that it is over.",
                  when=c.past(answers.any() & ~c.rst), then=state("IDLE") & ~answers.any())
    c.implication("actions-with-room", "An action begins with two places in the queue.",
                  when=state("LOOK-UP") & (at.under == ACTION),
                  then=c.past(c.past(dut.actions.valid & dut.room)))
    c.implication("takes-its-action", "What is taken is the action that was done.",
                  when=dut.actions.ready,
                  then=dut.actions.valid & (dut.actions.p.kind.as_value() == at.doing))
    kind = dut.actions.p.kind.as_value()
    c.invariant("action-stays", "It is there until it is taken.",
                (at.under != ACTION) | (kind == at.doing), cover=at.under == ACTION, lemma=True)
    c.invariant("seen", "It was there with two places when it was seen.",
                (at.asked != ACTION) | c.past(dut.actions.valid & dut.room),
                cover=at.asked == ACTION, lemma=True)
    c.invariant("origin", "The origin may have changed when it has begun, or with offsets.",
                dut.origin_changed == (answers[BEGIN] | (answers[ACTION]
                                                         & at.does(Kind.OFFSETS))),
                cover=dut.origin_changed)


def _time(c: Contract, dut: PlannerControl, state, at: Procedures, formulas: Any) -> None:
    """State for what a procedure waits, and that it ends."""
    offers = (dut.words.valid & ~dut.words.ready) | (dut.positions.valid & ~dut.positions.ready)
    waits = offers | formulas.busy | (state("KEEP") & dut.shown_read)
    goes_on = (at.under != NONE) & ~state("BEYOND")
    of_row = c.keep(range(ROW_CLOCKS + 4), name="clocks_of_row")
    rows = c.keep(8, name="rows")
    fetches = state("FETCH")
    c.m.d.sync += of_row.eq(Mux(goes_on & ~c.rst, Mux(fetches, 1, of_row + (~waits & (
        of_row != ROW_CLOCKS + 3))), 0))
    c.m.d.sync += rows.eq(Mux(goes_on & ~c.rst, rows + fetches, 0))
    most = dut.most_rows
    c.invariant("rows-end", "A row takes seven clocks at most, the last of a procedure two more, "
                "but those in which a word or a position is not taken, a number is not kept while "
                "another is read, or a table of formulas is not through.",
                ~goes_on | (of_row <= ROW_CLOCKS + 1), cover=of_row == ROW_CLOCKS)
    c.invariant("procedures-end", "A procedure has at most 82 rows, that of an arc, and ends.",
                ~goes_on | (rows <= most), cover=rows == 2)
    clocks = {"LOOK-UP": 0, "ROW": 1, "ADDRESS": 2, "READ": 3, "WORD": 4, "KEEP": 5, "ACT": 5,
              "DECIDE": 6, "COMPUTE": 3}
    c.invariant("clocks", "Each state has its clocks of a row.", Cat(
        *(~state(name) | (of_row == number) for name, number in clocks.items()),
        ~state("END") | (of_row <= ROW_CLOCKS), ~state("TELL") | (of_row <= ROW_CLOCKS + 1),
        ~state("FETCH") | (of_row <= ROW_CLOCKS), of_row <= ROW_CLOCKS + 3,
        ~(goes_on & ~state("TELL")) | (rows == Mux(
            state("LOOK-UP"), 0, at.row.index + ~state("FETCH"))),
        ~state("TELL") | (rows <= most)).all(),
        cover=state("DECIDE"), lemma=True)
    c.invariant("computes", "A table is computed where it is waited for.",
                (~formulas.busy & ~formulas.done) | state("COMPUTE"),
                cover=formulas.done, lemma=True)


def _blocks(c: Contract, dut: PlannerControl, state, at: Procedures, answers: Bits) -> None:
    """State what is written of blocks, and how many of them."""
    words, positions = dut.words, dut.positions
    given = words.valid & words.ready
    kept = c.past(~c.rst)
    begins = at.begins | c.rst
    commits, headed = c.keep(2, name="commits"), c.keep(1, name="headed")
    count = c.keep(2, name="positions")
    with c.m.If(given):
        c.m.d.sync += [headed.eq((headed | (words.p.address == 0)) & ~words.p.last),
                       commits.eq(commits + words.p.last)]
    with c.m.If(positions.valid & positions.ready):
        c.m.d.sync += count.eq(count + 1)
    with c.m.If(begins):
        c.m.d.sync += [headed.eq(0), commits.eq(0), count.eq(0)]
    for name, stream in ("word", words), ("position", positions):
        payload = Value.cast(stream.payload)
        c.implication(f"{name}-stays", "It is offered until it is taken, and does not change.",
                      when=kept & c.past(stream.valid & ~stream.ready),
                      then=stream.valid & (payload == c.past(payload)))
    c.implication("addresses", "A word is one of a block, the last of which commits it.",
                  when=words.valid, then=(words.p.address < ADDRESSES)
                  & (words.p.last == (words.p.address == ADDRESSES - 1)))
    c.implication("headers", "A block that is committed has a header of its own.",
                  when=words.valid & words.p.last, then=headed)
    writes = at.under == HOME
    for each, (_, most) in BLOCKS.items():
        writes = writes | (at.does(each) if most else 0)
    c.implication("only-of-blocks", "Words are written of what has a block, and of nothing else.",
                  when=words.valid, then=writes | (at.under == BEGIN))

    def between(fewest: int, most: int) -> Bits:
        return (commits >= fewest) & (commits <= most)

    numbers = [(at.under == BEGIN, 1, 1), ((at.under == CONFIGURE) | (at.under == REPORT), 0, 0),
               *(((at.under == HOME) & (at.home == kind.value), fewest, most)
                 for kind, fewest, most in ((HomingRequest.MOVE, 0, 1), (HomingRequest.PLACE, 0, 0),
                                            (HomingRequest.WAIT, 1, 1))),
               *((at.does(kind), fewest, most) for kind, (fewest, most) in BLOCKS.items())]
    ended = state("END", "TELL")
    c.invariant("number-of-blocks", "A request that is answered has committed as many blocks as "
                "its kind has, and an action two at most.", ~answers.any() | Cat(
                    ~which | between(fewest, most) for which, fewest, most in numbers).all(),
                cover=answers.any() & (commits == 2))
    c.implication("never-more", "Nor has it more before that: there is room for all of them.",
                  when=words.valid & words.p.last, then=(commits == 0) | (
                      at.does(Kind.ARC) & (commits == 1)))
    c.implication("beyond-before-a-block", "What would leave the travel has committed no block.",
                  when=dut.beyond, then=(commits == 0) & at.does(
                      Kind.RAPID, Kind.LINE, Kind.PROBE, Kind.ARC))
    c.implication("beyond-stays", "From then on nothing is done but a reset.",
                  when=kept & c.past(dut.beyond), then=dut.beyond & ~answers.any() & ~words.valid
                  & ~positions.valid & ~c.part("formulas").start & ~c.part("formulas").write)
    looks = state("DECIDE") & (at.present.do == gcode_planner._Do.GUARD)
    c.invariant("beyond", "It would leave the travel if a guard finds so, with soft limits only.",
                ~(dut.beyond & ~c.past(dut.beyond)) | c.past(
                    looks & dut.soft & (c.signal("value") != 0)), cover=dut.beyond)
    c.implication("guards", "A guard that finds so lets nothing pass.",
                  when=c.past(looks & dut.soft & (c.signal("value") != 0) & ~c.rst),
                  then=dut.beyond)
    c.implication("positions", "When it begins the interpreter is told three positions in order.",
                  when=positions.valid, then=(at.under == BEGIN) & (positions.p.axis == count)
                  & (count < 3))
    c.implication("all-positions", "All of them before it has begun.", when=dut.begun,
                  then=count == 3)
    over = Mux(at.present.last, _writes(at) & (at.present.destination == ADDRESSES - 1), 0)
    c.invariant("counted", "Rows before the one that is carried out have written so much.", Cat(
        ~state("FETCH", "ROW", "ADDRESS", "READ", "WORD", "KEEP", "ACT", "DECIDE", "COMPUTE",
               "BEYOND") | (commits == at.row.commits) & (headed == at.row.headed)
        & (count == at.row.positions),
        ~state("LOOK-UP") | (commits == 0) & ~headed & (count == 0),
        ~state("END") | (commits == at.row.commits + over)
        & (count == at.row.positions + (at.present.do == gcode_planner._Do.POSITION)),
        (c.signal("committed") == commits.any()) | state("IDLE")).all(),
        cover=commits == 2, lemma=True)
    c.invariant("counted-at-the-end", "So has the procedure when it ends.", ~ended | Cat(
        *(~which | between(fewest, most) for which, fewest, most in numbers),
        (at.under != BEGIN) | (count == 3)).all(), cover=state("TELL"), lemma=True)
    _headers(c, dut, state, at, commits)


def _writes(at: Procedures) -> Bits:
    """Return whether a row writes a word of the block."""
    return at.present.do.as_value()[3:] == 0b01


def _headers(c: Contract, dut: PlannerControl, state, at: Procedures, commits: Bits) -> None:
    """State what the header of a block says."""
    words, modes = dut.words, dut.actions.p.modes
    header = data.View(BlockHeader, c.signal("header"))
    kind: Bits = Mux(at.under == BEGIN, BlockKind.PLACE.value, Mux(
        (at.under == HOME) & (at.home == HomingRequest.WAIT.value), BlockKind.DWELL.value, 0))
    for each, block in KINDS.items():
        kind = Mux(at.does(each), block.value, kind)
    override = Mux(at.does(Kind.RAPID), OverrideKind.RAPID.value, Mux(
        at.does(Kind.JOG, Kind.PROBE) | (at.under == HOME) & (
            at.home == HomingRequest.MOVE.value), OverrideKind.NONE.value,
        OverrideKind.FEED.value))
    says = words.valid & (words.p.address == 0)
    c.implication("kind-of-the-block", "A header says what the block does.", when=says,
                  then=words.p.data[:3] == kind)
    moves = (at.under == ACTION) | (at.under == HOME) & (at.home == HomingRequest.MOVE.value)
    c.implication("override-of-the-block", "It says which override a motion obeys.",
                  when=says & moves, then=words.p.data[26:28] == override)
    outputs = Cat(modes.clockwise, modes.counter_clockwise, modes.mist, modes.flood)
    c.implication("outputs-of-the-block", "It has the outputs of the modes of its action.",
                  when=says & (at.under == ACTION), then=words.p.data[3:7] == outputs)
    is_header = at.present.do == gcode_planner._Do.HEADER
    now = Value.cast(header)
    c.invariant("header", "The header of what is under way is read in time.", Cat(
        (at.under == NONE) | (Value.cast(header.kind) == kind)
        & (~moves | (Value.cast(header.override) == override))
        & ((at.under != ACTION) | (Value.cast(header.outputs) == outputs)),
        ~(state("READ", "WORD") & is_header) | (c.signal("code") == at.present.input)
        | ~state("READ"),
        ~(state("WORD") & is_header) | (c.signal("other") == now) & (c.signal("operand") == 0),
        ~(state("ACT") & is_header) | (c.signal("value") == now)).all(),
        cover=is_header & state("ACT"), lemma=True)
    last = c.keep(1, name="outputs_last")  # the last block that was committed is one of outputs
    with c.m.If(words.valid & words.ready & words.p.last):
        c.m.d.sync += last.eq(kind == BlockKind.OUTPUTS.value)
    with c.m.If(c.rst):
        c.m.d.sync += last.eq(0)
    c.implication("second-stops", "Outputs stop the motion if the last block was one of outputs.",
                  when=state("LOOK-UP") & at.does(Kind.SPINDLE, Kind.COOLANT),
                  then=at.procedure == Mux(last, gcode_planner._SLOTS["STOPPED_EVENT"],
                                           gcode_planner._SLOTS["EVENT"]))
    c.invariant("outputs-last", "It is known whether that was so.",
                Mux((at.under != NONE) & (commits != 0),
                    last == (kind == BlockKind.OUTPUTS.value), 1)
                & ((at.under != NONE) & (commits != 0) & ~state("TELL")
                   | (c.signal("outputs_last") == last)), cover=last, lemma=True)
    programmed = c.signal("programmed")
    for address, low, part in (3, 14, programmed[:22]), (1, 26, programmed[22:]):
        c.implication(f"feed-in-word-{address}", "The programmed feed is in front of what the word "
                      "is for.", when=words.valid & (words.p.address == address),
                      then=words.p.data[low:] == part)


def _registers(c: Contract, dut: PlannerControl, state, at: Procedures, formulas: Any) -> None:
    """State how the formulas are used, and where values come from."""
    row, value, do = at.present, c.signal("value"), gcode_planner._Do
    bits = len(formulas.address)
    c.implication("one-table-at-a-time", "A table begins while none is computed, and is one.",
                  when=formulas.start, then=~formulas.busy & (formulas.table < TABLES))
    c.implication("not-while-it-computes", "No register is written meanwhile.",
                  when=formulas.write, then=~formulas.busy & ~formulas.start)
    quiet = ~formulas.busy & ~formulas.write
    c.implication("read-in-time", "A register is read when it has come: two clocks after its "
                  "number, while nothing was computed or written.",
                  when=state("WORD") & row.word,
                  then=quiet & c.past(quiet)
                  & c.past(c.past(quiet & (formulas.address == row.source[:bits]))))
    takes = c.past(state("WORD") & row.word & ~c.rst)
    c.implication("value-of-a-register", "Then it is the value of the row.", when=takes,
                  then=value == c.past(formulas.word))
    operand = c.past(dut.operand)
    too_large = (operand >= 1 << 35)
    feeds = (row.do == do.FEED) & at.does(Kind.RAPID)
    loads = row.operand & ~feeds
    number = c.past(Mux(too_large, (1 << 36) - 1, operand.as_unsigned()))
    c.implication("value-of-an-operand", "An operand is the value of its row, one that is too "
                  "large as the highest number.", when=c.past(state("WORD") & loads & ~c.rst),
                  then=value == number[:36])
    c.implication("operand-stays", "Its number stays while it comes.",
                  when=state("READ") & loads,
                  then=dut.operand_address == c.past(dut.operand_address))
    c.implication("settings", "A setting is one that there is.",
                  when=state("ADDRESS", "READ") & (row.do == do.SETTING),
                  then=dut.setting_address < SETTINGS)
    only: Bits = Mux(row.do == do.SETTING, row.source[6:], 0)
    near, slow = dut.homing.near, dut.homing.slow
    c.implication("writes-a-register", "A row that has a value for a register writes it, but a "
                  "setting that is of some requests for no others.",
                  when=state("ACT") & (row.do.as_value()[3:] == 0b00),
                  then=formulas.write == (~only[0] | near) & (~only[1] | slow))
    c.implication("writes-its-value", "What is written to a register is the value, once.",
                  when=formulas.write, then=(formulas.value == value) & state("ACT")
                  & (formulas.address == row.destination[:bits]) & ~c.past(formulas.write))
    c.implication("feed-of-a-rapid", "The feed of a rapid is the highest number.",
                  when=c.past(state("WORD") & feeds & ~c.rst), then=value == (1 << 36) - 1)
    c.implication("travel-with-soft-limits", "The travel is looked at with soft limits only.",
                  when=formulas.start & (row.do == do.RUN_SOFT), then=dut.soft)
    c.invariant("values", "Each kind of row has its value from one source.", Cat(
        ~state("WORD") | ~row.word | (c.signal("operand") == 0) & (c.signal("other") == 0),
        ~state("WORD") | ~loads | (c.signal("other") == 0),
        ~(state("READ") & ~feeds) | (c.signal("code") == row.input),
        ~(state("READ") & feeds) | (c.signal("code") == 3),
        ~(state("WORD") & feeds) | (c.signal("other") == (1 << 36) - 1),
        ~(state("DECIDE")) | (c.signal("zero") == (value == 0))).all(),
        cover=state("DECIDE"), lemma=True)


def _kept(c: Contract, dut: PlannerControl, state, at: Procedures) -> None:
    """State what is kept of numbers, and when."""
    known = c.past(~c.rst)
    settings = Cat(*dut.steps_per_metre, *dut.lengths, *dut.backlash, dut.filter, dut.pulse)
    configures = at.under == CONFIGURE
    for name, kept, when in (
            ("settings", settings, configures),
            ("switch", dut.switch, (at.under == HOME) & (at.home == HomingRequest.PLACE.value)),
            ("verdict", dut.verdict, configures | at.does(
                Kind.ARC, Kind.CHECK_ARC, Kind.CHECK_JOG))):
        changed = Value.cast(kept) != c.past(Value.cast(kept))
        c.implication(f"{name}-stay", "They are as they were, but while they are asked for.",
                      when=known & c.past(known) & changed, then=c.past(when))
    words = [word.as_unsigned() for word in c.words("shown")]
    read, address = dut.shown_read, dut.shown_address
    keeps = state("KEEP") & ~read
    where = c.free(4, name="where")
    word = Array(words)
    place = c.past(where)
    c.implication("shown", "A number that is read is out in the second clock, until another is.",
                  when=known & c.past(known) & c.past(c.past(known)),
                  then=dut.shown.as_unsigned() == Mux(
                      c.past(c.past(read)), c.past(c.past(word[address])),
                      c.past(dut.shown).as_unsigned()))
    written = keeps & (at.present.destination == where)
    c.implication("number-is-kept", "A number is kept while none is read.",
                  when=c.past(written), then=word[place] == c.past(c.signal("value"))[:27])
    c.implication("others-stay", "No other changes.", when=c.past(1) & ~c.past(written),
                  then=word[place] == c.past(word[where]))


GCODE_PLANNER = Component(
    make=PlannerControl, describe=describe, depth=37,
    cases=(Case({"few": True}), Case(real=True), Case({"few": True}, upset=True)))
