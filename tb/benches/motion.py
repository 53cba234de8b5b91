"""Benches of motion: orders to steps."""

from fresa.motion import MotionSequencer, OrderControl, StepCounter

from ..bench import Run, bench, put

X, Y, Z = 0b001, 0b010, 0b100


@bench
def step_counter(run: Run) -> str:
    """Counts up and down, and round through FFFF."""
    dut = StepCounter()

    async def test(ctx):
        ctx.set(dut.step, 1)
        for direction, counts in [
            (1, (1, 2, 3, 4)), (0, (3, 2, 1, 0, 0xFFFF, 0xFFFE)), (1, (0xFFFF, 0, 1)),
        ]:
            ctx.set(dut.direction, direction)
            for count in counts:
                await ctx.tick()
                run.see(ctx, dut, count=count)
        ctx.set(dut.step, 0)
        await ctx.tick().repeat(3)
        run.see(ctx, dut, count=1)
        ctx.set(dut.clear, 1)
        await ctx.tick()
        run.see(ctx, dut, count=0)

    run.simulate(dut, test)
    return "4 up, 6 down through 0000 to FFFE, 3 up to 0001; it held, and was cleared"


@bench
def order_control(run: Run) -> str:
    """A simple movement: as many steps as ordered, a period apart."""
    dut = OrderControl(period=4)
    steps = []

    async def counter(ctx):
        count = 0
        while True:
            _, _, clear, step = await ctx.tick().sample(dut.clear, dut.step)
            if step:
                steps.append((run.clock, step))
            count = 0 if clear else count + (step != 0)
            ctx.set(dut.count, count)

    async def test(ctx):
        ctx.set(dut.moves.valid, 1)
        await ctx.tick().repeat(5)
        run.see(ctx, dut.moves, ready=1)  # no axis: it stays at rest
        for axes, direction, count in [(X, X, 3), (X | Y, Y, 5), (Z, 0, 1)]:
            steps.clear()
            await put(ctx, dut.moves, {"axes": axes, "direction": direction, "steps": count})
            run.see(ctx, dut, direction=direction)
            await run.until(ctx, dut.moves, ready=1)
            await ctx.tick().repeat(6)
            run.expect("axes that stepped", [step for _, step in steps], [axes] * count)
            clocks = [clock for clock, _ in steps]
            run.expect("clocks of the steps", clocks, [clocks[0] + 4 * n for n in range(count)])

    run.simulate(dut, test, counter)
    return "X by 3 steps, X and Y by 5, Z by 1, 4 clocks apart; an order of no axis made none"


@bench
def motion_sequencer(run: Run) -> str:
    """A diagonal and a straight rest; the tool; three orders that are refused."""
    dut = MotionSequencer(z_travel=6)
    moves = []

    async def machine(ctx):
        at = [0, 0, 0]
        while True:
            ctx.set(dut.moves.ready, 1)
            _, _, valid, move = await ctx.tick().sample(dut.moves.valid, dut.moves.payload)
            if not valid:
                continue
            ctx.set(dut.moves.ready, 0)
            way = [(move.axes >> axis & 1) * (1 if move.direction >> axis & 1 else -1)
                   for axis in range(3)]
            moves.append((*way, move.steps))
            for _ in range(move.steps):
                await ctx.tick()
                at = [place + step for place, step in zip(at, way, strict=True)]
                ctx.set(dut.at_x, at[0])
                ctx.set(dut.at_y, at[1])
                ctx.set(dut.at_z, at[2])

    async def order(ctx, *expected, error=0, **fields):
        moves.clear()
        ctx.set(dut.order, fields)
        ctx.set(dut.start, 1)
        run.see(ctx, dut, ready=1)
        await ctx.tick()
        run.see(ctx, dut, ready=0)
        ctx.set(dut.start, 0)
        await run.until(ctx, dut, ready=1)
        run.expect("movements", moves, list(expected))
        run.see(ctx, dut, error=error)

    async def test(ctx):
        await order(ctx, (1, 1, 0, 3), x=3, y=3)
        await order(ctx, (1, -1, 0, 2), (1, 0, 0, 4), x=9, y=1)
        await order(ctx, (0, 1, 0, 7), x=9, y=8)
        await order(ctx, x=9, y=8)  # it is there
        await order(ctx, up=1)  # it is up
        await order(ctx, (0, 0, -1, 6), down=1)
        await order(ctx, x=5, y=7, error=1)
        await order(ctx, (-1, -1, 0, 4), x=5, y=4)
        await order(ctx, up=1, down=1, error=1)
        await order(ctx, (0, 0, 1, 6), up=1)
        # While it moves: a start is not queued, and with a tool order it is an error.
        ctx.set(dut.order, {"x": 9, "y": 4})
        ctx.set(dut.start, 1)
        await ctx.tick()
        ctx.set(dut.start, 0)
        await ctx.tick()
        ctx.set(dut.order, {"down": 1})
        ctx.set(dut.start, 1)
        await ctx.tick()
        await run.until(ctx, dut, ready=1)
        await ctx.tick().repeat(9)
        run.expect("movements", moves[1:], [(1, 0, 0, 4)])
        run.see(ctx, dut, error=1, ready=1)

    run.simulate(dut, test, machine)
    return ("11 orders: diagonal and rest, nothing to do, tool down and up; refused: a slanted "
            "cut, up and down together, a tool order while moving")
