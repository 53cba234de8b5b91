"""A line to `positioner` that is open: what is sent, and what is heard in between."""

import sys
import threading
from collections.abc import Callable

from .errors import LineLost
from .lines import LineSplitter
from .port import Port
from .positioner_lines import AXES, Limit, Refusal, Steps, read_line, stop

__all__ = ["PositionerLink"]


class PositionerLink:
    """A line to a positioner. It never waits for the machine; see `Positioner` for what does.

    Parameters
    ----------
    port : str or Port
        The serial port; see `Port`.
    heard : callable
        Called with all that the machine says, in a thread of its own. What it raises is told as
        that of any thread is, by `threading.excepthook`; the machine is heard on.
    lost : callable
        Called once if the port is gone or takes nothing, there or by `send`.

    Attributes
    ----------
    name : str
        Name of the port.

    Raises
    ------
    LineLost
        If the port cannot be opened.
    """

    def __init__(self, port: str | Port, *, heard: Callable[[Steps | Refusal | Limit], None],
                 lost: Callable[[LineLost], None]) -> None:
        self._port = Port(port) if isinstance(port, str) else port
        self._heard, self._lost = heard, lost
        self.name = self._port.name
        self._closed = self._told = False
        self._lock = threading.Lock()
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def send(self, orders: bytes) -> None:
        """Send orders, of `positioner_lines`.

        Raises
        ------
        LineLost
            If the port is gone, or takes nothing: who knows then what of an order went out.
        """
        try:
            self._port.write(orders)
        except LineLost as error:
            self._lose(error)
            raise

    @property
    def can_break(self) -> bool:
        """Whether the port can send a break."""
        return self._port.can_break

    def halt(self) -> None:
        """End all movement: by a break, if the port can, and by order.

        The break does not wait for what stands in the line, which is lost. The machine then refuses
        one line, as `DAMAGED`.

        Raises
        ------
        LineLost
            See `send`.
        """
        # The line that the break has damaged goes on until the first of these ends it.
        lost = stop(AXES[:1]) if self.can_break else b""
        self._port.send_break()
        self.send(lost + stop())

    def close(self) -> None:
        """Let go of the port. What moves goes on."""
        self._closed = True
        if self._thread is not threading.current_thread():
            self._thread.join()
        self._port.close()

    @property
    def baud(self) -> int:
        """Bits a second."""
        return self._port.baud

    def _listen(self) -> None:
        splitter = LineSplitter()
        while not self._closed:
            try:
                lines = splitter.feed(self._port.read())
            except LineLost as error:
                self._lose(error)
                return
            for line in lines:
                if (said := read_line(line)) is not None:
                    self._hand_on(said)

    def _hand_on(self, said: Steps | Refusal | Limit) -> None:
        try:
            self._heard(said)
        except Exception:  # a mistake of whoever listens must not make the machine unheard
            threading.excepthook(threading.ExceptHookArgs(
                (*sys.exc_info(), threading.current_thread())))

    def _lose(self, error: LineLost) -> None:
        with self._lock:
            told, self._told = self._told, True
        if not told:
            self._lost(error)
