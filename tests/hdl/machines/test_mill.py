# amaranth: UnusedElaboratable=no

"""The mill: every output at every clock as its model; what needs none is proved of its pins."""

import gc
import re
from fractions import Fraction
from math import ceil
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fresa.machines import Mill
from fresa.machines.mill import Z_TRAVEL, MillTiming, step_period
from tb.engines import AmaranthEngine, CXXRTLEngine
from tb.machines.mill import MACHINE
from tb.machines.mill.actions import Hold, Jog, Mode, Order, Reset, Select, Stop, Together
from tb.machines.mill.model import MillModel
from tests.machines.mill.lockstep import AXES, Lockstep

NO_COMPILER = CXXRTLEngine.missing()
RAISE, LOWER = Order(up=1), Order(down=1)
RANDOM = settings(deadline=None, database=None, derandomize=True)


class Timing(NamedTuple):
    period: int
    z_travel: int
    jog_period: int = 1
    scan_bits: int = 3


TIMINGS = [Timing(1, 1), Timing(2, 3), Timing(3, 5, 4), Timing(16, 4, 17, 5)]


def lockstep(timing: Timing) -> Lockstep:
    kind = AmaranthEngine if NO_COMPILER else CXXRTLEngine
    design = MACHINE.design(
        timing=MillTiming(timing.period, timing.scan_bits, timing.jog_period),
        z_travel=timing.z_travel
    )
    return Lockstep(
        kind(design),
        lambda: MillModel(
            period=timing.period,
            scan_bits=timing.scan_bits,
            z_travel=timing.z_travel,
            jog_period=timing.jog_period,
        ),
    )


@pytest.fixture(scope="module", params=TIMINGS, ids=str)
def timing(request) -> Timing:
    return request.param


@pytest.fixture(scope="module")
def machine(timing):
    steps = lockstep(timing)
    yield steps
    steps.engine.close()


# Scripts

small = st.integers(0, 6)
near_the_end = st.integers(65530, 65535)
orders = st.builds(
    Order,
    x=st.one_of(small, small, near_the_end),
    y=small,
    up=st.just(0),
    down=st.just(0),
    start=st.integers(1, 3),
    wait=st.one_of(st.integers(0, 40), st.integers(0, 300)),
)
tool_orders = st.builds(
    Order,
    up=st.integers(0, 1),
    down=st.integers(0, 1),
    start=st.integers(1, 3),
    wait=st.one_of(st.none(), st.integers(0, 40)),
)
near_orders = st.builds(Order, x=small, y=small, start=st.integers(1, 60))
odd = st.tuples(st.sampled_from(["start", "up", "down", "stop", "rst", "mode"]), st.integers(0, 1))
actions = st.one_of(
    near_orders,
    tool_orders,
    orders,
    st.builds(Jog, mask=st.integers(0, 63), clocks=st.integers(1, 40), release=st.booleans()),
    st.builds(Mode, st.integers(0, 1)),
    st.builds(Mode, st.just(1)),
    st.builds(Select, st.integers(0, 3)),
    st.builds(Reset, st.integers(1, 3)),
    st.builds(Stop, st.integers(1, 3)),
    st.builds(Hold, st.integers(1, 50)),
    st.builds(Together, st.lists(odd, min_size=1, max_size=3).map(tuple), clocks=st.integers(0, 5)),
)
scripts = st.lists(actions, min_size=1, max_size=10).map(lambda tail: [Mode(1), *tail])

SCRIPTS = {
    "square": [Mode(1), *(Order(x, y) for x, y in [(9, 0), (9, 9), (0, 9), (0, 0)])],
    "diagonal then straight": [Mode(1), Select(1), Order(9, 4), Select(2), Order(2, 8),
        Select(0), Order(0, 8), Order(3, 0)],
    "lower, mill in 8 directions, raise": [Mode(1), Order(4, 4), LOWER, *(Order(4 + x, 4 + y)
        for x, y in [(1, 0), (0, 0), (0, 1), (0, 0), (-1, 0), (0, 0), (0, -1), (0, 0), (1, 1),
        (0, 0), (1, -1), (0, 0), (-1, 1), (0, 0), (-1, -1), (0, 0), (3, 3), (3, 0), (-4, 0)]),
        RAISE],
    "refused when lowered": [Mode(1), LOWER, Order(2, 1), Hold(9), Order(1, 2), Order(2, 2),
        Order(4, 3), RAISE, Order(4, 3)],
    "up and down together": [Mode(1), Order(up=1, down=1), Hold(5), Order(1, 1)],
    "nowhere to go": [Mode(1), Order(0, 0), RAISE, Hold(3), LOWER, LOWER, Order(0, 0), RAISE,
        RAISE],
    "held start": [Mode(1), Order(3, 0, start=200), Order(0, 3, start=1)],
    "a second start while busy": [Mode(1), Order(9, 0, wait=3), Order(1, 1, wait=3),
        Order(2, 2), Hold(20), Order(1, 1)],
    "a tool order while busy": [Mode(1), Order(9, 0, wait=3), Order(up=1, wait=300),
        Order(1, 1)],
    "a start that comes too early": [Mode(1), Order(5, 0, wait=3), Order(7, 7, start=200),
        Hold(9), Order(7, 7)],
    "wrap of X down": [Mode(1), Select(1), Together((("position_x", 0),)), Order(3, 0),
        Order(65535, 3, wait=900), Mode(0), Hold(2), Mode(1), Order(2, 0)],
    "jog each axis": [Hold(2), *(Jog(1 << bit, 40) for bit in range(6))],
    "jog all together": [Hold(2), *(Jog(mask, 9) for mask in range(64))],
    "a switch on at entry": [Together((("jog", 0b010101),)), Mode(1), Hold(5), Mode(0),
        Jog(0b010101, 20), Jog(0b000101, 20), Jog(0b010101, 20), Hold(2), Jog(0b010101, 20)],
    "switches put on in automatic mode": [Mode(1), Hold(3), Jog(0b010101, 5, False), Mode(0),
        Hold(20), Jog(0, 1), Jog(0b010101, 20)],
    "reset with switches on": [Hold(2), Jog(0b111111, 20, False), Reset(1), Hold(20), Jog(0, 1),
        Jog(1, 9)],
    "mode change under way": [Mode(1), Order(9, 4, wait=25), Mode(0), Hold(1), Mode(1),
        Order(9, 4, wait=31), Mode(0), Hold(1), Jog(0b001001, 20), Mode(1), Order(2, 2)],
    "jog switches in automatic": [Together((("mode", 1), ("jog", 0b111111)), 5), Order(3, 3),
        Mode(0), Hold(20)],
    "orders in manual": [Order(3, 3), Order(up=1, down=1), Hold(4), Mode(1), Hold(9)],
    "start held through a mode change": [Together((("start", 1), ("position_x", 3)), 5),
        Mode(1), Hold(40), Reset(2), Hold(40)],
    "start held through a reset and manual mode": [Mode(1),
        Together((("start", 1), ("position_x", 3)), 8), Reset(2), Hold(40), Mode(0), Hold(5),
        Mode(1), Hold(40), Together((("start", 0),), 1), Together((("start", 1),), 40),
        Together((("start", 0),), 1)],
    "reset under way": [Mode(1), Order(9, 4, wait=25), Reset(1), Order(9, 4, wait=29), Reset(3),
        LOWER, Order(2, 2), Reset(1), Order(4, 2)],
    "stop under way": [Mode(1), Order(9, 4, wait=25), Stop(1), Hold(50), Order(1, 1, wait=20),
        Mode(0), Jog(0b111111, 20), Hold(2), Jog(0b111111, 20), Mode(1), Hold(50), Reset(1),
        Order(2, 1)],
    "reset between two steps": [*(action for gap in range(1, 6) for action in (Hold(20),
        Jog(1, 2 * gap), Reset(1), Hold(gap), Jog(1, 30)))],
    "stop while a count shows": [action for count, order in [(1, Order(90, 0, wait=25)), (2,
        Order(90, 90, wait=25))] for action in (Mode(1), Select(count), order, Stop(1),
        Hold(50), Reset(1))],
    "stop while jogging": [Hold(2), Jog(0b001001, 20, False), Stop(1), Hold(20), Reset(),
        Hold(9), Jog(0, 2), Jog(0b001001, 9)],
    "stop with an order": [Mode(1), Together((("start", 1), ("stop", 1), ("position_x", 2))),
        Together((("start", 0), ("stop", 0)), 40), Reset(), Order(2, 0)],
    "reset with an order": [Mode(1), Together((("start", 1), ("rst", 1), ("position_x", 2))),
        Together((("rst", 0),), 40), Together((("start", 0),), 4), Order(3, 0)],
    "every count": [Mode(1), Order(3, 5), LOWER, *(a for n in range(4) for a in (Select(n),
        Hold(200)))],
}


class TestModel:
    @pytest.mark.parametrize("script", SCRIPTS.values(), ids=SCRIPTS)
    def test_scenario(self, machine, script):
        machine.apply(script)

    @settings(RANDOM, max_examples=25 if NO_COMPILER else 150)
    @given(script=scripts)
    def test_random(self, machine, script):
        machine.apply(script)

    @pytest.mark.compiler
    def test_noise(self, machine, timing):
        """Every input at random: each holds for a while, and a reset ends every stop."""
        rng = np.random.default_rng(timing.period)
        script = []
        for _ in range(6000):
            pins = {
                "position_x": rng.integers(0, 5),
                "position_y": rng.integers(0, 5),
                "start": rng.random() < 0.6,
                "up": rng.random() < 0.15,
                "down": rng.random() < 0.15,
                "rst": rng.random() < 0.02,
                "stop": rng.random() < 0.01,
                "counter_select": rng.integers(0, 4),
                "mode": rng.random() < 0.95,
                "jog": rng.integers(0, 64),
            }
            chosen = tuple((name, int(level)) for name, level in pins.items() if rng.random() < 0.7)
            script.append(Together(chosen, int(rng.choice([1, 1, 2, 5, 30]))))
        machine.apply(script)

    @pytest.mark.compiler
    def test_wrap_of_the_counters(self):
        """16 bits and no more: FFFF + 1 = 0000, which only jogging could reach, but clears."""
        steps = lockstep(Timing(1, 1))
        with steps.engine:
            seen = steps.apply([
                Mode(1), Select(1), Order(65535, 65535, wait=65600), Order(0, 65534, wait=65600),
                LOWER, Select(3), Hold(5)])
        assert seen["count"].max() == 65535


class TestPowerUp:
    def test_state_1_and_nothing_under_way(self):
        with AmaranthEngine(MACHINE.design(timing=MillTiming(1, 3), z_travel=Z_TRAVEL)) as engine:
            assert engine.get("axis_x", "axis_y", "axis_z") == (0b0110,) * 3
            assert engine.get("ready", "error", "count", "leds", "digits") == (0, 0, 0, 0b0110, 0xF)
            engine.set(mode=1)
            assert engine.get("ready", "error") == (1, 0)


class TestTiming:
    def test_defaults_are_the_machine_of_the_thesis(self):
        timing = MillTiming.real()
        assert timing.period == ceil(50_000_000 / Fraction("101.376")) == 493_214
        assert timing.jog_period == 1

    @pytest.mark.parametrize("refresh", [60, 61, 100, 1000])
    @pytest.mark.parametrize("clock", [50_000_000, 100_000_000, 12_000_000])
    def test_display_is_refreshed_often_enough(self, refresh, clock):
        timing = MillTiming.real(clock=clock, refresh=refresh)
        assert clock / (4 * 2**timing.scan_bits) >= refresh
        assert clock / (4 * 2 ** (timing.scan_bits + 1)) < refresh

    @pytest.mark.parametrize(
        ("rate", "period"),
        [
            ("101.376", 493_214),
            (101.376, 493_214),
            (Fraction("101.376"), 493_214),
            (50e6, 1),
            (100, 500_000),
            (3, 16_666_667),
            ("1/2", None),
            (50_000_001, None),
            (0, None),
            (-5, None),
            ("fast", None),
            ("1/0", None),
            (0.7, None),
            (0.8, 62_500_000),
        ],
    )
    def test_step_period(self, rate, period):
        if period is None:
            with pytest.raises(
                ValueError,
                match=(
                    r"^step rate must be from 0\.745 to 50000000 steps/s, not "
                    + re.escape(repr(rate))
                ),
            ):
                step_period(rate)
        else:
            assert step_period(rate) == period
            assert Fraction(50_000_000, period) <= Fraction(str(rate))

    @pytest.mark.filterwarnings("ignore::amaranth.hdl.UnusedElaboratable")
    @pytest.mark.parametrize(
        ("timing", "z_travel", "message"),
        [
            (MillTiming(0, 3), 5, "period must be a whole number from 1 to 67108864, not 0"),
            (
                MillTiming(2**26 + 1, 3),
                5,
                "period must be a whole number from 1 to 67108864, not 67108865",
            ),
            (MillTiming(1, 2), 5, "scan_bits must be a whole number from 3 to 24, not 2"),
            (MillTiming(1, 25), 5, "scan_bits must be a whole number from 3 to 24, not 25"),
            (MillTiming(1, 3, 0), 5, "jog_period must be a whole number from 1 to 67108864, not 0"),
            (MillTiming(1, 3), 0, "z_travel must be a whole number from 1 to 32768, not 0"),
            (MillTiming(1, 3), 32769, "z_travel must be a whole number from 1 to 32768, not 32769"),
            (MillTiming(True, 3), 5, "period must be a whole number from 1 to 67108864, not True"),
        ],
    )
    def test_impossible_values(self, timing, z_travel, message):
        raised = None
        try:  # what was made before the refusal is let go of here, not later
            Mill(timing=timing, z_travel=z_travel)
        except ValueError as error:
            raised = str(error)
        gc.collect()
        assert raised == message

    @pytest.mark.compiler
    def test_the_real_timing(self):
        """The thesis's N: three steps of a jog and three of an order, 493 214 clocks apart."""
        with CXXRTLEngine(MACHINE.design(timing=MillTiming.real(), z_travel=Z_TRAVEL)) as engine:
            engine.run(600_000, AXES)
            engine.set(jog=0b000101)
            changes = engine.run(3 * 493_214, AXES)
            assert np.diff(changes.clock).tolist() == [493_214] * 2
            engine.set(jog=0, mode=1, position_x=3, start=1)
            changes = engine.run(4 * 493_214, AXES)
            assert np.diff(changes.clock).tolist() == [493_214] * 2
            assert engine.get("ready")
