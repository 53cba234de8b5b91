"""An axis: everything between a target and the pins of its motor."""

from amaranth import Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..drive import PhaseDriver, RateGenerator, StepDirDriver
from .backlash import Backlash
from .position import MoveTo

__all__ = ["Axis"]


class Axis(wiring.Component):
    """Takes a load to a target, at a set rate, past the backlash of its gears, up to its switches.

    A step is made when the position is not the target, ``run`` is set, the rate generator has a
    step due, no limit switch is on in that direction, and the driver is ready: in that order, so
    that the limit switches are the last gate before the driver. The position counts the steps of
    the driver, less those that only take up backlash.

    Steps of a movement come at the exact rate, see :class:`RateGenerator`, with a constant delay:
    that of the first, which comes at once after a rest, or when the driver has changed DIR for it.

    Parameters
    ----------
    driver : PhaseDriver or StepDirDriver
        Drives the motor. Its pins are pins of the axis, under their names.
    modulus, max_rate : int
        See :class:`RateGenerator`. The driver must be able to make steps at the highest rate.
    max_backlash : int
        Most steps of backlash, see :class:`Backlash`.
    width : int
        Bits of positions, see :class:`MoveTo`.

    Members
    -------
    target_n : In(signed(width))
        Target position, with all bits inverted, see :class:`MoveTo`.
    run : In(1)
        Move towards it.
    load : In(1)
        Set the position to ``place``. No step is made in this clock.
    place : In(signed(width))
        Position to set.
    rate : In(range(max_rate + 1))
        Steps in ``modulus`` clocks.
    backlash : In(range(max_backlash + 1))
        Steps that a reversal takes up.
    enable : In(1)
        Give the motor power. Without it no step is made.
    low, high : In(1)
        The switch at that end counts as on, see :class:`Limits`.
    position : Out(signed(width))
        Position of the load, in steps.
    in_position : Out(1)
        The position is the target.
    moved : Out(1)
        A step is made in this clock.
    limit_hit : Out(1)
        A step is due, and a limit switch blocks it.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, driver: PhaseDriver | StepDirDriver, modulus: int, max_rate: int,
                 max_backlash: int, width: int = 32) -> None:
        self.modulus, self.max_rate = modulus, max_rate
        self._driver = driver
        self._move = MoveTo(width=width)
        self._backlash = Backlash(max_backlash=max_backlash)
        self._rate = RateGenerator(modulus=modulus, max_rate=max_rate)
        self.pins = [name for name in driver.signature.members
                     if name.endswith("_pin") or name == "coils"]
        super().__init__({
            "target_n": In(signed(width)), "run": In(1), "load": In(1), "place": In(signed(width)),
            "rate": In(range(max_rate + 1)), "backlash": In(range(max_backlash + 1)),
            "enable": In(1),
            "low": In(1), "high": In(1),
            "position": Out(signed(width)), "in_position": Out(1), "moved": Out(1),
            "limit_hit": Out(1),
            **{name: Out(driver.signature.members[name].shape) for name in self.pins},
        })

    def elaborate(self, platform) -> Module:
        m = Module()

        m.submodules.move = move = self._move
        m.submodules.rate = rate = self._rate
        m.submodules.driver = driver = self._driver
        m.submodules.backlash = backlash = self._backlash
        due = Signal()
        blocked = Signal()
        m.d.comb += [
            move.target_n.eq(self.target_n),
            move.run.eq(self.run),
            move.load.eq(self.load),
            move.place.eq(self.place),
            move.moved.eq(backlash.counted),
            rate.rate.eq(self.rate),
            rate.moved.eq(driver.moved),
            due.eq(move.step & rate.due),
            blocked.eq(Mux(move.direction, self.high, self.low)),
            driver.step.eq(due & ~blocked),
            driver.direction.eq(move.direction),
            driver.enable.eq(self.enable),
            backlash.backlash.eq(self.backlash),
            backlash.direction.eq(move.direction),
            backlash.moved.eq(driver.moved),

            self.position.eq(move.position),
            self.in_position.eq(move.in_position),
            self.moved.eq(driver.moved),
            self.limit_hit.eq(due & blocked),
            *(getattr(self, name).eq(getattr(driver, name)) for name in self.pins),
        ]

        return m
