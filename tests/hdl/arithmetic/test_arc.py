# amaranth: UnusedElaboratable=no

"""Formulas of arcs: the tables against the model, and through the walk; gateware against tables."""

import random
from math import cos, hypot, pi, sin

import pytest

from fresa.arithmetic import Line, arc_formulas
from fresa.arithmetic.arc import REGISTERS, TABLES
from fresa.arithmetic.line import CORNER
from fresa.motion import SpeedProfile
from tb.boards import component
from tb.engines import AmaranthEngine, CXXRTLEngine
from tb.models.arc import PLANES, ArcPath, verdict
from tb.models.formulas import AXES, SIZE, FormulaModel
from tb.models.gcode_language import centre_by_radius
from tb.models.line import ONE, junction, place
from tb.models.walk import Walked, segment_steps
from tests.hdl.arithmetic.registers import FormulaGateware

MM = 1_000_000


class Machine(FormulaModel):
    """The registers of lines and arcs."""

    def __init__(self, line: Line) -> None:
        super().__init__(REGISTERS, TABLES, line)

    def begin(self, position) -> None:
        self.set_each("position", position)
        self.run("begin")

    def check(self, end, *, plane: int, clockwise: bool, centre=None, radius: int = 0) -> int:
        """Load an arc and return the verdict."""
        self.set_each("to", end)
        self.set(plane=plane, clockwise=clockwise)
        if centre is None:
            self.set(radius=radius)
            self.run("arc_plane", "arc_centre", "arc_check")
        else:
            self.set(centre_u=centre[0], centre_v=centre[1])
            self.run("arc_plane", "arc_check")
        return self.get("verdict")

    def centre(self) -> list[int]:
        """Return the centre by the axes of the plane."""
        centre = [self.signed("middle_u"), self.signed("middle_v")]
        return centre[::-1] if self.get("swapped") else centre


def settings(rng: random.Random) -> Line:
    return Line(speeds=[rng.randint(10**6, 10**9) for _ in AXES],
                accelerations=[rng.randint(10**7, 10**10) for _ in AXES],
                steps=[rng.choice([40_000, 80_000, 80_000, 250_000, 400_000]) for _ in AXES])


def logarithmic(rng: random.Random, low: float, high: float) -> float:
    return low * (high / low) ** rng.random()


class Drawn:
    """An arc at random: full circles and helices among them.

    Its path is `longest` at most, in nm.
    """

    def __init__(self, rng: random.Random, longest: float = 4_000 * MM) -> None:
        self.plane, self.clockwise = rng.randrange(3), rng.random() < 0.5
        a, b, c = PLANES[self.plane]
        self.start = [rng.choice([0, rng.randint(-500 * MM, 500 * MM)]) for _ in AXES]
        radius = logarithmic(rng, 0.01 * MM, 500 * MM)
        angle = rng.choice([rng.uniform(0, 2 * pi), rng.randrange(8) * pi / 4])
        full = rng.random() < 0.2 and 2 * pi * radius < longest
        sweep = 2 * pi if full else min(longest / radius, rng.choice(
            [rng.uniform(0.001, 2 * pi), rng.randint(1, 7) * pi / 4]))
        self.centre = round(-radius * cos(angle)), round(-radius * sin(angle))
        radius = hypot(*self.centre)
        end = angle + (-sweep if self.clockwise else sweep)
        self.end = list(self.start)
        if not full:
            self.end[a] += self.centre[0] + round(radius * cos(end))
            self.end[b] += self.centre[1] + round(radius * sin(end))
        if rng.random() < 0.4:
            self.end[c] += round(rng.uniform(-1, 1) * logarithmic(rng, 1, 2 * radius * sweep))

    def path(self) -> ArcPath:
        return ArcPath(self.start, self.end, self.centre, plane=self.plane,
                       clockwise=self.clockwise)


def near(found: float, wanted: float, *, part: float = 1e-9, off: float = 0) -> bool:
    return abs(found - wanted) <= part * abs(wanted) + off


def compare(machine: Machine, path: ArcPath, feed: int, before: list[int]) -> None:
    """Compare all results of an arc with the model."""
    line = machine.line
    a, b, _ = path.axes
    fine = max(line.steps[a], line.steps[b])
    assert near(machine.get("sweep") / 2**33, path.sweep, off=2e-9)
    part = 1e-9 + 2e-9 / path.sweep  # of the length
    off = 60 + (ONE * part if path.across else 0)
    for name, unit in zip(("unit", "unit_end"), path.units(), strict=True):
        assert all(near(found, ONE * each, off=off)
                   for found, each in zip(machine.each(name), unit, strict=True))

    exponent = machine.get("shift") - 3
    assert exponent in {path.exponent(fine), path.exponent(fine - 1e-8 * fine)}
    assert near(machine.get("turns"), path.turns(exponent), off=0.54)
    swapped = line.steps[a] < line.steps[b]
    unit = 2.0**34 / 2**exponent * fine / 10**9
    assert all(near(machine.signed(name), each * unit, off=16) for name, each in zip(
        "xy", path.start[::-1] if swapped else path.start, strict=True))
    assert machine.get("mirrored") == (swapped != (path.way < 0))

    least = min(path.arc, abs(path.across) or path.arc)
    limit_part = part + path.length / least / 2**33
    fastest, acceleration = machine.get("fastest"), machine.get("acceleration")
    clocks = max(128, 4 * machine.get("turns"))
    wanted = min(path.speed(2**34, line.speeds, line.accelerations),
                 path.length * line.clock / clocks)
    # The less a component is, the fewer bits it has. The speed on the circle is rounded
    # down to nm/s.
    assert near(fastest, wanted, part=limit_part + 1 / path.top(line.accelerations), off=3)
    assert near(acceleration, min((1 << 34) - 1, path.acceleration(line.accelerations)),
                part=limit_part, off=3)
    hundredth = max(28, -(-256 * feed // 100))
    assert machine.get("hundredth") == hundredth
    assert machine.pair("nominal") == min(hundredth * 100 // 256, fastest)**2
    speed = machine.get("speed")
    assert speed == min(hundredth, fastest)
    ticks, gain = machine.get("ticks"), 2 * acceleration * path.length
    assert near(machine.pair("gain"), max(5000, gain), part=part, off=1 << ticks)
    assert machine.pair("energy") == machine.pair("gain") >> ticks >= 2
    assert machine.pair("gain") < 1 << SpeedProfile().brake_bits
    modulus = machine.pair("modulus")
    assert near(modulus, path.length * line.clock * 2**16 / 2**ticks, part=part, off=1)
    most = 2**-9 if acceleration >= 5000 else 2**-5  # nm of a tick that is as fine as may be
    finest = path.length < most * (1 << ticks + 1)
    assert ticks == 36 or finest or modulus < 4 * speed << 16
    assert 4 * speed << 16 <= 2 * modulus + 2
    assert machine.get("turns") <= 2 << ticks

    found = machine.pair("junction")
    entry = junction(machine.each("unit"), before, line.accelerations, line.deviation)
    assert near(found, float(entry), part=1e-6 + 1 / min(line.accelerations), off=1)
    assert machine.pair("limit") == min(found, machine.pair("nominal"),
                                        machine.pair("nominal_before"))


def compare_gateware(engine, rounds: int, seed: int) -> None:
    """Carry out arcs, by their centre and by their radius."""
    rng = random.Random(seed)
    gateware = FormulaGateware(engine, TABLES)
    for _ in range(rounds):
        machine = Machine(settings(rng))
        drawn = Drawn(rng)
        machine.set(feed=10 * MM, plane=drawn.plane, clockwise=drawn.clockwise,
                    centre_u=drawn.centre[0], centre_v=drawn.centre[1],
                    radius=rng.choice([1, -1]) * round(hypot(*drawn.centre)))
        machine.begin(drawn.start)
        machine.set_each("to", drawn.end)
        a, b, _ = PLANES[drawn.plane]
        chord = any(drawn.end[axis] != drawn.start[axis] for axis in (a, b))
        by_radius = chord and rng.random() < 0.5
        tables = ["arc_plane", *["arc_centre"][:by_radius], "arc_check"]
        begun = machine.words
        machine.run(*tables)
        if not machine.get("verdict"):
            tables += ["arc_path", "arc_plan", "accept"]
            machine.run("arc_path", "arc_plan", "accept")
        found = gateware.run(begun, *tables)
        assert found == machine.words


class TestGateware:
    def test_is_the_table(self):
        with AmaranthEngine(component("formulas", arc_formulas())) as engine:
            compare_gateware(engine, 1, 1)

    @pytest.mark.compiler
    def test_is_the_table_compiled(self):
        with CXXRTLEngine(component("formulas", arc_formulas())) as engine:
            compare_gateware(engine, 200, 2)


class TestVerdict:
    @pytest.mark.parametrize("seed", range(4))
    def test_is_that_of_the_model_for_centres(self, seed):
        """For radii that are right, wrong, and just so, down to the last nm."""
        rng = random.Random(seed)
        seen = set()
        for _ in range(150):
            machine = Machine(settings(rng))
            drawn = Drawn(rng)
            machine.begin(drawn.start)
            a, b, _ = PLANES[drawn.plane]
            end = list(drawn.end)
            if rng.random() < 0.7:
                radius = round(hypot(*drawn.centre))
                most = 5000 if radius < 5 * MM else min(500_000, radius // 1000)
                end[rng.choice([a, b])] += rng.choice([1, -1]) * (rng.choice(
                    [most, round(logarithmic(rng, 1, 10 * MM))]) + rng.randint(-2, 2))
            wanted = verdict((end[a] - drawn.start[a], end[b] - drawn.start[b]),
                             centre=drawn.centre)
            seen.add(wanted)
            assert machine.check(end, plane=drawn.plane, clockwise=drawn.clockwise,
                                 centre=drawn.centre) == wanted
        assert seen == {0, 33}

    @pytest.mark.parametrize("seed", range(4))
    def test_is_that_of_the_model_for_radii(self, seed):
        """The centre is off by 1 nm at most."""
        rng = random.Random(seed)
        seen = set()
        for _ in range(150):
            machine = Machine(settings(rng))
            drawn = Drawn(rng)
            a, b, _ = PLANES[drawn.plane]
            machine.begin(drawn.start)
            chord = drawn.end[a] - drawn.start[a], drawn.end[b] - drawn.start[b]
            radius = rng.choice([1, -1]) * rng.choice([
                round(hypot(*drawn.centre)), round(hypot(*chord)) // 2 + rng.randint(-1, 1),
                round(logarithmic(rng, 1, 1000 * MM)), 0])
            wanted = verdict(chord, centre=None, radius=radius, clockwise=drawn.clockwise)
            found = machine.check(drawn.end, plane=drawn.plane, clockwise=drawn.clockwise,
                                  radius=radius)
            seen.add(wanted)
            assert found == wanted, (chord, radius)
            if not wanted:
                centre = centre_by_radius(*chord, radius, clockwise=drawn.clockwise)
                assert all(abs(x - y) <= 1 for x, y in zip(machine.centre(), centre, strict=True))
        assert seen == {0, 34}

    @pytest.mark.parametrize(("centre", "end", "wanted"), [
        ((0, 0), (0, 0), 33), ((1, 0), (0, 0), 0), ((1, 0), (2, 0), 0), ((-1, -1), (-2, -2), 0),
        (((1 << 33) - 1, 0), (0, 0), 0), ((1 << 33, 0), (0, 0), 33),
        ((6_100_000_000, 6_100_000_000), (0, 0), 33), ((-(1 << 35), 0), (0, 0), 33),
        ((1, 0), (68_000_000_000, 0), 33), ((10 * MM, 0), (20 * MM + 5000, 0), 0),
        ((10 * MM, 0), (20 * MM + 10001, 0), 33), ((10 * MM, 0), (20 * MM + 10000, 0), 0)])
    def test_is_by_what_can_be_made(self, centre, end, wanted):
        machine = Machine(Line(steps=(80_000, 10_000, 200_000)))
        start = [-34_000_000_000, 0, 0]
        machine.begin(start)
        assert machine.check([start[0] + end[0], end[1], 0], plane=0, clockwise=False,
                             centre=centre) == wanted
        assert verdict(end, centre=centre, steps=80_000) == wanted

    @pytest.mark.parametrize(("radius", "wanted"), [
        (1, 0), ((1 << 33) - 2, 0), (1 << 33, 33), (-(1 << 33), 33), (1 << 34, 33)])
    def test_is_by_what_can_be_made_of_a_radius(self, radius, wanted):
        """A half of a circle, whose centre is in the middle of its chord."""
        machine = Machine(Line(steps=(80_000, 10_000, 200_000)))
        machine.begin([-17_000_000_000, 0, 0])
        chord = min(abs(radius), (1 << 33) - 2) * 2
        assert machine.check([chord - 17_000_000_000, 0, 0], plane=0, clockwise=False,
                             radius=radius) == wanted
        assert verdict((chord, 0), centre=None, radius=radius, steps=80_000) == wanted

    def test_is_by_the_unit_of_the_rotator(self):
        machine = Machine(Line(steps=(1_000_000, 1_000_000, 2_000_000)))
        for plane, radius in (0, 2_097_152_000), (1, 2_097_152_000 // 2):
            for more, wanted in (-2, 0), (-1, 0), (0, 33), (1, 33):
                assert machine.check([0, 0, 0], plane=plane, clockwise=True,
                                     centre=(0, radius + more)) == wanted
                assert verdict((0, 0), centre=(0, radius + more),
                               steps=1_000_000 << plane) == wanted
            machine.check([0, 0, 0], plane=plane, clockwise=True, centre=(0, radius - 2))
            machine.run("arc_path", "arc_plan")
            assert machine.get("shift") == 24


class TestTables:
    def test_take_their_clocks(self):
        assert {table.name: table.clocks(36) for table in TABLES if "arc" in table.name} == {
            "arc_plane": 423, "arc_centre": 893, "arc_check": 537, "arc_path": 3915,
            "arc_plan": 2281}

    @pytest.mark.parametrize("seed", range(4))
    def test_are_exact_for_random_programs(self, seed):
        rng = random.Random(seed)
        for _ in range(25):
            machine = Machine(settings(rng))
            for _ in range(4):
                drawn = Drawn(rng)
                feed = round(logarithmic(rng, 1000, 1e9))
                machine.set_each("to", drawn.start)
                machine.set(feed=feed)
                machine.run("begin" if machine.each("from") == drawn.start else "line", "accept")
                before = machine.each("unit_before")
                assert machine.check(drawn.end, plane=drawn.plane, clockwise=drawn.clockwise,
                                     centre=drawn.centre) == 0
                machine.run("arc_path", "arc_plan")
                assert machine.get("apart") == 0
                assert machine.each("to") == drawn.end
                compare(machine, drawn.path(), feed, before)
                unit_end = machine.each("unit_end")
                machine.run("accept")
                assert machine.each("unit_before") == unit_end
                assert machine.each("from") == drawn.end


def walk(machine: Machine, path: ArcPath) -> list[int]:
    """Walk an arc; return how many steps it ends off, by axis."""
    line = machine.line
    before = [machine.get(f"place_before_{axis}") for axis in AXES]
    after = [machine.get(f"place_{axis}") for axis in AXES]
    change = [(b - a + SIZE // 2) % SIZE - SIZE // 2 for a, b in zip(before, after, strict=True)]
    channels = [machine.get("channels") >> 2 * axis & 3 for axis in range(3)]
    assert sorted(channels) == [0, 1, 2]
    axes = [channels.index(channel) for channel in range(3)]
    segment = Walked(
        increment=[change[axis] for axis in axes],
        start=[before[axis] + 128 & 255 for axis in axes], log2_ticks=machine.get("ticks"), arc=1,
        clockwise=machine.get("mirrored"), turns=machine.get("turns"), shift=machine.get("shift"),
        x=machine.signed("x"), y=machine.signed("y"), residual=machine.get("residual"))
    fine, coarse = line.steps[axes[0]], line.steps[axes[1]]
    assert (machine.get("steps_u"), machine.get("steps_v")) == (fine << 9, coarse << 9)
    assert fine >= coarse
    assert segment.residual < 4 * fine
    made = segment_steps(segment, fine, coarse)
    off = [0, 0, 0]
    for channel, axis in enumerate(axes):
        at = (before[axis] + 128) % 256
        wanted = at + change[axis] >> 8
        off[axis] = sum(step for _, step in made[channel]) - wanted
    assert off[axes[2]] == 0
    return off


class TestRange:
    @pytest.mark.parametrize("seed", range(4))
    def test_is_exact_at_its_ends(self, seed):
        """With any settings, radii from 1 nm, and sweeps of any length."""
        rng = random.Random(seed)
        arcs = 0
        while arcs < 60:
            line = Line(
                clock=rng.choice([2_000_000, 50_000_000, (1 << 27) - 1]),
                speeds=[rng.choice([10**6, (1 << 31) - 1]) for _ in AXES],
                accelerations=[rng.choice([1000, 10**9, (1 << 34) - 1]) for _ in AXES],
                steps=[rng.choice([round(logarithmic(rng, 1, 1 << 27)), (1 << 27) - 1, 80_000, 1])
                       for _ in AXES], deviation=rng.choice([1, 10_000, (1 << 28) - 1]))
            machine = Machine(line)
            plane, clockwise = rng.randrange(3), rng.random() < 0.5
            a, b, c = PLANES[plane]
            radius = rng.choice([1, 2, logarithmic(rng, 1, (1 << 33) - 1), (1 << 33) - 1])
            angle = rng.uniform(0, 2 * pi)
            sweep = rng.choice([2 * pi, logarithmic(rng, 1e-6, 2 * pi)])
            centre = round(-radius * cos(angle)), round(-radius * sin(angle))
            end = [0, 0, 0]
            if sweep < 6.28:
                after = angle + (-sweep if clockwise else sweep)
                end[a] = centre[0] + round(radius * cos(after))
                end[b] = centre[1] + round(radius * sin(after))
            end[c] = rng.choice([0, 1, -1, round(logarithmic(rng, 1, CORNER)), -CORNER])
            machine.set(feed=rng.choice([1000, 10 * MM, (1 << 31) - 1]))
            machine.begin([0, 0, 0])
            if machine.check(end, plane=plane, clockwise=clockwise, centre=centre):
                continue
            machine.run("arc_path", "arc_plan")
            if machine.get("apart"):
                continue
            arcs += 1
            compare(machine, ArcPath([0, 0, 0], end, centre, plane=plane, clockwise=clockwise),
                    machine.get("feed"), [0, 0, 0])

    @pytest.mark.parametrize("clockwise", [False, True])
    @pytest.mark.parametrize(("off", "full"), [(0, True), (49, True), (51, False), (-49, False)])
    def test_takes_an_end_just_after_the_start_for_it(self, off, full, clockwise):
        """Up to 5e-7 rad."""
        machine = Machine(Line())
        machine.begin([0, 0, 0])
        machine.set(feed=MM)
        machine.check([0, -off if clockwise else off, 0], plane=0, clockwise=clockwise,
                      centre=(-100 * MM, 0))
        machine.run("arc_path", "arc_plan")
        wanted = off * 1e-8 + 2 * pi * (full or off < 0)
        assert near(machine.get("sweep") / 2**33, wanted, off=2e-9)

    @pytest.mark.parametrize("plane", range(3))
    @pytest.mark.parametrize(("off", "apart"), [(0, 0), (10_000, 0), (13_000, 1), (-40_000, 1)])
    def test_ends_on_the_circle_if_the_end_is_apart(self, off, apart, plane):
        """By 0.9 of 80 steps per mm, or more."""
        machine = Machine(Line(steps=(80_000, 80_000, 80_000)))
        start = [7 * MM, -3 * MM, 50 * MM]
        machine.begin(start)
        machine.set(feed=MM)
        a, b, c = PLANES[plane]
        circle, end = list(start), list(start)
        circle[a] += -50 * MM + 30 * MM  # 3, 4 and 5
        circle[b] += 40 * MM
        end[a] = circle[a] + off * 3 // 5
        end[b] = circle[b] + off * 4 // 5
        end[c] = circle[c] = start[c] + 12_345
        assert machine.check(end, plane=plane, clockwise=False, centre=(-50 * MM, 0)) == 0
        machine.run("arc_path", "arc_plan")
        assert machine.get("apart") == apart
        assert all(abs(x - y) <= 1 for x, y in zip(
            machine.each("to"), circle if apart else end, strict=True))
        assert all(machine.get(f"place_{axis}") == place(at, 80_000) + 17 * 512 * 80_000
                   for axis, at in zip(AXES, machine.each("to"), strict=True))


class TestWalk:
    @pytest.mark.parametrize("seed", range(4))
    def test_ends_at_the_end(self, seed):
        """But for one step an axis, which the walk corrects."""
        rng = random.Random(seed)
        for _ in range(60):
            machine = Machine(settings(rng))
            machine.set(feed=10 * MM)
            drawn = Drawn(rng, longest=3 * MM)
            machine.begin(drawn.start)
            assert machine.check(drawn.end, plane=drawn.plane, clockwise=drawn.clockwise,
                                 centre=drawn.centre) == 0
            machine.run("arc_path", "arc_plan")
            assert max(map(abs, walk(machine, drawn.path()))) <= 1

    @pytest.mark.parametrize("clockwise", [False, True])
    @pytest.mark.parametrize("radius", [1, 700, 12_500, 100_000, 5 * MM])
    @pytest.mark.parametrize("plane", range(3))
    def test_makes_full_circles(self, plane, radius, clockwise):
        """Of any radius, also of less than a step; steps per mm are unequal."""
        machine = Machine(Line(steps=(80_000, 100_000, 40_000)))
        machine.begin([123, 456, 789])
        machine.set(feed=10 * MM)
        centre = -radius, round(0.3 * radius)
        assert machine.check([123, 456, 789], plane=plane, clockwise=clockwise,
                             centre=centre) == 0
        machine.run("arc_path", "arc_plan")
        path = ArcPath([123, 456, 789], [123, 456, 789], centre, plane=plane, clockwise=clockwise)
        assert max(map(abs, walk(machine, path))) <= 1
