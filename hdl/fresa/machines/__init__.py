"""The machines: their pins, their parts, and how these are joined."""

from .mill import Mill
from .positioner import Positioner
from .single import Single

__all__ = ["Mill", "Positioner", "Single"]
