# amaranth: UnusedElaboratable=no

"""`benchmarks.wall_lines`: its walls are those of the gateware, and it finds what is off."""

import json
import random
from fractions import Fraction
from math import hypot, sqrt

import numpy as np
import pytest
from amaranth.sim import Simulator
from PIL import Image

from benchmarks import wall_lines, wall_path
from benchmarks.ideal import ideal
from benchmarks.pages import with_figures
from benchmarks.wall_lines import FIGURES, PAGE, broken, figures, main, report
from benchmarks.wall_path import Requests, Wall, followed, nearest_lengths
from benchmarks.wall_pictures import LEFT, MOST, TOP, draw_lines, draw_map
from benchmarks.wall_sums import CELL, Motors, Sums, bowed, follow, measure, random_line, wall
from fresa.drive import StringMotor
from fresa.machines.vplotter import PLACE_BITS, VPlotterSettings
from fresa.motion import Hanging, StringLength
from tb.models.gcode_blocks import Motion, ProgramModel
from tb.models.gcode_plan import Planner
from tb.models.profile import Block
from tb.models.walk import segment_steps
from tools.canvas import COLOURS

WALL = wall()
SHORT = [random_line(f"short {number}", WALL) for number in range(6)]
SHORT = [(begin, (begin[0] + (end[0] - begin[0]) // 4000, begin[1] + (end[1] - begin[1]) // 4000))
         for begin, end in SHORT]
"""Lines of some 0.3 mm."""


class TestPath:
    def test_a_line_is_planned_as_the_machine_plans_it(self):
        """From the upper right corner, where the machine is at 0."""
        block, = ProgramModel(WALL.plan).line("G53G0X-1203.417Y-766.032")[1]
        assert isinstance(block, Motion)
        begin, end = (1768 * 10**6, 50 * 10**6), (564_583_000, 816_032_000)
        segment = WALL.planned(begin, end).segment
        for name in ("increment", "start", "log2_ticks"):
            found, wanted = getattr(segment, name), getattr(block.segment, name)
            assert found == wanted if name == "log2_ticks" else [*found][:2] == [*wanted][:2]

    @pytest.mark.parametrize("number", range(3))
    def test_ticks_are_those_of_the_walk(self, number):
        line = WALL.planned(*SHORT[number])
        x, y, _ = segment_steps(line.segment)
        wanted = {0: line.first}
        for tick in sorted({tick for tick, _ in x + y}):
            wanted[tick] = (line.first[0] + sum(way for at, way in x if at <= tick),
                            line.first[1] - sum(way for at, way in y if at <= tick))
        found = {}
        for ticks, across, below in line.places():
            found |= dict(zip(ticks.tolist(), zip(across.tolist(), below.tolist(), strict=True),
                              strict=True))
        assert found == wanted and len(found) > 20

    def test_times_are_those_of_the_trapezoid(self):
        for begin, end, feed in [(*SHORT[0], None), ((0, 10**9), (10**9, 9 * 10**8), None),
                                 ((0, 10**9), (10**9, 9 * 10**8), 777)]:
            line = WALL.planned(begin, end, feed)
            points = [(at[0] - 1768 * 10**6, 50 * 10**6 - at[1], 0) for at in (begin, end)]
            planned = Planner(WALL.plan, points[0]).line(
                points[1], None if feed is None else feed * 10**6 // 60)
            assert planned
            ticks = np.linspace(0, 1 << planned.log2_ticks, 50)
            wanted = ideal(Block(planned.energy, planned.modulus, planned.nominal,
                                 planned.log2_ticks),
                           np.longdouble(line.length * 1e6 * WALL.plan.clock) / (
                               1 << planned.log2_ticks), 0, 0, ticks)
            along = np.linspace(0, line.length, 50)
            times = line.times(along)
            assert times * WALL.plan.clock == pytest.approx(wanted.astype(float), rel=1e-5)
            assert line.along(times) == pytest.approx(along, abs=1e-6)

    def test_a_point_is_no_line(self):
        with pytest.raises(ValueError, match="a line has to have a length"):
            WALL.planned((0, 10**9), (0, 10**9))


class TestLengths:
    def test_they_are_the_nearest_of_two_that_are_as_near_the_shorter(self):
        rng = random.Random(1)
        places = [(0, 0), (12, 16), (36, 48), (2**18, 2**18 - 1)] + [
            (rng.randrange(1 << 19), rng.randrange(1 << 19)) for _ in range(200)]
        found = nearest_lengths(*np.array(places, float).T)[0]
        assert found.tolist() == [StringLength(first_across=across, first_below=below).first_length
                                  for across, below in places]
        assert found[1:3].tolist() == [2, 7]  # of 2.5 and 7.5

    @pytest.mark.parametrize("number", range(6))
    def test_they_are_those_of_the_gateware(self, number):
        """After each tick, when the gateware is not busy."""
        line = WALL.planned(*SHORT[number])
        made = WALL.lengths(line)
        settings = WALL.settings
        dut = Hanging(width=settings.wall_ticks, bits=PLACE_BITS,
                      first_across=line.first[0], first_below=line.first[1])
        x, y, _ = segment_steps(line.segment)
        ways = {tick: (0, 0) for tick, _ in x + y}
        ways |= {tick: (way, 0) for tick, way in x}
        ways |= {tick: (ways[tick][0], way) for tick, way in y}
        found = {0: tuple(string.first_length for string in dut.strings)}

        async def bench(ctx):
            for tick, way in sorted(ways.items()):
                ctx.set(dut.step, sum((each != 0) << axis for axis, each in enumerate(way)))
                ctx.set(dut.direction, sum((each > 0) << axis for axis, each in enumerate(way)))
                await ctx.tick()
                ctx.set(dut.step, 0)
                while ctx.get(dut.busy):
                    await ctx.tick()
                found[tick] = ctx.get(dut.lengths[0]), ctx.get(dut.lengths[1])

        sim = Simulator(dut)
        sim.add_clock(1e-6)
        sim.add_testbench(bench)
        sim.run()
        changes = dict(zip(made.ticks.tolist(), zip(made.left, made.right, strict=True),
                           strict=True))
        now = changes[0]
        for tick, lengths in found.items():
            now = changes.get(tick, now)
            assert lengths == now, tick
        assert len(changes) > 3 and made.error <= 0.5

    def test_the_pen_is_where_strings_of_that_length_meet(self):
        rng = random.Random(2)
        wanted = np.array([[rng.uniform(0, WALL.width), rng.uniform(1, WALL.height)]
                           for _ in range(300)])
        lengths = [each * WALL.steps_per_mm for each in WALL.string_lengths(wanted)]
        assert np.stack(WALL.pen(*lengths), axis=1) == pytest.approx(wanted, abs=1e-6)

    def test_half_a_step_is_worth_most_between_the_pulleys_and_near_their_line(self):
        y = np.array([50.0, 200.0, 500.0])
        found = WALL.farthest(np.array([884.0]), y)
        half = 0.5 / WALL.steps_per_mm * np.hypot(884, y) / y
        assert (half < found).all() and found == pytest.approx(half, rel=0.15)


class TestMotors:
    def test_a_step_that_is_not_wanted_any_more_is_not_made(self):
        made, late = followed(Requests(np.array([1.0, 1.2, 1.3, 1.4]),
                                       np.array([1.0, 1.0, -1.0, 1.0])), 0.5)
        assert made.times.tolist() == [1.0, 1.5] and made.ways.tolist() == [1, 1]
        assert late == pytest.approx(0.1)

    def test_they_are_those_of_the_gateware(self):
        rng, period, length = random.Random(3), 10, 100
        times, ways = [], []
        for _ in range(150):
            times.append((times[-1] if times else 30) + rng.choice([1, 2, 5, 9, 10, 11, 40]))
            ways.append(rng.choice([-1, 1, 1]))
        dut = StringMotor(bits=8, period=period, first=length)
        found = []

        async def bench(ctx):
            ctx.set(dut.length, length)
            ctx.set(dut.follow, 1)
            ctx.set(dut.enable, 1)
            lengths = dict(zip(times, (length + np.cumsum(ways)).tolist(), strict=True))
            for clock in range(times[-1] + 100):  # the last steps are made by then
                ctx.set(dut.length, lengths.get(clock, ctx.get(dut.length)))
                if ctx.get(dut.moved):
                    found.append((clock, 1 if ctx.get(dut.length) > ctx.get(dut.made) else -1))
                await ctx.tick()

        sim = Simulator(dut)
        sim.add_clock(1e-6)
        sim.add_testbench(bench)
        sim.run()
        made, _ = followed(Requests(np.array(times, float), np.array(ways, float)), period)
        assert list(zip(made.times.tolist(), made.ways.tolist(), strict=True)) == found
        assert 50 < len(found) < 150


def found_of(lines) -> dict:
    """Return the figures of lines."""
    return figures(measure(lines, WALL), {None: follow(lines, WALL, None)}, WALL, len(lines), 1)


class TestFigures:
    LINES = [((800 * 10**6, 210 * 10**6), (830 * 10**6, 211 * 10**6)),
             ((100 * 10**6, 700 * 10**6), (100 * 10**6, 730 * 10**6))]

    def test_a_good_machine(self):
        found = found_of(self.LINES)
        assert found["good"] and broken(found) == []
        assert 0.04 < found["bands"][2]["straight"] < 0.1 < found["bands"][1]["geometry"]
        assert found["bands"][2]["motors"][0] < 0.1

    @pytest.mark.parametrize(("name", "mistake"), [
        ("nearest_lengths", lambda across, below: (
            np.floor(np.hypot(across, below) / 8), np.hypot(across, below) / 8)),
        ("TICKS_LOG2", 2)])
    def test_another_rounding_is_found(self, monkeypatch, name, mistake):
        place = wall()
        monkeypatch.setattr(wall_path, name, mistake)
        found = measure(self.LINES[:1], place)
        bad = broken(figures(found, {None: Motors()}, WALL, 1, 1))
        assert bad and "200 mm" in bad[0]
        assert name != "nearest_lengths" or "steps off" in bad[-1]

    @pytest.mark.parametrize(("change", "text"), [
        ({"error": 0.51}, "0.51 steps off"), ({"speed": 1.1}, "1.1 times as fast"),
        ({"acceleration_share": 1.1}, "1.1 times v²/d + a")])
    def test_each_bound(self, change, text):
        bad, = broken(found_of(self.LINES) | change)
        assert text in bad

    def test_of_several_the_worst_is_kept(self):
        total, parts = Sums.of(WALL), [measure([line], WALL) for line in self.LINES]
        for part in parts:
            total.add(part)
        assert total.straight.tolist() == np.maximum(*(each.straight for each in parts)).tolist()
        assert total.steps == sum(each.steps for each in parts)
        assert total.apart == min(each.apart for each in parts) > WALL.settings.period
        assert (total.chart > 0).sum() == sum((each.chart > 0).sum() for each in parts)

    def test_a_bowed_line_sags(self):
        """In the middle both strings are as long as half of both at an end."""
        line = WALL.planned((100 * 10**6, 200 * 10**6), (1668 * 10**6, 200 * 10**6))
        ends = [np.round(each * WALL.steps_per_mm) for each in WALL.string_lengths(
            line.points(np.array([0, line.length])))]
        half = (hypot(100, 200) + hypot(1668, 200)) / 2
        assert line.off(*bowed(WALL, *ends)).max() == pytest.approx(
            sqrt(half**2 - 884**2) - 200, abs=0.1)

    def test_the_acceleration_of_a_string_that_is_passed_is_that_of_a_circle(self):
        """At 600 mm, at full speed; gently, so that the ends of the line are no worse."""
        gentle = Wall(VPlotterSettings(acceleration=(Fraction(4),) * 3))
        found = measure([((20 * 10**6, 828528 * 1000), (828528 * 1000, 20 * 10**6))], gentle)
        assert found.acceleration[0] == pytest.approx(2 * 50**2 / 600, rel=0.01)
        assert found.speed < 1 and found.share < 1

    def test_the_acceleration_along_a_string_is_that_of_the_path(self):
        found = measure([((0, 50 * 10**6), (0, 80 * 10**6))], WALL)
        assert found.acceleration[0] == pytest.approx(100) and found.speed == pytest.approx(1)


def test_the_command(tmp_path, monkeypatch, capsys):
    args = ["--lines", "2", "--motors", "1", "--jobs", "1", "--json", str(tmp_path / "found.json")]
    assert main([*args, "--picture", str(tmp_path / "map.png")]) == 0
    found = json.loads((tmp_path / "found.json").read_text())
    assert found["good"] and found["lines"] == 2
    with Image.open(tmp_path / "map.png") as picture:
        assert picture.format == "PNG" and picture.width == 1200
    monkeypatch.setattr(wall_lines, "BOUND", {200: 0.001})
    assert main(args) == 1
    assert "not 0.001 at most" in " ".join(capsys.readouterr().err.split())


def test_the_page_has_the_figures():
    found, page = json.loads(FIGURES.read_text(encoding="utf-8")), PAGE.read_text(encoding="utf-8")
    assert found["good"] and found["lines"] == 10_000
    assert report(found) in page, "run python -m benchmarks.wall_lines --write"
    assert with_figures(page, "wall_lines", report(found)) == page
    made = Wall(VPlotterSettings(least_y=50))
    assert made.steps_per_mm == found["steps_per_mm"][0]
    assert "bowed, by up to a quarter of the wall" in page
    assert max(band["bowed"] for band in found["bands"]) == pytest.approx(made.width / 4, rel=0.02)
    assert "up to 0.005 mm more than was said" in page and 1 / made.per_mm < 0.005


class TestPictures:
    def test_a_cell_has_the_colour_of_what_is_off_there(self):
        chart = np.zeros_like(Sums.of(WALL).chart)
        chart[30, 10] = MOST
        drawn = np.asarray(draw_map(chart, WALL, found_of(TestFigures.LINES)))
        per_mm = (1200 - 64 - 110) / WALL.width
        left, top = (round(edge + number * CELL * per_mm) + 4
                     for edge, number in ((LEFT, 10), (TOP, 30)))
        assert (drawn[top:top + 4, left:left + 4] == COLOURS[-1]).all()
        assert (drawn[top:top + 4, left + 16:left + 20] == 255).any()

    def test_straight_and_bowed_lines(self, monkeypatch):
        monkeypatch.setattr("benchmarks.wall_pictures.lines", lambda place: [
            ((100 * 10**6, 1000 * 10**6), (1668 * 10**6, 1000 * 10**6))])
        drawn = np.asarray(draw_lines(WALL)).astype(int)
        per_mm = (1200 - 64 - 110) / WALL.width
        for colour, y in (((31, 119, 180), 1000), ((225, 80, 40), 1181)):
            rows, _ = np.nonzero(np.abs(drawn[120:, 560:580] - colour).sum(axis=2) < 40)
            assert (rows.mean() + 120 - TOP) / per_mm == pytest.approx(y, abs=4)
