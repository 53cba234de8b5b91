"""`gcode`: a CNC controller for three axes, from G-code on a serial line to steps."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import floor
from re import fullmatch, search
from types import MappingProxyType

from amaranth import Cat, Module, Mux, ResetInserter, Signal, Value, signed
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out, connect

from ..arithmetic import Line
from ..checks import in_range, power_of_two
from ..choice import add_choice
from ..clock import CLOCK, clocks_of
from ..drive import (
    FULL_POWER,
    MAX_PULSE,
    MIN_SERVO_PERIOD,
    SERVO_PERIOD,
    PendingSteps,
    PowerPWM,
    ServoPulse,
    SpindlePower,
    StepDirDriver,
    StepDirPair,
    pwm_frequency,
)
from ..motion import (
    KINEMATICS,
    MAX_BACKLASH,
    MAX_BLOCKS,
    AccessoryRestart,
    AlarmCode,
    BacklashCompensator,
    BlockMotion,
    GCodeControl,
    GCodeHoming,
    GCodePlanner,
    GCodeProbing,
    Overrides,
)
from ..panel import ContactFilter
from ..protocol import (
    MAX_SILENCE,
    MAX_WIDTH,
    NEVER_IDLE,
    SETTINGS,
    STARTUP_LINES,
    STORED_LENGTH,
    GCodeActionKind,
    GCodeGate,
    GCodeInterpreter,
    GCodeKind,
    GCodeList,
    GCodeLister,
    GCodeMessage,
    GCodeReader,
    GCodeReporter,
    GCodeSettingStore,
    GCodeState,
    GCodeStatus,
    LineBuffer,
    RealtimeCode,
    RealtimeFilter,
    StoredLines,
    StoredProgram,
    ThesisDialect,
    UARTReceiver,
    UARTTransmitter,
    bit_period,
    setting_index,
    setting_values,
)
from ..roles import (
    BUTTON,
    COOLANT,
    DIRECTION,
    DOOR,
    ENABLE,
    LIMIT,
    MOTOR_FAULT,
    PROBE,
    RX,
    SERVO,
    SPINDLE,
    STATUS,
    STEP,
    STOP,
    TX,
    MachineComponent,
)

__all__ = ["AXES", "BAUDS", "GCode", "GCodeSettings"]

AXES = 3
AXIS_NAMES = "x", "y", "z"

BAUDS = {"grbl": 115_200, "thesis": 19_200}
"""Bits a second on the line, by dialect."""

THESIS_SETTINGS = {21: Fraction(0), 22: Fraction(1), 23: Fraction(0b011)}
"""Further settings of the thesis' machine: its end stops block steps, and home X and Y down."""

TICK = 4
"""Clocks by which two steps may be closer than the speed says, in a line: a tick."""

SECOND_MOTOR = {"second_step": (STEP, Out(1)), "second_direction": (DIRECTION, Out(1)),
                "second_limit": (LIMIT, In(1))}
"""Further ports of a machine with a second motor on one axis: roles and members."""


@dataclass(frozen=True)
class GCodeSettings:
    """What a machine is: its motors, its drivers and its limits.

    Attributes
    ----------
    clock : int
        Clock in Hz, from 2 000 000.
    dialect : str
        ``grbl``, or ``thesis``: that of the firmware of the thesis.
    baud : int, optional
        Bits a second on the line; `BAUDS` has what they are unless given.
    steps_per_mm : sequence of Fraction
        Steps per mm of each axis: $100 to $102.
    max_rate : sequence of Fraction
        Highest speed of each axis in mm/min: $110 to $112.
    acceleration : sequence of Fraction
        Of each axis in mm/s²: $120 to $122.
    deviation : Fraction
        Junction deviation in mm: $11.
    width_ns, low_ns, setup_ns, hold_ns : int
        Times of the driver modules, see :class:`StepDirDriver`; by default those of an A4988. The
        first is $0, in us.
    others : sequence of tuple
        Further settings: the number that GRBL gives it, and a value, see `SETTINGS`.
    depth : int
        Blocks that are looked ahead.
    receive : int
        Bytes of the receive buffer.
    pwm_hz : int
        Frequency of the PWM of the spindle.
    kinematics : str
        What the motors of X and Y move: ``cartesian``, an axis each, or ``corexy``.
    second_motor : str, optional
        The axis that has a second motor, such as that of a gantry: ``x``, ``y`` or ``z``.
    program : bytes
        A program that the start button runs, see :class:`StoredProgram`; none if empty.
    probing : bool
        It has G38.2 to G38.5; the dialect of the thesis has not.
    startup : sequence of str
        Lines that are run at every start, up to two: $N0 and $N1.
    startup_lines : bool
        It keeps such lines, and the text of $I; the dialect of the thesis does not.
    single_axes : bool
        It has $HX, $HY and $HZ; the dialect of the thesis has not.
    silence_us, idle_us : int
        Of the thesis: silence that ends a line, and after which motors are off, in us.
    servo_us : int
        From a pulse of the servo to the next, in us; of the thesis, otherwise `SERVO_PERIOD`.

    Raises
    ------
    ValueError
        If a setting is out of range, or pulses cannot make the highest speed.
    """

    clock: int = CLOCK
    dialect: str = "grbl"
    baud: int | None = None
    steps_per_mm: Sequence[Fraction] = (Fraction(250),) * AXES
    max_rate: Sequence[Fraction] = (Fraction(500),) * AXES
    acceleration: Sequence[Fraction] = (Fraction(10),) * AXES
    deviation: Fraction = Fraction(1, 100)
    width_ns: int = 1000
    low_ns: int = 1000
    setup_ns: int = 200
    hold_ns: int = 200
    others: Sequence[tuple[int, Fraction]] = ()
    depth: int = 64
    receive: int = 128
    pwm_hz: int = 1000
    kinematics: str = "cartesian"
    second_motor: str | None = None
    program: bytes = b""
    probing: bool = True
    startup: Sequence[str] = ()
    startup_lines: bool = True
    single_axes: bool = True
    silence_us: int = 10_000
    idle_us: int = 100_000
    servo_us: int = SERVO_PERIOD

    def __post_init__(self) -> None:
        if {len(self.steps_per_mm), len(self.max_rate), len(self.acceleration)} != {AXES}:
            raise ValueError(f"steps, rates and accelerations are those of {AXES} axes")
        if self.dialect not in BAUDS:
            raise ValueError(f"dialect must be {' or '.join(BAUDS)}, not {self.dialect!r}")
        if self.kinematics not in KINEMATICS:
            raise ValueError(f"kinematics must be {' or '.join(KINEMATICS)}, "
                             f"not {self.kinematics!r}")
        if self.kinematics == "corexy" and self.steps_per_mm[0] != self.steps_per_mm[1]:
            raise ValueError("X and Y of corexy must have the same steps per mm")
        self._check_second_motor()
        self._check_startup()
        power_of_two("depth", self.depth, 4, MAX_BLOCKS)
        # Which check ranges
        _ = Line(clock=self.clock), self._values
        pwm_frequency(self.pwm_hz, clock=self.clock)
        _ = self.silence, self.awake
        in_range("servo_us", self.servo_us, MIN_SERVO_PERIOD, SERVO_PERIOD)
        if self.dialect == "grbl" and self.servo_us != SERVO_PERIOD:
            raise ValueError(f"servo_us must be {SERVO_PERIOD}, as $1 is counted by it, "
                             f"not {self.servo_us}")
        for axis, steps, rate in zip("XYZ", self.steps_per_mm, self.max_rate, strict=True):
            most = self.most_rate * 60 / steps
            if rate > most:
                raise ValueError(f"max_rate of {axis} must be at most {float(most):.3f} mm/min "
                                 f"with {float(steps):g} steps/mm, not {float(rate):g}: pulses "
                                 f"are {self.interval} clocks apart")

    def _check_second_motor(self) -> None:
        if self.second_motor is None:
            return
        if self.second_motor not in AXIS_NAMES:
            raise ValueError(f"second_motor must be one of {', '.join(AXIS_NAMES)}, "
                             f"not {self.second_motor!r}")
        if self.kinematics == "corexy" and self.second_motor != "z":
            raise ValueError("with corexy only z may have a second motor, "
                             f"not {self.second_motor}: X and Y have no motors of their own")
        if self.dialect == "thesis":
            raise ValueError("the dialect of the thesis has no second motor: its homing cycle "
                             "squares no gantry")

    def _check_startup(self) -> None:
        in_range("number of startup lines", len(self.startup), 0, STARTUP_LINES)
        if any(self.startup) and not self.stores:
            raise ValueError("there is no room for startup lines where they are left out, and the "
                             "dialect of the thesis has none")
        for number, line in enumerate(self.startup):
            if not fullmatch("[!-~]*", line) or line != line.upper() or search("[(;/$]", line):
                raise ValueError(f"startup line {number} must be upper case, without blanks and "
                                 f"comments, not {line!r}")
            in_range(f"characters of startup line {number}", len(line), 0, STORED_LENGTH)

    @property
    def second_axis(self) -> int | None:
        """Number of the axis that has a second motor."""
        return None if self.second_motor is None else AXIS_NAMES.index(self.second_motor)

    @property
    def _values(self) -> list[int]:
        """Settings by their addresses."""
        return setting_values(self.store, second_motor=self.second_motor is not None)

    @property
    def line_baud(self) -> int:
        """Bits a second on the line."""
        return BAUDS[self.dialect] if self.baud is None else self.baud

    @property
    def options(self) -> str:
        """What it is built with, by GRBL's letters.

        Those of a variable spindle, of M7, of CoreXY, of homing of single axes, of a safety door,
        and of two motors on one axis, squared by homing.
        """
        of_grbl = self.dialect == "grbl"
        return ("V" * of_grbl + "M" * self.mists + "C" * (self.kinematics == "corexy")
                + "H" * self.homes_one + "+" * of_grbl + "2" * (self.second_motor is not None))

    @property
    def mists(self) -> bool:
        """Whether M7 of GRBL switches an output; the dialect of the thesis has no M7."""
        return self.dialect == "grbl"

    @property
    def probes(self) -> bool:
        """Whether it has G38.2 to G38.5."""
        return self.probing and self.dialect == "grbl"

    @property
    def stores(self) -> bool:
        """Whether it keeps startup lines, and a text of the user."""
        return self.startup_lines and self.dialect == "grbl"

    @property
    def homes_one(self) -> bool:
        """Whether it has $HX, $HY and $HZ."""
        return self.single_axes and self.dialect == "grbl"

    @property
    def origin(self) -> tuple[int, ...]:
        """Origin of G54 at power-up, in nm."""
        return (0,) * AXES

    @property
    def defaults(self) -> dict[int, Fraction]:
        """Further settings, unless `others` has them."""
        return {} if self.dialect == "grbl" else THESIS_SETTINGS

    @property
    def bounds(self) -> dict[int, int]:
        """Highest values of some settings as the store has them; 0 for those that stay."""
        return {}

    @property
    def notes(self) -> list[str]:
        """What ``$I`` says besides: what is not kept, and what is left out."""
        return ["Settings and coordinates last until power-off",
                *["Without probing"] * (not self.probes),
                *["Without startup lines"] * (not self.stores)]

    @property
    def bit(self) -> int:
        """Clocks of a bit on the line."""
        return bit_period(self.clock, self.line_baud)

    @property
    def silence(self) -> int:
        """Clocks of silence that end a line of the thesis."""
        return clocks_of("silence_us", self.silence_us, 10**6, clock=self.clock, most=MAX_SILENCE)

    @property
    def awake(self) -> int:
        """Clocks after which idle motors of the thesis are off."""
        return clocks_of("idle_us", self.idle_us, 10**6, clock=self.clock, most=MAX_SILENCE)

    @property
    def driver(self) -> dict[str, int]:
        """Times of the driver modules in clocks."""
        times = {"width": self.width_ns, "low": self.low_ns, "setup": self.setup_ns,
                 "hold": self.hold_ns}
        return {name: clocks_of(f"{name}_ns", time, 10**9, clock=self.clock, most=MAX_PULSE)
                for name, time in times.items()}

    @property
    def interval(self) -> int:
        """Least clocks from a pulse to the next."""
        times = self.driver
        return times["width"] + max(times["low"], times["hold"])

    @property
    def gap(self) -> int:
        """Least clocks from the end of a pulse to the next, and by how many that may be early."""
        return self.interval - self.driver["width"] + TICK

    @property
    def motors(self) -> int:
        """Axes that may ask one motor for steps."""
        return 2 if self.kinematics == "corexy" else 1

    @property
    def most_rate(self) -> Fraction:
        """Steps/s that an axis can make; a tick lies up to 4 clocks from where its step should be.

        A motor that two axes move makes the steps of both.
        """
        return Fraction(self.clock, (self.driver["width"] + self.gap) * self.motors)

    @property
    def filter(self) -> int:
        """Least time for which a limit switch must be on, in clocks: $201."""
        time = self._values[setting_index(201)]
        return -(-time * self.clock // 10**6)

    @property
    def store(self) -> dict[int, int]:
        """Settings by their numbers, as the store has them."""
        values: dict[int, Fraction] = {0: Fraction(self.width_ns, 1000), 11: self.deviation}
        for first, of_axes in ((100, self.steps_per_mm), (110, self.max_rate),
                               (120, self.acceleration)):
            values |= {first + axis: value for axis, value in enumerate(of_axes)}
        others = dict(self.others)
        if twice := values.keys() & others.keys():
            raise ValueError(f"${min(twice)} has a setting of its own, and is not a further one")
        values |= {**self.defaults, **others}
        decimal = {each.number for each in SETTINGS if each.decimal}
        for number, value in values.items():
            if number not in decimal and value != int(value):
                raise ValueError(f"${number} must be a whole number, not {float(value):g}")
        if values.get(20) and not values.get(22):
            raise ValueError("$20, soft limits, needs $22, homing")
        # A rate is rounded down, as the drivers may not be able to make a higher one.
        return {number: floor(value * 1000) if 110 <= number <= 112 else round(value * 1000)
                if number in decimal else int(value) for number, value in values.items()}


class GCode(MachineComponent):
    """CNC controller: programs of G-code come in, steps of three axes go out.

    There is no processor in it, and no computer has to keep up with it, nor to be there: ``start``
    runs a program of its own, if it has one and is idle. All inputs are synchronous
    to the clock. Each line that comes on ``rx`` is answered once, and in order, with ``ok`` or
    ``error:N``, with the codes of GRBL 1.1; ``?`` is answered with a status report, ``!`` holds,
    ``~`` goes on, and byte 0x18 resets, see :class:`GCodeControl`.

    Lines are planned as they come, ``depth`` blocks ahead: each is made as fast as its feed, the
    limits of the axes and the corners ahead allow, at an acceleration that is never exceeded.

    In the dialect of the thesis lines are those of :class:`ThesisDialect`, or end after 10 ms of
    silence; G28 is the `simple` cycle of :class:`GCodeHoming`; M0 waits until nothing moves, no
    more. An axis makes no step towards its limit switch while that is on, nor beyond its
    travel, and where it is stays known. The motors are off after M5, and 100 ms after the last
    byte or motion. The servo is up, $211, where Z is above 0 and while it homes, otherwise
    down, $210. There is no spindle.

    Parameters
    ----------
    settings : GCodeSettings
        Motors, drivers and limits.

    Members
    -------
    rx : In(1)
        The line from the host.
    limits : In(3)
        Limit switches, 1 where one is on.
    stop : In(1)
        Emergency stop: no step is made while it is 1, nor until a reset.
    door : In(1)
        The door is open: holds, and turns spindle and coolant off; goes on by ``~`` once it is
        closed.
    probe : In(1)
        The probe touches.
    motor_fault : In(1)
        A driver module has stopped: as an emergency stop, with an alarm of its own.
    hold, start, abort : In(1)
        Buttons, 1 while pressed: as ``!``, ``~`` and byte 0x18.
    tx : Out(1)
        The line to the host.
    step, direction : Out(3)
        STEP and DIR of the motors; DIR is on for the way up. $2 and $3 invert them.
    second_limit, second_step, second_direction : In(1), Out(1), Out(1)
        Limit switch, STEP and DIR of the second motor of an axis. Only with `second_motor`.
    enable : Out(1)
        Power of the motors, from the first motion on, with $1 from each to a time after it. $4
        inverts it.
    spindle, reverse : Out(1)
        The spindle turns; counter-clockwise.
    pwm : Out(1)
        Power of the spindle or laser: pulses whose duty follows S, from $31 to $30.
    servo : Out(1)
        The same as pulses for a hobby servo, from $210 to $211.
    mist, flood : Out(1)
        Coolant.
    moving : Out(1)
        Something moves, or waits to move.
    alarm : Out(1)
        Nothing moves until a reset and ``$X``.
    fault : Out(1)
        A register was upset, or steps were lost: never expected. No step is made until reset,
        from the second clock after a part has shown it.

    Raises
    ------
    ValueError
        If a setting is out of range.
    """

    _stored: StoredProgram

    restart_times: Mapping[str, int] = MappingProxyType({})
    """Times of its `AccessoryRestart`, if they are not the usual ones."""

    def __init__(self, *, settings: GCodeSettings | None = None) -> None:
        self.settings = settings = settings or GCodeSettings()
        further = SECOND_MOTOR if settings.second_motor is not None else {}
        self.roles = {
            "rx": RX, "tx": TX, "step": STEP, "direction": DIRECTION, "enable": ENABLE,
            "limits": LIMIT, "stop": STOP, "door": DOOR, "probe": PROBE,
            "motor_fault": MOTOR_FAULT, "hold": BUTTON, "start": BUTTON, "abort": BUTTON,
            "spindle": SPINDLE, "reverse": SPINDLE, "pwm": SPINDLE, "servo": SERVO,
            "mist": COOLANT, "flood": COOLANT,
            "moving": STATUS, "alarm": STATUS, "fault": STATUS,
            **{name: role for name, (role, _) in further.items()},
        }
        super().__init__({
            "rx": In(1), "limits": In(AXES), "stop": In(1), "door": In(1), "probe": In(1),
            "motor_fault": In(1), "hold": In(1), "start": In(1), "abort": In(1),
            "tx": Out(1), "step": Out(AXES), "direction": Out(AXES), "enable": Out(1),
            "spindle": Out(1), "reverse": Out(1), "pwm": Out(1), "servo": Out(1),
            "mist": Out(1), "flood": Out(1),
            "moving": Out(1), "alarm": Out(1), "fault": Out(1),
            **{name: member for name, (_, member) in further.items()},
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        settings = self.settings
        m.submodules.control = control = GCodeControl()
        # A clock after the control has decided: from there it is far to all that is reset.
        renewed = Signal()
        m.d.sync += renewed.eq(control.reset | control.flush)
        anew = ResetInserter(renewed)
        faults = [control.fault]

        discards = Signal()  # a jog that stands
        restart, restarts = Signal(), Signal()  # a clock later, as it is far
        m.d.sync += restart.eq(restarts)
        begins, configures = Signal(init=1), Signal(init=1)
        settling, moving = Signal(), Signal()

        # From the line to actions
        m.submodules.receiver = receiver = UARTReceiver(period=settings.bit)
        m.submodules.realtime = realtime = RealtimeFilter()
        thesis = settings.dialect == "thesis"
        buffer = LineBuffer(depth=settings.receive,
                            silence=settings.silence if thesis else None)
        reader = GCodeReader()
        gate = GCodeGate(stores=settings.stores, homes_one=settings.homes_one)
        lister = GCodeLister()
        interpreter = GCodeInterpreter(probing=settings.probes, origin=settings.origin)
        planner = GCodePlanner(line=Line(clock=settings.clock), gap=settings.gap,
                               motors=settings.motors)
        homing = self._homing()
        for name, part in (("buffer", buffer), ("reader", reader), ("gate", gate),
                           ("interpreter", interpreter), ("lister", lister),
                           ("planner", planner), ("homing", homing)):
            m.submodules[name] = anew(part)
        connect(m, receiver.bytes, realtime.bytes)
        connect(m, realtime.rest, buffer.bytes)
        answers = self._answers(m, control, gate, interpreter, renewed)
        stored = self._store_lines(m, anew, control, reader, gate, homing, answers, faults)
        lines, said = self._program(m, anew, control, interpreter,
                                    stored.said if stored else answers, buffer.items, faults,
                                    renewed)
        connect(m, lines, stored.lines if stored else reader.items)
        m.d.comb += [
            receiver.rx.eq(self.rx),
            gate.locked.eq((control.state == GCodeState.ALARM)
                           | (control.state == GCodeState.SLEEP)),
            gate.jogging.eq(control.jogging), gate.waiting.eq(interpreter.waits),
            control.check.eq(gate.checking),
            gate.answered.eq(answers.valid & answers.ready),
            gate.accepted.eq(answers.payload == 0),
            planner.operand.eq(interpreter.operand),
            interpreter.operand_address.eq(planner.operand_address),
            interpreter.verdict.eq(planner.verdict),
            interpreter.erase.eq(gate.erase), interpreter.erase_address.eq(gate.erase_address),
            interpreter.shown_address.eq(lister.address), interpreter.divide.eq(lister.divide),
            interpreter.division.eq(lister.division), lister.divided.eq(interpreter.divided),
            lister.quotient.eq(interpreter.shown),
            lister.modes.eq(interpreter.modes), lister.feed_zero.eq(interpreter.feed_zero),
            lister.list.eq(gate.list),
            lister.start.eq(gate.listing), gate.all_listed.eq(lister.done),
        ]
        probing = GCodeProbing() if settings.probes else None
        actions = interpreter.actions
        if probing is not None:
            m.submodules.probing = anew(probing)
            connect(m, actions, probing.actions)
            actions = probing.passed
            faults.append(probing.fault)
        # A report is of one origin: another waits until it is sent, and the next report for that.
        shows, offsets = Signal(), Signal()
        m.d.comb += [
            offsets.eq(actions.valid & (actions.p.kind == GCodeActionKind.OFFSETS)),
            planner.actions.payload.eq(actions.payload), actions.ready.eq(planner.actions.ready),
            planner.actions.valid.eq(actions.valid & ~(shows & offsets)),
        ]
        # A clock later, as it is far; nothing is left of them where a reset began meanwhile.
        for name in ("unlock", "sleep", "restart", "restoring"):
            asked = Signal(name=f"asks_{name}")
            m.d.sync += asked.eq(getattr(gate, name) & ~renewed)
            m.d.comb += getattr(control, name).eq(asked & ~renewed)
        missed = Signal()  # steps, since where the axes are was last taken over
        discarded = Signal()  # a jog, likewise
        # A line that follows waits until it is known where it begins. When its words can come it
        # has been between lines for a clock: what answers them takes longer.
        between = Signal()
        m.d.sync += between.eq(interpreter.position.ready)
        self._words(m, gate, interpreter, planner, probing, renewed,
                    settling | ((missed | discarded) & between), discarded)
        faults += [receiver.fault, gate.fault, interpreter.fault, lister.fault, planner.fault,
                   homing.fault]

        # From blocks to steps
        m.submodules.motion = motion = BlockMotion(
            clock=settings.clock, depth=settings.depth)
        checks = Signal()  # nothing is done of what is planned until a reset
        m.d.sync += checks.eq((checks | (control.state == GCodeState.CHECK)) & ~renewed)
        drops = checks | discarded
        m.d.comb += [motion.words.payload.eq(planner.words.payload),
                     motion.words.valid.eq(planner.words.valid & ~drops),
                     planner.words.ready.eq(motion.words.ready | drops)]
        m.submodules.settings = store = GCodeSettingStore(
            values=settings.store, second_motor=settings.second_motor is not None,
            bounds=settings.bounds)
        flags = store.flags
        switches = Signal(AXES + 2)
        blocked, powered = Signal(AXES), Signal()
        positions = self._drivers(m, control, motion, planner, homing, probing, store, faults,
                                  blocked, powered, restarts)
        m.d.comb += [
            planner.room.eq(motion.free > 1), planner.speed.eq(motion.speed),
            planner.spindle_speed.eq(motion.extra),
            motion.hold.eq(control.hold | homing.brake | (probing.brake if probing else 0)),
            motion.flush.eq(restart | discards),
            motion.off.eq(renewed | control.stop | (control.state == GCodeState.SLEEP)),
            control.standing.eq(motion.still),
            control.ended.eq(0 if thesis else motion.ended),
        ]
        m.d.sync += control.moving.eq(moving)
        jogs = interpreter.actions.valid & (interpreter.actions.p.kind == GCodeActionKind.JOG)
        m.d.sync += [
            control.jogging.eq((jogs | (control.jogging & ~motion.idle)) & ~renewed),
            discards.eq(control.cancelled),
            discarded.eq((control.cancelled | discarded) & ~(restarts | renewed)),
        ]
        for axis in range(AXES):
            # Places are counted from 34 m below 0, which with an odd number of steps per metre is
            # not a whole number of turns of these two bits.
            below = planner.steps_per_metre[axis][0] << 1
            m.d.comb += [motion.position[axis].eq(positions[axis][:2] + below),
                         motion.steps[axis].eq(planner.steps_per_metre[axis])]
        faults += [motion.fault]

        # Settings, then where the axes are
        with m.If(renewed):
            m.d.sync += configures.eq(1)
        with m.Elif(planner.configured):
            m.d.sync += configures.eq(0)
        with m.If(restarts):
            m.d.sync += begins.eq(1)
        with m.Elif(planner.begun):
            m.d.sync += begins.eq(0)
        resumes = Signal()  # from where the axes are
        m.d.sync += resumes.eq((missed | discarded) & motion.idle & interpreter.position.ready
                               & ~interpreter.words.valid & ~homing.active & ~settling & ~resumes)
        placing = Signal()  # the block that sets the place is under way
        m.d.sync += placing.eq((planner.begun | (placing & ~motion.idle)) & ~restarts)
        m.d.comb += [
            moving.eq(~motion.idle & ~settling),
            restarts.eq(renewed | planner.configured | homing.restart | resumes
                        | (probing.restart if probing else 0)),
            settling.eq(configures | begins | placing),
            planner.begin.eq(begins & ~configures),
        ]
        self._system(m, control, renewed, gate, planner, motion, homing, store)
        m.submodules.overrides = overrides = Overrides()
        m.submodules.accessories = accessories = AccessoryRestart(**self.restart_times)
        outputs = overrides.outputs
        was_off = Signal()
        m.d.sync += was_off.eq(motion.off)
        m.d.comb += [
            overrides.command.eq(realtime.command), overrides.code.eq(realtime.code),
            control.spindle_restored.eq(overrides.spindle_restored),
            overrides.restore.eq(renewed | motion.off & ~was_off | motion.ended),
            overrides.program.eq(motion.outputs),
            overrides.switches.eq(Cat(control.state == each for each in (
                GCodeState.IDLE, GCodeState.RUN, GCodeState.HOLD, GCodeState.JOG)).any()),
            overrides.standing.eq((control.state == GCodeState.HOLD) & motion.still),
            overrides.laser.eq(flags.laser),
            # A spindle that was stopped stays so in DOOR, and in ALARM until the outputs are off.
            overrides.held.eq(Cat(control.state == each for each in (
                GCodeState.HOLD, GCodeState.DOOR, GCodeState.ALARM)).any() & ~accessories.restart),
            planner.feed_override.eq(overrides.feed), planner.rapid_override.eq(overrides.rapid),
            motion.feed_override.eq(overrides.feed), motion.rapid_override.eq(overrides.rapid),
        ]
        at_door = control.state == GCodeState.DOOR
        m.d.comb += [
            accessories.off.eq(at_door & ~control.substate[1]),  # it stands
            accessories.restart.eq(at_door & control.substate.all()),
            # As long as one is to be on it is turned on by a restart alone.
            accessories.release.eq(renewed | ~(accessories.spindle | accessories.coolant)),
            accessories.coolant.eq(overrides.coolant), accessories.laser.eq(flags.laser),
            control.restarted.eq(accessories.restarted),
            overrides.spindle_off.eq(accessories.spindle_off),
            overrides.coolant_off.eq(accessories.coolant_off),
        ]
        if not thesis:  # there a spindle is what keeps the motors on
            m.d.comb += accessories.spindle.eq(self._spins(motion))
        m.d.comb += [gate.settling.eq(settling), homing.begins.eq(settling),
                     homing.moving.eq(control.moving)]
        pausing = Signal()  # the control holds since the program pauses
        m.d.sync += pausing.eq(motion.paused & ~control.reset)
        if not thesis:
            # In an alarm, such as that of a probing in the same line, it does not wait.
            m.d.comb += [control.pause.eq(motion.paused & ~pausing),
                         motion.start.eq(motion.paused & pausing & (
                             ~control.hold | (control.state == GCodeState.ALARM)))]

        contacts = self._inputs(m, control, realtime, planner, flags)
        m.d.comb += [switches.eq(contacts), homing.switches.eq(switches[:AXES])]
        second = settings.second_axis
        if second is not None:  # shown as one, but for homing
            m.d.comb += [switches[second].eq(Cat(contacts[second], contacts[-1]).any()),
                         homing.switches[second].eq(contacts[second]),
                         homing.second_switch.eq(contacts[-1])]

        # What is said
        m.submodules.reporter = reporter = GCodeReporter(
            dialect=settings.dialect, options=settings.options, blocks=settings.depth - 1,
            receive=settings.receive, position_bits=len(planner.shown), stores=settings.stores,
            notes=settings.notes)
        m.submodules.transmitter = transmitter = UARTTransmitter(period=settings.bit)
        connect(m, said, reporter.answers)
        connect(m, control.messages, reporter.messages)
        connect(m, control.alarms, reporter.alarms)
        connect(m, self._sent(m, reporter.bytes), transmitter.bytes)
        # Of these sources of parts never more than one has any.
        parts = [lister.parts, gate.listed, *([stored.replies] if stored else [])]
        for part in parts:
            m.d.comb += part.ready.eq(reporter.listed.ready)
            with m.If(part.valid):
                m.d.comb += [reporter.listed.valid.eq(1), reporter.listed.payload.eq(part.payload)]
        if stored:
            m.d.comb += [stored.shown.eq(reporter.stored),
                         stored.wanted.eq(reporter.stored_wanted)]
            connect(m, stored.text, reporter.stored_text)
        self._reports(m, control, gate, planner, motion, lister, reporter, switches, store,
                      configures, shows, offsets & planner.room)
        if probing is not None:
            self._probe(m, control, renewed, gate, lister, planner, motion, probing,
                        switches[AXES], checks=checks, settling=settling)
        self._overrides(m, overrides, reporter)
        # As GRBL does: with one block less than there are
        m.d.sync += reporter.free_blocks.eq(motion.free - (motion.free != 0))
        m.d.comb += [
            reporter.abandon.eq(renewed),
            reporter.free_bytes.eq(buffer.free),
            self.tx.eq(transmitter.tx),
        ]
        faults += [reporter.fault]

        self._tools(m, outputs)
        m.d.sync += [
            self.moving.eq(moving), self.alarm.eq(control.state == GCodeState.ALARM),
        ]
        if thesis:
            dialect = ThesisDialect()
            m.submodules.dialect = anew(dialect)
            connect(m, reader.words, dialect.words)
            connect(m, dialect.passed, gate.words)
            m.d.comb += [dialect.answered.eq(gate.answered),
                         dialect.resting.eq(gate.resting & ~settling),
                         motion.start.eq(motion.paused)]
            faults.append(dialect.fault)
            up = homing.active | (positions[2] > 0)
            self._motors(m, control, motion, receiver, homing.active, powered)
            self._block(m, motion, planner, switches, positions, flags.lower, blocked)
            with m.If((motion.step & blocked).any()):
                m.d.sync += missed.eq(1)
            with m.If(restarts):
                m.d.sync += missed.eq(0)
            beat = self._servo(m, store, Mux(up, FULL_POWER, 0))
        else:
            connect(m, reader.words, gate.words)
            beat = self._servo(m, store, self._spindle(m, motion, overrides, store, faults))
            self._idle(m, control, ~motion.still | homing.active,
                       store.drive.idle_delay, beat, powered)
        m.d.comb += accessories.beat.eq(beat)
        shown = Signal(len(faults))  # by parts, a clock before: from all of them it is far
        m.d.sync += shown.eq(Cat(faults))
        with m.If(shown.any()):
            m.d.sync += self.fault.eq(1)
        return m

    def _homing(self) -> wiring.Component:
        """Return what carries out homing cycles."""
        return GCodeHoming(simple=self.settings.dialect == "thesis",
                           squared_axis=self.settings.second_axis)

    def _sent(self, m: Module, said: stream.Interface) -> stream.Interface:
        """Return the bytes to be sent, of those that the machine says."""
        return said

    def _spins(self, motion: BlockMotion) -> Value:
        """Return that the program has turned the spindle on."""
        return motion.outputs.clockwise | motion.outputs.counter_clockwise

    def _tools(self, m: Module, outputs) -> None:
        """Switch spindle and coolant."""
        if self.settings.dialect != "thesis":
            m.d.sync += [
                self.spindle.eq(outputs.clockwise | outputs.counter_clockwise),
                self.reverse.eq(outputs.counter_clockwise)]
        m.d.sync += [self.mist.eq(outputs.mist), self.flood.eq(outputs.flood)]

    def _idle(self, m: Module, control: GCodeControl, busy: Value, delay: Value, beat: Signal,
              powered: Signal) -> None:
        """Give the motors power from the first motion on, and from each to the time of $1 after."""
        left = Signal(signed(len(delay) + 1), init=NEVER_IDLE)  # ms; below 0 it is over
        with m.If(busy):
            m.d.sync += left.eq(delay)
        with m.Elif(beat & (left >= 0) & (delay != NEVER_IDLE)):
            m.d.sync += left.eq(left - 1)
        m.d.comb += powered.eq(control.enable & (left >= 0))

    def _motors(self, m: Module, control: GCodeControl, motion: BlockMotion,
                receiver: UARTReceiver, homes: Signal, powered: Signal) -> None:
        """Give the motors power while something moves, and after M3 as long as bytes come."""
        left = Signal(range(self.settings.awake + 1))
        with m.If(receiver.bytes.valid | ~motion.idle):
            m.d.sync += left.eq(self.settings.awake)
        with m.Elif(left != 0):
            m.d.sync += left.eq(left - 1)
        wanted = Signal()
        m.d.sync += wanted.eq((motion.outputs.clockwise & (left != 0)) | homes | ~motion.still)
        m.d.comb += powered.eq(wanted & ~control.stop)

    def _block(self, m: Module, motion: BlockMotion, planner: GCodePlanner, switches: Signal,
               positions: Sequence[Value], lower: Value, blocked: Signal) -> None:
        """Block steps towards a limit switch that is on, and beyond the travel from it."""
        for axis in range(AXES):
            length, away = planner.lengths[axis], motion.direction[axis] == lower[axis]
            far = Signal(name=f"far_{axis}")
            m.d.sync += far.eq(Mux(lower[axis], positions[axis] >= length,
                                   positions[axis] <= -length))
            m.d.comb += blocked[axis].eq(Mux(away, far, switches[axis]))

    def _store_lines(self, m: Module, anew: Callable, control: GCodeControl, reader: GCodeReader,
                     gate: GCodeGate, homing, answers: stream.Interface, faults: list
                     ) -> StoredLines | None:
        """Have lines run at every start, and after homing, if the machine keeps any."""
        if not self.settings.stores:
            return None
        stored = StoredLines([line.encode() for line in self.settings.startup])
        m.submodules.stored = anew(stored)
        connect(m, stored.items, reader.items)
        connect(m, answers, stored.answers)
        m.d.comb += [
            stored.locked.eq(gate.locked), stored.held.eq(control.state == GCodeState.DOOR),
            stored.run.eq(homing.done & (gate.homes == 3)),
            stored.slot.eq(gate.slot), stored.writing.eq(gate.writing), stored.keep.eq(gate.keep),
            stored.seen.eq(reader.seen), stored.character.eq(reader.character),
            stored.restore.eq(gate.restoring_texts), gate.too_long.eq(stored.too_long),
        ]
        faults.append(stored.fault)
        return stored

    def _program(self, m: Module, anew: Callable, control: GCodeControl,
                 interpreter: GCodeInterpreter, answers: stream.Interface,
                 lines: stream.Interface, faults: list, renewed: Signal
                 ) -> tuple[stream.Interface, stream.Interface]:
        """Return the lines to be read, and their answers, with those of the program of its own."""
        if not self.settings.program:
            return lines, answers
        program = StoredProgram(self.settings.program)
        m.submodules.program = anew(program)
        connect(m, lines, program.lines)
        said = answers.signature.create()
        pressed, silent = Signal(), Signal()
        m.d.sync += pressed.eq(self.start)
        m.d.comb += [
            silent.eq(program.running & (answers.payload == 0)),
            said.payload.eq(answers.payload), said.valid.eq(answers.valid & ~silent),
            answers.ready.eq(said.ready | silent),
            program.answered.eq(answers.valid & answers.ready),
            program.refused.eq(answers.payload != 0),
            program.run.eq(self.start & ~pressed & self._may_run(control)),
            program.ended.eq(interpreter.actions.valid & interpreter.actions.ready
                             & (interpreter.actions.p.kind == GCodeActionKind.END)),
        ]
        faults.append(program.fault)
        self._stored = program
        return program.items, said

    def _may_run(self, control: GCodeControl) -> Value:
        """Return that the program of its own may be started."""
        return control.state == GCodeState.IDLE

    def _answers(self, m: Module, control: GCodeControl, gate: GCodeGate,
                 interpreter: GCodeInterpreter, renewed: Signal) -> stream.Interface:
        """Return the answers of lines, from a register: to what sends them it is far.

        That of a program's end comes once the end has been made and said; in the dialect of the
        thesis, which says nothing, at once.
        """
        answers = interpreter.answers
        kept = answers.signature.create()
        takes = ~kept.valid
        if self.settings.dialect != "thesis":
            said = Signal()
            m.d.sync += said.eq(interpreter.ending & (said | (
                control.messages.valid & control.messages.ready
                & (control.messages.payload == GCodeMessage.PROGRAM_END))))
            takes &= ~interpreter.ending | said | gate.checking
        m.d.comb += answers.ready.eq(takes)
        with m.If(takes):
            m.d.sync += [kept.payload.eq(answers.payload), kept.valid.eq(answers.valid)]
        with m.Elif(kept.ready):
            m.d.sync += kept.valid.eq(0)
        with m.If(renewed):
            m.d.sync += kept.valid.eq(0)
        return kept

    def _words(self, m: Module, gate: GCodeGate, interpreter: GCodeInterpreter,
               planner: GCodePlanner, probing: GCodeProbing | None, renewed: Signal,
               settling: Value, discarded: Signal) -> None:
        """Pass words and positions on, from registers: lines wait until they know where they begin.

        What follows a line waits until that is answered, as the gate has to know. A line that had
        begun when a jog was discarded is refused, as nothing would be done of it; another jog that
        had is a part of what is discarded.
        """
        words = interpreter.words
        takes = Signal()
        answering = Signal()  # a line is not answered
        m.d.comb += [takes.eq(~words.valid & ~answering), gate.passed.ready.eq(takes & ~settling)]
        with m.If(gate.answered):
            m.d.sync += answering.eq(0)
        with m.If(words.ready):
            m.d.sync += words.valid.eq(0)
        with m.If(takes):
            m.d.sync += [words.payload.eq(gate.passed.payload),
                         words.valid.eq(gate.passed.valid & ~settling),
                         answering.eq(gate.passed.valid & ~settling
                                      & (gate.passed.p.kind == GCodeKind.END))]
            with m.If(discarded & (gate.passed.p.kind == GCodeKind.END) & ~gate.passed.p.system
                      & (gate.passed.p.status == GCodeStatus.GOOD)):
                m.d.sync += words.p.status.eq(GCodeStatus.LOCKED)
        position = interpreter.position
        m.d.comb += planner.positions.ready.eq(~position.valid)
        with m.If(~position.valid):
            m.d.sync += [position.valid.eq(planner.positions.valid),
                         position.p.axis.eq(planner.positions.p.axis),
                         position.p.value.eq(planner.positions.p.value)]
            if probing is not None:
                m.d.sync += position.p.axis[2].eq(probing.measures)
        with m.Elif(position.ready):
            m.d.sync += position.valid.eq(0)
        with m.If(renewed):
            m.d.sync += [words.valid.eq(0), answering.eq(0), position.valid.eq(0)]

    def _system(self, m: Module, control: GCodeControl, renewed: Signal, gate: GCodeGate,
                planner: GCodePlanner, motion: BlockMotion, homing,
                store: GCodeSettingStore) -> None:
        """Carry out what system lines want: settings, and the homing cycle."""
        # Whose addresses they are is known long before the first.
        configuring, seeking = Signal(), Signal()
        wanted = Signal.like(store.address)
        m.d.sync += [
            configuring.eq(planner.configure), seeking.eq(homing.active),
            gate.resting.eq(motion.idle & ((control.state == GCodeState.IDLE)
                                           | (control.state == GCodeState.ALARM))),
            control.failure.eq(homing.failure),
        ]
        self._home(m, gate, planner, motion, homing, store)
        m.d.comb += [
            wanted.eq(planner.setting_address),
            store.address.eq(Mux(configuring | seeking, wanted, gate.address)),
            store.write_address.eq(gate.write_address), store.data.eq(gate.data),
            store.trial.eq(gate.trial), store.write.eq(gate.write),
            planner.setting.eq(store.value), planner.soft.eq(store.flags.soft),
            gate.stopped.eq(control.stop | control.critical), gate.door.eq(control.door),
            gate.configured.eq(planner.configured), gate.refused.eq(planner.verdict != 0),
            gate.homed.eq(homing.done), homing.start.eq(gate.home),
            homing.allowed.eq(control.state == GCodeState.HOME),
            control.home.eq(homing.active & ~renewed), control.strict.eq(store.flags.strict),
            control.locked_start.eq(store.flags.homing & (self.settings.dialect == "grbl")),
        ]
        m.d.comb += [getattr(gate, name).eq(getattr(store, name))
                     for name in ("value", "number", "decimal", "least", "most", "initial")]
        if self.settings.kinematics == "corexy":
            with m.If(planner.setting_address == setting_index(101)):
                m.d.comb += wanted.eq(setting_index(100))
        with m.If(planner.beyond):
            m.d.sync += control.failure.eq(AlarmCode.SOFT_LIMIT)
        with m.If(renewed):
            m.d.sync += control.failure.eq(AlarmCode.NONE)

    def _home(self, m: Module, gate: GCodeGate, planner: GCodePlanner, motion: BlockMotion, homing,
              store: GCodeSettingStore) -> None:
        """Have homing cycles made by the planner."""
        m.d.comb += [
            homing.lower.eq(store.flags.lower), homing.homed.eq(planner.homed),
            homing.standing.eq(motion.still),
        ]
        connect(m, homing.request, planner.homing)
        if self.settings.dialect == "grbl":
            m.d.comb += homing.only.eq(gate.homes)

    def _probe(self, m: Module, control: GCodeControl, renewed: Signal, gate: GCodeGate,
               lister: GCodeLister, planner: GCodePlanner, motion: BlockMotion,
               probing: GCodeProbing, contact: Value, *, checks: Signal, settling: Signal) -> None:
        """Give a probing what it needs to know, and list where the probe touched."""
        m.d.comb += [
            probing.contact.eq(contact), probing.checking.eq(checks),
            # It neither begins nor finds its end in a hold, or behind an open door.
            probing.idle.eq(motion.idle & ~settling & ~control.hold),
            # A report that is under way takes where the axes are, not where the probe touched.
            probing.standing.eq(motion.still & ~planner.report),
            probing.begins.eq(settling), probing.listed.eq(lister.done),
            lister.probed.eq(probing.touched), lister.start.eq(gate.listing | probing.listing),
        ]
        with m.If(probing.active):  # the gate waits for the answer of its line
            m.d.comb += lister.list.eq(GCodeList.PROBED)
        with m.If(probing.measures):  # a report would say where it touched, not where it is
            m.d.comb += planner.report.eq(0)
        with m.If((probing.failure != AlarmCode.NONE) & ~renewed):  # else an alarm after the reset
            m.d.sync += control.failure.eq(probing.failure)

    def _drivers(self, m: Module, control: GCodeControl, motion: BlockMotion,
                 planner: GCodePlanner, homing, probing: GCodeProbing | None,
                 store: GCodeSettingStore, faults: list, blocked: Signal, powered: Signal,
                 restarts: Signal) -> list[Signal]:
        """Make the steps at the pins, and count them there; return the counts."""
        times, flags = self.settings.driver, store.flags
        width = Signal.like(planner.pulse, init=times["width"], reset_less=True,
                            name="pulse_width")
        with m.If(planner.configured):
            m.d.sync += width.eq(planner.pulse)
        times["width"] = clocks_of("longest pulse", MAX_WIDTH, 10**9, clock=self.settings.clock,
                                   most=MAX_PULSE)
        made, powers = [], []
        # Where each axis was; in a homing cycle 0 but of the one that homes, so that the others
        # need no choice.
        latched = [Signal(signed(36), name=f"latched_{name}") for name in AXIS_NAMES]
        latched_one = latched[0] | latched[1] | latched[2]
        kinematics = KINEMATICS[self.settings.kinematics]()
        m.d.comb += [kinematics.step.eq(motion.step & ~blocked
                                         & (~self.fault).replicate(AXES)),
                     kinematics.direction.eq(motion.direction)]
        made.append(~kinematics.busy)
        # Behind a stop the profile may still run when a reset comes. What it requests until it is
        # flushed, two clocks later, is dropped as well.
        stopped, drops = Signal(), Signal()
        m.d.sync += [stopped.eq(control.stop | self.fault),
                     drops.eq(control.stop | self.fault | restarts)]
        m.submodules.kinematics = ResetInserter(drops)(kinematics)
        enabled = Signal()
        m.d.sync += enabled.eq(powered)  # where it comes from is far
        tick = Signal()  # steps that take up backlash are this far apart
        # Below 0 until the tick, by the clocks of a second: its sign is all that is looked at.
        clock = self.settings.clock
        phase = Signal(range(-clock, 1 << len(flags.backlash_rate)), init=-clock)
        again = Signal.like(phase)
        m.d.comb += tick.eq(phase[-1] == 0)
        m.d.sync += [again.eq(flags.backlash_rate - clock),
                     phase.eq(add_choice(phase, Mux(tick, again, flags.backlash_rate)))]
        for axis, name in enumerate("xyz"):
            pending = PendingSteps()
            if axis == self.settings.second_axis:
                driver = StepDirPair(**times, adjustable=True)
                halted, dropped = Signal(), Signal()
                m.d.comb += [halted.eq(stopped | homing.halt.all()),
                             dropped.eq(drops | homing.halt.all()),
                             homing.travel.eq(planner.lengths[axis])]
                self._second_motor(m, driver, homing, store, axis)
            else:
                driver = StepDirDriver(**times, adjustable=True)
                halted, dropped = stopped, drops
            m.submodules[f"pending_{name}"] = ResetInserter(dropped)(pending)
            m.submodules[f"driver_{name}"] = driver
            position = Signal(signed(36), name=f"position_{name}")
            backlash = BacklashCompensator(max_backlash=MAX_BACKLASH)
            m.submodules[f"backlash_{name}"] = backlash
            m.d.comb += [
                backlash.backlash.eq(planner.backlash[axis]), backlash.tick.eq(tick),
                backlash.step.eq(kinematics.motor_step[axis]),
                backlash.pending.eq(pending.driver_step), backlash.moved.eq(driver.moved),
                backlash.direction.eq(pending.driver_direction),
                backlash.stop.eq(dropped),
                kinematics.motors[axis].eq(position),
                pending.step.eq(kinematics.motor_step[axis] | backlash.extra),
                pending.direction.eq(Mux(kinematics.motor_step[axis],
                                         kinematics.motor_direction[axis],
                                         backlash.extra_direction)),
                pending.moved.eq(driver.moved),
                driver.step.eq(pending.driver_step & ~halted),
                driver.direction.eq(pending.driver_direction), driver.enable.eq(enabled),
                driver.width_now.eq(width),
                self.step[axis].eq(driver.step_pin ^ store.drive.step_inverted[axis]),
                self.direction[axis].eq(driver.direction_pin ^ flags.inverted[axis]),
                planner.steps[axis].eq(
                    Mux(probing.measures, latched[axis], kinematics.positions[axis])
                    if probing else kinematics.positions[axis]),
            ]
            with m.If(driver.moved | backlash.correct | homing.place):
                change = Mux(homing.place, kinematics.motor_shift[axis],
                             Mux(backlash.correct_direction, 1, -1))
                m.d.sync += position.eq(add_choice(position, change))
            # From the place that was counted to that of the switch, for the axis that homes
            shift = Signal(signed(36), name=f"shift_{name}")
            m.d.comb += kinematics.shift[axis].eq(shift)
            m.d.sync += [shift.eq(0), latched[axis].eq(0)]
            with m.If(homing.axis == axis):
                m.d.sync += [shift.eq(planner.switch - latched_one),
                             latched[axis].eq(latched[axis])]
                with m.If(homing.latch):
                    m.d.sync += latched[axis].eq(kinematics.positions[axis])
            if probing is not None:
                with m.If(probing.active):
                    m.d.sync += latched[axis].eq(Mux(probing.latch, kinematics.positions[axis],
                                                     latched[axis]))
            made.append(~(pending.driver_step | backlash.busy))
            powers.append(driver.enable_pin)
            faults.append(pending.fault)
        m.d.comb += [motion.made.eq(Cat(made).all()),
                     self.enable.eq(Cat(powers).any() ^ store.drive.enable_inverted)]
        return [*kinematics.positions]

    def _second_motor(self, m: Module, driver: StepDirPair, homing,
                      store: GCodeSettingStore, axis: int) -> None:
        """Give the second motor of an axis its pins, and let homing halt each of the two."""
        m.d.comb += [
            self.second_step.eq(driver.second_step_pin
                                ^ store.drive.step_inverted[axis]),
            self.second_direction.eq(driver.second_direction_pin ^ store.second_inverted),
            driver.halt.eq(homing.halt), homing.moved.eq(driver.moved),
        ]

    def _servo(self, m: Module, store: GCodeSettingStore, power: Value) -> Signal:
        """Give the servo its pulses, and return what counts ms."""
        m.submodules.servo = servo = ServoPulse(clock=self.settings.clock,
                                                 period=self.settings.servo_us)
        m.d.comb += [servo.power.eq(power), servo.low.eq(store.flags.servo_low),
                     servo.high.eq(store.flags.servo_high), self.servo.eq(servo.pin)]
        return servo.beat

    def _spindle(self, m: Module, motion: BlockMotion, overrides: Overrides,
                 store: GCodeSettingStore, faults: list) -> Signal:
        """Give the spindle, or the laser, the power that the program wants, and return it."""
        flags = store.flags
        m.submodules.power = power = SpindlePower()
        m.submodules.pwm = pwm = PowerPWM(clock=self.settings.clock,
                                          frequency=self.settings.pwm_hz)
        outputs, rapid = overrides.outputs, motion.feed.all()
        spins = outputs.clockwise | outputs.counter_clockwise
        m.d.comb += [
            power.on.eq(spins & ~(flags.laser & rapid)),
            power.scaled.eq(flags.laser & outputs.counter_clockwise),
            power.speed.eq(motion.extra), power.override.eq(overrides.spindle),
            power.least.eq(store.spindle.least),
            power.most.eq(store.spindle.most), power.path_speed.eq(motion.speed),
            power.feed.eq(motion.feed),
            pwm.power.eq(power.power), self.pwm.eq(pwm.pin),
        ]
        faults.append(power.fault)
        return power.power

    def _switches(self, m: Module, flags: Value) -> tuple[Value, Value]:
        """Return the levels of the limit switches of the axes, and of the probe."""
        return self.limits, self.probe if self.settings.probes else flags.probe_open

    def _inputs(self, m: Module, control: GCodeControl, realtime: RealtimeFilter,
                planner: GCodePlanner, flags: Value) -> Signal:
        """Give the control commands, buttons as such, and contacts that are on for a period.

        Return the limit switches, probe and door, and the limit switch of a second motor.
        """
        buttons = {RealtimeCode.RESET: self.abort, RealtimeCode.HOLD: self.hold,
                   RealtimeCode.RESUME: self.start}
        pressed = Signal(len(buttons))
        waiting = Signal(len(buttons))
        levels = Cat(buttons.values())
        left = Mux(realtime.command, waiting, waiting & (waiting - 1))  # without the lowest
        m.d.sync += [pressed.eq(levels), waiting.eq(left | (levels & ~pressed))]
        m.d.comb += [control.command.eq(realtime.command | waiting.any()),
                     control.code.eq(realtime.code)]
        with m.If(~realtime.command):
            for number, code in reversed([*enumerate(buttons)]):
                with m.If(waiting[number]):
                    m.d.comb += control.code.eq(code)
        period = Signal.like(planner.filter, init=self.settings.filter, reset_less=True)
        with m.If(planner.configured):
            m.d.sync += period.eq(planner.filter)
        # Level and what makes it on: limit switches, probe, door, stop, fault of a driver
        limits, probe = self._switches(m, flags)
        pins = [*((limit, flags.open) for limit in limits), (probe, flags.probe_open),
                (self.door, flags.others_open[1]), (self.stop, flags.others_open[0]),
                (self.motor_fault, flags.others_open[2])]
        if self.settings.second_motor is not None:
            pins.append((self.second_limit, flags.open))
        m.submodules.contacts = contacts = ContactFilter(
            width=len(pins), most=(1 << len(period)) - 1)
        on = contacts.o
        m.d.comb += [contacts.i.eq(Cat(pin ^ is_open for pin, is_open in pins)),
                     contacts.period.eq(period)]
        switches = Signal(AXES + 2)
        stop, motor_fault = Signal(), Signal()
        m.d.comb += [
            Cat(switches, stop, motor_fault).eq(on), control.door.eq(switches[AXES + 1]),
            control.limits.eq(on[:AXES]), control.hard.eq(flags.hard),
            control.emergency.eq(stop | motor_fault), control.motor_fault.eq(motor_fault & ~stop),
        ]
        if self.settings.second_motor is None:
            return switches
        further = Signal(AXES + 3)
        m.d.comb += [further.eq(Cat(switches, on[-1])), control.limits[AXES].eq(on[-1])]
        return further

    def _reports(self, m: Module, control: GCodeControl, gate: GCodeGate, planner: GCodePlanner,
                 motion: BlockMotion, lister: GCodeLister, reporter: GCodeReporter,
                 switches: Value, store: GCodeSettingStore, configures: Signal,
                 shows: Signal, waits: Value) -> None:
        """Compute each report that is wanted, then have it sent; the numbers stay meanwhile.

        So does what it shows: settings are taken between reports, and new ones count for these when
        the planner begins thereafter.
        """
        wanted = Signal()
        computed = Signal()  # and the reporter has not begun yet
        flags, quiet = store.flags, ~shows
        shown, inches = Signal.like(flags.shown), Signal()
        with m.If(planner.begin):
            m.d.sync += [shown.eq(flags.shown), inches.eq(flags.inches)]
        with m.If(control.report):
            m.d.sync += wanted.eq(1)
        with m.If(planner.reported):
            m.d.sync += [wanted.eq(control.report), computed.eq(1)]
        with m.If(reporter.reporting):
            m.d.sync += computed.eq(0)
        m.d.comb += [
            shows.eq(computed | reporter.reporting),
            planner.report.eq(wanted & quiet & ~waits),
            planner.configure.eq((configures | gate.configure) & quiet),
            planner.work.eq(shown[0] == 0), reporter.shown.eq(shown),
            *(each.inches.eq(inches) for each in (planner, lister, reporter)),
            reporter.request.eq(planner.reported),
            reporter.state.eq(control.state), reporter.substate.eq(control.substate),
            reporter.origin_changed.eq(planner.origin_changed),
            planner.shown_address.eq(reporter.number_address),
            planner.shown_read.eq(reporter.number_read), reporter.number.eq(planner.shown),
            reporter.pins.eq(Cat(switches[AXES], switches[:AXES], switches[AXES + 1], self.abort,
                                 self.hold, self.start)),
        ]

    def _overrides(self, m: Module, overrides: Overrides, reporter: GCodeReporter) -> None:
        """Have overrides and accessories in reports."""
        on = overrides.outputs
        m.d.comb += [
            reporter.overridden.eq(overrides.changed),
            *(each.eq(percent) for each, percent in zip(
                reporter.overrides, (overrides.feed, overrides.rapid, overrides.spindle),
                strict=True)),
            reporter.accessories.eq(Cat(on.clockwise, on.counter_clockwise, on.flood, on.mist)),
        ]
