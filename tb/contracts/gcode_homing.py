"""Contract of the homing cycle: what it requests, in which order, and that it ends."""

from collections.abc import Callable
from typing import NamedTuple

from amaranth import Array, Cat, Mux, Signal, Value

from fresa.motion import AlarmCode, GCodeHoming, HomingRequest

from .contract import Bits, Case, Component, Contract

__all__ = ["GCODE_HOMING"]


class _Line(NamedTuple):
    """A request: of an axis, by how much, towards its switch or not, and by which settings."""

    axis: int
    phase: int  # 0 seek, 1 place, 2 pull off, 3 locate
    thousandths: int
    near: bool = False
    slow: bool = False
    located: bool = False

    @property
    def places(self) -> bool:
        return self.phase == 1


def _lines(simple: bool) -> list[_Line]:
    """Return all requests of a cycle in their order; 0 thousandths of any distance are none."""
    if simple:
        return [_Line(axis, phase, 1500 if phase == 0 else 0, near=phase == 2)
                for axis in range(3) for phase in ((0, 1, 2) if axis < 2 else (1, 2))]
    return [_Line(axis, phase, thousandths, near, slow, located)
            for axis in (2, 0, 1) for phase, thousandths, near, slow, located in (
                (0, 1500, False, False, False), (1, 1000, False, False, False),
                (2, 1000, True, False, False), (3, 5000, True, True, True),
                (1, 1000, False, False, True), (2, 1000, True, False, True))]


def describe(c: Contract, dut: GCodeHoming) -> None:
    """By a list of the requests of a cycle."""
    state, request = c.state("homing_state"), dut.request
    began, known = c.past(1), c.past(~c.rst)
    lines = _lines(dut.simple)
    c.assume(~began | (dut.lower == c.past(dut.lower)))

    waits = request.kind == HomingRequest.WAIT
    wants = (request.kind != HomingRequest.NONE) & ~waits
    served = wants & dut.homed
    # Of the list a cycle of one axis makes a part.
    first, total, turn = 0, len(lines), 0
    if not dut.simple:
        alone = dut.only != 3
        turn = Mux(dut.only == 0, 1, Mux(dut.only == 1, 2, 0))
        first = turn * (len(lines) // 3)
        total = Mux(alone, first + len(lines) // 3, len(lines))
        c.assume(~began | (dut.only == c.past(dut.only)))
    count = c.keep(range(len(lines) + 1), name="count")
    made = Signal(range(len(lines) + 1))
    c.m.d.comb += made.eq(first + count)
    # Behind one line the switches are any, or stay on: behind others the cycle goes on.
    found = Array([0, *(line.phase in (0, 3) for line in lines)])[made].replicate(3)
    every = True if dut.simple else dut.only == 3
    c.restrict_covers(c.upset | every & ~c.rst & dut.allowed & dut.start & dut.standing
                      & ~dut.begins & (dut.homed == c.past(wants | waits)) & ~dut.moving
                      & (dut.lower == 0)
                      & ((dut.switches == found) | (made == 4) if dut.simple
                         else dut.switches == found ^ (made == 3).replicate(3)))
    c.m.d.sync += count.eq(Mux(c.rst | dut.done, 0, count + served))

    def of(field: str, at: Bits = made) -> Bits:
        return Array(int(getattr(line, field)) for line in lines)[at]

    axis, seeks = of("axis"), (of("phase") == 0) | (of("phase") == 3)
    lower = dut.lower.bit_select(axis, 1)
    c.implication("requests-in-order", "Requests are those of the cycle, in their order.",
                  when=wants, then=(made < total) & (request.axis == axis) & (
                      Value.cast(request.kind) == Mux(of("places"), HomingRequest.PLACE.value,
                                                      HomingRequest.MOVE.value))
                  & (request.from_switch == (of("phase") == 2)))
    c.implication("towards-its-switch", "A line goes towards the switch of its axis, or away from "
                  "it, and a switch is at 0 or below.", when=wants,
                  then=request.back == (of("places") | Mux(seeks, lower, ~lower)))
    zero = of("places") & ~lower & (not dut.simple)
    c.implication("distance", "A distance is so much of the setting, or nothing of it.",
                  when=wants, then=(request.thousandths == Mux(zero, 0, of("thousandths")))
                  & (request.near == of("near")))
    c.implication("speed", "A line has the speed of the setting.", when=wants & ~of("places"),
                  then=request.slow == of("slow"))
    fields = Cat(Value.cast(getattr(request, name)) for name in (
        "kind", "axis", "thousandths", "back", "from_switch", "near", "slow"))
    c.implication("request-stays", "A request holds until it is served.",
                  when=known & c.past((wants | waits) & ~dut.homed), then=fields == c.past(fields))
    _waits(c, dut, count, made < total, waits, wants, of)
    _ends(c, dut, count, made == total, wants | waits, wants)
    _switches(c, dut, lines, made, count, wants, served)

    after = state("START", "MOVE", "BRAKE", "PLACE", "RESTART", "BEGIN")
    at = (made - after)[:5]
    third = dut.simple & state("PLAN") & (c.signal("phase") == 0) & (made == 6)
    c.invariant("where", "Phase, turn and state are those of the request.", state(
        "IDLE", "ASK", "DONE", "FAILED", "FAULT") | (
            (at >= first) & (at < total) & (dut.axis == of("axis", at)) & (c.signal("turn") < 3)
            & (third | (c.signal("phase") == of("phase", at)))
            & (c.signal("located") == of("located", at))
            & (~after | (count != 0)) & (~state("PLACE") | of("places", at))
            & (~state("BRAKE") | (of("phase", at) == 0) | (of("phase", at) == 3))
            & (~state("START", "MOVE") | ~of("places", at))
            & (~state("RESTART", "BEGIN") | (of("phase", at) != 2) | (made == total))),
        cover=made == 2, lemma=True)
    c.invariant("ends-of-it", "At its ends nothing or all was requested.", Cat(
        ~state("IDLE", "ASK") | (count == 0), ~state("DONE") | (made == total), made <= total,
        ~state("ASK") | ((c.signal("turn") == turn) & ~c.signal("located"))).all(),
        cover=made == 1, lemma=True)
    c.leaves_unused_codes("homing_state", fault=dut.fault, shows=~(
        wants | waits | dut.done | dut.restart | dut.latch | dut.place | dut.brake))


def _waits(c: Contract, dut: GCodeHoming, count: Bits, more: Bits, waits: Bits, wants: Bits,
           of: Callable[[str], Bits]) -> None:
    """State that it stands for the time of $26 before each line but the first."""
    if dut.simple:
        c.invariant("no-wait", "The cycle of the thesis waits for nothing.", ~waits, cover=wants)
        return
    state, begins = c.state("homing_state"), dut.begins_within
    c.implication("waits-before-a-line", "A wait is requested before a line alone.", when=waits,
                  then=(count != 0) & ~of("places"))
    age = c.keep(range(begins + 1), name="wait_age")  # since a wait was committed
    rested = c.keep(2, name="rested")  # 1 while a wait is counted, 2 from then on to the line
    c.m.d.sync += age.eq(Mux(waits & dut.homed, 0, age + (age < begins)))
    with c.m.If((rested == 1) & (age == begins) & ~dut.moving):
        c.m.d.sync += rested.eq(2)
    with c.m.If(waits & dut.homed):
        c.m.d.sync += rested.eq(1)
    with c.m.If(c.rst | (wants & dut.homed)):
        c.m.d.sync += rested.eq(0)
    c.implication("rests-before-a-line", "A line but the first is requested when a wait before it "
                  "was committed, and has ended.", when=wants & (count != 0) & ~of("places"),
                  then=rested == 2)
    pause, line = c.signal("pause"), (count != 0) & more & ~of("places")
    c.invariant("rests", "It waits in one state.", Cat(
        ~state("WAIT") | (line & (rested == 0)),
        ~state("REST") | (line & (rested == 1) & (age == begins - pause)),
        ~(state("PLAN") & line) | (rested == 2), (rested == 0) | state("REST", "PLAN")).all(),
        cover=rested == 2, lemma=True)


def _ends(c: Contract, dut: GCodeHoming, count: Bits, all_made: Bits, asks: Bits, wants: Bits
          ) -> None:
    """State when a cycle begins, and when it is through."""
    known = c.past(~c.rst)
    c.implication("begins", "A cycle begins with a start.", when=known & c.past(~dut.active),
                  then=dut.active == c.past(dut.start))
    c.implication("goes-on", "It goes on until it is through.",
                  when=known & c.past(dut.active & ~dut.done), then=dut.active)
    c.implication("through", "And then it is over.", when=known & c.past(dut.done),
                  then=~dut.active)
    c.implication("all-was-done", "It is through after the last of its requests.", when=dut.done,
                  then=dut.active & all_made)
    failed = c.keep(1, name="failed")
    c.m.d.sync += failed.eq(~c.rst & (failed | (dut.failure != AlarmCode.NONE)))
    c.implication("failure-ends-it", "After a failure nothing is done until a reset.", when=failed,
                  then=dut.active & ~(asks | dut.done | dut.brake | dut.restart | dut.latch
                                      | dut.place) & (dut.failure == AlarmCode.NONE))
    c.invariant("failed", "It has failed in one state.",
                failed == c.state("homing_state")("FAILED"), cover=failed, lemma=True)
    c.implication("allowed", "It requests nothing before it is allowed to.",
                  when=wants & (count == 0), then=c.keep(1, name="allowed"))
    with c.m.If(dut.allowed & dut.active):
        c.m.d.sync += c.kept["allowed"].eq(1)
    with c.m.If(~dut.active | c.rst):
        c.m.d.sync += c.kept["allowed"].eq(0)
    c.invariant("was-allowed", "It goes on only then.", c.state("homing_state")(
        "IDLE", "ASK", "FAILED", "FAULT") | c.kept["allowed"], cover=count == 1, lemma=True)


def _switches(c: Contract, dut: GCodeHoming, lines: list[_Line], made: Bits, count: Bits,
              wants: Bits, served: Bits) -> None:
    """State what comes of switches."""
    known, state = c.past(~c.rst), c.state("homing_state")
    begins = dut.begins_within + 1  # clocks in which a line that was committed begins, at most
    now = (made - (count != 0))[:5]  # the line that was committed
    phase = Array(line.phase for line in lines)[now]
    axis = Array(line.axis for line in lines)[now]
    on = dut.switches.bit_select(axis, 1)
    seeks = (phase == 0) | (phase == 3)
    age = c.keep(range(begins + 2), name="age")  # since a line was committed
    line = served & (dut.request.kind == HomingRequest.MOVE)
    c.m.d.sync += age.eq(Mux(line | c.rst, 0, age + (age <= begins)))
    moves = (count != 0) & (age >= begins)
    third = dut.simple & (made == 6)
    c.implication("latches-at-a-switch", "A place is kept when the switch that is sought is on.",
                  when=dut.latch & ~third, then=seeks & on & moves)
    c.implication("brakes", "Then it brakes, until it stands.",
                  when=known & (c.past(dut.latch & ~third)
                                | c.past(dut.brake & ~dut.restart & ~dut.standing)),
                  then=dut.brake | dut.restart)
    kept = c.keep(1, name="kept")
    c.m.d.sync += kept.eq(~c.rst & dut.active & (dut.latch | kept & ~dut.place))
    c.implication("places-what-was-kept", "A switch is where it was kept.", when=dut.place,
                  then=kept & c.past(served & (dut.request.kind == HomingRequest.PLACE)))
    c.implication("restart-after-place", "Lines begin anew behind a switch.",
                  when=known & c.past(dut.place), then=dut.restart)
    for name in ("latch", "place", "restart"):
        port = getattr(dut, name)
        c.implication(f"{name}-for-a-clock", "It lasts a clock.", when=known & c.past(port),
                      then=~port)
    waits = c.keep(1, name="waits")
    c.m.d.sync += waits.eq(~c.rst & (dut.restart | waits & (dut.begins | dut.moving)))
    c.implication("waits-for-the-planner", "After a restart nothing is requested before the "
                  "planner has begun.", when=waits, then=~wants & ~dut.done)
    c.implication("no-switch", "A search fails if the line ends and its switch is not on.",
                  when=dut.failure == AlarmCode.HOMING_SEARCH,
                  then=seeks & ~on & ~dut.moving & moves)
    if not dut.simple:
        c.implication("still-on", "Pulling off fails if the line ends and the switch is on.",
                      when=dut.failure == AlarmCode.HOMING_PULL_OFF,
                      then=(phase == 2) & on & ~dut.moving & moves)
    c.implication("no-other-failure", "Nothing else fails.", when=dut.failure != AlarmCode.NONE,
                  then=Cat(dut.failure == each for each in (
                      AlarmCode.HOMING_SEARCH, AlarmCode.HOMING_PULL_OFF)).any())
    pause = c.signal("pause")
    places: Bits = Array(each.places for each in lines)
    c.invariant("waits-in", "It waits in one state, and judges a line that has begun.", Cat(
        ~waits | state("BEGIN"), ~state("START") | (age == begins - 1 - pause),
        ~state("MOVE") | (age >= begins), age <= begins + 1,
        ~state("PLAN", "PLACE") | ~places[(made - state("PLACE"))[:5]] | kept
        | third & state("PLAN") & (c.signal("phase") == 0),
        ~state("BRAKE") | kept, ~(state("RESTART", "BEGIN") & seeks) | kept).all(),
        cover=waits, lemma=True)


GCODE_HOMING = Component(
    make=GCodeHoming, describe=describe, depth=98,
    cases=(Case({"begins_within": 1}), Case({"simple": True, "begins_within": 1}),
           Case(real=True), Case({"simple": True}, real=True), Case(upset=True)))
