"""Lines that are run at every start, and a text of the user: those of ``$N0``, ``$N1``, ``$I``."""

from collections.abc import Sequence

from amaranth import Cat, Const, Module, Mux, Signal, unsigned
from amaranth.lib import data, memory, stream, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..fsm import leave_unused_codes
from .gcode_lister import LISTED, GCodeText
from .line import LineEnd, LineItem

__all__ = ["STARTUP_LINES", "STORED_LENGTH", "STORED_TEXTS", "StoredLines"]

STARTUP_LINES = 2
"""Lines that are run."""

STORED_TEXTS = STARTUP_LINES + 1
"""They, and the text of the user; their numbers are from 1 on, as 0 is none."""

STORED_LENGTH = 127
"""Most characters of each."""

COPIES = 3
"""Places of a text: as it is at power-up, and two that are written in turn."""


class StoredLines(wiring.Component):
    """Keeps texts that lines bring, and passes two of them as lines whenever it is asked to.

    Lines are passed as they come, up to three before they are answered; behind one with a ``$``,
    which may ask for it, the next waits until all are. After a reset, but not while the machine is
    locked, and when ``run`` asks for it, the texts 1 and 2 are passed as lines, before any other;
    an empty one is not, and one that is not begins when the machine is not ``held``. Their answers
    are not said, but given as parts of lists: ``>line:ok`` or ``>line:error:N``.

    A text is kept when its line was accepted, until then the old one stands; it is in a memory
    that a reset leaves as it is, as it leaves the choice of what stands. So the texts of power-up
    can come back. A byte is read from the memory every three clocks.

    ========  ================================================================  ===================
    state     does                                                              next
    ========  ================================================================  ===================
    START     waits until the control has left its own START                    CHOOSE
    CHOOSE    looks whether the machine is locked                               READ, or LINE
    LINE      passes lines, and answers                                         ANSWER at the end
                                                                                of one with a $
    ANSWER    passes answers, until there are all                               LINE, or READ if
                                                                                asked to run
    READ      passes a text as a line                                           REPLY, or NEXT if
                                                                                it is empty
    REPLY     passes its answer as a part of a list                             NEXT
    NEXT      takes the next text                                               READ, or LINE
    FAULT     shows ``fault``, passes nothing                                   stays until reset
    ========  ================================================================  ===================

    Parameters
    ----------
    texts : sequence of bytes
        The texts at power-up, up to three.
    length : int
        Most characters of a text, 2**n - 1.

    Members
    -------
    lines, items : In(stream.Signature(LineItem)), Out(stream.Signature(LineItem))
        Lines, and these with those of the texts.
    run, locked, held : In(1), In(1), In(1)
        Run the texts behind the line with a ``$`` that is to be answered, for one clock; nothing is
        to be run after a reset; not now.
    answers, said : In(stream.Signature(8)), Out(stream.Signature(8))
        Answers of all lines, and of those that came.
    replies : Out(stream.Signature(LISTED))
        Answers of texts that were run.
    slot, writing : In(2), In(1)
        The text that a line brings, from its first character to its answer; 0 is none. Its
        characters come.
    seen, character : In(1), In(8)
        A character of the line.
    keep : In(1)
        The line was accepted, for one clock.
    too_long : Out(1)
        It has more characters than there is room for.
    restore : In(1)
        Let all texts be those of power-up, for one clock.
    shown, wanted, text : In(2), In(1), Out(stream.Signature(LineItem))
        Show a text, as long as ``wanted``: its characters, and an end.
    fault : Out(1)
        The state register was upset. Stays until reset.

    Raises
    ------
    ValueError
        If there are too many texts, or one is too long or has a blank, or other than printable
        ASCII.
    """

    def __init__(self, texts: Sequence[bytes] = (), *, length: int = STORED_LENGTH) -> None:
        in_range("length of a text", length, 1, STORED_LENGTH)
        in_range("number of texts", len(texts), 0, STORED_TEXTS)
        for text in texts:
            in_range(f"number of characters of {text.decode('latin-1')!r}", len(text), 0, length)
            if not all(0x20 < byte < 0x7F for byte in text):
                raise ValueError("a text is printable ASCII without blanks, "
                                 f"not {text.decode('latin-1')!r}")
        self.texts, self.length = tuple(texts), length
        super().__init__({
            "lines": In(stream.Signature(LineItem)), "items": Out(stream.Signature(LineItem)),
            "run": In(1), "locked": In(1), "held": In(1),
            "answers": In(stream.Signature(8)), "said": Out(stream.Signature(8)),
            "replies": Out(stream.Signature(LISTED)),
            "slot": In(2), "writing": In(1), "seen": In(1), "character": In(8), "keep": In(1),
            "too_long": Out(1), "restore": In(1),
            "shown": In(2), "wanted": In(1), "text": Out(stream.Signature(LineItem)),
            "fault": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        room = self.length + 1  # a byte 0 ends a text, and as a line
        words = [0] * (4 * 4 * room)
        for number, text in enumerate(self.texts, 1):
            words[4 * room * number:4 * room * number + len(text)] = text
        m.submodules.texts = texts = memory.Memory(shape=unsigned(8), depth=len(words), init=words,
                                                   attrs={"ram_style": "block"})
        copies = data.ArrayLayout(range(COPIES), STORED_TEXTS + 1)
        copy = Signal(copies, reset_less=True)  # of each text, the one that stands
        other = Signal(range(COPIES))  # the one that is written next
        m.d.comb += other.eq(Mux(copy[self.slot] == 1, 2, 1))

        # Writing
        count = Signal(range(room))
        store = texts.write_port()
        m.d.comb += [store.addr.eq(Cat(count, other, self.slot)),
                     store.data.eq(Mux(self.keep, 0, self.character)),
                     store.en.eq(self.keep | (self.writing & self.seen & (count != self.length)))]
        with m.If(self.slot == 0):
            m.d.sync += [count.eq(0), self.too_long.eq(0)]
        with m.Elif(self.writing & self.seen):
            m.d.sync += [count.eq(count + (count != self.length)),
                         self.too_long.eq(self.too_long | (count == self.length))]
        with m.If(self.keep):
            m.d.sync += copy[self.slot].eq(other)
        with m.If(self.restore):
            m.d.sync += copy.eq(0)

        def read(number, active, out: stream.Interface, *, name: str, reset_less: bool = False):
            """Give a text, while that is wanted; return its place and whether its end is given."""
            port = texts.read_port()
            place = Signal(range(room), name=f"{name}_place", reset_less=reset_less)
            step = Signal(range(3), name=f"{name}_step", reset_less=reset_less)
            byte = Signal(8, name=f"{name}_byte", reset_less=reset_less)
            ended = Signal(name=f"{name}_ended")
            m.d.comb += [
                port.addr.eq(Cat(place, copy[number], number)), out.valid.eq(step == 2),
                out.p.end.eq(byte == LineEnd.GOOD.value), out.p.byte.eq(byte),
                ended.eq(active & out.valid & out.ready & out.p.end),
            ]
            with m.If(~active | ended):
                m.d.sync += [step.eq(0), place.eq(0)]
            with m.Elif(~out.valid):
                m.d.sync += [step.eq(step + 1), byte.eq(port.data)]
            with m.Elif(out.ready):
                m.d.sync += [step.eq(0), place.eq(place + 1)]
            return place, ended

        # What is being said is said to its end.
        read(self.shown, self.wanted, self.text, name="shown", reset_less=True)
        line = stream.Signature(LineItem).create()  # that is run
        number = Signal(range(STARTUP_LINES))
        runs = Signal()
        place, run_ended = read(number + 1, runs, line, name="run")
        asked = Signal()
        with m.If(self.run):
            m.d.sync += asked.eq(1)
        unanswered = Signal(2)  # lines that came
        system = Signal()  # the line has a $
        passes = Signal()  # answers of lines that came
        ended, told = Signal(name="line_ended"), Signal()
        m.d.comb += told.eq(self.said.valid & self.said.ready)
        with m.If(ended != told):
            m.d.sync += unanswered.eq(unanswered + Mux(told, -1, 1))

        items, answers = self.items, self.answers
        m.d.comb += [self.said.payload.eq(answers.payload), items.payload.eq(self.lines.payload),
                     self.replies.p.code.eq(answers.payload), self.replies.p.ends.eq(1),
                     self.replies.p.text.eq(Cat(answers.payload != 0, number,
                                                Const(GCodeText.RAN_FIRST.value >> 2, 3)))]
        with m.FSM(name="lines_state") as fsm:
            with m.State("START"):
                m.next = "CHOOSE"
            with m.State("CHOOSE"):
                m.next = "LINE"
                with m.If(~self.locked):
                    m.next = "READ"
            with m.State("LINE"):
                with m.If(~unanswered.all()):
                    m.d.comb += [items.valid.eq(self.lines.valid),
                                 self.lines.ready.eq(items.ready)]
                m.d.comb += [passes.eq(1), ended.eq(items.valid & items.ready & items.p.end)]
                with m.If(items.valid & items.ready):
                    m.d.sync += system.eq(~items.p.end & (system | (items.p.byte == ord("$"))))
                with m.If(ended & system):
                    m.next = "ANSWER"
            with m.State("ANSWER"):
                m.d.comb += passes.eq(1)
                with m.If(unanswered == 0):
                    m.next = "LINE"
                    with m.If(asked):
                        m.d.sync += asked.eq(0)
                        m.next = "READ"
            with m.State("READ"):
                m.d.comb += runs.eq(1)
                with m.If(line.valid & line.p.end & (place == 0)):
                    m.d.comb += line.ready.eq(1)
                    m.next = "NEXT"
                with m.Else():
                    with m.If(~self.held | (place != 0)):
                        m.d.comb += [items.valid.eq(line.valid), line.ready.eq(items.ready)]
                    m.d.comb += items.payload.eq(line.payload)
                    with m.If(run_ended):
                        m.next = "REPLY"
            with m.State("REPLY"):
                m.d.comb += [self.replies.valid.eq(answers.valid),
                             answers.ready.eq(self.replies.ready)]
                with m.If(answers.valid & answers.ready):
                    m.next = "NEXT"
            with m.State("NEXT"):
                m.d.sync += number.eq(number + 1)
                m.next = "READ"
                with m.If(number == STARTUP_LINES - 1):
                    m.next = "LINE"
            with m.State("FAULT"):
                pass
        with m.If(passes):
            m.d.comb += [self.said.valid.eq(answers.valid), answers.ready.eq(self.said.ready)]
        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))
        return m
