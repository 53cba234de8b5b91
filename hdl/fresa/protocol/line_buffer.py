"""Bytes to lines that are passed on while they come, through a FIFO."""

from amaranth import Cat, Module, Mux, Signal, unsigned
from amaranth.lib import memory, stream, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from .line import LineEnd, LineItem
from .receiver import Received

__all__ = ["MAX_DEPTH", "MAX_SILENCE", "LineBuffer"]

MAX_DEPTH, MAX_SILENCE = 4096, 2**26
"""Largest number of items of the FIFO, and of clocks of silence."""


class LineBuffer(wiring.Component):
    """Buffers bytes as items of lines; a line of any length goes on while it comes.

    CR and LF each end a line, CR LF is one end, and so is silence within a line, if enabled. An end
    goes on with the status of its line, so what a line says is to be done when its end has come.

    A byte with an error damages its line: the bytes of it that follow are dropped, and its end has
    status DAMAGED. So does a byte for which there is no room, ``overflow``. A byte is never left to
    wait for room, so that real-time commands behind it come through. The ends of lines that there
    is no room for are counted, up to the next power of two above ``depth`` less 1, and stored,
    DAMAGED, as soon as there is: each line has its end, and a line that comes when there is room
    again is whole.

    An item is offered three clocks after its byte was taken, and then one every two clocks: the
    FIFO is read into a register, since a block RAM alone is slow.

    Parameters
    ----------
    depth : int
        Items that the FIFO holds, from 2 to ``MAX_DEPTH``; one more is in the register behind it.
    silence : int, optional
        Clocks after the last byte of a line that end it, from 1 to ``MAX_SILENCE``; a LF that
        comes first after that is part of that end. Without it only characters end a line.

    Members
    -------
    bytes : In(stream.Signature(Received))
        Bytes, each with its error flag.
    items : Out(stream.Signature(LineItem))
        Lines: the bytes of each, then its end, with a `LineEnd`, GOOD or DAMAGED.
    free : Out(range(depth + 1))
        Items for which there is room.
    overflow : Out(1)
        A byte, or an end, is lost for lack of room. For one clock.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, depth: int = 128, silence: int | None = None) -> None:
        self.depth = in_range("depth of a line buffer", depth, 2, MAX_DEPTH)
        self.silence = silence
        if silence is not None:
            in_range("silence", silence, 1, MAX_SILENCE)
        super().__init__({
            "bytes": In(stream.Signature(Received)),
            "items": Out(stream.Signature(LineItem)),
            "free": Out(range(depth + 1), init=depth),
            "overflow": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()

        m.submodules.ring = ring = memory.Memory(
            shape=unsigned(9), depth=1 << (self.depth - 1).bit_length(), init=[],
            attrs={"ram_style": "block"})
        store, fetch = ring.write_port(), ring.read_port()
        head = Signal(range(ring.depth))  # address of the next item to store
        tail = Signal(range(ring.depth))  # address of the next item to pass on
        owed = Signal(range(self.depth + 1))  # ends that had no room
        # Flags, since much depends on these counts
        room = Signal(init=1)  # `free` is not 0
        owes = Signal()  # `owed` is not 0
        pays = Signal()  # such an end is stored
        taken = Signal()
        m.d.comb += [
            pays.eq(room & owes),
            self.bytes.ready.eq(~pays),
            taken.eq(self.bytes.valid & ~pays),
        ]

        byte, error = self.bytes.p.byte, self.bytes.p.error
        ended = Signal()
        more = Signal()  # a byte of the line
        begun = Signal()  # it had a byte
        damaged = Signal()
        after = Signal()  # the last byte was a CR, or silence: a LF now belongs to that end
        silent = self._silence(m, taken, begun & ~self.bytes.valid & ~pays)
        lf, cr = byte == ord("\n"), byte == ord("\r")
        rest = after & lf & ~error
        m.d.comb += [
            ended.eq(silent | (taken & (lf | cr) & ~rest)),
            more.eq(taken & ~lf & ~cr),
        ]
        with m.If(taken | silent):
            m.d.sync += after.eq(silent | (taken & cr))
        with m.If(ended):
            m.d.sync += [begun.eq(0), damaged.eq(0)]
        with m.Elif(more):
            m.d.sync += [begun.eq(1), damaged.eq(damaged | error | ~room)]

        wanted = Signal()
        m.d.comb += [
            wanted.eq(ended | (more & ~damaged & ~error)),
            self.overflow.eq(wanted & ~room),
            store.en.eq(room & (wanted | pays)),
            store.addr.eq(head),
            store.data.eq(Cat(Mux(more, byte, Mux(damaged | (taken & error) | pays,
                                                  LineEnd.DAMAGED, LineEnd.GOOD)), ~more)),
        ]
        with m.If(pays | (ended & ~room & ~owed.all())):
            m.d.sync += [owed.eq(owed + Mux(pays, -1, 1)), owes.eq(~pays | (owed != 1))]

        # An item is addressed, read and offered, a clock each. A word that is stored in the clock
        # in which it is addressed is not read.
        waits = Signal()  # there is one: `free` is not `depth`
        read = Signal()  # the ring gives the item at `tail`
        leaves = Signal()
        m.d.comb += [
            fetch.addr.eq(tail),
            leaves.eq(read & (~self.items.valid | self.items.ready)),
        ]
        m.d.sync += [
            head.eq(head + store.en),
            tail.eq(tail + leaves),
            read.eq(waits & ~leaves),
            self.items.valid.eq(leaves | (self.items.valid & ~self.items.ready)),
        ]
        with m.If(leaves):
            m.d.sync += self.items.payload.eq(fetch.data)
        with m.If(leaves ^ store.en):
            m.d.sync += [self.free.eq(self.free + Mux(leaves, 1, -1)),
                         room.eq(leaves | (self.free != 1)),
                         waits.eq(~leaves | (self.free != self.depth - 1))]

        return m

    def _silence(self, m: Module, taken: Signal, ends):
        """Return whether silence ends the line; `ends` says that it can."""
        silent = Signal()
        if self.silence is not None:
            left = Signal(range(self.silence), init=self.silence - 1)
            m.d.comb += silent.eq(ends & (left == 0))
            with m.If(taken):
                m.d.sync += left.eq(self.silence - 1)
            with m.Elif(left != 0):
                m.d.sync += left.eq(left - 1)
        return silent
