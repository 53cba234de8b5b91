"""Contract of the lister of a G-code machine: each list is whole, in order, and ends."""

from amaranth import Array, Cat, Const, Mux, Value

from fresa.protocol import GCodeList, GCodeLister, GCodeText, GCodeUnit, Operand

from .contract import Bits, Case, Component, Contract

__all__ = ["GCODE_LISTER"]

NUMBERS = (54, 55, 56, 57, 58, 59, 28, 30, 92)
PLACES = (*range(Operand.SYSTEM, Operand.OFFSET, 3), Operand.PREDEFINED, Operand.PREDEFINED + 3,
          Operand.OFFSET)
"""Numbers of the coordinates that are listed, and where the words of X are."""


def describe(c: Contract, dut: GCodeLister) -> None:
    """Parts come in the order of the list, stay until taken, and then it is through."""
    state, parts, part, modes = c.state("lister_state"), dut.parts, dut.parts.p, dut.modes
    kept = c.past(~c.rst)
    listing = c.keep(1, name="listing")
    count = c.keep(range(32), name="count")  # parts that were taken
    which, text = Value.cast(dut.list), Cat(
        Value.cast(modes), dut.feed_zero, dut.probed, dut.inches)
    motion = modes.motion.as_value()
    c.assume(~dut.start | ~listing)
    c.assume(~(kept & c.past(listing)) | ((which == c.past(which)) & (text == c.past(text))))
    c.assume(~(kept & c.past(dut.start)) | ((which == c.past(which)) & (text == c.past(text))))
    c.assume((which <= 5) & ((motion <= 4) | (motion >= 8) & (motion <= 11)) & (modes.plane <= 2)
             & (modes.system <= 5) & ~(modes.clockwise & modes.counter_clockwise))
    asked = c.past(dut.divide)
    c.assume(~dut.divided | asked)
    c.assume(~(kept & asked & c.past(dut.divided) & dut.divide)
             | (dut.divided & (dut.quotient == c.past(dut.quotient))))
    c.assume(dut.divide | asked | c.past(asked) | (dut.quotient == 0))
    taken = parts.valid & parts.ready
    with c.m.If(dut.start):
        c.m.d.sync += [listing.eq(1), count.eq(0)]
    with c.m.If(taken):
        c.m.d.sync += count.eq(count + 1)
    with c.m.If(dut.done):
        c.m.d.sync += listing.eq(0)
    with c.m.If(c.rst):
        c.m.d.sync += listing.eq(0)

    of_modes, of_places, of_probe = (dut.list == each for each in (
        GCodeList.MODES, GCodeList.COORDINATES, GCodeList.PROBED))
    both = modes.mist & modes.flood
    total = Mux(of_modes, 11 + both, Mux(of_places, 31, Mux(of_probe, 3, 1)))
    c.implication("part-stays", "A part is offered until it is taken, and does not change.",
                  when=kept & c.past(parts.valid & ~parts.ready), then=parts.valid
                  & (Value.cast(parts.payload) == c.past(Value.cast(parts.payload))))
    c.implication("whole", "A list is through when all its parts were taken.", when=dut.done,
                  then=listing & (count == total))
    c.implication("only-when-asked", "Nothing is listed unless it was asked for.",
                  when=parts.valid, then=listing & (count < total))
    c.implication("ends", "After its last part a list is through.",
                  when=kept & c.past(taken & (count == total - 1)), then=dut.done)

    # Turns of a list of modes, without the second word of coolant
    place: Bits = Mux(count > 7, count + ~both, count)[:5]
    spindle = Mux(modes.clockwise, 3, Mux(modes.counter_clockwise, 4, 5))
    coolant = Mux(modes.mist, 7, Mux(modes.flood, 8, 9))
    said = [Mux(motion == 4, 80, Mux(motion >= 8, motion - 6, motion))[:7], modes.system + 54,
            modes.plane + 17, Mux(modes.inches, 20, 21), Mux(modes.relative, 91, 90),
            Mux(modes.inverse, 93, 94), spindle, coolant, Const(8), Const(0), Const(0)]
    without = (place == 10) & dut.feed_zero  # a feed, which is 0 then
    words = [GCodeText.MOTION, *[GCodeText.G] * 5, *[GCodeText.M] * 3, GCodeText.TOOL,
             GCodeText.FEED, GCodeText.SPEED]

    def offers(text: Bits, ends: Bits) -> Bits:
        return (part.text.as_value() == text) & (part.ends == ends)

    c.implication("modes", "Modes come in GRBL's order.", when=parts.valid & of_modes,
                  then=offers(Mux((place == 0) & (motion >= 8), GCodeText.PROBE_MOTION.value,
                                  Array(word.value for word in words)[place]), place == 11)
                  & (part.code == 0))
    c.implication("modes-are-said", "What is said of them is what they are.",
                  when=parts.valid & of_modes & ((place <= 8) | without),
                  then=part.value == Array(said)[place])
    axis, group = count % 3, (count // 3)[:4]
    c.implication("coordinates", "Coordinates come in GRBL's order, by their axes; then the "
                  "tool.", when=parts.valid & of_places, then=Mux(
                      count < 27, offers(Mux(axis == 0, GCodeText.COORDINATES.value, Mux(
                          axis == 1, GCodeText.AXIS.value, GCodeText.LAST_AXIS.value)), axis == 2)
                      & (part.code == Array(NUMBERS)[group]),
                      (count != 27) | offers(GCodeText.LENGTH.value, Const(1))))
    of_probed = of_probe | of_places & (count >= 28)  # the last line of coordinates
    probe_axis: Bits = Mux(of_probe, count, count - 28)[:2]
    c.implication("probe", "The last line of coordinates says where the probe touched, and whether "
                  "it did.", when=parts.valid & of_probed,
                  then=offers(Array([GCodeText.PROBED.value, GCodeText.AXIS.value,
                                     GCodeText.LAST_PROBED.value])[probe_axis], probe_axis == 2)
                  & (part.code == dut.probed))
    for which_list, name in ((GCodeList.HELP, GCodeText.HELP), (GCodeList.BUILD, GCodeText.BUILD),
                             (GCodeList.STARTUP, GCodeText.STARTUP)):
        c.implication(f"{which_list.name.lower()}", "A text is a list of one part.",
                      when=parts.valid & (dut.list == which_list),
                      then=offers(Const(name.value), Const(1)))
    divided = of_places | of_probe | of_modes & (place >= 9) & ~without
    c.implication("address", "A word is divided where it is.",
                  when=dut.divide,
                  then=divided & (dut.address == Mux(
                      of_modes, Array([Operand.TOOL, Operand.FEED, Operand.SPEED])[place - 9],
                      Mux(of_probed, Operand.PROBED + probe_axis,
                          Mux(count == 27, Operand.LENGTH, Array(PLACES)[group] + axis)))))
    division = dut.division
    c.implication("division", "What a word is divided by depends on the unit of reports, and of a "
                  "feed on G93; but for the tool the quotient is the nearest.", when=dut.divide,
                  then=(division.unit.as_value() == Mux(
                      ~of_modes, GCodeUnit.LENGTH.value, Mux(
                          place != 10, GCodeUnit.ONE.value, Mux(
                              modes.inverse, GCodeUnit.INVERSE.value, GCodeUnit.FEED.value))))
                  & (division.inches == dut.inches)
                  & (division.nearest == ~(of_modes & (place == 9))))
    c.implication("quotient", "A word is offered when it is divided, as the quotient.",
                  when=parts.valid & divided,
                  then=dut.divide & dut.divided & (part.value == dut.quotient))
    c.implication("goes-on", "It is divided until then.",
                  when=kept & c.past(dut.divide & ~dut.divided), then=dut.divide)

    turn, own_axis = c.signal("turn"), c.signal("axis")
    c.invariant("turns", "Turns are those of the parts that were taken.",
                state("DONE", "IDLE", "FAULT") | (listing & (count < total) & Mux(
                    of_modes, (turn == place) & (own_axis == 0), Mux(
                        of_probed, (turn == 10) & (own_axis == probe_axis), Mux(
                            of_places, Mux(count < 27, (turn == group) & (own_axis == axis),
                                           (turn == 9) & (own_axis == 0)),
                            (turn == 0) & (own_axis == 0))))), cover=count == 1, lemma=True)
    c.invariant("listing", "A list is under way in all states but one.",
                (listing == ~state("IDLE")) | state("FAULT"), cover=listing, lemma=True)
    c.invariant("through", "It is through when all are taken.",
                ~state("DONE") | (count == total), cover=state("DONE"), lemma=True)
    c.invariant("chosen", "What was chosen for a part stays until that is taken.",
                state("IDLE", "CHOOSE", "DONE", "FAULT")
                | (Value.cast(c.signal("chosen")) == Value.cast(c.signal("choice"))),
                cover=state("READ"), lemma=True)
    c.invariant("value-of-a-mode", "A mode is offered as it was sampled.",
                ~(parts.valid & of_modes & ((place <= 8) | without))
                | (part.value == Array(said)[place]),
                cover=parts.valid & of_modes, lemma=True)
    c.leaves_unused_codes("lister_state", fault=dut.fault,
                          shows=~parts.valid & ~dut.done)


GCODE_LISTER = Component(make=GCodeLister, describe=describe, depth=18,
                         cases=(Case(), Case(upset=True)))
