"""Words of G-code to what their line says, each checked by itself."""

from amaranth import Cat, Module, Mux, Signal, unsigned
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from .gcode_modes import (
    LETTERS,
    OF_JOG,
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

CODE_BITS = 7
"""Bits of the largest code of G or M, 94: what is known is looked up by no more of them."""


PROBE_HUNDREDTHS = {GCodeMotion.PROBE_TOWARD: 20, GCodeMotion.PROBE_TOWARD_NO_ERROR: 30,
                    GCodeMotion.PROBE_AWAY: 40, GCodeMotion.PROBE_AWAY_NO_ERROR: 50}
"""Of G38."""


class GCodeWord(data.Struct):
    """What a word says by itself."""

    letter: unsigned(len(LETTERS))  # that it gives a value: one, or none
    index: unsigned(4)  # of that letter
    has_value: unsigned(1)
    groups: unsigned(len(ModalGroup))  # of which it is: one, or none
    choice: unsigned(4)  # what it chooses in its group
    second: unsigned(1)  # G30, not G28
    axes: AxisUse  # what its line's axis words are for, if it says so
    whole: unsigned(8)  # saturated, also where the value is below 0
    number_too_large: unsigned(1)  # as N
    zero: unsigned(1)
    too_long: unsigned(1)  # a length is beyond reach
    fault: unsigned(6)
    comes_first: unsigned(1)  # the fault, before one that the line makes of it

    def is_of(self, group: ModalGroup):
        """Return whether it is of a modal group."""
        return self.groups[group]


class GCodeLine(wiring.Component):
    """Collects what the words of a line say, and checks each word as GRBL does.

    The first error of a line stays, and later words change nothing.

    What a word is, of all that there are, is found in one clock; whether it goes with the line, in
    the next, in which it is taken.

    Parameters
    ----------
    width, reach : int
        Bits of values, and of lengths, with their sign.
    probing : bool
        There is a probe: else G38 is a word that is unknown.

    Members
    -------
    item : In(gcode_layout(width))
        A word.
    take : In(1)
        The word belongs to the line that was there in the two clocks before.
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
        Where among `LETTERS` the letter of that word is.
    has_value : Out(1)
        It is there.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, width: int = 44, reach: int = 36, probing: bool = True) -> None:
        self.width = in_range("width", width, 8, 64)
        self.reach = in_range("reach", reach, 2, width)
        self.probing = probing
        super().__init__({
            "item": In(gcode_layout(width)), "take": In(1), "clear": In(1), "end_program": In(1),
            "modes": In(GCodeModes), "line": Out(GCodeLineState), "error": Out(8),
            "index": Out(4), "has_value": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        line = Signal(GCodeLineState)
        groups = Signal(len(ModalGroup))  # those of which there is a word
        m.d.comb += self.line.eq(line)
        with m.If((line.axes == AxisUse.NONE) & line.given.any()):
            m.d.comb += self.line.axes.eq(AxisUse.MOTION)

        item = Signal(GCodeWord)
        word = Signal(GCodeWord, init={"fault": 20}, reset_less=True)  # none, which is no word
        m.d.sync += word.eq(item)
        # That it is G or M is known a clock before what its number says, which takes long.
        is_g, is_m = Signal(), Signal()
        character = self.item.character
        m.d.sync += [is_g.eq(character == ord("G")), is_m.eq(character == ord("M"))]
        with m.If(is_g):
            self._read_g(m, item)
        with m.Elif(is_m):
            self._read_m(m, item)
        with m.Else(), m.Switch(character):
            for index, letter in enumerate(LETTERS):
                with m.Case(ord(letter)):
                    m.d.comb += [item.letter[index].eq(1), item.index.eq(index),
                                 item.has_value.eq(1)]
                    self._read_value(m, item, letter)
            with m.Default():
                m.d.comb += item.fault.eq(20)

        m.d.comb += [self.index.eq(word.index), self.has_value.eq(word.has_value)]
        with m.If(self.take & (self.error == 0)):
            m.d.sync += groups.eq(groups | word.groups)
            with m.If(word.comes_first):
                m.d.sync += self.error.eq(word.fault)
            with m.Elif((word.axes != AxisUse.NONE) & (line.axes != AxisUse.NONE)):
                m.d.sync += self.error.eq(24)
            with m.Elif((word.letter & line.letters).any()):
                m.d.sync += self.error.eq(25)
            with m.Elif(word.fault != 0):
                m.d.sync += self.error.eq(word.fault)
            with m.Elif((word.groups & groups).any()):
                m.d.sync += self.error.eq(21)
            self._keep(m, line, word)

        with m.If(self.clear):
            m.d.sync += [line.eq(0), line.modes.eq(self.modes), groups.eq(0), self.error.eq(0)]
        with m.If(self.end_program):
            m.d.sync += [
                line.modes.eq(0), line.modes.motion.eq(GCodeMotion.LINE),
                line.modes.inches.eq(line.modes.inches), line.letters.eq(0),
                line.axes.eq(AxisUse.NONE), line.non_modal.eq(NonModal.NONE)]
        if not self.probing:  # so that synthesis knows
            m.d.sync += line.modes.motion.as_value()[3].eq(0)
        return m

    @staticmethod
    def _keep(m: Module, line, word) -> None:
        """Keep what a word says."""
        modes, choice = line.modes, word.choice
        m.d.sync += line.letters.eq(line.letters | word.letter)
        with m.If(word.letter[LETTERS.index("F")]):
            m.d.sync += line.zero_feed.eq(word.zero)
        with m.If(word.letter[LETTERS.index("L")]):
            m.d.sync += line.l_whole.eq(word.whole)
        with m.If(word.letter[LETTERS.index("N")]):
            m.d.sync += line.number_too_large.eq(word.number_too_large)
        with m.If(word.letter[LETTERS.index("P")]):
            m.d.sync += line.p_whole.eq(word.whole)
        with m.If(word.too_long):
            m.d.sync += line.too_long.eq(1)
        with m.If(word.axes != AxisUse.NONE):
            m.d.sync += line.axes.eq(word.axes)
        with m.If(Cat(word.is_of(group) for group in ModalGroup if group not in OF_JOG).any()):
            m.d.sync += line.not_of_jog.eq(1)
        with m.If(word.is_of(ModalGroup.NON_MODAL)):
            m.d.sync += [line.non_modal.eq(choice), line.second.eq(word.second)]
        with m.If(word.is_of(ModalGroup.LENGTH)):
            m.d.sync += line.cancels.eq(choice)
        with m.If(word.is_of(ModalGroup.FLOW)):
            m.d.sync += line.flow.eq(choice)
        with m.If(word.is_of(ModalGroup.SPINDLE)):
            m.d.sync += [modes.clockwise.eq(choice[0]), modes.counter_clockwise.eq(choice[1])]
        with m.If(word.is_of(ModalGroup.COOLANT)):
            m.d.sync += [modes.mist.eq(choice[0] | (modes.mist & choice.any())),
                         modes.flood.eq(choice[1] | (modes.flood & choice.any()))]
        for group, mode in [
                (ModalGroup.MOTION, modes.motion), (ModalGroup.PLANE, modes.plane),
                (ModalGroup.DISTANCE, modes.relative), (ModalGroup.FEED, modes.inverse),
                (ModalGroup.UNITS, modes.inches), (ModalGroup.SYSTEM, modes.system)]:
            with m.If(word.is_of(group)):
                m.d.sync += mode.eq(choice)

    def _read_value(self, m: Module, item, letter: str) -> None:
        number = self.item.number
        whole = number.whole
        m.d.comb += [item.whole.eq(Mux((whole > 255) | number.value[-1], 255, whole)),
                     item.zero.eq(number.value == 0)]
        if letter == "N":  # it may have as many digits as its whole part
            m.d.comb += item.number_too_large.eq(whole > MAX_LINE_NUMBER)
        else:
            with m.If(number.overflow):
                m.d.comb += item.fault.eq(38)
        if letter in "FNPST":
            with m.If(~number.overflow & number.value[-1]):
                m.d.comb += item.fault.eq(4)
        if letter == "T":
            with m.If(number.overflow | ~number.value[-1] & (
                    (whole > MAX_TOOL) | ((whole == MAX_TOOL) & ~number.integer))):
                m.d.comb += [item.fault.eq(38), item.comes_first.eq(1)]
        if letter in "IJKRXYZ":
            high = number.value.as_unsigned()[self.reach - 1:]
            m.d.comb += item.too_long.eq(high.any() & ~high.all())

    def _read_g(self, m: Module, item) -> None:
        number = self.item.number
        plain = number.exact & (number.hundredths == 0)
        tenth = number.exact & (number.hundredths == 10)
        known = Signal()
        fraction = Signal()  # it may have one
        unsupported = Signal()
        m.d.comb += known.eq(~number.whole[CODE_BITS:].any())

        def says(group: ModalGroup, choice=0) -> None:
            m.d.comb += [item.groups[group].eq(1), item.choice.eq(choice)]

        with m.Switch(number.whole[:CODE_BITS]):
            for code, kind in [(4, NonModal.DWELL), (10, NonModal.COORDINATES),
                               (53, NonModal.MACHINE)]:
                with m.Case(code):
                    says(ModalGroup.NON_MODAL, kind)
                    if code == 10:
                        m.d.comb += item.axes.eq(Mux(plain, AxisUse.NON_MODAL, AxisUse.NONE))
            for code, kind, other in [(28, NonModal.HOME, NonModal.SET_HOME),
                                      (30, NonModal.HOME, NonModal.SET_HOME),
                                      (92, NonModal.OFFSET, NonModal.CLEAR_OFFSET)]:
                with m.Case(code):
                    says(ModalGroup.NON_MODAL, Mux(plain, kind, other))
                    m.d.comb += [item.axes.eq(Mux(plain, AxisUse.NON_MODAL, AxisUse.NONE)),
                                 item.second.eq(code == 30), fraction.eq(1),
                                 unsupported.eq(~plain & ~tenth)]
            for code in (0, 1, 2, 3):
                with m.Case(code):
                    says(ModalGroup.MOTION, code)
                    m.d.comb += item.axes.eq(AxisUse.MOTION)
            if self.probing:
                with m.Case(38):
                    says(ModalGroup.MOTION, GCodeMotion.PROBE_TOWARD)
                    m.d.comb += [item.axes.eq(AxisUse.MOTION), fraction.eq(1), unsupported.eq(1)]
                    for motion, hundredths in PROBE_HUNDREDTHS.items():
                        with m.If(number.exact & (number.hundredths == hundredths)):
                            m.d.comb += [item.choice.eq(motion), unsupported.eq(0)]
            with m.Case(80):
                says(ModalGroup.MOTION, GCodeMotion.NONE)
            for code in (17, 18, 19):
                with m.Case(code):
                    says(ModalGroup.PLANE, code - 17)
            for code in (90, 91):
                with m.Case(code):
                    with m.If(plain):
                        says(ModalGroup.DISTANCE, code - 90)
                    with m.Else():
                        says(ModalGroup.ARC_DISTANCE)
                    m.d.comb += [fraction.eq(1),
                                 unsupported.eq(~plain & (~tenth | (code == 90)))]
            for code in (93, 94):
                with m.Case(code):
                    says(ModalGroup.FEED, code == 93)
            for code in (20, 21):
                with m.Case(code):
                    says(ModalGroup.UNITS, code == 20)
            with m.Case(40):
                says(ModalGroup.COMPENSATION)
            for code in (43, 49):
                with m.Case(code):
                    says(ModalGroup.LENGTH, code == 49)
                    m.d.comb += [item.axes.eq(AxisUse.LENGTH), fraction.eq(1),
                                 unsupported.eq(~tenth if code == 43 else 0)]
            for code in range(54, 60):
                with m.Case(code):
                    says(ModalGroup.SYSTEM, code - 54)
            with m.Case(61):
                says(ModalGroup.PATH)
                m.d.comb += [fraction.eq(1), unsupported.eq(~plain)]
            with m.Default():
                m.d.comb += known.eq(0)
        with m.If(~known | number.overflow | number.value[-1]):
            m.d.comb += [item.fault.eq(20), item.comes_first.eq(1)]
        with m.Elif(unsupported):
            m.d.comb += item.fault.eq(20)
        with m.Elif(~plain & ~fraction):
            m.d.comb += item.fault.eq(23)

    def _read_m(self, m: Module, item) -> None:
        number = self.item.number
        known = Signal()
        m.d.comb += known.eq(~number.whole[CODE_BITS:].any())
        with m.Switch(number.whole[:CODE_BITS]):
            for group, codes in [
                    (ModalGroup.FLOW, {0: ProgramFlow.PAUSE, 1: ProgramFlow.GO,
                                       2: ProgramFlow.END, 30: ProgramFlow.END}),
                    (ModalGroup.SPINDLE, {3: 0b01, 4: 0b10, 5: 0}),  # by the direction
                    (ModalGroup.COOLANT, {7: 0b01, 8: 0b10, 9: 0})]:  # mist and flood
                for code, choice in codes.items():
                    with m.Case(code):
                        m.d.comb += [item.groups[group].eq(1), item.choice.eq(choice)]
            with m.Default():
                m.d.comb += known.eq(0)
        with m.If(number.overflow | number.value[-1] | ~number.exact | (number.hundredths != 0)):
            m.d.comb += item.fault.eq(23)
        with m.Elif(~known):
            m.d.comb += item.fault.eq(20)
