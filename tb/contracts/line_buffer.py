"""Contract of the buffer that passes lines on while they come."""

from amaranth import Cat, Const, Mux

from fresa.protocol import LineBuffer, LineEnd

from .contract import Bits, Case, Component, Contract

__all__ = ["LINE_BUFFER"]

WATCHED = 4
"""Largest depth of which the content is checked; a deeper FIFO has the same logic."""


def describe(c: Contract, dut: LineBuffer) -> None:
    """Items come out as a queue of lines would have them, and each line has its end."""
    byte, error = dut.bytes.p.byte, dut.bytes.p.error
    taken = dut.bytes.valid & dut.bytes.ready
    given = dut.items.valid & dut.items.ready
    payload = dut.items.payload.as_value()

    count = c.keep(range(dut.depth + 2), name="waiting")  # in the FIFO and behind it
    full = count - dut.items.valid == dut.depth
    owed = c.keep(range(dut.depth + 1), name="lost_ends")
    pays = (owed != 0) & ~full
    begun, damaged = c.keep(1, name="has_begun"), c.keep(1, name="damaged_so_far")
    after = c.keep(1, name="behind_cr_or_silence")
    silent = Const(0)
    if dut.silence is not None:
        quiet = c.keep(range(dut.silence), name="quiet")  # clocks since the last byte
        c.m.d.sync += quiet.eq(
            Mux(c.rst | taken, 0, quiet + (quiet < dut.silence - 1)))
        silent = begun & ~dut.bytes.valid & (quiet == dut.silence - 1) & ~pays
        c.invariant("silence", "The time since the last byte is measured.",
                    c.signal("left") == dut.silence - 1 - quiet, cover=silent)
    belongs = after & (byte == 0x0A) & ~error
    ends = silent | (taken & ((byte == 0x0D) | (byte == 0x0A)) & ~belongs)
    more = taken & (byte != 0x0D) & (byte != 0x0A)
    bad = damaged | (taken & error)
    new = ends | (more & ~bad)
    stored = (new | pays) & ~full
    many = owed == (1 << len(owed)) - 1
    c.m.d.sync += [
        count.eq(Mux(c.rst, 0, count - given + stored)),
        owed.eq(Mux(c.rst, 0, owed - pays + (ends & full & ~many))),
    ]
    with c.m.If(c.rst | ends):
        c.m.d.sync += [begun.eq(0), damaged.eq(0)]
    with c.m.Elif(more):
        c.m.d.sync += [begun.eq(1), damaged.eq(bad | full)]
    with c.m.If(c.rst | taken | silent):
        c.m.d.sync += after.eq(~c.rst & (silent | (byte == 0x0D)))

    c.implication("never-waits-for-room", "A byte is taken at once, but while a lost end is "
                  "stored.", when=full | (owed == 0), then=dut.bytes.ready)
    c.implication("lost-ends-first", "While a lost end is stored nothing is taken.", when=pays,
                  then=~dut.bytes.ready)
    c.invariant("free", "It shows for how many items there is room.",
                dut.free == dut.depth - (count - dut.items.valid), cover=full)
    c.invariant("overflow", "A byte of a line that is good so far, or an end, that has no room "
                "shows as an overflow, and nothing else.", dut.overflow == (new & full),
                cover=dut.overflow)
    c.invariant("no-item-of-nothing", "An item is offered only if there is one.",
                count >= dut.items.valid, cover=dut.items.valid)
    late = c.keep(range(3), name="not_offered")  # clocks for which an item waits and none is
    c.m.d.sync += late.eq(Mux(c.rst | dut.items.valid | (count == 0), 0, late + (late < 2)))
    c.implication("offered-in-time", "An item is offered three clocks after its byte was taken, or "
                  "within two after the item before it.", when=late == 2, then=dut.items.valid)
    c.implication("stable-until-ready", "An offered item stays until it is taken.",
                  when=c.past(dut.items.valid & ~dut.items.ready & ~c.rst),
                  then=dut.items.valid & (payload == c.past(payload)))
    c.implication("reset-clears", "Reset drops everything.", when=c.past(c.rst),
                  then=~dut.items.valid & (dut.free == dut.depth))
    size = len(c.signal("tail"))
    c.invariant("registers", "The registers hold the state of the line, and where the items are.",
                (c.signal("owed") == owed) & (c.signal("begun") == begun)
                & (c.signal("owes") == (owed != 0)) & (c.signal("room") == (dut.free != 0))
                & (c.signal("waits") == (dut.free != dut.depth))
                & (c.signal("damaged") == damaged) & (c.signal("after") == after)
                & (~damaged | begun)
                & ((c.signal("head") - c.signal("tail"))[:size] == (dut.depth - dut.free)[:size])
                & (count <= dut.depth + dut.items.valid)
                & (c.signal("read") <= (count > dut.items.valid))
                & ((late == 0) | (count > 0)),
                cover=owed != 0)
    if dut.depth <= WATCHED:
        end = Cat(Mux(bad | pays, LineEnd.DAMAGED, LineEnd.GOOD), Const(1, 1))
        _watch_content(c, dut, count, given, stored, Mux(more, byte, end), ends, owed, many & full)


def _watch_content(c: Contract, dut: LineBuffer, count: Bits, given: Bits, stored: Bits,
                   new: Bits, ends: Bits, owed: Bits, beyond: Bits) -> None:
    """State what the items are, beside a queue that moves up by itself."""
    queue = [c.keep(9, name=f"waits_{place}") for place in range(dut.depth + 1)]
    left = count - given
    for place, at in enumerate(queue):
        moved = Mux(given, queue[place + 1], at) if place < dut.depth else at
        c.m.d.sync += at.eq(Mux(stored & (left == place), new, moved))
    payload, valid = dut.items.payload.as_value(), dut.items.valid
    c.implication("items-as-received", "Items come in the order in which they were received.",
                  when=valid, then=payload == queue[0])
    for name, sentence, kind in [
        ("byte-as-received", "The bytes of a line come as they were received.", ~queue[0][8]),
        ("good-end", "A line without a fault ends as GOOD.",
         queue[0] == 0x100 | LineEnd.GOOD.value),
        ("damaged-end", "A line of which a byte was lost or had an error ends as DAMAGED.",
         queue[0] == 0x100 | LineEnd.DAMAGED.value),
    ]:
        c.implication(name, sentence, when=valid & kind, then=payload == queue[0])

    lines, answered = c.keep(4, name="lines"), c.keep(4, name="lines_out")
    lost = c.keep(1, name="too_many")  # more ends than are counted
    c.m.d.sync += [
        lines.eq(Mux(c.rst, 0, lines + ends)),
        answered.eq(Mux(c.rst, 0, answered + (given & payload[8]))),
        lost.eq(~c.rst & (lost | (ends & beyond))),
    ]
    inside = sum(((place < count) & at[8] for place, at in enumerate(queue)), start=Const(0))
    c.invariant("each-line-ends-once", "Each line has one end, out or to come, unless more were "
                "lost than are counted.",
                lost | (((lines - answered)[:4]) == (inside + owed)[:4]), cover=owed == 2)

    words, tail = c.words("ring"), c.signal("tail")

    def word_at(place: Bits) -> Bits:
        value = words[0]
        for address in range(1, len(words)):
            value = Mux(place[:len(tail)] == address, words[address], value)
        return value

    c.invariant("stored", "The items that wait are in the memory.",
                Cat((place + valid >= count) | (word_at(tail + place)
                                                == Mux(valid, queue[place + 1], queue[place]))
                    for place in range(dut.depth)).all(), cover=count > 2)


LINE_BUFFER = Component(
    make=LineBuffer, describe=describe, depth=14,
    cases=(Case({"depth": 2}), Case({"depth": 3, "silence": 2}), Case({"depth": 2, "silence": 1}),
           Case({"depth": 128}, real=True), Case({"depth": 128, "silence": 500_000}, real=True)))
