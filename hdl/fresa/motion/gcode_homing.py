"""The homing cycle: each axis to its switch, which tells where it is."""

from amaranth import Array, Cat, Const, Module, Mux, Signal, unsigned
from amaranth.lib import enum, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..choice import look_up
from ..fsm import leave_unused_codes
from .gcode_control import AlarmCode
from .gcode_planner import HOMING, LENGTH_BITS, HomingRequest
from .squaring import MotorSquaring

__all__ = ["GCodeHoming"]

ORDER, THESIS_ORDER = (2, 0, 1), (0, 1, 2)
"""Z first, so that a tool is off the work before X and Y move; that of the thesis, where Z is a
servo."""

START = 31
"""Clocks in which a line that is planned begins, less one."""


class _Phase(enum.Enum, shape=unsigned(2)):
    SEEK = 0
    PLACE = 1
    PULL_OFF = 2
    LOCATE = 3


_SEARCH, _LOCATE, _ONCE = 1500, 5000, 1000
"""By how many thousandths of its travel an axis seeks; of $27 it is located, and goes back."""

_SKEW_SHIFT = 4
"""One of two motors goes on without the other one for a sixteenth of the travel at most."""


class GCodeHoming(wiring.Component):
    """Carries out homing cycles, with lines that a planner makes.

    One axis after the other, Z, X, Y: it seeks its switch at the speed of $25, over 1.5 times its
    travel, and brakes. Where it was when the switch closed is now the place of the switch: 0, or of
    an axis of $23 its lower end, -$130 to -$132. It pulls off, to $27 from there, locates the
    switch once more at the speed of $24, and pulls off again. Behind each of these motions, before
    the next, it stands for the time of $26, and looks at no switch.

    A cycle of ``only`` one axis is what it does of that axis.

    With `simple` the cycle is that of the thesis' firmware: X, then Y, seeks its switch once, and
    goes back to where that closed, which is 0, whichever end it is; then Z is 0 where it is.

    A `squared_axis` has two motors, each of which is halted at its own switch, both where it is
    sought and where it is located; the place of the switch is where the axis is when the second one
    closes. So the gantry is square after the cycle, if its switches are. A motor that goes on
    without the other one does so for a sixteenth of the travel at most, then it is HOMING_SEARCH.
    This axis stops at its switches without braking: once both motors are halted, steps that are
    requested of them have to be dropped.

    ``failure`` ends a cycle: HOMING_SEARCH if a switch is not found, HOMING_PULL_OFF if one
    is still on after that. Then, as after any other alarm, it waits for a reset of its
    own.

    Parameters
    ----------
    simple : bool
        The cycle of the thesis.
    squared_axis : int, optional
        The axis that has two motors, with a switch each.
    begins_within : int
        Clocks in which a line begins that is planned, less one, and in which a dwell begins.

    Members
    -------
    start : In(1)
        Begin. Only in IDLE and ALARM of the control, while nothing moves.
    only : In(2)
        The axis that homes alone, or 3: all do. Constant from ``start`` on. Not with `simple`.
    active, done : Out(1)
        A cycle goes on, from the clock after ``start``; it is through, one clock, in which
        ``active`` is still 1.
    allowed : In(1)
        The control is in HOME.
    failure : Out(AlarmCode)
        Why it has ended, for one clock, else NONE.
    switches : In(3)
        Switches, 1 where one is on.
    lower : In(3)
        Axes that home to their lower end: $23.
    request, homed : Out(HOMING), In(1)
        What the planner does, until ``homed``.
    moving, standing, begins : In(1)
        There is something to be carried out; the machine stands; the planner has not begun since
        ``restart``.
    brake : Out(1)
        Slow down.
    restart : Out(1)
        Drop what was not made, and begin where the axes are. For one clock.
    axis : Out(2)
        The axis.
    second_switch : In(1)
        The switch of the second motor of `squared_axis`; the first one's is in ``switches``. This
        and the next three are only there with such an axis.
    moved : In(1)
        A step of that axis is made, by the motors that are not halted.
    travel : In(31)
        Its travel in steps.
    halt : Out(2)
        Motors of it that must make no step.
    latch, place : Out(1)
        Keep where the axis is; then, the place of its switch is where it was then. For one clock
        each.
    fault : Out(1)
        The state register was upset. Stays until reset.

    Raises
    ------
    ValueError
        If ``begins_within`` is out of range.
    """

    def __init__(self, *, simple: bool = False, squared_axis: int | None = None,
                 begins_within: int = START) -> None:
        self.simple, self.squared_axis = simple, squared_axis
        self.begins_within = in_range("begins_within", begins_within, 1, START)
        super().__init__({
            **({} if simple else {"only": In(2)}),
            "start": In(1), "active": Out(1), "done": Out(1), "allowed": In(1),
            "failure": Out(AlarmCode), "switches": In(3), "lower": In(3),
            "request": Out(HOMING), "homed": In(1), "moving": In(1), "standing": In(1),
            "begins": In(1), "brake": Out(1), "restart": Out(1), "axis": Out(2), "latch": Out(1),
            "place": Out(1), "fault": Out(1),
            **({} if squared_axis is None else {
                "second_switch": In(1), "moved": In(1), "travel": In(LENGTH_BITS),
                "halt": Out(2)}),
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        order = THESIS_ORDER if self.simple else ORDER
        phase = Signal(_Phase)
        turn = Signal(range(len(order)))
        request = self.request
        switch, lower = Signal(), Signal()
        pause = Signal(range(self.begins_within + 1))
        seeks = Signal()
        rests = Signal()  # what switches do has no meaning yet
        located = Signal()
        first, last = Const(0, 2), turn == len(order) - 1
        if not self.simple:
            first = look_up([order.index(axis) for axis in range(len(order))] + [0], self.only, 2)
            last |= self.only != 3
        m.d.comb += [
            self.axis.eq(Array(order)[turn]), request.axis.eq(self.axis),
            switch.eq(self.switches.bit_select(self.axis, 1)),
            lower.eq(self.lower.bit_select(self.axis, 1)),
            seeks.eq((phase == _Phase.SEEK) | (phase == _Phase.LOCATE)),
            request.back.eq((phase == _Phase.PLACE) | (lower ^ ~seeks)),
            request.from_switch.eq(phase == _Phase.PULL_OFF),
            request.near.eq((phase == _Phase.PULL_OFF) | (phase == _Phase.LOCATE)),
            request.slow.eq(phase == _Phase.LOCATE),
            request.thousandths.eq(Mux(phase == _Phase.SEEK, _SEARCH,
                                       Mux(phase == _Phase.LOCATE, _LOCATE, _ONCE))),
        ]
        with m.If((phase != _Phase.SEEK) if self.simple else (phase == _Phase.PLACE) & ~lower):
            m.d.comb += request.thousandths.eq(0)  # the switch is at 0

        lost = None  # one of two motors does not find its switch
        if self.squared_axis is not None:
            lost = self._square(m, self.squared_axis, seeks, rests, switch)

        def follow(then: _Phase) -> None:
            m.d.sync += phase.eq(then)
            m.next = "PLAN"

        def follow_later(then: _Phase) -> None:
            follow(then)
            if not self.simple:
                m.next = "WAIT"

        def fail(code: AlarmCode) -> None:
            m.d.comb += self.failure.eq(code)
            m.next = "FAILED"

        m.d.comb += self.active.eq(1)
        with m.FSM(name="homing_state") as fsm:
            with m.State("IDLE"):
                m.d.comb += self.active.eq(0)
                m.d.sync += [turn.eq(first), located.eq(0)]
                with m.If(self.start):
                    m.next = "ASK"
            with m.State("ASK"):
                with m.If(self.allowed):
                    follow(_Phase.SEEK)

            # A switch may bounce, and the machine shake, until the phase begins
            if not self.simple:
                with m.State("WAIT"):
                    m.d.comb += [rests.eq(1), request.kind.eq(HomingRequest.WAIT)]
                    m.d.sync += pause.eq(self.begins_within)
                    with m.If(self.homed):
                        m.next = "REST"
                with m.State("REST"):
                    m.d.comb += rests.eq(1)
                    with m.If(pause != 0):
                        m.d.sync += pause.eq(pause - 1)
                    with m.Elif(~self.moving):
                        m.next = "PLAN"

            with m.State("PLAN"):
                m.d.comb += request.kind.eq(HomingRequest.MOVE)
                m.d.sync += pause.eq(self.begins_within)
                with m.If(phase == _Phase.PLACE):
                    m.d.comb += request.kind.eq(HomingRequest.PLACE)
                with m.If(self.homed):
                    m.next = "START"
                    with m.If(phase == _Phase.PLACE):
                        m.next = "PLACE"
                if self.simple:
                    with m.If((phase == _Phase.SEEK) & (self.axis == 2)):
                        m.d.comb += [self.latch.eq(1), request.kind.eq(HomingRequest.NONE)]
                        follow(_Phase.PLACE)

            with m.State("START"):
                m.d.sync += pause.eq(pause - 1)
                with m.If(pause == 0):
                    m.next = "MOVE"
            with m.State("MOVE"):
                with m.If(seeks & switch):
                    m.d.comb += self.latch.eq(1)
                    m.next = "BRAKE"
                with m.Elif(~self.moving):
                    with m.If(seeks):
                        fail(AlarmCode.HOMING_SEARCH)
                    if not self.simple:
                        with m.Elif(switch):
                            fail(AlarmCode.HOMING_PULL_OFF)
                        with m.Elif(~located):
                            m.d.sync += located.eq(1)
                            follow_later(_Phase.LOCATE)
                    with m.Elif(last):
                        m.next = "RESTART"
                    with m.Else():
                        m.d.sync += [turn.eq(turn + 1), located.eq(0)]
                        follow_later(_Phase.SEEK)
                if lost is not None:
                    with m.If(lost):
                        fail(AlarmCode.HOMING_SEARCH)
            with m.State("BRAKE"):
                m.d.comb += self.brake.eq(1)
                with m.If(self.standing):
                    m.next = "RESTART"
            with m.State("PLACE"):
                m.d.comb += self.place.eq(1)
                m.next = "RESTART"
            with m.State("RESTART"):
                m.d.comb += [self.brake.eq(1), self.restart.eq(1)]
                m.next = "BEGIN"
            with m.State("BEGIN"):
                with m.If(~self.begins & ~self.moving):
                    follow_later(_Phase.PULL_OFF)
                    with m.If(seeks):
                        follow(_Phase.PLACE)
                    # Lines that follow begin where the last axis is, not at its switch.
                    with m.Elif(phase == _Phase.PULL_OFF):
                        m.next = "DONE"

            with m.State("DONE"):
                m.d.comb += self.done.eq(1)
                m.next = "IDLE"
            with m.State("FAILED"):
                pass
            with m.State("FAULT"):
                pass
        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))
        return m

    def _square(self, m: Module, axis: int, seeks: Signal, rests: Signal, switch: Signal
                ) -> Signal:
        """Halt the motors of an axis at their switches; say when it has met them, by `switch`.

        Return whether one of the motors does not find its switch.
        """
        m.submodules.squaring = squaring = MotorSquaring(width=LENGTH_BITS - _SKEW_SHIFT)
        here = self.axis == axis
        m.d.comb += [
            squaring.seeks.eq(self.active & seeks & here & ~rests),
            squaring.switches.eq(Cat(self.switches[axis], self.second_switch)),
            squaring.moved.eq(self.moved), squaring.most.eq(self.travel[_SKEW_SHIFT:]),
            self.halt.eq(squaring.halt),
        ]
        with m.If(here):
            m.d.comb += switch.eq(Mux(seeks, squaring.halt.all(), squaring.switches.any()))
        return squaring.failed
