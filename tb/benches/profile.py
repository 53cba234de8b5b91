"""Benches of the speed along a path."""

from math import isqrt

from fresa.motion import SpeedProfile, SquareRoot

from ..bench import Run, bench


@bench
def square_root(run: Run) -> str:
    """Roots, of squares and beside them, and a start that replaces another."""
    dut = SquareRoot(integer_bits=6, fraction_bits=2)

    async def start(ctx, radicand):
        ctx.set(dut.radicand, radicand)
        ctx.set(dut.start, 1)
        await ctx.tick()
        ctx.set(dut.start, 0)

    async def test(ctx):
        for radicand in (0, 1, 2, 3, 4, 15, 16, 17, 24, 1023, 1024, 4094, 4095):
            await start(ctx, radicand)
            run.see(ctx, dut, busy=1)
            await ctx.tick().repeat(8)
            run.see(ctx, dut, busy=0, root=isqrt(radicand << 4))
        await start(ctx, 4095)
        await ctx.tick().repeat(3)
        await start(ctx, 9)
        await ctx.tick().repeat(8)
        run.see(ctx, dut, busy=0, root=12)

    run.simulate(dut, test)
    return "thirteen roots to a quarter, in nine clocks each"


@bench
def speed_profile(run: Run) -> str:
    """Two blocks without a stop between, and a hold in the second."""
    dut = SpeedProfile(speed_bits=6, fraction_bits=4, most_ticks_log2=8, brake_bits=20)
    ticks, fast = [64, 128], 20

    async def offer(ctx, log2_ticks):
        ctx.set(dut.blocks.p, {"energy": 4, "modulus": 3 * fast << 4, "log2_ticks": log2_ticks})
        ctx.set(dut.blocks.valid, 1)
        await run.until(ctx, dut.blocks, ready=1, within=9000)
        await ctx.tick()
        ctx.set(dut.blocks.valid, 0)

    async def through(ctx, count, *, first):
        """See so many ticks of a block."""
        for number in range(count):
            await run.until(ctx, dut, tick=1, within=9000)
            run.see(ctx, dut, first=int(first and number == 0))
            run.expect("speed", ctx.get(dut.speed) <= fast, 1)
            await ctx.tick()
            run.see(ctx, dut, tick=0)

    async def blocks(ctx):
        ctx.set(dut.nominal, fast**2)
        ctx.set(dut.exit, 128)
        await offer(ctx, 6)
        await offer(ctx, 7)
        ctx.set(dut.exit, 0)

    async def test(ctx):
        run.see(ctx, dut, standing=1, tick=0, fault=0)
        await through(ctx, ticks[0] - 1, first=True)
        await run.until(ctx, dut, tick=1, within=9000)
        run.see(ctx, dut, last=1, starved=0)
        await ctx.tick()
        await through(ctx, 4, first=True)
        ctx.set(dut.hold, 1)
        made = 4
        while not ctx.get(dut.standing):
            made += ctx.get(dut.tick)
            await ctx.tick()
        run.expect("ticks before it stands", 4 < made < ticks[1], 1)
        for _ in range(300):
            run.see(ctx, dut, tick=0, standing=1)
            await ctx.tick()
        ctx.set(dut.hold, 0)
        await through(ctx, ticks[1] - made - 1, first=False)
        await run.until(ctx, dut, tick=1, within=9000)
        run.see(ctx, dut, last=1)
        await ctx.tick()
        for _ in range(300):
            run.see(ctx, dut, tick=0, standing=1, speed=0, starved=0, fault=0)
            await ctx.tick()

    run.simulate(dut, test, blocks)
    return "192 ticks in two blocks, and a stop among them that loses none"
