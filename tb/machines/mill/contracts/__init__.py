"""Contracts of the milling machine, of its orders over a serial line, and of its stop button."""

from .machine import MILL
from .serial_orders import SERIAL_ORDERS
from .stop import STOP

__all__ = ["CONTRACTS"]

CONTRACTS = {"serial_orders": SERIAL_ORDERS, "mill": MILL, "stop": STOP}
