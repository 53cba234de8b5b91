"""Numbers that a program gives, checked before anything is sent."""

import math
import operator

__all__ = ["check_number", "check_whole"]


def check_whole(what: str, value: object, least: int, most: int) -> int:
    """Return a whole number in its range, of any type that counts as one, numpy's too.

    Raises
    ------
    ValueError
        If it is none, such as 1.5 or '7', or out of range.
    """
    try:
        number = operator.index(value)  # type: ignore[arg-type]  # that is what is asked here
    except TypeError:
        raise ValueError(f"{what} must be a whole number, not {value!r}") from None
    if not least <= number <= most:
        raise ValueError(f"{what} must be {least} to {most}, not {number}")
    return number


def check_number(what: str, value: object) -> float:
    """Return a finite number.

    Raises
    ------
    ValueError
        If it is none, such as nan or '7'.
    """
    try:
        number = math.nan if isinstance(value, str) else float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number):
        raise ValueError(f"{what} must be a number, not {value!r}")
    return number
