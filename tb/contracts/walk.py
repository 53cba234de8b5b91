"""Contract of the walk: what its parts do not promise by themselves."""

from amaranth import Mux

from fresa.motion import PathWalk

from .contract import Bits, Case, Component, Contract

__all__ = ["WALK"]

LOG2_TICKS = 36


def describe(c: Contract, dut: PathWalk) -> None:
    """Lines add exactly their increment, no half turn is lost, and blocks end where planned.

    A tick of a line adds its increment in 1/256 step, shifted by ``36 - log2_ticks``, which is in
    2**-44 step. So ``2**log2_ticks`` ticks add exactly the increment: that sum, less a step for
    each that is made, is the fraction (contract of the accumulator).
    """
    segment, valid, ready = dut.segments.payload, dut.segments.valid, dut.segments.ready
    waits = c.past(valid & ~ready & ~c.rst)
    c.assume(~waits | (valid & (segment.as_value() == c.past(segment.as_value()))))
    c.assume((segment.log2_ticks <= LOG2_TICKS) & (segment.shift >= 4) & (segment.shift <= 30))
    c.assume(~dut.load | ~dut.busy)
    c.restrict_covers(
        (segment.log2_ticks == LOG2_TICKS - 1) & (segment.turns == 1) & (segment.shift == 4)
        & ~segment.x.any() & ~segment.y.any() & ~segment.residual.any() & ~c.rst
        & ~segment.increment.as_value().any() & ~segment.start.as_value().any()
        & ~dut.fine.any() & ~dut.coarse.any())
    shifting, full, changing = (c.signal(name) for name in ("shifting", "full", "changing"))
    fault, known = dut.fault, c.past(1)

    c.implication("takes-what-is-offered", "A segment is taken only while it is offered.",
                  when=ready, then=valid)
    c.implication("offered-until-taken", "What is prepared is on offer.",
                  when=shifting | full | changing, then=valid, lemma=True)
    changes = c.signal("changes")
    c.invariant("one-at-a-time", "One segment is prepared, or begins.",
                (changing == changes.any()) & ((changes & (changes - 1)) == 0)
                & (shifting + full + changing <= 1), cover=changing, lemma=True)
    c.implication("fault-stays", "A fault stays until a reset.", when=c.past(fault & ~c.rst),
                  then=fault)
    c.implication("rests-behind-reset", "Behind a reset nothing is walked, no step is made, and "
                  "there is no fault.", when=c.past(c.rst, init=1),
                  then=~dut.busy & ~dut.step.any() & ~fault)
    c.implication("no-tick-without-segment", "A tick without a segment is a fault.",
                  when=c.past(dut.tick & ~dut.ready & ~c.rst), then=fault)
    _lines(c, dut, shifting, full)
    _half_turns(c, dut, fault)
    _ends(c, dut, known)


def _lines(c: Contract, dut: PathWalk, shifting: Bits, full: Bits) -> None:
    segment, exponent = dut.segments.payload, c.signal("exponent")
    begins = shifting & ~c.past(shifting)
    doubles = c.past(shifting & (exponent != LOG2_TICKS) & ~c.rst)
    changed = c.past(c.signal("changes")[9])
    c.implication("ends-at-36", "What is prepared is shifted by 36 bits less the logarithm of the "
                  "ticks: it starts at that and ends at 36, a bit a clock.",
                  when=full | begins | doubles,
                  then=Mux(full, exponent == LOG2_TICKS, Mux(
                      begins, exponent == segment.log2_ticks,
                      exponent == (c.past(exponent) + 1)[:6])))
    for channel, name in enumerate("uvw"):
        prepared, increment = c.signal(f"prepared_{channel}"), c.signal(f"increment_{channel}")
        before = c.past(prepared).as_signed()
        with c.each(name):
            c.implication("begins-as-increment", "A shift begins with the increment.", when=begins,
                          then=prepared == segment.increment[channel])
            c.implication("doubles", "A shift is by a bit a clock, and exact or a fault.",
                          when=doubles & ~dut.fault, then=prepared == before + before)
            c.implication("stays", "What is prepared stays until it is used.",
                          when=c.past(1) & ~begins & ~doubles & ~c.past(c.rst),
                          then=prepared == before)
            c.implication("adds-what-is-prepared", "A tick adds what was prepared when the segment "
                          "began, and no other.", when=c.past(1),
                          then=increment == Mux(changed, before, c.past(increment)).as_signed())


def _half_turns(c: Contract, dut: PathWalk, fault: Bits) -> None:
    due, due_next, made = (c.signal(name) for name in ("due", "due_next", "made"))
    waits, held = c.signal("waits"), c.signal("held")
    turned = c.part("rotator").turn & c.part("rotator").ready
    owed = c.keep(5, name="owed")
    c.m.d.sync += owed.eq(Mux(c.rst, 0, owed + made - turned))
    c.implication("no-lost-half-turn", "Each half turn is made or due.", when=~fault,
                  then=owed == due + due_next)
    c.implication("in-order", "Half turns of the next segment wait until it is loaded.",
                  when=~waits, then=due_next == 0, lemma=True)
    c.implication("loads-when-ready", "A vector is loaded between half turns, after those of the "
                  "segment before.", when=c.part("rotator").load,
                  then=(due == 0) & c.part("rotator").ready & ~turned)
    c.implication("holds-until-changed", "No half turn is made between the load of the vector and "
                  "that of the channels.", when=held, then=~turned)
    changes, ratio = c.signal("changes"), c.part("ratio")
    c.implication("rotator-first", "From the beginning of a segment to the load of its channels, "
                  "the rotator waits to load its vector, or is held; and at no other time.",
                  when=~fault, then=(waits + held) == changes[1:10].any(), lemma=True)
    c.implication("half-turns-before-change", "Half turns of the segment before are made when the "
                  "channels are loaded, and their quarter steps done, or it is a fault.",
                  when=c.past(changes[9] & ~c.rst) & ~fault,
                  then=~c.past(turned) & ~c.past(ratio.quarter) & ~c.past(c.past(ratio.quarter)))


def _ends(c: Contract, dut: PathWalk, known: Bits) -> None:
    ended = c.signal("ends")[11]
    for axis, name in enumerate("xyz"):
        count, due, back = (c.signal(f"{each}_{axis}") for each in ("count", "due", "back"))
        end = c.signal(f"end_{axis}")
        place = c.keep(2, name=f"place_{axis}")  # steps that were requested, modulo 4
        c.m.d.sync += place.eq(Mux(c.rst, 0, Mux(
            dut.load, dut.position[axis],
            place + Mux(dut.step[axis], Mux(dut.direction[axis], 1, -1), 0))))
        with c.each(name):
            c.implication("counts-every-step", "The count is that of all steps of the axis, and of "
                          "the corrective one that is due.", when=~dut.fault,
                          then=count == (place + Mux(due, Mux(back, -1, 1), 0))[:2])
            planned = c.past(end + Mux(c.signal(f"step_{axis}"),
                                       Mux(c.signal(f"direction_{axis}"), 1, -1), 0))
            c.implication("ends-as-planned", "At its end a segment has the planned count, "
                          "and a step of the next segment.",
                          when=known & c.past(ended & ~c.rst & ~dut.load),
                          then=count == planned[:2])
            error = (end - count)[:2]
            c.implication("corrective-only-if-off", "A corrective step comes due only at the end "
                          "of a segment, and if it is a step off.",
                          when=due & ~c.past(due) & known, then=c.past(ended & error[0]))
            c.implication("two-off-is-a-fault", "Two steps off at the end is a fault.",
                          when=c.past(ended & (error == 2) & ~c.rst), then=dut.fault)


WALK = Component(make=PathWalk, describe=describe, depth=20, cases=(Case(),))
