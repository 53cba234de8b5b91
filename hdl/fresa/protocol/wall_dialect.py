"""The commands of the hanging plotter of a thesis, beside lines of G-code."""

from enum import IntEnum

from amaranth import Array, Cat, Module, Mux, Signal, Value, signed, unsigned
from amaranth.lib import enum, stream, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..fsm import leave_unused_codes
from .decimal_writer import DecimalWriter
from .line import LineEnd, LineItem
from .text import TextSource

__all__ = ["MAX_MM", "HomingStage", "WallDialect", "wall_texts"]

MAX_MM = 9999
"""Largest coordinate, in mm: a command has four digits of each."""

SETTLE = 63
"""Clocks in which a line that is answered has begun to move, less one."""


class HomingStage(enum.Enum, shape=unsigned(2)):
    """What a homing cycle does."""

    NONE = 0
    FIRST = 1  # the left string
    SECOND = 2  # the right one
    REST = 3  # to the place of rest


class _Text(IntEnum):
    """What is said, by its place among the texts."""

    FIRST = 0  # stages of homing, in the order of these
    SECOND = 1
    REST = 2
    HOMED = 3
    POWERED = 4
    RELEASED = 5
    TO_START = 6
    AT_START = 7
    DRAWING = 8
    DRAWN = 9
    STOPPED = 10
    REFUSED = 11
    HOME_FIRST = 12
    START_FIRST = 13
    OFF_THE_WALL = 14
    BUSY = 15
    EMERGENCY = 16
    DAMAGED = 17
    COMMANDS = 18
    SYNTAX_P = 19
    SYNTAX_H = 20
    SYNTAX_I = 21
    SYNTAX_F = 22
    SYNTAX_S = 23
    LINE_HOME = 24  # parts of lines of G-code
    LINE_SLEEP = 25
    LINE_JOG = 26
    LINE_Y = 27
    LINE_FEED = 28
    STATE = 31  # of which there is no text


def wall_texts(*, width: int, top: int, height: int, feed: int) -> list[bytes]:
    """Return all texts in their order; see :class:`WallDialect`."""
    said = {
        _Text.FIRST: "Homing motor 1.",
        _Text.SECOND: "Homing motor 2.",
        _Text.REST: "Going to the place of rest.",
        _Text.HOMED: "Homed. Give a start point: :Ixxxxyyyy",
        _Text.POWERED: "Motors powered.",
        _Text.RELEASED: "Motors released: the place is unknown.",
        _Text.TO_START: "Going to the start point.",
        _Text.AT_START: "At the start point. Give the end point: :Fxxxxyyyy",
        _Text.DRAWING: "Drawing.",
        _Text.DRAWN: "Line drawn. Give a start point: :Ixxxxyyyy",
        _Text.STOPPED: "Stopped before the end.",
        _Text.REFUSED: "Refused: ? tells the state. $X or :H ends an alarm, ~ a hold, :P1 a sleep",
        _Text.HOME_FIRST: "The place is unknown. Home first: :H",
        _Text.START_FIRST: "Give a start point first: :Ixxxxyyyy",
        _Text.OFF_THE_WALL: f"Off the wall: x is 0000 to {width:04}, y is {top:04} to {height:04}",
        _Text.BUSY: "Busy: wait until it stands.",
        _Text.EMERGENCY: "Emergency stop, or a motor's fault: end that first.",
        _Text.DAMAGED: "That came damaged: send it again.",
        _Text.COMMANDS: "Commands: :P1 :P0 :H :Ixxxxyyyy :Fxxxxyyyy :S0 :S1 :S2",
        _Text.SYNTAX_P: "Power of the motors: :P1 on, :P0 off",
        _Text.SYNTAX_H: "Home: :H",
        _Text.SYNTAX_I: "Start point, x and y in mm, four digits each: :Ixxxxyyyy",
        _Text.SYNTAX_F: "End point, x and y in mm, four digits each: :Fxxxxyyyy",
        _Text.SYNTAX_S: "State: :S0 of the master, :S1 and :S2 of the motors",
    }
    lines = {_Text.LINE_HOME: "$H", _Text.LINE_SLEEP: "$SLP", _Text.LINE_JOG: "$J=G21G90G53X",
             _Text.LINE_Y: "Y", _Text.LINE_FEED: f"F{feed}"}
    return [f"{said[text]}\r\n".encode() if text in said else lines[text].encode()
            for text in list(_Text)[:-1]]


class _Job(enum.Enum, shape=unsigned(2)):
    """What a command has begun."""

    HOME = 0
    SLEEP = 1
    GO = 2
    DRAW = 3


class _Phase(enum.Enum, shape=unsigned(3)):
    """How far that is."""

    NONE = 0
    ASKED = 1  # its line is not answered
    SETTLE = 2  # it is, and it may not have begun to move
    MOVE = 3
    END = 4  # what has become of it is to be said


class WallDialect(wiring.Component):
    """Carries out the commands of the thesis' plotter, by lines of G-code, and passes on others.

    A line whose first byte is ``:`` is a command; in lower case it is the same. Coordinates are in
    mm from the upper left corner, y down. It says when each stage begins and ends, and what the
    right form of a command is.

    ==============  ============================================================  ==================
    command         does                                                          by the line
    ==============  ============================================================  ==================
    ``:P1``         powers the motors, and ends a sleep                           a reset
    ``:P0``         releases them; what hangs there is not where it was           ``$SLP``
    ``:H``          homes                                                         ``$H``
    ``:Ixxxxyyyy``  goes to the start point with the pen off                      ``$J=``
    ``:Fxxxxyyyy``  draws a line from there to the end point                      ``$J=``
    ``:S0``         gives the state of the master, two hexadecimal digits;
                    ``:S1`` and ``:S2`` those of the motors
    ==============  ============================================================  ==================

    Bits of a state: 0 powered, 1 homing, 2 homed, 3 moving, 4 ready to draw, 5 drawing. Commands
    are taken while it moves, too, but of these only ``:S`` and ``:P1`` are obeyed. Lines of G-code
    wait for the answer to the one before, and for the end of what a command has begun. While such
    an answer is to come of commands only ``:S`` is obeyed, and others wait, as does what is behind
    them. A line that is refused keeps the start point.

    Parameters
    ----------
    width, top, height : int
        Of the wall in mm: x is from 0 to `width`, and y from `top` to `height`. Positions of the
        machine are 0 at x = `width`, y = `top`, and negative elsewhere.
    feed : int
        Highest speed in mm/min, of the line of motions.
    bowed : bool
        ``:F`` is drawn as in the thesis, with each string at constant speed, while the machine is
        in the state of homing: by ``$H`` and ``bows``.

    Members
    -------
    lines : In(stream.Signature(LineItem))
        Lines.
    items : Out(stream.Signature(LineItem))
        Those of G-code, and those that commands become.
    answered, refused : In(1)
        The last line of `items` is answered, for one clock; with an error.
    own : Out(1)
        The line that is answered next is one of a command: its answer is not to be sent.
    moving, homed, powered, sleeping, emergency : In(1)
        The machine moves, or is to; knows its place; its motors have power; it sleeps; there is an
        emergency stop.
    stage : In(HomingStage)
        What its homing cycle does.
    cancelled : In(1)
        What was left of a motion is discarded, for one clock.
    renewed : In(1)
        All else is reset, and lines that had begun are lost.
    power, wake : Out(1)
        Power the motors; do so with a reset, as it sleeps. For one clock each.
    pen, lifts : Out(1)
        A command draws; it goes to a start point, so that the pen has to be off.
    bows, end : Out(1), Out(14) x 2
        The ``$H`` that is to be answered is a bowed line; its end point in mm. Only if `bowed`.
    drawing : In(1)
        The motors draw that. Only if `bowed`.
    states : Out(6) x 3
        State of the master, and of the motors.
    bytes : Out(stream.Signature(8))
        What it says, in lines.
    fault : Out(1)
        A state register was upset. Stays until reset.

    Raises
    ------
    ValueError
        If a parameter is out of range.

    Source: thesis of the hanging plotter, 3.1. Its texts are not known, so these are ours.
    """

    def __init__(self, *, width: int, top: int, height: int, feed: int, bowed: bool = False
                 ) -> None:
        self.width = in_range("width of the wall in mm", width, 1, MAX_MM)
        self.height = in_range("height of the wall in mm", height, 1, MAX_MM)
        self.top = in_range("least y in mm", top, 0, height)
        self.feed = in_range("feed in mm/min", feed, 1, 10**6)
        self.bowed = bowed
        bows = {"bows": Out(1), "end": Out(14).array(2), "drawing": In(1)} if bowed else {}
        super().__init__({
            "lines": In(stream.Signature(LineItem)), "items": Out(stream.Signature(LineItem)),
            "answered": In(1), "refused": In(1), "own": Out(1), "moving": In(1), "homed": In(1),
            "powered": In(1), "sleeping": In(1), "emergency": In(1), "stage": In(HomingStage),
            "cancelled": In(1), "renewed": In(1), "power": Out(1), "wake": Out(1), "pen": Out(1),
            "lifts": Out(1),
            "states": Out(6).array(3), "bytes": Out(stream.Signature(8)), "fault": Out(1), **bows})

    def elaborate(self, platform) -> Module:
        m = Module()
        w = _Work()
        draws = w.job == _Job.DRAW
        m.d.comb += [
            self.own.eq(w.phase == _Phase.ASKED),
            self.pen.eq(draws & (self.drawing if self.bowed else (w.phase == _Phase.SETTLE)
                                 | (w.phase == _Phase.MOVE))),
            self.lifts.eq((w.job == _Job.GO) & (w.phase != _Phase.NONE)),
        ]
        if self.bowed:
            m.d.comb += [self.bows.eq(draws & (w.phase == _Phase.ASKED)),
                         *(end.eq(each) for end, each in zip(self.end, w.target, strict=True))]
        faults = [self._speak(m, w), self._take_lines(m, w)]
        self._carry_out(m, w)
        m.d.comb += self.fault.eq(Cat(faults).any())
        return m

    def _take_lines(self, m: Module, w: "_Work") -> Value:
        """Pass lines of G-code on, and begin what commands say."""
        lines, items = self.lines, self.items
        letter = Signal(8)
        digits = Signal(range(16))
        wrong = Signal()
        damaged = Signal()
        byte = lines.p.byte
        digit = (byte >= ord("0")) & (byte <= ord("9"))

        def passes() -> None:
            m.d.comb += [items.payload.eq(lines.payload), items.valid.eq(lines.valid),
                         lines.ready.eq(items.ready)]
            with m.If(lines.valid & items.ready):
                m.next = "PASS"
                with m.If(lines.p.end):
                    m.d.sync += w.waits.eq(1)
                    m.next = "LINE"

        with m.If(self.answered):
            m.d.sync += w.waits.eq(0)
        with m.FSM(name="wall_state") as fsm:
            with m.State("LINE"):
                with m.If(lines.valid & ~lines.p.end & (byte == ord(":"))):
                    m.d.comb += lines.ready.eq(1)
                    m.d.sync += [letter.eq(0), digits.eq(0), wrong.eq(0),
                                 *(each.eq(0) for each in w.coordinates)]
                    m.next = "LETTER"
                with m.Elif((w.phase == _Phase.NONE) & ~w.waits):
                    passes()
            with m.State("PASS"):
                passes()
            with m.State("LETTER"):
                m.d.comb += lines.ready.eq(1)
                m.d.sync += [letter.eq(byte & ~0x20), damaged.eq(byte != LineEnd.GOOD)]
                with m.If(lines.valid):
                    m.next = "DIGITS"
                    with m.If(lines.p.end):
                        m.d.sync += letter.eq(0)
                        m.next = "ACT"
            with m.State("DIGITS"):
                m.d.comb += lines.ready.eq(1)
                m.d.sync += damaged.eq(byte != LineEnd.GOOD)
                with m.If(lines.valid & lines.p.end):
                    m.next = "ACT"
                with m.Elif(lines.valid):
                    m.d.sync += [wrong.eq(wrong | ~digit), digits.eq(digits + ~digits.all())]
                    for number, each in enumerate(w.coordinates):
                        with m.If((digits >> 2) == number):
                            m.d.sync += each.eq(((each << 2) + each << 1) + byte[:4])
            with m.State("ACT"):
                with m.If(~w.replies & ~self.renewed):
                    m.next = "LINE"
                    self._act(m, w, letter, digits, wrong, damaged)
                    with m.If(self.wake):
                        m.next = "WAKE"
            with m.State("WAKE"):  # until the reset, and through it
                with m.If(self.renewed):
                    self._reply(m, w, _Text.POWERED)
                    m.d.comb += self.power.eq(1)
                    m.next = "LINE"
            with m.State("FAULT"):
                pass
        with m.If(self.renewed):
            m.d.sync += w.waits.eq(0)
            with m.If(~fsm.ongoing("FAULT")):
                m.d.sync += fsm.state.eq(fsm.encoding["LINE"])
        return leave_unused_codes(m, fsm, fault="FAULT")

    def _reply(self, m: Module, w: "_Work", text: _Text) -> None:
        m.d.sync += [w.replies.eq(1), w.reply.eq(text)]

    def _act(self, m: Module, w: "_Work", letter: Signal, digits: Signal, wrong: Signal,
             damaged: Signal) -> None:
        """Obey a command, or say why not."""
        x, y = w.coordinates
        busy = (w.phase != _Phase.NONE) | self.moving
        beyond = (x > self.width) | (y < self.top) | (y > self.height)

        def command(character: str):
            return m.Elif(letter == ord(character))

        def unless(condition, text: _Text, *, first: bool = False):
            with m.If(condition) if first else m.Elif(condition):
                self._reply(m, w, text)

        def wait() -> None:
            """Until the line before is answered, and what it does has begun."""
            with m.Elif(w.waits | ((w.phase == _Phase.NONE) & (w.left != 0))):
                m.next = "ACT"

        def begin(job: _Job) -> None:
            m.d.sync += [w.job.eq(job), w.phase.eq(_Phase.ASKED), w.sends.eq(1), w.told.eq(0),
                         w.stopped.eq(0),
                         *(to.eq(each) for to, each in zip(w.target, w.coordinates, strict=True))]

        with m.If(damaged):
            self._reply(m, w, _Text.DAMAGED)
        with command("P"):
            unless(wrong | (digits != 1) | (x > 1), _Text.SYNTAX_P, first=True)
            unless((w.job == _Job.SLEEP) & (w.phase != _Phase.NONE), _Text.BUSY)
            wait()  # it may be a sleep
            unless((x == 1) & self.emergency, _Text.EMERGENCY)
            with m.Elif(x == 1):
                m.d.comb += self.wake.eq(self.sleeping)
                with m.If(~self.sleeping):
                    m.d.comb += self.power.eq(1)
                    self._reply(m, w, _Text.POWERED)
            unless(busy, _Text.BUSY)
            with m.Else():
                begin(_Job.SLEEP)
        with command("H"):
            unless(wrong | (digits != 0), _Text.SYNTAX_H, first=True)
            wait()
            unless(busy, _Text.BUSY)
            with m.Else():
                begin(_Job.HOME)
        for character, syntax, job in (("I", _Text.SYNTAX_I, _Job.GO),
                                       ("F", _Text.SYNTAX_F, _Job.DRAW)):
            with command(character):
                unless(wrong | (digits != 8), syntax, first=True)
                wait()
                unless(busy, _Text.BUSY)
                unless(~self.homed, _Text.HOME_FIRST)
                if job == _Job.DRAW:
                    unless(~w.ready, _Text.START_FIRST)
                unless(beyond, _Text.OFF_THE_WALL)
                with m.Else():
                    begin(job)
        with command("S"):
            with m.If(wrong | (digits != 1) | (x > 2)):
                self._reply(m, w, _Text.SYNTAX_S)
            with m.Else():
                self._reply(m, w, _Text.STATE)
                m.d.sync += w.shown.eq(Array(self.states)[x[:2]])
        with m.Else():
            self._reply(m, w, _Text.COMMANDS)

    def _carry_out(self, m: Module, w: "_Work") -> None:
        """Follow what a command has begun, and say so."""
        outcome = Signal(_Text)

        def tell(text) -> None:
            m.d.sync += [w.tells.eq(1), w.event.eq(text)]

        def end(text) -> None:
            m.d.sync += [w.phase.eq(_Phase.END), outcome.eq(text)]

        with m.Switch(w.phase):
            with m.Case(_Phase.NONE):
                with m.If(self.answered):
                    m.d.sync += w.left.eq(SETTLE)
                with m.Elif(w.left != 0):
                    m.d.sync += w.left.eq(w.left - 1)
            with m.Case(_Phase.ASKED):
                m.d.sync += w.left.eq(SETTLE)
                with m.If((w.job == _Job.HOME) & (self.stage.as_value() != w.told) & ~w.tells):
                    m.d.sync += w.told.eq(self.stage)
                    with m.If(self.stage != HomingStage.NONE):
                        tell(self.stage.as_value() - 1)
                if self.bowed:
                    with m.If(self.pen & (w.told == 0) & ~w.tells):
                        m.d.sync += w.told.eq(1)
                        tell(_Text.DRAWING)
                with m.If(self.answered):
                    with m.Switch(w.job):
                        with m.Case(_Job.HOME):
                            end(_Text.HOMED)
                        if self.bowed:
                            with m.Case(_Job.DRAW):
                                end(_Text.DRAWN)
                        with m.Case(_Job.SLEEP):
                            end(_Text.RELEASED)
                        with m.Default():
                            m.d.sync += w.phase.eq(_Phase.SETTLE)
                    with m.If(self.refused):
                        end(_Text.REFUSED)
            with m.Case(_Phase.SETTLE):
                with m.If((w.left != SETTLE) | ~w.tells):
                    m.d.sync += w.left.eq(w.left - 1)
                with m.If((w.left == SETTLE) & ~w.tells):
                    tell(Mux(w.job == _Job.DRAW, _Text.DRAWING, _Text.TO_START))
                with m.If(w.left == 0):
                    m.d.sync += w.phase.eq(_Phase.MOVE)
            with m.Case(_Phase.MOVE):
                with m.If(~self.moving):
                    end(Mux(w.stopped, _Text.STOPPED,
                            Mux(w.job == _Job.DRAW, _Text.DRAWN, _Text.AT_START)))
            with m.Case(_Phase.END):
                with m.If(~w.tells):
                    m.d.sync += w.phase.eq(_Phase.NONE)
                    with m.If(outcome != _Text.REFUSED):
                        m.d.sync += w.ready.eq(outcome == _Text.AT_START)
                    tell(outcome)
        with m.If(self.cancelled):
            m.d.sync += w.stopped.eq(1)
        with m.If((w.phase == _Phase.NONE) & (self.moving | ~self.homed)):  # it is elsewhere
            m.d.sync += w.ready.eq(0)
        with m.If(self.renewed):
            m.d.sync += [w.sends.eq(0), w.ready.eq(0)]
            with m.If((w.phase != _Phase.NONE) & (w.phase != _Phase.END)):
                end(_Text.STOPPED)

        # Bits P R H M L D of the master, then of the motors.
        jogs, draws = w.job.as_value()[1], w.job == _Job.DRAW
        asked = (w.phase == _Phase.ASKED)
        going = (w.phase == _Phase.SETTLE) | (w.phase == _Phase.MOVE)
        moves = self.moving | (jogs & (asked | going))
        homes, seeks_right = self.stage != HomingStage.NONE, self.stage == HomingStage.SECOND
        seeks_left = self.stage == HomingStage.FIRST
        rests = self.homed | (self.stage == HomingStage.REST)
        learns = draws & asked  # a motor its speed
        if self.bowed:
            m.d.sync += w.drawn.eq((w.drawn | self.drawing) & asked)
            learns &= ~(self.drawing | w.drawn)
        ready = w.ready & (w.phase == _Phase.NONE)
        m.d.comb += [
            self.states[0].eq(Cat(self.powered, homes, self.homed, ~homes & moves, ready,
                                  draws & (asked | going))),
            self.states[1].eq(Cat(self.powered, seeks_left | seeks_right, rests | seeks_right,
                                  homes | (moves & ~learns), learns, self.pen)),
            self.states[2].eq(Cat(self.powered, seeks_right, rests,
                                  homes | (moves & ~learns), learns, self.pen)),
        ]

    def _speak(self, m: Module, w: "_Work") -> Value:
        """Send what is said, and pass lines on that commands have become."""
        texts = TextSource(wall_texts(width=self.width, top=self.top, height=self.height,
                                      feed=self.feed))
        shape = signed(len(w.coordinates[0]) + 1)
        writer = DecimalWriter(width=shape.width, is_signed=True)
        m.submodules.texts, m.submodules.writer = texts, writer
        numbers, items = texts.numbers, self.items
        digit = Signal(4)
        second = Signal()  # the second digit; Y
        piece = Signal(_Text)
        lost = Signal()  # the line is, by a reset
        jogs = w.job == _Job.GO if self.bowed else w.job.as_value()[1]
        homes = w.job == _Job.HOME
        if self.bowed:
            homes |= w.job == _Job.DRAW
        x, y = w.target

        def ask(text, then: str) -> None:
            m.d.comb += [numbers.valid.eq(1), numbers.payload.eq(text)]
            m.next = then

        def give(source: stream.Interface) -> None:
            with m.If(~lost):
                m.d.comb += [items.valid.eq(source.valid), items.p.byte.eq(source.payload),
                             items.p.end.eq(0)]
            m.d.comb += source.ready.eq(items.ready | lost)

        m.d.comb += writer.numbers.payload.eq(Mux(second, self.top - y, x - self.width))
        with m.FSM(name="speak_state") as fsm:
            with m.State("REST"):
                m.d.sync += second.eq(0)
                with m.If(w.replies & (w.reply == _Text.STATE)):
                    m.next = "DIGIT"
                with m.Elif(w.replies):
                    ask(w.reply, "REPLY")
                with m.Elif(w.tells):
                    ask(w.event, "TELL")
                with m.Elif(w.sends & ~self.renewed):
                    m.next = "PIECE"
                    m.d.sync += w.sends.eq(0)
                    m.d.sync += piece.eq(Mux(jogs, _Text.LINE_JOG, Mux(
                        homes, _Text.LINE_HOME, _Text.LINE_SLEEP)))
            for state, waits in (("REPLY", w.replies), ("TELL", w.tells)):
                with m.State(state):
                    m.d.comb += [self.bytes.valid.eq(texts.bytes.valid),
                                 self.bytes.payload.eq(texts.bytes.payload),
                                 texts.bytes.ready.eq(self.bytes.ready)]
                    with m.If(numbers.ready):
                        m.d.sync += waits.eq(0)
                        m.next = "REST"
            with m.State("DIGIT"):
                m.d.comb += [digit.eq(Mux(second, w.shown[:4], w.shown[4:])),
                             self.bytes.valid.eq(1),
                             self.bytes.payload.eq(digit + Mux(digit > 9, ord("A") - 10, ord("0")))]
                with m.If(self.bytes.ready):
                    m.d.sync += second.eq(1)
                    with m.If(second):
                        m.next = "RETURN"
            for state, byte, then in (("RETURN", "\r", "FEED"), ("FEED", "\n", "REST")):
                with m.State(state):
                    m.d.comb += [self.bytes.valid.eq(1), self.bytes.payload.eq(ord(byte))]
                    with m.If(self.bytes.ready):
                        m.next = then
                        if then == "REST":
                            m.d.sync += w.replies.eq(0)
            with m.State("PIECE"):
                ask(piece, "GIVE")
            with m.State("GIVE"):
                give(texts.bytes)
                with m.If(numbers.ready):
                    m.next = "NUMBER"
                    with m.If(~jogs | (piece == _Text.LINE_FEED)):
                        m.next = "END"
            with m.State("NUMBER"):
                m.d.comb += writer.numbers.valid.eq(1)
                m.next = "WRITE"
            with m.State("WRITE"):
                give(writer.bytes)
                with m.If(writer.numbers.ready):
                    m.d.sync += [second.eq(1),
                                 piece.eq(Mux(second, _Text.LINE_FEED, _Text.LINE_Y))]
                    m.next = "PIECE"
            with m.State("END"):
                with m.If(~lost):
                    m.d.comb += [items.valid.eq(1), items.p.byte.eq(LineEnd.GOOD),
                                 items.p.end.eq(1)]
                with m.If(items.ready | lost):
                    m.next = "REST"
            with m.State("FAULT"):
                pass
        with m.If(fsm.ongoing("REST")):
            m.d.sync += lost.eq(0)
        with m.Elif(self.renewed):
            m.d.sync += lost.eq(1)
        return leave_unused_codes(m, fsm, fault="FAULT") | writer.fault


class _Work:
    """What the parts of the dialect share."""

    def __init__(self) -> None:
        self.job = Signal(_Job)
        self.phase = Signal(_Phase)
        self.reply = Signal(_Text)
        self.replies = Signal()
        self.event = Signal(_Text)
        self.tells = Signal()
        self.coordinates = [Signal(14, name=name) for name in "xy"]  # of a command as it comes
        self.target = [Signal(14, name=f"target_{name}") for name in "xy"]  # of what has begun
        self.waits = Signal()  # a line of G-code is not answered
        self.left = Signal(range(SETTLE + 1))  # clocks until what is answered has begun
        self.sends = Signal()  # the line of a command is to be passed
        self.ready = Signal()  # it is at a start point
        self.told = Signal(2)  # the stage that was
        self.drawn = Signal()  # the motors draw, or have drawn, a bowed line
        self.stopped = Signal()  # what was left of the motion is discarded
        self.shown = Signal(6)
