"""The machines: their pins, their parts, and how these are joined; and where orders come from."""

from .mill import Mill
from .positioner import Positioner
from .serial_orders import SerialOrders
from .single import Single
from .station import MillStation

__all__ = ["Mill", "MillStation", "Positioner", "SerialOrders", "Single"]
