"""The machines: their pins, their parts, and how these are joined."""

from .mill import Mill

__all__ = ["Mill"]
