"""Steps to pins."""

from fresa.drive import (
    HALF_STEP,
    AxisDrivers,
    CoilDriver,
    FrequencyDivider,
    PhaseDriver,
    RateGenerator,
    StepDirDriver,
)

from ..bench import Run, bench
from ..plant import WORDS


@bench
def frequency_divider(run: Run) -> str:
    """A tick every 5 clocks; how it pauses, and how it begins anew."""
    dut = FrequencyDivider(period=5)

    async def test(ctx):
        ctx.set(dut.enable, 1)
        for clock in range(1, 16):
            run.see(ctx, dut, tick=clock % 5 == 0)
            await ctx.tick()

        await ctx.tick().repeat(3)
        ctx.set(dut.enable, 0)
        for _ in range(4):
            run.see(ctx, dut, tick=0)
            await ctx.tick()
        ctx.set(dut.enable, 1)
        for tick in (0, 1):
            run.see(ctx, dut, tick=tick)
            await ctx.tick()

        await ctx.tick().repeat(3)
        ctx.set(dut.clear, 1)
        await ctx.tick()
        ctx.set(dut.clear, 0)
        for tick in (0, 0, 0, 0, 1):
            run.see(ctx, dut, tick=tick)
            await ctx.tick()

    run.simulate(dut, test)
    return ("3 ticks, 5 clocks apart; not enabled, it kept its count; "
            "cleared at 4, it counted 5 again")


@bench
def coil_driver(run: Run) -> str:
    """Coil words down the table and back; steps asked for too soon."""
    dut = CoilDriver(period=4)

    async def test(ctx):
        run.see(ctx, dut, coils=WORDS[0])
        state = 0
        for direction, way in [(1, 1), (0, -1)]:
            ctx.set(dut.direction, direction)
            for _ in range(8):
                ctx.set(dut.step, 1)
                run.see(ctx, dut, moved=1, refused=0)
                await ctx.tick()
                state = (state + way) % 4
                run.see(ctx, dut, coils=WORDS[state])
                ctx.set(dut.step, 0)
                await ctx.tick().repeat(3)

        ctx.set(dut.step, 1)
        await ctx.tick()
        for _ in range(3):
            run.see(ctx, dut, coils=WORDS[-1], moved=0, refused=1)
            await ctx.tick()
        run.see(ctx, dut, moved=1)
        await ctx.tick()

        ctx.set(run.rst, 1)
        for _ in range(5):
            await ctx.tick()
            run.see(ctx, dut, coils=WORDS[-2])

    run.simulate(dut, test)
    return ("8 steps down the table and 8 back; 3 asked for sooner than 4 clocks were refused; "
            "a reset left the coils as they were")


@bench
def axis_drivers(run: Run) -> str:
    """Every combination of the three motors, each with a direction of its own."""
    dut = AxisDrivers(period=2)

    async def test(ctx):
        states = [0, 0, 0]
        for step in range(8):
            for direction in range(8):
                ctx.set(dut.step, step)
                ctx.set(dut.direction, direction)
                run.see(ctx, dut, moved=step, refused=0)
                await ctx.tick()
                ctx.set(dut.step, 0)
                for axis in range(3):
                    if step >> axis & 1:
                        states[axis] += 1 if direction >> axis & 1 else -1
                x, y, z = (WORDS[state % 4] for state in states)
                run.see(ctx, dut, axis_x=x, axis_y=y, axis_z=z)
                await ctx.tick()

    run.simulate(dut, test)
    return "64 requests: all axes and directions, each motor followed its own and no other"


@bench
def phase_driver(run: Run) -> str:
    """Half steps down the table and back; the power goes and comes again."""
    dut = PhaseDriver(sequence=HALF_STEP, period=3)

    async def test(ctx):
        run.see(ctx, dut, coils=0)
        ctx.set(dut.step, 1)
        ctx.set(dut.direction, 1)
        await ctx.tick().repeat(4)
        run.see(ctx, dut, coils=0, ready=0, moved=0)  # no power

        ctx.set(dut.enable, 1)
        await ctx.tick()
        row = 0
        for direction, way, steps in [(1, 1, 10), (0, -1, 5)]:
            ctx.set(dut.direction, direction)
            for _ in range(steps):
                for rested in (0, 0, 1):
                    run.see(ctx, dut, coils=HALF_STEP[row % 8], ready=rested, moved=rested)
                    await ctx.tick()
                row += way
        ctx.set(dut.step, 0)
        await ctx.tick().repeat(2)
        run.see(ctx, dut, coils=HALF_STEP[5], ready=1, moved=0)
        await ctx.tick()
        ctx.set(run.rst, 1)
        await ctx.tick()
        run.see(ctx, dut, coils=HALF_STEP[5], ready=0)
        ctx.set(run.rst, 0)

        ctx.set(dut.enable, 0)
        ctx.set(dut.step, 1)
        run.see(ctx, dut, ready=0, moved=0)
        for _ in range(4):
            await ctx.tick()
            run.see(ctx, dut, coils=0, ready=0)
        ctx.set(dut.enable, 1)
        await ctx.tick()
        for rested in (0, 0, 1):
            run.see(ctx, dut, coils=HALF_STEP[5], moved=rested)
            await ctx.tick()
        run.see(ctx, dut, coils=HALF_STEP[4])

    run.simulate(dut, test)
    return ("10 half steps down the table and 5 back, each word for 3 clocks; after a time without "
            "power the coils were as before, for 3 clocks")


@bench
def step_dir_driver(run: Run) -> str:
    """Pulses for a driver module: reversed in a pulse, taken back, without power."""
    dut = StepDirDriver(width=3, low=4, setup=2, hold=2)

    async def pulse(ctx, way):
        """Where a step is asked for it is made now, and its pulse lasts."""
        run.see(ctx, dut, moved=1, ready=1, step_pin=0, direction_pin=way)
        await ctx.tick()
        for level in (1, 1, 1, 0, 0, 0):
            run.see(ctx, dut, moved=0, ready=0, step_pin=level, direction_pin=way, enable_pin=1)
            await ctx.tick()
        run.see(ctx, dut, step_pin=0, ready=1)

    async def test(ctx):
        ctx.set(dut.step, 1)
        await ctx.tick().repeat(5)
        run.see(ctx, dut, step_pin=0, enable_pin=0, ready=0, moved=0)  # no power
        ctx.set(dut.enable, 1)
        for power in (0, 1):
            run.see(ctx, dut, step_pin=0, enable_pin=power, moved=0)
            await ctx.tick()
        for _ in range(3):
            await pulse(ctx, 0)

        run.see(ctx, dut, moved=1)
        await ctx.tick()
        ctx.set(dut.direction, 1)  # in the middle of a pulse
        for level in (1, 1, 1, 0, 0, 0, 0):
            run.see(ctx, dut, step_pin=level, direction_pin=0, moved=0)
            await ctx.tick()
        run.see(ctx, dut, step_pin=0, direction_pin=1, moved=0)
        await ctx.tick()
        await pulse(ctx, 1)

        ctx.set(dut.direction, 0)
        run.see(ctx, dut, ready=0, moved=0)
        await ctx.tick()
        ctx.set(dut.step, 0)  # it is taken back while DIR settles
        for ready in (0, 1, 1):
            run.see(ctx, dut, step_pin=0, direction_pin=0, ready=ready, moved=0)
            await ctx.tick()
        ctx.set(dut.direction, 1)
        for _ in range(3):
            run.see(ctx, dut, direction_pin=0, ready=0)  # nobody steps that way
            await ctx.tick()
        ctx.set(dut.direction, 0)

        ctx.set(dut.step, 1)
        run.see(ctx, dut, moved=1)
        await ctx.tick()
        ctx.set(dut.enable, 0)  # in the middle of a pulse
        ctx.set(run.rst, 1)
        for level in (1, 1, 1, 0, 0, 0, 0):
            run.see(ctx, dut, step_pin=level, enable_pin=1, moved=0)
            await ctx.tick()
        ctx.set(run.rst, 0)
        for _ in range(6):
            run.see(ctx, dut, step_pin=0, enable_pin=0, ready=0, moved=0)
            await ctx.tick()

    run.simulate(dut, test)
    return ("6 pulses of 3 clocks, 4 or more apart, with DIR and ENABLE settled; those reversed "
            "and cut off in the middle were whole; a step taken back made none")


@bench
def rate_generator(run: Run) -> str:
    """7 steps in 40 clocks; a new rate under way; a step that has to wait."""
    dut = RateGenerator(modulus=40, max_rate=10)

    async def steps(ctx, clocks, expected):
        """Make the steps that are due; those are the clocks, from 0."""
        for clock in range(clocks):
            run.see(ctx, dut, due=clock in expected)
            await ctx.tick()

    async def test(ctx):
        ctx.set(dut.moved, 1)
        ctx.set(dut.rate, 7)
        await steps(ctx, 40, (6, 12, 18, 23, 29, 35))
        await steps(ctx, 20, (0, 6, 12, 18))

        ctx.set(dut.rate, 1)
        await steps(ctx, 8, ())
        ctx.set(dut.rate, 10)
        await steps(ctx, 4, (2,))
        ctx.set(dut.rate, 15)  # no more than 10
        await steps(ctx, 12, (2, 6, 10))

        ctx.set(dut.moved, 0)
        await steps(ctx, 9, range(2, 9))
        ctx.set(dut.moved, 1)
        await steps(ctx, 9, (0, 4, 8))
        ctx.set(dut.rate, 0)
        await steps(ctx, 12, ())

    run.simulate(dut, test)
    return ("steps at 7 in 40 clocks, less than a clock late each; slower and faster under way; "
            "one waited 7 clocks, and the next came a whole time of 4 after it")
