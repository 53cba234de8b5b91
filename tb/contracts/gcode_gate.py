"""Contract of the gate for system lines and for lines during an alarm."""

from amaranth import Cat, Const, Mux

from fresa.protocol import SETTINGS, GCodeGate
from fresa.protocol.gcode_gate import COMMANDS, STORES
from fresa.protocol.gcode_reader import GCodeKind, GCodeStatus

from .contract import Bits, Case, Component, Contract

__all__ = ["GCODE_GATE"]


def describe(c: Contract, dut: GCodeGate) -> None:
    """Every line ends once and in order, and what a line does is done before its end is passed."""
    words, passed = dut.words, dut.passed
    item = words.p
    ends = item.kind == GCodeKind.END
    taken = words.valid & words.ready
    good = item.status == GCodeStatus.GOOD
    same_but_status = ((item.as_value() ^ passed.p.as_value())
                       & ~_mask(item, "status", "system")) == 0
    begins = c.past(0, init=1) | c.past(c.rst)

    # What the reader keeps to: items stay until taken, and a line is of one kind
    c.assume(begins | ~c.past(words.valid & ~words.ready)
             | (words.valid & (item.as_value() == c.past(item.as_value()))))
    inside, system = c.keep(1, name="inside"), c.keep(1, name="system")
    c.assume(~words.valid | ~inside | (item.system == system))
    longest = max(map(len, COMMANDS))
    characters = c.keep(range(longest + 3), name="characters")
    said = [c.keep(8, name=f"said_{number}") for number in range(longest + 2)]
    open_ = c.keep(1, name="open")
    c.assume(open_ | ~dut.answered)


    def begins_with(text: str) -> Bits:
        return Cat(Const(1), *(said[at + 1] == ord(each) for at, each in enumerate(text))).all()

    brought = [system & inside & (characters == len(text) + 1) & begins_with(text)
               for text in STORES]
    brings = Cat(brought)
    kept = c.keep(2, name="brought")  # the text of the line that is to be answered
    with c.m.If(dut.answered):
        c.m.d.sync += [open_.eq(0), kept.eq(0)]
    with c.m.If(taken & ends & (passed.p.status == GCodeStatus.GOOD)):
        for number, each in enumerate(brought, 1):
            with c.m.If(each):
                c.m.d.sync += kept.eq(number)
    with c.m.If(taken):
        c.m.d.sync += [inside.eq(~ends), system.eq(item.system)]
        with c.m.If(ends):
            c.m.d.sync += [characters.eq(0), open_.eq(1)]
        with c.m.Elif(item.system & (item.kind == GCodeKind.CHARACTER) & ~brings.any()):
            c.m.d.sync += characters.eq(Mux(characters == longest + 2, characters, characters + 1))
            for number, each in enumerate(said):
                with c.m.If(characters == number):
                    c.m.d.sync += each.eq(item.character)
    with c.m.If(c.rst):
        c.m.d.sync += [inside.eq(0), characters.eq(0), open_.eq(0), kept.eq(0)]

    def named(*texts: str) -> Bits:
        return words.valid & ends & item.system & good & Cat(
            (characters == len(text) + 1) & begins_with(text) for text in texts).any()

    c.invariant("one-end-for-each", "An end is passed in the clock in which one is taken.",
                (taken & ends) == (passed.valid & passed.ready
                                   & (passed.p.kind == GCodeKind.END)), cover=taken & ends)
    c.implication("words-pass", "Words of G-code pass as they are, and at once.",
                  when=words.valid & ~ends & ~item.system,
                  then=passed.valid & (words.ready == passed.ready)
                  & (passed.payload.as_value() == item.as_value()))
    jog = item.system & (characters == len("$J=")) & begins_with("J=")
    stalls = words.valid & ~ends & item.system & (kept != 0)
    of_jog = words.valid & ~ends & jog & (item.kind == GCodeKind.WORD) & ~stalls
    of_line = (words.valid & ~ends & brings[:2].any() & (item.kind == GCodeKind.WORD) & ~stalls)
    c.implication("words-of-a-jog-pass", "So do those behind $J=, with the mark of the system.",
                  when=of_jog, then=passed.valid & (words.ready == passed.ready)
                  & (passed.payload.as_value() == item.as_value()))
    c.implication("words-of-a-startup-line-pass", "So do those behind $N0= and $N1=, without it.",
                  when=of_line, then=passed.valid & (words.ready == passed.ready)
                  & same_but_status & (passed.p.status == item.status) & ~passed.p.system)
    c.implication("system-words-do-not", "Other items of a system line are taken, and not passed.",
                  when=words.valid & ~ends & item.system & ~of_jog & ~of_line & ~stalls,
                  then=~passed.valid & words.ready)
    c.implication("texts-wait", "Behind a line that brings a text no system line begins before "
                  "that is answered.", when=stalls, then=~passed.valid & ~words.ready)
    c.invariant("slot", "It shows which text a line brings, and to its answer has brought.",
                (dut.slot == Mux(kept != 0, kept, Mux(brings[0], 1, Mux(
                    brings[1], 2, Mux(brings[2], 3, 0)))))
                & (dut.writing == brings.any()) & ~(brings.any() & (kept != 0)),
                cover=kept == 3)
    c.invariant("kept", "A text is kept if its line is answered without an error.",
                dut.keep == (dut.answered & dut.accepted & (kept != 0)), cover=dut.keep)
    c.implication("ends-pass", "Of an end only the status may be another, and only that of a jog "
                  "has the mark of the system.", when=passed.valid & ends,
                  then=words.valid & same_but_status & (passed.p.system == jog))
    code = words.valid & ends & ~item.system
    busy = dut.locked | dut.jogging
    refused = code & (inside | ~good) & busy & (item.status != GCodeStatus.DAMAGED)
    c.implication("errors-pass", "An error of the reader is passed at once.",
                  when=words.valid & ends & ~good & ~refused,
                  then=passed.valid & (passed.p.status == item.status))
    c.implication("locked-lines-refused", "During an alarm and a jog a line with a word, or with "
                  "something that is none, is refused.", when=refused,
                  then=passed.valid & (passed.p.status == GCodeStatus.LOCKED))
    c.implication("other-lines-pass", "Otherwise, and if it is empty, it is not refused.",
                  when=code & good & ~refused,
                  then=passed.valid & (passed.p.status == GCodeStatus.GOOD))
    c.implication("nothing-of-nothing", "Without an item nothing is passed.",
                  when=~words.valid, then=~passed.valid)
    c.implication("unlock", "Only $X unlocks, when its end is passed, as a line without error.",
                  when=dut.unlock,
                  then=named("X") & taken & (passed.p.status == GCodeStatus.GOOD))
    homes = named("H", "HX", "HY", "HZ")
    c.implication("home", "Only $H homes, and single axes, if $22 is not 0 and the door closed.",
                  when=dut.home, then=homes & c.past(dut.value != 0) & ~dut.door)
    c.implication("home-of-it", "That is of all axes, or of one.", when=dut.home,
                  then=Cat(~named(f"H{letter}") | (dut.homes == axis)
                           for letter, axis in (("", 3), ("X", 0), ("Y", 1), ("Z", 2))).all())
    c.implication("lists", "Only the lines of lists begin one, and its own.", when=dut.listing,
                  then=named("", "G", "#", "I", "N") & Cat(
                      ~named(text) | (dut.list.as_value() == number)
                      for number, text in enumerate(("", "G", "#", "I", "N"))).all())
    c.implication("erases", "Only $RST= with # or * erases coordinates.", when=dut.erase,
                  then=named("RST=#", "RST=*"))
    c.implication("restores", "Only $RST= says that something is as it was.", when=dut.restoring,
                  then=named("RST=$", "RST=#", "RST=*"))
    c.implication("check-mode", "Only $C begins and ends check mode.",
                  when=(dut.checking != c.past(dut.checking)) & ~begins,
                  then=c.past(named("C")))
    asks, answer_acts = c.keep(1, name="asks"), dut.restart | dut.sleep
    with c.m.If(dut.answered):
        c.m.d.sync += asks.eq(0)
    with c.m.If(taken & named("C", "SLP", "RST=$", "RST=#", "RST=*")):
        c.m.d.sync += asks.eq(1)
    with c.m.If(c.rst):
        c.m.d.sync += asks.eq(0)
    c.implication("at-the-answer", "A reset and sleep come with the answer of a line for them.",
                  when=answer_acts, then=dut.answered & asks)
    acts = dut.home | dut.write | dut.configure | dut.listed.valid | dut.listing | dut.erase
    c.implication("lines-before-answered", "A system line acts when those before are answered.",
                  when=acts | dut.unlock, then=words.valid & ends & item.system & good & ~open_)
    c.implication("acts-before-its-end", "Settings and homing are through when the end is passed.",
                  when=acts, then=~passed.valid)

    state, done = c.state("gate_state"), c.signal("done")
    place = c.signal("place")
    prefixes = dict.fromkeys(
        text[:length] for text in dut.commands for length in range(len(text) + 1))
    known = Cat(c.signal(f"begun_{number}") == ((characters == len(text) + 1) & begins_with(text))
                for number, text in enumerate(prefixes)).all()
    pending = words.valid & ends & item.system & good
    c.invariant("known-line", "What is known of a system line is that of its characters.",
                known
                & ((place == 0) == (characters == 0)) & ((place == 1) == (characters == 1))
                & ((characters == 0) | (inside & system)),
                cover=characters == 2, lemma=True)
    c.invariant("registers", "A line that has a word, or is not answered, is known as such.",
                (c.signal("filled") == inside) & (c.signal("open_") == open_)
                & (c.signal("stores") == kept), cover=inside,
                lemma=True)
    c.invariant("judged", "Only a system line that waits is judged.",
                (~done | (state("PASS") & pending & ~open_))
                & (state("PASS") | state("FAULT") | (pending & ~open_)), cover=done, lemma=True)
    asks_homing = c.past(state("ASK"))
    c.invariant("homing", "The states of homing are those of $H.",
                ~state("ASK", "COMPARE", "HOME", "HOMING") | homes, cover=asks_homing, lemma=True)
    restarts, sleeps = c.signal("restarts"), c.signal("sleeps")
    c.invariant("lines-of-states", "So are the others.",
                (~state("BEGIN_LIST", "LIST_ALL") | named("", "G", "#", "I", "N"))
                & (~state("RENEW", "ADDRESS_INITIAL", "READ_INITIAL", "WRITE_INITIAL")
                   | named("RST=$", "RST=*"))
                & (~state("ERASE") | named("RST=#", "RST=*"))
                & (~state("RESTORED") | named("RST=$", "RST=#", "RST=*")),
                cover=state("ERASE"), lemma=True)
    c.invariant("asks", "What comes with an answer is asked for by a line.",
                ~(restarts | sleeps) | asks
                | (state("PASS") & done & named("C", "SLP", "RST=$", "RST=#", "RST=*")),
                cover=asks & restarts, lemma=True)
    waits = dut.waiting & ~dut.resting & ~dut.locked & ~dut.checking
    c.implication("waits-for-rest", "Behind what GRBL waits for a system line does, too.",
                  when=c.past(state("JUDGE") & waits & ~c.rst), then=state("PASS") & ~done)
    judged, status = state("JUDGE") & ~dut.settling & ~waits & ~c.rst, c.signal("status")
    c.implication("no-unlock-of-a-stop", "While it is stopped, $X, $H and $SLP are refused.",
                  when=c.past(judged & (homes | named("X", "SLP")) & dut.stopped),
                  then=state("PASS") & done & (status == GCodeStatus.NOT_IDLE))
    c.implication("no-unlock-at-the-door", "So is $X during an alarm while the door is open.",
                  when=c.past(judged & named("X") & ~dut.stopped),
                  then=state("PASS") & done & (status == Mux(
                      c.past(dut.locked & dut.door), GCodeStatus.DOOR_OPEN, GCodeStatus.GOOD)))
    line = c.signal("line")
    sets, any_time, unread = line[0], line[-2], line[-1]
    others = ~named(*dut.commands) & ~sets & (characters >= 2)
    at_any_time = Cat(said[1] == ord(each) for each in "$GCXJ").any()
    of_command = Cat(said[1] == ord(each) for each in "GCXJHSIRN").any()
    c.invariant("others-known", "What such a line begins with is kept.",
                ((characters < 2) | (any_time == at_any_time))
                & ((characters != 2) | (said[1] < ord("A")) | (unread == ~of_command)),
                cover=characters == 3, lemma=True)
    c.implication("others-refused", "What is none of them is refused, with 8 first unless it "
                  "begins as one of those that may come at any time.",
                  when=c.past(judged & others),
                  then=state("PASS") & done & Mux(
                      c.past(dut.resting | at_any_time),
                      (status == GCodeStatus.UNSUPPORTED) | (status == GCodeStatus.NO_NUMBER),
                      status == GCodeStatus.NOT_IDLE))
    c.implication("no-number", "A line with a letter of no command has no number.",
                  when=c.past(judged & others & dut.resting & (characters == 2)
                              & (said[1] >= ord("A"))),
                  then=status == Mux(c.past(of_command), GCodeStatus.UNSUPPORTED,
                                     GCodeStatus.NO_NUMBER))
    c.implication("jogs", "A jog is refused unless it is at rest and not locked, or jogs.",
                  when=c.past(judged & named("J=")),
                  then=state("PASS") & done & (status == Mux(
                      c.past(dut.jogging | (dut.resting & ~dut.locked)),
                      GCodeStatus.GOOD, GCodeStatus.NOT_IDLE)))
    c.implication("stores", "A text is refused unless it is at rest, a line while it is locked, "
                  "and either if it is too long.",
                  when=c.past(judged & named(*STORES)),
                  then=state("PASS") & done & (status == Mux(
                      c.past(~dut.resting | (dut.locked & brings[:2].any())),
                      GCodeStatus.NOT_IDLE, Mux(c.past(dut.too_long),
                                                GCodeStatus.TEXT_TOO_LONG, GCodeStatus.GOOD))))
    asks_texts = c.keep(1, name="asks_texts")
    with c.m.If(dut.answered):
        c.m.d.sync += asks_texts.eq(0)
    with c.m.If(taken & named("RST=*")):
        c.m.d.sync += asks_texts.eq(done)
    with c.m.If(c.rst):
        c.m.d.sync += asks_texts.eq(0)
    texts = c.signal("restores_texts")
    c.invariant("restores-texts", "Only $RST=* lets them be those of power-up, at its answer.",
                ~dut.restoring_texts | (dut.answered & asks_texts), cover=answer_acts)
    c.invariant("asks-texts", "What comes with that answer is asked for by its line.",
                ~texts | asks_texts | (state("PASS") & done & named("RST=*")),
                cover=state("RESTORED"), lemma=True)
    c.leaves_unused_codes("gate_state", fault=dut.fault, shows=~acts)


def _mask(item, *members: str) -> int:
    """Return the bits of members in an item."""
    fields = [item.shape()[name] for name in members]
    return sum((1 << field.width) - 1 << field.offset for field in fields)


FEW = {"width": 8, "settings": [each for each in SETTINGS if each.number in (20, 22)]}
"""A machine with the settings that the gate itself knows: all are gone through in a few clocks."""

GCODE_GATE = Component(make=GCodeGate, describe=describe,
                       cases=(Case(FEW), Case(real=True), Case(FEW, upset=True)), depth=28)
