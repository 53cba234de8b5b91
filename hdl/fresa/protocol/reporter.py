"""Lines of text to a host: position reports at fixed times, and answers in between."""

from collections.abc import Sequence

from amaranth import Cat, Module, Mux, Signal, signed
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..drive import MAX_PERIOD
from ..fsm import leave_unused_codes
from .decimal_writer import DecimalWriter
from .text import TextSource

__all__ = ["Reporter"]

BEGIN, BETWEEN, END = b"# POS ", b" ", b" :\n"
LONGEST = len(BEGIN + BETWEEN * 2 + END) + 3 * len(str(-2**31))


class Reporter(wiring.Component):
    """Sends ``# POS x y z :`` at every tick of its clock, and answers between the reports.

    All lines pass through here, one after the other. An answer begins only if it will end before
    the next tick, however long the line is still busy with the byte before it; so no report ever
    waits for an answer, and its first bit is on the line ``5`` clocks after its tick. The three
    positions of a report are sampled in one clock, the one after the tick. A line feed ends each
    report and each answer.

    ========  =================================================================  =================
    state     does                                                               next
    ========  =================================================================  =================
    REST      begins a report that is due, or else takes an answer               ASK
    ASK       requests a text                                                    TEXT
    TEXT      sends it                                                           NUMBER, or REST
                                                                                 after the last
    NUMBER    requests the digits of a position                                  DIGITS
    DIGITS    sends them                                                         ASK
    FAULT     shows ``fault``, begins nothing                                    stays until reset
    ========  =================================================================  =================

    Parameters
    ----------
    answers : sequence of bytes
        The texts of the answers, with their line feeds.
    period : int
        Clocks from tick to tick, up to ``MAX_PERIOD``. Between two ticks there must be time for the
        longest report, the longest answer, and two bytes more.
    byte : int
        Clocks that the line takes to send a byte, at least 160. With fewer than 11 the times above
        do not hold.

    Members
    -------
    enable : In(1)
        Report at the ticks at which this is set.
    position : In(signed(32)).array(3)
        Positions to report.
    answers : In(stream.Signature)
        Indices of the answers to send.
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

    def __init__(self, *, answers: Sequence[bytes], period: int, byte: int) -> None:
        self._texts = TextSource((BEGIN, BETWEEN, END, *answers))
        self._writer = DecimalWriter(is_signed=True)
        byte = in_range("byte", byte, 1, MAX_PERIOD)
        self.quiet = byte * (max(map(len, answers)) + 1)
        least = byte * (LONGEST + 1) + self.quiet + 8
        if least > MAX_PERIOD:
            raise ValueError(f"a byte of {byte} clocks is too long to report")
        self.period = in_range("report period", period, least, MAX_PERIOD)
        super().__init__({
            "enable": In(1),
            "position": In(signed(32)).array(3),
            "answers": In(stream.Signature(range(len(answers)))),
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
        with m.If(self.tick):
            m.d.sync += due.eq(self.enable)

        numbers = [Signal(signed(32), name=f"number_{index}") for index in range(3)]
        text = Signal.like(texts.numbers.payload)
        left = Signal(range(4))  # numbers still to come in this line
        m.d.comb += [
            texts.numbers.payload.eq(text),
            writer.numbers.payload.eq(numbers[0]),
            # Only one of them has any.
            self.bytes.valid.eq(texts.bytes.valid | writer.bytes.valid),
            self.bytes.payload.eq(Mux(texts.bytes.valid, texts.bytes.payload,
                                      writer.bytes.payload)),
            texts.bytes.ready.eq(self.bytes.ready),
            writer.bytes.ready.eq(self.bytes.ready),
        ]

        with m.FSM(name="reporter_state") as fsm:
            with m.State("REST"):
                with m.If(due):
                    m.d.sync += [due.eq(self.tick & self.enable), Cat(numbers).eq(Cat(
                        self.position)), text.eq(0), left.eq(3)]
                    m.next = "ASK"
                with m.Elif(time > self.quiet):
                    m.d.comb += self.answers.ready.eq(1)
                    m.d.sync += [text.eq(self.answers.payload + 3), left.eq(0)]
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
                    m.d.sync += [Cat(numbers).eq(Cat(*numbers[1:], numbers[0])),
                                 left.eq(left - 1)]
                    m.next = "DIGITS"

            with m.State("DIGITS"):
                with m.If(writer.numbers.ready):
                    m.d.sync += text.eq(Mux(left == 0, 2, 1))
                    m.next = "ASK"

            with m.State("FAULT"):
                pass

        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT") | writer.fault)
        return m
