"""From a stream of orders to the thesis's handshake."""

from amaranth import Module
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from ..fsm import leave_unused_codes
from .orders import Order

__all__ = ["StartHandshake"]


class StartHandshake(wiring.Component):
    """Hands the orders of a stream to a controller by ``start`` and ``ready``, one at a time.

    An order is taken from the stream when the controller has carried it out: when ``ready`` has
    been seen to fall and to rise again (thesis, 5.4: the hardest bug was not to wait for both). An
    order that ends in ``error`` is never taken: its source waits, and moves nothing on, until
    reset.

    ==========  ===================================================  ==============================
    state       does                                                 next
    ==========  ===================================================  ==============================
    WAIT-READY  waits for an order and for the controller            START
    START       holds ``start`` until ``ready`` falls                MOVING
    MOVING      waits for ``ready``; takes the order if no error     WAIT-READY
    FAULT       shows ``fault``, takes nothing                       stays until reset
    ==========  ===================================================  ==============================

    Members
    -------
    orders : In(stream.Signature(Order))
        Orders to carry out.
    ready, error : In(1)
        From the controller.
    order : Out(Order)
        To the controller.
    start : Out(1)
        To the controller.
    fault : Out(1)
        The state register was upset. Stays until reset.
    """

    orders: In(stream.Signature(Order))
    ready: In(1)
    error: In(1)
    order: Out(Order)
    start: Out(1)
    fault: Out(1)

    def elaborate(self, platform) -> Module:
        m = Module()

        m.d.comb += self.order.eq(self.orders.payload)
        with m.FSM(name="handshake_state") as fsm:
            with m.State("WAIT-READY"):
                with m.If(self.orders.valid & self.ready):
                    m.next = "START"

            with m.State("START"):
                m.d.comb += self.start.eq(1)
                with m.If(~self.ready):
                    m.next = "MOVING"

            with m.State("MOVING"):
                with m.If(self.ready & ~self.error):
                    m.d.comb += self.orders.ready.eq(1)
                    m.next = "WAIT-READY"

            with m.State("FAULT"):
                pass

        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))
        return m
