"""Processes for long work that can be interrupted, and goes on where it was."""

import signal
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context

__all__ = ["pool"]


@contextmanager
def pool(jobs: int) -> Iterator[ProcessPoolExecutor]:
    """Start so many processes, and end them, whatever they do, where the context ends.

    Ctrl-C is left to the process that starts them: it keeps what is known.
    """
    with ProcessPoolExecutor(jobs, get_context("spawn"), _ignore_interrupts) as made:
        try:
            yield made
        finally:
            made.shutdown(wait=False, cancel_futures=True)
            for process in list((getattr(made, "_processes", None) or {}).values()):
                process.terminate()


def _ignore_interrupts() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
