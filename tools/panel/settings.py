"""The settings that the panel saves in a file of the user's."""

import json
import math
import os
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path

from ..console import UserError, warn, write_atomically
from .stage import AXES, POINTS, Steps

__all__ = ["FASTEST", "SLOWEST", "TRAVEL", "Settings", "Point", "folder", "load", "save", "um",
           "whole"]

#: A point in um; None for an empty field.
Point = tuple[float | None, float | None, float | None]

#: Speeds that the panel offers, in um/s.
SLOWEST, FASTEST = 1, 26
START_SPEED = 4

#: Travel of an axis in um, the largest coordinate of a point.
TRAVEL = 14_000

#: Most bytes of a settings file.
LARGEST = 1 << 16

#: Share by which the clocks of machine and computer may differ, and seconds that are lost besides:
#: it counts whole ones.
CLOCK_TOLERANCE, SECONDS_TOLERANCE = 0.001, 2.0


@dataclass(frozen=True)
class Settings:
    """The saved settings.

    Attributes
    ----------
    port : str
        Name of the port that was connected last.
    steps : Steps
        The last position of the machine.
    known : bool
        Whether that counts from the origin. If the machine was reset when it may have moved, only
        distances are known.
    on_since : float or None
        When the machine was switched on or reset, in seconds of the epoch. None if none was
        connected yet.
    speeds : tuple of int
        Speed of each axis, in um/s.
    points : tuple of Point
        The seven points.
    """

    port: str = ""
    steps: Steps = Steps(0, 0, 0)
    speeds: tuple[int, ...] = (START_SPEED,) * len(AXES)
    points: tuple[Point, ...] = field(default=((None, None, None),) * len(POINTS))
    known: bool = True
    on_since: float | None = None

    def least_seconds(self, now: float) -> float:
        """Return for how many seconds the machine must be on now, if it was not reset."""
        if self.on_since is None:
            return -math.inf
        return (now - self.on_since) * (1 - CLOCK_TOLERANCE) - SECONDS_TOLERANCE

    def with_speed(self, axis: int, speed: int) -> "Settings":
        """Return a copy with another speed of an axis."""
        return replace(self, speeds=(*self.speeds[:axis], speed, *self.speeds[axis + 1:]))

    def with_point(self, number: int, point: Point) -> "Settings":
        """Return a copy with another point, of 1 to 7."""
        return replace(self, points=(*self.points[:number - 1], point, *self.points[number:]))


def folder() -> Path:
    """Return the folder of the settings."""
    home = os.environ.get("XDG_CONFIG_HOME")
    return (Path(home) if home else Path.home() / ".config") / "fresa"


def load(path: Path) -> Settings:
    """Load the settings; defaults if there are none.

    A damaged file is renamed, with a warning.

    Raises
    ------
    UserError
        If it cannot be read.
    """
    try:
        with path.open("rb") as file:
            data = file.read(LARGEST + 1)
            written = os.fstat(file.fileno()).st_mtime
    except FileNotFoundError:
        return Settings()
    except OSError as error:
        raise UserError(f"cannot read {path}: {error.strerror}") from error
    try:
        if len(data) > LARGEST:
            raise ValueError
        return _read(json.loads(data), written)
    except (ValueError, TypeError, KeyError, RecursionError):
        aside = path.with_name(path.name + ".damaged")
        try:
            path.replace(aside)
        except OSError as error:
            raise UserError(f"{path} is damaged, and cannot be put aside: delete it") from error
        warn(f"{path} is damaged; it is now {aside.name}, and the panel starts with defaults")
        return Settings()


def save(path: Path, settings: Settings) -> None:
    """Save the settings atomically.

    Raises
    ------
    UserError
        If it cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(f"cannot make folder {path.parent}: {error.strerror}") from error
    write_atomically(path, (json.dumps(asdict(settings), indent=1) + "\n").encode())


def _read(data: dict, written: float) -> Settings:
    """Validate all fields: they are sent to the machine. An invalid `on_since` is None.

    In older files some are missing. A machine that was switched on after such a file was written
    does not count its position as saved, so that time stands for `on_since`.

    Raises
    ------
    ValueError, TypeError, KeyError
        If another field is missing or invalid.
    """
    port, points = data["port"], data["points"]
    if type(port) is not str or len(points) != len(POINTS):
        raise ValueError
    axes = range(len(AXES))
    for row in (data["steps"], data["speeds"], *points):
        if len(row) != len(axes):
            raise ValueError
    return Settings(
        port, Steps(*(whole(data["steps"][axis], -2**31, 2**31 - 1) for axis in axes)),
        tuple(whole(data["speeds"][axis], SLOWEST, FASTEST) for axis in axes),
        tuple((um(x), um(y), um(z)) for x, y, z in points),
        bool(data.get("known", True)), _time(data.get("on_since", written)))


def _time(value: object) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 <= value < 1e12:
        return None
    return float(value)


def whole(value: object, least: int, most: int) -> int:
    """Return a value if it is an integer in range.

    Raises
    ------
    ValueError
        If it is not.
    """
    if type(value) is not int or not least <= value <= most:
        raise ValueError(f"must be a whole number from {least} to {most}")
    return value


def um(value: object) -> float | None:
    """Return a coordinate of a point, in um; None for an empty field.

    Raises
    ------
    ValueError
        If it is neither, or out of an axis' travel.
    """
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not (
            -TRAVEL <= value <= TRAVEL):
        raise ValueError(f"must be from {-TRAVEL} to {TRAVEL} um: an axis travels no farther")
    return float(value)
