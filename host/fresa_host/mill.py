"""The mill that takes its orders over a serial line, from Python."""

import os
import time
from collections.abc import Callable, Sequence
from typing import Self

from .delivery import ReopenedPort, deliver
from .errors import JobStopped, LineLost, TimedOut
from .jobs import begin_raised, check_cuts
from .order_lines import Answer, AnswerReader, Kind, Order, request
from .orders import ANSWER_TIME, OrderRefused, Phase, Sender
from .port import Port

__all__ = ["Mill"]


class _Done(Exception):
    """All orders are done, but no answer says that the session is closed: it stays open."""


LEAST_TIMEOUT = 2.0

SILENCE = 0.1
"""Seconds of silence after which no answer to an earlier question is still to come: an answer takes
34 ms, a question 36 ms."""


class Mill:
    """A mill with its orders from a serial line, as `tools.build --orders serial` makes it.

    It carries out whole jobs: lists of `Order`, in steps from the origin. What was done of a job is
    known to the mill. So a job that was interrupted, by a cable or by Ctrl-C, is gone on with by
    the same call, from this program or another.

    Parameters
    ----------
    port : str or path
        The serial port, such as ``/dev/ttyUSB0``; see `Port`. It is locked meanwhile.
    timeout : float
        Seconds for which the mill may be silent, or its port gone; at least 2, for it is asked
        every half second at times.

    Raises
    ------
    ValueError
        If `timeout` is too short.
    LineLost
        If the port cannot be opened.
    TimedOut
        If no mill answers.

    Examples
    --------
    >>> with Mill("/dev/ttyUSB0") as mill:   # doctest: +SKIP
    ...     mill.carry_out([Order(Kind.GO, 128, 0), Order(Kind.DOWN), Order(Kind.GO, 256, 128),
    ...                     Order(Kind.UP), Order(Kind.GO, 0, 0)])
    """

    def __init__(self, port: str | os.PathLike[str], *, timeout: float = 5.0) -> None:
        if not timeout >= LEAST_TIMEOUT:
            raise ValueError(f"timeout must be at least {LEAST_TIMEOUT:g} s, not {timeout!r}")
        self._port, self._timeout = ReopenedPort(port), timeout
        self._sender: Sender | None = None  # of the job that is being carried out
        self._stopping = False
        try:
            self.state()
        except BaseException:
            self.close()
            raise

    def __repr__(self) -> str:
        return f"Mill({self._port.name!r})"

    def close(self) -> None:
        """Let go of the port, until the next call. What the mill has taken is carried out."""
        self._port.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def state(self) -> Answer:
        """Ask what the mill has done of a job, and whether it is stopped or in manual mode.

        Between jobs it has no session, and counts nothing.

        Raises
        ------
        TimedOut
            If it does not answer.
        LineLost
            If the port is gone.
        """
        end = time.monotonic() + self._timeout
        try:
            port = self._port.open()
            while time.monotonic() < end:
                _wait_for_silence(port, end)
                port.write(request(Kind.QUERY))
                reader, due = AnswerReader(), time.monotonic() + ANSWER_TIME
                while time.monotonic() < due:
                    if answers := reader.feed(port.read()):
                        return answers[-1]
        except LineLost:
            self.close()
            raise
        raise TimedOut(f"the mill at {self._port.name} does not answer: is it on, and was it built "
                       "with --orders serial?")

    def is_moving(self) -> bool:
        """Return whether orders are being carried out; may be called from any thread."""
        if self._sender is not None:
            return True
        answer = self.state()
        return answer.taken != answer.done and not (answer.error or answer.stopped)

    def stop(self) -> None:
        """End `carry_out`, in whichever thread it is: up to three orders are carried out after.

        For the tool to stop at once there is BTN3: the line carries no order to stop.
        """
        self._stopping = self._sender is not None

    def home(self, *, force: bool = False) -> None:
        """Raise the tool, and go to the origin, as a job of its own; see `carry_out`."""
        self.carry_out([Order(Kind.GO)], force=force)

    def carry_out(self, orders: Sequence[Order], *, again: bool = False, force: bool = False,
                  progress: Callable[[int, int], None] = lambda done, total: None) -> None:
        """Have a job carried out; return when all of it is.

        The mill is in automatic mode, and its origin is where the job's is. The tool is raised
        first, unless the job begins so itself. If the mill is in the middle of the same job, it
        goes on there. A job that was finished is done once more.

        Parameters
        ----------
        orders : sequence of Order
            What to do, one after the other; up to 16 777 214.
        again : bool
            Begin anew also where the mill is in the middle of this job.
        force : bool
            Begin also where the mill has done a part of another job, which it then forgets.
        progress : callable
            Called with the orders done, and all, whenever that has changed. What it
            raises ends the call; so does Ctrl-C. Up to three orders are carried out after that.

        Raises
        ------
        ValueError
            If there is no order, or are too many, or a cut is in none of the 8 directions, or
            begins at an unknown place. Nothing was sent.
        NotReady
            The mill is in manual mode, stopped, or shows an error.
        JobRefused
            It is carrying out orders of another job.
        JobHalfDone
            It has done a part of another job, without `force`.
        JobStopped
            `stop` was called.
        OrderRefused
            It refuses an order.
        WasReset
            It was reset in the middle: its origin is another now.
        TimedOut
            It was not heard for `timeout`.
        LineLost
            If the port cannot be opened.
        """
        if not orders:
            raise ValueError("a job has at least one order")
        check_cuts(orders)
        raised = begin_raised(orders)
        sender, before = Sender(raised, again=again, force=force), len(raised) - len(orders)
        begun, shown = time.monotonic(), None

        def watch(_: bool) -> None:
            done = max(0, sender.done - before)
            if self._stopping:
                raise JobStopped(f"stopped: {done} of {len(orders)} orders are done, the same call "
                                 "goes on")
            if time.monotonic() - max(begun, sender.heard or 0) > self._timeout:
                if sender.phase is Phase.CLOSING:
                    raise _Done
                raise TimedOut(f"the mill at {self._port.name} is silent; {done} of {len(orders)} "
                               "orders are done, the same call goes on")
            tell(done)

        def tell(done: int) -> None:
            nonlocal shown
            if sender.heard is not None and done != shown:
                shown = done
                progress(done, len(orders))

        self._sender, self._stopping = sender, False
        try:
            deliver(sender, self._port, watch=watch)
        except _Done:
            pass
        except OrderRefused as refused:
            raise OrderRefused(refused.number - before, refused.order) from None
        finally:
            self._sender = None
        tell(len(orders))


def _wait_for_silence(port: Port, end: float) -> None:
    """Discard answers to earlier questions, or to those of another program."""
    quiet = time.monotonic() + SILENCE
    while (now := time.monotonic()) < min(quiet, end):
        if port.read():
            quiet = now + SILENCE
