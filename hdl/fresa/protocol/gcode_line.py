"""Words of G-code to what their line says, each checked by itself."""

from amaranth import Const, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from .gcode_modes import (
    LETTERS,
    AxisUse,
    GCodeLineState,
    GCodeModes,
    GCodeMotion,
    ModalGroup,
    NonModal,
    ProgramFlow,
)
from .gcode_reader import gcode_layout

__all__ = ["GCodeLine"]

MAX_LINE_NUMBER = 10_000_000
MAX_TOOL = 255


class GCodeLine(wiring.Component):
    """Collects what the words of a line say, and checks each word as GRBL does.

    The first error of a line stays, and later words change nothing.

    Parameters
    ----------
    width, reach : int
        Bits of values, and of lengths, with their sign.

    Members
    -------
    item : In(gcode_layout(width))
        A word.
    take : In(1)
        It belongs to the line.
    clear : In(1)
        A line begins, with ``modes``. It comes without ``take``.
    end_program : In(1)
        The line becomes one that sets the modes of a program's end. It comes without ``take``.
    modes : In(GCodeModes)
        The present modes.
    line : Out(GCodeLineState)
        What the words so far say. Axis words that nothing else takes are for a motion.
    error : Out(8)
        The first error, or 0.
    index : Out(4)
        Where among `LETTERS` the letter of ``item`` is.
    has_value : Out(1)
        It is there.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, width: int = 44, reach: int = 36) -> None:
        self.width = in_range("width", width, 8, 64)
        self.reach = in_range("reach", reach, 2, width)
        super().__init__({
            "item": In(gcode_layout(width)), "take": In(1), "clear": In(1), "end_program": In(1),
            "modes": In(GCodeModes), "line": Out(GCodeLineState), "error": Out(8),
            "index": Out(4), "has_value": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        line = Signal(GCodeLineState)
        groups = Signal(len(ModalGroup))
        m.d.comb += self.line.eq(line)
        with m.If((line.axes == AxisUse.NONE) & line.given.any()):
            m.d.comb += self.line.axes.eq(AxisUse.MOTION)

        fault = Signal(8)  # of the word
        group = Signal(range(16))
        grouped = Signal()  # the word is of a modal group
        with m.If(self.take & (self.error == 0)):
            m.d.sync += self.error.eq(fault)
            with m.If(grouped):
                m.d.sync += groups.bit_select(group, 1).eq(1)
        with m.Switch(self.item.character):
            with m.Case(ord("G")):
                m.d.comb += grouped.eq(1)
                self._take_g(m, line, groups, group, fault)
            with m.Case(ord("M")):
                m.d.comb += grouped.eq(1)
                self._take_m(m, line, groups, group, fault)
            for index, letter in enumerate(LETTERS):
                with m.Case(ord(letter)):
                    m.d.comb += [self.index.eq(index), self.has_value.eq(1)]
                    self._take_value(m, line, letter, fault)
            with m.Default():
                m.d.comb += fault.eq(20)

        with m.If(self.clear):
            m.d.sync += [line.eq(0), line.modes.eq(self.modes), groups.eq(0), self.error.eq(0)]
        with m.If(self.end_program):
            m.d.sync += [
                line.modes.eq(0), line.modes.motion.eq(GCodeMotion.LINE),
                line.modes.inches.eq(line.modes.inches), line.letters.eq(0),
                line.axes.eq(AxisUse.NONE), line.non_modal.eq(NonModal.NONE)]
        return m

    def _says(self, m: Module, *assignments) -> None:
        """Keep what a word says, if it is taken."""
        with m.If(self.take & (self.error == 0)):
            m.d.sync += assignments

    def _take_value(self, m: Module, line, letter: str, fault: Signal) -> None:
        number = self.item.number
        whole = number.whole
        again = line.has(letter)
        with m.If(again):
            m.d.comb += fault.eq(25)
        with m.Elif(number.overflow):
            if letter != "N":  # it may have as many digits as its whole part
                m.d.comb += fault.eq(38)
        with m.Elif((number.value < 0) if letter in "FNPST" else Const(0)):
            m.d.comb += fault.eq(4)
        if letter == "T":
            with m.If(number.overflow | (number.value >= 0) & (
                    (whole > MAX_TOOL) | ((whole == MAX_TOOL) & ~number.integer))):
                m.d.comb += fault.eq(38)
        saturated = Mux(whole > 255, 255, whole)
        self._says(m, line.letters[LETTERS.index(letter)].eq(1))
        if letter == "F":
            self._says(m, line.zero_feed.eq(number.value == 0))
        elif letter == "L":
            self._says(m, line.l_whole.eq(saturated))
        elif letter == "N":
            self._says(m, line.number_too_large.eq(whole > MAX_LINE_NUMBER))
        elif letter == "P":
            self._says(m, line.p_whole.eq(saturated))
        elif letter in "IJKRXYZ":
            high = number.value.as_unsigned()[self.reach - 1:]
            with m.If(high.any() & ~high.all()):
                self._says(m, line.too_long.eq(1))

    def _take_g(self, m: Module, line, groups, group, fault: Signal) -> None:
        number, modes = self.item.number, line.modes
        hundredths = Signal(7)  # all ones if there is more behind
        m.d.comb += hundredths.eq(Mux(number.exact, number.hundredths, 127))
        plain, tenth = hundredths == 0, hundredths == 10
        known = Signal()
        takes_axes = Signal()
        unsupported = Signal()
        fraction = Signal()  # it may have one
        axes = Signal(AxisUse)
        m.d.comb += known.eq(1)
        with m.Switch(number.whole):
            for code, kind in [(4, NonModal.DWELL), (10, NonModal.COORDINATES),
                               (53, NonModal.MACHINE)]:
                with m.Case(code):
                    m.d.comb += [group.eq(ModalGroup.NON_MODAL), axes.eq(AxisUse.NON_MODAL),
                                 takes_axes.eq(plain if code == 10 else 0)]
                    self._says(m, line.non_modal.eq(kind))
            for code, kind, other in [(28, NonModal.HOME, NonModal.SET_HOME),
                                      (30, NonModal.HOME, NonModal.SET_HOME),
                                      (92, NonModal.OFFSET, NonModal.CLEAR_OFFSET)]:
                with m.Case(code):
                    m.d.comb += [group.eq(ModalGroup.NON_MODAL), axes.eq(AxisUse.NON_MODAL),
                                 takes_axes.eq(plain), fraction.eq(1),
                                 unsupported.eq(~plain & ~tenth)]
                    self._says(m, line.non_modal.eq(Mux(plain, kind.value, other.value)),
                               line.second.eq(code == 30))
            for code in (0, 1, 2, 3, 80):
                with m.Case(code):
                    m.d.comb += [group.eq(ModalGroup.MOTION), axes.eq(AxisUse.MOTION),
                                 takes_axes.eq(code != 80)]
                    self._says(m, modes.motion.eq(
                        GCodeMotion.NONE if code == 80 else GCodeMotion(code)))
            with m.Case(17, 18, 19):
                m.d.comb += group.eq(ModalGroup.PLANE)
                self._says(m, modes.plane.eq(number.whole - 17))
            for code in (90, 91):
                with m.Case(code):
                    m.d.comb += [
                        group.eq(Mux(plain, ModalGroup.DISTANCE, ModalGroup.ARC_DISTANCE)),
                        fraction.eq(1), unsupported.eq(~plain & (~tenth | (code == 90)))]
                    with m.If(plain):
                        self._says(m, modes.relative.eq(code == 91))
            with m.Case(93, 94):
                m.d.comb += group.eq(ModalGroup.FEED)
                self._says(m, modes.inverse.eq(number.whole == 93))
            with m.Case(20, 21):
                m.d.comb += group.eq(ModalGroup.UNITS)
                self._says(m, modes.inches.eq(number.whole == 20))
            with m.Case(40):
                m.d.comb += group.eq(ModalGroup.COMPENSATION)
            for code in (43, 49):
                with m.Case(code):
                    m.d.comb += [group.eq(ModalGroup.LENGTH), axes.eq(AxisUse.LENGTH),
                                 takes_axes.eq(1), fraction.eq(1),
                                 unsupported.eq(~tenth if code == 43 else 0)]
                    self._says(m, line.cancels.eq(code == 49))
            with m.Case(*range(54, 60)):
                m.d.comb += group.eq(ModalGroup.SYSTEM)
                self._says(m, modes.system.eq(number.whole - 54))
            with m.Case(61):
                m.d.comb += [group.eq(ModalGroup.PATH), fraction.eq(1), unsupported.eq(~plain)]
            with m.Default():
                m.d.comb += known.eq(0)
        with m.If(~known | number.overflow | (number.value < 0)):
            m.d.comb += fault.eq(20)
        with m.Elif(takes_axes & (line.axes != AxisUse.NONE)):
            m.d.comb += fault.eq(24)
        with m.Elif(unsupported):
            m.d.comb += fault.eq(20)
        with m.Elif(~plain & ~fraction):
            m.d.comb += fault.eq(23)
        with m.Elif(groups.bit_select(group, 1)):
            m.d.comb += fault.eq(21)
        with m.If(takes_axes):
            self._says(m, line.axes.eq(axes))

    def _take_m(self, m: Module, line, groups, group, fault: Signal) -> None:
        number, modes = self.item.number, line.modes
        known = Signal()
        m.d.comb += known.eq(1)
        with m.Switch(number.whole):
            for code, flow in [(0, ProgramFlow.PAUSE), (1, ProgramFlow.GO), (2, ProgramFlow.END),
                               (30, ProgramFlow.END)]:
                with m.Case(code):
                    m.d.comb += group.eq(ModalGroup.FLOW)
                    self._says(m, line.flow.eq(flow))
            with m.Case(3, 4, 5):
                m.d.comb += group.eq(ModalGroup.SPINDLE)
                self._says(m, modes.clockwise.eq(number.whole == 3),
                           modes.counter_clockwise.eq(number.whole == 4))
            for code in (7, 8, 9):
                with m.Case(code):
                    m.d.comb += group.eq(ModalGroup.COOLANT)
                    if code != 8:
                        self._says(m, modes.mist.eq(code == 7))
                    if code != 7:
                        self._says(m, modes.flood.eq(code == 8))
            with m.Default():
                m.d.comb += known.eq(0)
        with m.If(number.overflow | (number.value < 0) | ~number.exact | (number.hundredths != 0)):
            m.d.comb += fault.eq(23)
        with m.Elif(~known):
            m.d.comb += fault.eq(20)
        with m.Elif(groups.bit_select(group, 1)):
            m.d.comb += fault.eq(21)
