# amaranth: UnusedElaboratable=no

"""Blocks to steps: queue, profile and walk together, against the models of each."""

import random
from collections.abc import Mapping, Sequence

import pytest

from fresa.motion import BlockMotion
from tb.benches.blocks import block_words, place_words
from tb.boards import component
from tb.design import Design
from tb.engines import AmaranthEngine, CXXRTLEngine, Engine
from tb.models.gcode_plan import MotionBlock, Planner, PlanSettings
from tb.models.plan import plan
from tb.models.profile import Block, ProfileModel
from tb.models.walk import Walked, segment_steps

SETTINGS = PlanSettings(clock=2_000_000, speeds=(50_000_000,) * 3,
                        accelerations=(1_000_000_000, 800_000_000, 2_000_000_000),
                        steps=(80_000, 40_000, 250_000), deviation=20_000)


class Machine:
    """The gateware, and the steps that it has made."""

    def __init__(self, engine: Engine) -> None:
        self.engine = engine
        engine.set(made=1, feed_override=100, rapid_override=100,
                   **{f"steps_{axis}": steps for axis, steps in enumerate(SETTINGS.steps)})
        engine.run(1)
        self.steps: list[list[tuple[int, int]]] = [[], [], []]  # clock and way, of each axis
        self.starved = 0

    def write(self, words: Mapping[int, int]) -> None:
        """Write a block, waiting for room."""
        for number, (address, word) in enumerate(words.items(), 1):
            self.engine.set(words_valid=1, words_payload=address | word << 5
                            | (number == len(words)) << 41)
            while not self.engine.get("words_ready"):
                self.run(1)
            self.run(1)
        self.engine.set(words_valid=0)

    def run(self, clocks: int) -> None:
        seen = self.engine.run(clocks, watch=("step", "direction", "starved"))
        for clock, step, direction, starved in zip(
                seen.clock, seen["step"], seen["direction"], seen["starved"], strict=True):
            self.starved += int(starved)
            for axis in range(3):
                if step >> axis & 1:  # for one clock
                    self.steps[axis].append((int(clock), 1 if direction >> axis & 1 else -1))


def program(rng: random.Random, count: int, sizes: Sequence[int]
            ) -> tuple[list[MotionBlock], list[tuple[int, ...]]]:
    """Plan random lines of some sizes in nm; return them and their ends."""
    planner = Planner(SETTINGS)
    blocks, ends = [], []
    while len(blocks) < count:
        size = rng.choice(sizes)
        target = [at + rng.choice([0, rng.randint(-size, size)]) for at in planner.position]
        feed = rng.randint(max(10**5, 4 * size), 10**8)  # a quarter of a second at most
        block = planner.line(target, rng.choice([None, feed]))
        if block:
            blocks.append(block)
            ends.append(planner.position)
    return blocks, ends


def steps_at(position: Sequence[int]) -> list[int]:
    """Return a position in steps: the nearest, of two the higher."""
    return [(2 * at * steps + 10**9) // (2 * 10**9)
            for at, steps in zip(position, SETTINGS.steps, strict=True)]


def expected_steps(blocks: Sequence[MotionBlock], granules, begins: Sequence[int]
                   ) -> list[list[tuple[int, int]]]:
    """Return the steps of blocks: the granules give the clocks of their ticks."""
    steps: list[list[tuple[int, int]]] = [[], [], []]
    clocks: list[list[int]] = [[] for _ in blocks]
    for granule in granules:
        clocks[granule.block] += granule.clocks(1 << 48)
    place = begins
    for block, ticks in zip(blocks, clocks, strict=True):
        assert len(ticks) == 1 << block.log2_ticks
        change = [(new - old + (1 << 35)) % (1 << 36) - (1 << 35)
                  for new, old in zip(block.place, place, strict=True)]
        walked = Walked(increment=change, start=[each + 128 & 255 for each in place],
                        log2_ticks=block.log2_ticks)
        for axis, made in enumerate(segment_steps(walked)):
            steps[axis] += [(ticks[tick - 1], way) for tick, way in made]
        place = block.place
    return steps


def run_known(machine: Machine, blocks: Sequence[MotionBlock]) -> None:
    """Run blocks that are all known before the first begins, from 0."""
    engine = machine.engine
    engine.set(hold=1)
    machine.write(place_words(Planner(SETTINGS).places((0, 0, 0))))
    for block in blocks:
        machine.write(block_words(block))
    machine.run(2000)
    engine.set(hold=0)
    while not engine.get("idle"):
        machine.run(5000)
    assert not machine.starved
    assert not engine.get("fault")


def check(engine: Engine, seed: int, count: int, sizes: Sequence[int]) -> None:
    """Run lines, and compare every step with the models."""
    machine = Machine(engine)
    blocks, ends = program(random.Random(seed), count, sizes)
    run_known(machine, blocks)
    entries = [*plan([(block.limit, block.gain) for block in blocks]), 0]
    model = ProfileModel(
        [(Block(block.energy, block.modulus, block.nominal, block.log2_ticks), 0)
         for block in blocks], lambda number, _: entries[number + 1])
    expected = expected_steps(blocks, list(model.granules()),
                              Planner(SETTINGS).places((0, 0, 0)))
    delays = set()
    for made, due, end in zip(machine.steps, expected, steps_at(ends[-1]), strict=True):
        assert [way for _, way in made] == [way for _, way in due]
        assert sum(way for _, way in made) == end
        delays |= {clock - due_clock for (clock, _), (due_clock, _) in zip(made, due, strict=True)}
    assert len(delays) == 1  # all from one beginning


def motion() -> Design:
    return component("block_motion", BlockMotion(clock=SETTINGS.clock))


@pytest.fixture(scope="module")
def design() -> Design:
    return motion()


@pytest.mark.compiler
@pytest.mark.parametrize("seed", [
    0, *(pytest.param(seed, marks=pytest.mark.long) for seed in (1, 2))])
def test_lines_are_made_as_planned(design, seed):
    with CXXRTLEngine(design) as engine:
        check(engine, seed, 40, [10**4, 10**5, 10**6, 3 * 10**6])


def test_lines_are_made_as_planned_without_a_compiler():
    with AmaranthEngine(motion()) as engine:
        check(engine, 0, 2, [10**4, 2 * 10**4])


@pytest.mark.compiler
@pytest.mark.parametrize("size", [20, 100, 1000, 10_000])
def test_lines_that_are_over_at_once(design, size):
    """From 128 clocks up the next block is there in time."""
    with CXXRTLEngine(design) as engine:
        machine = Machine(engine)
        blocks, ends = program(random.Random(size), 60, [size])
        run_known(machine, blocks)
        for made, end in zip(machine.steps, steps_at(ends[-1]), strict=True):
            assert sum(way for _, way in made) == end
