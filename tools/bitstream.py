"""A bitstream by open tools, and what it takes of the FPGA."""

import re
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from fresa_boards.board import Board
from fresa_boards.flow import run
from fresa_boards.programs import ProgramError, last_words

from .console import FIRST_TIME, Progress, UserError

__all__ = ["Made", "check_programs", "check_room", "make"]

_EARLY = re.compile(r"Info:\s+hold\s+\S+\s+-")  # the time of a hold, and the slack with it


@dataclass(frozen=True)
class Made:
    """What the tools made of a design.

    Attributes
    ----------
    facts : dict
        Ready for JSON: ``resources`` of the netlist; after place and route ``cells``, by what the
        FPGA calls them, ``fmax_mhz``, and ``margin``, the part of the clock that it is faster.
    files : mapping of str to bytes
        The bitstream, unless it is too slow, and the log of place and route.
    fast_enough : bool
        It stands the clock of the board.
    """

    facts: dict
    files: Mapping[str, bytes] = field(default_factory=dict)
    fast_enough: bool = True


def check_programs(board: Board, name: str, files: Mapping[str, bytes]) -> None:
    """Refuse a board whose tools are not installed.

    Raises
    ------
    UserError
        It says what to install.
    """
    if board.flow and (lacking := board.flow.missing(board.flow.commands(files, name))):
        raise UserError(f"{lacking}, or leave the bitstream out with --no-bitstream")


def make(board: Board, name: str, files: Mapping[str, bytes], *, bitstream: bool = True) -> Made:
    """Make a bitstream, with a bar; the first use of a tool on a machine takes minutes.

    Parameters
    ----------
    board : Board
        One with a flow.
    name : str
        The design's.
    files : mapping of str to bytes
        Its sources, as the board's platform prepared them.
    bitstream : bool
        Otherwise only count what it takes.

    Raises
    ------
    UserError
        If the FPGA does not hold it.
    ProgramError
        If a tool fails.
    """
    flow = board.flow
    assert flow is not None
    synthesis, route, pack = flow.commands(files, name)
    stages = 4 if bitstream else 1
    with tempfile.TemporaryDirectory() as place, Progress(
            stages, "stages", f"{'making the bitstream' if bitstream else 'counting resources'}"
            f"{FIRST_TIME}") as progress:
        folder = Path(place)
        for file, data in files.items():
            (folder / file).write_bytes(data)
        _run(synthesis, folder)
        progress.advance()
        resources = flow.count(folder, name)
        check_room(board, name, resources)
        facts: dict = {"resources": resources,
                       "tools": flow.versions([synthesis, route, pack][:3 if bitstream else 1])}
        if not bitstream:
            return Made(facts)

        log: list[str] = []
        placed = False

        def watch(line: str) -> None:
            nonlocal placed
            log.append(line)
            if not placed and line.startswith("Info: Routing.."):
                placed = True
                progress.advance()

        status = run(route, folder, watch)
        try:
            timing = flow.timing(folder, name)
        except (OSError, ValueError):
            raise ProgramError(f"{route[0]} failed: {last_words(''.join(log))}") from None
        progress.advance(1 if placed else 2)
        clock = board.clock / 1e6
        facts |= {"cells": dict(timing.cells), "fmax_mhz": round(timing.fmax_mhz, 2),
                  "margin": round(timing.fmax_mhz / clock - 1, 4)}
        made = {f"{name}.tim": "".join(log).encode()}
        if timing.fmax_mhz < clock:
            return Made(facts, made, fast_enough=False)
        if status:
            raise ProgramError(f"{route[0]} failed: {last_words(''.join(log))}")
        if any(_EARLY.match(line) for line in log):
            raise ProgramError("a signal changes before a flip-flop has taken it: leave options "
                               "out, or choose another board")
        _run(pack, folder)
        progress.advance()
        facts["bitstream"] = name + flow.bitstream
        made[facts["bitstream"]] = (folder / facts["bitstream"]).read_bytes()
        return Made(facts, made)


def _run(command: list[str], folder: Path) -> None:
    log: list[str] = []
    if run(command, folder, log.append):
        raise ProgramError(f"{command[0]} failed: {last_words(''.join(log))}")


def check_room(board: Board, name: str, resources: Mapping[str, Any]) -> None:
    """Refuse what a board has no room for.

    Raises
    ------
    UserError
        If more of a resource is used than its FPGA has.
    """
    for resource, used in resources.items():
        has = getattr(board.capacity, resource, None)
        if has is not None and used > has:
            raise UserError(f"{name} takes {used} {resource.replace('_', ' ')} and {board.name} "
                            f"has {has}: choose a larger board, or leave options out")
