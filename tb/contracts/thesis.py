"""Contract of the thesis' dialect: an end for an end, and no word that the firmware has not."""

from amaranth import Cat, Const, Mux

from fresa.protocol import GCodeKind, ThesisDialect
from fresa.protocol.thesis import G_CODES, M_CODES, UNKNOWN

from .contract import Bits, Case, Component, Contract

__all__ = ["THESIS"]


def describe(c: Contract, dut: ThesisDialect) -> None:
    """What is passed is what came, but for G28, P and the codes that are not known."""
    words, passed = dut.words, dut.passed
    item, out = words.p, passed.p
    given, taken = passed.valid & passed.ready, words.valid & words.ready
    ends = item.kind == GCodeKind.END
    begins = c.past(0, init=1) | c.past(c.rst)
    if not c.upset:
        c.restrict_covers(~c.rst)
    c.assume(begins | ~c.past(words.valid & ~words.ready)
             | (words.valid & (item.as_value() == c.past(item.as_value()))))
    c.assume(item.kind.as_value() != 3)
    within = c.keep(1, name="within_a_line")
    system = c.keep(1, name="system_line")
    with c.m.If(taken):
        c.m.d.sync += [within.eq(~ends), system.eq(item.system)]
    with c.m.If(c.rst):
        c.m.d.sync += within.eq(0)
    c.assume(~words.valid | ~within | (item.system == system))
    state = c.state("thesis_state")
    word = (item.kind == GCodeKind.WORD) & ~item.system
    number = item.number

    c.implication("ends-together", "The end of a line is passed when it is taken, and only then.",
                  when=passed.valid | words.ready,
                  then=(given & (out.kind == GCodeKind.END)) == (taken & ends))
    c.implication("stable-until-ready", "An item that is offered stays until it is taken.",
                  when=~begins & c.past(passed.valid & ~passed.ready),
                  then=dut.fault | (passed.valid
                                    & (out.as_value() == c.past(out.as_value()))))

    # What the line has said
    says: dict[str, Bits] = {
        "axis": Cat(item.character == ord(each) for each in "XYZ").any(),
        "shift": (item.character == ord("G")) & (number.whole == 92),
        "motors": (item.character == ord("M")) & ((number.whole == 3) | (number.whole == 5)),
        "word": Const(1)}
    said = {name: c.keep(1, name=f"said_{name}") for name in says}
    home = (word & (item.character == ord("G")) & (number.whole == 28) & number.integer
            & ~number.overflow & ~number.value[-1])
    homes = c.keep(1, name="is_home")  # G28 alone
    with c.m.If(taken & word):
        c.m.d.sync += [said[name].eq(said[name] | now) for name, now in says.items()]
        c.m.d.sync += homes.eq(home & ~said["word"])
    with c.m.If((taken & ends) | c.rst):
        c.m.d.sync += [*(each.eq(0) for each in said.values()), homes.eq(0)]
    answered = c.keep(1, init=1, name="answered_all")
    with c.m.If(dut.answered):
        c.m.d.sync += answered.eq(1)
    with c.m.If(given & (out.kind == GCodeKind.END)):
        c.m.d.sync += answered.eq(0)
    with c.m.If(c.rst):
        c.m.d.sync += answered.eq(1)
    good = ends & (item.status.as_value() == 0)

    c.implication("goes-home", "The end of a line that is G28 alone is that of a system line.",
                  when=given & (out.kind == GCodeKind.END) & ~item.system,
                  then=out.system == (homes & good))
    c.implication("home-is-dollar-h", "Before it comes $H, and no other line gets characters.",
                  when=passed.valid & (out.kind == GCodeKind.CHARACTER)
                  & (item.kind != GCodeKind.CHARACTER),
                  then=homes & good & out.system & ~words.ready
                  & (out.character == Mux(state("DOLLAR"), ord("$"), ord("H"))))
    c.implication("waits-until-rest", "$H waits until nothing moves and all lines are answered.",
                  when=~begins & state("DOLLAR") & ~c.past(state("DOLLAR")),
                  then=c.past(dut.resting) & answered)
    inserted = passed.valid & (out.kind == GCodeKind.WORD) & ends
    c.implication("motors-on", "A word is added to a line that moves, before its end, and it "
                  "is M3.", when=inserted & said["axis"],
                  then=good & ~said["shift"] & ~said["motors"] & ~words.ready
                  & (out.character == ord("M")) & (out.number.whole == 3)
                  & (out.number.value == 3_000_000 % (1 << dut.width)))
    axes = c.keep(2, name="axes_added")
    with c.m.If(given & inserted & ~said["axis"]):
        c.m.d.sync += axes.eq(axes + 1)
    with c.m.If((taken & ends) | c.rst):
        c.m.d.sync += axes.eq(0)
    c.implication("origin", "To a line without an axis are added X0, Y0 and Z0, if it has G92.",
                  when=inserted & ~said["axis"],
                  then=good & said["shift"] & ~words.ready & (out.number.value == 0)
                  & Cat((axes == number) & (out.character == ord(axis))
                        for number, axis in enumerate("XYZ")).any())
    c.implication("whole-origin", "That line has all three.",
                  when=given & (out.kind == GCodeKind.END) & good & said["shift"] & ~said["axis"]
                  & ~homes & ~item.system & ~c.signal("wrong"), then=axes == 3)
    added = c.keep(1, name="is_added")
    with c.m.If(given & inserted & said["axis"]):
        c.m.d.sync += added.eq(1)
    with c.m.If((taken & ends) | c.rst):
        c.m.d.sync += added.eq(0)
    c.implication("motors-on-in-motion", "No line moves without that.",
                  when=given & (out.kind == GCodeKind.END) & good & said["axis"] & ~said["shift"]
                  & ~said["motors"] & ~homes & ~item.system
                  & ~c.signal("wrong"), then=added)
    whole = out.number.whole
    c.implication("codes-of-the-firmware", "No other code is passed on.",
                  when=passed.valid & (out.kind == GCodeKind.WORD) & ~out.system
                  & ((out.character == ord("G")) | (out.character == ord("M"))),
                  then=out.number.integer & ~out.number.overflow & ~out.number.value[-1] & Mux(
                      out.character == ord("G"),
                      Cat(whole == each for each in G_CODES if each != 28).any(),
                      Cat(whole == each for each in M_CODES).any()))
    c.implication("as-they-are", "Other words are passed as they are.",
                  when=given & taken & ~(word & (item.character == ord("P"))) & ~ends
                  & (out.character != UNKNOWN), then=out.as_value() == item.as_value())
    c.implication("each-word-once", "A word is passed when it is taken, but for G28.",
                  when=taken & ~ends, then=given | (home & ~said["word"]))
    if dut.width == 13:
        _seconds(c, dut, state)
    c.invariant("line", "What is known of the line is what it has said.",
                state("FAULT") | (
                    (c.signal("begun") == said["word"]) & (c.signal("moves") == said["axis"])
                    & (c.signal("shifts") == said["shift"])
                    & (c.signal("powers") == said["motors"]) & (c.signal("open_") == ~answered)
                    & ((c.signal("homes") & ~c.signal("wrong")) == homes)
                    & (~c.signal("homes") | said["word"])
                    & (said["word"] | ~(said["axis"] | said["shift"] | said["motors"]))
                    & (~said["word"] | (within & ~system))
                    & (~c.signal("wrong") | c.signal("homes"))
                    & (added == (state("END") & ~homes & said["axis"]))
                    & ((axes != 0) == (state("ADD_Y", "ADD_Z")
                                       | (state("END") & ~homes & ~said["axis"])))
                    & (~state("ADD_Y") | (axes == 1)) & (~state("ADD_Z") | (axes == 2))
                    & (~(state("END") & ~homes & ~said["axis"]) | (axes == 3))
                    & (~(state("ADD_X", "ADD_Y", "ADD_Z")
                         | (state("END") & ~homes & ~said["axis"]))
                       | (said["shift"] & ~said["axis"] & ~homes & ~item.system))
                    & (~state("ADD", "ADD_X", "ADD_Y", "ADD_Z", "END", "WAIT", "DOLLAR", "H")
                       | (words.valid & good & ~c.signal("wrong")))
                    & (~state("ADD") | (said["axis"] & ~said["shift"] & ~said["motors"] & ~homes))
                    & (~state("WAIT", "DOLLAR", "H") | (homes & ~item.system))
                    & (~state("END") | ~item.system)
                    & (~state("DOLLAR", "H") | answered)
                    & (~state("DIVIDE", "GIVE") | (words.valid & word & (
                        item.character == ord("P")) & ~number.overflow & ~number.value[-1]))),
                cover=state("END") & homes, lemma=True)
    c.leaves_unused_codes("thesis_state", fault=dut.fault, shows=~passed.valid & ~words.ready)


def _seconds(c: Contract, dut: ThesisDialect, state) -> None:
    """State that P in ms becomes P in s."""
    value, rest, count = c.signal("value"), c.signal("rest"), c.signal("count")
    bits = dut.width - 1
    source = dut.words.p.number.value.as_unsigned()[:bits]
    left = (count + 1)[:6]  # bits of the dividend that are to come
    done = (Const(bits, 6) - left)[:6]
    low = ((Const(1, bits + 1) << done) - 1)[:bits]  # where the quotient is
    c.implication("seconds", "P is a thousandth of what it was, towards zero.",
                  when=state("GIVE") & dut.passed.valid,
                  then=(dut.passed.p.number.value.as_unsigned() * 1000 <= source)
                  & (source < dut.passed.p.number.value.as_unsigned() * 1000 + 1000))
    c.invariant("division", "A bit of the quotient replaces one of the dividend.",
                (~state("DIVIDE") | ((count < bits) & (rest < 1000)
                    & ((value & ~low) == ((source << done) & ~low)[:bits])
                    & ((source >> left) == (value & low) * 1000 + rest)))
                & (~state("GIVE") | ((rest < 1000) & (value * 1000 + rest == source))),
                cover=state("GIVE"), lemma=True)


THESIS = Component(make=ThesisDialect, describe=describe, depth=18,
                   cases=(Case({"width": 13}), Case(real=True), Case({"width": 13}, upset=True)))
