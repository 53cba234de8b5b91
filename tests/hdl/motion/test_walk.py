# amaranth: UnusedElaboratable=no

"""The walk: as its model in every clock, and its parts by themselves."""

from functools import partial
from math import asin, ceil, cos, floor, log2, pi, sin

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fresa.motion import PathWalk
from tb.bench import Run
from tb.benches.walk import Segments, compare_walk
from tb.models.walk import PathWalkModel, Walked, line_steps, segment_steps, steps_in, turn_ticks


class Planner(Segments):
    """Makes whole segments, each from where the one before ended."""

    def line(self, increments: list[int] | None = None, log2_ticks: int | None = None) -> Walked:
        """Make a line on the three axes."""
        if log2_ticks is None:
            log2_ticks = self.rng.choice([0, 1, 3, 6, 8, 10])
        most = (1 << 8 + log2_ticks) - 1
        if increments is None:
            increments = [self.rng.choice([0, most, -most, self.rng.randint(-most, most)])
                          for _ in range(3)]
        start = [place & 255 for place in self.place]
        self.place = [place + by for place, by in zip(self.place, increments, strict=True)]
        return Walked(increment=increments, start=start, log2_ticks=log2_ticks,
                      end=[(place >> 8) % 4 for place in self.place])

    def arc(self, radius: float, angle: float, *, begin: float | None = None, crowd: int = 0
            ) -> Walked:
        """Make an arc; its radius is in m, its angle in radians, positive if counter-clockwise.

        It has a half turn a tick at most, or two with `crowd`.
        """
        rng, fine, coarse = self.rng, self.fine, self.coarse
        begin = rng.uniform(0, 2 * pi) if begin is None else begin
        unit = max(1, ceil(log2(radius * fine)))
        axes = rng.sample(range(3), 3)
        u, v, w = axes
        turns = round(abs(angle) / asin(2.0 ** -(unit + 4)))
        log2_ticks = max(1, turns - 1).bit_length() - crowd
        start = [self.place[axis] & 255 for axis in axes]
        rise = rng.randrange(-256 << min(6, log2_ticks), 256 << min(6, log2_ticks))
        residual = start[1] * fine >> 6
        self.place[u] += floor(256 * radius * fine * (cos(begin + angle) - cos(begin)))
        self.place[v] += floor(256 * radius * coarse * (sin(begin + angle) - sin(begin)))
        self.place[w] += rise
        scale = fine / 2**unit * 2**34 * radius
        return Walked(
            increment=(0, 0, rise), start=start, log2_ticks=log2_ticks, arc=1,
            end=[(place >> 8) % 4 for place in self.place],
            channel=[axes.index(axis) for axis in range(3)], clockwise=int(angle < 0),
            turns=turns, shift=unit + 3,
            x=round(scale * cos(begin)), y=round(scale * sin(begin)), residual=residual)

    def any(self, crowd: int = 0) -> Walked:
        """Make a line, or an arc of some hundred half turns."""
        if self.rng.random() < 0.5:
            return self.line()
        radius = self.rng.choice([0.7, 2, 3, 9]) / self.fine
        return self.arc(radius, self.rng.choice([-1, 1]) * self.rng.uniform(0.01, 2 * pi),
                        crowd=crowd)


class Bench:
    """The gateware and its model, in every clock."""

    def __init__(self, *, fine: int = 80_000, coarse: int = 80_000) -> None:
        self.model, self.fine, self.coarse = PathWalkModel(), fine, coarse
        self.steps: list[tuple[int, int, int]] = []  # clock, axis, direction

    @property
    def places(self) -> list[int]:
        """Where the axes are, in steps."""
        return [sum(way for _, moved, way in self.steps if moved == axis) for axis in range(3)]

    def walk(self, segments: list[Walked], gap) -> None:
        """Make segments; `gap` gives the clocks between ticks."""
        run, dut = Run(), PathWalk()

        async def test(ctx):
            self.steps = await compare_walk(
                run, ctx, dut, self.model, [(each, segment_ticks(each)) for each in segments],
                fine=self.fine, coarse=self.coarse, gap=gap)

        run.simulate(dut, test, deadline=50_000)


class TestPathWalk:
    @pytest.mark.parametrize(("seed", "fine", "coarse", "gaps"), [
        (1, 80_000, 80_000, [2, 3, 4]), (2, 250_000, 40_000, [3, 4]),
        pytest.param(3, 3_200_000, 78_740, [9], marks=pytest.mark.long),
        (4, 80_000, 79_999, [2, 3, 4, 60]),
    ])
    def test_is_its_model_in_every_clock(self, seed, fine, coarse, gaps):
        planner, bench = Planner(seed, fine=fine, coarse=coarse), Bench(fine=fine, coarse=coarse)
        bench.walk([planner.any(crowd=min(gaps) > 4) for _ in range(5)],
                   lambda: planner.rng.choice(gaps))
        assert bench.places == [place >> 8 for place in planner.place]
        assert len(bench.steps) > 30

    def test_ticks_in_every_clock_make_lines(self):
        planner, bench = Planner(5, fine=1, coarse=1), Bench()
        bench.walk([planner.line(log2_ticks=8) for _ in range(6)], lambda: 1)
        assert bench.places == [place >> 8 for place in planner.place]

    @pytest.mark.parametrize("turns", [-1, 1])
    def test_two_half_turns_a_tick(self, turns):
        planner, bench = Planner(6, fine=80_000, coarse=20_000), Bench(fine=80_000, coarse=20_000)
        bench.walk([planner.arc(3 / 80_000, turns * 6, crowd=1) for _ in range(2)], lambda: 5)
        assert bench.places == [place >> 8 for place in planner.place]

    def test_steps_come_eleven_clocks_after_their_ticks(self):
        bench, ticks = Bench(), []
        bench.walk([Walked(increment=(512, -512, 768), end=(2, 2, 3), log2_ticks=2)],
                   lambda: ticks.append(bench.model.now - 1) or 7)
        assert [(clock - 11 - ticks[0], axis, way) for clock, axis, way in bench.steps] == [
            (0, 0, 1), (0, 2, 1), (7, 1, -1), (7, 2, 1), (14, 0, 1), (21, 1, -1), (21, 2, 1)]

    def test_an_end_that_is_a_step_off_is_corrected_once(self):
        """Ends are modulo 4: one more than was made is forward, one less is back."""
        bench = Bench()
        bench.walk([Walked(increment=(256, 256, 0), end=(2, 0, 0), log2_ticks=3),
                    Walked(increment=(256, 256, 0), end=(3, 1, 0), log2_ticks=3)], lambda: 4)
        assert bench.places == [3, 1, 0]
        assert len(bench.steps) == 6

    def test_faults(self):
        for segment, ticks in [
                (Walked(increment=(0, 256, 0), end=(0, 3, 0), log2_ticks=3), 8),  # 2 steps off
                (Walked(increment=(1 << 12, 0, 0), log2_ticks=3), 8),  # two steps a tick
                (Walked(arc=1, turns=40, shift=4, log2_ticks=3), 8),  # five half turns a tick
                (Walked(arc=1, turns=16, shift=4, log2_ticks=3), 8),  # one a clock
                (Walked(log2_ticks=1), 3)]:  # a tick too many
            run, dut = Run(), PathWalk()
            run.simulate(dut, partial(self.fault, run, dut, segment, ticks))

    async def fault(self, run, dut, segment, ticks, ctx):
        """Check that a segment with so many ticks, one a clock, is a fault until a reset."""
        ctx.set(dut.segments.payload, vars(segment))
        for port in (dut.segments.valid, dut.fine, dut.coarse):
            ctx.set(port, 1)
        await ctx.tick().repeat(80)
        ctx.set(dut.segments.valid, 0)
        assert ctx.get(dut.ready)
        for tick in range(ticks):
            ctx.set(dut.tick, 1)
            ctx.set(dut.last, tick == segment_ticks(segment) - 1)
            await ctx.tick()
        ctx.set(dut.tick, 0)
        ctx.set(dut.last, 0)
        await ctx.tick().repeat(40)
        assert ctx.get(dut.fault), segment
        ctx.set(run.rst, 1)
        await ctx.tick()
        assert not ctx.get(dut.fault)


def segment_ticks(segment: Walked) -> int:
    """Return the number of ticks."""
    return 1 << segment.log2_ticks


class TestModels:
    """What is computed at once, against sums tick by tick."""

    @given(st.integers(0, 255), st.integers(0, 7), st.integers(-2**15, 2**15))
    @settings(deadline=None, database=None, derandomize=True, max_examples=200)
    def test_line_steps(self, start, log2_ticks, increment):
        most = (256 << log2_ticks) - 1
        increment = max(-most, min(most, increment))
        ticks, place = [], start << log2_ticks
        for tick in range(1, (1 << log2_ticks) + 1):
            before, place = place, place + increment
            if place >> 8 + log2_ticks != before >> 8 + log2_ticks:
                ticks.append(tick)
        assert list(line_steps(start, increment, log2_ticks)) == ticks

    def test_line_steps_of_the_longest_line(self):
        for increment in (2**24 - 1, -2**24, 1000):
            steps = line_steps(128, increment, 36)
            assert len(steps) == abs(128 + increment >> 8)
            assert all(step <= 2**36 for step in steps[-3:])
            if increment == 1000:
                assert list(steps) == [-(-(number * 256 - 128 << 36) // 1000)
                                       for number in range(1, 5)]

    def test_turn_ticks(self):
        assert list(turn_ticks(5, 3)) == [1, 2, 4, 5, 7]
        assert list(turn_ticks(8, 2)) == [1, 1, 2, 2, 3, 3, 4, 4]
        assert list(turn_ticks(0, 2)) == []

    def test_steps_of_segments_are_those_of_the_pipeline(self):
        planner, bench = Planner(9, fine=80_000, coarse=30_000), Bench(fine=80_000, coarse=30_000)
        segments = [planner.any() for _ in range(6)]
        bench.walk(segments, lambda: 3)
        places = [0, 0, 0]
        for segment in segments:
            made = segment_steps(segment, 80_000, 30_000)
            for axis, channel in enumerate(segment.channel):
                places[axis] += sum(way for _, way in made[channel])
                error = (segment.end[axis] - places[axis] + 1) % 4 - 1
                assert abs(error) <= segment.arc and (channel != 2 or not error)
                places[axis] += error
        assert bench.places == places

    @pytest.mark.parametrize("ticks", [1, 7, 40, 64])
    def test_steps_in_the_first_ticks(self, ticks):
        planner = Planner(3, fine=80_000, coarse=30_000)
        for segment in [planner.line(log2_ticks=6) for _ in range(9)] + [
                planner.arc(2 / 80_000, angle) for angle in (1, -2, 3, -4)]:
            made = segment_steps(segment, 80_000, 30_000)
            assert steps_in(segment, min(ticks, segment_ticks(segment)), 80_000, 30_000) == [
                sum(way for tick, way in made[channel] if tick <= ticks)
                for channel in segment.channel]
