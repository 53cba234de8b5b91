"""Contract of what collects the words of a line of G-code."""

from amaranth import Cat, Mux

from fresa.protocol.gcode_line import GCodeLine
from fresa.protocol.gcode_modes import LETTERS, AxisUse, GCodeMotion

from .contract import Case, Component, Contract

__all__ = ["GCODE_LINE"]


def describe(c: Contract, dut: GCodeLine) -> None:
    """The first error of a line stays, and a word is taken once, whole or not at all."""
    line = dut.line
    item = c.keep(dut.item.shape(), init={}, name="word")  # of the clock before
    before = c.keep(dut.item.shape(), init={}, name="word_before")  # of the one before that
    c.m.d.sync += [item.eq(dut.item), before.eq(item)]
    c.assume(~dut.take | ~(dut.clear | dut.end_program) & (item.as_value() == before.as_value()))
    known = c.past(1) & ~c.past(c.rst)
    state = Cat(line.as_value(), dut.error)
    same = state == c.past(state)
    good = dut.error == 0
    number = item.number
    letter = Cat(item.character == ord(each) for each in LETTERS)
    again = (letter & line.letters).any()

    c.implication("line-begins", "A line begins with the present modes, and with nothing else.",
                  when=known & c.past(dut.clear & ~dut.end_program),
                  then=good & (line.modes.as_value() == c.past(dut.modes.as_value()))
                  & (line.letters == 0) & (line.axes == AxisUse.NONE) & ~line.not_of_jog)
    c.implication("nothing-else-counts", "Without a word, a begin or an end it stays as it is.",
                  when=known & c.past(~(dut.take | dut.clear | dut.end_program)), then=same)
    c.implication("first-error-stays", "After an error words change nothing.",
                  when=known & c.past(dut.take & ~good), then=same)
    too_large_tool = (item.character == ord("T")) & (
        number.overflow | (number.value >= 0) & (
            (number.whole > 255) | (number.whole == 255) & ~number.integer))
    c.implication("letters-once", "A letter that is there already is error 25.",
                  when=known & c.past(dut.take & good & again & ~too_large_tool),
                  then=dut.error == 25)
    c.implication("large-tools", "A tool above 255 is error 38, also where it is the second.",
                  when=known & c.past(dut.take & good & too_large_tool), then=dut.error == 38)
    c.implication("letters-are-kept", "The letter of a word is kept, and no other changes.",
                  when=known & c.past(dut.take & good),
                  then=line.letters == c.past(line.letters | letter))
    c.implication("unknown-letters", "A letter without meaning is error 20.",
                  when=known & c.past(dut.take & good & ~letter.any() & (item.character != ord("G"))
                                      & (item.character != ord("M"))),
                  then=dut.error == 20)
    c.implication("negative-values", "Of F, N, P, S and T a negative value is error 4.",
                  when=known & c.past(
                      dut.take & good & ~again & ~number.overflow & (number.value < 0)
                      & Cat(item.character == ord(each) for each in "FNPST").any()),
                  then=dut.error == 4)
    c.implication("too-large-values", "A value with too many digits is error 38, but of N.",
                  when=known & c.past(
                      dut.take & good & ~again & number.overflow & letter.any()
                      & (item.character != ord("N"))), then=dut.error == 38)
    # That it is G is known a clock before, and a reset clears that.
    in_time = c.past(c.past(~c.rst))
    probes = c.past(in_time & dut.take & good & (item.character == ord("G"))
                    & (number.whole == 38) & ~number.overflow & (number.value >= 0))
    tenths = Mux(number.exact, Cat(number.hundredths == 10 * tenth for tenth in range(2, 6)), 0)
    c.implication("probe-words", "G38.2 to G38.5 are motions that probe, of their group and with "
                  "axis words; another fraction is error 20 unless those are taken.",
                  when=known & probes, then=Mux(
                      c.past(tenths.any()), (dut.error == 0) | (dut.error == 21)
                      | (dut.error == 24), (dut.error == 20) | (dut.error == 24)))
    c.implication("probe-modes", "The mode of motion says how it probes.",
                  when=known & probes & good, then=(line.axes == AxisUse.MOTION) & (
                      line.modes.motion.as_value() == c.past(Mux(
                          tenths[0], GCodeMotion.PROBE_TOWARD.value,
                          Mux(tenths[1], GCodeMotion.PROBE_TOWARD_NO_ERROR.value,
                              Mux(tenths[2], GCodeMotion.PROBE_AWAY.value,
                                  GCodeMotion.PROBE_AWAY_NO_ERROR.value))))))
    of_jog = (item.character != ord("M")) & (
        (item.character != ord("G"))
        | Cat(number.whole == code for code in (4, 10, 20, 21, 28, 30, 53, 92)).any()
        | Cat(number.whole == code for code in (90, 91)).any() & (number.hundredths == 0)
        & number.exact)
    c.implication("words-of-no-jog", "It is known whether there is a word that no jog may have.",
                  when=known & c.past(dut.take & good) & good,
                  then=line.not_of_jog == c.past(line.not_of_jog | ~of_jog))
    c.implication("axis-words-move", "Axis words that nothing takes are for a motion.",
                  when=line.given.any(), then=line.axes != AxisUse.NONE)
    c.implication("program-ends", "The end of a program keeps the unit, and moves along lines.",
                  when=known & c.past(dut.end_program & ~dut.clear),
                  then=(line.modes.inches == c.past(line.modes.inches))
                  & (line.modes.motion == GCodeMotion.LINE) & (line.letters == 0)
                  & (dut.error == c.past(dut.error)))


GCODE_LINE = Component(make=GCodeLine, describe=describe,
                       cases=(Case({"width": 36, "reach": 34}), Case(real=True)), depth=6)
