# amaranth: UnusedElaboratable=no
# pyright: reportGeneralTypeIssues=false, reportInvalidTypeForm=false

"""A mistake is in the design, whatever runs it, and nothing else in the design changes."""

import numpy as np
import pytest
from amaranth import Cat, Module, Mux, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from tb import boards
from tb.engines import AmaranthEngine
from tb.mistake import Mistake


class Part(wiring.Component):
    go: In(1)
    low: Out(4)
    high: Out(4, init=9)

    def elaborate(self, platform) -> Module:
        m = Module()
        sum = Signal(4)
        m.d.comb += sum.eq(self.low + 1)
        with m.If(self.go):
            m.d.sync += Cat(self.low, self.high).eq(Cat(sum, self.low))
        return m


class Pair(wiring.Component):
    go: In(1)
    a: Out(4)
    b: Out(4)

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.one, m.submodules.two = one, two = Part(), Part()
        m.d.comb += [one.go.eq(self.go), two.go.eq(self.go)]
        m.d.comb += [self.a.eq(one.low), self.b.eq(two.high)]
        return m


def run(*mistakes: Mistake, rst: int = 0) -> tuple[list[int], list[int]]:
    design = boards.component("pair", Pair())
    for mistake in mistakes:
        design = mistake.planted(design)
    with AmaranthEngine(design) as engine:
        seen = engine.apply({"go": np.array([1, 1, 0, 1, 1]), "rst": np.array([0, 0, rst, 0, 0])},
                            ["a", "b"])
    return seen["a"].tolist(), seen["b"].tolist()


RIGHT = [0, 1, 2, 2, 3], [9, 0, 1, 1, 2]


def test_none():
    assert run() == RIGHT


@pytest.mark.parametrize(("mistake", "a"), [
    (Mistake("one.sum", lambda right, _: right + 1), [0, 2, 4, 4, 6]),
    (Mistake("one.low", lambda right, _: right & 1), [0, 1, 0, 0, 1]),
    (Mistake("one.low", lambda right, at: Mux(at("two.go"), right, 7)), [0, 1, 2, 7, 8]),
    (Mistake("one.go", lambda right, at: ~right), [0, 0, 0, 1, 1]),
    (Mistake("a", lambda right, _: right ^ 8), [8, 9, 10, 10, 11]),
])
def test_in_one_signal(mistake, a):
    assert run(mistake) == (a, RIGHT[1])


def test_in_one_of_those_that_are_assigned_together():
    assert run(Mistake("two.high", lambda right, _: right ^ 8)) == (RIGHT[0], [9, 8, 9, 1, 10])


def test_in_what_reset_does():
    assert run(rst=1) == ([0, 1, 2, 0, 1], [9, 0, 1, 9, 0])
    kept = Mistake("two.high", reset_less=True)
    assert run(kept, rst=1) == ([0, 1, 2, 0, 1], [9, 0, 1, 1, 0])


def test_several():
    twice = Mistake("one.sum", lambda right, _: right + 1)
    assert run(twice, twice)[0] == [0, 3, 6, 6, 9]


@pytest.mark.parametrize(("path", "message"), [
    ("one.lwo", "no signal 'one.lwo' in this design; there are dut.one.low, "),
    ("low", "'low' matches dut.one.low, dut.two.low"),
    ("go", "nothing assigns 'go' in this design"),
])
def test_path_that_leads_nowhere(path, message):
    with pytest.raises(LookupError, match=message):
        run(Mistake(path, lambda right, _: right))
