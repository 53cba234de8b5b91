# amaranth: UnusedElaboratable=no

"""What is built, whichever machine it is."""

import argparse
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from amaranth.back import rtlil
from amaranth.lib import wiring

from fresa.clock import CLOCK
from fresa.roles import MachineComponent
from fresa_boards import boards
from fresa_boards.board import Board, pin_table
from fresa_boards.drawing import pin_drawing
from fresa_boards.verilog import from_rtlil
from fresa_boards.wiring import prepare
from tb.machine import Machine

from ..console import UserError
from .options import add_options, values_of

__all__ = ["BOARDS", "Built", "Job", "Kind", "build", "declared_kind", "on_board", "raw"]

BOARDS: dict[str, Board | None] = {**boards.BOARDS, "pins": None}
"""Boards by name; `pins` is the raw machine."""

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
    """A machine to build, as it was requested.

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


def on_board(board: Board, name: str, machine: MachineComponent,
             inverted: Collection[str] = ()) -> Built:
    """Build a machine on a board, and a table and a drawing of its pins.

    Parameters
    ----------
    board : Board
        The board.
    name : str
        The machine's, and that of the files and the top module.
    machine : MachineComponent
        The machine.
    inverted : collection of str
        See :func:`fresa_boards.wiring.wire`.
    """
    plan = prepare(board, name, machine, inverted=inverted)
    allotment = board.allotment(name)
    return Built({**plan.files, "pins.md": pin_table(board, machine, allotment).encode(),
                  "pins.svg": pin_drawing(board, name, machine, allotment).encode()},
                 plan.rtlil, name)


def build(board: str, machine: Machine, **given: Any) -> Built:
    """Build a machine as it is declared.

    Parameters
    ----------
    board : str
        One of `BOARDS`.
    machine : Machine
        Its declaration.
    given
        Values of its options; the others have their defaults.

    Raises
    ------
    ValueError
        If they do not go together, or want pins where there are none, or if the board has no pins
        for the machine.
    """
    where = BOARDS[board]
    values = machine.values_on(board, {
        **values_of(argparse.Namespace(), machine.options), **given})
    inverted = machine.inverted(**values) if machine.inverted else ()
    if where is None and inverted:
        raise ValueError("without a board the machine has no pins: invert "
                         f"{' and '.join(inverted)} where you wire it, not by an option")
    made = machine.make(**machine.real(where.clock if where else CLOCK, **values))
    if where is None:
        return raw(machine.name, made)
    if not isinstance(made, MachineComponent):
        raise ValueError(f"{machine.name} names no roles of its ports, so that no board has pins "
                         "for it: build it with --board pins")
    return on_board(where, machine.name, made, inverted)


def declared_kind(machine: Machine) -> Kind:
    """Return how a machine is built of which no more is known than its declaration."""
    def job(args: argparse.Namespace) -> Job:
        values = machine.values_on(args.board, values_of(args, machine.options))
        where = BOARDS[args.board]
        clock = where.clock if where else CLOCK
        try:
            built = build(args.board, machine, **values)
            facts, says = machine.figures(clock, machine.real(clock, **values), **values)
        except ValueError as error:
            raise UserError(str(error)) from error
        return Job(built, {"machine": machine.name, "board": args.board,
                           "files": sorted(built.files), "clock_hz": clock, **facts}, says)

    return Kind(lambda parser: add_options(
        parser.add_argument_group(machine.name), machine.options), job)
