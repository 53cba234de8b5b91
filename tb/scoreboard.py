"""Runners for benches of a machine: scoreboard and serial monitor.

The scoreboard compares every output in every clock with that of its model; the monitor decodes its
serial output.
"""

from collections.abc import Callable, Coroutine
from dataclasses import fields
from itertools import count
from typing import Any

from amaranth import Value
from amaranth.lib import wiring

from .bench import Run
from .runners import Model
from .uart import Decoder

__all__ = ["monitor", "scoreboard", "ticks"]


def scoreboard(run: Run, dut: wiring.Component, model: Model) -> Callable[[Any], Coroutine]:
    """Return a runner that compares a machine with its model, from power-up on.

    It should come before runners that check outputs, so that a difference is reported where it
    appears first.

    Raises
    ------
    CheckFailed
        While it runs, if an output differs from the model.
    """
    async def compare(ctx) -> None:
        pins = model.Inputs()
        inputs = {field.name: run.rst if field.name == "rst" else getattr(dut, field.name)
                  for field in fields(pins)}
        while True:
            for name, signal in inputs.items():
                setattr(pins, name, ctx.get(signal))
            run.see(ctx, dut, **vars(model.outputs(pins)))
            model.edge(pins)
            await ctx.tick()

    return compare


def monitor(run: Run, line: Value, period: int, received: bytearray
            ) -> Callable[[Any], Coroutine]:
    """Return a runner that appends received bytes of a serial output to `received`.

    Each is complete one clock after the middle of its stop bit.

    Parameters
    ----------
    run : Run
        The run of the bench.
    line : Value
        The output.
    period : int
        Clocks per bit.
    received : bytearray
        Destination of the bytes.

    Raises
    ------
    CheckFailed
        While it runs, at a framing error.
    """
    async def decoded(ctx) -> None:
        decoder = Decoder(period)
        for clock in count():
            received.extend(decoder.feed(clock, ctx.get(line)))
            run.expect("framing errors", decoder.errors, 0)
            await ctx.tick()

    return decoded


async def ticks(ctx, count: int) -> None:
    """Wait for a number of clocks; unlike ``repeat``, this ends when another runner fails."""
    for _ in range(count):
        await ctx.tick()
