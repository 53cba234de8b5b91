"""Orders that come over a serial line."""

from amaranth import Module
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out, connect

from ..motion import Answer, Order, OrderLedger, Request
from ..motion.order_ledger import valid_depth
from ..protocol import (
    CHECK_DIGITS,
    HexReader,
    HexWriter,
    LineReader,
    UARTReceiver,
    UARTTransmitter,
)
from ..protocol.baud import valid_bit

__all__ = ["ANSWER_START", "REQUEST_START", "SerialOrders"]

REQUEST_START, ANSWER_START = b":", b"="
"""Start characters of lines. They differ, so an echo is neither a request nor an answer."""


class SerialOrders(wiring.Component):
    """Takes orders as lines over RS-232, and answers each line.

    Even if bytes are dropped, doubled or changed, in both directions, every order is carried out
    once and in sequence, as long as its host repeats requests that got no answer: see
    `OrderLedger`, and docs/serial-orders.md for the lines. The buffer holds most of one further
    request while one waits; beyond that bytes are lost, and their lines are answered as damaged.

    Parameters
    ----------
    period : int
        Clocks of a bit; see :func:`fresa.protocol.bit_period`.
    depth : int
        Depth of the queue, see `OrderLedger`.

    Members
    -------
    rx : In(1)
        The line from the host, synchronous to the clock.
    tx : Out(1)
        The line to the host.
    orders : Out(stream.Signature(Order))
        Orders. Each must be taken only once it has been carried out.
    enable : In(1)
        Automatic mode. Without it the queue is empty and no session is open; lines are answered.
    error, stopped : In(1)
        State of the machine, for the answers.
    busy : Out(1)
        The queue is not empty.
    fault : Out(1)
        The state register of the receiver was upset. Stays until reset.

    Raises
    ------
    ValueError
        If ``period`` is out of range, or ``depth`` is none.
    """

    rx: In(1)
    tx: Out(1, init=1)
    orders: Out(stream.Signature(Order))
    enable: In(1)
    error: In(1)
    stopped: In(1)
    busy: Out(1)
    fault: Out(1)

    def __init__(self, *, period: int, depth: int = 2) -> None:
        self.period = valid_bit(period)
        self.depth = valid_depth(depth)
        super().__init__()

    def elaborate(self, platform) -> Module:
        m = Module()

        request, answer = Request.as_shape().size // 4, Answer.as_shape().size // 4
        m.submodules.receiver = receiver = UARTReceiver(period=self.period)
        m.submodules.lines = lines = LineReader(
            length=request + CHECK_DIGITS, start=REQUEST_START, ends=b"\r\n")
        m.submodules.reader = reader = HexReader(digits=request)
        m.submodules.ledger = ledger = OrderLedger(depth=self.depth)
        m.submodules.writer = writer = HexWriter(digits=answer, start=ANSWER_START)
        m.submodules.transmitter = transmitter = UARTTransmitter(period=self.period)
        connect(m, receiver.bytes, lines.bytes)
        connect(m, lines.items, reader.items)
        connect(m, writer.bytes, transmitter.bytes)
        connect(m, ledger.orders, wiring.flipped(self.orders))
        m.d.comb += [
            receiver.rx.eq(self.rx),
            self.tx.eq(transmitter.tx),
            # The bits of a message are the fields of a request, and those of an answer a message.
            ledger.requests.valid.eq(reader.messages.valid),
            ledger.requests.payload.eq(reader.messages.payload.as_value()),
            reader.messages.ready.eq(ledger.requests.ready),
            writer.messages.valid.eq(ledger.answers.valid),
            writer.messages.payload.eq(ledger.answers.payload.as_value()),
            ledger.answers.ready.eq(writer.messages.ready),
            ledger.enable.eq(self.enable),
            ledger.error.eq(self.error),
            ledger.stopped.eq(self.stopped),
            self.busy.eq(ledger.busy),
            self.fault.eq(receiver.fault),
        ]

        return m
