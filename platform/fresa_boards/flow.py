"""How open tools make a bitstream: Yosys, nextpnr, and a packer, each a Python package.

Amaranth's platforms write the files and the commands; here is what runs them, with the packages
that are installed beside this one and with nothing else of the machine, so that the same versions
make the same bytes.
"""

import json
import re
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path

from .programs import ProgramError

__all__ = ["ECP5", "GOWIN", "ICE40", "Flow", "Timing", "installed", "run"]

_START = ("import sys; from importlib.metadata import entry_points; "
          "sys.argv = sys.argv[1:]; "
          "(program,) = entry_points(group='console_scripts', name=sys.argv[0]); "
          "sys.exit(program.load()())")


@dataclass(frozen=True)
class Timing:
    """What place and route says of a design.

    Attributes
    ----------
    fmax_mhz : float
        The fastest clock at which it works.
    cells : mapping of str to int
        Cells that are used, by what the FPGA calls them.
    """

    fmax_mhz: float
    cells: Mapping[str, int]


@dataclass(frozen=True)
class Flow:
    """The programs for a family of FPGAs.

    Attributes
    ----------
    extra : str
        The extra of this project that installs them.
    bitstream : str
        How the name of a bitstream ends.
    cells : mapping of str to mapping of str to int
        For ``luts``, ``flip_flops``, ``block_rams`` and ``multipliers`` the cells of Yosys, as
        regular expressions, and how many of the resource each takes.
    seed : int, optional
        Where nextpnr's random numbers begin, unless where it has them begin by itself. By this
        alone the fastest clock of a design varies by a tenth.
    """

    extra: str
    bitstream: str
    cells: Mapping[str, Mapping[str, int]]
    seed: int | None = None

    def options(self, name: str) -> dict[str, object]:
        """Options that Amaranth's platforms take when they prepare a design."""
        seed = "" if self.seed is None else f" --seed {self.seed}"
        return {"emit_src": False, "verbose": True,
                "script_after_synth": f"tee -q -o {name}.cells.json stat -json",
                "nextpnr_opts": f"--report {name}.timing.json{seed}"}

    @staticmethod
    def commands(files: Mapping[str, bytes], name: str) -> list[list[str]]:
        """List the commands, from Yosys to the packer, of files that a platform prepared."""
        return json.loads(files[f"build_{name}.json"])["commands"]

    def missing(self, commands: Iterable[list[str]]) -> str | None:
        """Return what to install before commands can run, or None."""
        for program, *_ in commands:
            if not installed(program):
                return f"{program} missing: pip install -e '.[{self.extra}]'"
        return None

    def count(self, folder: Path, name: str) -> dict[str, int]:
        """Count the resources of a design by what Yosys wrote into a folder."""
        cells = json.loads((folder / f"{name}.cells.json").read_text(encoding="utf-8"))
        by_type = cells["design"]["num_cells_by_type"]
        return {resource: sum(weight * number for cell, number in by_type.items()
                              for pattern, weight in patterns.items()
                              if re.fullmatch(pattern, cell))
                for resource, patterns in self.cells.items()}

    @staticmethod
    def timing(folder: Path, name: str) -> Timing:
        """Read what nextpnr wrote of a design into a folder.

        Raises
        ------
        OSError
            If it did not come so far.
        """
        report = json.loads((folder / f"{name}.timing.json").read_text(encoding="utf-8"))
        clock = min(report["fmax"].values(), key=lambda clock: (
            clock["achieved"] / clock["constraint"]))
        return Timing(clock["achieved"], {
            cell: counts["used"] for cell, counts in report["utilization"].items()
            if counts["used"]})

    @staticmethod
    def versions(commands: Iterable[list[str]]) -> dict[str, str]:
        """Give the versions of the packages that commands run, by their names."""
        entries = [_entry(command[0]) for command in commands]
        return {entry.dist.name: entry.dist.version for entry in entries if entry and entry.dist}


def installed(program: str) -> bool:
    """Return whether a Python package has a program."""
    return _entry(program) is not None


def run(command: list[str], folder: Path,
        on_line: Callable[[str], None] = lambda line: None) -> int:
    """Run a command in a folder; return its exit status.

    Parameters
    ----------
    command : list of str
        Program and arguments, as of :meth:`Flow.commands`.
    folder : Path
        Where the files are, and where it writes.
    on_line : callable
        Called with each line that it prints. If it raises an exception, or another one such as
        KeyboardInterrupt comes meanwhile, the command has ended when that goes on.

    Raises
    ------
    ProgramError
        If the program is not installed.
    """
    entry = _entry(command[0])
    if entry is None:
        raise ProgramError(f"{command[0]} is not installed")
    with subprocess.Popen(
            [sys.executable, "-P", "-c", _START, entry.name, *command[1:]], cwd=folder,
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
            text=True, encoding="utf-8", errors="replace") as process:
        try:
            for line in process.stdout or ():
                on_line(line)
            return process.wait()
        except BaseException:
            process.terminate()
            process.wait()
            raise


def _entry(program: str) -> EntryPoint | None:
    """What starts a program: its package may call it YoWASP's."""
    for name in (f"yowasp-{program}", program):
        for entry in entry_points(group="console_scripts", name=name):
            return entry
    return None


ICE40 = Flow("ice40", ".bin", {
    "luts": {"SB_LUT4": 1}, "flip_flops": {r"SB_DFF\w*": 1}, "block_rams": {r"SB_RAM40_4K\w*": 1},
    "multipliers": {"SB_MAC16": 1}})
ECP5 = Flow("ecp5", ".bit", {
    "luts": {"LUT4": 1, "CCU2C": 2, "TRELLIS_DPR16X4": 8}, "flip_flops": {"TRELLIS_FF": 1},
    "block_rams": {"DP16KD": 1}, "multipliers": {"MULT18X18D": 1}},
    seed=1)  # With nextpnr's own, the mill on an ulx3s-45f stays below 100 MHz.
GOWIN = Flow("gowin", ".fs", {
    "luts": {"LUT[1-4]": 1, "ALU": 1, r"RAM16S\w*": 4}, "flip_flops": {r"DFF\w*": 1},
    "block_rams": {r"(SDP|DP|SP|pROM)X?[9B]?B?": 1}, "multipliers": {r"MULT\w*": 1}})
