"""Every machine on every board with open tools: cells, Fmax, and what the clock leaves to spare."""

import io
import json
import os
import tempfile
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

from fresa_boards.boards import BOARDS
from tb.machines import machines
from tools import build
from tools.console import (
    Parser,
    Progress,
    UserError,
    command,
    known,
    say,
    warn,
    write_files_atomically,
)

from .pages import with_figures

__all__ = ["main", "table", "without_figures"]

ROOT = Path(__file__).parent.parent
FIGURES = ROOT / "docs" / "boards.json"
PAGES = (ROOT / "README.md", ROOT / "docs" / "boards.md")

ABOUT = """\
Builds every machine for every board whose tools pip installs and that has pins for it, with its
default options, and prints for each pair the cells of the FPGA that it takes, the fastest clock by
place and route, and how much of that the board's clock leaves to spare. A build takes from seconds
to some ten minutes, gcode and vplotter longest.

With --write the figures are kept in docs/boards.json, and the tables in README.md and
docs/boards.md are written anew, when all of a board is built. Boards and machines that are not
named keep their figures.
"""

CELLS = {"ice40": "ICESTORM_LC", "ecp5": "TRELLIS_COMB"}
"""What counts as the cells of a family; Gowin counts carries apart from look-up tables."""


def cells(family: str, used: dict[str, int]) -> int:
    """Return the cells that place and route used."""
    if family in CELLS:
        return used[CELLS[family]]
    return sum(used.get(cell, 0) for cell in ("LUT4", "ALU", "RAM16SDP4"))


def figures(board: str, machine: str) -> dict:
    """Build a machine for a board as the command does; return what is worth keeping.

    Raises
    ------
    RuntimeError
        If it cannot be built.
    """
    output = io.StringIO()
    with tempfile.TemporaryDirectory() as place:
        with redirect_stdout(output), redirect_stderr(output):
            status = build.main(["--board", board, "--machine", machine, "--no-report",
                                 "-o", place])
        report = Path(place, "report.json")
        facts = json.loads(report.read_text()) if report.exists() else {}
    if "fmax_mhz" not in facts:
        raise RuntimeError(f"{machine} on {board}: status {status}\n{output.getvalue()}")
    flow = BOARDS[board].flow
    assert flow is not None
    return {"cells": cells(flow.extra, facts["cells"]), "of": facts["capacity"]["luts"],
            "flip_flops": facts["resources"]["flip_flops"],
            "block_rams": facts["resources"]["block_rams"], "clock_mhz": facts["clock_hz"] / 1e6,
            "fmax_mhz": facts["fmax_mhz"], "margin": facts["margin"], "tools": facts["tools"]}


def table(found: dict[str, dict[str, dict]]) -> str:
    """Return the figures as a table in Markdown."""
    names = list(dict.fromkeys(name for of in found.values() for name in of))
    lines = ["| board | clock | " + " | ".join(names) + " |",
             "| --- | --- |" + " --- |" * len(names)]
    for board, of in found.items():
        first = next(iter(of.values()))
        row = [f"`{board}`, {first['of']} cells", f"{first['clock_mhz']:g} MHz",
               *(f"{of[name]['cells']} cells, {of[name]['fmax_mhz'] // 1:.0f} MHz, "
                 f"{of[name]['margin']:+.0%}" if name in of else "" for name in names)]
        lines.append(f"| {' | '.join(row)} |")
    return "\n".join(lines) + "\n"


def machines_of(board: str) -> list[str]:
    """Return the machines that have pins on a board, in the order in which all are listed."""
    return [name for name in machines() if name in BOARDS[board].allotments]


def without_figures(found: dict[str, dict[str, dict]]) -> str:
    """Return the command that measures the boards with a machine without figures, or nothing."""
    boards = [name for name, board in BOARDS.items()
              if board.flow and {*found.get(name, ())} != {*machines_of(name)}]
    return f"run python -m benchmarks.boards {' '.join(boards)} --write" if boards else ""


def write(found: dict[str, dict[str, dict]]) -> None:
    """Keep figures, and write the tables of the pages."""
    pages = {page: with_figures(page.read_text(), "boards", table(found)).encode()
             for page in PAGES}
    write_files_atomically({FIGURES: (json.dumps(found, indent=1) + "\n").encode(), **pages})


@command
def main(argv: list[str] | None = None) -> int:
    """Run the benchmark."""
    boards = [name for name, board in BOARDS.items() if board.flow]
    parser = Parser(prog="python -m benchmarks.boards", description=ABOUT)
    parser.add_argument("boards", metavar="BOARD", nargs="*",
                        help=f"which; all of {', '.join(boards)}")
    parser.add_argument("--machine", metavar="NAME", action="append", choices=[*machines()],
                        help="measure this machine only; may be repeated")
    parser.add_argument("--write", action="store_true",
                        help="keep the figures, and write the tables of the pages")
    args = parser.parse_args(argv)
    chosen = [known(name, boards, "board with open tools") for name in args.boards] or boards
    found = json.loads(FIGURES.read_text()) if FIGURES.exists() else {}
    slow = []
    pairs = {board: [name for name in machines_of(board) if name in (args.machine or [name])]
             for board in chosen}
    chosen = [board for board in chosen if pairs[board]]
    if not chosen:
        raise UserError("none of these boards has pins for it")
    builds = sum(map(len, pairs.values()))
    with Progress(builds, "builds", "building") as progress:
        for board in chosen:
            new = {}
            for machine in pairs[board]:
                new[machine] = each = figures(board, machine)
                slow += [f"{machine} on {board}"] * (each["margin"] < 0.2)
                progress.advance()
            every = {**found.get(board, {}), **new}
            found[board] = {name: every[name] for name in machines_of(board) if name in every}
            found = {name: found[name] for name in boards if name in found}
            if args.write:
                write(found)
    say(table({name: found[name] for name in chosen}))
    for each in slow:
        warn(f"less than a fifth to spare: {each}")
    return 0


if __name__ == "__main__":
    os.environ.setdefault("AMARANTH_USE_YOSYS", "builtin")
    raise SystemExit(main())
