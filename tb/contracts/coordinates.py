"""Contract of the orders that mill a picture."""

from amaranth import Mux

from fresa.motion import CoordinateGenerator

from .contract import Case, Component, Contract
from .picture import AnyPicture, watch_search

__all__ = ["COORDINATES"]


def describe(c: Contract, dut: CoordinateGenerator) -> None:
    """Orders wait to be taken; the tool is down only for one pixel at a time; it ends at home."""
    state = c.state("coordinates_state")
    orders, payload = dut.orders, dut.orders.payload.as_value()
    taken = orders.valid & orders.ready
    tool = orders.p.up | orders.p.down
    walk = c.part("walk")
    row, column = c.signal("walk.row"), c.signal("walk.column")
    lowered, milled = c.signal("lowered"), c.signal("milled")

    early, waited = c.keep(1, name="early", init=1), c.keep(1, name="waited")
    c.m.d.sync += [early.eq(0), waited.eq(waited | (orders.valid & ~orders.ready))]
    c.restrict_covers(early | (~c.rst & dut.start & (orders.ready | ~waited)))
    c.implication("stable-until-ready", "An order that is offered stays, unchanged, until it is "
                  "taken.",
                  when=c.past(orders.valid & ~orders.ready & ~c.rst),
                  then=orders.valid & (payload == c.past(payload)))
    c.implication("up-or-down", "No order is up and down.",
                  when=orders.valid & tool, then=~orders.p.up | ~orders.p.down)
    c.implication("whole-pixels", "A place ordered is that of a pixel of the picture.",
                  when=orders.valid & ~tool,
                  then=walk.inside & (orders.p.x == row * dut.pixel_steps)
                  & (orders.p.y == column * dut.pixel_steps))

    # Where the tool is, by the orders that were taken
    down = c.keep(1, name="tool_down")
    at_row, at_column = c.keep(row.shape(), name="at_row"), c.keep(row.shape(), name="at_column")
    with c.m.If(c.rst):
        c.m.d.sync += [down.eq(0), at_row.eq(0), at_column.eq(0)]
    with c.m.Elif(taken & tool):
        c.m.d.sync += down.eq(orders.p.down)
    with c.m.Elif(taken):
        c.m.d.sync += [at_row.eq(row), at_column.eq(column)]
    c.invariant("state-matches-tool", "Its state agrees with the tool.",
                lowered == down, cover=down)
    c.implication("mills-a-pixel", "With the tool down it goes to one of the 8 neighbours.",
                  when=orders.valid & ~tool & down,
                  then=_near(row - at_row) & _near(column - at_column))
    c.invariant("stays-down", "The tool is not raised to go to one of the 8 neighbours.",
                ~(orders.valid & orders.p.up & down & (milled < 0))
                | ~_near(row - at_row) | ~_near(column - at_column),
                cover=orders.valid & ~tool & down)
    c.implication("lowers-at-its-place", "The tool is lowered where the last order went.",
                  when=orders.valid & orders.p.down,
                  then=~down & (row == at_row) & (column == at_column) & walk.inside)
    c.implication("travels-raised", "To a pixel that is no neighbour it goes with the tool up.",
                  when=state("TRAVEL"), then=~down)
    c.implication("ends-raised-at-home", "A job ends with the tool raised, at the origin.",
                  when=c.past(dut.busy & ~c.rst) & ~dut.busy,
                  then=~down & (at_row == 0) & (at_column == 0))
    c.implication("ends-when-all-are-milled", "A job ends only when as many are milled as are set.",
                  when=c.past(dut.busy & ~c.rst) & ~dut.busy, then=c.past(milled) == 0)
    c.implication("busy", "Orders come only while it is busy.", when=orders.valid, then=dut.busy)
    c.implication("start-begins-job", "A start begins a job.",
                  when=c.past(dut.start & ~dut.busy & ~c.rst),
                  then=dut.busy & (milled == -dut.pixels_set))
    c.implication("no-start-no-job", "Without a start nothing is ordered.",
                  when=c.past(~dut.start & ~dut.busy), then=~dut.busy & ~orders.valid)
    c.implication("reset-is-idle", "Reset ends a job.", when=c.past(c.rst), then=~dut.busy
                  & ~orders.valid)

    # What makes it so
    c.implication("in-the-picture", "What is found is in the picture.",
                  when=state("WALK", "LOWER", "MARK") | (state("RAISE", "TRAVEL") & (milled < 0)),
                  then=walk.inside & (milled < 0))
    c.invariant("counts-up-to-0", "The count of what is left to mill goes up to 0.",
                (milled <= 0) & (milled >= -dut.pixels_set), cover=milled == -1)
    c.implication("home-at-the-end", "When all are milled the way leads home.",
                  when=state("TRAVEL") & (milled == 0), then=(row == 0) & (column == 0))
    c.implication("idle-at-home", "Idle, and while it copies, the walk is at home.",
                  when=~dut.busy | state("COPY"), then=(row == 0) & (column == 0)
                  & (at_row == 0) & (at_column == 0) & ~down)
    c.implication("raised-first", "In the states that need it the tool is up, or down.",
                  when=state("TRAVEL", "LOWER", "WALK", "COPY", "MARK"),
                  then=down == state("WALK", "MARK"))
    c.implication("walk-at-tool", "Before the tool is lowered and marked, the walk is where the "
                  "tool is.", when=state("LOWER", "MARK"),
                  then=(row == at_row) & (column == at_column))
    c.implication("one-command-per-clock", "The walk gets at most one command in a clock.",
                  when=walk.advance, then=~walk.centre & ~walk.home)
    centre_row, centre_column = (c.keep(row.shape(), name=f"centre_{name}")
                                 for name in ("row", "column"))
    with c.m.If(c.rst):
        c.m.d.sync += [centre_row.eq(0), centre_column.eq(0)]
    with c.m.Elif(walk.centre):
        c.m.d.sync += [centre_row.eq(row), centre_column.eq(column)]
    searching = state("COPY", "READ", "SEARCH", "WALK")
    c.implication("centre-is-the-tool", "The spiral goes round the place of the tool.",
                  when=searching, then=(centre_row == at_row) & (centre_column == at_column))
    c.invariant("centre-inside", "That place is in the picture.",
                (at_row >= 0) & (at_row < dut.rows) & (at_column >= 0) & (at_column < dut.columns),
                cover=at_row > 0)
    watch_search(c, dut, down=down, at=(at_row, at_column), centre=(centre_row, centre_column))
    c.leaves_unused_codes(
        "coordinates_state", fault=dut.fault, shows=~orders.valid & ~dut.busy)


def _near(distance):
    return Mux(distance < 0, distance == -1, distance <= 1)


def make(*, rows: int = 0, columns: int = 0, pixels_set: int = 0,
         **parameters) -> CoordinateGenerator:
    """Make a generator of a given picture, or of any with a number of set pixels."""
    if rows:
        return AnyPicture([[row * columns + column < pixels_set for column in range(columns)]
                           for row in range(rows)], **parameters)
    return CoordinateGenerator(**parameters)


COORDINATES = Component(
    make=make, describe=describe, depth=24,
    cases=(Case({"picture": [[False], [True]], "pixel_steps": 128}),
           Case({"picture": [[True], [True], [True]], "pixel_steps": 128}),
           Case({"rows": 2, "columns": 1, "pixels_set": 1, "pixel_steps": 128}),
           *(Case({"rows": rows, "columns": columns, "pixels_set": n, "pixel_steps": 128},
                  real=True)
             for rows, columns in ((2, 2), (2, 3), (3, 2), (3, 3))
             for n in range(1, rows * columns + 1)),
           Case({"picture": [[False], [True]], "pixel_steps": 128}, upset=True)))
