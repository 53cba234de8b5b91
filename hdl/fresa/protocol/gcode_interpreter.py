"""Words of G-code to motions and other actions: modes, coordinates, and what GRBL refuses."""

from collections.abc import Sequence

from amaranth import Cat, Const, Module, Mux, Signal, signed, unsigned
from amaranth.lib import data, enum, stream, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..choice import look_up
from ..fsm import leave_unused_codes
from .gcode_coordinates import CoordinateSum, GCodeCoordinates, Operand
from .gcode_line import GCodeLine
from .gcode_modes import (
    LETTERS,
    AxisUse,
    GCodeLineState,
    GCodeModes,
    GCodeMotion,
    NonModal,
    ProgramFlow,
)
from .gcode_reader import GCodeKind, GCodeStatus, gcode_layout
from .unit_converter import GCodeDivision, UnitConverter

__all__ = ["GCodeAction", "GCodeActionKind", "GCodeInterpreter"]

SYSTEMS = 6
"""Coordinate systems, G54 to G59."""

POSITIONS = [*range(Operand.POSITION, Operand.POSITION + 3), 0,
             *range(Operand.PROBED, Operand.PROBED + 3), 0]
"""Where positions are stored, by the axis with which they come."""


class GCodeActionKind(enum.Enum, shape=unsigned(4)):
    """What an action does."""

    RAPID = 0  # a line to TARGET at the highest speed
    LINE = 1  # to TARGET
    ARC = 2  # to TARGET around CENTRE, or with RADIUS
    CHECK_ARC = 3  # give the verdict on that; nothing is done
    DWELL = 4
    SPINDLE = 5
    COOLANT = 6
    OFFSETS = 7  # ORIGIN has changed
    PAUSE = 8
    END = 9
    JOG = 10  # a line to TARGET, with RATE
    CHECK_JOG = 11  # give the verdict on that, not 0 if it leaves the travel; nothing is done
    PROBE = 12  # a line to TARGET that ends where the probe changes
    PROBED = 13  # taken when that has ended


MOTIONS = (GCodeActionKind.RAPID, GCodeActionKind.LINE, GCodeActionKind.ARC, GCodeActionKind.JOG,
           GCodeActionKind.PROBE)
"""Actions that GRBL answers before they are done."""

WAITED_FOR = (GCodeActionKind.DWELL, GCodeActionKind.SPINDLE, GCodeActionKind.COOLANT,
              GCodeActionKind.OFFSETS, GCodeActionKind.PAUSE, GCodeActionKind.END)
"""Actions that GRBL has done, with all before them, when it answers; so it is with what is stored
of coordinates."""


class GCodeAction(data.Struct):
    """An action, with the modes in which it is done."""

    kind: GCodeActionKind
    modes: GCodeModes
    by_radius: unsigned(1)


class GCodeInterpreter(wiring.Component):
    """Interprets lines of G-code, one at a time.

    Each word is checked as it comes, and the line as a whole at its end, in the order in which GRBL
    does it: the first error is the answer, but a status that the machine is locked or not idle
    comes before it. Then nothing of the line is done, and nothing has changed. Of a line that is
    right the actions are offered in GRBL's order of execution, and then it is answered with 0. So
    every line is answered once, in order.

    The geometry of an arc is checked elsewhere. The arc is offered first as CHECK_ARC, and
    `verdict` is the error, or 0, when that is taken.

    A line whose items are of the system is a jog: a straight line, with the feed that it must have,
    which changes nothing but the position. It is refused with 36 if it has S or T, with 16 if it
    has a word of another group than distance and units, but for G53, and with 15 if it would leave
    the travel: it is offered first as CHECK_JOG, and `verdict` is then not 0.

    Of a line that probes the motion is offered as PROBE, and then PROBED until that has ended.
    POSITION is then that at which the program goes on: TARGET, unless another has come.

    What an action is about is read at ``operand``, by its address, an `Operand`: while an action is
    offered these words stay.

    Values are in nm, of millimetres and of inches, rounded half away from zero. A length is below
    2 ** 35 nm, else error 38; a target or an origin beyond that is error 33. The feed is at least
    1 nm/s, if it is not 0, and at most 2 ** 31 - 1.

    Coordinates are summed word by word from one memory, and a serial divider converts units: a line
    takes 80 to 230 clocks, and in inches 65 more for each length. An item is taken two clocks after
    it is offered, at the earliest.

    A reset leaves the origins of the coordinate systems and the positions of G28 and G30, which
    power-up makes 0. It clears all modes, the offset of G92, length and number of the tool, feed
    and speed, and where the probe touched, as GRBL does, for which the first 125 clocks after it
    are needed; ORIGIN is then that of G54, without an OFFSETS. POSITION is what it was, and has to
    be loaded. A line that a reset interrupts is not answered; of the origin that it sets some axes
    may be new, and some not.

    Parameters
    ----------
    width : int
        Bits of values, from 40 to 64; those of the words.
    probing : bool
        There is a probe: else G38 is refused as a word that is unknown.
    origin : sequence of int
        Origin of G54 at power-up, in nm.

    Members
    -------
    words : In(stream.Signature)
        Lines, see :func:`gcode_layout`, but those for the system.
    position : In(stream.Signature)
        Sets POSITION: ``value``, in nm, of ``axis``, 0 to 2; or with 4 to 6 PROBED, the word. Taken
        before the first item of a line, one a clock, and before that item, and while PROBED is
        offered.
    actions : Out(stream.Signature(GCodeAction))
        What is to be done.
    verdict : In(6)
        Error of an arc or a jog, 0 if it can be; sampled when its check is taken.
    operand_address : In(6)
        An `Operand`, or one of the words that follow it.
    operand : Out(signed(width))
        That word, a clock later, unless that is one in which a word was stored.
    answers : Out(stream.Signature(unsigned(8)))
        Error of each line, or 0.
    modes : Out(GCodeModes)
        The present modes.
    feed_zero : Out(1)
        The feed is 0: no line has set it, or the last one left it undefined, as it was in G93, or
        ended that, and had none.
    shown_address : In(6)
        An `Operand`.
    divide : In(1)
        Divide that word, for a list, between two lines or while PROBED is offered; stays 1, with
        the same ``shown_address``, until the quotient was used.
    division : In(GCodeDivision)
        By what; constant while ``divide`` is 1. Only a word that is not negative may be rounded
        towards 0.
    divided : Out(1)
        It is divided, until ``divide`` is 0.
    shown : Out(signed(width))
        The quotient then, and 0 from two clocks after it on, between two lines.
    erase, erase_address : In(1), In(6)
        Make the word at an address 0. Between two lines.
    ending : Out(1)
        M2 or M30 is being done, and resets the modes: from before its last actions to its answer.
    waits : Out(1)
        Of actions, and of coordinates, offsets and lengths that were stored, the last was one that
        GRBL has done, with all before it, when it answers: so no motion is behind it.
    fault : Out(1)
        A state register was upset. Stays until reset.

    Raises
    ------
    ValueError
        If ``width`` is out of range.
    """

    def __init__(self, *, width: int = 44, probing: bool = True,
                 origin: Sequence[int] = (0, 0, 0)) -> None:
        self.width = in_range("width", width, 40, 64)
        self.probing, self.origin = probing, tuple(origin)
        super().__init__({
            "words": In(stream.Signature(gcode_layout(self.width))),
            "position": In(stream.Signature(
                data.StructLayout({"axis": 3, "value": signed(self.width)}))),
            "actions": Out(stream.Signature(GCodeAction)),
            "verdict": In(6), "operand_address": In(6), "operand": Out(signed(self.width)),
            "answers": Out(stream.Signature(unsigned(8))),
            "modes": Out(GCodeModes), "feed_zero": Out(1, init=1), "shown_address": In(6),
            "divide": In(1), "division": In(GCodeDivision), "divided": Out(1),
            "shown": Out(signed(self.width)), "erase": In(1), "erase_address": In(6),
            "ending": Out(1), "waits": Out(1), "fault": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.line = collected = GCodeLine(width=self.width, probing=self.probing)
        m.submodules.coordinates = store = GCodeCoordinates(width=self.width,
                                                               origin=self.origin)
        m.submodules.converter = converter = UnitConverter(width=self.width)
        line = Signal(GCodeLineState)
        jog = Signal()  # the line is one
        m.d.comb += line.eq(collected.line)
        with m.If(jog):
            m.d.comb += [line.modes.motion.eq(GCodeMotion.LINE), line.modes.inverse.eq(0)]

        error = Signal(8)
        begun = Signal()  # a word of the line is there
        offered, read = Signal(), Signal()  # the item that is there was so a clock ago, and two
        ending = self.ending
        awaits = Signal()  # the end of a probing
        starting = Signal(init=1)  # after a reset
        total = Signal(CoordinateSum, init=CoordinateSum.CLEAR_OFFSET)
        computing = Signal(init=1)  # that sum
        converts = Signal()  # a register, as from the state it is far to the memory
        stores = Signal()  # what came from outside, a clock ago
        place = Signal(6)
        value = Signal(signed(self.width))
        action = self.actions.p
        m.d.comb += [
            action.modes.eq(line.modes), collected.item.eq(self.words.p),
            collected.modes.eq(self.modes),
            converter.line.eq(line), converter.was_inverse.eq(self.modes.inverse & ~jog),
            converter.word.eq(store.fetched), converter.run.eq(converts),
            store.line.eq(line), store.sum.eq(total),
            store.run.eq(computing), store.write.eq(stores | converter.write),
            store.address.eq(Mux(stores, place, Mux(
                begun & ~awaits, converter.address, self.shown_address))),
            store.data.eq(Mux(stores, value, converter.data)),
            store.operand_address.eq(self.operand_address), self.operand.eq(store.operand),
            self.shown.eq(converter.data), converter.divide.eq(self.divide & ~stores),
            converter.division.eq(self.division), self.divided.eq(converter.divided),
        ]

        def refuse(code) -> None:
            m.d.sync += error.eq(code)
            m.next = "ANSWER"

        def compute(which: CoordinateSum, state: str) -> None:
            m.d.sync += [total.eq(which), computing.eq(1)]
            m.next = state

        def offer(kind: GCodeActionKind, then: str, following: CoordinateSum | None = None) -> None:
            m.d.comb += [self.actions.valid.eq(1), action.kind.eq(kind)]
            if kind in (*MOTIONS, *WAITED_FOR):
                m.d.sync += self.waits.eq(kind in WAITED_FOR)
            with m.If(self.actions.ready):
                m.next = then
                if following is not None:
                    compute(following, then)

        def computed(state: str, then: str, following: CoordinateSum | None = None) -> None:
            with m.State(state), m.If(store.done):
                m.next = then
                if following is not None:
                    compute(following, then)

        # The value is of no interest unless it is stored.
        # No position is stored while a word is read for a list.
        rests = Signal()
        m.d.comb += rests.eq(~(self.divide & ~self.divided))
        places = rests & ~begun & self.position.valid
        m.d.sync += [stores.eq(0), value.eq(Mux(
            self.position.valid & (~begun | awaits), self.position.p.value,
            self.words.p.number.value))]

        def store_position() -> None:
            at = self.position.p.axis
            m.d.sync += [stores.eq(~at[:2].all()), place.eq(look_up(POSITIONS, at, len(place)))]

        with m.If(self.erase & ~begun & ~self.position.valid):
            m.d.sync += value.eq(0)
            for axis, at_power_up in enumerate(self.origin):
                if at_power_up:
                    with m.If(self.erase_address == Operand.SYSTEM + axis):
                        m.d.sync += value.eq(at_power_up)
        # In a state that waits for a sum. A register, since from the state it is far to the sum.
        with m.If(store.done):
            m.d.sync += computing.eq(0)

        given, axes = line.given, line.axes
        any_axis = given.any()
        modes, motion = line.modes, line.modes.motion
        has = {letter: line.has(letter) for letter in LETTERS}
        # What the words of a line mean together is found in registers: each is right a clock or two
        # after the last word, or after the modes of a program's end, and is asked for later.
        is_arc = Signal()
        is_probe = Signal()
        moves = Signal()  # the line has a motion of its own
        unused = Signal()  # a value
        line_feed_zero = Signal()
        words_error, line_error = Signal(6), Signal(6)
        m.d.sync += [
            is_arc.eq((axes == AxisUse.MOTION) & ((motion == GCodeMotion.CLOCKWISE)
                                                  | (motion == GCodeMotion.COUNTER_CLOCKWISE))),
            moves.eq((axes == AxisUse.MOTION) & any_axis & (motion != GCodeMotion.NONE)),
            unused.eq(_unused(line, is_arc).any() | (jog & (has["S"] | has["T"]))),
            line_feed_zero.eq(Mux(has["F"], line.zero_feed,
                                  modes.inverse | self.modes.inverse | self.feed_zero)),
            words_error.eq(_error_of_words(m, line, jog)),
            line_error.eq(_error_of_line(m, line, is_arc, is_probe, line_feed_zero)),
        ]
        if self.probing:
            m.d.sync += is_probe.eq((axes == AxisUse.MOTION) & motion.as_value()[3])
        m.d.comb += action.by_radius.eq(has["R"])

        with m.FSM(name="interpreter_state") as fsm:
            computed("CLEAR_OFFSET", "CLEAR_LENGTH", CoordinateSum.CLEAR_LENGTH)
            computed("CLEAR_LENGTH", "CLEAR_RATES", CoordinateSum.CLEAR_RATES)
            computed("CLEAR_RATES", "CLEAR_PROBED", CoordinateSum.CLEAR_PROBED)
            computed("CLEAR_PROBED", "SET_ORIGIN", CoordinateSum.SET_ORIGIN)
            with m.State("READ"):
                m.d.comb += [self.position.ready.eq(rests & ~begun),
                             self.words.ready.eq(read & ~places)]
                m.d.sync += [offered.eq(self.words.valid & ~self.words.ready),
                             read.eq(offered & self.words.valid & ~self.words.ready)]
                with m.If(self.words.valid):
                    m.d.sync += jog.eq(self.words.p.system)
                with m.If(self.erase & ~begun):
                    m.d.sync += [stores.eq(1), place.eq(self.erase_address)]
                with m.If(places):
                    store_position()
                with m.Elif(self.words.valid & read):
                    m.d.sync += begun.eq(1)
                    with m.If(self.words.p.kind == GCodeKind.WORD):
                        m.d.comb += collected.take.eq(1)
                        m.d.sync += [stores.eq(collected.has_value), place.eq(collected.index)]
                    with m.Elif(self.words.p.kind == GCodeKind.END):
                        m.next = "CHECK_WORDS"
                        status = self.words.p.status
                        with m.If((status == GCodeStatus.NOT_IDLE)
                                  | (status == GCodeStatus.LOCKED)):
                            refuse(status.as_value())
                        with m.Elif(collected.error != 0):
                            refuse(collected.error)
                        with m.Elif(status.as_value() != 0):
                            refuse(status.as_value())
                        with m.Elif(~begun & ~self.words.p.system):  # nothing is in the line
                            m.next = "ANSWER"

            with m.State("CHECK_WORDS"):
                m.d.sync += converts.eq((words_error == 0) & ~line.too_long)
                m.next = "CONVERT"
                with m.If(words_error != 0):
                    refuse(words_error)
            with m.State("CONVERT"):
                with m.If(line.too_long | converter.too_long | converter.done):
                    m.d.sync += converts.eq(0)
                with m.If(line.too_long | converter.too_long):
                    refuse(38)
                with m.Elif(converter.done):
                    compute(CoordinateSum.TARGET, "COMPUTE")
                    with m.If(line.non_modal == NonModal.COORDINATES):
                        m.d.sync += total.eq(CoordinateSum.COORDINATES)
                    with m.Elif(line.non_modal == NonModal.OFFSET):
                        m.d.sync += total.eq(CoordinateSum.OFFSET)

            # What the line would set; nothing of it stays if the line is refused.
            with m.State("COMPUTE"):
                with m.If(store.done):
                    m.next = "CHECK_LINE"
                    with m.If(store.beyond):
                        refuse(33)
            with m.State("CHECK_LINE"):
                m.next = "CHECK_UNUSED"
                with m.If(line_error != 0):
                    refuse(line_error)
                with m.Elif(is_arc | is_probe):
                    compute(CoordinateSum.DISTANCE, "COMPARE")
            with m.State("COMPARE"):
                with m.If(store.done):
                    m.next = "CHECK_ARC"
                    with m.If(is_probe):
                        m.next = "CHECK_UNUSED"
                    with m.If((has["R"] | is_probe) & ~store.changed):
                        refuse(33)
            with m.State("CHECK_ARC"):
                offer(GCodeActionKind.CHECK_ARC, "CHECK_UNUSED")
                with m.If(self.actions.ready & (self.verdict != 0)):
                    refuse(self.verdict)
            with m.State("CHECK_UNUSED"):
                m.next = "SPINDLE"
                with m.If(unused):
                    refuse(36)
                with m.Elif(jog):
                    m.next = "CHECK_JOG"
                    with m.If(line.not_of_jog | ((line.non_modal != NonModal.NONE)
                                                 & (line.non_modal != NonModal.MACHINE))):
                        refuse(16)
                with m.Elif(has["T"]):
                    compute(CoordinateSum.SET_TOOL, "STORE_TOOL")
                with m.Elif(has["S"]):
                    compute(CoordinateSum.SET_SPEED, "STORE_SPEED")

            # A jog, which has its own feed, and leaves the modes as they are
            with m.State("CHECK_JOG"):
                m.next = "ANSWER"
                with m.If(moves):
                    m.next = "CHECK_JOG"
                    offer(GCodeActionKind.CHECK_JOG, "JOG")
                    with m.If(self.actions.ready & (self.verdict != 0)):
                        refuse(15)
            with m.State("JOG"):
                offer(GCodeActionKind.JOG, "ARRIVE", CoordinateSum.ARRIVE)

            # The line is right: do it.
            with m.State("STORE_TOOL"):
                with m.If(store.done):
                    m.next = "SPINDLE"
                    with m.If(has["S"]):
                        compute(CoordinateSum.SET_SPEED, "STORE_SPEED")
            computed("STORE_SPEED", "SPINDLE")
            spins = Cat(modes.clockwise, modes.counter_clockwise)
            with m.State("SPINDLE"):
                m.next = "COOLANT"
                with m.If((spins != Cat(self.modes.clockwise, self.modes.counter_clockwise))
                          | (has["S"] & spins.any())):
                    m.next = "SPINDLE"
                    offer(GCodeActionKind.SPINDLE, "COOLANT")
            with m.State("COOLANT"):
                m.next = "DWELL"
                with m.If(Cat(modes.mist, modes.flood)
                          != Cat(self.modes.mist, self.modes.flood)):
                    m.next = "COOLANT"
                    offer(GCodeActionKind.COOLANT, "DWELL")
            with m.State("DWELL"):
                m.next = "SET"
                with m.If(line.non_modal == NonModal.DWELL):
                    m.next = "DWELL"
                    offer(GCodeActionKind.DWELL, "SET")
            with m.State("SET"):
                m.d.sync += self.modes.eq(modes)
                m.next = "SET_NON_MODAL"
                with m.If(~ending):
                    m.d.sync += self.feed_zero.eq(line_feed_zero)
                with m.If(has["F"]):
                    compute(CoordinateSum.SET_FEED, "STORE_FEED")
            computed("STORE_FEED", "SET_NON_MODAL")
            with m.State("SET_NON_MODAL"):
                compute(CoordinateSum.ORIGIN_CHANGE, "COMPARE_ORIGIN")
                with m.Switch(line.non_modal):
                    for non_modal, which in [
                        (NonModal.COORDINATES, CoordinateSum.SET_COORDINATES),
                        (NonModal.OFFSET, CoordinateSum.SET_OFFSET),
                        (NonModal.CLEAR_OFFSET, CoordinateSum.CLEAR_OFFSET),
                        (NonModal.SET_HOME, CoordinateSum.PREDEFINE),
                    ]:
                        with m.Case(non_modal):
                            compute(which, "STORE_NON_MODAL")
                    with m.Default():
                        with m.If(axes == AxisUse.LENGTH):
                            compute(CoordinateSum.SET_LENGTH, "STORE_NON_MODAL")
                            with m.If(line.cancels):
                                m.d.sync += total.eq(CoordinateSum.CLEAR_LENGTH)
            with m.State("STORE_NON_MODAL"):
                m.d.sync += self.waits.eq(1)
                with m.If(store.done):
                    compute(CoordinateSum.ORIGIN_CHANGE, "COMPARE_ORIGIN")
            with m.State("COMPARE_ORIGIN"):
                with m.If(store.done):
                    m.next = "MOVE"
                    with m.If(store.changed):
                        compute(CoordinateSum.SET_ORIGIN, "SET_ORIGIN")
            with m.State("SET_ORIGIN"):
                with m.If(store.done):
                    m.d.sync += starting.eq(0)
                    m.next = "OFFSETS"
                    with m.If(starting):
                        m.next = "READ"
            with m.State("OFFSETS"):
                offer(GCodeActionKind.OFFSETS, "MOVE")

            with m.State("MOVE"):
                m.next = "FLOW"
                with m.If(line.non_modal == NonModal.HOME):
                    m.next = "INTERMEDIATE"
                    with m.If(~any_axis):
                        compute(CoordinateSum.HOME, "FIND_HOME")
                with m.Elif(moves):
                    m.next = "MOTION"
            with m.State("INTERMEDIATE"):
                offer(GCodeActionKind.RAPID, "ARRIVE_INTERMEDIATE", CoordinateSum.ARRIVE)
            # G28 with axes leaves the others where the target has them, which is where they are.
            computed("ARRIVE_INTERMEDIATE", "FIND_HOME", CoordinateSum.HOME)
            computed("FIND_HOME", "TAKE_HOME", CoordinateSum.TAKE_HOME)
            computed("TAKE_HOME", "GO_HOME")
            with m.State("GO_HOME"):
                offer(GCodeActionKind.RAPID, "ARRIVE", CoordinateSum.ARRIVE)
            with m.State("MOTION"):
                offer(GCodeActionKind.LINE, "ARRIVE", CoordinateSum.ARRIVE)
                with m.If(is_arc):
                    m.d.comb += action.kind.eq(GCodeActionKind.ARC)
                with m.Elif(motion == GCodeMotion.RAPID):
                    m.d.comb += action.kind.eq(GCodeActionKind.RAPID)
                with m.Elif(is_probe):
                    m.d.comb += action.kind.eq(GCodeActionKind.PROBE)
                    m.d.sync += awaits.eq(self.actions.ready)
            with m.State("ARRIVE"):
                with m.If(store.done):
                    m.next = "FLOW"
                    with m.If(jog):
                        m.next = "ANSWER"
                    if self.probing:
                        with m.If(awaits):
                            m.next = "PROBED"
            if self.probing:
                with m.State("PROBED"):
                    offer(GCodeActionKind.PROBED, "FLOW")
                    m.d.comb += self.position.ready.eq(rests)
                    with m.If(self.position.valid & rests):
                        store_position()
                    with m.If(self.actions.ready):
                        m.d.sync += awaits.eq(0)

            with m.State("FLOW"):
                m.next = "ANSWER"
                with m.If(ending):
                    m.next = "FLOW"
                    offer(GCodeActionKind.END, "ANSWER")
                with m.Elif(line.flow == ProgramFlow.PAUSE):
                    m.next = "FLOW"
                    offer(GCodeActionKind.PAUSE, "ANSWER")
                with m.Elif(line.flow == ProgramFlow.END):
                    # The rest of a program's end is a line that sets these modes.
                    m.d.comb += collected.end_program.eq(1)
                    m.d.sync += ending.eq(1)
                    m.next = "SPINDLE"

            with m.State("ANSWER"):
                m.d.comb += [self.answers.valid.eq(1), self.answers.payload.eq(error)]
                with m.If(self.answers.ready):
                    m.d.comb += collected.clear.eq(1)
                    m.d.sync += [error.eq(0), ending.eq(0), begun.eq(0)]
                    m.next = "READ"
            with m.State("FAULT"):
                pass
        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT") | converter.fault)
        return m


def _error_of_words(m: Module, line, jog: Signal) -> Signal:
    """Return the error of words that do not go together, or 0, in the order of GRBL."""
    error = Signal(6)
    modes, axes, motion = line.modes, line.axes, line.modes.motion
    any_axis, has_l, has_p = line.given.any(), line.has("L"), line.has("P")
    with m.If(line.number_too_large):
        m.d.comb += error.eq(27)
    with m.Elif(~line.has("F") & (jog | (
            modes.inverse & (axes == AxisUse.MOTION)
            & (motion != GCodeMotion.RAPID) & (motion != GCodeMotion.NONE)))):
        m.d.comb += error.eq(22)
    with m.Elif((line.non_modal == NonModal.DWELL) & ~has_p):
        m.d.comb += error.eq(28)
    with m.Elif((axes == AxisUse.LENGTH) & ~line.cancels & (line.given != 0b100)):
        m.d.comb += error.eq(37)
    with m.Else(), m.Switch(line.non_modal):
        with m.Case(NonModal.COORDINATES):
            with m.If(~any_axis):
                m.d.comb += error.eq(26)
            with m.Elif(~has_p & ~has_l):
                m.d.comb += error.eq(28)
            with m.Elif(has_p & (line.p_whole > SYSTEMS)):
                m.d.comb += error.eq(29)
            with m.Elif(~has_l | ((line.l_whole != 2) & (line.l_whole != 20))
                        | ((line.l_whole == 2) & line.has("R"))):
                m.d.comb += error.eq(20)
        with m.Case(NonModal.OFFSET):
            with m.If(~any_axis):
                m.d.comb += error.eq(26)
        with m.Case(NonModal.MACHINE):
            with m.If((motion != GCodeMotion.RAPID) & (motion != GCodeMotion.LINE)):
                m.d.comb += error.eq(30)
    return error


def _error_of_line(m: Module, line, is_arc: Signal, is_probe: Signal, feed_zero: Signal
                   ) -> Signal:
    """Return the error of a line whose words go together, or 0."""
    error = Signal(6)
    axes, motion, any_axis = line.axes, line.modes.motion, line.given.any()
    offsets = Cat(line.has("I"), line.has("J"), line.has("K"))
    with m.If(motion == GCodeMotion.NONE):
        with m.If(any_axis):
            m.d.comb += error.eq(31)
    with m.Elif((axes == AxisUse.MOTION) & (motion != GCodeMotion.RAPID) & feed_zero):
        m.d.comb += error.eq(22)
    with m.Elif((is_arc | is_probe) & ~any_axis):
        m.d.comb += error.eq(26)
    with m.Elif(is_arc):
        with m.If(_in_plane(line.modes.plane, line.given) == 0):
            m.d.comb += error.eq(32)
        with m.Elif(~line.has("R") & (_in_plane(line.modes.plane, offsets) == 0)):
            m.d.comb += error.eq(35)
    return error


def _in_plane(plane, given):
    """Return whether an axis of the plane is given."""
    x, y, z = given
    return Cat(x | y, z | x, y | z, Const(0)).bit_select(plane, 1)


def _unused(line, is_arc: Signal):
    """Return the letters with a value that nothing in the line uses."""
    dwell, coordinates = (line.non_modal == kind for kind in (NonModal.DWELL, NonModal.COORDINATES))
    by_radius = is_arc & line.has("R")
    by_centre = is_arc & ~line.has("R")
    used = {"P": dwell | coordinates, "L": coordinates, "R": by_radius,
            **dict.fromkeys("IJK", by_centre),
            **dict.fromkeys("XYZ", line.axes != AxisUse.NONE)}
    return Cat(line.has(letter) & ~use for letter, use in used.items())
