"""Values of a line of G-code to nm and nm/s."""

from amaranth import Cat, Module, Mux, Signal, signed, unsigned
from amaranth.lib import data, enum, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..choice import add_choice, look_up
from ..fsm import leave_unused_codes
from .gcode_modes import LETTERS, GCodeLineState

__all__ = ["GCodeDivision", "GCodeUnit", "UnitConverter"]

PER_ONE = 1_000_000
"""Units of a number in 1."""


class GCodeUnit(enum.Enum, shape=unsigned(2)):
    """What a word is divided by for a list, which `DIVISORS` has."""

    LENGTH = 0
    ONE = 1
    FEED = 2
    INVERSE = 3  # the feed in G93


DIVISORS = {GCodeUnit.LENGTH: (1000, 2540), GCodeUnit.ONE: (PER_ONE, PER_ONE),
            GCodeUnit.FEED: (50_000, 127_000), GCodeUnit.INVERSE: (PER_ONE, PER_ONE // 10)}
"""Units of a word in one that is listed, without and with inches: in 1 um and 1/10000 inch; of a
number in 1; a third of the 10**-6 nm a minute in 1 mm and 1/10 inch; of a number in 1 and 1/10."""

NOTHING, WORD, MINUS_WORD, ALL_ONES = range(4)
"""What is added to the number when it is doubled: the last makes all its bits 1."""

ONCE, THRICE, MULTIPLE = 1, 2, 7
"""How often a word is added to the double of what is there: it counts once, 3, and 127 times."""


class GCodeDivision(data.Struct):
    """A division for a list."""

    unit: GCodeUnit
    inches: unsigned(1)
    nearest: unsigned(1)  # round to that, half away from zero; else towards 0


class UnitConverter(wiring.Component):
    """Converts the values of a line in their memory, one after the other, to nm and nm/s.

    Lengths in inches are multiplied by 127 and divided by 5, rounded half away from zero. A feed is
    divided by 60, towards zero, but is at least 1 if it was not 0, and at most ``2**speed - 1``; it
    is not negative. A centre that is not given becomes 0. One divider serves all, a bit of the
    quotient a clock: a conversion takes ``width + 21`` clocks, but to nm/s ``width + 15``, a letter
    without one takes one.

    Between two lines it divides words for lists, which takes up to ``width + 14`` clocks.

    Parameters
    ----------
    width : int
        Bits of values.
    reach : int
        Bits of a length, with its sign.
    speed : int
        Bits of a feed.

    Members
    -------
    run : In(1)
        Convert; stays 1 until the clock with ``done`` or ``too_long``.
    line : In(GCodeLineState)
        The line; constant while ``run`` is 1.
    was_inverse : In(1)
        The mode before the line was one of feed in motions per minute: its F is in mm.
    address : Out(4)
        Of the value, in the order of `LETTERS`.
    word : In(signed(width))
        The value there, two clocks later.
    write : Out(1)
        Store ``data`` at ``address``.
    data : Out(signed(width))
        The converted value.
    done : Out(1)
        All are converted.
    too_long : Out(1)
        A length has more than ``reach`` bits. What is stored then is of no use.
    divide : In(1)
        Divide ``word``, as it is two clocks later and stays, while ``run`` is 0; stays 1 until the
        quotient was used.
    division : In(GCodeDivision)
        By what; constant while ``divide`` is 1. A word that is rounded towards 0 is not negative.
    divided : Out(1)
        ``data`` is the quotient, until ``divide`` is 0; two clocks later it is 0.
    fault : Out(1)
        The state register was upset. Stays until reset.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, width: int = 44, reach: int = 36, speed: int = 31) -> None:
        self.width = in_range("width", width, 4, 64)
        self.reach = in_range("reach", reach, 2, width)
        self.speed = in_range("speed", speed, 2, width - 1)
        super().__init__({
            "run": In(1), "line": In(GCodeLineState), "was_inverse": In(1), "address": Out(4),
            "word": In(signed(width)), "write": Out(1), "data": Out(signed(width)),
            "done": Out(1), "too_long": Out(1), "divide": In(1), "division": In(GCodeDivision),
            "divided": Out(1), "fault": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        modes = self.line.modes
        bits = self.width + 7
        letter = Signal(range(len(LETTERS) + 1))
        minutes = Signal()  # F is in nm per minute
        lists = Signal()  # a word is divided for a list
        is_feed = letter == LETTERS.index("F")
        is_length = Signal()
        is_offset = Signal()
        with m.Switch(letter):
            for index, name in enumerate(LETTERS):
                if name in "IJKRXYZ":
                    with m.Case(index):
                        m.d.comb += [is_length.eq(1), is_offset.eq(name in "IJK")]
        given = self.line.letters.bit_select(letter, 1)
        wanted = given & Mux(is_feed, ~modes.inverse, is_length & modes.inches)

        # The number is doubled each clock, and one adder does all by what is added then: first the
        # word without its sign, so often that it counts as often as it should; then nothing, while
        # the bits of that leave above, and those of the quotient come from below, inverted if the
        # word is negative. They are one more than the quotient has: with 1 added to them all but
        # the last are rounded half away from zero, as -n is ~n + 1. What is added is chosen a clock
        # before.
        number = Signal(bits)
        negative = Signal()
        added = Signal(2, init=ALL_ONES)
        carry = Signal(init=1)
        below = Signal()  # the bit that comes from there
        keeps, limits = Signal(), Signal()
        word, doubled, addend = Signal(bits), Signal(bits), Signal(bits)
        m.d.comb += [
            self.address.eq(letter), self.data.eq(number[1:]), word.eq(self.word),
            doubled.eq(Cat(below, number)),
            addend.eq(Mux(added[1], Mux(added[0], ~doubled, ~word), Mux(added[0], word, 0))),
        ]
        m.d.sync += [added.eq(ALL_ONES), carry.eq(1)]
        with m.If(~keeps):
            m.d.sync += number.eq(add_choice(doubled, addend, carry))
        with m.If(limits):
            m.d.sync += number[self.speed + 1:].eq(0)

        # What is left is below 0 if the divisor did not fit: then it is added the next time.
        size = PER_ONE.bit_length()
        rest = Signal(size + 1)
        fits = rest[-1] == 0
        divisors = [each[inches] for inches in range(2) for each in DIVISORS.values()]
        divisor = Signal(size + 1)
        m.d.comb += divisor.eq(look_up(
            [5, 60] + [0] * 6 + divisors,
            Cat(Mux(lists, self.division.unit.as_value(), minutes),
                lists & self.division.inches, lists), size))
        m.d.sync += rest.eq(add_choice(Cat(number[-1], rest[:-1]),
                                       divisor ^ fits.replicate(size + 1), fits))
        with m.If(added != NOTHING):
            m.d.sync += rest.eq(0)
        divides = Signal()  # `fits` is a bit of the quotient
        some = Signal()  # one that came before was 1
        was_some = Signal()  # a bit of what is divided was 1
        least = Signal()  # make the quotient 1
        beyond = Signal()  # it has too many bits
        m.d.comb += below.eq((divides & (fits ^ negative)) | least)
        m.d.sync += [divides.eq(added == NOTHING), some.eq(divides & (some | fits)),
                     was_some.eq(divides & (was_some | number[-1])), least.eq(0)]
        # Those that load are at the end of the range, in which nothing else is.
        count = Signal((bits + 8).bit_length())
        end = 1 << len(count)

        with m.FSM(name="converter_state") as fsm:
            with m.State("SELECT"):
                m.d.sync += lists.eq(self.divide)
                with m.If(self.divide):
                    m.next = "FETCH"
                with m.Elif(self.run):
                    with m.If(letter == len(LETTERS)):
                        m.d.comb += self.done.eq(1)
                        m.d.sync += letter.eq(0)
                    with m.Elif(wanted):
                        m.d.sync += [
                            minutes.eq(minutes | (is_feed & ~(modes.inches & ~self.was_inverse))),
                            beyond.eq(beyond & minutes)]
                        m.next = "FETCH"
                    with m.Else():
                        m.d.sync += letter.eq(letter + 1)
                        with m.If(is_offset & ~given):
                            m.d.comb += [self.write.eq(1), self.data.eq(0)]
            with m.State("FETCH"):
                m.next = "SIGN"
            with m.State("SIGN"):
                m.d.sync += [negative.eq(self.word[-1]), carry.eq(self.word[-1]),
                             added.eq(Mux(self.word[-1], MINUS_WORD, WORD)),
                             count.eq(end - ONCE)]
                with m.If(lists):
                    with m.If(self.division.unit == GCodeUnit.FEED):
                        m.d.sync += count.eq(end - THRICE)
                with m.Elif(~minutes):
                    m.d.sync += count.eq(end - MULTIPLE)
                m.next = "DIVIDE"
            with m.State("DIVIDE"):
                m.d.sync += [count.eq(count + 1), added.eq(NOTHING), carry.eq(0)]
                with m.If(count[3:].all() & ~count[:3].all()):
                    m.d.sync += [added.eq(added), carry.eq(carry)]
                with m.If(count == Mux(is_length, bits + 2 - self.reach, Mux(
                        minutes, bits + 1 - self.speed, bits + 2 - self.width))):
                    m.d.sync += beyond.eq(beyond | some)
                with m.If(count == bits):
                    m.d.sync += carry.eq(Mux(lists, self.division.nearest, ~minutes))
                    with m.If(minutes & was_some & ~(some | fits)):
                        m.d.sync += [least.eq(1), carry.eq(1)]
                    m.next = "ROUND"
            with m.State("ROUND"):
                m.d.sync += carry.eq(0)
                m.next = "LIMIT"
                with m.If(lists):
                    m.next = "LISTED"
            with m.State("LIMIT"):
                m.d.comb += [limits.eq(minutes & beyond), keeps.eq(~limits)]
                m.next = "STORE"
            with m.State("STORE"):
                m.d.comb += [keeps.eq(1), self.write.eq(1)]
                m.d.sync += minutes.eq(is_feed & ~minutes)
                m.next = "SELECT"
                with m.If(~is_feed | minutes):
                    m.d.sync += letter.eq(letter + 1)
                with m.If(is_length & beyond):
                    m.d.comb += self.too_long.eq(1)
                    m.d.sync += letter.eq(0)
            with m.State("LISTED"):
                m.d.comb += [keeps.eq(1), self.divided.eq(1)]
                with m.If(~self.divide):
                    m.next = "SELECT"
            with m.State("FAULT"):
                pass
        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))
        return m
