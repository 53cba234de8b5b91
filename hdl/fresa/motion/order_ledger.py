"""Orders by sequence number, so that none is lost and none is carried out twice."""

from amaranth import Cat, Module, Signal, unsigned
from amaranth.lib import data, enum, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from ..checks import power_of_two
from .orders import Order

__all__ = [
    "MAX_DEPTH", "Answer", "OrderLedger", "Outcome", "Request", "RequestKind", "valid_depth",
]

MAX_DEPTH = 16
"""Largest depth: a LUT of the Spartan-3E is a distributed RAM of 16 words of one bit."""


def valid_depth(value: object) -> int:
    """Return `value` if a ledger can have that depth, else raise ValueError."""
    return power_of_two("depth", value, 2, MAX_DEPTH)


class RequestKind(enum.Enum, shape=unsigned(8)):
    """Kind of a request."""

    QUERY = 0
    OPEN = 1  # a session; the number is that of the order before its first
    GO = 2
    UP = 3
    DOWN = 4


class Request(data.Struct):
    """A request of a host. Written in hexadecimal it begins with ``kind``."""

    y: unsigned(16)
    x: unsigned(16)
    number: unsigned(24)
    session: unsigned(32)
    kind: RequestKind


class Outcome(enum.Enum, shape=unsigned(4)):
    """Result of a request."""

    REPORTED = 0  # the state, on a query
    OPENED = 1  # or was open already
    TAKEN = 2  # the order was
    AGAIN = 3  # it was taken before
    FULL = 4  # too many orders wait
    BUSY = 5  # orders of another session wait
    UNEXPECTED = 6  # the order has neither the next number nor the last
    CLOSED = 7  # the session is not open
    MANUAL = 8  # no session can be opened now
    DAMAGED = 9  # the line was
    UNKNOWN = 10  # there is no such request


class Answer(data.Struct):
    """Answer of the machine to a request. Written in hexadecimal it begins with ``outcome``.

    All fields but ``outcome`` give the state after the request.
    """

    done: unsigned(24)  # the last order that was carried out
    taken: unsigned(24)  # the last order that was taken
    session: unsigned(32)  # 0 if none is open
    error: unsigned(1)  # the machine refuses an order
    stopped: unsigned(1)  # until reset
    manual: unsigned(1)
    reserved: unsigned(1)
    outcome: Outcome


class OrderLedger(wiring.Component):
    """Accepts numbered orders of a session, each once, and queues them until they are carried out.

    A session is opened by a request, with a number of the host's choice that is not 0, and with the
    number before that of its first order. From there an order is taken only if it is of this
    session and has the next number; a repetition of the last number is answered and does nothing.
    So a host may repeat any request that got no answer. Opening the open session again does nothing
    either; another is opened only when all accepted orders are done. Session 0 means that none is
    open: after reset, after manual mode, or by a request, which closes the one before.

    The answer to an accepted request is valid one clock later, and no request is accepted before it
    has been taken. An answer gives the present state: so its receiver must, once ``answers.ready``,
    stay ready until there is one.

    Parameters
    ----------
    depth : int
        Orders in the queue, the one that is carried out included: 2, 4, 8 or 16.

    Members
    -------
    requests : In(stream.Signature)
        ``value``, a `Request`, and ``good``: its line had no error.
    answers : Out(stream.Signature(Answer))
        One answer a request.
    orders : Out(stream.Signature(Order))
        Orders. Each must be taken only once it has been carried out.
    enable : In(1)
        Automatic mode. Without it no order is offered, and one clock later the queue is empty and
        no session is open.
    error, stopped : In(1)
        State of the machine, for the answers.
    busy : Out(1)
        The queue is not empty.

    Raises
    ------
    ValueError
        If ``depth`` is no such number.
    """

    def __init__(self, *, depth: int = 2) -> None:
        self.depth = valid_depth(depth)
        super().__init__({
            "requests": In(stream.Signature(data.StructLayout({"value": Request, "good": 1}))),
            "answers": Out(stream.Signature(Answer)),
            "orders": Out(stream.Signature(Order)),
            "enable": In(1),
            "error": In(1),
            "stopped": In(1),
            "busy": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()

        request, good = self.requests.p.value, self.requests.p.good
        session = Signal(32)
        outcome = Signal(Outcome)
        taken = Signal(24)
        done = Signal(24)
        given = Signal()
        same = Signal()
        waiting = Signal(range(self.depth + 1))
        m.d.comb += [
            given.eq(self.requests.valid & self.requests.ready),
            self.requests.ready.eq(self.answers.ready & ~self.answers.valid),
            same.eq(request.session == session),
            waiting.eq(taken - done),
            self.busy.eq(waiting != 0),
            self.answers.p.eq(Cat(done, taken, session, self.error, self.stopped, ~self.enable,
                                  0, outcome)),
        ]

        # Order n is in word n of a ring buffer.
        m.submodules.ring = ring = memory.Memory(shape=Order, depth=self.depth, init=[])
        store, fetch = ring.write_port(), ring.read_port(domain="comb")
        m.d.comb += [
            store.addr.eq(request.number[:len(store.addr)]),
            store.data.x.eq(request.x),
            store.data.y.eq(request.y),
            store.data.up.eq(request.kind == RequestKind.UP),
            store.data.down.eq(request.kind == RequestKind.DOWN),
            fetch.addr.eq((done + 1)[:len(fetch.addr)]),
            self.orders.valid.eq(self.busy & self.enable),
            self.orders.payload.eq(fetch.data),
        ]
        with m.If(self.orders.valid & self.orders.ready):
            m.d.sync += done.eq(done + 1)

        # Result of a request
        decided = Signal(Outcome)
        opens = Signal()
        with m.If(~good):
            m.d.comb += decided.eq(Outcome.DAMAGED)
        with m.Else():
            with m.Switch(request.kind):
                with m.Case(RequestKind.QUERY):
                    m.d.comb += decided.eq(Outcome.REPORTED)
                with m.Case(RequestKind.OPEN):
                    with m.If(~self.enable):
                        m.d.comb += decided.eq(Outcome.MANUAL)
                    with m.Elif(~same & self.busy):
                        m.d.comb += decided.eq(Outcome.BUSY)
                    with m.Else():
                        m.d.comb += [decided.eq(Outcome.OPENED), opens.eq(~same)]
                with m.Case(RequestKind.GO, RequestKind.UP, RequestKind.DOWN):
                    with m.If(~self.enable | ~same | (session == 0)):
                        m.d.comb += decided.eq(Outcome.CLOSED)
                    with m.Elif(request.number == taken):
                        m.d.comb += decided.eq(Outcome.AGAIN)
                    with m.Elif(request.number != (taken + 1)[:24]):
                        m.d.comb += decided.eq(Outcome.UNEXPECTED)
                    with m.Elif(waiting == self.depth):
                        m.d.comb += decided.eq(Outcome.FULL)
                    with m.Else():
                        m.d.comb += decided.eq(Outcome.TAKEN)
                with m.Default():
                    m.d.comb += decided.eq(Outcome.UNKNOWN)

        with m.If(given):
            m.d.sync += [self.answers.valid.eq(1), outcome.eq(decided)]
            with m.If(opens):
                m.d.sync += [session.eq(request.session), taken.eq(request.number),
                             done.eq(request.number)]
            with m.If(decided == Outcome.TAKEN):
                m.d.comb += store.en.eq(1)
                m.d.sync += taken.eq(request.number)
        with m.Elif(self.answers.ready):
            m.d.sync += self.answers.valid.eq(0)
        with m.If(~self.enable):
            m.d.sync += [session.eq(0), taken.eq(0), done.eq(0)]

        return m
