"""What orders and movements are made of: others lay the bits out by hand."""

from amaranth.lib import data

from fresa.motion import Move, Order


class TestLayouts:
    def test_order(self):
        order = data.Const(Order.as_shape(), 0x1234 | 0x5678 << 16 | 1 << 32)
        assert (order.x, order.y, order.up, order.down) == (0x1234, 0x5678, 1, 0)
        assert Order.as_shape().size == 34

    def test_move(self):
        move = data.Const(Move.as_shape(), 0b011 | 0b110 << 3 | 0xABCD << 6)
        assert (move.axes, move.direction, move.steps) == (0b011, 0b110, 0xABCD)
        assert Move.as_shape().size == 22
