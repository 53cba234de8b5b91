"""Speed along a path: from blocks to ticks."""

from amaranth import Cat, Const, Module, Mux, Signal, Value, signed
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..choice import add_choice, choice_code, choose
from ..fsm import leave_unused_codes
from .root import SquareRoot

__all__ = ["GRANULE_BITS", "SpeedProfile"]

SQUARE, NOMINAL, EXIT, CHANGE = (choice_code(number) for number in range(4))
"""What goes into the adder, as codes of :func:`choose`."""

GRANULE_BITS = 5
"""A granule has at most 2 to this power of ticks."""


class SpeedProfile(wiring.Component):
    """Divides blocks, parts of a path, into ticks; the speed has a limited acceleration.

    A block is 2**s ticks of equal lengths of path. At constant acceleration the square of the speed
    v, called w here, is linear in the path: so a tick can add a constant to it, the block's
    `energy`, and it takes sums and minima alone to reach every speed and every end exactly. Speeds
    are set for a granule at a time, 2**g ticks; while one runs, the next is computed:

    - g is the smallest for which the granule takes at least 64 clocks at the speed of its begin, or
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

    The next rate is known 63 clocks after a granule has begun. If the granule is over by then, the
    next begins when it is known, with a phase that has grown at the rate of the one before: ticks
    that are late come as soon as they may, but a phase of more than a clock of the highest rate is
    dropped. So the end of a granule is off by more than 3 clocks only if an acceleration takes less
    than a third of a millisecond; and near rest, where a granule has few ticks, those within it if
    it takes less than a millisecond.

    **Blocks.** The next one is taken a clock after the begin of the last granule of the present
    one, if it has been offered for 4 + s clocks then, or later. If the present one ends at a w
    above 0, the next must be there: if none is offered after the last tick, the speed is cut to 0,
    which ``starved`` shows. So ``exit`` may be above 0 only while a block is offered. At w = 0 the
    profile stands and waits for the next block, or for the end of `hold`.

    **Hold** is sampled, with the decision to compute a granule, in the clock before that in
    which the one before begins: it slows down from the granule after that, as fast as the block
    allows, through the begin of the next block if need be. At w = 0 nothing begins while it lasts.
    Then it goes on with the ticks that are left. A reset while it stands discards them. Where w is
    less than the energy of the last granule, that has a rate that is more by an eighth of the root
    of half that energy: without that its time would have no bound, as w may be nearly 0.

    **Nominal** is sampled 3 clocks after that: it must be that of a block from the clock after it
    was taken. If it falls, the speed does as fast as the block allows.

    **Exit** is sampled 7 clocks after that decision. It may rise at any time; after a block was
    taken it must be that of this block within 5 clocks. If it falls, the end may be faster than it.

    Two ticks are never in consecutive clocks; the modulus must be at least twice the highest speed
    (of `nominal` and of ``exit``). Otherwise there are fewer ticks than there should be.

    Parameters
    ----------
    speed_bits : int
        Bits of the integer part of a speed. Squares have twice as many.
    fraction_bits : int
        Bits of the fraction of a speed, from 1; with `speed_bits` five at least.
    most_ticks_log2 : int
        Largest s.
    brake_bits : int
        Bits of ``energy << s``, at least those of squares.

    Members
    -------
    blocks : In(stream.Signature)
        ``energy``, from 2 up: what a tick can add to w. ``modulus``: length of path a tick times
        clocks a second, in speeds with ``fraction_bits``. ``log2_ticks``: s.
    nominal : In(2 * speed_bits)
        w that is not exceeded.
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

    def __init__(self, *, speed_bits: int = 31, fraction_bits: int = 16, most_ticks_log2: int = 36,
                 brake_bits: int = 72) -> None:
        self.speed_bits = in_range("speed_bits", speed_bits, 2, 64)
        # An eighth of a root takes two clocks or more, in which it is known what follows.
        self.fraction_bits = in_range("fraction_bits", fraction_bits, max(1, 5 - speed_bits), 64)
        self.most_ticks_log2 = in_range("most_ticks_log2", most_ticks_log2, 1, 63)
        self.square_bits = 2 * self.speed_bits
        self.brake_bits = in_range("brake_bits", brake_bits, self.square_bits, 256)
        self.modulus_bits = self.speed_bits + self.fraction_bits + 3
        super().__init__({
            "blocks": In(stream.Signature(data.StructLayout({
                "energy": self.square_bits, "modulus": self.modulus_bits,
                "log2_ticks": range(self.most_ticks_log2 + 1)}))),
            "nominal": In(self.square_bits), "exit": In(self.square_bits), "hold": In(1),
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
        nominal = Signal(self.square_bits)  # of the granule
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
        least = Signal(rate_bits + GRANULE_BITS + 1)  # modulus x size
        compared = Signal(len(least) + 1)  # what it becomes
        short = Signal()  # that takes less than 64 clocks at the begin, unless the search is over

        # Present granule
        running = Signal()
        ticks = Signal(GRANULE_BITS + 1)  # ticks left
        final = Signal()  # one is
        rate = Signal(rate_bits)
        opening = Signal()
        closing = Signal()
        running_modulus = Signal(self.modulus_bits)
        end = Signal(rate_bits - 1)  # root at its end
        begin = Signal(rate_bits - 1)  # and at its begin, or that from which the next one starts
        speed = Signal(self.speed_bits)  # half of the rate, if it runs

        sums = Signal()  # the root is taken in this clock
        m.submodules.root = root = SquareRoot(integer_bits=self.speed_bits,
                                              fraction_bits=self.fraction_bits)

        # One adder for all that is squares, with registers in front of it. It has one accumulator,
        # x, that is also cleared by a sign, a clock after that is known, and one for others, y.
        width = self.brake_bits + 2
        x = Signal(signed(width))
        y = Signal(signed(width))
        subtract = Signal()
        carry = Signal()
        total = Signal(signed(width))
        negative = Signal()  # the total is
        less = Signal()  # the bound is less than the nominal square
        beyond = Signal()  # w would change by more than the granule allows
        # From 0 to 0, which goes up and down within the granule; or to 0 for a hold, from less than
        # its energy.
        none = Signal()
        inverts, from_brake, keeps, clears = Signal(), Signal(), Signal(), Signal()
        source = Signal(3)  # of y
        m.d.comb += [
            total.eq(((x << 1) - ((y ^ (~subtract).replicate(width)) << 1 | ~carry)) >> 1),
            negative.eq(total[-1]),
        ]
        with m.If(clears):
            m.d.sync += x.eq(0)
        with m.Elif(~keeps):
            m.d.sync += x.eq(Mux(from_brake, brake, total ^ inverts.replicate(width)))
        m.d.sync += y.eq(choose([square, nominal, self.exit, change], source, width))

        def loads(which: Value | int) -> None:  # by the next clock
            m.d.sync += source.eq(which)

        def subtracts(does: int) -> None:
            m.d.sync += [subtract.eq(does), carry.eq(does)]

        ends = Signal()  # at 0, without being beyond
        clears_square, clears_begin, stops, spends = Signal(), Signal(), Signal(), Signal()
        over = Signal()  # last tick of the granule, or there is none
        ready = Signal()  # the granule may start
        begins, follows = Signal(), Signal()  # none runs; behind another
        starts = Signal()  # either
        held, may = Signal(), Signal()  # a clock old, for the sake of Fmax
        takes = Signal()
        taken = Signal()  # in the clock before, which is what SCALE follows
        # A granule adds half of a difference of roots to the phase, less a modulus. One adder makes
        # that and the rate, which is a sum.
        less_modulus = Signal(self.modulus_bits + 3)  # what is subtracted for it
        adjusted = Signal(signed(self.modulus_bits + 3))
        rates = Signal(signed(self.modulus_bits + 4))
        minus = Signal(signed(self.modulus_bits + 5))  # twice that, or the inverse for a sum
        m.d.comb += [root.radicand.eq(total), root.start.eq(sums), root.halve.eq(none),
                     root.eighth.eq(none & ~from_rest)]
        m.d.sync += [held.eq(self.hold), sums.eq(0), ready.eq(0),
                     may.eq((more | multiplied) & ~(self.hold & at_rest))]

        # By the sign of a difference, less 1: so the choice of what is compared goes into the LUTs
        # of the carry.
        missing = Signal(signed(len(compared) + 1))
        m.d.comb += [compared.eq(Mux(taken, modulus, least << 1)),
                     self.blocks.ready.eq(taken & opens),
                     missing.eq(((end << 7) - (compared << 1 | 1)) >> 1)]
        m.d.sync += [taken.eq(takes), short.eq(missing[-1] == 0)]

        with m.FSM(name="profile_state") as fsm:
            with m.State("WAIT"):
                m.d.comb += takes.eq(may)
                with m.If(~running & ~more & ~self.blocks.valid):
                    m.d.comb += self.starved.eq(~at_rest)
                    m.d.comb += stops.eq(1)
                    m.d.sync += at_rest.eq(1)
                with m.If(may):
                    m.next = "SCALE"
            with m.State("SCALE"):
                m.d.sync += [least.eq(modulus), change.eq(energy), size.eq(1)]
                loads(NOMINAL)
                m.next = "SEARCH"
            with m.State("SEARCH"):
                with m.If(short & ((left & size) == 0) & ~from_rest):
                    m.d.sync += [least.eq(least << 1), change.eq(change << 1), size.eq(size << 1)]
                m.d.comb += from_brake.eq(1)
                m.d.sync += count.eq(count + 1)
                with m.If(count == 0):
                    m.d.sync += nominal.eq(self.nominal)
                subtracts(1)
                with m.If(count == GRANULE_BITS - 2):
                    loads(EXIT)
                with m.If(count == GRANULE_BITS - 1):
                    m.d.comb += from_brake.eq(0)
                    m.d.sync += count.eq(0)
                    subtracts(0)
                    loads(CHANGE)
                    m.next = "BRAKE"
            with m.State("BRAKE"):
                subtracts(1)
                loads(NOMINAL)
                m.next = "BOUND"
            with m.State("BOUND"):
                m.d.sync += less.eq(negative)
                subtracts(0)
                m.next = "COMPARE"
            with m.State("COMPARE"):
                m.d.comb += [keeps.eq(1), clears.eq(~less)]
                loads(SQUARE)
                m.next = "GOAL"
            with m.State("GOAL"):
                m.d.comb += [clears.eq(holds), clears_square.eq(holds)]
                m.d.sync += [square.eq(total), subtract.eq(1)]  # and 1 more: the sign is that of 0
                loads(CHANGE)
                m.next = "DIFFERENCE"
            with m.State("DIFFERENCE"):
                m.d.comb += [inverts.eq(1), clears_begin.eq(from_rest)]
                m.d.sync += [subtract.eq(negative), carry.eq(negative)]
                m.next = "LIMIT"
            with m.State("LIMIT"):
                m.d.comb += ends.eq(subtract & (from_rest | (holds & negative)))
                m.d.sync += [none.eq(ends), beyond.eq(negative ^ subtract)]
                loads(Mux(ends, CHANGE, SQUARE))
                m.next = "CORRECT"
            with m.State("CORRECT"):
                m.d.comb += [keeps.eq(1), clears.eq(~beyond)]
                m.d.sync += sums.eq(1)
                subtracts(0)
                loads(CHANGE)
                m.next = "SUM"
            with m.State("SUM"):
                m.d.comb += [from_brake.eq(1), clears_square.eq(none)]
                m.d.sync += square.eq(total)
                subtracts(1)
                m.next = "SPEND"
            with m.State("SPEND"):
                m.d.comb += [keeps.eq(1), spends.eq(1)]
                m.d.sync += [carry.eq(0), left.eq(left - size),
                             less_modulus.eq((modulus << 2) + begin)]
                m.next = "ROOT"
            with m.State("ROOT"):
                m.d.comb += keeps.eq(1)
                m.d.sync += [more.eq(~negative), at_rest.eq(square == 0)]
                with m.If(~root.busy):
                    m.d.sync += [adjusted.eq(rates >> 1), ready.eq(1)]
                    m.next = "READY"
            with m.State("READY"):
                m.d.sync += ready.eq(~starts)
                with m.If(starts):
                    m.d.comb += takes.eq(may)
                    m.next = "WAIT"
                    with m.If(may):
                        m.next = "SCALE"
            with m.State("FAULT"):
                pass
        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))

        with m.If(takes):
            m.d.sync += [from_rest.eq(at_rest), holds.eq(held), opens.eq(0)]
            with m.If(~more):
                m.d.sync += [energy.eq(block.energy), modulus.eq(block.modulus), opens.eq(1)]
        # What the search needs comes a clock later, for whether one is taken takes long.
        with m.If(self.blocks.ready):
            m.d.sync += left.eq(Mux(block.log2_ticks < GRANULE_BITS, 1 << block.log2_ticks[:3],
                                    0))

        # With a condition of its own the choice is no longer than needed.
        with m.If(self.blocks.ready | spends):
            m.d.sync += brake.eq(Mux(spends, total, offered))

        # Phase, less a modulus. A tick subtracts a modulus alone, and the rate of its clock follows
        # with the next: there cannot be one in between.
        phase = Signal(signed(self.modulus_bits + 4))
        after = Signal()
        backlog = Signal()
        waits = Signal()
        m.d.comb += [
            backlog.eq(phase[rate_bits:] != 0),
            self.tick.eq(running & (phase[-1] == 0) & ~after),
            over.eq(~running | (self.tick & final)),
            begins.eq(ready & ~running & ~after),
            waits.eq(~running & ~begins & backlog),
            follows.eq(ready & self.tick & final),
            starts.eq(begins | follows),
            self.first.eq(self.tick & opening),
            self.last.eq(self.tick & closing & final),
            self.speed.eq(speed),
            # The difference is taken in the clock before it is ready, the sum when it starts.
            minus.eq(Mux(ready, ~Cat(Const(0, 1), end, Const(0, 1)).as_signed(),
                         less_modulus << 1)),
            rates.eq(((root.root << 1) - minus) >> 1),
            self.standing.eq(~running & Mux(fsm.ongoing("WAIT"), at_rest, from_rest)),
        ]
        jumps = Signal()
        base, growth, distance = Signal.like(phase), Signal.like(phase), Signal.like(phase)
        m.d.comb += [
            distance.eq(running_modulus << 1),
            jumps.eq(self.tick | begins),  # one follows in a tick
            base.eq(Mux((jumps & backlog) | (starts & from_rest), 0, phase)),
            # Which jump it would be is known before whether it is one. A last tick behind which no
            # granule is ready subtracts nothing, as `adjusted` is 0 until one is: that does.
            growth.eq(Mux(jumps, Mux(final | ~running, adjusted, ~distance),
                          Mux(after, rate << 1, rate))),
        ]
        m.d.sync += after.eq(jumps)
        # While none runs, the phase grows only until it would be dropped.
        with m.If(~waits):
            m.d.sync += phase.eq(add_choice(growth, base, self.tick & ~final))
        with m.If(self.tick):
            m.d.sync += [ticks.eq(ticks - 1), final.eq(ticks == 2), opening.eq(0)]
        with m.If(starts):
            m.d.sync += [
                adjusted.eq(0), running.eq(1), ticks.eq(size), final.eq(size == 1), rate.eq(rates),
                speed.eq(rates >> self.fraction_bits + 1),
                opening.eq(opens), closing.eq(~more), running_modulus.eq(modulus), begin.eq(end),
                end.eq(root.root),
            ]
        with m.If((over & ~starts) | self.fault):
            m.d.sync += [running.eq(0), speed.eq(0)]
        with m.If(stops | clears_square):
            m.d.sync += square.eq(0)
        with m.If(clears_begin):
            m.d.sync += begin.eq(0)
        with m.If(stops | (starts & at_rest)):
            m.d.sync += end.eq(0)
        return m
