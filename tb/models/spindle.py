"""Power of a spindle: what it has to be, in exact numbers."""

__all__ = ["power"]

FULL_POWER, LEAST_POWER = 1 << 16, 1 << 8


def _ratio(part: int, whole: int) -> int:
    """Return a share of full power, at most that."""
    return FULL_POWER if whole <= 0 else max(0, min(FULL_POWER, (part << 16) // whole))


def power(*, on: int, scaled: int, speed: int, override: int, least: int, most: int,
          path_speed: int, feed: int) -> int:
    """Return what the power has to be."""
    if not on or not speed:
        return 0
    factor = (override * 4096 + 50) // 100  # to the nearest of these digits
    share = max(LEAST_POWER, _ratio(speed * factor - (1000 * least << 12),
                                    1000 * (most - least) << 12))
    if not scaled:
        return share
    return share * _ratio(path_speed, feed) >> 16 if path_speed else 0
