"""What is between actions and steps: the planner, the loader, and the motion of blocks."""

from fresa.arithmetic import Line
from fresa.motion import (
    AccessoryRestart,
    BlockLoader,
    BlockMotion,
    GCodeHoming,
    GCodePlanner,
    GCodeProbing,
    HomingRequest,
    NominalSpeed,
    OverrideKind,
    Overrides,
)
from fresa.motion.blocks import BlockHeader, BlockKind, BlockWord
from fresa.protocol import GCodeAction, GCodeActionKind, GCodeMotion, Operand, RealtimeCode

from ..bench import Run, bench, put
from ..models.gcode_plan import MotionBlock, Planner, PlanSettings

CLOCK = 2_000_000
LINE = Line(clock=CLOCK, speeds=(200_000_000,) * 3, accelerations=(16_000_000_000,) * 3)
WORD = (1 << 36) - 1


def model() -> Planner:
    return Planner(PlanSettings(LINE.clock, LINE.speeds, LINE.accelerations, LINE.steps,
                                LINE.deviation))


def header(kind: BlockKind = BlockKind.MOTION, log2_ticks: int = 0, flood: int = 0) -> int:
    return BlockHeader.const({"kind": kind, "log2_ticks": log2_ticks, "channel": (0, 1, 2),
                              "outputs": {"flood": flood}}).as_bits()


def line(planner: Planner, target: tuple[int, int, int], feed: int | None = None) -> MotionBlock:
    """Plan a line that has a length."""
    block = planner.line(target, feed)
    assert block
    return block


def block_words(block: MotionBlock, feed: int = 0) -> dict[int, int]:
    """Return the words of a block, by their addresses; the last one commits it.

    The programmed feed is in bits that two of them have left over.
    """
    words = {BlockWord.HEADER: header(log2_ticks=block.log2_ticks)}
    for address, number in ((BlockWord.ENERGY, block.energy), (BlockWord.MODULUS, block.modulus)):
        words |= {address: number >> 36, address + 1: number & WORD}
    words[BlockWord.MODULUS] |= (feed & (1 << 22) - 1) << 14
    words[BlockWord.ENERGY] |= feed >> 22 << 26
    words |= {BlockWord.FASTEST: block.fastest, BlockWord.HUNDREDTH: block.hundredth}
    words |= {BlockWord.PLACE + axis: place for axis, place in enumerate(block.place)}
    for address, number in ((16, block.gain), (18, block.limit)):
        words |= {address: number & WORD, address + 1: number >> 36}
    return words


def place_words(places: tuple[int, ...]) -> dict[int, int]:
    """Return the words of a block that sets a place."""
    return {BlockWord.HEADER: header(BlockKind.PLACE), **{
        BlockWord.PLACE + axis: place for axis, place in enumerate(places)},
        16: 0, 17: 0, 18: 0, 19: 0}


@bench
def block_loader(run: Run) -> str:
    """A place, a line from there, outputs, and a dwell."""
    dut = BlockLoader(clock=CLOCK)

    async def send(ctx, words):
        for number in range(16):
            await put(ctx, dut.blocks, {"data": words.get(number, 0), "last": number == 15})

    async def taken(ctx):
        await run.until(ctx, dut, take=1)
        await ctx.tick()

    async def test(ctx):
        planner = model()
        await send(ctx, place_words(planner.places((0, 0, 0))))
        await taken(ctx)
        block = line(planner, (1_000_000, 0, -3_000))
        await send(ctx, block_words(block))
        await run.until(ctx, dut.profile, valid=1)
        run.expect("energy", ctx.get(dut.profile.p.energy), block.energy)
        run.expect("modulus", ctx.get(dut.profile.p.modulus), block.modulus)
        run.see(ctx, dut.segments, valid=1)
        run.expect("increments", [*ctx.get(dut.segments.p.increment)],
                   [80 * 256, 0, -62])
        run.expect("start", [*ctx.get(dut.segments.p.start)], [128, 128, 128])
        ctx.set(dut.profile.ready, 1)
        run.see(ctx, dut, take=1)
        await ctx.tick()
        ctx.set(dut.profile.ready, 0)
        ctx.set(dut.segments.ready, 1)
        await ctx.tick()
        ctx.set(dut.segments.ready, 0)
        await send(ctx, {BlockWord.HEADER: header(BlockKind.OUTPUTS, flood=1)})
        await taken(ctx)
        run.expect("outputs", ctx.get(dut.outputs).flood, 0)
        ctx.set(dut.idle, 1)
        await ctx.tick()
        run.expect("outputs", ctx.get(dut.outputs).flood, 1)
        await send(ctx, {BlockWord.HEADER: header(BlockKind.DWELL, flood=1), BlockWord.EXTRA: 9})
        await run.until(ctx, dut, waiting=1)
        begun = run.clock
        await taken(ctx)
        run.expect("clocks of 9 us", run.clock - begun, 20)

    run.simulate(dut, test)
    return "what profile and walk get is what was planned; 9 us are 18 clocks, and 2 more"


@bench
def block_motion(run: Run) -> str:
    """Two lines to steps, with a corner between them."""
    dut = BlockMotion(clock=CLOCK)
    position = [0, 0, 0]

    async def count(ctx):
        while True:
            for axis in range(3):
                if ctx.get(dut.step) >> axis & 1:
                    position[axis] += 1 if ctx.get(dut.direction) >> axis & 1 else -1
            await ctx.tick()

    async def write(ctx, words):
        for number, (address, word) in enumerate(words.items(), 1):
            await put(ctx, dut.words, {"address": address, "data": word,
                                       "last": number == len(words)})

    async def test(ctx):
        ctx.set(dut.made, 1)
        for each in dut.feed_override, dut.rapid_override:
            ctx.set(each, 100)
        for axis in range(3):
            ctx.set(dut.steps[axis], LINE.steps[axis])
        planner = model()
        await write(ctx, place_words(planner.places((0, 0, 0))))
        for target in ((200_000, 0, 50_000), (200_000, -150_000, 50_000)):
            await write(ctx, block_words(line(planner, target)))
        await run.until(ctx, dut, still=0, within=400)
        await run.until(ctx, dut, idle=1, within=40_000)
        run.expect("steps", position, [16, -12, 4])
        run.see(ctx, dut, fault=0)

    run.simulate(dut, test, count, deadline=60_000)
    return "0.2 mm and 0.15 mm are 16 and 12 steps; Z makes 4 of them meanwhile"


@bench
def g_code_planner(run: Run) -> str:
    """A line to the words of its block, and a dwell."""
    dut = GCodePlanner(line=LINE)
    operands = {Operand.TARGET: 200_000, Operand.TARGET + 1: -7, Operand.FEED: 10_000_000,
                Operand.DWELL: 1500}
    words = {}

    async def interpreter(ctx):
        while True:
            ctx.set(dut.operand, operands.get(ctx.get(dut.operand_address), 0))
            await ctx.tick()

    async def queue(ctx):
        ctx.set(dut.words.ready, 1)
        while True:
            if ctx.get(dut.words.valid):
                word = ctx.get(dut.words.payload)
                words[word.address] = word.data
            await ctx.tick()

    async def act(ctx, kind):
        words.clear()
        ctx.set(dut.actions.payload, GCodeAction.const({"kind": kind}))
        ctx.set(dut.actions.valid, 1)
        await run.until(ctx, dut.actions, ready=1, within=4000)
        await ctx.tick()
        ctx.set(dut.actions.valid, 0)
        await ctx.tick()

    async def test(ctx):
        ctx.set(dut.room, 1)
        for each in dut.feed_override, dut.rapid_override:
            ctx.set(each, 100)
        await act(ctx, GCodeActionKind.LINE)
        block = line(model(), (200_000, -7, 0), 10_000_000)
        run.expect("words", {address: word for address, word in words.items()
                             if address != BlockWord.EXTRA}, block_words(block, 10_000_000))
        await act(ctx, GCodeActionKind.DWELL)
        run.expect("kind", BlockHeader.from_bits(words[0]).kind, BlockKind.DWELL)
        run.expect("time", words[BlockWord.EXTRA], 1500)
        run.see(ctx, dut, fault=0)

    run.simulate(dut, test, interpreter, queue)
    return "the block of a line is that of the model, and that of a dwell has its time"


@bench
def g_code_homing(run: Run) -> str:
    """An axis after the other to its switch and away."""
    dut = GCodeHoming()
    lines = []

    async def planner(ctx):
        while True:
            kind, axis = ctx.get(dut.request.kind), ctx.get(dut.request.axis)
            seeks = ctx.get(dut.request.thousandths) != 1000
            if kind != HomingRequest.NONE:
                ctx.set(dut.homed, 1)
                await ctx.tick()
                ctx.set(dut.homed, 0)
            if kind == HomingRequest.MOVE:
                lines.append(axis)
                ctx.set(dut.moving, 1)
                await ctx.tick().repeat(50)
                ctx.set(dut.switches, seeks << axis)
                await ctx.tick().repeat(5)
                ctx.set(dut.moving, 0)
            await ctx.tick()

    async def test(ctx):
        ctx.set(dut.standing, 1)
        ctx.set(dut.allowed, 1)
        ctx.set(dut.only, 3)
        ctx.set(dut.start, 1)
        await ctx.tick()
        ctx.set(dut.start, 0)
        await run.until(ctx, dut, done=1, within=2000)
        run.expect("lines", lines, [2] * 4 + [0] * 4 + [1] * 4)
        await ctx.tick()
        run.see(ctx, dut, active=0, fault=0)

    run.simulate(dut, test, planner)
    return "Z, X and Y are homed, by four lines each"


@bench
def g_code_probing(run: Run) -> str:
    """A line until the probe touches, one where it does already, one checked."""
    dut = GCodeProbing()
    did, kept = [], []

    async def act(ctx, kind):
        ctx.set(dut.actions.payload, GCodeAction.const({
            "kind": kind, "modes": {"motion": GCodeMotion.PROBE_TOWARD}}))
        ctx.set(dut.actions.valid, 1)
        await run.until(ctx, dut.actions, ready=1)
        await ctx.tick()
        ctx.set(dut.actions.valid, 0)

    async def watch(ctx):
        while True:
            listing = ctx.get(dut.listing)
            if ctx.get(dut.latch):
                kept.append(ctx.get(dut.contact))
            did.extend(name for name in ("restart", "listing")
                       if ctx.get(getattr(dut, name)))
            await ctx.tick()
            ctx.set(dut.listed, listing)

    async def test(ctx):
        for pin in dut.idle, dut.standing, dut.passed.ready:
            ctx.set(pin, 1)
        await act(ctx, GCodeActionKind.PROBE)
        for pin in dut.idle, dut.standing:
            ctx.set(pin, 0)
        await ctx.tick().repeat(10)
        ctx.set(dut.contact, 1)
        await ctx.tick()
        run.see(ctx, dut, brake=1)
        await ctx.tick().repeat(5)
        for pin in dut.idle, dut.standing:
            ctx.set(pin, 1)
        await act(ctx, GCodeActionKind.PROBED)
        run.expect("the probe as it was kept", kept[-2:], [0, 1])
        run.expect("what it did", did, ["restart", "restart", "listing"])
        run.see(ctx, dut, touched=1, active=0)
        did.clear()
        await act(ctx, GCodeActionKind.PROBE)
        await act(ctx, GCodeActionKind.PROBED)
        run.expect("what it did", did, ["restart"])
        run.see(ctx, dut, touched=0, fault=0)
        did.clear()
        ctx.set(dut.checking, 1)
        await act(ctx, GCodeActionKind.PROBE)
        await act(ctx, GCodeActionKind.PROBED)
        run.expect("what it did while lines are checked", did, [])
        run.see(ctx, dut, active=0, fault=0)

    run.simulate(dut, test, watch)
    return ("kept where it touched, and begun there and where it stands; then nothing moves, nor "
            "in check mode")


@bench
def accessory_restart(run: Run) -> str:
    """A door opens, closes, and opens again while the spindle gets its speed."""
    dut = AccessoryRestart(spindle_log2=2, coolant_log2=1)

    async def test(ctx):
        for pin in dut.beat, dut.spindle, dut.coolant, dut.off:
            ctx.set(pin, 1)
        await ctx.tick()
        run.see(ctx, dut, spindle_off=1, coolant_off=1)
        for clocks in 2, 10:
            ctx.set(dut.off, 1)
            await ctx.tick()
            run.see(ctx, dut, spindle_off=1, coolant_off=1)
            ctx.set(dut.off, 0)
            ctx.set(dut.restart, 1)
            await ctx.tick().repeat(clocks)
            run.see(ctx, dut, spindle_off=0, coolant_off=int(clocks == 2))
        run.see(ctx, dut, restarted=1)
        ctx.set(dut.restart, 0)
        await ctx.tick()

    run.simulate(dut, test)
    return "both are off; the spindle starts twice, the coolant once, 5 clocks later"


@bench
def overrides(run: Run) -> str:
    """Commands of all overrides, and a restore."""
    dut = Overrides()

    async def command(ctx, code, times=1):
        for _ in range(times):
            ctx.set(dut.code, code)
            ctx.set(dut.command, 1)
            await ctx.tick()
            ctx.set(dut.command, 0)
            await ctx.tick()

    async def test(ctx):
        run.see(ctx, dut, feed=100, rapid=100, spindle=100)
        await command(ctx, RealtimeCode.FEED_PLUS_10, 12)
        run.see(ctx, dut, feed=200)
        await command(ctx, RealtimeCode.FEED_MINUS_1)
        await command(ctx, RealtimeCode.SPINDLE_MINUS_10, 3)
        await command(ctx, RealtimeCode.SPINDLE_PLUS_1, 2)
        await command(ctx, RealtimeCode.RAPID_QUARTER)
        run.see(ctx, dut, feed=199, rapid=25, spindle=72)
        ctx.set(dut.program, {"clockwise": 1, "flood": 1})
        for pin in dut.standing, dut.held, dut.switches:
            ctx.set(pin, 1)
        for code in RealtimeCode.SPINDLE_STOP, RealtimeCode.FLOOD, RealtimeCode.MIST:
            await command(ctx, code)
        on = ctx.get(dut.outputs)
        run.expect("outputs", [on.clockwise, on.flood, on.mist], [0, 0, 1])
        ctx.set(dut.standing, 0)
        await ctx.tick()
        run.expect("behind an open door", ctx.get(dut.outputs).clockwise, 0)
        ctx.set(dut.held, 0)
        ctx.set(dut.restore, 1)
        await ctx.tick()
        ctx.set(dut.restore, 0)
        run.see(ctx, dut, feed=100, rapid=100, spindle=100, changed=1)
        run.expect("spindle", ctx.get(dut.outputs).clockwise, 1)
        await ctx.tick()

    run.simulate(dut, test)
    return "199, 25 and 72 %, a spindle that is off while it holds, and coolant by hand"


@bench
def nominal_speed(run: Run) -> str:
    """Two blocks, and an override that changes in the second."""
    dut = NominalSpeed()
    within = dut.speed_bits + 16

    async def load(ctx, feed, fastest, override):
        for load, word in (1, fastest), (2, -(-256 * feed // 100)):
            ctx.set(dut.load, load)
            ctx.set(dut.word, word)
            await ctx.tick()
        ctx.set(dut.load, 0)
        ctx.set(dut.override, override)
        await run.until(ctx, dut, ready=1, within=within)

    async def take(ctx):
        ctx.set(dut.take, 1)
        await ctx.tick()
        ctx.set(dut.take, 0)

    async def test(ctx):
        ctx.set(dut.feed, 150)
        ctx.set(dut.rapid, 25)
        await load(ctx, 20_000_000, 25_000_000, OverrideKind.FEED)
        await take(ctx)
        run.see(ctx, dut, nominal=25_000_000**2)
        await load(ctx, 40_000_000, 40_000_000, OverrideKind.RAPID)
        run.see(ctx, dut, nominal=25_000_000**2)
        await take(ctx)
        run.see(ctx, dut, nominal=10_000_000**2)
        ctx.set(dut.rapid, 50)
        await ctx.tick().repeat(3 * (dut.speed_bits + 14))
        run.see(ctx, dut, nominal=20_000_000**2)

    run.simulate(dut, test)
    return "a limit of 25 mm/s, then a quarter and a half of 40 mm/s"
