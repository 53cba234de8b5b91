"""Contract of the commands of the positioner: each line is one order, or one refusal."""

from amaranth import Array, Cat, Mux, Value

from fresa.protocol import LineEnd
from fresa.protocol.positioner import (
    ARGUMENTS,
    POINTS,
    Answer,
    Command,
    Kind,
    PositionerCommands,
)
from tb.contracts.contract import Bits, Case, Component, Contract

from .read import watch_read

__all__ = ["POSITIONER_COMMANDS"]

STALL = 3
"""Most clocks in which nothing of a line is taken that waits, and no order is offered."""

TYPED = (
    *((line, LineEnd.GOOD) for line in (
        b"", b"P", b"P ", b"GOTO", b"GOTO 7", b"GOTO 8", b"MOV", b"POS", b"VEL", b"STOP", b"MOT")),
    (b"", LineEnd.LONG), (b"ORIGIN", LineEnd.DAMAGED),
    *((line, LineEnd.GOOD) for line in (
        b"ORIGIN", b"ORIGIN ", b"STOP X", b"STOP MOT4", b"STOP MOT1", b"CONNECT", b"CONNECT ",
        b"P 1 2 3 4", b"POS 1 2 3", b"MOV MOT1 C", b"VEL MOT1 0", b"VEL MOT1 9", b"DISCONNECT",
        b"DISCONNECT ", b"ACK 1", b"ACK 2", b"STATE", b"")))
"""What covers type. All lines are short; what mutants make of them shows early."""


def describe(c: Contract, dut: PositionerCommands) -> None:
    """What is offered is what was read, and is in its range."""
    items, order = dut.items, dut.orders.p
    answer = order.answer.as_value()
    offered, payload = dut.orders.valid, dut.orders.payload.as_value()
    taken, said = items.valid & items.ready, offered & dut.orders.ready
    state = c.state("commands_state")
    _type(c, dut, taken)
    # A stream keeps what it offers.
    left = items.valid & ~items.ready & ~c.rst
    item = items.payload.as_value()
    held, was = c.past(left), c.past(item)
    c.assume(~held | (items.valid & (item == was)))
    c.implication("end-skipped-last", "Of a line that is right only the end is left, and is "
                  "taken.", when=state("SKIP") & (order.answer == Answer.NONE), then=held & was[8])
    ended = taken & items.p.end
    fine = offered & (order.answer == Answer.NONE)

    waiting = c.keep(1, name="line_has_ended")
    c.m.d.sync += waiting.eq((waiting | ended) & ~said & ~c.rst)
    c.invariant("one-order-a-line", "An order is offered from the clock after a line has ended "
                "until it is taken, and at no other time.", offered == waiting, cover=offered)
    c.implication("one-at-a-time", "While an order is offered nothing is read.", when=offered,
                  then=~items.ready)
    c.implication("stable-until-ready", "An order stays until it is taken, and its numbers "
                  "with it.",
                  when=c.past(offered & ~dut.orders.ready & ~c.rst),
                  then=offered & (payload == c.past(payload))
                  & (Cat(dut.numbers) == c.past(Cat(dut.numbers))))

    # How it ended
    last = c.keep(8, name="last_end")
    with c.m.If(ended):
        c.m.d.sync += last.eq(items.p.byte)
    for name, when, then in [
        ("long", last == LineEnd.LONG, Answer.LONG),
        ("damaged", (last != LineEnd.LONG) & (last != LineEnd.GOOD), Answer.DAMAGED),
    ]:
        c.implication(f"error-{name}", f"A line that is {name} is refused with that reason.",
                      when=offered & when, then=answer == then)
    c.implication("good-lines-only", "Only a line that ended well is an order.", when=fine,
                  then=last == LineEnd.GOOD)
    c.invariant("reason-in-range", "A refusal has a reason that a line can have.",
                answer <= Answer.RANGE.value, cover=answer == Answer.RANGE.value)

    # What it holds
    spaces = c.keep(3, name="spaces")
    bytes_read = c.keep(1, name="has_bytes")
    with c.m.If(c.rst | said):
        c.m.d.sync += [spaces.eq(0), bytes_read.eq(0)]
    with c.m.Elif(taken & ~items.p.end):
        c.m.d.sync += [bytes_read.eq(1), spaces.eq(spaces + (
            (items.p.byte == ord(" ")) & (spaces != 7)))]
    takes = Array(len(ARGUMENTS.get(one, ())) for one in Command)
    c.implication("is-complete", "An order has as many spaces as its command has arguments, one "
                  "before each.", when=fine, then=spaces == takes[order.command.as_value()])
    c.invariant("empty-line-refused", "An empty line is no order.", Mux(
                   state("COMMAND"), bytes_read | (c.signal("words.place") == 0),
                   bytes_read | (answer != Answer.NONE.value)), cover=offered & ~bytes_read)
    _ranges(c, dut, fine, state, takes, spaces)
    _inside(c, dut, state, taken)
    watch_read(c, dut)
    c.leaves_unused_codes(
        "commands_state", fault=dut.fault, shows=~offered & ~items.ready)


def _type(c: Contract, dut: PositionerCommands, taken: Bits) -> None:
    """Let covers type certain lines without a pause: a solver that may choose is lost in them."""
    items = Array([item for line, end in TYPED for item in (*line, end.value | 0x100)])
    count = c.keep(range(len(items) + 1), name="items_typed")
    c.m.d.sync += count.eq(count + (taken & (count < len(items))))
    c.restrict_covers((~c.rst | dut.fault) & dut.items.valid & (count < len(items))
                      & (dut.items.payload.as_value() == items[count])
                      & (dut.orders.ready == c.past(dut.orders.valid)))


def _ranges(c: Contract, dut: PositionerCommands, fine: Bits, state, takes, spaces: Bits) -> None:
    """State that every order can be carried out, whatever its line holds."""
    order, command = dut.orders.p, dut.orders.p.command
    place = c.signal("place")
    good = order.answer == Answer.NONE
    # After its first word: what follows is behind `place`.
    inside = ~state("COMMAND", "FAULT")

    def read(*kinds: Kind) -> Bits:
        """Return whether something of this kind was read already."""
        found = Value.cast(0)
        for one, following in ARGUMENTS.items():
            for at, kind in enumerate(following):
                if kind in kinds:
                    found = found | (command == one) & (place > at)
        return found & good & inside

    speed = dut.numbers[2]
    for name, says, kinds, within in [
        ("motor", "A motor is one of three.", (Kind.MOTOR,), order.motor < 3),
        ("point", "A point is one of seven.", (Kind.POINT,), order.point != 0),
        ("speed", "A speed is from 1 to the highest.", (Kind.RATE,),
         (speed >= 1) & (speed <= dut.top_speed)),
        ("flag", "What follows ACK is 0 or 1.", (Kind.FLAG,), (speed == 0) | (speed == 1)),
    ]:
        c.implication(f"{name}-in-range", says, when=read(*kinds), then=within)
    c.implication("command-in-range", "A command is one of those that there are.", when=fine,
                  then=command.as_value() < len(Command))
    needed = takes[command.as_value()]
    c.invariant("place-counted", "The place is the number of arguments that were read.",
                Mux(state("COMMAND"), (place == 0) & good & (spaces == 0),
                    Mux(state("SEPARATE"), good & (spaces == place) & (place <= needed),
                        Mux(state("WORD", "DIGIT", "NUMBER"),
                            good & (spaces == place + 1) & (place < needed),
                            ~state("SKIP", "OFFER") | ~good
                            | (place == needed) & (spaces == place))))
                & (~inside | ~good | (command.as_value() < len(Command))),
                cover=place == 4)
    assert POINTS == 7


def _inside(c: Contract, dut: PositionerCommands, state, taken: Bits) -> None:
    """State that the readers read in their states only, so that none waits for ever."""
    word, number = c.signal("words.words__valid"), c.signal("number.numbers__valid")
    kind = c.signal("kind")
    letters, digits = c.signal("words.place"), c.signal("number.begun")
    c.invariant("readers-in-their-states", "A reader holds something only in its state.",
                (state("COMMAND", "WORD") | (~word & (letters == 0)
                                             & c.signal("words.alive").all()))
                & (state("NUMBER") | (~number & ~digits & ~c.signal("number.digits")
                                      & ~c.signal("number.overflow"))),
                cover=word | number)
    c.invariant("kinds-in-their-states", "A state reads what comes next.",
                (~state("WORD") | (kind == Kind.MOTOR) | (kind == Kind.WAY))
                & (~state("DIGIT") | (kind == Kind.MOTOR))
                & (~state("NUMBER") | (kind == Kind.POINT) | (kind == Kind.RATE)
                   | (kind == Kind.NUMBER) | (kind == Kind.FLAG)), cover=state("DIGIT"))
    idle = c.keep(range(STALL + 2), name="idle")
    c.m.d.sync += idle.eq(Mux(taken | dut.orders.valid | ~dut.items.valid | c.rst, 0,
                              idle + (idle <= STALL)))
    c.invariant("progress", f"Of a line that waits something is taken at least every {STALL + 1} "
                "clocks, until its order is offered.", idle <= STALL, cover=idle == 2)
    reading = state("COMMAND", "WORD", "NUMBER")
    c.invariant("progress-in-each-state", "Each state takes something, or leaves, in its time.",
                idle <= Mux(reading, word | number, Mux(state("SEPARATE", "DIGIT"), 2, STALL)),
                cover=idle == 1)


POSITIONER_COMMANDS = Component(
    make=PositionerCommands, describe=describe, depth=388,
    cases=(Case({"top_speed": 9}), Case({"top_speed": 1500}, real=True),
           Case({"top_speed": 9}, upset=True)))
