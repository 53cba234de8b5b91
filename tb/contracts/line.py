"""Contract of the reader of lines."""

from amaranth import Cat, Const, Mux

from fresa.protocol import LineReader
from fresa.protocol.line import LineEnd

from .contract import Bits, Case, Component, Contract

__all__ = ["LINE"]

WATCHED = 4
"""Depth of the buffer whose content is checked; a deeper one has the same logic."""


def describe(c: Contract, dut: LineReader) -> None:
    """Lines that are good come out as they went in, others as one word, in their order."""
    byte, error = dut.bytes.p.byte, dut.bytes.p.error
    taken = dut.bytes.valid & dut.bytes.ready
    given = dut.items.valid & dut.items.ready
    payload = dut.items.payload.as_value()
    starts = taken & (byte == dut.start[0] if dut.start else Const(0))
    inside = c.keep(1, init=not dut.start, name="in_a_line")
    begun = inside | error  # a byte with an error may be a start
    ends = taken & ~starts & begun & Cat(byte == end for end in dut.ends).any()
    more = taken & ~starts & begun & ~ends

    # The line so far
    count = c.keep(range(dut.length + 1), name="bytes_so_far")
    long, damaged = c.keep(1, name="too_long"), c.keep(1, name="damaged_so_far")
    full = count == dut.length
    fits = more & ~(error | damaged | long | full)
    cr = c.keep(1, name="carriage_return")  # is the last of them
    with c.m.If(c.rst | taken):
        c.m.d.sync += cr.eq(fits & ~c.rst & (byte == ord("\r")) if dut.crlf else 0)
    size = count - cr
    with c.m.If(c.rst | ends):
        c.m.d.sync += [inside.eq(not dut.start), count.eq(0), long.eq(0), damaged.eq(0)]
    with c.m.Elif(starts):
        c.m.d.sync += [inside.eq(1), count.eq(0), long.eq(0), damaged.eq(error)]
    with c.m.Elif(more):
        c.m.d.sync += [inside.eq(1), count.eq(Mux(fits, count + 1, 0)), damaged.eq(damaged | error),
                       long.eq(long | full)]
    bad = error | damaged | long
    verdict = Mux(error | damaged, LineEnd.DAMAGED, Mux(long, LineEnd.LONG, LineEnd.GOOD))
    wanted = ends & (bad | (size > 0) | (not dut.skip_empty))

    # Stored items: bytes and ends
    waiting = c.keep(range(dut.depth + 1), name="waiting")
    added = Mux(wanted, Mux(bad, 1, size + 1), 0)
    c.m.d.sync += waiting.eq(Mux(c.rst, 0, waiting - given + added))

    c.implication("whole-lines-only", "An offered item belongs to a line that has ended.",
                  when=dut.items.valid, then=waiting > 0)
    fetching = c.keep(range(3), name="fetching")  # clocks for which the next item waits, up to two
    c.m.d.sync += fetching.eq(
        Mux(c.rst | given | (waiting == 0), 0, fetching + (fetching < 2)))
    c.invariant("offered-in-time", "An item is offered two clocks after it became the next, or "
                "its line was complete.",
                (dut.items.valid == (fetching == 2)) & ((fetching == 0) | (waiting > 0)),
                cover=dut.items.valid)
    c.invariant("read-before-offered", "The ring is read in the clock before an item is offered.",
                c.signal("read") == (fetching == 1), cover=c.signal("read"))
    c.implication("one-line-has-room", "While nothing waits a byte is taken.", when=waiting == 0,
                  then=dut.bytes.ready)
    c.implication("no-byte-without-room", "Without room no byte is taken.",
                  when=waiting + count >= dut.depth - 1, then=~dut.bytes.ready)
    c.implication("room-is-used", "With room a byte is taken.",
                  when=waiting + count < dut.depth - 1,
                  then=dut.bytes.ready)
    c.implication("stable-until-ready", "An offered item stays until it is taken.",
                  when=c.past(dut.items.valid & ~dut.items.ready & ~c.rst),
                  then=dut.items.valid & (payload == c.past(payload)))
    c.implication("reset-clears", "Reset drops every line.", when=c.past(c.rst),
                  then=~dut.items.valid & dut.bytes.ready)
    c.invariant("line-length-and-errors", "The registers hold the length of the line and its "
                "errors.",
                (c.signal("count") == count) & (c.signal("long") == long)
                & (c.signal("damaged") == damaged) & (c.signal("inside") == inside)
                & (c.signal("cr") == cr) & (~cr | (count > 0))
                & (count <= dut.length) & ((count == 0) | (inside & ~long & ~damaged)),
                cover=count == dut.length)
    c.invariant("lines-in-sequence", "The line being received follows the complete ones.",
                ((c.signal("kept") - c.signal("tail"))[:len(c.signal("tail"))] == waiting)
                & (waiting + count < dut.depth), cover=waiting > 1)
    if dut.start:
        c.implication("lost-start", "A byte with an error between lines begins a damaged line.",
                      when=c.past(taken & error & ~inside & ~starts & ~ends & ~c.rst),
                      then=c.signal("inside") & c.signal("damaged"))
        c.implication("lost-line", "An end with an error between lines is that of a damaged "
                      "line.",
                      when=c.past(taken & error & ~inside & ends & ~c.rst),
                      then=waiting == c.past(waiting - given) + 1)
    if dut.crlf:
        c.implication("drops-cr", "A CR right before the end is no byte of the line.",
                      when=c.past(wanted & cr & ~bad & ~c.rst),
                      then=c.signal("kept") == c.past((c.signal("kept") + count)[:len(
                          c.signal("kept"))]))
    if dut.depth == WATCHED:
        _watch_content(c, dut, fits, count, size, wanted, bad, Cat(verdict, Const(1, 1)), waiting)


def _watch_content(c: Contract, dut: LineReader, fits: Bits, count: Bits, size: Bits, wanted: Bits,
                   bad: Bits, end: Bits, waiting: Bits) -> None:
    """State what the bytes and ends are, beside a queue that moves up by itself."""
    byte, payload = dut.bytes.p.byte, dut.items.payload.as_value()
    given = dut.items.valid & dut.items.ready
    so_far = [c.keep(8, name=f"byte_{place}") for place in range(dut.length)]
    for place, at in enumerate(so_far):
        with c.m.If(fits & (count == place)):
            c.m.d.sync += at.eq(byte)
    queue = [c.keep(9, name=f"waits_{place}") for place in range(dut.depth)]
    left = waiting - given
    for place, at in enumerate(queue):
        moved = Mux(given, queue[place + 1], at) if place + 1 < dut.depth else at
        behind = place - left
        new = end
        for number, was in enumerate(so_far):
            new = Mux((behind == number) & (number < size) & ~bad, was, new)
        c.m.d.sync += at.eq(Mux((place < left) | ~wanted, moved, new))

    c.implication("items-as-received", "Offered items are the bytes of good lines and the ends of "
                  "all.", when=dut.items.valid, then=payload == queue[0])
    for fault, word in [
        ("good", LineEnd.GOOD),
        ("long", LineEnd.LONG),
        ("damaged", LineEnd.DAMAGED),
    ]:
        c.implication(f"end-{fault}", f"A {fault} line ends with {word.name}.",
                      when=dut.items.valid & (queue[0] == Cat(Const(word, 8), Const(1, 1))),
                      then=payload == queue[0])
    words = c.words("ring")
    tail, kept = c.signal("tail"), c.signal("kept")

    def word_at(place: Bits) -> Bits:
        value = words[0]
        for address in range(1, dut.depth):
            value = Mux(place[:len(tail)] == address, words[address], value)
        return value

    c.invariant("stored", "Complete lines, and the line so far, are in the buffer.",
                Cat((place >= waiting) | (word_at(tail + place) == at)
                    for place, at in enumerate(queue)).all()
                & Cat((place >= count) | (word_at(kept + place) == at)
                      for place, at in enumerate(so_far)).all(), cover=waiting > 1)
    c.implication("fetched", "An offered item is the stored one.", when=dut.items.valid,
                  then=payload == word_at(tail))


LINE = Component(
    make=LineReader, describe=describe, depth=14,
    cases=(Case({"length": 2, "start": b":"}),
           Case({"length": 2, "ends": b"\r\n", "skip_empty": True}), Case({"length": 1}),
           Case({"length": 2, "ends": b"\n", "crlf": True}),
           Case({"length": 2, "ends": b"\n", "start": b":", "skip_empty": True, "crlf": True}),
           Case({"length": 80, "ends": b"\r\n", "skip_empty": True}, real=True),
           Case({"length": 126, "start": b":"}, real=True)))
