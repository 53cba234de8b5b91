"""Contract of the way round a pixel."""

from amaranth import Mux, Signal, signed

from fresa.motion import SpiralWalk, spiral

from .contract import Bug, Case, Component, Contract

__all__ = ["SPIRAL"]


def describe(c: Contract, dut: SpiralWalk) -> None:
    """A square spiral, as far as the coordinates go, and pixel numbers that follow it."""
    row, column, number = c.signal("row"), c.signal("column"), c.signal("number")
    heading, run, run_start = c.signal("heading"), c.signal("run"), c.signal("run_start")
    visited = c.signal("visited")
    longest = max(dut.rows, dut.columns)
    # One thing at a time, and no further than the coordinates reach.
    c.assume(~(dut.advance & (dut.centre | dut.home)))
    for place in (row, column):
        c.assume(~dut.advance | ((place > -longest) & (place < 2 * longest - 1)))
    c.assume(~dut.advance | (run_start > 2 - 2 * longest))

    inside = (row >= 0) & (row < dut.rows) & (column >= 0) & (column < dut.columns)
    moved = c.past(dut.advance & ~c.rst)
    down, along = row - c.past(row), column - c.past(column)
    c.holds("inside", "Inside is where the picture has a pixel.", when=row == 0,
            then=dut.inside == inside,
            bug=Bug(spiral, "column.as_unsigned() < self.columns", "column < self.columns"))
    c.holds("outside", "Outside is where it has none.", when=~inside, then=~dut.inside,
            bug=Bug(spiral, "row.as_unsigned() < self.rows", "row < self.rows"))
    c.holds("one-pixel", "An advance goes to one of the four neighbours.", when=moved,
            then=((down == 0) & ((along == 1) | (along == -1)))
            | ((along == 0) & ((down == 1) | (down == -1))),
            bug=Bug(spiral, "column.eq(column + along)", "column.eq(column + along + down)"))
    c.holds("stays", "Without an advance it stays.",
            when=c.past(~dut.advance & ~dut.home & ~c.rst), then=(down == 0) & (along == 0),
            bug=Bug(spiral, "with m.If(self.advance):", "with m.If(self.advance | self.centre):"))
    c.holds("home", "Home is pixel 0.", when=c.past(dut.home | c.rst),
            then=(row == 0) & (column == 0) & (number == 0),
            bug=Bug(spiral, "column.eq(0), number", "column.eq(column), number"))
    c.always("number", "The number of a pixel is its row times the columns, and its column.",
             (number - row * dut.columns - column)[:18] == 0, seen=dut.inside
             & (row == dut.rows - 1),
             bug=Bug(spiral, "d_row * self.columns + d_column", "d_row * self.rows + d_column"))
    c.holds("coordinates", "The coordinates are those of the walk.", when=inside,
            then=(dut.row == row) & (dut.column == column) & (dut.number == number),
            bug=Bug(spiral, "self.column.eq(column.as_unsigned())",
                    "self.column.eq(row.as_unsigned())"))

    # Where it is from its centre follows from the leg of the spiral and how far along it is.
    shape = signed(len(row) + 3)
    from_row = c.keep(shape, name="from_row")
    from_column = c.keep(shape, name="from_column")
    d_row, d_column = Signal(shape), Signal(shape)
    spiralling = c.keep(1, name="spiralling", init=1)  # no home since the centre
    centred = c.past(dut.centre | c.rst, init=1)
    was_home = c.past(dut.home & ~dut.centre)
    c.m.d.comb += [d_row.eq(Mux(centred, 0, from_row + down)),
                   d_column.eq(Mux(centred, 0, from_column + along))]
    known = Signal(name="knows_centre")
    c.m.d.comb += known.eq(centred | (spiralling & ~was_home))
    c.m.d.sync += [from_row.eq(d_row), from_column.eq(d_column), spiralling.eq(known)]
    k = -run_start
    legs = [  # west, south, east, north: pixels in the leg, less one; row and column of its corner
        (k, -(k >> 1), (k >> 1), 0, -1),
        (k - 1, -((k - 1) >> 1), -((k + 1) >> 1), 1, 0),
        (k, (k + 1) >> 1, -((k + 1) >> 1), 0, 1),
        (k - 1, k >> 1, k >> 1, -1, 0),
    ]
    for code, (length, corner_row, corner_column, by_row, by_column) in enumerate(legs):
        name = ("west", "south", "east", "north")[code]
        done = run + length
        odd = code in (1, 2)
        c.always(f"spiral-{name}", f"Each leg {name} lies where a square spiral has it.",
                 ~known | (heading != code) | (
                     (k[0] == odd) & (run <= 0) & (done >= 0)
                     & (d_row == corner_row + by_row * done)
                     & (d_column == corner_column + by_column * done)),
                 seen=known & (heading == code),
                 bug=Bug(spiral, "with m.If(run >= 0):", "with m.If(run >= -1):")
                 if name in ("west", "north") else
                 Bug(spiral, "with m.If(heading[0] == 0):", "with m.If(heading[0] == 1):"))
    c.holds("near", "Near is the centre and its 8 neighbours.", when=known & dut.near,
            then=(d_row >= -1) & (d_row <= 1) & (d_column >= -1) & (d_column <= 1),
            bug=Bug(spiral, "visited < 9", "visited < 10"))
    order = [(0, 0), (0, -1), (1, -1), (1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1)]
    miscounts = Bug(spiral, "visited.eq(visited + 1)", "visited.eq(visited + 1 + (visited == 3))")
    for count, (r, col) in enumerate(order):
        c.holds(f"visit-{count}", f"Pixel {count} of the walk lies at ({r}, {col}) of its centre.",
                when=known & (visited == count), then=(d_row == r) & (d_column == col),
                bug=Bug(spiral, "visited.eq(visited + 1)", "visited.eq(visited + self.inside)")
                if count < 5 else miscounts)
    c.always("visited-at-most-9", "Nine pixels are counted and no more.", visited <= 9,
             seen=visited == 3, bug=Bug(spiral, "with m.If(self.near):", "with m.If(1):"))
    c.holds("farther", "After nine pixels none is a neighbour.", when=known & (visited == 9),
            then=(d_row > 1) | (d_row < -1) | (d_column > 1) | (d_column < -1),
            bug=miscounts)


SPIRAL = Component(make=SpiralWalk, describe=describe, depth=14,
                   cases=(Case({"rows": 2, "columns": 3}), Case({"rows": 3, "columns": 2}),
                          Case({"rows": 16, "columns": 16}, real=True)))
