"""Contract of a bowed line: where it leads, and how evenly its motors make their steps."""

from amaranth import Cat, Mux, signed

from fresa.machines.vplotter import VPlotterSettings
from fresa.motion import BowedLine

from .contract import Case, Component, Contract

__all__ = ["BOWED_LINE"]

SIDES = "left", "right"


def describe(c: Contract, dut: BowedLine) -> None:
    """By the ticks it gives, and by the steps that it has had of each motor."""
    state = c.state("bowed_state")
    goes_on = c.past(~c.rst)  # there was a clock before, without a reset
    acts = Cat(dut.tick, dut.follow, dut.restart, dut.done, dut.drawing).any()
    away = Cat(at != to for at, to in zip(dut.point, dut.target, strict=True)).any()
    bits = len(dut.made[0])
    if not c.upset:
        c.restrict_covers(~c.rst)

    # Lengths stay once the place is at the end. A motor makes only what is requested, and sooner
    # than the next step is due.
    waited = [c.keep(range(dut.pace + 1), name=f"waited_{name}") for name in SIDES]
    ways = [c.keep(bits, name=f"steps_{name}") for name in SIDES]  # to be made
    stays = goes_on & c.past(state("SETTLE", "LEFT", "RIGHT", "HALF", "DRAW")) & ~state("LEAD")
    for motor, (length, made, moved) in enumerate(zip(dut.length, dut.made, dut.moved,
                                                      strict=True)):
        clocks, asked = waited[motor], dut.follow[motor]
        c.assume(~moved | asked)
        c.assume(~asked | moved | (clocks < dut.pace - 1))
        c.assume(dut.behind[motor] == (length != made))
        step = Mux(c.past(moved), Mux(c.past(made) < c.past(length), 1, -1), 0)
        c.assume(~stays | state("SETTLE") | ((length == c.past(length))
                                            & (made == (c.past(made) + step)[:bits])))
        c.m.d.sync += clocks.eq(Mux(asked & ~moved & ~c.rst, clocks + (clocks < dut.pace), 0))
        with c.m.If(~dut.drawing):
            c.m.d.sync += ways[motor].eq(Mux(length < made, made - length, length - made))
    most = Mux(ways[0] < ways[1], ways[1], ways[0])
    half = most >> 1

    # Where it leads
    c.implication("leads", "A tick leads a coordinate that is not there towards the end, and none "
                  "that is.", when=dut.tick.any(), then=dut.active & ~dut.drawing & Cat(
                      ~tick | ((at != to) & (up == (at < to))) for tick, up, at, to in zip(
                          dut.tick, dut.up, dut.point, dut.target, strict=True)).all())
    c.implication("one-by-one", "It comes when the one before is taken, or when the line begins.",
                  when=dut.tick.any(), then=goes_on & ~c.past(dut.tick).any()
                  & c.past(~dut.busy | dut.allowed))
    there = c.keep(1, name="there")
    c.m.d.sync += there.eq(dut.active & ~away & ~dut.busy & ~dut.tick.any() & ~c.rst
                           | there & dut.active & ~dut.tick.any() & ~c.rst & ~state("LEAD"))
    c.implication("draws-from-there", "Motors move when the place is at the end, and the lengths "
                  "are those of it.", when=dut.drawing, then=there & dut.active)

    # Steps
    until = c.keep(range(dut.pace), name="until")  # the next pace
    pace = dut.drawing & (until == 0)
    c.m.d.sync += until.eq(Mux(dut.drawing & ~c.rst, Mux(pace, dut.pace - 1, until - 1), 0))
    owed = [c.keep(signed(bits + 2), name=f"owed_{name}") for name in SIDES]  # times `most`
    began = goes_on & c.past(pace) & dut.drawing
    anew = []
    for motor, name in enumerate(SIDES):
        first = dut.follow[motor] & (c.past(~dut.follow[motor]) | c.past(dut.moved[motor]))
        anew.append(first)
        with c.m.If(~dut.drawing | c.rst):
            c.m.d.sync += owed[motor].eq(0)
        with c.m.Else():
            c.m.d.sync += owed[motor].eq(owed[motor] + Mux(pace, ways[motor], 0)
                                         - Mux(first, most, 0))
        c.implication(f"as-it-is-due-{name}", "A step is requested a clock after a pace begins, "
                      "if the motor is half a step behind its share of the way.", when=began,
                      then=first == (owed[motor] + half >= most))
        c.implication(f"no-other-{name}", "No other is.", when=first, then=began)
        c.implication(f"share-{name}", "Between two requests a motor has had its share of the way, "
                      "to half a step.", when=dut.drawing & ~began,
                      then=(owed[motor] >= -half) & (owed[motor] <= most - half))
        c.implication(f"each-pace-{name}", "The motor with more steps makes one each pace.",
                      when=began & (ways[motor] == most) & (most != 0), then=first)
    c.implication("follows", "Motors make steps only while it draws.", when=dut.follow.any(),
                  then=dut.drawing)

    # In which order
    ready = c.keep(1, name="ready")
    with c.m.If(dut.restart):
        c.m.d.sync += ready.eq(1)
    with c.m.If(c.rst | ~dut.active | dut.done):
        c.m.d.sync += ready.eq(0)
    c.implication("ends-there", "It begins anew once where both strings have their lengths.",
                  when=dut.restart, then=goes_on & ~ready & c.past(dut.drawing & (dut.behind == 0)))
    c.implication("draws-until-then", "It draws until they have.",
                  when=goes_on & c.past(dut.drawing) & ~dut.drawing & ~state("FAULT"),
                  then=dut.restart)
    c.implication("done", "It is through when the planner has begun there, and nothing moves.",
                  when=dut.done, then=ready & c.past(~dut.begins & ~dut.moving))
    c.implication("begins", "It begins when it shall.",
                  when=goes_on & dut.active & c.past(~dut.active), then=c.past(dut.start) & ~acts)
    c.implication("starts", "And then at once.", when=goes_on & c.past(dut.start & ~dut.active),
                  then=dut.active)
    asked = c.keep(1, name="asked")  # it is not allowed
    c.m.d.sync += asked.eq(~c.rst & Mux(dut.active, asked & ~dut.allowed, dut.start))
    c.implication("allowed", "Nothing happens before it is allowed.", when=dut.active & acts,
                  then=~asked)
    c.implication("active-until-done", "It stays active until it is through.",
                  when=goes_on & c.past(dut.active & ~dut.done), then=dut.active)
    c.implication("ends", "Then it is not.", when=goes_on & c.past(dut.done), then=~dut.active)
    c.implication("rest", "Nothing is done while it is not.", when=~dut.active, then=~acts)

    # Lemmas
    left = c.signal("left")
    found = [c.signal(f"way_{name}") for name in SIDES]
    now = [Mux(length < made, made - length, length - made)
           for length, made in zip(dut.length, dut.made, strict=True)]
    c.invariant("states", "States are known by what happened.", Cat(
        state("FAULT") | (dut.active == ~state("IDLE")),
        state("FAULT") | ~dut.active | (asked == state("ASK")),
        ~state("LEFT", "RIGHT", "HALF", "DRAW") | (there & ~ready),
        ~state("BEGIN", "DONE") | ready,
        ~state("RESTART", "LEAD", "SETTLE", "ASK", "IDLE") | ~ready,
        dut.drawing == state("DRAW")).all(), cover=state("HALF"), lemma=True)
    c.invariant("ways", "It has taken what the motors are to make.", Cat(
        ~state("RIGHT") | ((found[0] == now[0]) & (c.signal("most") == now[0])),
        *(~state("HALF") | ((each == steps) & (left == 0))
          for each, steps in zip(found, now, strict=True)),
        ~state("HALF") | (c.signal("most") == Mux(now[0] < now[1], now[1], now[0])),
        *(~state("DRAW") | (each == steps) for each, steps in zip(found, ways, strict=True)),
        ~state("DRAW") | (c.signal("most") == most)).all(), cover=most > 1, lemma=True)
    c.invariant("paces", "It counts paces.", Cat(
        ~state("DRAW") | (left == until), dut.drawing | c.past(dut.drawing) | (until == 0),
        until < dut.pace).all(), cover=until == 1, lemma=True)
    for motor, name in enumerate(SIDES):
        c.invariant(f"rest-{name}", "It keeps what a motor is behind its share.", Cat(
            ~state("DRAW") | (c.signal(f"rest_{name}").as_unsigned() == (
                half + owed[motor] - Mux(anew[motor], most, 0))),
            ~state("DRAW") | (c.signal(f"rest_{name}") < most) | (most == 0)).all(),
            cover=owed[motor] != 0, lemma=True)
        c.invariant(f"due-{name}", "A step that is due waits as long as the pace has gone on.",
                    ~dut.follow[motor] | (waited[motor] == dut.pace - 1 - left),
                    cover=dut.follow[motor], lemma=True)
    c.leaves_unused_codes("bowed_state", fault=dut.fault, shows=~acts)


BOWED_LINE = Component(
    make=BowedLine, describe=describe, depth=30,
    cases=(Case({"pace": 2, "place_bits": 2, "length_bits": 3}),
           Case(VPlotterSettings().bowed_line, real=True),
           Case({"pace": 2, "place_bits": 2, "length_bits": 3}, upset=True)))
