"""Actions of a G-code program to blocks: copies between registers, and tables of formulas."""

from collections.abc import Iterable
from itertools import accumulate
from typing import NamedTuple

from amaranth import Array, Cat, Const, Module, Mux, Signal, signed, unsigned
from amaranth.lib import data, enum, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from ..arithmetic import Line
from ..arithmetic.gcode import REGISTERS, TABLES, gcode_formulas
from ..arithmetic.line import OVERRIDE_SHIFT, WIDTH
from ..checks import in_range
from ..choice import ALL_ONES, choice_code, choose
from ..fsm import leave_unused_codes
from ..protocol import (
    SETTING_BITS,
    SETTINGS,
    GCodeAction,
    GCodeActionKind,
    GCodeMotion,
    Operand,
    ReportNumber,
    setting_index,
)
from .backlash import MAX_BACKLASH
from .blocks import (
    BLOCK_WORDS,
    FEED_BITS,
    FEED_HIGH,
    FEED_LOW,
    BlockHeader,
    BlockKind,
    BlockWord,
    OverrideKind,
)
from .overrides import OVERRIDE_BITS, override_of

__all__ = ["HOMING", "GCodePlanner", "HomingRequest"]

UM_BITS = 27
"""Bits of a position in um, which reaches to 34 m, with its sign."""

UM, INCH = 1000, 2540
"""Units of positions in reports, in nm: the second is a ten thousandth of an inch."""

LENGTH_BITS = 31
"""Bits of a travel in steps."""

FILTER_BITS = 20
"""Bits of the time of a filter in clocks: `MAX_FILTER` us at any clock."""

PULSE_BITS = 16
"""Bits of the time of a pulse in clocks: `MAX_WIDTH` ns at any clock."""

MAX_GAP = (1 << PULSE_BITS) + 4
"""Most clocks from a pulse to the next."""

HIGHEST = (1 << WIDTH) - 1
"""Highest number in a word."""

PLAN_GAIN, PLAN_LIMIT = BLOCK_WORDS, BLOCK_WORDS + 2


class HomingRequest(enum.Enum, shape=unsigned(2)):
    """What a homing cycle wants of the planner."""

    NONE = 0
    MOVE = 1  # a line of one axis
    PLACE = 2  # the place of a switch
    WAIT = 3  # a dwell


HOMING = wiring.Signature({
    "kind": Out(HomingRequest), "axis": Out(2), "thousandths": Out(13), "back": Out(1),
    "from_switch": Out(1), "near": Out(1), "slow": Out(1)})
"""A request of a homing cycle.

A line is as long as the travel of its axis, $130 to $132, or with ``near`` as $27, as often as
``thousandths`` says; ``back`` is the way to lower positions. It goes with the speed of $25, or with
``slow`` of $24, and begins where the axis is, or with ``from_switch`` is reckoned from the place
that a PLACE gave. That is the travel from 0, as often and in the way that the request says. A WAIT
takes the time of $26.
"""


class _Do(enum.Enum, shape=unsigned(5)):
    """What a row of a procedure does; a register is one of the formulas."""

    LOAD = 0b00_000  # operand -> register
    FEED = 0b00_001  # operand -> register; of a rapid the highest number
    CENTRE_U = 0b00_010  # operand of the first axis of the plane -> register
    CENTRE_V = 0b00_011
    INPUT = 0b00_100  # one of _INPUTS -> register
    SETTING = 0b00_101  # setting -> register
    ZERO = 0b00_110  # 0 -> register
    STORE = 0b01_000  # register -> word of the block
    PUT = 0b01_001  # operand -> word of the block
    HEADER = 0b01_010  # header -> word of the block
    RUN = 0b10_000  # a table
    RUN_INVERSE = 0b10_001  # a table, if the feed of the action is motions a minute
    RUN_SOFT = 0b10_010  # a table, if there are soft limits
    RUN_RADIUS = 0b10_011  # a table, if the arc has a radius
    RUN_WORK = 0b10_100  # a table, if reports have positions of work
    KEEP = 0b11_000  # register -> one of _Kept
    SKIP = 0b11_001  # end here if the register is 0
    GUARD = 0b11_010  # wait for a reset if the register is not 0 and there are soft limits
    POSITION = 0b11_011  # register -> position of an axis of the interpreter


_OPERANDS = (_Do.LOAD, _Do.FEED, _Do.CENTRE_U, _Do.CENTRE_V, _Do.PUT)
_WORDS = (_Do.STORE, _Do.KEEP, _Do.SKIP, _Do.GUARD, _Do.POSITION)
"""Rows whose value is an operand, and a register."""


SHOWN_BITS = 4
"""Bits of the address of a number that reports show."""


class _Kept(enum.Enum, shape=unsigned(6)):
    """What is kept of the registers of the formulas.

    Those below 16 are numbers that reports show, each a `ReportNumber` and its address in a memory;
    others have registers of their own.
    """

    FEED = ReportNumber.FEED.value
    SPINDLE = ReportNumber.SPINDLE.value
    X = ReportNumber.X.value
    ORIGIN_X = ReportNumber.ORIGIN_X.value
    STEPS_X = 16
    STEPS_Y = 17
    STEPS_Z = 18
    FILTER = 19
    PROGRAMMED = 20
    LENGTH_X = 21
    LENGTH_Y = 22
    LENGTH_Z = 23
    BACKLASH_X = 24
    BACKLASH_Y = 25
    BACKLASH_Z = 26
    LOG2_TICKS = 27
    VERDICT = 28
    ARC = 29
    CLOCKWISE = 30
    CHANNELS = 31
    SHIFT = 32
    SWITCH = 33
    PULSE = 34


class _Row(NamedTuple):
    do: _Do
    source: int = 0
    destination: int = 0
    input: str = ""


# An even number, as `choose` wants.
_INPUTS = ("steps_now_x", "steps_now_y", "steps_now_z", "spindle", "speed_now", "header", "setting",
           "number")
_NUMBERS = {"back": 0b100, "from_switch": 0b101, "clockwise": 0b110, "plane": 0b111,
            "thousandths": 0b1_000, "unit": 0b10_000, "override": 0b100_000}
"""Small numbers, by the source of a row: a bit for each, and four that are flags."""

_NEAR, _SLOW = 1 << 6, 1 << 7
"""With these beside its source a setting is taken only for a request that says so."""

ROW = data.StructLayout({"do": _Do, "source": 8, "destination": 8, "last": 1, "operand": 1,
                         "word": 1, "input": len(_INPUTS) // 2 + 1})
"""A row, and from where it has its value: operand, register, or by a code one of `_INPUTS`."""

_register = REGISTERS.__getitem__
_TABLE = {table.name: number for number, table in enumerate(TABLES)}


def _input(name: str, register: str) -> _Row:
    if name in _NUMBERS:
        return _Row(_Do.INPUT, _NUMBERS[name], _register(register), "number")
    return _Row(_Do.INPUT, 0, _register(register), name)


def _setting(number: int, register: str, only: int = 0) -> _Row:
    return _Row(_Do.SETTING, setting_index(number) | only, _register(register))


def _pair(name: str, word: int, *, high_first: bool) -> Iterable[_Row]:
    names = (name, f"{name}.low")
    for offset, each in enumerate(names if high_first else reversed(names)):
        yield _Row(_Do.STORE, _register(each), word + offset)


def _targets() -> Iterable[_Row]:
    for axis, name in enumerate("xyz"):
        yield _Row(_Do.LOAD, Operand.TARGET + axis, _register(f"to_{name}"))


def _guarded_targets() -> Iterable[_Row]:
    """Go no further if a target is out of the travel."""
    yield from _targets()
    yield _Row(_Do.RUN_SOFT, _TABLE["travel"])
    yield _Row(_Do.GUARD, _register("beyond"))


def _places() -> Iterable[_Row]:
    for axis, name in enumerate("xyz"):
        yield _Row(_Do.STORE, _register(f"place_{name}"), BlockWord.PLACE + axis)


def _plan(limit: str) -> Iterable[_Row]:
    """Commit the block."""
    yield from _pair(limit, PLAN_LIMIT, high_first=False)


def _zero_gain() -> Iterable[_Row]:
    for word in range(2):
        yield _Row(_Do.STORE, _register("zero"), PLAN_GAIN + word)


def _zero_limit() -> Iterable[_Row]:
    """Commit a block that begins at rest, as the next one will."""
    for register in ("nominal_before", "nominal_before.low"):
        yield _Row(_Do.ZERO, 0, _register(register))
    for word in range(2):
        yield _Row(_Do.STORE, _register("zero"), PLAN_LIMIT + word)


def _block() -> Iterable[_Row]:
    """Commit the block that tables have computed."""
    yield _Row(_Do.KEEP, _register("ticks"), _Kept.LOG2_TICKS.value)
    yield _Row(_Do.KEEP, _register("feed"), _Kept.PROGRAMMED.value)
    yield _Row(_Do.HEADER, 0, BlockWord.HEADER)
    for name, word in ("energy", BlockWord.ENERGY), ("modulus", BlockWord.MODULUS):
        yield from _pair(name, word, high_first=True)
    for name, word in ("fastest", BlockWord.FASTEST), ("hundredth", BlockWord.HUNDREDTH):
        yield _Row(_Do.STORE, _register(name), word)
    yield from _places()
    yield _Row(_Do.PUT, Operand.SPEED, BlockWord.EXTRA)
    yield from _pair("gain", PLAN_GAIN, high_first=False)
    # The register of a limit is of before `accept`, which needs no block.
    yield _Row(_Do.RUN, _TABLE["accept"])
    yield from _plan("limit")


def _line() -> Iterable[_Row]:
    yield from _guarded_targets()
    yield _Row(_Do.FEED, Operand.FEED, _register("feed"))
    yield _Row(_Do.RUN_INVERSE, _TABLE["distance"])
    yield _Row(_Do.RUN_INVERSE, _TABLE["inverse"])
    yield from _rest_of_line()


def _rest_of_line() -> Iterable[_Row]:
    yield _input("override", "override")
    yield _Row(_Do.RUN, _TABLE["line"])
    yield _Row(_Do.SKIP, _register("path"))
    yield _Row(_Do.KEEP, _register("zero"), _Kept.ARC.value)
    yield _Row(_Do.KEEP, _register("xyz_ahead"), _Kept.CHANNELS.value)
    yield from _block()


def _jog() -> Iterable[_Row]:
    yield from _targets()
    yield _Row(_Do.LOAD, Operand.RATE, _register("feed"))
    yield from _rest_of_line()


def _check_jog() -> Iterable[_Row]:
    """Give the verdict whether a target is out of the travel."""
    yield from _targets()
    yield _Row(_Do.ZERO, 0, _register("beyond"))
    yield _Row(_Do.RUN_SOFT, _TABLE["travel"])
    yield _Row(_Do.KEEP, _register("beyond"), _Kept.VERDICT.value)


def _check() -> Iterable[_Row]:
    """Give the verdict on an arc, by its centre or radius: the other register is not looked at."""
    yield from _targets()
    yield _input("plane", "plane")
    yield _input("clockwise", "clockwise")
    yield _Row(_Do.LOAD, Operand.RADIUS, _register("radius"))
    for do, name in (_Do.CENTRE_U, "centre_u"), (_Do.CENTRE_V, "centre_v"):
        yield _Row(do, 0, _register(name))
    yield _Row(_Do.RUN, _TABLE["arc_plane"])
    yield _Row(_Do.RUN_RADIUS, _TABLE["arc_centre"])
    yield _Row(_Do.RUN, _TABLE["arc_check"])
    yield _Row(_Do.KEEP, _register("verdict"), _Kept.VERDICT.value)


def _arc() -> Iterable[_Row]:
    """Queue an arc, and a line to its end if that is not on the circle."""
    yield from _guarded_targets()
    yield from _check()
    yield _Row(_Do.FEED, Operand.FEED, _register("feed"))
    yield _Row(_Do.RUN, _TABLE["arc_path"])
    for name in ("arc_travel", *["quarter"] * 4):
        yield _Row(_Do.RUN_SOFT, _TABLE[name])
    yield _Row(_Do.GUARD, _register("beyond"))
    yield _Row(_Do.RUN_INVERSE, _TABLE["inverse"])
    yield _input("override", "override")
    yield _Row(_Do.RUN, _TABLE["arc_plan"])
    for name, kept in (("1", _Kept.ARC), ("mirrored", _Kept.CLOCKWISE),
                       ("channels", _Kept.CHANNELS), ("shift", _Kept.SHIFT)):
        yield _Row(_Do.KEEP, _register(name), kept.value)
    for name, word in (("zero", BlockWord.TURNS), ("turns", BlockWord.TURNS + 1),
                       ("x", BlockWord.X), ("y", BlockWord.Y), ("residual", BlockWord.RESIDUAL)):
        yield _Row(_Do.STORE, _register(name), word)
    yield from _block()
    yield _Row(_Do.SKIP, _register("apart"))
    yield from _targets()
    yield from _rest_of_line()


def _event(extra: Operand, *, stops: bool) -> Iterable[_Row]:
    """Queue what is no motion; without a stop it has the highest speed of the motion before it."""
    yield _Row(_Do.HEADER, 0, BlockWord.HEADER)
    yield _Row(_Do.PUT, extra, BlockWord.EXTRA)
    yield from _zero_gain()
    if stops:
        yield from _zero_limit()
    else:
        yield from _plan("nominal_before")


def _configure() -> Iterable[_Row]:
    """Take all settings of motion; steps per metre are thousandths of those per mm."""
    for axis, name in enumerate("xyz"):
        for first, register in ((100, "steps"), (110, "max_speed"), (120, "max_acceleration"),
                                (130, "travel")):
            yield _setting(first + axis, f"{register}_{name}")
        yield _Row(_Do.KEEP, _register(f"steps_{name}"), _Kept.STEPS_X.value + axis)
    for number, register in (0, "pulse"), (11, "deviation"), (201, "filter"):
        yield _setting(number, register)
    yield _Row(_Do.RUN, _TABLE["configure"])
    for first, kept in (130, _Kept.LENGTH_X), (220, _Kept.BACKLASH_X):
        for axis in range(3):
            for number, register in (first, "a"), (100, "b"):
                yield _setting(number + axis, register)
            yield _Row(_Do.RUN, _TABLE["in_steps"])
            yield _Row(_Do.KEEP, _register("a"), kept.value + axis)
    for register, kept in (("verdict", _Kept.VERDICT), ("filter", _Kept.FILTER),
                           ("pulse", _Kept.PULSE)):
        yield _Row(_Do.KEEP, _register(register), kept.value)


def _offset() -> Iterable[_Row]:
    yield _input("thousandths", "a")
    yield _input("back", "back")
    yield _Row(_Do.RUN, _TABLE["offset"])


def _home(axis: int) -> Iterable[_Row]:
    yield _setting(130 + axis, "distance")
    yield _setting(27, "distance", _NEAR)
    yield _setting(25, "feed")
    yield _setting(24, "feed", _SLOW)
    yield _input("from_switch", "from_home")
    yield from _offset()
    yield _Row(_Do.RUN, _TABLE[f"offset_{'xyz'[axis]}"])
    yield from _rest_of_line()


def _home_place(axis: int) -> Iterable[_Row]:
    yield _setting(130 + axis, "distance")
    yield from _offset()
    yield _setting(100 + axis, "a")
    yield _Row(_Do.RUN, _TABLE["home"])
    yield _Row(_Do.KEEP, _register("a"), _Kept.SWITCH.value)


def _home_wait() -> Iterable[_Row]:
    yield _setting(26, "a")
    yield _Row(_Do.RUN, _TABLE["wait"])
    yield _Row(_Do.HEADER, 0, BlockWord.HEADER)
    yield _Row(_Do.STORE, _register("product.low"), BlockWord.EXTRA)
    yield from _zero_gain()
    yield from _zero_limit()


def _keep_places(first: _Kept) -> Iterable[_Row]:
    """Keep positions: those of a report may be from the origin of work."""
    for name in "xyz":
        yield _Row(_Do.ZERO, 0, _register(f"to_{name}"))
    if first == _Kept.X:
        yield _Row(_Do.RUN_WORK, _TABLE["work"])
    yield _Row(_Do.RUN, _TABLE["round"])
    for axis, name in enumerate("xyz"):
        yield _Row(_Do.KEEP, _register(f"position_{name}"), first.value + axis)


def _steps() -> Iterable[_Row]:
    yield _input("unit", "unit")
    for name in "xyz":
        yield _input(f"steps_now_{name}", f"steps_now_{name}")


def _report() -> Iterable[_Row]:
    yield from _steps()
    for name in "speed_now", "spindle":
        yield _input(name, name)
    yield _Row(_Do.RUN, _TABLE["report"])
    for name, kept in ("speed_now", _Kept.FEED), ("spindle", _Kept.SPINDLE):
        yield _Row(_Do.KEEP, _register(name), kept.value)
    yield from _keep_places(_Kept.X)


def _origins() -> Iterable[_Row]:
    yield _input("unit", "unit")
    for axis, name in enumerate("xyz"):
        for register in "origin", "position":
            yield _Row(_Do.LOAD, Operand.ORIGIN + axis, _register(f"{register}_{name}"))
    yield from _keep_places(_Kept.ORIGIN_X)


def _begin() -> Iterable[_Row]:
    yield from _steps()
    yield _Row(_Do.RUN, _TABLE["report"])
    yield _Row(_Do.RUN, _TABLE["begin"])
    for axis, name in enumerate("xyz"):
        yield _Row(_Do.POSITION, _register(f"position_{name}"), axis)
    yield from _origins()
    yield _Row(_Do.HEADER, 0, BlockWord.HEADER)
    yield from _places()
    yield from _zero_gain()
    yield from _zero_limit()


SLOT = 8
"""A procedure begins at a multiple of this."""


_PROCEDURES = {
    "BEGIN": (*_begin(),),
    "REPORT": (*_report(),),
    "LINE": (*_line(),),
    "DWELL": (*_event(Operand.DWELL, stops=True),),
    "EVENT": (*_event(Operand.SPEED, stops=False),),
    "STOPPED_EVENT": (*_event(Operand.SPEED, stops=True),),
    "ORIGIN": (*_origins(),),
    "CHECK_ARC": (*_check(),),
    "ARC": (*_arc(),),
    "JOG": (*_jog(),),
    "CHECK_JOG": (*_check_jog(),),
    "CONFIGURE": (*_configure(),),  # those behind it are of homing
    "HOME_X": (*_home(0),),
    "HOME_Y": (*_home(1),),
    "HOME_Z": (*_home(2),),
    "PLACE_X": (*_home_place(0),),
    "PLACE_Y": (*_home_place(1),),
    "PLACE_Z": (*_home_place(2),),
    "HOME_WAIT": (*_home_wait(),),
}

_SLOTS = dict(zip(_PROCEDURES, accumulate(
    (-(-len(rows) // SLOT) for rows in _PROCEDURES.values()), initial=0), strict=False))
"""Where each procedure begins, in slots."""


class _Procedure(enum.Enum, shape=unsigned(6)):
    """A procedure, by where it begins."""

    BEGIN = _SLOTS["BEGIN"]
    REPORT = _SLOTS["REPORT"]
    LINE = _SLOTS["LINE"]
    DWELL = _SLOTS["DWELL"]
    EVENT = _SLOTS["EVENT"]
    STOPPED_EVENT = _SLOTS["STOPPED_EVENT"]
    ORIGIN = _SLOTS["ORIGIN"]
    CHECK_ARC = _SLOTS["CHECK_ARC"]
    ARC = _SLOTS["ARC"]
    JOG = _SLOTS["JOG"]
    CHECK_JOG = _SLOTS["CHECK_JOG"]
    CONFIGURE = _SLOTS["CONFIGURE"]
    HOME_X = _SLOTS["HOME_X"]
    HOME_Y = _SLOTS["HOME_Y"]
    HOME_Z = _SLOTS["HOME_Z"]
    PLACE_X = _SLOTS["PLACE_X"]
    PLACE_Y = _SLOTS["PLACE_Y"]
    PLACE_Z = _SLOTS["PLACE_Z"]
    HOME_WAIT = _SLOTS["HOME_WAIT"]


_EVENTS = {
    GCodeActionKind.DWELL: (_Procedure.DWELL, BlockKind.DWELL),
    GCodeActionKind.PAUSE: (_Procedure.STOPPED_EVENT, BlockKind.PAUSE),
    GCodeActionKind.END: (_Procedure.STOPPED_EVENT, BlockKind.END),
}


class GCodePlanner(wiring.Component):
    """Makes blocks of actions, one after the other.

    An action is done when all words of its block are written, and is taken then; one without a
    block, such as a motion to where it starts, at once. Spindle and coolant go on while it moves: a
    block of OUTPUTS has the highest speed of the motion before it, but the second of two without
    motion between them stops it, so that blocks of motion are never far from each other. Dwell,
    pause and end stop motion.

    Between two actions, and before the first, it reports or begins when it is asked to: both
    compute where the axes are, by their steps; to begin makes that the start of the next motion, in
    the formulas, in the queue and in the interpreter. It also takes the settings, and serves a
    homing cycle.

    With soft limits a motion that would leave the travel, which is from 0 down, is not made, but
    ``beyond`` becomes 1, and nothing is done from then on but a reset. Of an arc that is looked at
    as a whole.

    Its procedures are rows without jumps, six clocks each, or seven; tables of formulas take their
    own time.

    Parameters
    ----------
    line : Line
        Settings of the machine.
    gap : int
        Least number of clocks from the end of a STEP pulse to the next, and those by which that may
        be early.
    motors : int
        Axes that may ask one motor for steps.
    width : int
        Bits of an operand.

    Members
    -------
    actions : In(stream.Signature(GCodeAction))
        What is to be done.
    operand_address, operand : Out(6), In(signed(width))
        The operands of the action, a clock after their address.
    verdict : Out(6)
        Error of an arc, when its CHECK_ARC is taken; 1 for a jog out of the travel, 0 for another,
        when its CHECK_JOG is.
    configure, configured : In(1), Out(1)
        Take the settings, until ``configured``, which is one clock; ``verdict`` is then 0, or 1 if
        the drivers cannot make the highest speed of an axis. Only while nothing moves and no block
        waits, and then it has to begin.
    setting_address, setting : Out(6), In(27)
        A setting, a clock after its address in the store.
    steps_per_metre : Out(27) x 3
        As the settings have them.
    lengths, backlash : Out(31) x 3, Out(21) x 3
        Travel and backlash of each axis in steps.
    filter, pulse : Out(20), Out(16)
        Clocks of $201, and of $0.
    homing, homed : In(HOMING), Out(1)
        Serve a homing cycle, until ``homed``, which is one clock: the block of a line is
        committed, or ``switch`` is the place.
    switch : Out(signed(36))
        Steps from 0 to a switch.
    feed_override, rapid_override : In(8)
        In percent: with these the block is planned, unless it is of a jog, a probing or a homing
        cycle.
    soft, beyond : In(1), Out(1)
        Soft limits; a motion would have left the travel.
    words : Out(stream.Signature)
        Words of blocks, for a queue of blocks of 16 words of 36 bits.
    room : In(1)
        There are two places in the queue; otherwise no action is begun.
    steps, speed, spindle_speed : In(signed(36)) x 3, In(31), In(36)
        Steps of each axis since power-up, the speed in nm/s and that of the spindle in 10**-6
        rev/min: what is reported.
    report, reported : In(1), Out(1)
        Compute the report, until ``reported``, which is one clock.
    work, inches : In(1)
        Its positions are in the coordinates of work, not of the machine; positions, also those of
        origins, are in 1/10000 inch, and the speed in 1/10 inch/min. Constant meanwhile.
    shown_address, shown_read, shown : In(4), In(1), Out(signed(27))
        Read a `ReportNumber`, which is out from the second clock on until another is read: as they
        were with the last report, or with the last origin. A procedure that keeps a number waits
        meanwhile.
    origin_changed : Out(1)
        The origin may be another from this clock on.
    begin, begun : In(1), Out(1)
        Begin, until ``begun``, which is one clock. Only while nothing moves and no block waits.
    positions : Out(stream.Signature)
        Position of each axis in nm, for the interpreter, when it begins.
    fault : Out(1)
        A state register was upset. Stays until reset.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, line: Line | None = None, gap: int = 1, motors: int = 1,
                 width: int = 44) -> None:
        self.line = line or Line()
        self.gap = in_range("gap", gap, 1, MAX_GAP)
        self.motors = in_range("motors", motors, 1, 2)
        self.width = in_range("width", width, WIDTH, 64)
        super().__init__({
            "actions": In(stream.Signature(GCodeAction)),
            "operand_address": Out(6), "operand": In(signed(self.width)), "verdict": Out(6),
            "configure": In(1), "configured": Out(1),
            "setting_address": Out(range(len(SETTINGS))), "setting": In(SETTING_BITS),
            "steps_per_metre": Out(SETTING_BITS).array(3),
            "filter": Out(FILTER_BITS), "pulse": Out(PULSE_BITS),
            "lengths": Out(LENGTH_BITS).array(3),
            "backlash": Out(range(MAX_BACKLASH + 1)).array(3),
            "homing": In(HOMING), "homed": Out(1), "switch": Out(signed(WIDTH)),
            "soft": In(1), "beyond": Out(1),
            "words": Out(stream.Signature(data.StructLayout({
                "address": range(BLOCK_WORDS + 4), "data": WIDTH, "last": 1}))),
            "room": In(1), "steps": In(signed(WIDTH)).array(3), "speed": In(31),
            "spindle_speed": In(WIDTH),
            "feed_override": In(OVERRIDE_BITS), "rapid_override": In(OVERRIDE_BITS),
            "report": In(1), "reported": Out(1), "work": In(1), "inches": In(1),
            "shown_address": In(SHOWN_BITS), "shown_read": In(1), "shown": Out(signed(UM_BITS)),
            "origin_changed": Out(1),
            "begin": In(1), "begun": Out(1),
            "positions": Out(stream.Signature(data.StructLayout({
                "axis": 2, "value": signed(self.width)}))),
            "fault": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.formulas = formulas = gcode_formulas(
            self.line, gap=self.gap, motors=self.motors)
        rows = _rows()
        m.submodules.rows = rom = memory.Memory(shape=ROW, depth=len(rows), init=rows)
        following = rom.read_port()
        place = Signal(range(len(rows)))
        row = Signal(ROW)
        value = Signal(WIDTH, init=HIGHEST)  # so that a reset sets it, as what is too large does
        zero = Signal()  # it was in the clock before
        operand = Signal.like(self.operand)  # a register behind the memory
        # It is 0 at rest, so that the adder that counts it also takes the first.
        advance = Signal.like(place)
        m.d.sync += place.eq(place + advance)
        m.d.comb += following.addr.eq(place)
        m.d.sync += [operand.eq(self.operand), zero.eq(value == 0)]

        procedure = Signal(_Procedure)
        header = Signal(BlockHeader)
        committed = Signal()  # a block, by this procedure
        outputs_last = Signal()  # the last block was one of outputs
        rapid = Signal()
        m.d.comb += rapid.eq(header.override == OverrideKind.RAPID)
        modes = self.actions.p.modes
        programmed = Signal(FEED_BITS)
        inverse = Signal()  # of a motion, long before it is looked at
        m.d.sync += inverse.eq(modes.inverse & ~rapid)
        kept = {_Kept.LOG2_TICKS: header.log2_ticks,
                _Kept.VERDICT: self.verdict, _Kept.ARC: header.arc,
                _Kept.CLOCKWISE: header.clockwise, _Kept.CHANNELS: header.channel,
                _Kept.SHIFT: header.shift, _Kept.SWITCH: self.switch,
                _Kept.FILTER: self.filter, _Kept.PULSE: self.pulse, _Kept.PROGRAMMED: programmed,
                **{_Kept(first.value + axis): registers[axis] for first, registers in (
                    (_Kept.STEPS_X, self.steps_per_metre), (_Kept.LENGTH_X, self.lengths),
                    (_Kept.BACKLASH_X, self.backlash)) for axis in range(3)}}
        # One port, which does not write while it reads: else there would be a bypass around it.
        m.submodules.shown = shown = memory.Memory(shape=signed(UM_BITS), depth=1 << SHOWN_BITS,
                                                   init=[], attrs={"ram_style": "block"})
        keeps, show = shown.write_port(), shown.read_port()
        m.d.comb += [
            show.addr.eq(Mux(self.shown_read, self.shown_address, row.destination)),
            show.en.eq(self.shown_read),
            keeps.addr.eq(show.addr), keeps.data.eq(value),
        ]
        m.d.sync += self.shown.eq(show.data)
        request = self.homing
        number = Signal(WIDTH)
        flag = Array([request.back, request.from_switch,
                      modes.motion == GCodeMotion.CLOCKWISE, modes.plane])[row.source[:2]]
        override = override_of(
            header.override, feed=self.feed_override, rapid=self.rapid_override) << OVERRIDE_SHIFT
        m.d.comb += number.eq(
            Mux(row.source[2], flag, 0) | Mux(row.source[3], request.thousandths, 0)
            | Mux(row.source[4], Mux(self.inches, INCH, UM), 0) | Mux(row.source[5], override, 0))
        inputs = [*self.steps, self.spindle_speed, self.speed, header.as_value(), self.setting,
                  number]
        code = Signal.like(row.input)
        other = Signal(WIDTH)  # what comes neither from a register nor an operand, a clock later
        m.d.sync += [code.eq(row.input), other.eq(choose(inputs, code, WIDTH))]
        with m.If((row.do == _Do.FEED) & rapid):
            m.d.sync += code.eq(ALL_ONES)
        with m.If(~row.operand):
            m.d.sync += operand.eq(0)
        place_u, place_v = (Mux(modes.plane == 0, first, Mux(modes.plane == 1, second, third))
                            for first, second, third in ((0, 2, 1), (1, 0, 2)))
        into_register = Signal()
        m.d.comb += [
            self.operand_address.eq(Mux(
                row.do == _Do.CENTRE_U, Operand.CENTRE + place_u,
                Mux(row.do == _Do.CENTRE_V, Operand.CENTRE + place_v, row.source))),
            formulas.address.eq(Mux(into_register, row.destination, row.source)),
            formulas.value.eq(value), formulas.table.eq(row.source),
            self.words.p.address.eq(row.destination), self.words.p.data.eq(value),
            self.words.p.last.eq(row.destination == PLAN_LIMIT + 1),
            self.positions.p.axis.eq(row.destination), self.positions.p.value.eq(
                value.as_signed()),
        ]

        bits = iter(programmed)
        for word, lowest, count in FEED_LOW, FEED_HIGH:
            with m.If(row.destination == word):
                m.d.comb += self.words.p.data[lowest:].eq(Cat(next(bits) for _ in range(count)))

        def begin(which: _Procedure, kind: BlockKind = BlockKind.MOTION) -> None:
            m.d.sync += [procedure.eq(which), header.kind.eq(kind), committed.eq(0)]
            m.next = "LOOK-UP"

        def begin_by_axis(first: _Procedure, *others: _Procedure) -> None:
            begin(first)
            for axis, which in enumerate(others, 1):
                with m.If(request.axis == axis):
                    begin(which)

        ends = Signal()  # the procedure is through, which is told in the next clock
        m.d.comb += self.setting_address.eq(row.source)
        m.d.sync += [
            self.actions.ready.eq(ends & (procedure != _Procedure.BEGIN)
                                  & (procedure != _Procedure.REPORT)
                                  & (procedure.as_value() < _Procedure.CONFIGURE.value)),
            self.configured.eq(ends & (procedure == _Procedure.CONFIGURE)),
            self.homed.eq(ends & (procedure.as_value() > _Procedure.CONFIGURE.value)),
            self.reported.eq(ends & (procedure == _Procedure.REPORT)),
            self.begun.eq(ends & (procedure == _Procedure.BEGIN)),
            self.origin_changed.eq(ends & ((procedure == _Procedure.BEGIN)
                                           | (procedure == _Procedure.ORIGIN))),
        ]

        # What is asked for, a clock later
        configure = Signal()
        starts = Signal()
        report = Signal()
        homing = Signal(HomingRequest)
        action = Signal()
        kind = Signal.like(self.actions.p.kind)
        by_radius = Signal()
        m.d.sync += [each.eq(0) for each in (configure, starts, report, homing, action)]
        m.d.sync += [kind.eq(self.actions.p.kind), by_radius.eq(self.actions.p.by_radius)]

        def finish() -> None:
            m.next = "FETCH"
            with m.If(row.last):
                m.next = "END"

        with m.FSM(name="planner_state") as fsm:
            with m.State("IDLE"):
                m.d.sync += [
                    header.outputs.clockwise.eq(modes.clockwise),
                    header.outputs.counter_clockwise.eq(modes.counter_clockwise),
                    header.outputs.mist.eq(modes.mist), header.outputs.flood.eq(modes.flood),
                    header.override.eq(Mux(kind == GCodeActionKind.RAPID, OverrideKind.RAPID, Mux(
                        (kind == GCodeActionKind.JOG) | (kind == GCodeActionKind.PROBE),
                        OverrideKind.NONE, OverrideKind.FEED))),
                    configure.eq(self.configure), starts.eq(self.begin), report.eq(self.report),
                    homing.eq(self.homing.kind), action.eq(self.actions.valid & self.room),
                ]
                with m.If(configure):
                    begin(_Procedure.CONFIGURE)
                with m.Elif(starts):
                    begin(_Procedure.BEGIN, BlockKind.PLACE)
                with m.Elif(report):
                    begin(_Procedure.REPORT)
                with m.Elif(homing == HomingRequest.PLACE):
                    begin_by_axis(_Procedure.PLACE_X, _Procedure.PLACE_Y, _Procedure.PLACE_Z)
                with m.Elif(homing == HomingRequest.WAIT):
                    begin(_Procedure.HOME_WAIT, BlockKind.DWELL)
                with m.Elif(homing == HomingRequest.MOVE):
                    m.d.sync += header.override.eq(OverrideKind.NONE)
                    begin_by_axis(_Procedure.HOME_X, _Procedure.HOME_Y, _Procedure.HOME_Z)
                with m.Elif(action):
                    with m.Switch(kind):
                        with m.Case(GCodeActionKind.RAPID, GCodeActionKind.LINE,
                                    GCodeActionKind.PROBE):
                            begin(_Procedure.LINE)
                        for event, (which, block) in _EVENTS.items():
                            with m.Case(event):
                                begin(which, block)
                        with m.Case(GCodeActionKind.SPINDLE, GCodeActionKind.COOLANT):
                            begin(_Procedure.EVENT, BlockKind.OUTPUTS)
                            with m.If(outputs_last):
                                begin(_Procedure.STOPPED_EVENT, BlockKind.OUTPUTS)
                        with m.Case(GCodeActionKind.OFFSETS):
                            begin(_Procedure.ORIGIN)
                        with m.Case(GCodeActionKind.JOG):
                            begin(_Procedure.JOG)
                        with m.Case(GCodeActionKind.CHECK_JOG):
                            begin(_Procedure.CHECK_JOG)
                        with m.Case(GCodeActionKind.CHECK_ARC):
                            begin(_Procedure.CHECK_ARC)
                        with m.Case(GCodeActionKind.ARC):
                            begin(_Procedure.ARC)
            with m.State("LOOK-UP"):
                m.d.comb += advance.eq(procedure.as_value() * SLOT)
                m.next = "FETCH"
            with m.State("FETCH"):
                m.next = "ROW"
            with m.State("ROW"):
                m.d.sync += row.eq(following.data)
                m.d.comb += advance.eq(1)
                m.next = "ADDRESS"
            with m.State("ADDRESS"):
                m.next = "READ"
                with m.If(row.do.as_value()[3:] == 0b10):  # RUN, of one kind or another
                    finish()
                    runs = Array([Const(1), inverse, self.soft, by_radius, *[self.work] * 4])
                    with m.If(runs[row.do.as_value()[:3]]):
                        m.d.comb += formulas.start.eq(1)
                        m.next = "COMPUTE"
            with m.State("READ"):
                m.next = "WORD"
            with m.State("WORD"):  # the register or the operand has come
                m.d.sync += value.eq(Mux(row.word, formulas.word, 0) | operand[:WIDTH] | other)
                m.next = "ACT"
                with m.If(row.do == _Do.KEEP):
                    m.next = "KEEP"
            with m.State("KEEP"):
                with m.Switch(row.destination):
                    for which, register in kept.items():
                        with m.Case(which.value):
                            m.d.sync += register.eq(value)
                with m.If(~self.shown_read):
                    m.d.comb += keeps.en.eq(row.destination[SHOWN_BITS:] == 0)
                    finish()
            with m.State("ACT"):
                with m.Switch(row.do.as_value()):
                    with m.Case("00---"):  # into a register
                        # No source of these but settings has bits as high.
                        m.d.comb += [formulas.write.eq((~row.source[6] | request.near)
                                                       & (~row.source[7] | request.slow)),
                                     into_register.eq(1)]
                        finish()
                    with m.Case("01---"):  # into a word of the block
                        m.d.comb += [self.words.valid.eq(1)]
                        with m.If(self.words.ready):
                            m.d.sync += committed.eq(committed | self.words.p.last)
                            finish()
                    with m.Case(_Do.SKIP.value, _Do.GUARD.value):
                        m.next = "DECIDE"
                    with m.Default():  # POSITION
                        m.d.comb += self.positions.valid.eq(1)
                        with m.If(self.positions.ready):
                            finish()
            with m.State("DECIDE"):
                finish()
                with m.If((row.do == _Do.SKIP) & zero):
                    m.next = "END"
                with m.If((row.do == _Do.GUARD) & ~zero & self.soft):
                    m.next = "BEYOND"
            with m.State("COMPUTE"):
                with m.If(formulas.done):
                    finish()
            with m.State("END"):
                m.d.comb += ends.eq(1)
                m.d.sync += place.eq(0)
                with m.If(committed):
                    m.d.sync += outputs_last.eq(header.kind == BlockKind.OUTPUTS)
                m.next = "TELL"
            with m.State("TELL"):
                m.next = "IDLE"
            with m.State("BEYOND"):
                m.d.comb += self.beyond.eq(1)
            with m.State("FAULT"):
                pass
        with m.If(fsm.ongoing("WORD") & _too_large(operand)):
            m.d.sync += value.eq(HIGHEST)
        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT") | formulas.fault)
        return m


def _rows() -> list[dict[str, object]]:
    """Return the rows of all procedures."""
    inputs = {_Do.SETTING: "setting", _Do.HEADER: "header"}
    rows: list[dict[str, object]] = []
    for procedure, steps in _PROCEDURES.items():
        rows += [{}] * (_SLOTS[procedure] * SLOT - len(rows))
        for row in steps:
            name = inputs.get(row.do, row.input)
            rows.append({**row._asdict(), "last": int(row is steps[-1]),
                         "operand": row.do in _OPERANDS, "word": row.do in _WORDS,
                         "input": choice_code(_INPUTS.index(name)) if name else 0})
    return rows


def _too_large(operand: Signal):
    """Return whether an operand has more bits than a word, which is then the highest number."""
    return (operand[-1] == 0) & operand[WIDTH - 1:].any()
