"""Benches of drivers: steps to pins."""

import random

from fresa.drive import (
    AxisDrivers,
    CoilDriver,
    FrequencyDivider,
    PowerPWM,
    ServoPulse,
    SpindlePower,
)

from ..bench import Run, bench
from ..models.spindle import power
from ..plant import WORDS

SPINDLES = 100


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


def some_spindle(rng: random.Random) -> dict[str, int]:
    """Return inputs of the power of a spindle, at its ends as often as between."""
    most = rng.choice([1_000_000, 24_000_000, rng.randrange(1 << 27)])
    least = rng.choice([0, 0, most // 3, rng.randrange(1 << 27)])
    feed = rng.choice([0, 1, 16_666_667, rng.randrange(1 << 32), (1 << 32) - 1])
    return {"on": int(rng.random() < 0.95), "scaled": rng.getrandbits(1),
            "speed": rng.choice([0, 1, 1000 * least, 1000 * most, rng.randrange(
                1, 2000 * max(1, most)), rng.randrange(1 << 36)]) & (1 << 36) - 1,
            "override": rng.choice([100, 100, 10, 50, 200, rng.randint(10, 200)]),
            "least": least, "most": most, "feed": feed,
            "path_speed": rng.choice([0, feed, feed // 2, rng.randrange(1 << 31)])}


@bench
def spindle_power(run: Run) -> str:
    """A spindle at a quarter, a laser at half the speed of its path, 100 others."""
    dut, rng = SpindlePower(), random.Random(1)

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
        for _ in range(SPINDLES):
            inputs = some_spindle(rng)
            for name, value in inputs.items():
                ctx.set(getattr(dut, name), value)
            await ctx.tick().repeat(130)
            run.see(ctx, dut, power=power(**inputs), fault=0)

    run.simulate(dut, test, deadline=50_000)
    return (f"powers of 1/4 and 1/8 were computed, and that of a spindle that is off is 0; "
            f"{SPINDLES} others are right")


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
    """A pulse of 700 us, then one of 900, and seven of random length."""
    period = 5000
    dut, rng = ServoPulse(clock=1_000_000, period=period), random.Random(1)
    others = [(rng.choice([rng.randrange(1 << 16), 1 << 16]), rng.randrange(1, 4001),
               rng.randrange(1, 4001)) for _ in range(7)]

    async def test(ctx):
        await ctx.tick()
        for share, low, high in [(0, 700, 1100), (1 << 15, 700, 1100), *others]:
            for name, value in (("power", share), ("low", low), ("high", high)):
                ctx.set(getattr(dut, name), value)
            await ctx.tick().repeat(period)
            length = low * (65_536 - share) + high * share >> 16
            for clock in range(period):
                run.see(ctx, dut, pin=clock < length, beat=clock % 1024 == 0)
                await ctx.tick()

    run.simulate(dut, test, deadline=100_000)
    return "a pulse was 700 us long without power, and 900 us at half of it; seven others are right"
