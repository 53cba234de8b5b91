"""Lists of a G-code machine: modes, coordinates, what it is and what it understands."""

from amaranth import Cat, Module, Mux, Signal, signed, unsigned
from amaranth.lib import data, enum, stream, wiring
from amaranth.lib.wiring import In, Out

from ..choice import look_up
from ..fsm import leave_unused_codes
from .gcode_coordinates import Operand
from .gcode_modes import GCodeModes, GCodeMotion
from .gcode_settings import SETTING_BITS
from .unit_converter import GCodeDivision, GCodeUnit

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
    PROBED = 5  # the last line of $#


class GCodeText(enum.Enum, shape=unsigned(5)):
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
    RAN_FIRST = 16  # a startup line, and that it was accepted; those below are in this order
    REFUSED_FIRST = 17
    RAN_SECOND = 18
    REFUSED_SECOND = 19
    LAST_PROBED = 20
    PROBE_MOTION = 21


LISTED = data.StructLayout({"text": GCodeText, "ends": 1, "code": 8, "value": signed(LISTED_BITS)})
"""A part of a list: a text, whether that ends its line, and the numbers in it."""

SYSTEMS = (*((54 + system, Operand.SYSTEM + 3 * system) for system in range(6)),
           (28, Operand.PREDEFINED), (30, Operand.PREDEFINED + 3), (92, Operand.OFFSET))
"""Coordinates in the order in which they are listed, by their numbers, and where they are."""

LENGTH, PROBED = len(SYSTEMS), len(SYSTEMS) + 1
"""Turns of what is listed behind them."""

MIST = 7
"""Turn of the first word of coolant, among the modes."""

FEED = MIST + 3
"""Turn of the feed, likewise."""


CHOICE = data.StructLayout({
    "text": GCodeText, "ends": 1, "code": 8, "last": 1, "mode": 7, "divides": 1, "address": 6,
    "unit": GCodeUnit})
"""What a part is: text, end and code of it, whether it is the last, and where its value is from: a
mode, or a word that is divided, by its address."""


class GCodeLister(wiring.Component):
    """Gives lists in parts, each a text and at most two numbers.

    ===========  ============================================================================
    list         parts
    ===========  ============================================================================
    HELP         a text, and so for BUILD and STARTUP
    MODES        motion, coordinate system, plane, units, distance, feed, spindle, coolant (two
                 if mist and flood are on), tool, feed in mm/min or 1/min, speed in rev/min
    COORDINATES  the three axes of G54 to G59, G28, G30 and G92 in um, the length of the tool,
                 and where the probe touched in um, with whether it did in the last probing
    PROBED       only the last of these lines, in three parts, too
    ===========  ============================================================================

    The feed is 0 with ``feed_zero``, whatever its word is.

    With ``inches`` lengths are in 1/10000 inch, and the feed in 1/10 inch/min, or tenths of 1/min.

    A number is that of a word, by its address, divided elsewhere and rounded half away from zero,
    but that of the tool towards 0. A part is offered three clocks after ``start``, or after the one
    before was taken, and one with such a number when it is ``divided``.

    Members
    -------
    start : In(1)
        Begin, for one clock, while no list is under way.
    list : In(GCodeList)
        Which, constant until ``done``.
    modes : In(GCodeModes)
        The modes; they, ``feed_zero``, ``inches``, ``probed`` and all words are constant until
        ``done``.
    feed_zero : In(1)
        No feed holds.
    inches : In(1)
        List in inches.
    probed : In(1)
        The probe has touched in the last probing.
    address : Out(6)
        An `Operand`.
    divide : Out(1)
        Divide that word; stays 1 until its part is taken.
    division : Out(GCodeDivision)
        By what; with ``divide``.
    divided, quotient : In(1), In(signed(LISTED_BITS))
        It is; that stays then until ``divide`` is 0, and two clocks later ``quotient`` is 0.
    parts : Out(stream.Signature(LISTED))
        The parts.
    done : Out(1)
        All were taken, for one clock.
    fault : Out(1)
        The state register was upset. Stays until reset.
    """

    def __init__(self) -> None:
        super().__init__({
            "start": In(1), "list": In(GCodeList), "modes": In(GCodeModes), "feed_zero": In(1),
            "inches": In(1), "probed": In(1), "address": Out(6), "divide": Out(1),
            "division": Out(GCodeDivision), "divided": In(1),
            "quotient": In(signed(LISTED_BITS)),
            "parts": Out(stream.Signature(LISTED)), "done": Out(1), "fault": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        part = self.parts.p
        turn = Signal(range(MIST + 5))  # which of the modes, or of the coordinates
        axis = Signal(2)
        choice = Signal(CHOICE)  # of the next part; `chosen` is that of the present one
        chosen = Signal(CHOICE)
        m.d.comb += [part.text.eq(chosen.text), part.ends.eq(chosen.ends),
                     part.code.eq(chosen.code), self.address.eq(chosen.address),
                     part.value.eq(self.quotient | chosen.mode)]
        with m.Switch(self.list):
            for each, only in ((GCodeList.HELP, GCodeText.HELP), (GCodeList.BUILD, GCodeText.BUILD),
                               (GCodeList.STARTUP, GCodeText.STARTUP)):
                with m.Case(each):
                    m.d.comb += [choice.text.eq(only), choice.ends.eq(1), choice.last.eq(1)]
            with m.Case(GCodeList.MODES):
                self._modes(m, turn, choice)
            with m.Case(GCodeList.COORDINATES, GCodeList.PROBED):
                self._coordinates(m, turn, axis, choice)

        # It is divided from the clock in which the address is there until the part is taken.
        asks = Signal()
        m.d.comb += [self.divide.eq(asks & chosen.divides), self.division.unit.eq(chosen.unit),
                     self.division.inches.eq(self.inches),
                     self.division.nearest.eq(chosen.text != GCodeText.TOOL)]

        with m.FSM(name="lister_state") as fsm:
            with m.State("IDLE"):
                m.d.sync += [turn.eq(0), axis.eq(0)]
                with m.If(self.list == GCodeList.PROBED):
                    m.d.sync += turn.eq(PROBED)
                with m.If(self.start):
                    m.next = "CHOOSE"
            with m.State("CHOOSE"):
                m.d.sync += chosen.eq(choice)
                m.next = "READ"
            with m.State("READ"):
                m.d.comb += asks.eq(1)
                m.next = "OFFER"
            with m.State("OFFER"):
                m.d.comb += [asks.eq(1), self.parts.valid.eq(self.divided | ~chosen.divides)]
                with m.If(self.parts.valid & self.parts.ready):
                    m.next = "CHOOSE"
                    m.d.sync += turn.eq(turn + 1)
                    with m.If((self.list == GCodeList.COORDINATES)
                              | (self.list == GCodeList.PROBED)):
                        m.d.sync += [turn.eq(turn + part.ends),
                                     axis.eq(Mux(part.ends, 0, axis + 1))]
                    with m.Elif((turn == MIST) & ~(self.modes.mist & self.modes.flood)):
                        m.d.sync += turn.eq(MIST + 2)
                    with m.If(chosen.last):
                        m.next = "DONE"
            with m.State("DONE"):
                m.d.comb += self.done.eq(1)
                m.next = "IDLE"
            with m.State("FAULT"):
                pass
        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))
        return m

    def _modes(self, m: Module, turn: Signal, choice: data.View) -> None:
        """Choose one of the modes."""
        modes = self.modes
        motion = modes.motion.as_value()
        none, probes = modes.motion == GCodeMotion.NONE, motion[3]
        spindle = Mux(modes.clockwise, 3, Mux(modes.counter_clockwise, 4, 5))
        words = [Mux(none, 80, Mux(probes, motion[:2] + 2, motion)), 54 + modes.system,
                 17 + modes.plane, 21 - modes.inches, 90 + modes.relative, 94 - modes.inverse,
                 spindle, Mux(modes.mist, 7, Mux(modes.flood, 8, 9)), 8]
        with m.Switch(turn):
            for number, mode in enumerate(words):
                with m.Case(number):
                    m.d.comb += choice.mode.eq(mode)
        texts = [GCodeText.MOTION, *[GCodeText.G] * 5, *[GCodeText.M] * 3, GCodeText.TOOL,
                 GCodeText.FEED, GCodeText.SPEED]
        places = [0] * 9 + [Operand.TOOL, Operand.FEED, Operand.SPEED]
        units = [GCodeUnit.ONE] * 10 + [GCodeUnit.FEED, GCodeUnit.ONE]
        m.d.comb += [
            choice.text.eq(look_up([each.value for each in texts], turn, 5)),
            choice.address.eq(look_up(places, turn, 6)),
            # A feed that does not hold is as a mode that is 0.
            choice.divides.eq((turn >= MIST + 2) & ~((turn == FEED) & self.feed_zero)),
            # As one more bit G93 leaves ONE, and makes INVERSE of FEED.
            choice.unit.eq(look_up([each.value for each in units], turn, 2) | modes.inverse),
            choice.ends.eq(turn == MIST + 4), choice.last.eq(turn == MIST + 4),
        ]
        with m.If((turn == 0) & probes):
            m.d.comb += choice.text.eq(GCodeText.PROBE_MOTION)

    def _coordinates(self, m: Module, turn: Signal, axis: Signal, choice: data.View) -> None:
        """Choose one of the coordinates."""
        length, probed = turn == LENGTH, turn == PROBED
        codes, places = zip(*SYSTEMS, strict=True)
        texts = [GCodeText.COORDINATES, GCodeText.AXIS, GCodeText.LAST_AXIS, GCodeText.LENGTH,
                 GCodeText.PROBED, GCodeText.AXIS, GCodeText.LAST_PROBED]
        m.d.comb += [
            choice.unit.eq(GCodeUnit.LENGTH), choice.divides.eq(1),
            choice.last.eq(probed & (axis == 2)), choice.ends.eq((axis == 2) | length),
            choice.code.eq(look_up(codes, turn, 8) | (probed & self.probed)),
            choice.address.eq(
                look_up([*places, Operand.LENGTH, Operand.PROBED], turn, 6) + axis),
            choice.text.eq(look_up([each.value for each in texts],
                                   Cat(axis | length.replicate(2), probed), 5)),
        ]
