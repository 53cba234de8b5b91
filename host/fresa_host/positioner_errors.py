"""What can go wrong with a positioner alone."""

from .errors import MachineError

__all__ = ["Astray", "PositionError"]


class PositionError(MachineError):
    """The machine goes, or stands, elsewhere than where it was sent: an order was damaged, say."""


#: Its name before, for programs that catch it.
Astray = PositionError
