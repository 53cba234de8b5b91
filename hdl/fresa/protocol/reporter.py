"""Lines of text to a host: position reports at fixed times, and answers in between."""

from collections.abc import Sequence

from amaranth import Module, Mux, Signal
from amaranth.hdl import Shape
from amaranth.lib import data, stream, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..drive import MAX_PERIOD
from ..fsm import leave_unused_codes
from .decimal_writer import DecimalWriter
from .text import TextSource

__all__ = ["Reporter", "least_period"]

TEXTS = REPORT, BETWEEN, REPORT_END, STATE, STATE_END = b"# POS ", b" ", b" :", b"STATE ", b"\n"
POSITIONS = tuple(f"position_{number}" for number in (1, 2, 3))

OVERHEAD = 32
"""Clocks that a number takes at most besides those of its bytes."""


class Reporter(wiring.Component):
    """Sends ``# POS x y z :`` at every tick of its clock, and answers between the reports.

    All lines pass through here, one after the other. An answer begins only if it will end before
    the next tick, however long the line is still busy with the byte before it; so no report ever
    waits for an answer, and its first bit is on the line ``5`` clocks after its tick. A line feed
    ends each answer. Nothing follows the colon of a report: the original's panel looks for ``#`` in
    the very beginning of what it has not read.

    One answer, the state, is ``STATE`` and all numbers of it, too long to be sent between two
    reports: it waits for a tick, and is sent in place of the report. The numbers of a report or a
    state are sampled in one clock, the one after the tick.

    ========  =================================================================  =================
    state     does                                                               next
    ========  =================================================================  =================
    REST      begins what is due, or else takes an answer                        ASK
    ASK       requests a text                                                    TEXT
    TEXT      sends it                                                           NUMBER, or REST
                                                                                 after the last
    NUMBER    requests the digits of a number                                    DIGITS
    DIGITS    sends them                                                         ASK
    FAULT     shows ``fault``, begins nothing                                    stays until reset
    ========  =================================================================  =================

    Parameters
    ----------
    state : StructLayout
        The numbers of the state, in their order, of up to 32 bits if signed and 31 if not. Those of
        a report are among them: ``position_1`` to ``position_3``, one after the other.
    answers : sequence of bytes
        The texts of the other answers, with their line feeds.
    period : int
        Clocks from tick to tick, up to ``MAX_PERIOD``. Between two ticks there must be time for the
        longest report, the longest answer, and two bytes more; and for the longest state.
    byte : int
        Clocks that the line takes to send a byte. A `UARTTransmitter` takes 160 at least. With
        fewer than 11, as in a small proof, the times above do not hold.

    Members
    -------
    enable : In(1)
        Report at the ticks at which this is set.
    position_1, ... : In
        The numbers of the state, by their names.
    answers : In(stream.Signature)
        Indices of the answers to send. The one after the last is the state.
    bytes : Out(stream.Signature(8))
        The bytes of all lines.
    tick : Out(1)
        A report is due. Once in ``period`` clocks, enabled or not.
    fault : Out(1)
        A state register was upset. Stays until reset.

    Raises
    ------
    ValueError
        If a parameter is out of range.
    """

    def __init__(self, *, state: data.StructLayout, answers: Sequence[bytes], period: int,
                 byte: int) -> None:
        self.layout = state
        least = least_period(state, answers, byte)
        self._names = tuple(state.members)
        self._first = self._names.index(POSITIONS[0])
        if self._names[self._first:self._first + len(POSITIONS)] != POSITIONS:
            raise ValueError("the positions are one after the other, not "
                             f"{', '.join(self._names)}")
        self._texts = TextSource((*TEXTS, *answers))
        self._writer = DecimalWriter(is_signed=True)
        self.quiet = _quiet(answers, byte)
        if least > MAX_PERIOD:
            raise ValueError(f"a byte of {byte} clocks is too long to report")
        self.period = in_range("report period", period, least, MAX_PERIOD)
        super().__init__({
            "enable": In(1),
            **{name: In(shape) for name, shape in state.members.items()},
            "answers": In(stream.Signature(range(len(answers) + 1))),
            "bytes": Out(stream.Signature(8)),
            "tick": Out(1),
            "fault": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()

        m.submodules.texts = texts = self._texts
        m.submodules.writer = writer = self._writer

        # Counts down to the tick
        time = Signal(range(self.period), init=self.period - 1)
        due = Signal()
        m.d.comb += self.tick.eq(time == 0)
        m.d.sync += time.eq(Mux(self.tick, self.period - 1, time - 1))
        wants_state = Signal()
        begins = Signal()
        m.d.comb += [
            wants_state.eq(
                self.answers.valid & (self.answers.payload == len(texts.texts) - len(TEXTS))),
            begins.eq(self.tick & (self.enable | wants_state)),
        ]
        with m.If(begins):
            m.d.sync += due.eq(1)

        sampled = Signal(self.layout)
        text = Signal.like(texts.numbers.payload)
        is_state = Signal()  # this line is one
        left = Signal(range(len(self._names) + 1))  # numbers still to come in this line
        number = Signal(range(len(self._names)))  # that is next
        m.d.comb += [
            texts.numbers.payload.eq(text),
            number.eq(Mux(is_state, len(self._names), self._first + len(POSITIONS)) - left),
            # Only one of them has any.
            self.bytes.valid.eq(texts.bytes.valid | writer.bytes.valid),
            self.bytes.payload.eq(Mux(texts.bytes.valid, texts.bytes.payload,
                                      writer.bytes.payload)),
            texts.bytes.ready.eq(self.bytes.ready),
            writer.bytes.ready.eq(self.bytes.ready),
        ]
        with m.Switch(number):
            for index, name in enumerate(self._names):
                with m.Case(index):
                    m.d.comb += writer.numbers.payload.eq(sampled[name])

        with m.FSM(name="reporter_state") as fsm:
            with m.State("REST"):
                with m.If(due):
                    m.d.comb += self.answers.ready.eq(wants_state)
                    m.d.sync += [
                        due.eq(begins), is_state.eq(wants_state),
                        text.eq(Mux(wants_state, TEXTS.index(STATE), TEXTS.index(REPORT))),
                        left.eq(Mux(wants_state, len(self._names), len(POSITIONS))),
                    ]
                    m.d.sync += [sampled[name].eq(getattr(self, name)) for name in self._names]
                    m.next = "ASK"
                with m.Elif((time > self.quiet) & ~wants_state):
                    m.d.comb += self.answers.ready.eq(1)
                    m.d.sync += [text.eq(self.answers.payload + len(TEXTS)), left.eq(0)]
                    with m.If(self.answers.valid):
                        m.next = "ASK"

            with m.State("ASK"):
                m.d.comb += texts.numbers.valid.eq(1)
                with m.If(texts.numbers.ready):
                    m.next = "TEXT"

            with m.State("TEXT"):
                with m.If(texts.numbers.ready):
                    m.next = "REST"
                    with m.If(left != 0):
                        m.next = "NUMBER"

            with m.State("NUMBER"):
                m.d.comb += writer.numbers.valid.eq(1)
                with m.If(writer.numbers.ready):
                    m.d.sync += left.eq(left - 1)
                    m.next = "DIGITS"

            with m.State("DIGITS"):
                with m.If(writer.numbers.ready):
                    m.d.sync += text.eq(Mux(left != 0, TEXTS.index(BETWEEN), Mux(
                        is_state, TEXTS.index(STATE_END), TEXTS.index(REPORT_END))))
                    m.next = "ASK"

            with m.State("FAULT"):
                pass

        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT") | writer.fault)
        return m


def least_period(state: data.StructLayout, answers: Sequence[bytes], byte: int) -> int:
    """Return the least clocks from tick to tick; parameters as for `Reporter`."""
    byte = in_range("byte", byte, 1, MAX_PERIOD)
    widths = {name: _longest(shape) for name, shape in state.members.items()}
    report = len(REPORT + BETWEEN * 2 + REPORT_END) + sum(widths[name] for name in POSITIONS)
    whole = len(STATE + BETWEEN * (len(widths) - 1) + STATE_END) + sum(widths.values())
    return max(byte * (report + 1) + _quiet(answers, byte) + 8,
               byte * (whole + 1) + OVERHEAD * len(widths))


def _quiet(answers: Sequence[bytes], byte: int) -> int:
    """Return the clocks of the longest answer, and of the byte before it."""
    return byte * (max(map(len, answers)) + 1)


def _longest(shape) -> int:
    """Return the most bytes of a number of that shape, from 1 to 32 bits."""
    shape = Shape.cast(shape)
    width = in_range("width of a number", shape.width + (not shape.signed), 2, 32)
    return len(str(-2 ** (width - 1))) if shape.signed else len(str(2**shape.width - 1))
