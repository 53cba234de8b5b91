"""Where orders come from."""

from fresa.motion import (
    CoordinateGenerator,
    OrderLedger,
    Outcome,
    RequestKind,
    SerialOrders,
    SpiralWalk,
    SquareGenerator,
    StartHandshake,
)

from ..bench import Run, bench
from ..models.orders import checked
from ..models.protocol import bits

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


@bench
def order_ledger(run: Run) -> str:
    """Each order once and in its turn; whatever is not the next does nothing."""
    dut = OrderLedger(depth=2)
    tell, open_, go, up = (RequestKind.TELL, RequestKind.OPEN, RequestKind.GO, RequestKind.UP)

    async def ask(ctx, outcome, kind, session=7, number=0, x=0, good=1, **now):
        ctx.set(dut.requests.p, {"good": good, "value": {
            "kind": kind, "session": session, "number": number, "x": x}})
        ctx.set(dut.requests.valid, 1)
        run.see(ctx, dut.requests, ready=1)
        await ctx.tick()
        ctx.set(dut.requests.valid, 0)
        run.see(ctx, dut.answers, valid=1)
        answer = ctx.get(dut.answers.payload)
        run.expect("outcome", Outcome(answer.outcome), outcome)
        for name, value in now.items():
            run.expect(name, answer[name], value)
        await ctx.tick()
        run.see(ctx, dut.answers, valid=0)

    async def carry_out(ctx, x):
        run.see(ctx, dut.orders, valid=1)
        run.expect("order.x", ctx.get(dut.orders.p.x), x)
        ctx.set(dut.orders.ready, 1)
        await ctx.tick()
        ctx.set(dut.orders.ready, 0)

    async def test(ctx):
        ctx.set(dut.answers.ready, 1)
        await ask(ctx, Outcome.MANUAL, open_, manual=1)
        ctx.set(dut.enable, 1)
        await ask(ctx, Outcome.CLOSED, go, session=0, number=1)
        await ask(ctx, Outcome.OPENED, open_, number=4, session=7, taken=4, done=4)
        await ask(ctx, Outcome.TAKEN, go, number=5, x=50, taken=5, done=4)
        await ask(ctx, Outcome.AGAIN, go, number=5, x=99, taken=5)
        await ask(ctx, Outcome.OPENED, open_, number=0, taken=5)
        await ask(ctx, Outcome.DAMAGED, go, number=6, good=0, taken=5)
        await ask(ctx, Outcome.UNEXPECTED, go, number=7, taken=5)
        await ask(ctx, Outcome.TAKEN, up, number=6, x=60, taken=6)
        await ask(ctx, Outcome.FULL, go, number=7, taken=6)
        await ask(ctx, Outcome.BUSY, open_, session=8, taken=6)
        run.see(ctx, dut, busy=1)
        await carry_out(ctx, 50)
        await ask(ctx, Outcome.TAKEN, go, number=7, x=70, taken=7, done=5)
        run.expect("tool", ctx.get(dut.orders.p.up), 1)
        await carry_out(ctx, 60)
        await carry_out(ctx, 70)
        run.see(ctx, dut, busy=0)
        run.see(ctx, dut.orders, valid=0)
        ctx.set(dut.error, 1)
        await ask(ctx, Outcome.TOLD, tell, taken=7, done=7, error=1)
        ctx.set(dut.enable, 0)
        await ctx.tick()
        await ask(ctx, Outcome.CLOSED, go, number=8)
        await ask(ctx, Outcome.TOLD, tell, taken=0, done=0)

    run.simulate(dut, test)
    return ("orders 5, 6 and 7 of a session, each offered once; 5 again, 7 too early, a damaged 6 "
            "and all but the next did nothing")


@bench
def serial_orders(run: Run) -> str:
    """Lines over a serial line to orders, and an answer to each."""
    dut = SerialOrders(clock=16, baud=1)
    answers = []

    async def listen(ctx):
        line = bytearray()
        while True:
            while ctx.get(dut.tx):
                await ctx.tick()
            await ctx.tick().repeat(24)
            byte = 0
            for number in range(8):
                byte |= ctx.get(dut.tx) << number
                await ctx.tick().repeat(16)
            line.append(byte)
            if byte == ord("\n"):
                answers.append(line.decode()[:23])
                line.clear()

    async def ask(ctx, digits, answer, *, damage=None):
        text = bytearray(f":{checked(digits)}\r".encode())
        if damage is not None:
            text[damage] ^= 1
        for byte in text:
            for level in bits(byte):
                ctx.set(dut.rx, level)
                await ctx.tick().repeat(16)
        await ctx.tick().repeat(6000)
        run.expect("answer", answers[-1:], [f"={answer}"])

    async def test(ctx):
        ctx.set(dut.rx, 1)
        ctx.set(dut.enable, 1)
        await ctx.tick().repeat(9)
        await ask(ctx, "01C0FFEE01" "000000" "00000000", "10C0FFEE01" "000000" "000000")
        await ask(ctx, "02C0FFEE01" "000001" "00800100", "20C0FFEE01" "000001" "000000")
        run.see(ctx, dut.orders, valid=1)
        order = ctx.get(dut.orders.payload)
        run.expect("order", (order.x, order.y), (128, 256))
        ctx.set(dut.orders.ready, 1)
        await ctx.tick()
        ctx.set(dut.orders.ready, 0)
        await ask(ctx, "03C0FFEE01" "000002" "00000000", "90C0FFEE01" "000001" "000001", damage=9)
        run.see(ctx, dut.orders, valid=0)
        await ask(ctx, "03C0FFEE01" "000002" "00000000", "20C0FFEE01" "000002" "000001")
        run.expect("tool", ctx.get(dut.orders.p.up), 1)
        run.expect("answers", len(answers), 4)

    run.simulate(dut, test, listen, deadline=80_000)
    return "a session opened, order 1 taken, order 2 taken once its line came undamaged"
