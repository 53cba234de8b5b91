"""A session driven by a port and a thread, for programs whose calls wait."""

import sys
import threading
import time
from collections.abc import Callable
from typing import TypeVar

from .errors import LineLost
from .port import Port
from .positioner_session import PositionerSession
from .positioner_state import Message
from .session import Waiting

__all__ = ["Driver"]

T = TypeVar("T")


class Driver:
    """Reads a port in a thread, and lets calls of any thread wait for what comes of it.

    Parameters
    ----------
    port : Port
        The serial port.
    session : PositionerSession
        What is done on it. It is only touched in calls of this.
    on_message : callable
        Called with each message, in the thread that reads, with no lock held. What it raises is
        handed to `threading.excepthook`; reading goes on.
    """

    def __init__(self, port: Port, session: PositionerSession,
                 on_message: Callable[[Message], None]) -> None:
        self._port, self._session, self._on_message = port, session, on_message
        self._changed = threading.Condition()
        self._closed = False
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def run(self, steps: Waiting[T]) -> T:
        """Carry out an operation of the session; return its result, or raise its error."""
        with self._changed:
            operation = self._session.begin(steps, time.monotonic())
            try:
                while True:
                    self._send()
                    if operation.done:
                        return operation.result()
                    self._wait(operation.deadline)
                    self._session.tick(time.monotonic())
            finally:
                operation.cancel()

    def do(self, work: Callable[..., T], *args: object) -> T:
        """Do at once what the session does, given the time last; return what it returns.

        Raises
        ------
        LineLost
            If the line is gone.
        """
        with self._changed:
            result = work(*args, time.monotonic())
            self._send()
            self._changed.notify_all()
            if self._session.lost is not None:
                raise self._session.lost
            return result

    def wait(self, holds: Callable[[], bool], patience: float) -> None:
        """Wait until something holds of the session, for so many seconds at most."""
        with self._changed:
            self._changed.wait_for(holds, patience)

    def close(self) -> None:
        """Let go of the port. What moves goes on; what waits or is called from now on fails."""
        self._closed = True
        with self._changed:
            self._lose(LineLost(f"{self._port.name} was closed"))
        if self._thread is not threading.current_thread():
            self._thread.join()
        self._port.close()

    def _wait(self, deadline: float) -> None:
        self._changed.wait(min(max(0.0, deadline - time.monotonic()), threading.TIMEOUT_MAX))

    def _send(self) -> None:
        try:
            for data, after_break in self._session.take_outputs():
                if after_break:
                    self._port.send_break()
                self._port.write(data)
        except LineLost as error:
            self._lose(error)

    def _lose(self, error: LineLost) -> None:
        self._session.lose(error)
        self._changed.notify_all()

    def _listen(self) -> None:
        while not self._closed:
            try:
                data = self._port.read()
            except LineLost as error:
                with self._changed:
                    self._lose(error)
                return
            if data:
                with self._changed:
                    messages = self._session.receive(data, time.monotonic())
                    self._send()
                    self._changed.notify_all()
                for message in messages:
                    self._hand_on(message)

    def _hand_on(self, message: Message) -> None:
        try:
            self._on_message(message)
        except Exception:  # a mistake of the listener must not make the machine unheard
            threading.excepthook(threading.ExceptHookArgs(
                (*sys.exc_info(), threading.current_thread())))
