"""A way round a pixel, the nearest first."""

from amaranth import Module, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range

__all__ = ["PICTURE_LIMIT", "SpiralWalk"]

PICTURE_LIMIT = 512
"""Most rows and columns of a picture: a pixel number has 9 bits (thesis, 5.4)."""

HEADINGS = ((0, -1), (1, 0), (0, 1), (-1, 0))
"""West, south, east, north: rows and columns of a move."""


class SpiralWalk(wiring.Component):
    """Visits the pixels around one in a square spiral: runs of 1, 1, 2, 2, 3, 3 ... pixels.

    So it meets them in the order of the time that the machine takes to get there, for which a
    diagonal is as long as a straight. The walk runs past the borders of the picture by as much as
    the picture is long; ``last`` is where it has visited all of the picture, whatever pixel of it
    is the centre. Further, its coordinates mean nothing.

    Parameters
    ----------
    rows, columns : int
        Size of the picture, from 1 to ``PICTURE_LIMIT``.

    Members
    -------
    home : In(1)
        Go to pixel (0, 0).
    centre : In(1)
        Begin a spiral around the pixel of this clock.
    advance : In(1)
        Go to the next pixel. Never in the same clock as ``home`` or ``centre``, nor from the last.
    row, column : Out(16)
        Coordinates of the pixel, if ``inside``.
    number : Out(18)
        ``row * columns + column``, if ``inside``.
    following : Out(18)
        ``number`` of the next pixel, to which ``advance`` goes.
    inside : Out(1)
        The pixel is in the picture.
    near : Out(1)
        The pixel is the centre or one of its 8 neighbours.
    last : Out(1)
        The pixel is the last corner of a square around the centre that holds the picture.

    Raises
    ------
    ValueError
        If a size is out of range.
    """

    home: In(1)
    centre: In(1)
    advance: In(1)
    row: Out(16)
    column: Out(16)
    number: Out(18)
    following: Out(18)
    inside: Out(1)
    near: Out(1)
    last: Out(1)

    def __init__(self, *, rows: int, columns: int) -> None:
        self.rows = in_range("rows of the picture", rows, 1, PICTURE_LIMIT)
        self.columns = in_range("columns of the picture", columns, 1, PICTURE_LIMIT)
        super().__init__()

    def elaborate(self, platform) -> Module:
        m = Module()

        longest = max(self.rows, self.columns)
        row = Signal(range(-longest, 2 * longest))
        column = Signal.like(row)
        number = Signal.like(self.number)
        m.d.comb += [
            self.row.eq(row.as_unsigned()),
            self.column.eq(column.as_unsigned()),
            self.number.eq(number),
            # Below 0 is far above, without the sign.
            self.inside.eq((row.as_unsigned() < self.rows)
                           & (column.as_unsigned() < self.columns)),
        ]

        heading = Signal(range(len(HEADINGS)))
        down = Signal(range(-1, 2))
        along = Signal(range(-1, 2))
        offset = Signal(range(-self.columns, self.columns + 1))
        with m.Switch(heading):
            for code, (d_row, d_column) in enumerate(HEADINGS):
                with m.Case(code):
                    m.d.comb += [
                        down.eq(d_row),
                        along.eq(d_column),
                        offset.eq(d_row * self.columns + d_column),
                    ]

        m.d.comb += self.following.eq(number + offset)

        # Both count up to 0 from the length of the run, less one, below it.
        run = Signal(range(-2 * longest, 1))
        run_start = Signal.like(run)
        visited = Signal(range(10))
        m.d.comb += [
            self.near.eq(visited < 9),
            # The square ends with a run to the west that is as long as the one before.
            self.last.eq((run >= 0) & (run_start == 2 - 2 * longest) & (heading == 0)),
        ]

        with m.If(self.advance):
            m.d.sync += [
                row.eq(row + down),
                column.eq(column + along),
                number.eq(self.following),
                run.eq(run + 1),
            ]
            with m.If(self.near):
                m.d.sync += visited.eq(visited + 1)
            with m.If(run >= 0):
                m.d.sync += [heading.eq(heading + 1), run.eq(run_start)]
                with m.If(heading[0] == 0):  # every second run is longer
                    m.d.sync += run_start.eq(run_start - 1)
        with m.If(self.centre):
            m.d.sync += [heading.eq(0), run.eq(0), run_start.eq(0), visited.eq(0)]
        with m.If(self.home):
            m.d.sync += [row.eq(0), column.eq(0), number.eq(0)]

        return m
