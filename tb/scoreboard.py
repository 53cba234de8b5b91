"""Scoreboard: every output of every clock of a machine is compared with that of its model."""

from collections.abc import Callable, Coroutine
from dataclasses import fields
from typing import Any

from amaranth.lib import wiring

from .bench import Run
from .machine import Model

__all__ = ["scoreboard", "ticks"]


def scoreboard(run: Run, dut: wiring.Component, model: Model) -> Callable[[Any], Coroutine]:
    """Return a runner that compares a machine with its model, from power-up on.

    It should come before runners that look at outputs: what is wrong is then said where it shows
    first.

    Raises
    ------
    CheckFailed
        While it plays, if an output is not that of the model.
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


async def ticks(ctx, count: int) -> None:
    """Wait so many clocks; unlike ``repeat``, this can be left when another runner fails."""
    for _ in range(count):
        await ctx.tick()
