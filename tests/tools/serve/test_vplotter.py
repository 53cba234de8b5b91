# amaranth: UnusedElaboratable=no

"""Sessions with the gateware of `vplotter`, whose plant hangs from its motors."""

from collections.abc import Iterator

import numpy as np
import pytest

from fresa.drive import HALF_STEP
from fresa_host import BlockRefused, Refused, VPlotter
from tb.engines.base import Changes
from tb.wall_plant import WallPlant
from tests.tools.process import PATIENCE
from tools.serve import servable
from tools.serve.planted import PlantedEngine

pytest.importorskip("serial", reason="pyserial missing: pip install -e '.[host]'")

WALL = ("--wall", 100, 80, "--least-y", 20, "--rest", 50, 40, "--string-rate", 1200,
        "--rate", 6000, "--acceleration", 2000)


def test_inputs_that_can_be_typed_are_inputs_of_the_machine():
    served = servable()["vplotter"]
    design = served.design(2_457_600, 9600)
    assert {*served.how.contacts} < {*design.inputs}
    plant = served.plant(2_457_600)
    assert plant and {*plant.levels} < {*design.inputs} and {*plant.outputs} < {*design.outputs}


class FakeEngine:
    """Winds the left string by a half step every 100 clocks, and shows its switch."""

    def __init__(self) -> None:
        self.clock, self.limits, self.shown = 0, 0, []

    def set(self, **levels: int) -> None:
        self.limits = levels.get("limits", self.limits)

    def run(self, clocks: int, watch) -> Changes:
        assert list(watch) == ["tx", "left", "right"]
        times = np.arange(self.clock, self.clock + clocks)
        self.shown += [self.limits] * clocks
        self.clock += clocks
        return Changes(times, {
            "tx": times % 2, "left": np.array([HALF_STEP[-(at // 100) % 8] for at in times]),
            "right": np.full(len(times), HALF_STEP[0])})


def test_a_switch_closes_in_the_time_of_a_step():
    plant = WallPlant(100, 10, 5, 0, switch_mm=1, period=100)
    fake = FakeEngine()
    engine = PlantedEngine(fake, plant)  # pyright: ignore[reportArgumentType]
    changes = engine.run(7000, ["tx"])
    assert len(changes.clock) == 7000 and (changes["tx"] == changes.clock % 2).all()
    closed = fake.shown.index(1)  # 50 steps to the switch, and one beyond
    assert 5000 <= closed <= 5200
    engine.set(limits=2)
    engine.run(1, ["tx"])
    assert fake.limits == 3


@pytest.fixture(scope="module")
def url(serve) -> Iterator[str]:
    with serve("vplotter", *WALL, "--board", "icepi-zero", "--tcp", 0, "--speed", "max",
               says=r"socket://\S+") as url:
        yield url


@pytest.fixture
def plotter(url) -> Iterator[VPlotter]:
    with VPlotter(url, timeout=PATIENCE) as plotter:
        if plotter.state == "Alarm":
            plotter.home(timeout=20 * PATIENCE)
        yield plotter


@pytest.mark.compiler
@pytest.mark.long
class TestServed:
    def test_homes_and_draws(self, plotter):
        assert plotter.machine_position == pytest.approx((50 - 100, 20 - 40, 0), abs=0.01)
        assert plotter.states == (0x05, 0x05, 0x05)
        plotter.draw_line((30, 30), (70, 50))
        assert plotter.position[:2] == pytest.approx((70, 80 - 50), abs=0.01)
        plotter.stream(["G21 G90", "G0 X50 Y40", "M3", "G2 X50 Y40 I5 F3000", "M5"])
        plotter.wait(PATIENCE)
        assert plotter.position[:2] == pytest.approx((50, 40), abs=0.01)

    def test_says_why_it_does_not_obey(self, plotter):
        plotter.go((30, 30))
        with pytest.raises(Refused, match="Off the wall: x is 0000 to 0100, y is 0020 to 0080"):
            plotter.go((30, 19))
        for x in (70.5, True, -1, 10_000):
            with pytest.raises(ValueError, match="x must be a whole number of mm"):
                plotter.draw_line((30, 30), (x, 50))
        for point in ((1, 2, 3), None, 5):
            with pytest.raises(ValueError, match="a point has two whole numbers of mm"):
                plotter.go(point)
        with pytest.raises(BlockRefused, match="error:3"):
            plotter.command("$100=100")
        assert plotter.position[:2] == pytest.approx((30, 50), abs=0.01)

    def test_example(self, url, plotter, example, tmp_path):
        plotter.close()  # what the machine says comes to all that are connected
        lines = tmp_path / "lines.txt"
        lines.write_text("30 30 40 30\n\n40 30 40 40\n")
        assert example("draw_vplotter.py", url, lines) == ["2 lines drawn"]
        with VPlotter(url, timeout=PATIENCE) as plotter:
            assert plotter.position[:2] == pytest.approx((40, 40), abs=0.01)

    def test_released_motors_forget_the_place(self, plotter):
        plotter.power(on=False)
        assert plotter.states == (0, 0, 0)
        plotter.power(on=True)
        assert plotter.states == (1, 1, 1)
        with pytest.raises(Refused, match="The place is unknown"):
            plotter.go((30, 30))
