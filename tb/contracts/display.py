"""Contract of the display, and of what the monitor shows."""

from amaranth import Array

from fresa.panel import SevenSegment, display
from fresa.panel.display import HEX_SEGMENTS

from .contract import Bits, Bug, Case, Component, Contract

__all__ = ["DISPLAY", "watch_display"]


def watch_display(c: Contract, path: str, *, segments: Bits, digits: Bits, value: Bits,
                  enable: Bits) -> None:
    """Promise that four digits take turns and show the number; `path` leads to the display."""
    scan_bits = c.part(path).scan_bits
    time = c.signal(f"{path}.time")
    lit = ~digits
    turn = c.keep(scan_bits + 2, name="turns")
    c.m.d.sync += turn.eq(turn + 1)
    with c.m.If(c.rst):
        c.m.d.sync += turn.eq(0)
    digit, within = turn[scan_bits:], turn[:scan_bits]
    eighth = within[-3:]
    c.always("time-is-time", "The digits take turns by the clocks since reset.", time == turn,
             seen=turn == 9, bug=Bug(display, "time.eq(time + 1)", "time.eq(time + 3)"))
    c.holds("one-digit", "At most one digit is on.", when=lit.any(), then=(lit & (lit - 1)) == 0,
            bug=Bug(display, "~(lit << digit)", "~((lit << digit) | (lit << 1))"))
    c.holds("dark", "Without enable no digit is on.", when=~enable & (eighth == 3), then=lit == 0,
            bug=Bug(display, "self.enable & eighth.any()", "eighth.any()"))
    c.holds("no-ghost", "No digit is on in the first and the last eighth of a turn.",
            when=enable & ((eighth == 0) | (eighth == 7)), then=lit == 0,
            bug=(Bug(display, "eighth.any() & ~eighth.all()", "eighth.any()"),
                 Bug(display, "eighth.any() & ~eighth.all()", "~eighth.all()")))
    c.holds("own-turn", "Each digit is on in the rest of its turn.",
            when=enable & (eighth != 0) & (eighth != 7), then=lit == (1 << digit)[:4],
            bug=Bug(display, "~(lit << digit)", "~(lit << digit[::-1])"))
    c.holds("changes-dark", "Digits change only while none is on, but for a reset.",
            when=(c.past(digit) != digit) & ~c.past(c.rst), then=(lit == 0) & (c.past(lit) == 0),
            bug=Bug(display, "eighth.any() & ~eighth.all()", "1"))
    for number in range(4):
        nibble = value.word_select(number, 4)
        c.holds(f"digit-{number}", f"Digit {number} shows its four bits as a hexadecimal digit.",
                when=lit[number], then=segments == (Array(HEX_SEGMENTS)[nibble] ^ 0xFF),
                bug=Bug(display, "self.value.word_select(digit, 4)",
                        f"self.value.word_select(digit, 4) ^ (digit == {number})"))
    c.holds("no-point", "The point is never on.", when=lit.any(), then=segments[7],
            bug=Bug(display, "self.segments.eq(~shape)", "self.segments.eq(~shape[:7])"))


def describe(c: Contract, dut: SevenSegment) -> None:
    """Watch it by itself."""
    watch_display(c, "", segments=dut.segments, digits=dut.digits, value=dut.value,
                  enable=dut.enable)


DISPLAY = Component(make=SevenSegment, describe=describe, depth=30,
                    cases=(Case({"scan_bits": 3}), Case({"scan_bits": 17}, real=True)))
