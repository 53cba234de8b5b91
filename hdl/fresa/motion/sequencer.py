"""From a complex movement to simple ones."""

from amaranth import Cat, Const, Module, Mux, ResetSignal, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..fsm import leave_unused_codes
from .orders import Move, Order

__all__ = ["MAX_Z_TRAVEL", "MotionSequencer", "valid_z_travel"]

MAX_Z_TRAVEL = 2**15
"""Most steps between the raised and the lowered tool, which is where the Z counter is below 0."""


def valid_z_travel(value: object) -> int:
    """Return `value` if the tool can travel that many steps, else raise ValueError."""
    return in_range("z_travel", value, 1, MAX_Z_TRAVEL)


class MotionSequencer(wiring.Component):
    """Splits an order into simple movements, at most a diagonal and a straight rest.

    The state machine of the *Módulo Principal* (thesis, 4.1.1).

    =========  ======  ================================================  =========================
    state      thesis  does                                              next
    =========  ======  ================================================  =========================
    REST       S0      waits, ``ready`` high                             DECIDE; TOOL for up or
                                                                         down; TOOL-WAIT for both
    DECIDE     S1      refuses, or finds nothing to do, or chooses       REST; TOGETHER if both
                                                                         have the same, else
                                                                         DIAGONAL
    TOGETHER   S2      orders both axes together                         WAIT
    DIAGONAL   S3      orders both axes, the smaller count, unless 0     DIAG-WAIT
    DIAG-WAIT  S4      waits for its end                                 STRAIGHT
    STRAIGHT   S5      orders the rest: the axis with more               WAIT
    WAIT       S6      waits for its end                                 REST
    TOOL       S7      orders Z up or down, unless the tool is there     TOOL-WAIT
    TOOL-WAIT  S8      waits for its end                                 REST
    FAULT      (ours)  shows ``fault``, never ready                      stays until reset
    =========  ======  ================================================  =========================

    The steps to go, \\|target - position\\|, follow the axis counters in every clock. So they are
    settled in DECIDE (the thesis waits 20 clocks there), and in STRAIGHT what is left to go is the
    rest.

    An order that moves nothing, or is refused, leaves REST as well, so that ``ready`` falls for a
    clock at least after every order. Refused are: up and down together; a movement with the tool
    lowered in none of the 8 directions; and an order with up or down that begins while another is
    under way. Then it moves nothing, and ``error`` is set until reset or the next order that is not
    refused.

    An order taken in clock t is offered to ``moves`` in clock t + 4 at the latest.

    Parameters
    ----------
    z_travel : int
        Steps between the raised and the lowered tool, from 1 to ``MAX_Z_TRAVEL``.

    Members
    -------
    order : In(Order)
        The order, sampled in the clock in which it is taken.
    start : In(1)
        Take the order if ``ready``. Must fall before it counts again, whatever comes between, and
        also when it came too early.
    hold : In(1)
        Take no order: ``ready`` is low.
    ready : Out(1)
        At rest, an order may come.
    error : Out(1)
        An order was refused, or ``fault``.
    fault : Out(1)
        The state register was upset. Stays until reset.
    at_x, at_y, at_z : In(16)
        Position: the axis counters. The tool counts as lowered while ``at_z`` is below 0.
    moves : Out(stream.Signature(Move))
        Simple movements. A movement is over when its taker is ready again.

    Raises
    ------
    ValueError
        If ``z_travel`` is out of range.
    """

    order: In(Order)
    start: In(1)
    hold: In(1)
    ready: Out(1)
    error: Out(1)
    fault: Out(1)
    at_x: In(16)
    at_y: In(16)
    at_z: In(16)
    moves: Out(stream.Signature(Move))

    def __init__(self, *, z_travel: int) -> None:
        self.z_travel = valid_z_travel(z_travel)
        super().__init__()

    def elaborate(self, platform) -> Module:
        m = Module()

        resting = Signal()
        # This start has been taken, or came too early. Neither reset nor manual mode makes it new.
        started = Signal(reset_less=True)
        counts = (self.ready & ~ResetSignal()) | ~resting
        m.d.sync += started.eq(self.start & (started | counts))
        refused = Signal()
        raising = Signal()
        lowered = self.at_z[-1]  # at rest Z is at 0 or at -z_travel

        steps_x = Signal(16)
        steps_y = Signal(16)
        directions = []
        for name, at, target, steps in [
            ("x", self.at_x, self.order.x, steps_x), ("y", self.at_y, self.order.y, steps_y),
        ]:
            goal = Signal(16, name=f"goal_{name}")
            with m.If(resting):
                m.d.sync += goal.eq(target)
            past = at - Mux(resting, target, goal)  # 17 bits: the sign says on which side it is
            ascending = Signal(name=f"ascending_{name}")
            m.d.sync += [
                ascending.eq(past[-1]),
                steps.eq((past[:16] ^ past[-1].replicate(16)) + past[-1]),
            ]
            directions.append(ascending)

        none_x, none_y = ~steps_x.any(), ~steps_y.any()
        same = Signal()
        m.d.comb += same.eq(steps_x == steps_y)

        largest = Signal()
        move_tool = Signal()
        take_x = (steps_x < steps_y) ^ largest
        m.d.comb += [
            self.moves.p.direction.eq(Cat(*directions, raising)),
            self.moves.p.steps.eq(
                Mux(move_tool, self.z_travel, Mux(take_x, steps_x, steps_y))),
        ]

        with m.FSM(name="motion_state") as fsm:
            with m.State("REST"):
                m.d.comb += [
                    resting.eq(1),
                    self.ready.eq(~self.hold),
                ]
                m.d.sync += raising.eq(self.order.up)
                with m.If(self.ready & self.start & ~started):
                    with m.If(self.order.up & self.order.down):
                        m.d.sync += refused.eq(1)
                        m.next = "TOOL-WAIT"
                    with m.Elif(self.order.up | self.order.down):
                        m.next = "TOOL"
                    with m.Else():
                        m.next = "DECIDE"

            with m.State("DECIDE"):
                m.d.sync += refused.eq(0)
                with m.If(none_x & none_y):
                    m.next = "REST"
                with m.Elif(same):
                    m.next = "TOGETHER"
                with m.Elif(lowered & ~none_x & ~none_y):
                    m.d.sync += refused.eq(1)
                    m.next = "REST"
                with m.Else():
                    m.next = "DIAGONAL"

            with m.State("TOGETHER"):
                m.d.comb += [self.moves.valid.eq(1), self.moves.p.axes.eq(0b011)]
                with m.If(self.moves.ready):
                    m.next = "WAIT"

            with m.State("DIAGONAL"):
                m.d.comb += [
                    self.moves.valid.eq(~none_x & ~none_y),
                    self.moves.p.axes.eq(0b011),
                ]
                with m.If(self.moves.ready | ~self.moves.valid):
                    m.next = "DIAG-WAIT"

            with m.State("DIAG-WAIT"):
                with m.If(self.moves.ready):
                    m.next = "STRAIGHT"

            with m.State("STRAIGHT"):
                m.d.comb += [
                    self.moves.valid.eq(1),
                    self.moves.p.axes.eq(Cat(~none_x, ~none_y)),
                    largest.eq(1),
                ]
                with m.If(self.moves.ready):
                    m.next = "WAIT"

            with m.State("WAIT"):
                with m.If(self.moves.ready):
                    m.next = "REST"

            with m.State("TOOL"):
                m.d.sync += refused.eq(0)
                m.d.comb += [
                    self.moves.valid.eq(raising == lowered),
                    self.moves.p.axes.eq(Const(0b100)),
                    move_tool.eq(1),
                ]
                with m.If(self.moves.ready | ~self.moves.valid):
                    m.next = "TOOL-WAIT"

            with m.State("TOOL-WAIT"):
                with m.If(self.moves.ready):
                    m.next = "REST"

            with m.State("FAULT"):
                pass

        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))

        # A tool order that begins while another order is under way.
        with m.If(~resting & self.start & ~started & (self.order.up | self.order.down)):
            m.d.sync += refused.eq(1)

        m.d.comb += self.error.eq(refused | self.fault)
        return m
