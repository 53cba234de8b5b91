"""Benches of axes: rates, positions, limit switches, and the drivers of their motors."""

from fresa.drive import HALF_STEP, PhaseDriver, RateGenerator, StepDirDriver
from fresa.motion import Backlash, BacklashCompensator, Limits, MoveTo

from ..bench import Run, bench


@bench
def phase_driver(run: Run) -> str:
    """Half steps down the table and back; the power goes and comes again."""
    dut = PhaseDriver(sequence=HALF_STEP, period=3)

    async def test(ctx):
        run.see(ctx, dut, coils=0)
        ctx.set(dut.step, 1)
        ctx.set(dut.direction, 1)
        await ctx.tick().repeat(4)
        run.see(ctx, dut, coils=0, ready=0, moved=0)  # no power

        ctx.set(dut.enable, 1)
        await ctx.tick()
        row = 0
        for direction, way, steps in [(1, 1, 10), (0, -1, 5)]:
            ctx.set(dut.direction, direction)
            for _ in range(steps):
                for rested in (0, 0, 1):
                    run.see(ctx, dut, coils=HALF_STEP[row % 8], ready=rested, moved=rested)
                    await ctx.tick()
                row += way
        ctx.set(dut.step, 0)
        await ctx.tick().repeat(2)
        run.see(ctx, dut, coils=HALF_STEP[5], ready=1, moved=0)
        await ctx.tick()
        ctx.set(run.rst, 1)
        await ctx.tick()
        run.see(ctx, dut, coils=HALF_STEP[5], ready=0)
        ctx.set(run.rst, 0)

        ctx.set(dut.enable, 0)
        ctx.set(dut.step, 1)
        run.see(ctx, dut, ready=0, moved=0)
        for _ in range(4):
            await ctx.tick()
            run.see(ctx, dut, coils=0, ready=0)
        ctx.set(dut.enable, 1)
        await ctx.tick()
        for rested in (0, 0, 1):
            run.see(ctx, dut, coils=HALF_STEP[5], moved=rested)
            await ctx.tick()
        run.see(ctx, dut, coils=HALF_STEP[4])

    run.simulate(dut, test)
    return ("10 half steps down the table and 5 back, each word for 3 clocks; after a time without "
            "power the coils were as before, for 3 clocks")


@bench
def step_dir_driver(run: Run) -> str:
    """Pulses for a driver module: reversed in a pulse, taken back, without power."""
    dut = StepDirDriver(width=3, low=4, setup=2, hold=2)

    async def pulse(ctx, way):
        """Make requested steps at once, and follow the length of the pulse."""
        run.see(ctx, dut, moved=1, ready=1, step_pin=0, direction_pin=way)
        await ctx.tick()
        for level in (1, 1, 1, 0, 0, 0):
            run.see(ctx, dut, moved=0, ready=0, step_pin=level, direction_pin=way, enable_pin=1)
            await ctx.tick()
        run.see(ctx, dut, step_pin=0, ready=1)

    async def test(ctx):
        ctx.set(dut.step, 1)
        await ctx.tick().repeat(5)
        run.see(ctx, dut, step_pin=0, enable_pin=0, ready=0, moved=0)  # no power
        ctx.set(dut.enable, 1)
        for power in (0, 1):
            run.see(ctx, dut, step_pin=0, enable_pin=power, moved=0)
            await ctx.tick()
        for _ in range(3):
            await pulse(ctx, 0)

        run.see(ctx, dut, moved=1)
        await ctx.tick()
        ctx.set(dut.direction, 1)  # in the middle of a pulse
        for level in (1, 1, 1, 0, 0, 0, 0):
            run.see(ctx, dut, step_pin=level, direction_pin=0, moved=0)
            await ctx.tick()
        run.see(ctx, dut, step_pin=0, direction_pin=1, moved=0)
        await ctx.tick()
        await pulse(ctx, 1)

        ctx.set(dut.direction, 0)
        run.see(ctx, dut, ready=0, moved=0)
        await ctx.tick()
        ctx.set(dut.step, 0)  # it is taken back while DIR settles
        for ready in (0, 1, 1):
            run.see(ctx, dut, step_pin=0, direction_pin=0, ready=ready, moved=0)
            await ctx.tick()
        ctx.set(dut.direction, 1)
        for _ in range(3):
            run.see(ctx, dut, direction_pin=0, ready=0)  # no step in that direction
            await ctx.tick()
        ctx.set(dut.direction, 0)

        ctx.set(dut.step, 1)
        run.see(ctx, dut, moved=1)
        await ctx.tick()
        ctx.set(dut.enable, 0)  # in the middle of a pulse
        ctx.set(run.rst, 1)
        for level in (1, 1, 1, 0, 0, 0, 0):
            run.see(ctx, dut, step_pin=level, enable_pin=1, moved=0)
            await ctx.tick()
        ctx.set(run.rst, 0)
        for _ in range(6):
            run.see(ctx, dut, step_pin=0, enable_pin=0, ready=0, moved=0)
            await ctx.tick()

    run.simulate(dut, test)
    return ("6 pulses of 3 clocks, 4 or more apart, with DIR and ENABLE settled; those reversed "
            "and cut off in the middle were whole; a step taken back made none")


@bench
def rate_generator(run: Run) -> str:
    """7 steps in 40 clocks; a new rate meanwhile; a step that has to wait."""
    dut = RateGenerator(modulus=40, max_rate=10)

    async def steps(ctx, clocks, expected):
        """Make the steps that are due; return their clocks, from 0."""
        for clock in range(clocks):
            run.see(ctx, dut, due=clock in expected)
            await ctx.tick()

    async def test(ctx):
        await steps(ctx, 3, range(3))  # from power-up on
        ctx.set(dut.moved, 1)
        ctx.set(dut.rate, 7)
        await steps(ctx, 40, (0, 6, 12, 18, 23, 29, 35))
        await steps(ctx, 20, (0, 6, 12, 18))

        ctx.set(dut.rate, 1)
        await steps(ctx, 8, ())
        ctx.set(dut.rate, 10)
        await steps(ctx, 4, (2,))
        ctx.set(dut.rate, 15)  # no more than 10
        await steps(ctx, 12, (2, 6, 10))

        ctx.set(dut.moved, 0)
        await steps(ctx, 9, range(2, 9))
        ctx.set(dut.moved, 1)
        await steps(ctx, 9, (0, 4, 8))
        ctx.set(dut.rate, 0)
        await steps(ctx, 12, ())

    run.simulate(dut, test)
    return ("steps at 7 in 40 clocks, less than a clock late each; slower and faster under way; "
            "one waited 7 clocks, and the next came a whole time of 4 after it")


@bench
def move_to(run: Run) -> str:
    """To a target, to one behind, stopped, elsewhere, and to the end of the range."""
    dut = MoveTo(width=8)

    async def go(ctx, target, places, direction):
        """Make every requested step, in its second clock."""
        ctx.set(dut.target_n, ~target)
        for place in places:
            for moved in (0, 1):
                ctx.set(dut.moved, moved)
                run.see(ctx, dut, position=place, step=1, direction=direction)
                await ctx.tick()
            ctx.set(dut.moved, 0)

    async def rests(ctx, place):
        for _ in range(3):
            run.see(ctx, dut, position=place, step=0)
            await ctx.tick()

    async def test(ctx):
        ctx.set(dut.target_n, ~4)
        await rests(ctx, 0)  # until `run`
        ctx.set(dut.run, 1)
        await go(ctx, 4, (0, 1, 2), 1)
        await go(ctx, -2, (3, 2, 1, 0, -1), 0)
        await rests(ctx, -2)

        await go(ctx, 50, (-2, -1), 1)
        ctx.set(dut.run, 0)
        await rests(ctx, 0)
        ctx.set(dut.target_n, ~127)
        ctx.set(dut.place, 125)
        ctx.set(dut.load, 1)
        ctx.set(dut.run, 1)
        run.see(ctx, dut, position=0, step=0)
        await ctx.tick()
        ctx.set(dut.load, 0)
        await go(ctx, 127, (125, 126), 1)
        await rests(ctx, 127)
        await go(ctx, -128, (127, 126), 0)
        ctx.set(run.rst, 1)
        ctx.set(dut.target_n, ~0)
        ctx.set(dut.run, 0)
        await ctx.tick()
        run.see(ctx, dut, position=0, step=0)

    run.simulate(dut, test)
    return ("3 steps towards 4, back to -2, stopped at 0; called 125 there, it went to 127, the "
            "end of the range, and from there back")


@bench
def backlash(run: Run) -> str:
    """Reversals with a backlash of 3, also while it is taken up; then of 1."""
    dut = Backlash(max_backlash=5)

    async def steps(ctx, direction, *counted):
        ctx.set(dut.direction, direction)
        for says in counted:
            ctx.set(dut.moved, 1)
            run.see(ctx, dut, counted=says)
            await ctx.tick()
            ctx.set(dut.moved, 0)
            run.see(ctx, dut, counted=0)
            await ctx.tick()

    async def test(ctx):
        ctx.set(dut.backlash, 3)
        await steps(ctx, 0, 1, 1)
        await steps(ctx, 1, 0, 0, 0, 1, 1)
        await steps(ctx, 0, 0, 0)
        await steps(ctx, 1, 0, 0, 1)
        ctx.set(run.rst, 1)
        await ctx.tick()
        ctx.set(run.rst, 0)
        await steps(ctx, 0, 0)
        ctx.set(dut.backlash, 1)
        await steps(ctx, 0, 0, 0, 1)
        await steps(ctx, 1, 0, 1)
        await steps(ctx, 0, 0, 1)
        ctx.set(dut.backlash, 0)
        await steps(ctx, 1, 1, 1)

    run.simulate(dut, test)
    return ("3 steps were left out after each reversal, and 2 where only 2 had been taken up; "
            "then 1, then none")


@bench
def backlash_compensator(run: Run) -> str:
    """Three steps up, two down, with a backlash of 3; a stop in between."""
    dut = BacklashCompensator(max_backlash=3)
    motor, position, waiting, tick = [0], [0], [], [0]

    async def around(ctx):
        """Make each step a clock after it is requested."""
        while True:
            ctx.set(dut.pending, bool(waiting))
            ctx.set(dut.moved, bool(waiting) and not ctx.get(dut.stop))
            ctx.set(dut.direction, bool(waiting) and waiting[0] > 0)
            tick[0] = (tick[0] + 1) % 4
            ctx.set(dut.tick, tick[0] == 0)
            if ctx.get(dut.moved):
                motor[0] += waiting[0]
                position[0] += waiting.pop(0)
            if ctx.get(dut.correct):
                position[0] += 1 if ctx.get(dut.correct_direction) else -1
            if ctx.get(dut.extra):
                waiting.append(1 if ctx.get(dut.extra_direction) else -1)
            await ctx.tick()

    async def steps(ctx, count, way):
        for _ in range(count):
            ctx.set(dut.step, 1)
            await ctx.tick()
            ctx.set(dut.step, 0)
            waiting.append(way)
            await ctx.tick()

    async def test(ctx):
        ctx.set(dut.backlash, 3)
        await steps(ctx, 3, 1)
        await ctx.tick().repeat(16)
        run.see(ctx, dut, busy=0)
        run.expect("motor, position", (motor[0], position[0]), (6, 3))
        await steps(ctx, 2, -1)
        ctx.set(dut.stop, 1)
        await ctx.tick()
        ctx.set(dut.stop, 0)
        await ctx.tick().repeat(8)
        run.see(ctx, dut, busy=0)
        run.expect("motor, position", (motor[0], position[0]), (4, 1))
        await steps(ctx, 1, -1)
        await ctx.tick().repeat(16)
        run.expect("motor, position", (motor[0], position[0]), (0, 0))

    run.simulate(dut, test, around)
    return "a motor makes 3 steps more each way, which its position does not count"


@bench
def limits(run: Run) -> str:
    """Each switch of two axes; a contact that bounces."""
    dut = Limits(axes=2, period=4)

    async def test(ctx):
        for low, high in [(0, 0), (0b01, 0), (0, 0b01), (0b10, 0b01)]:
            ctx.set(dut.low, low)
            ctx.set(dut.high, high)
            for _ in range(3):
                run.see(ctx, dut, at_low=low, at_high=high)
                await ctx.tick()
            ctx.set(dut.low, 0)
            ctx.set(dut.high, 0)
            await ctx.tick().repeat(8)

        await ctx.tick().repeat(3)
        for contact in (1, 0, 0, 1, 1, 0, 1, 0, 0, 0):
            ctx.set(dut.high, contact)
            run.see(ctx, dut, at_low=0, at_high=0b01)
            await ctx.tick()
        ctx.set(run.rst, 1)
        for on in (0b01, 0b01, 0b01, 0, 0):
            run.see(ctx, dut, at_high=on)
            await ctx.tick()

    run.simulate(dut, test)
    return ("each switch counted as on at once, and no other with it; one that bounced did from "
            "its first touch until it had settled")
