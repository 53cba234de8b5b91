"""Contract of the coordinates of G-code: each sum is what its meaning says."""

from amaranth import Array, Cat, Const, Mux, Value

from fresa.protocol import CoordinateSum, GCodeCoordinates, Operand
from fresa.protocol.gcode_modes import LETTERS, AxisUse, NonModal

from .contract import Bits, Case, Component, Contract

__all__ = ["GCODE_COORDINATES"]

SMALL = 8
"""Largest width at which the meaning of sums is stated."""

CLOCKS = 24
"""Clocks of a sum."""


def describe(c: Contract, dut: GCodeCoordinates) -> None:
    """Sums are of the words that they mean, and nothing else is stored."""
    which, text = Value.cast(dut.sum), Value.cast(dut.line)
    goes_on = c.past(dut.run & ~dut.done & ~c.rst)
    c.assume(~goes_on | (dut.run & (which == c.past(which)) & (text == c.past(text))))
    c.assume(which < len(CoordinateSum))
    c.assume((dut.line.modes.system <= 5) & (dut.line.p_whole <= 6))
    c.restrict_covers(~c.rst)
    axis, step, total = c.signal("axis"), c.signal("step"), c.signal("total")
    computes = dut.run & ~dut.done
    stores = computes & (step == 7)

    clocks = c.keep(range(CLOCKS + 1), name="clocks")
    changed, beyond = c.keep(1, name="was_changed"), c.keep(1, name="was_beyond")
    first = clocks == 0
    limit = 1 << dut.reach - 1
    with c.m.If(c.rst | dut.done):
        c.m.d.sync += [clocks.eq(0), changed.eq(0), beyond.eq(0)]
    with c.m.Elif(dut.run):
        c.m.d.sync += clocks.eq(clocks + 1)
        with c.m.If(stores):
            c.m.d.sync += [changed.eq(changed | (total != 0)),
                           beyond.eq(beyond | (total < -limit) | (total >= limit))]
    c.invariant("in-time", "A sum takes 24 clocks, whatever it is of.",
                dut.done == (clocks == CLOCKS), cover=dut.done)
    c.invariant("clock", "An axis takes 8 of them.",
                (dut.done & (axis == 0) & (step == 0)) | (~dut.done & (axis < 3)
                                                         & (clocks == (axis << 3) + step)),
                cover=axis == 2, lemma=True)
    c.invariant("runs-on", "A sum that has begun runs.", dut.run | first, cover=~first, lemma=True)
    c.invariant("flags", "The flags are of the axes so far.",
                Mux(first, ~changed & ~beyond, (dut.changed == changed)
                    & (dut.beyond == beyond)), cover=changed & beyond,
                lemma=True)
    c.implication("changed", "A sum is not 0.", when=dut.done, then=dut.changed == changed)
    c.implication("beyond", "A sum is beyond reach.", when=dut.done, then=dut.beyond == beyond)
    if dut.width <= SMALL:
        _sums(c, dut, axis, step, total, computes, stores)


def _sums(c: Contract, dut: GCodeCoordinates, axis, step, total, computes, stores) -> None:
    line, modes = dut.line, dut.line.modes
    words = c.words("words_0")

    def at(address: Bits) -> Bits:
        """Return the word at an address."""
        return Array([word.as_signed() for word in words])[address]

    def own(base: int) -> Bits:
        """Return a word of the axis."""
        return Array([at(base), at(base + 1), at(base + 2), at(base)])[axis]

    here = (line.letters >> LETTERS.index("X") + axis)[0]
    any_axis = line.letters[LETTERS.index("X"):].any()
    chosen = ((dut.sum == CoordinateSum.COORDINATES) | (dut.sum == CoordinateSum.SET_COORDINATES)) \
        & (line.p_whole != 0)
    system_address = (Operand.SYSTEM + 3 * Mux(chosen, line.p_whole - 1, modes.system) + axis)[:6]
    stored = line.second
    system, offset, letter = at(system_address), own(Operand.OFFSET), own(LETTERS.index("X"))
    length = Mux(axis == 2, at(Operand.LENGTH), 0)
    position, target, new = (own(each) for each in (Operand.POSITION, Operand.TARGET, Operand.NEW))
    predefined = Mux(stored, own(Operand.PREDEFINED + 3), own(Operand.PREDEFINED))
    origin = system + offset + length
    moved = here & (line.axes != AxisUse.LENGTH)
    base = Mux(line.non_modal == NonModal.MACHINE, 0, Mux(modes.relative, position, origin))
    means = {
        CoordinateSum.TARGET: Mux(moved, base + letter, position),
        CoordinateSum.COORDINATES: Mux(here, Mux(
            line.l_whole == 20, position - offset - length - letter, letter), system),
        CoordinateSum.OFFSET: Mux(here, position - system - length - letter, offset),
        CoordinateSum.HOME: Mux(here | ~any_axis, predefined, position),
        CoordinateSum.DISTANCE: target - position,
        CoordinateSum.SET_COORDINATES: new, CoordinateSum.SET_OFFSET: new,
        CoordinateSum.SET_LENGTH: at(LETTERS.index("Z")),
        CoordinateSum.ORIGIN_CHANGE: origin - own(Operand.ORIGIN),
        CoordinateSum.SET_ORIGIN: origin, CoordinateSum.PREDEFINE: position,
        CoordinateSum.TAKE_HOME: own(Operand.HOME), CoordinateSum.ARRIVE: target,
        CoordinateSum.SET_FEED: at(LETTERS.index("F")),
        CoordinateSum.SET_SPEED: at(LETTERS.index("S")),
        CoordinateSum.SET_TOOL: at(LETTERS.index("T")),
    }
    goes = {
        CoordinateSum.TARGET: Operand.TARGET + axis, CoordinateSum.COORDINATES: Operand.NEW + axis,
        CoordinateSum.OFFSET: Operand.NEW + axis, CoordinateSum.HOME: Operand.HOME + axis,
        CoordinateSum.SET_COORDINATES: system_address,
        CoordinateSum.SET_OFFSET: Operand.OFFSET + axis,
        CoordinateSum.SET_ORIGIN: Operand.ORIGIN + axis,
        CoordinateSum.PREDEFINE: Operand.PREDEFINED + Mux(stored, 3, 0) + axis,
        CoordinateSum.TAKE_HOME: Operand.TARGET + axis,
        CoordinateSum.ARRIVE: Operand.POSITION + axis,
        CoordinateSum.CLEAR_OFFSET: Operand.OFFSET + axis,
        CoordinateSum.CLEAR_LENGTH: Const(Operand.LENGTH),
        CoordinateSum.CLEAR_PROBED: Operand.PROBED + axis,
    }
    only = {  # the axis with which it is stored
        CoordinateSum.SET_LENGTH: (Operand.LENGTH, 2), CoordinateSum.SET_FEED: (Operand.FEED, 0),
        CoordinateSum.SET_SPEED: (Operand.SPEED, 0), CoordinateSum.SET_TOOL: (Operand.TOOL, 0)}
    for each in CoordinateSum:
        c.implication(each.name.lower().replace("_", "-"), "The sum is what it means.",
                      when=stores & (dut.sum == each), then=total == means.get(each, Const(0)))

    keeps, goal = Const(0), Const(0, 6)
    for each, address in goes.items():
        keeps = Mux(dut.sum == each, 1, keeps)
        goal = Mux(dut.sum == each, address, goal)
    for each, (address, when) in only.items():
        keeps = Mux(dut.sum == each, axis == when, keeps)
        goal = Mux(dut.sum == each, address, goal)
    rates = dut.sum == CoordinateSum.CLEAR_RATES
    keeps = Mux(rates, 1, keeps)
    goal = Mux(rates, Operand.FEED + axis, goal)[:6]
    written = Mux(dut.run, stores & keeps, dut.write)
    address, value = Mux(dut.run, goal, dut.address), Mux(dut.run, total, dut.data)
    was_written, where, what = c.past(written), c.past(address), c.past(value[:dut.width])
    same = Const(1)
    for number, word in enumerate(words):
        same = same & (word == Mux(was_written & (where == number), what, c.past(word)))
    c.invariant("memory", "A sum is stored where it belongs, and what is written where it is "
                "written; no other word changes.", same | ~c.past(1), cover=was_written)

    c.invariant("operands", "Operands are the same words.",
                Cat(word == copy for word, copy in
                    zip(words, c.words("operands_0"), strict=True)).all(), cover=was_written)

    uses, subtracts = c.signal("uses"), c.signal("subtracts")
    chosen: list[Bits] = [Cat(Const(0, 2), which, Const(0, 1)).bit_select(step, 1)
                          for which in (uses, subtracts)]
    chosen_uses, chosen_minus = chosen
    c.invariant("counts", "Whether the word that was fetched counts was found a clock before.",
                (c.signal("counts") == chosen_uses) & (~chosen_uses | (
                    c.signal("minus") == chosen_minus)), cover=c.signal("counts"), lemma=True)
    places = [(Operand.OFFSET + axis)[:6], Const(Operand.LENGTH, 6),
              (Operand.POSITION + axis)[:6], system_address, c.signal("last")]
    partial: Bits = Const(0)
    sums = [partial]
    for number, place in enumerate(places):
        partial = partial + Mux(uses[number], Mux(subtracts[number], -at(place), at(place)), 0)
        sums.append(partial)
    so_far = Array([sums[0], sums[0], sums[0], *sums[1:]])[step]
    c.invariant("partial-sum", "A word is added in each clock.",
                total == Mux(computes, so_far, 0), cover=computes, lemma=True)
    fetched = Array([*[at(place) for place in places], Const(0), Const(0), Const(0)])
    c.implication("fetched", "It was read before.", when=computes & (step >= 2) & (step != 7),
                  then=c.signal("fetched") == fetched[(step - 2)[:3]], lemma=True)
    c.implication("read", "And before that it was in the memory.",
                  when=computes & (step >= 1) & (step < 6),
                  then=dut.word == fetched[(step - 1)[:3]], lemma=True)


GCODE_COORDINATES = Component(
    make=GCodeCoordinates, describe=describe, depth=28,
    cases=(Case({"width": 5, "reach": 4}), Case(real=True)))
