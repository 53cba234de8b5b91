"""The backlash of gears: counted, or compensated."""

from amaranth import Module, Mux, ResetSignal, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range

__all__ = ["MAX_BACKLASH", "Backlash", "BacklashCompensator"]

MAX_BACKLASH = 2**20
"""Most steps of backlash that can be counted."""


class Backlash(wiring.Component):
    """Backlash compensation: tells steps that move the load from steps that take up backlash.

    After a reversal the first ``backlash`` steps turn gears and move nothing. They are not counted,
    so a position that counts ``counted`` makes its controller request as many more. A movement that
    is reversed again while it takes up backlash goes back through only what it has taken up.

    At power-up the load is assumed to rest where a movement down leaves it. A reset moves no gear
    and changes nothing. A new ``backlash`` applies from the next reversal on.

    Parameters
    ----------
    max_backlash : int
        Most steps of backlash, from 1 to ``MAX_BACKLASH``.

    Members
    -------
    backlash : In(range(max_backlash + 1))
        Steps that a reversal takes up; 0 for none.
    moved, direction : In(1)
        The motor makes a step in this clock, and its direction.
    counted : Out(1)
        The step moves the load: use it as count enable of the position.

    Raises
    ------
    ValueError
        If ``max_backlash`` is out of range.
    """

    def __init__(self, *, max_backlash: int) -> None:
        self.max_backlash = in_range("max_backlash", max_backlash, 1, MAX_BACKLASH)
        super().__init__({"backlash": In(range(self.max_backlash + 1)), "moved": In(1),
                          "direction": In(1), "counted": Out(1)})

    def elaborate(self, platform) -> Module:
        m = Module()

        way = Signal(reset_less=True)  # direction of the last step
        left = Signal.like(self.backlash, reset_less=True)  # still to take up in that direction
        ahead = Signal.like(left)  # still to take up in the direction of this step
        # `backlash` may have been made smaller meanwhile
        back = Mux(left > self.backlash, 0, self.backlash - left)
        m.d.comb += [
            ahead.eq(Mux(self.direction == way, left, back)),
            self.counted.eq(self.moved & (ahead == 0)),
        ]
        with m.If(self.moved):
            m.d.sync += [
                way.eq(self.direction),
                left.eq(Mux(ahead == 0, 0, ahead - 1)),
            ]

        return m


class BacklashCompensator(wiring.Component):
    """Adds steps that take up backlash to those that are requested of a motor.

    It knows from the driver's steps where the load is, and while that is not where the requested
    steps have it, one step is added a clock after each `tick`, between the requested ones: after a
    reversal ``backlash`` of them, and fewer if the load is pushed back before. At power-up the load
    is assumed to rest where a movement down leaves it.

    A position that counts the driver's steps, and one more for each ``correct``, is that which was
    requested, while no step is pending: an added step is counted against its direction when it is
    requested. After a stop one that the driver has not made is taken back, and none is added until
    another step is requested. A reset is a stop, and moves no gear.

    Parameters
    ----------
    max_backlash : int
        Most steps of backlash, from 1 to ``MAX_BACKLASH``.

    Members
    -------
    backlash : In(range(max_backlash + 1))
        Steps that a reversal takes up. It may change at any time.
    tick : In(1)
        A step may be added in the next clock.
    step : In(1)
        A step is requested.
    pending : In(1)
        The driver has not made all steps that were requested of it up to the clock before.
    moved, direction : In(1)
        The driver makes one in this clock; the direction of those that are pending.
    stop : In(1)
        Pending steps are dropped, and those that are requested meanwhile.
    extra, extra_direction : Out(1)
        A step is added, and its direction. Never with ``step``.
    correct, correct_direction : Out(1)
        The position changes by one in this clock, and in which direction. Never with ``moved``; in
        which the direction is that of the driver's step.
    busy : Out(1)
        Steps are still to be added.

    Raises
    ------
    ValueError
        If ``max_backlash`` is out of range.
    """

    def __init__(self, *, max_backlash: int) -> None:
        self.max_backlash = in_range("max_backlash", max_backlash, 1, MAX_BACKLASH)
        super().__init__({
            "backlash": In(range(self.max_backlash + 1)), "tick": In(1), "step": In(1),
            "pending": In(1), "moved": In(1), "direction": In(1), "stop": In(1),
            "extra": Out(1), "extra_direction": Out(1),
            "correct": Out(1), "correct_direction": Out(1), "busy": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()

        slack = Signal.like(self.backlash, reset_less=True)  # the motor is so far above the load
        ahead = Signal(signed(len(slack) + 1), reset_less=True)  # the load, of the position
        active = Signal()  # a step was requested since the last stop
        adds = Signal()  # the load is not there, and there was a tick
        waits = Signal()  # the driver has not made the added step
        moves = Signal(signed(len(slack) + 1))  # the slack after a step that does not push
        pushes = Signal()
        stops = Signal()
        m.d.comb += [
            stops.eq(self.stop | ResetSignal()),
            moves.eq(slack + Mux(self.direction, 1, -1)),
            pushes.eq(Mux(self.direction, slack >= self.backlash, moves[-1])),
            self.busy.eq(active & (ahead != 0)),
            self.extra_direction.eq(ahead[-1]),
            self.extra.eq(adds & ~self.step & ~self.pending & ~stops),
            self.correct.eq(self.extra | (stops & waits & self.pending)),
            # A step is added while none is pending, and made or taken back while one is: so which
            # of them it is need not be known.
            self.correct_direction.eq(Mux(self.pending, self.direction, ~self.extra_direction)),
        ]
        # Nothing changes `ahead` in the clock of the tick, nor before the step is added.
        m.d.sync += adds.eq(self.busy & self.tick & ~self.pending & ~adds & ~stops)
        with m.If(self.moved & ~pushes):
            m.d.sync += slack.eq(moves)
        with m.If((self.moved & ~pushes) | self.correct):
            m.d.sync += ahead.eq(ahead + Mux(self.correct_direction, -1, 1))
        with m.If(self.moved | ~self.pending):
            m.d.sync += waits.eq(0)
        with m.If(self.step):
            m.d.sync += active.eq(1)
        with m.If(self.extra):
            m.d.sync += waits.eq(1)
        with m.If(stops):
            m.d.sync += [active.eq(0), waits.eq(0)]

        return m
