"""The engine GHDL: the VHDL reference of a design, written independently of the gateware.

The process runs the bench of ``bench.vhd``.
"""

import shutil
from pathlib import Path

from ..design import Design, Entity
from .base import PERIOD, EngineError
from .cache import call, version
from .piped import PipedEngine
from .ports import Port, numbered

__all__ = ["GHDLEngine"]

STANDARD = "--std=08"
BENCH = Path(__file__).with_name("bench.vhd")

# Before the first delta cycle every signal inside is U, and arithmetic warns of it. Later warnings
# are errors: a comparison with a U in it is false, which would hide it.
STRICT = ("--ieee-asserts=disable-at-0", "--assert-level=warning")


class GHDLEngine(PipedEngine):
    """Runs the VHDL reference of a design that has one. See `PipedEngine`."""

    name = "ghdl"
    program = "ghdl"

    @classmethod
    def missing(cls) -> str | None:
        return None if shutil.which("ghdl") else "GHDL is needed: install Debian's package ghdl"

    @classmethod
    def version(cls) -> str:
        """Return the version of GHDL."""
        return version("ghdl", "--version").partition("\n")[0].strip()

    def _command(self, design: Design, work: Path) -> list[str]:
        if design.vhdl is None:
            raise EngineError(f"GHDL runs VHDL, and {design.name} has no VHDL reference")
        (work / "bench.vhd").write_text(_bench(design, design.vhdl))
        files = map(str, design.vhdl.files)
        call(["ghdl", "-a", STANDARD, *files, "bench.vhd"], work)
        waves = []
        if self.vcd is not None:
            waves = ["-gwaveform=true", f"--vcd={Path(self.vcd).absolute()}"]
        return ["ghdl", "--elab-run", STANDARD, "bench", *STRICT, *waves]

    def _read_answer(self, size: int | None = None) -> bytes:
        message = super()._read_answer(size)
        if b":" in message:  # not an answer but a failed assertion, which ends it
            self._died(message)
        return message


def _bench(design: Design, entity: Entity) -> str:
    """Write the bench of a design."""
    inputs, outputs = numbered(design)
    joined = ["clk => clk"]

    def join(ports: list[Port], levels: str) -> int:
        """Connect ports to their places, the first leftmost; return the number of bits."""
        place = bits = sum(4 * port.digits for port in ports)
        for port in ports:
            place -= 4 * port.digits
            index = place if port.width == 1 else f"{place + port.width - 1} downto {place}"
            joined.append(f"{entity.renamed.get(port.name, port.name)} => {levels}({index})")
        return bits

    bits = {"GIVEN": join(inputs, "given"), "SEEN": join(outputs, "seen")}
    place, met = bits["SEEN"], []
    for n, port in enumerate(outputs):
        place -= 4 * port.digits
        span = f"({place + 4 * port.digits - 1} downto {place})"
        met.append(f"(enable({n}) = '1' and seen{span} = values{span})")
    generics = ", ".join(f"{name} => {str(value).lower()}"
                         for name, value in entity.generics.items())
    parts = {
        "HALF": PERIOD * 500, **{name: size or 4 for name, size in bits.items()},
        "OUTPUTS": 4 * max(1, -(-len(outputs) // 4)), "MET": " or ".join(met or ["false"]),
        "INSTANCE": entity.name + (f" generic map ({generics})" if generics else "")
        + f" port map ({', '.join(joined)})",
    }
    text = BENCH.read_text()
    for name, part in parts.items():
        text = text.replace(f"{{{name}}}", str(part))
    return text
