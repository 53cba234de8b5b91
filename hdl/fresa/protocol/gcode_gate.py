"""Lines that a G-code machine does not pass on to its interpreter."""

from amaranth import Module, Mux, Signal
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out

from .gcode_reader import GCodeKind, GCodeStatus, gcode_layout

__all__ = ["GCodeGate"]


class GCodeGate(wiring.Component):
    """Carries out system lines, refuses lines while the machine is locked, and passes the others.

    A line that is not passed is passed as an empty one whose end has its error as status, so that
    lines are answered by one part, in their order. An error of the reader comes first. Of system
    lines there are ``$X``, which unlocks, and ``$H``, which is refused as homing is not enabled.

    A line is judged by whether the machine is locked when its end comes; its words are passed on
    before, and only the end makes them a line. So nothing of it is done either way. An empty line
    is never refused.

    Parameters
    ----------
    width : int
        Bits of values, those of the words.

    Members
    -------
    words, passed : In(stream.Signature), Out(stream.Signature)
        Items of lines, see :func:`gcode_layout`.
    locked : In(1)
        Refuse lines of G-code.
    unlock : Out(1)
        ``$X``. For one clock, in which its end is passed.
    """

    def __init__(self, *, width: int = 44) -> None:
        super().__init__({
            "words": In(stream.Signature(gcode_layout(width))),
            "passed": Out(stream.Signature(gcode_layout(width))),
            "locked": In(1), "unlock": Out(1),
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        item, passed = self.words.p, self.passed.p
        ends = Signal()
        count = Signal(2)  # characters of a system line so far; 3 are too many
        letter = Signal(8)  # the second
        named = Signal()
        filled = Signal()  # the line has a word
        swallowed = Signal()
        m.d.comb += [
            ends.eq(item.kind == GCodeKind.END),
            named.eq(count == 2),
            swallowed.eq(item.system & ~ends),
            passed.eq(item),
            self.passed.valid.eq(self.words.valid & ~swallowed),
            self.words.ready.eq(self.passed.ready | swallowed),
            self.unlock.eq(self.words.valid & self.passed.ready & ends & item.system & named
                           & (letter == ord("X")) & (item.status == GCodeStatus.GOOD)),
        ]
        with m.If(ends & (item.status == GCodeStatus.GOOD)):
            with m.If(item.system):
                m.d.comb += passed.status.eq(GCodeStatus.UNSUPPORTED)
                with m.If(named & (letter == ord("H"))):
                    m.d.comb += passed.status.eq(GCodeStatus.NO_HOMING)
                with m.If(named & (letter == ord("X"))):
                    m.d.comb += passed.status.eq(GCodeStatus.GOOD)
            with m.Elif(self.locked & filled):
                m.d.comb += passed.status.eq(GCodeStatus.LOCKED)
        with m.If(self.words.valid & self.words.ready):
            m.d.sync += filled.eq(~ends)
            with m.If(ends):
                m.d.sync += count.eq(0)
            with m.Elif(item.system & (item.kind == GCodeKind.CHARACTER)):
                m.d.sync += [letter.eq(item.character), count.eq(Mux(count == 3, 3, count + 1))]
        return m
