# amaranth: UnusedElaboratable=no

"""The speed profile: to the clock as its model, and what a path feels of it, without a model."""

import random
import re
from bisect import bisect_right

import pytest

from benchmarks.step_times import Path1D, deviations, plan, program
from fresa.motion import SpeedProfile
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.models.profile import Block, Granule, ProfileModel

SPEED, FRACTION, TICKS = 6, 4, 8
SQUARE, MODULUS = 2 * SPEED, SPEED + FRACTION + 3


def any_blocks(rng: random.Random) -> list[tuple[Block, int]]:
    """Make blocks that no planner would have made, beside some that it would."""
    blocks, clock, top = [], 0, 2**SPEED - 1
    for _ in range(rng.randint(1, 5)):
        log2_ticks, speed = rng.choice([0, 1, 2, 3, 5, 6, 7]), rng.randint(1, top)
        energy = rng.choice([2, rng.randint(2, (top**2 >> log2_ticks) + 3),
                             speed**2 >> rng.randint(3, 7)])
        modulus = rng.choice([rng.uniform(2, 4) * speed, rng.uniform(2, 4) * top,
                              rng.uniform(0, 8) * top])
        clock += rng.choice([0, 0, 0, rng.randint(0, 3000)])
        blocks.append((Block(max(2, energy), int(modulus * 2**FRACTION) + 1, speed**2, log2_ticks),
                       clock))
    return blocks


class Bench:
    """The profile, with blocks, holds and an exit by the clock, as its model has them."""

    def __init__(self, blocks, exits, holds=(), percents=(100,)) -> None:
        self.blocks, self.exits, self.holds, self.percents = blocks, exits, holds, percents
        self.model = ProfileModel(blocks, lambda _, clock: exits(clock), holds, speed_bits=SPEED,
                                  fraction_bits=FRACTION, nominals=self.nominal)
        self.taken: list[int] = []
        self.starved: list[int] = []

    def nominal(self, number: int, clock: int) -> int:
        """Return the square that a block may have: by an override that changes now and then."""
        percent = self.percents[clock // 64 % len(self.percents)]
        return self.blocks[number][0].nominal * percent // 100

    def expected(self, clocks: int) -> tuple[dict[int, tuple[int, int]], list[Granule]]:
        """Return, of each clock with a tick, whether it is a block's first or last."""
        ticks, granules = {}, []
        for granule in self.model.granules():
            made = granule.clocks(self.model.backlog)
            ticks |= {clock: (0, 0) for clock in made}
            ticks[made[0]] = (int(granule.first), 0)
            if granule.last:
                ticks[made[-1]] = (ticks[made[-1]][0], 1)
            granules.append(granule)
            if granule.began > clocks:
                break
        return ticks, granules

    def run(self, clocks: int) -> None:
        """Compare so many clocks."""
        ticks, granules = self.expected(clocks)
        begins = {granule.began: granule for granule in granules}
        ends = {granule.ended for granule in granules}
        running, at_rest = None, True
        with AmaranthEngine(component("profile", SpeedProfile(
                speed_bits=SPEED, fraction_bits=FRACTION, most_ticks_log2=TICKS,
                brake_bits=SQUARE + TICKS))) as engine:
            for clock in range(clocks):
                self._offer(engine, clock)
                tick = ticks.get(clock)
                seen = {name: engine.get(name) for name in ("tick", "first", "last", "speed")}
                first, last = tick or (0, 0)
                assert seen == {"tick": int(tick is not None), "first": first, "last": last,
                                "speed": running.rate >> FRACTION + 1 if running else 0}, clock
                assert engine.get("standing") == (running is None and at_rest), clock
                if engine.get("starved"):
                    self.starved.append(clock)
                    at_rest = True
                if clock in ends:
                    assert running
                    running, at_rest = None, running.square == 0
                running = begins.get(clock, running)
                engine.run(1)
        assert self.taken == [clock for clock in self.model.taken if clock < clocks]
        assert self.starved == [clock for clock in self.model.starved if clock < clocks]

    def _offer(self, engine: AmaranthEngine, clock: int) -> None:
        """Set the inputs of a clock."""
        number = len(self.taken)
        offered = number < len(self.blocks) and self.blocks[number][1] <= clock
        engine.set(blocks_valid=int(offered), hold=bisect_right(self.holds, clock) % 2,
                   exit=self.exits(clock), nominal=self.nominal(number - 1, clock) if number else 0)
        if offered:
            block = self.blocks[number][0]
            engine.set(blocks_payload=block.energy | block.modulus << SQUARE
                       | block.log2_ticks << SQUARE + MODULUS)
            if engine.get("blocks_ready"):
                self.taken.append(clock)


class TestSpeedProfile:
    @pytest.mark.parametrize("seed", range(5))
    def test_is_its_model_in_every_clock(self, seed):
        rng = random.Random(seed)
        clocks = 1200
        exits = [rng.randrange(4**SPEED) * (rng.random() < 0.3) for _ in range(clocks)]
        holds = sorted(rng.sample(range(clocks), rng.choice([0, 2, 4])))
        Bench(any_blocks(rng), lambda clock: exits[clock // 50] if clock < 50 * clocks else 0,
              holds).run(clocks)

    def test_obeys_a_nominal_speed_that_changes(self):
        rng = random.Random(9)
        Bench(any_blocks(rng), lambda clock: 4**SPEED - 1 if clock < 900 else 0,
              percents=[100, 4, 60, 1, 30]).run(1200)

    @pytest.mark.parametrize("energy", [40, 92])
    def test_reaches_the_highest_speed(self, energy):
        top = 2**SPEED - 1
        block = Block(energy, int(2.7 * top * 2**FRACTION), top**2, 7)
        Bench([(block, 0)], lambda clock: 0).run(1500)

    @pytest.mark.parametrize("energy", [5, 11])
    def test_reaches_half_the_highest_speed(self, energy):
        top = 2**(SPEED - 1) - 1
        block = Block(energy, int(2.7 * top * 2**FRACTION), top**2, 7)
        Bench([(block, 0)], lambda clock: 0).run(1500)


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
