"""Contract of a search for pixels, whatever the memory holds: it ends, with a fault if it must.

`coordinates` states what is milled where the memory holds the picture. Here it holds anything.
"""

from amaranth import Array

from fresa.motion import CoordinateGenerator

from .contract import Case, Component, Contract
from .coordinates import make
from .picture import spiral_of

__all__ = ["SEARCH"]


def describe(c: Contract, dut: CoordinateGenerator) -> None:
    """No pixel is looked at twice; where all were, in vain, a fault shows until reset."""
    state, walk = c.state("coordinates_state"), c.part("walk")
    milled, found = c.signal("milled"), c.signal("found")
    depth = c.part("picture_0").depth
    contents = c.free(depth * len(c.words("picture_0")[0]), name="contents")
    width = len(contents) // depth
    c.write("picture_0", (contents[width * word:][:width] for word in range(depth)),
            when=~c.past(1))
    c.restrict_covers(dut.start & dut.orders.ready)

    places = list(spiral_of((2 * max(dut.rows, dut.columns) - 1) ** 2))
    visit = c.keep(range(len(places) + 1), name="visit")
    with c.m.If(c.rst | walk.centre):
        c.m.d.sync += visit.eq(0)
    with c.m.Elif(walk.advance):
        c.m.d.sync += visit.eq(visit + 1)
    searching = state("READ", "SEARCH")
    passed = state("SEARCH") & (visit == len(places) - 1) & (milled < 0) & ~found
    c.implication("search-bounded", "A search visits no more pixels than the square around the "
                  "tool has that holds the picture.",
                  when=searching, then=visit < len(places))
    c.implication("pixels-left-is-fault", "Where all were visited and pixels are left, a fault "
                  "follows.", when=c.past(passed & ~c.rst), then=dut.fault)
    c.implication("no-earlier-fault", "No fault comes sooner.",
                  when=dut.fault & ~c.past(dut.fault), then=c.past(passed & ~c.rst))
    c.implication("fault-stays", "A fault stays until reset.",
                  when=c.past(dut.fault & ~c.rst), then=dut.fault)
    c.implication("fault-orders-nothing", "In a fault nothing is ordered, and no job is under way.",
                  when=dut.fault, then=~dut.orders.valid & ~dut.busy)
    c.implication("reset-ends-a-fault", "After a reset the next job can begin.",
                  when=c.past(dut.fault & c.rst), then=~dut.fault & ~dut.busy)

    # What makes it so
    _, _, heading, run, run_start = (Array(values)[visit] for values in zip(*places, strict=True))
    c.implication("place-counted", "The registers of the walk agree with the number of pixels "
                  "visited.",
                  when=state("COPY", "READ", "SEARCH", "WALK"), then=(visit < len(places))
                  & (c.signal("walk.heading") == heading) & (c.signal("walk.run") == run)
                  & (c.signal("walk.run_start") == run_start), lemma=True)
    c.invariant("state-in-use", "The state is one of those that there are.", ~state.is_unused(),
                cover=state("SEARCH"), lemma=True)


SEARCH = Component(
    make=make, describe=describe, depth=14,
    cases=(Case({"rows": 1, "columns": 1, "pixels_set": 1, "pixel_steps": 128}),
           Case({"rows": 1, "columns": 2, "pixels_set": 1, "pixel_steps": 128}),
           Case({"rows": 3, "columns": 3, "pixels_set": 4, "pixel_steps": 128}, real=True)))
