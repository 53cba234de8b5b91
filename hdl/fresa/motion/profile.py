"""Speed along a path: from blocks to ticks."""

from amaranth import Module, Mux, Signal, Value, signed
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..fsm import leave_unused_codes
from .root import SquareRoot

__all__ = ["GRANULE_BITS", "SpeedProfile"]

GRANULE_BITS = 5
"""A granule has at most 2 to this power of ticks."""


class SpeedProfile(wiring.Component):
    """Divides blocks, parts of a path, into ticks; the speed has a limited acceleration.

    A block is 2**s ticks of equal lengths of path. At constant acceleration the square of the speed
    v, called w here, is linear in the path: so a tick can add a constant to it, the block's
    `energy`, and it takes sums and minima alone to reach every speed and every end exactly. Speeds
    are set for a granule at a time, 2**g ticks; while one runs, the next is computed:

    - g is the smallest for which the granule takes at least 64 clocks at the present rate, or
      ``GRANULE_BITS``, or as many as the ticks that are left in the block are a multiple of;
    - w at its end is the smaller of `nominal` and ``exit + energy * (ticks then left)``, with
      `hold` it is 0; it changes by ``energy * 2**g`` at most from that at its start;
    - the rate, at which the phase accumulator counts, is the sum of the roots of both, which is
      twice the mean speed.

    In each clock the phase grows by the rate; where it reaches the modulus there is a tick, which
    subtracts the modulus. The phase is a length of path: so it goes on from block to block. The
    last tick of a granule lies within a clock, the remainder of which belongs to the next granule:
    on average it is half, so half of the difference of the rates is added to the phase. Where w is
    0 between granules, the phase starts anew, with half of the rate.

    The next rate is known 63 clocks after a granule has begun. If the granule is over by then, as
    it can be in the first of an acceleration that takes less than a millisecond, the next begins
    when it is known, later than it should, and the phase starts anew.

    **Blocks.** The next one is taken a clock after the begin of the last granule of the present
    one, if it has been offered for 4 + s clocks then, or later. If the present one ends at a w
    above 0, the next must be there: if none is offered after the last tick, the speed is cut to 0,
    which ``starved`` shows. So ``exit`` may be above 0 only while a block is offered. At w = 0 the
    profile stands and waits for the next block, or for the end of `hold`.

    **Hold** is sampled, with the decision to compute a granule, in the clock before that in
    which the one before begins: it slows down from the granule after that, as fast as the block
    allows, through the begin of the next block if need be. At w = 0 nothing begins while it lasts.
    Then it goes on with the ticks that are left. A reset while it stands discards them.

    **Exit** is sampled 7 clocks after that. It may rise at any time; after a block has been taken
    it must be that of this block within 5 clocks. If it falls, the end may be faster than it.

    Two ticks are never in consecutive clocks; the modulus must be at least twice the highest speed
    (of `nominal` and of ``exit``). Otherwise there are fewer ticks than there should be.

    Parameters
    ----------
    speed_bits : int
        Bits of the integer part of a speed. Squares have twice as many.
    fraction_bits : int
        Bits of the fraction of a speed, from 1.
    most_ticks_log2 : int
        Largest s.
    brake_bits : int
        Bits of ``energy << s``, at least those of squares.

    Members
    -------
    blocks : In(stream.Signature)
        ``energy``, from 2 up: what a tick can add to w. ``modulus``: length of path a tick times
        clocks a second, in speeds with ``fraction_bits``. ``nominal``: w that is not
        exceeded. ``log2_ticks``: s.
    exit : In(2 * speed_bits)
        Highest w at the end of the block that was taken last.
    hold : In(1)
        Slow down and stand.
    tick : Out(1)
        A tick.
    first, last : Out(1)
        With a tick: the first of a block, the last of a block.
    speed : Out(speed_bits)
        Mean speed of the present granule.
    standing : Out(1)
        No granule runs, and w is 0.
    starved : Out(1)
        The speed is cut to 0 since no block follows.
    fault : Out(1)
        The state machine was upset: no ticks from the next clock on, until reset.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, speed_bits: int = 31, fraction_bits: int = 16, most_ticks_log2: int = 40,
                 brake_bits: int = 72) -> None:
        self.speed_bits = in_range("speed_bits", speed_bits, 2, 64)
        self.fraction_bits = in_range("fraction_bits", fraction_bits, 1, 64)
        self.most_ticks_log2 = in_range("most_ticks_log2", most_ticks_log2, 1, 63)
        self.square_bits = 2 * self.speed_bits
        self.brake_bits = in_range("brake_bits", brake_bits, self.square_bits, 256)
        self.modulus_bits = self.speed_bits + self.fraction_bits + 3
        super().__init__({
            "blocks": In(stream.Signature(data.StructLayout({
                "energy": self.square_bits, "modulus": self.modulus_bits,
                "nominal": self.square_bits, "log2_ticks": range(self.most_ticks_log2 + 1)}))),
            "exit": In(self.square_bits), "hold": In(1),
            "tick": Out(1), "first": Out(1), "last": Out(1), "speed": Out(self.speed_bits),
            "standing": Out(1), "starved": Out(1), "fault": Out(1)})

    def elaborate(self, platform) -> Module:
        m = Module()
        block = self.blocks.p
        rate_bits = self.speed_bits + self.fraction_bits + 1  # twice a speed

        # Block offered: its energy is multiplied by its ticks meanwhile.
        offered = Signal(self.brake_bits)
        doublings = Signal.like(block.log2_ticks)
        multiplying = Signal()
        multiplied = Signal()
        m.d.comb += multiplied.eq(multiplying & (doublings == 0))
        with m.If(~self.blocks.valid | self.blocks.ready):
            m.d.sync += multiplying.eq(0)
        with m.Elif(~multiplying):
            m.d.sync += [multiplying.eq(1), offered.eq(block.energy),
                         doublings.eq(block.log2_ticks)]
        with m.Elif(~multiplied):
            m.d.sync += [offered.eq(offered << 1), doublings.eq(doublings - 1)]

        # Block taken last, and the granule that is computed
        energy = Signal(self.square_bits)
        modulus = Signal(self.modulus_bits)
        nominal = Signal(self.square_bits)
        brake = Signal(self.brake_bits)  # energy of the ticks left
        left = Signal(GRANULE_BITS)  # low bits of the number of ticks left
        more = Signal()  # some are
        opens = Signal()  # the granule is the first of the block
        square = Signal(self.square_bits)  # w at the end of the granule, once that is known
        at_rest = Signal(init=1)  # it is 0
        from_rest = Signal()  # w at the begin of the granule is 0
        holds = Signal()
        count = Signal(range(GRANULE_BITS))  # always as long: the exit of a new block may take time
        size = Signal(GRANULE_BITS + 1, init=1)  # its ticks
        change = Signal(self.square_bits + GRANULE_BITS)  # energy of the granule
        least = Signal(rate_bits + GRANULE_BITS + 1)  # what at 2**5 rates takes enough clocks

        # Present granule
        running = Signal()
        ticks = Signal(GRANULE_BITS + 1)  # ticks left
        final = Signal()  # one is
        rate = Signal(rate_bits)
        opening = Signal()
        closing = Signal()
        running_modulus = Signal(self.modulus_bits)
        end = Signal(rate_bits - 1)  # root at its end
        begin = Signal(self.modulus_bits + 3)  # root at its begin, later with moduli

        sums = Signal()  # the root is taken in this clock
        m.submodules.root = root = SquareRoot(integer_bits=self.speed_bits,
                                              fraction_bits=self.fraction_bits)

        # One adder for all that is squares, with registers in front of it, and behind its sign
        # where that decides what is added next.
        width = self.brake_bits + 2
        x = Signal(signed(width))
        y = Signal(signed(width))
        subtract = Signal()
        carry = Signal()
        total = Signal(signed(width))
        negative = Signal()  # the total is
        less = Signal()  # it was in the clock before
        beyond = Signal()  # w would change by more than the granule allows
        none = Signal()  # from 0 to 0, which goes up and down within the granule
        m.d.comb += [
            total.eq((((x << 1) | 1) + ((Mux(subtract, ~y, y) << 1) | carry)) >> 1),
            negative.eq(total < 0),
        ]
        m.d.sync += [y.eq(square), less.eq(negative)]

        def subtracts(does: Value | int) -> None:
            m.d.sync += [subtract.eq(does), carry.eq(does)]

        over = Signal()  # last tick of the granule, or there is none
        starts = Signal()
        held, may = Signal(), Signal()  # a clock old, for the sake of Fmax
        takes = Signal()
        adjusted = Signal(signed(self.modulus_bits + 3))  # half a difference, less a modulus
        m.d.comb += [root.radicand.eq(total), root.start.eq(sums)]
        m.d.sync += [held.eq(self.hold), sums.eq(0),
                     may.eq((more | multiplied) & ~(self.hold & at_rest))]

        with m.FSM(name="profile_state") as fsm:
            with m.State("WAIT"):
                m.d.comb += takes.eq(may)
                with m.If(~running & ~more & ~self.blocks.valid):
                    m.d.comb += self.starved.eq(~at_rest)
                    m.d.sync += [square.eq(0), at_rest.eq(1), end.eq(0)]
                with m.If(may):
                    m.next = "SCALE"
            with m.State("SCALE"):
                m.d.comb += self.blocks.ready.eq(opens)
                m.d.sync += [least.eq(modulus), change.eq(energy), size.eq(1)]
                m.next = "SEARCH"
            with m.State("SEARCH"):
                with m.If((least < rate << 5) & ((left & size) == 0) & ~from_rest):
                    m.d.sync += [least.eq(least << 1), change.eq(change << 1), size.eq(size << 1)]
                m.d.sync += [x.eq(brake), y.eq(self.exit), count.eq(count + 1)]
                subtracts(0)
                with m.If(count == GRANULE_BITS - 1):
                    m.d.sync += count.eq(0)
                    m.next = "BRAKE"
            with m.State("BRAKE"):
                m.d.sync += [x.eq(total), y.eq(change)]
                subtracts(1)
                m.next = "BOUND"
            with m.State("BOUND"):
                m.d.sync += [x.eq(total), y.eq(nominal)]
                m.next = "COMPARE"
            with m.State("COMPARE"):
                m.next = "GOAL"
            with m.State("GOAL"):
                with m.If(holds):
                    m.d.sync += x.eq(0)
                with m.Elif(~less):  # the bound is not
                    m.d.sync += x.eq(nominal)
                m.next = "DIFFERENCE"
            with m.State("DIFFERENCE"):
                m.d.sync += [x.eq(total), y.eq(change)]
                subtracts(~negative)
                m.next = "LIMIT"
            with m.State("LIMIT"):
                m.d.sync += [none.eq(from_rest & (x == 0)), beyond.eq(negative == (x < 0))]
                m.next = "CHANGE"
            with m.State("CHANGE"):
                subtracts(0)
                with m.If(none):
                    m.d.sync += x.eq(change >> 1)
                with m.Elif(beyond):  # ~change and the carry are -change
                    m.d.sync += [x.eq(change ^ (x < 0).replicate(width)), carry.eq(x < 0)]
                m.d.sync += sums.eq(1)
                m.next = "SUM"
            with m.State("SUM"):
                m.d.sync += [square.eq(Mux(none, 0, total)), x.eq(brake), y.eq(change)]
                subtracts(1)
                m.next = "SPEND"
            with m.State("SPEND"):
                m.d.sync += [
                    brake.eq(total),
                    left.eq(left - size),
                    begin.eq(Mux(from_rest, 0, begin) + (modulus << 2)),
                ]
                m.next = "ROOT"
            with m.State("ROOT"):
                m.d.sync += [more.eq(brake != 0), at_rest.eq(square == 0)]
                with m.If(~root.busy):
                    m.d.sync += adjusted.eq((root.root - begin) >> 1)
                    m.next = "READY"
            with m.State("READY"):
                with m.If(over):
                    m.d.comb += [starts.eq(1), takes.eq(may)]
                    m.next = "WAIT"
                    with m.If(may):
                        m.next = "SCALE"
            with m.State("FAULT"):
                pass
        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))

        with m.If(takes):
            m.d.sync += [from_rest.eq(at_rest), holds.eq(held), opens.eq(0)]
            with m.If(~more):
                m.d.sync += [
                    energy.eq(block.energy), modulus.eq(block.modulus), nominal.eq(block.nominal),
                    brake.eq(offered), opens.eq(1),
                    left.eq(Mux(block.log2_ticks < GRANULE_BITS, 1 << block.log2_ticks[:3], 0)),
                ]

        # Phase, less a modulus. A tick subtracts a modulus alone, and the rate of its clock follows
        # with the next: there cannot be one in between.
        phase = Signal(signed(self.modulus_bits + 4))
        after = Signal()
        backlog = Signal()
        m.d.comb += [
            backlog.eq(phase[rate_bits:] != 0),
            self.tick.eq(running & (phase >= 0) & ~after),
            over.eq(~running | (self.tick & final)),
            self.first.eq(self.tick & opening),
            self.last.eq(self.tick & closing & final),
            self.speed.eq(Mux(running, rate >> self.fraction_bits + 1, 0)),
            self.standing.eq(~running & Mux(fsm.ongoing("WAIT"), at_rest, from_rest)),
        ]
        jumps = Signal()
        base, growth, distance = Signal.like(phase), Signal.like(phase), Signal.like(phase)
        m.d.comb += [
            distance.eq(running_modulus << 1),
            jumps.eq(self.tick | starts),
            base.eq(Mux((self.tick & backlog) | (starts & (~running | from_rest)), 0, phase)),
            growth.eq(Mux(starts, adjusted, Mux(self.tick, ~distance,
                                                Mux(after, rate << 1, rate)))),
        ]
        m.d.sync += after.eq(jumps)
        # While none runs, the phase may be any.
        m.d.sync += phase.eq(((base << 1 | 1) + (growth << 1 | (self.tick & ~starts))) >> 1)
        with m.If(self.tick):
            m.d.sync += [ticks.eq(ticks - 1), final.eq(ticks == 2), opening.eq(0)]
        with m.If(starts):
            m.d.sync += [
                running.eq(1), ticks.eq(size), final.eq(size == 1), rate.eq(end + root.root),
                opening.eq(opens), closing.eq(~more), running_modulus.eq(modulus), begin.eq(end),
                end.eq(Mux(at_rest, 0, root.root)),
            ]
        with m.Elif(over | self.fault):
            m.d.sync += running.eq(0)
        return m
