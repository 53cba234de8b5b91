# pyright: reportArgumentType=false

"""Contract of `single`: no step but those that were requested, all of them, and in time."""

from typing import cast

from amaranth import Array, Cat, Const, Fragment, Module, Mux
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from fresa.drive import PhaseDriver, RateGenerator
from fresa.machines import Single
from fresa.machines.single import SingleTiming
from fresa.motion import MoveTo, Ramp
from fresa.protocol import (
    LineItem,
    LineReader,
    Received,
    UARTTransmitter,
)
from fresa.protocol.frames import POSITIONS, SPEEDS, Answer
from tb.contracts.contract import Bits, Case, Component, Contract
from tb.contracts.line import LINE
from tb.contracts.phase import PHASE
from tb.contracts.position import POSITION
from tb.contracts.rate import RATE
from tb.contracts.uart_receiver import UART_RECEIVER
from tb.contracts.uart_transmitter import UART_TRANSMITTER

from .frames import FRAMES_INSIDE

__all__ = ["SINGLE"]

PARTS = {"receiver": UART_RECEIVER, "lines": LINE, "commands": FRAMES_INSIDE,
         "transmitter": UART_TRANSMITTER, "rate": RATE, "move": POSITION, "driver": PHASE}
"""Parts that keep their own contracts in the whole machine."""

LONG = 100
"""Clocks of a bit with which that takes too long to prove of all of them together."""


def describe(c: Contract, dut: Single) -> None:
    """Steps and coils; frames and their answers are stated by the interpreter."""
    driver, commands = c.part("driver"), c.part("commands")
    moved, row = driver.moved, c.signal("driver.row")
    target, enable = commands.target, commands.enable
    sequence = driver.sequence
    came, place, at = c.past(row), dut.position, c.part("move").position
    forward, back = (came + 1)[:len(row)], (came - 1)[:len(row)]
    move = c.part("move")
    slows = move.level != 0 if isinstance(move, Ramp) else Const(0)  # also past the set-point
    up = Mux(slows, driver.direction, target > place)

    c.invariant("coils-legal", "A coil word is one of the motor's table, or none.",
                (dut.coils == 0) | Cat(dut.coils == word for word in sequence).any(),
                cover=dut.coils == sequence[1])
    c.implication("off-without-power", "Without power all coils are off with the next clock.",
                  when=c.past(~dut.enable), then=dut.coils == 0)
    c.implication("no-step-without-power", "Without power no step is made, nor requested.",
                  when=~dut.enable, then=~moved & ~dut.moving)
    c.implication("step-toward-set-point", "A step is made only towards the set-point that a "
                  "frame gave, or as the ramp needs it to slow down.", when=moved,
                  then=enable & (slows | (target != place)) & (driver.direction == up))
    c.implication("coils-follow", "The coils go one row on with a step, forward or back, and in "
                  "no other clock.", when=c.past(dut.enable),
                  then=(row == Mux(c.past(moved), Mux(c.past(up), forward, back), came))
                  & (dut.coils == Array(sequence)[row]))
    lines = c.part("lines")
    if isinstance(lines, _Typed):
        item, there = c.free(9, name="typed"), c.free(1, name="there")
        c.m.d.comb += [lines.typed.eq(item), lines.there.eq(there)]
        held = c.past(there & ~lines.items.ready & ~c.rst)
        c.assume(~held | (there & (item == c.past(item))))
        c.restrict_covers(there)
    base = c.keep(len(row), name="row_of_position_0")
    c.invariant("position-is-phase", "The position is that of the coils, for ever: no step is "
                "lost, and none is made that is not counted.",
                (place[:len(row)] + base)[:len(row)] == row, cover=place == 3)
    with c.m.If(c.rst):
        c.m.d.sync += base.eq(row)
    c.implication("reset-moves-nothing", "Reset makes the present position 0, and no step.",
                  when=c.past(c.rst),
                  then=(place == 0) & (target == 0) & (row == came) & ~dut.moving)
    c.invariant("in-range", "Position, set-point and speed are always in range.",
                (at >= 0) & (at < POSITIONS) & (place == at) & (target < POSITIONS)
                & (commands.speed < SPEEDS)
                & (_stands(c, move) >= 0) & (_stands(c, move) < POSITIONS),
                cover=place == 2)
    command, value, answer = (c.signal(f"commands.{name}")
                              for name in ("command", "value", "answer"))
    c.implication("numbers-in-range", "A number that is about to be set is in range.",
                  when=c.state("commands.interpreter_state")("END") & (answer == Answer.OK.value),
                  then=Mux(command == 0, value < POSITIONS, (command != 1) | (
                      (value > 0) & (value < SPEEDS))))
    _watch_times(c, dut)
    if isinstance(lines, LineReader) and c.part("receiver").period < LONG:
        _watch_parts(c)
    c.implication("fault-stops-steps", "While a state register is upset no step is made.",
                  when=dut.fault,
                  then=~moved & ~dut.moving, upset=True)


def _watch_parts(c: Contract) -> None:
    """State what the parts do, and what is in them while it has no effect."""
    for path, part in PARTS.items():
        c.keeps(path, part)
    c.implication("reset-clears", "After reset the place in a text is the first.",
                  when=c.past(c.rst),
                  then=c.signal("commands.texts.place") == 0)
    at_rest = c.state("receiver.receiver_state")("IDLE")
    time, bit = c.signal("receiver.time"), c.part("receiver")
    c.implication("receiver-waits-for-start", "While the line is high the receiver waits where a "
                  "start bit begins.", when=at_rest & c.past(at_rest & bit.rx & ~c.rst),
                  then=time == -(bit.period // 2 + bit.spread))


def _stands(c: Contract, move: MoveTo | Ramp) -> Bits:
    """Where it can stand."""
    if isinstance(move, Ramp):
        return move.position + Mux(c.signal("move.way"), move.level, -move.level)
    return move.position


def _watch_times(c: Contract, dut: Single) -> None:
    """State that a step is made when it is due, and that it is due when the speed says."""
    driver, move, speed = c.part("driver"), c.part("move"), c.part("rate")
    commands = c.part("commands")
    accumulator, rest = c.signal("rate.accumulator"), c.signal("driver.rest")
    highest = min(speed.max_rate, dut.rpm * (SPEEDS - 1))
    rate = move.requested_rate if isinstance(move, Ramp) else speed.rate
    c.invariant("due-by-the-speed", "What makes a step due is the speed that a frame gave.",
                rate == (commands.speed * dut.rpm)[:len(rate)],
                cover=dut.position == 1)
    settled = c.keep(1, name="settled")  # since power came
    with c.m.If(~driver.enable):
        c.m.d.sync += settled.eq(0)
    with c.m.Elif(rest >= 0):
        c.m.d.sync += settled.eq(1)
    if isinstance(move, MoveTo) and driver.period > 1:
        c.implication("compared-ahead", "Where a step is due, the comparison of the clock before "
                      "still holds: none was made in that.", when=speed.due,
                      then=c.signal("wanted") == (move.position != commands.target))
    c.implication("in-time", "A step that is due is made at once, unless power has only just "
                  "come: what is on the line delays none.",
                  when=move.step & speed.due & settled & ~c.rst, then=driver.moved)
    c.implication("not-before", "No step is made that is not due.",
                  when=driver.moved, then=speed.due)
    c.invariant("ready-before-due", "The motor is ready before the next step can be due.",
                (accumulator < highest) & (~settled | (rest >= 0)
                | (accumulator < (rest + driver.period + 1) * highest - speed.modulus)),
                cover=settled & (rest < 0) if driver.period > 1 else settled)


class _Typed(wiring.Component):
    """In place of lines: any frames."""

    def __init__(self) -> None:
        super().__init__({"bytes": In(stream.Signature(Received)),
                          "items": Out(stream.Signature(LineItem)),
                          "typed": In(LineItem), "there": In(1)})

    def elaborate(self, platform) -> Module:
        m = Module()
        m.d.comb += [self.bytes.ready.eq(1), self.items.payload.eq(self.typed),
                     self.items.valid.eq(self.there)]
        return m


class _Printed(wiring.Component):
    """In place of the transmitter: a line that takes everything at once."""

    def __init__(self) -> None:
        super().__init__({"bytes": In(stream.Signature(8)), "tx": Out(1)})

    def elaborate(self, platform) -> Module:
        m = Module()
        m.d.comb += [self.bytes.ready.eq(1), self.tx.eq(1)]
        return m


def make(*, terminal: bool = True, short: bool = False, unipolar: bool = False,
         full_step: bool = False, ramp: int = 0) -> Single:
    """Make a machine; one without a terminal has frames of which each byte comes in a clock."""
    if short:
        return Single(timing=SingleTiming.real(clock=48_000, baud=3000), greeting=b"g",
                      help_text=b"h")
    if terminal:
        return Single(unipolar=unipolar, full_step=full_step, ramp=ramp)
    dut = Single(timing=SingleTiming(bit=16, modulus=SPEEDS), greeting=b"g", help_text=b"h",
                 unipolar=unipolar, full_step=full_step)
    for part in (dut._lines, dut._transmitter, dut._rate, dut._driver, dut._move):
        Fragment.get(part, None)  # else Amaranth says that they were made for nothing
    dut._rate = RateGenerator(modulus=256, max_rate=128)  # at 100 rpm a step takes three clocks
    if ramp:
        dut._move = Ramp(rates=(64, 100, 119), max_rate=SPEEDS - 1, width=dut._move.width)
    dut._driver = PhaseDriver(sequence=dut._driver.sequence, period=2)
    dut._lines, dut._transmitter = cast(LineReader, _Typed()), cast(UARTTransmitter, _Printed())
    return dut


SINGLE = Component(
    make=make, describe=describe, depth=22,
    cases=(Case({"terminal": False}), Case({"terminal": False, "full_step": True}),
           Case({"terminal": False, "ramp": 1}),
           Case({"terminal": True, "short": True}, real=True),
           Case({"terminal": True}, real=True),
           Case({"terminal": True, "unipolar": True, "full_step": True}, real=True),
           Case({"terminal": True, "ramp": 1000}, real=True),
           Case({"terminal": False}, upset=True)))
