"""Contract of the ramp: what a motor can follow, and that it ends at the target all the same."""

from amaranth import Array, Mux

from fresa.motion import Ramp, ramp_rates

from .contract import Bits, Case, Component, Contract

__all__ = ["RAMP"]

DOWN = "~rests & (below | (left < self.level))"
UP = "above & (left > self.level) & (self.level != len(self.rates))"


def describe(c: Contract, dut: Ramp) -> None:
    """Speed changes by a level a step, standing is at level 0, and no target that stays is passed.

    That it gets there: until it stands at the target it requests a step
    (``stops-at-target-only``); each brings it nearer, or takes it a level down
    (``nearer-or-slower``); once there is room to slow down there always is
    (``target-not-passed``); and the rate is 0 only if 0 is requested.
    """
    c.assume(~dut.moved | (dut.step & ~c.rst & c.past(1)))  # a driver makes what is requested
    fastest = Array([dut.rates[0], *dut.rates])[dut.level]
    slowest = Array([0, dut.rates[0], *dut.rates])[dut.level]
    above, below = dut.requested_rate > fastest, dut.requested_rate <= slowest
    moved, rests, level = c.past(dut.moved), dut.level == 0, c.past(dut.level)
    goes_on = c.past(dut.run & ~c.rst)
    stays = dut.target == c.past(dut.target)

    up = c.keep(1, name="last_way")
    with c.m.If(dut.moved):
        c.m.d.sync += up.eq(dut.direction)
    ahead = Mux(up, dut.target - dut.position, dut.position - dut.target)
    room = rests | (ahead >= dut.level)

    c.implication("one-level-per-step", "The level changes with a step, by one at most, or is 0 "
                  "with the power lost or a reset.", when=dut.level != level,
                  then=~goes_on & rests
                  | moved & (dut.level == level + 1) | moved & (dut.level + 1 == level))
    c.implication("turns-at-0", "The direction is kept while the level is not 0.",
                  when=~rests & dut.run, then=dut.step & (dut.direction == up))
    c.implication("stops-at-target-only", "With power a step is requested, except at level 0 at "
                  "the target.", when=dut.run & ~dut.step,
                  then=rests & (dut.position == dut.target))
    c.implication("target-not-passed", "While a target stays and there is room to stop before it, "
                  "there is room with the next clock too: it is not passed.",
                  when=c.past(room) & goes_on & stays, then=room)
    c.implication("nearer-or-slower", "Each step leads nearer to a target that stays or, where "
                  "there is no room to slow down, a level down.", when=moved & goes_on & stays,
                  then=Mux(c.past(room), _distance(dut) + 1 == c.past(_distance(dut)),
                           dut.level + 1 == level))
    _rates(c, dut, fastest, slowest)
    c.implication("slows-down", "At a rate above the requested one, with each step it "
                  "goes a level down.", when=moved & goes_on & c.past(below & ~rests),
                  then=dut.level + 1 == level)
    left = c.past(Mux(rests, _distance(dut), ahead)) - 1
    c.implication("speeds-up", "With each step it goes a level up if a higher rate is requested, "
                  "there is one, and there is room to slow down from it.",
                  when=moved & goes_on & c.past(above) & (level != len(dut.rates)),
                  then=(dut.level == level + 1) == (left > level))
    c.implication("speeds-up-only-on-request",
                  "It goes a level up only if a higher rate is requested.",
                  when=dut.level == level + 1, then=c.past(above))
    c.implication("power-lost", "Without power no step is requested, and the level is 0 with the "
                  "next clock; as after a reset.", when=~dut.run | ~goes_on,
                  then=(dut.run | ~dut.step) & (goes_on | rests | ~c.past(1)))
    _range(c, dut, up, rests)
    c.implication("direction-of-last-step", "The register of the direction is that of the last "
                  "step.",
                  when=~rests, then=c.signal("way") == up)


def _distance(dut: Ramp) -> Bits:
    return Mux(dut.target > dut.position, dut.target - dut.position, dut.position - dut.target)


def _rates(c: Contract, dut: Ramp, fastest: Bits, slowest: Bits) -> None:
    """State the relation of the rate to the level, and to what is requested."""
    known = c.past(1)
    c.invariant("level-in-range", "The level is one that has rates.",
                dut.level <= len(dut.rates), cover=dut.level == len(dut.rates))
    c.implication("no-faster-than-its-level", "The rate is never above the highest of the level.",
                  when=known, then=dut.rate <= fastest)
    c.implication("no-faster-than-requested", "The rate is above that requested only as the "
                  "lowest of the level.", when=known, then=(dut.rate <= dut.requested_rate)
                  | (dut.rate == slowest))
    c.implication("no-slower-than-requested", "The rate is below that requested only as the "
                  "highest of the level.", when=known, then=(dut.rate >= dut.requested_rate)
                  | (dut.rate == fastest))
    c.implication("no-jump", "The rate is never below the lowest of the level: it does not fall "
                  "by more than a level a step, however low a rate is requested.", when=known,
                  then=dut.rate >= slowest)
    c.invariant("rate-0-at-power-up", "In the first clock the rate is 0.", known | (dut.rate == 0),
                cover=~known & (dut.requested_rate != 0))


def _range(c: Contract, dut: Ramp, up: Bits, rests: Bits) -> None:
    """State that it stays where targets are, of which 0 is one."""
    low, high = c.free(dut.width, name="low"), c.free(dut.width, name="high")
    for end in (low, high):
        c.assume(~c.past(1) | (end == c.past(end)))
    low, high = low.as_signed(), high.as_signed()
    c.assume((low <= 0) & (high >= 0) & (dut.target >= low) & (dut.target <= high))
    stop = dut.position + Mux(up, dut.level, -dut.level)
    c.invariant("within-targets", "The position, and the one at which it can stop, are never "
                "beyond the lowest and the highest target.",
                (dut.position >= low) & (dut.position <= high) & (stop >= low) & (stop <= high),
                cover=~rests & (dut.position < 0))


def make(*, rates: int | tuple[int, ...], most: int, bits: int) -> Ramp:
    """Make a ramp with these rates, or with those of so many steps/s² that the board has."""
    if isinstance(rates, int):
        rates = ramp_rates(acceleration=rates, top=16_000, modulus=1_000_000_000, clock=50_000_000)
    return Ramp(rates=rates, max_rate=most, width=bits)


RAMP = Component(
    make=make, describe=describe, depth=12,
    cases=(Case({"rates": (2, 4, 5, 6), "most": 7, "bits": 5}),
           Case({"rates": (2, 2), "most": 3, "bits": 3}),
           Case({"rates": 20_000, "most": 959_984, "bits": 15}, real=True)))
