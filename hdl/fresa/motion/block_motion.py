"""Blocks to steps: a queue with look-ahead, the speed profile, and the walk along the path."""

from amaranth import Array, Cat, Module, Mux, ResetInserter, Signal
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out, connect

from ..arithmetic.line import WIDTH
from .block_loader import BlockLoader
from .blocks import BLOCK_WORDS, FEED_BITS, Outputs
from .nominal import NominalSpeed
from .overrides import OVERRIDE_BITS
from .plan import BlockQueue
from .profile import SpeedProfile
from .walk import WALK_DELAY, PathWalk

__all__ = ["BlockMotion"]

STEPS_FOLLOW = WALK_DELAY + 5
"""Clocks after a tick in which its steps come, and one that corrects an end."""


class BlockMotion(wiring.Component):
    """Runs blocks as they come, each as fast as the blocks that are known allow.

    ``flush`` drops all blocks, and what is left of the one that runs: only while the speed is 0.
    Then the steps are those at ``position``, and a block that sets the place must come first.

    Parameters
    ----------
    clock : int
        Clock in Hz.
    depth : int
        Blocks that are looked ahead, see :class:`BlockQueue`.

    Members
    -------
    steps : In(27) x 3
        Steps per metre of each axis, at least 1. Constant while there are blocks.
    words : In(stream.Signature)
        Words of blocks, see :class:`BlockQueue` and `BlockWord`.
    feed_override, rapid_override : In(8)
        In percent, see :class:`NominalSpeed`.
    hold : In(1)
        Slow down and stand.
    flush : In(1)
        Drop all blocks.
    position : In(2 bits an axis)
        Steps of each axis, counted as places are, modulo 4, for `flush`.
    made : In(1)
        All steps are made.
    start, off : In(1)
        End a pause; switch the outputs off, which `flush` leaves as they are.
    step, direction : Out(3)
        A step of each axis; 1 is forward.
    free : Out(range(depth + 1))
        Places left in the queue.
    speed : Out(31)
        Speed along the path, in nm/s.
    still : Out(1)
        The speed is 0, and the steps that were due are made; a clock later than they are.
    idle : Out(1)
        Nothing moves or waits to move, no dwell is counted, and no pause waits; a clock later than
        that is so.
    ended : Out(1)
        The program has ended: for one clock.
    paused : Out(1)
        A pause waits.
    outputs, extra : Out(Outputs), Out(36)
        Outputs, and the speed of the spindle in 10**-6 rev/min.
    feed : Out(32)
        Programmed feed of the motion, see :class:`BlockLoader`.
    starved : Out(1)
        The speed was cut to 0 since no block followed. For one clock; it is never expected.
    fault : Out(1)
        A part has a fault. Stays until reset, or a flush.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, clock: int = 50_000_000, depth: int = 64) -> None:
        self._queue = BlockQueue(depth=depth, words=BLOCK_WORDS, word=WIDTH)
        self._profile = SpeedProfile()
        self._loader = BlockLoader(clock=clock, speed_bits=self._profile.speed_bits,
                                   modulus_bits=self._profile.modulus_bits)
        super().__init__({
            "steps": In(27).array(3), "words": In(self._queue.write.signature.flip()),
            "feed_override": In(OVERRIDE_BITS), "rapid_override": In(OVERRIDE_BITS),
            "hold": In(1), "flush": In(1),
            "position": In(data.ArrayLayout(2, 3)), "made": In(1), "start": In(1), "off": In(1),
            "step": Out(3), "direction": Out(3), "free": Out(range(depth + 1)),
            "speed": Out(self._profile.speed_bits), "still": Out(1), "idle": Out(1),
            "ended": Out(1), "paused": Out(1), "outputs": Out(Outputs), "extra": Out(WIDTH),
            "feed": Out(FEED_BITS), "starved": Out(1), "fault": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.queue = queue = self._queue
        profile, loader, walk = self._profile, self._loader, PathWalk()
        nominal = NominalSpeed(speed_bits=profile.speed_bits)
        for name, each in (("profile", profile), ("loader", loader), ("walk", walk),
                           ("nominal", nominal)):
            m.submodules[name] = ResetInserter(self.flush)(each)
        connect(m, wiring.flipped(self.words), queue.write)
        connect(m, queue.blocks, loader.blocks)
        connect(m, loader.segments, walk.segments)

        flushed = Signal()
        settled = Signal(STEPS_FOLLOW)  # it stood so long
        m.d.sync += settled.eq(Mux(profile.standing, Cat(1, settled), 0))
        m.d.sync += [flushed.eq(self.flush), queue.take.eq(loader.take & ~self.flush),
                     self.step.eq(walk.step & ~self.flush.replicate(3)),
                     self.direction.eq(walk.direction),
                     self.still.eq(settled[-1] & profile.standing & self.made),
                     loader.idle.eq(self.still & ~loader.profile.valid & ~loader.segments.valid
                                    & ~walk.busy)]
        m.d.comb += [
            queue.flush.eq(self.flush),
            profile.blocks.valid.eq(loader.profile.valid & nominal.ready),
            profile.blocks.payload.eq(loader.profile.payload),
            loader.profile.ready.eq(profile.blocks.ready),
            nominal.load.eq(loader.bound), nominal.word.eq(queue.blocks.p.data),
            nominal.override.eq(loader.override),
            nominal.take.eq(profile.blocks.ready), nominal.feed.eq(self.feed_override),
            nominal.rapid.eq(self.rapid_override), profile.nominal.eq(nominal.nominal),
            profile.exit.eq(queue.exit), profile.hold.eq(self.hold),
            walk.tick.eq(profile.tick), walk.last.eq(profile.last),
            walk.load.eq(flushed), walk.position.eq(self.position),
            loader.start.eq(self.start), loader.off.eq(self.off),
            self.free.eq(queue.free), self.speed.eq(profile.speed),
            self.paused.eq(loader.paused), self.ended.eq(loader.ended),
            self.idle.eq(loader.idle & queue.empty),
            self.outputs.eq(loader.outputs), self.extra.eq(loader.extra), self.feed.eq(loader.feed),
            self.starved.eq(profile.starved),
        ]
        m.d.sync += self.fault.eq(profile.fault | walk.fault | loader.fault)

        # Steps per metre of the channels u and v, while an arc runs: one axis after the other is
        # looked at all the time, so that there is one choice for both.
        turn = Signal(range(3))
        m.d.sync += turn.eq(Mux(turn == 2, 0, turn + 1))
        axes = loader.segments.p.channel
        looked_at, its_channel = Signal(27), Signal(2)
        m.d.comb += [looked_at.eq(Array(self.steps)[turn]),
                     its_channel.eq(Array(axes[axis] for axis in range(3))[turn])]
        for channel, port in enumerate((walk.fine, walk.coarse)):
            found = Signal(27, name=f"steps_{channel}")
            with m.If(its_channel == channel):
                m.d.sync += found.eq(looked_at)
            with m.If(loader.segments.ready):
                m.d.sync += port.eq(found)
        return m
