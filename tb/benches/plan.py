"""The queue of blocks."""

from fresa.motion import BlockQueue

from ..bench import Run, bench

PLAN = ((0, 20), (25, 9), (30, 12), (18, 25))
"""Limit and gain of each block."""


@bench
def block_queue(run: Run) -> str:
    """Full, with its speeds; a block that is replaced; one that stops."""
    dut = BlockQueue(depth=4, words=4, word=3, width=5)

    async def write(ctx, address, value, last=0):
        ctx.set(dut.write.p, {"address": address, "data": value, "last": last})
        ctx.set(dut.write.valid, 1)
        await run.until(ctx, dut.write, ready=1, within=60)
        await ctx.tick()
        ctx.set(dut.write.valid, 0)

    async def commit(ctx, number, limit, gain):
        for address in range(4):
            await write(ctx, address, (number + address) % 8)
        for address, value in ((dut.gain, gain), (dut.limit, limit)):
            await write(ctx, address, value % 8)
            await write(ctx, address + 1, value >> 3, last=address == dut.limit)

    async def take(ctx, number):
        """Read a block, with a word that waits, and start it."""
        ctx.set(dut.take, 1)  # without effect until it is read
        for word in range(4):
            await run.until(ctx, dut.blocks, valid=1)
            ctx.set(dut.blocks.ready, 0)
            await ctx.tick()
            run.see(ctx, dut.blocks, valid=1)
            payload = ctx.get(dut.blocks.payload)
            run.expect("word", payload.data, (number + word) % 8)
            run.expect("last", payload.last, word == 3)
            ctx.set(dut.blocks.ready, 1)
            await ctx.tick()
        ctx.set(dut.blocks.ready, 0)
        run.see(ctx, dut.blocks, valid=0)
        await ctx.tick()
        ctx.set(dut.take, 0)

    async def exits(ctx, first, second, count):
        await ctx.tick().repeat(64)
        run.see(ctx, dut, exit=first, next_exit=second, count=count, free=4 - count,
                empty=count == 0)

    async def test(ctx):
        run.see(ctx, dut, empty=1, free=4)
        await write(ctx, 0, 7)  # of a line that turns out wrong
        entries = ((0, 0), (0, 9), (0, 21), (0, 25))
        for number, (block, then) in enumerate(zip(PLAN, entries, strict=True)):
            await commit(ctx, number, *block)
            await exits(ctx, *then, number + 1)
        run.see(ctx, dut.write, ready=0)
        for number, then in enumerate(((25, 30), (30, 18))):
            await take(ctx, number)
            await exits(ctx, *then, 3 - number)
        await commit(ctx, 4, 0, 0)  # a stop
        await exits(ctx, 30, 18, 3)
        await commit(ctx, 5, 31, 31)
        await exits(ctx, 30, 18, 4)
        await take(ctx, 2)
        await take(ctx, 3)
        await exits(ctx, 0, 31, 2)
        ctx.set(dut.flush, 1)
        await ctx.tick()
        ctx.set(dut.flush, 0)
        await exits(ctx, 0, 0, 0)
        run.see(ctx, dut.blocks, valid=0)
        await commit(ctx, 6, 3, 4)
        await exits(ctx, 3, 0, 1)
        await take(ctx, 6)
        await exits(ctx, 0, 0, 0)

    run.simulate(dut, test)
    return "seven blocks, their words and their speeds; five taken in order, two dropped"
