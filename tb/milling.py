"""A picture milled in simulation, with the whole board: from its switches to its coils."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from fresa.clock import CLOCK
from fresa.machines import MillStation
from fresa.machines.mill import PIXEL_STEPS, TOP_SPEED, Z_TRAVEL, MillTiming, step_period
from fresa.motion import CoordinateGenerator

from .boards import board
from .engines import Engine
from .machines.mill import AUTOMATIC
from .plant import Plant

__all__ = ["AUTOMATIC", "BUTTON", "DEBOUNCE", "LED", "SETTLE", "Cut", "mill_picture", "press",
           "ready_to_mill", "run_job"]

BUTTON = {"reset": 1 << 0, "start": 1 << 1, "stop": 1 << 3}
LED = {"busy": 1 << 5, "error": 1 << 6, "ready": 1 << 7}
DEBOUNCE = 2
"""Debouncing time in simulated clocks; the board's is 500 000 times as long."""

SETTLE = 2 * DEBOUNCE + 4
"""Clocks within which the machine has sampled a change of a contact."""

SLICE = 0.2
"""Seconds that the engine runs between two reports of progress."""


def press(engine: Engine, button: str) -> None:
    """Press a button of the board and release it, each long enough to be sampled."""
    for level in (BUTTON[button], 0):
        engine.set(buttons=level)
        engine.run(SETTLE)


@dataclass(frozen=True)
class Cut:
    """The result of milling a picture.

    Attributes
    ----------
    target : array of bool
        Pixels to mill.
    plant : Plant
        The simulated motors, tool and plate.
    period : int
        Clocks per step in the simulation.
    clocks : int
        Clocks simulated, from power-up.
    seconds : float
        Time that the simulation took, without building the engine.
    engine : str
        Name of the engine.
    """

    target: NDArray[np.bool_]
    plant: Plant
    period: int
    clocks: int
    seconds: float
    engine: str

    @property
    def missed(self) -> int:
        """Target pixels that were not milled."""
        return int(np.count_nonzero(self.target & ~self.plant.cut))

    @property
    def in_error(self) -> int:
        """Other pixels that were milled, and steps in the plate outside target pixels."""
        return int(np.count_nonzero(self.plant.cut & ~self.target)) + self.plant.wrong_steps

    @property
    def right(self) -> bool:
        """Whether the cut is the picture, every word was legal, and the tool is back and raised."""
        plant = self.plant
        return not (self.missed or self.in_error or plant.faults) and plant.position == (0, 0, 0)

    def job_seconds(self, step_rate: Fraction = TOP_SPEED, clock: int = CLOCK) -> float:
        """Return the seconds of the job on the real machine, by default at its top speed.

        Every step takes the real period instead of the simulated one; the other clocks stay.
        """
        plant = self.plant
        made = plant.air.steps + plant.milled.steps + plant.steps["axis_z"]
        return (self.clocks + made * (step_period(step_rate, clock) - self.period)) / clock

    def facts(self) -> dict[str, object]:
        """Return the figures for JSON."""
        plant = self.plant
        return {
            "engine": self.engine,
            "rows": self.target.shape[0],
            "columns": self.target.shape[1],
            "pixels_asked": int(np.count_nonzero(self.target)),
            "pixels_cut": int(np.count_nonzero(plant.cut)),
            "pixels_missed": self.missed,
            "cut_in_error": self.in_error,
            "coil_faults": len(plant.faults),
            "strokes": plant.lifts,
            "steps": {axis[-1]: steps for axis, steps in plant.steps.items()},
            "milled_mm": round(plant.milled.mm, 3),
            "air_steps": plant.air.steps,
            "air_mm": round(plant.air.mm, 3),
            "job_seconds": round(self.job_seconds(), 3),
            "step_period": self.period,
            "least_period": min((n for n in plant.least.values() if n is not None), default=None),
            "clocks": self.clocks,
            "simulation_seconds": round(self.seconds, 3),
            "clocks_per_second": round(self.clocks / max(self.seconds, 1e-9)),
        }


def ready_to_mill(
    picture: NDArray[np.bool_], engine: type[Engine], *, period: int = 1,
    vcd: str | PathLike[str] | None = None, guard: bool = False, scan_bits: int = 8,
    traceable: bool = False,
) -> Engine:
    """Build the mill on a Nexys 2, with a picture, on an engine.

    Parameters
    ----------
    picture : array of bool
        Rows of pixels, true where to mill.
    engine : type of Engine
        The engine. It may compile the design first.
    period : int
        Clocks per step; the real machine has some 500 000.
    vcd : path, optional
        Where to write a waveform of the whole job.
    guard : bool
        Whether the machine has a guard.
    scan_bits : int
        Binary logarithm of the clocks that each digit of the display is driven.
    traceable : bool
        Whether the engine can write waveforms of parts of its run.

    Raises
    ------
    EngineError
        If the engine is not available.
    """
    source = CoordinateGenerator(np.asarray(picture, bool).tolist(), pixel_steps=PIXEL_STEPS)
    machine = MillStation(source=source, timing=MillTiming(period=period, scan_bits=scan_bits),
                          guard=guard)
    design = board("mill", machine, debounce=DEBOUNCE)
    return engine(design, vcd=vcd, traceable=traceable)


def run_job(
    run: Engine, picture: NDArray[np.bool_], *, period: int = 1,
    progress: Callable[[int], None] | None = None,
) -> Cut:
    """Set SW7, press BTN1, and wait until LD5 is dark.

    Parameters
    ----------
    run : Engine
        From :func:`ready_to_mill`, with this picture and period.
    picture : array of bool
        The target picture.
    period : int
        Clocks per step.
    progress : callable, optional
        Called repeatedly with the number of pixels milled since the last call.

    Raises
    ------
    RuntimeError
        If the machine shows an error, or does not step although it is not done.
    """
    picture = np.asarray(picture, bool)
    plant = Plant(picture, pitch=PIXEL_STEPS, travel=Z_TRAVEL)
    # Copying the picture and then searching all of it takes no longer without a step.
    limit = (1 << 15) + 32 * max(picture.shape) ** 2 + 8 * period
    watch = ("axis_x", "axis_y", "axis_z", "leds")

    begun = time.perf_counter()
    plant.feed(run.run(0, watch))
    run.set(switches=AUTOMATIC)
    run.run(SETTLE)
    press(run, "start")
    slice_, done, moved_at = 1000, 0, run.clock
    while (leds := run.get("leds")) & LED["busy"]:
        if leds & LED["error"]:
            raise RuntimeError(f"the machine shows an error at clock {run.clock}")
        if run.clock - moved_at > limit:
            raise RuntimeError(f"the machine has made no step since clock {moved_at}")
        start = time.perf_counter()
        changes = run.run(slice_, watch, until={"leds": LED["ready"]})
        if len(changes):
            moved_at = int(changes.clock[-1])
        plant.feed(changes)
        milled = int(np.count_nonzero(plant.cut))
        if progress is not None:
            progress(milled - done)
        done = milled
        if time.perf_counter() - start < SLICE / 2:
            slice_ = min(2 * slice_, 1 << 20)
    plant.feed(run.run(2, watch))  # the pipeline to the pins
    seconds = time.perf_counter() - begun
    return Cut(picture, plant, period, run.clock, seconds, run.name)


def mill_picture(
    picture: NDArray[np.bool_], engine: type[Engine], *, period: int = 1,
    vcd: str | PathLike[str] | None = None, progress: Callable[[int], None] | None = None,
) -> Cut:
    """Mill a picture: :func:`ready_to_mill` and :func:`run_job`."""
    with ready_to_mill(picture, engine, period=period, vcd=vcd) as run:
        return run_job(run, picture, period=period, progress=progress)
