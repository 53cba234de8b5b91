"""The board and its machine, run by clocks: contacts in, lights and steps out."""

import struct
from collections import deque
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from tb.engines import Changes, Engine, EngineError
from tb.milling import AUTOMATIC, BUTTON, LED, SETTLE, Cut

from .lights import LIGHTS, Lights
from .messages import Job, Snapshot, Window
from .plate import COILS, Plate

__all__ = ["Machine"]

WATCH = (*LIGHTS, *COILS)

#: Contact changes that may be queued; a further one replaces the last.
MOST_CONTACTS = 64

#: Rows of changes that are collected before they are processed.
MOST_PENDING = 1 << 16

#: File size in bytes at which a waveform ends, and clocks between two checks of it.
LARGEST_WAVE = 64 << 20
WAVE_SLICE = 2000


class Machine:
    """A running board, three motors, and a plate under the tool.

    A plate is replaced when the machine is switched on, when a job begins with the tool at the
    corner of the last one, and when automatic mode is entered with the tool elsewhere, not in the
    plate: so the operator sets the origin, where the first pixel is. Otherwise plate and tool stay
    where they are, whatever the machine takes for its origin after a reset or a change of mode.

    Parameters
    ----------
    engine : Engine
        From `tb.milling.ready_to_mill`, not run yet. `close` closes it.
    job : Job
        The job that is built into it, with its period.
    switches : int
        Levels of the switches.

    Attributes
    ----------
    stopped : bool
        Whether BTN3 was pressed since the last reset. It is not visible at any output.
    lost : bool
        Whether automatic mode is on and the origin of the machine is not the corner of the plate.
    """

    def __init__(self, engine: Engine, job: Job, *, switches: int = 0) -> None:
        self.engine, self.job = engine, job
        self.stopped = False
        self._began_lost = False
        self._contacts = deque([(switches, 0)])
        self._held_until = 0
        self._automatic = self._entering = False
        changes = engine.run(0, WATCH)
        self._levels = {name: int(changes[name][-1]) for name in WATCH}
        self._pending: list[Changes] = []
        self._digested, self._digested_to = self._levels, -1
        self._lights = Lights()
        self._shine = bytes(8), bytes(32)
        self._job_clocks: tuple[int, int | None] = (0, None)
        self._window: tuple[Path, int, int] | None = None
        self._plate = Plate(job, self._words())

    def close(self) -> None:
        """Switch it off."""
        self.engine.close()

    @property
    def clock(self) -> int:
        """Clocks since it was switched on."""
        return self.engine.clock

    @property
    def busy(self) -> bool:
        """Whether LD5 is lit: a job is under way."""
        return bool(self._levels["leds"] & LED["busy"])

    @property
    def done(self) -> bool:
        """Whether every target pixel is cut, the tool back over its corner, and LD5 dark."""
        self._digest()
        return not self.busy and self._plate.right

    @property
    def lost(self) -> bool:  # see the class
        self._digest()
        if not self._automatic or self._entering:
            return False
        return self._began_lost if self.busy else not self._plate.at_origin

    @property
    def step_limit(self) -> int:
        """Clocks within which a busy machine makes a step."""
        return (1 << 15) + 32 * max(self.job.pixels.shape) ** 2 + 8 * (self.job.period or 1)

    def touch(self, switches: int, buttons: int) -> None:
        """Move contacts. Each change lasts until the machine has sampled it; none is left out."""
        if len(self._contacts) >= MOST_CONTACTS:
            self._contacts.pop()
        self._contacts.append((switches, buttons))

    def run(self, clocks: int, *, once: bool = False) -> tuple[int, bool]:
        """Run for at least one clock.

        Parameters
        ----------
        clocks : int
            Most clocks to run.
        once : bool
            Stop after the first clock that changes a coil word.

        Returns
        -------
        int
            Clocks that were run.
        bool
            Whether a coil word changed in the last of them.
        """
        if self._window is not None:
            clocks = min(clocks, WAVE_SLICE, self._window[2] - self.clock)
        first, last = self.clock, self.clock + clocks
        words = [self._levels[name] for name in COILS]
        changed = False
        while self.clock < last and not changed:
            if self._contacts and self.clock >= self._held_until:
                self._move_contacts()
            held = self._held_until - self.clock
            changes = self.engine.run(min(last - self.clock, held if held > 0 else clocks), WATCH,
                                      once=once)
            if len(changes):
                self._pending.append(changes)
                self._levels = {name: int(changes[name][-1]) for name in WATCH}
                changed = once and words != [self._levels[name] for name in COILS]
            if self._entering and self.clock >= self._held_until:
                self._enter()
        if sum(map(len, self._pending)) > MOST_PENDING:
            self._digest()
        return self.clock - first, changed

    def _move_contacts(self) -> None:
        switches, buttons = self._contacts.popleft()
        self.engine.set(switches=switches, buttons=buttons)
        self._held_until = self.clock + SETTLE
        # Reset clears the stop, so that with both buttons down reset wins.
        self.stopped = bool(buttons & BUTTON["stop"]) or self.stopped
        self.stopped &= not buttons & BUTTON["reset"]
        automatic = bool(switches & AUTOMATIC)
        self._entering |= automatic and not self._automatic
        self._automatic = automatic

    def _enter(self) -> None:
        """Enter automatic mode: a plate is put where the tool is, unless it is in one."""
        self._entering = False
        self._digest()
        if not (self._plate.at_origin or self._plate.pierced):
            self._plate = Plate(self.job, self._words())

    def _digest(self) -> None:
        """Process the changes collected so far. Runs are too short to do it in each."""
        if self.clock == self._digested_to:
            return
        changes = _joined(self._pending)
        self._lights.feed(self._digested, changes, self._digested_to + 1, self.clock)
        was_busy = bool(self._digested["leds"] & LED["busy"])
        self._pending, self._digested, self._digested_to = [], self._levels, self.clock
        if not len(changes):
            return
        busy = (changes["leds"] & LED["busy"]) != 0
        before = np.concatenate([[was_busy], busy[:-1]])
        start = 0
        for row in map(int, np.flatnonzero(busy != before)):
            at = int(changes.clock[row])
            if busy[row]:
                self._plate.feed(_rows(changes, start, row))
                self._began_lost = not self._plate.at_origin
                if not self._began_lost:
                    self._plate = Plate(self.job, _rows(changes, row, row + 1))
                start = row
            self._job_clocks = (at, None) if busy[row] else (self._job_clocks[0], at)
        self._plate.feed(_rows(changes, start, len(changes)))

    def _words(self) -> Changes:
        """Return the present coil words."""
        return Changes(np.array([self.clock]),
                       {name: np.array([self._levels[name]]) for name in COILS})

    def cut(self, seconds: float = 0.0) -> Cut:
        """Return the plate as milled so far, with the timing of its last job."""
        self._digest()
        begun, ended = self._job_clocks
        clocks = (self.clock if ended is None else ended) - begun
        return Cut(self.job.pixels, self._plate.plant, self.job.period or 1, clocks, seconds,
                   self.engine.name)

    def record(self, path: Path, clocks: int) -> None:
        """Record the waveform of the next `clocks` clocks.

        Raises
        ------
        EngineError
            If it cannot be written, or another is being recorded.
        """
        if self.recording:
            raise EngineError("A waveform is being recorded: wait until it ends")
        self.engine.trace(path)
        self._window = path, self.clock, self.clock + clocks

    @property
    def recording(self) -> bool:
        """Whether a waveform is being recorded."""
        return self._window is not None

    def recorded(self, *, whole: bool = True) -> Window | None:
        """Return a waveform that is complete or has grown too large, once.

        Parameters
        ----------
        whole : bool
            If false, end the recording now.

        Raises
        ------
        EngineError
            If its file is gone or cannot be written, or it ends before its first clock. The
            recording ends, and the machine continues.
        """
        if self._window is None:
            return None
        path, first, last = self._window
        if whole and self.clock < last and 0 <= _size(path) < LARGEST_WAVE:
            return None
        self._window = None
        self.engine.trace(None)
        if (size := _size(path)) < 0:
            raise EngineError("The waveform is lost, its file is gone")
        if self.clock == first:
            path.unlink(missing_ok=True)
            raise EngineError("The waveform has ended before its first clock")
        return Window(str(path), first, self.clock - first, last - first, size)

    def snapshot(self, rate: float) -> Snapshot:
        """Return the changes since the last snapshot.

        Parameters
        ----------
        rate : float
            Clocks per second, to be shown.
        """
        self._digest()
        self._shine = self._lights.take() or self._shine
        x, y, z = self._plate.plant.position
        motors = b"".join(struct.pack("<Bi", self._levels[name], place)
                          for name, place in zip(COILS, (x, y, -z), strict=True))
        return Snapshot(struct.pack("<df", self.clock, rate), *self._shine, motors,
                        *self._plate.take_path(), *self._plate.take_cut())


def _size(path: Path) -> int:
    """Return the size of a file in bytes, -1 if there is none."""
    try:
        return path.stat().st_size
    except OSError:
        return -1


def _rows(changes: Changes, start: int, end: int) -> Changes:
    return Changes(changes.clock[start:end],
                   {name: values[start:end] for name, values in changes.values.items()})


def _joined(parts: Sequence[Changes]) -> Changes:
    if not parts:
        return Changes(np.empty(0, np.int64), {name: np.empty(0, np.int64) for name in WATCH})
    return Changes(np.concatenate([part.clock for part in parts]),
                   {name: np.concatenate([part[name] for part in parts]) for name in WATCH})
