"""The commands of the G-code firmware of a thesis, as words that an interpreter of GRBL's takes."""

from amaranth import Cat, Module, Mux, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..fsm import leave_unused_codes
from .gcode_reader import GCodeKind, GCodeStatus, gcode_layout

__all__ = ["ThesisDialect"]

G_CODES = (0, 1, 2, 3, 4, 28, 90, 91, 92)
M_CODES = (0, 3, 5)
"""Those that the firmware has."""

HOME = b"$H"
UNKNOWN = ord("A")
"""A letter that no word has."""


class ThesisDialect(wiring.Component):
    """Passes lines of the thesis' dialect on as lines of GRBL's that do what they mean.

    =============  ================================================================================
    word           becomes
    =============  ================================================================================
    G28            ``$H``, once `resting`; it has to be the only word of its line
    P, ms          P, in s, rounded towards zero
    G, M           the same, if it is one of the firmware, otherwise a letter that is unknown
    =============  ================================================================================

    A line that moves has M3 in addition, unless it has M3 or M5: the firmware has the motors
    on from then on, until M5. A line with G92 and no axis has X0 Y0 Z0 in addition: where the tool
    is becomes the origin. System lines stay as they are. An item is offered in the clock in which
    it comes, and a P ``width`` clocks later.

    Parameters
    ----------
    width : int
        Bits of values.

    Members
    -------
    words, passed : In(stream.Signature), Out(stream.Signature)
        Items of lines, see :func:`gcode_layout`.
    answered : In(1)
        A line that was passed is answered, for one clock.
    resting : In(1)
        Nothing moves, or will by lines that are answered.
    fault : Out(1)
        The state register was upset. Stays until reset.

    Raises
    ------
    ValueError
        If ``width`` is out of range.
    """

    def __init__(self, *, width: int = 44) -> None:
        self.width = in_range("width", width, 8, 64)
        super().__init__({
            "words": In(stream.Signature(gcode_layout(width))),
            "passed": Out(stream.Signature(gcode_layout(width))),
            "answered": In(1), "resting": In(1), "fault": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        item, number, out = self.words.p, self.words.p.number, self.passed.p
        begun = Signal()  # the line has a word
        homes = Signal()  # the first is G28
        moves = Signal()  # it has an axis
        shifts = Signal()  # G92
        powers = Signal()  # M3 or M5
        open_ = Signal()  # a line is not answered
        word, ends = Signal(), Signal()

        def code(letter: str, codes: tuple[int, ...]):
            return (item.character == ord(letter)) & Cat(
                number.whole == each for each in codes).any()

        known = Signal()
        plain = Signal()  # a whole number that is not below 0
        first_home = Signal()
        milliseconds = Signal()
        m.d.comb += [
            word.eq((item.kind == GCodeKind.WORD) & ~item.system),
            ends.eq(item.kind == GCodeKind.END),
            plain.eq(number.integer & ~number.overflow & ~number.value[-1]),
            known.eq(~homes & Mux((item.character == ord("G")) | (item.character == ord("M")),
                                  plain & (code("G", G_CODES) | code("M", M_CODES))
                                  & ~code("G", (28,)), 1)),
            first_home.eq(word & ~begun & plain & code("G", (28,))),
            milliseconds.eq(word & (item.character == ord("P")) & ~number.overflow
                            & ~number.value[-1]),
        ]
        goes_home = ends & homes & (item.status == GCodeStatus.GOOD)
        adds = ends & moves & ~shifts & ~powers & (item.status == GCodeStatus.GOOD)
        places = ends & shifts & ~moves & (item.status == GCodeStatus.GOOD)
        wrong = Signal()  # a word behind G28: the line is no longer one that homes

        value = Signal(self.width - 1)  # and then, from below, its quotient
        rest = Signal(range(2000))
        left = Signal(range(2000))
        fits = Signal()
        count = Signal(range(self.width))
        m.d.comb += [left.eq(Cat(value[-1], rest)), fits.eq(left >= 1000), out.eq(item)]
        taken = self.words.valid & self.words.ready
        with m.If(self.answered):
            m.d.sync += open_.eq(0)
        with m.If(self.passed.valid & self.passed.ready & (out.kind == GCodeKind.END)):
            m.d.sync += open_.eq(1)
        with m.If(taken & ends):
            m.d.sync += [begun.eq(0), homes.eq(0), moves.eq(0), shifts.eq(0), powers.eq(0),
                         wrong.eq(0)]
        with m.Elif(taken & word):
            m.d.sync += [
                begun.eq(1), homes.eq(homes | first_home), wrong.eq(homes),
                moves.eq(moves | Cat(item.character == ord(axis) for axis in "XYZ").any()),
                shifts.eq(shifts | code("G", (92,))), powers.eq(powers | code("M", (3, 5))),
            ]

        def give(character: int) -> None:
            m.d.comb += [self.passed.valid.eq(1), out.kind.eq(GCodeKind.CHARACTER),
                         out.system.eq(1), out.character.eq(character)]

        def add(letter: str, whole: int, then: str) -> None:
            m.d.comb += [
                self.passed.valid.eq(1), out.kind.eq(GCodeKind.WORD),
                out.character.eq(ord(letter)), out.number.value.eq(whole * 1_000_000),
                out.number.whole.eq(whole), out.number.hundredths.eq(0), out.number.exact.eq(1),
                out.number.integer.eq(1), out.number.overflow.eq(0),
            ]
            with m.If(self.passed.ready):
                m.next = then

        with m.FSM(name="thesis_state") as fsm:
            with m.State("PASS"):
                m.d.comb += [self.passed.valid.eq(self.words.valid),
                             self.words.ready.eq(self.passed.ready)]
                m.d.sync += [value.eq(number.value), rest.eq(0), count.eq(self.width - 2)]
                with m.If(word & ~known & ~first_home):
                    m.d.comb += out.character.eq(UNKNOWN)
                with m.If(first_home):
                    m.d.comb += [self.passed.valid.eq(0), self.words.ready.eq(1)]
                with m.Elif(self.words.valid & milliseconds & known):
                    m.d.comb += [self.passed.valid.eq(0), self.words.ready.eq(0)]
                    m.next = "DIVIDE"
                with m.Elif(self.words.valid & goes_home & ~wrong):
                    m.d.comb += [self.passed.valid.eq(0), self.words.ready.eq(0)]
                    m.next = "WAIT"
                with m.Elif(self.words.valid & adds & ~wrong):
                    m.d.comb += [self.passed.valid.eq(0), self.words.ready.eq(0)]
                    m.next = "ADD"
                with m.Elif(self.words.valid & places & ~wrong):
                    m.d.comb += [self.passed.valid.eq(0), self.words.ready.eq(0)]
                    m.next = "ADD_X"
            with m.State("DIVIDE"):
                m.d.sync += [value.eq(Cat(fits, value)), rest.eq(Mux(fits, left - 1000, left)),
                             count.eq(count - 1)]
                with m.If(count == 0):
                    m.next = "GIVE"
            with m.State("GIVE"):
                m.d.comb += [self.passed.valid.eq(1), out.number.value.eq(value),
                             self.words.ready.eq(self.passed.ready)]
                with m.If(self.passed.ready):
                    m.next = "PASS"
            with m.State("ADD"):
                add("M", 3, "END")
            with m.State("ADD_X"):
                add("X", 0, "ADD_Y")
            with m.State("ADD_Y"):
                add("Y", 0, "ADD_Z")
            with m.State("ADD_Z"):
                add("Z", 0, "END")
            with m.State("WAIT"):
                with m.If(self.resting & ~open_):
                    m.next = "DOLLAR"
            with m.State("DOLLAR"):
                give(HOME[0])
                with m.If(self.passed.ready):
                    m.next = "H"
            with m.State("H"):
                give(HOME[1])
                with m.If(self.passed.ready):
                    m.next = "END"
            with m.State("END"):
                m.d.comb += [self.passed.valid.eq(1), out.system.eq(item.system | homes),
                             self.words.ready.eq(self.passed.ready)]
                with m.If(self.passed.ready):
                    m.next = "PASS"
            with m.State("FAULT"):
                pass
        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))
        return m
