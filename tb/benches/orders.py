"""Benches of sources of orders."""

from fresa.motion import CoordinateGenerator, SpiralWalk, SquareGenerator, StartHandshake

from ..bench import Run, bench

FIGURE = (
    ".##..",
    ".#...",
    "..#..",
    "....#",
)
"""A line that bends, and a dot."""


@bench
def start_handshake(run: Run) -> str:
    """An order is taken once ready has fallen and risen; never after an error."""
    dut = StartHandshake()

    async def test(ctx):
        ctx.set(dut.ready, 1)
        ctx.set(dut.orders.valid, 1)
        for x, busy in [(128, 6), (256, 1), (384, 9)]:
            ctx.set(dut.orders.payload, {"x": x})
            await run.until(ctx, dut, start=1)
            run.expect("order.x", ctx.get(dut.order.x), x)
            await ctx.tick().repeat(2)
            run.see(ctx, dut, start=1)  # it holds until it is seen
            ctx.set(dut.ready, 0)
            for _ in range(busy):
                run.see(ctx, dut.orders, ready=0)
                await ctx.tick()
                run.see(ctx, dut, start=0)
            ctx.set(dut.ready, 1)
            run.see(ctx, dut.orders, ready=1)
            await ctx.tick()

        await run.until(ctx, dut, start=1)
        ctx.set(dut.ready, 0)
        await ctx.tick()
        ctx.set(dut.ready, 1)
        ctx.set(dut.error, 1)
        for _ in range(9):
            run.see(ctx, dut, start=0)
            run.see(ctx, dut.orders, ready=0)
            await ctx.tick()

    run.simulate(dut, test)
    return "3 orders, each taken after ready fell and rose; a fourth, in error, was not taken"


@bench
def spiral_walk(run: Run) -> str:
    """Every pixel once, the nearest first."""
    dut = SpiralWalk(rows=4, columns=5)

    async def test(ctx):
        ctx.set(dut.home, 1)
        ctx.set(dut.centre, 1)
        await ctx.tick()
        ctx.set(dut.home, 0)
        ctx.set(dut.centre, 0)
        ctx.set(dut.advance, 1)
        await ctx.tick().repeat(4)  # west, south, east, east: to (1, 1)
        ctx.set(dut.centre, 1)
        ctx.set(dut.advance, 0)
        await ctx.tick()
        ctx.set(dut.centre, 0)
        ctx.set(dut.advance, 1)
        seen, far = [], 0
        for pixel in range(49):
            run.see(ctx, dut, near=pixel < 9)
            if ctx.get(dut.inside):
                row, column = ctx.get(dut.row), ctx.get(dut.column)
                run.see(ctx, dut, number=5 * row + column)
                distance = max(abs(row - 1), abs(column - 1))
                run.expect("nearer than the last", distance < far, False)
                far = distance
                seen.append((row, column))
            await ctx.tick()
        run.expect("pixels", sorted(seen), [(row, col) for row in range(4) for col in range(5)])

    run.simulate(dut, test)
    return "around (1, 1): all 20 pixels of a 4 x 5 picture, each once, none nearer than the last"


@bench
def square_generator(run: Run) -> str:
    """Four corners for every start."""
    dut = SquareGenerator(side=300)

    async def test(ctx):
        for _ in range(2):
            run.see(ctx, dut, busy=0)
            ctx.set(dut.start, 1)
            await ctx.tick()
            ctx.set(dut.start, 0)
            for corner in [(300, 0), (300, 300), (0, 300), (0, 0)]:
                await ctx.tick().repeat(3)  # the order holds until it is taken
                run.see(ctx, dut, busy=1)
                run.see(ctx, dut.orders, valid=1)
                order = ctx.get(dut.orders.payload)
                run.expect("order", (order.x, order.y, order.up, order.down), (*corner, 0, 0))
                ctx.set(dut.orders.ready, 1)
                await ctx.tick()
                ctx.set(dut.orders.ready, 0)
            run.see(ctx, dut.orders, valid=0)
            await ctx.tick().repeat(3)

    run.simulate(dut, test)
    return "twice (300, 0), (300, 300), (0, 300), (0, 0), in the air, an order at a time"


@bench
def coordinate_generator(run: Run) -> str:
    """A picture to orders: every pixel is milled, and no other."""
    dut = CoordinateGenerator([[pixel == "#" for pixel in row] for row in FIGURE], pixel_steps=8)
    pixels = {(row, column) for row, line in enumerate(FIGURE)
              for column, pixel in enumerate(line) if pixel == "#"}
    milled, lifts = set(), 0

    async def test(ctx):
        nonlocal lifts
        ctx.set(dut.start, 1)
        await ctx.tick()
        ctx.set(dut.start, 0)
        at, lowered = (0, 0), False
        while ctx.get(dut.busy):
            if not ctx.get(dut.orders.valid):
                await ctx.tick()
                continue
            order = ctx.get(dut.orders.payload)
            run.expect("up and down together", order.up and order.down, 0)
            if order.up or order.down:
                lifts += lowered and order.up
                lowered = bool(order.down)
            else:
                run.expect("place between pixels", (order.x % 8, order.y % 8), (0, 0))
                to = (order.x // 8, order.y // 8)
                if lowered:
                    way = max(abs(to[0] - at[0]), abs(to[1] - at[1]))
                    run.expect("pixels walked with the tool down", way, 1)
                at = to
            if lowered:
                run.expect(f"pixel {at} is to be milled", at in pixels, True)
                milled.add(at)
            await ctx.tick().repeat(4)  # the machine at work
            ctx.set(dut.orders.ready, 1)
            await ctx.tick()
            ctx.set(dut.orders.ready, 0)
        run.expect("pixels milled", sorted(milled), sorted(pixels))
        run.expect("place and tool at the end", (at, lowered), ((0, 0), False))

    run.simulate(dut, test)
    return f"{len(milled)} pixels milled in {lifts} strokes, no other; at the origin, raised"
