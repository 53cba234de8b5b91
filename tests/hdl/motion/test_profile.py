# amaranth: UnusedElaboratable=no

"""The speed profile: to the clock as its model, and what a path feels of it, without a model."""

import random
import re

import numpy as np
import pytest

from benchmarks.ideal import ideal
from benchmarks.step_times import Path1D, deviations, plan, program
from fresa.clock import CLOCK
from fresa.motion import SpeedProfile
from tb.bench import Run
from tb.benches.profile import FRACTION, SMALL, SPEED, any_blocks, compare_profile
from tb.models.profile import Block, ProfileModel


def compare(clocks, blocks, exits, **others) -> None:
    """Compare the profile with its model in so many clocks."""
    run, dut = Run(), SpeedProfile(**SMALL)

    async def test(ctx):
        await compare_profile(run, ctx, dut, clocks, blocks, exits, **others)

    run.simulate(dut, test)


def brief_path(rng: random.Random) -> Path1D:
    """Return a path whose acceleration takes 1/3 to 5 ms, with a top speed or without."""
    acceleration = int(10**rng.uniform(8, 10.2))
    seconds = 10**rng.uniform(-3.477, -2.3)
    peak = acceleration * seconds
    level = rng.random() < 0.5
    path = Path1D(int(256 * peak * seconds * (rng.uniform(1, 3) if level else 1)), acceleration,
                  int(peak * (1 if level else rng.uniform(1, 3))) + 1)
    block = path.block()
    return path if block.energy > 1 and 3 <= block.log2_ticks <= 17 else brief_path(rng)


class TestSpeedProfile:
    @pytest.mark.parametrize("seed", range(5))
    def test_is_its_model_in_every_clock(self, seed):
        rng = random.Random(seed)
        clocks = 1200
        exits = [rng.randrange(4**SPEED) * (rng.random() < 0.3) for _ in range(clocks // 50)]
        holds = sorted(rng.sample(range(clocks), rng.choice([0, 2, 4])))
        compare(clocks, any_blocks(rng), [each for each in exits for _ in range(50)], holds=holds)

    def test_obeys_a_nominal_speed_that_changes(self):
        rng = random.Random(9)
        compare(1200, any_blocks(rng), [4**SPEED - 1] * 900 + [0],
                percents=[100, 4, 60, 1, 30])

    @pytest.mark.parametrize("energy", [40, 92])
    def test_reaches_the_highest_speed(self, energy):
        top = 2**SPEED - 1
        block = Block(energy, int(2.7 * top * 2**FRACTION), top**2, 7)
        compare(1500, [(block, 0)], [0])

    @pytest.mark.parametrize("energy", [5, 11])
    def test_reaches_half_the_highest_speed(self, energy):
        top = 2**(SPEED - 1) - 1
        block = Block(energy, int(2.7 * top * 2**FRACTION), top**2, 7)
        compare(1500, [(block, 0)], [0])


class TestModel:
    def test_granules_at_one_speed_may_be_one(self):
        path = Path1D(length=2_000_000 * 256, acceleration=4 * 10**9, speed=200_000_000)
        short = Path1D(length=1_000_000 * 256, acceleration=4 * 10**9, speed=100_000_000)
        paths = [path, short, path]
        ends = plan(random.Random(4), paths)
        ticks = []
        for merge in (False, True):
            model = ProfileModel([(each.block(), 0) for each in paths],
                                 lambda number, _: ends[number])
            granules = list(model.granules(merge=merge))
            assert model.late == 0 and not model.starved
            ticks.append([granule.clock(tick) for granule in granules
                          for tick in range(1, granule.size + 1)])
        assert ticks[0] == ticks[1]
        assert len(ticks[0]) == sum(1 << each.block().log2_ticks for each in paths)

    @pytest.mark.parametrize("blocks", [1, 5])
    def test_ticks_are_within_two_clocks_of_the_ideal(self, blocks):
        rng = random.Random(blocks)
        paths = program(rng, blocks)
        while paths[0].acceleration < 2 * paths[0].speed:  # to be quick
            paths = program(rng, blocks)
        found = deviations(paths, plan(rng, paths))
        assert -2 < found.least < found.most < 2
        assert found.clocks > 10_000 and len(found.ends) == blocks

    @pytest.mark.parametrize("length_mm", [40, 80])
    def test_a_hold_ends_in_time_where_little_speed_is_left_to_the_last_tick(self, length_mm):
        """To 100 mm/s and back it takes 2**k ticks, and speed of what is rounded is left."""
        path = Path1D(256 * length_mm * 10**6, 5 * 10**8, 10**8)
        speeding = 10**8 * CLOCK // (5 * 10**8)  # clocks, as many as it brakes
        model = ProfileModel([(path.block(), 0)], lambda *_: 0, [speeding + 123_456],
                             fraction_bits=16)
        granules = list(model.granules())
        assert granules[-1].square == 0 and granules[-2].square < path.block().energy // 100
        assert 0 <= granules[-1].ended - (speeding + 123_456) - speeding < CLOCK // 200

    def test_a_thousand_short_blocks_are_off_by_no_more(self):
        rng = random.Random(0)
        paths = [Path1D(256 * rng.randrange(20_000, 60_000), 2 * 10**9, 200_000_000)
                 for _ in range(1000)]
        found = deviations(paths, plan(rng, paths), samples=1)
        assert max(map(abs, found.ends)) < 2

    @pytest.mark.parametrize(("microseconds", "apart"), [
        (1, 200), (3, 200), (10, 200), (30, 100), (118, 9), (300, 4), (1000, 1.5)])
    def test_where_granules_are_over_early_ticks_are_few_clocks_apart(self, microseconds, apart):
        acceleration = 17 * 10**9
        speed = acceleration * microseconds // 10**6
        path = Path1D(length=speed * 256 // 500, acceleration=acceleration, speed=speed)
        found = deviations([path], [0], samples=1 << 20)
        assert -apart < found.least < found.most < apart

    @pytest.mark.parametrize("seed", range(10))
    def test_granules_end_within_three_clocks_from_a_third_of_a_millisecond_on(self, seed):
        path = brief_path(random.Random(seed))
        block = path.block()
        model = ProfileModel([(block, 0)], lambda *_: 0, fraction_bits=16)
        granules = list(model.granules())
        ticks = np.cumsum([granule.size for granule in granules])
        ended = np.array([granule.ended - granules[0].began for granule in granules])
        unit = np.longdouble(path.length) / 256 * CLOCK / (1 << block.log2_ticks)
        by = ended - ideal(block, unit, 0, 0, ticks)
        assert ticks[-1] == 1 << block.log2_ticks
        assert -3 < by.min() < by.max() < 3


class TestParameters:
    @pytest.mark.parametrize(("changed", "message"), [
        ({"speed_bits": 1}, "speed_bits must be a whole number from 2 to 64, not 1"),
        ({"fraction_bits": 0}, "fraction_bits must be a whole number from 1 to 64, not 0"),
        ({"most_ticks_log2": 0}, "most_ticks_log2 must be a whole number from 1 to 63, not 0"),
        ({"brake_bits": 61}, "brake_bits must be a whole number from 62 to 256, not 61"),
    ])
    def test_impossible(self, changed, message):
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            SpeedProfile(**changed)
