"""Contract of the compensation of backlash: the load is where steps were requested."""

from amaranth import Mux, signed

from fresa.motion import BacklashCompensator

from .contract import Case, Component, Contract

__all__ = ["BACKLASH_COMPENSATOR"]


def describe(c: Contract, dut: BacklashCompensator) -> None:
    """By a mechanism of motor and load, with what is pending as `PendingSteps` counts it."""
    stops = dut.stop | c.rst
    steps = dut.step & ~stops
    begins = c.past(0, init=1)

    c.assume(dut.backlash <= dut.max_backlash)
    # What is pending, less than 8 steps
    pending = c.keep(signed(6), name="pending")
    way = c.keep(1, name="requested_direction", init=1)  # of the last step, any
    made = (dut.moved & (pending > 0)) - (dut.moved & (pending < 0))
    c.assume(dut.pending == (pending != 0))
    c.assume(~dut.moved | (dut.pending & ~stops))
    c.assume(~dut.pending | (dut.direction == (pending > 0)))
    c.assume((pending < 8) & (pending >= -8))
    requested = Mux(steps, Mux(way, 1, -1), 0)
    added = Mux(dut.extra, Mux(dut.extra_direction, 1, -1), 0)
    corrects = Mux(dut.correct, Mux(dut.correct_direction, 1, -1), 0)
    c.m.d.sync += pending.eq(Mux(stops, 0, pending + requested + added - made))

    c.implication("between-requested-steps", "No step is added in the clock of another, while one "
                  "is pending, or while steps are dropped; and only in the clock after a tick.",
                  when=dut.extra,
                  then=c.past(dut.tick) & ~dut.step & ~dut.pending & ~stops)
    asked = c.keep(1, name="asked")
    c.m.d.sync += asked.eq((asked | steps) & ~stops)
    c.implication("only-after-a-request", "After a stop none is added before another is requested.",
                  when=dut.extra, then=asked)

    # The mechanism: the motor is from 0 to the backlash above the load
    gap = c.keep(signed(len(dut.backlash) + 1), name="gap")
    ahead = c.keep(signed(len(dut.backlash) + 2), name="load_ahead")  # of the position
    pushes = Mux(dut.direction, gap >= dut.backlash, gap == 0)
    c.m.d.sync += [gap.eq(gap + Mux(pushes, 0, made)),
                   ahead.eq(ahead + Mux(pushes, 0, -made) - corrects)]
    c.implication("load-is-where-it-was-requested", "Once all steps are made the load is at the "
                  "position.", when=asked & ~dut.pending & ~dut.busy, then=ahead == 0)
    c.implication("takes-up", "A step is added only in the direction in which the load is missing.",
                  when=dut.extra, then=Mux(dut.extra_direction, ahead < 0, ahead > 0))

    # A position that counts the driver's steps and the corrections is the requested one.
    place = c.keep(signed(6), name="place")  # less the requested steps, which a stop resets
    unmade = c.keep(signed(2), name="unmade")  # the added step that is still to be made
    c.m.d.sync += [
        place.eq(Mux(stops, 0, place + made + corrects - requested)),
        unmade.eq(Mux(stops, 0, Mux(dut.extra, added,
                                    Mux(dut.moved | ~dut.pending, 0, unmade))))]
    c.invariant("position-is-requested", "The driver's steps and the corrections, with the steps "
                "that are pending, are the requested ones.", (place + pending)[:6] == 0,
                cover=place != 0)
    c.implication("stop-takes-back", "A stop takes back the added step that is still to be made, "
                  "and nothing else.", when=stops, then=corrects == Mux(dut.pending, unmade, 0))
    c.implication("corrects-alone", "The position is not corrected in the clock of a step.",
                  when=dut.correct, then=~dut.moved)
    c.implication("counts-one-way", "With a step the direction is that of the driver.",
                  when=dut.moved, then=dut.correct_direction == dut.direction)
    waits = c.signal("waits")
    c.invariant("added-step-first", "A step that is added is the first of those that are pending, "
                "or was taken back by a requested one.",
                (waits == (unmade != 0)) & (unmade >= -1)
                & (~waits | ~dut.pending | ((pending > 0) == (unmade > 0)))
                & (c.signal("active") == asked), cover=waits, lemma=True)
    beyond = ahead - unmade + gap  # the motor, of where its requested steps have it
    most = dut.max_backlash
    c.invariant("mechanism", "Motor and load are where they are, and no further apart than the "
                "most backlash that there may be.",
                (gap == c.signal("slack")) & (ahead == c.signal("ahead"))
                & (gap >= 0) & (gap <= most) & (beyond >= 0) & (beyond <= most)
                & (~waits | Mux(unmade > 0, ahead <= 0, ahead >= 0))
                & (~c.signal("adds") | (asked & (ahead != 0))),
                cover=ahead != 0, lemma=True)
    first = c.keep(dut.backlash.shape(), name="first_backlash")
    steady = c.keep(1, init=1, name="steady")  # the backlash was never another before this clock
    is_steady = steady & ((dut.backlash == first) | begins)
    c.m.d.sync += [first.eq(dut.backlash), steady.eq(is_steady)]
    c.implication("within-the-backlash", "With constant backlash the load is never further from "
                  "the position than that, but for a step that is added.", when=is_steady,
                  then=(gap <= dut.backlash) & (beyond <= dut.backlash) & (beyond >= 0))


BACKLASH_COMPENSATOR = Component(
    make=BacklashCompensator, describe=describe, depth=10,
    cases=(Case({"max_backlash": 3}), Case({"max_backlash": 2**20}, real=True)))
