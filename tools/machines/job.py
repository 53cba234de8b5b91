"""What is built, whichever machine it is."""

import argparse
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from amaranth import Elaboratable
from amaranth.back import rtlil
from amaranth.lib import wiring

from fresa_boards.nexys2 import Nexys2_1200Platform, Nexys2Platform
from fresa_boards.verilog import from_rtlil
from tb.design import Design

__all__ = ["BOARDS", "Built", "Job", "Kind", "on_board", "raw"]

BOARDS = {"nexys2-500": Nexys2Platform, "nexys2-1200": Nexys2_1200Platform, "pins": None}
"""Platforms by name; `pins` is the raw machine."""

Write = Callable[[Mapping[str, bytes]], None]
"""Writes files beside those that are there, and the report."""


@dataclass(frozen=True)
class Built:
    """What was built.

    Attributes
    ----------
    files : mapping of str to bytes
        The sources, by name.
    rtlil : str
        The same design for Yosys.
    top : str
        Name of the top module.
    """

    files: Mapping[str, bytes]
    rtlil: str
    top: str


@dataclass(frozen=True)
class Job:
    """A machine to build, as it was asked for.

    Attributes
    ----------
    built : Built
        Its sources.
    facts : dict
        What is known without synthesis, ready for JSON. The report, to which more may be added.
    says : str
        The same in a line.
    source : Path or None
        A file that it is made of, which must not be written over.
    shows : tuple of str
        Files that `finish` writes.
    finish : callable, optional
        What the report has beside resources: is given what writes files, and gives 0 if all is
        well.
    """

    built: Built
    facts: dict
    says: str
    source: Path | None = None
    shows: tuple[str, ...] = ()
    finish: Callable[[Write], int] = field(default=lambda write: 0)


@dataclass(frozen=True)
class Kind:
    """A machine that can be built.

    Attributes
    ----------
    add_options : callable
        Adds the options that only it has to a parser.
    job : callable
        Makes its job of parsed options, ``board`` and its own among them; raises `UserError`.
    """

    add_options: Callable[[argparse.ArgumentParser], None]
    job: Callable[[argparse.Namespace], Job]


def raw(name: str, machine: wiring.Component) -> Built:
    """Build a machine without a board: Verilog alone."""
    text = rtlil.convert(machine, name=name, emit_src=False)
    return Built({f"{name}.v": from_rtlil(text).encode()}, text, name)


def on_board(name: str, platform, top: Elaboratable, design: Design) -> Built:
    """Build a machine on a board.

    Parameters
    ----------
    name : str
        Of the files and the top module.
    platform : ISEPlatform
        The board.
    top : Elaboratable
        The machine wired to the ports of the board.
    design : Design
        The same wiring on plain ports, for Yosys: from Verilog it reads a picture in a minute.
    """
    plan = platform.prepare(top, name)
    files = {file: text.encode() if isinstance(text, str) else text
             for file, text in plan.files.items()}
    ports = [design.clk, *design.inputs.values(), *design.outputs.values()]
    return Built(files, rtlil.convert(design.top, name=name, ports=ports, emit_src=False), name)
