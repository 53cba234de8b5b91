"""Validation of pages' requests: a page may send anything."""

from collections.abc import Callable, Mapping
from functools import partial

from fresa.machines.mill import TOP_SPEED, step_period

from ..console import UserError
from .waves import MOST_CLOCKS

__all__ = ["LONGEST_PERIOD", "read_order"]

Message = Mapping[str, object]

#: Clocks per step at the top speed of the real machine.
LONGEST_PERIOD = step_period(TOP_SPEED)

#: Most clocks of a request, and limits of the speed in clocks per second.
MOST_AT_ONCE = 1_000_000
SPEEDS = (0.1, 1e9)


def read_order(name: str, message: Message) -> int | float | tuple[int, int] | None:
    """Return the argument of an order: levels, a number of clocks, a speed; None if it has none.

    Switches have a mask of those that change, and their levels: a page may have an old state of
    the others.

    Raises
    ------
    UserError
        If there is no such order, or its argument is invalid.
    """
    if name not in _ORDERS:
        raise UserError(f"there is no {name[:40]!r}: {', '.join(sorted(_ORDERS))}")
    return _ORDERS[name](message)


def _whole(message: Message, *, name: str, least: int, most: int) -> int:
    value = message.get(name)
    if not isinstance(value, int) or isinstance(value, bool) or not least <= value <= most:
        raise UserError(f"{name} must be a whole number from {least} to {most}")
    return value


def _switches(message: Message) -> tuple[int, int]:
    mask = _whole(message, name="mask", least=1, most=255)
    value = _whole(message, name="value", least=0, most=255)
    if value & ~mask:
        raise UserError("value must have ones only where mask has them")
    return mask, value


def _clocks_at_once(message: Message) -> int:
    return _whole({"count": 1, **message}, name="count", least=1, most=MOST_AT_ONCE)


def _speed(message: Message) -> float | None:
    speed = message.get("clocks_per_second")
    least, most = SPEEDS
    if speed is None:
        return None
    if isinstance(speed, bool) or not isinstance(speed, int | float) or not least <= speed <= most:
        raise UserError(f"clocks_per_second must be {least:g} to {most:g}, or null for "
                        "no limit")
    return float(speed)


def _nothing(_: Message) -> None:
    return None


_ORDERS: dict[str, Callable[[Message], int | float | tuple[int, int] | None]] = {
    "switches": _switches,
    "buttons": partial(_whole, name="value", least=0, most=15),
    "run": _nothing,
    "pause": _nothing,
    "clock": _clocks_at_once,
    "step": _nothing,
    "speed": _speed,
    "power": _nothing,
    "step_period": partial(_whole, name="clocks", least=1, most=LONGEST_PERIOD),
    "record": partial(_whole, name="clocks", least=1, most=MOST_CLOCKS),
}
