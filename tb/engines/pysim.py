"""The engine Amaranth: its own simulator, always available and slow, with states by name.

The clock is toggled by a testbench, which is as fast as `Simulator.add_clock` and needs no advance
of the timeline. It changes while all else is settled, and a design has one clock, so no flip-flop
can see another's new value. The testbench waits for orders, each a coroutine, and executes one per
advance.
"""

from collections.abc import Awaitable, Callable, Mapping, Sequence
from contextlib import ExitStack
from io import TextIOWrapper
from os import PathLike, fspath
from typing import Any

import numpy as np
from amaranth import Elaboratable, Module, Signal, Value
from amaranth.sim import Simulator
from numpy.typing import NDArray

from ..design import Design
from .base import CUT_SHORT, PERIOD, Engine, EngineError, Rows

__all__ = ["AmaranthEngine"]

HALF = PERIOD * 1e-9 / 2

#: Time units of the simulator in a nanosecond.
FEMTO = 1_000_000


class AmaranthEngine(Engine):
    """Runs a design on Amaranth's simulator. See `Engine`."""

    name = "amaranth"
    can_trace = True

    def __init__(self, design: Design, *, vcd: str | PathLike[str] | None = None,
                 traceable: bool = False, stretches: bool = False) -> None:
        super().__init__(design, vcd=vcd, traceable=traceable, stretches=stretches)
        self._pins = {name: _bits(port) for name, port in design.inputs.items()}
        self._pads = {name: _bits(port) for name, port in design.outputs.items()}
        self._order: Callable[[Any], Awaitable[None]] | None = None
        self._file = ExitStack()
        self._timed = False
        top, self._traces = (
            _named_ports(design) if traceable or vcd is not None else (design.top, []))
        self._sim = Simulator(top)
        if vcd is not None:
            self._trace(fspath(vcd))
        self._sim.add_testbench(self._serve)
        self._set(dict.fromkeys(self._pins, 0))

    @classmethod
    def missing(cls) -> str | None:
        return None

    def _close(self) -> None:
        try:
            self._file.close()
        except OSError as error:
            raise EngineError(CUT_SHORT) from error

    def _trace(self, path: str | None) -> None:
        self._close()
        self._timed = False
        if path is None:
            return
        if self.clock > 0:
            self._do(self._catch_up)
        engine: Any = self._sim._engine
        try:
            file = self._file.enter_context(_LateFile(path, engine.now))
        except OSError as error:
            raise EngineError(f"Waveform {path} cannot be written") from error
        # The simulator itself refuses to begin later than at time 0; its parts do not.
        self._file.enter_context(engine.write_vcd(
            vcd_file=file, gtkw_file=None, traces=self._traces, fs_per_delta=0))
        self._timed = True

    async def _catch_up(self, ctx) -> None:
        """Advance the time that clocks took: without a waveform they take none."""
        engine: Any = self._sim._engine
        while left := self.clock * PERIOD * FEMTO - engine.now:
            # One second at a time: the simulator takes floats, and rounds them.
            await ctx.delay(min(left * 1e-15, 1.0))

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
        if self._timed:
            await ctx.delay(HALF)
        ctx.set(self.design.clk, 1)
        if self._timed:
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
        self, clocks: int, watch: Sequence[str], last: Sequence[int], until: Mapping[str, int],
        once: bool,
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
                    if once:
                        break
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


class _LateFile(TextIOWrapper):
    """A file for a waveform that begins at a later time, while its writer starts at 0."""

    def __init__(self, path: str, begin: int) -> None:
        super().__init__(open(path, "wb"), encoding="utf-8")
        self._begin: int | None = begin

    def write(self, text: str, /) -> int:
        if self._begin is not None and text == "#0\n":
            text, self._begin = f"#{self._begin}\n", None
        return super().write(text)


def _named_ports(design: Design) -> tuple[Elaboratable, list[Signal]]:
    """Add a signal for each port to the design, named as the design names the port."""
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
