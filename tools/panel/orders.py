"""Validation of pages' requests: a page may send anything."""

from collections.abc import Mapping

from ..console import UserError
from .settings import FASTEST, SLOWEST, Point, um, whole
from .stage import AXES, POINTS

__all__ = ["read_axis", "read_directions", "read_name", "read_number", "read_page", "read_point",
           "read_speed", "read_switch"]

Message = Mapping[str, object]

LONGEST_NAME = 200


def _whole(message: Message, name: str, least: int, most: int) -> int:
    """Return an integer field of a message.

    Raises
    ------
    UserError
        If it is missing, or out of range.
    """
    try:
        return whole(message.get(name), least, most)
    except ValueError as error:
        raise UserError(f"{name} {error}") from error


def read_axis(message: Message) -> int:
    """Return the index of an axis, from 0."""
    return _whole(message, "axis", 0, len(AXES) - 1)


def read_speed(message: Message) -> int:
    """Return a speed in um/s."""
    return _whole(message, "speed", SLOWEST, FASTEST)


def read_number(message: Message) -> int:
    """Return the number of a point."""
    return _whole(message, "number", POINTS[0], POINTS[-1])


def read_name(message: Message) -> str:
    """Return the name of a port."""
    name = message.get("port")
    if not isinstance(name, str) or not 0 < len(name) <= LONGEST_NAME:
        raise UserError("choose a port first")
    return name


def read_page(message: Message) -> str:
    """Return what a page calls itself."""
    name = message.get("name")
    if not isinstance(name, str) or not 0 < len(name) <= LONGEST_NAME:
        raise UserError("a page must have a name")
    return name


def read_switch(message: Message) -> tuple[str, bool]:
    """Return the name of a limit switch, and whether to press it."""
    end, pressed = message.get("end"), message.get("pressed")
    if not isinstance(end, str) or not isinstance(pressed, bool):
        raise UserError("a limit switch must have a name and be pressed or not")
    return end[:LONGEST_NAME], pressed


def read_directions(message: Message) -> tuple[int, ...]:
    """Return the direction of each axis: 1, -1, or 0."""
    directions = message.get("directions")
    if not isinstance(directions, list) or len(directions) != len(AXES) or not all(
            isinstance(direction, int) and direction in (-1, 0, 1) for direction in directions):
        raise UserError("directions must be three of -1, 0 and 1")
    return tuple(map(int, directions))


def read_point(message: Message) -> Point:
    """Return a point in um; None where a field is empty."""
    place = message.get("place")
    if not isinstance(place, list) or len(place) != len(AXES):
        raise UserError("place must be three numbers of um, or null")
    x, y, z = (_um(value, axis) for value, axis in zip(place, AXES, strict=True))
    return x, y, z


def _um(value: object, axis: str) -> float | None:
    try:
        return um(value)
    except ValueError as error:
        raise UserError(f"{axis} {error}") from error
