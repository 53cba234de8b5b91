# amaranth: UnusedElaboratable=no
# pyright: reportGeneralTypeIssues=false, reportInvalidTypeForm=false, reportReturnType=false

"""Conditional evaluation by CXXRTL: each output of each clock is that of Amaranth's simulator."""

import random
import re

import numpy as np
import pytest
from amaranth import Cat, Module, Mux, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import In, Out

from tb.design import Design
from tb.engines import AmaranthEngine, CXXRTLEngine
from tb.engines.gating import gated, statements
from tests.tb.designs import clocked


class Part(wiring.Component):
    """Registers that change seldom, values of them, and perhaps a memory."""

    a: In(9)
    b: In(40)
    count: Out(9)
    wide: Out(40)
    now: Out(5)

    def __init__(self, seed: int) -> None:
        self.seed = seed
        super().__init__()

    def elaborate(self, platform) -> Module:
        m, rng = Module(), random.Random(self.seed)
        go = self.a[:3] == rng.randrange(8)
        halves = Signal(10)
        m.d.comb += [halves[:3].eq(self.a[2:5] ^ self.count[:3]), halves[3:].eq(self.b[5:12]),
                     self.now.eq(Mux(go, halves[2:7], self.wide[30:35]))]
        with m.If(go):
            m.d.sync += self.count.eq(self.count + rng.choice([1, 3, self.a]))
        with m.Elif(halves[4]):
            m.d.sync += self.wide.eq(Cat(self.b[1:], self.count[0] ^ halves[0]))
        if rng.random() < 0.3:
            m.submodules.memory = memory = Memory(
                shape=8, depth=8, init=[rng.randrange(256) for _ in range(8)])
            read = memory.read_port(domain=rng.choice(["comb", "sync"]))
            write, other = memory.write_port(), memory.write_port()
            m.d.comb += [read.addr.eq(self.a[1:4]), write.addr.eq(self.count[:3]),
                         write.data.eq(self.b[:8]), write.en.eq(go),
                         other.addr.eq(self.a[:3]), other.data.eq(self.count),
                         other.en.eq(self.b[3] & (other.addr != write.addr))]
            with m.If(self.a[0]):
                m.d.comb += self.now.eq(read.data[:5])
        return m


class Waiting(wiring.Component):
    """Registers that wait for numbers of a counter that nothing stops, of a state, and of a value.

    The `many` are so many numbers that a counter is not compared with each.
    """

    a: In(9)
    b: In(40)
    seen: Out(30)
    now: Out(4)

    def __init__(self, seed: int, many: int = 3) -> None:
        self.seed, self.many = seed, many
        super().__init__()

    def elaborate(self, platform) -> Module:
        m, rng = Module(), random.Random(self.seed)
        clocks, state, value = Signal(7), Signal(5), Signal(6)
        m.d.sync += clocks.eq(clocks + rng.choice([1, 3, 125]))
        m.d.comb += value.eq(self.b[3:] + clocks[:2])
        with m.If(self.a[0] | (clocks[:3] == rng.randrange(8))):
            m.d.sync += state.eq(Mux(self.b[1], state + 1, self.a))
        outcomes = [
            *(clocks == rng.randrange(128) for _ in range(self.many)), clocks[4], clocks[2:5] == 3,
            *(state == rng.choice([1, 2, rng.randrange(32)]) for _ in range(6)),
            rng.choice([state > 28, state < 3, state != 17, ~state.any(), state.bool()]),
            state >= rng.randrange(32), value == rng.randrange(64), value[1:4], value != 1]
        for bit, outcome in enumerate(outcomes):
            with m.If(outcome):
                m.d.sync += self.seen[bit % 30].eq(~self.seen[bit % 30])
        m.d.comb += self.now.eq(Cat(outcomes[0], outcomes[-1], outcomes[-4], outcomes[-5]))
        return m


def design(seed: int, parts: int) -> Design:
    """Make parts that are joined at random, also by values of the same clock."""
    rng, clk = random.Random(seed), Signal()
    inputs = {"p": Signal(9), "q": Signal(40), "rst": Signal()}
    m = clocked(clk, inputs["rst"])
    every = [Part(seed * 1000 + number) for number in range(parts)]

    def any_of(width: int, before: int) -> Value:
        later = [x for part in every for x in (part.count, part.wide)]
        now = [part.now for part in every[:before]]
        picked = rng.choice([inputs["p"], inputs["q"], *rng.choice([later, now or later])])
        return Cat(picked, rng.choice(later))[:width]

    for number, part in enumerate(every):
        m.submodules[f"part_{number}"] = part
        m.d.comb += [part.a.eq(any_of(9, number)), part.b.eq(any_of(40, number))]
    outputs = {f"o{n}": Signal(5) for n in range(4)}
    for output in outputs.values():
        m.d.comb += output.eq(any_of(40, parts).xor())
    outputs |= {f"now_{n}": every[-1 - n].now for n in range(3)}
    for number, many in enumerate([3] * (parts // 3) + [14]):
        m.submodules[f"waiting_{number}"] = part = Waiting(seed * 100 + number, many)
        m.d.comb += [part.a.eq(any_of(9, parts)), part.b.eq(any_of(40, parts))]
        outputs |= {f"seen_{number}": part.seen, f"waits_{number}": part.now}
    return Design("parts", m, clk, inputs, outputs)


def stimulus(seed: int, rows: int) -> dict[str, np.ndarray]:
    """Return inputs that stay for some clocks, most of them."""
    rng = np.random.default_rng(seed)

    def held(high: int) -> np.ndarray:
        levels, clocks = rng.integers(0, high, rows), rng.choice([1, 1, 2, 30], rows)
        return np.repeat(levels, clocks)[:rows].astype(np.uint64)

    return {"p": held(1 << 9), "q": held(1 << 40),
            "rst": (rng.random(rows) < 0.02).astype(np.uint64)}


@pytest.mark.compiler
@pytest.mark.usefixtures("libraries")
@pytest.mark.parametrize(("seed", "parts", "traceable"), [
    (1, 3, True), (2, 12, False),
    *(pytest.param(*larger, marks=pytest.mark.long) for larger in [  # compiled for long
        (1, 3, False), (2, 12, True), (3, 70, False), (3, 70, True)])])
def test_is_as_the_simulator(seed, parts, traceable):
    made = design(seed, parts)
    rows = stimulus(seed, 400)
    outputs = list(made.outputs)
    with AmaranthEngine(made) as simulator:
        expected = simulator.apply(rows, outputs)
    with CXXRTLEngine(made, traceable=traceable) as engine:
        seen = engine.apply(rows, outputs)
    for name in outputs:
        assert seen[name].tolist() == expected[name].tolist(), name
    assert max(len(set(expected[name].tolist())) for name in outputs) > 1
    assert all(len(set(expected[name].tolist())) > 10 for name in outputs if "seen" in name)


def enabled() -> Design:
    """Make a memory that is read when an input says so, at an address named as few are."""
    clk = Signal()
    inputs = {"index": Signal(4), "en": Signal(), "rst": Signal()}
    outputs = {"data": Signal(8), "thrice": Signal(8), "first": Signal()}
    m = clocked(clk, inputs["rst"])
    m.submodules.memory = memory = Memory(shape=8, depth=16, init=range(100, 116))
    read = memory.read_port()
    m.d.comb += [read.addr.eq(inputs["index"]), read.en.eq(inputs["en"]),
                 outputs["data"].eq(read.data), outputs["first"].eq(inputs["index"] == 1)]
    m.d.sync += outputs["thrice"].eq(inputs["index"] * 3)
    return Design("enabled", m, clk, inputs, outputs)


@pytest.mark.compiler
@pytest.mark.usefixtures("libraries")
@pytest.mark.parametrize("traceable", [False, True])
def test_inputs_change_more_than_once_in_a_clock(traceable):
    made, rng = enabled(), random.Random(1)
    outputs = list(made.outputs)
    seen = []
    with AmaranthEngine(made) as simulator, CXXRTLEngine(made, traceable=traceable) as engine:
        for _ in range(60):
            for _ in range(rng.choice([1, 1, 2, 3])):
                levels = {"index": rng.randrange(16), "en": rng.randrange(2)}
                simulator.set(**levels)
                engine.set(**levels)
                assert engine.get(*outputs) == simulator.get(*outputs)
            simulator.run(1)
            engine.run(1)
            seen.append(engine.get(*outputs))
            assert seen[-1] == simulator.get(*outputs)
    assert len(set(seen)) > 10


LOGIC = """\
\t// \\hdlname: top sum
\tp_top_2e_sum = add_uu<5>(p_top_2e_count.curr, p_step);
\tp_top_2e_part.slice<4,2>() = i_flatten_5c_top_2e__24_1.slice<2,0>().val();
\tauto tmp_0 = memory_index(p_top_2e_sum, 0, 16);
\tif(tmp_0.valid) {
\t\ti_auto_24_1 = memory_p_top_2e_rom[tmp_0.index];
\t} else {
\t\ti_auto_24_1 = value<6> {};
\t}
\tif (posedge_p_clk) {
\t\tp_top_2e_count.next = (p_rst ? value<5>{0u} : p_top_2e_sum);
\t}
\tif (posedge_p_clk) {
\t\tauto tmp_1 = memory_index(p_top_2e_count.curr, 0, 16);
\t\tif (tmp_1.valid) {
\t\t\tmemory_p_top_2e_ring.update(tmp_1.index, p_data, p_write.repeat<8>().val(), 0);
\t\t}
\t}
"""


def test_statements_say_what_they_read_and_change():
    total, part, rom, count, ring = statements(LOGIC)
    assert (total.values, total.reads) == ({"p_top_2e_sum"}, {"p_top_2e_count", "p_step"})
    assert (part.values, part.reads) == ({"p_top_2e_part"}, {"i_flatten_5c_top_2e__24_1"})
    assert (rom.values, rom.reads) == ({"i_auto_24_1"}, {"memory_p_top_2e_rom", "p_top_2e_sum"})
    assert (count.registers, count.reads) == ({"p_top_2e_count"}, {"p_rst", "p_top_2e_sum"})
    assert ring.memories == {"memory_p_top_2e_ring"}
    assert {"p_data", "p_write", "p_top_2e_count"} <= ring.reads
    assert [each.module for each in (total, part, rom)] == [("top",), ("top",), None]


def test_a_register_whose_next_value_is_read_cannot_be_gated():
    with pytest.raises(ValueError, match="next value"):
        statements("\tp_a.next = p_b.next;\n")


def test_statements_say_which_parts_they_read():
    (made,) = statements(
        "\tp_a = (eq_uu<1>(p_n.curr, value<2>{0x2u}) ? p_m.curr.slice<3,1>().val() : "
        "(logic_not<1>(p_k.slice<4>().val()) ? and_uu<3>(p_o, p_n.curr.slice<2,0>().val()) : "
        "(gt_uu<1>(p_o, value<3>{0x4u}) ? i_l.concat(p_m.curr.slice<0>()).val() : p_a)));\n")
    assert made.parts == {
        "p_n": {"eq_uu<1>(@, value<2>{0x2u})", "@.slice<2,0>().val()"}, "p_m": {"@"},
        "p_k": {"logic_not<1>(@.slice<4>().val())"}, "p_o": {"@"}, "i_l": {"@"}, "p_a": {"@"}}


def register(name: str, value: str) -> str:
    return f"\tif (posedge_p_clk) {{\n\t\tp_top_2e_{name}.next = {value};\n\t}}\n"


def gate(lines: str, inputs: str, **bits: int) -> tuple[list[str], str]:
    """Return the registers that each segment changes, and all that is written."""
    bits = dict.fromkeys(re.findall(r"\bp_\w+", lines), 8) | bits
    _, segments, others = gated("p_top", "posedge_p_clk", lines, inputs.split(), [], bits)
    changed = ("".join(re.findall(r"\bp_top_2e_(\w)\.next = ", each)) for each in segments)
    return [each for each in changed if each], "".join([*segments, others])


def test_what_has_little_in_common_is_evaluated_apart():
    segments, text = gate(
        register("a", "p_x.concat(p_y)") + register("b", "p_u.concat(p_v)")
        + register("c", "p_x.concat(p_y)"), "p_x p_y p_u p_v")
    assert segments == ["ac", "b"]
    assert "if (p_x != was_p_x) { was_p_x = p_x; dirty[0] |= 0x1ull; }" in text
    assert "if (p_v != was_p_v) { was_p_v = p_v; dirty[0] |= 0x2ull; }" in text


def test_what_waits_for_a_number_is_evaluated_when_it_comes():
    segments, text = gate(
        register("n", "(p_x ? p_y : p_z)")
        + register("a", "(eq_uu<1>(p_top_2e_n.curr, value<3>{0x5u}) ? p_u : p_v)"), "p_x p_u")
    assert segments == ["n", "a"]
    assert ("if (eq_uu<1>(p_top_2e_n.curr, value<3>{0x5u}) != "
            "eq_uu<1>(p_top_2e_n.next, value<3>{0x5u})) { dirty[0] |= 0x2ull; }") in text


def test_what_waits_for_states_is_looked_up():
    reads = [f"{compared}_uu<1>(p_top_2e_n.curr, value<2>{{0x{number}u}})" for compared, number in
             [("eq", 1), ("eq", 2), ("gt", 2), ("ne", 1)]]
    lines = register("n", "p_x") + "".join(
        register(name, f"({each} ? p_{name} : p_z{name})") for name, each in zip("abcd", reads,
                                                                                strict=True))
    segments, text = gate(lines, "p_x", p_top_2e_n=3)
    assert segments == ["n", "a", "b", "c", "d"]
    # Flags 1 to 4, of eight states: 0 to 2 are as seldom as can be of what is above 2.
    assert ("flags[] = {0x8, 0x1a, 0xc, 0x0, 0x0, 0x0, 0x0, 0x0}; "
            "dirty[0] |= flags[p_top_2e_n.curr.data[0]] | flags[p_top_2e_n.next.data[0]];") in text


def test_counters_that_nothing_stops_are_evaluated_together():
    def counter(name: str) -> str:
        return register(name, f"(p_rst ? value<8>{{0u}} : add_uu<9>(p_top_2e_{name}.curr, "
                              "value<1>{0x1u}).slice<7,0>().val())")

    stops = register("s", "(p_rst ? value<8>{0u} : (p_go ? add_uu<8>(p_top_2e_s.curr, p_x) : "
                          "p_top_2e_s.curr))")
    segments, text = gate(counter("a") + stops + counter("b"), "p_rst p_go p_x")
    assert segments == ["s", "ab"]
    assert len(re.findall(r"void p_top::take_\d+\(\)", text)) == 2
    assert ("p_top_2e_a.curr != p_top_2e_a.next || p_top_2e_b.curr != p_top_2e_b.next"
            in text)
