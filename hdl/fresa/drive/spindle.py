"""The power of a spindle or a laser, and the pulses that carry it: PWM, and those of a servo."""

from amaranth import Cat, Module, Mux, Signal, signed
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

PHASE_BITS = 10
"""A PWM has 1024 duties."""

MAX_PWM = 100_000
"""Highest frequency of a PWM in Hz."""

MIN_SERVO_PERIOD, SERVO_PERIOD = POWER_BITS + 2, 20_000
"""Least time from a pulse for a servo to the next, and the usual one, which is the most, in us."""


class SpindlePower(wiring.Component):
    """Computes the power of a spindle from its speed, or of a laser also from that of the path.

    The power is ``(speed - least) / (most - least)``, and at ``LEAST_POWER`` least; with ``scaled``
    that times ``path_speed / feed``. Each quotient is rounded down, and at most 1; that of a range
    which is 0 or less is 1. A speed of 0 has no power, nor has a path that stands.

    A serial divider and multiplier compute it again and again: a new value is out 110 clocks after
    its inputs at most. That with ``on`` at 0 is 0, a clock later.

    Members
    -------
    on, scaled : In(1)
        The spindle is on; its power follows the speed of the path.
    speed : In(36)
        In 10**-6 rev/min.
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
    least: In(27)
    most: In(27)
    path_speed: In(32)
    feed: In(32)
    power: Out(POWER_BITS + 1)
    fault: Out(1)

    def elaborate(self, platform) -> Module:
        m = Module()
        least, span = Signal(37), Signal(signed(38))  # in 10**-6 rev/min
        difference = Signal(signed(28))
        m.d.sync += [least.eq(self.least * 1000), difference.eq(self.most - self.least),
                     span.eq(difference * 1000)]
        left, divisor = Signal(38), Signal(37)
        above = Signal(38)
        m.d.comb += above.eq(self.speed - least)
        quotient, share = Signal(POWER_BITS + 1), Signal(POWER_BITS + 1)
        digit = Signal(range(POWER_BITS + 1))
        doubled = Signal(39)
        fits = Signal()
        full = Signal()  # the quotient is 1, or more
        total = Signal(2 * POWER_BITS + 2)
        m.d.comb += [doubled.eq(left << 1), fits.eq(doubled >= divisor),
                     full.eq(left >= divisor)]

        def divide(then: str) -> None:
            m.d.sync += [digit.eq(digit + 1), quotient.eq(Cat(fits, quotient)),
                         left.eq(Mux(fits, doubled - divisor, doubled))]
            with m.If((digit == 0) & full):
                m.d.sync += [quotient.eq(FULL_POWER), digit.eq(0)]
                m.next = then
            with m.Elif(digit == POWER_BITS - 1):
                m.d.sync += digit.eq(0)
                m.next = then

        with m.FSM(name="power_state") as fsm:
            with m.State("SAMPLE"):
                m.d.sync += [divisor.eq(span), left.eq(above), digit.eq(0), quotient.eq(0)]
                m.next = "SPEED"
                with m.If(span[-1]):
                    m.d.sync += divisor.eq(0)  # then the quotient is 1
                with m.If(above[-1]):
                    m.d.sync += left.eq(0)
            with m.State("SPEED"):
                divide("PATH")
            with m.State("PATH"):
                m.d.sync += [share.eq(Mux(quotient < LEAST_POWER, LEAST_POWER, quotient)),
                             divisor.eq(self.feed), left.eq(self.path_speed), quotient.eq(0)]
                m.next = "SHARE"
                with m.If(self.speed == 0):
                    m.d.sync += share.eq(0)
            with m.State("SHARE"):
                divide("SCALE")
            with m.State("SCALE"):
                m.d.sync += total.eq(0)
                m.next = "MULTIPLY"
                with m.If(~self.scaled):
                    m.d.sync += quotient.eq(FULL_POWER)
                with m.Elif(self.path_speed == 0):
                    m.d.sync += quotient.eq(0)
            with m.State("MULTIPLY"):  # from the highest digit
                m.d.sync += [total.eq((total << 1) + Mux(quotient[-1], share, 0)),
                             quotient.eq(quotient << 1), digit.eq(digit + 1)]
                with m.If(digit == POWER_BITS):
                    m.next = "SHOW"
            with m.State("SHOW"):
                m.d.sync += self.power.eq(total >> POWER_BITS)
                m.next = "SAMPLE"
            with m.State("FAULT"):
                pass
        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))
        with m.If(~self.on | self.fault):
            m.d.sync += self.power.eq(0)
        with m.If(~self.on & ~self.fault):
            m.d.sync += fsm.state.eq(fsm.encoding["SAMPLE"])
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

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, clock: int, period: int = SERVO_PERIOD) -> None:
        self.clock = in_range("clock", clock, 1_000_000, (1 << 27) - 1)
        self.period = in_range("period", period, MIN_SERVO_PERIOD, SERVO_PERIOD)
        super().__init__({"power": In(POWER_BITS + 1), "low": In(12), "high": In(12),
                          "pin": Out(1)})

    def elaborate(self, platform) -> Module:
        m = Module()
        time = Signal(range(self.period))
        tick = _share(m, 10**6, self.clock, "time")
        length = Signal(12)
        power = Signal(POWER_BITS)
        full = Signal()
        total = Signal(12 + POWER_BITS)  # 2**-16 us: (low + sum of low or high) by digits of power
        m.d.sync += self.pin.eq(time < length)
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
                    total.eq((total + (Mux(power[0], self.high, self.low) << POWER_BITS)) >> 1)]
        return m


def _share(m: Module, part: int, whole: int, name: str) -> Signal:
    """Return a signal that is 1 in ``part`` of ``whole`` clocks, evenly."""
    rest = Signal(range(whole), name=f"{name}_rest")
    over = Signal(name=f"{name}_over")
    m.d.comb += over.eq(rest >= whole - part)
    m.d.sync += rest.eq(Mux(over, rest - (whole - part), rest + part))
    return over
