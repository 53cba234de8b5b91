"""Which lines and which levels of a design a run has come by, as Verilator counts them."""

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

__all__ = ["CoverageEngine", "Point"]

#: Keeps what is a branch in the gateware a branch in the Verilog.
SCRIPT = ("read_rtlil design.il; proc -nomux -norom; memory_collect; "
          "write_verilog -norename design.v")

#: What Yosys adds: a register that starts each process once.
_TRIGGER = "verilog_backend.cc"

#: How Verilator writes what a name of C++ cannot have.
_ESCAPED = re.compile("__0([0-9A-F]{2})")

#: What every run comes by: the first value of a register, and where a process begins.
_ALWAYS = re.compile(r"(reg|always) .*")

_RECORD = re.compile(r"^C '(.*)' (\d+)$", re.M)


@dataclass(frozen=True)
class Point:
    """A line of a process, a branch of it, or a bit of a signal.

    Attributes
    ----------
    kind : str
        ``line``, ``branch`` or ``toggle``.
    module : str
        Path of its module in the design, with dots.
    what : str
        The text of the line; which way and the condition of a branch; the bit.
    count : int
        How often it was come by; of a bit, how often it changed.
    """

    kind: str
    module: str
    what: str
    count: int


class CoverageEngine(VerilatorEngine):
    """Runs a design and counts what it comes by. See `Engine`.

    It is given Verilog in which every ``If`` and ``Switch`` of the gateware is still a branch; in
    that which users get they are multiplexers, which have no lines to come by.
    """

    name = "coverage"
    coverage = True

    def __init__(self, design: Design, *, vcd: str | PathLike[str] | None = None) -> None:
        super().__init__(design, vcd=vcd)
        self._text = self._sources(design)["design.v"].splitlines()
        self._at_start: list[Point] = []
        self._get(list(design.outputs))
        # Settling after power-up changes bits from the random values that they had before.
        self._at_start = self.points()

    @classmethod
    def _sources(cls, design: Design) -> dict[str, str]:
        with tempfile.TemporaryDirectory() as folder:
            Path(folder, "design.il").write_text(source.rtlil(design), encoding="utf-8")
            call([*YOSYS, "-q", "-p", SCRIPT], Path(folder))
            return {"design.v": Path(folder, "design.v").read_text(encoding="utf-8")}

    def points(self) -> list[Point]:
        """Give every point, with what was counted since power-up."""
        self._open()
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "coverage.dat")
            self._lib.fresa_coverage(ctypes.c_void_p(self._handle), fsencode(path))
            points = list(_read(path.read_text(encoding="utf-8", errors="replace"), self._text))
        if not self._at_start:
            return points
        return [replace(point, count=point.count - before.count * (point.kind == "toggle"))
                for point, before in zip(points, self._at_start, strict=True)]


def _read(records: str, text: list[str]) -> Iterator[Point]:
    """Read what Verilator counted; leave out what cannot be missed, and ports seen from outside."""
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
        if "." not in module:  # has but the ports of what is in it
            continue
        name = _ESCAPED.sub(lambda code: chr(int(code[1], 16)), fields["o"])
        what = {"line": line, "branch": f"{name} of {line}"}.get(kind, name)
        yield Point(kind, module, what, int(match[2]))
