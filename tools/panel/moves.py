"""What moves the machine: pages that hold an axis, and the way to a point."""

import asyncio
from collections.abc import Hashable, Sequence
from typing import NamedTuple

from fresa_host.positioner_lines import AXES, Limit, Refusal, Steps

from ..console import UserError
from .jogging import NOWHERE, Jogging
from .line import Heard
from .machine import Machine
from .settings import Point

__all__ = ["Ended", "Moves"]


class Ended(NamedTuple):
    """A point that is not being gone to any more, and whether the machine is there."""

    point: int
    there: bool


class Moves:
    """What moves a machine, at which speed, and what has stopped it.

    Parameters
    ----------
    machine : Machine
        It.

    Attributes
    ----------
    ways : tuple of int
        Which way each axis is held.
    goal : int or None
        The point that is being gone to.
    limits : set of str
        Axes that a limit switch has stopped, until they are moved.
    """

    def __init__(self, machine: Machine) -> None:
        self._machine = machine
        self._loop = asyncio.get_running_loop()
        self._speeds: tuple[int, ...] = ()  # that the machine was told
        self.limits: set[str] = set()
        self.forget()

    def forget(self) -> None:
        """Begin anew, with a machine that stands still."""
        self.ways, self._jogging = NOWHERE, Jogging()
        self.end_going()
        self.limits.clear()

    def end_going(self) -> None:
        """Note that no point is being gone to any more."""
        self.goal: int | None = None
        self._there: Steps | None = None

    # Holding

    def hold(self, who: Hashable, ways: tuple[int, ...]) -> None:
        """Let somebody hold each axis up (1), down (-1), or not (0)."""
        self._jogging.hold(who, ways, self._loop.time())
        self.follow()

    def refresh(self, who: Hashable) -> None:
        """Note that somebody still holds what was held."""
        self._jogging.refresh(who, self._loop.time())

    def leave(self, who: Hashable) -> None:
        """Let go of what somebody holds."""
        self._jogging.leave(who)
        self.follow()

    def follow(self) -> None:
        """Let each axis move as it is held; tell the machine only what is new."""
        ways = self._jogging.ways(self._loop.time())
        for axis, before, way in zip(AXES, self.ways, ways, strict=True):
            if way != before:
                self._machine.jog(axis, way)
                self.end_going()
                if way:
                    self.limits.discard(axis)
        self.ways = ways

    def stop(self) -> None:
        """End all movement, whoever holds what, and whatever stands in the line."""
        self._machine.stop()
        self.end_going()
        self.ways, self._jogging = NOWHERE, Jogging()

    # Going to points, and speeds

    def go(self, number: int, point: Point) -> None:
        """Go to a point.

        Raises
        ------
        UserError
            If it has an empty field.
        """
        steps = self._machine.go(number, point)
        if steps is None:
            raise UserError(f"point {number} has an empty field: fill it in first")
        self.goal, self._there = number, steps
        self.limits.clear()

    def knows_speeds(self, speeds: Sequence[int]) -> None:
        """Note which speeds the machine was told, when it was connected."""
        self._speeds = tuple(speeds)

    def tell_speeds(self, speeds: Sequence[int]) -> None:
        """Tell the machine what is new, seldom: the line is slow, and a slider says much."""
        if not self._machine.connected:
            return
        for axis, told, speed in zip(AXES, self._speeds, speeds, strict=True):
            if speed != told:
                self._machine.set_speed(axis, speed)
        self._speeds = tuple(speeds)

    def hear(self, said: Heard) -> Ended | None:
        """Take what the machine says; give a point that it does not go to any more by itself.

        What it refuses on the way to a point may be that way: all movement is ended.
        """
        if isinstance(said, Limit):
            self.limits.add(said.axis)
            self.end_going()
        elif isinstance(said, Refusal):
            if self._machine.in_motion:
                self.stop()
            self.end_going()
        elif self.goal is not None and not self._machine.in_motion:
            ended = Ended(self.goal, said == self._there)
            self.end_going()
            return ended
        return None
