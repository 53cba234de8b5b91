"""A line of which each string changes its length at a constant speed, so that it is bowed."""

from amaranth import Array, Cat, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..fsm import leave_unused_codes
from .string_homing import MAX_PACE

__all__ = ["BowedLine"]


class BowedLine(wiring.Component):
    """Draws lines with both motors at constant speed: they start together and arrive together.

    The place is led to the end first, by ticks that no motor follows. Then the motor that has more
    steps to make makes one each pace, and the other one spreads its own evenly among them.

    ==========  ====================================================  ================
    state       does                                                  goes on
    ==========  ====================================================  ================
    ``IDLE``    waits                                                 with ``start``
    ``ASK``     waits                                                 with ``allowed``
    ``LEAD``    gives a tick of each coordinate that is not there     when both are
    ``SETTLE``  waits until the lengths are those of the place        then
    ``LEFT``    takes the steps of the left motor                     next clock
    ``RIGHT``   takes those of the right motor, and which are more    next clock
    ``HALF``    begins half way to the first step of the other one    next clock
    ``DRAW``    has the motors make them                              when all are made
    ``RESTART`` has the planner begin there                           next clock
    ``BEGIN``   waits                                                 when it has
    ``DONE``    is ``done``                                           next clock
    ==========  ====================================================  ================

    Parameters
    ----------
    pace : int
        Clocks from a step of the motor that makes more to the next one.
    place_bits, length_bits : int
        Of a place in ticks, and of a length in steps.

    Members
    -------
    start : In(1)
        Begin. Only while nothing moves, and the strings have the lengths of the place.
    target : In(place_bits) x 2
        Where it ends, in ticks: across and below. Taken until ``drawing``.
    active, done : Out(1)
        A line goes on, from the clock after ``start``; it is through, one clock, in which
        ``active`` is still 1.
    allowed : In(1)
        The control has taken notice.
    point : In(place_bits) x 2
        Where it is.
    busy : In(1)
        A tick waits, or the lengths are not those of the place.
    tick, up : Out(2)
        A tick of a coordinate; it becomes more.
    length, made : In(length_bits) x 2
        How long each string shall be, and is.
    follow : Out(2)
        The motor may make a step towards that.
    moved, behind : In(2)
        It makes one; its string has not that length.
    drawing : Out(1)
        The motors move, or are about to.
    moving, begins : In(1)
        There is something to be carried out; the planner has not begun since ``restart``.
    restart : Out(1)
        Begin where the point is. For one clock.
    fault : Out(1)
        The state register was upset. Stays until reset.

    Raises
    ------
    ValueError
        If a parameter is out of range.

    Source: thesis of the hanging plotter, 3.1.4, whose slaves divide the time of the longer way by
    their own steps.
    """

    def __init__(self, *, pace: int, place_bits: int = 19, length_bits: int = 18) -> None:
        self.pace = in_range("pace of a bowed line", pace, 2, MAX_PACE)
        in_range("place_bits", place_bits, 2, 32)
        in_range("length_bits", length_bits, 2, 32)
        super().__init__({
            "start": In(1), "target": In(place_bits).array(2), "active": Out(1), "done": Out(1),
            "allowed": In(1), "point": In(place_bits).array(2), "busy": In(1), "tick": Out(2),
            "up": Out(2), "length": In(length_bits).array(2), "made": In(length_bits).array(2),
            "follow": Out(2), "moved": In(2), "behind": In(2), "drawing": Out(1), "moving": In(1),
            "begins": In(1), "restart": Out(1), "fault": Out(1)})

    def elaborate(self, platform) -> Module:
        m = Module()
        side = Signal()
        length, made = (Array(each)[side] for each in (self.length, self.made))
        way = Signal.like(self.length[0])
        ways = [Signal.like(way, name=f"way_{name}") for name in ("left", "right")]
        most = Signal.like(way)
        left = Signal(range(self.pace))  # clocks until steps are due
        due = Signal(2)
        rest = [Signal.like(way, name=f"rest_{name}") for name in ("left", "right")]
        sums = [Signal(len(way) + 1, name=f"sum_{name}") for name in ("left", "right")]
        m.d.comb += [each.eq(begin + more) for each, begin, more in zip(
            sums, rest, ways, strict=True)]
        away = Cat(at != to for at, to in zip(self.point, self.target, strict=True))
        m.d.comb += [
            way.eq(Mux(length < made, made - length, length - made)), self.active.eq(1),
            self.up.eq(Cat(at < to for at, to in zip(self.point, self.target, strict=True))),
        ]
        with m.FSM(name="bowed_state") as fsm:
            with m.State("IDLE"):
                m.d.comb += self.active.eq(0)
                with m.If(self.start):
                    m.next = "ASK"
            with m.State("ASK"):
                with m.If(self.allowed):
                    m.next = "LEAD"
            with m.State("LEAD"):
                m.d.comb += self.tick.eq(away)
                m.next = "SETTLE"
            with m.State("SETTLE"):
                with m.If(~self.busy):
                    m.next = "LEAD"
                    with m.If(away == 0):
                        m.next = "LEFT"
            with m.State("LEFT"):
                m.d.sync += [ways[0].eq(way), most.eq(way)]
                m.next = "RIGHT"
            with m.State("RIGHT"):
                m.d.comb += side.eq(1)
                m.d.sync += [ways[1].eq(way), left.eq(0), due.eq(0)]
                with m.If(way > most):
                    m.d.sync += most.eq(way)
                m.next = "HALF"
            with m.State("HALF"):
                m.d.sync += [each.eq(most >> 1) for each in rest]
                m.next = "DRAW"
            with m.State("DRAW"):
                m.d.comb += [self.drawing.eq(1), self.follow.eq(due)]
                with m.If(left == 0):
                    m.d.sync += left.eq(self.pace - 1)
                    for motor, whole in enumerate(sums):
                        steps = whole >= most
                        m.d.sync += [due[motor].eq(steps),
                                     rest[motor].eq(whole - Mux(steps, most, 0))]
                with m.Else():
                    m.d.sync += [left.eq(left - 1), due.eq(due & ~self.moved)]
                with m.If(self.behind == 0):
                    m.next = "RESTART"
            with m.State("RESTART"):
                m.d.comb += self.restart.eq(1)
                m.next = "BEGIN"
            with m.State("BEGIN"):
                with m.If(~self.begins & ~self.moving):
                    m.next = "DONE"
            with m.State("DONE"):
                m.d.comb += self.done.eq(1)
                m.next = "IDLE"
            with m.State("FAULT"):
                pass
        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))
        return m
