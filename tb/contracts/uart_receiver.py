"""Contract of the receiver of a serial line."""

from amaranth import Cat, Const, Mux

from fresa.protocol import UARTReceiver

from .contract import Bits, Case, Component, Contract

__all__ = ["UART_RECEIVER"]

LINE = (
    "11" "0" "10101100" "1"  # 35h
    "0" "01011010" "0000000000000" "1"  # 5Ah without its stop bit, and a break
    "0" "00000000" "000" "1"  # another, of which the byte is lost
    "0" "10000011" "1" "1"  # C1h after it
)
"""The line of the covers: its levels, each for a bit."""


def describe(c: Contract, dut: UARTReceiver) -> None:
    """What a sender within 2 % puts on the line is received, and errors in it are reported."""
    state, time, word = c.state("receiver_state"), c.signal("time"), c.signal("word")
    period, first = dut.period, dut.period // 2 + dut.spread
    payload = dut.bytes.payload.as_value()
    ended = state("STOP") & (time == 0)
    stop = _majority(c, dut, time)

    taken = c.keep(range(9), name="taken")  # data bits of this byte
    with c.m.If(c.rst | state("START")):
        c.m.d.sync += taken.eq(0)
    with c.m.Elif(state("DATA") & (time == 0)):
        c.m.d.sync += taken.eq(taken + 1)
    missing = c.keep(1, name="missing")  # a byte since the last that was handed on
    with c.m.If(c.rst | ended):
        c.m.d.sync += missing.eq(dut.overrun & ~c.rst)

    bits = {"agreed": period, "slow": period * 51 // 50, "fast": -(-period * 49 // 50)}
    any_byte = c.free(8, name="any_byte")
    for name, bit in bits.items():
        if name == "agreed" or bit != period:
            _watch_sender(c, dut, name, bit, any_byte, taken, ended)
    c.restrict_covers(_usual_line(c, dut, period) & (any_byte == 0x35))

    c.implication("samples-in-time", "The time to the last sample of a bit is counted from the "
                  "start bit's edge.", when=state("START", "DATA", "STOP"),
                  then=(time <= 0) & Mux(state("START"), time > -first, time > -period)
                  & (~state("STOP") | (taken == 8)) & (~state("DATA") | (taken < 8))
                  & (~state("DATA", "STOP") | ((word
                                                & (Const(0xFF) >> taken)) == Const(0x80) >> taken)))
    c.implication("false-start", "A start bit that is 1 in its middle is none.",
                  when=c.past(state("START") & (time == 0) & stop & ~c.rst), then=state("IDLE"))
    high = c.keep(range(2 * dut.spread + 1), name="high")  # clocks for which the line has been
    settled = dut.rx & (high == 2 * dut.spread)
    with c.m.If(c.rst | ~state("LOW") | ~dut.rx | settled):
        c.m.d.sync += high.eq(0)
    with c.m.Else():
        c.m.d.sync += high.eq(high + 1)
    c.implication("waits-for-high", "After reset and after a missing stop bit the line must be "
                  "high for longer than a disturbance.", when=c.past(state("LOW") & ~settled),
                  then=state("LOW"))
    c.implication("next-byte-after-high", "After that time the next byte is awaited.",
                  when=c.past(state("LOW") & settled & ~c.rst), then=state("IDLE"))
    c.invariant("high-is-counted", "The time is counted from where the line is high.",
                Mux(state("LOW"), time + 2 * dut.spread == high, high == 0), cover=high == 1)
    c.implication("no-stop-bit", "A missing stop bit shows at once.",
                  when=ended & ~stop, then=dut.framing)
    c.implication("stop-bit", "No framing error shows otherwise.", when=~ended | stop,
                  then=~dut.framing)
    c.implication("next-at-once", "After a stop bit the next byte is awaited at once.",
                  when=c.past(ended & stop & ~c.rst), then=state("IDLE"))
    c.implication("no-stop-bit-waits-for-high", "After a missing stop bit the line must be high "
                  "first.",
                  when=c.past(ended & ~stop), then=state("LOW"))
    c.implication("overrun", "A byte is lost where the one before waits, and shows at once.",
                  when=ended | dut.overrun,
                  then=dut.overrun == (ended & dut.bytes.valid & ~dut.bytes.ready))
    c.implication("byte-offered", "A complete byte is offered with the next clock.",
                  when=c.past(ended & ~c.rst), then=dut.bytes.valid)
    c.implication("no-other-byte", "No other byte is offered.",
                  when=dut.bytes.valid & ~c.past(dut.bytes.valid & ~dut.bytes.ready),
                  then=c.past(ended))
    c.implication("error-marked", "A byte without a stop bit, or after a lost one, is marked.",
                  when=c.past(ended & (~stop | missing) & ~dut.overrun & ~c.rst),
                  then=dut.bytes.p.error)
    c.implication("error-not-marked", "No other byte is marked.",
                  when=c.past(ended & stop & ~missing & ~dut.overrun & ~c.rst),
                  then=~dut.bytes.p.error)
    c.invariant("loss-remembered", "The register `lost` is 1 after a lost byte.",
                c.signal("lost") == missing, cover=missing)
    c.implication("stable-until-ready", "A byte that is offered stays until it is taken.",
                  when=c.past(dut.bytes.valid & ~dut.bytes.ready & ~c.rst),
                  then=dut.bytes.valid & (payload == c.past(payload)))
    low = c.keep(range(10 * period), name="low")  # clocks for which it has been, in this state
    longest = low == 10 * period - 1
    with c.m.If(c.rst | ~state("LOW") | settled):
        c.m.d.sync += low.eq(0)
    with c.m.Elif(~dut.rx & ~longest):
        c.m.d.sync += low.eq(low + 1)
    c.invariant("low-is-counted", "The clocks are counted in which the line is low and should be "
                "high.",
                c.signal("low") == low, cover=longest)
    zeros = ended & ~stop & (word == 0)
    again = state("LOW") & ~dut.rx & longest
    c.implication("break-in-a-byte", "A line that is low for ten bits more, after any bits, is a "
                  "break.", when=c.past(again & ~c.rst), then=dut.line_break)
    c.implication("break-shows", "A line that is low for a byte and its stop bit is a break.",
                  when=c.past(zeros & ~c.rst), then=dut.line_break)
    c.implication("break-ends", "A break ends when the line has been high for long enough.",
                  when=c.past(state("LOW") & settled), then=~dut.line_break)
    c.implication("break-lasts", "Until then a break shows, despite disturbances.",
                  when=c.past(dut.line_break & ~settled & ~c.rst), then=dut.line_break)
    c.implication("no-byte-in-break", "In a break no byte is awaited.", when=dut.line_break,
                  then=state("LOW"))
    c.implication("no-other-break", "Nothing else is a break.", when=dut.line_break,
                  then=c.past(zeros | again | dut.line_break))
    c.implication("reset-restarts", "After reset no byte is offered, and the line must be high "
                  "first.", when=c.past(c.rst),
                  then=state("LOW") & ~dut.bytes.valid & ~dut.line_break)
    c.leaves_unused_codes("receiver_state", fault=dut.fault, shows=~dut.framing & ~dut.overrun)


def _majority(c: Contract, dut: UARTReceiver, time: Bits) -> Bits:
    """Return the majority of three samples of a bit, in the clock of the last."""
    seen = c.keep(2, name="seen")
    for number, when in enumerate([-2 * dut.spread, -dut.spread]):
        with c.m.If(time == when):
            c.m.d.sync += seen[number].eq(dut.rx)
    looks = c.signal("looks")
    known = c.state("receiver_state")("START", "DATA", "STOP") & (time > -2 * dut.spread)
    c.implication("samples-are-the-line", "The samples of a bit are levels of the line.",
                  when=known, then=Mux(time > -dut.spread, looks == Cat(seen[1], seen[0]),
                                       looks[0] == seen[0]))
    return seen[0] + seen[1] + dut.rx >= 2


def _usual_line(c: Contract, dut: UARTReceiver, period: int) -> Bits:
    """Return the one line that covers have, disturbed before its first byte and in each bit."""
    place = c.keep(range(len(LINE)), name="place")
    clock = c.keep(range(period), name="clock")
    c.m.d.sync += clock.eq(Mux(clock == period - 1, 0, clock + 1))
    with c.m.If((clock == period - 1) & (place < len(LINE) - 1)):
        c.m.d.sync += place.eq(place + 1)
    level = (Const(int(LINE[::-1], 2), len(LINE)) >> place)[0]
    disturbed = (place != 1) & (clock == period // 2)
    return ((dut.rx == (level ^ disturbed)) & (c.rst == c.past(~c.past(1)))
            & (dut.bytes.ready == ((place < 21) | (place == len(LINE) - 8))))


def _watch_sender(c: Contract, dut: UARTReceiver, name: str, bit: int, any_byte: Bits,
                  taken: Bits, ended: Bits) -> None:
    """State that a byte is received whose bits last `bit` clocks, with one wrong sample of each."""
    state, time = c.state("receiver_state"), c.signal("time")
    period, first = dut.period, dut.period // 2 + dut.spread
    begins = state("IDLE") & ~dut.rx
    on, wrong = c.keep(1, name=f"on_{name}"), c.keep(1, name=f"wrong_{name}")
    sent, at = c.keep(8, name=f"sent_{name}"), c.keep(range(10), name=f"at_{name}")
    clock = c.keep(range(bit), name=f"clock_{name}")
    frame = Cat(Const(0, 1), sent, Const(1, 1))
    look = (time == -2 * dut.spread) | (time == -dut.spread) | (time == 0)
    bad = look & (dut.rx != (frame >> at)[0])
    c.m.d.sync += clock.eq(clock + 1)
    with c.m.If(clock == bit - 1):
        c.m.d.sync += [clock.eq(0), at.eq(at + 1)]
    c.m.d.sync += wrong.eq((wrong | bad) & (time != 0))
    with c.m.If(c.rst | (bad & wrong) | ended):
        c.m.d.sync += on.eq(0)
    with c.m.If(begins & ~c.rst):
        c.m.d.sync += [on.eq(1), sent.eq(any_byte), at.eq(0), clock.eq(1), wrong.eq(0)]

    good = c.past(on & ended & ~(bad & wrong) & ~c.rst)
    c.implication(f"received-{name}", f"A sent byte is received: {_SENDERS[name]}.",
                  when=good & ~c.past(dut.overrun), then=dut.bytes.valid
                  & (dut.bytes.p.byte == sent))
    c.implication(f"good-{name}", f"A sent byte is received without an error: {_SENDERS[name]}.",
                  when=good & ~c.past(dut.overrun | c.signal("lost")), then=~dut.bytes.p.error)

    # What makes it so
    current = Mux(state("START"), 0, Mux(state("STOP"), 9, taken + 1))
    level = (frame >> current)[0]
    seen = c.signal("looks") ^ level.replicate(2)
    done = Mux(state("START"), 0, current * period)
    c.implication(f"sender-{name}", "Sender and receiver are in the same byte.", when=on,
                  then=state("START", "DATA", "STOP") & (clock < bit) & (at < 10)
                  & (at * bit + clock == time + first + done)
                  & (state("START") | (c.signal("word")
                                       == (Cat(Const(0x80, 8), sent) >> taken)[:8])))
    c.implication(f"samples-{name}", "Of the samples of a bit so far at most one was wrong.",
                  when=on, then=wrong == Mux(time > -dut.spread, seen[0] | seen[1],
                                             (time > -2 * dut.spread) & seen[0]))
    c.implication(f"at-most-one-bad-{name}", "Of the samples of a bit two are never wrong.",
                  when=on & (time > -dut.spread),
                  then=~seen.all())


_SENDERS = {"agreed": "at the rate agreed", "slow": "2 % slower", "fast": "2 % faster"}

UART_RECEIVER = Component(
    make=UARTReceiver, describe=describe, depth=len(LINE) * 16,
    cases=(Case({"period": 16}), Case({"period": 50}),
           Case({"period": 5208}, real=True),
           Case({"period": 16}, upset=True)))
