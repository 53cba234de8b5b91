"""`positioner`: three geared steppers at the screws of a micropositioner."""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass

from amaranth import Cat, Const, Module, Signal
from amaranth.lib.wiring import In, Out, connect

from ..checks import in_range
from ..clock import CLOCK, clocks_of
from ..drive import MAX_PERIOD, MAX_PULSE, RateGenerator, StepDirDriver
from ..motion import MAX_BACKLASH, Axis, Limits
from ..motion.positioner import Positioning
from ..protocol import (
    BAUD,
    LineReader,
    Reporter,
    UARTReceiver,
    UARTTransmitter,
    bit_period,
)
from ..protocol.baud import LEAST_PERIOD
from ..protocol.positioner import MOTORS, Answer, PositionerCommands, state_layout
from ..protocol.reporter import least_period
from ..roles import (
    BUZZER,
    DIRECTION,
    ENABLE,
    LIMIT,
    RX,
    STATUS,
    STEP,
    TX,
    MachineComponent,
)

__all__ = ["ANSWERS", "ENDS", "LIMIT_ENDS", "LINE_LENGTH", "TOP_SPEED", "Positioner",
           "PositionerTiming"]

TOP_SPEED = 1500
"""Most steps a second that the motors follow."""

LINE_LENGTH = 254
"""Most bytes of a command; the longest one needs 39."""

ENDS = ("X-", "X+", "Y-", "Y+", "Z-", "Z+")
"""The ends of the axes. Clockwise leads to +."""

LIMIT_ENDS = ("X+", "Y+", "Z+")
"""Default ends of the limit switches, by their inputs."""

ANSWERS = tuple(b"ok\n" if answer == Answer.OK else f"! {answer.name.replace('_', ' ')}\n".encode()
                for answer in Answer if answer != Answer.STATE)
"""Texts of the answers, by the numbers of `Answer`. The first is never sent. There is none of the
last, the state."""


@dataclass(frozen=True)
class PositionerTiming:
    """Times of the machine.

    A board sets it from physical units with :meth:`real`. A simulation may have a slower clock, and
    any time shortened, without another change to the gateware.

    Attributes
    ----------
    clock : int
        Clock in Hz.
    baud : int
        Bits a second on the line.
    top_speed : int
        Highest speed of a motor, in steps/s.
    width, low, setup, hold : int
        Times of the driver modules in clocks, see :class:`StepDirDriver`.
    settle : int
        Clocks in which a limit switch settles.
    report : int
        Clocks from report to report.
    """

    clock: int
    baud: int
    top_speed: int
    width: int
    low: int
    setup: int
    hold: int
    settle: int
    report: int

    @classmethod
    def real(cls, *, clock: int = CLOCK, baud: int = BAUD, top_speed: int = TOP_SPEED,
             width_ns: int = 1900, low_ns: int = 1900, setup_ns: int = 650, hold_ns: int = 650,
             settle_us: int = 10_000, report_us: int = 100_000) -> "PositionerTiming":
        """Return the timing for a clock in Hz, a speed in steps/s, and least times in ns and us.

        The times of the driver modules default to those of the DRV8825, with which no more than
        263 157 steps/s are possible.

        Raises
        ------
        ValueError
            If a time is not over 0, or longer than can be counted.
        """
        in_range("clock", clock, 1, 10**9)

        times = [("width", width_ns), ("low", low_ns), ("setup", setup_ns), ("hold", hold_ns)]
        driver = {name: clocks_of(f"{name}_ns", time, 10**9, clock=clock, most=MAX_PULSE)
                  for name, time in times}
        waits = {name: clocks_of(f"{name}_us", time, 10**6, clock=clock, most=MAX_PERIOD)
                 for name, time in [("settle", settle_us), ("report", report_us)]}
        return cls(clock=clock, baud=baud, top_speed=top_speed, **driver, **waits)


def _check_report(timing: PositionerTiming, bit: int) -> None:
    """Raise ValueError if a higher bit rate would do for the report period, and this does not."""
    def least(bit: int) -> int:
        return least_period(state_layout(timing.top_speed), ANSWERS, 10 * bit)

    fitting = bisect_right(range(LEAST_PERIOD, bit), timing.report, key=least)
    if fitting and least(bit) > timing.report:
        slowest = 2 * timing.clock // (2 * (LEAST_PERIOD + fitting) - 1) + 1  # bits are rounded
        raise ValueError(f"baud must be at least {slowest} for a report period of {timing.report} "
                         f"clocks, not {timing.baud}")


class Positioner(MachineComponent):
    """Three-axis micropositioner on a serial line, without a board.

    All inputs are synchronous to the clock. Lines come in on ``rx``, each a command and a line
    feed, before which a CR may stand: ``CONNECT``, ``DISCONNECT``, ``MOV MOTn C``, ``MOV MOTn CC``,
    ``STOP MOTn``, ``VEL MOTn v``, ``P i x y z``, ``GOTO i``, ``ORIGIN``, ``POS x y z``, ``ACK 0``,
    ``ACK 1`` and ``STATE``. What they do is described by :class:`Positioning`. From ``ACK 1`` to
    ``ACK 0`` a line that is executed is answered ``ok``, except ``STATE``; before and after that it
    has no answer. A line that is not changes nothing and is answered by exactly one line
    ``! reason``:

    ====================  ==========================================================================
    ``! COMMAND``         its first word is no command
    ``! ARGUMENT``        arguments are missing, too many, or of another kind
    ``! RANGE``           a number is out of range
    ``! DISCONNECTED``    ``MOV`` or ``GOTO`` before ``CONNECT``
    ``! EMPTY``           ``GOTO`` to a point that was never stored
    ``! LONG``            it has more than ``LINE_LENGTH`` bytes
    ``! DAMAGED``         a byte of it had a framing error, or was lost
    ``! OVERFLOW``        the queue of answers is full: this answers the line, and all lines right
                          after it that have an answer, be they executed or not
    ====================  ==========================================================================

    Lines are executed when they end, however many answers wait: no ``STOP`` is delayed. A break of
    the line, low for ten bits, ends every movement, since the host may have gone.

    While connected it reports ``# POS x y z :`` at fixed times that no answer delays, see
    :class:`Reporter`. ``STATE`` is answered ``STATE`` and 14 numbers, see :func:`state_layout`, at
    the time of the next report and in its place, connected or not; the limit inputs are as they are
    then, not settled, and the seconds are whole ones, the first up to one too short. A limit switch
    blocks steps towards its end and passes those away from it. It ends the movement that it blocks,
    which is answered once, by ``! LIMIT MOTn``, before all answers that wait but the next one,
    which may be the state, and sounds the buzzer for one to two report periods. An upset state
    register holds all movement, and sets ``fault``.

    Parameters
    ----------
    timing : PositionerTiming
        Times. The drivers must be able to make steps at the top speed.
    inverted : bool
        STEP and DIR go through optocouplers that invert them.
    backlash : sequence of int
        Steps that each axis needs to take up the backlash of its gears after a reversal.
    original : bool
        Send reports only, as the original: no answer of any kind.
    limit_ends : sequence of str
        For each limit input the end at which its switch is, of ``ENDS``, each once.

    Members
    -------
    rx : In(1)
        The line from the host.
    limits : In(3)
        Limit switches, 1 where one is pressed.
    tx : Out(1)
        The line to the host.
    step, direction : Out(3)
        STEP and DIR of the motors; DIR is on for clockwise.
    enable : Out(3)
        Power of the motors.
    buzzer : Out(1)
        A limit switch has just ended a movement.
    connected : Out(1)
        Between ``CONNECT`` and ``DISCONNECT``.
    moving : Out(3)
        Motors that have a movement.
    fault : Out(1)
        A register was upset, in the clock before or earlier. No step is made until reset.

    Raises
    ------
    ValueError
        If a parameter is out of range, or the parts of the timing do not go together.
    """

    rx: In(1)
    limits: In(MOTORS)
    tx: Out(1)
    step: Out(MOTORS)
    direction: Out(MOTORS)
    enable: Out(MOTORS)
    buzzer: Out(1)
    connected: Out(1)
    moving: Out(MOTORS)
    fault: Out(1)

    def __init__(self, *, timing: PositionerTiming | None = None, inverted: bool = False,
                 backlash: Sequence[int] = (0, 0, 0), original: bool = False,
                 limit_ends: Sequence[str] = LIMIT_ENDS) -> None:
        timing = timing or PositionerTiming.real()
        bit = bit_period(timing.clock, timing.baud)
        in_range("top speed", timing.top_speed, 1, timing.clock)
        _check_report(timing, bit)
        shortest = timing.width + max(timing.low, timing.hold)
        if timing.clock // timing.top_speed < shortest:
            raise ValueError(f"top speed must be at most {timing.clock // shortest} steps/s with "
                             f"pulses {shortest} clocks apart, not {timing.top_speed}")
        if len(backlash) != MOTORS or len(limit_ends) != MOTORS:
            raise ValueError(f"there is a backlash and a limit end for each of {MOTORS} axes, "
                             f"not {backlash!r} and {limit_ends!r}")
        if len(set(limit_ends)) < MOTORS or not set(limit_ends) <= set(ENDS):
            raise ValueError(f"limit ends must be different ends of {', '.join(ENDS)}, not "
                             f"{limit_ends!r}")
        self._inverted, self._limit_ends = inverted, tuple(limit_ends)
        self._original = original
        rest = (1 << MOTORS) - 1 if inverted else 0
        self.roles = {
            "rx": RX, "tx": TX, "limits": LIMIT, "step": STEP.resting(rest),
            "direction": DIRECTION.resting(rest), "enable": ENABLE, "buzzer": BUZZER,
            "connected": STATUS, "moving": STATUS, "fault": STATUS,
        }
        self._backlash = [in_range("backlash", steps, 0, MAX_BACKLASH) for steps in backlash]
        self._axes = [Axis(
            driver=StepDirDriver(width=timing.width, low=timing.low, setup=timing.setup,
                                 hold=timing.hold),
            # No speed is above the top speed; a limit of all ones needs no comparison here.
            modulus=timing.clock, max_rate=min((1 << timing.top_speed.bit_length()) - 1,
                                               timing.clock),
            max_backlash=max(1, steps)) for steps in self._backlash]
        self._switches = Limits(axes=MOTORS, period=timing.settle)
        self._receiver = UARTReceiver(period=bit)
        self._transmitter = UARTTransmitter(period=bit)
        self._lines = LineReader(length=LINE_LENGTH, ends=b"\n", crlf=True)
        self._commands = PositionerCommands(top_speed=timing.top_speed)
        self._positioning = Positioning(top_speed=timing.top_speed)
        self._second = RateGenerator(modulus=timing.clock, max_rate=1)
        self._reporter = Reporter(state=state_layout(timing.top_speed), answers=ANSWERS,
                                  period=timing.report, byte=10 * bit)
        super().__init__()

    def elaborate(self, platform) -> Module:
        m = Module()

        # From the line to orders
        m.submodules.receiver = receiver = self._receiver
        m.submodules.lines = lines = self._lines
        m.submodules.commands = commands = self._commands
        m.submodules.positioning = positioning = self._positioning
        connect(m, receiver.bytes, lines.bytes)
        connect(m, lines.items, commands.items)
        connect(m, commands.orders, positioning.orders)
        m.d.comb += receiver.rx.eq(self.rx)

        # From positions and answers to the line
        m.submodules.reporter = reporter = self._reporter
        m.submodules.transmitter = transmitter = self._transmitter
        if self._original:
            m.d.comb += positioning.answers.ready.eq(1)
        else:
            connect(m, positioning.answers, reporter.answers)
        connect(m, reporter.bytes, transmitter.bytes)
        m.d.comb += [
            reporter.enable.eq(positioning.connected),
            positioning.halt.eq(receiver.line_break),
            positioning.tick.eq(reporter.tick),
            self.tx.eq(transmitter.tx),
            self.buzzer.eq(positioning.buzzer),
            self.connected.eq(positioning.connected),
            self.moving.eq(positioning.run),
        ]
        m.d.sync += self.fault.eq(receiver.fault | commands.fault | reporter.fault)

        m.submodules.second = second = self._second
        seconds = Signal(31)
        started = Signal(reset_less=True)  # the second that is due at power-up is none
        m.d.comb += [second.rate.eq(1), second.moved.eq(1)]
        m.d.sync += [started.eq(1), seconds.eq(seconds + (second.due & started))]
        m.d.comb += [reporter.connected.eq(positioning.connected), reporter.seconds.eq(seconds)]

        m.submodules.switches = switches = self._switches
        pressed = {end: self.limits[number] for number, end in enumerate(self._limit_ends)}
        m.d.comb += [
            switches.low.eq(Cat(pressed.get(f"{name}-", Const(0)) for name in "XYZ")),
            switches.high.eq(Cat(pressed.get(f"{name}+", Const(0)) for name in "XYZ")),
        ]
        for index, (name, axis) in enumerate(zip("xyz", self._axes, strict=True)):
            m.submodules[name] = axis
            m.d.comb += [
                positioning.numbers[index].eq(commands.numbers[index]),
                positioning.in_position[index].eq(axis.in_position),
                positioning.limit_hit[index].eq(axis.limit_hit),
                getattr(reporter, f"moving_{index + 1}").eq(positioning.run[index]),
                getattr(reporter, f"rate_{index + 1}").eq(positioning.rate[index]),
                getattr(reporter, f"limit_{index + 1}").eq(self.limits[index]),
                getattr(reporter, f"position_{index + 1}").eq(axis.position),
                axis.target_n.eq(positioning.target_n[index]),
                axis.run.eq(positioning.run[index] & ~self.fault),
                axis.load.eq(positioning.load),
                axis.place.eq(positioning.place[index]),
                axis.rate.eq(positioning.rate[index]),
                axis.backlash.eq(self._backlash[index]),
                axis.enable.eq(positioning.connected),
                axis.low.eq(switches.at_low[index]),
                axis.high.eq(switches.at_high[index]),
                self.step[index].eq(axis.step_pin ^ self._inverted),
                self.direction[index].eq(axis.direction_pin ^ self._inverted),
                self.enable[index].eq(axis.enable_pin),
            ]

        return m
