"""The parts of the positioner."""

import re

from fresa.drive import StepDirDriver
from fresa.motion import Axis, PointStore, Positioning
from fresa.protocol import LineEnd, PositionerCommands, Reporter
from fresa.protocol.positioner import Answer, Command

from ..bench import Run, bench, put
from ..scoreboard import ticks

BYTE = 11
"""Clocks of a byte on the line of the reporter's bench."""


@bench
def axis(run: Run) -> str:
    """An axis to a target and back, past its backlash, and up to a switch."""
    dut = Axis(driver=StepDirDriver(width=2, low=2, setup=2, hold=2), modulus=20, max_rate=2,
               max_backlash=3, settle=2, width=6)
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
        ctx.set(dut.target, target)
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
        ctx.set(dut.target, -5)
        await ctx.tick().repeat(30)
        run.see(ctx, dut, position=1, blocked=1, there=0)
        await go(ctx, 3, 3)
        run.see(ctx, dut, blocked=0, there=1)
        ctx.set(dut.place, -20)
        ctx.set(dut.load, 1)
        await ctx.tick()
        run.see(ctx, dut, position=-20)
        ctx.set(dut.load, 0)

        # At half the speed, to the clock
        ctx.set(dut.rate, 1)
        ctx.set(dut.target, -16)
        await run.until(ctx, dut, moved=1)
        for _ in range(3):
            await ctx.tick()
            for _ in range(19):
                run.see(ctx, dut, moved=0)
                await ctx.tick()
            run.see(ctx, dut, moved=1)
        # After a rest, however long, at once
        for rest in (41, 42, 43):
            await ctx.tick().repeat(rest)
            run.see(ctx, dut, there=1, moved=0)
            ctx.set(dut.target, ctx.get(dut.target) + 1)
            run.see(ctx, dut, there=0, moved=1)

        # The other switch lets go down, and then up again, once it has settled
        ctx.set(dut.low, 0)
        ctx.set(dut.high, 1)
        ctx.set(dut.backlash, 0)
        await ctx.tick().repeat(25)
        ctx.set(dut.target, -15)
        await ctx.tick().repeat(2)
        run.see(ctx, dut, moved=1, blocked=0)
        await ctx.tick().repeat(25)
        ctx.set(dut.target, -10)
        run.see(ctx, dut, moved=0, blocked=1)
        ctx.set(dut.high, 0)
        run.see(ctx, dut, moved=0, blocked=1)
        await ctx.tick().repeat(5)
        run.see(ctx, dut, blocked=0)
        await run.until(ctx, dut, position=-10)

    run.simulate(dut, test, observe)
    return ("to 4 with 2 pulses more for the backlash, back to 1; a switch held it there, and let "
            "it go to 3; that place was called -20; steps to the clock; the other switch let it go "
            "down only")


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
        ("GO 1", Answer.COMMAND, None), ("", Answer.COMMAND, None),
        ("POS 1 -2 3", none, Command.POS)]

    async def test(ctx):
        for number, (line, *_) in enumerate(lines, 1):
            for byte in line.encode():
                await put(ctx, dut.items, {"byte": byte})
            await put(ctx, dut.items, {"byte": LineEnd.GOOD.value, "end": 1})
            while len(offered) < number:
                await ctx.tick()
        run.expect("orders", offered, [(answer, command) for _, answer, command in lines])
        run.expect("numbers", [ctx.get(number) for number in dut.numbers], [1, -2, 3])
        run.see(ctx, dut, fault=0)

    run.simulate(dut, test, consumer)
    return "5 commands were understood and 6 other lines refused, each by its reason"


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
        run.expect("targets", [ctx.get(port) for port in dut.target], [5, -5, 9])
        await order(ctx, Command.MOV, motor=2)
        ctx.set(dut.there, 0b001)
        await ctx.tick()
        ctx.set(dut.there, 0)
        run.see(ctx, dut, run=0b110)
        ctx.set(dut.blocked, 0b100)
        await ctx.tick()
        ctx.set(dut.blocked, 0)
        run.see(ctx, dut, run=0b010, buzzer=1)
        await order(ctx, Command.ORIGIN)
        run.see(ctx, dut, run=0)
        await ctx.tick().repeat(3)
        run.expect("answers", answers,
                   [Answer.DISCONNECTED, Answer.EMPTY, Answer.LIMIT_MOT3])

    run.simulate(dut, test, listener)
    return ("MOV before CONNECT and GOTO to no point were refused; of three motors one arrived, "
            "one was stopped by a switch, and ORIGIN ended the third")


@bench
def reporter(run: Run) -> str:
    """Reports at their times, and answers in between that never delay one."""
    dut = Reporter(answers=(b"! A\n", b"! LONGER\n"), period=640, byte=BYTE)
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
            for port, value in zip(dut.position, place, strict=True):
                ctx.set(port, value)
            for number in range(10):
                await put(ctx, dut.answers, number % 2)
        await ticks(ctx, 600)
        lines = re.findall(rb"# POS [^:]* :\n|! A\n|! LONGER\n", bytes(text))
        run.expect("text", b"".join(lines), bytes(text[:len(b"".join(lines))]))
        run.expect("reports", len(begun) >= 3, True)
        run.expect("times", {b - a for a, b in zip(begun, begun[1:], strict=False)}, {640})
        run.expect("places", {line for line in lines if line[:1] == b"#"},
                   {"# POS {} {} {} :\n".format(*place).encode() for place in places})
        run.expect("answers", [line for line in lines if line[:1] == b"!"],
                   [b"! A\n", b"! LONGER\n"] * 15)
        run.see(ctx, dut, fault=0)

    run.simulate(dut, test, line)
    return "30 answers, each whole and in order, and between them reports exactly 640 clocks apart"
