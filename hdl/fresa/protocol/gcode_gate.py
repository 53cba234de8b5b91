"""Lines for the system: those of a G-code machine that do not reach its interpreter."""

from collections.abc import Sequence

from amaranth import Cat, Module, Mux, Signal, Value
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..fsm import leave_unused_codes
from .fixed_point import WHOLE
from .gcode_coordinates import Operand
from .gcode_lister import LISTED, GCodeList, GCodeText
from .gcode_reader import GCodeKind, GCodeStatus, gcode_layout
from .gcode_settings import SETTING_BITS, SETTINGS, GCodeSetting

__all__ = ["COMMANDS", "GCodeGate"]

LISTS = {"": GCodeList.HELP, "G": GCodeList.MODES, "#": GCodeList.COORDINATES,
         "I": GCodeList.BUILD, "N": GCodeList.STARTUP}
"""Lines of lists, behind their ``$``."""

JOG = "J="
"""What begins a jog, behind its ``$``: the rest is words of G-code."""

STORES = ("N0=", "N1=", "I=")
"""What begins a line whose rest is stored, behind its ``$``: the first two bring G-code."""

HOMING = {"H": 3, "HX": 0, "HY": 1, "HZ": 2}
"""Lines of homing cycles, behind their ``$``: of all axes, and of one."""

COMMANDS = ("X", *HOMING, "$", "C", "SLP", "RST=$", "RST=#", "RST=*", JOG, *LISTS, *STORES)
"""System lines that are a text of their own, behind their ``$``, or begin so."""

ANY_TIME, AT_REST = "$GCXJ", "#HSIRN"
"""What is behind the ``$`` of lines that are refused also while it moves, and of others that need
no number there."""

NO_SETTING = 255
"""A number that no setting may have: it stands for those that are larger."""


class GCodeGate(wiring.Component):
    """Carries out system lines, refuses lines while the machine is locked, and passes the others.

    A line that is not passed is passed as an empty one whose end has its error as status, so that
    lines are answered by one part, in their order. An error of the reader comes first. System lines
    are

    ==========  ================================  ===============================================
    line        does                              is refused
    ==========  ================================  ===============================================
    $X          unlocks                           with 13 during an alarm with the door open
    $ $G        list what there is, and modes
    $C          begins check mode, or ends it     with 8 unless at rest and not locked, or checking
                with a reset
    $$          lists all settings                with 8 unless at rest, checking or jogging
    $# $I $N    list coordinates, the build, and  with 8 unless at rest
                lines run at a start
    $H          carries out a homing cycle, of    with 5 if $22 is 0, 13 with the door open, 8
    $HX HY HZ   all axes or of one                unless at rest
    $SLP        sleeps                            with 8 unless at rest
    $RST=$ # *  make settings, coordinates, or    with 8 unless at rest
                both what they were at power-up,
                with a reset
    $J=words    passes them, as a jog             with 8 unless at rest and not locked, or jogging
    $N0=words   passes them, and has them kept    with 8 unless at rest and not locked, 14 if too
    $N1=words   if they are accepted              long
    $I=text     has it kept                       with 8 unless at rest, 14 if too long
    $n=value    changes a setting                 with 8 unless at rest; see below
    ==========  ================================  ===============================================

    and any other with 8 unless at rest, or with 2 if no number is where one has to be, or with 3.
    But one that begins as one of the first, or as ``$$``, ``$C`` or ``$J``, is not refused with 8.
    Settings are refused, and stay as they were: with 3 if there is none of that number, 4 if the
    value is too low, 38 if it is too high, or not whole where it has to be, 10 for soft limits
    without homing, and 12 if the drivers could not make the highest speed. A value is rounded to
    thousandths. Without homing, $22=0, there are no soft limits.

    A line of G-code is refused with 9 during an alarm, in sleep, and while a jog is made, whatever
    is wrong with it, unless bytes of it are lost. It is judged by what the machine does when its
    end comes; its words are passed on before, and only the end makes them a line. So nothing of it
    is done either way. An empty line is never refused. A system line is judged when all lines
    before it are answered, and it is done before its end is passed; but a reset and sleep begin
    when it is answered, and what is stored is kept then. Words and end of a jog are passed as items
    of the system; those of a line that is stored are as of a line of G-code, as all other ends are.

    Parameters
    ----------
    width : int
        Bits of values, those of the words.
    settings : sequence of GCodeSetting
        Those of the store, $20 and $22 among them.
    stores : bool
        It has lines that are stored; otherwise they are refused with 3.
    homes_one : bool
        It homes single axes; otherwise that is refused with 3.

    Members
    -------
    words, passed : In(stream.Signature), Out(stream.Signature)
        Items of lines, see :func:`gcode_layout`.
    answered, accepted : In(1), In(1)
        A line that was passed is answered, for one clock, and that without an error.
    slot, writing, keep : Out(2), Out(1), Out(1)
        The text that a line brings, 1 to 3 for $N0, $N1 and $I, until it is answered, and 0 for
        none; its characters come; it is to be kept, for one clock, that of the answer.
    too_long : In(1)
        It has too many characters.
    locked : In(1)
        Alarm, or sleep.
    jogging : In(1)
        A jog is made, or planned.
    resting : In(1)
        Nothing moves, or will by lines that are answered, and it is in IDLE or ALARM.
    stopped : In(1)
        Nothing moves until a reset: ``$X``, ``$H`` and ``$SLP`` are refused.
    door : In(1)
        The door is open.
    waiting : In(1)
        The last line that did anything is one for which GRBL waits before it answers. So a system
        line waits here until it is at rest; but not while it is locked or in check mode.
    settling : In(1)
        What was done before is not complete: `resting` says nothing yet.
    unlock : Out(1)
        ``$X``. For one clock, in which its end is passed.
    checking : Out(1)
        Check mode: lines are to be checked, and nothing done.
    sleep, restart : Out(1)
        Sleep; reset. For one clock, that of the answer.
    restoring, restoring_texts : Out(1), Out(1)
        Settings or coordinates have become what they were at power-up, for one clock; the texts
        are to, in that of the answer.
    erase, erase_address : Out(1), Out(6)
        Make the word of an `Operand` 0.
    listing, list, all_listed : Out(1), Out(GCodeList), In(1)
        Begin a list, one clock; which; it is through, one clock.
    home, homes, homed : Out(1), Out(2), In(1)
        Begin a homing cycle, one clock; of which axis, or of all, 3; it is through, one clock.
    address, value : Out(6), In(27)
        The store of settings, for reading, see :class:`GCodeSettingStore`; ``address`` is a
        register.
    number, decimal, least, most, initial : In(8), In(1), In(1), In(27), In(27)
        What is known of the setting at ``write_address``, two clocks later.
    write_address, data, trial, write : Out(6), Out(27), Out(1), Out(1)
        For writing.
    configure, configured, refused : Out(1), In(1), In(1)
        Take all settings, until ``configured``, in which clock they are ``refused`` or not.
    listed : Out(stream.Signature(LISTED))
        Settings, a line each.
    fault : Out(1)
        The state register was upset. Stays until reset.

    Raises
    ------
    ValueError
        If ``width`` is out of range, or a setting is missing.
    """

    def __init__(self, *, width: int = 44, settings: Sequence[GCodeSetting] = SETTINGS,
                 stores: bool = True, homes_one: bool = True) -> None:
        self.width = in_range("width", width, 8, 64)
        numbers = [each.number for each in settings]
        for number in 20, 22:
            if number not in numbers:
                raise ValueError(f"there must be a setting ${number}")
        self.settings = tuple(settings)
        self.soft, self.homing = numbers.index(20), numbers.index(22)
        without = [*STORES] * (not stores) + [*HOMING][1:] * (not homes_one)
        self.commands = tuple(each for each in COMMANDS if each not in without)
        index = range(len(settings))
        super().__init__({
            "words": In(stream.Signature(gcode_layout(width))),
            "passed": Out(stream.Signature(gcode_layout(width))),
            "answered": In(1), "accepted": In(1), "slot": Out(2), "writing": Out(1),
            "keep": Out(1), "too_long": In(1), "locked": In(1), "jogging": In(1), "resting": In(1),
            "settling": In(1), "waiting": In(1), "stopped": In(1), "door": In(1),
            "unlock": Out(1), "checking": Out(1), "sleep": Out(1), "restart": Out(1),
            "restoring": Out(1), "restoring_texts": Out(1), "erase": Out(1),
            "erase_address": Out(6), "listing": Out(1), "list": Out(GCodeList),
            "all_listed": In(1), "home": Out(1), "homes": Out(2, init=3), "homed": In(1),
            "address": Out(index), "value": In(SETTING_BITS), "number": In(8), "decimal": In(1),
            "least": In(1), "most": In(SETTING_BITS), "initial": In(SETTING_BITS),
            "write_address": Out(index), "data": Out(SETTING_BITS), "trial": Out(1),
            "write": Out(1), "configure": Out(1), "configured": In(1), "refused": In(1),
            "listed": Out(stream.Signature(LISTED)), "fault": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        item, passed = self.words.p, self.passed.p
        ends, taken = Signal(), Signal()
        stalls = Signal()  # a system line, until one that brings a text is answered
        line, known, jog, stored = self._line(m, ends, taken, stalls)
        lists = Cat(known[each] for each in LISTS)
        homes = Cat(known[each] for each in HOMING if each in known)
        for each, axis in HOMING.items():
            if each in known:
                with m.If(known[each]):
                    m.d.comb += self.homes.eq(axis)
        restores_settings = known["RST=$"] | known["RST=*"]
        restores = restores_settings | known["RST=#"]
        restarts = Signal()  # when it is answered
        sleeps = Signal()  # likewise
        restores_texts = Signal()  # likewise
        m.d.comb += [self.restart.eq(self.answered & restarts),
                     self.sleep.eq(self.answered & sleeps),
                     self.restoring_texts.eq(self.answered & restores_texts)]
        with m.If(self.answered):
            m.d.sync += [restarts.eq(0), sleeps.eq(0), restores_texts.eq(0)]
        for each, which in LISTS.items():
            with m.If(known[each]):
                m.d.comb += self.list.eq(which)
        filled = Signal()  # the line has a word
        open_ = Signal()  # a line is not answered
        status = Signal(GCodeStatus)  # of a system line
        done = Signal()  # it has its status
        waits = Signal()  # for that
        swallowed = Signal()
        number = Signal(2)  # of the text that the line brings
        stores = Signal.like(number)  # that of the line that is to be answered
        good = item.status == GCodeStatus.GOOD
        other = ~(Cat(known.values()).any() | line.sets)
        m.d.comb += [
            ends.eq(item.kind == GCodeKind.END),
            swallowed.eq(item.system & ~ends & ~((jog | stored[:2].any())
                                                 & (item.kind == GCodeKind.WORD))),
            stalls.eq(item.system & ~ends & stores.any()),
            self.writing.eq(stored.any()),
            number.eq(Mux(stored[2], 3, stored)), self.slot.eq(stores | number),
            self.keep.eq(self.answered & self.accepted & stores.any()),
            waits.eq(item.system & ends & good & ~done),
            taken.eq(self.words.valid & self.words.ready),
            passed.eq(item), passed.system.eq(item.system & jog),
            self.passed.valid.eq(self.words.valid & ~swallowed & ~waits & ~stalls),
            self.words.ready.eq((self.passed.ready | swallowed) & ~waits & ~stalls),
            self.unlock.eq(taken & ends & done & known["X"] & (status == GCodeStatus.GOOD)),
        ]
        with m.If(ends & item.system & good):
            m.d.comb += passed.status.eq(status)
        with m.If(ends & ~item.system & (item.status != GCodeStatus.DAMAGED)
                  & (self.locked | self.jogging) & (filled | ~good)):
            m.d.comb += passed.status.eq(GCodeStatus.LOCKED)
        with m.If(self.answered):
            m.d.sync += [open_.eq(0), stores.eq(0)]
        with m.If(taken):
            m.d.sync += filled.eq(~ends)
            with m.If(ends):
                m.d.sync += [done.eq(0), open_.eq(1)]
                with m.If(self.writing & (passed.status == GCodeStatus.GOOD)):
                    m.d.sync += stores.eq(self.slot)

        index = Signal(range(len(self.settings) + 1))  # of a setting; `address` follows it
        count = Signal(range(Operand.POSITION + 1))
        changed = Signal(SETTING_BITS)
        is_it = Signal()  # the setting of the number that the line has
        zero = Signal()  # the value of the clock before was 0
        above, below = Signal(), Signal()  # its limits
        m.d.sync += [zero.eq(self.value == 0), above.eq(changed > self.most),
                     below.eq(changed < self.least), self.address.eq(index)]
        m.d.comb += [
            self.write_address.eq(index), self.data.eq(changed),
            self.erase_address.eq(count),
            self.listed.p.code.eq(self.number), self.listed.p.value.eq(self.value),
            self.listed.p.text.eq(Mux(self.decimal, GCodeText.DECIMAL_SETTING,
                                      GCodeText.WHOLE_SETTING)),
            self.listed.p.ends.eq(1),
        ]

        def answer(code: GCodeStatus) -> None:
            m.d.sync += [status.eq(code), done.eq(1)]
            m.next = "PASS"

        with m.FSM(name="gate_state") as fsm:
            with m.State("PASS"):
                m.d.sync += index.eq(0)
                with m.If(self.words.valid & waits & ~open_ & ~self.settling):
                    m.next = "JUDGE"
            with m.State("JUDGE"):
                with m.If(self.settling | (self.waiting & ~self.resting & ~self.locked
                                           & ~self.checking)):
                    m.next = "PASS"
                with m.Else():
                    with m.If(known["X"] & ~self.stopped):
                        answer(Mux(self.locked & self.door, GCodeStatus.DOOR_OPEN,
                                   GCodeStatus.GOOD))
                    with m.Elif(known[""] | known["G"]):
                        m.next = "BEGIN_LIST"
                    with m.Elif(known["C"] & self.checking):
                        m.d.sync += [self.checking.eq(0), restarts.eq(1)]
                        answer(GCodeStatus.GOOD)
                    with m.Elif(known[JOG]):
                        answer(Mux(self.jogging | (self.resting & ~self.locked),
                                   GCodeStatus.GOOD, GCodeStatus.NOT_IDLE))
                    with m.Elif(stored.any()):
                        answer(GCodeStatus.GOOD)
                        with m.If(self.too_long):
                            answer(GCodeStatus.TEXT_TOO_LONG)
                        with m.If(~self.resting | (self.locked & stored[:2].any())):
                            answer(GCodeStatus.NOT_IDLE)
                    with m.Elif(other & (self.resting | line.any_time)):
                        answer(Mux(line.unread, GCodeStatus.NO_NUMBER, GCodeStatus.UNSUPPORTED))
                    with m.Elif(~(self.resting | (known["$"] & (self.checking | self.jogging)))
                                | ((known["X"] | homes.any() | known["SLP"]) & self.stopped)
                                | (known["C"] & self.locked)):
                        answer(GCodeStatus.NOT_IDLE)
                    with m.Elif(known["C"]):
                        m.d.sync += self.checking.eq(1)
                        answer(GCodeStatus.GOOD)
                    with m.Elif(known["SLP"]):
                        m.d.sync += sleeps.eq(1)
                        answer(GCodeStatus.GOOD)
                    with m.Elif(homes.any()):
                        m.d.sync += self.address.eq(self.homing)
                        m.next = "ASK"
                    with m.Elif(lists.any()):
                        m.next = "BEGIN_LIST"
                    with m.Elif(restores):
                        m.d.sync += count.eq(Operand.SYSTEM)
                        m.next = "ERASE"
                        with m.If(restores_settings):
                            m.next = "RENEW"
                    with m.Else():
                        m.next = "READ"

            with m.State("BEGIN_LIST"):
                m.d.comb += self.listing.eq(1)
                m.next = "LIST_ALL"
            with m.State("LIST_ALL"):
                with m.If(self.all_listed):
                    answer(GCodeStatus.GOOD)

            # Settings and coordinates as they were at power-up
            with m.State("RENEW"):
                m.next = "ADDRESS_INITIAL"
            with m.State("ADDRESS_INITIAL"):
                m.next = "READ_INITIAL"
            with m.State("READ_INITIAL"):
                m.d.sync += changed.eq(self.initial)
                m.next = "WRITE_INITIAL"
            with m.State("WRITE_INITIAL"):
                m.d.comb += self.write.eq(1)
                m.d.sync += index.eq(index + 1)
                m.next = "RENEW"
                with m.If(index == len(self.settings) - 1):
                    m.next = "RESTORED"
                    with m.If(known["RST=*"]):
                        m.next = "ERASE"
            with m.State("ERASE"):
                m.d.comb += self.erase.eq(1)
                m.d.sync += count.eq(count + 1)
                with m.If(count == Operand.POSITION - 1):
                    m.next = "RESTORED"
            with m.State("RESTORED"):
                m.d.comb += self.restoring.eq(1)
                m.d.sync += [restarts.eq(1), restores_texts.eq(known["RST=*"])]
                answer(GCodeStatus.GOOD)

            # A homing cycle, if it is allowed: $22 is read.
            with m.State("ASK"):
                m.next = "COMPARE"
            with m.State("COMPARE"):
                m.next = "HOME"
            with m.State("HOME"):
                with m.If(zero):
                    answer(GCodeStatus.NO_HOMING)
                with m.Elif(self.door):
                    answer(GCodeStatus.DOOR_OPEN)
                with m.Else():
                    m.d.comb += self.home.eq(1)
                    m.next = "HOMING"
            with m.State("HOMING"):
                with m.If(self.homed):
                    answer(GCodeStatus.GOOD)

            # Settings, one after the other: to be listed, or for the one of that number.
            with m.State("READ"):
                m.next = "ADDRESS"
                with m.If(index == len(self.settings)):
                    answer(Mux(known["$"], GCodeStatus.GOOD, GCodeStatus.UNSUPPORTED))
            with m.State("ADDRESS"):
                m.next = "MATCH"
                with m.If(known["$"]):
                    m.next = "LIST"
            with m.State("MATCH"):
                m.d.sync += [is_it.eq(line.number == self.number),
                             changed.eq(Mux(self.decimal, line.value, line.whole))]
                m.next = "FOUND"
            with m.State("LIST"):
                m.d.comb += self.listed.valid.eq(1)
                with m.If(self.listed.ready):
                    m.d.sync += index.eq(index + 1)
                    m.next = "READ"
            with m.State("FOUND"):
                m.next = "COMPARE_LIMITS"
                with m.If(~is_it):
                    m.d.sync += index.eq(index + 1)
                    m.next = "READ"
                with m.Elif(line.negative):
                    answer(GCodeStatus.NEGATIVE)
                with m.Elif(line.overflow | ~(self.decimal | line.integer)):
                    answer(GCodeStatus.TOO_LARGE)
            with m.State("COMPARE_LIMITS"):
                m.next = "CHECK"
            with m.State("CHECK"):
                m.d.sync += self.address.eq(self.homing)
                m.next = "NEEDS"
                with m.If(above):
                    answer(GCodeStatus.TOO_LARGE)
                with m.Elif(below):
                    answer(GCodeStatus.NEGATIVE)

            # Soft limits need homing; then all is computed as if it were so.
            with m.State("NEEDS"):
                m.next = "LOOK"
            with m.State("LOOK"):
                m.next = "HAS"
            with m.State("HAS"):
                m.next = "CONFIGURE"
                with m.If((index == self.soft) & (changed != 0) & zero):
                    answer(GCodeStatus.NEEDS_HOMING)
            with m.State("CONFIGURE"):
                m.d.comb += self.configure.eq(1)
                with m.If(self.configured):
                    m.next = "WRITE"
                    with m.If(self.refused):
                        m.next = "RESTORE"
                    with m.Elif((index == self.homing) & (changed == 0)):
                        m.d.sync += index.eq(self.soft)
                        m.next = "DISABLE"
            with m.State("DISABLE"):
                m.d.comb += self.write.eq(1)
                m.d.sync += index.eq(self.homing)
                m.next = "WRITE"
            with m.State("WRITE"):
                m.d.comb += self.write.eq(1)
                answer(GCodeStatus.GOOD)
            with m.State("RESTORE"):
                m.d.comb += self.configure.eq(1)
                with m.If(self.configured):
                    answer(GCodeStatus.TOO_FAST)

            with m.State("FAULT"):
                pass
        m.d.sync += self.trial.eq(fsm.ongoing("CONFIGURE"))  # long before the first is read
        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))
        return m

    def _line(self, m: Module, ends: Signal, taken: Signal, stalls: Signal
              ) -> tuple[Signal, dict[str, Value], Value, Value]:
        """Read a system line: its number and its value, and which of `COMMANDS` it is.

        That it is a jog is also returned at once, for words of it follow; and so is which of
        `STORES` it is.
        """
        item = self.words.p
        number = item.number
        line = Signal(data.StructLayout({
            "sets": 1, "number": 8, "value": SETTING_BITS, "whole": WHOLE,
            "negative": 1, "overflow": 1, "integer": 1,
            # Of a line that is none: it may be judged at any time; a number is not there
            "any_time": 1, "unread": 1}))
        # How far a setting is: nothing, $, digits, =, a number; or something else
        place = Signal(3)
        # What the line is so far, if a command begins so: each is the one before it, and one more
        # character.
        now: dict[str, Value] = {each: Signal(name=f"begun_{number}")
                                 for number, each in enumerate(_prefixes(self.commands))}
        stored = Signal(len(STORES))
        m.d.comb += stored.eq(Cat(now.get(command, 0) for command in STORES))
        character = item.character
        digit = (character >= ord("0")) & (character <= ord("9"))
        numeric = digit | Cat(character == ord(each) for each in "+-.").any()
        with m.If(taken & ends):
            m.d.sync += [place.eq(0), line.sets.eq(0), *(each.eq(0) for each in now.values())]
        # Such an item is taken, or a word that waits, which is none of those below.
        with m.If(self.words.valid & item.system & ~ends & ~stalls):
            with m.If(stored.any()):
                pass  # what follows is no part of a command
            with m.Elif(item.kind == GCodeKind.CHARACTER):
                m.d.sync += [place.eq(5), line.sets.eq(0), *(
                    known.eq(now[text[:-1]] & (character == ord(text[-1])) if text else place == 0)
                    for text, known in now.items())]
                with m.Switch(place):
                    with m.Case(0):
                        m.d.sync += place.eq(1)
                    with m.Case(1):
                        any_time, others = (Cat(character == ord(each) for each in letters).any()
                                            for letters in (ANY_TIME, AT_REST))
                        m.d.sync += [line.any_time.eq(any_time),
                                     line.unread.eq(~(any_time | others | numeric))]
                        with m.If(digit):
                            m.d.sync += place.eq(2)
                    with m.Case(2):
                        with m.If(digit):
                            m.d.sync += place.eq(2)
                        with m.If(character == ord("=")):
                            m.d.sync += [place.eq(3), line.unread.eq(1)]
                    with m.Case(3, 4):
                        with m.If(numeric & ~line.sets):
                            m.d.sync += [place.eq(4), line.unread.eq(0)]
            with m.Elif(place == 2):  # the number has ended
                m.d.sync += line.number.eq(Mux(number.whole[8:].any(), NO_SETTING, number.whole))
            with m.Elif((place == 4) & (character == ord("="))):
                m.d.sync += [
                    line.sets.eq(1), line.value.eq(number.value), line.whole.eq(number.whole),
                    line.negative.eq(number.value[-1] & ~number.overflow),
                    line.overflow.eq(number.overflow | number.whole.all()
                                     | number.value[SETTING_BITS:].any()),
                    line.integer.eq(number.integer),
                ]
        return line, {command: now[command] for command in self.commands}, now[JOG], stored


def _prefixes(commands: Sequence[str]) -> list[str]:
    """Return all texts with which commands begin, those of one command after the other."""
    return list(dict.fromkeys(command[:length] for command in commands
                              for length in range(len(command) + 1)))
