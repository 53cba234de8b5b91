"""A program in the bitstream, whose lines come instead of those of the serial line."""

from amaranth import Module, Signal, unsigned
from amaranth.lib import memory, stream, wiring
from amaranth.lib.wiring import In, Out

from ..checks import in_range
from ..fsm import leave_unused_codes
from .line import LineEnd, LineItem

__all__ = ["MAX_PROGRAM", "StoredProgram"]

MAX_PROGRAM = 1 << 16
"""Most bytes of a program."""


class StoredProgram(wiring.Component):
    """Passes lines, and when it is asked to those of its program instead, until that ends.

    Each line is answered before the next begins, so that an answer belongs to the last line that
    was passed. A program ends with its last line, with one that is refused, or with one that says
    so. Lines wait meanwhile. A line that had begun to be passed when the program is asked for is
    ended as DAMAGED, and the rest of it is dropped: a line that is not connected must not keep
    the program from running.

    ========  ================================================================  ===================
    state     does                                                              next
    ========  ================================================================  ===================
    LINE      passes a line                                                     ANSWER at its end;
                                                                                READ or BREAK when
                                                                                asked to run
    BREAK     ends the line that had begun                                      ANSWER
    ANSWER    waits for the answer                                              LINE, or READ while
                                                                                or when it runs
    READ      reads a byte of the program, in two clocks                        GIVE
    GIVE      passes it, or the end of its line                                 READ, or ANSWER
    FAULT     shows ``fault``, passes nothing                                   stays until reset
    ========  ================================================================  ===================

    Parameters
    ----------
    program : bytes
        The program. Each of its lines ends with LF.

    Members
    -------
    lines : In(stream.Signature(LineItem))
        Lines.
    items : Out(stream.Signature(LineItem))
        Lines of either.
    answered, refused : In(1), In(1)
        The last line is answered, for one clock, and it is refused.
    run : In(1)
        Run the program, for one clock. Nothing while it runs.
    ended : In(1)
        The program says that it ends, for one clock, before the answer to that line.
    running : Out(1)
        The lines are those of the program.
    busy : Out(1)
        They are, or will be when it is asked to in this clock or was before.
    line_done : Out(1)
        The last of `lines` that was taken to its end is answered; of one that was ended as DAMAGED
        the rest is taken, too. For one clock.
    fault : Out(1)
        The state register was upset. Stays until reset.

    Raises
    ------
    ValueError
        If the program has no line, more than ``MAX_PROGRAM`` bytes, or does not end with LF.
    """

    def __init__(self, program: bytes) -> None:
        in_range("number of bytes of a program", len(program), 1, MAX_PROGRAM)
        if not program.endswith(b"\n"):
            raise ValueError("the last line of a program must end with LF")
        self.program = program
        super().__init__({
            "lines": In(stream.Signature(LineItem)), "items": Out(stream.Signature(LineItem)),
            "answered": In(1), "refused": In(1), "run": In(1), "ended": In(1), "running": Out(1),
            "busy": Out(1), "line_done": Out(1), "fault": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.rom = rom = memory.Memory(
            shape=unsigned(8), depth=len(self.program), init=self.program,
            attrs={"ram_style": "block"})
        fetch = rom.read_port()
        place = Signal(range(len(self.program)))
        byte = Signal(8)
        read = Signal()  # the ROM has read the byte
        begun = Signal()  # a line
        drops = Signal()  # the rest of a line
        dropped = Signal()  # the end of that, a clock ago
        wanted = Signal()
        last = Signal()  # line of the program
        items, lines = self.items, self.lines
        m.d.comb += [
            fetch.addr.eq(place), self.busy.eq(self.running | wanted | self.run),
            self.line_done.eq((self.answered & ~self.running & ~drops) | dropped),
        ]
        m.d.sync += dropped.eq(drops & lines.valid & lines.ready & lines.p.end)
        with m.If(self.run & ~self.running):
            m.d.sync += wanted.eq(1)
        with m.If(self.ended):
            m.d.sync += last.eq(1)

        def begin() -> None:
            m.d.sync += [wanted.eq(0), self.running.eq(1), place.eq(0), last.eq(0)]
            m.next = "READ"

        with m.FSM(name="program_state") as fsm:
            with m.State("LINE"):
                with m.If(wanted & ~(lines.valid & ~drops)):
                    with m.If(begun):
                        m.next = "BREAK"
                    with m.Else():
                        begin()
                with m.Else():
                    m.d.comb += [items.payload.eq(lines.payload),
                                 items.valid.eq(lines.valid & ~drops),
                                 lines.ready.eq(items.ready | drops)]
                    with m.If(lines.valid & drops):
                        m.d.sync += drops.eq(~lines.p.end)
                    with m.Elif(lines.valid & items.ready):
                        m.d.sync += begun.eq(~lines.p.end)
                        with m.If(lines.p.end):
                            m.next = "ANSWER"
            with m.State("BREAK"):
                m.d.comb += [items.valid.eq(1), items.p.end.eq(1),
                             items.p.byte.eq(LineEnd.DAMAGED)]
                with m.If(items.ready):
                    m.d.sync += [begun.eq(0), drops.eq(1)]
                    m.next = "ANSWER"
            with m.State("ANSWER"):
                with m.If(self.answered):
                    m.next = "LINE"
                    with m.If(self.running & ~last & ~self.refused):
                        m.next = "READ"
                    with m.Else():
                        m.d.sync += self.running.eq(0)
                    with m.If(wanted):
                        begin()
            with m.State("READ"):
                m.d.sync += [read.eq(~read), byte.eq(fetch.data)]
                with m.If(read):
                    m.next = "GIVE"
            with m.State("GIVE"):
                ends = byte == ord("\n")
                m.d.comb += [items.valid.eq(1), items.p.end.eq(ends), items.p.byte.eq(byte)]
                with m.If(ends):
                    m.d.comb += items.p.byte.eq(LineEnd.GOOD)
                with m.If(items.ready):
                    m.d.sync += place.eq(place + 1)
                    m.next = "READ"
                    with m.If(ends):
                        m.next = "ANSWER"
                    with m.If(place == len(self.program) - 1):
                        m.d.sync += last.eq(1)
            with m.State("FAULT"):
                pass
        m.d.comb += self.fault.eq(leave_unused_codes(m, fsm, fault="FAULT"))
        return m
