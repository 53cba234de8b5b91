"""Contract of the loader of blocks: what is in a block is done, once, in the order of blocks."""

from itertools import permutations

from amaranth import Array, Cat, Mux, Shape, Value
from amaranth.lib import data

from fresa.motion import BlockLoader
from fresa.motion.blocks import BlockHeader, BlockKind

from .contract import Bits, Case, Component, Contract

__all__ = ["BLOCK_LOADER"]

WORDS = 16
HEADER = Shape.cast(BlockHeader).width
SETTLE = 8
"""Clocks from the last word of a block that is no motion to its start, at least."""


def describe(c: Contract, dut: BlockLoader) -> None:
    """By the words that were read, whose places are those of `BlockWord`."""
    state, blocks = c.state("loader_state"), dut.blocks
    known = c.past(~c.rst)
    read = blocks.valid & blocks.ready
    count = c.keep(range(WORDS + 1), name="count")  # words of a block that was not taken
    word = [c.keep(36, name=f"word_{number}") for number in range(WORDS)]
    c.assume(~(known & c.past(blocks.valid & ~blocks.ready)) | (
        blocks.valid & (Value.cast(blocks.payload) == c.past(Value.cast(blocks.payload)))))
    c.assume(~blocks.valid | (blocks.p.last == (count == WORDS - 1)))
    coming = _header(blocks.p.data[:HEADER])
    c.assume(~(blocks.valid & (count == 0)) | _has_channels(coming))
    one = BlockHeader.const({"channel": (0, 1, 2), "outputs": {"flood": 1}}).as_bits()
    c.restrict_covers(c.upset | ~c.rst & blocks.valid & Mux(
        (count == 0) | (count == WORDS), (blocks.p.data >> 3) == one >> 3,
        blocks.p.data == Mux(count == WORDS - 1, 2, 1 << 7)))
    with c.m.If(dut.take):
        c.m.d.sync += count.eq(0)
    with c.m.If(read):
        c.m.d.sync += [Array(word)[count[:4]].eq(blocks.p.data), count.eq(count + 1)]
    with c.m.If(c.rst):
        c.m.d.sync += count.eq(0)
    header = _header(word[0][:HEADER])
    whole = count == WORDS
    moves = whole & (header.kind == BlockKind.MOTION)

    c.implication("taken-when-read", "A block starts when all of its words were read.",
                  when=dut.take, then=whole)
    c.implication("one-after-the-other", "No word of the next is read before it starts.",
                  when=whole, then=~read)
    c.implication("motion-is-offered", "A motion is offered until the profile takes it, and starts "
                  "then.", when=moves, then=dut.profile.valid & (dut.take == dut.profile.ready))
    c.implication("only-motion-is-offered", "Nothing else is.", when=dut.profile.valid, then=moves)
    profile = dut.profile.p
    c.implication("profile-of-the-block", "The profile has what was read for it, which stays.",
                  when=dut.profile.valid, then=Cat(
                      field == Cat(word[low], word[low - 1])[:len(field)]
                      for field, low in ((profile.energy, 2), (profile.modulus, 4))).all()
                  & (profile.log2_ticks == header.log2_ticks))
    c.implication("bounds-of-the-block", "What bounds its speed is told as it is read.", when=1,
                  then=(dut.bound == Cat(read & (count == 5), read & (count == 6))))
    c.implication("override-of-the-block", "So is what changes that, until it starts.",
                  when=count != 0, then=Value.cast(dut.override) == Value.cast(header.override))
    _walk(c, dut, read, word, count)
    _waits(c, dut, header, whole, moves, word)
    _outputs(c, dut, header, whole, word)
    c.invariant("number", "Words are counted.",
                (c.signal("number") == count[:4]) & (count <= WORDS)
                & (state("FAULT") | (state("READ") == ~whole)), cover=count == 3, lemma=True)
    fields = [(1, profile.energy[36:]), (2, profile.energy[:36]), (3, profile.modulus[36:]),
              (4, profile.modulus[:36]),
              (12, dut.segments.p.x.as_unsigned()), (13, dut.segments.p.y.as_unsigned()),
              (14, dut.segments.p.residual), (0, Value.cast(c.signal("header"))),
              (15, c.signal("new_extra"))]
    turns = c.signal("turns")
    c.invariant("words", "What was read is kept, but turns that a line has not.", Cat(
        *((count <= number) | (register == word[number][:len(register)])
          for number, register in fields),
        *((count <= number) | (register == Mux(header.arc, word[number][:len(register)], 0))
          for number, register in ((10, turns[36:]), (11, turns[:36])))).all(),
        cover=whole, lemma=True)
    c.invariant("channels", "Each axis has a channel.", (count == 0) | _has_channels(header),
                cover=count == 1, lemma=True)
    c.implication("kinds", "Each state is one of a kind of block.", when=whole, then=Cat(
        state("OFFER") == moves,
        ~state("DWELL") | (header.kind == BlockKind.DWELL),
        ~state("PAUSE") | (header.kind == BlockKind.PAUSE)).all(), lemma=True)
    c.leaves_unused_codes("loader_state", fault=dut.fault, shows=~(
        dut.take | dut.profile.valid | blocks.ready | dut.waiting | dut.paused))


def _header(word: Bits) -> Bits:
    """Return what the bits of a header say."""
    return data.View(BlockHeader, word)


def _has_channels(header: Bits) -> Bits:
    """Return whether each axis has a channel of its own; in a line that of its number."""
    channels = Cat(header.channel[axis] for axis in range(3))
    right = [sum(channel << 2 * axis for axis, channel in enumerate(each))
             for each in permutations(range(3))]
    return (header.kind != BlockKind.MOTION) | Mux(
        header.arc, Cat(channels == each for each in right).any(), channels == right[0])


def _walk(c: Contract, dut: BlockLoader, read: Bits, word: list, count: Bits) -> None:
    """State what the walk is offered."""
    known, segments, segment = c.past(~c.rst), dut.segments, dut.segments.p
    begins = read & (count == WORDS - 1)
    first = _header(word[0][:HEADER])
    header = c.keep(BlockHeader, name="header_of_segment")
    with c.m.If(begins):
        c.m.d.sync += header.eq(first)
    moved = known & c.past(begins & (first.kind == BlockKind.MOTION))
    c.implication("segment-offered", "With its last word a motion is offered to the walk.",
                  when=moved, then=segments.valid)
    c.implication("only-motion-is-walked", "Nothing else is.",
                  when=known & segments.valid & c.past(~segments.valid), then=moved)
    c.implication("segment-stays", "A segment is offered until it is taken, and does not change.",
                  when=known & c.past(segments.valid & ~segments.ready),
                  then=segments.valid & (Value.cast(segments.payload)
                                         == c.past(Value.cast(segments.payload))))
    c.implication("taken-once", "And only once.",
                  when=known & c.past(segments.valid & segments.ready) & ~moved,
                  then=~segments.valid)
    c.implication("no-segment-behind-reset", "Behind a reset no segment is offered.", when=~known,
                  then=~segments.valid)
    c.implication("waits-for-the-walk", "Words of the walk are not read before it has taken those "
                  "of the last motion.", when=segments.valid & (count >= 7), then=~read)
    c.implication("segment-of-the-block", "It has what was read for it.", when=segments.valid,
                  then=(segment.x.as_unsigned() == word[12])
                  & (segment.y.as_unsigned() == word[13])
                  & (segment.residual == word[14][:29])
                  & (segment.turns == Mux(header.arc, Cat(word[11], word[10])[:38], 0))
                  & (segment.log2_ticks == header.log2_ticks) & (segment.arc == header.arc)
                  & (segment.clockwise == header.clockwise) & (segment.shift == header.shift)
                  & (Value.cast(segment.channel) == Value.cast(header.channel)))
    places = (first.kind == BlockKind.MOTION) | (first.kind == BlockKind.PLACE)
    present = Mux(segments.valid, Value.cast(header), Value.cast(first))
    ring = [c.signal(f"place_{place}") for place in range(3)]
    for axis, name in enumerate("xyz"):
        came, change = c.keep(36, name=f"came_{name}"), c.keep(34, name=f"change_{name}")
        place = c.keep(36, name=f"place_{name}")
        with c.m.If(read & (count == 7 + axis) & places):
            c.m.d.sync += [came.eq(place), place.eq(dut.blocks.p.data),
                           change.eq(dut.blocks.p.data - place)]
        with c.m.If(c.rst):
            c.m.d.sync += [came.eq(0), place.eq(0)]
        channel = header.channel[axis]
        increment: Bits = Array(segment.increment)[channel]
        c.implication(f"{name}-from-its-place", "A motion begins where the last block has put the "
                      "axis, and goes to its own place.", when=segments.valid,
                      then=(Array(segment.start)[channel] == (came + 128)[:8])
                      & (segment.end[axis] == (place + 128)[8:10]) & Mux(
                          header.arc & (channel != 2), increment == 0,
                          increment.as_unsigned() == change))
        mine = _header(present).channel[axis]
        start, increment = (Array(c.signal(f"{what}_{channel}") for channel in range(3))[mine]
                            for what in ("start", "increment"))
        c.invariant(f"place-of-{name}", "Its places are those, the next one first.",
                    (Mux(places & (count == 8), ring[axis - 1],
                         Mux(places & (count == 9), ring[axis - 2], ring[axis])) == place)
                    & ((start == (came + 128)[:8]) & (increment.as_unsigned() == Mux(
                        _header(present).arc & (mine != 2), 0, change))
                       | ~(segments.valid | (first.kind == BlockKind.MOTION) & (count > 7 + axis)
                           & (count != WORDS))),
                    cover=place != 0, lemma=True)
    c.invariant("of-segment", "Of a segment its header is kept, and no word of the walk is read.",
                ~segments.valid | ((Value.cast(c.signal("segment_header")) == Value.cast(header))
                                   & _has_channels(header) & (header.kind == BlockKind.MOTION)
                                   & (c.signal("new_extra") == word[15])
                                   & ((count <= 7) | (count == WORDS))), cover=segments.valid,
                lemma=True)


def _waits(c: Contract, dut: BlockLoader, header: Bits, whole: Bits, moves: Bits,
           word: list) -> None:
    """State for what a block that is no motion waits, and that it waits no longer."""
    known, state = c.past(~c.rst), c.state("loader_state")
    other = whole & ~moves
    age = c.keep(range(SETTLE + 3), name="age")
    c.m.d.sync += age.eq(Mux(other & ~dut.take & ~c.rst, age + (age != SETTLE + 2), 0))
    rests = c.keep(1, name="rests")  # it stood when such a block was old enough
    waits = Cat(header.kind == each for each in (BlockKind.DWELL, BlockKind.PAUSE,
                                                 BlockKind.END)).any()
    c.m.d.sync += rests.eq(~c.rst & other & ~dut.take & (rests | ((age >= SETTLE - 1) & dut.idle)))
    c.implication("not-too-soon", "A block starts no sooner than the queue knows its exit.",
                  when=dut.take & ~moves, then=age >= SETTLE)
    c.implication("waits-for-rest", "Dwell, pause and end wait until nothing moves.",
                  when=other & waits & (dut.take | dut.waiting | dut.paused), then=rests)
    c.implication("waits-for-nothing-else", "What waits for nothing starts then, and an end when "
                  "nothing moves.", when=other & (age >= SETTLE) & ~(waits & ~rests)
                  & (header.kind != BlockKind.DWELL) & (header.kind != BlockKind.PAUSE),
                  then=dut.take)
    c.implication("waits-with-a-whole-block", "It waits or pauses only with a block that was read, "
                  "and no motion.", when=dut.waiting | dut.paused,
                  then=whole & ~dut.profile.valid)
    c.implication("pause-waits", "A pause waits for a start.", when=known & c.past(dut.paused),
                  then=Mux(c.past(dut.start), dut.take, dut.paused))
    c.implication("pauses", "Only a pause does, and it is over with that.",
                  when=other & ((header.kind == BlockKind.PAUSE) & dut.take | dut.paused),
                  then=(header.kind == BlockKind.PAUSE) & (dut.paused | c.past(dut.paused)))
    # The time of a dwell by a clock of its own
    us, rest = c.keep(36, name="us"), c.keep(range(dut.clock), name="part_of_us")
    over = rest + 10**6 >= dut.clock
    c.m.d.sync += rest.eq(Mux(dut.waiting, rest + 10**6 - Mux(over, dut.clock, 0), 0))
    c.m.d.sync += us.eq(Mux(dut.waiting, us + over, 0))
    with c.m.If(c.rst):
        c.m.d.sync += [us.eq(0), rest.eq(0)]
    c.implication("dwells", "A dwell lasts its time, and a clock.",
                  when=known & c.past(dut.waiting),
                  then=Mux(c.past(us == word[15]), dut.take, dut.waiting))
    c.implication("dwell-is-a-dwell", "Only a dwell does, and it is over with that.",
                  when=other & ((header.kind == BlockKind.DWELL) & dut.take | dut.waiting),
                  then=(header.kind == BlockKind.DWELL) & (dut.waiting | c.past(dut.waiting)))
    c.invariant("left", "What is left of it is counted.",
                (~dut.waiting | (c.signal("left") + us == word[15]))
                & (dut.waiting | ((us == 0) & (rest == 0)) | known & c.past(dut.waiting)),
                cover=us != 0, lemma=True)
    c.invariant("phase", "And the part of a microsecond.",
                (c.signal("phase") + dut.clock - 10**6 == rest) & (rest < dut.clock),
                cover=rest != 0, lemma=True)
    pause = c.signal("pause")
    c.invariant("age", "The time to settle is counted.", Cat(
        age <= SETTLE + 2, ~state("READ", "OFFER") | (age == 0),
        ~state("SETTLE") | Mux(pause == 0, age >= SETTLE - 1, age == SETTLE - 1 - pause),
        ~state("READ") | whole | (count_of(c) == 0) | (pause == SETTLE - 1),
        ~state("DWELL", "PAUSE", "TAKE") | (age >= SETTLE),
        ~state("DWELL", "PAUSE") | rests,
        ~(state("TAKE") & waits) | rests,
        ~(state("SETTLE") & waits) | ~rests).all(), cover=age == SETTLE, lemma=True)


def count_of(c: Contract) -> Bits:
    """Return the number of words that were read."""
    return c.kept["count"]


def _outputs(c: Contract, dut: BlockLoader, header: Bits, whole: Bits, word: list) -> None:
    """State when outputs change, and to what."""
    known, segments = c.past(~c.rst), dut.segments
    walked = segments.valid & segments.ready
    now, extra = Value.cast(dut.outputs), dut.extra
    c.implication("off", "Outputs that are switched off are so in the next clock.",
                  when=c.past(dut.off) | ~known, then=(now == 0) & (extra == 0))
    of_it = c.kept["header_of_segment"]
    c.implication("outputs-of-a-motion", "When a motion begins its outputs are set.",
                  when=known & c.past(walked & ~dut.off),
                  then=(now == c.past(Value.cast(of_it.outputs))) & (extra == c.past(word[15])))
    feed = c.keep(32, name="feed_of_segment")  # highest bits of two words, high part last
    with c.m.If(dut.blocks.valid & dut.blocks.ready & dut.blocks.p.last):
        c.m.d.sync += feed.eq(Cat(word[3][14:], word[1][26:]))
    c.implication("feed-of-a-motion", "So is what is shown as its feed, and stays until the next.",
                  when=known & c.past(known), then=dut.feed == Mux(
                      c.past(walked), c.past(feed), c.past(dut.feed)))
    c.invariant("new-feed", "The feed of a motion is that of its words.",
                ~segments.valid | (c.signal("new_feed") == feed), cover=segments.valid, lemma=True)
    c.invariant("read-feed", "It is in words 1 and 3.", Cat(
        (c.kept["count"] <= 3) | (c.signal("read_feed")[:22] == word[3][14:]),
        (c.kept["count"] <= 1) | (c.signal("read_feed")[22:] == word[1][26:])).all(),
                cover=whole, lemma=True)
    due, due_extra = c.keep(len(now), name="due_outputs"), c.keep(36, name="due_extra")
    wait = c.keep(1, name="outputs_wait")
    sets = dut.take & (header.kind == BlockKind.OUTPUTS)
    waits, rests = wait | sets, dut.idle & ~walked
    with c.m.If(sets):
        c.m.d.sync += [due.eq(header.outputs), due_extra.eq(word[15])]
    c.m.d.sync += wait.eq(waits & ~dut.idle & ~walked & ~c.rst)
    newest, newest_extra = Mux(sets, header.outputs, due), Mux(sets, word[15], due_extra)
    c.implication("outputs-at-rest", "Those of a block of outputs are set when nothing moves.",
                  when=known & c.past(waits & rests & ~dut.off),
                  then=(now == c.past(newest)) & (extra == c.past(newest_extra)))
    c.implication("outputs-stay", "Nothing else changes them.",
                  when=known & c.past(~walked & ~(waits & rests) & ~dut.off),
                  then=(now == c.past(now)) & (extra == c.past(extra)))
    c.invariant("due", "Outputs that wait are kept.", (c.signal("due") == waits) & (~waits | (
        (Value.cast(c.signal("due_outputs")) == newest)
        & (c.signal("due_extra") == newest_extra))) | c.state("loader_state")("FAULT"),
        cover=waits, lemma=True)


BLOCK_LOADER = Component(
    make=BlockLoader, describe=describe, depth=34,
    cases=(Case({"clock": 2_000_000, "speed_bits": 20, "modulus_bits": 37}), Case(real=True),
           Case({"clock": 2_000_000}, upset=True)))
