"""The power of a spindle or a laser, and the pulses that carry it: PWM, and those of a servo."""

from amaranth import Cat, Const, Module, Mux, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..fsm import leave_unused_codes

__all__ = ["FULL_POWER", "LEAST_POWER", "MAX_PWM", "PowerPWM", "ServoPulse", "SpindlePower",
           "pwm_frequency"]

POWER_BITS = 16
FULL_POWER = 1 << POWER_BITS
"""Power of a pin that is always on."""

LEAST_POWER = FULL_POWER >> 8
"""Power of the lowest speed that is not 0, as GRBL has it."""

OVERRIDE_DIGITS = 14
OVERRIDE_POINT = 12
"""Digits of an override as a factor, and how many of them are behind the point."""

PART_BITS = 17
"""Low bits that are multiplied apart."""

PHASE_BITS = 10
"""A PWM has 1024 duties."""

MAX_PWM = 100_000
"""Highest frequency of a PWM in Hz."""

MIN_SERVO_PERIOD, SERVO_PERIOD = POWER_BITS + 2, 20_000
"""Least time from a pulse for a servo to the next, and the usual one, which is the most, in us."""

BEAT_LOG2 = 10
"""Of the microseconds of a beat."""


class SpindlePower(wiring.Component):
    """Computes the power of a spindle from its speed, or of a laser also from that of the path.

    The power is ``(speed - least) / (most - least)``, with the speed multiplied by the override,
    and at ``LEAST_POWER`` least; with ``scaled`` that times ``path_speed / feed``. Each quotient is
    rounded down, and at most 1; that of a range which is 0 or less is 1. A speed of 0 has no power,
    nor has a path that stands.

    One adder makes both quotients, one after the other and again and again: as non-restoring
    divisions, whose first digit is the whole 1. A second one multiplies, by the digits of the
    second quotient as they come. A new value is out 130 clocks after its inputs at most. That with
    ``on`` at 0 is 0, a clock later. Of the override's factor 12 digits behind the point are used:
    those of 100, 50, 25 and 200 % are exact.

    Members
    -------
    on, scaled : In(1)
        The spindle is on; its power follows the speed of the path.
    speed : In(36)
        In 10**-6 rev/min.
    override : In(8)
        Percent by which that is multiplied.
    least, most : In(27)
        Speeds of the least and of full power, in 10**-3 rev/min: $31 and $30 of GRBL.
    path_speed, feed : In(32)
        Present speed of the path, and the one that was programmed, in nm/s.
    power : Out(17)
        From 0 to ``FULL_POWER``.
    fault : Out(1)
        The state register was upset; the power is 0. Stays until reset.
    """

    on: In(1)
    scaled: In(1)
    speed: In(36)
    override: In(8)
    least: In(27)
    most: In(27)
    path_speed: In(32)
    feed: In(32)
    power: Out(POWER_BITS + 1)
    fault: Out(1)

    def elaborate(self, platform) -> Module:
        m = Module()
        second = Signal()  # the second quotient is made; the first one is `share`
        scales = Signal()  # and it is not 1
        share = Signal(POWER_BITS + 1)
        scaled = Signal(2 * POWER_BITS + 1)  # the share times the digits of the second so far
        step = Signal(range(POWER_BITS + 2))  # of a division: each has a digit, a clock later
        speed, percent = Signal.like(self.speed), Signal.like(self.override)  # of the first
        override = Signal(OVERRIDE_DIGITS)  # percent x 40.96, rounded
        digits = Cat(reversed(override[:-1]))  # behind the first
        adds_soon, adds = Signal(), Signal()  # the last, of so many multiples of the speed
        by_41 = Signal(OVERRIDE_DIGITS)
        # As sums: a multiplier would be used for that, and is slow.
        m.d.sync += [by_41.eq(percent + (percent << 3) + (percent << 5)),
                     override.eq(by_41 - (by_41 + 512 >> 10))]
        with m.If(second | ~self.on):
            m.d.sync += [speed.eq(self.speed), percent.eq(self.override)]
        digit = Signal()
        counts = Signal()  # digits do, up to the first if that is 1
        nonzero = Signal()

        # What is added is 0 but in its own clocks, so that there is no choice between two things.
        # Each step doubles what remains: so these are multiples of 10**-6 rev/min, with digits of
        # the override behind the point.
        operand = Signal(36)
        product = Signal(signed(41 + OVERRIDE_POINT))
        factor = Signal(signed(28))
        thousand = Signal(signed(38))  # times it
        low_part = Signal(PART_BITS + 10)
        high_part = Signal(signed(38 - PART_BITS))
        rest, total = (Signal(signed(42 + OVERRIDE_POINT), name=name) for name in ("rest", "total"))
        subtracts, loads, multiplies, divides, keeps, clears = (
            Signal(name=name) for name in ("subtracts", "loads", "multiplies", "divides", "keeps",
                                           "clears"))
        addend = (operand | product) ^ (~subtracts).replicate(len(total))
        m.d.comb += total.eq(((rest << 2) - (addend << 1 | ~subtracts)) >> 1)
        with m.If(~(loads | keeps)):
            m.d.sync += operand.eq(0)
        with m.Elif(loads):
            m.d.sync += operand.eq(Mux(divides, self.feed << 2,
                                       Mux(second, self.path_speed, speed)))
        with m.If(~(multiplies | keeps)):
            m.d.sync += product.eq(0)
        with m.Elif(multiplies):
            m.d.sync += product.eq(Mux(divides, thousand << 2, thousand << 1) << OVERRIDE_POINT)
        with m.If(clears):
            m.d.sync += rest.eq(0)
        with m.Elif(~divides):
            m.d.sync += rest.eq(total)

        with m.FSM(name="power_state") as fsm:
            with m.State("SAMPLE"):
                m.d.comb += [loads.eq(~second | self.scaled), clears.eq(1)]
                m.d.sync += scales.eq(second & self.scaled)
                m.next = "TEST"
            with m.State("TEST"):
                m.d.comb += [keeps.eq(1), subtracts.eq(1)]
                m.next = "CLEAR"
            with m.State("CLEAR"):
                m.d.comb += [keeps.eq(second), loads.eq(~second & override[-1]), clears.eq(1)]
                m.d.sync += [nonzero.eq(rest[-1] | (second & ~scales)),
                             step.eq(Mux(second, OVERRIDE_DIGITS - 1, 0))]
                m.next = "ADD"
            with m.State("ADD"):  # digit by digit of the override
                m.d.comb += [adds_soon.eq(step == OVERRIDE_DIGITS - 2),
                             adds.eq(step == OVERRIDE_DIGITS - 1), multiplies.eq(adds & ~second),
                             loads.eq(digits.bit_select(step, 1))]
                m.d.sync += step.eq(step + 1)
                with m.If(adds):
                    m.next = "LESS"
            with m.State("LESS"):
                m.d.comb += subtracts.eq(1)
                m.next = "CLAMP"
            with m.State("CLAMP"):  # without a divisor the quotient is 1
                m.d.comb += [clears.eq(rest[-1]), divides.eq(1), loads.eq(scales),
                             multiplies.eq(~second & factor[-1])]
                m.d.sync += [step.eq(0), counts.eq(0)]
                m.next = "DIVIDE"
            with m.State("DIVIDE"):
                m.d.comb += [keeps.eq(1), subtracts.eq(rest[-1] ^ second),
                             digit.eq(counts & (rest[-1] == 0))]
                m.d.sync += [step.eq(step + 1), scaled.eq(_sum(scaled << 1, Mux(digit, share, 0)))]
                with m.If(step == 0):
                    m.d.sync += counts.eq(nonzero)
                with m.Elif((step == 1) & digit):
                    m.d.sync += counts.eq(0)
                with m.If(~second):
                    m.d.sync += share.eq(Cat(digit, share))
                with m.If(step == POWER_BITS + 1):
                    m.next = "SHARE"
                    with m.If(second):
                        m.next = "SHOW"
            with m.State("SHARE"):
                m.d.sync += second.eq(1)
                m.next = "SAMPLE"
            with m.State("SHOW"):
                m.d.sync += [self.power.eq(scaled >> POWER_BITS), second.eq(0)]
                m.next = "SAMPLE"
            with m.State("FAULT"):
                pass
        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))
        # Its product is there two clocks later, in parts before: a multiplier of 18 bits is slow.
        m.d.sync += [factor.eq(self.least - Mux(adds_soon | adds | fsm.ongoing("LESS"), self.most,
                                                0)),
                     low_part.eq(Value.cast(factor[:PART_BITS]) * 1000),
                     high_part.eq((factor >> PART_BITS) * 1000),
                     thousand.eq((high_part << PART_BITS) + low_part)]
        with m.If(fsm.ongoing("SHARE")):
            m.d.sync += scaled.eq(0)
            with m.If(nonzero & (share < LEAST_POWER)):
                m.d.sync += share.eq(LEAST_POWER)
        with m.If(~self.on | self.fault):
            m.d.sync += self.power.eq(0)
        with m.If(~self.on & ~self.fault):
            m.d.sync += [fsm.state.eq(fsm.encoding["SAMPLE"]), second.eq(0)]
        return m


def pwm_frequency(frequency: int, *, clock: int, phase_bits: int = PHASE_BITS) -> int:
    """Return the frequency of a PWM in Hz, if a clock in Hz can make it.

    Parameters
    ----------
    frequency, clock, phase_bits : int
        As of :class:`PowerPWM`.

    Raises
    ------
    ValueError
        If it is out of range.
    """
    return in_range("frequency of the PWM", frequency, 1, min(MAX_PWM, clock >> phase_bits))


class PowerPWM(wiring.Component):
    """Makes pulses whose duty is a power, in ``2**phase_bits`` steps, rounded down.

    A new duty begins with a period; power 0 ends the pulse a clock later. Over time there are
    exactly ``frequency`` periods in a second; each is at most a clock longer than another.

    Parameters
    ----------
    clock : int
        Clock in Hz.
    frequency : int
        In Hz, and at most ``2**-phase_bits`` of the clock.
    phase_bits : int
        Duties, as a power of two; from 1 to 16.

    Members
    -------
    power : In(17)
        From 0 to ``FULL_POWER``.
    pin : Out(1)
        The pulses.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, clock: int, frequency: int, phase_bits: int = PHASE_BITS) -> None:
        self.phase_bits = in_range("phase_bits", phase_bits, 1, POWER_BITS)
        self.clock = in_range("clock", clock, 1 << phase_bits, (1 << 27) - 1)
        self.frequency = pwm_frequency(frequency, clock=clock, phase_bits=phase_bits)
        super().__init__({"power": In(POWER_BITS + 1), "pin": Out(1)})

    def elaborate(self, platform) -> Module:
        m = Module()
        bits = self.phase_bits
        phase = Signal(bits)
        duty = Signal(bits + 1)
        advance = _share(m, self.frequency << bits, self.clock, "phase")
        wanted = self.power >> POWER_BITS - bits
        with m.If(advance):
            m.d.sync += phase.eq(phase + 1)
            with m.If(phase == (1 << bits) - 1):
                m.d.sync += duty.eq(wanted)
        with m.If(self.power == 0):
            m.d.sync += duty.eq(0)
        m.d.sync += self.pin.eq((phase < duty) & (self.power != 0))
        return m


class ServoPulse(wiring.Component):
    """Makes the pulses of a hobby servo: one each period, whose length follows a power.

    It is ``low`` at power 0 and ``high`` at full power, in whole us, rounded down between them. The
    power is sampled 17 us before a period ends, and the pulse of the next has its length.

    Parameters
    ----------
    clock : int
        Clock in Hz.
    period : int
        From a pulse to the next, in us; from `MIN_SERVO_PERIOD` to `SERVO_PERIOD`.

    Members
    -------
    power : In(17)
        From 0 to ``FULL_POWER``.
    low, high : In(12)
        Lengths of pulses in us; either may be the longer one. A change in those 17 us may give one
        pulse another length.
    pin : Out(1)
        The pulses.
    beat : Out(1)
        For one clock, as a period begins and each 1024 us from there on, up to 2 us later. In a
        period of 20 ms that is 20 times, so it counts ms that are up to 0.5 ms too short, or
        0.024 ms too long.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, clock: int, period: int = SERVO_PERIOD) -> None:
        self.clock = in_range("clock", clock, 1_000_000, (1 << 27) - 1)
        self.period = in_range("period", period, MIN_SERVO_PERIOD, SERVO_PERIOD)
        super().__init__({"power": In(POWER_BITS + 1), "low": In(12), "high": In(12),
                          "pin": Out(1), "beat": Out(1)})

    def elaborate(self, platform) -> Module:
        m = Module()
        time = Signal(range(self.period))
        tick = _share(m, 10**6, self.clock, "time")
        length = Signal(12)
        power = Signal(POWER_BITS)
        full = Signal()
        total = Signal(12 + POWER_BITS)  # 2**-16 us: (low + sum of low or high) by digits of power
        m.d.sync += [self.pin.eq(time < length), self.beat.eq(tick & (time[:BEAT_LOG2] == 0))]
        with m.If(tick):
            m.d.sync += time.eq(time + 1)
            with m.If(time == self.period - 1):
                m.d.sync += [time.eq(0), length.eq(Mux(full, self.high, total >> POWER_BITS))]
            # The digits are looked at before, one a us, the lowest first.
            with m.If(time == self.period - POWER_BITS - 2):
                m.d.sync += [power.eq(self.power), full.eq(self.power[-1]),
                             total.eq(self.low << POWER_BITS)]
            with m.Else():
                m.d.sync += [
                    power.eq(power >> 1),
                    total.eq(_sum(
                        total, Mux(power[0], self.high, self.low) << POWER_BITS) >> 1)]
        return m


def _share(m: Module, part: int, whole: int, name: str) -> Signal:
    """Return a signal that is 1 in ``part`` of ``whole`` clocks, evenly."""
    # Below 0 until the next: so its sign is all that is looked at.
    rest = Signal(range(part - whole, part), name=f"{name}_rest", init=part - whole)
    over = Signal(name=f"{name}_over")
    m.d.comb += over.eq(rest[-1] == 0)
    m.d.sync += rest.eq(rest + Mux(over, part - whole, part))
    return over


def _sum(number: Value, other: Value):
    """Return a sum, as a difference: so a choice of the other goes into the LUTs of the carry."""
    bits = max(len(number), len(other)) + 1
    doubled = Value.cast(Cat(Const(0, 1), other, Const(0, bits - len(other))))
    return ((number << 1) - ~doubled)[1:bits + 1]
