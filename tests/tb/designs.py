# amaranth: UnusedElaboratable=no
# pyright: reportGeneralTypeIssues=false, reportInvalidTypeForm=false, reportOperatorIssue=false

"""Designs that engines are compared on, and inputs for them."""

import random
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from amaranth import Cat, ClockDomain, Module, Mux, ResetSignal, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tb import boards
from tb.design import Design, Entity
from tb.engines import ENGINES

__all__ = ["ADDER", "adder", "clocked", "engines", "random_inputs", "scramble"]

ADDER = Path(__file__).with_name("adder.vhd")
MARKS = {
    "cxxrtl": ["compiler"], "verilator": ["verilator", "compiler"], "icarus": ["icarus"],
    "netlist": ["verilator", "compiler"], "netlist-icarus": ["icarus"], "ghdl": ["ghdl"],
}
"""What an engine needs, by the marks of tests."""


def engines(*names: str, long: Collection[str] = ()):
    """Parametrize a test with engines, of which some take long."""
    return pytest.mark.parametrize("kind", [
        pytest.param(ENGINES[name], id=name,
                     marks=[getattr(pytest.mark, mark) for mark in (
                         *MARKS.get(name, ()), *["long"] * (name in long))])
        for name in names])


class Adder(wiring.Component):
    """Add what is selected with every `go`; turn 64 bits all the time."""

    go: In(1)
    select: In(5)
    total: Out(16, init=3)
    odd: Out(1)
    wide: Out(64)

    def elaborate(self, platform) -> Module:
        m = Module()
        m.d.comb += self.odd.eq(self.go & self.total[0])
        m.d.sync += self.wide.eq(self.wide.rotate_left(3) + Cat(self.select, ~self.go))
        with m.If(self.go):
            m.d.sync += self.total.eq(self.total + self.select)
        return m


def adder(vhdl: Path = ADDER, **generics) -> Design:
    """Make the adder, with a description in VHDL."""
    entity = Entity("adder", (vhdl,), {"first": 3, "forwards": True, **generics},
                    {"select": "choice"})
    return replace(boards.component("adder", Adder()), vhdl=entity)


def clocked(clk, rst=None, **kwargs) -> Module:
    """Return a module with a clock domain of these signals."""
    m = Module()
    m.domains.sync = sync = ClockDomain(reset_less=rst is None, **kwargs)
    m.d.comb += sync.clk.eq(clk)
    if rst is not None:
        m.d.comb += ResetSignal().eq(rst)
    return m


def scramble(seed: int, *, whole: bool = False, wide: bool = False) -> Design:
    """Join registers, memories and gates at random.

    Parameters
    ----------
    seed : int
        Of the choice.
    whole : bool
        Memories have a word for every address: beyond their last word, Verilog reads X.
    wide : bool
        Gates have up to 150 bits, and none divides: all is what ``values.h`` has.
    """
    rng = random.Random(seed)
    clk, rst = Signal(), Signal()
    inputs = {f"i{n}": Signal(rng.randint(1, 40)) for n in range(4)}
    m = clocked(clk, rst)
    registers = [
        Signal(signed(rng.randint(2, 40)) if rng.random() < 0.3 else rng.randint(1, 40),
               name=f"r{n}", init=rng.getrandbits(1), reset_less=n % 5 == 0) for n in range(12)]
    values = [*inputs.values(), *registers]
    for n in range(2):
        m.submodules[f"m{n}"] = memory = Memory(
            shape=rng.randint(1, 70), init=[rng.getrandbits(1)],
            depth=1 << rng.randint(1, 5) if whole else rng.randint(2, 90))
        put, got = memory.write_port(), memory.read_port(domain=("comb", "sync")[n])
        m.d.comb += [put.addr.eq(rng.choice(registers)), got.addr.eq(rng.choice(registers)),
                     put.data.eq(Cat(*rng.sample(registers, 2))),
                     put.en.eq(rng.choice(registers)[0])]
        values.append(got.data)
    for n in range(10):
        a, b, c = rng.choices(values, k=3)
        gate = Signal(rng.randint(1, 150 if wide else 64), name=f"g{n}")
        rest = [a >> b[:5], a << b[:3], a == b, a.all(), b.xor(), -a, ~a, a[len(a) // 2:]] if wide \
            else [a // (b | 1)]
        m.d.comb += gate.eq(rng.choice(
            [a + b, a - b, a * b, a ^ ~b, Mux(c[0], a, b), a < b, *rest, Cat(a, b)]))
        values.append(gate)
    for register in registers:
        with m.If(rng.choice(values).any()):
            m.d.sync += register.eq(rng.choice(values) + rng.choice(values))
        with m.Elif(rng.choice(values)[0]):
            m.d.sync += register.eq(~rng.choice(values))
    outputs = {f"o{n}": value for n, value in enumerate(values[4:]) if len(value) <= 64}
    return Design(f"scramble{seed}", m, clk, {"rst": rst, **inputs}, outputs)


def random_inputs(design: Design, rows: int, seed: int) -> dict[str, np.ndarray]:
    """Return random inputs that hold for a while, with a reset now and then."""
    rng = np.random.default_rng(seed)
    held = np.cumsum(rng.random(rows) < 0.3)
    inputs = {name: rng.integers(0, 1 << len(port), rows + 1, np.uint64)[held]
              for name, port in design.inputs.items()}
    return inputs | {"rst": rng.random(rows) < 0.02}
