"""Model of the planning of lines, in whole numbers: what blocks have, to the bit.

Written from what the formulas stand for: lengths are mantissas of 36 bits, quotients and roots are
rounded down, and what is too large is the highest number that has a place.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isqrt

__all__ = ["MotionBlock", "PlanSettings", "Planner"]

CORNER = 34_000_000_000
BEYOND = (1 << 62) - 1
WORD = (1 << 36) - 1


@dataclass(frozen=True)
class PlanSettings:
    """Settings of a machine: clock in Hz, and for each axis nm/s, nm/s² and steps per metre."""

    clock: int
    speeds: Sequence[int]
    accelerations: Sequence[int]
    steps: Sequence[int]
    deviation: int  # nm

    @classmethod
    def stored(cls, clock: int, store: Mapping[int, int], axes: int = 3) -> "PlanSettings":
        """Return those of settings in thousandths by their numbers, such as 110 for $110."""
        steps, speeds, accelerations = (
            [store[first + axis] for axis in range(axes)] for first in (100, 110, 120))
        return cls(clock, [each * 1000 // 60 for each in speeds],
                   [each * 1000 for each in accelerations], steps, store[11] * 1000)


@dataclass(frozen=True)
class MotionBlock:
    """A block of motion.

    Attributes
    ----------
    energy, modulus, log2_ticks : int
        As the speed profile has them.
    hundredth, fastest : int
        A hundredth of the feed in 2**-8 nm/s, and the speed that is never exceeded.
    nominal : int
        Square of the speed, by those and the override.
    gain, limit : int
        As the queue has them.
    place : tuple of int
        Of each axis at the end, 2**-8 step and modulo 2**36, from a corner far below.
    """

    energy: int
    modulus: int
    log2_ticks: int
    hundredth: int
    fastest: int
    nominal: int
    gain: int
    limit: int
    place: tuple[int, ...]


def _vector(distances: Sequence[int]) -> tuple[list[int], int, int, int]:
    """Return mantissas of distances, their exponent, the sum of their squares and its root."""
    exponent = 36 - max(distances).bit_length()
    mantissas = [(each << exponent) >> 1 for each in distances]
    square = sum(each * each for each in mantissas)
    return mantissas, exponent, square, isqrt(square)


def _along(limits: Sequence[int], mantissas: Sequence[int]) -> int:
    return min(min((limit << 36) // each, WORD) if each else WORD
               for limit, each in zip(limits, mantissas, strict=True))


class Planner:
    """Plans lines, each from the end of the one before.

    Parameters
    ----------
    settings : PlanSettings
        Of the machine.
    position : sequence of int
        Where the first line begins, in nm; it begins at rest.

    Attributes
    ----------
    feed_override, rapid_override : int
        In percent.
    """

    def __init__(self, settings: PlanSettings, position: Sequence[int] = (0, 0, 0)) -> None:
        self.settings = settings
        self.position = tuple(position)
        self.unit = (0, 0, 0)
        self.nominal = 0
        self.feed_override = self.rapid_override = 100

    def stop(self) -> None:
        """Let the next line begin at rest."""
        self.nominal = 0

    def places(self, position: Sequence[int]) -> tuple[int, ...]:
        """Return where a position is, in 2**-8 of a step, rounded down."""
        return tuple(
            (at + CORNER) * 256 * steps // 10**9 % (WORD + 1)
            for at, steps in zip(position, self.settings.steps, strict=True))

    def line(self, target: Sequence[int], feed: int | None, *, inverse: bool = False
             ) -> MotionBlock | None:
        """Plan a line, with a feed in nm/s if not as fast as can be; None if it has no length.

        With `inverse` the feed is motions in 10**-6 a minute.
        """
        of = self.settings
        change = [to - at for to, at in zip(target, self.position, strict=True)]
        if not any(change):
            return None
        mantissas, exponent, _, length = _vector([abs(each) for each in change])
        unit = tuple((abs(each) // each if each else 0) * ((mantissa << 34) // length)
                     for each, mantissa in zip(change, mantissas, strict=True))

        rapid = feed is None
        if inverse and feed is not None:
            feed = max(1, min((length * feed >> exponent) // 30_000_000, WORD))
        scaled = length * (of.clock << 8)
        fastest = min(_along(of.speeds, mantissas) * length >> 36,
                      scaled >> exponent + 14,  # 128 clocks at least
                      (1 << 31) - 1)
        if feed is None or feed >= 1 << 34:
            feed = fastest
        hundredth = max(28, -(-256 * feed // 100))
        nominal = self._nominal(hundredth, fastest, self.rapid_override if rapid
                                else self.feed_override)
        speed = min(hundredth, fastest)  # more than any override makes of the feed
        acceleration = min(_along(of.accelerations, mantissas) * length >> 36, (1 << 34) - 1)
        gain = 4 * acceleration * length >> exponent

        # 2 to 4 clocks a tick, at top speed, but 2**-11 nm at least; with little acceleration 2**-7
        shift, slow = 72 - scaled.bit_length(), 36 - speed.bit_length()
        ticks = slow + 28 - shift - ((scaled << shift) >> 36 < speed << slow)
        ticks = min(min(ticks, 46 if acceleration >= 5000 else 42) - exponent, 36)
        energy = gain >> ticks
        gain = energy << ticks
        limit = min(self._junction(unit), nominal, self.nominal)
        block = MotionBlock(energy, scaled >> ticks + exponent - 9, ticks, hundredth, fastest,
                            nominal, gain, limit, self.places(target))
        self.position, self.unit, self.nominal = tuple(target), unit, nominal
        return block

    @staticmethod
    def _nominal(hundredth: int, fastest: int, percent: int) -> int:
        """Return the squared speed of a block with an override."""
        return min(hundredth * percent >> 8, fastest)**2

    def _junction(self, unit: Sequence[int]) -> int:
        """Return the squared speed at which a corner may be passed."""
        turn = [abs(a - b) for a, b in zip(unit, self.unit, strict=True)]
        if not any(turn):
            return BEYOND
        mantissas, exponent, square, length = _vector(turn)
        quarter = square >> 2 * exponent  # of the squared length, in 2**-68
        cosine = isqrt((1 << 68) - quarter) if quarter <= 1 << 68 else 0
        part = 2 * cosine * (cosine + (1 << 34)) >> 36
        product = _along(self.settings.accelerations, mantissas) * (self.settings.deviation << 8)
        raised, shift = _normalised(product)
        raised_length, shift_length = _normalised(length << 36)
        quotient = min(raised * part // raised_length, WORD)
        down = shift + 9 - shift_length - 2 * exponent
        return min((quotient << 36) >> down, BEYOND) if down >= 0 else BEYOND


def _normalised(pair: int) -> tuple[int, int]:
    """Return the high word of a pair that is shifted until its highest bit is set, and by what."""
    shift = 72 - pair.bit_length()
    return (pair << shift) >> 36, shift
