"""Waveforms of pin levels given row by row, for models, which cannot write one."""

from collections.abc import Mapping
from os import PathLike
from pathlib import Path

import numpy as np
from amaranth import Value
from numpy.typing import NDArray
from vcd import VCDWriter

from .design import Design
from .engines import PERIOD

__all__ = ["write_pins"]


def write_pins(path: str | PathLike[str], design: Design, rows: Mapping[str, NDArray]) -> None:
    """Write a VCD of the ports of a design, one row per clock, timed like an engine's waveform."""
    ports = {**design.inputs, **design.outputs}
    clocks = len(next(iter(rows.values())))
    events: list[tuple[int, int, str, int]] = []
    for clock in range(clocks):
        events += [(clock * PERIOD, 0, "clk", 0), (clock * PERIOD + PERIOD // 2, 0, "clk", 1)]
    events.append((clocks * PERIOD, 0, "clk", 0))
    for name, levels in rows.items():
        values = np.asarray(levels).astype(np.uint64)
        changes = np.flatnonzero(np.r_[True, values[1:] != values[:-1]])
        # Outputs change at the rising edge, and inputs at the falling one.
        early = PERIOD // 2 if name in design.outputs else 0
        events += [(max(0, int(row) * PERIOD - early), 1, name, int(values[row]))
                   for row in changes]
    with Path(path).open("w") as file, VCDWriter(file, timescale="1 ns") as writer:
        widths = {"clk": 1, **{name: len(Value.cast(ports[name])) for name in rows}}
        shown = {name: writer.register_var(design.name, name, "wire", width, 0)
                 for name, width in widths.items()}
        for time, _, name, value in sorted(events):
            writer.change(shown[name], time, value)
