"""Homing of a point that hangs from two strings: each is wound until its end switch closes."""

from amaranth import Cat, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..fsm import leave_unused_codes
from ..protocol import HomingStage
from .gcode_control import AlarmCode

__all__ = ["MAX_PACE", "MAX_STEPS", "StringHoming"]

MAX_PACE, MAX_STEPS = 2**26, 2**20
"""Most clocks from a step to the next, and most steps of a stage."""

SLOW = 3
"""A string leaves its switch slower by this power of two."""


class StringHoming(wiring.Component):
    """Carries out homing cycles: finds where each string is 0, then goes to the place of rest.

    The left string is wound until its end switch closes, and paid out slowly until that opens: it
    is 0 there. Meanwhile the right one is paid out step by step as the left one is wound, so that
    neither gets tight: where the point hangs when the left one is at its end, the way to the
    right pulley is not more than what both were before. Then the same with the roles changed.
    At last both get the lengths of the place of rest, and positions count from there.

    ===========  ======================================================  =========================
    state        does                                                    goes on
    ===========  ======================================================  =========================
    ``IDLE``     waits                                                   with ``start``
    ``ASK``      waits                                                   with ``allowed``
    ``SEEK``     winds the string, pays the other one out                when its switch closes
    ``LEAVE``    pays it out slowly                                      when that opens
    ``ZERO``     takes that for the length 0                             next clock: again with the
                                                                         right string, or on
    ``PLACE``    lets the point be at the place of rest                  next clock
    ``REST``     lets the motors make those lengths                      when both have
    ``RESTART``  has the planner begin there                             next clock
    ``BEGIN``    waits                                                   when it has
    ``DONE``     is ``done``                                             next clock
    ``FAILED``   waits                                                   with a reset
    ===========  ======================================================  =========================

    ``failure`` ends a cycle: HOMING_SEARCH if a switch does not close in `most` steps,
    HOMING_PULL_OFF if it does not open in `most_off`. Then it waits for a reset of its own.

    Parameters
    ----------
    pace : int
        Clocks from a step to the next; eight times that while a switch is left.
    most, most_off : int
        Most steps in which a string is wound, and paid out until its switch opens.

    Members
    -------
    start : In(1)
        Begin. Only while nothing moves.
    active, done : Out(1)
        A cycle goes on, from the clock after ``start``; it is through, one clock, in which
        ``active`` is still 1.
    allowed : In(1)
        The control is in HOME.
    failure : Out(AlarmCode)
        Why it has ended, for one clock, else NONE.
    stage : Out(HomingStage)
        What it does.
    switches : In(2)
        End switches of the strings, 1 where one is on.
    moved, behind : In(2)
        Of the motors of the strings.
    step, longer : Out(2)
        A step of a motor; it pays out.
    zero : Out(2)
        The string has the length 0.
    place : Out(1)
        The point shall be at the place of rest. For one clock.
    follow : Out(2)
        The motor may make a step towards the length that its string shall have.
    moving, begins : In(1)
        There is something to be carried out; the planner has not begun since ``restart``.
    brake : Out(1)
        Slow down: always 0, as nothing moves.
    restart : Out(1)
        Begin where the point is. For one clock.
    fault : Out(1)
        The state register was upset. Stays until reset.

    Raises
    ------
    ValueError
        If a parameter is out of range.

    Source: thesis of the hanging plotter, 3.1.2. It seeks without end there, and the place of rest
    is ours.
    """

    def __init__(self, *, pace: int, most: int, most_off: int) -> None:
        self.pace = in_range("pace of homing", pace, 2, MAX_PACE)
        self.most = in_range("most steps of homing", most, 1, MAX_STEPS)
        self.most_off = in_range("most steps off a switch", most_off, 1, MAX_STEPS)
        super().__init__({
            "start": In(1), "active": Out(1), "done": Out(1), "allowed": In(1),
            "failure": Out(AlarmCode), "stage": Out(HomingStage), "switches": In(2),
            "moved": In(2), "behind": In(2), "step": Out(2), "longer": Out(2), "zero": Out(2),
            "place": Out(1), "follow": Out(2), "moving": In(1), "begins": In(1),
            "brake": Out(1), "restart": Out(1), "fault": Out(1)})

    def elaborate(self, platform) -> Module:
        m = Module()
        turn = Signal()  # the string that is homed: the right one
        switch = Signal()
        moved = Signal()
        count = Signal(range(max(self.most, self.most_off) + 1))
        left = Signal(range((self.pace << SLOW) + 1))  # clocks until a step is due
        due = Signal(2)
        m.d.comb += [
            switch.eq(self.switches.bit_select(turn, 1)), moved.eq(self.moved.bit_select(turn, 1)),
            self.active.eq(1),
        ]

        def begin(state: str, slower: int = 0) -> None:
            m.d.sync += [count.eq(0), due.eq(0), left.eq((self.pace << slower) - 1)]
            m.next = state

        def pace(slower: int, motors) -> None:
            with m.If(left == 0):
                m.d.sync += [left.eq((self.pace << slower) - 1), due.eq(motors)]
            with m.Else():
                m.d.sync += [left.eq(left - 1), due.eq(due & ~self.moved)]
            with m.If(moved):
                m.d.sync += count.eq(count + 1)

        def fail(code: AlarmCode) -> None:
            m.d.comb += self.failure.eq(code)
            m.next = "FAILED"

        of_turn = Signal(2)
        m.d.comb += of_turn.eq(Cat(~turn, turn))
        seeking = Mux(turn, HomingStage.SECOND, HomingStage.FIRST)
        with m.FSM(name="string_homing_state") as fsm:
            with m.State("IDLE"):
                m.d.comb += self.active.eq(0)
                m.d.sync += turn.eq(0)
                with m.If(self.start):
                    m.next = "ASK"
            with m.State("ASK"):
                with m.If(self.allowed):
                    begin("SEEK")
            with m.State("SEEK"):
                m.d.comb += [self.stage.eq(seeking), self.step.eq(due), self.longer.eq(~of_turn)]
                pace(0, 0b11)
                with m.If(switch):
                    begin("LEAVE", SLOW)
                with m.Elif(count == self.most):
                    fail(AlarmCode.HOMING_SEARCH)
            with m.State("LEAVE"):
                m.d.comb += [self.stage.eq(seeking), self.step.eq(due), self.longer.eq(of_turn)]
                pace(SLOW, of_turn)
                with m.If(~switch):
                    m.next = "ZERO"
                with m.Elif(count == self.most_off):
                    fail(AlarmCode.HOMING_PULL_OFF)
            with m.State("ZERO"):
                m.d.comb += [self.stage.eq(seeking), self.zero.eq(of_turn)]
                m.d.sync += turn.eq(1)
                begin("SEEK")
                with m.If(turn):
                    m.next = "PLACE"
            with m.State("PLACE"):
                m.d.comb += [self.stage.eq(HomingStage.REST), self.place.eq(1)]
                begin("REST")
            with m.State("REST"):
                m.d.comb += [self.stage.eq(HomingStage.REST), self.follow.eq(due)]
                pace(0, 0b11)
                # Not before the first pace: the lengths are those of the place by then.
                with m.If((due == 0b11) & (self.behind == 0)):
                    m.next = "RESTART"
            with m.State("RESTART"):
                m.d.comb += [self.stage.eq(HomingStage.REST), self.restart.eq(1)]
                m.next = "BEGIN"
            with m.State("BEGIN"):
                m.d.comb += self.stage.eq(HomingStage.REST)
                with m.If(~self.begins & ~self.moving):
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
