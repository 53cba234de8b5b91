"""Contract of the positioner: what its motors never do, whatever its registers hold.

Commands come as slow as a serial line, too slow to be waited for here. So some properties are about
one clock and the next, and are kept from any values of all registers, also of upset ones; those
about the way of a step from the clock after, since position and target are compared a clock ahead.
The others, about pins for ever, are kept from power-up by a machine without its line: any order
comes in any clock, and any answer and report is sent. That lines are orders is stated by
`uart_receiver`, `line` and `positioner_commands`; that an order moves the motor it names, by
`positioning`; and what is sent, by `reporter`. The widths of STEP, the set-up and hold of DIR, the
rate, and what backlash does to the position, are stated by `axis` at the pins of an axis: the pins
of the machine are these and no other, for each motor.
"""

from amaranth import Array, Cat, Mux, signed

from fresa.machines import Positioner
from fresa.machines.positioner import PositionerTiming
from fresa.protocol.positioner import Answer, Command
from tb.contracts.contract import Case, Component, Contract, Unknown

__all__ = ["POSITIONER"]


def describe(c: Contract, dut: Positioner) -> None:
    """A step leaves a pin only where a movement is ordered, power is on, and no switch is ahead."""
    if isinstance(c.part("commands"), Unknown):
        for path in LINE:
            c.unknown(path)
        _type(c, dut)
        for index, name in enumerate("xyz"):
            with c.each(name):
                _watch_pins(c, dut, index)
        _watch_state(c, dut)
    known = c.past(1)
    orders = c.part("positioning")
    for index, name in enumerate("xyz"):
        axis = c.part(name)
        step, up = dut.step[index], dut.direction[index]
        rises = known & step & ~c.past(step)
        c.implication(f"{name}-moves-by-order", f"STEP of {name} rises only where {name} has a "
                      "movement, and in no reset.", when=rises,
                      then=c.past(dut.moving[index] & ~c.rst), upset=True)
        c.implication(f"{name}-only-connected", f"STEP of {name} rises only while connected.",
                      when=rises,
                      then=c.past(dut.connected), upset=True)
        c.implication(f"{name}-limit-blocks", f"Clockwise no step of {name} is made from "
                      "the clock in which its limit is seen.",
                      when=c.past(dut.limits[index]) & rises, then=~up, upset=True)
        c.implication(f"{name}-direction-toward-target", f"DIR of {name} is that of its target "
                      "two clocks before, when STEP rises.", when=c.past(known) & rises,
                      then=up == c.past(c.past(
                          (~orders.target_n[index]).as_signed() > axis.position)), upset=True)
        change = axis.position - c.past(axis.position)
        c.implication(f"{name}-position-counts-steps", f"The position of {name} changes by one, "
                      "where STEP rises, its way, or is called otherwise by POS, ORIGIN or reset.",
                      when=c.past(known) & (change != 0) & ~c.past(orders.load | c.rst),
                      then=rises & ((change == 1) & up | (change == -1) & ~up), upset=True)
    c.implication("fault-holds", "While a fault shows no step begins.",
                  when=known & c.past(dut.fault), then=(dut.step & ~c.past(dut.step)) == 0,
                  upset=True)
    c.implication("power", "ENABLE follows CONNECT and DISCONNECT: where it comes on, one is "
                  "connected.", when=known & (dut.enable & ~c.past(dut.enable)).any(),
                  then=c.past(dut.connected), upset=True)
    broke = known & c.past(c.part("receiver").line_break)
    c.implication("break-halts", "In the clock after a break of the line was detected no motor "
                                 "has a "
                  "movement.", when=broke, then=dut.moving == 0, upset=True)
    c.implication("break-ends-steps", "No STEP rises two clocks after a break of the line was "
                                      "detected.", when=c.past(broke),
                  then=(dut.step & ~c.past(dut.step)) == 0, upset=True)


def _watch_state(c: Contract, dut: Positioner) -> None:
    """State what is reported of the machine, from power-up on and for ever."""
    state, orders, second = (c.part(path) for path in ("reporter", "positioning", "second"))
    c.invariant("state-is-the-machine", "What is reported is what the machine has: connection, "
                "movements, speeds, limit inputs and positions.",
                (state.connected == dut.connected) & Cat(
                    (getattr(state, f"moving_{number}") == dut.moving[index])
                    & (getattr(state, f"rate_{number}") == orders.rate[index])
                    & (getattr(state, f"limit_{number}") == dut.limits[index])
                    & (getattr(state, f"position_{number}") == c.part(name).position)
                    for index, (number, name) in enumerate(enumerate("xyz", 1))).all(),
                cover=state.moving_1)
    clock = second.modulus
    count = c.keep(range(clock), name="clocks_of_the_second")
    c.m.d.sync += count.eq(Mux(count == clock - 1, 0, count + 1))
    elapsed = c.past(count == clock - 1)
    c.invariant("seconds", "The seconds grow by one each `clock` clocks from power-up, and begin "
                "at 0 with a reset.", state.seconds == Mux(c.past(c.rst), 0, (
                    c.past(state.seconds) + c.past(second.due & c.signal("started")))[:31]),
                cover=state.seconds == 0)
    due = elapsed | ~c.past(1)  # also at power-up, where none has passed
    c.invariant("second", "A second has `clock` clocks.", (second.due == due) & (
        c.signal("second.accumulator") == Mux(due, 0, count - clock))
        & (c.signal("started") == c.past(1)), cover=~second.due)


def _type(c: Contract, dut: Positioner) -> None:
    """Let covers, and they alone, order this: a solver that may choose is lost in it."""
    orders, numbers = c.part("commands").orders, c.part("commands").numbers
    typed = c.keep(range(len(ORDERS) + 1), name="orders_typed")
    c.m.d.sync += typed.eq(typed + (orders.valid & orders.ready))
    reset = c.keep(1, name="was_reset")  # once, when power has come
    c.m.d.sync += reset.eq(reset | c.rst)
    command, motor, clockwise = (Array(order[at] for order in ORDERS)[typed] for at in range(3))
    c.restrict_covers((orders.valid == (typed < len(ORDERS))) & (orders.p.answer == Answer.NONE)
                      & (orders.p.command.as_value() == command) & (orders.p.motor == motor)
                      & (orders.p.clockwise == clockwise) & (orders.p.point == 1)
                      & Cat(number == 5 for number in numbers).all() & (dut.limits == 0)
                      & ~c.part("receiver").line_break & ~dut.fault & ~c.part("reporter").tick
                      & c.part("reporter").answers.ready
                      & (c.rst == (~reset & dut.step.all())))


def _watch_pins(c: Contract, dut: Positioner, index: int) -> None:
    """State what leaves the pins of a motor, from power-up on and for ever."""
    name = "xyz"[index]
    axis, driver, rate = (c.part(path) for path in (name, f"{name}.driver", f"{name}.rate"))
    load, place = c.part("positioning").load, c.part("positioning").place[index]
    step, up = dut.step[index], dut.direction[index]
    rises = step & ~c.past(step)
    c.invariant("pins", "The pins are those of the driver of this axis, and of no other.",
                Cat(step, up, dut.enable[index]) == Cat(
                    driver.step_pin, driver.direction_pin, driver.enable_pin), cover=step)
    sum_before = c.keep(signed(32), name="sum")  # of pulses, and of what the place was called
    total = sum_before + Mux(rises, Mux(up, 1, -1), 0)
    c.m.d.sync += sum_before.eq(Mux(c.rst, 0, Mux(load, place, total)))
    c.invariant("position-is-the-pulses", "The position is for ever the signed number of pulses "
                "at the pins, from where it was called otherwise.",
                (axis.position == total[:32].as_signed())
                & (c.signal(f"{name}.backlash.left") == 0), cover=rises)
    wants, ahead = c.signal(f"{name}.wants"), c.signal(f"{name}.up")
    due = dut.moving[index] & ~load & rate.due & ~dut.fault
    c.implication("waits-for-no-other", "A step that is due, and was wanted by the clock "
                  "before, is made when the driver is ready and its own switch lets it, whatever "
                  "the other axes do.",
                  when=due & wants & driver.ready & ~Mux(ahead, axis.high, axis.low),
                  then=axis.moved)
    c.invariant("compared-before", "A step is wanted where in the clock before there was a "
                "movement, no load and no step, and the position was not the target.",
                wants == c.past(dut.moving[index] & ~dut.fault & ~load & ~axis.moved
                                & ~axis.in_position & ~c.rst), cover=wants)


def make(*, line: bool = True, **timing: int) -> Positioner:
    """Make a machine of its times, or one to which any order comes in any clock."""
    dut = Positioner(timing=PositionerTiming(**timing))
    if not line:
        for name in LINE:
            setattr(dut, f"_{name}", Unknown(getattr(dut, f"_{name}")))
    return dut


LINE = ("receiver", "lines", "commands", "reporter", "transmitter")
"""The parts of its line."""

ORDERS = [(command.value, motor, clockwise) for command, motor, clockwise in (
    (Command.CONNECT, 0, 0), (Command.MOV, 0, 1), (Command.MOV, 1, 1), (Command.MOV, 2, 1),
    (Command.CONNECT, 0, 0), (Command.POS, 0, 0), (Command.MOV, 0, 0), (Command.MOV, 1, 0),
    (Command.MOV, 2, 0), (Command.DISCONNECT, 0, 0))]
"""What covers order: command, motor, and way."""

QUICK = {"clock": 16_000, "baud": 1000, "top_speed": 1500, "width": 2, "low": 2, "setup": 2,
         "hold": 2, "settle": 3, "report": 14_000}

POSITIONER = Component(
    make=make, describe=describe, depth=26,
    cases=(Case({**QUICK, "line": False, "clock": 1600, "baud": 100, "top_speed": 160}),
           Case(QUICK, upset=True)))
