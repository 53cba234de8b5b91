"""Benches of manual mode, automatic mode, and both."""

from fresa.motion import AutomaticControl, ManualControl, NumericalController

from ..bench import Run, bench, put
from ..plant import WORDS

X, Y, Z = 0b001, 0b010, 0b100


@bench
def automatic_control(run: Run) -> str:
    """The four counts; a refused step is not counted and comes again."""
    dut = AutomaticControl(period=3)
    made = [0, 0, 0]

    async def motors(ctx):
        requests = 0
        while True:
            step = ctx.get(dut.step)
            requests += step != 0
            moved = 0 if requests == 2 else step  # the second is too soon for the motors
            ctx.set(dut.moved, moved)
            direction = ctx.get(dut.direction)
            await ctx.tick()
            for axis in range(3):
                made[axis] += (moved >> axis & 1) * (1 if direction >> axis & 1 else -1)

    async def test(ctx):
        for axes, direction, steps, counts in [
            (X, X, 5, (5, 5, 0, 0)), (X | Y, Y, 3, (3, 2, 3, 0)), (Z, 0, 2, (2, 2, 3, 0xFFFE)),
        ]:
            await put(ctx, dut.moves, {"axes": axes, "direction": direction, "steps": steps})
            await run.until(ctx, dut.moves, ready=1)
            for select, count in enumerate(counts):
                ctx.set(dut.select, select)
                run.see(ctx, dut, shown=count)
                await ctx.tick()
            run.expect("steps made", [step % 65536 for step in made], list(counts[1:]))

    run.simulate(dut, test, motors, inside=("x.count", "y.count", "z.count"))
    return "X 5 on, X 3 back while Y 3 on, Z 2 back; each count equals the steps that were made"


@bench
def manual_control(run: Run) -> str:
    """Two switches an axis: up, down, both; and one that was on from before."""
    dut = ManualControl(period=4)

    async def test(ctx):
        ctx.set(dut.enable, 1)
        await ctx.tick()
        for jog, axes, up in [
            (0b000001, X, X), (0b000010, X, 0), (0b000011, X, X), (0b001000, Y, 0),
            (0b010000, Z, Z), (0b100110, X | Y | Z, Y),
        ]:
            ctx.set(dut.jog, jog)
            for clock in range(1, 9):
                run.see(ctx, dut, active=axes, direction=up, step=axes if clock % 4 == 0 else 0)
                await ctx.tick()
            ctx.set(dut.jog, 0)
            run.see(ctx, dut, active=0, step=0)
            await ctx.tick()

        ctx.set(dut.enable, 0)
        ctx.set(dut.jog, 0b000001)
        await ctx.tick().repeat(3)
        ctx.set(dut.enable, 1)
        for _ in range(8):
            run.see(ctx, dut, active=0, step=0)
            await ctx.tick()
        ctx.set(dut.jog, 0)
        await ctx.tick()
        ctx.set(dut.jog, 0b000001)
        run.see(ctx, dut, active=X, direction=X)

    run.simulate(dut, test)
    return ("each axis, both ways, all together: a step every 4 clocks, both switches on are up; "
            "a switch on from before did nothing until it was off once")


@bench
def numerical_controller(run: Run) -> str:
    """Orders, the tool, manual mode, a reset and a stop: no coil word ever jumps."""
    dut = NumericalController(period=3, z_travel=4)

    async def coils(ctx, x, y):
        run.see(ctx, dut, axis_x=WORDS[x % 4], axis_y=WORDS[y % 4], axis_z=WORDS[0])
        await ctx.tick()

    async def counts(ctx, *expected):
        for select, count in enumerate(expected):
            ctx.set(dut.select, select)
            run.see(ctx, dut, count=count)
            await ctx.tick()

    async def order(ctx, **fields):
        ctx.set(dut.order, fields)
        ctx.set(dut.start, 1)
        await run.until(ctx, dut, ready=0)
        ctx.set(dut.start, 0)

    async def test(ctx):
        await ctx.tick()
        for jog, axis in [(0b010000, Z), (0b000100, Y), (0b000001, X)]:
            ctx.set(dut.jog, jog)
            run.see(ctx, dut, jogging=axis)
        await ctx.tick().repeat(7)  # steps in the first, the fourth and the seventh clock
        ctx.set(dut.jog, 0)
        await coils(ctx, 3, 0)

        ctx.set(dut.mode, 1)
        await run.until(ctx, dut, ready=1)
        await counts(ctx, 0, 0, 0, 0)
        await order(ctx, x=3, y=1)
        await run.until(ctx, dut, ready=1)
        await counts(ctx, 2, 3, 1, 0)
        await coils(ctx, 6, 1)
        for tool, count in [("down", 0xFFFC), ("down", 0xFFFC), ("up", 0), ("up", 0)]:
            await order(ctx, **{tool: 1})
            await run.until(ctx, dut, ready=1)
            await counts(ctx, 4, 3, 1, count)

        ctx.set(dut.mode, 0)
        await coils(ctx, 6, 1)
        await counts(ctx, 0, 0, 0, 0)
        ctx.set(run.rst, 1)
        await coils(ctx, 6, 1)
        ctx.set(run.rst, 0)

        ctx.set(dut.mode, 1)
        await run.until(ctx, dut, ready=1)
        await order(ctx, x=0, y=9)
        ctx.set(dut.select, 2)
        await run.until(ctx, dut, count=2)
        ctx.set(dut.stop, 1)
        await ctx.tick()
        ctx.set(dut.stop, 0)
        for _ in range(12):
            run.see(ctx, dut, ready=0, count=2)
            await coils(ctx, 6, 3)

    run.simulate(dut, test, inside=("automatic.x.count", "automatic.y.count", "automatic.z.count"))
    return ("by hand to the origin, then to (3, 1); the tool down and up; manual mode and reset "
            "cleared the counts and left the coils; stopped after 2 of 9 steps, it stayed there")
