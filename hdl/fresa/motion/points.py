"""Positions that are kept under a number."""

from amaranth import Cat, Module, Signal, signed
from amaranth.lib import memory, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range

__all__ = ["MAX_POINTS", "PointStore"]

MAX_POINTS = 1023
"""Largest number of points."""


class PointStore(wiring.Component):
    """Memory of points, with a valid bit for each.

    ``stored`` answers in the clock in which the number is given, ``found`` one clock later; a point
    can be read the clock after it is stored. Reset clears all valid bits.

    Parameters
    ----------
    points : int
        Number of points, from 1 to ``MAX_POINTS``. They are counted from 1.
    axes : int
        Numbers of a point, from 1 to 8.
    width : int
        Bits of each, signed, from 2 to 64.

    Members
    -------
    number : In(range(points + 1))
        Number of the point. There is no point 0: nothing is stored under it.
    store : In(1)
        Store ``place`` under this number.
    place : In(signed(width)).array(axes)
        Point to store.
    stored : Out(1)
        The point is valid.
    found : Out(signed(width)).array(axes)
        Point whose number was given in the clock before.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, points: int = 7, axes: int = 3, width: int = 32) -> None:
        self.points = in_range("points", points, 1, MAX_POINTS)
        self.axes = in_range("axes", axes, 1, 8)
        self.width = in_range("width", width, 2, 64)
        super().__init__({
            "number": In(range(self.points + 1)),
            "store": In(1),
            "place": In(signed(self.width)).array(self.axes),
            "stored": Out(1),
            "found": Out(signed(self.width)).array(self.axes),
        })

    def elaborate(self, platform) -> Module:
        m = Module()

        m.submodules.places = places = memory.Memory(
            shape=self.axes * self.width, depth=1 << len(self.number), init=[])
        write, read = places.write_port(), places.read_port()
        written = Signal(1 << len(self.number))
        exists = Signal()
        m.d.comb += [
            exists.eq((self.number != 0) & (self.number <= self.points)),
            self.stored.eq(written.bit_select(self.number, 1)),
            write.addr.eq(self.number),
            write.data.eq(Cat(self.place)),
            write.en.eq(self.store & exists),
            read.addr.eq(self.number),
            Cat(self.found).eq(read.data),
        ]
        with m.If(write.en):
            m.d.sync += written.bit_select(self.number, 1).eq(1)

        return m
