"""The board as pages have it: their requests, and the state that they show."""

import asyncio
import importlib.metadata
from collections.abc import Mapping
from dataclasses import replace
from functools import reduce
from operator import or_
from typing import Any

from fresa.clock import CLOCK
from fresa.machines.mill import PICTURE_MAX, PIXEL_STEPS, RESOLUTION, TOP_SPEED, Z_TRAVEL
from tb.milling import Cut

from ..console import UserError
from ..web import FRAME_INTERVAL, Pages, View
from .messages import Job, Window
from .orders import LONGEST_PERIOD, read_order
from .scene import Scene, SceneView
from .simulation import Simulation
from .waves import MOST_CLOCKS, Windows

__all__ = ["Board"]

#: Seconds from one recording that is asked for to the next, at least.
RECORD_INTERVAL = 0.5

#: Seconds that the simulation gets to tell of the cut.
PATIENCE = 10


class Board:
    """A Nexys 2 that runs in a process of its own, and the pages that watch it.

    Parameters
    ----------
    job : Job
        What it is programmed with first.
    engine : str, optional
        The engine; None for the fastest that runs here.

    Attributes
    ----------
    pages : Pages
        Who watches.
    job : Job or None
        What the machine that runs was programmed with.
    windows : Windows
        What was recorded.
    built : asyncio.Future
        Done when the first machine is ready; its result is None, or why there is none.
    """

    def __init__(self, job: Job, engine: str | None = None) -> None:
        self.pages = Pages(self, self._pages_changed)
        self.windows = Windows()
        self.job: Job | None = None
        self.built: asyncio.Future[str | None] = asyncio.get_running_loop().create_future()
        self._scene = Scene()
        self._switches = 0
        self._held: dict[View, int] = {}
        self._speed: float | None = None
        self._state: dict[str, object] = {"running": True, "building": "starting", "speed": None,
                                          "recording": False, "done": False, "error": None,
                                          "advancing": False, "stopped": False,
                                          "unrecorded": None}
        self._jobs: dict[int, Job] = {}
        self._newest = 0
        self._wanted = self._good = job
        self._recorded_at = float("-inf")
        self._engine = engine or ""
        self._plate: asyncio.Future[Cut | None] | None = None
        self._looked = asyncio.Event()
        self._hungry = asyncio.Event()
        self._simulation = Simulation(engine, self._heard, self.windows.folder)
        self._tell_hello()
        self._tell_state()
        self._start()
        self._frames = asyncio.create_task(self._send_frames())

    async def close(self) -> None:
        """Switch off. The site, which ends, closes the connections of the pages."""
        self._frames.cancel()
        await asyncio.to_thread(self._simulation.stop)
        self.windows.close()

    def view(self) -> SceneView:
        """Begin a page. See `Shown`."""
        return SceneView(self._scene)

    def left(self, view: View) -> None:
        """End a page: what it held is let go of. See `Shown`."""
        if self._held.pop(view, 0):
            self._touch()

    def do(self, view: View, name: str, message: Mapping[str, object]) -> None:
        """Do what a page asks for. See `Shown`."""
        match name, read_order(name, message):
            case "switches", (mask, levels):
                self._switches = self._switches & ~mask | levels
                self._touch()
            case "buttons", int(held):
                self._held[view] = held
                self._touch()
            case ("run" | "pause"), _:
                self._tell("run", name == "run")
            case "clock", int(clocks):
                self._tell("clocks", clocks)
            case "step", _:
                self._tell("step")
            case "speed", (float() | None) as speed:
                self._speed = speed
                self._tell("speed", speed)
            case "power", _ if self._simulation.alive:
                self._build(self._wanted, "power")
            case "power", _:
                self._start()
            case "step_period", int(period):
                self._build(replace(self._wanted, period=period),
                            "build", "changing the step rate")
            case "record", int(clocks):
                self._record(clocks)

    def _record(self, clocks: int) -> None:
        # To begin a waveform takes the simulation as long as thousands of clocks.
        now = asyncio.get_running_loop().time()
        if now < self._recorded_at + RECORD_INTERVAL:
            raise UserError("a waveform was asked for just now: wait a moment")
        if self._state["recording"]:
            raise UserError("a waveform is being recorded: wait for its end")
        self._tell("record", str(self.windows.place()), clocks)
        self._recorded_at = now

    def program(self, job: Job) -> None:
        """Program the board with another picture. The old machine goes on until that is done."""
        self._build(replace(job, period=self._wanted.period), "build", "programming the board")

    async def cut(self) -> Cut:
        """Return what has become of the plate.

        Raises
        ------
        UserError
            If there is no machine.
        """
        if self._plate is None:
            self._plate = asyncio.get_running_loop().create_future()
            self._simulation.tell("plate")
        plate = self._plate
        try:
            cut = await asyncio.wait_for(asyncio.shield(plate), PATIENCE)
        except TimeoutError:
            cut = None
        finally:
            if self._plate is plate:
                self._plate = None
        if cut is None:
            raise UserError("the machine is off: switch the power on")
        return cut

    # The simulation

    def _touch(self) -> None:
        """Put the contacts where pages have them. A button is down while any page holds it."""
        buttons = reduce(or_, self._held.values(), 0)
        self._scene.touch(self._switches, buttons)
        self._simulation.tell("inputs", self._switches, buttons)

    def _tell(self, *order: Any) -> None:
        if not self._simulation.alive:
            raise UserError("the machine is off: switch the power on")
        self._simulation.tell(*order)

    def _start(self) -> None:
        self._simulation.start()
        self._touch()
        self._simulation.tell("speed", self._speed)
        self._simulation.tell("run", True)
        self._hungry.set()  # pages may have waited for a frame since the process before ended
        self._build(self._wanted, "build", "building the machine")

    def _build(self, job: Job, order: str, *how: str) -> None:
        self._tell(order, self._newest + 1, job, *how)
        self._newest += 1
        self._wanted = self._jobs[self._newest] = job

    def _heard(self, what: str, *rest: Any) -> None:
        {"look": self._heard_look, "state": self._heard_state, "built": self._heard_built,
         "failed": self._heard_failed, "plate": self._heard_plate, "recorded": self._heard_recorded,
         "ended": self._heard_ended}[what](*rest)

    def _heard_look(self, snapshot: Any) -> None:
        if snapshot is not None:
            self._scene.apply(snapshot)
        self.pages.wake()
        self._looked.set()

    def _heard_state(self, state: dict[str, object]) -> None:
        self._state = state
        self._tell_state()
        if state["error"] and not state["building"] and not self.built.done():
            self.built.set_result(str(state["error"]))

    def _heard_built(self, number: int, period: int, scan_bits: int, engine: str) -> None:
        self._good = self._jobs[number]
        job = replace(self._good, period=period)
        self._jobs = {n: job for n, job in self._jobs.items() if n >= number}
        self.job, self._engine = job, engine
        self._tell_hello()
        rows, columns = job.pixels.shape
        self.pages.tell("job", {
            "number": number, "rows": rows, "columns": columns, "count": int(job.pixels.sum()),
            "name": job.name, "period": period, "scan_bits": scan_bits,
            "steps_per_second": round(CLOCK / period, 3)})
        if not self.built.done():
            self.built.set_result(None)

    def _heard_failed(self, number: int) -> None:
        if number == self._newest:
            self._wanted = self._good

    def _heard_plate(self, cut: Cut | None) -> None:
        if self._plate is not None and not self._plate.done():
            self._plate.set_result(cut)

    def _heard_recorded(self, window: Window) -> None:
        self.windows.keep(window)
        self._tell_state()

    def _heard_ended(self, status: int | None) -> None:
        message = f"the simulation has ended unexpectedly ({status}): switch the power off and on"
        if self._state["recording"]:
            self._state["unrecorded"] = "The waveform is lost with the simulation: record again"
        self._state |= {"running": False, "building": False, "recording": False, "error": message,
                        "advancing": False, "stopped": False}
        self._wanted = self._good  # what was being built may have been the reason
        self._tell_state()
        self._heard_plate(None)
        self._looked.set()
        if not self.built.done():
            self.built.set_result(message)

    # The pages

    def _pages_changed(self) -> None:
        self._tell_hello()
        if self.pages.hungry:
            self._hungry.set()

    def _tell_hello(self) -> None:
        self.pages.tell("hello", {
            "engine": self._engine, "clock_hz": CLOCK, "pixel_steps": PIXEL_STEPS,
            "z_travel": Z_TRAVEL, "step_mm": float(RESOLUTION), "longest_period": LONGEST_PERIOD,
            "top_speed": float(TOP_SPEED), "picture_max": PICTURE_MAX,
            "most_clocks": MOST_CLOCKS, "version": importlib.metadata.version("fresa"),
            "pages": len(self.pages)})

    def _tell_state(self) -> None:
        self.pages.tell("state", {**self._state, "wave": self.windows.about()})

    async def _send_frames(self) -> None:
        """Look at the machine as often as a page can take a frame, and not too often."""
        loop = asyncio.get_running_loop()
        while True:
            await self._hungry.wait()
            self._hungry.clear()
            while self.pages.hungry and self._simulation.alive:
                start = loop.time()
                self._looked.clear()
                self._simulation.tell("look")
                await self._looked.wait()
                await asyncio.sleep(start + FRAME_INTERVAL - loop.time())
