"""Contract of the speed profile."""

from amaranth import Mux, Signal, signed

from fresa.motion import SpeedProfile
from fresa.motion.profile import GRANULE_BITS

from .contract import Bits, Case, Component, Contract

__all__ = ["PROFILE"]


def describe(c: Contract, dut: SpeedProfile) -> None:
    """The acceleration and the speed are limited, and every block has its ticks."""
    blocks = dut.blocks
    payload = blocks.payload.as_value()
    c.assume(~c.past(blocks.valid & ~blocks.ready & ~c.rst) | c.past(c.rst)
             | (blocks.valid & (payload == c.past(payload))))
    c.assume(~blocks.valid | (blocks.p.log2_ticks <= dut.most_ticks_log2)
             & (blocks.p.energy >= 2))
    state = c.state("profile_state")
    square, brake, change = c.signal("square"), c.signal("brake"), c.signal("change")
    _plan(c, dut, state, square, brake, change)
    _ticks(c, dut, state)
    c.leaves_unused_codes("profile_state", fault=dut.fault, shows=~blocks.ready & ~dut.starved)
    c.implication("fault-stops", "After a fault there is no tick.",
                  when=c.past(dut.fault & ~c.rst) & c.past(1), then=~dut.tick | c.past(~dut.fault),
                  upset=True)


def _plan(c: Contract, dut: SpeedProfile, state, square: Bits, brake: Bits, change: Bits) -> None:
    """State how the squares of speeds follow each other."""
    width = signed(len(brake) + 2)
    known = c.past(1) & ~c.past(c.rst)
    goal, work = Signal(width, name="goal"), c.signal("work")
    held, nominal = c.signal("holds"), c.signal("nominal")
    sampled = c.keep(len(dut.exit), name="sampled")  # exit, with the granule
    with c.m.If(state("SEARCH")):
        c.m.d.sync += sampled.eq(dut.exit)
    bound = Signal(width, name="bound")
    c.m.d.comb += [
        bound.eq(sampled + brake - change),
        goal.eq(Mux(held, 0, Mux(bound < nominal, bound, nominal))),
    ]
    before, grown = c.past(square), c.past(change)
    planned = known & c.past(state("SUM") & (brake >= change))
    up, down = before + grown, before - grown
    expected = Mux(c.past(goal) > up, up, Mux(c.past(goal) < down, down, c.past(goal)))
    c.implication("follows-plan", "The square of the speed at the end of a granule is the smaller "
                  "of the nominal one and that from which it can brake, 0 with a hold; it differs "
                  "from that at the begin by the energy of the granule at most.",
                  when=planned, then=square == expected)
    c.implication("acceleration-is-limited", "The square of the speed changes by the energy of a "
                  "granule at most.", when=planned & (square != before),
                  then=(square <= up) & (square >= down))
    c.implication("speed-is-limited", "A granule ends above the nominal speed only if it slows "
                  "down as fast as it may.", when=planned & (square > c.past(nominal)),
                  then=square == down)
    c.implication("can-brake", "It ends faster than it can brake to the exit from only if it slows "
                  "down as fast as it may.", when=planned & (square > c.past(bound)),
                  then=square == down)
    c.implication("hold-slows-down", "With a hold it slows down as fast as it may, to 0.",
                  when=planned & c.past(held), then=square == Mux(down < 0, 0, down))
    c.implication("speed-is-kept-otherwise", "Nothing else changes the speed, but the end of the "
                  "blocks.", when=known & (square != before), then=c.past(state("SUM"))
                  | c.past(dut.starved) & (square == 0))
    energy, size = c.signal("energy"), c.signal("size")
    c.implication("energy-of-granule", "The energy of a granule is that of its ticks, a power of "
                  "two.", when=state("BRAKE", "NOMINAL", "DIFFERENCE", "BOUND", "SUM", "SPEND",
                                     "ROOT", "READY", "SEARCH"),
                  then=_any(size == 1 << bits for bits in range(GRANULE_BITS + 1))
                  & (change == _scaled(energy, size)))
    count = c.signal("count")
    c.invariant("search-ends", "The granule is at most doubled in each clock of the search.",
                Mux(state("SEARCH"), (count < GRANULE_BITS) & (size <= 1 << count), count == 0),
                cover=count == GRANULE_BITS - 1, lemma=True)
    if len(brake) < 16:
        _left(c, dut, state, brake, change)
    c.invariant("work-in-order", "The adder's register is what its state says.", _all(
        ~state("BRAKE") | (work == sampled + brake),
        ~state("NOMINAL") | (work == bound),
        ~state("DIFFERENCE") | (work == bound),
        ~state("BOUND") | (work == goal - square),
        ~state("SUM") | (work == goal - square)
        & (c.signal("none") == (c.signal("from_rest") & (goal == 0)))),
        cover=state("SUM"), lemma=True)
    capped, none = bound >= nominal, c.signal("none")
    beyond = Mux(work < 0, work + change < 0, work >= change)

    def adds(x: dict[str, Bits], y: dict[str, Bits], less: Bits) -> Bits:
        """Return whether the adder adds these, and nothing else."""
        return _all(c.signal("subtract") == less, *(
            c.signal(f"{port}_is_{name}") == choice.get(name, 0)
            for port, choice, names in (
                ("x", x, ("brake", "work", "nominal", "square")),
                ("y", y, ("exit", "change", "nominal", "square", "half", "work")))
            for name in names))

    c.invariant("adds-in-order", "The adder adds what its state says.", _all(
        ~state("SEARCH") | adds({"brake": 1}, {"exit": 1}, 0),
        ~state("BRAKE") | adds({"work": 1}, {"change": 1}, 1),
        ~state("NOMINAL") | adds({"work": 1}, {"nominal": 1}, 1),
        ~state("DIFFERENCE") | adds({"nominal": ~held & capped, "work": ~held & ~capped},
                                    {"square": 1}, 1),
        ~state("BOUND") | adds({"work": 1}, {"change": 1}, work >= 0),
        ~state("SUM") | adds({"square": 1}, {"half": none, "change": ~none & beyond,
                                             "work": ~none & ~beyond}, beyond & (work < 0)),
        ~state("SPEND") | adds({"brake": 1}, {"change": 1}, 1),
        c.signal("sums") == state("SUM")),
        cover=state("SUM"), lemma=True)
    missing, digits = c.signal("root.missing"), len(c.part("root").root)
    waits = state("WAIT", "READY")
    known_now = (state("ROOT") & (missing < digits - 1)) | waits
    c.invariant("root-in-step", "The root takes as long as its state.", _all(
        ~state("SPEND") | (missing == digits), ~state("ROOT") | (missing < digits)),
        cover=state("ROOT"), lemma=True)
    c.implication("rest-is-0", "It is known whether the speed is 0.",
                  when=known_now | ~state("SPEND", "ROOT"),
                  then=c.signal("at_rest") == (square == 0), lemma=True)
    c.implication("more-is-left", "And whether ticks of the block are left.",
                  when=known_now, then=c.signal("more") == (brake != 0), lemma=True)
    c.implication("goes-on-with-a-block", "It goes on if there are, or with a block that is ready.",
                  when=waits & c.signal("may"), then=c.signal("more") | c.signal("multiplied"),
                  lemma=True)
    c.implication("multiplies-a-block", "That is offered.", when=c.signal("multiplying"),
                  then=dut.blocks.valid, lemma=True)
    c.implication("began-at-rest", "And whether it was where the granule begins.",
                  when=state("SCALE", "SEARCH", "BRAKE", "NOMINAL", "DIFFERENCE", "BOUND", "SUM"),
                  then=c.signal("from_rest") == (square == 0), lemma=True)


def _left(c: Contract, dut: SpeedProfile, state, brake: Bits, change: Bits) -> None:
    """State that there are as many ticks in a block as there should be: at small widths."""
    size, energy = c.signal("size"), c.signal("energy")
    left = c.keep(dut.most_ticks_log2 + 1, name="ticks_left")  # and not in a granule yet
    taken = dut.blocks.valid & dut.blocks.ready
    whole = dut.blocks.p.energy << dut.blocks.p.log2_ticks
    with c.m.If(c.rst):
        c.m.d.sync += left.eq(0)
    with c.m.Elif(taken):
        c.m.d.sync += left.eq(1 << dut.blocks.p.log2_ticks)
    with c.m.Elif(state("SPEND")):
        c.m.d.sync += left.eq(left - size)
    computes = ~state("WAIT", "READY", "FAULT", "ROOT")
    c.invariant("brake-is-energy-left", "The energy for braking is that of the ticks left.",
                brake == energy * left, cover=state("ROOT") & (left != 0))
    c.implication("granule-divides-block", "A granule is not longer than what is left of its "
                  "block, and what is left is a multiple of it.", when=computes,
                  then=(left != 0) & ((left & (size - 1)[:len(size)]) == 0) & (size <= left)
                  | state("SCALE") & (left != 0))
    c.implication("granule-within-energy", "Its energy is not more than what is left.",
                  when=computes & ~state("SCALE"), then=brake >= change)
    c.implication("next-when-none-left", "A block is taken when no tick of the one before is left.",
                  when=taken, then=(left == 0) & (c.signal("offered") == whole))
    c.implication("energy-of-block", "A tick's energy is not 0.", when=left != 0,
                  then=energy >= 2, lemma=True)
    c.invariant("low-bits-of-left", "The count of ticks left has the low bits.",
                c.signal("left") == left[:GRANULE_BITS], cover=left != 0, lemma=True)
    c.implication("multiplies", "What is offered is multiplied tick by tick.",
                  when=c.signal("multiplying"),
                  then=(c.signal("offered") << c.signal("doublings") == whole)
                  & (c.signal("doublings") <= dut.blocks.p.log2_ticks), lemma=True)


def _ticks(c: Contract, dut: SpeedProfile, state) -> None:
    """State what the ticks are, and when it stands."""
    known = c.past(1) & ~c.past(c.rst)
    c.implication("ticks-apart", "Two ticks are never in consecutive clocks.",
                  when=c.past(dut.tick) & known, then=~dut.tick)
    c.implication("stands-still", "It gives no tick while it stands.", when=dut.standing,
                  then=~dut.tick & (dut.speed == 0))


def _scaled(energy: Bits, size: Bits) -> Bits:
    value = energy
    for bits in range(1, GRANULE_BITS + 1):
        value = Mux(size[bits], energy << bits, value)
    return value


def _any(values) -> Bits:
    found = 0
    for value in values:
        found = found | value
    return found


def _all(*values) -> Bits:
    found = 1
    for value in values:
        found = found & value
    return found


PROFILE = Component(
    make=SpeedProfile, describe=describe, depth=34,
    cases=(Case({"speed_bits": 2, "fraction_bits": 1, "most_ticks_log2": 2, "brake_bits": 6}),
           Case({}, real=True),
           Case({"speed_bits": 2, "fraction_bits": 1, "most_ticks_log2": 2, "brake_bits": 6},
                upset=True)))
