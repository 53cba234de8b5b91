"""Contract of the way round a pixel."""

from amaranth import Mux, Signal, signed

from fresa.motion import SpiralWalk

from .contract import Case, Component, Contract

__all__ = ["SPIRAL"]


def describe(c: Contract, dut: SpiralWalk) -> None:
    """A square spiral, as far as the coordinates go, and pixel numbers that follow it."""
    row, column, number = c.signal("row"), c.signal("column"), c.signal("number")
    heading, run, run_start = c.signal("heading"), c.signal("run"), c.signal("run_start")
    visited = c.signal("visited")
    longest = max(dut.rows, dut.columns)
    # One thing at a time, from where the centre is in the picture, and no further than the last.
    c.assume(~(dut.advance & (dut.centre | dut.home | dut.last)))
    for place in (row, column):
        c.assume(~dut.advance | ((place > -longest) & (place < 2 * longest - 1)))

    inside = (row >= 0) & (row < dut.rows) & (column >= 0) & (column < dut.columns)
    moved = c.past(dut.advance & ~c.rst)
    down, along = row - c.past(row), column - c.past(column)
    c.implication("inside", "Inside is where the picture has a pixel.", when=row == 0,
                  then=dut.inside == inside)
    c.implication("outside", "Outside is where it has none.", when=~inside, then=~dut.inside)
    c.implication("one-pixel", "An advance goes to one of the four neighbours.", when=moved,
                  then=((down == 0) & ((along == 1) | (along == -1)))
                  | ((along == 0) & ((down == 1) | (down == -1))))
    c.implication("following", "An advance goes to the pixel of the following number.", when=moved,
                  then=dut.number == c.past(dut.following))
    c.implication("stays", "Without an advance it stays.",
                  when=c.past(~dut.advance & ~dut.home & ~c.rst), then=(down == 0) & (along == 0))
    c.implication("home", "Home is pixel 0.", when=c.past(dut.home | c.rst),
                  then=(row == 0) & (column == 0) & (number == 0))
    c.invariant("number", "The number of a pixel is its row times the columns, and its column.",
                (number - row * dut.columns - column)[:18] == 0, cover=dut.inside
                & (row == dut.rows - 1))
    c.implication("coordinates", "The coordinates are those of the walk.", when=inside,
                  then=(dut.row == row) & (dut.column == column) & (dut.number == number))

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
        c.invariant(f"spiral-{name}", f"Each leg {name} lies where a square spiral has it.",
                    ~known | (heading != code) | (
                        (k[0] == odd) & (run <= 0) & (done >= 0)
                        & (d_row == corner_row + by_row * done)
                        & (d_column == corner_column + by_column * done)),
                    cover=known & (heading == code))
    reach = longest - 1
    c.invariant("in-the-square", "The walk stays in the square that holds the picture, from any "
                "pixel of it.", ~known | ((d_row >= -reach) & (d_row <= reach)
                                          & (d_column >= -reach) & (d_column <= reach)),
                cover=known & (d_row == reach))
    c.implication("last-is-the-corner", "The last pixel is the corner of that square, in the last "
                  "run to the west.", when=known & dut.last,
                  then=(d_row == -reach) & (d_column == -reach) & (heading == 0))
    c.implication("corner-is-last", "And there it is the last.",
                  when=known & (d_row == -reach) & (d_column == -reach) & (k == 2 * reach)
                  & (heading == 0), then=dut.last)
    c.implication("near", "Near is the centre and its 8 neighbours.", when=known & dut.near,
                  then=(d_row >= -1) & (d_row <= 1) & (d_column >= -1) & (d_column <= 1))
    order = [(0, 0), (0, -1), (1, -1), (1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1)]
    for count, (r, col) in enumerate(order):
        c.implication(f"visit-{count}", f"Pixel {count} of the walk lies at ({r}, {col}) of its "
                      "centre.", when=known & (visited == count),
                      then=(d_row == r) & (d_column == col))
    c.invariant("visited-at-most-9", "Nine pixels are counted and no more.", visited <= 9,
                cover=visited == 3)
    c.implication("farther", "After nine pixels none is a neighbour.", when=known & (visited == 9),
                  then=(d_row > 1) | (d_row < -1) | (d_column > 1) | (d_column < -1))


SPIRAL = Component(make=SpiralWalk, describe=describe, depth=14,
                   cases=(Case({"rows": 2, "columns": 3}), Case({"rows": 3, "columns": 2}),
                          Case({"rows": 1, "columns": 2}),
                          Case({"rows": 16, "columns": 16}, real=True)))
