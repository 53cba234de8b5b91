# amaranth: UnusedElaboratable=no
# pyright: reportGeneralTypeIssues=false

"""State machines: every one that a machine holds is marked, and its unused codes lead to a fault.

What follows from an upset is proved of each, and found in the netlists of boards.
"""

from collections.abc import Callable
from contextlib import contextmanager

import pytest
from amaranth import Fragment, Module, Signal
from amaranth.sim import Simulator

from fresa.fsm import leave_unused_codes
from fresa.machines import MillStation, SerialOrders
from fresa.machines.mill import MillTiming
from fresa.motion import CoordinateGenerator, SquareGenerator
from tb.boards import board
from tb.design import Design
from tb.machines.mill import MACHINE

TIMING = MillTiming(period=3, scan_bits=3)
PICTURE = [[True] * 9] * 9


def station(source) -> Design:
    return board("mill", MillStation(source=source, timing=TIMING, z_travel=5), debounce=2)


MACHINES = {
    "mill": lambda: MACHINE.design(timing=TIMING, z_travel=5),
    "square": lambda: station(SquareGenerator(side=500)),
    "picture": lambda: station(CoordinateGenerator(PICTURE, pixel_steps=4)),
    "serial": lambda: station(SerialOrders(period=16)),
}
STATE_MACHINES = {
    "mill": {"order_state", "motion_state"},
    "square": {"order_state", "motion_state", "handshake_state", "square_state"},
    "picture": {"order_state", "motion_state", "handshake_state", "coordinates_state"},
    "serial": {"order_state", "motion_state", "handshake_state", "receiver_state"},
}


def made_for(make: Callable[[], Design]) -> dict:
    """Return every state machine that is made for a design, by its register.

    They are caught where Amaranth makes them, so that none can hide.
    """
    found = {}
    machine: Callable = Module.FSM

    @contextmanager
    def caught(self, *args, **kwargs):
        with machine(self, *args, **kwargs) as fsm:
            yield fsm
        name = fsm.state.name.removesuffix("_state")
        assert name not in found
        found[name] = fsm

    design = make()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Module, "FSM", caught)
        Fragment.get(design.top, None)
    return found


@pytest.mark.parametrize("machine", MACHINES)
def test_all_are_found_and_keep_their_codes(machine):
    found = made_for(MACHINES[machine])
    assert found.keys() == STATE_MACHINES[machine]
    for fsm in found.values():
        assert fsm.state.attrs["fsm_encoding"] == "none"
        assert fsm.state.attrs["fsm_extract"] == "no"
        assert fsm.state.init != fsm.encoding["FAULT"]


def test_fault_is_for_unused_codes_only():
    """The first unused code goes to the fault, the last used one does not."""
    m = Module()
    go, bad = Signal(), Signal()
    with m.FSM(name="state") as fsm:
        with m.State("A"):
            with m.If(go):
                m.next = "B"
        with m.State("B"):
            m.next = "A"
        with m.State("FAULT"):
            m.d.comb += bad.eq(1)
    leave_unused_codes(m, fsm, fault="FAULT")

    async def testbench(ctx):
        for code, after in [(0, 0), (1, 0), (2, 2), (3, 2)]:
            ctx.set(fsm.state, code)
            await ctx.tick()
            assert (ctx.get(fsm.state), ctx.get(bad)) == (after, after == 2)

    sim = Simulator(m)
    sim.add_clock(1e-6)
    sim.add_testbench(testbench)
    sim.run()


def test_machine_without_unused_codes():
    m = Module()
    with m.FSM(name="state") as fsm:
        for name, after in [("A", "B"), ("B", "C"), ("C", "A"), ("FAULT", "FAULT")]:
            with m.State(name):
                m.next = after
    leave_unused_codes(m, fsm, fault="FAULT")
    assert fsm.state.attrs == {"fsm_encoding": "none", "fsm_extract": "no"}

    async def testbench(ctx):
        seen = [await ctx.tick().sample(fsm.state) for _ in range(4)]
        assert [state for _, _, state in seen] == [0, 1, 2, 0]

    sim = Simulator(m)
    sim.add_clock(1e-6)
    sim.add_testbench(testbench)
    sim.run()
