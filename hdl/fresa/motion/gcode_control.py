"""States of a G-code machine: run, hold, jog, alarm, and what leads from one to another."""

from amaranth import Cat, Module, Mux, Signal, Value
from amaranth.lib import enum, stream, wiring
from amaranth.lib.wiring import In, Out

from ..fsm import leave_unused_codes
from ..protocol import GCodeMessage, GCodeState, RealtimeCode

__all__ = ["AlarmCode", "GCodeControl"]


class AlarmCode(enum.Enum, shape=5):
    """Number of an alarm, as GRBL 1.1 has them; the last two are as grblHAL has them."""

    NONE = 0
    HARD_LIMIT = 1
    SOFT_LIMIT = 2
    ABORTED = 3
    PROBE_INITIAL = 4
    PROBE_CONTACT = 5
    HOMING_RESET = 6
    HOMING_DOOR = 7
    HOMING_PULL_OFF = 8
    HOMING_SEARCH = 9
    EMERGENCY = 10
    MOTOR_FAULT = 17


MAY_MOVE = ("IDLE", "RUN", "JOG", "HOME")


class GCodeControl(wiring.Component):
    """Decides whether the machine may move, from real-time commands, inputs and alarms.

    It holds the speed profile back, or stops the drivers at once, and says which state that is. The
    motion itself begins by itself as soon as there are blocks and ``hold`` is 0.

    =====  ==================================================  =====================================
    state  meaning                                             next
    =====  ==================================================  =====================================
    START  after power-up and reset, one clock                 ALARM if locked or at a limit, or
                                                               IDLE
    IDLE   nothing moves, blocks may begin                     RUN, JOG when it moves; HOME, CHECK
    RUN    blocks are carried out                              IDLE when none is left
    JOG    the same of a jog                                   IDLE, also after it was cancelled
    HOLD   slows down and stands: feed hold, program pause     IDLE by a resume, once it stands
    DOOR   the same, door open                                 RENEW by a resume, once closed
    RENEW  what DOOR turned off is turned on again; shown as   IDLE once `restarted`; DOOR by the
           DOOR                                                door
    ALARM  slows down or is stopped, refuses to move           IDLE by `unlock`, HOME by `home`
    CHECK  lines are checked, nothing moves                    IDLE, or START by a reset
    HOME   homing cycle; resets and alarms alone end it early  IDLE
    SLEEP  nothing moves, motors off                           ALARM, by a reset
    FAULT  a state register was upset: stopped                 stays until reset
    =====  ==================================================  =====================================

    **Hold** in IDLE, RUN; in JOG it cancels: it slows down, then ``cancelled`` discards the rest. A
    resume while it still slows down does nothing, as with GRBL.

    **Reset** slows down, whatever the state, and takes effect when the machine stands: ``reset`` is
    1 for a clock, and position and alarm are kept. With `strict`, as with GRBL, it takes effect
    at once, steps are stopped, and where it was moving the position counts as lost: alarm 3. During
    homing it is alarm 6 in either case.

    **Alarms** by a hard limit (an edge, so that it can be moved off again) or the emergency stop
    set ``stop`` in the next clock, until a reset has taken effect and the emergency stop is off.
    Before that reset neither `unlock` nor `home` does anything; so it is with SOFT_LIMIT, which
    slows down. Other alarms, `failure`, slow down, and need no reset; ``flush`` then discards the
    blocks, and until then `unlock` does nothing. But of a probing, PROBE_INITIAL and PROBE_CONTACT,
    nothing is left to be discarded. An alarm in HOME resets by itself once it stands, unless it is
    HARD_LIMIT or the emergency stop. In ALARM and SLEEP only an emergency stop is an alarm. An
    alarm while another waits to be announced is not announced. A limit switch that is on in START
    locks, as ALARM does, and is no alarm.

    Members
    -------
    command : In(1)
        A real-time command came: `RealtimeFilter`. It counts in the next clock.
    code : In(8)
        Which.
    moving : In(1)
        There are blocks or parts of them to be carried out, or a dwell.
    standing : In(1)
        The profile stands, and no requested step is pending.
    jogging : In(1)
        What moves is a jog.
    pause : In(1)
        Program pause, for a clock, before the profile takes another block.
    home : In(1)
        Homing cycle: requested, and going on.
    check : In(1)
        Check mode, sampled in IDLE and CHECK.
    sleep : In(1)
        Go to sleep, for a clock, in IDLE and ALARM.
    unlock : In(1)
        End an alarm, for a clock.
    restart : In(1)
        A reset is wanted, for a clock, as by a command.
    restoring : In(1)
        Settings or coordinates are made what they were at power-up, for a clock.
    door : In(1)
        The door is open.
    restarted : In(1)
        Nothing is off any more that DOOR turns off. Where something is in IDLE, as after an alarm
        that began in DOOR, it is DOOR again.
    ended : In(1)
        The program has ended, for a clock.
    spindle_restored : In(1)
        A spindle that was stopped in HOLD turns again, for a clock; but in RENEW it does not count.
    limits : In(4)
        Limit switches.
    hard : In(1)
        They are hard limits.
    emergency : In(1)
        The emergency stop.
    motor_fault : In(1)
        It is a driver that asks for the emergency stop: alarm 17, otherwise 10.
    failure : In(AlarmCode)
        Another alarm, for a clock, or NONE.
    strict : In(1)
        Resets take effect at once.
    locked_start : In(1)
        ALARM after power-up: homing is required.
    hold : Out(1)
        To the profile.
    stop : Out(1)
        Steps must not begin.
    critical : Out(1)
        An alarm needs a reset.
    state : Out(GCodeState)
        State. HOLD while a reset slows down.
    substate : Out(2)
        Of HOLD 0 when it stands, otherwise 1; of DOOR 0 when it stands and the door is closed, 1
        when it stands and it is open, 3 in RENEW, otherwise 2.
    report : Out(1)
        A status report is requested.
    reset : Out(1)
        Reset everything else but the reporter, in this clock.
    flush : Out(1)
        Discard blocks and parts of them, and all lines, in this clock.
    cancelled : Out(1)
        Discard blocks and parts of them, in this clock: it was a jog, and it stands.
    enable : Out(1)
        Power of the motors: from the first motion on, not in SLEEP nor after an emergency stop.
    alarms : Out(stream.Signature(5))
        Numbers of alarms, to be announced.
    messages : Out(stream.Signature(GCodeMessage))
        The greeting after START, then that a limit switch is on, and the reminder of a lock; after
        an alarm that needs a reset the reminder of that; that the door is open, also where it opens
        again in DOOR, and in JOG and SLEEP; that an alarm was ended by `unlock`; that check mode
        begins and ends, and sleep begins; `restoring`, `spindle_restored` and `ended`.
    fault : Out(1)
        The state register was upset: ``stop`` and ``hold`` are 1. Stays until the reset of all.
    """

    command: In(1)
    code: In(8)
    moving: In(1)
    standing: In(1)
    jogging: In(1)
    pause: In(1)
    home: In(1)
    check: In(1)
    sleep: In(1)
    unlock: In(1)
    restart: In(1)
    restoring: In(1)
    door: In(1)
    restarted: In(1)
    ended: In(1)
    spindle_restored: In(1)
    limits: In(4)
    hard: In(1)
    emergency: In(1)
    motor_fault: In(1)
    failure: In(AlarmCode)
    strict: In(1)
    locked_start: In(1)
    hold: Out(1)
    stop: Out(1)
    critical: Out(1)
    state: Out(GCodeState)
    substate: Out(2)
    report: Out(1)
    reset: Out(1)
    flush: Out(1)
    cancelled: Out(1)
    enable: Out(1)
    alarms: Out(stream.Signature(5))
    messages: Out(stream.Signature(GCodeMessage))
    fault: Out(1)

    def elaborate(self, platform) -> Module:
        m = Module()

        came = {code: Signal(name=f"came_{code.name.lower()}") for code in (
            RealtimeCode.STATUS, RealtimeCode.HOLD, RealtimeCode.RESUME, RealtimeCode.RESET,
            RealtimeCode.DOOR, RealtimeCode.JOG_CANCEL)}
        m.d.sync += [each.eq(self.command & (self.code == code.value))
                     for code, each in came.items()]
        asks_hold, asks_resume, asks_reset, asks_door = Signal(), Signal(), Signal(), Signal()
        m.d.comb += [
            self.report.eq(came[RealtimeCode.STATUS]),
            asks_hold.eq(came[RealtimeCode.HOLD]),
            asks_resume.eq(came[RealtimeCode.RESUME]),
            asks_reset.eq(came[RealtimeCode.RESET] | self.restart),
            asks_door.eq(came[RealtimeCode.DOOR] | self.door),
        ]

        wants = self._announce(m)
        stopped = Signal()  # from a clock after the alarm to the reset
        critical = self.critical
        alarmed = Signal()  # also through a reset
        powered = Signal()  # it has been in START
        resetting = Signal()
        cancelling = Signal()  # flush when it stands
        door_next = Signal()  # after the jog
        limits_before = Signal.like(self.limits)
        emergency_before, door_before = Signal(), Signal()
        m.d.sync += [limits_before.eq(self.limits), emergency_before.eq(self.emergency),
                     door_before.eq(self.door)]
        opens = Signal()  # the door
        m.d.comb += opens.eq(came[RealtimeCode.DOOR] | (self.door & ~door_before))
        alarm = Signal(AlarmCode)  # that begins in this clock
        of_probing = (alarm == AlarmCode.PROBE_INITIAL) | (alarm == AlarmCode.PROBE_CONTACT)

        def open_door() -> None:
            m.d.sync += wants[GCodeMessage.CHECK_DOOR].eq(1)
            m.next = "DOOR"

        def fall_asleep() -> None:
            m.d.sync += wants[GCodeMessage.SLEEPING].eq(1)
            m.next = "SLEEP"

        for message, said in ((GCodeMessage.RESTORING, self.restoring),
                              (GCodeMessage.PROGRAM_END, self.ended)):
            with m.If(said):
                m.d.sync += wants[message].eq(1)
        with m.FSM(name="control_state", init="START") as fsm:
            with m.State("START"):
                m.d.sync += [powered.eq(1), wants[GCodeMessage.GREETING].eq(1)]
                m.next = "IDLE"
                at_limit = self.limits.any() & self.hard
                with m.If(at_limit):
                    m.d.sync += wants[GCodeMessage.CHECK_LIMITS].eq(1)
                with m.If(alarmed | (self.locked_start & ~powered) | at_limit):
                    m.d.sync += [alarmed.eq(1), wants[GCodeMessage.LOCKED].eq(1)]
                    m.next = "ALARM"

            with m.State("IDLE"):
                m.d.sync += door_next.eq(0)
                with m.If(asks_door | ~self.restarted):
                    open_door()
                with m.Elif(asks_hold | self.pause):
                    m.next = "HOLD"
                with m.Elif(self.sleep):
                    fall_asleep()
                with m.Elif(self.home):
                    m.next = "HOME"
                with m.Elif(self.check):
                    m.d.sync += wants[GCodeMessage.ENABLED].eq(1)
                    m.next = "CHECK"
                with m.Elif(self.moving & self.jogging):
                    m.next = "JOG"
                with m.Elif(self.moving):
                    m.next = "RUN"

            with m.State("RUN"):
                with m.If(asks_door):
                    open_door()
                with m.Elif(asks_hold | self.pause):
                    m.next = "HOLD"
                with m.Elif(~self.moving):
                    m.next = "IDLE"

            with m.State("JOG"):
                with m.If(asks_door):
                    m.d.sync += door_next.eq(1)
                with m.If(cancelling & self.standing):
                    m.next = "IDLE"
                    with m.If(door_next | asks_door):
                        m.next = "DOOR"
                with m.Elif(asks_door | asks_hold | came[RealtimeCode.JOG_CANCEL]):
                    m.d.sync += cancelling.eq(1)
                with m.Elif(~cancelling & ~self.moving):
                    m.next = "IDLE"

            with m.State("HOLD"):
                with m.If(asks_door):
                    open_door()
                with m.Elif(asks_resume & self.standing):
                    m.next = "IDLE"

            with m.State("DOOR"):
                with m.If(~opens & asks_resume & self.standing & ~self.door):
                    m.next = "RENEW"

            with m.State("RENEW"):
                with m.If(asks_door):
                    open_door()
                with m.Elif(self.restarted):
                    m.next = "IDLE"

            with m.State("ALARM"):
                with m.If(~critical & ~cancelling):
                    with m.If(self.sleep):
                        fall_asleep()
                    with m.Elif(self.home):
                        m.next = "HOME"
                    with m.Elif(self.unlock):
                        m.d.sync += [alarmed.eq(0), wants[GCodeMessage.UNLOCKED].eq(1)]
                        m.next = "IDLE"

            with m.State("CHECK"):
                with m.If(~self.check):
                    m.d.sync += wants[GCodeMessage.DISABLED].eq(1)
                    m.next = "IDLE"

            with m.State("HOME"):
                with m.If(asks_door):
                    m.d.comb += alarm.eq(AlarmCode.HOMING_DOOR)
                with m.Elif(~self.home):
                    m.d.sync += alarmed.eq(0)
                    m.next = "IDLE"
                with m.If(asks_reset):
                    m.d.comb += alarm.eq(AlarmCode.HOMING_RESET)

            with m.State("SLEEP"):
                m.d.sync += alarmed.eq(1)

            with m.State("FAULT"):
                pass

        def within(*names: str) -> Value:
            return Cat(fsm.ongoing(name) for name in names).any()

        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))

        with m.If(opens & within("JOG", "DOOR", "SLEEP")):
            m.d.sync += wants[GCodeMessage.CHECK_DOOR].eq(1)
        with m.If(self.spindle_restored & ~within("RENEW")):
            m.d.sync += wants[GCodeMessage.RESTORING_SPINDLE].eq(1)

        # In any state, the most urgent last.
        with m.If(asks_reset):
            m.d.sync += resetting.eq(1)
        with m.If(within("JOG", "ALARM") & cancelling & self.standing):
            m.d.comb += [self.cancelled.eq(within("JOG")), self.flush.eq(within("ALARM"))]
            m.d.sync += cancelling.eq(0)
        stops, breaks = Signal(), Signal()
        with m.If(~within("START", "ALARM", "SLEEP")):
            with m.If(self.failure != AlarmCode.NONE):
                m.d.comb += alarm.eq(self.failure)
            with m.If(asks_reset & self.strict & ~self.standing):
                m.d.comb += stops.eq(1)
                with m.If(~within("HOME")):
                    m.d.comb += alarm.eq(AlarmCode.ABORTED)
            with m.If((self.limits & ~limits_before).any() & self.hard & ~within("HOME")):
                m.d.comb += [alarm.eq(AlarmCode.HARD_LIMIT), breaks.eq(1)]
        with m.If(self.emergency & (~emergency_before | within("START"))):
            m.d.comb += [alarm.eq(AlarmCode.EMERGENCY), breaks.eq(1)]
            with m.If(self.motor_fault):
                m.d.comb += alarm.eq(AlarmCode.MOTOR_FAULT)

        m.d.comb += self.reset.eq(resetting & (self.standing | stopped) & ~self.fault)
        with m.If(self.reset):
            m.d.sync += [resetting.eq(0), stopped.eq(0), critical.eq(0), cancelling.eq(0),
                         fsm.state.eq(fsm.encoding["START"])]
        with m.If((alarm != AlarmCode.NONE) & ~self.fault):
            m.d.sync += alarmed.eq(1)
            with m.If(~of_probing):
                m.d.sync += cancelling.eq(1)
            with m.If(~self.reset):
                m.d.sync += fsm.state.eq(fsm.encoding["ALARM"])
                with m.If(within("HOME") & ~breaks & (alarm != AlarmCode.HARD_LIMIT)):
                    m.d.sync += resetting.eq(1)
            with m.If(~self.alarms.valid | self.alarms.ready):
                m.d.sync += [self.alarms.valid.eq(1), self.alarms.payload.eq(alarm)]
        with m.If(stops | breaks):
            m.d.sync += stopped.eq(1)
        with m.If(breaks | (alarm == AlarmCode.SOFT_LIMIT)):
            m.d.sync += [critical.eq(1), wants[GCodeMessage.RESET_TO_CONTINUE].eq(1)]

        m.d.comb += [
            self.stop.eq(stopped | emergency_before | self.fault),
            self.hold.eq(~within(*MAY_MOVE) | resetting | cancelling),
            self.substate.eq(~self.standing),
        ]
        for state in GCodeState:
            with m.If(within(state.name)):
                m.d.comb += self.state.eq(state)
        with m.If(within("DOOR")):
            m.d.comb += self.substate.eq(Mux(self.standing, self.door, 2))
        with m.If(within("RENEW")):
            m.d.comb += [self.state.eq(GCodeState.DOOR), self.substate.eq(3)]
        with m.If(within(*MAY_MOVE) & resetting):
            m.d.comb += self.state.eq(GCodeState.HOLD)
        with m.If(within("RUN", "JOG", "HOME")):
            m.d.sync += self.enable.eq(1)
        with m.If(within("SLEEP") | self.emergency):
            m.d.sync += self.enable.eq(0)
        return m

    def _announce(self, m: Module) -> dict[GCodeMessage, Signal]:
        """Send messages; return a register for each, to be set by what comes after."""
        wants = {message: Signal(name=f"wants_{message.name.lower()}") for message in (
            GCodeMessage.GREETING, GCodeMessage.CHECK_LIMITS, GCodeMessage.LOCKED,
            GCodeMessage.RESET_TO_CONTINUE, GCodeMessage.CHECK_DOOR, GCodeMessage.UNLOCKED,
            GCodeMessage.ENABLED, GCodeMessage.DISABLED, GCodeMessage.SLEEPING,
            GCodeMessage.RESTORING, GCodeMessage.RESTORING_SPINDLE, GCodeMessage.PROGRAM_END)}
        with m.If(self.alarms.ready):
            m.d.sync += self.alarms.valid.eq(0)
        with m.If(~self.messages.valid | self.messages.ready):
            m.d.sync += self.messages.valid.eq(Cat(wants.values()).any())
            first = True
            for message, wanted in wants.items():
                with m.If(wanted) if first else m.Elif(wanted):
                    m.d.sync += [self.messages.payload.eq(message), wanted.eq(0)]
                first = False
        return wants
