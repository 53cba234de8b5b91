"""Contract of homing a point on two strings: what is wound, what ends a stage, in which order."""

from amaranth import Cat, Mux

from fresa.machines.vplotter import VPlotterSettings
from fresa.motion import AlarmCode, StringHoming
from fresa.motion.string_homing import SLOW
from fresa.protocol import HomingStage

from .coil import watch_spacing
from .contract import Bits, Case, Component, Contract

__all__ = ["STRING_HOMING"]


def describe(c: Contract, dut: StringHoming) -> None:
    """By the steps that were made in a stage, and by what its switch has shown."""
    state, stage, switches = c.state("string_homing_state"), dut.stage, dut.switches
    goes_on = c.past(~c.rst)  # there was a clock before, without a reset
    wants = dut.step | dut.follow
    acts = Cat(dut.step, dut.zero, dut.place, dut.follow, dut.restart, dut.done).any()
    if not c.upset:
        c.restrict_covers(~c.rst)

    # A motor makes only what is requested, and sooner than the next step is due.
    waited = [c.keep(range(dut.pace + 1), name=f"waited_{motor}") for motor in range(2)]
    for motor, clocks in enumerate(waited):
        c.assume(~dut.moved[motor] | wants[motor])
        c.assume(~dut.step[motor] | dut.moved[motor] | (clocks < dut.pace - 1))
        c.m.d.sync += clocks.eq(Mux(dut.step[motor] & ~dut.moved[motor] & ~c.rst,
                                    clocks + (clocks < dut.pace), 0))

    # The string whose turn it is, and what has become of it
    turn = c.keep(range(3), name="turn")  # how many have their length
    closed = c.keep(1, name="closed")  # its switch has been on
    most = max(dut.most, dut.most_off) + 1
    made = [c.keep(range(most + 1), name=f"made_{name}") for name in ("own", "other")]
    own, other = (Mux(turn[0], each[1], each[0]) for each in (dut.step, dut.step[::-1]))
    pays_own, pays_other = (Mux(turn[0], each[1], each[0])
                            for each in (dut.longer, dut.longer[::-1]))
    moves = [Mux(turn[0], each[1], each[0]) for each in (dut.moved, dut.moved[::-1])]
    on = Mux(turn[0], switches[1], switches[0])
    seeks = (stage == HomingStage.FIRST) | (stage == HomingStage.SECOND)
    seeking = seeks & ~dut.zero.any()
    turns = c.rst | ~dut.active | ~seeks | dut.zero.any() | (seeking & ~closed & on)
    for count, moved in zip(made, moves, strict=True):
        with c.m.If(turns):
            c.m.d.sync += count.eq(0)
        with c.m.Elif(moved & (count < most)):
            c.m.d.sync += count.eq(count + 1)
    with c.m.If(turns):
        c.m.d.sync += closed.eq(~c.rst & dut.active & seeking)
    with c.m.If(c.rst | ~dut.active | dut.done):
        c.m.d.sync += turn.eq(0)
    with c.m.Elif(dut.zero.any()):
        c.m.d.sync += turn.eq(turn + (turn < 2))

    c.invariant("in-turn", "The left string is homed first, then the right one.", Cat(
        (stage != HomingStage.FIRST) | (turn == 0), (stage != HomingStage.SECOND) | (turn == 1),
        (stage != HomingStage.REST) | (turn == 2)).all(), cover=stage == HomingStage.SECOND)
    c.implication("winds-to-its-switch", "A string is wound only in its turn, while its switch "
                  "was off a clock ago, and before that has been on.",
                  when=own & ~pays_own, then=seeking & ~closed & goes_on & ~c.past(on))
    c.implication("never-winds-the-other", "Meanwhile the other string is never wound.",
                  when=other, then=seeking & pays_other & ~closed)
    c.implication("neither-gets-tight", "What a string is wound by the other is paid out, up to "
                  "the step that is being made.", when=seeking & ~closed,
                  then=made[0] + own == made[1] + other)
    c.implication("leaves-alone", "A string leaves its switch while that is on, and the other "
                  "stays.", when=own & pays_own,
                  then=seeking & closed & c.past(on) & ~other)
    c.implication("no-more-than-most", "No more is wound than it may be, but for a step in the "
                  "clock in which that ends.", when=seeking & ~closed, then=made[0] <= dut.most)
    c.implication("no-more-off", "No more is paid out than it may be, but for such a step.",
                  when=seeking & closed, then=made[0] <= dut.most_off)
    c.implication("zero-where-it-opens", "A string is 0 where its switch, that was on, has opened.",
                  when=dut.zero.any(), then=(dut.zero == Mux(turn[0], 0b10, 0b01)) & (turn < 2)
                  & closed & c.past(~on) & seeks)

    def began(request: Bits, moved: Bits) -> Bits:
        """Return whether it is requested anew."""
        return request & (c.past(~request) | c.past(moved))

    anew = []
    for motor, name in enumerate(("left", "right")):
        first = began(dut.step[motor], dut.moved[motor])
        toward = began(dut.follow[motor], dut.moved[motor])
        anew += [first, toward]
        rested = watch_spacing(c, first | toward | turns & seeks | dut.place,
                               dut.pace << SLOW, f"since_{name}")
        c.implication(f"pace-{name}", "A step is requested no sooner than the pace is, after the "
                      "last, or after a stage begins.", when=first,
                      then=rested >= (Mux(closed, dut.pace << SLOW, dut.pace)) - 1)
        c.implication(f"pace-to-rest-{name}", "So it is on the way to rest.", when=toward,
                      then=rested >= dut.pace - 1)

    # In which order
    placed, ready = c.keep(1, name="placed"), c.keep(1, name="ready")
    failed = c.keep(1, name="failed")
    with c.m.If(dut.place):
        c.m.d.sync += placed.eq(1)
    with c.m.If(dut.restart):
        c.m.d.sync += ready.eq(1)
    with c.m.If(dut.failure != AlarmCode.NONE):
        c.m.d.sync += failed.eq(1)
    with c.m.If(c.rst | ~dut.active | dut.done):
        c.m.d.sync += [placed.eq(0), ready.eq(0), failed.eq(0)]
    c.implication("place-once", "It is placed when both strings have their length, once.",
                  when=dut.place, then=(turn == 2) & ~placed & (stage == HomingStage.REST))
    c.implication("follows-to-rest", "Only on the way to rest motors make lengths that are wanted.",
                  when=dut.follow.any(), then=placed & ~ready & (stage == HomingStage.REST)
                  & ~dut.step.any())
    c.implication("rests", "It begins anew once where it hangs, when neither motor was behind.",
                  when=dut.restart, then=placed & ~ready & c.past(dut.behind == 0)
                  & c.past(dut.follow == 0b11))
    c.implication("done", "It is through when the planner has begun there, and nothing moves.",
                  when=dut.done, then=ready & c.past(~dut.begins & ~dut.moving))
    c.implication("begins", "It begins when it shall, and asks for the state of homing.",
                  when=goes_on & dut.active & c.past(~dut.active), then=c.past(dut.start)
                  & (stage == HomingStage.NONE))
    c.implication("starts", "And then at once.", when=goes_on & c.past(dut.start & ~dut.active),
                  then=dut.active)
    c.implication("allowed", "Nothing happens before it is allowed.",
                  when=goes_on & (stage == HomingStage.FIRST) & c.past(stage == HomingStage.NONE),
                  then=c.past(dut.allowed & dut.active))
    c.implication("active-until-done", "It stays active until it is through.",
                  when=goes_on & c.past(dut.active & ~dut.done), then=dut.active)
    c.implication("ends", "Then it is not.", when=goes_on & c.past(dut.done), then=~dut.active)
    c.implication("rest", "Nothing is done while it is not.", when=~dut.active,
                  then=~acts & (stage == HomingStage.NONE))
    c.implication("no-search-without-end", "It fails where a switch does not close.",
                  when=dut.failure == AlarmCode.HOMING_SEARCH,
                  then=seeking & ~closed & ~on & (made[0] >= dut.most))
    c.implication("no-switch-that-stays", "It fails where a switch does not open.",
                  when=dut.failure == AlarmCode.HOMING_PULL_OFF,
                  then=seeking & closed & on & (made[0] >= dut.most_off))
    c.implication("no-other-failure", "Nothing else fails.", when=dut.failure != AlarmCode.NONE,
                  then=(dut.failure == AlarmCode.HOMING_SEARCH)
                  | (dut.failure == AlarmCode.HOMING_PULL_OFF))
    c.implication("failed", "After that nothing is done, until a reset.", when=failed,
                  then=dut.active & ~acts & (stage == HomingStage.NONE)
                  & (dut.failure == AlarmCode.NONE))

    # Lemmas
    count, left, due = c.signal("count"), c.signal("left"), c.signal("due")
    paced = state("SEEK", "LEAVE", "REST")
    c.invariant("states", "States are known by what happened.", Cat(
        state("FAULT") | (dut.active == ~state("IDLE")),
        ~state("IDLE", "ASK") | ((turn == 0) & ~closed & ~placed & ~ready & ~failed),
        ~state("SEEK") | (~closed & (turn == c.signal("turn"))),
        ~state("LEAVE", "ZERO") | (closed & (turn == c.signal("turn"))),
        ~state("SEEK", "LEAVE", "ZERO") | (~placed & ~ready & ~failed),
        ~state("PLACE") | ((turn == 2) & ~placed & ~ready & ~failed),
        ~state("REST", "RESTART") | ((turn == 2) & placed & ~ready & ~failed),
        ~state("BEGIN", "DONE") | ((turn == 2) & placed & ready & ~failed),
        ~state("FAILED") | failed,
        ~state("ASK") | ~c.signal("turn")).all(), cover=state("LEAVE"), lemma=True)
    c.invariant("counts", "It counts what it winds, or pays out, and a step is due once in a pace.",
                Cat(~state("SEEK", "LEAVE") | (count == made[0]),
                    ~state("SEEK") | (count <= dut.most),
                    ~state("LEAVE") | (count <= dut.most_off),
                    ~paced | (left < Mux(state("LEAVE"), dut.pace << SLOW, dut.pace))).all(),
                cover=count == 1, lemma=True)
    c.implication("begins-with-the-pace", "A step is requested where the pace begins.",
                  when=Cat(anew).any(), then=left == Mux(
                      state("LEAVE"), dut.pace << SLOW, dut.pace) - 1, lemma=True)
    for motor, clocks in enumerate(waited):
        name = ("left", "right")[motor]
        c.invariant(f"due-{name}", "A step that is due waits as long as the pace has gone on.", Cat(
            ~dut.step[motor] | (clocks == Mux(
                state("LEAVE"), dut.pace << SLOW, dut.pace) - 1 - left),
            ~paced | (c.kept[f"since_{name}"] + left + 2 >= Mux(
                state("LEAVE"), dut.pace << SLOW, dut.pace))).all(),
            cover=due[motor], lemma=True)
    c.leaves_unused_codes("string_homing_state", fault=dut.fault, shows=~acts)


STRING_HOMING = Component(
    make=StringHoming, describe=describe, depth=36,
    cases=(Case({"pace": 2, "most": 2, "most_off": 1}),
           Case(VPlotterSettings().string_homing, real=True),
           Case({"pace": 2, "most": 2, "most_off": 1}, upset=True)))
