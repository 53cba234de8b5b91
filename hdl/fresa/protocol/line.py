"""Bytes to lines."""

from amaranth import Cat, Const, Module, Mux, Signal, unsigned
from amaranth.lib import data, enum, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from .receiver import Received

__all__ = ["MAX_LENGTH", "LineEnd", "LineItem", "LineReader"]

MAX_LENGTH = 1022
"""Largest length of a line, in bytes."""


class LineEnd(enum.Enum, shape=unsigned(8)):
    """Status of a line, given at its end."""

    GOOD = 0
    LONG = 1  # it had more bytes than the buffer holds
    DAMAGED = 2  # a byte of it had a framing error, or was lost


class LineItem(data.Struct):
    """A byte of a line, or its end."""

    byte: unsigned(8)  # with `end`, a `LineEnd`
    end: unsigned(1)


class LineReader(wiring.Component):
    """Collects bytes into lines, and passes each line on when its end has come.

    The buffer is a ring. A line is written behind those that wait, and becomes visible with its
    end; one that is too long or damaged frees its room at once, is dropped to its end, and only
    that end, with its status, is passed on. While lines wait and the buffer is full, no byte is
    taken. A single line always fits.

    With a start character a line begins behind it, and again behind each other one; bytes outside
    are dropped. But a byte outside with a framing error, or after lost ones, begins a damaged line:
    its start may have been among them. An end character of a line that has begun ends it, and is
    not part of it.

    The first byte of a line can be taken three clocks after its end was, and then one every three
    clocks: the ring is read into a register, since a block RAM alone is slow.

    Parameters
    ----------
    length : int
        Most bytes of a line, from 1 to ``MAX_LENGTH``.
    ends : bytes
        Characters that end a line, one or more.
    start : bytes
        The character that starts a line; empty if lines follow each other.
    skip_empty : bool
        Drop good lines that are empty, such as those between CR and LF.
    crlf : bool
        A CR right before an end character is not part of the line. It is buffered all the same: a
        line of ``length`` bytes and a CR is too long.

    Attributes
    ----------
    depth : int
        Words of the buffer: the bytes and ends that it holds, and one more.

    Members
    -------
    bytes : In(stream.Signature(Received))
        Bytes, each with its error flag.
    items : Out(stream.Signature(LineItem))
        Lines: the bytes of each, then its end.

    Raises
    ------
    ValueError
        If ``length`` is out of range, there is no end character, the start is one of them or more
        than one character, or with ``crlf`` the CR is one of these.
    """

    bytes: In(stream.Signature(Received))
    items: Out(stream.Signature(LineItem))

    def __init__(self, *, length: int, ends: bytes = b"\r", start: bytes = b"",
                 skip_empty: bool = False, crlf: bool = False) -> None:
        self.length = in_range("length of a line", length, 1, MAX_LENGTH)
        if not ends or len(start) > 1 or start in [ends[n:n + 1] for n in range(len(ends))]:
            raise ValueError(f"a line needs an end character, and one other or none to start it, "
                             f"not ends={ends!r} and start={start!r}")
        if crlf and b"\r" in ends + start:
            raise ValueError(f"with crlf a CR neither starts nor ends a line, "
                             f"not ends={ends!r} and start={start!r}")
        self.ends = ends
        self.start = start
        self.skip_empty = skip_empty
        self.crlf = crlf
        self.depth = 1 << (length + 1).bit_length()
        super().__init__()

    def elaborate(self, platform) -> Module:
        m = Module()

        m.submodules.ring = ring = memory.Memory(
            shape=unsigned(9), depth=self.depth, init=[])
        store, fetch = ring.write_port(), ring.read_port()
        kept = Signal(range(self.depth))  # address of the first byte of the line being received
        tail = Signal(range(self.depth))  # address of the next item to pass on
        count = Signal(range(self.length + 1))
        room = Signal()
        taken = Signal()
        m.d.comb += [
            room.eq((kept + count + 1)[:len(tail)] != tail),
            self.bytes.ready.eq(room),
            taken.eq(self.bytes.valid & room),
        ]

        byte, error = self.bytes.p.byte, self.bytes.p.error
        inside = Signal(init=not self.start)
        begun = Signal()  # a line has begun, with this byte at the latest
        long = Signal()
        damaged = Signal()
        ended = Signal()
        cr = Signal()  # the last byte so far is a CR, which an end would drop
        size = Signal.like(count)  # of a line that ends here
        starts = byte == self.start[0] if self.start else Const(0)
        m.d.comb += [
            begun.eq(inside | error),
            ended.eq(Cat(byte == end for end in self.ends).any()),
            size.eq(count - cr),
        ]
        with m.If(taken):
            m.d.sync += cr.eq(0)
        with m.If(taken & starts):
            m.d.sync += [inside.eq(1), count.eq(0), long.eq(0), damaged.eq(error)]
        with m.Elif(taken & begun & ended):
            m.d.sync += [inside.eq(not self.start), count.eq(0), long.eq(0), damaged.eq(0)]
            with m.If(damaged | error | long | (size != 0) | (not self.skip_empty)):
                m.d.sync += kept.eq(store.addr + 1)
        with m.Elif(taken & begun):
            m.d.sync += [inside.eq(1), damaged.eq(damaged | error),
                         long.eq(long | (count >= self.length))]
            with m.If(damaged | error | long | (count >= self.length)):
                m.d.sync += count.eq(0)
            with m.Else():
                m.d.sync += count.eq(count + 1)
                if self.crlf:
                    m.d.sync += cr.eq(byte == ord("\r"))
        verdict = Mux(damaged | error, LineEnd.DAMAGED, Mux(long, LineEnd.LONG, LineEnd.GOOD))
        # The word behind the line is free, so every byte is stored; a dropped one is overwritten.
        m.d.comb += [
            store.en.eq(taken),
            store.addr.eq(kept + Mux(error, 0, Mux(ended, size, count))),
            store.data.eq(Cat(Mux(ended, verdict, byte), ended)),
        ]

        # An item is addressed, read and offered, a clock each. A word that is stored in the clock
        # in which it is addressed is not read.
        given = Signal()
        read = Signal()  # the ring gives the item at `tail`
        m.d.comb += [
            given.eq(self.items.valid & self.items.ready),
            fetch.addr.eq(tail),
        ]
        m.d.sync += [
            tail.eq(tail + given),
            read.eq((tail != kept) & ~read & ~self.items.valid),
            self.items.valid.eq(read | (self.items.valid & ~self.items.ready)),
        ]
        with m.If(read):
            m.d.sync += self.items.payload.eq(fetch.data)

        return m
