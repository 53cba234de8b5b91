"""X: no output is ever unknown, from the first clock after power-up, with or without a reset.

Icarus runs the Verilog that users get, and the netlist. What has no value at power-up is X there,
and so is all that depends on it.
"""

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from amaranth import Value

from ..design import Design
from ..engines import Engine, IcarusEngine, NetlistIcarusEngine, UnknownLevelError
from ..runners import Dut, stimuli
from ..stimulus import Stimulus, random_blocks

__all__ = ["ENGINES", "Runnable", "Seen", "look", "random_stimulus", "serial_stimulus",
           "without_values"]

ENGINES: dict[str, type[Engine]] = {"RTL": IcarusEngine, "netlist": NetlistIcarusEngine}
"""What runs a design as what it is called here."""


@dataclass(frozen=True)
class Runnable:
    """A design with short times, and what it is given.

    Attributes
    ----------
    name : str
        The name shown to people.
    make : callable
        Makes the design.
    stimulus : callable
        Makes a stimulus of a seed, a number of clocks, and whether there may be a reset in it.
    engines : tuple of str
        As what it can be run, see `ENGINES`.
    control : bool
        Without values at power-up an X must be found.
    """

    name: str
    make: Callable[[], Design]
    stimulus: Callable[[int, int, bool], Iterator[Stimulus]]
    engines: tuple[str, ...] = ("RTL", "netlist")
    control: bool = False


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


def random_stimulus(dut: Dut) -> Callable[[int, int, bool], Iterator[Stimulus]]:
    """Return the stimulus of a build: it waits for the machine; random alone without resets."""
    def rows(seed: int, clocks: int, resets: bool) -> Iterator[Stimulus]:
        if resets:
            yield from stimuli(dut, seed, clocks)
        else:
            for block in random_blocks(dut.random, seed, clocks):
                yield {**block, "rst": np.zeros_like(block["rst"])}

    return rows


def serial_stimulus(dut: Dut) -> Callable[[int, int, bool], Iterator[Stimulus]]:
    """Return the stimulus of a build with a serial line, which takes long.

    There are ten times as many clocks; a reset in one of a thousand, or none.
    """
    def rows(seed: int, clocks: int, resets: bool) -> Iterator[Stimulus]:
        rng = np.random.default_rng(seed)
        for block in stimuli(dut, seed, 10 * clocks):
            rst = rng.integers(0, 1000, len(block["rst"])) == 0
            yield {**block, "rst": (rst & resets).astype(np.uint8)}

    return rows
