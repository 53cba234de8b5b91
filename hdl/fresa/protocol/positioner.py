"""The commands of the positioner: a line of words and numbers to an order, or to a refusal."""

from amaranth import Cat, Module, Signal, signed, unsigned
from amaranth.lib import data, enum, stream, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..fsm import leave_unused_codes
from .decimal_reader import DecimalReader, NumberError
from .line import LineEnd, LineItem
from .words import WordReader

__all__ = ["MOTORS", "POINTS", "Answer", "Command", "PositionerCommands", "PositionerOrder",
           "state_layout"]

MOTORS, POINTS = 3, 7
"""Motors, MOT1 to MOT3, and points, 1 to 7."""


class Command(enum.Enum, shape=unsigned(4)):
    """The commands. Their names are the words that begin a line."""

    CONNECT = 0
    DISCONNECT = 1
    MOV = 2
    STOP = 3
    VEL = 4
    P = 5
    GOTO = 6
    ORIGIN = 7
    POS = 8
    ACK = 9
    STATE = 10


class Answer(enum.Enum, shape=unsigned(4)):
    """Answers. Up to ``EMPTY`` they are refusals of a line, but for ``NONE``."""

    NONE = 0  # no answer: the command is executed
    DAMAGED = 1  # a byte of the line had a framing error, or was lost
    LONG = 2  # the line had more bytes than the buffer holds
    COMMAND = 3  # its first word is no command
    ARGUMENT = 4  # arguments missing, too many, or of another kind
    RANGE = 5  # a number out of range
    DISCONNECTED = 6  # nothing moves before CONNECT
    EMPTY = 7  # the point was never stored
    LIMIT_MOT1 = 8  # a switch stops motor 1
    LIMIT_MOT2 = 9
    LIMIT_MOT3 = 10
    OVERFLOW = 11  # to this line, and to those right after it: the queue of answers is full
    OK = 12  # the line is obeyed
    STATE = 13  # the state of the machine


class PositionerOrder(data.Struct):
    """A decoded line. The other fields are valid only if `answer` is ``NONE``."""

    answer: Answer
    command: Command
    motor: unsigned(2)  # from 0
    clockwise: unsigned(1)
    point: unsigned(3)  # from 1


def state_layout(top_speed: int) -> data.StructLayout:
    """Return the numbers of the answer to ``STATE``, in their order.

    Connected; movements; speeds in steps/s; limit inputs that are pressed; positions in steps;
    seconds since reset.
    """
    def each(name: str, shape: object) -> dict[str, object]:
        return {f"{name}_{motor + 1}": shape for motor in range(MOTORS)}

    return data.StructLayout({
        "connected": 1, **each("moving", 1), **each("rate", range(top_speed + 1)),
        **each("limit", 1), **each("position", signed(32)), "seconds": 31})


class Kind(enum.Enum, shape=unsigned(3)):
    """Kinds of arguments."""

    END = 0
    MOTOR = 1
    WAY = 2
    POINT = 3
    RATE = 4
    NUMBER = 5
    FLAG = 6


ARGUMENTS = {
    Command.MOV: (Kind.MOTOR, Kind.WAY),
    Command.STOP: (Kind.MOTOR,),
    Command.VEL: (Kind.MOTOR, Kind.RATE),
    Command.P: (Kind.POINT, Kind.NUMBER, Kind.NUMBER, Kind.NUMBER),
    Command.GOTO: (Kind.POINT,),
    Command.POS: (Kind.NUMBER, Kind.NUMBER, Kind.NUMBER),
    Command.ACK: (Kind.FLAG,),
}
"""Arguments of the commands that take any."""

WORDS = (*(command.name.encode() for command in Command), b"MOT", b"C", b"CC")
MOT, CLOCKWISE, COUNTER_CLOCKWISE = range(len(Command), len(WORDS))


class PositionerCommands(wiring.Component):
    """Decodes lines: each gives exactly one order, or one refusal.

    Words are in capitals and there is one space between them. A number may have a sign and leading
    zeros. A position may also be unsigned, 2 ** 32 too large, as the original keeps it. A refusal
    names the first error of the line; the rest of it is dropped.

    ==========  ===============================================================  =================
    state       does                                                             next
    ==========  ===============================================================  =================
    COMMAND     reads the first word                                             SEPARATE
    SEPARATE    takes a space if an argument follows                             WORD, NUMBER, or
                                                                                 SKIP at the end
    WORD        reads ``MOT``, or ``C`` or ``CC``                                DIGIT, SEPARATE
    DIGIT       takes the digit behind ``MOT``                                   SEPARATE
    NUMBER      reads a number                                                   SEPARATE
    SKIP        takes the rest of the line, its end included                     OFFER
    OFFER       offers the order                                                 COMMAND
    FAULT       shows ``fault``, reads nothing, offers nothing                   stays until reset
    ==========  ===============================================================  =================

    Each of the first five goes to SKIP at an error. A byte takes a clock, a word or a number two
    more, and SEPARATE and OFFER at least one each.

    Parameters
    ----------
    top_speed : int
        Highest speed of ``VEL`` in steps/s, from 1 to 2 ** 31 - 1.

    Members
    -------
    items : In(stream.Signature(LineItem))
        Lines.
    orders : Out(stream.Signature(PositionerOrder))
        One order or refusal a line.
    numbers : Out(signed(32)).array(3)
        The three positions of ``P`` and ``POS``; the last is the speed of ``VEL``, and the 0 or 1
        of ``ACK``. They stay while an order is offered.
    fault : Out(1)
        The state register was upset. Stays until reset.

    Raises
    ------
    ValueError
        If ``top_speed`` is out of range.
    """

    items: In(stream.Signature(LineItem))
    orders: Out(stream.Signature(PositionerOrder))
    numbers: Out(signed(32)).array(3)
    fault: Out(1)

    def __init__(self, *, top_speed: int) -> None:
        self.top_speed = in_range("top_speed", top_speed, 1, 2**31 - 1)
        super().__init__()

    def elaborate(self, platform) -> Module:
        m = Module()

        m.submodules.words = words = WordReader(WORDS, fold=False)
        m.submodules.number = number = DecimalReader(width=33, is_signed=True)
        items, order = self.items, self.orders.p
        for reader in (words, number):
            m.d.comb += reader.items.payload.eq(items.payload)

        place = Signal(range(1 + max(map(len, ARGUMENTS.values()))))
        kind = Signal(Kind)
        with m.Switch(Cat(place, order.command)):
            for command, kinds in ARGUMENTS.items():
                for at, what in enumerate(kinds):
                    with m.Case(command.value << len(place) | at):
                        m.d.comb += kind.eq(what)

        value = number.numbers.p.value
        out_of_range = Signal()
        with m.Switch(kind):
            for what, least, most in [(Kind.POINT, 1, POINTS), (Kind.RATE, 1, self.top_speed),
                                      (Kind.FLAG, 0, 1), (Kind.NUMBER, -2**31, 2**32 - 1)]:
                with m.Case(what):
                    m.d.comb += out_of_range.eq((value < least) | (value > most))

        def refuse(answer: Answer) -> None:
            m.d.sync += order.answer.eq(answer)
            m.next = "SKIP"

        def proceed() -> None:
            m.d.sync += place.eq(place + 1)
            m.next = "SEPARATE"

        with m.FSM(name="commands_state") as fsm:
            with m.State("COMMAND"):
                m.d.comb += [
                    words.items.valid.eq(items.valid),
                    items.ready.eq(words.items.ready),
                    words.words.ready.eq(1),
                ]
                with m.If(words.words.valid):
                    m.d.sync += order.command.eq(words.words.p.index)
                    m.next = "SEPARATE"
                    with m.If(~words.words.p.known | (words.words.p.index >= len(Command))):
                        refuse(Answer.COMMAND)

            with m.State("SEPARATE"):
                with m.If(items.valid & (kind == Kind.END) & items.p.end):
                    m.next = "SKIP"
                with m.Elif(items.valid & (kind != Kind.END) & ~items.p.end
                            & (items.p.byte == ord(" "))):
                    m.d.comb += items.ready.eq(1)
                    m.next = "NUMBER"
                    with m.If((kind == Kind.MOTOR) | (kind == Kind.WAY)):
                        m.next = "WORD"
                with m.Elif(items.valid):
                    refuse(Answer.ARGUMENT)

            with m.State("WORD"):
                m.d.comb += [
                    words.items.valid.eq(items.valid),
                    items.ready.eq(words.items.ready),
                    words.words.ready.eq(1),
                ]
                index = words.words.p.index
                with m.If(words.words.valid):
                    with m.If(~words.words.p.known):
                        refuse(Answer.ARGUMENT)
                    with m.Elif((kind == Kind.MOTOR) & (index == MOT)):
                        m.next = "DIGIT"
                    with m.Elif((kind == Kind.WAY) & (index >= CLOCKWISE)):
                        m.d.sync += order.clockwise.eq(index == CLOCKWISE)
                        proceed()
                    with m.Else():
                        refuse(Answer.ARGUMENT)

            with m.State("DIGIT"):
                with m.If(items.valid & ~items.p.end & items.p.byte.matches(
                        *(ord("1") + motor for motor in range(MOTORS)))):
                    m.d.comb += items.ready.eq(1)
                    m.d.sync += order.motor.eq(items.p.byte - ord("1"))
                    proceed()
                with m.Elif(items.valid):
                    refuse(Answer.ARGUMENT)

            with m.State("NUMBER"):
                m.d.comb += [
                    number.items.valid.eq(items.valid),
                    items.ready.eq(number.items.ready),
                    number.numbers.ready.eq(1),
                ]
                with m.If(number.numbers.valid):
                    with m.If(number.numbers.p.error == NumberError.NO_DIGITS):
                        refuse(Answer.ARGUMENT)
                    with m.Elif((number.numbers.p.error == NumberError.OVERFLOW) | out_of_range):
                        refuse(Answer.RANGE)
                    with m.Else():
                        with m.If(kind == Kind.POINT):
                            m.d.sync += order.point.eq(value)
                        with m.Else():
                            m.d.sync += Cat(self.numbers).eq(Cat(*self.numbers[1:], value[:32]))
                        proceed()

            with m.State("SKIP"):
                m.d.comb += items.ready.eq(1)
                with m.If(items.valid & items.p.end):
                    m.next = "OFFER"
                    with m.If(items.p.byte == LineEnd.LONG):
                        m.d.sync += order.answer.eq(Answer.LONG)
                    with m.Elif(items.p.byte != LineEnd.GOOD):
                        m.d.sync += order.answer.eq(Answer.DAMAGED)

            with m.State("OFFER"):
                m.d.comb += self.orders.valid.eq(1)
                with m.If(self.orders.ready):
                    m.d.sync += [order.answer.eq(Answer.NONE), place.eq(0)]
                    m.next = "COMMAND"

            with m.State("FAULT"):
                pass

        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))
        return m
