"""A motor that winds a string and pays it out."""

from collections.abc import Sequence

from amaranth import Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from .divider import valid_period
from .phase import PhaseDriver
from .sequences import HALF_STEP, valid_sequence

__all__ = ["MAX_LENGTH_BITS", "StringMotor"]

MAX_LENGTH_BITS = 24
"""Most bits of the length of a string."""


class StringMotor(wiring.Component):
    """Makes its string as long as it shall be, half step by half step, and counts what it made.

    While ``follow`` is 1 it makes steps until the string has the length that is wanted, each when
    the coils have rested for a period. A step that is not wanted any more by then is not made. So
    no step is ever lost or left over, whatever the motor was kept from. Otherwise it makes the
    steps that are requested.

    Parameters
    ----------
    bits : int
        Bits of a length, from 4.
    period : int
        Least number of clocks between two steps: see :class:`PhaseDriver`.
    first : int
        How long the string is at power-up, and after a reset.
    sequence : sequence of int
        Coil words, ``HALF_STEP`` unless given.

    Members
    -------
    length : In(bits)
        How long the string shall be, in steps.
    follow : In(1)
        Make it so.
    step, longer : In(1)
        Make a step, as long as it is 1 and until ``moved``; pay string out. While ``follow`` is 0.
    zero, place : In(1)
        The string is as long as 0, or as ``length`` says; in this clock the motor makes no step.
    enable, inverted : In(1)
        Give the motor power; it turns the other way.
    moved : Out(1)
        A step is made in this clock.
    behind : Out(1)
        The string has not the length that it shall have.
    made : Out(bits)
        How long it is, in steps. It wraps.
    coils : Out(4)
        Coil word, or 0.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, bits: int, period: int, first: int = 0,
                 sequence: Sequence[int] = HALF_STEP) -> None:
        self.bits = in_range("bits of a length", bits, 4, MAX_LENGTH_BITS)
        self.period = valid_period(period)
        self.first = in_range("first length", first, 0, (1 << bits) - 1)
        self.sequence = valid_sequence(sequence)
        super().__init__({
            "length": In(bits), "follow": In(1), "step": In(1), "longer": In(1), "zero": In(1),
            "place": In(1), "enable": In(1), "inverted": In(1), "moved": Out(1), "behind": Out(1),
            "made": Out(bits, init=self.first), "coils": Out(4)})

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.driver = driver = PhaseDriver(sequence=self.sequence, period=self.period)
        sets = Signal()
        longer = Signal()
        m.d.comb += [
            sets.eq(self.zero | self.place),
            self.behind.eq(self.made != self.length),
            longer.eq(Mux(self.follow, self.made < self.length, self.longer)),
            driver.step.eq(Mux(self.follow, self.behind, self.step) & ~sets),
            driver.direction.eq(longer ^ self.inverted), driver.enable.eq(self.enable),
            self.moved.eq(driver.moved), self.coils.eq(driver.coils),
        ]
        with m.If(sets):
            m.d.sync += self.made.eq(Mux(self.zero, 0, self.length))
        with m.Elif(driver.moved):
            m.d.sync += self.made.eq(self.made + Mux(longer, 1, -1))
        return m
