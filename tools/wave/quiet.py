"""Suppress output that a native library writes past Python."""

import gc
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress

__all__ = ["muffled", "uncollected"]

_muffling = threading.Lock()


@contextmanager
def muffled() -> Iterator[None]:
    """Redirect stdout and stderr of the process to nothing, below Python."""
    with _muffling:
        for stream in (sys.stdout, sys.stderr):
            if stream is not None:
                with suppress(OSError, ValueError):
                    stream.flush()
        kept: dict[int, int] = {}
        sink = os.open(os.devnull, os.O_WRONLY)
        try:
            for number in (1, 2):
                with suppress(OSError):  # closed by the caller
                    kept[number] = os.dup(number)
                    os.dup2(sink, number)
            yield
        finally:
            for number, copy in kept.items():
                os.dup2(copy, number)
                os.close(copy)
            os.close(sink)


@contextmanager
def uncollected() -> Iterator[None]:
    """Keep the garbage collector from scanning millions of pairs that cannot form cycles."""
    was = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()
