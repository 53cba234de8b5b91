"""Strike a machine so often, on all cores."""

import queue
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing, contextmanager
from itertools import islice

import numpy as np
from numpy.typing import NDArray

from fresa.machines.mill import MillPace
from tb import boards
from tb.design import Design
from tb.faults.upsets import Silent, Trial, Verdict, WrongReset
from tb.faults.work import Rows, actions, rows_of_actions, rows_of_stimulus
from tb.stimulus import chance, orders

from .results import Flips, Resets

__all__ = ["KEPT", "PACE", "SHOWN", "TRAVEL", "machine", "run_flips", "run_resets"]

PACE = MillPace(period=4, scan_bits=3)
TRAVEL = 6
"""Every time is shortened, so that much happens in few clocks."""

FLIPS = 20_000
"""Upsets of a chunk: each chunk has work of its own."""

PIECES = 150
"""Pieces of work of a chunk."""

RESETS = 500
"""Resets of a chunk."""

SHOWN = 20
"""Silent upsets that are told of."""

KEPT = ("black", "orange", "rest", "started",
        "fault", "seen", "apart_x_before", "apart_y_before", "apart_z_before")
"""What a reset does not set: where the motors stand, how long ago they stepped, that `start` has
been taken; and of the guard what it must remember over a reset."""


def machine(*, guard: bool) -> Design:
    """Give the raw machine that is struck."""
    return boards.mill(pace=PACE, z_travel=TRAVEL, guard=guard)


def run_resets(count: int, seed: int, *, guard: bool, jobs: int,
               advance: Callable[[int], object]) -> Resets:
    """Reset a machine so often.

    Parameters
    ----------
    count : int
        Resets.
    seed : int
        Of the work, and of when and how long it is reset.
    guard : bool
        Whether the machine has its guard.
    jobs : int
        Cores to use.
    advance : callable
        Is told how many resets are done.
    """
    def chunk(trial: Trial, number: int, size: int) -> tuple[int, int, WrongReset | None]:
        rng = np.random.default_rng([seed, number])
        trial.load(_work_to_reset(seed, number))
        return trial.resets(rng.integers(1, 121, size).tolist(),
                            rng.choice([1, 1, 1, 2, 3, 4, 30], size).tolist(), KEPT)

    result = Resets(guard)
    with _machines(guard, jobs) as trials:
        began = time.perf_counter()
        for size, (clocks, steps, wrong) in _in_order(trials, count, RESETS, chunk):
            result.resets += size
            result.clocks += clocks
            result.steps += steps
            result.wrong += [wrong] if wrong else []
            advance(size)
        result.seconds = time.perf_counter() - began
    return result


def _work_to_reset(seed: int, number: int) -> Rows:
    """Orders that wait for the machine in one chunk, pins at random in the next."""
    if number % 2:
        return rows_of_stimulus(chance(seed, number, 40_000))
    return rows_of_actions(islice(orders(seed * 1_000_003 + number), 200))


def run_flips(count: int, seed: int, *, guard: bool, jobs: int,
              advance: Callable[[int], object]) -> Flips:
    """Upset a machine so often; see :func:`run_resets`."""
    def chunk(trial: Trial, number: int, size: int
              ) -> tuple[int, NDArray[np.int64], list[Silent]]:
        trial.load(rows_of_actions(actions(seed * 1_000_003 + number, PIECES)))
        clocks = trial.work()
        return clocks, *trial.flips(seed, number * FLIPS, size)

    with _machines(guard, jobs) as trials:
        registers = trials[0].registers
        result = Flips(guard, registers, np.zeros((len(registers), len(Verdict)), np.int64))
        began = time.perf_counter()
        for size, (clocks, verdicts, silent) in _in_order(trials, count, FLIPS, chunk):
            result.clocks += clocks
            result.verdicts += verdicts
            result.silent += silent[: SHOWN - len(result.silent)]
            advance(size)
        result.seconds = time.perf_counter() - began
    return result


@contextmanager
def _machines(guard: bool, count: int) -> Iterator[list[Trial]]:
    """Make so many machines alike, one for each core."""
    with ExitStack() as stack:
        design = machine(guard=guard)
        yield [stack.enter_context(closing(Trial(design))) for _ in range(count)]


def _in_order(trials: Sequence[Trial], count: int, most: int, chunk: Callable
              ) -> Iterator[tuple[int, tuple]]:
    """Do `count` things in chunks on all cores; give size and result of each, in their order.

    The loops let go of Python while they run, so threads will do, each with a machine of its own.
    """
    sizes = [min(most, count - done) for done in range(0, count, most)]
    free: queue.SimpleQueue[Trial] = queue.SimpleQueue()
    for trial in trials:
        free.put(trial)

    def run(number: int, size: int) -> tuple:
        trial = free.get()
        try:
            return chunk(trial, number, size)
        finally:
            free.put(trial)

    with ThreadPoolExecutor(len(trials)) as pool:
        tasks = [pool.submit(run, *task) for task in enumerate(sizes)]
        try:
            for size, task in zip(sizes, tasks, strict=True):
                yield size, task.result()
        except BaseException:
            pool.shutdown(cancel_futures=True)
            raise
