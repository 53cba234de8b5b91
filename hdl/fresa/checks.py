"""Checks of parameters, so that an impossible value is named where it is given."""

__all__ = ["in_range", "power_of_two"]


def in_range(name: str, value: object, low: int, high: int) -> int:
    """Return `value` if it is a whole number from `low` to `high`.

    Raises
    ------
    ValueError
        If it is not; the message names the parameter and the value.
    """
    if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
        raise ValueError(f"{name} must be a whole number from {low} to {high}, not {value!r}")
    return value


def power_of_two(name: str, value: object, low: int, high: int) -> int:
    """Return `value` if it is a power of two from `low` to `high`.

    Raises
    ------
    ValueError
        If it is not; the message names the parameter and the value.
    """
    number = in_range(name, value, low, high)
    if number & (number - 1):
        raise ValueError(f"{name} must be a power of two, not {number}")
    return number
