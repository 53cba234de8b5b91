"""What travels between the parts that decide how the machine moves."""

from amaranth import unsigned
from amaranth.lib import data

__all__ = ["Move", "Order"]


class Order(data.Struct):
    """What an order source asks of the controller: a tool order, or a place to go to.

    With ``up`` or ``down`` the position is not looked at.
    """

    x: unsigned(16)  # target row, in steps from the origin
    y: unsigned(16)  # target column, in steps from the origin
    up: unsigned(1)  # raise the tool
    down: unsigned(1)  # lower the tool


class Move(data.Struct):
    """A simple movement: one axis, or several that step in the same clocks, some steps each.

    Bits 0, 1 and 2 of ``axes`` and ``direction`` are X, Y and Z.
    """

    axes: unsigned(3)  # 1: the axis moves
    direction: unsigned(3)  # 1: ascending
    steps: unsigned(16)
