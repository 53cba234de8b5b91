"""Amaranth's own simulator: always there, slow, and the waveforms show states by name.

The clock is toggled by a testbench, which is as fast as `Simulator.add_clock` and costs no advance
of the timeline. It changes while all else is settled, and one design has one clock, so no flip-flop
can see another's new value. The testbench waits for orders, each a coroutine, and does one an
advance.
"""

from collections.abc import Awaitable, Callable, Mapping, Sequence
from contextlib import ExitStack
from os import PathLike, fspath
from typing import Any

import numpy as np
from amaranth import Elaboratable, Module, Signal, Value
from amaranth.sim import Simulator
from numpy.typing import NDArray

from ..design import Design
from .base import PERIOD, Engine, EngineError, Rows

__all__ = ["AmaranthEngine"]

HALF = PERIOD * 1e-9 / 2


class AmaranthEngine(Engine):
    """Runs a design on Amaranth's simulator. See `Engine`."""

    name = "amaranth"

    def __init__(self, design: Design, *, vcd: str | PathLike[str] | None = None) -> None:
        super().__init__(design, vcd=vcd)
        self._pins = {name: _bits(port) for name, port in design.inputs.items()}
        self._pads = {name: _bits(port) for name, port in design.outputs.items()}
        self._order: Callable[[Any], Awaitable[None]] | None = None
        self._files = ExitStack()
        top, traces = (design.top, []) if vcd is None else _named_ports(design)
        self._sim = Simulator(top)
        if vcd is not None:
            writer = self._sim.write_vcd(fspath(vcd), traces=traces, fs_per_delta=0)
            try:
                self._files.enter_context(writer)
            except OSError as error:
                raise EngineError(f"Waveform {vcd} cannot be written") from error
        self._sim.add_testbench(self._serve)
        self._set(dict.fromkeys(self._pins, 0))

    @classmethod
    def missing(cls) -> str | None:
        return None

    def _close(self) -> None:
        self._files.close()

    async def _serve(self, ctx) -> None:
        while True:
            if self._order is not None:
                await self._order(ctx)
                self._order = None
            await ctx.delay(0)

    def _do(self, order: Callable[[Any], Awaitable[None]]) -> None:
        self._order = order
        while self._order is not None:
            self._sim.advance()

    async def _edge(self, ctx) -> None:
        if self.vcd is not None:
            await ctx.delay(HALF)
        ctx.set(self.design.clk, 1)
        if self.vcd is not None:
            await ctx.delay(HALF)
        ctx.set(self.design.clk, 0)

    def _set(self, values: Mapping[str, int]) -> None:
        async def order(ctx):
            for name, value in values.items():
                ctx.set(self._pins[name], value)

        self._do(order)

    def _get(self, names: Sequence[str]) -> tuple[int, ...]:
        read: list[int] = []

        async def order(ctx):
            read.extend(ctx.get(self._pads[name]) for name in names)

        self._do(order)
        return tuple(read)

    def _run(
        self, clocks: int, watch: Sequence[str], last: Sequence[int], until: Mapping[str, int]
    ) -> Rows:
        pads = [self._pads[name] for name in watch]
        stops = [(self._pads[name], value) for name, value in until.items()]
        clock: list[int] = []
        values: list[list[int]] = []
        made = 0

        async def order(ctx):
            nonlocal made
            before = list(last)
            while made < clocks:
                await self._edge(ctx)
                made += 1
                now = [ctx.get(pad) for pad in pads]
                if now != before:
                    clock.append(made)
                    values.append(now)
                    before = now
                if any(ctx.get(pad) == value for pad, value in stops):
                    break

        self._do(order)
        rows = np.array(values, np.uint64).reshape(len(clock), len(watch))
        return Rows(made, np.array(clock, np.int64), np.ascontiguousarray(rows.T))

    def _play(
        self, stimulus: Mapping[str, NDArray[np.uint64]], rows: int, outputs: Sequence[str]
    ) -> NDArray[np.uint64]:
        pads = [self._pads[name] for name in outputs]
        columns = [(self._pins[name], values.tolist()) for name, values in stimulus.items()]
        sampled = np.empty((len(pads), rows), np.uint64)

        async def order(ctx):
            for row in range(rows):
                for pin, values in columns:
                    if row == 0 or values[row] != values[row - 1]:
                        ctx.set(pin, values[row])
                sampled[:, row] = [ctx.get(pad) for pad in pads]
                await self._edge(ctx)

        self._do(order)
        return sampled


def _named_ports(design: Design) -> tuple[Elaboratable, list[Signal]]:
    """Put beside the design a signal for each port, named as the design names the port."""
    m = Module()
    m.submodules[design.name] = design.top
    traces = []
    for name, port in {"clk": design.clk, **design.inputs, **design.outputs}.items():
        traces.append(shown := Signal(len(Value.cast(port)), name=name))
        m.d.comb += shown.eq(port)
    return m, traces


def _bits(port: Signal) -> Value:
    value = Value.cast(port)
    return value.as_unsigned() if value.shape().signed else value
