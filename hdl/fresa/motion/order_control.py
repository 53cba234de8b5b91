"""One simple movement at a time."""

from amaranth import Module, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from ..drive import FrequencyDivider, valid_period
from ..fsm import leave_unused_codes
from .orders import Move

__all__ = ["OrderControl"]


class OrderControl(wiring.Component):
    """Makes the step requests of a simple movement and stops exactly at its end.

    *Control de Órdenes* (thesis, 4.1.3).

    ========  ======  ====================================================  =======================
    state     thesis  does                                                  next
    ========  ======  ====================================================  =======================
    REST      S0      waits for a move; ``moves.ready`` is high             MOVING if it has axes
    MOVING    S1      requests a step at every tick of the divider          CLEAR once ``reached``
    CLEAR     S2      clears the axes and the divider                       REST
    FAULT     (ours)  requests nothing, shows ``fault``                     stays until reset
    ========  ======  ====================================================  =======================

    A move that is taken in clock t requests its first step in clock t + ``period``, and the others
    ``period`` clocks apart. A move without axes or without steps requests none. A step that is not
    made is not in ``count``, and is requested again at the next tick.

    Parameters
    ----------
    period : int
        Clocks from one step to the next.

    Members
    -------
    moves : In(stream.Signature(Move))
        Movements to make; ready exactly while at rest.
    count : In(16)
        Steps made since ``clear``: the main counter.
    clear : Out(1)
        A movement begins: count from 0.
    step, direction : Out(3)
        Step requests; ``direction`` holds from one move to the next.
    fault : Out(1)
        The state register was upset. Stays until reset.
    """

    moves: In(stream.Signature(Move))
    count: In(16)
    clear: Out(1)
    step: Out(3)
    direction: Out(3)
    fault: Out(1)

    def __init__(self, *, period: int) -> None:
        self.period = valid_period(period)
        super().__init__()

    def elaborate(self, platform) -> Module:
        m = Module()

        m.submodules.divider = divider = FrequencyDivider(period=self.period)
        axes = Signal(3)
        steps = Signal(16)
        reached = Signal()
        # The count comes from below; >= takes a carry chain where == takes three times the logic.
        m.d.comb += reached.eq(self.count >= steps)

        with m.FSM(name="order_state") as fsm:
            with m.State("REST"):
                m.d.comb += self.moves.ready.eq(1)
                with m.If(self.moves.valid & self.moves.p.axes.any()):
                    m.d.comb += self.clear.eq(1)
                    m.d.sync += [
                        axes.eq(self.moves.p.axes),
                        self.direction.eq(self.moves.p.direction),
                        steps.eq(self.moves.p.steps),
                    ]
                    m.next = "MOVING"

            with m.State("MOVING"):
                m.d.comb += divider.enable.eq(1)
                with m.If(reached):
                    m.next = "CLEAR"
                with m.Elif(divider.tick):
                    m.d.comb += self.step.eq(axes)

            with m.State("CLEAR"):
                m.d.comb += divider.clear.eq(1)
                m.d.sync += axes.eq(0)
                m.next = "REST"

            with m.State("FAULT"):
                pass

        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))
        return m
