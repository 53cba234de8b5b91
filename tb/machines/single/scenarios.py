"""Scenarios of `single`: a session on its line."""

from fresa.machines.single import PHASES

from ...bench import Run, bench
from ...scoreboard import monitor, scoreboard
from ...uart import encode
from . import MACHINE, make_model
from .parts import frame_interpreter

BIT = 16
HELLO, HELP = b"hi\r\n", b"help\r\n"
SESSION = [
    (b":x?\r", b"x:0\r\nok\r\n"), (b":v?\r", b"v:100\r\nok\r\n"), (b":d\r", HELP + b"ok\r\n"),
    (b":V5987\r", b"ok\r\n"), (b"noise :x9:x5\r", b"ok\r\n"), (b":X?\r", b"x:5\r\nok\r\n"),
    (b":e0\r", b"ok\r\n"), (b":x2\r", b"ok\r\n"), (b":x?\r", b"x:5\r\nok\r\n"),
    (b":e1\r", b"ok\r\n"), (b":x?\r", b"x:2\r\nok\r\n"), (b":y\r", b"err command\r\n"),
    (b":x12a\r", b"err number\r\n"), (b":x10000\r", b"err range\r\n"), (b":v0\r", b"err range\r\n"),
    (b":x" + b"0" * 126 + b"\r", b"err length\r\n"), (b":v?\r", b"v:5987\r\nok\r\n"),
    (b":v59987\r", b"ok\r\n"), (b":v?\r", b"v:59987\r\nok\r\n"),
]


@bench
def single(run: Run) -> str:
    """A session at a terminal: every command and error, power off and on, a reset."""
    options = MACHINE.bench_options
    dut, model = MACHINE.make(**options), make_model(**options)
    received = bytearray()

    async def receive(ctx, text):
        for _ in range((len(text) + 2) * 10 * BIT):
            if len(received) >= len(text):
                break
            await ctx.tick()
        run.expect("received", bytes(received), text)
        received.clear()

    async def test(ctx):
        ctx.set(dut.rx, 1)
        await receive(ctx, HELLO + HELP)
        for text, answer in SESSION:
            for level in encode(text, BIT):
                ctx.set(dut.rx, level)
                await ctx.tick()
            await receive(ctx, answer)
            if text == b":e0\r":
                run.see(ctx, dut, enable=0, coils=0, position=5)
        run.see(ctx, dut, position=2, moving=0, coils=PHASES[2], enable=1, fault=0)

        ctx.set(run.rst, 1)
        await ctx.tick()
        ctx.set(run.rst, 0)
        run.see(ctx, dut, position=0, coils=PHASES[2])
        await receive(ctx, HELLO + HELP)

    run.simulate(dut, test, scoreboard(run, dut, model), monitor(run, dut.tx, BIT, received),
                 inside=("commands.speed",),
                 deadline=80_000)
    return (f"{len(SESSION)} frames, each answered once: 5 half steps forward, 3 back when power "
            "came again; none that was wrong changed anything; a reset made no step; every clock "
            "was as the model has it")


SCENARIOS = [frame_interpreter, single]
