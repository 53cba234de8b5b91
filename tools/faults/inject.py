"""Inject faults into a machine, on all cores."""

import queue
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, closing, contextmanager

import numpy as np
from numpy.typing import NDArray

from tb.faults.target import FaultTarget
from tb.faults.upsets import Trial
from tb.faults.verdicts import Silent, Verdict, WrongReset

from .results import Resets, Upsets

__all__ = ["SHOWN", "run_upsets", "run_resets"]

RESETS = 500
"""Resets of a chunk: each chunk has work of its own."""

SHOWN = 20
"""Silent upsets that are listed."""

QUESTION_EVERY = 20
"""After one of so many resets a machine on a line must answer a question."""


def run_resets(machine: FaultTarget, count: int, seed: int, *, jobs: int,
               advance: Callable[[int], object]) -> Resets:
    """Reset a machine so often.

    Parameters
    ----------
    machine : Machine
        The machine.
    count : int
        Resets.
    seed : int
        Of the work, and of when and how long it is reset.
    jobs : int
        Cores to use.
    advance : callable
        Called with the number of resets done.
    """
    def chunk(trial: Trial, number: int, size: int) -> tuple[int, int, WrongReset | None]:
        rng = np.random.default_rng([seed, number])
        trial.load(machine.work_to_reset(seed, number))
        gaps = rng.integers(1, machine.gap + 1, size).tolist()
        lengths = rng.choice([1, 1, 1, 2, 3, 4, 30], size).tolist()
        questions = [machine.line is not None and place % QUESTION_EVERY == QUESTION_EVERY - 1
                     for place in range(size)]
        return trial.resets(gaps, lengths, questions)

    result = Resets(machine)
    with _trials(machine, jobs) as trials:
        began = time.perf_counter()
        for size, (clocks, steps, wrong) in _in_order(trials, count, RESETS, chunk):
            result.resets += size
            result.clocks += clocks
            result.steps += steps
            result.wrong += [wrong] if wrong else []
            advance(size)
        result.seconds = time.perf_counter() - began
    return result


def run_upsets(machine: FaultTarget, count: int, seed: int, *, jobs: int,
              advance: Callable[[int], object]) -> Upsets:
    """Upset a machine so often; see :func:`run_resets`."""
    def chunk(trial: Trial, number: int, size: int
              ) -> tuple[int, NDArray[np.int64], list[Silent]]:
        trial.load(machine.work(seed * 1_000_003 + number))
        clocks = trial.work()
        return clocks, *trial.upsets(seed, number * machine.shared, size)

    with _trials(machine, jobs) as trials:
        registers = trials[0].registers
        result = Upsets(machine, registers, np.zeros((len(registers), len(Verdict)), np.int64))
        began = time.perf_counter()
        for size, (clocks, verdicts, silent) in _in_order(trials, count, machine.shared, chunk):
            result.clocks += clocks
            result.verdicts += verdicts
            result.silent += silent[: SHOWN - len(result.silent)]
            advance(size)
        result.seconds = time.perf_counter() - began
    return result


@contextmanager
def _trials(machine: FaultTarget, count: int) -> Iterator[list[Trial]]:
    """Make so many of a machine, one for each core."""
    with ExitStack() as stack:
        yield [stack.enter_context(closing(Trial(machine))) for _ in range(count)]


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
