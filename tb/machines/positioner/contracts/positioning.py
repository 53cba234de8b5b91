"""Contract of what the orders of the positioner do."""

from collections.abc import Callable

from amaranth import Cat, Const, Mux

from fresa.motion import positioner as positioning
from fresa.motion.positioner import Positioning
from fresa.protocol.positioner import Answer, Command
from tb.contracts.contract import Bits, Case, Component, Contract

__all__ = ["POSITIONING"]

SHOWN = 4
"""Longest queue of answers that is looked into; a longer one has the same logic."""


def describe(c: Contract, dut: Positioning) -> None:
    """No motor moves without an order, and a refused order changes nothing."""
    order, command = dut.orders.p, dut.orders.p.command
    payload = dut.orders.payload.as_value()
    # A stream keeps what it offers, and the numbers stay with it.
    waited = c.past(dut.orders.valid & ~dut.orders.ready & ~c.rst)
    numbers = Cat(dut.numbers)
    c.assume(~waited | (dut.orders.valid & (payload == c.past(payload))
                        & (numbers == c.past(numbers))))
    c.assume((order.answer.as_value() < Answer.LIMIT_MOT1.value)
             & (command.as_value() < len(Command)))
    c.assume(order.motor < 3)

    stored = c.keep(8, name="points_there")
    moving = (command == Command.MOV) | (command == Command.GOTO)
    wrong = order.answer != Answer.NONE
    apart = ~wrong & moving & ~dut.connected
    empty = ~wrong & ~apart & (command == Command.GOTO) & ~stored.bit_select(order.point, 1)
    refused = wrong | apart | empty
    taken = dut.orders.valid & dut.orders.ready
    obeyed = taken & ~refused & ~c.rst
    point = _points(c, dut, taken & ~refused & (command == Command.P))
    with c.m.If(c.rst):
        c.m.d.sync += stored.eq(0)
    with c.m.Elif(obeyed & (command == Command.P) & (order.point != 0)):
        c.m.d.sync += stored.bit_select(order.point, 1).eq(1)
    c.invariant("points-valid", "The flags are those of the points that were stored.",
                c.signal("points.written") == stored, cover=stored[3])
    _changes(c, dut, obeyed)
    _movements(c, dut, obeyed, point)
    reason = Mux(wrong, order.answer.as_value(), Mux(
        apart, Answer.DISCONNECTED, Answer.EMPTY))
    acknowledges = _acknowledges(c, dut, obeyed)
    asks = ~refused & (command == Command.STATE)
    _answers(c, dut, taken & (refused | asks | acknowledges),
             Mux(refused, reason, Mux(asks, Answer.STATE, Answer.OK)))


def _acknowledges(c: Contract, dut: Positioning, obeyed: Bits) -> Bits:
    """Return whether the order that is offered is acknowledged if it is obeyed."""
    ack, on = dut.orders.p.command == Command.ACK, dut.numbers[2][0]
    since = c.keep(1, name="acknowledges_since")
    with c.m.If(c.rst):
        c.m.d.sync += since.eq(0)
    with c.m.Elif(obeyed & ack):
        c.m.d.sync += since.eq(on)
    c.invariant("acknowledges", "Orders are acknowledged from ACK 1 to ACK 0 or reset.",
                c.signal("acknowledges") == since, cover=since)
    return Mux(ack, on, since)


def _points(c: Contract, dut: Positioning, stores: Bits) -> Bits:
    """Watch what is stored, in each clock at another place; return the point of an order."""
    number, words = dut.orders.p.point, c.words("points.places")
    place = c.keep(len(number), name="watched_point")
    c.m.d.sync += place.eq(place + 1)

    def word_at(address: Bits) -> Bits:
        value = words[0]
        for other in range(1, len(words)):
            value = Mux(address == other, words[other], value)
        return value

    c.invariant("points-stored", "A point is where P stored it last.",
                word_at(c.past(place)) == Mux(
                    c.past(stores & (number == place) & (place != 0)), c.past(Cat(dut.numbers)),
                    c.past(word_at(place))), cover=word_at(place) != 0)
    return word_at(number)


def _orders(c: Contract, dut: Positioning, obeyed: Bits) -> Callable[..., Bits]:
    """Return what says whether an order was obeyed in the clock before."""
    order = dut.orders.p

    def then(*commands: Command, motor: int | None = None) -> Bits:
        of = Cat(order.command == one for one in commands).any()
        return c.past(obeyed & of & (order.motor == motor if motor is not None else 1))

    return then


def _changes(c: Contract, dut: Positioning, obeyed: Bits) -> None:
    """What changes, and by which order."""
    command, then = dut.orders.p.command, _orders(c, dut, obeyed)
    was_reset = c.past(c.rst)
    c.invariant("still-unless-connected", "No motor has a movement while disconnected.",
                dut.connected | ~dut.run.any(), cover=dut.connected & dut.run.all())
    c.implication("connected", "Power changes only by CONNECT, DISCONNECT and reset.",
                  when=dut.connected != c.past(dut.connected),
                  then=Mux(dut.connected, then(Command.CONNECT),
                           then(Command.DISCONNECT) | was_reset))
    c.implication("connect-and-disconnect", "CONNECT gives power, DISCONNECT takes it.",
                  when=then(Command.CONNECT, Command.DISCONNECT),
                  then=dut.connected == then(Command.CONNECT))
    place = Cat(dut.place)
    c.implication("place", "POS sets the position to its numbers, ORIGIN to 0, and nothing else "
                           "does.",
                  when=dut.load, then=obeyed & Mux(
                      command == Command.POS, place == Cat(dut.numbers),
                      (command == Command.ORIGIN) & (place == 0)) | c.rst)
    c.invariant("place-of-pos", "The position to set is 0 except while POS is obeyed.",
                (place == 0) | (command == Command.POS) & (place == Cat(dut.numbers)),
                cover=place != 0)
    c.implication("load-by-order", "POS and ORIGIN are obeyed by a load.",
                  when=obeyed & ((command == Command.POS) | (command == Command.ORIGIN)),
                  then=dut.load)


def _movements(c: Contract, dut: Positioning, obeyed: Bits, point: Bits) -> None:
    """What moves, where to, and how fast."""
    order, then, was_reset = dut.orders.p, _orders(c, dut, obeyed), c.past(c.rst)
    going, halted = c.signal("going"), c.past(dut.halt)
    after_reset = min(positioning.START_SPEED, dut.top_speed)
    for motor in range(3):
        name = f"mot{motor + 1}"
        run, run_before = dut.run[motor], c.past(dut.run[motor])
        target_n, rate, way = dut.target_n[motor], dut.rate[motor], going[motor]
        moved, goes = then(Command.MOV, motor=motor), then(Command.GOTO)
        begins = (moved | goes) & ~halted
        c.implication(f"{name}-moves-by-order", f"Motor {motor + 1} begins to move only by MOV of "
                      "it and by GOTO.", when=run & ~run_before, then=begins)
        c.implication(f"{name}-begins", f"MOV and GOTO do start motor {motor + 1}.",
                      when=begins,
                      then=run)
        c.implication(f"{name}-ends", f"Motor {motor + 1} ends its movement where it arrives or "
                      "is blocked, by STOP, by a halt, and by ORIGIN and POS if it is to a point, "
                      "unless another is ordered.", when=~run & run_before,
                      then=was_reset | halted
                      | c.past(dut.in_position[motor] | dut.limit_hit[motor])
                      | then(Command.STOP, motor=motor) | then(Command.DISCONNECT)
                      | then(Command.ORIGIN, Command.POS) & c.past(way))
        c.implication(f"{name}-ends-by-order", f"No movement of motor {motor + 1} goes on after "
                      "its end.",
                      when=c.past(dut.in_position[motor] | dut.limit_hit[motor])
                      & run_before | then(Command.STOP, motor=motor) | then(Command.DISCONNECT),
                      then=~run | moved | goes)
        there = c.past(point.word_select(motor, 32)).as_signed()
        end = Mux(c.past(order.clockwise), positioning.UP, positioning.DOWN)
        c.invariant(f"{name}-target", f"The target of motor {motor + 1} is a point, by GOTO, or "
                    "an end, by MOV of it, whichever was last.",
                    target_n == Mux(was_reset, 0, Mux(
                        goes, ~there, Mux(moved, ~end, c.past(target_n)))), cover=target_n != 0)
        c.invariant(f"{name}-rate",
                    f"The speed of motor {motor + 1} is that of the last VEL of it.",
                    rate == Mux(was_reset, after_reset, Mux(
                        then(Command.VEL, motor=motor), c.past(dut.numbers[2])[:len(rate)],
                        c.past(rate, init=after_reset))), cover=rate != after_reset)
        c.invariant(f"{name}-going-to-point", f"A movement of motor {motor + 1} is to a point from "
                    "GOTO to the next MOV of it.",
                    way == ~was_reset & (goes | c.past(way) & ~moved),
                    cover=way)
    c.implication("halt-ends-movements", "From the clock after a halt on no motor has a movement.",
                  when=c.past(dut.halt & dut.run.any()), then=~dut.run.any())
    c.implication("origin-ends-going", "ORIGIN and POS end all movements to points.",
                  when=then(Command.ORIGIN, Command.POS) & c.past(going).any(),
                  then=~(dut.run & c.past(going)).any())


def _answers(c: Contract, dut: Positioning, answered: Bits, answer: Bits) -> None:
    """State which orders are answered, and with what."""
    offered, says = dut.answers.valid, dut.answers.payload.as_value()
    limit = (says >= Answer.LIMIT_MOT1.value) & (says <= Answer.LIMIT_MOT3.value)
    kept = c.past(offered & ~dut.answers.ready & ~c.rst)
    c.implication("stable-until-ready", "An answer stays until it is taken.", when=kept,
                  then=offered & (says == c.past(says)))
    c.implication("taken-a-clock-later", "An order is taken in the clock after it was offered, "
                  "however many answers wait.",
                  when=c.past(dut.orders.valid & ~dut.orders.ready & ~c.rst), then=dut.orders.ready)
    c.implication("lookup-first",
                  "No order is taken in the clock in which it is first offered.",
                  when=dut.orders.ready,
                  then=c.past(dut.orders.valid & ~dut.orders.ready))

    # The queue of answers to orders, from the one that is offered next
    pending_limits = c.signal("pending_limits")
    level = c.signal("queue.level")
    free = ~offered | dut.answers.ready
    leaves = free & ~pending_limits.any() & (level != 0)
    joins = answered & ~c.rst & (level != dut.waiting)
    joined = Mux(level == dut.waiting - 1, Answer.OVERFLOW, answer)
    c.implication("queue-level", "Each answer to an order joins the queue unless it is full, each "
                  "that is offered leaves it, and nothing else changes its level.",
                  when=c.past(~c.rst), then=level == c.past(level) + c.past(joins) - c.past(leaves))
    c.implication("queue-is-answered", "While an answer to an order waits and no limit is pending, "
                  "one is offered next.", when=c.past((level != 0) & free & ~pending_limits.any()
                                                  & ~c.rst),
                  then=offered & ~limit)
    c.implication("answers-have-a-cause", "A new answer is to an order or of a limit.",
                  when=offered & ~kept, then=c.past(leaves | pending_limits.any()))
    words, first = c.words("queue.storage"), c.signal("queue.consume")
    c.invariant("queue-is-valid", "The pointers of the queue fit its level, and its entries are "
                "answers to orders.",
                (c.signal("queue.produce") == (first + level) % dut.waiting)
                & (first < dut.waiting) & (level <= dut.waiting)
                & Cat(((address + dut.waiting - first) % dut.waiting >= level)
                      | (word != Answer.NONE) & (word < Answer.LIMIT_MOT1)
                      | (word >= Answer.OVERFLOW) & (word <= Answer.STATE)
                      for address, word in enumerate(words)).all(),
                cover=level == dut.waiting)
    if dut.waiting <= SHOWN:
        _queue(c, dut, words, joins, joined, leaves)
    c.implication("never-none", "No answer is NONE.", when=offered,
                  then=(says != 0) & (says <= Answer.STATE.value))
    struck = dut.run & dut.limit_hit
    for motor in range(3):
        mine = offered & (says == Answer.LIMIT_MOT1.value + motor)
        ended = struck[motor]
        c.implication(f"limit-{motor + 1}-pending", "A switch that ends a movement of motor "
                      f"{motor + 1} raises its pending limit.", when=c.past(ended & ~c.rst),
                      then=pending_limits[motor])
        c.implication(f"limit-{motor + 1}-once", f"A limit of motor {motor + 1} is answered only "
                      "where it ended a movement, and once for that.", when=mine & ~kept,
                      then=c.past(pending_limits[motor]) & (~pending_limits[motor] | c.past(ended)))
        c.implication(f"limit-{motor + 1}-kept", f"A pending limit of motor {motor + 1} "
                      "stays pending until it is answered.",
                      when=c.past(pending_limits[motor] & ~c.rst) & ~pending_limits[motor],
                      then=mine)
        c.implication(f"limit-{motor + 1}-only-by-switch", "No limit of motor "
                      f"{motor + 1} is pending without a cause.", when=pending_limits[motor]
                      & ~c.past(pending_limits[motor]),
                      then=c.past(ended))
    c.implication("buzzer-on-after-limit", "The buzzer is on after a switch ended a movement.",
                  when=c.past(struck.any() & ~c.rst), then=dut.buzzer)
    c.invariant("buzzer-two-ticks", "The buzzer counts two ticks at most.", c.signal("ticks") <= 2,
                cover=c.signal("ticks") == 2)
    c.implication("buzzer-off-at-tick", "The buzzer goes off at a tick or with reset only.",
                  when=c.past(dut.buzzer) & ~dut.buzzer, then=c.past(dut.tick | c.rst))


def _queue(c: Contract, dut: Positioning, words: list[Bits], joins: Bits, joined: Bits,
           leaves: Bits) -> None:
    """State what the entries are, by comparison with a queue that shifts."""
    level, first = c.signal("queue.level"), c.signal("queue.consume")
    queue = [c.keep(4, name=f"answer_{place}") for place in range(dut.waiting)]
    moved = [*queue[1:], Const(0, 4)]
    for place, (at, behind) in enumerate(zip(queue, moved, strict=True)):
        new = joins & (level - leaves == place)
        c.m.d.sync += at.eq(Mux(new, joined, Mux(leaves, behind, at)))
    says = dut.answers.payload.as_value()
    c.implication("answers-in-order", "Orders are answered in their order, each once.",
                  when=c.past(leaves & ~c.rst), then=says == c.past(queue[0]))

    def word_at(place: Bits) -> Bits:
        value = words[0]
        for address in range(1, dut.waiting):
            value = Mux(place == address, words[address], value)
        return value

    c.implication("overflow-when-full", "The last entry of a full queue is OVERFLOW.",
                  when=level == dut.waiting,
                  then=word_at((first + dut.waiting - 1) % dut.waiting) == Answer.OVERFLOW)
    c.invariant("queue-is-stored", "The queue is in its memory.",
                Cat((place >= level) | (word_at((first + place) % dut.waiting) == at)
                    for place, at in enumerate(queue)).all(), cover=level == dut.waiting)


POSITIONING = Component(
    make=Positioning, describe=describe, depth=20,
    cases=(Case({"top_speed": 1500, "waiting": 4}), Case({"top_speed": 1500}, real=True)))
