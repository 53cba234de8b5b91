"""X: no output is ever unknown, from the first clock after power-up, with or without a reset.

Icarus runs the Verilog that users get, and the netlist. What has no value at power-up is X there,
and so is all that depends on it.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from amaranth import Value

from fresa.machines import MillStation
from fresa.machines.mill import MillTiming
from fresa.motion import SquareGenerator

from .. import boards
from ..design import Design
from ..engines import Engine, IcarusEngine, NetlistIcarusEngine, UnknownLevelError
from ..runners import duts, stimuli
from ..stimulus import Stimulus, random_blocks

__all__ = ["ENGINES", "GUARDED", "MACHINE", "ON_A_LINE", "PANEL", "Runnable", "Seen", "look",
           "without_values"]

ENGINES: dict[str, type[Engine]] = {"RTL": IcarusEngine, "netlist": NetlistIcarusEngine}
"""What runs a design as what it is called here."""


@dataclass(frozen=True)
class Runnable:
    """A design with short times, and what it is given.

    Attributes
    ----------
    name : str
        What people call it.
    make : callable
        Makes the design.
    stimulus : callable
        Makes a stimulus of a seed, a number of clocks, and whether there may be a reset in it.
    """

    name: str
    make: Callable[[], Design]
    stimulus: Callable[[int, int, bool], Iterator[Stimulus]]


@dataclass(frozen=True)
class Seen:
    """What was seen of a design.

    Attributes
    ----------
    clocks : int
        Clocks in which every output was known.
    bits : int
        Bits of outputs.
    wrong : str or None
        What was unknown, and when.
    """

    clocks: int
    bits: int
    wrong: str | None


def look(design: Design, kind: type[Engine], runnable: Runnable, *, seed: int, clocks: int) -> Seen:
    """Look for X in every output of every clock.

    Parameters
    ----------
    design : Design
        What to run: from power-up with resets, and again from power-up without any.
    kind : type of Engine
        What runs it.
    runnable : Runnable
        What it is.
    seed : int
        Of the stimulus.
    clocks : int
        For each of the two runs.
    """
    bits = sum(len(Value.cast(port)) for port in design.outputs.values())
    seen = 0
    for resets in (True, False):
        with kind(design) as engine:
            try:
                for rows in runnable.stimulus(seed, clocks, resets):
                    engine.apply(rows, ())
                    seen += len(next(iter(rows.values())))
            except UnknownLevelError as error:
                when = f"clock {error.clock} of the run {'with' if resets else 'without'} reset"
                return Seen(seen, bits, f"{error.output} is not known in {when}")
    return Seen(seen, bits, None)


def without_values(kind: type[Engine]) -> type[Engine]:
    """Make an engine that takes out of its Verilog what registers hold at power-up."""
    def spoilt(text: str) -> str:
        text = re.sub(r"^( *reg [^=;]+?) = [^;]+;", r"\1;", text, flags=re.M)
        return re.sub(r"(FD\w* #\(\s+\.INIT\(1')h[01]\)", r"\1hx)", text)

    class Spoilt(kind):
        @classmethod
        def _sources(cls, design: Design) -> dict[str, str]:
            return {name: text if name == "cells_sim.v" else spoilt(text)
                    for name, text in super()._sources(design).items()}

    return Spoilt


def _machine(seed: int, clocks: int, resets: bool) -> Iterator[Stimulus]:
    """Orders that wait for the machine, and chance; chance alone if there is no reset."""
    if resets:
        yield from stimuli(duts()["mill"], seed, clocks)
    else:
        for rows in random_blocks(duts()["mill"].random, seed, clocks):
            yield {**rows, "rst": np.zeros_like(rows["rst"])}


def _on_a_line(name: str, seed: int, clocks: int, resets: bool) -> Iterator[Stimulus]:
    """What is typed takes long: ten times as many clocks; a reset in one of a thousand, or none."""
    rng = np.random.default_rng(seed)
    for rows in stimuli(duts()[name], seed, 10 * clocks):
        rst = rng.integers(0, 1000, len(rows["rst"])) == 0
        yield {**rows, "rst": (rst & resets).astype(np.uint8)}


def _panel(seed: int, clocks: int, resets: bool) -> Iterator[Stimulus]:
    """Switches and buttons at random, each level for a while."""
    rng = np.random.default_rng(seed)
    changes = np.cumsum(rng.integers(0, 24, clocks) == 0)
    switches = rng.integers(0, 1 << 8, clocks, np.uint8)[changes]
    buttons = rng.integers(0, 1 << 4, clocks, np.uint8)[changes]
    yield {"switches": switches, "buttons": buttons if resets else buttons & 0b1110}


MACHINE = Runnable("mill", duts()["mill"].design, _machine)
GUARDED = Runnable("mill-guarded", duts()["mill-guarded"].design, _machine)
"""The raw machine."""

ON_A_LINE = tuple(Runnable(name, duts()[name].design, partial(_on_a_line, name))
                  for name in ("single", "positioner"))
"""The machines on a serial line."""

PANEL = Runnable(
    "nexys2-square",
    lambda: boards.board("mill", MillStation(source=SquareGenerator(side=3), z_travel=2,
                                             timing=MillTiming(period=2, scan_bits=3)), debounce=1),
    _panel)
"""The Nexys 2 that walks a square."""
