"""Execution of the positioner's commands."""

from amaranth import Cat, Module, Mux, Signal, Value, signed, unsigned
from amaranth.lib import stream, wiring
from amaranth.lib.fifo import SyncFIFO
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..protocol.positioner import MOTORS, POINTS, Answer, Command, PositionerOrder
from .points import PointStore

__all__ = ["MAX_WAITING", "START_SPEED", "WAITING", "Positioning"]

START_SPEED = 200
"""Speed of every motor after reset, in steps/s."""

WAITING, MAX_WAITING = 32, 1024
"""Default and largest depth of the queue of answers."""

UP, DOWN = 2**31 - 1, -2**31
"""Targets of an endless movement."""


class Positioning(wiring.Component):
    """Executes commands: holds connection, speeds, targets and stored points.

    ===============  ==============================================================================
    ``CONNECT``      gives the motors power
    ``DISCONNECT``   takes it, and ends every movement
    ``MOV``          the motor moves on, up if clockwise, until something ends that
    ``STOP``         ends the movement of a motor
    ``VEL``          sets its speed, also while it moves
    ``P``            stores a point
    ``GOTO``         all motors go to a point, each by itself
    ``ORIGIN``       this place is (0, 0, 0); ends going to a point
    ``POS``          this place is another; ends going to a point, which was meant in the old places
    ``ACK``          with 1, this and each command from here on is answered ``OK``; with 0 not
    ``STATE``        is answered ``STATE``
    ===============  ==============================================================================

    A motor has one movement, that of its last command. It ends when it arrives, and when a limit
    switch blocks it, which is answered ``LIMIT_MOTn``; no movement resumes by itself. ``MOV`` and
    ``GOTO`` are refused while nothing is connected, ``GOTO`` also for a point never stored. A
    refused command changes nothing and has one answer, its reason.

    A command is taken one clock after it is first offered, and takes effect one clock later:
    execution never waits for answers, so no earlier line delays a ``STOP``. Answers wait in a
    queue, in the order of their lines. The last place of the queue is for ``OVERFLOW``, which
    stands for all answers until there is room again.

    Parameters
    ----------
    top_speed : int
        Highest speed, in steps/s, from 1 to 2 ** 31 - 1.
    waiting : int
        Places of the queue of answers, from 2 to ``MAX_WAITING``.

    Members
    -------
    orders : In(stream.Signature(PositionerOrder))
        Commands, and lines that are none.
    numbers : In(signed(32)).array(3)
        Their numbers, see :class:`PositionerCommands`.
    in_position, limit_hit : In(3)
        Motors at their target; motors that a limit switch blocks.
    halt : In(1)
        Ends every movement; none begins.
    tick : In(1)
        Time base of the buzzer.
    answers : Out(stream.Signature(Answer))
        Answers, never ``NONE``. A limit that ended a movement comes before all others but the one
        that is offered already, which may be the state.
    connected : Out(1)
        The motors have power.
    rate : Out(range(top_speed + 1)).array(3)
        Speeds, in steps/s.
    run : Out(3)
        Motors that move.
    target_n : Out(signed(32)).array(3)
        Target positions, with all bits inverted, see :class:`MoveTo`. Of no meaning after reset,
        when nothing moves.
    load : Out(1)
        Set the positions to ``place``, with the edge that ends this clock.
    place : Out(signed(32)).array(3)
        Positions to set.
    buzzer : Out(1)
        Set when a limit switch ends a movement, until the second tick after that.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, top_speed: int, waiting: int = WAITING) -> None:
        self.top_speed = in_range("top_speed", top_speed, 1, 2**31 - 1)
        self.waiting = in_range("waiting", waiting, 2, MAX_WAITING)
        super().__init__({
            "orders": In(stream.Signature(PositionerOrder)),
            "numbers": In(signed(32)).array(MOTORS),
            "in_position": In(MOTORS), "limit_hit": In(MOTORS), "halt": In(1), "tick": In(1),
            "answers": Out(stream.Signature(Answer)),
            "connected": Out(1),
            "rate": Out(range(self.top_speed + 1), init=min(START_SPEED, self.top_speed)).array(
                MOTORS),
            "run": Out(MOTORS),
            "target_n": Out(signed(32)).array(MOTORS),
            "load": Out(1),
            "place": Out(signed(32)).array(MOTORS),
            "buzzer": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()

        m.submodules.points = points = PointStore(points=POINTS, axes=MOTORS)
        order = self.orders.p
        command = order.command
        lookup_done = Signal()  # the order was offered a clock ago, so its point has been read
        reason = Signal(Answer)  # why it is refused
        refusal = Signal(Answer)  # that, a clock later
        obeyed = Signal()
        acknowledges = Signal()  # since ACK 1
        answer = Signal(Answer)
        m.d.comb += points.number.eq(order.point)
        m.d.comb += reason.eq(order.answer)
        with m.If(order.answer == Answer.NONE):
            with m.If(((command == Command.MOV) | (command == Command.GOTO)) & ~self.connected):
                m.d.comb += reason.eq(Answer.DISCONNECTED)
            with m.Elif((command == Command.GOTO) & ~points.stored):
                m.d.comb += reason.eq(Answer.EMPTY)
        offered = Signal()  # for the first clock: it will be taken in the next
        accepted = Signal()
        m.d.comb += [
            offered.eq(self.orders.valid & ~lookup_done),
            accepted.eq(offered & (reason == Answer.NONE)),
            self.orders.ready.eq(lookup_done),
        ]
        m.d.sync += [
            lookup_done.eq(offered),
            refusal.eq(reason),
            obeyed.eq(accepted),
            self.load.eq(accepted & ((command == Command.ORIGIN) | (command == Command.POS))),
        ]

        m.d.comb += answer.eq(refusal)
        with m.If(obeyed):
            with m.If(command == Command.STATE):
                m.d.comb += answer.eq(Answer.STATE)
            with m.Elif(Mux(command == Command.ACK, self.numbers[-1][0], acknowledges)):
                m.d.comb += answer.eq(Answer.OK)
        m.submodules.queue = queue = SyncFIFO(width=4, depth=self.waiting)
        m.d.comb += [
            queue.w_en.eq(lookup_done & (answer != Answer.NONE)),
            queue.w_data.eq(Mux(queue.level < self.waiting - 1, answer, Answer.OVERFLOW)),
        ]

        # A limit switch ends a movement; its answer comes before all others.
        stopped = Signal(MOTORS)
        pending_limits = Signal(MOTORS)  # not answered yet
        free = Signal()
        m.d.comb += [
            stopped.eq(self.run & self.limit_hit),
            free.eq(~self.answers.valid | self.answers.ready),
            queue.r_en.eq(free & ~pending_limits.any()),
        ]
        first = pending_limits & (~pending_limits + 1)[:MOTORS]
        with m.If(free):
            m.d.sync += [
                self.answers.valid.eq(pending_limits.any() | queue.r_rdy),
                self.answers.payload.eq(Mux(pending_limits.any(), _limit(first), queue.r_data)),
            ]
        m.d.sync += pending_limits.eq(Mux(free, pending_limits & ~first, pending_limits) | stopped)
        self._sound(m, stopped)

        going = Signal(MOTORS)  # to a point
        m.d.sync += self.run.eq(self.run & ~self.in_position & ~stopped)
        with m.If(obeyed):
            self._obey(m, going, points)
            with m.If(command == Command.ACK):
                m.d.sync += acknowledges.eq(self.numbers[-1])
        with m.If(self.halt):
            m.d.sync += self.run.eq(0)
        return m

    def _obey(self, m: Module, going: Signal, points: PointStore) -> None:
        """Execute a command."""
        order = self.orders.p
        # movements that do not end in this clock
        left = self.run & ~self.in_position & ~self.limit_hit
        with m.Switch(order.command):
            with m.Case(Command.CONNECT):
                m.d.sync += self.connected.eq(1)
            with m.Case(Command.DISCONNECT):
                m.d.sync += [self.connected.eq(0), self.run.eq(0)]
            with m.Case(Command.MOV):
                for motor in range(MOTORS):
                    with m.If(order.motor == motor):
                        m.d.sync += [
                            self.run[motor].eq(1), going[motor].eq(0),
                            self.target_n[motor].eq(Mux(order.clockwise, ~UP, ~DOWN)),
                        ]
            with m.Case(Command.STOP):
                for motor in range(MOTORS):
                    with m.If(order.motor == motor):
                        m.d.sync += self.run[motor].eq(0)
            with m.Case(Command.VEL):
                for motor in range(MOTORS):
                    with m.If(order.motor == motor):
                        m.d.sync += self.rate[motor].eq(self.numbers[-1])
            with m.Case(Command.P):
                m.d.comb += points.store.eq(1)
            with m.Case(Command.GOTO):
                m.d.sync += [self.run.eq(~0), going.eq(~0),
                             Cat(self.target_n).eq(~Value.cast(Cat(points.found)))]
            with m.Case(Command.ORIGIN, Command.POS):
                m.d.sync += self.run.eq(left & ~going)

        for point, place, number in zip(points.place, self.place, self.numbers, strict=True):
            m.d.comb += point.eq(number)
            with m.If(order.command == Command.POS):
                m.d.comb += place.eq(number)

    def _sound(self, m: Module, stopped: Signal) -> None:
        """Sound the buzzer for two ticks."""
        ticks = Signal(unsigned(2))
        m.d.comb += self.buzzer.eq(ticks != 0)
        with m.If(stopped.any()):
            m.d.sync += ticks.eq(2)
        with m.Elif(self.tick & self.buzzer):
            m.d.sync += ticks.eq(ticks - 1)


def _limit(first: Signal):
    """Return the answer for the one bit that is set."""
    return Mux(first[0], Answer.LIMIT_MOT1,
               Mux(first[1], Answer.LIMIT_MOT2, Answer.LIMIT_MOT3))
