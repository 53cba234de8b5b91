"""The backend of the panel's page: requests of pages, and the state that they show."""

import asyncio
import time
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from fresa_host import MachineError, Port

from ..console import UserError
from ..web import Pages, View
from .broadcast import Broadcast
from .busy import Busy
from .machine import Machine
from .moves import Mode, Moves
from .orders import (
    read_axis,
    read_directions,
    read_name,
    read_number,
    read_page,
    read_point,
    read_speed,
    read_switch,
)
from .ports import Ports
from .settings import TRAVEL, Settings
from .simulated import Simulated
from .stage import AXES, Message, Place
from .store import Store

__all__ = ["Panel"]

#: Seconds between checks of holds and reports.
POLL_S = 0.1

#: Least seconds from one write of the settings to the next.
SAVE_INTERVAL_S = 0.5


UNKNOWN = ("It is not known where the machine is: it was reset, now or earlier, and may have moved "
           "since its position was saved. Move it to a known place and make that the origin.")


class PanelView:
    """The view of a page, which is sent text messages only.

    Attributes
    ----------
    name : str
        What it calls itself, to tell it from other pages.
    """

    name = ""

    def frame(self) -> None:
        """Return None. See `View`."""


class Panel:
    """The stage, its saved settings, and the pages that move it.

    Parameters
    ----------
    path : path
        File of the settings.
    port : str, optional
        A port to offer besides those that the system lists; it is selected first.
    simulated : Simulated, optional
        A machine in simulation; its port is then the only one.

    Attributes
    ----------
    pages : Pages
        The connected pages.
    settings : Settings
        The settings, including unsaved changes.

    Raises
    ------
    UserError
        If the file cannot be read, or another panel uses it.
    """

    def __init__(self, path: Path, port: str | None = None, *,
                 simulated: Simulated | None = None) -> None:
        self.pages = Pages(self)
        self._store = Store(path)
        self.settings = self._store.settings
        self._simulated = simulated
        self._ports = Ports(simulated.port if simulated else port, only=simulated is not None)
        self._machine = Machine(simulated.open if simulated else Port,
                                self._on_message, self._on_loss, self._on_motion)
        self._moves = Moves(self._machine)
        self._busy = Busy(self._done)
        self._broadcast = Broadcast(self.pages, simulated.switches if simulated else None)
        self._tasks = [asyncio.create_task(work) for work in (
            self._poll(), self._save_changes(),
            self._ports.watch(lambda: not self._machine.connected))]
        self._publish()

    async def close(self) -> None:
        """Stop the machine, disconnect it, and save the settings."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        await self._busy.cancel()
        await self._machine.disconnect()
        self._update_place()
        await self._write()
        self._store.close()

    # Requests of pages

    def view(self) -> PanelView:
        """Open a view for a new page. See `Backend`."""
        return PanelView()

    def left(self, view: View) -> None:
        """Close the view of a page: the axes that it held are released. See `Backend`."""
        self._moves.leave(view)

    def do(self, view: View, name: str, message: Mapping[str, object]) -> None:
        """Carry out a request of a page. See `Backend`."""
        match name:
            case "page":
                view.name = read_page(message)
            case "connect":
                self._busy.begin("connecting", self._connect(self._ports.known(read_name(message))))
            case "disconnect":
                self._busy.begin("disconnecting", self._disconnect())
            case "jog":
                self._jog(view, read_directions(message))
            case "holding":
                self._moves.refresh(view)
            case "stop":
                self._moves.stop()
                self._broadcast.notify("")
            case "origin":
                self._require_connection()
                self._moves.clear_goal()
                self._busy.begin("setting the origin", self._set_origin())
            case "speed":
                axis, speed = read_axis(message), read_speed(message)
                self.settings = self.settings.with_speed(axis, speed)
                if self._machine.connected:
                    self._machine.set_speed(AXES[axis], speed)
            case "point":
                number, point = read_number(message), read_point(message)
                self.settings = self.settings.with_point(number, point)
                self._machine.store(number, point)
            case "here":
                self._store_position(read_number(message))
            case "go":
                self._travel(view, read_number(message))
            case "limit":
                self._press(*read_switch(message))
            case _:
                raise UserError(f"there is no {name[:40]!r}")
        self._publish()

    def _done(self, error: MachineError | None) -> None:
        if error is not None:
            self._broadcast.notify(str(error), bad=True)
        self._publish()

    async def _connect(self, port: str) -> None:
        self._forget()
        settings = self.settings
        left = settings.steps if settings.known and not self._store.moving else None
        reset, seconds = await self._machine.connect(port, settings, left,
                                                     settings.least_seconds(time.time()))
        self._moves.forget()  # and how often the session before was stopped
        self._moves.lost = False
        # Its own count goes on while it has power.
        known = settings.known and (not reset or self._machine.steps == left)
        self.settings = replace(self.settings, port=port, known=known,
                                on_since=max(0.0, time.time() - seconds))
        self._update_place()
        self._send_changed(settings)
        if not known:
            self._broadcast.notify(UNKNOWN, bad=True)
        elif reset:
            self._broadcast.notify("The machine was reset: its position has been restored.",
                                   during=Mode.IDLE)
        else:
            self._broadcast.notify("Connected. Hold a button or a key to move.", during=Mode.IDLE)

    def _send_changed(self, before: Settings) -> None:
        """Send the speeds and points that have changed while the panel connected."""
        for axis, was, speed in zip(AXES, before.speeds, self.settings.speeds, strict=True):
            if speed != was:
                self._machine.set_speed(axis, speed)
        for number, (was, point) in enumerate(
                zip(before.points, self.settings.points, strict=True), 1):
            if point != was:
                self._machine.store(number, point)

    async def _disconnect(self) -> None:
        await self._machine.disconnect()
        self._update_place()
        self._forget()

    def _jog(self, view: View, directions: tuple[int, ...]) -> None:
        if any(directions):
            self._require_connection()
            self._broadcast.notify("")
        self._moves.hold(view, directions)

    async def _set_origin(self) -> None:
        await self._machine.origin()
        self.settings = replace(self.settings, known=True)
        self._broadcast.notify("This position is the origin now.")

    def _store_position(self, number: int) -> None:
        self._require_connection()
        here = Place.of(self.settings.steps)
        if any(abs(um) > TRAVEL for um in here):
            raise UserError(f"this position is farther than {TRAVEL} um from the origin")
        self.settings = self.settings.with_point(number, (
            round(here.x, 2), round(here.y, 2), round(here.z, 2)))
        self._machine.store(number, self.settings.points[number - 1])

    def _travel(self, view: View, number: int) -> None:
        self._require_connection()
        self._moves.go(view, number, self.settings.points[number - 1])
        self._broadcast.notify(f"To point {number}.", during=Mode.GOING)

    def _press(self, name: str, on: bool) -> None:
        if self._simulated is None:
            raise UserError("a real machine's limit switches are pressed by hand")
        self._simulated.switches.press(name, on)

    def _require_connection(self) -> None:
        if not self._machine.connected:
            raise UserError("the machine is not connected: connect it first")

    # Messages of the machine

    def _on_message(self, message: Message) -> None:
        self._broadcast.receive(message, self._moves.receive(message))
        self._update_place()
        self._publish()

    def _on_loss(self, message: str) -> None:
        self._forget()
        self._moves.lost = True
        self._broadcast.notify(f"{message}. The machine may still be moving.", bad=True)
        self._publish()

    def _forget(self) -> None:
        self._moves.forget()
        self._broadcast.notify("")

    def _update_place(self) -> None:
        if self._machine.steps is not None:
            self.settings = replace(self.settings, steps=self._machine.steps)

    def _on_motion(self) -> None:
        """Save that it moves, before it does: this process may be killed meanwhile."""
        self._store.mark(moving=True)

    # Background tasks

    async def _poll(self) -> None:
        while True:
            await asyncio.sleep(POLL_S)
            self._moves.follow()
            self._publish()

    async def _save_changes(self) -> None:
        while True:
            await asyncio.sleep(SAVE_INTERVAL_S)
            await self._write()

    async def _write(self) -> None:
        settings = self.settings
        if settings != self._store.settings:
            try:
                await asyncio.to_thread(self._store.save, settings)
            except UserError as error:
                self._broadcast.notify(f"The settings are not saved: {error}.", bad=True)
                return
        if self._store.moving and self._machine.at_rest and settings.steps == self._machine.steps:
            self._store.mark(moving=False)

    def _publish(self) -> None:
        self._broadcast.publish(self._machine, self._moves, self._ports, self._busy, self.settings,
                                moving=self._store.moving)
