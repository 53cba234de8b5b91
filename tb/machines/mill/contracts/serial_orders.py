"""Contract of orders over a serial line: each that was acknowledged is handed on once, as it came.

What lines are, how bytes become them and what the ledger decides is stated by the parts, see
`uart_receiver`, `line`, `hex_reader`, `order_ledger`, `hex_writer` and `uart_transmitter`. Here it
is stated that nothing is lost or made up between them; and, of an order of any number, all the
way from its line to the output.
"""

from collections.abc import Callable
from unittest.mock import patch

from amaranth import Cat, Module, Mux, Value
from amaranth.lib import wiring

from fresa.machines import serial_orders
from fresa.machines.serial_orders import SerialOrders
from fresa.motion import Outcome, RequestKind
from tb.contracts.contract import Case, Component, Contract, Unknown

__all__ = ["SERIAL_ORDERS"]

PARTS = {"receiver": "UARTReceiver", "lines": "LineReader", "reader": "HexReader",
         "writer": "HexWriter", "transmitter": "UARTTransmitter"}
"""What carries lines."""


def describe(c: Contract, dut: SerialOrders) -> None:
    """From the pins to the orders and back."""
    receiver, lines, reader, writer, transmitter = map(c.part, PARTS)
    ledger = c.part("ledger")
    if isinstance(reader, Unknown):
        _let_lines_be_any(c, lines, reader, writer)
    c.invariant("pins", "The receiver is connected to `rx`, and the transmitter to `tx`.",
                (receiver.rx == dut.rx) & (dut.tx == transmitter.tx), cover=~dut.rx)
    for items, first, second in [("Each byte received", "receiver.bytes", "lines.bytes"),
                                ("Each item of a line", "lines.items", "reader.items"),
                                ("Each byte of an answer", "writer.bytes", "transmitter.bytes")]:
        source, sink = (getattr(c.part(path.split(".")[0]), path.split(".")[1])
                        for path in (first, second))
        c.invariant(f"{first.replace('.', '-')}-forwarded",
                    f"{items} goes on to the next part, once and unchanged.",
                    (source.valid == sink.valid) & (source.ready == sink.ready)
                    & (Value.cast(source.payload) == Value.cast(sink.payload)),
                    cover=source.valid & sink.ready)
    _watch_words(c, dut, reader, ledger, writer)
    _watch_an_order(c, dut, reader, ledger)

    ends = reader.items.valid & reader.items.ready & reader.items.p.end
    sent = writer.messages.valid & writer.messages.ready
    owed = c.keep(2, name="answers_owed")
    c.m.d.sync += owed.eq(Mux(c.rst, 0, owed + ends - sent))
    c.invariant("one-answer-per-line", "Every line that ended has one answer, and nothing else "
                "has.",
                owed == reader.messages.valid + ledger.answers.valid, cover=ledger.answers.valid)
    c.implication("ready-until-answer", "Readiness to send an answer lasts until there is "
                  "one, so that it is current when its line begins.",
                  when=c.past(ledger.answers.ready & ~ledger.answers.valid & ~c.rst),
                  then=ledger.answers.ready)
    c.invariant("fault-shows", "An upset of the receiver shows, and nothing else does.",
                dut.fault == receiver.fault, cover=ledger.busy)


def _watch_words(c: Contract, dut: SerialOrders, reader, ledger, writer) -> None:
    """State which digits are which fields."""
    digits, request = reader.messages.p.value, ledger.requests.p.value
    fields = [("y", 4), ("x", 4), ("number", 6), ("session", 8), ("kind", 2)]
    same, place = [], 0
    for name, count in fields:
        same.append(Value.cast(request[name]) == digits[place:place + 4 * count])
        place += 4 * count
    assert place == len(digits)
    c.implication("requests-are-lines", "A request has the fields of its line's digits, and is "
                  "good if the line was correct.", when=ledger.requests.valid,
                  then=Cat(same).all() & (ledger.requests.p.good == reader.messages.p.good)
                  & reader.messages.valid)
    answer, sends = ledger.answers.p, writer.messages
    status = Cat(dut.error, dut.stopped, ~dut.enable, 0)
    c.implication("lines-are-answers", "A line begins with the outcome, the machine state "
                  "now, the session, and the last orders that were taken and done.",
                  when=sends.valid,
                  then=ledger.answers.valid & (sends.payload == Cat(
                      answer.done, answer.taken, answer.session, status, answer.outcome)))


def _watch_an_order(c: Contract, dut: SerialOrders, reader, ledger) -> None:
    """Watch the order of any one number, from its line to where it is handed on."""
    message, answer = reader.messages.p.value, ledger.answers.p
    mine = c.free(24, name="any_number")
    c.assume(~c.past(1) | (mine == c.past(mine)))
    read = reader.messages.valid & reader.messages.ready & ~c.rst
    kind, number = message[88:96], message[32:56]
    order = Cat(message[16:32], message[:16], kind == RequestKind.UP.value,
                kind == RequestKind.DOWN.value)
    acknowledged = c.past(read & (number == mine)) & (answer.outcome == Outcome.TAKEN)

    kept, stored = c.keep(1, name="waits"), c.keep(len(order), name="stored")
    waits, what = kept | acknowledged, Mux(acknowledged, c.past(order), stored)
    offered, payload = dut.orders.valid, Value.cast(dut.orders.payload)
    is_mine = (answer.done + 1)[:24] == mine
    handed = offered & dut.orders.ready
    spent = c.keep(1, name="handed_on")
    c.m.d.sync += [kept.eq(waits & ~(handed & is_mine) & dut.enable & ~c.rst), stored.eq(what),
                   spent.eq((spent & ~acknowledged | handed & is_mine) & ~c.rst)]

    c.implication("forwarded-as-acknowledged", "An order passed on was acknowledged, and is that "
                  "of its line.", when=offered & is_mine, then=waits & (payload == what))
    c.implication("forwarded-once", "An order that was handed on is not handed on again, unless "
                  "one of its number is acknowledged anew.", when=spent & ~acknowledged,
                  then=~waits & ~(offered & is_mine))
    c.implication("acknowledged-offered-in-sequence", "An order that was acknowledged is offered "
                  "when those before it are done.", when=waits & is_mine & dut.enable,
                  then=offered & dut.busy)
    c.implication("forwarded-in-sequence",
                  "After an order the one with the next number is handed on.",
                  when=c.past(handed & dut.enable & ~c.rst),
                  then=answer.done == (c.past(answer.done) + 1)[:24])
    c.implication("damaged-refused", "A damaged line is answered so, and orders nothing.",
                  when=c.past(read & ~reader.messages.p.good),
                  then=(answer.outcome == Outcome.DAMAGED) & ~acknowledged
                  & ((answer.taken == c.past(answer.taken)) | ~c.past(dut.enable)))
    c.implication("disable-clears-queue", "Without `enable`, and after reset, no order is offered "
                  "or waits.",
                  when=c.past(~dut.enable | c.rst), then=~offered & ~dut.busy & ~waits)

    count = (answer.taken - answer.done)[:24]
    inside = (mine - answer.done - 1)[:24] < count
    ring = c.words("ledger.ring")
    word = ring[0]
    for address in range(1, dut.depth):
        word = Mux(mine[:(dut.depth - 1).bit_length()] == address, ring[address], word)
    c.invariant("queue-in-memory", "Queued orders are those taken and not done.",
                (inside == waits) & (count <= dut.depth) & (~waits | (word == what)), cover=waits)


class _Short(SerialOrders):
    """Without what carries lines: they come and go as the contract likes."""

    def elaborate(self, platform) -> Module:
        def instead(real: Callable[..., wiring.Component]) -> Callable[..., Unknown]:
            return lambda **parameters: Unknown(real(**parameters))

        with patch.dict(vars(serial_orders), {
                name: instead(getattr(serial_orders, name)) for name in PARTS.values()}):
            return super().elaborate(platform)


def _let_lines_be_any(c: Contract, lines, reader, writer) -> None:
    """Let parts be what their own contracts state, and anything else."""
    for name in PARTS:
        c.unknown(name)
    # A line that has ended is a message with the next clock; meanwhile nothing is read.
    read = c.keep(1, name="line_is_read")
    ended = lines.items.valid & reader.items.ready & lines.items.p.end
    c.m.d.sync += read.eq((read & ~reader.messages.ready | ended) & ~c.rst)
    c.assume((reader.messages.valid == read) & (reader.items.ready == ~read))
    waits = writer.messages
    c.assume(~c.past(waits.ready & ~waits.valid & ~c.rst) | waits.ready)


def make(*, depth: int, lines: bool = True) -> SerialOrders:
    """Make it, for 9600 baud at 50 MHz, or without what carries lines."""
    return (SerialOrders if lines else _Short)(period=5208, depth=depth)


SERIAL_ORDERS = Component(
    make=make, describe=describe, depth=10,
    cases=(Case({"depth": 2, "lines": False}), Case({"depth": 4, "lines": False}),
           Case({"depth": 2}, real=True)))
