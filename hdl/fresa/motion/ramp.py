"""Moving to a position with a limited acceleration."""

from collections.abc import Sequence
from fractions import Fraction
from math import sqrt

from amaranth import Module, Mux, ResetSignal, Signal, signed, unsigned
from amaranth.lib import data, memory, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from .position import MoveTo

__all__ = ["MAX_ACCELERATION", "MAX_LEVELS", "Ramp", "ramp_rates"]

MAX_LEVELS = 4096
"""Largest number of steps to the highest rate: eight block RAMs of a Spartan-3E."""

MAX_ACCELERATION = 1_000_000
"""Highest acceleration, in steps/s²."""


def ramp_rates(*, acceleration: int, top: int, modulus: int, clock: int) -> tuple[int, ...]:
    """Return the rates of a constant acceleration from standstill, the highest last.

    A motor accelerated by a from standstill is at step n after sqrt(2 n / a), and then its speed is
    sqrt(2 a n). So from step n - 1 to step n it takes sqrt(2 / a) (sqrt(n) - sqrt(n - 1)), which is
    a rate of sqrt(a / 2) (sqrt(n) + sqrt(n - 1)): the mean of the speeds at both. These are the
    rates, rounded down.

    Parameters
    ----------
    acceleration : int
        In steps/s², to ``MAX_ACCELERATION``. It is so high that the first rate is not 0.
    top : int
        Highest rate, at which the ramp ends. It takes ``MAX_LEVELS`` steps at most to get there.
    modulus : int
        Rates are in steps in so many clocks, as those of :class:`RateGenerator`.
    clock : int
        Clocks of a second.

    Raises
    ------
    ValueError
        If ``acceleration`` is out of range, ``top`` is no rate, or it takes more steps.
    """
    unit = Fraction(modulus, clock)  # rate of a step/s
    least = -(-2 // unit**2)
    acceleration = in_range("acceleration", acceleration, int(least), MAX_ACCELERATION)
    scale = float(unit) * sqrt(acceleration / 2)

    def rate(step: int) -> int:
        return int(scale * (sqrt(step) + sqrt(step - 1)))

    top = in_range("top", top, 1, modulus)
    if rate(MAX_LEVELS) < top:
        raise ValueError(f"at {acceleration} steps/s² it takes more than {MAX_LEVELS} steps to the "
                         "highest rate: have more acceleration, or a lower rate")
    rates: list[int] = []
    while not rates or rates[-1] < top:
        rates.append(min(top, rate(len(rates) + 1)))
    return tuple(rates)


class Ramp(wiring.Component):
    """A :class:`MoveTo` that speeds up and slows down, so that a motor with a load can follow.

    ``level`` is the number of steps in which it can stop, and bounds the rate: at level n between
    the rates of step n - 1 and step n of the ramp, at level 0 up to that of step 1. Within these
    bounds the rate is the requested one. With each step the level goes down or up by one, or stays:

    - down, if there are fewer steps than that to the target, if the target is behind, or if the
      requested rate belongs to a lower level;
    - up, if a higher rate is requested, and there is room to slow down before the target.

    So a target that does not change is never passed. One that is set too near during the movement,
    or behind, is: the motor slows down along the ramp, stops, and comes back. Since it could always
    have stopped at an earlier target, or before it, the position never leaves the range of targets.
    It stops and reverses at level 0 only; a requested rate up to that of step 1 needs no ramp.

    The level is updated with each step that is made, by the present target and requested rate; the
    rate follows the requested one in the same clock, within its bounds. Without ``run`` the motor
    has no power: no step is requested, and the level is 0 one clock later, as after a reset.

    Parameters
    ----------
    rates : sequence of int
        Rate of each step from standstill, such as :func:`ramp_rates`: 1 to ``MAX_LEVELS`` of them,
        from 1 up, none below that before it. A rate above the last is made as that.
    max_rate : int
        Highest requested rate, from 1.
    width : int
        Bits of positions, see :class:`MoveTo`.

    Members
    -------
    target : In(signed(width))
        Target position.
    run : In(1)
        Move towards it.
    requested_rate : In(range(max_rate + 1))
        Requested rate, as for :class:`RateGenerator`.
    moved : In(1)
        The requested step is made in this clock. Only with ``step``, and neither in a reset nor in
        the first clock.
    step : Out(1)
        Step request.
    direction : Out(1)
        1 up, 0 down.
    rate : Out(range(rates[-1] + 1))
        Present rate; 0 in the first clock.
    position : Out(signed(width))
        Present position, in steps.
    level : Out(range(len(rates) + 1))
        Steps in which it can stop.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, rates: Sequence[int], max_rate: int, width: int = 32) -> None:
        in_range("number of rates", len(rates), 1, MAX_LEVELS)
        self.rates: list[int] = []
        for number, rate in enumerate(rates, start=1):
            least = self.rates[-1] if self.rates else 1
            self.rates.append(in_range(f"rate {number}", rate, least, 1 << 40))
        self.max_rate = in_range("max_rate", max_rate, 1, 1 << 40)
        self.width = in_range("width", width, 2, 64)
        super().__init__({
            "target": In(signed(self.width)), "run": In(1),
            "requested_rate": In(range(self.max_rate + 1)),
            "moved": In(1), "step": Out(1), "direction": Out(1),
            "rate": Out(range(self.rates[-1] + 1)), "position": Out(signed(self.width)),
            "level": Out(range(len(self.rates) + 1)),
        })

    def elaborate(self, platform) -> Module:
        m = Module()

        # Slowest and fastest rate of each level. What starts and stops without a ramp does so with
        # the rate of step 1.
        fastest = [self.rates[0], *self.rates]
        bits = unsigned(len(self.rate))
        m.submodules.table = table = memory.Memory(
            shape=data.StructLayout({"slowest": bits, "fastest": bits}), depth=len(fastest),
            init=[{"slowest": low, "fastest": high}
                  for low, high in zip([0, *fastest], fastest, strict=False)])
        bounds = table.read_port()
        known = Signal(reset_less=True)  # the table has not been read at power-up
        m.d.sync += known.eq(1)
        above = Signal()
        below = Signal()
        m.d.comb += [
            above.eq(self.requested_rate > bounds.data.fastest),
            below.eq(self.requested_rate <= bounds.data.slowest),
        ]
        with m.If(known):
            m.d.comb += self.rate.eq(Mux(above, bounds.data.fastest,
                                         Mux(below, bounds.data.slowest, self.requested_rate)))

        m.submodules.move = move = MoveTo(width=self.width)
        rests = Signal()
        way = Signal()
        up = Signal()
        left = Signal(signed(self.width + 1))  # steps to the target after the present one
        m.d.comb += [
            rests.eq(self.level == 0),
            up.eq(Mux(rests, self.target > self.position, way)),
            left.eq(Mux(up, self.target, self.position)
                    - Mux(up, self.position, self.target) - 1),
            move.target_n.eq(~Mux(rests | (left >= 0), self.target,
                                  self.position + Mux(up, 1, -1))),
            move.run.eq(self.run),
            move.moved.eq(self.moved),
            self.step.eq(move.step),
            self.direction.eq(move.direction),
            self.position.eq(move.position),
        ]

        # The bounds are looked up together with the level, so that they are always its own.
        goes_to = Signal.like(self.level)
        m.d.comb += [goes_to.eq(self.level), bounds.addr.eq(goes_to)]
        with m.If(~self.run | ResetSignal()):
            m.d.comb += goes_to.eq(0)
        with m.Elif(self.moved):
            m.d.sync += way.eq(up)
            with m.If(~rests & (below | (left < self.level))):
                m.d.comb += goes_to.eq(self.level - 1)
            with m.Elif(above & (left > self.level) & (self.level != len(self.rates))):
                m.d.comb += goes_to.eq(self.level + 1)
        m.d.sync += self.level.eq(goes_to)

        return m
