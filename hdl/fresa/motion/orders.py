"""Payloads of the streams between order source, sequencer and order control."""

from amaranth import unsigned
from amaranth.lib import data

__all__ = ["Move", "Order"]


class Order(data.Struct):
    """An order of an order source to the controller: a tool order, or a position to move to.

    With ``up`` or ``down`` the position is ignored.
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
