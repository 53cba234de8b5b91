"""An axis that goes to targets, and the store of points to go to."""

from fresa.drive import StepDirDriver
from fresa.motion import Axis, PointStore

from ..bench import Run, bench


@bench
def axis(run: Run) -> str:
    """An axis to a target and back, past its backlash, and up to a switch."""
    dut = Axis(driver=StepDirDriver(width=2, low=2, setup=2, hold=2), modulus=20, max_rate=2,
               max_backlash=3, width=6)
    motor = 0

    async def observe(ctx):
        nonlocal motor
        before = 0
        while True:
            step = ctx.get(dut.step_pin)
            motor += (1 if ctx.get(dut.direction_pin) else -1) * (step and not before)
            before = step
            await ctx.tick()

    async def go(ctx, target, position):
        ctx.set(dut.target_n, ~target)
        await run.until(ctx, dut, position=position)
        await ctx.tick().repeat(30)
        run.see(ctx, dut, position=position)

    async def test(ctx):
        ctx.set(dut.backlash, 2)
        ctx.set(dut.rate, 2)
        ctx.set(dut.run, 1)
        ctx.set(dut.enable, 1)
        await go(ctx, 4, 4)
        run.expect("pulses", motor, 6)  # 2 of them take up the backlash
        await go(ctx, 1, 1)
        run.expect("pulses", motor, 1)
        ctx.set(dut.low, 1)
        ctx.set(dut.target_n, ~-5)
        await ctx.tick().repeat(30)
        run.see(ctx, dut, position=1, limit_hit=1, in_position=0)
        await go(ctx, 3, 3)
        run.see(ctx, dut, limit_hit=0, in_position=1)
        ctx.set(dut.place, -24)
        ctx.set(dut.load, 1)
        await ctx.tick()
        run.see(ctx, dut, position=-24)
        ctx.set(dut.load, 0)

        # At the full speed and at half of it, to the clock
        for rate, target in [(2, -20), (1, -16)]:
            ctx.set(dut.rate, rate)
            ctx.set(dut.target_n, ~target)
            await run.until(ctx, dut, moved=1)
            for _ in range(3):
                await ctx.tick()
                for _ in range(20 // rate - 1):
                    run.see(ctx, dut, moved=0)
                    await ctx.tick()
                run.see(ctx, dut, moved=1)
            await ctx.tick()
        # After a rest, however long, in the next clock
        for rest in (41, 42, 43):
            await ctx.tick().repeat(rest)
            run.see(ctx, dut, in_position=1, moved=0)
            ctx.set(dut.target_n, ctx.get(dut.target_n) - 1)
            run.see(ctx, dut, in_position=0, moved=0)
            await ctx.tick()
            run.see(ctx, dut, moved=1)

        # The other switch lets go down, and up again when it is off
        ctx.set(dut.low, 0)
        ctx.set(dut.high, 1)
        ctx.set(dut.backlash, 0)
        await ctx.tick().repeat(25)
        ctx.set(dut.target_n, ~-15)
        await ctx.tick().repeat(3)
        run.see(ctx, dut, moved=1, limit_hit=0)
        await ctx.tick().repeat(25)
        ctx.set(dut.target_n, ~-10)
        run.see(ctx, dut, moved=0, limit_hit=0)
        await ctx.tick()
        run.see(ctx, dut, moved=0, limit_hit=1)
        await ctx.tick().repeat(3)
        run.see(ctx, dut, moved=0, limit_hit=1)
        ctx.set(dut.high, 0)
        run.see(ctx, dut, limit_hit=0)
        await run.until(ctx, dut, position=-10)

        # A backlash that is reduced while it is taken up: the first step back moves the load
        ctx.set(dut.backlash, 2)
        ctx.set(dut.target_n, ~-12)
        await run.until(ctx, dut, moved=1)
        await ctx.tick().repeat(2)
        ctx.set(dut.backlash, 0)
        before = motor
        await go(ctx, -9, -9)
        run.expect("pulses", motor - before, 1)

    run.simulate(dut, test, observe)
    return ("to 4 with 2 pulses more for the backlash, back to 1; a switch held it there, and let "
            "it go to 3; steps to the clock; the other switch let it go down only")


@bench
def point_store(run: Run) -> str:
    """Points kept, found a clock later, and forgotten at reset."""
    dut = PointStore(points=3, axes=2, width=6)
    kept = {1: (4, -7), 3: (31, -32), 0: (1, 1)}

    async def test(ctx):
        for number, place in kept.items():
            ctx.set(dut.number, number)
            for port, value in zip(dut.place, place, strict=True):
                ctx.set(port, value)
            ctx.set(dut.store, 1)
            await ctx.tick()
        ctx.set(dut.store, 0)
        for number in range(4):
            ctx.set(dut.number, number)
            run.see(ctx, dut, stored=int(number in (1, 3)))
            await ctx.tick()
            if number in (1, 3):
                run.expect("place", tuple(ctx.get(port) for port in dut.found), kept[number])
        ctx.set(run.rst, 1)
        await ctx.tick()
        ctx.set(run.rst, 0)
        run.see(ctx, dut, stored=0)

    run.simulate(dut, test)
    return "points 1 and 3 were found where they were put, 2 and 0 were not there, after reset none"
