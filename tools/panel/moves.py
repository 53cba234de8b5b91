"""Movements: jogging by pages, and movements to points."""

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
    """A movement to a point that has ended, and whether it reached the point."""

    point: int
    reached: bool


class Moves:
    """Movements of a machine, their speeds, and their ends.

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
    """

    def __init__(self, machine: Machine) -> None:
        self._machine = machine
        self._loop = asyncio.get_running_loop()
        self._sent_speeds: tuple[int, ...] = ()
        self.forget()

    def forget(self) -> None:
        """Start again, with a machine that stands still."""
        self._release()
        self.clear_goal()

    def clear_goal(self) -> None:
        """Clear the goal: no movement to a point is under way."""
        self.goal: int | None = None
        self._goal_steps: Steps | None = None

    # Holding

    def hold(self, page: Hashable, directions: tuple[int, ...]) -> None:
        """Let a page hold each axis up (1), down (-1), or not (0)."""
        self._jogging.hold(page, directions, self._loop.time())
        self.follow()

    def refresh(self, page: Hashable) -> None:
        """Renew a page's hold."""
        self._jogging.refresh(page, self._loop.time())

    def leave(self, page: Hashable) -> None:
        """Release the axes that a page holds."""
        self._jogging.leave(page)
        self.follow()

    def follow(self) -> None:
        """Jog each axis as it is held; send changes only."""
        directions = self._jogging.directions(self._loop.time())
        for axis, before, direction in zip(AXES, self.directions, directions, strict=True):
            if direction != before:
                self._machine.jog(axis, direction)
                self.clear_goal()
        self.directions = directions

    def stop(self) -> None:
        """Stop all movement, whatever pages hold and whatever is in the line."""
        self._machine.stop()
        self.clear_goal()
        self._release()

    def _release(self) -> None:
        """Release all axes."""
        self.directions, self._jogging = NOWHERE, Jogging()
        self._halts = self._machine.halts

    # Movements to points, and speeds

    def go(self, number: int, point: Point) -> None:
        """Move to a point.

        Raises
        ------
        UserError
            If it has an empty field.
        """
        steps = self._machine.go(number, point)
        if steps is None:
            raise UserError(f"point {number} has an empty field: fill it in first")
        self.goal, self._goal_steps = number, steps

    def record_speeds(self, speeds: Sequence[int]) -> None:
        """Record the speeds that were sent on connection."""
        self._sent_speeds = tuple(speeds)

    def send_speeds(self, speeds: Sequence[int]) -> None:
        """Send changed speeds, at a low rate: the line is slow, and a slider changes often."""
        if not self._machine.connected:
            return
        for axis, sent, speed in zip(AXES, self._sent_speeds, speeds, strict=True):
            if speed != sent:
                self._machine.set_speed(axis, speed)
        self._sent_speeds = tuple(speeds)

    def receive(self, message: Message) -> Ended | None:
        """Process a message; return a movement to a point that has ended by itself."""
        if self._machine.halts != self._halts:
            self._release()
        if isinstance(message, Limit | Refusal):
            self.clear_goal()
        elif self.goal is not None and not self._machine.in_motion:
            ended = Ended(self.goal, message == self._goal_steps)
            self.clear_goal()
            return ended
        return None
