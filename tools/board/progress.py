"""How far a job is, and how long it has taken: here, and on the real board."""

from typing import Protocol

from tb.milling import Cut

__all__ = ["JobTimer"]


class Milling(Protocol):
    """What is timed of a `tools.board.machine.Machine`."""

    jobs: int
    stopped: bool

    @property
    def busy(self) -> bool:
        """Whether a job is under way."""
        ...

    def cut(self) -> Cut:
        """Return the plate as milled so far, with the timing of its last job."""
        ...


class JobTimer:
    """Measures the time of a job, and of a build. Pauses do not count."""

    def __init__(self) -> None:
        self._job: tuple[int, int] = (0, 0)  # the machine's, and its number of jobs
        self._elapsed = 0.0
        self._at = 0.0
        self._building_since: float | None = None

    def update(self, machine: Milling | None, now: float, *, moving: bool, building: bool) -> None:
        """Continue up to a time in seconds; to be called often."""
        if building != (self._building_since is not None):
            self._building_since = now if building else None
        job = (0, 0) if machine is None else (id(machine), machine.jobs)
        if job != self._job:
            self._job, self._elapsed = job, 0.0
        elif machine is not None and moving and machine.busy and not machine.stopped:
            self._elapsed += now - self._at
        self._at = now

    def report(self, machine: Milling | None) -> dict[str, object]:
        """Describe the progress for pages.

        Returns
        -------
        dict
            ``building_s``, the seconds of the build under way, or None. ``job``, None or that of
            the machine's last job: whether it is ``busy``, pixels ``cut``, seconds ``elapsed_s``,
            and ``real_s``, those that the real board takes for as much at its top speed.
        """
        building = self._building_since
        job = None
        if machine is not None and machine.jobs:
            cut = machine.cut()
            job = {"busy": machine.busy, "cut": int((cut.plant.cut & cut.target).sum()),
                   "elapsed_s": round(self._elapsed), "real_s": round(cut.job_seconds())}
        return {"building_s": None if building is None else round(self._at - building), "job": job}
