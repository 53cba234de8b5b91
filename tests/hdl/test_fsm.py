# amaranth: UnusedElaboratable=no
# pyright: reportGeneralTypeIssues=false

"""State machines: every one that a machine holds leaves every code that it should never be in."""

from collections.abc import Callable
from contextlib import contextmanager
from dataclasses import replace

import pytest
from amaranth import Elaboratable, Fragment, Module, Signal
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
DEBOUNCE = 2
SETTLE = 2 * DEBOUNCE + 4
AUTOMATIC = 1 << 7
RESET, START = 1, 2


def station(source) -> Design:
    return board("mill", MillStation(source=source, timing=TIMING, z_travel=5), debounce=DEBOUNCE)


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


class Elaborated(Elaboratable):
    """A fragment, as gateware that gives it whenever it is elaborated."""

    def __init__(self, fragment: Fragment) -> None:
        self.fragment = fragment

    def elaborate(self, platform) -> Fragment:
        return self.fragment


def elaborated(make) -> tuple[Design, dict]:
    """The design, elaborated once, and every state machine that was made for it, by its register.

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
        fragment = Fragment.get(design.top, None)
    return replace(design, top=Elaborated(fragment)), found


@pytest.mark.parametrize("machine", MACHINES)
def test_all_are_found_and_keep_their_codes(machine):
    found = elaborated(MACHINES[machine])[1]
    assert found.keys() == STATE_MACHINES[machine]
    for fsm in found.values():
        assert fsm.state.attrs["fsm_encoding"] == "none"
        assert fsm.state.attrs["fsm_extract"] == "no"
        assert fsm.state.init != fsm.encoding["FAULT"]


class Bench:
    """A machine that is at work, in Amaranth's simulator, where a register can be upset."""

    def __init__(self, ctx, design: Design) -> None:
        self.ctx, self.design = ctx, design
        self.board = "switches" in design.inputs

    async def clock(self, clocks: int = 1) -> None:
        for _ in range(clocks):
            self.ctx.set(self.design.clk, 1)
            await self.ctx.delay(10e-9)
            self.ctx.set(self.design.clk, 0)
            await self.ctx.delay(10e-9)

    def set(self, **levels: int) -> None:
        for name, level in levels.items():
            self.ctx.set(self.design.inputs[name], level)

    def get(self, name: str) -> int:
        return self.ctx.get(self.design.outputs[name])

    async def begin(self, under_way: bool) -> None:
        """Go to automatic mode; `under_way`, have a movement make its first step.

        Where orders come over a line, it is a movement by hand: an order takes 10 000 clocks.
        """
        by_hand = "rx" in self.design.inputs
        if by_hand:
            self.set(rx=1, switches=0)  # what is on after a reset does nothing until it was off
            await self.clock(SETTLE)
            self.set(switches=0b000101 if under_way else 0)
        elif self.board:
            self.set(switches=AUTOMATIC)
            await self.clock(SETTLE)
        else:
            self.set(mode=1)
            await self.clock()
        if not under_way:
            return
        if self.board and not by_hand:
            self.set(buttons=START)
            await self.clock(SETTLE)
            self.set(buttons=0)
        elif not self.board:
            self.set(position_x=900, position_y=400, start=1)
            await self.clock()
            self.set(start=0)
        before = self.coils
        for _ in range(1000):
            await self.clock()
            if self.coils != before:
                return
        raise AssertionError("nothing moves")

    async def reset(self) -> None:
        if self.board:
            self.set(buttons=RESET)
            await self.clock(SETTLE)
            self.set(buttons=0)
            await self.clock(SETTLE)
        else:
            self.set(rst=1)
            await self.clock()
            self.set(rst=0)
            await self.clock()

    @property
    def error(self) -> int:
        return self.get("leds") >> 6 & 1 if self.board else self.get("error")

    @property
    def coils(self) -> tuple[int, ...]:
        return self.get("axis_x"), self.get("axis_y"), self.get("axis_z")


def run(design: Design, testbench) -> None:
    sim = Simulator(design.top)

    async def bench(ctx):
        await testbench(ctx, Bench(ctx, design))

    sim.add_testbench(bench)
    sim.run()


@pytest.mark.parametrize(("machine", "name"), [
    (machine, name) for machine, names in STATE_MACHINES.items() for name in sorted(names)
    if machine != "serial" or name == "receiver_state"])  # all else is as with a square
def test_unused_codes_show_an_error_until_reset_and_no_coil_moves(machine, name):
    """The fault itself may be what an upset register holds."""
    design, found = elaborated(MACHINES[machine])
    fsm = found[name]
    used = {*fsm.encoding.values()} - {fsm.encoding["FAULT"]}
    # A receiver has seen after a reset that its line is at rest.
    after = fsm.encoding["IDLE"] if machine == "serial" else fsm.state.init

    async def testbench(ctx, bench):
        for code in sorted({*range(1 << len(fsm.state))} - used):
            for under_way in (False, True):  # the second, and the next code, show that it goes on
                await bench.begin(under_way)
                ctx.set(fsm.state, code)
                before = bench.coils
                for clock in range(30):
                    await bench.clock()
                    assert ctx.get(fsm.state) == fsm.encoding["FAULT"], code
                    assert bench.error, code
                    if bench.board and not clock:
                        before = bench.coils  # what was on its way to the pins
                    assert bench.coils == before, code
                await bench.reset()
                assert ctx.get(fsm.state) == after, code
                assert not bench.error, code

    run(design, testbench)


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
