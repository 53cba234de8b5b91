"""`single`: one stepper, commanded from a terminal."""

from dataclasses import dataclass
from fractions import Fraction

from amaranth import Cat, Const, Module, Signal, Value
from amaranth.lib.wiring import In, Out, connect

from ..checks import in_range
from ..clock import CLOCK
from ..drive import HALF_STEP, PhaseDriver, RateGenerator, swap_inner
from ..motion import MAX_ACCELERATION, MoveTo, Ramp, ramp_rates
from ..protocol import (
    BAUD,
    FrameInterpreter,
    LineReader,
    UARTReceiver,
    UARTTransmitter,
    bit_period,
)
from ..protocol.baud import MAX_CLOCK
from ..protocol.frames import GREETING, HELP, POSITIONS, SPEEDS
from ..roles import COILS, ENABLE, NUMBER, RX, STATUS, TX, MachineComponent

__all__ = ["FRAME", "PHASES", "TOP_SPEED", "TURN", "Single", "SingleTiming"]

TURN = 48
"""Steps of a turn of the motor, by which a speed in rpm becomes a time of steps. It is that of full
steps also where half steps are made: then the shaft turns at half of the speed."""

TOP_SPEED = 1000
"""Default speed at which a ramp ends, in rpm."""

FINE = 16
"""With a ramp, rates are counted in so many parts of an rpm."""

FRAME = 126
"""Longest frame, in bytes between its start and its end."""

PHASES = swap_inner(HALF_STEP[3::-1] + HALF_STEP[:3:-1])
"""Coil words of a bipolar motor behind an H-bridge, in half steps, forward, from 0001 on."""


@dataclass(frozen=True)
class SingleTiming:
    """Times of the machine, in clocks.

    Attributes
    ----------
    bit : int
        Clocks of a bit of the line.
    modulus, rate : int
        At 1 rpm there are exactly ``rate`` steps in ``modulus`` clocks.
    clock : int
        Clocks of a second. Only a ramp needs them.
    """

    bit: int
    modulus: int
    rate: int = 1
    clock: int = CLOCK

    @classmethod
    def real(cls, *, clock: int = CLOCK, baud: int = BAUD, turn: int = TURN) -> "SingleTiming":
        """Return the timing of a clock in Hz, a line in bits/s and a motor of so many steps a turn.

        A simulation takes a lower clock: 48 kHz and 3000 baud do.

        Raises
        ------
        ValueError
            If the clock is too slow or too fast for them.
        """
        turn = in_range("turn", turn, 1, 10_000)
        clock = in_range("clock", clock, -(-turn * (SPEEDS - 1) // 60), MAX_CLOCK)
        step = Fraction(60 * clock, turn)
        return cls(bit=bit_period(clock, baud), modulus=step.numerator, rate=step.denominator,
                   clock=clock)


class Single(MachineComponent):
    """Position controller for one stepper, without a board.

    Its frames are those of :class:`FrameInterpreter`. Nothing on the line delays a step: the rate
    generator runs independently, and a new set-point or speed takes effect in the clock after the
    end of its frame, also for the step under way; with a ramp, within the limits of its
    acceleration, see :class:`Ramp`. Without power the motor makes no step.

    Reset makes no step, and sets position and set-point to 0.

    Parameters
    ----------
    timing : SingleTiming
        Times, in clocks.
    unipolar : bool
        The motor is unipolar: the coil words are in the order of its wires, see
        :mod:`fresa.drive.sequences`.
    full_step : bool
        Take every other phase, those with both windings on; a step is then twice as long.
    ramp : int
        Acceleration in steps/s², steps as they are made, up to ``MAX_ACCELERATION``; 0 for none.
    top_speed : int
        With a ramp, the highest speed in rpm, in the range of speeds. A higher one is clamped to
        it.
    greeting, help_text : bytes
        See :class:`FrameInterpreter`.

    Members
    -------
    rx : In(1)
        The line from the terminal, synchronous to the clock.
    tx : Out(1)
        The line to it.
    coils : Out(4)
        Coil word, or 0 without power.
    enable : Out(1)
        Power for the bridge.
    position : Out(14)
        Position in steps; 0 after reset.
    moving : Out(1)
        It has power, and is not at its set-point, or goes past it to slow down.
    fault : Out(1)
        A state register was upset: no step is made until reset.

    Raises
    ------
    ValueError
        If a parameter is out of range, or the ramp to the highest speed would take too many steps.
    """

    rx: In(1)
    tx: Out(1)
    coils: Out(4)
    enable: Out(1)
    position: Out(range(POSITIONS))
    moving: Out(1)
    fault: Out(1)

    roles = {
        "rx": RX, "tx": TX, "coils": COILS, "enable": ENABLE, "position": NUMBER,
        "moving": STATUS, "fault": STATUS,
    }

    def __init__(self, *, timing: SingleTiming | None = None, unipolar: bool = False,
                 full_step: bool = False, ramp: int = 0, top_speed: int = TOP_SPEED,
                 greeting: bytes = GREETING, help_text: bytes = HELP) -> None:
        timing = timing or SingleTiming.real()
        ramp = in_range("ramp", ramp, 0, MAX_ACCELERATION)
        top_speed = in_range("top_speed", top_speed, 1, SPEEDS - 1)
        width = (POSITIONS - 1).bit_length() + 1
        if ramp:
            self.rpm, modulus = timing.rate * FINE, timing.modulus * FINE
            rates = ramp_rates(acceleration=ramp, top=top_speed * self.rpm, modulus=modulus,
                               clock=timing.clock)
            self._move = Ramp(rates=rates, max_rate=self.rpm * (SPEEDS - 1), width=width)
            highest = rates[-1]
        else:
            self.rpm, modulus = timing.rate, timing.modulus
            self._move = MoveTo(width=width)
            highest = self.rpm * (SPEEDS - 1)
        # Rates are limited before; a limit of all ones needs no comparison here.
        most = (1 << highest.bit_length()) - 1
        self._rate = RateGenerator(modulus=modulus, max_rate=min(most, modulus))
        self._receiver = UARTReceiver(period=timing.bit)
        self._transmitter = UARTTransmitter(period=timing.bit)
        self._lines = LineReader(length=FRAME, start=b":")
        self._commands = FrameInterpreter(greeting=greeting, help_text=help_text)
        phases = PHASES[1::2] if full_step else PHASES
        self._driver = PhaseDriver(sequence=swap_inner(phases) if unipolar else phases,
                                   period=timing.modulus // (timing.rate * (SPEEDS - 1)))
        super().__init__()

    def elaborate(self, platform) -> Module:
        m = Module()

        m.submodules.receiver = receiver = self._receiver
        m.submodules.lines = lines = self._lines
        m.submodules.commands = commands = self._commands
        m.submodules.transmitter = transmitter = self._transmitter
        connect(m, receiver.bytes, lines.bytes)
        connect(m, lines.items, commands.items)
        connect(m, commands.bytes, transmitter.bytes)

        m.submodules.rate = rate = self._rate
        m.submodules.move = move = self._move
        m.submodules.driver = driver = self._driver
        requested_rate = commands.speed * self.rpm
        if isinstance(move, Ramp):
            m.d.comb += [move.target.eq(commands.target), move.requested_rate.eq(requested_rate)]
            step = move.step
        else:
            m.d.comb += move.target_n.eq(~Value.cast(Cat(commands.target, Const(0, 1))))
            step = move.step
            if driver.period > 1:
                # Compared a clock ahead, since that takes long. A step that was made in that clock
                # is not seen yet, but then no other is due.
                wanted = Signal()
                m.d.sync += wanted.eq(move.position != commands.next_target)
                step = wanted & ~self.fault
        m.d.comb += [
            receiver.rx.eq(self.rx),
            self.tx.eq(transmitter.tx),
            self.fault.eq(receiver.fault | commands.fault),

            move.run.eq(commands.enable & ~self.fault),
            move.moved.eq(driver.moved),
            commands.position.eq(move.position),
            rate.rate.eq(move.rate if isinstance(move, Ramp) else requested_rate),
            rate.moved.eq(driver.moved),
            driver.step.eq(step & rate.due),
            driver.direction.eq(move.direction),
            driver.enable.eq(commands.enable),

            self.coils.eq(driver.coils),
            self.enable.eq(commands.enable),
            self.position.eq(move.position),
            self.moving.eq(move.step),
        ]

        return m
