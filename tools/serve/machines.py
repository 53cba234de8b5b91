# amaranth: UnusedElaboratable=no

"""The machines that can be served: how each is built, and its simulated clock."""

import argparse
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, cast

from fresa.roles import MachineComponent
from fresa_boards.board import Board
from tb.boards import behind_pins
from tb.design import Design
from tb.engines import AmaranthEngine, Engine, EngineError, build_with_fallback, why_slow
from tb.machine import Machine, Option, Serve
from tb.machines import machines

from ..console import FIRST_TIME, Progress, UserError, warn
from ..machines.options import add_options, values_of
from .planted import Plant, PlantedEngine

__all__ = ["Served", "build", "servable"]

#: Of the clocks that machines are made for one of the slowest, in Hz: whole clocks a bit at every
#: common speed of a line up to 115 200 baud.
CLOCK = 2_073_600
#: Clocks per bit on the slow engine: as few as a receiver can work with.
SLOW_BIT = 16


@dataclass(frozen=True)
class Served:
    """A machine that can be served.

    Attributes
    ----------
    machine : Machine
        Its declaration.
    how : Serve
        Its declaration of serving it.
    values : mapping of str to object
        Values of the options that it is built with.
    board : Board, optional
        The board behind whose pins it is; without one it is the machine alone.
    """

    machine: Machine
    how: Serve
    values: Mapping[str, Any]
    board: Board | None = None

    def add_options(self, group: argparse._ArgumentGroup) -> None:
        """Add the machine's own options to a parser."""
        add_options(group, self._options)

    def options(self, args: argparse.Namespace) -> dict[str, Any]:
        """Return the values of these from parsed arguments."""
        return values_of(args, self._options)

    def chosen(self, args: argparse.Namespace) -> "Served":
        """Return a copy with the options of parsed arguments."""
        return replace(self, values={**self.values, **self.options(args)})

    def on(self, board: Board) -> "Served":
        """Return a copy behind the pins of a board, with what a small one leaves out.

        Raises
        ------
        ValueError
            If the board has no pins for the machine, or that is always served on one.
        """
        board.allotment(self.machine.name)
        if self.how.design:
            raise ValueError(f"{self.machine.name} is always served on a Nexys 2")
        return replace(self, board=board, values=self.machine.values_on(board.name, self.values))

    @property
    def contacts(self) -> tuple[str, ...]:
        """Further inputs that can be switched: those that have a pin, and the reset of a board."""
        return tuple(name for name in self.how.contacts if self._has(name)) + (
            ("reset",) if self.board and self._has("reset") else ())

    @property
    def further_switches(self) -> dict[str, str]:
        """The inputs of limit switches that have one of their own, by the names of switches."""
        further = self.how.further_switches
        switches = further(**self.values) if further else {}
        return {name: port for name, port in switches.items() if self._has(port)}

    @property
    def switches(self) -> tuple[str, ...]:
        """The axis ends with a limit switch, by bits of the input ``limits``."""
        return tuple(self.how.switches(**self.values)) if self.how.switches else ()

    def design(self, clock: int, baud: int) -> Design:
        """Make the design for a clock in Hz; raises `ValueError` for invalid options."""
        values = {**self.values, "baud": baud}
        if self.how.design:
            return self.how.design(clock, **values)
        if self.board:
            made = self.machine.make(**self.machine.real(clock, **values))
            return behind_pins(
                self.machine.name, cast(MachineComponent, made), clock=clock, on=self.board,
                inverted=self.machine.inverted(**values) if self.machine.inverted else ())
        return self.machine.design(**self.machine.real(clock, **values))

    def plant(self, clock: int) -> Plant | None:
        """Make what the machine moves, for a clock in Hz."""
        if self.how.plant is None:
            return None
        return self.how.plant(**self.machine.real(clock, **self.values))

    def _has(self, port: str) -> bool:
        """Whether an input can be switched: on a board, whether it has a pin there."""
        if self.board is None:
            return True
        allotment = self.board.allotment(self.machine.name)
        return port in allotment.header or any(
            port in words.split() for words in allotment.panel.values())

    @property
    def _options(self) -> list[Option]:
        return [option for option in self.machine.options if option.serve]


def servable() -> dict[str, Served]:
    """Return the machines that can be served, by name."""
    return {name: Served(machine, machine.serve, {each.name: each.default
                                                  for each in machine.options})
            for name, machine in machines().items() if machine.serve}


def build(served: Served, name: str | None = None) -> tuple[Engine, int]:
    """Build a machine at power-up; return it and the clocks per bit of its serial line.

    Parameters
    ----------
    served : Served
        The machine.
    name : str, optional
        The engine. None for the fastest available: if it fails, the slow one is used.

    Raises
    ------
    UserError
        If the engine is not available, or the options are invalid.
    """
    with Progress(1, "machines", f"building the machine{FIRST_TIME}"):
        try:
            made, note = build_with_fallback(name, lambda kind: _make(served, kind))
        except EngineError as error:
            raise UserError(str(error)) from error
        except ValueError as error:
            raise UserError(f"a machine with these options cannot be simulated: {error}") from error
    if note := note or why_slow(name):
        warn(note)
    if isinstance(made[0], AmaranthEngine):
        warn("a second of the machine takes about half a minute")
    return made


def _make(served: Served, kind: type[Engine]) -> tuple[Engine, int]:
    baud, slow = served.how.baud, kind is AmaranthEngine
    bit = SLOW_BIT if slow else max(SLOW_BIT, round(CLOCK / baud))
    if slow and bit * baud < served.how.least_clock:
        raise EngineError("this machine is served by the fast engine alone, which needs a C++ "
                          "compiler: pip install -e '.[fast]'")
    engine = kind(served.design(bit * baud, baud), stretches=True)
    engine.set(**served.how.levels)
    if plant := served.plant(bit * baud):
        return cast(Engine, PlantedEngine(engine, plant)), bit
    return engine, bit
