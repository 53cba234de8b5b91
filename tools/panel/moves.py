"""What moves the machine: pages that hold an axis, and the way to a point."""

import asyncio
from collections.abc import Hashable, Sequence
from typing import NamedTuple

from ..console import UserError
from .jogging import NOWHERE, Jogging
from .machine import Machine
from .settings import Point
from .stage import AXES, Limit, Message, Refusal, Steps

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
    directions : tuple of int
        In which direction each axis is held.
    goal : int or None
        The point that is being gone to.
    """

    def __init__(self, machine: Machine) -> None:
        self._machine = machine
        self._loop = asyncio.get_running_loop()
        self._speeds: tuple[int, ...] = ()  # that the machine was told
        self.forget()

    def forget(self) -> None:
        """Begin anew, with a machine that stands still."""
        self._release()
        self.end_going()

    def end_going(self) -> None:
        """Note that no point is being gone to any more."""
        self.goal: int | None = None
        self._there: Steps | None = None

    # Holding

    def hold(self, who: Hashable, directions: tuple[int, ...]) -> None:
        """Let somebody hold each axis up (1), down (-1), or not (0)."""
        self._jogging.hold(who, directions, self._loop.time())
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
        directions = self._jogging.directions(self._loop.time())
        for axis, before, direction in zip(AXES, self.directions, directions, strict=True):
            if direction != before:
                self._machine.jog(axis, direction)
                self.end_going()
        self.directions = directions

    def stop(self) -> None:
        """End all movement, whoever holds what, and whatever stands in the line."""
        self._machine.stop()
        self.end_going()
        self._release()

    def _release(self) -> None:
        """Hold nothing any more."""
        self.directions, self._jogging = NOWHERE, Jogging()
        self._halts = self._machine.halts

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

    def hear(self, message: Message) -> Ended | None:
        """Take a message; give a point that the machine does not go to any more by itself."""
        if self._machine.halts != self._halts:
            self._release()
        if isinstance(message, Limit | Refusal):
            self.end_going()
        elif self.goal is not None and not self._machine.in_motion:
            ended = Ended(self.goal, message == self._there)
            self.end_going()
            return ended
        return None
