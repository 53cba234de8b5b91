"""Contract of the pixels of a picture: each that is set is milled once, and no other.

What makes it so is that a search never passes a pixel that is left to mill: then it meets all of
them, and ends before its coordinates mean nothing any more. So the contract has the whole spiral
and looks into the memories. In the cases of :class:`AnyPicture` the memory of the picture holds,
from the first clock on, whatever the prover chooses.
"""

from collections.abc import Iterable, Iterator

from amaranth import Array, Cat, Mux, Value

from fresa.motion import CoordinateGenerator

from .contract import Bits, Contract

__all__ = ["AnyPicture", "spiral_of", "watch_search"]


class AnyPicture(CoordinateGenerator):
    """A generator of any picture of its size that has as many pixels set."""


def spiral_of(pixels: int) -> Iterator[tuple[int, int, int, int, int]]:
    """Give row and column from the centre, heading, run and start of the next run of a walk."""
    row = column = leg = done = 0
    for _ in range(pixels):
        yield row, column, leg % 4, done - leg // 2, -((leg + 1) // 2)
        down, along = [(0, -1), (1, 0), (0, 1), (-1, 0)][leg % 4]
        row, column, done = row + down, column + along, done + 1
        if done > leg // 2:
            leg, done = leg + 1, 0


def watch_search(c: Contract, dut: CoordinateGenerator, *, down: Bits, at: tuple[Bits, Bits],
                 centre: tuple[Bits, Bits]) -> None:
    """State which pixels are milled, and the lemmas for it.

    `down` and `at` are what the tool does, by the orders that were taken; `centre` is where the
    spiral has its centre.
    """
    state = c.state("coordinates_state")
    walk, milled = c.part("walk"), c.signal("milled")
    row, column, number = (c.signal(f"walk.{name}") for name in ("row", "column", "number"))
    orders = dut.orders

    # The spiral goes all over the picture from any pixel of it, and no further.
    radius = max(dut.rows, dut.columns) - 1
    places = list(spiral_of((2 * radius + 1) ** 2))
    visit = c.keep(range(len(places) + 1), name="visit")
    with c.m.If(c.rst | walk.centre):
        c.m.d.sync += visit.eq(0)
    with c.m.Elif(walk.advance):
        c.m.d.sync += visit.eq(visit + 1)
    d_row, d_column, heading, run, run_start = (
        Array(values)[visit] for values in zip(*places, strict=True))
    c.implication("on-the-spiral", "The pixel looked at is the one that a square spiral has there.",
                  when=state("COPY", "READ", "SEARCH", "WALK"), then=(visit < len(places))
                  & (row == centre[0] + d_row) & (column == centre[1] + d_column)
                  & (c.signal("walk.heading") == heading) & (c.signal("walk.run") == run)
                  & (c.signal("walk.run_start") == run_start)
                  & (c.signal("walk.visited") == Mux(visit < 9, visit, 9)))
    c.invariant("number", "The number of the pixel is that of its row and column.",
                (number - row * dut.columns - column)[:len(number)] == 0, cover=walk.advance)

    # The memories: words, and a bit for each pixel
    size = dut.rows * dut.columns
    known = c.past(1)
    words, words_left = c.words("picture_0"), c.words("to_mill")
    depth, banks = len(words), len(words[0])
    picture, left = ([held[n % depth][n // depth] for n in range(size)]
                     for held in (words, words_left))
    if isinstance(dut, AnyPicture):
        given = c.free(size, name="given")
        c.write("picture_0", (Cat(given[n] if n < size else 0 for n in range(word, depth * banks,
                                                                             depth))
                              for word in range(depth)), when=~known)
        c.assume(_ones(Mux(known, Cat(picture), given)) == dut.pixels_set)
    here = [number == n for n in range(size)]
    at_pixel = [(at[0] == n // dut.columns) & (at[1] == n % dut.columns) for n in range(size)]
    lowers, walks = orders.valid & orders.p.down, orders.valid & ~orders.p.up & down
    cuts = [(lowers & at_pixel[n])
            | (walks & (orders.p.x == n // dut.columns * dut.pixel_steps)
               & (orders.p.y == n % dut.columns * dut.pixel_steps)) for n in range(size)]
    cut = [c.keep(1, name=f"cut_{n}") for n in range(size)]
    for n in range(size):
        with c.m.If(c.rst | ~dut.busy):
            c.m.d.sync += cut[n].eq(0)
        with c.m.Elif(cuts[n] & orders.ready):
            c.m.d.sync += cut[n].eq(1)

    c.implication("mills-set-pixels-only", "The tool is lowered on a pixel, or goes to one, that "
                  "is set.",
                  when=lowers | walks, then=_any(cuts[n] & picture[n] for n in range(size)))
    c.implication("mills-once", "No pixel is milled twice in a job.",
                  when=lowers | walks, then=~_any(cuts[n] & cut[n] for n in range(size)))
    c.implication("mills-all", "When a job ends all that is set is milled, and nothing else.",
                  when=c.past(dut.busy & ~c.rst) & ~dut.busy, then=Cat(cut) == Cat(picture))

    # What makes it so
    reading, writing = c.signal("reading"), c.signal("writing")
    c.implication("copies", "The copy is that of the picture, as far as it has come.",
                  when=state("COPY"), then=(reading == writing + 1) & (writing <= depth)
                  & (c.part("picture_0").read_ports[0].data
                     == Array(words)[writing[:len(writing) - 1]]) & ~_any(cut)
                  & ~_any((word < writing) & (words_left[word] != words[word])
                          for word in range(depth)))
    c.implication("copies-from-the-first", "Otherwise the first word is read next.",
                  when=~state("COPY", "READ"), then=reading == 0)
    c.implication("begins", "A job begins with all pixels to mill, none milled, at the centre.",
                  when=state("COPY"), then=(milled == -dut.pixels_set) & ~_any(cut) & (visit == 0))
    at_work = state("READ", "SEARCH", "WALK", "RAISE", "TRAVEL", "LOWER", "MARK")
    found = (milled < 0) & state("WALK", "RAISE", "TRAVEL", "LOWER")
    c.implication("left-is-not-milled", "A set pixel is milled or left in the copy, and nothing "
                  "else is.", when=at_work,
                  then=~_any(
        (left[n] != picture[n] & ~cut[n]) | (cut[n] & ~picture[n]) for n in range(size)))
    c.implication("counts-what-is-left", "The count is that of the pixels left, and of the one "
                  "that has just been milled.",
                  when=at_work, then=-milled == _ones(Cat(left)) + state("MARK"))
    word = Array(words_left)[number[:len(writing) - 1]]
    c.implication("reads-its-pixel", "The word read from the copy is that of the present pixel.",
                  when=state("READ"), then=c.part("to_mill").read_ports[0].data == word)
    c.implication("holds-its-pixel", "That word is held until the pixel is milled.",
                  when=state("SEARCH") | found, then=c.signal("held") == word)
    c.implication("found-is-left", "A found pixel is set, and not yet milled.",
                  when=found, then=_any(here[n] & left[n] for n in range(size)))
    c.implication("marked-is-not-left", "A pixel just milled is not left.",
                  when=state("MARK"), then=_any(here[n] & cut[n] for n in range(size)))
    order = {place[:2]: count for count, place in enumerate(places)}

    def ahead(n: int) -> Bits:
        """Lie on the way that the spiral has before it, if its centre is in the picture."""
        from_each = ((n // dut.columns - of // dut.columns, n % dut.columns - of % dut.columns)
                     for of in range(size))
        return _any(at_pixel[of] & (visit <= order[place]) for of, place in enumerate(from_each))

    c.implication("remaining-ahead-on-spiral", "The pixels left are ahead on the spiral.",
                  when=state("READ", "SEARCH", "WALK"),
                  then=~_any(left[n] & ~ahead(n) for n in range(size)))


def _ones(bits: Bits) -> Bits:
    return sum((bit for bit in bits), start=Value.cast(0))


def _any(values: Iterable[Bits]) -> Bits:
    return Cat(values).any()
