"""`GCode`: a machine that speaks the GRBL 1.1 protocol behind a serial line, from Python."""

import os
import re
from collections.abc import Callable, Iterable
from contextlib import suppress
from math import isfinite
from pathlib import Path

from .errors import MachineError
from .gcode_lines import BAUD, HOLD, JOG_CANCEL, RESUME, Position, Status, program
from .gcode_session import GCodeSession
from .port import Port
from .serial_machine import SerialMachine

__all__ = ["GCode"]


class GCode(SerialMachine[GCodeSession]):
    """A machine that carries out G-code, by the protocol of GRBL 1.1.

    All may be called from several threads: `hold`, `resume`, `end_jog` and `stop` act at once, the
    others wait for each other. Opening resets nothing, so the machine must stand then. Closing lets
    go of the port; what was sent is carried out. A ``with`` block that an exception ends, Ctrl-C
    for one, stops the machine.

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
    LineLost
        If the port cannot be opened, here; in all methods if it is gone or closed.
    TimedOut
        If the machine is silent, or an answer was lost, here and in all methods.
    BlockRefused
        In all methods, if the machine refuses a line.
    Alarmed
        In all methods that send lines or wait, once, if it has raised an alarm.
    WasReset
        In the same, once, if it was reset since the last call by something else than `stop`.
    JobStopped
        In the same, if another thread calls `stop`.

    Examples
    --------
    >>> with GCode("/dev/ttyUSB0") as machine:   # doctest: +SKIP
    ...     machine.home()
    ...     machine.stream(["G21 G90", "G1 X10 F600", "G2 X20 I5"])
    ...     machine.wait()
    ...     print(machine.position)
    """

    def __init__(self, port: str | os.PathLike[str] | Port, *, baud: int = BAUD,
                 timeout: float = 5.0) -> None:
        port = Port(port, baud) if isinstance(port, (str, os.PathLike)) else port
        session = self._new_session(port, timeout)
        super().__init__(port, session, session.open())

    @classmethod
    def _new_session(cls, port: Port, timeout: float) -> GCodeSession:
        return GCodeSession(name=port.name, baud=port.baud, timeout=timeout)

    def _stop_somehow(self) -> None:
        with suppress(MachineError):
            self.stop()

    @property
    def status(self) -> Status:
        """What the machine reports of itself."""
        return self._run(self._session.report())

    @property
    def state(self) -> str:
        """What it does: see `Status`."""
        return self.status.state

    @property
    def position(self) -> Position:
        """Where it is, in work coordinates: mm, or inches if it reports in them ($13)."""
        return self._run(self._session.place())

    @property
    def machine_position(self) -> Position:
        """Where it is, in the machine's coordinates, in the same unit."""
        return self._run(self._session.place(work=False))

    def command(self, line: str, timeout: float | None = None) -> list[str]:
        """Send a line, such as ``$$``; return the lines of the answer before its ``ok``.

        Parameters
        ----------
        line : str
            The line. What is moved by it goes on after its answer: see `wait`.
        timeout : float, optional
            Seconds that the answer may take. None for as long as the machine reports its status.

        Raises
        ------
        ValueError
            If it cannot be sent as one line.
        """
        return self._run(self._session.ask(line, timeout))

    def stream(self, source: str | os.PathLike[str] | Iterable[str],
               progress: Callable[[int, int], None] = lambda done, total: None, *,
               line_by_line: bool = False) -> None:
        """Send a program; return when each of its lines is answered. It may move after: see `wait`.

        Comments and empty lines are not sent. If a line is refused no more are sent, but up to 127
        bytes of lines behind it, which the machine has by then, are carried out if they can be.

        Parameters
        ----------
        source : path, or iterable of str
            A file, or lines.
        progress : callable
            Called with the lines answered, and all, whenever that has changed. What it raises ends
            the call; so does Ctrl-C. What was sent by then is carried out.
        line_by_line : bool
            Wait for the answer to each line before the next is sent. Then nothing behind one that
            is refused is carried out, but short movements may falter.

        Raises
        ------
        ValueError
            If a line cannot be sent: it is too long, or has characters that are real-time commands.
            Nothing was sent.
        OSError
            If the file cannot be read.
        """
        if isinstance(source, (str, os.PathLike)):
            source = Path(source).read_text(encoding="ascii", errors="replace").splitlines()
        blocks, shown = program(source), -1
        session = self._session

        def tell() -> None:
            nonlocal shown
            if session.total == len(blocks) and session.done != shown:
                shown = session.done
                progress(shown, session.total)

        self._run(session.stream(blocks, line_by_line=line_by_line), tell)

    def wait(self, timeout: float | None = None) -> None:
        """Wait until it stands, with all that it was sent done.

        Parameters
        ----------
        timeout : float, optional
            Seconds that it may take. None for as long as it takes, a hold included.

        Raises
        ------
        TimedOut
            If it moves or holds after that.
        """
        self._run(self._session.still(timeout))

    def jog(self, feed: float, *, x: float = 0, y: float = 0, z: float = 0) -> None:
        """Go by a distance that is no part of a program: see `end_jog`, and `wait`.

        It may follow another jog, but nothing else that moves.

        Parameters
        ----------
        feed : float
            In mm a minute.
        x, y, z : float
            In mm.

        Raises
        ------
        ValueError
            If one of them is no number.
        """
        self._run(self._session.ask(f"$J=G21G91{_way(feed, x, y, z)}"))

    def end_jog(self) -> None:
        """Slow down, stand, and forget what is left of jogs, at once. Do not wait for it."""
        self._port.write(JOG_CANCEL)

    def probe(self, feed: float, *, x: float = 0, y: float = 0, z: float = 0,
              away: bool = False) -> Position | None:
        """Go by a distance until the probe touches; return where it did, or None if it did not.

        It brakes then, and stands beyond that place, or has gone the whole distance. Modes are as
        before, but that of motion, which is G0, and F, which is `feed`.

        Parameters
        ----------
        feed : float
            In mm a minute.
        x, y, z : float
            In mm.
        away : bool
            It touches now; go until it does not.

        Returns
        -------
        Position, optional
            In the machine's coordinates: mm, or inches if it reports in them ($13).

        Raises
        ------
        ValueError
            If one of them is no number.
        Alarmed
            If the probe is already as it should become: nothing has moved. Or with any other alarm.
            Modes are then those of the probing: G21, G91, G94 and G38.3 or G38.5.
        """
        way = _way(feed, x, y, z)
        _, *modes = re.findall(r"G\d[\d.]*", " ".join(self.command("$G")))
        said = self.command(f"G21G91G94G38.{5 if away else 3}{way}")
        self.command("".join(["G0", *modes]))
        found = re.search(r"\[PRB:([-\d.]+),([-\d.]+),([-\d.]+):1\]", "".join(said))
        return Position(*map(float, found.groups())) if found else None

    def hold(self) -> None:
        """Slow down and stand, at once; a jog ends so. Do not wait for it."""
        self._port.write(HOLD)

    def resume(self) -> None:
        """Go on after `hold`, ``M0``, or an open door."""
        self._port.write(RESUME)

    def stop(self) -> None:
        """Slow down, stand, and forget what was sent (a soft reset). The position is kept.

        But a homing cycle, and a bowed line of a plotter, end at once, and the position is lost.
        What waits in other threads ends with a `JobStopped`. Modes are those of power-up then.
        """
        self._session.stopping = True
        self.hold()
        self._run(self._session.stop())

    def home(self, timeout: float = 120.0) -> Position:
        """Seek the home switches; return the machine's position then.

        Parameters
        ----------
        timeout : float
            Seconds that it may take.
        """
        self._run(self._session.ask("$H", timeout, clear=True))
        return self.machine_position

    def unlock(self) -> None:
        """End an alarm, without homing: the position may be wrong."""
        self._run(self._session.ask("$X", clear=True))


def _way(feed: float, x: float, y: float, z: float) -> str:
    """Return the words of a distance, and a feed."""
    numbers = {"X": x, "Y": y, "Z": z, "F": feed}
    try:
        finite = all(map(isfinite, numbers.values()))
    except (TypeError, OverflowError):
        finite = False
    if not finite:
        raise ValueError(f"not a way, or no feed: {numbers}")
    return "".join(f"{letter}{number:.3f}" for letter, number in numbers.items())
