# amaranth: UnusedElaboratable=no
# pyright: reportGeneralTypeIssues=false, reportOperatorIssue=false, reportReturnType=false

"""Stretches of clocks that CXXRTL makes at once: what shows is what every single clock shows."""

import random

import numpy as np
import pytest
from amaranth import Array, Cat, Module, Mux, Signal, Value, signed, unsigned
from amaranth.lib.memory import Memory

from tb.design import Design
from tb.engines import CXXRTLEngine
from tests.tb.designs import clocked

pytestmark = [pytest.mark.compiler, pytest.mark.usefixtures("libraries")]


class Generator:
    """Random counters, what is computed of them, and outputs that it decides."""

    def __init__(self, seed: int) -> None:
        self.rng = random.Random(seed)
        self.counters = [
            Signal(self.rng.choice([unsigned, signed])(self.rng.choice([4, 9, 16, 20, 33, 64, 70])))
            for _ in range(self.rng.randint(2, 3))]

    def design(self) -> Design:
        rng = self.rng
        clk, go = Signal(), Signal(3)
        m = clocked(clk)
        for counter in self.counters:
            self._count(m, counter, go)
        outputs = {"table": self._table(m)}
        for n in range(3):
            outputs[f"o{n}"] = Signal(8)
            m.d.comb += outputs[f"o{n}"].eq(rng.choice([
                self.compared(), Cat(self.compared(), go), self.number().any() & self.compared(),
                Array([self.compared(), 1, 2, self.number().all()])[self.number()[-2:]],
                self.number()[-3:], self.number() >> rng.randrange(20)]))
        return Design("stretch", m, clk, {"go": go}, outputs)

    def _count(self, m: Module, counter: Signal, go: Signal) -> None:
        rng, width = self.rng, len(counter)
        step = rng.choice([1, 1, -1, -1, 3, -rng.randrange(1 << min(width, 12))])
        first, limit = (rng.randrange(1 << width - 1) for _ in range(2))
        m.d.sync += counter.eq(rng.choice([
            counter + step, Mux(counter == limit, first, counter + step),
            Mux(counter >= limit, counter - limit, counter + step),
            Mux(self.compared(), counter, counter + step)]))
        with m.If(go[rng.randrange(3)]):
            m.d.sync += counter.eq(rng.choice([first, self.number(), counter - go]))

    def _table(self, m: Module) -> Signal:
        rng, shown = self.rng, Signal(8)
        m.submodules.table = table = Memory(
            shape=8, depth=16, init=[rng.randrange(256) for _ in range(16)])
        read, write = table.read_port(domain="comb"), table.write_port()
        m.d.comb += [read.addr.eq(self.number()[-4:]), shown.eq(read.data),
                     write.addr.eq(self.number()[-4:]), write.data.eq(self.number()),
                     write.en.eq(self.number() == rng.randrange(64))]
        return shown

    def number(self) -> Value:
        value, rng = self.rng.choice(self.counters), self.rng
        low = rng.randrange(len(value))
        return rng.choice([
            lambda: value, lambda: value[low:rng.randint(low, len(value) - 1) + 1],
            lambda: Cat(value, rng.choice(self.counters)), lambda: value * rng.randrange(16),
            lambda: -value, lambda: ~value, lambda: value.as_signed() + low,
            lambda: value - rng.choice(self.counters), lambda: abs(value.as_signed()),
            lambda: value ^ low, lambda: Mux(self.compared(), value, self.number()),
            lambda: value << rng.randrange(4), lambda: value // 4])()

    def compared(self) -> Value:
        value, rng = Value.cast(self.number()), self.rng
        other = rng.choice([rng.randrange(1 << min(len(value), 12)), rng.choice(self.counters)])
        return rng.choice([value < other, value <= other, value > other, value >= other,
                           value == other, value != other])


@pytest.mark.parametrize("seed", [
    0, *(pytest.param(seed, marks=pytest.mark.long) for seed in range(1, 6))])
def test_stretches_show_what_single_clocks_show(seed):
    design = Generator(seed).design()
    rng = random.Random(seed)
    spans = [(rng.choice([0, 0, 0, rng.randrange(8)]), rng.choice([1, 20, 300, 5000]))
             for _ in range(60)]
    outputs = list(design.outputs)
    with (CXXRTLEngine(design, stretches=True) as engine,
          CXXRTLEngine(design) as single):
        for go, clocks in spans:
            engine.set(go=go)
            single.set(go=go)
            seen = engine.run(clocks, outputs)
            expected = single.run(clocks, outputs)
            assert seen.clock.tolist() == expected.clock.tolist()
            for name in outputs:
                assert seen[name].tolist() == expected[name].tolist()
        stimulus = {"go": np.repeat(*np.array(spans).T)}
    with (CXXRTLEngine(design, stretches=True) as engine,
          CXXRTLEngine(design) as single):
        seen, expected = (each.apply(stimulus, outputs) for each in (engine, single))
        for name in outputs:
            assert seen[name].tolist() == expected[name].tolist()


def test_a_long_timer_ends_at_its_clock():
    clk, go, done = Signal(), Signal(), Signal()
    left = Signal(37, init=1 << 36)
    m = clocked(clk)
    m.d.comb += done.eq(left == 5)
    with m.If(left != 0):
        m.d.sync += left.eq(left - 1)
    design = Design("timer", m, clk, {"go": go}, {"done": done})
    with CXXRTLEngine(design, stretches=True) as engine:
        changes = engine.run(1 << 37, ["done"], until={"done": 1})
        assert changes.clock.tolist() == [0, (1 << 36) - 5] and engine.clock == (1 << 36) - 5
        assert engine.run(10, ["done"]).clock.tolist() == [(1 << 36) - 4]
