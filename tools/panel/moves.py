"""Movements: jogging by pages, and movements to points."""

import asyncio
import enum
from collections.abc import Hashable
from typing import NamedTuple

from ..console import UserError
from .jogging import NOWHERE, Jogging
from .machine import Machine
from .settings import Point
from .stage import AXES, Limit, Message, Steps

__all__ = ["Ended", "Mode", "Moves"]


class Mode(enum.StrEnum):
    """What the machine does, in one word."""

    OFF = "Not connected"
    IDLE = "Idle"
    GOING = "Going"
    JOGGING = "Jogging"
    STOPPED = "Stopped"
    LIMIT = "Limit"
    LOST = "Lost"


class Ended(NamedTuple):
    """A movement to a point that has ended, and whether it reached the point."""

    point: int
    reached: bool


class Moves:
    """Movements of a machine, and their ends.

    Parameters
    ----------
    machine : Machine
        The machine.

    Attributes
    ----------
    directions : tuple of int
        The direction in which each axis is held.
    goal : int or None
        The point of the movement under way.
    controller : hashable
        The page that moved the machine last; None if it has left.
    lost : bool
        Whether the machine was lost and is not connected again.
    """

    def __init__(self, machine: Machine) -> None:
        self._machine = machine
        self._loop = asyncio.get_running_loop()
        self.controller: Hashable = None
        self.lost = False
        self.forget()

    def forget(self) -> None:
        """Start again, with a machine that stands still."""
        self._release()
        self.clear_goal()
        self._motion = Mode.IDLE  # the last movement, until it is seen to have ended
        self._stopped = False

    @property
    def mode(self) -> Mode:
        """What the machine does. It stands only once it says so."""
        machine = self._machine
        if not machine.connected:
            return Mode.LOST if self.lost else Mode.OFF
        if machine.silent:
            return Mode.LOST
        if any(direction and axis not in machine.limits
               for axis, direction in zip(AXES, self.directions, strict=True)):
            self._motion = Mode.JOGGING
        elif self.goal is not None or machine.in_motion:
            self._motion = Mode.GOING
        elif machine.at_rest:
            self._motion = Mode.IDLE
        if self._motion is not Mode.IDLE:
            return self._motion
        if machine.limits:
            return Mode.LIMIT
        return Mode.STOPPED if self._stopped else Mode.IDLE

    def clear_goal(self) -> None:
        """Clear the goal: no movement to a point is under way."""
        self.goal: int | None = None
        self._goal_steps: Steps | None = None

    # Holding

    def hold(self, page: Hashable, directions: tuple[int, ...]) -> None:
        """Let a page hold each axis up (1), down (-1), or not (0).

        A movement to a point ends, with all its axes, and so does what another page holds.
        """
        if any(directions):
            if self.goal is not None or self._machine.in_motion:
                for axis in AXES:
                    self._machine.jog(axis, 0)
                self.clear_goal()
            self.controller, self._stopped = page, False
        self._jogging.hold(page, directions, self._loop.time())
        self.follow()

    def refresh(self, page: Hashable) -> None:
        """Renew a page's hold."""
        self._jogging.refresh(page, self._loop.time())

    def leave(self, page: Hashable) -> None:
        """Release the axes that a page holds, which is closed."""
        if page == self.controller:
            self.controller = None
        self._jogging.leave(page)
        self.follow()

    def follow(self) -> None:
        """Jog each axis as it is held; send changes only."""
        directions = self._jogging.directions(self._loop.time())
        for axis, before, direction in zip(AXES, self.directions, directions, strict=True):
            if direction != before:
                self._machine.jog(axis, direction)
        self.directions = directions

    def stop(self) -> None:
        """Stop all movement, whatever pages hold and whatever is in the line."""
        self._machine.stop()
        self.clear_goal()
        self._release()
        self._stopped = True

    def _release(self) -> None:
        """Release all axes."""
        self.directions, self._jogging = NOWHERE, Jogging()
        self._halts = self._machine.halts

    # Movements to points

    def go(self, page: Hashable, number: int, point: Point) -> None:
        """Let a page move the machine to a point. What pages hold is released.

        Raises
        ------
        UserError
            If it has an empty field.
        """
        if None in point:
            raise UserError(f"point {number} has an empty field: fill it in first")
        self._jogging = Jogging()
        self.follow()
        self.goal, self._goal_steps = number, self._machine.go(number, point)
        self.controller, self._stopped = page, False

    def receive(self, message: Message) -> Ended | None:
        """Process a message; return a movement to a point that has ended by itself."""
        if self._machine.halts != self._halts:
            self._release()
            self._stopped = True
        if isinstance(message, Limit):
            self.clear_goal()
        elif self.goal is not None and not self._machine.in_motion:
            ended = Ended(self.goal, message == self._goal_steps)
            self.clear_goal()
            return ended
        return None
