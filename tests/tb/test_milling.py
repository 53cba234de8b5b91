# amaranth: UnusedElaboratable=no

"""Pictures milled in simulation, from switches to coils; and that a bad job is found out."""

import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fresa.machines import MillStation
from fresa.machines.mill import MillTiming
from fresa.motion import CoordinateGenerator
from tb import milling
from tb.boards import board
from tb.engines import AmaranthEngine, CXXRTLEngine
from tb.milling import AUTOMATIC, DEBOUNCE, LED, Cut, mill_picture, press
from tb.plant import Plant

PITCH, TRAVEL = 4, 6
DOT = np.array([[1]], bool)
CORNER = np.array([[1, 0], [1, 1]], bool)


def blob(rows: int, columns: int, seed: int, share: float) -> np.ndarray:
    rng = random.Random(seed)
    picture = np.array([[rng.random() < share for _ in range(columns)] for _ in range(rows)], bool)
    picture[rng.randrange(rows), rng.randrange(columns)] = True
    return picture


def mill(picture, *, shown=None, period=1) -> Cut:
    """Mill a picture with short pixels and a short stroke; `shown` is the picture of the plant."""
    plant = Plant(picture if shown is None else shown, pitch=PITCH, travel=TRAVEL)
    machine = MillStation(
        source=CoordinateGenerator(picture.tolist(), pixel_steps=PITCH),
        timing=MillTiming(period, 8), z_travel=TRAVEL)
    design = board("mill", machine, debounce=DEBOUNCE)
    watch = ("axis_x", "axis_y", "axis_z", "leds")
    with AmaranthEngine(design) as engine:
        plant.feed(engine.run(0, watch))
        engine.set(switches=AUTOMATIC)
        engine.run(2 * DEBOUNCE + 4)
        press(engine, "start")
        while engine.get("leds") & LED["busy"]:
            assert engine.clock < 500_000
            plant.feed(engine.run(1000, watch))
        plant.feed(engine.run(2, watch))
        return Cut(plant.target, plant, period, engine.clock, 0.0, engine.name)


class TestBlobs:
    @settings(deadline=None, database=None, derandomize=True, max_examples=8)
    @given(
        rows=st.integers(1, 12),
        columns=st.integers(1, 12),
        seed=st.integers(0, 999),
        share=st.sampled_from([0.1, 0.5, 0.9]),
        period=st.integers(1, 2),
    )
    def test_is_milled_as_asked(self, rows, columns, seed, share, period):
        cut = mill(blob(rows, columns, seed, share), period=period)
        assert (cut.missed, cut.in_error, cut.plant.faults) == (0, 0, [])
        assert cut.right
        assert all(n is None or n >= period for n in cut.plant.least.values())
        assert cut.plant.lifts >= 1


class TestMachine:
    def test_corner(self):
        """Two straights and a diagonal of 128 steps, down and up 1152: nothing else is made."""
        seen = []
        cut = mill_picture(CORNER, AmaranthEngine, progress=seen.append)
        assert cut.right
        assert sum(seen) == 3
        facts = cut.facts()
        assert facts["pixels_cut"] == facts["pixels_asked"] == 3
        assert cut.plant.steps["axis_z"] == 2 * 1152
        assert facts["strokes"] == 1
        assert cut.plant.milled.steps == 2 * 128
        assert cut.plant.air.steps == 128

    @pytest.mark.compiler
    def test_engines_agree(self):
        cuts = [mill_picture(CORNER, kind, period=2) for kind in (AmaranthEngine, CXXRTLEngine)]
        times = ("engine", "simulation_seconds", "clocks_per_second", "clocks", "job_seconds")
        facts = [
            {name: fact for name, fact in cut.facts().items() if name not in times} for cut in cuts
        ]
        assert facts[0] == facts[1]
        assert (cuts[0].plant.corners == cuts[1].plant.corners).all()

    @pytest.mark.compiler
    def test_larger_picture(self):
        cut = mill_picture(blob(40, 60, 7, 0.4), CXXRTLEngine)
        assert cut.right
        assert cut.plant.least["axis_x"] == 1


class TestChecker:
    """Shown another picture than is milled, it says what is missing and what is too much."""

    def test_a_missing_pixel(self):
        shown = CORNER.copy()
        shown[0, 1] = True
        cut = mill(CORNER, shown=shown)
        assert (cut.missed, cut.in_error) == (1, 0)
        assert not cut.right

    def test_a_pixel_too_many(self):
        shown = CORNER.copy()
        shown[1, 1] = False
        cut = mill(CORNER, shown=shown)
        assert cut.missed == 0
        assert cut.in_error > 1  # the pixel, and steps on the way to it
        assert not cut.right

    def test_mirrored(self):
        cut = mill(CORNER, shown=CORNER[:, ::-1])
        assert cut.missed and cut.in_error and not cut.right

    def test_machine_in_error(self):
        """A machine that cannot mill says so instead of waiting for ever."""

        class Stuck(AmaranthEngine):
            def _get(self, names):
                levels = super()._get(names)
                return (levels[0] | LED["error"],) if tuple(names) == ("leds",) else levels

        with pytest.raises(RuntimeError, match=r"^the machine shows an error at clock \d+$"):
            mill_picture(DOT, Stuck)

    def test_machine_that_stands_still(self, monkeypatch):
        def start_and_stop(engine, button):
            press(engine, button)
            press(engine, "stop")

        monkeypatch.setattr(milling, "press", start_and_stop)
        with pytest.raises(RuntimeError, match=r"^the machine has made no step since clock \d+$"):
            mill_picture(DOT, AmaranthEngine)
