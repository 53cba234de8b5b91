"""`vplotter`: a pen that hangs from two strings, and draws on a wall."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from math import ceil, floor, hypot, sqrt
from types import MappingProxyType

from amaranth import Cat, Const, Module, Mux, Signal, Value, signed
from amaranth.lib import stream
from amaranth.lib.wiring import In, Out, connect

from ..checks import in_range
from ..drive import FULL_POWER, MAX_PERIOD, StringMotor
from ..motion import (
    TICKS_LOG2,
    AlarmCode,
    BlockMotion,
    BowedLine,
    GCodeControl,
    GCodePlanner,
    GCodeProbing,
    Hanging,
    Overrides,
    StringCycles,
    StringHoming,
    nearest_steps,
)
from ..protocol import (
    MAX_MM,
    GCodeGate,
    GCodeInterpreter,
    GCodeReader,
    GCodeSettingStore,
    GCodeState,
    StoredLines,
    WallDialect,
)
from ..roles import (
    BUTTON,
    COILS,
    DOOR,
    LIMIT,
    MOTOR_FAULT,
    PEN,
    RX,
    SERVO,
    STATUS,
    STOP,
    TX,
    MachineComponent,
)
from .gcode import AXES, GCode, GCodeSettings

__all__ = ["VPlotter", "VPlotterSettings"]

PLACE_BITS, LENGTH_BITS = 19, 18
"""Bits of a place in ticks, and of what a motor has paid out, in steps: of both strings at most."""

ANSWERED = 15
"""Clocks in which the reporter has begun to send an answer."""

FRACTION = 16
"""Bits of a fraction of the ticks in a mm."""

OFF_SWITCH = 20
"""Millimetres of string in which a switch has to open, at most."""

LIFT = 20
"""Millimetres from where Z is 0, the pen touching, to the upper end of its travel."""


@dataclass(frozen=True)
class VPlotterSettings(GCodeSettings):
    """What a hanging plotter is: its wall, its strings, and the limits of what hangs there.

    X and Y are counted in ticks, an eighth of a step of a string; Z has no motor, and says whether
    the pen touches. Lines are those of GRBL, or begin with ``:``.

    Attributes
    ----------
    wall_width, wall_height : int
        From pulley to pulley, and from the line of the pulleys to the lower edge of the wall, in
        mm.
    least_y : int
        Upper edge of where it draws, below the line of the pulleys, in mm.
    rest : tuple of int
        Where it is after homing, x and y in mm from the left pulley, y down.
    string_steps : Fraction
        Half steps of a motor per mm of string.
    string_rate : int
        Half steps a second with which strings are wound in a homing cycle, and that the motor with
        more of them makes in a bowed line.
    bowed : bool
        ``:F`` draws as the thesis: each string at constant speed between its lengths at the ends,
        so that the line is bowed. Stopped within it the place is unknown, and reports have the end
        of it from its begin.

    Raises
    ------
    ValueError
        If a setting is out of range.
    """

    baud: int | None = 9600
    steps_per_mm: Sequence[Fraction] = field(init=False, default=())
    max_rate: Sequence[Fraction] = (Fraction(3000), Fraction(3000), Fraction(6000))
    acceleration: Sequence[Fraction] = (Fraction(100),) * AXES
    kinematics: str = field(init=False, default="cartesian")
    second_motor: str | None = field(init=False, default=None)
    probing: bool = field(init=False, default=False)
    dialect: str = field(init=False, default="grbl")
    wall_width: int = 1768
    wall_height: int = 1768
    least_y: int = 200
    rest: tuple[int, int] = (884, 884)
    string_steps: Fraction = Fraction("25.4648")
    string_rate: int = 400
    bowed: bool = False

    def __post_init__(self) -> None:
        in_range("wall_width in mm", self.wall_width, 10, MAX_MM)
        in_range("wall_height in mm", self.wall_height, 10, MAX_MM)
        in_range("least_y in mm", self.least_y, 1, self.wall_height - 1)
        in_range("x of the place of rest", self.rest[0], 0, self.wall_width)
        in_range("y of the place of rest", self.rest[1], self.least_y, self.wall_height)
        ticks = Fraction(round(self.string_steps * (1000 << TICKS_LOG2)), 1000)
        object.__setattr__(self, "steps_per_mm", (ticks, ticks, Fraction(100)))
        self._check_size()
        in_range("clocks between steps of a string", self.period, 2, MAX_PERIOD)
        if self.clock < self.period:
            raise ValueError("a string makes less than a step a second: choose a higher max_rate, "
                             "or more string_steps")
        in_range("string_rate (by max_rate of X and Y the strings are no faster)",
                 self.string_rate, 1, self.clock // self.period)
        if stays := {number for number, _ in self.others} & self.bounds.keys():
            raise ValueError(f"${min(stays)} follows from the wall, and is not a further setting")
        super().__post_init__()

    def _check_size(self) -> None:
        """Raise ValueError for a wall of more ticks than are counted, or of less than two."""
        per_mm, largest = float(self.string_steps), max(self.wall_width, self.wall_height)
        if not 2 <= self.ticks(largest) < 1 << PLACE_BITS:
            most = floor(((1 << PLACE_BITS) - 1) / self.steps_per_mm[0]) if per_mm else 0
            raise ValueError(f"with {per_mm:g} half steps a mm (string_steps) a wall may be "
                             f"{most} mm wide and high at most, not {largest}")
        in_range("steps of both strings", self.most_wound, 1, (1 << LENGTH_BITS) - 1)

    def ticks(self, mm: int) -> int:
        """Return a place in ticks."""
        return round(mm * self.steps_per_mm[0])

    @property
    def edges(self) -> tuple[int, int, int]:
        """The least ticks across, and the least and most below, that soft limits allow.

        They count from the upper right corner, so the nearest ticks may be beyond.
        """
        across, below = (floor(mm * self.steps_per_mm[0])
                         for mm in (self.wall_width, self.wall_height - self.least_y))
        top = self.ticks(self.least_y)
        return self.wall_ticks - across, top, top + below

    @property
    def wall_ticks(self) -> int:
        """Ticks from pulley to pulley, rounded up: an arc along an edge may be half a tick out."""
        return ceil(self.wall_width * self.steps_per_mm[0])

    @property
    def steps_of_string(self) -> float:
        """Half steps per mm of string, as it counts: $100, which is rounded, has eight times it."""
        return float(self.steps_per_mm[0]) / (1 << TICKS_LOG2)

    @property
    def most_wound(self) -> int:
        """Steps of string that homing may wind: of both to the far corners, and a tenth."""
        return ceil(2.2 * hypot(self.wall_width, self.wall_height) * float(self.string_steps))

    @property
    def period(self) -> int:
        """Least clocks between steps of a string: a third more than at the highest speed."""
        fastest = max(self.max_rate[:2]) / 60 * self.string_steps
        return floor(self.clock / (float(fastest) * sqrt(2) * 4 / 3))

    @property
    def pace(self) -> int:
        """Clocks from step to step in a homing cycle."""
        return self.clock // self.string_rate

    @property
    def hanging(self) -> dict[str, int]:
        """Parameters of :class:`Hanging`."""
        (across, below), (least, _, most) = map(self.ticks, self.rest), self.edges
        return {"width": self.wall_ticks, "bits": PLACE_BITS, "first_across": max(across, least),
                "first_below": min(below, most)}

    @property
    def string_lengths(self) -> list[dict[str, int]]:
        """Parameters of each :class:`StringLength` of that."""
        hanging = self.hanging
        width, across = hanging["width"], hanging["first_across"]
        return [{"bits": hanging["bits"], "first_across": place,
                 "first_below": hanging["first_below"]} for place in (across, width - across)]

    @property
    def string_motors(self) -> list[dict[str, int]]:
        """Parameters of each :class:`StringMotor`."""
        return [{"bits": LENGTH_BITS, "period": self.period,
                 "first": nearest_steps(each["first_across"], each["first_below"])}
                for each in self.string_lengths]

    @property
    def string_homing(self) -> dict[str, int]:
        """Parameters of :class:`StringHoming`."""
        return {"pace": self.pace, "most": self.most_wound,
                "most_off": ceil(OFF_SWITCH * self.string_steps)}

    @property
    def bowed_line(self) -> dict[str, int]:
        """Parameters of :class:`BowedLine`."""
        return {"pace": self.pace, "place_bits": PLACE_BITS, "length_bits": LENGTH_BITS}

    @property
    def wall(self) -> dict[str, int]:
        """Parameters of :class:`WallDialect`."""
        return {"width": self.wall_width, "top": self.least_y, "height": self.wall_height,
                "feed": floor(max(self.max_rate[:2]))}

    @property
    def origin(self) -> tuple[int, ...]:
        """The lower left corner; positions of the machine are 0 at the upper right one."""
        return (-self.wall_width * 10**6, (self.least_y - self.wall_height) * 10**6, -LIFT * 10**6)

    @property
    def defaults(self) -> dict[int, Fraction]:
        return {20: Fraction(1), 22: Fraction(1), 130: Fraction(self.wall_width),
                131: Fraction(self.wall_height - self.least_y), 132: Fraction(2 * LIFT)}

    @property
    def mists(self) -> bool:
        """M7 is taken, but there is no output for it."""
        return False

    @property
    def homes_one(self) -> bool:
        return False

    @property
    def bounds(self) -> dict[int, int]:
        return dict.fromkeys((20, 22, 100, 101, 130, 131), 0) | {
            110 + axis: floor(self.max_rate[axis] * 1000) for axis in range(2)}


class VPlotter(GCode):
    """Hanging plotter: G-code, or the commands of the thesis, come in, coils of two motors go out.

    It is :class:`GCode` with other kinematics, :class:`Hanging`, and another homing cycle,
    :class:`StringHoming`. The origin of G54 is the lower left corner of the wall, y up; a line that
    begins with ``:`` is a command of :class:`WallDialect`, with y down. It stays on the wall, but a
    bowed line may sag below its lower edge.

    At power-up the place is unknown: it is locked until it has homed. If it is unlocked without
    that, or after homing has failed, it takes for granted that it hangs at the place of rest.

    The pen touches while a command draws, after M3 and M4 until M5, and where Z is below 0; but not
    while a command goes to a start point, in a homing cycle, an alarm, a stop or a sleep, nor
    behind an open door, until half a second before it goes on. Motors turn the other way with bits
    0 and 1 of $3.

    Parameters
    ----------
    settings : VPlotterSettings
        Wall, strings and limits.

    Members
    -------
    rx : In(1)
        The line from the host.
    limits : In(2)
        End switches of the left and the right string, 1 where one is on.
    stop, door, motor_fault, hold, start, abort : In(1)
        As of :class:`GCode`.
    tx : Out(1)
        The line to the host.
    left, right : Out(4)
        Coils of the motors of the strings, half step.
    pen : Out(1)
        The pen touches.
    servo : Out(1)
        The same as pulses for a hobby servo: $210 off the wall, $211 on it.
    moving, alarm, fault : Out(1)
        As of :class:`GCode`.

    Raises
    ------
    ValueError
        If a setting is out of range.

    Source: thesis of the hanging plotter, whose master and slaves are blocks of one gateware here.
    """

    settings: VPlotterSettings
    _dialect: WallDialect

    restart_times = MappingProxyType({"spindle_log2": 9, "coolant_log2": 0})

    def __init__(self, *, settings: VPlotterSettings | None = None) -> None:
        self.settings = settings = settings or VPlotterSettings()
        self.roles = {
            "rx": RX, "tx": TX, "left": COILS, "right": COILS, "pen": PEN, "servo": SERVO,
            "limits": LIMIT, "stop": STOP, "door": DOOR, "motor_fault": MOTOR_FAULT,
            "hold": BUTTON, "start": BUTTON, "abort": BUTTON,
            "moving": STATUS, "alarm": STATUS, "fault": STATUS,
        }
        MachineComponent.__init__(self, {
            "rx": In(1), "limits": In(2), "stop": In(1), "door": In(1), "motor_fault": In(1),
            "hold": In(1), "start": In(1), "abort": In(1), "tx": Out(1), "left": Out(4),
            "right": Out(4), "pen": Out(1), "servo": Out(1), "moving": Out(1), "alarm": Out(1),
            "fault": Out(1)})
        self._enabled = Signal(name="enabled")  # the motors have power
        self._touches = Signal(name="touches")  # Z is below 0
        self._lifted = Signal(name="lifted")  # whatever else, the pen is off

    def elaborate(self, platform) -> Module:
        self._dialect = WallDialect(**self.settings.wall, bowed=self.settings.bowed)
        return super().elaborate(platform)

    def _homing(self) -> StringHoming | StringCycles:
        homing = StringHoming(**self.settings.string_homing)
        return (StringCycles(homing, BowedLine(**self.settings.bowed_line))
                if self.settings.bowed else homing)

    def _store_lines(self, m: Module, anew: Callable, control: GCodeControl, reader: GCodeReader,
                     gate: GCodeGate, homing, answers: stream.Interface, faults: list
                     ) -> StoredLines | None:
        # A bowed line is no start.
        return super()._store_lines(m, anew, control, reader, gate,
                                    homing.homing if self.settings.bowed else homing, answers,
                                    faults)

    def _system(self, m: Module, control: GCodeControl, renewed: Signal, gate: GCodeGate,
                planner: GCodePlanner, motion: BlockMotion, homing,
                store: GCodeSettingStore) -> None:
        """Let an end switch end a bowed line: in a homing cycle hard limits do not count."""
        super()._system(m, control, renewed, gate, planner, motion, homing, store)
        if isinstance(homing, StringCycles):
            before = Signal.like(control.limits)
            m.d.sync += before.eq(control.limits)
            with m.If((control.limits & ~before).any() & control.hard & homing.line.active
                      & ~renewed):
                m.d.sync += control.failure.eq(AlarmCode.HARD_LIMIT)

    def _home(self, m: Module, gate: GCodeGate, planner: GCodePlanner, motion: BlockMotion, homing,
              store: GCodeSettingStore) -> None:
        """Leave the planner out of it: these cycles make steps of their own."""

    def _switches(self, m: Module, flags: Value) -> tuple[Value, Value]:
        switches = Signal(AXES)
        m.d.comb += switches.eq(Cat(self.limits, flags.open))  # those that there are not are off
        return switches, flags.probe_open

    def _program(self, m: Module, anew: Callable, control: GCodeControl,
                 interpreter: GCodeInterpreter, answers: stream.Interface,
                 lines: stream.Interface, faults: list, renewed: Signal
                 ) -> tuple[stream.Interface, stream.Interface]:
        m.submodules.dialect = dialect = self._dialect
        connect(m, lines, dialect.lines)
        # A program of its own is behind the dialect: each of its lines is answered there.
        items, answers = super()._program(m, anew, control, interpreter, answers, dialect.items,
                                          faults, renewed)
        answered, moving = answers.valid & answers.ready, control.moving
        if self.settings.program:
            answered, moving = self._stored.line_done, moving | self._stored.busy
        said = answers.signature.create()
        m.d.comb += [
            said.payload.eq(answers.payload), said.valid.eq(answers.valid & ~dialect.own),
            answers.ready.eq(said.ready | dialect.own),
            dialect.answered.eq(answered),
            dialect.refused.eq(answers.payload != 0), dialect.renewed.eq(renewed),
            dialect.moving.eq(moving), dialect.cancelled.eq(control.cancelled),
            dialect.sleeping.eq(control.state == GCodeState.SLEEP),
            dialect.powered.eq(self._enabled), dialect.emergency.eq(control.emergency),
        ]
        faults.append(dialect.fault)
        return items, said

    def _may_run(self, control: GCodeControl) -> Value:
        """Return that a program may be started: not while a command is carried out."""
        dialect = self._dialect
        return super()._may_run(control) & ~(dialect.own | dialect.pen | dialect.lifts)

    def _sent(self, m: Module, said: stream.Interface) -> stream.Interface:
        """Send lines of the reporter and of the dialect, never one within another."""
        own, sent = self._dialect.bytes, said.signature.create()
        turn = Signal()  # of the dialect
        within = Signal()  # a line of the reporter
        rested = Signal(range(ANSWERED + 1))  # clocks since there was an answer, or part of a line
        last = sent.payload == ord("\n")
        m.d.comb += [
            sent.payload.eq(Mux(turn, own.payload, said.payload)),
            sent.valid.eq(Mux(turn, own.valid, said.valid)),
            said.ready.eq(sent.ready & ~turn), own.ready.eq(sent.ready & turn),
        ]
        with m.If(turn):
            m.d.sync += turn.eq(~(sent.valid & sent.ready & last))
        with m.Elif(said.valid & said.ready):
            m.d.sync += within.eq(~last)
        with m.Elif(~within & ~said.valid & (rested == ANSWERED)):
            m.d.sync += turn.eq(own.valid)
        with m.If(said.valid | (self._dialect.answered & ~self._dialect.own)):
            m.d.sync += rested.eq(0)
        with m.Elif(rested != ANSWERED):
            m.d.sync += rested.eq(rested + 1)
        return sent

    def _drivers(self, m: Module, control: GCodeControl, motion: BlockMotion,
                 planner: GCodePlanner, homing, probing: GCodeProbing | None,
                 store: GCodeSettingStore, faults: list, blocked: Signal, powered: Signal,
                 restarts: Signal) -> list[Signal]:
        """Make ticks of the place and steps of the strings, and return the place."""
        settings, dialect = self.settings, self._dialect
        m.submodules.hanging = hanging = Hanging(**settings.hanging)
        stops, stopped, drops = Signal(), Signal(), Signal()
        homed, homes = Signal(), Signal()
        step, direction, lifts, known = motion.step[:2], motion.direction[:2], homing.active, homed
        if isinstance(homing, StringCycles):
            lifts, known = homing.active & ~homing.drawing, homed | homing.line.active
            step, direction = self._bow(m, homing, hanging, step, direction)
        fails, failed = Signal(), Signal()  # homing, a clock ago
        begun = Signal()  # a cycle goes on, and has been allowed to
        m.d.comb += [stops.eq(control.stop | self.fault),
                     begun.eq(homing.active & (homing.allowed | homes)),
                     fails.eq(homes & ~homing.active & ~homed)]
        m.d.sync += [
            stopped.eq(stops), drops.eq(stops | restarts), self._enabled.eq(powered),
            homes.eq(begun), failed.eq(fails),
            homed.eq((homed & ~begun | homing.done)
                     & (control.state != GCodeState.SLEEP) & ~control.emergency),
        ]
        m.d.comb += [
            hanging.step.eq(step & (~stops).replicate(2)), hanging.direction.eq(direction),
            hanging.begin.eq(homing.place | fails), hanging.drop.eq(drops),
            dialect.homed.eq(known), dialect.stage.eq(homing.stage),
        ]
        faults.append(hanging.fault)
        follows = Signal()  # motors make the lengths that strings shall have
        m.d.comb += follows.eq(~(homing.active | fails | failed))
        made = [~hanging.busy]
        for side, (name, coils) in enumerate((("left", self.left), ("right", self.right))):
            motor = StringMotor(**settings.string_motors[side])
            m.submodules[f"motor_{name}"] = motor
            m.d.comb += [
                motor.length.eq(hanging.lengths[side]),
                motor.follow.eq((follows | homing.follow[side]) & ~stopped),
                motor.step.eq(homing.step[side] & ~stopped), motor.longer.eq(homing.longer[side]),
                motor.zero.eq(homing.zero[side]), motor.place.eq(failed),
                motor.enable.eq(self._enabled), motor.inverted.eq(store.flags.inverted[side]),
                homing.moved[side].eq(motor.moved), homing.behind[side].eq(motor.behind),
                coils.eq(motor.coils),
            ]
            # A motor without power makes what is left when it has some again.
            made.append(~(motor.behind & follows & self._enabled))
            if isinstance(homing, StringCycles):
                m.d.comb += [homing.length[side].eq(motor.length), homing.made[side].eq(motor.made)]
        m.d.comb += motion.made.eq(Cat(made).all())

        z = Signal(signed(PLACE_BITS))
        with m.If(motion.step[2] & ~stops):
            m.d.sync += z.eq(z + Mux(motion.direction[2], 1, -1))
        m.d.comb += [
            self._touches.eq(z < -LIFT * 100),
            self._lifted.eq(stops | lifts | (control.state == GCodeState.SLEEP)
                            | (control.state == GCodeState.ALARM)),
        ]
        across, below = hanging.across, hanging.below
        positions = [Signal(signed(36), name=f"position_{name}") for name in "xyz"]
        m.d.comb += [
            positions[0].eq(across - settings.wall_ticks),
            positions[1].eq(settings.ticks(settings.least_y) - below), positions[2].eq(z),
            *(planner.steps[axis].eq(position) for axis, position in enumerate(positions)),
        ]
        return positions

    def _bow(self, m: Module, homing: StringCycles, hanging: Hanging, step: Value,
             direction: Value) -> tuple[Value, Value]:
        """Have a bowed line lead the place; return ticks and their directions."""
        dialect, per_mm = self._dialect, round(self.settings.steps_per_mm[0] * (1 << FRACTION))
        m.d.comb += [
            homing.bows.eq(dialect.bows), dialect.drawing.eq(homing.drawing),
            homing.point[0].eq(hanging.across), homing.point[1].eq(hanging.below),
            homing.busy.eq(hanging.busy),
        ]
        across, below = (Signal(PLACE_BITS, name=f"end_{name}") for name in ("across", "below"))
        for ticks, mm in zip((across, below), dialect.end, strict=True):
            m.d.sync += ticks.eq((mm * per_mm + (1 << FRACTION - 1)) >> FRACTION)
        least, top, most = self.settings.edges
        m.d.comb += [homing.target[0].eq(Mux(across < least, least, across)),
                     homing.target[1].eq(Mux(below > most, most, Mux(below < top, top, below)))]
        right, down = homing.up
        return step | homing.tick, Mux(homing.tick.any(), Cat(right, ~down), direction)

    def _spins(self, motion: BlockMotion) -> Value:
        """Have the pen waited for, as Z and commands move it, too."""
        return Const(1)

    def _tools(self, m: Module, outputs) -> None:
        """Leave out what a plotter has not: the pen is in place of a spindle."""

    def _spindle(self, m: Module, motion: BlockMotion, overrides: Overrides,
                 store: GCodeSettingStore, faults: list) -> Signal:
        outputs, rapid = overrides.outputs, motion.feed.all()
        spins = outputs.clockwise | outputs.counter_clockwise
        draws = self._touches | (spins & ~(store.flags.laser & rapid))
        m.d.sync += self.pen.eq((self._dialect.pen | (draws & ~self._dialect.lifts))
                                & ~self._lifted & ~overrides.spindle_off)
        power = Signal.like(Const(FULL_POWER))
        m.d.comb += power.eq(Mux(self.pen, FULL_POWER, 0))
        return power

    def _idle(self, m: Module, control: GCodeControl, busy: Value, delay: Value, beat: Signal,
              powered: Signal) -> None:
        """Give the motors power also on demand, and let that end a sleep."""
        moves, wanted = Signal(), Signal()
        super()._idle(m, control, busy, delay, beat, moves)
        m.d.sync += wanted.eq((wanted | self._dialect.power)
                              & (control.state != GCodeState.SLEEP) & ~control.emergency)
        m.d.comb += powered.eq(moves | wanted)
        with m.If(self._dialect.wake):
            m.d.comb += control.restart.eq(1)
