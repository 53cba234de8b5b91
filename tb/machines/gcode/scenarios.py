"""Scenarios of `gcode`: a session on its line."""


from ...bench import Run, bench
from ...scoreboard import monitor
from ...uart import encode
from . import MACHINE

GREETING = b"Grbl 1.1h ['$' for help]\r\n"
SESSION = [
    (b"G1 X0.05 Y-0.025 F9000\n", b"ok\r\n", (4, -2, 0)),
    (b"G91 X-0.0125\r\n", b"ok\r\n", (3, -2, 0)),
    (b"g0z0.1(up)\n", b"ok\r\n", (3, -2, 8)),
    (b"X1 X2\n", b"error:25\r\n", (3, -2, 8)),
    (b"G90 G1 F0 X9\n", b"error:22\r\n", (3, -2, 8)),
    (b"G90 G1 F9000 X0 Y0 Z0 M8\n", b"ok\r\n", (0, 0, 0)),
]


@bench
def gcode(run: Run) -> str:
    """Lines that move, lines that are refused, a report, and a limit switch."""
    dut = MACHINE.make(**MACHINE.bench_options)
    settings = dut.settings
    bit = settings.bit
    received, position, high = bytearray(), [0, 0, 0], [0]

    async def count(ctx):
        while True:
            step = ctx.get(dut.step)
            for axis in range(3):
                if (step & ~high[0]) >> axis & 1:
                    position[axis] += 1 if ctx.get(dut.direction) >> axis & 1 else -1
            high[0] = step
            await ctx.tick()

    async def send(ctx, text):
        for level in encode(text, bit):
            ctx.set(dut.rx, level)
            await ctx.tick()

    async def receive(ctx, text):
        for _ in range((len(text) + 40) * 10 * bit):
            if len(received) >= len(text):
                break
            await ctx.tick()
        run.expect("received", bytes(received), text)
        received.clear()

    async def test(ctx):
        ctx.set(dut.rx, 1)
        await receive(ctx, GREETING)
        for text, answer, end in SESSION:
            await send(ctx, text)
            await receive(ctx, answer)
            await run.until(ctx, dut, moving=0, within=40_000)
            run.expect("position", tuple(position), end)
        run.see(ctx, dut, flood=1, spindle=0, enable=1, alarm=0)
        await send(ctx, b"?")
        await receive(ctx, b"<Idle|MPos:0.000,0.000,0.000|Bf:63,128|FS:0,0|WCO:0.000,0.000,0.000>"
                           b"\r\n")
        await send(ctx, b"G0 X5\n")
        await receive(ctx, b"ok\r\n")
        await run.until(ctx, dut, moving=1)
        ctx.set(dut.limits, 1)
        await run.until(ctx, dut, alarm=1)
        ctx.set(dut.limits, 0)
        at = tuple(position)
        await receive(ctx, b"ALARM:1\r\n[MSG:Reset to continue]\r\n")
        run.expect("position", abs(position[0] - at[0]) <= 1, True)
        await send(ctx, b"\x18")
        await receive(ctx, GREETING + b"[MSG:'$H'|'$X' to unlock]\r\n")
        await send(ctx, b"G0 X0\n")
        await receive(ctx, b"error:9\r\n")
        await send(ctx, b"$X\nG0 X0\n")
        await receive(ctx, b"[MSG:Caution: Unlocked]\r\nok\r\nok\r\n")
        await run.until(ctx, dut, moving=0, within=40_000)
        run.expect("position", tuple(position), (0, 0, 0))
        run.see(ctx, dut, fault=0)

    run.simulate(dut, test, count, monitor(run, dut.tx, bit, received), deadline=400_000)
    return (f"{len(SESSION)} lines, each answered once, end where they say; a limit switch stopped "
            "a sixth, and after a reset the place was known")


SCENARIOS = [gcode]
