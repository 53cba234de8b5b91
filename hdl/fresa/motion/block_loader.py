"""From words of blocks to ticks, segments and outputs."""

from amaranth import Array, Cat, Module, Mux, ResetSignal, Signal, signed
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from ..arithmetic.line import WIDTH
from ..checks import in_range
from ..choice import add_choice
from ..fsm import leave_unused_codes
from .blocks import (
    FEED_BITS,
    FEED_HIGH,
    FEED_LOW,
    BlockHeader,
    BlockKind,
    BlockWord,
    Outputs,
    OverrideKind,
)
from .walk import MAX_LOG2_TICKS, Segment

__all__ = ["BlockLoader"]

REFRESH = 8
"""Clocks from the last word of a block to its start, at least: the queue has its exit by then."""


class BlockLoader(wiring.Component):
    """Reads blocks from a queue, gives them to profile and walk, and does what is no motion.

    A block of motion is offered to both once all of its words are read, those from the places on
    after the walk has taken the one before it. It starts, ``take``, when the profile takes
    it. Where its steps begin and by how much they go follows from the places at the ends of blocks.

    Its outputs are set when the walk takes it. Those of an OUTPUTS block are set when nothing
    moves, unless a block of motion comes first, whose own are newer. DWELL, PAUSE and END wait
    until nothing moves; time and pause begin then.

    Parameters
    ----------
    clock : int
        Clock in Hz, from 2 000 000.
    speed_bits, modulus_bits : int
        Of the profile.

    Members
    -------
    blocks : In(stream.Signature)
        Words of the oldest block, with ``last``; see `BlockWord`.
    take : Out(1)
        Start that block.
    profile : Out(stream.Signature)
        For the profile.
    bound : Out(2)
        The word that is read bounds the speed of the block: its ``load`` of :class:`NominalSpeed`.
    override : Out(OverrideKind)
        What changes that, from the clock after the header is read.
    segments : Out(stream.Signature(Segment))
        For the walk.
    idle : In(1)
        Nothing moves: profile and walk have made all that they took, and all steps are made.
    start : In(1)
        End a pause.
    off : In(1)
        Switch the outputs off. A reset that is inserted leaves them as they are.
    ended : Out(1)
        A block of END is done: for one clock.
    paused : Out(1)
        A pause waits.
    waiting : Out(1)
        A dwell is counted.
    outputs, extra : Out(Outputs), Out(36)
        Outputs, and the speed of the spindle in 10**-6 rev/min, as they are now.
    feed : Out(32)
        Programmed feed of the motion that is made, or was made last, in nm/s; of a rapid, and
        before the first motion, all ones.
    fault : Out(1)
        The state register was upset. Stays until reset.

    Raises
    ------
    ValueError
        If ``clock`` is out of range.
    """

    def __init__(self, *, clock: int = 50_000_000, speed_bits: int = 31,
                 modulus_bits: int = 50) -> None:
        self.clock = in_range("clock", clock, 2_000_000, (1 << 27) - 1)
        squares = 2 * speed_bits
        super().__init__({
            "blocks": In(stream.Signature(data.StructLayout({"data": WIDTH, "last": 1}))),
            "take": Out(1),
            "profile": Out(stream.Signature(data.StructLayout({
                "energy": squares, "modulus": modulus_bits,
                "log2_ticks": range(MAX_LOG2_TICKS + 1)}))),
            "bound": Out(2), "override": Out(OverrideKind),
            "segments": Out(stream.Signature(Segment)),
            "idle": In(1), "start": In(1), "off": In(1), "ended": Out(1), "paused": Out(1),
            "waiting": Out(1),
            "outputs": Out(Outputs), "extra": Out(WIDTH),
            "feed": Out(FEED_BITS, init=(1 << FEED_BITS) - 1),
            "fault": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        word = self.blocks.p.data
        header = Signal(BlockHeader)
        number = Signal(4)
        wanted = Signal()  # words of the profile, or those of the walk when it has taken the last
        read = Signal()
        profile = self.profile.p
        m.d.comb += [
            wanted.eq((number < BlockWord.PLACE) | ~self.segments.valid),
            read.eq(self.blocks.valid & self.blocks.ready),
            profile.log2_ticks.eq(header.log2_ticks),
        ]
        of_profile = {name: Signal.like(profile[name], name=name)
                      for name in ("energy", "modulus")}
        m.d.comb += [profile[name].eq(field) for name, field in of_profile.items()]
        # A word of the profile, so that it does not wait for what is wanted.
        reads = Signal()
        m.d.comb += [self.override.eq(header.override), self.bound.eq(Cat(
            self.blocks.valid & reads & (number == which)
            for which in (BlockWord.FASTEST, BlockWord.HUNDREDTH)))]

        # The places of the three axes change places, so that the one that comes next is first.
        places = [Signal(WIDTH, name=f"place_{place}") for place in range(3)]
        channels = range(3)
        starts = [Signal(8, name=f"start_{channel}") for channel in channels]
        increments = [Signal(signed(34), name=f"increment_{channel}") for channel in channels]
        change = Signal(signed(34))
        channel_now = Signal(2)
        m.d.comb += [change.eq(word - places[0]),
                     channel_now.eq(Array(header.channel[axis] for axis in range(3))
                                    [(number - BlockWord.PLACE)[:2]])]
        turns = Signal.like(self.segments.p.turns)
        x, y = Signal(WIDTH), Signal(WIDTH)
        residual = Signal(29)
        new_extra = Signal(WIDTH)
        read_feed = Signal(FEED_BITS)
        new_feed = Signal(FEED_BITS)
        segment_header = Signal(BlockHeader)
        has_places = Signal()  # a clock after the header
        m.d.sync += has_places.eq((header.kind == BlockKind.MOTION)
                                  | (header.kind == BlockKind.PLACE))
        # What is copied is so in every clock of its number, of which the last is that of its word.
        with m.Switch(number):
            for high, field in ((BlockWord.ENERGY, of_profile["energy"]),
                                (BlockWord.MODULUS, of_profile["modulus"]),
                                (BlockWord.TURNS, turns)):
                with m.Case(high):
                    m.d.sync += field[WIDTH:].eq(word)
                with m.Case(high + 1):
                    m.d.sync += field[:WIDTH].eq(word)
            with m.Case(BlockWord.X):
                m.d.sync += x.eq(word)
            with m.Case(BlockWord.Y):
                m.d.sync += y.eq(word)
            with m.Case(BlockWord.RESIDUAL):
                m.d.sync += residual.eq(word)
        with m.If(~header.arc & ((number == BlockWord.TURNS) | (number == BlockWord.TURNS + 1))):
            m.d.sync += turns.eq(0)
        with m.If(read):
            m.d.sync += number.eq(number + 1)
            with m.Switch(number):
                with m.Case(BlockWord.HEADER):
                    m.d.sync += header.eq(word)
                with m.Case(*(BlockWord.PLACE + axis for axis in range(3))):
                    with m.If(has_places):
                        m.d.sync += Cat(places).eq(Cat(places[1:], word))
                        for channel, start, increment in zip(channels, starts, increments,
                                                             strict=True):
                            with m.If(channel_now == channel):
                                m.d.sync += [start.eq(places[0] + 128),  # 1/2 step
                                             increment.eq(change)]
                                with m.If(header.arc & (channel != 2)):
                                    m.d.sync += increment.eq(0)
                with m.Case(BlockWord.EXTRA):
                    m.d.sync += [new_extra.eq(word), new_feed.eq(read_feed),
                                 segment_header.eq(header)]
                    with m.If(header.kind == BlockKind.MOTION):
                        m.d.sync += self.segments.valid.eq(1)
            for place, bits in ((FEED_LOW, read_feed[:FEED_LOW[2]]),
                                (FEED_HIGH, read_feed[FEED_LOW[2]:])):
                with m.If(number == place[0]):
                    m.d.sync += bits.eq(word >> place[1])
        segment = self.segments.p
        m.d.comb += [
            segment.turns.eq(turns), segment.x.eq(x), segment.y.eq(y),
            segment.residual.eq(residual), segment.log2_ticks.eq(segment_header.log2_ticks),
            segment.arc.eq(segment_header.arc), segment.clockwise.eq(segment_header.clockwise),
            segment.channel.eq(segment_header.channel), segment.shift.eq(segment_header.shift),
            *(each.eq(start) for each, start in zip(segment.start, starts, strict=True)),
            *(each.eq(increment)
              for each, increment in zip(segment.increment, increments, strict=True)),
            *(each.eq((place + 128) >> 8) for each, place in zip(segment.end, places, strict=True)),
        ]

        pause = Signal(range(REFRESH))
        microseconds = self._microseconds(m)
        left = Signal(WIDTH)
        loads = Signal()
        with m.If(loads | microseconds):
            m.d.sync += left.eq(add_choice((~loads).replicate(WIDTH), Mux(loads, new_extra, left)))
        outputs, extra = Signal(Outputs, reset_less=True), Signal(WIDTH, reset_less=True)
        due = Signal()  # outputs wait for the end of motion
        due_outputs = Signal(Outputs)
        due_extra = Signal(WIDTH)
        with m.If(self.segments.valid & self.segments.ready):
            m.d.sync += [self.segments.valid.eq(0), outputs.eq(segment_header.outputs),
                         extra.eq(new_extra), self.feed.eq(new_feed), due.eq(0)]
        with m.Elif(due & self.idle):
            m.d.sync += [outputs.eq(due_outputs), extra.eq(due_extra), due.eq(0)]
        # In the clock in which some are set others may come, which are due.
        with m.FSM(name="loader_state") as fsm:
            with m.State("READ"):
                m.d.comb += [reads.eq(1), self.blocks.ready.eq(wanted)]
                m.d.sync += pause.eq(REFRESH - 1)
                with m.If(read & self.blocks.p.last):
                    m.next = "SETTLE"
                    with m.If(header.kind == BlockKind.MOTION):
                        m.next = "OFFER"
            with m.State("OFFER"):
                m.d.comb += [self.profile.valid.eq(1), self.take.eq(self.profile.ready)]
                with m.If(self.profile.ready):
                    m.next = "READ"
            with m.State("SETTLE"):
                m.d.sync += pause.eq(pause - 1)
                m.d.comb += loads.eq(1)
                with m.If(pause == 0):
                    with m.Switch(header.kind):
                        with m.Case(BlockKind.DWELL):
                            with m.If(self.idle):
                                m.next = "DWELL"
                        with m.Case(BlockKind.PAUSE):
                            with m.If(self.idle):
                                m.next = "PAUSE"
                        with m.Case(BlockKind.END):
                            with m.If(self.idle):
                                m.next = "TAKE"
                        with m.Case(BlockKind.OUTPUTS):
                            m.d.sync += [due.eq(1), due_outputs.eq(header.outputs),
                                         due_extra.eq(new_extra)]
                            m.next = "TAKE"
                        with m.Default():
                            m.next = "TAKE"
                    m.d.sync += pause.eq(0)
            with m.State("DWELL"):
                m.d.comb += self.waiting.eq(1)
                with m.If(left == 0):
                    m.next = "TAKE"
            with m.State("PAUSE"):
                m.d.comb += self.paused.eq(1)
                with m.If(self.start):
                    m.next = "TAKE"
            with m.State("TAKE"):
                m.d.comb += [self.take.eq(1), self.ended.eq(header.kind == BlockKind.END)]
                m.next = "READ"
            with m.State("FAULT"):
                pass
        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))

        with m.If(self.off | ResetSignal()):
            m.d.sync += [outputs.eq(0), extra.eq(0)]
        m.d.comb += [self.outputs.eq(outputs), self.extra.eq(extra)]
        return m

    def _microseconds(self, m: Module) -> Signal:
        """Return a signal that is 1 for a clock each microsecond, while a dwell is counted."""
        # Below 0 until it is, by a part of the clock, so that its sign is all that is looked at.
        early = self.clock - 10**6
        phase = Signal(range(-early, 10**6), init=-early)
        over = Signal()
        m.d.comb += over.eq(self.waiting & (phase[-1] == 0))
        m.d.sync += phase.eq(phase + Mux(phase[-1], 10**6, -early))
        with m.If(~self.waiting):
            m.d.sync += phase.eq(-early)
        return over
