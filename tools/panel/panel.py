"""The panel as pages have it: what they ask for, and what becomes of it."""

import asyncio
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from fresa_host import MachineError, Port

from ..console import UserError
from ..web import Pages, View
from .broadcast import Broadcast
from .busy import Busy
from .machine import Machine
from .moves import Moves
from .orders import (
    read_axis,
    read_directions,
    read_name,
    read_number,
    read_point,
    read_speed,
    read_switch,
)
from .ports import Ports
from .settings import TRAVEL, load, save
from .simulated import Simulated
from .stage import Message, Place

__all__ = ["Panel"]

#: Seconds from one look at what pages hold, and whether the machine still reports, to the next.
POLL_S = 0.1

#: Seconds from one writing of the file to the next, at least.
SAVE = 0.5


class PanelView:
    """A page. All that it is shown are texts."""

    def frame(self) -> None:
        """Give nothing. See `View`."""


class Panel:
    """The stage, what is kept of it, and the pages that move it.

    Parameters
    ----------
    path : path
        File of what is kept.
    port : str, optional
        A port to offer beside those that the system knows, chosen at first.
    simulated : Simulated, optional
        A machine in simulation, whose port is the only one then.

    Attributes
    ----------
    pages : Pages
        The pages that are open.
    settings : Settings
        What is kept.

    Raises
    ------
    UserError
        If the file cannot be read.
    """

    def __init__(self, path: Path, port: str | None = None, *,
                 simulated: Simulated | None = None) -> None:
        self.pages = Pages(self)
        self.settings = load(path)
        self._path, self._written = path, self.settings
        self._simulated = simulated
        self._ports = Ports(simulated.port if simulated else port, only=simulated is not None)
        self._machine = Machine(simulated.open if simulated else Port, self._heard, self._lost)
        self._moves = Moves(self._machine)
        self._busy = Busy(self._done)
        self._broadcast = Broadcast(self.pages, simulated.switches if simulated else None)
        self._tasks = [asyncio.create_task(work) for work in (
            self._look(), self._keep(),
            self._ports.watch(lambda: not self._machine.connected))]
        self._tell()

    async def close(self) -> None:
        """Stop the machine, disconnect it, and write what is kept."""
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)
        await self._busy.cancel()
        await self._machine.disconnect()
        self._take_place()
        await self._write()

    # What pages ask for

    def view(self) -> PanelView:
        """Begin a page. See `Shown`."""
        return PanelView()

    def left(self, view: View) -> None:
        """End a page: what it held is let go of. See `Shown`."""
        self._moves.leave(view)

    def do(self, view: View, name: str, message: Mapping[str, object]) -> None:
        """Do what a page asks for. See `Shown`."""
        match name:
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
            case "origin":
                self._origin()
            case "speed":
                # It is sent by and by.
                self.settings = self.settings.with_speed(read_axis(message), read_speed(message))
            case "point":
                number, point = read_number(message), read_point(message)
                self.settings = self.settings.with_point(number, point)
                self._machine.store(number, point)
            case "here":
                self._store_here(read_number(message))
            case "go":
                self._go(read_number(message))
            case "limit":
                self._press(*read_switch(message))
            case _:
                raise UserError(f"there is no {name[:40]!r}")
        self._tell()

    def _done(self, error: MachineError | None) -> None:
        if error is not None:
            self._broadcast.say(str(error), bad=True)
        self._tell()

    async def _connect(self, port: str) -> None:
        self._forget()
        settings = self.settings
        forgot = await self._machine.connect(port, settings)
        self._moves.knows_speeds(settings.speeds)
        self.settings = replace(self.settings, port=port)
        self._take_place()
        self._broadcast.say("The machine was reset and had forgotten where it is: it was told."
                       if forgot else "Connected. Hold a button or a key to move.")

    async def _disconnect(self) -> None:
        await self._machine.disconnect()
        self._take_place()
        self._forget()

    def _jog(self, view: View, directions: tuple[int, ...]) -> None:
        if any(directions):
            self._needed()
            self._moves.send_speeds(self.settings.speeds)
            self._broadcast.say("")
        self._moves.hold(view, directions)

    def _origin(self) -> None:
        self._needed()
        self._machine.origin()
        self._moves.end_going()
        self._broadcast.say("This place is the origin now.")

    def _store_here(self, number: int) -> None:
        self._needed()
        here = Place.of(self.settings.steps)
        if any(abs(um) > TRAVEL for um in here):
            raise UserError(f"this place is farther than {TRAVEL} um from the origin")
        self.settings = self.settings.with_point(number, (
            round(here.x, 2), round(here.y, 2), round(here.z, 2)))
        self._machine.store(number, self.settings.points[number - 1])

    def _go(self, number: int) -> None:
        self._needed()
        self._moves.send_speeds(self.settings.speeds)
        self._moves.go(number, self.settings.points[number - 1])
        self._broadcast.say(f"Going to point {number}.")

    def _press(self, name: str, on: bool) -> None:
        if self._simulated is None:
            raise UserError("a real machine's limit switches are pressed by hand")
        self._simulated.switches.press(name, on)

    def _needed(self) -> None:
        if not self._machine.connected:
            raise UserError("the machine is not connected: connect it first")

    # What the machine says

    def _heard(self, message: Message) -> None:
        self._broadcast.hear(message, self._moves.hear(message))
        self._take_place()
        self._tell()

    def _lost(self, message: str) -> None:
        self._forget()
        self._broadcast.say(f"{message}. What moved may still move.", bad=True)
        self._tell()

    def _forget(self) -> None:
        self._moves.forget()
        self._broadcast.forget()

    def _take_place(self) -> None:
        if self._machine.steps is not None:
            self.settings = replace(self.settings, steps=self._machine.steps)

    # What goes on by itself

    async def _look(self) -> None:
        while True:
            await asyncio.sleep(POLL_S)
            self._moves.follow()
            self._moves.send_speeds(self.settings.speeds)
            self._broadcast.silent = self._machine.silent
            self._tell()

    async def _keep(self) -> None:
        while True:
            await asyncio.sleep(SAVE)
            await self._write()

    async def _write(self) -> None:
        settings = self.settings
        if settings == self._written:
            return
        try:
            await asyncio.to_thread(save, self._path, settings)
            self._written = settings
        except UserError as error:
            self._broadcast.say(f"Nothing is kept: {error}.", bad=True)

    def _tell(self) -> None:
        self._broadcast.tell(self._machine, self._moves, self._ports, self._busy, self.settings)
