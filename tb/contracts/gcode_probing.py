"""Contract of probing: what moves, what is kept and in which clock, what was done at its end."""

from amaranth import Mux, Value

from fresa.motion import AlarmCode, GCodeProbing
from fresa.protocol import GCodeActionKind

from .contract import Bits, Case, Component, Contract, State

__all__ = ["GCODE_PROBING"]


def describe(c: Contract, dut: GCodeProbing) -> None:
    """By what was asked for since the last probing ended."""
    state, actions, passed = c.state("probing_state"), dut.actions, dut.passed
    known = c.past(~c.rst)
    payload = Value.cast(actions.payload)
    probe, waits = (actions.p.kind == kind for kind in (
        GCodeActionKind.PROBE, GCodeActionKind.PROBED))
    taken = actions.valid & actions.ready
    owed = c.keep(1, name="owed")  # a PROBE was taken, and its PROBED was not
    c.m.d.sync += owed.eq(~c.rst & Mux(taken, probe, owed))
    c.assume(~(known & c.past(actions.valid & ~actions.ready))
             | (actions.valid & (payload == c.past(payload))))
    c.assume(~actions.valid | (waits == owed))
    c.assume(~(known & c.past(dut.checking)) | dut.checking)  # a reset ends it

    modes = actions.p.modes
    c.restrict_covers(c.upset | ~c.rst & dut.idle & dut.standing & ~dut.begins & dut.listed
                      & ~actions.p.by_radius
                      & (modes.as_value() == modes.motion.as_value()))
    # What the line wants, while it is offered, and then as it was
    motion = actions.p.modes.motion.as_value()
    kept = c.keep(2, name="wanted")
    with c.m.If(actions.valid & probe):
        c.m.d.sync += kept.eq(motion[:2])
    offered = actions.valid & probe
    wanted: Bits = Mux(offered, motion[:2], kept)
    found = dut.contact ^ wanted[1]
    seeks = c.keep(1, name="seeks")
    initial = dut.failure == AlarmCode.PROBE_INITIAL
    left = c.keep(range(dut.begins_within + 2), name="left")  # clocks in which a line may begin
    ended = seeks & ~found & (left == 0) & dut.idle
    ends = seeks & found | ended & wanted[0]
    c.m.d.sync += [
        left.eq(Mux(seeks, Mux(left == 0, 0, left - 1), dut.begins_within)),
        seeks.eq(~c.rst & ((seeks & ~found & ~ended) | (
            dut.active & passed.valid & passed.ready & probe)))]

    c.implication("others-pass", "Every other action passes in its clock.",
                  when=actions.valid & ~probe & ~waits,
                  then=passed.valid & (Value.cast(passed.payload) == payload)
                  & (actions.ready == passed.ready))
    c.implication("passes-what-is-offered", "Nothing else does, and PROBED does not.",
                  when=passed.valid, then=actions.valid & ~waits
                  & (Value.cast(passed.payload) == payload) & (actions.ready == passed.ready))
    c.implication("passed-stays", "What is passed is offered until it is taken.",
                  when=known & c.past(passed.valid & ~passed.ready), then=passed.valid)
    c.implication("begins-at-rest", "A probing begins when all that was planned is done.",
                  when=known & dut.active & ~c.past(dut.active),
                  then=c.past(dut.idle & ~dut.checking) & offered)
    c.implication("not-towards-a-contact", "A line is planned only if it can find something.",
                  when=dut.active & passed.valid & ~c.past(dut.active & passed.valid),
                  then=probe & c.past(dut.active & ~found))
    c.implication("initial-alarm", "Otherwise nothing moves.", when=initial,
                  then=taken & probe & found & ~passed.valid)
    c.implication("kept", "Where the axes are is kept up to the clock in which the probe changes, "
                  "or the line has come to its end.", when=seeks, then=dut.latch)
    c.implication("kept-no-longer", "It is kept at no other time.", when=dut.latch, then=seeks)
    c.implication("contact-alarm", "The end of a line that has to find something is an alarm.",
                  when=ended & ~wanted[0], then=dut.failure == AlarmCode.PROBE_CONTACT)
    c.implication("no-other-contact-alarm", "Nothing else is.",
                  when=dut.failure == AlarmCode.PROBE_CONTACT, then=ended & ~wanted[0])
    c.implication("touched", "What was found is known.", when=known & c.past(ends),
                  then=dut.touched == c.past(found))
    c.implication("touched-is-of-the-last", "It is as the last line had it, or 0 from the next on.",
                  when=known & (dut.touched != c.past(dut.touched)),
                  then=c.past(ends) | (~dut.touched & c.past(dut.active)))
    c.implication("brakes", "Then it brakes, until it begins anew.",
                  when=known & c.past(ends | (dut.brake & ~dut.restart)), then=dut.brake)

    measured = c.keep(1, name="measured")  # it has begun where it was kept
    renewed = c.keep(1, name="renewed")  # and where it is
    latched, listed = c.keep(1, name="latched"), c.keep(1, name="listed")
    alarmed, checked = c.keep(1, name="alarmed"), c.keep(1, name="checked")
    going = dut.active & ~c.rst & ~(taken & waits)
    c.m.d.sync += [
        latched.eq(going & (latched | ends)),
        measured.eq(going & (measured | (dut.restart & dut.measures))),
        renewed.eq(going & (renewed | (dut.restart & ~dut.measures))),
        listed.eq(going & (listed | dut.listing)),
        alarmed.eq(going & (alarmed | initial)),
        checked.eq(~c.rst & Mux(taken, probe & dut.checking & ~dut.active, checked))]
    c.implication("restarts-at-a-stand", "It begins where it was kept once it stands.",
                  when=dut.restart & dut.measures,
                  then=latched & ~measured & ~renewed & c.past(dut.standing))
    c.implication("begins-where-it-is", "Then, or if nothing was kept, where it is: once.",
                  when=dut.restart & ~dut.measures,
                  then=(measured == latched) & ~renewed & (~measured | c.past(~dut.begins)))
    c.implication("measures-between", "The planner is told which.", when=dut.measures,
                  then=latched & ~renewed)
    c.implication("listed-at-the-end", "It is listed once it has begun, but after alarm 4.",
                  when=dut.listing, then=renewed & ~listed & ~alarmed & c.past(~dut.begins))
    c.implication("ends-when-done", "The probing ends when all that is done; of a line that is "
                  "checked nothing is.", when=taken & waits,
                  then=Mux(checked, ~dut.active, renewed & (listed ^ alarmed)))
    c.implication("checked-does-nothing", "Then it is at rest.",
                  when=checked, then=~dut.active & ~dut.brake & ~dut.restart & ~dut.latch)

    _progress(c, dut, state, going=going, offered=offered, found=found, waits=waits,
              alarmed=alarmed)

    pause = c.signal("pause")
    c.invariant("states", "States are those of what has been done.", _states(c, state, {
        "PASS": (~seeks & ~latched & ~measured & ~renewed & ~listed & ~alarmed
                 & (owed == checked)),
        "CHECK": offered & ~owed & ~latched & ~measured & ~renewed & ~listed & ~alarmed & ~seeks,
        "PLAN": offered & ~owed & ~latched & ~measured & ~renewed & ~listed & ~alarmed & ~seeks,
        "SEEK": (owed & seeks & ~latched & ~measured & ~renewed & ~listed & ~alarmed
                 & (pause == left)),
        "BRAKE": owed & ~seeks & latched & ~measured & ~renewed & ~listed & ~alarmed,
        "MEASURE": (owed & ~seeks & latched & ~measured & ~renewed & ~listed & ~alarmed
                    & c.past(dut.standing)),
        "MEASURING": owed & ~seeks & latched & measured & ~renewed & ~listed & ~alarmed,
        "RESTART": owed & ~seeks & (latched == measured) & ~renewed & ~listed
        & (~alarmed | ~latched) & (~measured | c.past(~dut.begins)),
        "BEGIN": owed & ~seeks & renewed & (latched == measured) & ~listed,
        "LIST": owed & ~seeks & renewed & ~listed & ~alarmed & c.past(~dut.begins),
        "LISTING": owed & ~seeks & renewed & listed & ~alarmed,
        "END": owed & ~seeks & renewed & (listed ^ alarmed),
    }), cover=state("SEEK"), lemma=True)
    c.invariant("lists", "It is listed unless there was alarm 4.",
                (~state("BEGIN", "RESTART") | (c.signal("lists") == ~alarmed))
                & (~state("CHECK") | ~c.signal("lists"))
                & (~state("SEEK", "BRAKE", "MEASURE", "MEASURING") | c.signal("lists")),
                cover=state("BEGIN"), lemma=True)
    c.invariant("wants", "It keeps what the line wants.",
                ~state("CHECK", "PLAN", "SEEK") | ((c.signal("away") == wanted[1])
                                                   & (c.signal("silent") == wanted[0])),
                cover=wanted[1], lemma=True)
    c.invariant("untouched", "Until it finds something nothing is known to be found.",
                ~state("PLAN", "SEEK") | ~dut.touched, cover=state("SEEK"), lemma=True)
    c.invariant("paused", "A line may begin for as long.",
                ~state("CHECK", "PLAN") | (pause == dut.begins_within), cover=state("PLAN"),
                lemma=True)
    c.invariant("unchecked", "A line that is checked is not probed.",
                ~checked | state("PASS", "FAULT"), cover=checked, lemma=True)
    c.leaves_unused_codes("probing_state", fault=dut.fault,
                          shows=~passed.valid & ~actions.ready & ~dut.restart & ~dut.latch)


def _progress(c: Contract, dut: GCodeProbing, state: State, *, going: Bits, offered: Bits,
              found: Bits, waits: Bits, alarmed: Bits) -> None:
    """State that each part of a probing ends in the clock in which it can."""
    known = c.past(~c.rst)
    anew, lists, done = (c.keep(1, name=name) for name in ("begins_anew", "lists", "done"))
    began = anew & ~dut.begins
    c.m.d.sync += [
        anew.eq(going & (anew & dut.begins | (dut.restart & ~dut.measures))),
        lists.eq(going & (lists & ~dut.listed | dut.listing)),
        done.eq(going & (done | (lists & dut.listed) | (began & alarmed)))]
    c.implication("begins", "A probing begins once all that was planned is done.",
                  when=known & c.past(offered & ~dut.active & ~dut.checking & dut.idle),
                  then=dut.active)
    c.implication("checked-passes", "While lines are checked a line passes at once, whatever the "
                  "probe.", when=~dut.active & offered & dut.checking,
                  then=dut.passed.valid & (dut.actions.ready == dut.passed.ready))
    c.implication("checked-ends", "Its end is then taken at once, and does not pass.",
                  when=~dut.active & waits & dut.actions.valid,
                  then=dut.actions.ready & ~dut.passed.valid)
    first = known & dut.active & ~c.past(dut.active)
    c.implication("initial-alarm-at-once", "A probe that is as it should become is seen at once.",
                  when=first & found, then=dut.failure == AlarmCode.PROBE_INITIAL)
    c.implication("plans-at-once", "Otherwise the line is planned.",
                  when=known & c.past(first & ~found), then=dut.passed.valid)
    c.implication("restarts-once-it-stands", "Braking ends when it stands.",
                  when=known & c.past(dut.brake & ~dut.restart & dut.standing),
                  then=dut.restart & dut.measures)
    c.implication("measures-until-begun", "What was kept is told until the planner has begun.",
                  when=known & c.past(dut.measures & (dut.restart | dut.begins)),
                  then=dut.measures & ~dut.restart)
    c.implication("measured", "Then it begins where it is.",
                  when=known & c.past(dut.measures & ~dut.restart & ~dut.begins),
                  then=dut.restart & ~dut.measures)
    c.implication("alarm-ends-it", "So it does after an alarm.",
                  when=known & c.past(dut.failure != AlarmCode.NONE),
                  then=dut.restart & ~dut.measures)
    c.implication("lists-once-begun", "Once it has begun there it is listed, but after alarm 4.",
                  when=known & c.past(began & ~alarmed), then=dut.listing)
    c.implication("ends-at-once", "Then PROBED is taken at once.", when=done & dut.actions.valid,
                  then=dut.actions.ready)
    c.invariant("progress", "States are those of what is waited for.",
                (anew == state("BEGIN")) & (lists == state("LISTING")) & (done == state("END")),
                cover=done, lemma=True)


def _states(c: Contract, state, facts: dict[str, Bits]) -> Bits:
    """Return whether each fact holds in its state."""
    holds: Bits = 1
    for name, fact in facts.items():
        holds = holds & (~state(name) | fact)
    return holds


GCODE_PROBING = Component(make=GCodeProbing, describe=describe, depth=24,
                          cases=(Case({"begins_within": 3}), Case(real=True),
                                 Case({"begins_within": 3}, upset=True)))
