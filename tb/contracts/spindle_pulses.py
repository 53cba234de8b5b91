"""Contracts of the pulses that carry a power: PWM, and those of a servo."""

from amaranth import Mux, signed

from fresa.drive import FULL_POWER, PowerPWM, ServoPulse

from .contract import Bits, Case, Component, Contract

__all__ = ["POWER_PWM", "SERVO_PULSE"]


def _evenly(c: Contract, *, due: Bits, rest: Bits, part: int, whole: int) -> None:
    """State that a signal is 1 in exactly `part` of `whole` clocks, over any time.

    Parameters
    ----------
    c : Contract
        Where to state it.
    due, rest : Value
        The signal, and the register that decides when it is 1.
    part, whole : int
        The share.
    """
    behind = c.keep(signed(len(rest) + 2), name="behind")  # in 1/whole
    c.m.d.sync += behind.eq(Mux(c.rst, 0, behind + part - Mux(due, whole, 0)))
    c.invariant("exact-rate", "Over any time it falls behind an ideal clock by less than one "
                "period of that, and is never ahead of it.", (behind >= 0) & (behind < whole),
                cover=behind != 0)
    c.invariant("behind", "By how much is counted.", behind == rest + (whole - part),
                cover=behind != 0, lemma=True)


def describe_pwm(c: Contract, dut: PowerPWM) -> None:
    """By a phase of its own: the pin is high for the duty of each period, and for no more."""
    duties = 1 << dut.phase_bits
    advance = c.signal("phase_over")
    _evenly(c, due=advance, rest=c.signal("phase_rest"), part=dut.frequency * duties,
            whole=dut.clock)
    known = c.past(~c.rst)
    c.assume(dut.power <= FULL_POWER)
    phase = c.keep(range(duties), name="phase_of_it")
    duty = c.keep(range(duties + 1), name="duty_of_it")
    with c.m.If(advance):
        c.m.d.sync += phase.eq(phase + 1)
        with c.m.If(phase == duties - 1):
            c.m.d.sync += duty.eq(dut.power * duties // FULL_POWER)
    with c.m.If(dut.power == 0):
        c.m.d.sync += duty.eq(0)
    with c.m.If(c.rst):
        c.m.d.sync += [phase.eq(0), duty.eq(0)]

    c.implication("off-in-a-clock", "Power 0 ends a pulse in the next clock.",
                  when=c.past(dut.power == 0) & known, then=~dut.pin)
    c.implication("high-for-its-duty", "It is high for that share of a period that is the power.",
                  when=known & c.past((phase < duty) & (dut.power != 0)), then=dut.pin)
    c.implication("low-for-the-rest", "And low for the rest.",
                  when=known & c.past(phase >= duty), then=~dut.pin)
    c.implication("rises-with-a-period", "A pulse begins with a period.",
                  when=known & c.past(known) & dut.pin & ~c.past(dut.pin),
                  then=c.past((phase == 0) & c.past(advance)))
    c.implication("reset-clears", "Reset ends a pulse.", when=c.past(c.rst), then=~dut.pin)
    c.invariant("phase", "Phase and duty are those.",
                (c.signal("phase") == phase) & (c.signal("duty") == duty), cover=duty != 0,
                lemma=True)
    c.implication("pin-follows", "Where a pulse goes on it began before.",
                  when=known & c.past(phase != 0) & dut.pin, then=c.past(duty > phase), lemma=True)


def describe_servo(c: Contract, dut: ServoPulse) -> None:
    """By a clock of us: a pulse a period, of a length that is its own or between its ends.

    How long it is at a power between none and full is tested against numbers: a solver does not
    multiply so much.
    """
    tick = c.signal("time_over")
    _evenly(c, due=tick, rest=c.signal("time_rest"), part=10**6, whole=dut.clock)
    known = c.past(~c.rst)
    bits = len(dut.power) - 1
    # Those are settings, which wait for the machine to stand.
    c.assume(~known | ((dut.low == c.past(dut.low)) & (dut.high == c.past(dut.high))))
    c.assume(dut.power <= FULL_POWER)
    c.restrict_covers(((dut.power == 0) | (dut.power == FULL_POWER))
                      & (dut.low == 3) & (dut.high == 6))
    time = c.keep(range(dut.period), name="time_of_it")
    power = c.keep(len(dut.power), name="power_sampled")
    made = c.keep(len(dut.power), name="power_of_it")
    begun = c.keep(1, name="begun")
    with c.m.If(tick):
        c.m.d.sync += time.eq(time + 1)
        with c.m.If(time == dut.period - 1 - bits - 1):
            c.m.d.sync += power.eq(dut.power)
        with c.m.If(time == dut.period - 1):
            c.m.d.sync += [time.eq(0), made.eq(power), begun.eq(1)]
    with c.m.If(c.rst):
        c.m.d.sync += [time.eq(0), begun.eq(0)]
    length = c.signal("length")
    c.invariant("beats", "It beats a clock after the first us of each 1024 of a period.",
                dut.beat == (known & c.past(tick & (time % 1024 == 0))), cover=dut.beat)

    least, most = (Mux((dut.low < dut.high) == up, dut.low, dut.high) for up in (1, 0))
    high = known & c.past(begun)
    c.implication("at-least-the-shorter", "A pulse is no shorter than the shorter of its lengths.",
                  when=high & c.past(time < least), then=dut.pin)
    c.implication("at-most-the-longer", "And no longer than the longer one.",
                  when=known & c.past(time >= most), then=~dut.pin)
    for name, share, exact in (("no", 0, dut.low), ("full", FULL_POWER, dut.high)):
        c.implication(f"as-at-{name}-power", f"At {name} power it has its length of that.",
                      when=high & c.past(made == share), then=dut.pin == c.past(time < exact))
    c.implication("falls-once", "A pulse goes on until it ends, once.",
                  when=known & c.past(known) & ~c.past(dut.pin) & c.past(time != 0),
                  then=~dut.pin)
    c.implication("first-after-a-period", "The first comes when a period is over.",
                  when=c.past(~begun), then=~dut.pin)
    c.implication("reset-clears", "Reset ends a pulse.", when=c.past(c.rst), then=~dut.pin)

    left, total = c.signal("power"), c.signal("total")
    c.invariant("time", "Time is that, and the length is between its ends.",
                (c.signal("time") == time) & (time < dut.period)
                & Mux(begun, (length >= least) & (length <= most), length == 0),
                cover=length != 0, lemma=True)
    c.invariant("pin", "The pin shows it.", ~known | (dut.pin == c.past(time < length)),
                cover=dut.pin, lemma=True)
    c.invariant("length", "The length is that of the power that was sampled.",
                ~begun | (((made != 0) | (length == dut.low))
                          & ((made != FULL_POWER) | (length == dut.high))),
                cover=length != 0, lemma=True)
    c.invariant("mean", "What is computed is between its ends, and at no power at the lower one.",
                (time < dut.period - 1 - bits)
                | ((c.signal("full") == power[-1]) & (power <= FULL_POWER)
                   & (total >= least << bits) & (total <= most << bits)
                   & ((power != 0) | ((left == 0) & (total == dut.low << bits)))),
                cover=time == dut.period - 1, lemma=True)


POWER_PWM = Component(
    make=PowerPWM, describe=describe_pwm, depth=24,
    cases=(Case({"clock": 12, "frequency": 1, "phase_bits": 3}),
           Case({"clock": 50_000_000, "frequency": 5000}, real=True)))
SERVO_PULSE = Component(
    make=ServoPulse, describe=describe_servo, depth=36,
    cases=(Case({"clock": 1_250_000, "period": 18}), Case({"clock": 50_000_000}, real=True)))
