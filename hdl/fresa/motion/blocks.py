"""Words of the blocks that a planner writes into a queue, and a loader reads."""

from enum import IntEnum

from amaranth import unsigned
from amaranth.lib import data, enum

__all__ = ["BLOCK_WORDS", "BlockHeader", "BlockKind", "BlockWord", "Outputs", "OverrideKind"]


class BlockKind(enum.Enum, shape=unsigned(3)):
    """What a block does."""

    MOTION = 0
    OUTPUTS = 1  # sets the outputs, at the end of the motion before it
    DWELL = 2
    PAUSE = 3  # waits for a start
    END = 4  # waits for the end of motion
    PLACE = 5  # sets the place from which the next motion starts; nothing moves


class OverrideKind(enum.Enum, shape=unsigned(2)):
    """Which override a motion obeys."""

    FEED = 0
    RAPID = 1
    NONE = 2


class Outputs(data.Struct):
    """Outputs that a program switches."""

    clockwise: unsigned(1)  # spindle
    counter_clockwise: unsigned(1)
    mist: unsigned(1)
    flood: unsigned(1)


class BlockHeader(data.Struct):
    """First word of a block. What is said of ticks, arcs and channels is that of a `Segment`."""

    kind: BlockKind
    outputs: Outputs
    log2_ticks: unsigned(6)
    arc: unsigned(1)
    clockwise: unsigned(1)
    channel: data.ArrayLayout(unsigned(2), 3)
    shift: unsigned(5)
    override: OverrideKind


class BlockWord(IntEnum):
    """Addresses of the words; where there are two, that of the high one, the low one follows.

    The programmed feed of a motion is in the highest bits of two words, see `FEED_LOW` and
    `FEED_HIGH`.

    Of a block that is no motion there are the header and ``EXTRA``, and of a PLACE the places.
    """

    HEADER = 0
    ENERGY = 1
    MODULUS = 3
    FASTEST = 5  # speed that is never exceeded, in nm/s
    HUNDREDTH = 6  # of the feed, in 2**-8 nm/s, which the override multiplies
    PLACE = 7  # of each axis, at the end, in 2**-8 step and modulo 2**36
    TURNS = 10
    X = 12
    Y = 13
    RESIDUAL = 14
    EXTRA = 15  # speed of the spindle in 10**-6 rev/min, or of a DWELL its time in us


BLOCK_WORDS = 16

FEED_LOW = (BlockWord.MODULUS, 14, 22)
FEED_HIGH = (BlockWord.ENERGY, 26, 10)
"""Words, lowest bits, and numbers of bits of a feed in nm/s: in front of what the words are for. A
rapid has all ones."""

FEED_BITS = FEED_LOW[2] + FEED_HIGH[2]
