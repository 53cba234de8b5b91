"""The machines: their pins, their parts, and how these are joined."""

from .mill import Mill
from .single import Single

__all__ = ["Mill", "Single"]
