"""The backend of the board's page: requests of pages, and the state that they show."""

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

#: Least seconds from one start of a recording to the next.
RECORD_INTERVAL = 0.5

#: Seconds within which the simulation returns the cut.
CUT_TIMEOUT_S = 10


class Board:
    """A Nexys 2 that is simulated in a process of its own, and the pages that show it.

    Parameters
    ----------
    job : Job
        The first job that it is programmed with.
    engine : str, optional
        The engine; None for the fastest available.

    Attributes
    ----------
    pages : Pages
        The connected pages.
    job : Job or None
        The job of the running machine.
    windows : Windows
        The recorded window of waveform.
    built : asyncio.Future
        Done when the first machine is ready; the result is None, or an error message.
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
                                          "lost": False, "unrecorded": None}
        self._jobs: dict[int, Job] = {}
        self._newest = 0
        self._requested = self._working = job
        self._recorded_at = float("-inf")
        self._engine = engine or ""
        self._plate: asyncio.Future[Cut | None] | None = None
        self._snapshot_received = asyncio.Event()
        self._pages_ready = asyncio.Event()
        self._simulation = Simulation(engine, self._on_message, self.windows.folder)
        self._publish_hello()
        self._publish_state()
        self._start()
        self._frames = asyncio.create_task(self._send_frames())

    async def close(self) -> None:
        """Stop the simulation. The site closes the connections of the pages."""
        self._frames.cancel()
        await asyncio.to_thread(self._simulation.stop)
        self.windows.close()

    def view(self) -> SceneView:
        """Open a view for a new page. See `Backend`."""
        return SceneView(self._scene)

    def left(self, view: View) -> None:
        """Close the view of a page: the buttons that it held are released. See `Backend`."""
        if self._held.pop(view, 0):
            self._apply_inputs()

    def do(self, view: View, name: str, message: Mapping[str, object]) -> None:
        """Carry out a request of a page. See `Backend`."""
        match name, read_order(name, message):
            case "switches", (mask, levels):
                self._switches = self._switches & ~mask | levels
                self._apply_inputs()
            case "buttons", int(held):
                self._held[view] = held
                self._apply_inputs()
            case ("run" | "pause"), _:
                self._send("run", name == "run")
            case "clock", int(clocks):
                self._send("clocks", clocks)
            case "step", _:
                self._send("step")
            case "speed", (float() | None) as speed:
                self._speed = speed
                self._send("speed", speed)
            case "power", _ if self._simulation.alive:
                self._build(self._requested, "power")
            case "power", _:
                self._start()
            case "step_period", int(period):
                self._build(replace(self._requested, period=period),
                            "build", "changing the step rate")
            case "record", int(clocks):
                self._record(clocks)

    def _record(self, clocks: int) -> None:
        # Starting a waveform takes as long as thousands of clocks.
        now = asyncio.get_running_loop().time()
        if now < self._recorded_at + RECORD_INTERVAL:
            raise UserError("a waveform was requested a moment ago: wait a moment")
        if self._state["recording"]:
            raise UserError("a waveform is being recorded: wait until it ends")
        self._send("record", str(self.windows.place()), clocks)
        self._recorded_at = now

    def program(self, job: Job) -> None:
        """Program the board with another picture. The old machine runs until the new is built."""
        self._build(replace(job, period=self._requested.period), "build", "programming the board")

    async def cut(self) -> Cut:
        """Return the plate as it is milled so far.

        Raises
        ------
        UserError
            If there is no machine.
        """
        if self._plate is None:
            self._plate = asyncio.get_running_loop().create_future()
            self._simulation.send("plate")
        plate = self._plate
        try:
            cut = await asyncio.wait_for(asyncio.shield(plate), CUT_TIMEOUT_S)
        except TimeoutError:
            cut = None
        finally:
            if self._plate is plate:
                self._plate = None
        if cut is None:
            raise UserError("the machine is off: switch the power on")
        return cut

    # The simulation

    def _apply_inputs(self) -> None:
        """Apply the contacts that pages set. A button is down while any page holds it."""
        buttons = reduce(or_, self._held.values(), 0)
        self._scene.touch(self._switches, buttons)
        self._simulation.send("inputs", self._switches, buttons)

    def _send(self, *order: Any) -> None:
        if not self._simulation.alive:
            raise UserError("the machine is off: switch the power on")
        self._simulation.send(*order)

    def _start(self) -> None:
        self._simulation.start()
        self._apply_inputs()
        self._simulation.send("speed", self._speed)
        self._simulation.send("run", True)
        self._pages_ready.set()  # pages may have waited for a frame since the last process ended
        self._build(self._requested, "build", "building the machine")

    def _build(self, job: Job, order: str, *how: str) -> None:
        self._send(order, self._newest + 1, job, *how)
        self._newest += 1
        self._requested = self._jobs[self._newest] = job

    def _on_message(self, what: str, *rest: Any) -> None:
        {"snapshot": self._on_snapshot, "state": self._on_state, "built": self._on_built,
         "failed": self._on_failed, "plate": self._on_plate, "recorded": self._on_recorded,
         "ended": self._on_ended}[what](*rest)

    def _on_snapshot(self, snapshot: Any) -> None:
        if snapshot is not None:
            self._scene.apply(snapshot)
        self.pages.wake()
        self._snapshot_received.set()

    def _on_state(self, state: dict[str, object]) -> None:
        self._state = state
        self._publish_state()
        if state["error"] and not state["building"] and not self.built.done():
            self.built.set_result(str(state["error"]))

    def _on_built(self, number: int, period: int, scan_bits: int, engine: str) -> None:
        self._working = self._jobs[number]
        job = replace(self._working, period=period)
        self._jobs = {n: job for n, job in self._jobs.items() if n >= number}
        self.job, self._engine = job, engine
        self._publish_hello()
        rows, columns = job.pixels.shape
        self.pages.publish("job", {
            "number": number, "rows": rows, "columns": columns, "count": int(job.pixels.sum()),
            "name": job.name, "period": period, "scan_bits": scan_bits,
            "steps_per_second": round(CLOCK / period, 3)})
        if not self.built.done():
            self.built.set_result(None)

    def _on_failed(self, number: int) -> None:
        if number == self._newest:
            self._requested = self._working

    def _on_plate(self, cut: Cut | None) -> None:
        if self._plate is not None and not self._plate.done():
            self._plate.set_result(cut)

    def _on_recorded(self, window: Window) -> None:
        self.windows.keep(window)
        self._publish_state()

    def _on_ended(self, status: int | None) -> None:
        message = f"the simulation has ended unexpectedly ({status}): switch the power off and on"
        if self._state["recording"]:
            self._state["unrecorded"] = "The waveform is lost with the simulation: record again"
        self._state |= {"running": False, "building": False, "recording": False, "error": message,
                        "advancing": False, "stopped": False, "lost": False}
        self._requested = self._working  # the job that was being built may be the cause
        self._publish_state()
        self._on_plate(None)
        self._snapshot_received.set()
        if not self.built.done():
            self.built.set_result(message)

    # The pages

    def _pages_changed(self) -> None:
        self._publish_hello()
        if self.pages.ready:
            self._pages_ready.set()

    def _publish_hello(self) -> None:
        self.pages.publish("hello", {
            "engine": self._engine, "clock_hz": CLOCK, "pixel_steps": PIXEL_STEPS,
            "z_travel": Z_TRAVEL, "step_mm": float(RESOLUTION), "longest_period": LONGEST_PERIOD,
            "top_speed": float(TOP_SPEED), "picture_max": PICTURE_MAX,
            "most_clocks": MOST_CLOCKS, "version": importlib.metadata.version("fresa"),
            "pages": len(self.pages)})

    def _publish_state(self) -> None:
        self.pages.publish("state", {**self._state, "wave": self.windows.about()})

    async def _send_frames(self) -> None:
        """Request a snapshot whenever a page can take a frame, at a limited rate."""
        loop = asyncio.get_running_loop()
        while True:
            await self._pages_ready.wait()
            self._pages_ready.clear()
            while self.pages.ready and self._simulation.alive:
                start = loop.time()
                self._snapshot_received.clear()
                self._simulation.send("snapshot")
                await self._snapshot_received.wait()
                await asyncio.sleep(start + FRAME_INTERVAL - loop.time())
