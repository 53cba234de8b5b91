"""`VPlotter`: a hanging plotter behind a serial line, from Python."""

import os
from collections.abc import Sequence

from .errors import Refused, TimedOut
from .gcode import GCode
from .gcode_lines import STATUS, Position
from .gcode_session import POLL_S, GCodeSession
from .port import Port
from .session import Waiting

__all__ = ["BAUD", "VPlotter", "VPlotterSession"]

BAUD = 9600
"""Bits a second of the line, unless it was built with another rate."""

HOME_S = 900.0
"""Seconds that a homing cycle may take: it winds metres of string, slowly."""

#: What it says while a command goes on; others of its texts end it.
GOES_ON = ("Homing motor ", "Going to the ", "Drawing.", "[")


class VPlotterSession(GCodeSession):
    """A hanging plotter on a line, which takes commands of the thesis beside lines of G-code."""

    def ask(self, line: str, timeout: float | None = None, *, clear: bool = False
            ) -> Waiting[list[str]]:
        """Do as the session of G-code does; a command would end otherwise than a line of it."""
        _no_command(line)
        return (yield from super().ask(line, timeout, clear=clear))

    def stream(self, blocks: Sequence[tuple[int, str]], *, line_by_line: bool = False
               ) -> Waiting[None]:
        """Do as the session of G-code does, and refuse commands in the same way."""
        for number, text in blocks:
            _no_command(text, f"line {number}: ")
        yield from super().stream(blocks, line_by_line=line_by_line)

    def order(self, command: str, ends: str | tuple[str, ...]) -> Waiting[str]:
        """Send a command, when all lines are answered; return the text that ends it.

        Parameters
        ----------
        command : str
            Such as ``:I05000500``.
        ends : str or tuple of str
            How the text begins that says that it is done, or how it may begin.

        Raises
        ------
        Refused
            If another text comes: it says why.
        """
        self._begin()
        yield from self._answered()
        self._texts = []
        seen, poll = 0, self.now + POLL_S
        self._send(f"{command}\n".encode("ascii"))
        while True:
            for text in self._texts[seen:]:
                if text.startswith(ends):
                    return text
                if text and not text.startswith(GOES_ON):
                    raise Refused(command, text)
            seen = len(self._texts)
            self._check()
            if self.now - self._received_at >= self._timeout:
                raise TimedOut(f"{command!r} is not answered after {self._timeout:g} s")
            if self.now >= poll:
                poll = self.now + POLL_S
                self._send(STATUS)
            yield poll

    def power(self, *, on: bool) -> Waiting[None]:
        """Power the motors, or release them; waking up is a reset."""
        yield from self.order(f":P{on:d}", "Motors powered." if on else "Motors released")
        yield from self._pause()
        self._clear()


class VPlotter(GCode):
    """A pen that hangs from two strings: G-code as for `GCode`, and lines from point to point.

    Points are in whole mm from the upper left corner, x to the right and y down; in G-code y is up,
    from the lower edge of the wall.

    Parameters
    ----------
    port : str, path or Port
        The serial port, such as ``/dev/ttyUSB0``; see `Port`.
    baud : int
        Bits a second, if `port` is not open yet.
    timeout : float
        Seconds within which the machine must send something when it is waited for.

    Raises
    ------
    MachineError
        As `GCode` does; and `Refused` if it does not obey a command, with what it says.

    Examples
    --------
    >>> with VPlotter("/dev/ttyUSB0") as plotter:   # doctest: +SKIP
    ...     plotter.home()
    ...     plotter.draw_line((500, 500), (900, 700))
    """

    _session: VPlotterSession

    def __init__(self, port: str | os.PathLike[str] | Port, *, baud: int = BAUD,
                 timeout: float = 5.0) -> None:
        super().__init__(port, baud=baud, timeout=timeout)

    @classmethod
    def _new_session(cls, port: Port, timeout: float) -> VPlotterSession:
        return VPlotterSession(name=port.name, baud=port.baud, timeout=timeout)

    def home(self, timeout: float = HOME_S) -> Position:
        """Find where the strings end, and go to the place of rest; return where that is.

        Parameters
        ----------
        timeout : float
            Seconds that it may take.
        """
        return super().home(timeout)

    def power(self, *, on: bool) -> None:
        """Power the motors, or release them: then the place is unknown.

        It has to be powered, and to home, before it moves again.
        """
        self._run(self._session.power(on=on))

    def go(self, point: tuple[int, int]) -> None:
        """Go to a point with the pen off, and wait until it is there."""
        self._run(self._session.order(f":I{_digits(point)}", "At the start point."))

    def draw_line(self, start: tuple[int, int], end: tuple[int, int]) -> None:
        """Go to a point, draw a line from there to another, and wait until it is drawn."""
        command = f":F{_digits(end)}"
        self.go(start)
        self._run(self._session.order(command, "Line drawn."))

    @property
    def states(self) -> tuple[int, int, int]:
        """State bytes of the master and of the motors: see docs/vplotter.md."""
        master, left, right = (int(self._run(self._session.order(f":S{number}", tuple(
            f"{state:02X}" for state in range(64)))), 16) for number in range(3))
        return master, left, right


def _no_command(line: str, where: str = "") -> None:
    """Raise ValueError for a command, which is no line of G-code."""
    if line.lstrip().startswith(":"):
        raise ValueError(f"{where}{line.strip()!r} is a command of the plotter, not G-code: see "
                         "go, draw_line, home, power and states")


def _digits(point: tuple[int, int]) -> str:
    """Return the digits of a point in a command."""
    if not (isinstance(point, Sequence) and len(point) == 2):
        raise ValueError(f"a point has two whole numbers of mm, x and y, not {point!r}")
    for name, place in zip("xy", point, strict=True):
        if not (isinstance(place, int) and not isinstance(place, bool) and 0 <= place <= 9999):
            raise ValueError(f"{name} must be a whole number of mm from 0 to 9999, not {place!r}")
    return "".join(f"{place:04}" for place in point)
