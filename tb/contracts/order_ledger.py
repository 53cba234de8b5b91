"""Contract of the ledger of orders: each once, in its turn, and only of a line that was right."""

from amaranth import Cat, Mux

from fresa.motion import Order, OrderLedger, Outcome, RequestKind

from .contract import Bits, Case, Component, Contract

__all__ = ["ORDER_LEDGER"]


def describe(c: Contract, dut: OrderLedger) -> None:
    """A reference queue holds the orders taken, by rules that are stated independently."""
    request, good = dut.requests.p.value, dut.requests.p.good
    given = dut.requests.valid & dut.requests.ready
    offered, payload = dut.orders.valid, dut.orders.payload.as_value()
    carried_out = offered & dut.orders.ready
    # The receiver of answers stays ready until there is one.
    c.assume(~c.past(dut.answers.ready & ~dut.answers.valid & ~c.rst) | dut.answers.ready)

    session = c.keep(32, name="open_session")
    taken, done = c.keep(24, name="last_taken"), c.keep(24, name="last_done")
    count = c.keep(range(dut.depth + 1), name="waiting")
    queue = [c.keep(Order.as_shape().size, name=f"waits_{place}") for place in range(dut.depth)]

    kind = request.kind
    is_order = good & Cat(kind == one for one in (RequestKind.GO, RequestKind.UP,
                                                  RequestKind.DOWN)).any()
    ours = is_order & dut.enable & (session != 0) & (request.session == session)
    is_next = request.number == (taken + 1)[:24]
    takes = given & ours & is_next & (count < dut.depth)
    opens = (given & good & (kind == RequestKind.OPEN) & dut.enable & (count == 0)
             & (request.session != session))
    order = Cat(request.x, request.y, kind == RequestKind.UP, kind == RequestKind.DOWN)

    with c.m.If(c.rst | ~dut.enable):
        c.m.d.sync += [session.eq(0), taken.eq(0), done.eq(0), count.eq(0)]
    with c.m.Else():
        left = count - carried_out
        c.m.d.sync += count.eq(left + takes)
        with c.m.If(carried_out):
            c.m.d.sync += done.eq(done + 1)
        with c.m.If(takes):
            c.m.d.sync += taken.eq(taken + 1)
        with c.m.If(opens):
            c.m.d.sync += [session.eq(request.session), taken.eq(request.number),
                           done.eq(request.number)]
        for place, at in enumerate(queue):
            behind = queue[place + 1] if place + 1 < dut.depth else at
            c.m.d.sync += at.eq(Mux(takes & (left == place), order,
                                    Mux(carried_out, behind, at)))

    _watch_orders(c, dut, offered, payload, queue[0], count)
    _watch_requests(c, dut, given, opens, takes, taken, done)
    _watch_answers(c, dut, given, session, taken, done, count, ours, is_order, is_next)

    ring = c.words("ring")
    place = done[:(dut.depth - 1).bit_length()]

    def word_at(number: Bits) -> Bits:
        word = ring[0]
        for address in range(1, dut.depth):
            word = Mux(number[:len(place)] == address, ring[address], word)
        return word

    c.invariant("queue-in-memory", "Queued orders are at their addresses.",
                ((taken - done)[:24] == count) & (count <= dut.depth)
                & Cat((number >= count) | (word_at(place + 1 + number) == at)
                      for number, at in enumerate(queue)).all(),
                cover=count == dut.depth)
    c.invariant("registers-of-requests", "Session and numbers are those of accepted requests.",
                (c.signal("session") == session) & (c.signal("taken") == taken)
                & (c.signal("done") == done), cover=(done != taken) & (session != 0))


def _watch_orders(c: Contract, dut: OrderLedger, offered: Bits, payload: Bits, first: Bits,
                  count: Bits) -> None:
    """State what the machine is offered."""
    c.invariant("offered-while-queued", "While orders wait the first is offered, and else none.",
                offered == ((count != 0) & dut.enable), cover=offered)
    c.implication("offered-in-sequence", "The offered order is the oldest that was accepted.",
                  when=offered, then=payload == first)
    c.implication("stable-until-ready", "An order that is offered stays, unchanged, until it is "
                  "taken.",
                  when=c.past(offered & ~dut.orders.ready & ~c.rst & dut.enable) & dut.enable,
                  then=offered & (payload == c.past(payload)))
    c.invariant("busy", "It is busy while an order waits.", dut.busy == (count != 0),
                cover=dut.busy)
    c.implication("disable-clears-queue", "Without `enable`, and after reset, no order waits.",
                  when=c.past(c.rst | ~dut.enable), then=~offered & ~dut.busy
                  & (c.signal("session") == 0))


def _watch_requests(c: Contract, dut: OrderLedger, given: Bits, opens: Bits, takes: Bits,
                    taken: Bits, done: Bits) -> None:
    """State which requests change something."""
    request, good = dut.requests.p.value, dut.requests.p.good
    is_open = request.kind == RequestKind.OPEN
    went_on = ~c.rst & dut.enable
    numbers = Cat(c.signal("session"), c.signal("taken"))
    same = numbers == c.past(numbers)
    c.implication("damaged-ignored", "A damaged line changes nothing.",
                  when=c.past(given & ~good & went_on), then=same)
    c.implication("repeat-ignored", "The last order, repeated, changes nothing.",
                  when=c.past(given & went_on & ~is_open & (request.number == taken)), then=same)
    c.implication("accepts-next-only", "An order is taken if it is the next of this session, "
                  "and else not.", when=c.past(given & went_on & ~is_open),
                  then=c.signal("taken") == c.past((taken + takes)[:24]))
    c.implication("session-opens", "A session that may be opened is, and the next order has the "
                  "number after its number.", when=c.past(opens & ~c.rst),
                  then=(numbers == c.past(Cat(request.session, request.number))) & ~dut.busy)
    c.implication("no-other-session-opens", "A request to open the open session changes nothing, "
                  "nor any while orders wait.",
                  when=c.past(given & is_open & ~opens & went_on), then=same)
    c.implication("no-change-without-request", "Without a request nothing is opened or taken.",
                  when=c.past(~given & went_on), then=same)
    c.implication("done-counted", "An order that the machine took counts as done.",
                  when=c.past(dut.orders.valid & dut.orders.ready & went_on),
                  then=c.signal("done") == c.past((done + 1)[:24]))


def _watch_answers(c: Contract, dut: OrderLedger, given: Bits, session: Bits, taken: Bits,
                   done: Bits, count: Bits, ours: Bits, is_order: Bits, is_next: Bits) -> None:
    """State the answers to requests."""
    request, good, answer = dut.requests.p.value, dut.requests.p.good, dut.answers.p
    answers, kind = dut.answers.valid, request.kind
    c.implication("answers-every-request", "A request is answered with the next clock.",
                  when=c.past(given & ~c.rst), then=answers)
    c.implication("answers-only-requests", "A request is answered once, and nothing else is.",
                  when=answers,
                  then=c.past(given & ~c.rst))
    c.invariant("one-at-a-time", "A request is taken when its answer can go.",
                dut.requests.ready == (dut.answers.ready & ~answers), cover=given)
    c.implication("answer-is-current", "An answer holds the session, the orders taken and done, "
                  "and the state of the machine.", when=answers,
                  then=(answer.session == session) & (answer.taken == taken)
                  & (answer.done == done) & (answer.error == dut.error)
                  & (answer.stopped == dut.stopped) & (answer.manual == ~dut.enable)
                  & (answer.reserved == 0))
    is_open = good & (kind == RequestKind.OPEN)
    for name, outcome, condition, when in [
        ("damaged", Outcome.DAMAGED, "the line was damaged", ~good),
        ("reported", Outcome.REPORTED, "the request is a query",
         good & (kind == RequestKind.QUERY)),
        ("manual", Outcome.MANUAL, "a session is requested in manual mode", is_open & ~dut.enable),
        ("busy", Outcome.BUSY, "orders of another session wait",
         is_open & dut.enable & (request.session != session) & (count != 0)),
        ("opened", Outcome.OPENED, "the session is open now",
         is_open & dut.enable & ((request.session == session) | (count == 0))),
        ("closed", Outcome.CLOSED, "the session of an order is not open", is_order & ~ours),
        ("again", Outcome.AGAIN, "the order was the last", ours & (request.number == taken)),
        ("unexpected", Outcome.UNEXPECTED, "the order has another number",
         ours & (request.number != taken) & ~is_next),
        ("full", Outcome.FULL, "the queue is full", ours & is_next & (count == dut.depth)),
        ("taken", Outcome.TAKEN, "the order is taken", ours & is_next & (count < dut.depth)),
        ("unknown", Outcome.UNKNOWN, "the request is unknown",
         good & (kind.as_value() > RequestKind.DOWN.value)),
    ]:
        c.implication(f"outcome-{name}", f"The outcome is {outcome.name} if and only if "
                      f"{condition}.",
                      when=answers & (c.past(when) | (answer.outcome == outcome)),
                      then=c.past(when) & (answer.outcome == outcome))


ORDER_LEDGER = Component(
    make=OrderLedger, describe=describe, depth=8,
    cases=(Case({"depth": 2}), Case({"depth": 4}), Case({"depth": 16}, real=True)))
