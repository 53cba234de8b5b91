"""Look-ahead: blocks that wait for the motion engine, and the speeds at which they may be entered.

Speeds are squared, w = v^2. A block is planned by two numbers: `limit`, the highest w at its entry,
and `gain`, the most that w can change over its length. The planner needs the backward pass alone:

    entry of a block = min(its limit, entry of the block after it + its gain)

from the newest block, with 0 after it, to the oldest. The engine that runs the blocks is the
forward pass. A new block changes the entry of that before it, which may change the one before that,
and so on; where an entry stays as it was, no older one depends on what has changed, so the pass
ends there. Entries only ever rise: what has been promised to the engine holds.

One schedule of eight clocks, which never stops, has the whole of it. A word read from the memory of
the plan arrives two clocks later, behind a register; numbers are of two words, low word first:

    clock   reads                       adder                       writes
    0, 1    gain                        -                           (0) high word of the entry
    2, 3    limit                       entry after it + gain       -
    4, 5    entry                       sum - limit: which is less  -
    6, 7    entry of oldest or second   minimum; as it was?         (7) low word of the entry

The last read pair alternates between the oldest block and the second; it refreshes `exit` and
`next_exit`. It never meets an entry that is half written: low words are read a clock before they
could be written, and high words as well.
"""

from amaranth import Cat, Const, Module, Mux, Signal, signed, unsigned
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range, power_of_two

__all__ = ["MAX_BLOCKS", "BlockQueue"]

MAX_BLOCKS = 256
"""Largest depth of a queue."""


class BlockQueue(wiring.Component):
    """Queue of blocks with look-ahead.

    A block is ``words`` words and its plan, written in any order, words left out keep what an older
    block left there. The word that is written with ``last`` commits the block. A block that is not
    committed leaves no trace: the next one is written over it.

    The reader gets the words of the oldest block in order, and nothing of the next before ``take``,
    which starts the block: it leaves the queue, and its entry is not planned any more. ``exit`` is
    the w with which the block that was taken last may end, and ``next_exit`` that of the oldest in
    the queue, which is the one to be taken next: each the entry of the block after it, 0 if there
    is none. They change as a whole, in one clock, and never fall while it is the same block, except
    by ``flush``: that ends the plan of the block that runs, and is for an engine that stands, or
    brakes and obeys no exit.

    A pass over n blocks takes at most 8 n + 9 clocks, during which no word is accepted, nor in the
    clock after it. `exit` and `next_exit` follow 20 clocks after an entry is computed, at most, and
    `next_exit` is 0 for at most so long after `take`. Words are offered from the third clock after
    `take`, one a clock.

    Entries without motion stand in the queue like others, with ``gain`` 0. Where motion must stop
    (dwell, program stop), and in the block after it, ``limit`` is 0. Others (coolant, offsets,
    line numbers) have as ``limit`` the highest w of the motion before them, so that their entry is
    that of the block after them; they can be taken while the motion before them runs, whose
    ``exit`` is then no lower, and carried out at its end. The kind of a block is for its words to
    say.

    Parameters
    ----------
    depth : int
        Blocks in the queue, the running one not among them: a power of two from 4 to
        ``MAX_BLOCKS``.
    words : int
        Words of a block: a power of two from 4 to 64.
    word : int
        Bits of a word, from 2 to 64.
    width : int
        Bits of w, more than those of a word and at most those of two.

    Attributes
    ----------
    gain, limit : int
        Addresses of the low words of the plan; the high words follow. A gain may have all bits of
        two words; a limit has ``width`` bits, those above them are 0.

    Members
    -------
    write : In(stream.Signature)
        A word: ``address``, ``data``, and ``last``, which commits the block. The words of the block
        have the addresses 0 to ``words`` - 1.
    blocks : Out(stream.Signature)
        Words of the oldest block: ``data``, and ``last`` with the last one. Only ``flush`` takes an
        offer back.
    take : In(1)
        Start the block that was read. Without effect until all its words are.
    flush : In(1)
        Drop all blocks in the queue, also one that is committed or read in this clock.
    exit, next_exit : Out(width)
        w at which the running block and the next one may end.
    count, free : Out(range(depth + 1))
        Blocks in the queue, and places left. A block counts once its own entry is computed.
    empty : Out(1)
        No block is in the queue, and none is about to be.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, depth: int = 64, words: int = 16, word: int = 36,
                 width: int = 62) -> None:
        self.depth = power_of_two("depth", depth, 4, MAX_BLOCKS)
        self.words = power_of_two("words", words, 4, 64)
        self.word = in_range("word", word, 2, 64)
        self.width = in_range("width", width, self.word + 1, 2 * self.word)
        self.gain, self.limit = self.words, self.words + 2
        super().__init__({
            "write": In(stream.Signature(data.StructLayout({
                "address": range(self.words + 4), "data": unsigned(self.word), "last": 1}))),
            "blocks": Out(stream.Signature(data.StructLayout({
                "data": unsigned(self.word), "last": 1}))),
            "take": In(1),
            "flush": In(1),
            "exit": Out(self.width),
            "next_exit": Out(self.width),
            "count": Out(range(self.depth + 1)),
            "free": Out(range(self.depth + 1)),
            "empty": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        head = Signal(range(self.depth))
        tail = Signal(range(self.depth))
        phase = Signal(4)  # the highest bit selects what the last read pair is of
        clock = phase[:3]
        m.d.sync += phase.eq(phase + 1)

        # `adding`: a block is committed, and not computed yet. `active`: a pass is under way.
        # `left`: blocks older than the one that is computed; negative once it was taken.
        adding = Signal()
        active = Signal()
        same = Signal()
        left = Signal(signed(len(head) + 1))
        taken = Signal()
        added = Signal()
        begins = Signal()
        ends = Signal()
        accepts = Signal(init=1)
        written = self.write.valid & self.write.ready
        m.d.comb += [
            self.write.ready.eq(accepts & ~adding),
            self.free.eq(self.depth - self.count),
            self.empty.eq((self.count == 0) & ~adding),
            begins.eq((clock == 0) & adding & ~active),
            ends.eq((clock == 0) & active),
            added.eq(ends & adding),
        ]
        m.d.sync += [
            self.count.eq(self.count + added - taken),
            head.eq(head + taken),
            tail.eq(tail + added),
            left.eq(Mux(begins, self.count, left) - ends - taken),
            # A clock old: only a word that is accepted makes it false, which `adding` shows.
            accepts.eq(~adding & ~active & (self.count != self.depth)),
        ]
        with m.If(written & self.write.p.last):
            m.d.sync += adding.eq(1)
        with m.If(begins):
            m.d.sync += active.eq(1)
        with m.If(ends):
            m.d.sync += adding.eq(0)
            with m.If((same & ~adding) | (left <= 0)):
                m.d.sync += active.eq(0)
        with m.If(self.flush):
            m.d.sync += [self.count.eq(0), head.eq(tail), tail.eq(tail), adding.eq(0),
                         active.eq(0)]

        self._plan(m, phase, head, tail, left, begins, active, same, taken)
        self._read(m, head, tail, taken)
        return m

    def _plan(self, m: Module, phase: Signal, head: Signal, tail: Signal, left: Signal,
              begins: Signal, active: Signal, same: Signal, taken: Signal) -> None:
        """Compute entries, and refresh the exits."""
        m.submodules.plan = plan = memory.Memory(shape=self.word, depth=8 * self.depth, init=[])
        write, read = plan.write_port(), plan.read_port()
        index = Signal.like(tail)
        computed = Signal.like(tail)
        number = [Signal(self.word, name=f"read_{age}") for age in range(3)]  # [0] is the newest
        clock = Signal(3)
        high = Signal()
        second = Signal()
        adds = Signal()
        subtracts = Signal()
        decides = Signal()
        m.d.comb += [clock.eq(phase), high.eq(phase[0]), second.eq(phase < 8),
                     adds.eq(clock[1:] == 1), subtracts.eq(clock[1:] == 2),
                     decides.eq(clock[1:] == 3)]
        m.d.sync += [number[0].eq(read.data), number[1].eq(number[0]), number[2].eq(number[1]),
                     computed.eq(index)]
        with m.If(clock == 7):
            m.d.sync += index.eq(Mux(active, index - 1, tail))
        m.d.comb += [
            read.addr.eq(Mux(decides, Cat(high, Const(0b10, 2), (head + second)[:len(head)]),
                             Cat(clock, index))),
            write.addr.eq(Mux(active, Cat(~high, Const(0b10, 2), computed),
                              Cat(self.write.p.address[:2], Const(0, 1), tail))),
            write.en.eq(Mux(active, ((clock == 7) | (clock == 0)) & (left >= 0),
                            self.write.valid & self.write.ready
                            & (self.write.p.address >= self.words))),
        ]

        # The two words of the entry go round through the adder: low words in even clocks.
        front = Signal(self.word)
        back = Signal(self.word)
        carry = Signal()
        over = Signal()
        limited = Signal()
        operand = Signal(self.word)
        entry = Signal(self.word)
        total = Signal(self.word + 1)
        m.d.comb += [
            operand.eq(number[0] ^ subtracts.replicate(self.word)),
            # A bit below the lowest carries in.
            total.eq((front << 1 | 1) + (operand << 1 | Mux(high, carry, subtracts)) >> 1),
            limited.eq(decides & (carry | over)),
            entry.eq(Mux(limited, number[2], front)),
            write.data.eq(Mux(active, back, self.write.p.data)),
        ]
        m.d.sync += [front.eq(back), back.eq(Mux(adds, total, entry))]
        with m.If(adds | subtracts):
            m.d.sync += carry.eq(total[-1])
        with m.If(subtracts & ~high):
            m.d.sync += over.eq(carry)
        with m.If(decides):
            m.d.sync += same.eq((number[0] == entry) & (same | ~high))
        with m.If(begins):
            m.d.sync += [front.eq(0), back.eq(0)]

        valid = Signal()  # what the last pair reads is still the entry of that block
        with m.If(clock == 6):
            m.d.sync += valid.eq((self.count != 0) & ~(second & (self.count == 1)))
        with m.If(valid & (clock == 1)):
            refreshed = Cat(number[1], number[0])[:self.width]
            m.d.sync += Mux(second, self.exit, self.next_exit).eq(refreshed)
        with m.If(taken):
            m.d.sync += [valid.eq(0), self.exit.eq(self.next_exit), self.next_exit.eq(0)]
        with m.If(self.flush):
            m.d.sync += [valid.eq(0), self.exit.eq(0), self.next_exit.eq(0)]

    def _read(self, m: Module, head: Signal, tail: Signal, taken: Signal) -> None:
        """Read the oldest block through two registers."""
        m.submodules.memory = blocks = memory.Memory(
            shape=self.word, depth=self.words * self.depth, init=[])
        write, read = blocks.write_port(), blocks.read_port()
        place = Signal(range(self.words))
        requested = Signal()  # all words of the block
        read_out = Signal()  # they are read
        fetched = Signal()
        fetched_last = Signal()
        offered, advances = self.blocks, Signal()
        fetches = (self.count != 0) & ~requested
        m.d.comb += [
            write.addr.eq(Cat(self.write.p.address[:len(place)], tail)),
            write.data.eq(self.write.p.data),
            write.en.eq(self.write.valid & self.write.ready
                        & (self.write.p.address < self.words)),
            read.addr.eq(Cat(place, head)),
            read.en.eq(advances),
            advances.eq(~offered.valid | offered.ready),
            taken.eq(self.take & read_out),
        ]
        with m.If(advances):
            m.d.sync += [fetched.eq(fetches), fetched_last.eq(place == self.words - 1),
                         offered.valid.eq(fetched), offered.p.data.eq(read.data),
                         offered.p.last.eq(fetched_last), place.eq(place + fetches)]
            with m.If(fetches & (place == self.words - 1)):
                m.d.sync += requested.eq(1)
        with m.If(offered.valid & offered.ready & offered.p.last):
            m.d.sync += read_out.eq(1)
        with m.If(taken | self.flush):
            m.d.sync += [requested.eq(0), read_out.eq(0)]
        with m.If(self.flush):
            m.d.sync += [place.eq(0), fetched.eq(0), offered.valid.eq(0)]
