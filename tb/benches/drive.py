"""Benches of drivers: steps to pins."""

from fresa.drive import (
    AxisDrivers,
    CoilDriver,
    FrequencyDivider,
    PowerPWM,
    ServoPulse,
    SpindlePower,
)

from ..bench import Run, bench
from ..plant import WORDS


@bench
def frequency_divider(run: Run) -> str:
    """A tick every 5 clocks; pause and restart."""
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
    """Coil words down the table and back; steps requested too soon."""
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
    return ("8 steps down the table and 8 back; 3 requested sooner than 4 clocks were refused; "
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
def spindle_power(run: Run) -> str:
    """A spindle at a quarter, then a laser at half the speed of its path, and off."""
    dut = SpindlePower()

    async def test(ctx):
        ctx.set(dut.on, 1)
        ctx.set(dut.most, 1_000_000)
        ctx.set(dut.speed, 250_000_000)
        ctx.set(dut.override, 100)
        await ctx.tick().repeat(130)
        run.see(ctx, dut, power=1 << 14)
        ctx.set(dut.scaled, 1)
        ctx.set(dut.feed, 2000)
        ctx.set(dut.path_speed, 1000)
        await ctx.tick().repeat(130)
        run.see(ctx, dut, power=1 << 13)
        ctx.set(dut.on, 0)
        await ctx.tick()
        run.see(ctx, dut, power=0, fault=0)
        await ctx.tick()

    run.simulate(dut, test)
    return "powers of 1/4 and 1/8 were computed, and that of a spindle that is off is 0"


@bench
def power_pwm(run: Run) -> str:
    """Half of full power, from the second period on, and none."""
    dut = PowerPWM(clock=2048, frequency=2)

    async def test(ctx):
        ctx.set(dut.power, 1 << 15)
        on = 0
        for clock in range(3 * 1024):
            on += ctx.get(dut.pin) if clock > 1024 else 0
            await ctx.tick()
        run.expect("clocks on", on in (1023, 1024), True)
        ctx.set(dut.power, 0)
        await ctx.tick()
        run.see(ctx, dut, pin=0)
        await ctx.tick()

    run.simulate(dut, test)
    return "half of two periods was on, and nothing of it without power"


@bench
def servo_pulse(run: Run) -> str:
    """A pulse of 700 us, then one of 900."""
    dut = ServoPulse(clock=1_000_000)

    async def test(ctx):
        ctx.set(dut.low, 700)
        ctx.set(dut.high, 1100)
        for power, length in ((0, 700), (1 << 15, 900)):
            ctx.set(dut.power, power)
            on = 0
            for clock in range(40_000):
                on += ctx.get(dut.pin) if clock >= 20_001 else 0
                await ctx.tick()
            run.expect("us", on, length)

    run.simulate(dut, test, deadline=90_000)
    return "a pulse in 20 ms was 700 us long without power, and 900 us at half of it"
