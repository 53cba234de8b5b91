"""Values of a line of G-code to nm and nm/s."""

from amaranth import Cat, Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..choice import ALL_ONES, choice_code, choose
from ..fsm import leave_unused_codes
from .gcode_modes import LETTERS, GCodeLineState

__all__ = ["UnitConverter"]

DOUBLE, MULTIPLE = choice_code(0), choice_code(1)


class UnitConverter(wiring.Component):
    """Converts the values of a line in their memory, one after the other, to nm and nm/s.

    Lengths in inches are multiplied by 127 and divided by 5, rounded half away from zero. A feed is
    divided by 60, towards zero, but is at least 1 if it was not 0, and at most
    ``2**speed - 1``. A centre that is not given becomes 0. One divider serves all, a bit of the
    quotient a clock: a conversion takes ``width + 15`` clocks, a letter without one takes one.

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
        A length has more than ``reach`` bits.
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
            "done": Out(1), "too_long": Out(1), "fault": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        modes = self.line.modes
        bits = self.width + 7
        letter = Signal(range(len(LETTERS) + 1))
        minutes = Signal()  # F is in nm per minute
        # What is too large becomes all ones, as far as a feed reaches, and so does a reset.
        number = Signal(bits, init=(1 << self.speed) - 1)
        rest = Signal(6)
        negative = Signal()
        some = Signal()  # a digit of the quotient is 1
        # One is beyond the bits of a value, of a length, or of a feed.
        too_large, long, too_fast = (Signal(name=name) for name in ("too_large", "long",
                                                                    "too_fast"))
        beyond = Signal()  # a length has too many bits
        count = Signal(range(bits))
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

        remainder = Signal(7)
        divisor = Mux(minutes, 60, 5)
        m.d.comb += remainder.eq(Cat(number[-1], rest))
        fits = remainder >= divisor
        # One adder does all, by what it is to add: it doubles, and it negates, as -n is ~(n - 1),
        # and multiplies by 127, as ~(n - 128 n). That is chosen a clock before; it adds 0 if
        # nothing is. The 2 rounds: no half is ever left.
        added = Signal(2)
        total, multiple = Signal(bits), Signal(bits)
        loads, divides, limits = Signal(), Signal(), Signal()
        m.d.comb += [
            self.address.eq(letter), self.data.eq(number),
            multiple.eq(~((number << 7) | 2)),
            total.eq(number + choose([number, multiple], added, bits)),
        ]
        m.d.sync += [
            added.eq(0),
            number.eq(Mux(loads, self.word, total ^ added[1].replicate(bits))),
        ]
        with m.If(divides):
            m.d.sync += [number[0].eq(fits), some.eq(some | fits)]
        for reach, reaches in ((self.width - 1, too_large), (self.reach - 1, long),
                               (self.speed, too_fast)):
            with m.If(count == bits - reach):
                m.d.sync += reaches.eq(some)
        with m.If(limits & minutes & ~some):
            m.d.sync += number[0].eq(rest.any())
        with m.If(limits & ~minutes & too_large):
            m.d.sync += number[self.speed:].eq(-1)
        with m.If(limits & Mux(minutes, too_fast, too_large)):
            m.d.sync += number[:self.speed].eq(-1)
        with m.If(limits & minutes):
            m.d.sync += number[self.speed:].eq(0)
        with m.If(limits):
            m.d.sync += number[self.width - 1:].eq(0)

        with m.FSM(name="converter_state") as fsm:
            with m.State("SELECT"):
                with m.If(self.run):
                    with m.If(letter == len(LETTERS)):
                        m.d.comb += self.done.eq(1)
                        m.d.sync += letter.eq(0)
                    with m.Elif(wanted):
                        m.d.sync += minutes.eq(
                            minutes | (is_feed & ~(modes.inches & ~self.was_inverse)))
                        m.next = "FETCH"
                    with m.Else():
                        m.d.sync += letter.eq(letter + 1)
                        with m.If(is_offset & ~given):
                            m.d.comb += [self.write.eq(1), self.data.eq(0)]
            with m.State("FETCH"):
                m.next = "LOAD"
            with m.State("LOAD"):
                m.d.comb += loads.eq(1)
                m.d.sync += negative.eq(self.word[-1])
                with m.If(self.word[-1]):
                    m.d.sync += added.eq(ALL_ONES)
                m.next = "SIGN"
            with m.State("SIGN"):
                with m.If(~minutes):
                    m.d.sync += added.eq(MULTIPLE)
                m.next = "MULTIPLY"
            with m.State("MULTIPLY"):
                m.d.sync += [rest.eq(0), count.eq(0), some.eq(0), added.eq(DOUBLE)]
                m.next = "DIVIDE"
            with m.State("DIVIDE"):
                m.d.comb += divides.eq(1)
                m.d.sync += [rest.eq(Mux(fits, remainder - divisor, remainder)),
                             count.eq(count + 1), added.eq(DOUBLE)]
                with m.If(count == bits - 1):
                    m.d.sync += added.eq(0)
                    m.next = "LIMIT"
            with m.State("LIMIT"):
                m.d.comb += limits.eq(1)
                with m.If(negative):
                    m.d.sync += added.eq(ALL_ONES)
                m.next = "NEGATE"
            with m.State("NEGATE"):
                m.d.sync += beyond.eq(is_length & long)
                m.next = "STORE"
            with m.State("STORE"):
                m.d.comb += self.write.eq(1)
                m.d.sync += minutes.eq(is_feed & ~minutes)
                m.next = "SELECT"
                with m.If(~is_feed | minutes):
                    m.d.sync += letter.eq(letter + 1)
                with m.If(beyond):
                    m.d.comb += self.too_long.eq(1)
                    m.d.sync += letter.eq(0)
            with m.State("FAULT"):
                pass
        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))
        return m
