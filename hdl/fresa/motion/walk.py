"""Lines and arcs of three axes, step by step."""

from amaranth import Cat, Module, Mux, Signal, signed, unsigned
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from .rotator import Rotator
from .step_accumulator import StepAccumulator
from .step_ratio import StepRatio

__all__ = ["WALK_DELAY", "PathWalk", "Segment"]

MAX_LOG2_TICKS = 36
FRACTION = MAX_LOG2_TICKS + 8  # bits of a fraction of a step

WALK_DELAY = 10
"""Clocks from a tick to what it adds to a line."""


class Segment(data.Struct):
    """A line or an arc of :class:`PathWalk`, on the channels u, v and w (0, 1 and 2).

    In a line each channel goes by its increment, less than a step a tick. In an arc w does; u and v
    go round a centre, in steps of the axis of u, which has no fewer steps per metre than that of v.
    An arc takes `turns` half turns of a :class:`Rotator`, two a tick at most, each of which is
    ``asin(2**-(shift + 1))``. With ``2**e`` steps as the unit of x and y, no less than the radius,
    and e from 1 to 21, `shift` is ``e + 3``: then a half turn is 1/8 step at most.
    """

    increment: data.ArrayLayout(signed(34), 3)  # 1/256 step; |increment| < 256 * ticks
    start: data.ArrayLayout(unsigned(8), 3)  # fraction of position + 1/2 step; in arcs not of v
    end: data.ArrayLayout(unsigned(2), 3)  # of each axis: position in steps at the end, modulo 4
    channel: data.ArrayLayout(unsigned(2), 3)  # of each axis: its channel; 3 is none
    log2_ticks: unsigned(6)  # to 36
    arc: unsigned(1)
    clockwise: unsigned(1)
    turns: unsigned(MAX_LOG2_TICKS + 2)  # to 2 * ticks; 0 in a line
    shift: unsigned(5)
    x: signed(36)  # from the centre to the start, in 2**-34 of the unit
    y: signed(36)
    residual: unsigned(29)  # of an arc, see StepRatio: fraction of position + 1/2 step of v


class PathWalk(wiring.Component):
    """Makes steps of the ticks of segments: lines, arcs and helices, with no error that adds up.

    A segment has ``2**log2_ticks`` ticks, whenever they come, one a clock at most. In a line each
    tick adds the same part of a step to each channel, so that after the last one the position is
    exactly ``start + increment``. In an arc the ticks are spread over half turns, of which one
    takes two clocks; a few may wait. Steps of the axis of v are made of quarter steps of that of u,
    so that their numbers per metre may differ.

    When a segment ends, the steps of each axis since power-up are compared with its ``end``,
    modulo 4. An arc may have rounded its end the other way: then a corrective step is made, one an
    axis at most, in the first clock in which the axis makes no other.

    The next segment is prepared while the present one runs, which takes 38 clocks at most, and is
    taken from ``segments`` when it begins: with the first tick after the last one, or at once if
    none runs. Steps of a line come ``WALK_DELAY + 1`` clocks after their tick. By then the half
    turns of an arc before must be made, which is so if they come two clocks apart on average.

    Members
    -------
    segments : In(stream)
        The next segment. It is looked at long before it is taken.
    fine, coarse : In(27)
        Steps per metre of the axes of u and v while arcs run: ``1 <= coarse <= fine``.
    tick, last : In(1)
        A tick, and with it whether it is the last one of the segment. Only with ``ready``.
    load, position : In(1), In(2 bits an axis)
        Set the position in steps of each axis, modulo 4; only without ``busy``.
    ready : Out(1)
        A segment runs.
    busy : Out(1)
        A segment runs, or its last steps are not made yet.
    step, direction : Out(3)
        A step of each axis; 1 is forward.
    fault : Out(1)
        A tick without a segment, a segment that is out of range, half turns or segments that came
        too fast, or an end that is 2 steps off. It stays until a reset.
    """

    segments: In(stream.Signature(Segment))
    fine: In(27)
    coarse: In(27)
    tick: In(1)
    last: In(1)
    load: In(1)
    position: In(data.ArrayLayout(unsigned(2), 3))
    ready: Out(1)
    busy: Out(1)
    step: Out(3)
    direction: Out(3)
    fault: Out(1)

    def elaborate(self, platform) -> Module:
        m = Module()
        faults = []
        segment = self.segments.payload

        # Preparation: what one tick adds is the whole, shifted by a bit a clock.
        prepared = [Signal(signed(FRACTION + 1), name=f"prepared_{channel}", reset_less=True)
                    for channel in range(3)]
        prepared_turns = Signal(MAX_LOG2_TICKS + 2, reset_less=True)
        exponent = Signal(6, reset_less=True)
        shifting = Signal()
        full = Signal()
        changing = Signal()
        with m.If(shifting):
            with m.If(exponent == MAX_LOG2_TICKS):
                m.d.sync += [shifting.eq(0), full.eq(1)]
            with m.Else():
                m.d.sync += [exponent.eq(exponent + 1), prepared_turns.eq(prepared_turns << 1)]
                m.d.sync += [each.eq(each << 1) for each in prepared]
                faults += [shifting & (exponent != MAX_LOG2_TICKS) & Cat(
                    prepared_turns[-1], *(each[-1] != each[-2] for each in prepared)).any()]
        with m.Elif(self.segments.valid & ~full & ~changing):
            m.d.sync += [shifting.eq(1), exponent.eq(segment.log2_ticks),
                         prepared_turns.eq(segment.turns)]
            m.d.sync += [each.eq(segment.increment[channel])
                         for channel, each in enumerate(prepared)]

        # A tick, the end of a segment and the change to the next go through a delay, so that the
        # half turns of an arc before are made by then.
        running = Signal()
        ticks = Signal(WALK_DELAY)
        ends = Signal(WALK_DELAY + 2)
        changes = Signal(WALK_DELAY + 2)
        ticked = self.tick & running
        ended = ticked & self.last
        change = Signal()
        m.d.comb += [
            self.ready.eq(running),
            change.eq(full & ~changing & (ended | ~running)),
            self.segments.ready.eq(changes[-1]),
        ]
        m.d.sync += [
            ticks.eq(Cat(ticked, ticks)), ends.eq(Cat(ended, ends)),
            changes.eq(Cat(change, changes)),
        ]
        faults += [self.tick & ~running]
        with m.If(change):
            m.d.sync += [running.eq(1), full.eq(0), changing.eq(1)]
        with m.Elif(ended):
            m.d.sync += running.eq(0)
        with m.If(changes[-1]):
            m.d.sync += changing.eq(0)
        changed = changes[WALK_DELAY - 1]

        m.submodules.rotator = rotator = Rotator(width=FRACTION - 1)
        m.d.comb += [
            rotator.x.eq(segment.x), rotator.y.eq(segment.y), rotator.shift.eq(segment.shift),
            rotator.mirror.eq(segment.clockwise),
        ]
        faults += self._turns(m, rotator, ticked, change, changes, prepared_turns)

        # Channels
        arc = Signal()
        clockwise = Signal(reset_less=True)
        increments = [Signal(signed(FRACTION + 1), name=f"increment_{channel}", reset_less=True)
                      for channel in range(3)]
        with m.If(changed):
            m.d.sync += [arc.eq(segment.arc), clockwise.eq(segment.clockwise)]
            m.d.sync += [now.eq(then) for now, then in zip(increments, prepared, strict=True)]
        channels = []
        for channel, name in enumerate("uvw"):
            m.submodules[name] = each = StepAccumulator(width=FRACTION)
            channels.append(each)
            m.d.comb += [each.load.eq(changed), each.start.eq(segment.start[channel]),
                         each.add.eq(ticks[-1]), each.term.eq(increments[channel])]
        u, v, w = channels
        with m.If(arc):
            m.d.comb += [u.add.eq(rotator.moves_u), u.term.eq(~rotator.vector),
                         v.add.eq(rotator.moves_v), v.term.eq(rotator.vector)]
        with m.If(segment.arc):
            # Quarter steps are rounded, hence 1/8; the first addition is of half the size, which
            # is x / 2**44 less than what is added.
            m.d.comb += v.start.eq(32 - (segment.x >> 30))

        m.submodules.ratio = ratio = StepRatio(width=27)
        quarters = Signal()  # v makes quarter steps
        m.d.sync += quarters.eq(arc)
        m.d.comb += [
            ratio.fine.eq(self.fine), ratio.coarse.eq(self.coarse), ratio.load.eq(changed),
            ratio.residual.eq(segment.residual), ratio.quarter.eq(v.quarter & quarters),
            ratio.forward.eq(v.direction ^ clockwise),
        ]

        faults += self._axes(
            m, ends[-1], changes[-2:],
            Cat(u.step, Mux(quarters, ratio.step, v.step), w.step, 0),
            Cat(u.direction, Mux(quarters, ratio.direction, v.direction), w.direction, 0))
        m.d.comb += self.busy.eq(running | changing | ticks.any() | ends.any() | self.step.any())
        with m.If(Cat(faults).any()):
            m.d.sync += self.fault.eq(1)

        return m

    def _turns(self, m: Module, rotator: Rotator, ticked: Signal, change: Signal, changes: Signal,
               prepared: Signal) -> list:
        """Make half turns of ticks, those of a segment before those of the next; return faults."""
        # From all ones: the first half turn comes with the first tick, the others after it.
        angle = Signal(MAX_LOG2_TICKS, init=-1)
        turns = Signal.like(prepared)
        total = Signal.like(prepared)
        made = Signal(2)  # half turns of a tick
        m.d.comb += total.eq(angle + turns)
        m.d.sync += made.eq(0)
        with m.If(ticked):
            m.d.sync += [angle.eq(total), made.eq(total[MAX_LOG2_TICKS:])]
        with m.If(change):
            m.d.sync += [angle.eq(-1), turns.eq(prepared)]

        due = Signal(3)
        due_next = Signal(3)  # those of the next segment, while some of this one are due
        waits = Signal()  # the next segment has begun, but not for the rotator
        held = Signal()  # it has for the rotator, but not for the channels
        left = Signal(4)
        left_next = Signal(4)
        m.d.comb += [
            rotator.turn.eq(due.any() & ~held),
            rotator.load.eq(waits & ~due.any() & rotator.ready),
            left.eq(Mux(rotator.load, due_next, due - (rotator.turn & rotator.ready))
                    + Mux(waits & ~rotator.load, 0, made)),
            left_next.eq(due_next + made),
        ]
        m.d.sync += due.eq(left)
        with m.If(rotator.load):
            m.d.sync += [due_next.eq(0), waits.eq(0), held.eq(1)]
        with m.Elif(waits):
            m.d.sync += due_next.eq(left_next)
        with m.If(changes[0]):
            m.d.sync += waits.eq(1)
        changed = changes[WALK_DELAY - 1]
        with m.If(changed):
            m.d.sync += held.eq(0)
        return [left[-1], waits & left_next[-1], changed & waits]

    def _axes(self, m: Module, ended: Signal, changes: Signal, steps: Cat, directions: Cat) -> list:
        """Give each axis the steps of its channel, and a corrective one; return faults."""
        segment = self.segments.payload
        faults = []
        for axis in range(3):
            channel = Signal(2, init=3, name=f"channel_{axis}")
            end = Signal(2, name=f"end_{axis}")
            count = Signal(2, name=f"count_{axis}")
            due = Signal(name=f"due_{axis}")
            back = Signal(name=f"back_{axis}")
            step = Signal(name=f"step_{axis}")
            direction = Signal(name=f"direction_{axis}")
            error = Signal(2, name=f"error_{axis}")
            m.d.comb += [
                step.eq(steps.bit_select(channel, 1)),
                direction.eq(directions.bit_select(channel, 1)),
                error.eq(end - count),
                self.step[axis].eq(step | due),
                self.direction[axis].eq(Mux(step, direction, ~back)),
            ]
            with m.If(changes[0]):
                m.d.sync += channel.eq(segment.channel[axis])
            with m.If(changes[1]):
                m.d.sync += end.eq(segment.end[axis])
            m.d.sync += count.eq(Mux(ended, end, count) + Mux(step, Cat(1, ~direction), 0))
            with m.If(self.load):
                m.d.sync += count.eq(self.position[axis])
            with m.If(ended):
                m.d.sync += [due.eq(error[0]), back.eq(error[1])]
            with m.Elif(~step):
                m.d.sync += due.eq(0)
            faults += [ended & ((error == 2) | (due & step))]
        return faults
