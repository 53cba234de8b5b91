"""Lines of G-code to words."""

from amaranth import Cat, Module, Mux, Signal, unsigned
from amaranth.lib import data, enum, stream, wiring
from amaranth.lib.wiring import In, Out

from .fixed_point import FixedPoint, fixed_point_format, fixed_point_layout
from .line import LineEnd, LineItem

__all__ = ["GCodeKind", "GCodeReader", "GCodeStatus", "gcode_layout"]


CHARACTER = data.StructLayout({"byte": 8, **dict.fromkeys(
    ("end", "digit", "point", "sign", "dollar", "letter", "opens", "closes", "semicolon",
     "skipped"), 1)})
"""An item of a line, in upper case, and what it is."""


class GCodeKind(enum.Enum, shape=unsigned(2)):
    """Kind of an item."""

    WORD = 0
    CHARACTER = 1  # of a system line
    END = 2  # of a line


class GCodeStatus(enum.Enum, shape=unsigned(6)):
    """Status of a line, given at its end: the error with which it is answered, or 0.

    Those between NO_NUMBER and DAMAGED, and the last, are of `GCodeGate`.
    """

    GOOD = 0
    NO_LETTER = 1  # another character stands where a letter must
    NO_NUMBER = 2  # no number follows a letter
    UNSUPPORTED = 3  # a system command, or a setting, that is not known
    NEGATIVE = 4  # a setting that is too low
    NO_HOMING = 5  # homing is not enabled
    NOT_IDLE = 8  # a system command that has to wait until nothing moves
    LOCKED = 9  # G-code during an alarm
    NEEDS_HOMING = 10  # soft limits without homing
    DAMAGED = 11  # bytes were lost or damaged; GRBL's error of a line that is too long
    TOO_FAST = 12  # the drivers cannot make the highest speed
    DOOR_OPEN = 13  # homing, or the end of an alarm, with the door open
    TEXT_TOO_LONG = 14  # what is to be stored has too many characters
    TOO_LARGE = 38  # a setting that is too high


def gcode_layout(width: int) -> data.StructLayout:
    """Return the layout of an item whose values have `width` bits.

    =========  ========================================================================
    member     is
    =========  ========================================================================
    kind       a `GCodeKind`
    status     of an END: that of the line, a `GCodeStatus`
    system     the line begins with ``$``
    character  of a CHARACTER: itself; of a WORD: its letter, or the character before it
    number     of a WORD, see :func:`fixed_point_layout`
    =========  ========================================================================
    """
    return data.StructLayout({"kind": GCodeKind, "status": GCodeStatus, "system": 1,
                              "character": 8, "number": fixed_point_layout(width)})


class GCodeReader(wiring.Component):
    """Reads lines of G-code: gives each word as it comes, and the end of each line.

    A word is a letter and a number: digits, with or without a sign before them and a point
    anywhere. Blanks, control characters and ``/`` are skipped, also within a number, and so are
    comments: from ``(`` to the first ``)`` or the end of the line, and from ``;`` to the end of the
    line. Lower case is converted to upper case. After the first error of a line its words are
    skipped. So an error of a word that was given comes before that of the line. Each line, an empty
    one too, gives one END.

    A line that begins with ``$`` is for a system command: each of its characters is an item, and
    none is an error. A number that follows a character which is no part of a number is, when it has
    ended, an item as well, a WORD of that character: ``$100=2.5`` has the words $ 100 and = 2.5,
    whose values have half as many decimals. Behind ``$J=``, ``$N0=`` and ``$N1=`` the line is read
    as words, with their errors.

    A byte takes three clocks. A word is offered four clocks after the byte that ends it was taken,
    and a clock later for each decimal that its number lacks and for a minus sign; that byte is read
    after it. An END is offered three clocks after it was taken, and a CHARACTER four, if nothing is
    before it. While an item waits nothing is read, and one byte more is taken.

    Parameters
    ----------
    width, decimals : int
        Bits and decimals of the value of a number, see :class:`FixedPoint`.

    Members
    -------
    items : In(stream.Signature(LineItem))
        Lines.
    words : Out(stream.Signature)
        What they say, see :func:`gcode_layout`.
    seen, character : Out(1), Out(8)
        A character that is neither skipped nor in a comment is read, in upper case, in this clock:
        when the items of those before it have been taken.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, width: int = 44, decimals: int = 6) -> None:
        self.width, self.decimals = fixed_point_format(width, decimals)
        super().__init__({
            "items": In(stream.Signature(LineItem)),
            "words": Out(stream.Signature(gcode_layout(width))),
            "seen": Out(1), "character": Out(8),
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.number = number = FixedPoint(width=self.width, decimals=self.decimals)

        out = self.words.p
        finishing = Signal()  # a number has ended
        digits = Signal()  # it has a digit
        passing = Signal()  # a character will be an item, when its digit is added
        idle = Signal()
        ends = Signal()  # the item that is held ends a number
        judges = Signal()  # what it is stands in registers
        taken = Signal()  # and it does not
        held, char = self._hold(m, taken)

        expects = Signal()  # a number follows, or goes on
        begun = Signal()  # it has a sign, a digit or a point
        point = Signal()
        numeric = Signal()
        visible = Signal()
        begins = Signal()  # a number, a clock after its letter was judged
        m.d.sync += begins.eq(0)
        is_numeric = expects & (char.digit | (char.point & ~point) | (char.sign & ~begun))
        is_visible = self._visible(m, char, taken)
        m.d.sync += [numeric.eq(is_numeric), visible.eq(is_visible),
                     ends.eq(digits & (char.end | (is_visible & ~is_numeric))),
                     judges.eq(held & idle & ~judges)]
        m.d.comb += [
            idle.eq(~self.words.valid & ~finishing & ~passing),
            taken.eq(judges & ~ends),
            number.digit.eq(char.byte[:4]),
            number.take.eq(taken & visible & numeric & char.digit),
            number.decimal.eq(point),
            number.finish.eq(finishing), number.clear.eq(begins),
            out.number.eq(number.number),
            self.seen.eq(taken & visible), self.character.eq(char.byte),
        ]
        with m.If(taken & visible & numeric):
            m.d.sync += [begun.eq(1), point.eq(point | char.point), digits.eq(digits | char.digit)]
            with m.If(char.sign):
                m.d.sync += number.negative.eq(char.byte == ord("-"))
        self._read_line(m, begins, char, taken, visible, numeric, expects, passing,
                        number.short)
        letter = Signal(8)
        with m.If(begins):
            m.d.sync += [expects.eq(1), begun.eq(0), point.eq(0), number.negative.eq(0),
                         letter.eq(char.byte)]
        with m.If(judges & ends):
            m.d.sync += finishing.eq(1)
        with m.If(number.done):
            m.d.sync += [finishing.eq(0), expects.eq(0), digits.eq(0), self.words.valid.eq(1),
                         out.kind.eq(GCodeKind.WORD), out.character.eq(letter)]

        return m

    def _hold(self, m: Module, taken):
        """Hold an item, classified; return whether there is one, and it."""
        held = Signal()
        char = Signal(CHARACTER)
        byte, end = self.items.p.byte, self.items.p.end

        def among(first: str, last: str):
            return ~end & (byte >= ord(first)) & (byte <= ord(last))

        m.d.comb += self.items.ready.eq(~held)
        with m.If(taken):
            m.d.sync += held.eq(0)
        with m.If(self.items.valid & self.items.ready):
            m.d.sync += [
                held.eq(1), char.byte.eq(Mux(among("a", "z"), byte & 0xDF, byte)), char.end.eq(end),
                char.digit.eq(among("0", "9")), char.point.eq(among(".", ".")),
                char.sign.eq(among("+", "+") | among("-", "-")), char.dollar.eq(among("$", "$")),
                char.letter.eq(among("A", "Z") | among("a", "z")), char.opens.eq(among("(", "(")),
                char.closes.eq(among(")", ")")), char.semicolon.eq(among(";", ";")),
                char.skipped.eq(end | among("\0", " ") | among("/", "/") | among("(", "(")
                                | among(";", ";")),
            ]
        return held, char

    def _visible(self, m: Module, char, taken):
        """Return whether a byte is neither skipped nor in a comment."""
        parenthesis = Signal()  # in a comment
        rest = Signal()  # in one to the end of the line
        with m.If(taken):
            m.d.sync += [
                parenthesis.eq(~char.end & Mux(parenthesis, ~char.closes, char.opens & ~rest)),
                rest.eq(~char.end & (rest | (char.semicolon & ~parenthesis))),
            ]
        return ~(parenthesis | rest | char.skipped)

    def _read_line(self, m: Module, begins: Signal, char, taken, visible, numeric, expects,
                   passing, raw: Signal) -> None:
        """Judge the characters of a line, and offer its items other than words."""
        out, byte = self.words.p, char.byte
        line_begun = Signal()  # it has a character
        # How far it is of $J=, $N0= or $N1=: nothing, $, all but the =, $N, all of it
        place = Signal(3)
        bad = out.status != GCodeStatus.GOOD
        m.d.comb += raw.eq(Mux(line_begun, out.system & (place != 4), char.dollar))

        with m.If(self.words.valid & self.words.ready):
            m.d.sync += self.words.valid.eq(0)
            with m.If(out.kind == GCodeKind.END):
                m.d.sync += [out.status.eq(GCodeStatus.GOOD), out.system.eq(0), line_begun.eq(0),
                             place.eq(0), expects.eq(0)]
        with m.If(passing):
            m.d.sync += [passing.eq(0), self.words.valid.eq(1)]
        with m.If(taken & char.end):
            m.d.sync += [self.words.valid.eq(1), out.kind.eq(GCodeKind.END)]
            with m.If(~bad & (byte != LineEnd.GOOD)):
                m.d.sync += out.status.eq(GCodeStatus.DAMAGED)
            with m.Elif(expects & ~raw):
                m.d.sync += out.status.eq(GCodeStatus.NO_NUMBER)
        with m.Elif(taken & visible & raw):
            m.d.sync += [passing.eq(1), out.kind.eq(GCodeKind.CHARACTER), out.character.eq(byte),
                         out.system.eq(1), line_begun.eq(1), place.eq(0), expects.eq(numeric)]
            with m.If(~line_begun):
                m.d.sync += place.eq(1)
            for at, expected, following in (
                    (1, b"J", 2), (1, b"N", 3), (3, b"01", 2), (2, b"=", 4)):
                with m.If((place == at) & Cat(byte == each for each in expected).any()):
                    m.d.sync += place.eq(following)
            # Behind the whole prefix comes a letter, not a number.
            m.d.sync += begins.eq(~numeric & ~((place == 2) & (byte == ord("="))))
        with m.Elif(taken & visible & ~bad & ~numeric):
            m.d.sync += [line_begun.eq(1), expects.eq(0)]
            with m.If(expects):
                m.d.sync += out.status.eq(GCodeStatus.NO_NUMBER)
            with m.Elif(char.letter):
                m.d.sync += begins.eq(1)
            with m.Else():
                m.d.sync += out.status.eq(GCodeStatus.NO_LETTER)
