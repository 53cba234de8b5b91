# amaranth: UnusedElaboratable=no

"""`vplotter` against the model of its strings: every half step of both motors, in its clock."""

import random
from math import hypot

import pytest

from fresa.drive import HALF_STEP
from fresa.motion import StringLength
from tb.engines import CXXRTLEngine
from tb.machines.vplotter import MACHINE, SHORT
from tb.machines.vplotter.modelled import modelled_steps, program
from tb.machines.vplotter.scenarios import GREETING, WallSession
from tb.models.strings import nearest_length


class Motors(WallSession):
    """A session that keeps every step of the motors."""

    def __init__(self, engine) -> None:
        super().__init__(engine, SHORT, place=SHORT.rest)
        self.steps: list[list[tuple[int, int]]] = [[], []]
        self.rows: list[int | None] = [None, None]

        def feel(rows, follow=self.plant.feel) -> None:
            follow(rows)
            for clock, *words in rows:
                for side, word in enumerate(words):
                    if word:
                        row, before = HALF_STEP.index(word), self.rows[side]
                        if before not in (None, row):
                            self.steps[side].append((clock, (row - before + 4) % 8 - 4))
                        self.rows[side] = row

        self.plant.feel = feel


@pytest.fixture(scope="module")
def design():
    return MACHINE.design(settings=SHORT)


@pytest.mark.compiler
@pytest.mark.parametrize("seed", [
    0, *(pytest.param(seed, marks=pytest.mark.long) for seed in range(1, 4))])
def test_every_step_comes_in_its_clock(design, seed):
    lines = program(random.Random(seed), 30)
    wanted = modelled_steps(lines)
    with CXXRTLEngine(design) as engine:
        session = Motors(engine)
        session.take(20_000, GREETING)
        session.ask("$X", "ok")
        session.ask(":P1", "Motors powered.")
        session.send("!")
        for line in lines:
            assert session.ask(line, "ok", 60_000) == b"ok\r\n"
        assert session.steps == [[], []]
        session.send("~")
        session.rest(4_000_000)
        assert engine.get("fault") == 0
    assert all(len(each) > 20 for each in wanted)
    begin = session.steps[0][0][0] - wanted[0][0][0]
    assert session.steps == [[(begin + clock, way) for clock, way in made] for made in wanted]


def test_nearest_length():
    assert [nearest_length(4, 0), nearest_length(5, 0), nearest_length(0, 12)] == [0, 1, 1]
    rng = random.Random(1)
    for _ in range(2000):
        across, below = rng.randrange(1 << 19), rng.randrange(1 << 19)
        found = nearest_length(across, below)
        assert abs(found - hypot(across, below) / 8) <= 0.5 + 1e-9
        assert found == StringLength(first_across=across, first_below=below).first_length
