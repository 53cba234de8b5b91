"""Scenarios of `mill`: a tour of all that it does."""

from ...bench import Run, bench
from ...plant import WORDS
from . import MACHINE
from .parts import serial_orders


@bench
def mill(run: Run) -> str:
    """A tour: by hand to the origin, tool down, a cut, two refusals, home, stop."""
    dut = MACHINE.make(**MACHINE.bench_options)
    hand = [0, 0, 0]

    async def there(ctx, main, *place):
        """Check the four counts, and that the coils agree with them."""
        for select, count in enumerate((main, *place)):
            ctx.set(dut.counter_select, select)
            await ctx.tick()
            run.see(ctx, dut, count=count % 65536)
        x, y, z = (WORDS[(a + b) % 4] for a, b in zip(hand, place, strict=True))
        run.see(ctx, dut, axis_x=x, axis_y=y, axis_z=z)

    async def order(ctx, x=0, y=0, up=0, down=0):
        await run.until(ctx, dut, ready=1)
        ctx.set(dut.position_x, x)
        ctx.set(dut.position_y, y)
        ctx.set(dut.up, up)
        ctx.set(dut.down, down)
        ctx.set(dut.start, 1)
        await ctx.tick()
        run.see(ctx, dut, ready=0)
        ctx.set(dut.start, 0)

    async def test(ctx):
        await ctx.tick()
        for jog, clocks, way in [(0b000001, 9, (3, 0, 0)), (0b001000, 5, (0, -2, 0))]:
            ctx.set(dut.jog, jog)
            await ctx.tick().repeat(clocks)
            ctx.set(dut.jog, 0)
            await ctx.tick().repeat(4)
            hand[:] = [a + b for a, b in zip(hand, way, strict=True)]
            run.see(ctx, dut, leds=WORDS[hand[0] % 4], axis_y=WORDS[hand[1] % 4], digits=0b1111)

        ctx.set(dut.mode, 1)
        await there(ctx, 0, 0, 0, 0)  # this is the origin
        for target, error, main, place in [
            ({"x": 5, "y": 2}, 0, 3, (5, 2, 0)),  # 2 along a diagonal, then 3
            ({"down": 1}, 0, 6, (5, 2, -6)),
            ({"x": 8, "y": 5}, 0, 3, (8, 5, -6)),  # a cut along a diagonal
            ({"x": 0, "y": 0}, 1, 3, (8, 5, -6)),  # a slanted one
            ({"up": 1, "down": 1}, 1, 3, (8, 5, -6)),
            ({"up": 1}, 0, 6, (8, 5, 0)),
            ({"x": 0, "y": 0}, 0, 3, (0, 0, 0)),
        ]:
            await order(ctx, **target)
            await run.until(ctx, dut, ready=1)
            run.see(ctx, dut, error=error)
            await there(ctx, main, *place)

        await order(ctx, x=9)
        ctx.set(dut.counter_select, 1)
        await run.until(ctx, dut, count=4)
        ctx.set(dut.stop, 1)
        await ctx.tick()
        ctx.set(dut.stop, 0)
        for _ in range(20):
            run.see(ctx, dut, ready=0, count=4)
            await ctx.tick()
        ctx.set(run.rst, 1)
        await ctx.tick()
        ctx.set(run.rst, 0)
        hand[0] += 4
        await there(ctx, 0, 0, 0, 0)

    run.simulate(dut, test, inside=tuple(
        f"controller.automatic.{axis}.count" for axis in "xyz"))
    return ("to (5, 2), tool down, a cut to (8, 5), home; two orders refused; stopped after 4 "
            "steps of 9; after every order the counts and the coils agreed")


SCENARIOS = [serial_orders, mill]
