"""Lists of a G-code machine: modes, coordinates, what it is and what it understands."""

from amaranth import Array, Cat, Const, Module, Mux, Signal, signed, unsigned
from amaranth.lib import data, enum, stream, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..fsm import leave_unused_codes
from .gcode_coordinates import Operand
from .gcode_modes import GCodeModes, GCodeMotion
from .gcode_settings import SETTING_BITS

__all__ = ["LISTED", "GCodeList", "GCodeLister", "GCodeText"]

LISTED_BITS = SETTING_BITS + 1
"""Bits of a value, with its sign: a setting, or a position in um, which reaches to 34 m."""


class GCodeList(enum.Enum, shape=unsigned(3)):
    """A list."""

    HELP = 0  # $
    MODES = 1  # $G
    COORDINATES = 2  # $#
    BUILD = 3  # $I
    STARTUP = 4  # $N


class GCodeText(enum.Enum, shape=unsigned(4)):
    """What a part of a list says, around its numbers."""

    HELP = 0
    BUILD = 1
    STARTUP = 2
    MOTION = 3
    G = 4
    M = 5
    TOOL = 6
    FEED = 7
    SPEED = 8
    COORDINATES = 9
    AXIS = 10
    LAST_AXIS = 11
    LENGTH = 12
    PROBED = 13
    WHOLE_SETTING = 14
    DECIMAL_SETTING = 15


LISTED = data.StructLayout({"text": GCodeText, "ends": 1, "code": 8, "value": signed(LISTED_BITS)})
"""A part of a list: a text, whether that ends its line, and the numbers in it."""

SYSTEMS = (*((54 + system, Operand.SYSTEM + 3 * system) for system in range(6)),
           (28, Operand.PREDEFINED), (30, Operand.PREDEFINED + 3), (92, Operand.OFFSET))
"""Coordinates in the order in which they are listed, by their numbers, and where they are."""

MIST = 7
"""Turn of the first word of coolant, among the modes."""

PER_UM, PER_ONE, PER_FEED = 1000, 1_000_000, 50_000
"""Units of a length in 1 um; of a number in 1; and a third of the nm/s of 1000 mm/min."""


class GCodeLister(wiring.Component):
    """Gives lists in parts, each a text and at most two numbers.

    ===========  ============================================================================
    list         parts
    ===========  ============================================================================
    HELP         a text, and so for BUILD and STARTUP
    MODES        motion, coordinate system, plane, units, distance, feed, spindle, coolant (two
                 if mist and flood are on), tool, feed in mm/min or 1/min, speed in rev/min
    COORDINATES  the three axes of G54 to G59, G28, G30 and G92 in um, the length of the tool,
                 and where the probe touched, which is 0: there is no probing
    ===========  ============================================================================

    A number is read by its address and divided serially, rounded half away from zero, but that of
    the tool towards 0. A part is offered two clocks after ``start``, or after the one before was
    taken, and one with such a number ``width`` + 5 clocks later.

    Parameters
    ----------
    width : int
        Bits of words, with their sign.

    Members
    -------
    start : In(1)
        Begin, for one clock, while no list is under way.
    list : In(GCodeList)
        Which, constant until ``done``.
    modes : In(GCodeModes)
        The modes; they and all words are constant until ``done``.
    address, word : Out(6), In(signed(width))
        An `Operand`, and that word a clock later.
    parts : Out(stream.Signature(LISTED))
        The parts.
    done : Out(1)
        All were taken, for one clock.
    fault : Out(1)
        The state register was upset. Stays until reset.

    Raises
    ------
    ValueError
        If ``width`` is out of range.
    """

    def __init__(self, *, width: int = 44) -> None:
        self.width = in_range("width", width, 4, 64)
        super().__init__({
            "start": In(1), "list": In(GCodeList), "modes": In(GCodeModes), "address": Out(6),
            "word": In(signed(self.width)), "parts": Out(stream.Signature(LISTED)),
            "done": Out(1), "fault": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        part = self.parts.p
        turn = Signal(range(MIST + 5))  # which of the modes, or of the coordinates
        axis = Signal(2)
        last = Signal()
        divides = Signal()
        per = Signal(range(PER_ONE + 1))
        mode = Signal(7)  # a number that is no word
        text = Signal(GCodeText)
        value = Signal(signed(LISTED_BITS))
        m.d.comb += [part.text.eq(text), part.value.eq(value)]
        with m.Switch(self.list):
            for each, only in ((GCodeList.HELP, GCodeText.HELP), (GCodeList.BUILD, GCodeText.BUILD),
                               (GCodeList.STARTUP, GCodeText.STARTUP)):
                with m.Case(each):
                    m.d.comb += [text.eq(only), part.ends.eq(1), last.eq(1)]
            with m.Case(GCodeList.MODES):
                self._modes(m, turn, text, mode, divides, per)
                m.d.comb += [last.eq(turn == MIST + 4), part.ends.eq(last)]
            with m.Case(GCodeList.COORDINATES):
                numbers, places = zip(*SYSTEMS, strict=True)
                m.d.comb += [
                    per.eq(PER_UM), divides.eq(1), part.code.eq(Array(numbers)[turn]),
                    self.address.eq(Array(places)[turn] + axis), part.ends.eq(axis == 2),
                    text.eq(Mux(axis == 0, GCodeText.COORDINATES,
                                Mux(axis == 1, GCodeText.AXIS, GCodeText.LAST_AXIS))),
                ]
                with m.If(turn == len(SYSTEMS)):
                    m.d.comb += [text.eq(GCodeText.LENGTH), self.address.eq(Operand.LENGTH),
                                 part.code.eq(0), part.ends.eq(1)]
                with m.If(turn == len(SYSTEMS) + 1):
                    m.d.comb += [text.eq(GCodeText.PROBED), divides.eq(0), part.code.eq(0),
                                 part.ends.eq(1), last.eq(1)]

        # The digits of the quotient come from below as those of the word leave above.
        negative = Signal()
        magnitude = Signal(self.width + 2)
        remainder = Signal(range(2 * PER_ONE))
        count = Signal(range(self.width + 2))
        left, fits = Signal(range(2 * PER_ONE)), Signal()
        rounds = Signal()
        quotient = Signal(LISTED_BITS - 1)
        m.d.comb += [
            left.eq(Cat(magnitude[-1], remainder)), fits.eq(left >= per),
            rounds.eq((Cat(Const(0, 1), remainder) >= per) & (text != GCodeText.TOOL)),
            quotient.eq(magnitude + rounds),
        ]
        size = Signal(self.width)
        m.d.comb += size.eq(Mux(self.word < 0, -self.word, self.word))

        with m.FSM(name="lister_state") as fsm:
            with m.State("IDLE"):
                m.d.sync += [turn.eq(0), axis.eq(0)]
                with m.If(self.start):
                    m.next = "READ"
            with m.State("READ"):
                m.d.sync += value.eq(mode)
                m.next = "OFFER"
                with m.If(divides):
                    m.next = "TAKE"
            with m.State("TAKE"):
                m.d.sync += [negative.eq(self.word < 0), remainder.eq(0), count.eq(self.width + 1),
                             magnitude.eq(size)]
                m.next = "SCALE"
            with m.State("SCALE"):
                with m.If(per == PER_FEED):
                    m.d.sync += magnitude.eq(magnitude + (magnitude << 1))
                m.next = "DIVIDE"
            with m.State("DIVIDE"):
                m.d.sync += [magnitude.eq(Cat(fits, magnitude)), count.eq(count - 1),
                             remainder.eq(Mux(fits, left - per, left))]
                with m.If(count == 0):
                    m.next = "ROUND"
            with m.State("ROUND"):
                m.d.sync += value.eq(Mux(negative, -quotient, quotient))
                m.next = "OFFER"
            with m.State("OFFER"):
                m.d.comb += self.parts.valid.eq(1)
                with m.If(self.parts.ready):
                    m.next = "READ"
                    m.d.sync += turn.eq(turn + 1)
                    with m.If(self.list == GCodeList.COORDINATES):
                        m.d.sync += [turn.eq(turn + part.ends),
                                     axis.eq(Mux(part.ends, 0, axis + 1))]
                    with m.Elif((turn == MIST) & ~(self.modes.mist & self.modes.flood)):
                        m.d.sync += turn.eq(MIST + 2)
                    with m.If(last):
                        m.next = "DONE"
            with m.State("DONE"):
                m.d.comb += self.done.eq(1)
                m.next = "IDLE"
            with m.State("FAULT"):
                pass
        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))
        return m

    def _modes(self, m: Module, turn: Signal, text: Signal, mode: Signal, divides: Signal,
               per: Signal) -> None:
        """Say one of the modes."""
        modes = self.modes
        none = modes.motion == GCodeMotion.NONE
        spindle = Mux(modes.clockwise, 3, Mux(modes.counter_clockwise, 4, 5))
        for number, (name, value) in enumerate([
                (GCodeText.MOTION, Mux(none, 80, modes.motion.as_value())),
                (GCodeText.G, 54 + modes.system), (GCodeText.G, 17 + modes.plane),
                (GCodeText.G, 21 - modes.inches), (GCodeText.G, 90 + modes.relative),
                (GCodeText.G, 94 - modes.inverse), (GCodeText.M, spindle),
                (GCodeText.M, Mux(modes.mist, 7, Mux(modes.flood, 8, 9))), (GCodeText.M, 8)]):
            with m.If(turn == number):
                m.d.comb += [text.eq(name), mode.eq(value)]
        for number, (name, operand) in enumerate([
                (GCodeText.TOOL, Operand.TOOL), (GCodeText.FEED, Operand.FEED),
                (GCodeText.SPEED, Operand.SPEED)], MIST + 2):
            with m.If(turn == number):
                m.d.comb += [text.eq(name), self.address.eq(operand), divides.eq(1),
                             per.eq(PER_ONE)]
        with m.If((text == GCodeText.FEED) & ~modes.inverse):
            m.d.comb += per.eq(PER_FEED)

