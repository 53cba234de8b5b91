"""Benches of a point that hangs from two strings: its motors, lengths, homing and commands."""

from collections.abc import Callable
from itertools import pairwise
from math import hypot

from fresa.drive import HALF_STEP, StringMotor
from fresa.motion import TICKS_LOG2, AlarmCode, BowedLine, Hanging, StringCycles, StringHoming
from fresa.protocol import HomingStage, LineEnd, WallDialect

from ..bench import Run, bench

TICKS = 1 << TICKS_LOG2
PACE = 3


@bench
def string_motor(run: Run) -> str:
    """Steps on request, a length followed, and one that changes on the way."""
    dut = StringMotor(bits=6, period=3, first=20)
    row = made = 0

    async def watch(ctx):
        nonlocal row, made
        while True:
            *_, moved, have, want = await ctx.tick().sample(dut.moved, dut.made, dut.length)
            if moved:
                made += 1
                longer = have < want if ctx.get(dut.follow) else ctx.get(dut.longer)
                row += 1 if longer else -1

    async def follow(ctx, length):
        ctx.set(dut.length, length)
        await ctx.tick()
        await run.until(ctx, dut, behind=0)
        await ctx.tick()
        run.see(ctx, dut, made=length, coils=HALF_STEP[row % 8])

    async def test(ctx):
        ctx.set(dut.length, 20)
        run.see(ctx, dut, made=20, behind=0, coils=0)
        ctx.set(dut.enable, 1)
        ctx.set(dut.step, 1)
        await run.until(ctx, dut, made=18)
        ctx.set(dut.step, 0)
        ctx.set(dut.zero, 1)
        await ctx.tick()
        ctx.set(dut.zero, 0)
        run.see(ctx, dut, made=0, behind=1, coils=HALF_STEP[-2])
        ctx.set(dut.follow, 1)
        await follow(ctx, 5)
        ctx.set(dut.length, 9)
        await run.until(ctx, dut, made=7)
        await follow(ctx, 4)  # what was to come is not made
        ctx.set(dut.length, 20)
        ctx.set(dut.place, 1)
        await ctx.tick()
        ctx.set(dut.place, 0)
        run.see(ctx, dut, made=20, behind=0)
        run.expect("steps", made, 2 + 5 + 2 + 3)
        ctx.set(dut.enable, 0)
        await ctx.tick()
        run.see(ctx, dut, coils=0)

    run.simulate(dut, test, watch)
    return f"{made} steps, and none that was not wanted any more"


@bench
def hanging(run: Run) -> str:
    """A point that goes around, with ticks in adjacent clocks that are taken back."""
    width, first = 700, (350, 200)
    dut = Hanging(width=width, first_across=first[0], first_below=first[1], bits=10)

    def lengths(across, below):
        return [round(hypot(across, below) / TICKS), round(hypot(width - across, below) / TICKS)]

    async def ticks(ctx, right, up):
        """Give a tick."""
        ctx.set(dut.step, (right != 0) | (up != 0) << 1)
        ctx.set(dut.direction, (right > 0) | (up > 0) << 1)
        await ctx.tick()
        ctx.set(dut.step, 0)

    async def test(ctx):
        across, below = first
        run.see(ctx, dut, across=across, below=below, busy=0)
        for right, up, count in ((1, 0, 40), (1, 1, 60), (0, -1, 90), (-1, -1, 50), (-1, 1, 120)):
            for _ in range(count):
                await ticks(ctx, right, up)
                if right:  # forth and back again
                    await ticks(ctx, -right, 0)
                    await ticks(ctx, right, 0)
                across, below = across + right, below - up
                await run.until(ctx, dut, busy=0, within=12)
                run.see(ctx, dut, across=across, below=below, fault=0)
                run.expect("lengths", [ctx.get(each) for each in dut.lengths],
                           lengths(across, below))
        for _ in range(20):
            await ticks(ctx, 0, 1)
        run.see(ctx, dut, fault=1)
        ctx.set(dut.begin, 1)
        await ctx.tick()
        ctx.set(dut.begin, 0)
        run.see(ctx, dut, across=first[0], below=first[1], busy=0, fault=0)
        run.expect("lengths", [ctx.get(each) for each in dut.lengths], lengths(*first))
        for _ in range(3):
            await ticks(ctx, 1, 1)
        ctx.set(dut.drop, 1)
        await ctx.tick()
        ctx.set(dut.drop, 0)
        await run.until(ctx, dut, busy=0, within=12)
        run.see(ctx, dut, across=first[0] + 1, below=first[1] - 1, fault=0)

    run.simulate(dut, test)
    return "both strings always have the nearest length; ticks without room are a fault"


def _drawing(run: Run, dut: BowedLine | StringCycles) -> tuple[Callable, Callable, Callable]:
    """Return a test of a line, its plant, which runs until `over`, and the checks behind it."""
    point, target = [4, 20], [9, 17]
    made, length = [20, 30], [33, 25]
    clocks: list[list[int]] = [[], []]  # of the steps of each motor

    async def plant(ctx, over=lambda: False):
        clock = 0
        while not over():
            for own, value in zip((*dut.point, *dut.target, *dut.made, *dut.length),
                                  (*point, *target, *made, *length), strict=True):
                ctx.set(own, value)
            ctx.set(dut.behind, sum((a != b) << side for side, (a, b) in enumerate(
                zip(made, length, strict=True))))
            ctx.set(dut.moved, follow := ctx.get(dut.follow))
            tick, up = ctx.get(dut.tick), ctx.get(dut.up)
            await ctx.tick()
            clock += 1
            for side in range(2):
                if follow >> side & 1:
                    made[side] += 1 if made[side] < length[side] else -1
                    clocks[side].append(clock)
                if tick >> side & 1:
                    point[side] += 1 if up >> side & 1 else -1

    async def test(ctx):
        run.see(ctx, dut, active=0, drawing=0)
        ctx.set(dut.start, 1)
        await ctx.tick()
        ctx.set(dut.start, 0)
        ctx.set(dut.begins, 1)
        await ctx.tick().repeat(3)
        run.see(ctx, dut, active=1, tick=0)
        ctx.set(dut.allowed, 1)
        await run.until(ctx, dut, drawing=1)
        run.expect("where it draws", point, target)
        await run.until(ctx, dut, restart=1, within=50)
        run.expect("lengths", made, length)
        await ctx.tick().repeat(4)
        run.see(ctx, dut, active=1, done=0, drawing=0)
        ctx.set(dut.begins, 0)
        await run.until(ctx, dut, done=1, within=2)
        await ctx.tick()
        run.see(ctx, dut, active=0, done=0, fault=0)

    def check():
        run.expect("steps", [len(each) for each in clocks], [13, 5])
        run.expect("clocks between steps of the left motor", {
            b - a for a, b in pairwise(clocks[0])}, {PACE})
        # That is made where its share of the way passes half a step.
        part = [int(13 * (number + 0.5) / 5) + 1 for number in range(5)]
        run.expect("steps of the left motor up to each of the right one", [
            sum(each <= other for each in clocks[0]) for other in clocks[1]], part)

    return test, plant, check


@bench
def bowed_line(run: Run) -> str:
    """A line of 13 steps of the left string and 5 of the right one, evenly."""
    dut = BowedLine(pace=PACE, place_bits=5, length_bits=6)
    test, plant, check = _drawing(run, dut)
    run.simulate(dut, test, plant)
    check()
    return "13 steps of one motor, one each pace, and 5 of the other evenly among them"


def _homing(run: Run, dut: StringHoming | StringCycles) -> tuple[Callable, Callable]:
    """Return a test of cycles, and its plant."""
    length = [5, 7]  # from the switches, in steps
    rest = [9, 8]
    stages = []

    def switches():
        return sum((each <= 0) << side for side, each in enumerate(length))

    async def motors(ctx):
        while True:
            ctx.set(dut.switches, switches())
            behind = sum((have != want) << side for side, (have, want) in enumerate(
                zip(length, rest, strict=True)))
            ctx.set(dut.behind, behind)
            moved = ctx.get(dut.step) | (ctx.get(dut.follow) & behind)
            ctx.set(dut.moved, moved)
            longer, follow = ctx.get(dut.longer), ctx.get(dut.follow)
            if (stage := HomingStage(ctx.get(dut.stage))).name not in stages:
                stages.append(stage.name)
            await ctx.tick()
            for side in range(2):
                if moved >> side & 1:
                    out = length[side] < rest[side] if follow else longer >> side & 1
                    length[side] += 1 if out else -1

    async def test(ctx):
        ctx.set(dut.start, 1)
        await ctx.tick()
        ctx.set(dut.start, 0)
        run.see(ctx, dut, active=1, step=0)
        await ctx.tick().repeat(2)
        ctx.set(dut.allowed, 1)
        for side in range(2):
            await run.until(ctx, dut, zero=1 << side)
            run.expect("length", length[side], 1)  # where the switch has opened
            await ctx.tick()
        await run.until(ctx, dut, done=1)
        run.expect("lengths", length, rest)
        run.expect("stages", stages, ["NONE", "FIRST", "SECOND", "REST"])
        length[0] = 50
        ctx.set(dut.start, 1)
        await ctx.tick().repeat(2)
        ctx.set(dut.start, 0)
        await run.until(ctx, dut, failure=AlarmCode.HOMING_SEARCH.value)
        await ctx.tick().repeat(5)
        run.expect("steps", 50 - length[0], 12)
        run.see(ctx, dut, active=1, step=0, failure=0)

    return test, motors


@bench
def string_homing(run: Run) -> str:
    """A cycle with a plant of two strings, and a switch that does not close."""
    dut = StringHoming(pace=PACE, most=12, most_off=4)
    run.simulate(dut, *_homing(run, dut))
    return "each string is 0 where its switch opens; what is wound in vain has an end"


@bench
def string_cycles(run: Run) -> str:
    """A bowed line, and then homing cycles."""
    dut = StringCycles(StringHoming(pace=PACE, most=12, most_off=4),
                       BowedLine(pace=PACE, place_bits=5, length_bits=6))
    draws, strings, check = _drawing(run, dut)
    homes, motors = _homing(run, dut)
    drawn = False

    async def plant(ctx):
        await strings(ctx, over=lambda: drawn)
        ctx.set(dut.behind, 0)
        await motors(ctx)

    async def test(ctx):
        nonlocal drawn
        ctx.set(dut.bows, 1)
        await draws(ctx)
        drawn = True
        ctx.set(dut.bows, 0)
        ctx.set(dut.allowed, 0)
        run.see(ctx, dut, stage=HomingStage.NONE.value, step=0, follow=0)
        await ctx.tick()
        await homes(ctx)

    run.simulate(dut, test, plant)
    check()
    return "each does what it is started for"


@bench
def wall_dialect(run: Run) -> str:
    """A line of G-code, a command that homes, two that draw, and what is wrong."""
    dut = WallDialect(width=1768, top=200, height=1768, feed=3000)
    passed, said = [], []

    async def consume(ctx):
        ctx.set(dut.items.ready, 1)
        line = ""
        while True:
            *_, valid, item, own = await ctx.tick().sample(
                dut.items.valid, dut.items.payload, dut.own)
            if valid and not item.end:
                line += chr(item.byte)
            elif valid:
                passed.append(("own " if own else "") + line)
                ctx.set(dut.answered, 0)
                await ctx.tick().repeat(3)
                if "$J" in line:
                    ctx.set(dut.moving, 1)
                if "$H" in line:
                    for stage in (HomingStage.FIRST, HomingStage.SECOND, HomingStage.REST):
                        ctx.set(dut.stage, stage)
                        await ctx.tick().repeat(90)
                    ctx.set(dut.stage, HomingStage.NONE)
                    ctx.set(dut.homed, 1)
                ctx.set(dut.answered, 1)
                await ctx.tick()
                ctx.set(dut.answered, 0)
                line = ""
                if ctx.get(dut.moving):
                    await ctx.tick().repeat(120)
                    ctx.set(dut.moving, 0)

    async def listen(ctx):
        ctx.set(dut.bytes.ready, 1)
        line = ""
        while True:
            *_, valid, byte = await ctx.tick().sample(dut.bytes.valid, dut.bytes.payload)
            if valid:
                line += chr(byte)
                if byte == 10:
                    said.append(line.strip().partition(".")[0])
                    line = ""

    async def send(ctx, text, end=LineEnd.GOOD):
        ctx.set(dut.lines.valid, 1)
        for byte in [*text.encode(), end]:
            ctx.set(dut.lines.payload, {"byte": byte, "end": isinstance(byte, LineEnd)})
            await run.until(ctx, dut.lines, ready=1)
            await ctx.tick()
        ctx.set(dut.lines.valid, 0)

    async def command(ctx, text, *answers):
        said.clear()
        await send(ctx, text)
        for _ in range(1000):
            if len(said) >= len(answers):
                break
            await ctx.tick()
        run.expect(f"answers to {text}", said, list(answers))

    async def test(ctx):
        ctx.set(dut.powered, 1)
        await ctx.tick()
        await send(ctx, "G1X2")
        await command(ctx, ":i00100300", "The place is unknown")
        await command(ctx, ":h", "Homing motor 1", "Homing motor 2", "Going to the place of rest",
                      "Homed")
        await command(ctx, ":S0", "05")
        await command(ctx, ":I00100199",
                      "Off the wall: x is 0000 to 1768, y is 0200 to 1768")
        await command(ctx, ":I00100300", "Going to the start point", "At the start point")
        await command(ctx, ":S0", "15")
        await send(ctx, ":F17680200")
        await run.until(ctx, dut, pen=1)
        run.expect("states", [ctx.get(each) for each in dut.states], [0x2D] * 3)
        await run.until(ctx, dut, pen=0)
        await command(ctx, ":S0", "Line drawn", "05")
        await command(ctx, ":Q", "Commands: :P1 :P0 :H :Ixxxxyyyy :Fxxxxyyyy :S0 :S1 :S2")
        run.expect("lines", passed, [
            "G1X2", "own $H", "own $J=G21G90G53X-1758Y-100F3000", "own $J=G21G90G53X0Y0F3000"])

    run.simulate(dut, test, consume, listen, deadline=20_000)
    return "G-code passes; a command becomes a line of it, and is answered in words"
