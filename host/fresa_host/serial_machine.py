"""What machines behind a serial line have in common: a port, a session, one call at a time."""

import threading
import time
from collections.abc import Callable
from typing import Generic, Self, TypeVar

from .port import Port
from .session import Session, Waiting

__all__ = ["SerialMachine"]

S = TypeVar("S", bound=Session)
T = TypeVar("T")

#: Reads at most of what came before a call.
STALE_READS = 16


class SerialMachine(Generic[S]):
    """A machine on a port, which operations of a session use one after the other.

    Parameters
    ----------
    port : Port
        Where it is.
    session : Session
        What is said.
    opening : operation
        The first operation. If it fails, the port is closed.
    """

    def __init__(self, port: Port, session: S, opening: Waiting[object]) -> None:
        self._port = port
        self._session = session
        self._lock = threading.Lock()
        try:
            self._run(opening)
        except BaseException:
            self.close()
            raise

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._port.name!r})"

    def close(self) -> None:
        """Let go of the port. What the machine was sent is carried out: `stop` first."""
        self._port.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        try:
            if kind is not None:
                self._stop_somehow()
        finally:
            self.close()

    def _stop_somehow(self) -> None:
        """Stop, since an exception ends a ``with`` block; raise nothing of the machine's."""
        raise NotImplementedError

    def _run(self, steps: Waiting[T], watch: Callable[[], None] = lambda: None) -> T:
        """Carry out an operation of the session, and what came before it."""
        with self._lock:
            for _ in range(STALE_READS):
                if self._port.waiting:
                    self._session.receive(self._port.read(), time.monotonic())
            operation = self._session.begin(steps, time.monotonic())
            try:
                while True:
                    self._write()
                    watch()
                    if operation.done:
                        return operation.result()
                    self._session.receive(self._port.read(), time.monotonic())
            finally:
                operation.cancel()

    def _write(self) -> None:
        for data, _ in self._session.take_outputs():
            self._port.write(data)
