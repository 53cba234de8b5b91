"""The engine Icarus Verilog: the Verilog for users, interpreted, with X for unknown levels.

The process runs the bench of ``bench.v``.
"""

import shutil
from pathlib import Path

from ..design import Design
from . import source
from .base import PERIOD
from .cache import call, folder, kept, version
from .piped import PipedEngine
from .ports import instance, numbered

__all__ = ["IcarusEngine"]

OPTIONS = ("-g2005", "-s", "bench", "-o", "design.vvp")
BENCH = Path(__file__).with_name("bench.v")


class IcarusEngine(PipedEngine):
    """Runs a design on Icarus Verilog. See `PipedEngine`."""

    name = "icarus"
    title = "Icarus"
    program = "vvp"

    @classmethod
    def missing(cls) -> str | None:
        if shutil.which("iverilog") and shutil.which("vvp"):
            return None
        return f"{cls.title} needs Icarus Verilog: install Debian's package iverilog"

    @classmethod
    def version(cls) -> str:
        """Return the version of Icarus."""
        return version("iverilog", "-V").partition("\n")[0].strip()

    @classmethod
    def _sources(cls, design: Design) -> dict[str, str]:
        """Return the Verilog files by name."""
        return {"design.v": source.verilog(design)}

    @classmethod
    def _program(cls, design: Design) -> bytes:
        files = {"bench.v": _bench(design), **cls._sources(design)}

        def make(work: Path) -> Path:
            for name, text in files.items():
                (work / name).write_text(text)
            call(["iverilog", *OPTIONS, *files], work)
            return work / "design.vvp"

        return kept(folder("icarus"), ".vvp", [*files.values(), cls.version(), *OPTIONS], make,
                    load=lambda _, content: content)

    def _command(self, design: Design, work: Path) -> list[str]:
        (work / "design.vvp").write_bytes(self._program(design))
        waves = [] if self.vcd is None else [f"+vcd={Path(self.vcd).absolute()}"]
        return ["vvp", "-n", "design.vvp", *waves]


def _bench(design: Design) -> str:
    """Write the bench of a design."""
    inputs, outputs = numbered(design)
    wires = []
    place = sum(4 * port.digits for port in inputs)
    macros = {"HALF": PERIOD * 500, "GIVEN": place or 4}
    for port in inputs:
        place -= 4 * port.digits
        wires.append(f"wire [{port.width - 1}:0] {port.plain} = given[{place} +: {port.width}];")
    place = sum(4 * port.digits for port in outputs)
    macros |= {"SEEN": place or 4, "OUTPUTS": len(outputs) or 1}
    met = []
    for port in outputs:
        place -= 4 * port.digits
        wires += [f"wire [{port.width - 1}:0] {port.plain};",
                  f"assign seen[{place} +: {4 * port.digits}] = {port.plain};"]
        met.append(f"{port.plain} === values[{place} +: {port.width}]")
    parts = {"WIRES": "\n  ".join(wires or ["assign seen = 0;"]),
             "INSTANCE": instance(design).replace(f"\\{design.name} ", "dut ", 1).strip(),
             "MET": "{" + ", ".join(reversed(met or ["1'b0"])) + "}"}
    text = BENCH.read_text()
    for name, part in parts.items():
        text = text.replace(f"`{name}", part)
    return "".join(f"`define {name} {value}\n" for name, value in macros.items()) + text
