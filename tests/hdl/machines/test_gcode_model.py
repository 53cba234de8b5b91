# amaranth: UnusedElaboratable=no

"""`gcode` against the model of the whole machine: every edge of STEP, in its clock."""

import random
from fractions import Fraction

import pytest

from benchmarks.end_positions import exact_steps, measure, measure_pins
from benchmarks.step_instants import A4988, KINDS, instants, program
from tb.engines import CXXRTLEngine
from tb.models.gcode_blocks import Motion
from tb.models.gcode_ends import moved
from tb.models.gcode_machine import MachineModel, pulses
from tb.models.gcode_plan import PlanSettings
from tests.hdl.machines.test_gcode import SETTINGS, Session, steps

pytestmark = pytest.mark.compiler

PLAN = PlanSettings.stored(SETTINGS.clock, SETTINGS.store)


def lines(rng: random.Random, count: int) -> list[str]:
    """Return lines and arcs of all kinds, short ones among them, and corners of any angle."""
    found = ["G91G1F3000"]
    while len(found) < count:
        size = rng.choice([0.001, 0.01, 0.1, 0.1, 1, 2])
        x, y, z = (rng.choice([0, rng.uniform(-size, size)]) for _ in range(3))
        radius, arc = max(0.002, abs(x)), rng.choice(["G2", "G3"])
        found.append(rng.choice([
            f"G1X{x:.4f}Y{y:.4f}", f"G1X{x:.4f}Y{y:.4f}Z{z:.4f}", f"G1X{x:.4f}",
            f"G1X{x:.4f}Y{y:.4f}F{rng.randint(300, 9000)}", f"G0Y{y:.4f}Z{z:.4f}",
            *[f"G1X{size / 20:.4f}"] * 3,
            f"G17{arc}X0Y0I{radius:.4f}J{y:.4f}", f"G18{arc}X0Z0I{radius:.4f}K{z:.4f}Y{y:.4f}",
            f"G19{arc}Y{radius:.4f}Z{radius:.4f}J{radius:.4f}",
            f"G17{arc}X{radius:.4f}Y{radius / 3:.4f}R{rng.choice([-1, 1]) * radius:.4f}",
            f"G17{arc}X{2 * radius:.4f}Y0I{radius + 4e-4:.4f}Z{z:.4f}",
            f"G93{arc}G17X{radius:.4f}Y0R{radius:.4f}F{rng.randint(60, 3000)} G94",
            "G1X1Y1I1", "G92X0"]))
        if "G94" in found[-1]:
            found.append(f"G1F{rng.randint(300, 9000)}")
    return found


def edges(path: list[tuple[int, tuple[int, ...]]]) -> list[list[tuple[int, int]]]:
    """Return the edges of each axis and their directions."""
    found: list[list[tuple[int, int]]] = [[], [], []]
    before = (0, 0, 0)
    for clock, at in path:
        for axis, (new, old) in enumerate(zip(at, before, strict=True)):
            if new != old:
                found[axis].append((clock, new - old))
        before = at
    return found


@pytest.mark.parametrize("seed", [
    0, *(pytest.param(seed, marks=pytest.mark.long) for seed in range(1, 4))])
def test_every_step_comes_in_its_clock(design, seed):
    program = lines(random.Random(seed), 40)
    model = MachineModel(PLAN, SETTINGS.driver)
    model.send("".join(f"{line}\n" for line in program).encode())
    with CXXRTLEngine(design) as engine:
        session = Session(engine)
        session.send("!", wait=False)
        assert [session.send(f"{line}\n", wait=False) for line in program] == [
            [answer] for answer in model.answers]
        assert not session.path
        session.send("~")
        assert not engine.get("fault")
    assert session.position == model.position == steps(model.program.language.position)
    found, wanted = edges(session.path), model.steps()
    begin = min(made[0][0] for made in found if made) - min(
        made[0][0] for made in wanted if made)
    assert found == [[(begin + clock, way) for clock, way in made] for made in wanted]


def test_clocks_are_those_of_motions_that_fit_the_queue():
    model = MachineModel(PLAN, SETTINGS.driver)
    model.send(b"G91\n" + 64 * b"G0X0.1\n")
    with pytest.raises(ValueError, match="^64 blocks are more than the queue takes$"):
        model.steps()
    model.send(b"M8\n")
    with pytest.raises(ValueError, match="^clocks are those of motions alone$"):
        model.steps()


@pytest.mark.parametrize("seed", range(6))
def test_ends_of_many_blocks_are_those_of_each(seed):
    program, model = lines(random.Random(seed), 60), MachineModel(PLAN, SETTINGS.driver)
    model.send("".join(f"{line}\n" for line in program).encode())
    found = moved(model.blocks)
    assert found.tolist() == [
        block.made() for block in model.blocks if isinstance(block, Motion)]
    assert found.sum(axis=0).tolist() == model.position == steps(model.program.language.position)


class TestInstants:
    @pytest.mark.parametrize("kind", KINDS)
    def test_edges_are_those_of_the_model_of_the_machine(self, kind, monkeypatch):
        requests: list[list[tuple[int, int]]] = []
        monkeypatch.setattr("benchmarks.step_instants.pulses", lambda steps, **times: (
            requests.append(list(steps)), pulses(steps, **times))[1])
        made = next(one for seed in range(99) if (
            one := program(kind, random.Random(f"{kind} {seed}"))).rate > 20_000
            and len(one.lines) < 63)
        found = instants(made)
        model = MachineModel(made.settings, made.driver)
        model.send("".join(f"{line}\n" for line in made.lines).encode())
        assert [pulses(steps, **made.driver) for steps in requests] == model.steps()
        assert -10 < found.by.min() and abs(found.ticks).max() < 2
        assert len(found.by) > 20 and abs(found.share).max() <= 2

    def test_a_step_that_comes_late_is_seen(self, monkeypatch):
        made = program("short", random.Random("short 3"))
        before = instants(made).by
        monkeypatch.setattr("benchmarks.step_instants.pulses", lambda steps, **times: [
            (clock + 100 * (number == 7), way)
            for number, (clock, way) in enumerate(pulses(steps, **times))])
        assert (instants(made).by - before > 99).sum() == 2  # X and Y
        assert made.driver == A4988


class TestEndPositions:
    def test_no_line_ends_off(self):
        found = measure(400, arcs=0.1)
        assert found.arcs > 20 and found.steps > 10_000
        assert (found.off, found.most) == (0, 0)

    def test_a_step_that_is_missing_is_found(self, monkeypatch):
        def without_one(blocks):
            steps = moved(blocks)
            steps[100:101, 1] -= 1
            return steps

        monkeypatch.setattr("benchmarks.end_positions.moved", without_one)
        found = measure(200, arcs=0)
        assert found.most == 1 and 80 < found.off < 120

    @pytest.mark.long  # the record does it with more blocks; the machine is compiled for a minute
    def test_the_gateware_ends_there_as_well(self):
        found = measure_pins(60, arcs=0.1)
        assert found.blocks == 60 and found.arcs > 1 and found.steps > 10_000
        assert (found.off, found.most) == (0, 0) and found.places > 0

    @pytest.mark.long
    def test_a_step_that_is_missing_at_a_pin_is_found(self, monkeypatch):
        monkeypatch.setattr("benchmarks.end_positions.exact_steps",
                            lambda *given: [at + 1 for at in exact_steps(*given)])
        assert measure_pins(20, arcs=0).most == 1

    @pytest.mark.parametrize(("position", "wanted"), [
        ((0, 0, 0), [0, 0, 0]), ((Fraction(1, 160), 0, 0), [1, 0, 0]),
        ((Fraction(-1, 160), Fraction(1, 100), -1), [0, 1, -400])])
    def test_half_a_step_is_rounded_up(self, position, wanted):
        assert exact_steps([Fraction(at) for at in position]) == wanted
