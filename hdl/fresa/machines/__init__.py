"""The machines: their pins, their parts, and how these are joined."""

from .mill import Mill
from .positioner import Positioner

__all__ = ["Mill", "Positioner"]
