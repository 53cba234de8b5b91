"""Builds machines in a thread: it takes seconds, and the machine before runs meanwhile."""

import threading
from dataclasses import replace

from tb.engines import AmaranthEngine, Engine, EngineError, build_with_fallback
from tb.milling import ready_to_mill

from .messages import Job

__all__ = ["Builder", "timing_of"]


def timing_of(engine: type[Engine]) -> tuple[int, int]:
    """Return the step period and the bits of the display's scan counter that suit an engine.

    The machine should mill the example in about a minute, and the display be scanned in far less
    than the time between two frames of the page.
    """
    return (8, 4) if engine is AmaranthEngine else (4096, 8)


class Builder:
    """Builds one machine at a time, the one that was requested last.

    Parameters
    ----------
    name : str, optional
        The engine. None for the fastest available: if it fails, the slow one is used.

    Attributes
    ----------
    note : str or None
        Why the last machine runs on the slow engine, if it was built with fallback.
    """

    def __init__(self, name: str | None) -> None:
        self._name = name
        self._requested: tuple[int, Job] | None = None
        self._building = False
        self._lock = threading.Lock()
        self._built: list[tuple[int, Job, int, Engine | EngineError]] = []
        self.note: str | None = None

    @property
    def building(self) -> bool:
        """Whether a build is under way."""
        with self._lock:
            return self._building or bool(self._built)

    def request(self, number: int, job: Job) -> None:
        """Request a machine."""
        with self._lock:
            self._requested = number, job
            if not self._building:
                self._building = True
                threading.Thread(target=self._work, name="board builder", daemon=True).start()

    def built(self) -> tuple[int, Job, int, Engine | EngineError] | None:
        """Return the number, the job with its period, the scan bits and the result; each once."""
        with self._lock:
            return self._built.pop() if self._built else None

    def _work(self) -> None:
        while True:
            with self._lock:
                if self._requested is None:
                    self._building = False
                    return
                number, job = self._requested
                self._requested = None
            self.note = None
            result = self._make(job)
            with self._lock:
                for *_, stale in self._built:
                    if isinstance(stale, Engine):
                        stale.close()
                self._built = [(number, *result)]

    def _make(self, job: Job) -> tuple[Job, int, Engine | EngineError]:
        try:
            result, self.note = build_with_fallback(self._name, lambda kind: _ready(job, kind))
            return result
        except EngineError as error:
            return job, 0, error
        except Exception as error:  # a bug must be shown, and the page stay up
            return job, 0, EngineError(f"{type(error).__name__}: {error}")


def _ready(job: Job, kind: type[Engine]) -> tuple[Job, int, Engine]:
    period, scan_bits = timing_of(kind)
    job = replace(job, period=job.period or period)
    assert job.period is not None
    return job, scan_bits, ready_to_mill(
        job.pixels, kind, period=job.period, scan_bits=scan_bits, traceable=True)
