"""Contracts of the milling machine, and of its orders over a serial line."""

from .machine import MILL
from .serial_orders import SERIAL_ORDERS

__all__ = ["CONTRACTS"]

CONTRACTS = {"serial_orders": SERIAL_ORDERS, "mill": MILL}
