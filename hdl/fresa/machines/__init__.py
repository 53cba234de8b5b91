"""The machines: their pins, their parts, and how these are joined; and where orders come from."""

from .mill import Mill
from .positioner import Positioner
from .serial_orders import SerialOrders
from .single import Single

__all__ = ["Mill", "Positioner", "SerialOrders", "Single"]
