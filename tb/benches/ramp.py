"""Bench of acceleration and deceleration."""

from fresa.motion import Ramp

from ..bench import Run, bench

RATES = (5, 12, 15, 18, 20)
MODULUS = 100


@bench
def ramp(run: Run) -> str:
    """Up to the top and down; turned back, slowed down, without power."""
    dut = Ramp(rates=RATES, max_rate=31, width=8)
    accumulator = -MODULUS

    async def clock(ctx) -> bool:
        """Make a clock, and the step that is due in it; return whether one was made."""
        nonlocal accumulator
        due = accumulator >= 0
        moved = due and ctx.get(dut.step)
        ctx.set(dut.moved, moved)
        if not due or moved:
            accumulator += ctx.get(dut.rate) - MODULUS * moved
        await ctx.tick()
        ctx.set(dut.moved, 0)
        return moved

    async def go(ctx, target, levels, *, rate=31, way=1):
        """Make steps; check the direction before each, and the level after it."""
        ctx.set(dut.target, target)
        ctx.set(dut.requested_rate, rate)
        for level in levels:
            position = ctx.get(dut.position)
            for _ in range(MODULUS):
                run.see(ctx, dut, step=1, direction=way)
                if await clock(ctx):
                    break
            run.expect("position", ctx.get(dut.position), position + (1 if way else -1))
            run.see(ctx, dut, level=level)
            fastest = RATES[max(level, 1) - 1]
            slowest = RATES[max(level - 1, 1) - 1] if level else 0
            run.see(ctx, dut, rate=sorted((slowest, rate, fastest))[1])

    async def rests(ctx, place):
        for _ in range(MODULUS // RATES[0] + 2):
            run.see(ctx, dut, step=0, level=0, position=place & 0xFF)
            await clock(ctx)

    async def test(ctx):
        run.see(ctx, dut, rate=0, step=0)
        ctx.set(dut.requested_rate, 31)
        await clock(ctx)
        ctx.set(dut.run, 1)
        await rests(ctx, 0)
        await go(ctx, 12, (1, 2, 3, 4, 5, 5, 5, 4, 3, 2, 1, 0))
        await rests(ctx, 12)

        await go(ctx, 40, (1, 2, 3, 4))
        await go(ctx, 15, (3, 2, 1, 0))  # past it
        await go(ctx, 15, (1, 2, 2, 1, 0), way=0)
        await rests(ctx, 15)

        await go(ctx, 50, (1, 2, 3, 4, 5))
        await go(ctx, 50, (4, 3, 3, 3), rate=13)
        await go(ctx, 50, (2, 1, 0, 0), rate=2)
        await go(ctx, 50, (1, 2, 3))
        ctx.set(dut.run, 0)
        run.see(ctx, dut, step=0, level=3)
        await clock(ctx)
        await rests(ctx, 31)
        ctx.set(dut.run, 1)
        await go(ctx, 34, (1, 1, 0))
        await rests(ctx, 34)

        await go(ctx, 50, (1, 2))
        ctx.set(run.rst, 1)
        ctx.set(dut.target, 0)
        await clock(ctx)
        ctx.set(run.rst, 0)
        await rests(ctx, 0)

    run.simulate(dut, test)
    return ("12 steps, up to level 5 and down; turned back, it passed its target by 5 and came "
            "back; it slowed down by a level a step, and stood without power")
