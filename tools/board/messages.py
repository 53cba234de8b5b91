"""Messages between the page's server and the simulation, two processes."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["CORNER", "PIXEL", "Job", "Snapshot", "Window"]

#: A corner of the tool's path, in steps; bit 0 of the flags: the line to it was cut.
CORNER = np.dtype([("x", "<i4"), ("y", "<i4"), ("flags", "u1")])

#: Number of a pixel: row * columns + column.
PIXEL = np.dtype("<u4")


@dataclass(frozen=True, eq=False)
class Job:
    """What the board is programmed with.

    Attributes
    ----------
    pixels : array of bool
        Rows of pixels, true where to mill.
    name : str
        Name of the picture.
    period : int, optional
        Clocks from step to step. None for one that suits the engine.
    """

    pixels: NDArray[np.bool_]
    name: str
    period: int | None = None


class Snapshot(NamedTuple):
    """The machine at a moment, packed as pages get it.

    Attributes
    ----------
    time, leds, display, motors : bytes
        The parts of a frame of these names.
    path : bytes
        Corners that are fixed since the last snapshot, as `CORNER`.
    tip : bytes
        Where the tool is, as a `CORNER`.
    path_anew : bool
        Whether the path begins with these.
    cut : bytes
        Pixels cut since the last snapshot, as `PIXEL`.
    cut_anew : bool
        Whether these are the first on the plate.
    """

    time: bytes
    leds: bytes
    display: bytes
    motors: bytes
    path: bytes
    tip: bytes
    path_anew: bool
    cut: bytes
    cut_anew: bool


class Window(NamedTuple):
    """A waveform that was recorded: its file, first clock, clocks, clocks asked for, and bytes."""

    path: str
    clock: int
    clocks: int
    asked: int
    size: int
