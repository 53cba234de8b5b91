"""Messages between the server of the page and the simulation, two processes."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["CORNER", "PIXEL", "Job", "Snapshot", "Window"]

#: A corner of the tool's path, in steps; bit 0 of the flags: the tool cut on the way to it.
CORNER = np.dtype([("x", "<i4"), ("y", "<i4"), ("flags", "u1")])

#: Number of a pixel: row * columns + column.
PIXEL = np.dtype("<u4")


@dataclass(frozen=True, eq=False)
class Job:
    """The picture that the board is programmed with.

    Attributes
    ----------
    pixels : array of bool
        Rows of pixels, true where to mill.
    name : str
        Name of the picture.
    period : int, optional
        Clocks per step. None for the default of the engine.
    """

    pixels: NDArray[np.bool_]
    name: str
    period: int | None = None


class Snapshot(NamedTuple):
    """The machine at one time, packed as frames of pages need it.

    Attributes
    ----------
    time, leds, display, motors : bytes
        Parts of a frame, by these names.
    path : bytes
        Corners that are fixed since the last snapshot, as `CORNER`.
    tip : bytes
        The place of the tool, as a `CORNER`.
    path_anew : bool
        Whether the path starts again with these.
    cut : bytes
        Pixels cut since the last snapshot, as `PIXEL`.
    cut_anew : bool
        Whether these are the first pixels of a new plate.
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
    """A recorded waveform: its file, first clock, clocks, requested clocks, and size in bytes."""

    path: str
    clock: int
    clocks: int
    requested: int
    size: int
