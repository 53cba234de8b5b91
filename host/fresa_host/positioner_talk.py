"""What is said to a positioner, and what it answers, in an order that threads may rely on."""

import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress

from . import positioner_lines as lines
from .errors import LineLost, Refused, TimedOut
from .heard import SETTLED, Heard
from .port import Port
from .positioner_lines import AXES, Limit, Refusal, Steps
from .positioner_link import PositionerLink

__all__ = ["TRIES", "PositionerTalk"]

#: Seconds after which a refusal would have come: the longest line each way, and some more.
SILENCE = 0.3

#: Times that something is said that the line may have damaged.
TRIES = 3


class PositionerTalk:
    """A positioner that is told one thing at a time, but to stop and to jog at once.

    What is raised is that of `Positioner`, for which this is.

    Parameters
    ----------
    port : str or Port
        The serial port; see `Port`.
    timeout : float
        Seconds within which the machine must be heard while it is connected.
    reported : callable, optional
        See `Heard`.

    Attributes
    ----------
    call : lock
        Held from what is said to what it is answered: what is refused then is of that.
    connected : bool
        Whether the machine should report. Set by who connects it.
    heard : Heard
        What it has said.
    link : PositionerLink
        The line.
    """

    def __init__(self, port: str | Port, timeout: float,
                 reported: Callable[[Steps], None] | None) -> None:
        self.call = threading.RLock()
        self.connected = False
        self.heard = Heard(reported)
        self._timeout = timeout
        self._ordering = threading.RLock()
        self._since: dict[str, bytes] = {}  # what axes were told since `begin`
        self.link = PositionerLink(port, heard=self._hear, lost=self.heard.lose)

    def send(self, orders: bytes) -> None:
        """Send orders at once."""
        if self.heard.lost is not None:
            raise self.heard.lost
        self.link.send(orders)

    def do(self, orders: bytes) -> None:
        """Send orders, and wait until the machine would have refused them; raise if it did."""
        with self.call:
            self.send(orders)
            self._settle(len(orders))

    def jog(self, axis: str, order: bytes) -> None:
        """Send an order to move an axis without end, at once."""
        with self._ordering:
            self.heard.leave(axis)
            self._since[axis] = order
            self.send(order)

    def stop(self, axes: Iterable[str] = AXES) -> None:
        """End the movement of axes, at once."""
        orders = {axis: lines.stop([axis]) for axis in axes}
        with self._ordering:
            self.heard.drop(*orders)
            self._since |= orders
            self.send(b"".join(orders.values()))

    def stand(self) -> None:
        """Stop all axes, again if that is refused or one moves on, and in the end by a break.

        What else is wrong the next call will tell.
        """
        with suppress(LineLost):
            for _ in range(TRIES):
                self.stop()
                if self._stands(len(lines.stop())):
                    return
            self.link.halt()

    def _stands(self, size: int) -> bool:
        """Say whether so many bytes that stop all axes did so, as far as is heard."""
        places = []
        for reports in (SETTLED, 1):
            self._wait_for_line(size)
            self.heard.listen(self.heard.reports + reports, self._patience)
            places.append(self.heard.last()[0])
            size = 0
        return not self.heard.pardon() and (not self.connected or places[0] == places[1])

    def begin(self) -> None:
        """Begin what ends with `go`. Axes that are stopped or jogged in between do not go."""
        self._since.clear()

    def go(self, order: bytes, there: Steps) -> None:
        """Send an order to go to a place; see `do`."""
        with self.call, self.standing_if_refused(True):
            with self._ordering:
                since = self._since
                if len(since) == len(AXES):
                    return
                self.heard.aim(there, *AXES)
                self.heard.drop(*since)
                order += b"".join(since.values())
                self.send(order)
            self._settle(len(order))

    @contextmanager
    def standing_if_refused(self, going: bool = False) -> Iterator[None]:
        """Stop all axes if something is refused and they were going to a place, or to be sent."""
        going = going or self.heard.target is not None
        try:
            yield
        except Refused:
            if going:
                self.stand()
            raise

    def _settle(self, size: int) -> None:
        self._wait_for_line(size)
        due = self.heard.reports + SETTLED
        if not self.heard.wait_for_reports(due, self._patience) and self.connected:
            raise TimedOut(f"the machine at {self.link.name} reports no more: nobody knows "
                           "whether it obeyed")

    def _wait_for_line(self, size: int) -> None:
        time.sleep(10 * size / self.link.baud)

    @property
    def _patience(self) -> float:
        """Without reports, by the clock; with them by the machine's own time, if it is slow."""
        return self._timeout if self.connected else SILENCE

    def _hear(self, said: Steps | Refusal | Limit) -> None:
        """Take what the machine says, in the thread of the line."""
        if not isinstance(said, Limit):
            self.heard.hear(said)
            return
        with self._ordering:
            # It may have been on its way while the axis was told to move again, and nothing have
            # ended that. What is told of it has to be true.
            if self.heard.doubts(said.axis):
                with suppress(LineLost):
                    self.link.send(lines.stop([said.axis]))
            self.heard.hear(said)
