"""Makes machines, in a thread: it takes seconds, and the machine before goes on meanwhile."""

import threading
from dataclasses import replace

from tb.engines import AmaranthEngine, Engine, EngineError, build_with_fallback
from tb.milling import ready_to_mill

from .messages import Job

__all__ = ["Builder", "timing_of"]


def timing_of(engine: type[Engine]) -> tuple[int, int]:
    """Return the period, and the bits of the display's scan, at which a person can watch an engine.

    A machine should mill the example in a minute or so. The digits should each have their turn in
    far less than the time of a picture on the page.
    """
    return (8, 4) if engine is AmaranthEngine else (4096, 8)


class Builder:
    """Builds one machine at a time, the one that was asked for last.

    Parameters
    ----------
    name : str, optional
        The engine. None for the fastest that runs here: if it fails, the slow one serves.

    Attributes
    ----------
    note : str or None
        Why the slow engine serves, if the machine that was made last has it for that.
    """

    def __init__(self, name: str | None) -> None:
        self._name = name
        self._wanted: tuple[int, Job] | None = None
        self._building = False
        self._lock = threading.Lock()
        self._built: list[tuple[int, Job, int, Engine | EngineError]] = []
        self.note: str | None = None

    @property
    def building(self) -> bool:
        """Whether something is under way."""
        with self._lock:
            return self._building or bool(self._built)

    def want(self, number: int, job: Job) -> None:
        """Ask for a machine."""
        with self._lock:
            self._wanted = number, job
            if not self._building:
                self._building = True
                threading.Thread(target=self._work, name="board builder", daemon=True).start()

    def built(self) -> tuple[int, Job, int, Engine | EngineError] | None:
        """Return the number, the job with its period, the scan, and what came of it; once."""
        with self._lock:
            return self._built.pop() if self._built else None

    def _work(self) -> None:
        while True:
            with self._lock:
                if self._wanted is None:
                    self._building = False
                    return
                number, job = self._wanted
                self._wanted = None
            self.note = None
            made = self._make(job)
            with self._lock:
                for *_, old in self._built:
                    if isinstance(old, Engine):
                        old.close()
                self._built = [(number, *made)]

    def _make(self, job: Job) -> tuple[Job, int, Engine | EngineError]:
        try:
            made, self.note = build_with_fallback(self._name, lambda kind: _ready(job, kind))
            return made
        except EngineError as error:
            return job, 0, error
        except Exception as error:  # a mistake of ours must be seen, and the page must live
            return job, 0, EngineError(f"{type(error).__name__}: {error}")


def _ready(job: Job, kind: type[Engine]) -> tuple[Job, int, Engine]:
    period, scan_bits = timing_of(kind)
    job = replace(job, period=job.period or period)
    assert job.period is not None
    return job, scan_bits, ready_to_mill(
        job.pixels, kind, period=job.period, scan_bits=scan_bits, traceable=True)
