"""The process of the gateware: executes orders, and runs clocks in between.

It runs for some milliseconds at a time, so that orders never wait longer.
"""

import os
import shutil
import signal
import time
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path

from tb.engines import EngineError

from ..throttle import Rate, Throttle
from .build import Builder
from .machine import Machine
from .messages import Job

__all__ = ["work"]

#: Seconds that a run should take, and clocks of the first run.
SLICE = 0.006
FIRST_SLICE = 100

#: Seconds from one unrequested report of the state to the next.
REPORT = 0.03

#: Most orders that are executed between two runs.
MOST_ORDERS = 32

#: Seconds after which waiting for a step ends.
STEP_TIMEOUT_S = 30

#: Seconds between checks for a finished build while nothing runs.
IDLE = 0.02


def work(connection: Connection, engine: str | None, folder: str) -> None:
    """Serve the process at the other end of a connection until it ends: the main function.

    If that process ends without an order to quit, the folder of waveforms is deleted.

    Every order is a tuple that begins with the name of a method of `Worker`; every answer begins
    with a name too.
    """
    # Ctrl-C is for the parent process, which ends this one and with it a running compiler.
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
        self._throttle, self._rate = Throttle(), Rate()
        self._slice = FIRST_SLICE
        self._running = False
        self._remaining = 0  # clocks left of a request, while it does not run
        self._until_step = False
        self._step_deadline = 0.0  # when waiting for a step ends
        self._inputs = 0, 0
        self._activity = ""
        self._failed: str | None = None
        self._unrecorded: str | None = None  # why there is no waveform
        self._snapshot_sent = True
        self._reported = 0.0
        self._sent_state: dict[str, object] = {}

    def serve(self) -> None:
        """Execute orders and run, until the other end is closed or sends `quit`."""
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
            self._install_built()
            try:
                self._advance()
            except (EngineError, OSError) as error:
                self._report_failure(f"{error}; switch the power off and on")
                self._switch_off()
            if not self._snapshot_sent:
                self._send_snapshot()
            if obeyed or time.monotonic() > self._reported + REPORT:
                self._send_state()

    def build(self, number: int, job: Job, activity: str) -> None:
        """Build a machine. The one before runs until it is ready."""
        self._activity = activity
        self._failed = None
        self._builder.request(number, job)

    def power(self, number: int, job: Job) -> None:
        """Switch off, and on again."""
        self._switch_off()
        self.build(number, job, "switching on")

    def _switch_off(self) -> None:
        machine, self._machine = self._machine, None
        if machine is not None:
            self._report_window(machine, whole=False)
            with suppress(EngineError):  # of its waveform, which has been reported
                machine.close()

    def inputs(self, switches: int, buttons: int) -> None:
        """Move contacts."""
        self._inputs = switches, buttons
        if self._machine is not None:
            self._machine.touch(switches, buttons)

    def run(self, running: bool) -> None:
        """Run, or pause."""
        self._running = running
        self._remaining = 0
        self._begin()

    def clocks(self, count: int) -> None:
        """Pause, and run so many clocks."""
        self._running, self._until_step = False, False
        self._remaining = count
        self._begin()

    def step(self) -> None:
        """Pause, and run until the next coil word changes, or the step limit is reached."""
        if self._machine is not None:
            self.clocks(self._machine.step_limit)
            self._until_step = True
            self._step_deadline = time.monotonic() + STEP_TIMEOUT_S

    def speed(self, clocks_per_second: float | None) -> None:
        """Set the speed in clocks per second; None for no limit."""
        self._throttle.speed = clocks_per_second
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

    def snapshot(self) -> None:
        """Answer with a snapshot, or None if there is no machine.

        It is taken after the next run, so that the orders before it have had their effect.
        """
        self._snapshot_sent = False

    def _send_snapshot(self) -> None:
        self._snapshot_sent = True
        machine = self._machine
        if machine is None:
            return self._connection.send(("snapshot", None))
        # Averaged over some clocks, even if each takes seconds.
        span = min(60.0, max(1.0, 5 / (self._throttle.speed or 5)))
        rate = self._rate.update(time.monotonic(), machine.clock, span)
        return self._connection.send(("snapshot", machine.snapshot(rate if self._moving else 0.0)))

    def plate(self) -> None:
        """Answer with the plate so far, or None if there is no machine."""
        machine = self._machine
        self._connection.send(("plate", None if machine is None else machine.cut()))

    @property
    def _moving(self) -> bool:
        return self._running or self._remaining > 0

    def _begin(self) -> None:
        self._throttle.begin(time.monotonic())
        self._rate.clear()

    def _wait(self) -> float:
        if self._machine is None or not self._moving:
            return IDLE
        return 0.0 if self._remaining else min(IDLE, self._throttle.wait(time.monotonic()))

    def _install_built(self) -> None:
        built = self._builder.built()
        if built is None:
            return
        number, job, scan_bits, engine = built
        if isinstance(engine, EngineError):
            self._report_failure(str(engine))
            return self._connection.send(("failed", number))
        self._switch_off()
        self._machine = Machine(engine, job, switches=self._inputs[0])
        if self._inputs[1]:
            self._machine.touch(*self._inputs)
        self._remaining, self._slice = 0, FIRST_SLICE
        self._begin()
        self._failed = self._builder.note
        return self._connection.send(("built", number, job.period, scan_bits, engine.name))

    def _report_failure(self, message: str) -> None:
        self._failed = message

    def _advance(self) -> None:
        machine = self._machine
        if machine is None or not self._moving:
            return
        start = time.monotonic()
        due = self._remaining or self._throttle.due(start)
        if due < 1:
            return
        count = min(due, self._slice)
        made, changed = machine.run(count, once=self._until_step and self._remaining > 0)
        end = time.monotonic()
        if self._remaining:
            over = self._until_step and (changed or end > self._step_deadline)
            self._remaining = 0 if over else self._remaining - made
        else:
            self._throttle.made(made, end)
        if made == self._slice:
            ratio = SLICE / max(end - start, 1e-6)
            self._slice = max(1, round(self._slice * min(2.0, max(0.1, ratio))))
        self._report_window(machine)

    def _report_window(self, machine: Machine, *, whole: bool = True) -> None:
        try:
            window = machine.recorded(whole=whole)
        except EngineError as error:
            self._unrecorded = f"{error}: record again"
        else:
            if window is not None:
                self._unrecorded = None
                self._connection.send(("recorded", window))

    def _send_state(self) -> None:
        self._reported = time.monotonic()
        machine = self._machine
        state: dict[str, object] = {
            "running": self._running,
            "advancing": self._remaining > 0 and machine is not None,
            "stopped": machine is not None and machine.stopped,
            "lost": machine is not None and machine.lost,
            "building": self._activity if self._builder.building else False,
            "speed": self._throttle.speed,
            "recording": machine is not None and machine.recording,
            "done": machine is not None and machine.done,
            "error": self._failed,
            "unrecorded": self._unrecorded,
        }
        if state != self._sent_state:
            self._sent_state = state
            self._connection.send(("state", state))
