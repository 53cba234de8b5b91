"""Benches of what two motors of one axis need."""

from fresa.drive import StepDirPair
from fresa.motion import MotorSquaring

from ..bench import Run, bench


@bench
def step_dir_pair(run: Run) -> str:
    """Steps of both motors, of one while the other is halted, and of none."""
    dut = StepDirPair(width=2, low=3, setup=2, hold=2)
    made = [0, 0]  # at the pins

    async def count(ctx):
        before = [0, 0]
        while True:
            *_, first, second = await ctx.tick().sample(dut.step_pin, dut.second_step_pin)
            for motor, (was, level) in enumerate(zip(before, (first, second), strict=True)):
                made[motor] += level & ~was
            before = [first, second]

    async def rests(ctx, clocks):
        for _ in range(clocks):
            run.see(ctx, dut, moved=0)
            await ctx.tick()

    async def test(ctx):
        ctx.set(dut.enable, 1)
        ctx.set(dut.direction, 1)
        await ctx.tick().repeat(6)
        run.see(ctx, dut, enable_pin=1, direction_pin=0, second_direction_pin=0)
        ctx.set(dut.step, 1)
        await rests(ctx, 2)  # DIR of both is turned
        run.see(ctx, dut, moved=1, direction_pin=1, second_direction_pin=1)
        await ctx.tick()
        run.see(ctx, dut, step_pin=1, second_step_pin=1)
        await rests(ctx, 4)
        ctx.set(dut.halt, 1)  # in the clock in which both would step
        run.see(ctx, dut, moved=1, step_pin=0, second_step_pin=0)
        await ctx.tick()
        run.see(ctx, dut, step_pin=0, second_step_pin=1)
        ctx.set(dut.halt, 0)
        await rests(ctx, 4)  # the first waits for the second
        run.see(ctx, dut, moved=1)
        await ctx.tick()
        ctx.set(dut.halt, 2)
        ctx.set(dut.direction, 0)
        await rests(ctx, 4)
        run.see(ctx, dut, step_pin=0, direction_pin=1)
        await rests(ctx, 2)
        run.see(ctx, dut, moved=1, direction_pin=0, second_direction_pin=1)
        await ctx.tick()
        ctx.set(dut.halt, 3)
        await rests(ctx, 12)
        ctx.set(dut.halt, 0)
        await rests(ctx, 2)  # DIR of the second is turned, too
        run.see(ctx, dut, moved=1, direction_pin=0, second_direction_pin=0)
        await ctx.tick()
        ctx.set(run.rst, 1)  # in the pulse
        await rests(ctx, 9)
        ctx.set(run.rst, 0)
        ctx.set(dut.step, 0)
        await rests(ctx, 3)
        run.expect("steps of both motors", made, [4, 4])
        ctx.set(dut.enable, 0)
        await rests(ctx, 2)
        run.see(ctx, dut, enable_pin=0)

    run.simulate(dut, test, count)
    return "three steps of both motors, one of each alone, and none while both are halted"


@bench
def motor_squaring(run: Run) -> str:
    """The switches of both motors in either order, and one that is not met."""
    dut = MotorSquaring(width=4)

    async def set_and_see(ctx, halt, failed=0, **levels):
        for name, level in levels.items():
            ctx.set(getattr(dut, name), level)
        await ctx.tick()
        run.see(ctx, dut, halt=halt, failed=failed)

    async def test(ctx):
        ctx.set(dut.most, 3)
        ctx.set(dut.moved, 1)
        for _ in range(2):  # also once more
            await set_and_see(ctx, 0, switches=3)
            await set_and_see(ctx, 0, switches=0, seeks=1)
            for switches in (0, 0, 0, 0, 0, 1):  # both make as many steps as they like
                await set_and_see(ctx, switches, switches=switches)
            await set_and_see(ctx, 1, switches=0)  # it was met, and is off again
            await set_and_see(ctx, 1)
            await set_and_see(ctx, 3, switches=2)
            for _ in range(6):
                await set_and_see(ctx, 3, switches=0)
            await set_and_see(ctx, 0, seeks=0)
        await set_and_see(ctx, 2, seeks=1, switches=2)
        for failed in (0, 0, 0, 0, 1, 1):  # the first motor makes four steps, and fails
            await set_and_see(ctx, 2, failed)
        await set_and_see(ctx, 3, 1, switches=1)
        await set_and_see(ctx, 3)
        await set_and_see(ctx, 0, seeks=0)

        await set_and_see(ctx, 2, seeks=1, switches=2, moved=0)
        for moved in (1, 1, 0, 1, 0, 0):  # three of them are allowed
            await set_and_see(ctx, 2, moved=moved)
        ctx.set(run.rst, 1)
        await set_and_see(ctx, 0)

    run.simulate(dut, test)
    return "each motor is halted at its own switch; one that went on alone for four steps failed"
