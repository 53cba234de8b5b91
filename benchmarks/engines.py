"""Speed of milling on the engines, side by side."""

import os
import shlex
import tempfile
import time
from contextlib import ExitStack
from importlib.util import find_spec
from os import times
from pathlib import Path
from unittest.mock import patch

import numpy as np
import platformdirs

from tb.engines import ENGINES, build
from tb.engines.cache import ZIG, compiler
from tb.machine import Machine
from tb.machines import machines
from tb.milling import mill_picture
from tb.stimulus import random_blocks
from tools import console

ABOUT = """\
Mills a picture of 400 x 400 pixels on CXXRTL, from nothing to the finished cut, including
compilation, with the system's compiler and that of the Python package ziglang, in alternation; then
a corner of it on each available engine, and prints clocks per second and their ratio. Every machine
is compiled with the values of this project and with those of CXXRTL's own header, in alternation,
by time of processors. Last every machine runs without and with its random stimulus, all outputs
sampled, on CXXRTL and Verilator in alternation, by time of the processor.
"""

ROUNDS = 3

#: Clocks of a machine, without stimulus and with it.
CLOCKS = 1 << 19


MOST_PIXELS = 40_600
"""Pixels of all squares."""


def picture(pixels: int) -> np.ndarray:
    """Draw nested squares until enough pixels are set."""
    drawn = np.zeros((400, 400), bool)
    for inset in range(0, 200, 4):
        ring = np.zeros_like(drawn)
        ring[inset:400 - inset, inset:400 - inset] = True
        ring[inset + 1:399 - inset, inset + 1:399 - inset] = False
        places = np.flatnonzero(ring & ~drawn)[:pixels - int(drawn.sum())]
        drawn.reshape(-1)[places] = True
    return drawn


def from_nothing(pixels: np.ndarray, command: str) -> float:
    """Mill on CXXRTL with a compiler, without caches; return clocks per second."""
    with (tempfile.TemporaryDirectory() as cache,
          patch.dict(os.environ, own_cache(cache) | {"CXX": command})):
        begun = time.perf_counter()
        cut = mill_picture(pixels, ENGINES["cxxrtl"])
        seconds = time.perf_counter() - begun
    assert cut.right
    speed = cut.clocks / cut.seconds
    print(f"{pixels.sum()} pixels of 400 x 400 in {seconds:.1f} s by {command}, compilation "
          f"included: {cut.clocks} clocks, {speed:.3g} a second once compiled")
    return speed


def compiled(machine: Machine) -> None:
    """Compile a machine with both headers; print seconds of processors and their ratios."""
    design = machine.dut(machine.name).shared
    spent: list[list[float]] = [[], []]
    for number in (0, 1) * ROUNDS:
        with ExitStack() as stack:
            cache = stack.enter_context(tempfile.TemporaryDirectory())
            stack.enter_context(patch.dict(os.environ, own_cache(cache)))
            if number:
                stack.enter_context(patch.object(build, "_lean", lambda code, logic: code))
            begun = times()
            build.library(design)
            spent[number].append(times().children_user - begun.children_user)
    own, theirs = map(min, spent)
    ratios = " ".join(f"{one / other:.2f}" for one, other in zip(*spent, strict=True))
    print(f"{machine.name} is compiled in {own:.1f} s, with CXXRTL's own header in {theirs:.1f} s: "
          f"{ratios} of it")


def own_cache(folder: str) -> dict[str, str]:
    """Return the environment in which what is compiled is kept there, but not what tools keep."""
    caches = {"YOWASP_CACHE_DIR": "YoWASP", "ZIG_GLOBAL_CACHE_DIR": "zig"}
    return {"XDG_CACHE_HOME": folder} | {
        name: os.environ.get(name) or str(Path(platformdirs.user_cache_dir(), kept))
        for name, kept in caches.items()}


def stimulated(machine: Machine) -> None:
    """Run a machine without and with stimulus; print clocks per second and ratios."""
    dut = machine.dut(machine.name)
    kinds = {name: ENGINES[name] for name in ("cxxrtl", "verilator") if not ENGINES[name].missing()}
    blocks = list(random_blocks(dut.random, 1, CLOCKS))
    speeds = {name: [0.0, 0.0] for name in kinds}
    with ExitStack() as stack:
        engines = {name: stack.enter_context(kind(dut.shared)) for name, kind in kinds.items()}
        for name, engine in list(engines.items()) * ROUNDS:
            begun = time.process_time()
            engine.run(CLOCKS)
            bare = time.process_time()
            for block in blocks:
                engine.apply(block, list(dut.shared.outputs))
            ends = CLOCKS / (bare - begun), CLOCKS / (time.process_time() - bare)
            speeds[name] = [max(pair) for pair in zip(speeds[name], ends, strict=True)]
    for name, (bare, applied) in speeds.items():
        print(f"{machine.name} on {name}: {bare:.3g} clocks a second, with stimulus {applied:.3g}, "
              f"{applied / bare:.2f} of it")


@console.command
def main(argv: list[str] | None = None) -> int:
    """Run the benchmark."""
    parser = console.Parser(prog="python -m benchmarks.engines", description=ABOUT)
    parser.add_argument("pixels", metavar="PIXELS", type=console.whole(1, MOST_PIXELS), nargs="?",
                        default=4000, help="pixels that are set (default: %(default)s)")
    large = picture(parser.parse_args(argv).pixels)
    small = large[:12, :12]
    if reason := ENGINES["cxxrtl"].missing():
        print(reason)
    else:
        first = shlex.join(compiler() or [])
        commands = [first, *([shlex.join(ZIG)] if find_spec("ziglang") else [])]
        made = {command: [] for command in commands}
        for command in list(made) * (ROUNDS if len(made) > 1 else 1):
            made[command].append(from_nothing(large, command))
        for command in list(made)[1:]:
            ratios = [other / one for one, other in zip(made[first], made[command], strict=True)]
            print(f"{command} : {first} = {' '.join(f'{ratio:.2f}' for ratio in ratios)}")
    speeds = {}
    for name, engine in ENGINES.items():
        # Yosys has no model of a block RAM, and boards have no VHDL reference.
        if engine.missing() or name.startswith(("netlist", "ghdl")):
            continue
        cut = mill_picture(small, engine)
        assert cut.right
        speeds[name] = cut.clocks / cut.seconds
        print(f"{small.sum()} pixels of 12 x 12 on {name}: {speeds[name]:.3g} clocks a second")
    for name, speed in speeds.items():
        if name != "amaranth":
            print(f"{name} : amaranth = {speed / speeds['amaranth']:.3g}")
    if not ENGINES["cxxrtl"].missing():
        for machine in machines().values():
            compiled(machine)
    for machine in machines().values():
        stimulated(machine)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
