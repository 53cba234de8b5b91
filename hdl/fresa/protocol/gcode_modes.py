"""What lines of G-code say: modes, and what else a line has."""

from enum import IntEnum

from amaranth import Value, unsigned
from amaranth.lib import data, enum

__all__ = ["LETTERS", "OF_JOG", "AxisUse", "GCodeLineState", "GCodeModes", "GCodeMotion",
           "ModalGroup", "NonModal", "ProgramFlow"]

LETTERS = "FIJKLNPRSTXYZ"
"""Letters of words that have a value, in the order in which the values are stored."""


class GCodeMotion(enum.Enum, shape=unsigned(4)):
    """Mode of motion: with bit 3 it probes, with bit 1 away, and with bit 0 without an alarm."""

    RAPID = 0
    LINE = 1
    CLOCKWISE = 2
    COUNTER_CLOCKWISE = 3
    NONE = 4
    PROBE_TOWARD = 8  # G38.2
    PROBE_TOWARD_NO_ERROR = 9
    PROBE_AWAY = 10
    PROBE_AWAY_NO_ERROR = 11  # G38.5


class GCodeModes(data.Struct):
    """What stays from line to line."""

    motion: GCodeMotion
    plane: unsigned(2)  # 0 XY, 1 ZX, 2 YZ
    relative: unsigned(1)
    inches: unsigned(1)
    inverse: unsigned(1)  # feed in motions per minute
    system: unsigned(3)  # 0 for G54
    clockwise: unsigned(1)  # the spindle turns
    counter_clockwise: unsigned(1)
    mist: unsigned(1)
    flood: unsigned(1)


class NonModal(enum.Enum, shape=unsigned(4)):
    """A command that counts for its line only."""

    NONE = 0
    DWELL = 1
    COORDINATES = 2
    HOME = 3
    SET_HOME = 4
    MACHINE = 5
    OFFSET = 6
    CLEAR_OFFSET = 7


class AxisUse(enum.Enum, shape=unsigned(2)):
    """What the axis words of a line are for."""

    NONE = 0
    MOTION = 1
    NON_MODAL = 2
    LENGTH = 3


class ModalGroup(IntEnum):
    """Modal groups: a line has one word of each at most."""

    NON_MODAL = 0
    MOTION = 1
    PLANE = 2
    DISTANCE = 3
    ARC_DISTANCE = 4
    FEED = 5
    UNITS = 6
    COMPENSATION = 7
    LENGTH = 8
    SYSTEM = 9
    PATH = 10
    FLOW = 11
    SPINDLE = 12
    COOLANT = 13


OF_JOG = ModalGroup.NON_MODAL, ModalGroup.DISTANCE, ModalGroup.UNITS
"""Groups of which a jog may have a word: of the first only G53."""


class ProgramFlow(enum.Enum, shape=unsigned(2)):
    """What follows a line."""

    GO = 0
    PAUSE = 1
    END = 2


class GCodeLineState(data.Struct):
    """What the words of a line have said so far."""

    modes: GCodeModes
    letters: unsigned(len(LETTERS))  # that have a value
    axes: AxisUse
    non_modal: NonModal
    second: unsigned(1)  # G30, not G28
    cancels: unsigned(1)  # G49
    flow: ProgramFlow
    p_whole: unsigned(8)  # saturated
    l_whole: unsigned(8)
    number_too_large: unsigned(1)  # N
    zero_feed: unsigned(1)
    too_long: unsigned(1)  # a length is beyond reach
    not_of_jog: unsigned(1)  # a word of a group of which no jog has one

    def has(self, letter: str) -> Value:
        """Return whether a letter has a value."""
        return self.letters[LETTERS.index(letter)]

    @property
    def given(self) -> Value:
        """Which of X, Y and Z are there."""
        return self.letters[LETTERS.index("X"):]
