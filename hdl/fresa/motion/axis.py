"""An axis: everything between a target and the pins of its motor."""

from amaranth import Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..drive import PhaseDriver, RateGenerator, StepDirDriver
from .backlash import Backlash

__all__ = ["Axis"]


class Axis(wiring.Component):
    """Takes a load to a target, at a set rate, past the backlash of its gears, up to its switches.

    A step is made when the position was not the target, ``run`` is set, the rate generator has a
    step due, no limit switch is on in that direction, and the driver is ready: in that order, so
    that the limit switches are the last gate before the driver. The position counts the steps of
    the driver, less those that only take up backlash.

    Position and target are compared a clock ahead, since that takes long: a step leads towards the
    target of the clock before, none is made in the clock after a step, a load or the begin of
    ``run``, and the position never leaves the range of targets. To stop, clear ``run``.

    Steps of a movement come at the exact rate, see :class:`RateGenerator`, with a constant delay:
    that of the first, which comes a clock after the movement begins, or when the driver has changed
    DIR for it.

    Parameters
    ----------
    driver : PhaseDriver or StepDirDriver
        Drives the motor. Its pins are pins of the axis, under their names.
    modulus, max_rate : int
        See :class:`RateGenerator`. The driver must be able to make steps at the highest rate.
    max_backlash : int
        Most steps of backlash, see :class:`Backlash`.
    width : int
        Bits of positions, from 2 to 64.

    Members
    -------
    target_n : In(signed(width))
        Target position, with all bits inverted, see :class:`MoveTo`. Of no meaning without ``run``.
    run : In(1)
        Move towards it.
    load : In(1)
        Set the position to ``place``. No step is made in this clock, nor in the next.
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
        A step is due, also towards the present target, and a limit switch blocks it.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, driver: PhaseDriver | StepDirDriver, modulus: int, max_rate: int,
                 max_backlash: int, width: int = 32) -> None:
        self.modulus, self.max_rate = modulus, max_rate
        self._driver = driver
        width = in_range("width", width, 2, 64)
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

        m.submodules.rate = rate = self._rate
        m.submodules.driver = driver = self._driver
        m.submodules.backlash = backlash = self._backlash
        beyond = Signal(signed(len(self.position) + 1))  # by how much more than a step
        wants = Signal()  # a step, by the position and the target of the clock before
        up = Signal()  # its direction
        due = Signal()
        blocked = Signal()
        m.d.comb += [
            beyond.eq(self.position + self.target_n),
            self.in_position.eq((self.position ^ self.target_n).all()),
            rate.rate.eq(self.rate),
            rate.moved.eq(driver.moved),
            due.eq(wants & self.run & ~self.load & rate.due),
            blocked.eq(Mux(up, self.high, self.low)),
            driver.step.eq(due & ~blocked),
            driver.direction.eq(up),
            driver.enable.eq(self.enable),
            backlash.backlash.eq(self.backlash),
            backlash.direction.eq(up),
            backlash.moved.eq(driver.moved),

            self.moved.eq(driver.moved),
            self.limit_hit.eq(due & blocked & ~self.in_position & (up == beyond[-1])),
            *(getattr(self, name).eq(getattr(driver, name)) for name in self.pins),
        ]
        m.d.sync += [
            wants.eq(self.run & ~self.load & ~driver.moved & ~self.in_position),
            up.eq(beyond[-1]),
        ]
        with m.If(self.load):
            m.d.sync += self.position.eq(self.place)
        with m.Elif(backlash.counted):
            m.d.sync += self.position.eq(self.position + Mux(up, 1, -1))

        return m
