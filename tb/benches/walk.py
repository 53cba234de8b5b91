"""Benches of the walk, and of its parts."""

import random
from collections.abc import Callable, Sequence
from dataclasses import replace
from math import cos, isqrt, pi, sin

from fresa.drive import PendingSteps
from fresa.motion import CoreXY, PathWalk, Rotator, StepAccumulator, StepRatio, StringLength
from fresa.motion.string_length import TICKS_LOG2

from ..bench import Run, bench
from ..models.walk import PathWalkModel, Walked, steps_in


class Segments:
    """Makes segments, each from where the one before ended."""

    def __init__(self, seed: int, *, fine: int, coarse: int) -> None:
        self.rng, self.fine, self.coarse = random.Random(seed), fine, coarse
        self.place = [128, 128, 128]  # of each axis: position + 1/2 step, in 1/256 step

    def part(self, ticks: int) -> Walked:
        """Make so many ticks of a segment with any numbers that it may have, however long."""
        rng, fine = self.rng, self.fine
        log2_ticks, arc = rng.randint(ticks.bit_length(), 36), int(rng.random() < 0.6)
        most = min((1 << 8 + log2_ticks) - 1, (1 << 33) - 1)
        start = [rng.randrange(256) for _ in range(3)]
        angle, size = rng.uniform(0, 2 * pi), rng.choice([1 << 34, rng.getrandbits(34)])
        segment = Walked(
            increment=[rng.choice([most, -most, rng.randint(-most, most)]) for _ in range(3)],
            start=start, channel=rng.sample(range(3), 3) if arc else [0, 1, 2],
            log2_ticks=log2_ticks, arc=arc, clockwise=rng.randrange(2),
            turns=rng.choice([1 << log2_ticks, rng.randint(1, 1 << log2_ticks)]) * arc,
            shift=rng.randint(4, 28), x=int(size * cos(angle)), y=int(size * sin(angle)),
            residual=start[1] * fine >> 6)
        made = steps_in(segment, ticks, fine, self.coarse)
        self.place = [(place >> 8) + by << 8 for place, by in zip(self.place, made, strict=True)]
        return replace(segment, end=[(place >> 8) % 4 for place in self.place])


async def compare_walk(run: Run, ctx, dut: PathWalk, model: PathWalkModel,
                       segments: Sequence[tuple[Walked, int]], *, fine: int, coarse: int,
                       gap: Callable[[], int]) -> list[tuple[int, int, int]]:
    """Compare a walk with its model in every clock, until nothing is under way.

    Parameters
    ----------
    run, ctx, dut, model
        The run, its simulator, the walk, and its model in the same state.
    segments : sequence of (Walked, int)
        Segments, each with the number of its ticks.
    fine, coarse : int
        Inputs by these names.
    gap : callable
        Gives the clocks from a tick to the next, at least 1.

    Returns
    -------
    list of (int, int, int)
        Of each step its clock, its axis, and 1 if it is forward, else -1.
    """
    queue, left = [segment for segment, _ in segments], [ticks for _, ticks in segments]
    steps, wait, busy = [], 0, True
    for name, value in (("fine", fine), ("coarse", coarse)):
        ctx.set(getattr(dut, name), value)
    ctx.set(dut.segments.payload, vars(queue[0]))
    while left or busy:
        now, tick = model.now, int(bool(model.running and left and wait <= 0))
        last = int(tick and left[0] == 1)
        for name, level in (("tick", tick), ("last", last)):
            ctx.set(getattr(dut, name), level)
        ctx.set(dut.segments.valid, bool(queue))
        seen = model.clock(valid=int(bool(queue)), segment=queue[0] if queue else Walked(),
                           fine=fine, coarse=coarse, tick=tick, last=last)
        run.see(ctx, dut, segments_ready=seen["taken"],
                **{name: seen[name] for name in ("ready", "step", "busy", "fault")})
        if seen["step"]:
            run.expect("directions", ctx.get(dut.direction) & seen["step"], seen["direction"])
            steps += [(now, axis, 1 if seen["direction"] >> axis & 1 else -1)
                      for axis in range(3) if seen["step"] >> axis & 1]
        await ctx.tick()
        wait, busy = wait - 1, bool(seen["busy"])
        if tick:
            wait = gap() - 1
            left[0] -= 1
            if last:
                del left[0]
        if seen["taken"]:
            del queue[0]
            if queue:
                ctx.set(dut.segments.payload, vars(queue[0]))
    return steps


@bench
def pending_steps(run: Run) -> str:
    """Requests that a driver makes late, that cancel, and that are too many."""
    dut = PendingSteps(width=3)

    async def request(ctx, *ways):
        for way in ways:
            ctx.set(dut.step, 1)
            ctx.set(dut.direction, way > 0)
            await ctx.tick()
            ctx.set(dut.step, 0)

    async def make(ctx, steps, way):
        for left in range(steps, 0, -1):
            run.see(ctx, dut, driver_step=1, driver_direction=int(way > 0), pending=left * way,
                    fault=0)
            ctx.set(dut.moved, 1)
            await ctx.tick()
            ctx.set(dut.moved, 0)
        run.see(ctx, dut, driver_step=0, pending=0)

    async def test(ctx):
        run.see(ctx, dut, driver_step=0, pending=0, fault=0)
        await request(ctx, 1, 1, 1)
        await make(ctx, 3, 1)
        await request(ctx, -1, -1, 1, -1, -1, -1)
        await make(ctx, 4, -1)
        await request(ctx, 1, -1)
        run.see(ctx, dut, driver_step=0, pending=0, fault=0)
        await request(ctx, 1, 1)
        ctx.set(dut.moved, 1)
        await request(ctx, 1)
        ctx.set(dut.moved, 0)
        await make(ctx, 2, 1)
        await request(ctx, -1, -1, -1, -1)
        run.see(ctx, dut, pending=-4, fault=0)
        await request(ctx, -1)
        run.see(ctx, dut, pending=-4, fault=1)
        ctx.set(dut.moved, 1)
        await ctx.tick()
        ctx.set(dut.moved, 0)
        run.see(ctx, dut, pending=-3, fault=1)
        ctx.set(run.rst, 1)
        await ctx.tick()
        ctx.set(run.rst, 0)
        run.see(ctx, dut, driver_step=0, pending=0, fault=0)

    run.simulate(dut, test)
    return "every step made or taken back; the fifth one of four was a fault, until the reset"


@bench
def step_accumulator(run: Run) -> str:
    """Sums of parts of a step, forward and back."""
    dut = StepAccumulator(width=10)

    async def test(ctx):
        fraction = 0
        for start, term, count in [(128, 300, 20), (7, -999, 12), (255, 1, 6), (0, -1, 2),
                                   (64, 255, 9), (200, -255, 9), (1, 1023, 5)]:
            ctx.set(dut.load, 1)
            ctx.set(dut.start, start)
            await ctx.tick()
            ctx.set(dut.load, 0)
            run.see(ctx, dut, step=0, quarter=0)
            fraction = start << 2
            ctx.set(dut.term, term)
            ctx.set(dut.add, 1)
            for _ in range(count):
                await ctx.tick()
                total = fraction + term
                run.see(ctx, dut, step=int(not 0 <= total < 1024), direction=int(term >= 0))
                if abs(term) < 256:
                    run.see(ctx, dut, quarter=int(total >> 8 != fraction >> 8))
                fraction = total % 1024
            ctx.set(dut.add, 0)
            await ctx.tick()
            run.see(ctx, dut, step=0, quarter=0)

    run.simulate(dut, test)
    return "a step wherever the sum passes a whole one, forward and back"


@bench
def step_ratio(run: Run) -> str:
    """Steps of an axis with 78 steps/m out of quarter steps of one with 100."""
    dut = StepRatio(width=7)
    fine, coarse = 100, 78

    async def test(ctx):
        ctx.set(dut.fine, fine)
        ctx.set(dut.coarse, coarse)
        ctx.set(dut.load, 1)
        ctx.set(dut.residual, 250)
        await ctx.tick()
        ctx.set(dut.load, 0)
        sum_, place = 250, 0
        for way in [1] * 37 + [-1] * 44 + [1, -1] * 6 + [-1, 1, 1, -1] * 4:
            ctx.set(dut.quarter, 1)
            ctx.set(dut.forward, way > 0)
            await ctx.tick()
            ctx.set(dut.quarter, 0)
            run.see(ctx, dut, step=0)
            await ctx.tick()
            sum_ += way * coarse
            step, place = sum_ // (4 * fine) - place, sum_ // (4 * fine)
            run.see(ctx, dut, step=abs(step))
            if step:
                run.see(ctx, dut, direction=int(step > 0))

    run.simulate(dut, test)
    return "always the floor, whatever the direction"


@bench
def rotator(run: Run) -> str:
    """Half turns of two vectors, one of them mirrored; each sum is checked."""
    dut = Rotator(width=16, precision=12)

    def part(value: int, shift: int) -> int:
        return (value >> shift) + (value >> shift - 1 & 1)

    async def test(ctx):
        for x, y, shift, mirror in [(1000, -70, 4, 0), (-333, 901, 5, 1), (3, -1023, 9, 0)]:
            for name, value in [("x", x), ("y", y), ("shift", shift), ("mirror", mirror),
                                ("load", 1)]:
                ctx.set(getattr(dut, name), value)
            await ctx.tick()
            ctx.set(dut.load, 0)
            at = {"v": x << 4, "u": ~(y << 4) if mirror else y << 4}
            ctx.set(dut.turn, 1)
            for turn in range(60):
                moved, other = "vu" if turn % 2 == 0 else "uv"
                run.see(ctx, dut, ready=1, vector=at[moved], moves_v=int(moved == "v"),
                        moves_u=int(moved == "u"))
                way = 1 if moved == "v" else -1
                at[other] += way * part(at[moved], shift + (turn == 0))
                await ctx.tick()
                run.see(ctx, dut, ready=0, moves_u=0, moves_v=0)
                await ctx.tick()
            ctx.set(dut.turn, 0)
            await ctx.tick().repeat(3)
            run.see(ctx, dut, ready=1, moves_u=0, moves_v=0, vector=at["v"])

    run.simulate(dut, test)
    return "180 half turns, each by the rounded part of the other component"


@bench
def path_walk(run: Run) -> str:
    """A line, a quarter of a circle, parts of others as in the model."""
    dut, model = PathWalk(), PathWalkModel()

    async def test(ctx):
        run.see(ctx, dut, ready=0, busy=0, step=0, fault=0)
        offer = {"start": [128, 128, 128], "channel": [0, 1, 2], "residual": 0}
        ctx.set(dut.fine, 80_000)
        ctx.set(dut.coarse, 80_000)
        line = {**offer, "increment": [3 * 256, -5 * 256, 16 * 255], "end": [3, 3, 0],
                "log2_ticks": 4}
        # From (2, 0) to (0, 2) steps from the centre: shift is 4, 16 pi half turns
        arc = {**offer, "increment": [0, 0, 0], "end": [1, 1, 0], "log2_ticks": 6, "arc": 1,
               "turns": 50, "shift": 4, "x": 2**34, "y": 0, "residual": 160_000}
        places = [0, 0, 0]

        async def clock(tick=0, last=0):
            ctx.set(dut.tick, tick)
            ctx.set(dut.last, last)
            for axis in range(3):
                if ctx.get(dut.step) >> axis & 1:
                    places[axis] += 1 if ctx.get(dut.direction) >> axis & 1 else -1
            taken = ctx.get(dut.segments.ready)
            await ctx.tick()
            return taken

        async def walk(segment, ticks, then, end):
            ctx.set(dut.segments.valid, 1)
            ctx.set(dut.segments.payload, segment)
            while not ctx.get(dut.ready):
                await clock()
            while not await clock():
                pass
            ctx.set(dut.segments.valid, 0)
            for tick in range(ticks):
                await clock(1, int(tick == ticks - 1))
                await clock()
                await clock()
            while ctx.get(dut.busy):
                await clock()
            run.expect(then, places, end)
            run.see(ctx, dut, ready=0, step=0, fault=0)

        await walk(line, 16, "end of the line", [3, -5, 16])
        await walk(arc, 64, "end of the arc", [1, -3, 16])
        ctx.set(run.rst, 1)
        await ctx.tick()
        ctx.set(run.rst, 0)
        # Of few steps per m low bits count, and in many ticks those of sums.
        for seed, (fine, coarse, longest) in enumerate((
                (80_000, 80_000, 90), (3_200_000, 78_740, 90), ((1 << 27) - 1, 99_999_999, 90),
                (4321, 1, 90), (29, 23, 500))):
            planner = Segments(seed, fine=fine, coarse=coarse)
            planner.place = [(count << 8) + 128 for count in model.counts]
            parts = [(planner.part(ticks), ticks) for _ in range(8)
                     for ticks in [planner.rng.randint(1, longest)]]
            await compare_walk(run, ctx, dut, model, parts, fine=fine, coarse=coarse,
                               gap=lambda rng=planner.rng: rng.choice([2, 2, 3, 5]))
        await clock(1)
        run.see(ctx, dut, step=0, fault=1)

    run.simulate(dut, test)
    return ("a line to (3, -5, 16), an arc to (1, -3, 16); parts of 40 others as their model; a "
            "tick that belonged to nothing: a fault")


@bench
def core_xy(run: Run) -> str:
    """Steps of X, of Y, and of both at once; positions of motors and axes."""
    dut, rng = CoreXY(), random.Random(1)
    motors = [0, 0]

    async def count(ctx):
        while True:
            *_, steps, directions = await ctx.tick().sample(dut.motor_step, dut.motor_direction)
            for motor in range(2):
                if steps >> motor & 1:
                    motors[motor] += 1 if directions >> motor & 1 else -1

    async def test(ctx):
        for step, direction, ends in ((1, 1, [1, 1]), (2, 0, [0, 2]), (3, 2, [0, 0]),
                                      (3, 3, [2, 0])):
            ctx.set(dut.step, step)
            ctx.set(dut.direction, direction)
            await ctx.tick()
            ctx.set(dut.step, 0)
            for _ in range(3):
                await ctx.tick()
            run.expect("motors", motors, ends)
            for axis, motor in enumerate(motors):
                ctx.set(dut.motors[axis], motor)
        await ctx.tick()
        run.expect("X and Y", [ctx.get(dut.positions[axis]) for axis in range(2)], [1, 1])
        for _ in range(40):
            at, by = ([rng.getrandbits(bits) - (1 << bits - 1) for bits in (35, 35, 36)]
                      for _ in range(2))
            for axis, (motor, shift) in enumerate(zip((at[0] + at[1], at[0] - at[1], at[2]), by,
                                                      strict=True)):
                ctx.set(dut.motors[axis], motor)
                ctx.set(dut.shift[axis], shift)
            run.expect("positions", [ctx.get(dut.positions[axis]) for axis in range(3)], at)
            run.expect("shifts", [ctx.get(dut.motor_shift[axis]) for axis in range(3)],
                       [by[0] + by[1], by[0] - by[1], by[2]])
            await ctx.tick()

    run.simulate(dut, test, count)
    return "both motors make each step, and two at once are made one after the other"


@bench
def string_length(run: Run) -> str:
    """Ways of a point that hangs from a string, and whether its length fits."""
    dut = StringLength(bits=10)
    ticks = 1 << TICKS_LOG2
    made, worst = 0, 0

    async def move(ctx, place, target):
        nonlocal made, worst
        while place != target:
            ways = [(to > at) - (to < at) for at, to in zip(place, target, strict=True)]
            ctx.set(dut.tick, sum((way != 0) << bit for bit, way in enumerate(ways)))
            ctx.set(dut.away, sum((way > 0) << bit for bit, way in enumerate(ways)))
            await ctx.tick()
            ctx.set(dut.tick, 0)
            clocks = 0
            while ctx.get(dut.busy):
                if ctx.get(dut.step):
                    made += 1 if ctx.get(dut.longer) else -1
                await ctx.tick()
                clocks += 1
            place = [at + way for at, way in zip(place, ways, strict=True)]
            squares = place[0] ** 2 + place[1] ** 2
            # The nearest whole number of steps; of two that are as near, the shorter.
            length = (isqrt(4 * squares - 1) + ticks) // (2 * ticks) if squares else 0
            worst = max(worst, clocks)
            run.see(ctx, dut, across=place[0], below=place[1], length=length, busy=0)
            run.expect("steps", made, length)
        return place

    async def test(ctx):
        place = [0, 0]
        for target in ([90, 40], [90, 300], [20, 310], [350, 40], [0, 5], [8, 8]):
            place = await move(ctx, place, target)
        ctx.set(dut.begin, 1)
        await ctx.tick()
        ctx.set(dut.begin, 0)
        run.see(ctx, dut, across=0, below=0, length=0, busy=0)

    run.simulate(dut, test)
    run.expect("clocks of a tick", worst, 4)
    return f"always the nearest length, {worst} clocks after a tick at most"
