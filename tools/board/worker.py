"""The process that the gateware runs in: obeys orders, and runs clocks in between.

It runs for some milliseconds at a time, so that a click never waits longer.
"""

import os
import shutil
import signal
import time
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path

from tb.engines import EngineError

from ..pace import Pace, Rate
from .build import Builder
from .machine import Machine
from .messages import Job

__all__ = ["work"]

#: Seconds that a run of clocks should take, and how many to begin with.
SLICE = 0.006
FIRST_SLICE = 100

#: Seconds after which a new state is sent without a request.
REPORT = 0.03

#: Orders that are obeyed before it runs again, however many there are.
MOST_ORDERS = 32

#: Seconds after which a step that does not come is waited for no more.
STEP_PATIENCE = 30

#: Seconds after which it looks whether a machine is built, if nothing else happens.
IDLE = 0.02


def work(connection: Connection, engine: str | None, folder: str) -> None:
    """Serve the process at the other end until it goes away: what a process of its own runs.

    If that process goes away without saying so, the folder of waveforms is deleted for it.

    Every order is a tuple that begins with the name of a method of `Worker`; every answer begins
    with a name too.
    """
    # Ctrl-C is for the process that started us. It ends us, and with us a compiler that runs.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if hasattr(os, "setsid"):
        os.setsid()
    try:
        Worker(connection, engine).serve()
    except (EOFError, ConnectionError):
        shutil.rmtree(folder, ignore_errors=True)
    finally:
        if hasattr(os, "killpg"):
            signal.signal(signal.SIGTERM, signal.SIG_IGN)
            with suppress(OSError):
                os.killpg(0, signal.SIGTERM)


class Worker:
    """Runs a machine for the process at the other end of a connection."""

    def __init__(self, connection: Connection, engine: str | None) -> None:
        self._connection = connection
        self._builder = Builder(engine)
        self._machine: Machine | None = None
        self._pace, self._rate = Pace(), Rate()
        self._slice = FIRST_SLICE
        self._running = False
        self._counted = 0  # clocks to make even though it does not run
        self._until_step = False
        self._give_up = 0.0  # when to wait for a step no more
        self._inputs = 0, 0
        self._what = ""
        self._failed: str | None = None
        self._unrecorded: str | None = None  # why there is no waveform
        self._looked = True
        self._reported = 0.0
        self._told: dict[str, object] = {}

    def serve(self) -> None:
        """Obey and run, until the other end is closed or asks for the end."""
        while True:
            wait, obeyed = self._wait(), False
            for _ in range(MOST_ORDERS):
                if not self._connection.poll(wait):
                    break
                name, *arguments = self._connection.recv()
                if name == "quit":
                    return
                getattr(self, name)(*arguments)
                wait, obeyed = 0, True
            self._take_built()
            try:
                self._advance()
            except (EngineError, OSError) as error:
                self._fail(f"{error}; switch the power off and on")
                self._switch_off()
            if not self._looked:
                self._show()
            if obeyed or time.monotonic() > self._reported + REPORT:
                self._tell_state()

    def build(self, number: int, job: Job, what: str) -> None:
        """Build a machine. The one before goes on until it is ready."""
        self._what = what
        self._failed = None
        self._builder.want(number, job)

    def power(self, number: int, job: Job) -> None:
        """Switch off, and on again."""
        self._switch_off()
        self.build(number, job, "switching on")

    def _switch_off(self) -> None:
        machine, self._machine = self._machine, None
        if machine is not None:
            self._take_window(machine, whole=False)
            with suppress(EngineError):  # of its waveform, which has been told
                machine.close()

    def inputs(self, switches: int, buttons: int) -> None:
        """Move contacts."""
        self._inputs = switches, buttons
        if self._machine is not None:
            self._machine.touch(switches, buttons)

    def run(self, running: bool) -> None:
        """Run, or pause."""
        self._running = running
        self._counted = 0
        self._begin()

    def clocks(self, count: int) -> None:
        """Pause, and make so many clocks."""
        self._running, self._until_step = False, False
        self._counted = count
        self._begin()

    def step(self) -> None:
        """Pause, and run until the next coil word changes, or for as long as that may take."""
        if self._machine is not None:
            self.clocks(self._machine.patience)
            self._until_step = True
            self._give_up = time.monotonic() + STEP_PATIENCE

    def speed(self, clocks_per_second: float | None) -> None:
        """Set how fast it runs."""
        self._pace.speed = clocks_per_second
        self._begin()

    def record(self, path: str, clocks: int) -> None:
        """Record a waveform."""
        self._unrecorded = None
        if self._machine is None:
            self._unrecorded = "There was no machine: record again"
            return
        try:
            self._machine.record(Path(path), clocks)
        except EngineError as error:
            self._unrecorded = str(error)
        self._slice = FIRST_SLICE

    def look(self) -> None:
        """Answer with a snapshot, or None if there is no machine.

        First it runs, so that what came before this order can be seen.
        """
        self._looked = False

    def _show(self) -> None:
        self._looked = True
        machine = self._machine
        if machine is None:
            return self._connection.send(("look", None))
        # Over some clocks, even if each takes seconds.
        span = min(60.0, max(1.0, 5 / (self._pace.speed or 5)))
        rate = self._rate.see(time.monotonic(), machine.clock, span)
        return self._connection.send(("look", machine.look(rate if self._moving else 0.0)))

    def plate(self) -> None:
        """Answer with the cut so far, or None if there is no machine."""
        machine = self._machine
        self._connection.send(("plate", None if machine is None else machine.cut()))

    @property
    def _moving(self) -> bool:
        return self._running or self._counted > 0

    def _begin(self) -> None:
        self._pace.begin(time.monotonic())
        self._rate.clear()

    def _wait(self) -> float:
        if self._machine is None or not self._moving:
            return IDLE
        return 0.0 if self._counted else min(IDLE, self._pace.wait(time.monotonic()))

    def _take_built(self) -> None:
        built = self._builder.built()
        if built is None:
            return
        number, job, scan_bits, engine = built
        if isinstance(engine, EngineError):
            self._fail(str(engine))
            return self._connection.send(("failed", number))
        self._switch_off()
        self._machine = Machine(engine, job, switches=self._inputs[0])
        if self._inputs[1]:
            self._machine.touch(*self._inputs)
        self._counted, self._slice = 0, FIRST_SLICE
        self._begin()
        self._failed = self._builder.note
        return self._connection.send(("built", number, job.period, scan_bits, engine.name))

    def _fail(self, message: str) -> None:
        self._failed = message

    def _advance(self) -> None:
        machine = self._machine
        if machine is None or not self._moving:
            return
        start = time.monotonic()
        due = self._counted or self._pace.due(start)
        if due < 1:
            return
        asked = min(due, self._slice)
        made, changed = machine.run(asked, once=self._until_step and self._counted > 0)
        end = time.monotonic()
        if self._counted:
            over = self._until_step and (changed or end > self._give_up)
            self._counted = 0 if over else self._counted - made
        else:
            self._pace.made(made, end)
        if made == self._slice:
            ratio = SLICE / max(end - start, 1e-6)
            self._slice = max(1, round(self._slice * min(2.0, max(0.1, ratio))))
        self._take_window(machine)

    def _take_window(self, machine: Machine, *, whole: bool = True) -> None:
        try:
            window = machine.recorded(whole=whole)
        except EngineError as error:
            self._unrecorded = f"{error}: record again"
        else:
            if window is not None:
                self._unrecorded = None
                self._connection.send(("recorded", window))

    def _tell_state(self) -> None:
        self._reported = time.monotonic()
        machine = self._machine
        state: dict[str, object] = {
            "running": self._running,
            "advancing": self._counted > 0 and machine is not None,
            "stopped": machine is not None and machine.stopped,
            "building": self._what if self._builder.building else False,
            "speed": self._pace.speed,
            "recording": machine is not None and machine.recording,
            "done": machine is not None and machine.done,
            "error": self._failed,
            "unrecorded": self._unrecorded,
        }
        if state != self._told:
            self._told = state
            self._connection.send(("state", state))
