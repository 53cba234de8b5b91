"""Serial ports, by pyserial."""

import errno
import os
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any, TypeVar

from .errors import LineLost
from .session import BAUD

__all__ = ["BAUD", "PSEUDO_TERMINALS", "Port", "find_ports", "opened"]

T = TypeVar("T")

#: What pyserial raises where a port is gone, or (the last two) closed meanwhile.
_GONE = (OSError, TypeError, AttributeError)

#: Seconds that a read waits for the first byte.
READ_TIMEOUT_S = 0.05

#: How names of pseudo-terminals begin. A name may be another's when it is gone.
PSEUDO_TERMINALS = "/dev/pts/"

#: Seconds that a break lasts at least, longer than the bytes take that are in the port itself; and
#: the bits of it, and of the rest behind it: more than two bytes, and than one.
BREAK_S = 0.02
BREAK_BITS, REST_BITS = 25, 15

MOST_AT_ONCE = 4096

#: Seconds that a write may wait for a line that takes nothing.
WRITE_TIMEOUT_S = 2.0


class Port:
    """A serial port that is open, and locked, so that no other that is locked can be opened on it.

    Two programs on one line would mix their words.

    Parameters
    ----------
    name : str or path
        What pyserial's ``serial_for_url`` takes: ``/dev/ttyUSB0``, ``COM3``,
        ``socket://127.0.0.1:4000``.
    baud : int
        Bits a second.

    Raises
    ------
    LineLost
        If it cannot be opened, or pyserial is missing.
    """

    def __init__(self, name: str | os.PathLike[str], baud: int = BAUD) -> None:
        self.name, self.baud = name, baud = os.fspath(name), baud
        self._closed = False
        try:
            import serial  # only needed for a machine
        except ImportError as error:
            raise LineLost("pyserial is missing: pip install -e '.[host]'") from error
        self._lock = threading.Lock()
        try:
            self._serial: Any = serial.serial_for_url(
                name, baudrate=baud, timeout=READ_TIMEOUT_S, write_timeout=WRITE_TIMEOUT_S,
                exclusive=True)
        except (OSError, ValueError) as error:  # SerialException is an OSError
            why = _OURS if os.path.realpath(name) in _open else _why_closed(name, error)
            raise LineLost(f"{name} cannot be opened: {why}") from error
        self._place = os.path.realpath(name)
        _open.add(self._place)

    @property
    def waiting(self) -> bool:
        """Whether something has come."""
        return bool(self._gone(lambda: self._serial.in_waiting))

    def read(self) -> bytes:
        """Return what has come; wait a moment if that is nothing.

        Raises
        ------
        LineLost
            If the port is gone or closed.
        """
        return self._gone(lambda: self._serial.read(
            max(1, min(MOST_AT_ONCE, self._serial.in_waiting))))

    def write(self, data: bytes) -> None:
        """Send bytes.

        Raises
        ------
        LineLost
            If the port is gone or closed, or takes nothing.
        """
        with self._lock:
            self._gone(lambda: self._serial.write(data))

    @property
    def can_break(self) -> bool:
        """Whether `send_break` can do something."""
        return not os.path.realpath(self.name).startswith(PSEUDO_TERMINALS) and (
            not self.name.startswith("socket:"))

    def send_break(self) -> None:
        """Hold the line low for longer than two bytes, if the port can.

        What was not sent yet is lost. If the port is gone, the next `write` says so.
        """
        if self.can_break:
            with suppress(*_GONE):
                self._serial.reset_output_buffer()
            self._hold_low()

    def _hold_low(self) -> None:
        """Do so. The simulation's port has a way of its own to it: tools.panel.simulated."""
        with suppress(*_GONE):  # some converters refuse
            self._serial.break_condition = True
            time.sleep(max(BREAK_S, BREAK_BITS / self.baud))
        with suppress(*_GONE):
            self._serial.break_condition = False
        time.sleep(REST_BITS / self.baud)

    def _gone(self, work: Callable[[], T]) -> T:
        try:
            return work()
        except _GONE as error:
            why = "was closed" if self._closed else f"is gone: {_reason(error)}"
            raise LineLost(f"{self.name} {why}") from error

    def close(self) -> None:
        """Let go of it. Closing twice does nothing."""
        if not self._closed:
            self._closed = True
            _open.discard(self._place)
            with suppress(OSError):
                self._serial.close()


def opened(port: str | os.PathLike[str] | Port) -> Port:
    """Return a port that is open; open it if it is a name."""
    return Port(port) if isinstance(port, (str, os.PathLike)) else port


def find_ports() -> list[str]:
    """Return the names of the serial ports that the system knows, those on USB first."""
    from serial.tools.list_ports import comports

    found = sorted(comports(), key=lambda port: (port.vid is None, port.device))
    return [port.device for port in found]


#: Real paths of the ports that this program has open.
_open: set[str] = set()

_OURS = "this program has it open already; close that object first"
_IN_USE = "another program has it open; end that first"
_WHY: dict[object, str] = {
    errno.ENOENT: "there is no such port; is it plugged in?",
    errno.EACCES: "you may not; on Linux, join the group dialout",
    errno.EAGAIN: _IN_USE,  # locked
    errno.EBUSY: _IN_USE,
    errno.ENOTTY: "it is no serial port",
    errno.ECONNREFUSED: "no program listens there",
}


def _why_closed(name: str, error: Exception) -> str:
    """Return why a port cannot be opened, and what to do."""
    number = getattr(error, "errno", None)
    if number is None and error.__context__ is not None:  # pyserial says some only in its text
        number = next(iter(error.__context__.args), None)
    if number == errno.ENOENT and name.startswith(PSEUDO_TERMINALS):
        return "there is no such port; python -m tools.serve prints another each time"
    return _WHY.get(number) or _reason(error)


def _reason(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error) or type(error).__name__
