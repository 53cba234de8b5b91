"""Bench of the states of a G-code machine."""

import random

from fresa.motion import AlarmCode, GCodeControl
from fresa.protocol import GCodeState, RealtimeCode

from ..bench import Run, bench, scoreboard
from ..models.gcode_control import ControlModel, control_inputs

CLOCKS = 4000


@bench
def g_code_control(run: Run) -> str:
    """A feed hold, a hard limit, its reset and unlock; then whatever may come."""
    dut = GCodeControl()

    async def pulse(ctx, port, value=1):
        ctx.set(port, value)
        await ctx.tick()
        ctx.set(port, 0)

    async def command(ctx, code):  # which counts in the next clock
        ctx.set(dut.code, code.value)
        await pulse(ctx, dut.command)
        await ctx.tick()

    async def test(ctx):
        for pin in dut.standing, dut.restarted, dut.messages.ready, dut.hard:
            ctx.set(pin, 1)
        await ctx.tick()
        run.see(ctx, dut, state=GCodeState.IDLE.value, hold=0)
        ctx.set(dut.moving, 1)
        await ctx.tick()
        run.see(ctx, dut, state=GCodeState.RUN.value)
        ctx.set(dut.standing, 0)
        await command(ctx, RealtimeCode.HOLD)
        run.see(ctx, dut, state=GCodeState.HOLD.value, substate=1, hold=1)
        await command(ctx, RealtimeCode.RESUME)
        run.see(ctx, dut, state=GCodeState.HOLD.value, hold=1)
        ctx.set(dut.standing, 1)
        await ctx.tick()
        run.see(ctx, dut, state=GCodeState.HOLD.value, substate=0)
        await command(ctx, RealtimeCode.RESUME)
        await ctx.tick()
        run.see(ctx, dut, state=GCodeState.RUN.value, hold=0)
        ctx.set(dut.standing, 0)
        await ctx.tick()
        run.see(ctx, dut, enable=1, stop=0)

        ctx.set(dut.limits, 0b001)
        await ctx.tick()
        run.see(ctx, dut, state=GCodeState.ALARM.value, stop=1, hold=1)
        run.expect("alarm", ctx.get(dut.alarms.payload), AlarmCode.HARD_LIMIT.value)
        ctx.set(dut.alarms.ready, 1)
        await pulse(ctx, dut.unlock)
        run.see(ctx, dut, state=GCodeState.ALARM.value, stop=1)
        await command(ctx, RealtimeCode.RESET)
        run.see(ctx, dut, reset=1, stop=1)
        ctx.set(dut.moving, 0)
        ctx.set(dut.standing, 1)
        await ctx.tick().repeat(2)
        run.see(ctx, dut, state=GCodeState.ALARM.value, reset=0, stop=0, hold=1)
        await pulse(ctx, dut.unlock)
        run.see(ctx, dut, state=GCodeState.IDLE.value, hold=0)
        await ctx.tick().repeat(4)

        await scoreboard(run, ctx, dut, ControlModel(), control_inputs(random.Random(1), CLOCKS))

    run.simulate(dut, test)
    return ("held in the next clock, resumed once it stood; stopped by a limit in the next clock, "
            f"and until a reset; then as its model in {CLOCKS} clocks")
