"""Frames of `single`: commands and queries, each with one answer."""

from amaranth import Module, Mux, Signal, unsigned
from amaranth.lib import enum, stream, wiring
from amaranth.lib.wiring import In, Out

from ..fsm import leave_unused_codes
from .decimal_reader import DecimalReader, NumberError
from .decimal_writer import DecimalWriter
from .line import LineEnd, LineItem
from .text import TextSource
from .words import WordReader

__all__ = ["GREETING", "HELP", "POSITIONS", "SPEEDS", "START_SPEED", "Answer", "FrameInterpreter"]

POSITIONS = 10_000
"""Set-points are 0 to this less one."""

SPEEDS = 60_000
"""Speeds are 1 to this less one, in rpm; to stop a motor, set its present position."""

START_SPEED = 100
"""Speed after reset, in rpm."""

GREETING = b"\r\nfresa single\r\n"
"""Text after reset, before the help."""

HELP = b"""\
a frame is : command return\r
:x?  position\r
:xN  go to N, 0 to 9999\r
:v?  speed\r
:vN  N rpm, 1 to 59999\r
:e1  power on\r
:e0  power off\r
:d   this help\r
"""
"""Text of ``:d``, in lines that end with CR LF."""


class Answer(enum.Enum, shape=unsigned(4)):
    """Texts that are sent, by their index in the ROM."""

    GREETING = 0
    HELP = 1
    OK = 2
    COMMAND = 3  # no such command, or a frame that was damaged on the line
    NUMBER = 4  # no number where one is expected, or more behind it
    RANGE = 5  # a number out of range
    LENGTH = 6  # a frame that is too long
    VALUE = 7  # text after a value
    POSITION = 8  # text before it
    SPEED = 9


class _Command(enum.Enum, shape=unsigned(3)):
    """Commands, by their place in the table of words."""

    POSITION = 0
    SPEED = 1
    ENABLE = 2
    HELP = 3
    ASK_POSITION = 4
    ASK_SPEED = 5


_WORDS = (b"X", b"V", b"E", b"D", b"X?", b"V?")


class FrameInterpreter(wiring.Component):
    """Executes frames, and answers each exactly once.

    ============  =====================================  =======================================
    frame         does                                   answers
    ============  =====================================  =======================================
    ``x?``                                               ``x:`` position, end of line, ``ok``
    ``xN``        set-point N, below ``POSITIONS``       ``ok``
    ``v?``                                               ``v:`` speed, end of line, ``ok``
    ``vN``        N rpm, over 0 and below ``SPEEDS``     ``ok``
    ``e1, e0``    motor power on or off                  ``ok``
    ``d``         prints the help                        the help, ``ok``
    any other     nothing                                ``err`` and a word, see :class:`Answer`
    ============  =====================================  =======================================

    Letters are of either case, numbers unsigned decimal. All lines end with CR LF. A frame is
    executed in the clock in which its end is taken, and not before, so a bad one changes nothing.
    The next is read when the text of the answer has begun; the position in an answer is sampled
    when its digits begin. After reset a greeting is sent.

    =======  ================================================  =====================================
    state    does                                              next
    =======  ================================================  =====================================
    ANSWER   waits until all before is sent, and sends a text  COMMAND
    COMMAND  reads a word                                      NUMBER, or END if it takes none
    NUMBER   reads a number                                    END
    END      reads to the end, executes the command            ANSWER, or NAME for a query
    NAME     waits likewise, and sends the name of the value   VALUE
    VALUE    waits likewise, and sends the value               ANSWER
    FAULT    shows ``fault``, does nothing                     stays until reset
    =======  ================================================  =====================================

    Parameters
    ----------
    greeting, help_text : bytes
        Sent after reset, one after the other; the help also for ``d``.

    Members
    -------
    items : In(stream.Signature(LineItem))
        Frames, without what starts and ends them.
    position : In(14)
        Position of the motor.
    target : Out(14)
        Set-point. 0 after reset.
    next_target : Out(14)
        Set-point of the next clock, unless it is reset.
    speed : Out(16)
        Speed in rpm, ``START_SPEED`` after reset.
    enable : Out(1)
        The motor has power. 1 after reset.
    bytes : Out(stream.Signature(8))
        Answers.
    fault : Out(1)
        A state register was upset. Stays until reset.

    Raises
    ------
    ValueError
        If the texts do not fit into their ROM.
    """

    items: In(stream.Signature(LineItem))
    position: In(range(POSITIONS))
    target: Out(range(POSITIONS))
    next_target: Out(range(POSITIONS))
    speed: Out(range(SPEEDS), init=START_SPEED)
    enable: Out(1, init=1)
    bytes: Out(stream.Signature(8))
    fault: Out(1)

    def __init__(self, *, greeting: bytes = GREETING, help_text: bytes = HELP) -> None:
        self.texts = {
            Answer.GREETING: greeting + help_text, Answer.HELP: help_text + b"ok\r\n",
            Answer.OK: b"ok\r\n",
            **{error: f"err {error.name.lower()}\r\n".encode()
               for error in (Answer.COMMAND, Answer.NUMBER, Answer.RANGE, Answer.LENGTH)},
            Answer.VALUE: b"\r\nok\r\n", Answer.POSITION: b"x:", Answer.SPEED: b"v:",
        }
        self._source = TextSource(list(self.texts.values()))
        super().__init__()

    def elaborate(self, platform) -> Module:
        m = Module()

        m.submodules.words = words = WordReader(_WORDS)
        m.submodules.reader = reader = DecimalReader(width=len(self.speed))
        m.submodules.writer = writer = DecimalWriter(width=len(self.speed))
        m.submodules.texts = texts = self._source

        # Texts and digits share the output: each begins only when both are idle.
        idle = Signal()
        m.d.comb += [
            idle.eq(texts.numbers.ready & writer.numbers.ready),
            self.bytes.valid.eq(texts.bytes.valid | writer.bytes.valid),
            self.bytes.payload.eq(
                Mux(writer.bytes.valid, writer.bytes.payload, texts.bytes.payload)),
            texts.bytes.ready.eq(self.bytes.ready),
            writer.bytes.ready.eq(self.bytes.ready),
            words.items.payload.eq(self.items.payload),
            reader.items.payload.eq(self.items.payload),
        ]

        command = Signal(_Command)
        answer = Signal(Answer, init=Answer.GREETING)
        value = Signal.like(self.speed)
        of_speed = (command == _Command.SPEED) | (command == _Command.ASK_SPEED)
        m.d.comb += writer.numbers.payload.eq(Mux(of_speed, self.speed, self.position))

        m.d.comb += self.next_target.eq(self.target)
        m.d.sync += self.target.eq(self.next_target)

        with m.FSM(name="interpreter_state", init="ANSWER") as fsm:
            with m.State("COMMAND"):
                m.d.comb += [
                    words.items.valid.eq(self.items.valid),
                    self.items.ready.eq(words.items.ready),
                    words.words.ready.eq(1),
                ]
                with m.If(words.words.valid):
                    m.d.sync += [command.eq(words.words.p.index), answer.eq(Answer.COMMAND)]
                    m.next = "END"
                    with m.If(words.words.p.known):
                        with m.Switch(words.words.p.index):
                            with m.Case(_Command.ASK_POSITION, _Command.ASK_SPEED):
                                m.d.sync += answer.eq(Answer.VALUE)
                            with m.Case(_Command.HELP):
                                m.d.sync += answer.eq(Answer.HELP)
                            with m.Default():
                                m.next = "NUMBER"

            with m.State("NUMBER"):
                m.d.comb += [
                    reader.items.valid.eq(self.items.valid),
                    self.items.ready.eq(reader.items.ready),
                    reader.numbers.ready.eq(1),
                ]
                with m.If(reader.numbers.valid):
                    m.d.sync += [
                        value.eq(reader.numbers.p.value),
                        answer.eq(_judge(command, reader.numbers.p)),
                    ]
                    m.next = "END"

            with m.State("END"):
                m.d.comb += self.items.ready.eq(1)
                with m.If(self.items.valid & self.items.p.end):
                    m.next = "ANSWER"
                    with m.If(self.items.p.byte == LineEnd.LONG):
                        m.d.sync += answer.eq(Answer.LENGTH)
                    with m.Elif(self.items.p.byte != LineEnd.GOOD):
                        m.d.sync += answer.eq(Answer.COMMAND)
                    with m.Elif(answer == Answer.VALUE):
                        m.next = "NAME"
                    with m.Elif(answer == Answer.OK):
                        self._do(m, command, value)
                with m.Elif(self.items.valid):  # bytes after the last argument
                    with m.Switch(answer):
                        with m.Case(Answer.OK, Answer.RANGE, Answer.NUMBER):
                            m.d.sync += answer.eq(Answer.NUMBER)
                        with m.Default():
                            m.d.sync += answer.eq(Answer.COMMAND)

            with m.State("NAME"):
                m.d.comb += [
                    texts.numbers.valid.eq(idle),
                    texts.numbers.payload.eq(Mux(of_speed, Answer.SPEED, Answer.POSITION)),
                ]
                with m.If(idle):
                    m.next = "VALUE"

            with m.State("VALUE"):
                m.d.comb += writer.numbers.valid.eq(idle)
                with m.If(idle):
                    m.next = "ANSWER"

            with m.State("ANSWER"):
                m.d.comb += [texts.numbers.valid.eq(idle), texts.numbers.payload.eq(answer)]
                with m.If(idle):
                    m.next = "COMMAND"

            with m.State("FAULT"):
                pass

        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT") | writer.fault)
        return m

    def _do(self, m: Module, command: Signal, value: Signal) -> None:
        """Execute a command whose number is valid."""
        with m.Switch(command):
            with m.Case(_Command.POSITION):
                m.d.comb += self.next_target.eq(value)
            with m.Case(_Command.SPEED):
                m.d.sync += self.speed.eq(value)
            with m.Default():
                m.d.sync += self.enable.eq(value[0])


def _judge(command: Signal, number):
    """Return the answer to a number that is the last item of its frame."""
    most = Mux(command == _Command.POSITION, POSITIONS - 1,
               Mux(command == _Command.SPEED, SPEEDS - 1, 1))
    wrong = (number.value > most) | ((command == _Command.SPEED) & (number.value == 0))
    return Mux(number.error == NumberError.NO_DIGITS, Answer.NUMBER,
               Mux((number.error == NumberError.OVERFLOW) | wrong, Answer.RANGE, Answer.OK))
