"""Scenarios of `positioner`: a session on its line."""

import re

from fresa.machines.positioner import ANSWERS
from fresa.protocol.positioner import Answer

from ...bench import Run, bench
from ...scoreboard import monitor, scoreboard, ticks
from ...uart import encode
from . import MACHINE, make_model
from .parts import positioner_commands, positioning, reporter


@bench
def positioner(run: Run) -> str:
    """A session on the line: points, jogging, a limit, errors, the origin."""
    bit = 16
    options = MACHINE.bench_options
    dut, model = MACHINE.make(**options), make_model(**options)
    received = bytearray()
    motors = [0, 0, 0]

    async def count(ctx):
        """Count what leaves the pins."""
        before = 0
        while True:
            step, direction = ctx.get(dut.step), ctx.get(dut.direction)
            for n in range(3):
                motors[n] += (step & ~before) >> n & 1 and (1 if direction >> n & 1 else -1)
            before = step
            await ctx.tick()

    async def send(ctx, *lines):
        for level in encode("".join(f"{line}\n" for line in lines).encode(), bit):
            ctx.set(dut.rx, level)
            await ctx.tick()
        await ticks(ctx, 60)

    async def reports(ctx, x, y, z):
        """Wait for a report that began after this."""
        seen = received.count(b"#")
        while received.count(b"#") == seen or not received.endswith(b":"):
            await ctx.tick()
        run.expect("report", bytes(received[received.rindex(b"#"):]).decode(),
                   f"# POS {x} {y} {z} :")

    async def test(ctx):
        ctx.set(dut.rx, 1)
        await ticks(ctx, 50)
        await send(ctx, "MOV MOT1 C", "CONNECT", "VEL MOT1 1500", "GOTO 4", "P 4 20 -6 0", "GOTO 4")
        run.see(ctx, dut, connected=1, enable=0b111)
        await ticks(ctx, 600)
        run.see(ctx, dut, moving=0)
        run.expect("pulses", motors, [23, -6, 0])  # 3 take up the backlash of X
        await reports(ctx, 20, -6, 0)
        await send(ctx, "MOV MOT3 C", "STOP MOT3", "VEL MOT3 0")
        jogged = motors[2]
        run.expect("jogged", jogged > 3, True)
        await reports(ctx, 20, -6, jogged)
        ctx.set(dut.limits, 0b010)
        await send(ctx, "MOV MOT2 C")
        run.expect("pulses", motors, [23, -6, jogged])
        run.see(ctx, dut, moving=0, buzzer=1)
        await send(ctx, "ACK 1", "ORIGIN", "HELLO", "STATE", "ACK 0")
        while not received.endswith(b"STATE 1 0 0 0 1500 200 200 0 1 0 0 0 0 2\n"):
            await ctx.tick()
        await reports(ctx, 0, 0, 0)
        far = "1431655765 -1717986919 -252645136"
        await send(ctx, f"P 7 {far}", f"POS {far}", "GOTO 7")
        run.see(ctx, dut, moving=0)  # it is there
        await send(ctx, "DISCONNECT")
        run.see(ctx, dut, connected=0, enable=0, fault=0)
        run.expect("pulses", motors, [23, -6, jogged])
        answers = re.findall(rb"! .*\n|ok\n", bytes(received))
        run.expect("answers", answers, [ANSWERS[answer.value] for answer in (
            Answer.DISCONNECTED, Answer.EMPTY, Answer.RANGE, Answer.LIMIT_MOT2, Answer.OK,
            Answer.OK, Answer.COMMAND)])

    run.simulate(dut, test, scoreboard(run, dut, model),
                 monitor(run, dut.tx, bit, received), count, deadline=120_000)
    return ("to a point, a jog, a limit that blocked, 4 lines refused, the origin; reports and "
            "pulses agreed all the while, and every clock was as the model has it")


SCENARIOS = [positioner_commands, positioning, reporter, positioner]
