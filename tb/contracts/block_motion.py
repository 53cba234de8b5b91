# amaranth: UnusedElaboratable=no

"""Contract of blocks to steps: what is between the parts, of which each has a contract of its own.

The parts are unknowns, which keep what their contracts prove. Not stated is what takes the times of
two of them: that a segment is prepared before its first tick, that its steps are made when the
profile has stood for 16 clocks, and that the exit of a block is there when it is looked at. Benches
with all parts compare every step with models.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any
from unittest.mock import patch

from amaranth import Cat, Module, Mux, Signal, Value
from amaranth.lib.wiring import Component as Part

from fresa.motion import BlockMotion, block_motion

from .contract import Bits, Case, Component, Contract, Unknown

__all__ = ["BLOCK_MOTION"]

PARTS = {"queue": "BlockQueue", "profile": "SpeedProfile", "loader": "BlockLoader",
         "walk": "PathWalk", "nominal": "NominalSpeed"}
WORDS = 16
"""Words of a block."""

FASTEST, HUNDREDTH = 5, 6
"""Words that bound its speed."""

FOLLOWS = 16
"""Clocks for which it stands until all steps are made: ten of the walk, and of registers."""


def describe(c: Contract, dut: BlockMotion) -> None:
    """Blocks, segments and steps are passed on once, in their order; a flush drops all of them."""
    for path in PARTS:
        c.unknown(path)
    parts = [c.part(path) for path in PARTS]
    queue, profile, loader, walk, nominal = parts
    c.restrict_covers(~c.rst)
    anew = c.past(c.rst | dut.flush, init=1)  # all parts begin anew
    count = _blocks(c, dut, queue, loader, anew)
    _speeds(c, dut, parts, count, anew)
    _segments(c, dut, loader, walk, anew)
    _steps(c, dut, walk)
    _rest(c, dut, parts)
    _ports(c, dut, parts)

    for path in ("profile", "loader", "walk", "nominal"):
        c.invariant(f"flush-resets-{path}", "A flush resets it, and nothing else does but a reset.",
                    c.signal(f"{path}.begins") == anew, cover=c.past(dut.flush))
    c.invariant("flush", "It empties the queue, and a clock later the walk, which rests, has its "
                "position.", (queue.flush == dut.flush) & (walk.load == c.past(dut.flush & ~c.rst))
                & ~(walk.load & walk.busy)
                & (Value.cast(walk.position) == Value.cast(dut.position)), cover=walk.load)

    faults = Cat(part.fault for part in (profile, loader, walk))
    c.assume(~faults.any() | ~anew)
    c.assume(((faults & c.past(faults)) == c.past(faults)) | anew)
    c.invariant("faults", "A fault of a part shows a clock later.",
                dut.fault == c.past(faults.any() & ~c.rst), cover=dut.fault)
    c.implication("fault-stays", "It stays until a reset, or a flush, which resets the parts.",
                  when=c.past(dut.fault & ~c.rst) & ~c.past(anew), then=dut.fault)
    c.implication("turns-from-any-code", "Whatever axis is looked at, there is one in the next "
                  "clock.", when=c.past(1), then=c.signal("turn") <= 2, upset=True)


def _blocks(c: Contract, dut: BlockMotion, queue: Any, loader: Any, anew: Bits) -> Bits:
    """State what becomes of the words of a block; return how many of them were read."""
    depth = 1 << len(dut.free) - 1
    accepted = queue.write.valid & queue.write.ready
    given = queue.blocks.valid & queue.blocks.ready
    dropped = c.rst | dut.flush
    words, waiting = (c.keep(range(most + 1), name=name)
                      for most, name in ((WORDS, "words"), (depth, "waiting")))
    begins = queue.take & (words == WORDS)
    c.m.d.sync += [waiting.eq(waiting + (accepted & queue.write.p.last) - begins),
                   words.eq(Mux(begins, 0, words + given))]
    with c.m.If(c.rst | queue.flush):
        c.m.d.sync += [waiting.eq(0), words.eq(0)]
    offered = Value.cast(queue.blocks.payload)
    c.assume(~accepted | (waiting < depth))
    c.assume((queue.free + waiting == depth)
             | ((queue.free + waiting == depth + 1) & (waiting != 0)))
    c.assume(queue.empty == (waiting == 0))
    c.assume(~queue.blocks.valid | (waiting != 0) & (words != WORDS)
             & (queue.blocks.p.last == (words == WORDS - 1)))
    c.assume(~anew | ~queue.blocks.valid & (queue.exit == 0))
    c.assume(~c.past(queue.blocks.valid & ~queue.blocks.ready) | anew
             | queue.blocks.valid & (offered == c.past(offered)))

    read = loader.blocks.valid & loader.blocks.ready
    count = c.keep(range(WORDS + 1), name="count")
    with c.m.If(loader.take):
        c.m.d.sync += count.eq(0)
    with c.m.Elif(read):
        c.m.d.sync += count.eq(count + 1)
    with c.m.If(dropped):
        c.m.d.sync += count.eq(0)
    whole = count == WORDS
    c.assume(~loader.take | whole)
    c.assume(~whole | ~read)
    c.assume(~(loader.waiting | loader.paused) | whole & ~loader.profile.valid)

    written = queue.write
    c.invariant("written", "A word is accepted by the queue, and by nothing else.",
                (written.valid == dut.words.valid) & (written.ready == dut.words.ready)
                & (Value.cast(written.payload) == Value.cast(dut.words.payload)),
                cover=accepted & (waiting == 1))
    c.invariant("read", "A word that the queue gives is read at once, and no other.",
                (read == given) & (Value.cast(loader.blocks.payload) == offered), cover=read)
    c.invariant("taken", "A block that starts is taken from the queue a clock later, unless all "
                "are dropped.", queue.take == c.past(loader.take & ~dropped), cover=queue.take)
    c.invariant("taken-once", "Each block is read, and then taken, once: the queue and the loader "
                "count the same words.", (count == Mux(queue.take, 0, words))
                & (~queue.take | (words == WORDS)), cover=queue.take)
    c.implication("of-one-block", "The end of a block comes with its last word.",
                  when=loader.blocks.valid,
                  then=loader.blocks.p.last == (count == WORDS - 1))
    c.implication("word-stays", "A word is offered until it is read, or dropped.",
                  when=c.past(loader.blocks.valid & ~loader.blocks.ready) & ~anew,
                  then=loader.blocks.valid & (Value.cast(loader.blocks.payload)
                                              == c.past(Value.cast(loader.blocks.payload))))
    c.invariant("waiting", "A block waits until it is taken.",
                (waiting <= depth) & ((words == 0) | (waiting != 0)), cover=waiting == 2,
                lemma=True)
    return count


def _speeds(c: Contract, dut: BlockMotion, parts: list, count: Bits, anew: Bits) -> None:
    """State what is planned, and with which bounds of the speed."""
    queue, profile, loader, _, nominal = parts
    offer, blocks = loader.profile, profile.blocks
    plan, override = Value.cast(offer.payload), Value.cast(loader.override)
    whole, read = count == WORDS, loader.blocks.valid & loader.blocks.ready
    c.assume(~offer.valid | whole & (loader.take == offer.ready))
    c.assume(~anew | ~offer.valid)
    c.assume(~c.past(offer.valid & ~loader.take) | anew
             | offer.valid & (plan == c.past(plan)))
    c.assume(loader.bound == Cat(read & (count == FASTEST), read & (count == HUNDREDTH)))
    c.assume(c.past(count == 0) | c.past(loader.take) | anew | (override == c.past(override)))
    c.assume(~blocks.ready | blocks.valid)
    c.assume(~c.past(nominal.ready & ~nominal.load[1]) | anew | nominal.ready)
    c.assume(~anew | ~nominal.ready)

    taken = blocks.valid & blocks.ready
    c.invariant("planned-once", "A motion that starts is taken by the profile, and no other is.",
                taken == (loader.take & offer.valid), cover=taken)
    c.invariant("planned-when-known", "It is offered from when its highest speed is known.",
                (blocks.valid == (offer.valid & nominal.ready))
                & (Value.cast(blocks.payload) == plan), cover=blocks.valid)
    c.implication("offer-stays", "Then it is offered until it is taken, or dropped.",
                  when=c.past(blocks.valid & ~blocks.ready) & ~anew,
                  then=blocks.valid & (Value.cast(blocks.payload)
                                       == c.past(Value.cast(blocks.payload))))
    bounds = nominal.load
    c.invariant("bounds", "Its bounds are the words that are read.",
                (bounds == Cat(read & (count == FASTEST), read & (count == HUNDREDTH)))
                & (nominal.word == loader.blocks.p.data)
                & (Value.cast(nominal.override) == override), cover=bounds[1])
    # As the contract of the speed has it.
    first, loaded = c.keep(1, name="first"), c.keep(1, name="loaded")
    with c.m.If(bounds[0]):
        c.m.d.sync += [first.eq(1), loaded.eq(0)]
    with c.m.If(bounds[1]):
        c.m.d.sync += loaded.eq(1)
    with c.m.If(nominal.take):
        c.m.d.sync += [first.eq(0), loaded.eq(0)]
    with c.m.If(c.rst | dut.flush):
        c.m.d.sync += [first.eq(0), loaded.eq(0)]
    c.invariant("bounds-in-order", "They come in their order, and none with the start.",
                ~(nominal.take & bounds.any()) & (~bounds[1] | first) & ~bounds.all(),
                cover=bounds[1])
    c.implication("starts-with-its-bounds", "A block starts with its own, once both are known.",
                  when=nominal.take, then=nominal.ready & loaded & taken)
    c.implication("bounds-of-the-start", "The speed that is planned changes with the block.",
                  when=taken, then=nominal.take)
    c.invariant("has-bounds", "What is read has its bounds.",
                ((count <= FASTEST) | first) & ((count <= HUNDREDTH) | loaded),
                cover=count == WORDS, lemma=True)
    c.invariant("limits-of-the-profile", "The profile has the speed of its block, and its exit.",
                (profile.nominal == nominal.nominal) & (profile.exit == queue.exit)
                & (profile.hold == dut.hold), cover=profile.hold)


def _segments(c: Contract, dut: BlockMotion, loader: Any, walk: Any, anew: Bits) -> None:
    """State what the walk is given."""
    offer, segments = loader.segments, walk.segments
    payload, channels = Value.cast(offer.payload), offer.p.channel
    c.assume(~anew | ~offer.valid)
    c.assume(~c.past(offer.valid & ~offer.ready) | anew
             | offer.valid & (payload == c.past(payload)))
    c.assume(~segments.ready | segments.valid)
    c.invariant("walked-once", "A segment that is offered is offered to the walk, and taken when "
                "that takes it.", (segments.valid == offer.valid) & (segments.ready == offer.ready)
                & (Value.cast(segments.payload) == payload), cover=offer.valid & offer.ready)

    # Steps per metre
    known = Cat(Value.cast(channels), *dut.steps)
    steady = offer.valid & c.past(offer.valid) & (known == c.past(known))
    held = c.keep(range(4), name="held")
    clocks = Mux(steady, held, 0)  # in which it was as it is, at most 3
    c.m.d.sync += held.eq(Mux(offer.valid & ~c.rst, Mux(clocks == 3, 3, clocks + 1), 0))
    begins = c.past(offer.valid & offer.ready)
    turn = c.signal("turn")
    for channel, (name, port) in enumerate((("u", walk.fine), ("v", walk.coarse))):
        found = c.signal(f"steps_{channel}")
        alone = [Cat(axis_channel == channel for axis_channel in channels) == 1 << axis
                 for axis in range(3)]
        for axis, here in zip("xyz", alone, strict=True):
            steps = dut.steps["xyz".index(axis)]
            c.implication(f"{name}-of-{axis}", "A segment that was offered for four clocks begins "
                          "with the steps per metre of the axis that has the channel.",
                          when=c.past(offer.valid & offer.ready & here & (clocks == 3) & ~c.rst),
                          then=port == c.past(steps))
            # Each axis is looked at every third clock.
            age = Mux(turn == "zxy".index(axis), 1, Mux(turn == "yzx".index(axis), 2, 3))
            c.implication(f"{name}-found-at-{axis}", "They were found when it was looked at.",
                          when=here & (clocks >= age), then=found == steps, lemma=True)
        c.implication(f"{name}-stays", "They stay until the next begins.",
                      when=c.past(~c.rst) & ~begins, then=port == c.past(port))
    c.invariant("turn", "One axis after the other is looked at.", turn <= 2, cover=turn == 2,
                lemma=True)


def _steps(c: Contract, dut: BlockMotion, walk: Any) -> None:
    """State which steps leave."""
    step, direction = dut.step, dut.direction
    profile = c.part("profile")
    c.invariant("steps", "Each tick of the profile is one of the walk, and each step of that "
                "leaves a clock later, and no other, unless all is dropped.",
                (walk.tick == profile.tick) & (walk.last == profile.last)
                & (step == c.past(Mux(c.rst | dut.flush, 0, walk.step))), cover=step)
    c.invariant("directions", "So does its direction.",
                direction == c.past(Mux(c.rst, 0, walk.direction)), cover=step & direction)
    c.assume(~c.signal("walk.begins") | ~walk.busy & ~walk.step.any())
    c.implication("no-step-after-a-flush", "A clock after a flush, and in the next, there is none.",
                  when=c.past(dut.flush) | c.past(c.past(dut.flush)), then=~step.any())


def _rest(c: Contract, dut: BlockMotion, parts: list) -> None:
    """State when nothing moves."""
    queue, profile, loader, walk, _ = parts
    stood = c.keep(range(FOLLOWS + 1), name="stood")  # clocks for which the profile stands
    now = Mux(profile.standing, Mux(stood == FOLLOWS, FOLLOWS, stood + 1), 0)
    c.m.d.sync += stood.eq(Mux(c.rst, 0, now))
    c.invariant("still", "It is still when it has stood so long that its steps are made.",
                dut.still == c.past((now == FOLLOWS) & dut.made & ~c.rst), cover=dut.still)
    settled = c.signal("settled")
    c.invariant("settled", "The clocks are counted for which it stands.", Cat(
        stood <= FOLLOWS, *(
            settled[number] == (stood > number) for number in range(FOLLOWS - 1))).all(),
        cover=stood == FOLLOWS - 1, lemma=True)
    waits = loader.profile.valid | loader.segments.valid | walk.busy
    c.invariant("rests", "Nothing moves when it is still and no motion is offered or walked.",
                loader.idle == c.past(dut.still & ~waits & ~c.rst), cover=loader.idle)
    c.invariant("idle", "It is idle when nothing moves and no block is in the queue.",
                dut.idle == (loader.idle & queue.empty), cover=dut.idle)
    c.implication("idle-waits-for-nothing", "Then no block is read or offered, no dwell is "
                  "counted, and no pause waits.", when=dut.idle,
                  then=~(loader.profile.valid | loader.waiting | loader.paused | loader.take
                         | queue.blocks.valid))


def _ports(c: Contract, dut: BlockMotion, parts: list) -> None:
    """State which outputs are those of parts."""
    queue, profile, loader, _, nominal = parts
    for name, part in (("speed", profile), ("starved", profile), ("free", queue),
                       *((name, loader) for name in ("paused", "ended", "outputs", "extra",
                                                     "feed"))):
        c.invariant(f"{name}-of-its-part", "It is that of the part that has it.",
                    Value.cast(getattr(dut, name)) == Value.cast(getattr(part, name)),
                    cover=Value.cast(getattr(dut, name)).any())
    c.invariant("overrides", "Overrides reach what they multiply.",
                (nominal.feed == dut.feed_override) & (nominal.rapid == dut.rapid_override),
                cover=dut.feed_override != dut.rapid_override)
    c.invariant("starts-and-off", "So does what ends a pause, or switches outputs off.",
                (loader.start == dut.start) & (loader.off == dut.off),
                cover=loader.start & loader.off)


class _Part(Unknown):
    """An unknown that shows that it begins anew: in the clock after its reset."""

    def __init__(self, part: Part) -> None:
        super().__init__(part)
        for name in ("speed_bits", "modulus_bits"):
            setattr(self, name, getattr(part, name, None))

    def elaborate(self, platform) -> Module:
        m = Module()
        begins = Signal(init=1)
        m.d.sync += begins.eq(0)
        return m


@contextmanager
def _unknown_parts() -> Iterator[None]:
    def instead(real):
        return lambda **parameters: _Part(real(**parameters))

    with patch.dict(vars(block_motion), {
            name: instead(getattr(block_motion, name)) for name in PARTS.values()}):
        yield


class _Between(BlockMotion):
    """Without what is in the parts."""

    def __init__(self, **parameters) -> None:
        with _unknown_parts():
            super().__init__(**parameters)

    def elaborate(self, platform) -> Module:
        with _unknown_parts():
            return super().elaborate(platform)


def make(**parameters) -> BlockMotion:
    """Make it of unknowns."""
    return _Between(**parameters)


BLOCK_MOTION = Component(
    make=make, describe=describe, depth=24,
    cases=(Case({"clock": 2_000_000, "depth": 4}), Case(real=True),
           Case({"clock": 2_000_000, "depth": 4}, upset=True)))
