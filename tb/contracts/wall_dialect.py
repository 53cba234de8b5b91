"""Contract of the wall's dialect: what passes, what a command begins, and what is said of it."""

from unittest.mock import patch

from amaranth import Array, Cat, Module, Mux, Value

from fresa.machines.vplotter import VPlotterSettings
from fresa.protocol import HomingStage, LineEnd, WallDialect, wall_dialect
from fresa.protocol.wall_dialect import _Job, _Phase, _Text

from .contract import Bits, Case, Component, Contract, Unknown

__all__ = ["WALL_DIALECT"]

SYNTAX = {"P": _Text.SYNTAX_P, "H": _Text.SYNTAX_H, "I": _Text.SYNTAX_I, "F": _Text.SYNTAX_F,
          "S": _Text.SYNTAX_S}
MANY = 15
"""Bytes of a command that are counted at most."""


def describe(c: Contract, dut: WallDialect) -> None:
    """Lines pass unchanged, a command is answered or begun, and nothing is said within a line."""
    short = isinstance(c.part("texts"), Unknown)
    if short:
        _assume_parts(c)
    lines, items, says = dut.lines, dut.items, dut.bytes
    taken, given = lines.valid & lines.ready, items.valid & items.ready
    item = lines.payload.as_value()
    goes_on = c.past(~c.rst)
    anew = c.rst | dut.renewed
    known = c.past(~anew)
    byte, ends = lines.p.byte, lines.p.end
    phase, job, replies, reply = (c.signal(name) for name in ("phase", "job", "replies", "reply"))

    # Lines stay until taken; an answer is to a line. With a reset lines begin anew.
    c.assume(~known | ~c.past(lines.valid & ~lines.ready)
             | (lines.valid & (item == c.past(item))))
    c.assume(~ends | (byte <= LineEnd.DAMAGED.value))
    within, commands = c.keep(1, name="within"), c.keep(1, name="commands")
    first = ~within & lines.valid & ~ends & (byte == ord(":"))
    command = (within & commands) | first
    with c.m.If(taken):
        c.m.d.sync += [within.eq(~ends), commands.eq(command)]
    with c.m.If(anew):
        c.m.d.sync += within.eq(0)
    begun, waits = c.keep(1, name="line_begun"), c.keep(1, name="line_is_not_answered")
    c.assume(~dut.answered | waits)
    with c.m.If(dut.answered):
        c.m.d.sync += waits.eq(0)
    with c.m.If(given):
        c.m.d.sync += [begun.eq(~items.p.end), waits.eq(items.p.end)]
    with c.m.If(anew):
        c.m.d.sync += [begun.eq(0), waits.eq(0)]
    owned = c.keep(1, name="owned")  # the line that has begun is one of a command
    with c.m.If(given):
        c.m.d.sync += owned.eq(dut.own)

    asked = phase == _Phase.ASKED
    c.implication("lines-pass", "Of a line of G-code each item passes as it is, in its clock.",
                  when=items.valid & ~dut.own, then=lines.valid & ~command
                  & (items.payload.as_value() == item) & (lines.ready == items.ready))
    c.implication("no-other-is-taken", "A line that is taken passes, or is a command.",
                  when=taken & ~command, then=given & ~dut.own)
    c.implication("passes-at-once", "It passes at once, unless the line before is not answered, "
                  "or what a command has begun goes on.",
                  when=lines.valid & ~command & ~waits & ~dut.own & ~dut.fault
                  & (begun | (phase == _Phase.NONE)) & ~c.state("wall_state")("ACT", "WAKE"),
                  then=items.valid)
    c.implication("commands-do-not-pass", "A line that begins with a colon does not pass.",
                  when=command & lines.valid & items.valid, then=dut.own)
    c.implication("answered-before-the-next", "A line begins when the one before is answered.",
                  when=items.valid, then=~waits)
    c.implication("none-within-another", "A line that has begun goes on as what it began as.",
                  when=begun & items.valid, then=owned == dut.own)

    # What a command says
    letter, count = c.keep(8, name="letter"), c.keep(range(MANY + 1), name="count")
    bad, status, complete = (c.keep(1, name="bad"), c.keep(8, name="status"),
                             c.keep(1, name="complete"))
    numbers = [c.keep(14, name=f"number_{name}") for name in "xy"]
    named = c.keep(1, name="named")
    digit = (byte >= ord("0")) & (byte <= ord("9"))
    if not c.upset:  # a number is 0, or begins with 1: there is less to try
        c.restrict_covers(~c.rst & (
            ~(lines.valid & within & commands & named & ~ends) | (byte == ord("0"))
            | ((byte == ord("1")) & (count == 0))))
    with c.m.If(first & taken):
        c.m.d.sync += [letter.eq(0), count.eq(0), bad.eq(0), named.eq(0),
                       *(each.eq(0) for each in numbers)]
    with c.m.Elif(command & taken & ends):
        c.m.d.sync += [status.eq(byte), complete.eq(1)]
    with c.m.Elif(command & taken & ~named):
        c.m.d.sync += [letter.eq(byte & 0xDF), named.eq(1)]
    with c.m.Elif(command & taken):
        c.m.d.sync += [count.eq(count + (count != MANY)), bad.eq(bad | ~digit)]
        for number, each in enumerate(numbers):
            with c.m.If((count >= 4 * number) & (count < 4 * number + 4)):
                c.m.d.sync += each.eq(each * 10 + byte[:4])
    x, y = numbers
    state, speak = c.state("wall_state"), c.state("speak_state")
    looked_at = complete & ~replies & ~dut.renewed & ~state("WAKE")

    def is_(*letters: str) -> Bits:
        return Cat(letter == ord(each) for each in letters).any()

    many = Mux(is_("P", "S"), 1, Mux(is_("H"), 0, 8))
    most = Mux(is_("P"), 1, 2)
    formed = (status == LineEnd.GOOD.value) & ~bad & (count == many) & (
        ~is_("P", "S") | (x <= most)) & is_("P", "H", "I", "F", "S")
    releases = (job == _Job.SLEEP) & (phase != _Phase.NONE)
    # But for states what is right waits for the answer to the line of G-code before, and until it
    # has begun to move.
    left = c.signal("left")
    most = (1 << len(left)) - 1
    idle = c.keep(range(most + 2), name="idle")
    still = (phase == _Phase.NONE) & ~dut.answered & ~c.rst
    c.m.d.sync += idle.eq(Mux(still, idle + (idle <= most), 0))
    c.invariant("begins-soon", "It does not wait for long.", (idle + left <= most + 1)
                & ((idle <= most) | (left == 0)), cover=idle == most)
    stays = formed & ((waits & ~asked) | ((phase == _Phase.NONE) & (left != 0))) & (
        is_("H", "I", "F") | (is_("P") & ~releases))
    decides = looked_at & ~stays
    with c.m.If(decides | anew):
        c.m.d.sync += complete.eq(0)
    busy = (phase != _Phase.NONE) | dut.moving
    wall = (x <= dut.width) & (y >= dut.top) & (y <= dut.height)
    ready, sleeping = c.signal("ready"), dut.sleeping
    powered = formed & is_("P") & (x == 1) & ~releases
    powers = powered & ~dut.emergency
    tells_state = formed & is_("S")
    starts = formed & ~busy & (
        (is_("P") & (x == 0)) | is_("H") | (is_("I") & dut.homed & wall)
        | (is_("F") & dut.homed & ready & wall))
    refusal = Mux(
        status != LineEnd.GOOD.value, _Text.DAMAGED, Mux(
            ~is_(*SYNTAX), _Text.COMMANDS, Mux(
                ~formed, _choose((letter == ord(each), text) for each, text in SYNTAX.items()),
                Mux(tells_state, _Text.STATE, Mux(powered, Mux(
                    dut.emergency, _Text.EMERGENCY, _Text.POWERED), Mux(
                    busy, _Text.BUSY, Mux(~dut.homed, _Text.HOME_FIRST, Mux(
                        is_("F") & ~ready, _Text.START_FIRST, _Text.OFF_THE_WALL))))))))
    wakes = powers & sleeping
    c.implication("begins", "A command that is right begins what it says, in the next clock.",
                  when=goes_on & c.past(decides & starts), then=asked & ~c.past(asked) & (
                      job == c.past(Mux(is_("P"), _Job.SLEEP, Mux(is_("H"), _Job.HOME, Mux(
                          is_("I"), _Job.GO, _Job.DRAW))))))
    c.implication("begins-only-so", "Nothing else begins anything.", when=goes_on & asked
                  & ~c.past(asked), then=c.past(decides & starts))
    c.implication("begins-when-answered", "Nothing begins before the line of G-code that came "
                  "before is answered.", when=goes_on & asked & ~c.past(asked),
                  then=~c.past(waits))
    ends = [c.keep(14, name=f"end_{name}") for name in "xy"]  # where what has begun ends
    with c.m.If(decides & starts):
        c.m.d.sync += [end.eq(each) for end, each in zip(ends, numbers, strict=True)]
    with c.m.If(c.rst):
        c.m.d.sync += [end.eq(0) for end in ends]
    c.implication("off-the-wall", "Nothing goes off the wall.",
                  when=goes_on & asked & job[1],
                  then=(ends[0] <= dut.width) & (ends[1] >= dut.top) & (ends[1] <= dut.height))
    c.implication("replies", "Any other is answered, by what is not right first.",
                  when=goes_on & c.past(decides & ~starts & ~wakes),
                  then=replies & (reply == c.past(refusal)))
    c.implication("replies-only-so", "No answer is to nothing.", when=goes_on & replies
                  & ~c.past(replies), then=c.past((decides & ~starts & ~wakes)
                                                  | (state("WAKE") & dut.renewed)))
    c.implication("replies-to-power", "After a sleep the answer comes with the reset.",
                  when=goes_on & c.past(state("WAKE") & dut.renewed),
                  then=replies & (reply == _Text.POWERED))
    c.implication("shown", "What is shown is the state that was asked for.",
                  when=goes_on & c.past(decides & tells_state),
                  then=c.signal("shown") == c.past(Array(dut.states)[x[:2]]))
    c.invariant("wake", "Power ends a sleep by a reset.", dut.wake == (decides & wakes),
                cover=dut.wake)
    c.invariant("power", "Motors get power by that command, or with the reset that it began.",
                dut.power == ((decides & powers & ~sleeping) | (state("WAKE") & dut.renewed)),
                cover=dut.power)
    c.implication("waits-for-the-reset", "It waits for that.",
                  when=known & c.past(state("WAKE") | dut.wake), then=state("WAKE"))

    # What has begun
    told = c.signal("tells") & c.past(~c.signal("tells"))
    c.implication("own", "An answer belongs to the line of a command until that is answered.",
                  when=known & c.past(dut.own), then=dut.own == c.past(~dut.answered))
    c.implication("own-of-commands", "And to no other.", when=dut.own, then=asked)
    c.invariant("lifts", "The pen is off while a command goes to a start point.",
                dut.lifts == ((job == _Job.GO) & (phase != _Phase.NONE)), cover=asked)
    c.implication("reset-ends-what-began", "A reset ends what a command began.",
                  when=goes_on & c.past(dut.renewed),
                  then=~dut.own & ~dut.pen & ~ready & ((phase == _Phase.NONE)
                                                       | (phase == _Phase.END)))
    c.implication("refused-keeps-its-start", "A line that is refused keeps the start point.",
                  when=goes_on & ~c.past(dut.renewed) & c.past(
                      (asked & (~dut.answered | dut.refused))
                      | ((phase == _Phase.END) & (c.signal("outcome") == _Text.REFUSED))),
                  then=ready == c.past(ready))
    if dut.bowed:
        learns = _bowed(c, dut, asked, job, ends)
    else:
        learns = asked & (job == _Job.DRAW)
        _straight(c, dut, asked, job, phase, goes_on)
    c.invariant("draws-from-a-start", "It draws only from a start point where it arrived.",
                ~(goes_on & ready & c.past(~ready)) | c.past(
                    (phase == _Phase.END) & (c.signal("outcome") == _Text.AT_START)),
                cover=asked)
    c.implication("in-this-order", "It is asked, settles, moves, and what became of it is said.",
                  when=known & (phase != c.past(phase)), then=Mux(
                      phase == _Phase.ASKED, c.past(phase == _Phase.NONE), Mux(
                          phase == _Phase.SETTLE, c.past(asked), Mux(
                              phase == _Phase.MOVE, c.past(phase == _Phase.SETTLE), Mux(
                                  phase == _Phase.END, c.past(asked | (phase == _Phase.MOVE)),
                                  c.past(phase == _Phase.END))))))
    c.implication("says-its-end", "What became of it is said.",
                  when=goes_on & (phase == _Phase.NONE) & c.past(phase != _Phase.NONE),
                  then=told & (c.signal("event") == c.past(c.signal("outcome"))))
    c.implication("refused", "A line that is refused has begun nothing.",
                  when=known & c.past(asked & dut.answered & dut.refused),
                  then=(phase == _Phase.END) & (c.signal("outcome") == _Text.REFUSED))
    moves = _moves(c, dut, asked, job, phase)
    homes, rests = dut.stage != HomingStage.NONE, dut.stage == HomingStage.REST
    one, two = (dut.stage == stage for stage in (HomingStage.FIRST, HomingStage.SECOND))
    motor = (moves & ~learns) | homes
    draws = (job == _Job.DRAW) & (asked | (phase == _Phase.SETTLE) | (phase == _Phase.MOVE))
    c.invariant("states", "The states are those of the thesis.", Cat(
        dut.states[0] == Cat(dut.powered, homes, dut.homed, moves & ~homes,
                             ready & (phase == _Phase.NONE), draws),
        dut.states[1] == Cat(dut.powered, one | two, dut.homed | rests | two, motor, learns,
                             dut.pen),
        dut.states[2] == Cat(dut.powered, two, dut.homed | rests, motor, learns,
                             dut.pen)).all(), cover=dut.own)

    # What it says
    said = c.keep(1, name="said")  # part of a line
    with c.m.If(says.valid & says.ready):
        c.m.d.sync += said.eq(says.payload != ord("\n"))
    with c.m.If(c.rst):
        c.m.d.sync += said.eq(0)
    if short:
        c.implication("stable-until-ready", "A byte that is offered stays until it is taken.",
                      when=goes_on & c.past(says.valid & ~says.ready) & ~dut.fault,
                      then=says.valid & (says.payload == c.past(says.payload)))
        c.implication("whole-lines", "Between texts a whole line is said, or nothing of one.",
                      when=speak("REST", "PIECE", "GIVE", "NUMBER", "WRITE", "END"), then=~said)
        sends, sent, number = (c.kept[name] for name in ("text_sends", "text_sent", "text"))
        c.invariant("texts", "Texts are those of what is said, and end a line.", Cat(
            ~speak("REPLY", "TELL") | ~sends | (number == Mux(speak("TELL"), c.signal("event"),
                                                              reply)),
            ~speak("REPLY", "TELL") | (said == (sends & sent)),
            ~replies | (reply <= _Text.SYNTAX_S) | (reply == _Text.STATE),
            ~c.signal("tells") | (c.signal("event") <= _Text.SYNTAX_S),
            c.signal("outcome") <= _Text.SYNTAX_S,
            speak("REPLY", "TELL", "GIVE") | ~sends,
            ~speak("DIGIT") | (said == c.signal("second"))).all(),
            cover=speak("TELL"), lemma=True)
    figure = Mux(c.signal("second"), c.signal("shown")[:4], c.signal("shown")[4:])
    c.implication("figures", "The state is two hexadecimal digits.",
                  when=says.valid & speak("DIGIT"), then=says.payload == Array(
                      b"0123456789ABCDEF")[figure])
    writer = c.part("writer")
    which = c.keep(1, name="which")
    with c.m.If(writer.numbers.valid & writer.numbers.ready):
        c.m.d.sync += which.eq(1)
    with c.m.If(speak("REST")):
        c.m.d.sync += which.eq(0)
    c.implication("goes-there", "A line says where to go: from the upper right corner, y up.",
                  when=writer.numbers.valid, then=writer.numbers.payload == Mux(
                      which, dut.top - ends[1], ends[0] - dut.width))
    _lemmas(c, dut, within, commands, complete, named, waits, begun, owned, which)
    c.leaves_unused_codes("wall_state", fault=dut.fault, shows=~lines.ready & ~dut.power
                          & ~dut.wake)
    c.leaves_unused_codes("speak_state", fault=dut.fault, shows=~says.valid)


def _straight(c: Contract, dut: WallDialect, asked: Bits, job: Bits, phase: Bits, goes_on: Bits
              ) -> None:
    """State when a line is drawn that is a jog."""
    # A pen that draws is too far from power-up for a cover: the bench has it.
    c.invariant("pen-after-its-line", "The pen is on when the line of what it draws is "
                "answered without an error.", ~(dut.pen & c.past(~dut.pen)) | (
                    goes_on & (job == _Job.DRAW) & c.past(asked & dut.answered & ~dut.refused)),
                cover=asked)
    c.invariant("pen-while-it-draws", "It is on only while it draws.", ~dut.pen | (
        (job == _Job.DRAW) & ((phase == _Phase.SETTLE) | (phase == _Phase.MOVE))), cover=asked)
    c.invariant("pen-off", "When nothing moves any more it is off.",
                ~c.past((phase == _Phase.MOVE) & ~dut.moving) | ~dut.pen, cover=asked)


def _bowed(c: Contract, dut: WallDialect, asked: Bits, job: Bits, ends: list) -> Bits:
    """State when a line is drawn that is bowed; give that the motors learn their speeds."""
    draws = job == _Job.DRAW
    c.assume(~dut.drawing | (asked & draws))  # a reset and an answer end it
    c.invariant("bows", "A bowed line is asked for until its line is answered.",
                dut.bows == (asked & draws), cover=asked)
    c.invariant("ends-there", "It ends where the command says.",
                ~dut.bows | Cat(a == b for a, b in zip(dut.end, ends, strict=True)).all(),
                cover=asked)
    c.invariant("pen-while-motors-draw", "The pen is on while the motors draw a line.",
                dut.pen == dut.drawing, cover=asked)
    drew = c.keep(1, name="drew")
    c.m.d.sync += drew.eq(asked & (drew | dut.drawing) & ~c.rst)
    c.invariant("drawn", "It is kept that the motors have drawn.", c.signal("drawn") == drew,
                cover=asked, lemma=True)
    return asked & draws & ~dut.drawing & ~drew


def _choose(values) -> Bits:
    result: Bits = Value.cast(0)
    for condition, value in values:
        result = Mux(condition, value, result)
    return result


def _moves(c: Contract, dut: WallDialect, asked: Bits, job: Bits, phase: Bits) -> Bits:
    going = asked | (phase == _Phase.SETTLE) | (phase == _Phase.MOVE)
    return dut.moving | (going & ((job == _Job.GO) | (job == _Job.DRAW)))


def _lemmas(c: Contract, dut: WallDialect, within: Bits, commands: Bits, complete: Bits,
            named: Bits, waits: Bits, begun: Bits, owned: Bits, which: Bits) -> None:
    """State how registers and states belong together."""
    state, speak = c.state("wall_state"), c.state("speak_state")
    phase, sends, lost = c.signal("phase"), c.signal("sends"), c.signal("lost")
    asked = phase == _Phase.ASKED
    gives = speak("PIECE", "GIVE", "NUMBER", "WRITE", "END") & ~lost
    c.invariant("lines", "States of lines are those of what was taken.", Cat(
        (state("LETTER", "DIGITS") == (within & commands)),
        state("PASS") == (within & ~commands),
        ~state("LETTER") | ~named, ~state("DIGITS") | named,
        state("ACT") == complete,
        c.signal("waits") == (waits & ~asked),
        ~state("PASS") | ~(asked | waits), ~begun | asked | state("PASS"),
        ~begun | (owned == asked), ~state("PASS") | begun).all(), cover=state("ACT"), lemma=True)
    c.invariant("own-lines", "A line of a command is sent while its answer is to come.", Cat(
        asked | ~(sends | gives), ~sends | speak("REST", "REPLY", "TELL", "DIGIT", "RETURN",
                                                 "FEED") | lost,
        ~asked | Cat(sends, gives, waits).any(), ~(sends & waits), ~(gives & waits),
        ~begun | ~asked | gives, ~(sends & begun & asked), ~(sends & gives)).all(),
        cover=gives, lemma=True)
    c.invariant("phases", "Of phases there are five.", phase <= _Phase.END.value,
                cover=asked, lemma=True)
    replies, tells = c.signal("replies"), c.signal("tells")
    c.invariant("said", "What is being said waits to be said.", Cat(
        ~speak("REPLY", "DIGIT", "RETURN", "FEED") | replies, ~speak("TELL") | tells,
        ~speak("DIGIT", "RETURN", "FEED") | (c.signal("reply") == _Text.STATE),
        ~speak("REPLY") | (c.signal("reply") != _Text.STATE),
        ~state("WAKE") | ~replies).all(), cover=tells, lemma=True)
    letter = c.kept["letter"]
    c.invariant("kept", "What a command says is kept.", Cat(
        *(c.signal(f"target_{name}") == c.kept[f"end_{name}"] for name in "xy"),
        ~state("LETTER", "DIGITS", "ACT") | Cat(
            state("LETTER") | (c.signal("letter") == letter),
            c.signal("digits") == c.kept["count"],
            c.signal("wrong") == c.kept["bad"], c.signal("x") == c.kept["number_x"],
            c.signal("y") == c.kept["number_y"]).all(),
        ~state("LETTER") | (letter == 0),
        ~state("ACT") | (c.signal("damaged")
                         == (c.kept["status"] != LineEnd.GOOD.value))).all(),
        cover=state("DIGITS"), lemma=True)
    piece, rests = c.signal("piece"), ~c.kept.get("writes", 0)
    if not isinstance(c.part("writer"), Unknown):
        writer = c.state("writer.writer_state")
        rests = writer("REST")
        c.invariant("writer", "The writer is as it shall be.",
                    ~writer("FAULT") & ~writer.is_unused(), cover=writer("DIGIT"), lemma=True)
    jogs = speak("PIECE", "GIVE") & (piece == _Text.LINE_Y)
    c.invariant("numbers", "The second number follows the first.",
                Cat(~speak("PIECE", "GIVE", "NUMBER") | (which == c.signal("second")),
                    ~speak("WRITE") | which, ~jogs | which,
                    speak("WRITE") | rests).all(), cover=which, lemma=True)


def _assume_parts(c: Contract) -> None:
    """Let texts of two bytes, CR and LF, and parts of lines of one come, and numbers of any."""
    for path in ("texts", "writer"):
        c.unknown(path)
    texts, writer = c.part("texts"), c.part("writer")
    sends, sent = c.keep(1, name="text_sends"), c.keep(1, name="text_sent")
    number = c.keep(5, name="text")
    said = number <= _Text.SYNTAX_S
    given = texts.bytes.valid & texts.bytes.ready
    with c.m.If(texts.numbers.valid & texts.numbers.ready):
        c.m.d.sync += [sends.eq(1), sent.eq(0), number.eq(texts.numbers.payload)]
    with c.m.Elif(given):
        c.m.d.sync += [sends.eq(said & ~sent), sent.eq(1)]
    c.assume(texts.numbers.ready == ~sends)
    c.assume(texts.bytes.valid == (sends & c.past(sends)))
    c.assume(texts.bytes.payload == Mux(~said, ord("F"), Mux(sent, ord("\n"), ord("\r"))))
    writes = c.keep(1, name="writes")
    ends = c.free(1, name="number_ends")
    with c.m.If(writer.numbers.valid & writer.numbers.ready):
        c.m.d.sync += writes.eq(1)
    with c.m.Elif(writer.bytes.valid & writer.bytes.ready & ends):
        c.m.d.sync += writes.eq(0)
    c.assume((writer.numbers.ready == ~writes) & ~writer.fault & (writes | ~writer.bytes.valid))
    with c.m.If(c.rst):
        c.m.d.sync += [sends.eq(0), writes.eq(0)]


class _Brief(WallDialect):
    """Without what has texts and writes numbers, and it waits less."""

    def elaborate(self, platform) -> Module:
        def instead(real):
            return lambda *values, **parameters: Unknown(real(*values, **parameters))

        with (patch.dict(vars(wall_dialect), {
                name: instead(getattr(wall_dialect, name))
                for name in ("TextSource", "DecimalWriter")}),
              patch.object(wall_dialect, "SETTLE", 1)):
            return super().elaborate(platform)


def make(*, brief: bool = False, **parameters) -> WallDialect:
    """Make it, or without what is long."""
    return (_Brief if brief else WallDialect)(**parameters)


FEW = {"width": 3, "top": 0, "height": 4, "feed": 5, "brief": True}

WALL_DIALECT = Component(
    make=make, describe=describe, depth=34,
    cases=(Case(VPlotterSettings().wall, real=True),  # first, as benches have it
           Case(FEW), Case({**FEW, "bowed": True}), Case(FEW, upset=True)))
