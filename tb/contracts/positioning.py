"""Contract of what the orders of the positioner do."""

from collections.abc import Callable

from amaranth import Cat, Const, Mux

from fresa.motion import Positioning, points, positioning
from fresa.protocol.positioner import Answer, Command

from .contract import Bits, Bug, Case, Component, Contract

__all__ = ["POSITIONING"]

OBEYED = "self.orders.valid & looked & (refusal == Answer.NONE)"
LEFT = "self.waiting - 1, refusal, Answer.OVERFLOW"
SHOWN = 4
"""Longest queue of reasons that is looked into; a longer one has the same logic."""

MOVES = "self.run & ~self.there & ~stopped"


def describe(c: Contract, dut: Positioning) -> None:
    """Nothing moves that was not ordered, and what is not obeyed changes nothing."""
    order, command = dut.orders.p, dut.orders.p.command
    payload = dut.orders.payload.as_value()
    # A stream keeps what it offers; the numbers stay with it, and only answers are offered.
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
    c.always("knows-its-points", "It knows which points were stored.",
             c.signal("points.there") == stored, seen=stored[3],
             bug=Bug(positioning, "with m.Case(Command.P):",
                     "with m.Case(Command.P, Command.POS):"))
    _changes(c, dut, obeyed)
    _movements(c, dut, obeyed, point)
    _answers(c, dut, taken, refused, Mux(wrong, order.answer.as_value(), Mux(
        apart, Answer.DISCONNECTED, Answer.EMPTY)))


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

    c.always("keeps-its-points", "A point is where P stored it last.",
             word_at(c.past(place)) == Mux(
                 c.past(stores & (number == place) & (place != 0)), c.past(Cat(dut.numbers)),
                 c.past(word_at(place))), seen=word_at(place) != 0,
             bug=(Bug(positioning, "point.eq(number)", "point.eq(number + 1)"),
                  Bug(points, "write.addr.eq(self.number)", "write.addr.eq(self.number | 1)")))
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
    c.always("still-unless-connected", "Nothing moves that is not connected.",
             dut.connected | ~dut.run.any(), seen=dut.connected & dut.run.all(),
             bug=(Bug(positioning, "self.connected.eq(0), self.run.eq(0)", "self.connected.eq(0)"),
                  Bug(positioning, "& ~self.connected", "& 0")))
    c.holds("connected", "Power changes only by CONNECT, DISCONNECT and reset.",
            when=dut.connected != c.past(dut.connected),
            then=Mux(dut.connected, then(Command.CONNECT), then(Command.DISCONNECT) | was_reset),
            bug=Bug(positioning, "Case(Command.CONNECT)", "Case(Command.CONNECT, Command.STOP)"))
    c.holds("obeys", "CONNECT gives power, DISCONNECT takes it.",
            when=then(Command.CONNECT, Command.DISCONNECT),
            then=dut.connected == then(Command.CONNECT),
            bug=Bug(positioning, "self.connected.eq(1)", "self.connected.eq(order.clockwise)"))
    place = Cat(dut.place)
    c.holds("place", "A place is called by POS as it says, by ORIGIN 0, and by nothing else.",
            when=dut.load, then=obeyed & Mux(
                command == Command.POS, place == Cat(dut.numbers),
                (command == Command.ORIGIN) & (place == 0)) | c.rst,
            bug=Bug(positioning, "with m.If(order.command == Command.POS):",
                    "with m.If(order.command != Command.P):"))
    c.always("place-of-pos", "No place is shown but that of POS while it is obeyed.",
             (place == 0) | (command == Command.POS) & (place == Cat(dut.numbers)),
             seen=place != 0,
             bug=Bug(positioning, "with m.If(order.command == Command.POS):",
                     "with m.If(order.command != Command.ORIGIN):"))
    c.holds("loads", "POS and ORIGIN are obeyed by a load.",
            when=obeyed & ((command == Command.POS) | (command == Command.ORIGIN)), then=dut.load,
            bug=Bug(positioning, "self.load.eq(1)", "self.load.eq(order.motor == 0)"))


def _movements(c: Contract, dut: Positioning, obeyed: Bits, point: Bits) -> None:
    """What moves, where to, and how fast."""
    order, then, was_reset = dut.orders.p, _orders(c, dut, obeyed), c.past(c.rst)
    going, halted = c.signal("going"), c.past(dut.halt)
    after_reset = min(positioning.START_SPEED, dut.top_speed)
    for motor in range(3):
        name = f"mot{motor + 1}"
        run, run_before = dut.run[motor], c.past(dut.run[motor])
        target, rate, way = dut.target[motor], dut.rate[motor], going[motor]
        moved, goes = then(Command.MOV, motor=motor), then(Command.GOTO)
        begins = (moved | goes) & ~halted
        c.holds(f"{name}-moves-by-order", f"Motor {motor + 1} begins to move only by MOV of it and "
                "by GOTO.", when=run & ~run_before, then=begins,
                bug=(Bug(positioning, OBEYED, "self.orders.valid & looked"),
                     Bug(positioning, "self.run[motor].eq(1)", "self.run.eq(~0)")))
        c.holds(f"{name}-begins", f"By these motor {motor + 1} does begin to move.", when=begins,
                then=run, bug=(Bug(positioning, "self.run.eq(~0), ", ""),
                               Bug(positioning, "self.run[motor].eq(1), ", "")))
        c.holds(f"{name}-ends", f"Motor {motor + 1} ends its movement where it arrives or is "
                "blocked, by STOP, by a halt, and by ORIGIN and POS if it is to a point, unless "
                "another is ordered.", when=~run & run_before, then=was_reset | halted
                | c.past(dut.there[motor] | dut.blocked[motor])
                | then(Command.STOP, motor=motor) | then(Command.DISCONNECT)
                | then(Command.ORIGIN, Command.POS) & c.past(way),
                bug=(Bug(positioning, "self.run[motor].eq(0)", "self.run.eq(0)"),
                     Bug(positioning, "self.run.eq(left & ~going)", "self.run.eq(0)")))
        c.holds(f"{name}-does-end", f"It does: no movement of motor {motor + 1} goes on that has "
                "come to an end.", when=c.past(dut.there[motor] | dut.blocked[motor])
                & run_before | then(Command.STOP, motor=motor) | then(Command.DISCONNECT),
                then=~run | moved | goes,
                bug=(Bug(positioning, MOVES, "self.run & ~self.there"),
                     Bug(positioning, MOVES, "self.run & ~stopped"),
                     Bug(positioning, "self.run & ~self.there & ~self.blocked", "self.run")))
        c.always(f"{name}-target", f"The target of motor {motor + 1} is a point, by GOTO, or an "
                 "end, by MOV of it, whichever was last.", target == Mux(was_reset, 0, Mux(
                     goes, c.past(point.word_select(motor, 32)).as_signed(), Mux(
                         moved, Mux(c.past(order.clockwise), positioning.UP, positioning.DOWN),
                         c.past(target)))), seen=target != 0,
                 bug=(Bug(positioning, "Mux(order.clockwise, UP, DOWN)",
                          "Mux(order.clockwise, DOWN, UP)"),
                      Bug(positioning, "Cat(self.target).eq(Cat(points.found))",
                          "Cat(self.target).eq(Cat(self.numbers))")))
        c.always(f"{name}-rate", f"The speed of motor {motor + 1} is that of the last VEL of it.",
                 rate == Mux(was_reset, after_reset, Mux(
                     then(Command.VEL, motor=motor), c.past(dut.numbers[2])[:len(rate)],
                     c.past(rate, init=after_reset))), seen=rate != after_reset,
                 bug=(Bug(positioning, "self.rate[motor].eq(self.numbers[-1])",
                          "self.rate[motor].eq(self.numbers[0])"),
                      Bug(positioning, OBEYED, "self.orders.valid & looked")))
        c.always(f"{name}-is-going", f"A movement of motor {motor + 1} is to a point from GOTO to "
                 "the next MOV of it.", way == ~was_reset & (goes | c.past(way) & ~moved),
                 seen=way, bug=(Bug(positioning, "going[motor].eq(0)", "going.eq(0)"),
                                Bug(positioning, "going.eq(~0), ", "")))
    c.holds("halts", "While it is to halt nothing moves from the next clock on.",
            when=c.past(dut.halt & dut.run.any()), then=~dut.run.any(),
            bug=Bug(positioning, "with m.If(self.halt):", "with m.If(self.halt & ~obeyed):"))
    c.holds("origin-ends-going", "ORIGIN and POS end all movements to points.",
            when=then(Command.ORIGIN, Command.POS) & c.past(going).any(),
            then=~(dut.run & c.past(going)).any(),
            bug=Bug(positioning, "self.run.eq(left & ~going)", "self.run.eq(left)"))


def _answers(c: Contract, dut: Positioning, taken: Bits, refused: Bits, reason: Bits) -> None:
    """Who is answered, and what."""
    offered, says = dut.answers.valid, dut.answers.payload.as_value()
    limit = (says >= Answer.LIMIT_MOT1.value) & (says <= Answer.LIMIT_MOT3.value)
    kept = c.past(offered & ~dut.answers.ready & ~c.rst)
    c.holds("stream-keeps", "An answer stays until it is taken.", when=kept,
            then=offered & (says == c.past(says)),
            bug=Bug(positioning, "~self.answers.valid | self.answers.ready", "1"))
    c.holds("taken-a-clock-later", "An order is taken in the clock after it was offered, whatever "
            "waits to be answered.", when=c.past(dut.orders.valid & ~dut.orders.ready & ~c.rst),
            then=dut.orders.ready,
            bug=Bug(positioning, "self.orders.ready.eq(looked)",
                    "self.orders.ready.eq(looked & ~self.answers.valid)"))
    c.holds("looked-at-first", "Not before.", when=dut.orders.ready,
            then=c.past(dut.orders.valid & ~dut.orders.ready),
            bug=Bug(positioning, "self.orders.valid & ~looked)", "self.orders.valid | looked)"))

    # The queue of reasons, from the one that is said next
    hits = c.signal("hits")
    level = c.signal("reasons.level")
    free = ~offered | dut.answers.ready
    told = free & ~hits.any() & (level != 0)
    joins = taken & refused & ~c.rst & (level != dut.waiting)
    said = Mux(level == dut.waiting - 1, Answer.OVERFLOW, reason)
    c.holds("counts-reasons", "Each refusal joins the queue unless it is full, each that is handed "
            "on leaves it, and nothing else changes it.", when=c.past(~c.rst),
            then=level == c.past(level) + c.past(joins) - c.past(told),
            bug=(Bug(positioning, "free & ~hits.any()", "free"),
                 Bug(positioning, "self.orders.valid & looked & (refusal != Answer.NONE)",
                     "self.orders.valid & (refusal != Answer.NONE)")))
    c.holds("reasons-are-said", "While there is a reason and no limit to be told, one is next.",
            when=c.past((level != 0) & free & ~hits.any() & ~c.rst), then=offered & ~limit,
            bug=Bug(positioning, "hits.any() | reasons.r_rdy", "hits.any()"))
    c.holds("answers-have-a-cause", "An answer that is new is that of a refusal, or a limit's.",
            when=offered & ~kept, then=c.past(told | hits.any()),
            bug=Bug(positioning, "hits.any() | reasons.r_rdy", "hits.any() | self.orders.ready"))
    words, first = c.words("reasons.storage"), c.signal("reasons.consume")
    c.always("knows-its-reasons", "The queue is where it says, and has nothing but reasons in it.",
             (c.signal("reasons.produce") == (first + level) % dut.waiting)
             & (first < dut.waiting) & (level <= dut.waiting)
             & Cat(((address + dut.waiting - first) % dut.waiting >= level)
                   | (word != Answer.NONE) & (word < Answer.LIMIT_MOT1)
                   | (word == Answer.OVERFLOW) for address, word in enumerate(words)).all(),
             seen=level == dut.waiting,
             bug=Bug(positioning, LEFT, "self.waiting - 1, refusal, Answer.NONE"))
    if dut.waiting <= SHOWN:
        _queue(c, dut, words, joins, said, told)
    c.holds("never-none", "What is said is something.", when=offered,
            then=(says != 0) & (says <= Answer.OVERFLOW.value),
            bug=Bug(positioning, "hits.any() | reasons.r_rdy", "hits.any() | self.orders.ready"))
    struck = dut.run & dut.blocked
    for motor in range(3):
        mine = offered & (says == Answer.LIMIT_MOT1.value + motor)
        ended = struck[motor]
        c.holds(f"limit-{motor + 1}-is-told", f"A switch that ends a movement of motor {motor + 1} "
                "is told of.", when=c.past(ended & ~c.rst), then=hits[motor],
                bug=Bug(positioning, "hits & ~first, hits) | stopped)",
                        "hits & ~first, hits | stopped))"))
        c.holds(f"limit-{motor + 1}-once", f"A limit of motor {motor + 1} is told only of where it "
                "ended a movement, and once for that.", when=mine & ~kept,
                then=c.past(hits[motor]) & (~hits[motor] | c.past(ended)),
                bug=Bug(positioning, "Mux(free, hits & ~first, hits)", "hits"))
        c.holds(f"limit-{motor + 1}-is-not-lost", f"What is to be told of motor {motor + 1} stays "
                "so until it is being told.", when=c.past(hits[motor] & ~c.rst) & ~hits[motor],
                then=mine, bug=Bug(positioning, "hits & ~first, hits)", "hits & ~first, 0)"))
        c.holds(f"limit-{motor + 1}-has-a-cause", f"Nothing is to be told of motor {motor + 1} "
                "that did not happen.", when=hits[motor] & ~c.past(hits[motor]), then=c.past(ended),
                bug=Bug(positioning, "stopped.eq(self.run & self.blocked)",
                        "stopped.eq(self.blocked)"))
    c.holds("sounds", "The buzzer is on after a switch ended a movement.",
            when=c.past(struck.any() & ~c.rst), then=dut.buzzer,
            bug=Bug(positioning, "ticks.eq(2)", "ticks.eq(0)"))
    c.always("two-ticks", "It waits for two ticks at most.", c.signal("ticks") <= 2,
             seen=c.signal("ticks") == 2,
             bug=Bug(positioning, "ticks.eq(2)", "ticks.eq(3)"))
    c.holds("is-still-again", "It goes off at a tick, and at no other time but reset.",
            when=c.past(dut.buzzer) & ~dut.buzzer, then=c.past(dut.tick | c.rst),
            bug=Bug(positioning, "self.tick & self.buzzer", "self.buzzer"))


def _queue(c: Contract, dut: Positioning, words: list[Bits], joins: Bits, said: Bits,
           told: Bits) -> None:
    """Promise what the reasons are, beside a queue that moves up by itself."""
    level, first = c.signal("reasons.level"), c.signal("reasons.consume")
    queue = [c.keep(4, name=f"reason_{place}") for place in range(dut.waiting)]
    moved = [*queue[1:], Const(0, 4)]
    for place, (at, behind) in enumerate(zip(queue, moved, strict=True)):
        new = joins & (level - told == place)
        c.m.d.sync += at.eq(Mux(new, said, Mux(told, behind, at)))
    says = dut.answers.payload.as_value()
    c.holds("reasons-in-their-order", "Reasons are said in the order of their orders, each once.",
            when=c.past(told & ~c.rst), then=says == c.past(queue[0]),
            bug=(Bug(positioning, "refusal.eq(Answer.EMPTY)", "refusal.eq(Answer.RANGE)"),
                 Bug(positioning, LEFT, "self.waiting - 1, refusal, Answer.LONG"),
                 Bug(positioning, LEFT, "self.waiting - 2, refusal, Answer.OVERFLOW")))

    def word_at(place: Bits) -> Bits:
        value = words[0]
        for address in range(1, dut.waiting):
            value = Mux(place == address, words[address], value)
        return value

    c.holds("full-says-so", "Behind reasons that fill the queue is OVERFLOW.",
            when=level == dut.waiting,
            then=word_at((first + dut.waiting - 1) % dut.waiting) == Answer.OVERFLOW,
            bug=Bug(positioning, LEFT, "self.waiting, refusal, Answer.OVERFLOW"))
    c.always("reasons-are-stored", "The queue is in its memory.",
             Cat((place >= level) | (word_at((first + place) % dut.waiting) == at)
                 for place, at in enumerate(queue)).all(), seen=level == dut.waiting,
             bug=Bug(positioning, LEFT, "self.waiting - 1, refusal, Answer.LONG"))


POSITIONING = Component(
    make=Positioning, describe=describe, depth=20,
    cases=(Case({"top_speed": 1500, "waiting": 4}), Case({"top_speed": 1500}, real=True)))
