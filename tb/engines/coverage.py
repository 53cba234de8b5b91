"""Engine for code coverage: lines, branches and toggles of a design, counted by Verilator."""

import ctypes
import re
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from os import PathLike, fsencode
from pathlib import Path

from ..design import Design
from ..yosys import YOSYS
from . import source
from .cache import call
from .verilator import VerilatorEngine

__all__ = ["CoverageEngine", "NamedCoverageEngine", "Point"]

#: Keeps branches of the gateware as branches of the Verilog.
SCRIPT = ("read_rtlil design.il; proc -nomux -norom; memory_collect; "
          "write_verilog -norename design.v")

#: Yosys adds this: a register that starts each process once.
_TRIGGER = "verilog_backend.cc"

#: Escapes of Verilator for characters that names of C++ cannot have.
_ESCAPED = re.compile("__0([0-9A-F]{2})")

#: Covered by every run: the first value of a register, and where a process begins.
_ALWAYS = re.compile(r"(reg|always) .*")

#: A signal to which Amaranth or Yosys has given a name, or a number to tell it from another.
_UNNAMED = re.compile(r"^( *(?:wire|reg) (?:signed )?(?:\[\d+:\d+\] )?"
                      r"\\(?:\S*\$\d+|\$\w+)(?:\.\S+)? .*;)$", re.M)

_RECORD = re.compile(r"^C '(.*)' (\d+)$", re.M)


@dataclass(frozen=True)
class Point:
    """A coverage point: a line, a branch, or a bit of a signal.

    Attributes
    ----------
    kind : str
        ``line``, ``branch`` or ``toggle``.
    module : str
        Path of its module in the design, with dots.
    what : str
        The text of the line; direction and condition of a branch; the bit.
    count : int
        Number of times it was covered; of a bit, its changes.
    """

    kind: str
    module: str
    what: str
    count: int


class CoverageEngine(VerilatorEngine):
    """Runs a design and counts its coverage. See `Engine`.

    Its Verilog keeps every ``If`` and ``Switch`` of the gateware as a branch; in the Verilog for
    users they are multiplexers, which have no lines to cover.
    """

    name = "coverage"
    coverage = True

    def __init__(self, design: Design, *, vcd: str | PathLike[str] | None = None) -> None:
        super().__init__(design, vcd=vcd)
        self._text = self._sources(design)["design.v"].splitlines()
        self._at_start: list[Point] = []
        self._get(list(design.outputs))
        # Settling after power-up changes bits from their random initial values.
        self._at_start = self.points()

    @classmethod
    def _sources(cls, design: Design) -> dict[str, str]:
        with tempfile.TemporaryDirectory() as folder:
            Path(folder, "design.il").write_text(source.rtlil(design), encoding="utf-8")
            call([*YOSYS, "-q", "-p", SCRIPT], Path(folder))
            return {"design.v": Path(folder, "design.v").read_text(encoding="utf-8")}

    def points(self) -> list[Point]:
        """Return every point with its count since power-up."""
        self._open()
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "coverage.dat")
            self._lib.fresa_coverage(ctypes.c_void_p(self._handle), fsencode(path))
            points = list(_read(path.read_text(encoding="utf-8", errors="replace"), self._text))
        if not self._at_start:
            return points
        return [replace(point, count=point.count - before.count * (point.kind == "toggle"))
                for point, before in zip(points, self._at_start, strict=True)]


class NamedCoverageEngine(CoverageEngine):
    """Counts bits of those signals alone that have a name in the gateware. See `CoverageEngine`.

    In a large design the others are most of what there is to compile. So that this takes seconds
    and not minutes, the compiler does not optimise either, and the engine is several times slower.
    """

    level = "-O0"

    @classmethod
    def _sources(cls, design: Design) -> dict[str, str]:
        return {name: _UNNAMED.sub(r"/*verilator coverage_off*/\1/*verilator coverage_on*/", text)
                for name, text in super()._sources(design).items()}


def _read(records: str, text: list[str]) -> Iterator[Point]:
    """Parse Verilator's counts; leave out points that are always covered, and outer ports."""
    for match in _RECORD.finditer(records):
        # \x01 begins the name of a field, \x02 its value.
        fields = dict(field.split("\x02", 1) for field in match[1].split("\x01") if field)
        kind = fields["page"].partition("/")[0].removeprefix("v_")
        if fields["f"] != "design.v":
            continue
        line = text[int(fields["l"]) - 1].strip()
        module = fields["h"].partition(".")[2].partition(".")[2]
        if _TRIGGER in line or (kind == "line" and _ALWAYS.fullmatch(line)):
            continue
        if "." not in module:  # has only ports of its submodules
            continue
        name = _ESCAPED.sub(lambda code: chr(int(code[1], 16)), fields["o"])
        what = {"line": line, "branch": f"{name} of {line}"}.get(kind, name)
        yield Point(kind, module, what, int(match[2]))
