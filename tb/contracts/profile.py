"""Contract of the speed profile."""

from amaranth import Mux, Signal, Value, signed

from fresa.motion import SpeedProfile
from fresa.motion.profile import CHANGE, EXIT, GRANULE_BITS, NOMINAL, SQUARE

from .contract import Bits, Case, Component, Contract

__all__ = ["PROFILE"]

PLANS = ("BRAKE", "BOUND", "COMPARE", "GOAL", "DIFFERENCE", "LIMIT", "CORRECT")
"""States between the search and the sum."""

SMALL = 16
"""Bits of an energy up to which all is proved of it."""


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
    c.leaves_unused_codes("profile_state", fault=dut.fault, shows=~dut.starved)
    c.implication("fault-stops", "After a fault there is no tick.",
                  when=c.past(dut.fault & ~c.rst) & c.past(1), then=~dut.tick | c.past(~dut.fault),
                  upset=True)
    c.implication("fault-takes-nothing", "After a fault no block is taken.",
                  when=c.past(dut.fault & ~c.rst) & c.past(1), then=~blocks.ready, upset=True)


def _plan(c: Contract, dut: SpeedProfile, state, square: Bits, brake: Bits, change: Bits) -> None:
    """State how the squares of speeds follow each other."""
    width = signed(len(brake) + 2)
    known = c.past(1) & ~c.past(c.rst)
    goal = Signal(width, name="goal")
    x, y = c.signal("x"), c.signal("y")
    held, nominal = c.signal("holds"), c.signal("nominal")
    sampled = c.keep(len(dut.exit), name="sampled")  # exit, with the granule
    with c.m.If(state("SEARCH")):
        c.m.d.sync += sampled.eq(dut.exit)
    kept = c.keep(len(square), name="square_at_begin")  # while the register has the goal
    with c.m.If(state("GOAL")):
        c.m.d.sync += kept.eq(square)
    present = Mux(state("DIFFERENCE", "LIMIT", "CORRECT", "SUM"), kept, square)
    # A solver does not reorder wide sums. At small widths they say what is meant, at full width how
    # the adder makes them.
    small = len(brake) < SMALL

    def total(first: Bits, second: Bits, less: Bits, *, carry: Bits | None = None) -> Bits:
        """Return a sum or a difference."""
        if carry is None:
            carry = less
        if small:
            return Mux(less, first - second - 1, first + second) + carry
        a, b, inverts, carries = Signal(width), Signal(width), Signal(), Signal()
        c.m.d.comb += [a.eq(first), b.eq(second), inverts.eq(less), carries.eq(carry)]
        made = Signal(width)
        c.m.d.comb += made.eq(
            ((a << 1) - ((b ^ ~Value.cast(inverts.replicate(len(b)))) << 1 | ~carries)) >> 1)
        return made

    bound, spare, lead, excess = (Signal(width, name=name)
                                  for name in ("bound", "spare", "lead", "excess"))
    capped, rises = spare >= 0, lead < 0
    beyond = (excess < 0) == rises
    without = total(brake, nominal, 1)
    with_exit = total(without, sampled, 0)
    c.m.d.comb += [
        spare.eq(total(with_exit, change, 1)),
        bound.eq(sampled + brake - change),
        goal.eq(Mux(held, 0, Mux(capped, nominal, bound) if small else total(
            Mux(capped, 0, spare), nominal, 0))),
        lead.eq(present - goal if small else ~total(goal, present, 1, carry=0)),
        excess.eq(total(lead, change, ~rises)),
    ]
    before, grown = c.past(present), c.past(change)
    samples = c.past(state("SEARCH") & (c.signal("count") == 0))
    c.implication("nominal-of-the-granule", "The nominal speed is sampled for each granule.",
                  when=known & (samples | (nominal != c.past(nominal))),
                  then=samples & (nominal == c.past(dut.nominal)))
    planned = known & c.past(state("SUM") & (brake >= change))
    up, down = before + grown, before - grown
    expected = Mux(c.past(goal) > up, up, Mux(c.past(goal) < down, down, c.past(goal))
                   ) if small else c.past(
        Mux(c.signal("none"), 0, total(Mux(beyond, excess, 0), goal, 0)))
    c.implication("follows-plan", "The square of the speed at the end of a granule is the smaller "
                  "of the nominal one and that from which it can brake, 0 with a hold; it differs "
                  "from that at the begin by the energy of the granule at most.",
                  when=planned, then=square == expected)
    if small:
        _limits(c, planned, square, before, up, down, (nominal, bound, held))
    c.implication("speed-is-kept-otherwise", "Nothing else changes the speed, but the end of the "
                  "blocks.", when=known & (present != before), then=c.past(state("SUM"))
                  | c.past(dut.starved) & (present == 0))
    energy, size = c.signal("energy"), c.signal("size")
    c.implication("energy-of-granule", "The energy of a granule is that of its ticks, a power of "
                  "two.", when=state("SEARCH", *PLANS, "SUM", "SPEND", "ROOT", "READY"),
                  then=_any(size == 1 << bits for bits in range(GRANULE_BITS + 1))
                  & (change == _scaled(energy, size)))
    count = c.signal("count")
    c.invariant("search-ends", "The granule is at most doubled in each clock of the search.",
                Mux(state("SEARCH"), (count < GRANULE_BITS) & (size <= 1 << count), count == 0),
                cover=count == GRANULE_BITS - 1, lemma=True)
    if small:
        _left(c, dut, state, brake, change)
    none = c.signal("none")

    def adds(first: Bits, second: Bits, less: Bits, *, carry: Bits | None = None) -> Bits:
        """Return whether the adder adds these, or takes the second from the first."""
        return _all(x == first, y == second, c.signal("subtract") == less,
                    c.signal("carry") == (less if carry is None else carry))

    c.invariant("adds-in-order", "The adder adds what its state says.", _all(
        ~state("SEARCH") | (count != GRANULE_BITS - 1) | adds(brake, nominal, 1),
        ~state("BRAKE") | adds(without, sampled, 0),
        ~state("BOUND") | adds(with_exit, change, 1),
        ~state("COMPARE") | adds(spare, nominal, 0) & (c.signal("less") == ~capped),
        ~state("GOAL") | adds(Mux(capped, 0, spare), nominal, 0),
        ~state("DIFFERENCE") | adds(goal, present, 1, carry=0),
        ~state("LIMIT") | adds(lead, change, ~rises),
        ~state("CORRECT") | (x == excess) & (c.signal("beyond") == beyond),
        ~state("SUM") | adds(Mux(beyond, excess, 0), Mux(none, change, square), 0),
        ~state("DIFFERENCE", "LIMIT", "CORRECT", "SUM") | (square == goal[:len(square)]),
        ~state("CORRECT", "SUM") | (none == (~rises & (c.signal("from_rest") | held & ~beyond))),
        ~state("SPEND") | adds(brake, change, 1),
        ~state("ROOT") | (y == change) & c.signal("subtract") & ~c.signal("carry"),
        c.signal("sums") == state("SUM")),
        cover=state("SUM"), lemma=True)
    source = c.signal("source")
    c.invariant("loads-in-order", "And loads for the next one what that adds.", _all(
        ~state("SEARCH") | (source == Mux(count == GRANULE_BITS - 1, EXIT, NOMINAL)),
        ~state("BOUND", "COMPARE") | (source == NOMINAL),
        ~state("GOAL") | (source == SQUARE),
        ~state("CORRECT") | (source == Mux(none, CHANGE, SQUARE)),
        ~state("BRAKE", "DIFFERENCE", "LIMIT", "SUM", "SPEND", "ROOT") | (source == CHANGE)),
        cover=state("SUM"), lemma=True)
    c.invariant("taken", "What is taken is scaled in the next clock.",
                (c.signal("taken") == state("SCALE")) | state("FAULT") | state.is_unused(),
                cover=state("SCALE"), lemma=True)
    c.invariant("ready", "A granule may start when all of it is known.",
                (c.signal("ready") == state("READY")) | state("FAULT") | state.is_unused(),
                cover=state("READY"), lemma=True)
    missing, digits = c.signal("root.missing"), len(c.part("root").root)
    waits = state("WAIT", "READY")
    last = c.signal("none") & ~c.signal("from_rest")  # of a hold
    whole = Mux(last, digits - 3, digits)
    known_now = (state("ROOT") & c.past(state("ROOT"))) | waits
    c.invariant("root-in-step", "The root takes as long as its state.", _all(
        ~state("SPEND") | (missing == whole),
        ~state("ROOT") | (missing < whole) | (missing == 0)),
        cover=state("ROOT"), lemma=True)
    c.implication("rest-is-0", "It is known whether the speed is 0.",
                  when=known_now | ~state("SPEND", "ROOT"),
                  then=c.signal("at_rest") == (present == 0), lemma=True)
    c.implication("more-is-left", "And whether ticks of the block are left.",
                  when=known_now & state("ROOT"),
                  then=c.signal("more") == ~c.signal("negative"), lemma=True)
    c.implication("goes-on-with-a-block", "It goes on if there are, or with a block that is ready.",
                  when=waits & c.signal("may"), then=c.signal("more") | c.signal("multiplied"),
                  lemma=True)
    c.implication("multiplies-a-block", "That is offered.", when=c.signal("multiplying"),
                  then=dut.blocks.valid, lemma=True)
    c.implication("takes-what-is-offered", "A block is taken only while it is offered.",
                  when=dut.blocks.ready, then=dut.blocks.valid)
    c.implication("taken-is-offered", "What was multiplied is offered until then.",
                  when=c.past(c.signal("takes") & ~c.signal("more") & ~c.rst),
                  then=dut.blocks.valid, lemma=True)
    c.implication("began-at-rest", "And whether it was where the granule begins.",
                  when=state("SCALE", "SEARCH", *PLANS, "SUM"),
                  then=c.signal("from_rest") == (present == 0), lemma=True)


def _limits(c: Contract, planned: Bits, square: Bits, before: Bits, up: Bits, down: Bits,
            goals: tuple[Bits, Bits, Bits]) -> None:
    """State what the plan means for the speed."""
    nominal, bound, held = map(c.past, goals)
    c.implication("acceleration-is-limited", "The square of the speed changes by the energy of a "
                  "granule at most.", when=planned & (square != before),
                  then=(square <= up) & (square >= down))
    c.implication("speed-is-limited", "A granule ends above the nominal speed only if it slows "
                  "down as fast as it may.", when=planned & (square > nominal),
                  then=square == down)
    c.implication("can-brake", "It ends faster than it can brake to the exit from only if it slows "
                  "down as fast as it may.", when=planned & (square > bound),
                  then=square == down)
    c.implication("hold-slows-down", "With a hold it slows down as fast as it may, to 0.",
                  when=planned & held, then=square == Mux(down < 0, 0, down))


def _left(c: Contract, dut: SpeedProfile, state, brake: Bits, change: Bits) -> None:
    """State that there are as many ticks in a block as there should be: at small widths."""
    size, energy = c.signal("size"), c.signal("energy")
    left = c.keep(dut.most_ticks_log2 + 1, name="ticks_left")  # and not in a granule yet
    taken = c.signal("takes") & ~c.signal("more")  # it shows in the next clock
    loads = dut.blocks.valid & dut.blocks.ready
    whole = dut.blocks.p.energy << dut.blocks.p.log2_ticks
    with c.m.If(c.rst):
        c.m.d.sync += left.eq(0)
    with c.m.Elif(loads):
        c.m.d.sync += left.eq(1 << dut.blocks.p.log2_ticks)
    with c.m.Elif(state("SPEND")):
        c.m.d.sync += left.eq(left - size)
    computes = ~state("WAIT", "READY", "FAULT", "ROOT")
    c.invariant("brake-is-energy-left", "The energy for braking is that of the ticks left.",
                brake == energy * left, cover=state("ROOT") & (left != 0))
    c.implication("granule-divides-block", "A granule is not longer than what is left of its "
                  "block, and what is left is a multiple of it.", when=computes,
                  then=(left != 0) & ((left & (size - 1)[:len(size)]) == 0) & (size <= left)
                  | state("SCALE") & ((left != 0) | dut.blocks.ready))
    c.implication("granule-within-energy", "Its energy is not more than what is left.",
                  when=computes & ~state("SCALE"), then=brake >= change)
    c.implication("next-when-none-left", "A block is taken when no tick of the one before is left.",
                  when=loads, then=(left == 0) & (c.signal("offered") == whole)
                  & (energy == dut.blocks.p.energy))
    c.implication("spends-energy", "The sign that tells whether any is left is that of it.",
                  when=state("ROOT"), then=c.signal("x") - c.signal("y") == brake, lemma=True)
    c.implication("more-energy-is-left", "As long as any is left there are ticks.",
                  when=state("ROOT") & c.past(state("ROOT")) | state("WAIT", "READY"),
                  then=c.signal("more") == (brake != 0), lemma=True)
    c.implication("energy-of-block", "A tick's energy is not 0.", when=left != 0,
                  then=energy >= 2, lemma=True)
    c.implication("takes-what-is-loaded", "A block that is taken was loaded in the clock before.",
                  when=loads, then=c.past(taken))
    c.implication("loads-what-is-taken", "It is taken when it was.", when=c.past(taken & ~c.rst),
                  then=dut.blocks.ready)
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
    make=SpeedProfile, describe=describe, depth=42,
    cases=(Case({"speed_bits": 2, "fraction_bits": 3, "most_ticks_log2": 2, "brake_bits": 6}),
           Case({}, real=True),
           Case({"speed_bits": 2, "fraction_bits": 3, "most_ticks_log2": 2, "brake_bits": 6},
                upset=True)))
