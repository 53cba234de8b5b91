"""The panel as pages have it: what they ask for, what they are told, what is kept."""

import asyncio
from collections.abc import Coroutine, Mapping
from dataclasses import replace
from pathlib import Path

from fresa_host import MachineError, Place
from fresa_host.port import find_ports
from fresa_host.positioner_lines import AXES, MEANINGS, STEPS_PER_UM, Limit, Refusal, Steps

from ..console import UserError
from ..web import Pages, View
from .jogging import NOWHERE, Jogging
from .kept import FASTEST, SLOWEST, TRAVEL, load, save
from .line import Heard
from .machine import Machine
from .orders import read_axis, read_name, read_number, read_point, read_speed, read_ways

__all__ = ["Panel"]

#: Seconds from one look at who holds what, and whether the machine still reports, to the next.
LOOK = 0.1

#: Seconds from one writing of the file to the next, at least, and from one look for ports.
SAVE = 0.5
PORTS = 2.0


class PanelView:
    """A page. All that it is shown are texts."""

    def frame(self) -> None:
        """Give nothing. See `View`."""


class Panel:
    """The positioner, what is kept of it, and the pages that move it.

    Parameters
    ----------
    path : path
        File of what is kept.
    port : str, optional
        A port to offer beside those that the system knows, chosen at first.
    only : bool
        Offer no other port.

    Attributes
    ----------
    pages : Pages
        Who watches.
    kept : Kept
        What is kept.

    Raises
    ------
    UserError
        If the file cannot be read.
    """

    def __init__(self, path: Path, port: str | None = None, *, only: bool = False) -> None:
        self.pages = Pages(self)
        self.kept = load(path)
        self._path, self._written = path, self.kept
        self._port, self._only = port, only
        self._ports: list[str] = []
        self._machine = Machine(self._heard, self._lost)
        self._jogging, self._ways = Jogging(), NOWHERE
        self._busy: asyncio.Task | None = None
        self._doing = ""
        self._note, self._bad = "", False
        self._goal: tuple[int, Steps] | None = None
        self._limits: set[str] = set()
        self._speeds = self.kept.speeds  # that the machine was told
        self._silent = False
        self._reports = 0
        self._tasks = [asyncio.create_task(work()) for work in (
            self._look, self._keep, self._find_ports)]
        self._tell()

    async def close(self) -> None:
        """Stop the machine, disconnect it, and write what is kept."""
        tasks = [*self._tasks, *filter(None, [self._busy])]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        await self._machine.disconnect()
        self._take_place()
        await self._write()

    # What pages ask for

    def view(self) -> PanelView:
        """Begin a page. See `Shown`."""
        return PanelView()

    def left(self, view: View) -> None:
        """End a page: what it held is let go of. See `Shown`."""
        self._jogging.leave(view)
        self._move()

    def do(self, view: View, name: str, message: Mapping[str, object]) -> None:
        """Do what a page asks for. See `Shown`."""
        match name:
            case "connect":
                self._begin("connecting", self._connect(self._known(read_name(message))))
            case "disconnect":
                self._begin("disconnecting", self._disconnect())
            case "jog":
                self._jog(view, read_ways(message))
            case "holding":
                self._jogging.refresh(view, asyncio.get_running_loop().time())
            case "stop":
                self._stop()
            case "origin":
                self._origin()
            case "speed":
                self._speed(read_axis(message), read_speed(message))
            case "point":
                number, point = read_number(message), read_point(message)
                self.kept = self.kept.with_point(number, point)
                self._machine.store(number, point)
            case "here":
                self._store_here(read_number(message))
            case "go":
                self._go(read_number(message))
            case _:
                raise UserError(f"there is no {name[:40]!r}")
        self._tell()

    def _known(self, port: str) -> str:
        # A page may not open what it likes.
        if port not in self._offered():
            raise UserError(f"there is no port {port}: choose one of the list")
        return port

    def _begin(self, doing: str, work: Coroutine[None, None, None]) -> None:
        if self._busy is not None:
            work.close()
            raise UserError(f"{self._doing}: wait a moment")
        self._doing = doing
        self._busy = asyncio.create_task(work)
        self._busy.add_done_callback(self._done)

    def _done(self, task: asyncio.Task) -> None:
        self._busy, self._doing = None, ""
        error = None if task.cancelled() else task.exception()
        if isinstance(error, MachineError):
            self._say(str(error), bad=True)
        self._tell()
        if error is not None and not isinstance(error, MachineError):
            raise error  # a mistake of ours must be seen

    async def _connect(self, port: str) -> None:
        self._forget()
        kept = self.kept
        forgot = await self._machine.connect(port, kept)
        self._speeds = kept.speeds
        self.kept = replace(self.kept, port=port)
        self._take_place()
        self._say("The machine was reset and had forgotten where it is: it was told." if forgot else
                  "Connected. Hold a button or a key to move.")

    async def _disconnect(self) -> None:
        await self._machine.disconnect()
        self._take_place()
        self._forget()

    def _jog(self, view: View, ways: tuple[int, ...]) -> None:
        if any(ways):
            self._needed()
            self._tell_speeds()
            self._say("")
        self._jogging.hold(view, ways, asyncio.get_running_loop().time())
        self._move()

    def _move(self) -> None:
        """Let each axis move as it is held; tell the machine only what is new."""
        ways = self._jogging.ways(asyncio.get_running_loop().time())
        for axis, before, way in zip(AXES, self._ways, ways, strict=True):
            if way != before:
                self._machine.jog(axis, way)
                self._goal = None
                if way:
                    self._limits.discard(axis)
        self._ways = ways

    def _stop(self) -> None:
        self._machine.stop()
        self._goal = None
        self._ways = NOWHERE
        self._jogging = Jogging()

    def _origin(self) -> None:
        self._needed()
        self._machine.origin()
        self._goal = None
        self._say("This place is the origin now.")

    def _speed(self, axis: int, speed: int) -> None:
        self.kept = self.kept.with_speed(axis, speed)  # the machine is told by and by

    def _tell_speeds(self) -> None:
        """Tell the machine what is new, seldom: the line is slow, and a slider says much."""
        if not self._machine.connected:
            return
        for axis, told, speed in zip(AXES, self._speeds, self.kept.speeds, strict=True):
            if speed != told:
                self._machine.set_speed(axis, speed)
        self._speeds = self.kept.speeds

    def _store_here(self, number: int) -> None:
        self._needed()
        here = Place.of(self.kept.steps)
        if any(abs(um) > TRAVEL for um in here):
            raise UserError(f"this place is farther than {TRAVEL} um from the origin")
        self.kept = self.kept.with_point(number, (
            round(here.x, 2), round(here.y, 2), round(here.z, 2)))
        self._machine.store(number, self.kept.points[number - 1])

    def _go(self, number: int) -> None:
        self._needed()
        self._tell_speeds()
        steps = self._machine.go(number, self.kept.points[number - 1])
        if steps is None:
            raise UserError(f"point {number} has an empty field: fill it in first")
        self._goal = number, steps
        self._limits.clear()
        self._say(f"Going to point {number}.")

    def _needed(self) -> None:
        if not self._machine.connected:
            raise UserError("the machine is not connected: connect it first")

    # What the machine says

    def _heard(self, said: Heard) -> None:
        if isinstance(said, Limit):
            self._limits.add(said.axis)
            self._goal = None
            self._say(f"A limit switch stopped {said.axis.upper()}. Move away from it.", bad=True)
        elif isinstance(said, Refusal):
            self._goal = None
            meaning = MEANINGS.get(said.reason, "it does not say more")
            self._say(f"The machine refused: {meaning} ({said.reason}).", bad=True)
        else:
            self._reports += 1
            if self._goal is not None and said == self._goal[1]:
                self._say(f"At point {self._goal[0]}.")
                self._goal = None
        self._silent = False
        self._take_place()
        self._tell()

    def _lost(self, message: str) -> None:
        self._forget()
        self._say(f"{message}. What moved may still move.", bad=True)
        self._tell()

    def _forget(self) -> None:
        self._goal, self._ways, self._jogging = None, NOWHERE, Jogging()
        self._limits.clear()
        self._silent = False
        self._say("")

    def _take_place(self) -> None:
        if self._machine.steps is not None:
            self.kept = replace(self.kept, steps=self._machine.steps)

    # What goes on by itself

    async def _look(self) -> None:
        while True:
            await asyncio.sleep(LOOK)
            self._move()
            self._tell_speeds()
            self._silent = self._machine.silent
            self._tell()

    async def _keep(self) -> None:
        while True:
            await asyncio.sleep(SAVE)
            await self._write()

    async def _write(self) -> None:
        kept = self.kept
        if kept == self._written:
            return
        try:
            await asyncio.to_thread(save, self._path, kept)
            self._written = kept
        except UserError as error:
            self._say(f"Nothing is kept: {error}.", bad=True)

    async def _find_ports(self) -> None:
        while not self._only:
            if not self._machine.connected:
                self._ports = await asyncio.to_thread(find_ports)
            await asyncio.sleep(PORTS)

    # What pages are told

    def _offered(self) -> list[str]:
        own = [self._port] if self._port else []
        return own + [port for port in self._ports if port not in own]

    def _say(self, note: str, *, bad: bool = False) -> None:
        self._note, self._bad = note, bad

    def _tell(self) -> None:
        """Tell all pages how it is. What has not changed is not sent."""
        machine = self._machine
        self.pages.tell("hello", {
            "axes": AXES, "slowest": SLOWEST, "fastest": FASTEST, "travel": TRAVEL,
            "steps_per_um": STEPS_PER_UM})
        self.pages.tell("state", {
            "connected": machine.connected, "doing": self._doing, "ports": self._offered(),
            "port": self.kept.port if self.kept.port in self._offered() else self._port,
            "note": self._note, "bad": self._bad, "silent": self._silent,
            "limits": sorted(self._limits), "goal": self._goal[0] if self._goal else None,
            "ways": self._ways})
        self.pages.tell("place", {"um": Place.of(self.kept.steps), "steps": self.kept.steps,
                                  "reports": self._reports})
        self.pages.tell("kept", {"speeds": self.kept.speeds, "points": self.kept.points})
