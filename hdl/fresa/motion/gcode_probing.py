"""Probing: a line that ends where the probe changes, and where that was."""

from amaranth import Module, Mux, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..fsm import leave_unused_codes
from ..protocol import GCodeAction, GCodeActionKind
from .gcode_control import AlarmCode
from .gcode_homing import START

__all__ = ["GCodeProbing"]


class GCodeProbing(wiring.Component):
    """Carries out G38.2 to G38.5, and passes all other actions.

    A PROBE waits until all that was planned is done. If the probe is then where the line is to take
    it already, nothing moves: alarm 4. Otherwise the line is planned as any other. Where the axes
    are in the clock in which the probe changes is kept; they brake, and the rest of the line is
    dropped. What the probe does while the line is planned is not seen, unless it stays so. A line
    that ends without a change is alarm 5 with G38.2 and G38.4; with G38.3 and G38.5
    its end is what is kept. Then the machine begins where it stands, and what is kept is listed,
    but after alarm 4. PROBED is taken when all that is done.

    What is kept is told to the interpreter as where the machine begins is, by a beginning before
    that one.

    While lines are checked a PROBE passes at once, as any other action: what it moves is dropped
    behind the planner, but the next line begins at its end. PROBED is taken at once.

    Parameters
    ----------
    begins_within : int
        Clocks in which a line begins that is planned, less one.

    Members
    -------
    actions, passed : In(stream.Signature(GCodeAction)), Out(stream.Signature(GCodeAction))
        Actions of the interpreter, and those that are planned: all but PROBED, and but a PROBE that
        the probe forbids.
    contact : In(1)
        The probe touches.
    checking : In(1)
        Lines are checked, and nothing moves. Once 1 it stays so until reset.
    idle, standing : In(1)
        All that was planned is done; the machine stands, and no report of where it is is computed.
    begins : In(1)
        The planner has not begun since ``restart``, or its block that sets the place is under way.
    active : Out(1)
        A probing goes on.
    brake : Out(1)
        Slow down.
    latch : Out(1)
        Keep where the axes are, each clock: where they are in the last is what counts.
    restart : Out(1)
        Drop what was not made, and begin, for one clock: where it was kept with ``measures``,
        otherwise where the axes are.
    measures : Out(1)
        The planner is to begin where it was kept.
    touched : Out(1)
        The last probing found what it looked for. After a reset none has.
    listing, listed : Out(1), In(1)
        List it, one clock; it is listed, one clock.
    failure : Out(AlarmCode)
        PROBE_INITIAL or PROBE_CONTACT for one clock, else NONE.
    fault : Out(1)
        The state register was upset. Stays until reset.

    Raises
    ------
    ValueError
        If ``begins_within`` is out of range.
    """

    def __init__(self, *, begins_within: int = START) -> None:
        self.begins_within = in_range("begins_within", begins_within, 1, START)
        super().__init__({
            "actions": In(stream.Signature(GCodeAction)),
            "passed": Out(stream.Signature(GCodeAction)),
            "contact": In(1), "checking": In(1), "idle": In(1), "standing": In(1), "begins": In(1),
            "active": Out(1), "brake": Out(1), "latch": Out(1), "restart": Out(1),
            "measures": Out(1), "touched": Out(1), "listing": Out(1), "listed": In(1),
            "failure": Out(AlarmCode), "fault": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        action, motion = self.actions.p, self.actions.p.modes.motion.as_value()
        probe = action.kind == GCodeActionKind.PROBE
        waits = action.kind == GCodeActionKind.PROBED
        away = Signal()  # as the line says
        silent = Signal()  # it makes no alarm
        found = Signal()  # the probe is as the line wants it
        pause = Signal(range(self.begins_within + 1))
        lists = Signal()
        m.d.comb += [self.passed.payload.eq(action), found.eq(self.contact ^ away)]

        def fail(code: AlarmCode) -> None:
            m.d.comb += self.failure.eq(code)
            m.next = "RESTART"

        m.d.comb += self.active.eq(1)
        with m.FSM(name="probing_state") as fsm:
            with m.State("PASS"):
                passes = Mux(probe, self.checking, ~waits)
                m.d.comb += [
                    self.active.eq(0),
                    self.passed.valid.eq(self.actions.valid & passes),
                    self.actions.ready.eq(waits | (passes & self.passed.ready)),
                ]
                m.d.sync += [away.eq(motion[1]), silent.eq(motion[0]),
                             pause.eq(self.begins_within), lists.eq(0)]
                with m.If(self.actions.valid & probe & ~self.checking & self.idle):
                    m.next = "CHECK"
            with m.State("CHECK"):
                m.d.sync += self.touched.eq(0)
                m.next = "PLAN"
                with m.If(found):
                    m.d.comb += self.actions.ready.eq(1)
                    fail(AlarmCode.PROBE_INITIAL)
            with m.State("PLAN"):
                m.d.comb += [self.passed.valid.eq(1), self.actions.ready.eq(self.passed.ready)]
                m.d.sync += lists.eq(1)
                with m.If(self.passed.ready):
                    m.next = "SEEK"
            with m.State("SEEK"):
                m.d.comb += self.latch.eq(1)  # not only at the end, which is known late
                with m.If(pause != 0):
                    m.d.sync += pause.eq(pause - 1)
                with m.If(found):
                    m.d.sync += self.touched.eq(1)
                    m.next = "BRAKE"
                with m.Elif((pause == 0) & self.idle):
                    with m.If(silent):
                        m.next = "BRAKE"
                    with m.Else():
                        fail(AlarmCode.PROBE_CONTACT)
            with m.State("BRAKE"):
                m.d.comb += self.brake.eq(1)
                with m.If(self.standing):
                    m.next = "MEASURE"
            with m.State("MEASURE"):
                m.d.comb += [self.brake.eq(1), self.restart.eq(1), self.measures.eq(1)]
                m.next = "MEASURING"
            with m.State("MEASURING"):
                m.d.comb += self.measures.eq(1)
                with m.If(~self.begins):
                    m.next = "RESTART"
            with m.State("RESTART"):
                m.d.comb += [self.brake.eq(1), self.restart.eq(1)]
                m.next = "BEGIN"
            with m.State("BEGIN"):
                with m.If(~self.begins):
                    m.next = "END"
                    with m.If(lists):
                        m.next = "LIST"
            with m.State("LIST"):
                m.d.comb += self.listing.eq(1)
                m.next = "LISTING"
            with m.State("LISTING"):
                with m.If(self.listed):
                    m.next = "END"
            with m.State("END"):
                m.d.comb += self.actions.ready.eq(waits)
                with m.If(self.actions.valid & waits):
                    m.next = "PASS"
            with m.State("FAULT"):
                pass
        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))
        return m
