"""Benches of the speed along a path."""

import random
from bisect import bisect_right
from collections.abc import Sequence
from math import isqrt

from fresa.motion import SpeedProfile, SquareRoot

from ..bench import Run, bench
from ..models.profile import Block, ProfileModel

SPEED, FRACTION, TICKS = 6, 4, 8
SMALL = {"speed_bits": SPEED, "fraction_bits": FRACTION, "most_ticks_log2": TICKS,
         "brake_bits": 2 * SPEED + TICKS}
"""A profile in which much happens in few clocks."""
SEEDS, CLOCKS = 8, 800


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
        for halve in (0, 1):
            ctx.set(dut.halve, halve)
            ctx.set(dut.eighth, 1)
            await start(ctx, 4095)
            ctx.set(dut.eighth, 0)
            await ctx.tick().repeat(5)
            run.see(ctx, dut, busy=0, root=isqrt(4095 >> halve << 4) >> 3)

    run.simulate(dut, test)
    return "thirteen roots to a quarter, in nine clocks each, and two eighths of roots"


def any_blocks(rng: random.Random) -> list[tuple[Block, int]]:
    """Make blocks that no planner would have made, beside some that it would."""
    blocks, clock, top = [], 0, 2**SPEED - 1
    for _ in range(rng.randint(1, 5)):
        log2_ticks, speed = rng.choice([0, 1, 2, 3, 5, 6, 7]), rng.randint(1, top)
        energy = rng.choice([2, rng.randint(2, (top**2 >> log2_ticks) + 3), rng.randint(2, top**2),
                             speed**2 >> rng.randint(3, 7)])
        modulus = rng.choice([rng.uniform(2, 4) * speed, rng.uniform(2, 4) * top,
                              rng.uniform(0, 8) * top])
        clock += rng.choice([0, 0, 0, rng.randint(0, 3000)])
        blocks.append((Block(max(2, energy), int(modulus * 2**FRACTION) + 1, speed**2, log2_ticks),
                       clock))
    return blocks


async def compare_profile(run: Run, ctx, dut: SpeedProfile, clocks: int,
                   blocks: Sequence[tuple[Block, int]], exits: Sequence[int], *,
                   holds: Sequence[int] = (), percents: Sequence[int] = (100,)) -> None:
    """Compare a profile, which has been reset, with its model in so many clocks.

    Parameters
    ----------
    run, ctx, dut, clocks
        The run, its simulator, the profile, and how many.
    blocks : sequence of (Block, int)
        Each with the clock from which it is offered.
    exits : sequence of int
        Highest square at the end of a block, by the clock; the last stays.
    holds : sequence of int
        Clocks in which hold changes, from 0.
    percents : sequence of int
        Of the nominal square of blocks, for 64 clocks each, over and over.
    """
    def nominal(number: int, clock: int) -> int:
        return blocks[number][0].nominal * percents[clock // 64 % len(percents)] // 100

    def exit_at(clock: int) -> int:
        return exits[min(clock, len(exits) - 1)]

    model = ProfileModel(blocks, lambda _, clock: exit_at(clock), holds, speed_bits=SPEED,
                         fraction_bits=FRACTION, nominals=nominal)
    ticks, begins, ends = {}, {}, set()
    for granule in model.granules():
        made = granule.clocks(model.backlog)
        ticks |= {clock: (0, 0) for clock in made}
        ticks[made[0]] = int(granule.first), 0
        if granule.last:
            ticks[made[-1]] = ticks[made[-1]][0], 1
        begins[granule.began] = granule
        ends.add(granule.ended)
        if granule.began > clocks:
            break
    running, rests, taken = None, True, 0
    for clock in range(clocks):
        offered = taken < len(blocks) and blocks[taken][1] <= clock
        ctx.set(dut.blocks.valid, offered)
        ctx.set(dut.hold, bisect_right(holds, clock) % 2)
        ctx.set(dut.exit, exit_at(clock))
        ctx.set(dut.nominal, nominal(taken - 1, clock) if taken else 0)
        if offered:
            block = blocks[taken][0]
            ctx.set(dut.blocks.payload, {"energy": block.energy, "modulus": block.modulus,
                                         "log2_ticks": block.log2_ticks})
            run.see(ctx, dut.blocks, ready=clock in model.taken)
            taken += clock in model.taken
        first, last = ticks.get(clock, (0, 0))
        run.see(ctx, dut, tick=clock in ticks, first=first, last=last,
                speed=running.rate >> FRACTION + 1 if running else 0,
                standing=running is None and rests, starved=clock in model.starved, fault=0)
        if clock in model.starved:
            rests = True
        if clock in ends:
            assert running
            running, rests = None, running.square == 0
        running = begins.get(clock, running)
        await ctx.tick()


@bench
def speed_profile(run: Run) -> str:
    """Two blocks without a stop between, a hold in the second; random blocks."""
    dut = SpeedProfile(**SMALL)
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
        for seed in range(SEEDS):
            rng = random.Random(seed)
            exits = [rng.randrange(4**SPEED) * (rng.random() < 0.3) for _ in range(CLOCKS // 50)]
            ctx.set(run.rst, 1)
            await ctx.tick()
            ctx.set(run.rst, 0)
            await compare_profile(
                run, ctx, dut, CLOCKS, any_blocks(rng), [each for each in exits for _ in range(50)],
                holds=sorted(rng.sample(range(CLOCKS), rng.choice([0, 2, 4]))),
                percents=rng.choice([[100], [100, 4, 60, 1, 30]]))

    run.simulate(dut, test, blocks, deadline=20_000)
    return (f"192 ticks in two blocks, and a stop among them that loses none; as its model in "
            f"{SEEDS * CLOCKS} clocks")
