"""Benches of the parts of `positioner`: its commands, what carries them out, and its reports."""

import re

from amaranth import signed
from amaranth.lib import data

from fresa.motion.positioner import Positioning
from fresa.protocol import LineEnd, Reporter
from fresa.protocol.positioner import Answer, Command, PositionerCommands

from ...bench import Run, bench, put
from ...scoreboard import ticks

BYTE = 11
"""Clocks of a byte on the line of the reporter's bench."""


@bench
def positioner_commands(run: Run) -> str:
    """Lines to orders, and what is wrong with those that are none."""
    dut = PositionerCommands(top_speed=1500)
    none, offered = Answer.NONE, []

    async def consumer(ctx):
        ctx.set(dut.orders.ready, 1)
        while True:
            if ctx.get(dut.orders.valid):
                order = ctx.get(dut.orders.payload)
                offered.append((order.answer, order.command if order.answer == none else None))
            await ctx.tick()

    lines = [
        ("MOV MOT1 C", none, Command.MOV), ("VEL MOT3 1500", none, Command.VEL),
        ("P 7 -5 0 99", none, Command.P), ("ORIGIN", none, Command.ORIGIN),
        ("VEL MOT3 1501", Answer.RANGE, None), ("GOTO 8", Answer.RANGE, None),
        ("MOV MOT4 C", Answer.ARGUMENT, None), ("STOP", Answer.ARGUMENT, None),
        ("GO 1", Answer.COMMAND, None), ("", Answer.COMMAND, None), ("ACK 2", Answer.RANGE, None),
        ("STATE", none, Command.STATE), ("POS 1 -2 4294967293", none, Command.POS)]

    async def test(ctx):
        for number, (line, *_) in enumerate(lines, 1):
            for byte in line.encode():
                await put(ctx, dut.items, {"byte": byte})
            await put(ctx, dut.items, {"byte": LineEnd.GOOD.value, "end": 1})
            while len(offered) < number:
                await ctx.tick()
        run.expect("orders", offered, [(answer, command) for _, answer, command in lines])
        run.expect("numbers", [ctx.get(number) for number in dut.numbers], [1, -2, -3])
        run.see(ctx, dut, fault=0)

    run.simulate(dut, test, consumer)
    return "6 commands were understood and 7 other lines refused, each by its reason"


@bench
def positioning(run: Run) -> str:
    """Orders obeyed and refused; movements that arrive, and that a switch ends."""
    dut = Positioning(top_speed=1500, waiting=4)
    answers = []

    async def listener(ctx):
        ctx.set(dut.answers.ready, 1)
        while True:
            if ctx.get(dut.answers.valid):
                answers.append(ctx.get(dut.answers.payload))
            await ctx.tick()

    async def order(ctx, command, numbers=(0, 0, 0), **fields):
        for port, value in zip(dut.numbers, numbers, strict=True):
            ctx.set(port, value)
        await put(ctx, dut.orders, {"command": command, **fields})

    async def test(ctx):
        await order(ctx, Command.MOV, motor=0, clockwise=1)
        run.see(ctx, dut, run=0, connected=0)
        await order(ctx, Command.CONNECT)
        await order(ctx, Command.GOTO, point=2)
        await order(ctx, Command.P, (5, -5, 9), point=2)
        await order(ctx, Command.GOTO, point=2)
        run.see(ctx, dut, run=0b111, connected=1)
        run.expect("targets", [~ctx.get(port) for port in dut.target_n], [5, -5, 9])
        await order(ctx, Command.MOV, motor=2)
        ctx.set(dut.in_position, 0b001)
        await ctx.tick()
        ctx.set(dut.in_position, 0)
        run.see(ctx, dut, run=0b110)
        ctx.set(dut.limit_hit, 0b100)
        await ctx.tick()
        ctx.set(dut.limit_hit, 0)
        run.see(ctx, dut, run=0b010, buzzer=1)
        await order(ctx, Command.ACK, (0, 0, 1))
        await order(ctx, Command.ORIGIN)
        run.see(ctx, dut, run=0)
        await order(ctx, Command.STATE)
        await order(ctx, Command.ACK, (0, 0, 0))
        await order(ctx, Command.ORIGIN)
        await ctx.tick().repeat(3)
        run.expect("answers", answers, [Answer.DISCONNECTED, Answer.EMPTY, Answer.LIMIT_MOT3,
                                        Answer.OK, Answer.OK, Answer.STATE])

    run.simulate(dut, test, listener)
    return ("MOV before CONNECT and GOTO to no point were refused; of three motors one arrived, "
            "one was stopped by a switch, and ORIGIN ended the third; ACK had it answered")


@bench
def reporter(run: Run) -> str:
    """Reports at their times, answers in between, a state in place of one."""
    axes = [f"position_{number}" for number in (1, 2, 3)]
    state = data.StructLayout({"on": 1, **dict.fromkeys(axes, signed(32)), "seconds": 31})
    dut = Reporter(state=state, answers=(b"! A\n", b"! LONGER\n"), period=800, byte=BYTE)
    places = [(5, -17, 2**31 - 1), (0, -2**31, 0x55555555),
              (-0x55555555, 0x2AAAAAAA, -0x2AAAAAAA)]
    begun, text = [], bytearray()

    async def line(ctx):
        """Take a byte every 11 clocks."""
        while True:
            ctx.set(dut.bytes.ready, 1)
            while not ctx.get(dut.bytes.valid):
                await ctx.tick()
            byte = ctx.get(dut.bytes.payload)
            begun.extend([run.clock] * (byte == ord("#")))
            text.append(byte)
            await ctx.tick()
            ctx.set(dut.bytes.ready, 0)
            await ticks(ctx, BYTE - 1)

    async def test(ctx):
        ctx.set(dut.enable, 1)
        for place in places:
            for name, value in zip(("on", *axes, "seconds"), (1, *place, 1234), strict=True):
                ctx.set(getattr(dut, name), value)
            for number in range(14):
                await put(ctx, dut.answers, number % 2)
        await put(ctx, dut.answers, 2)
        await ticks(ctx, 1400)
        lines = re.findall(rb"# POS [^:]* :|! A\n|! LONGER\n|STATE .*\n", bytes(text))
        run.expect("text", b"".join(lines), bytes(text[:len(b"".join(lines))]))
        run.expect("reports", len(begun) >= 3, True)
        run.expect("times", {b - a for a, b in zip(begun, begun[1:], strict=False)},
                   {800, 1600})  # the longer one with a state
        run.expect("places", sorted({line for line in lines if line[:1] == b"#"}),
                   sorted("# POS {} {} {} :".format(*place).encode() for place in places))
        run.expect("state", [line for line in lines if line[:1] == b"S"],
                   ["STATE 1 {} {} {} 1234\n".format(*places[-1]).encode()])
        run.expect("answers", [line for line in lines if line[:1] == b"!"],
                   [b"! A\n", b"! LONGER\n"] * 21)
        run.see(ctx, dut, fault=0)

    run.simulate(dut, test, line)
    return ("42 answers and a state, each whole and in order, and between them reports exactly "
            "800 clocks apart")
