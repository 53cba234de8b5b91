"""Contract of the display, and of what the monitor shows."""

from amaranth import Array

from fresa.panel import SevenSegment
from fresa.panel.display import HEX_SEGMENTS

from .contract import Bits, Case, Component, Contract

__all__ = ["DISPLAY", "watch_display"]


def watch_display(c: Contract, path: str, *, segments: Bits, digits: Bits, value: Bits,
                  enable: Bits) -> None:
    """State that four digits take turns and show the number; `path` leads to the display."""
    scan_bits = c.part(path).scan_bits
    time = c.signal(f"{path}.time")
    lit = ~digits
    turn = c.keep(scan_bits + 2, name="turns")
    c.m.d.sync += turn.eq(turn + 1)
    with c.m.If(c.rst):
        c.m.d.sync += turn.eq(0)
    digit, within = turn[scan_bits:], turn[:scan_bits]
    eighth = within[-3:]
    c.invariant("turns-by-clocks", "Digits take turns by the clocks since reset.", time == turn,
                cover=turn == 9)
    c.implication("one-digit", "At most one digit is on.", when=lit.any(),
                  then=(lit & (lit - 1)) == 0)
    c.implication("dark-when-disabled", "Without enable no digit is on.",
                  when=~enable & (eighth == 3),
                  then=lit == 0)
    c.implication("no-ghost", "No digit is on in the first and the last eighth of a turn.",
                  when=enable & ((eighth == 0) | (eighth == 7)), then=lit == 0)
    c.implication("lit-in-own-turn", "Each digit is on in the rest of its turn.",
                  when=enable & (eighth != 0) & (eighth != 7), then=lit == (1 << digit)[:4])
    c.implication("dark-at-changes", "Digits change only while none is on, but for a reset.",
                  when=(c.past(digit) != digit) & ~c.past(c.rst),
                  then=(lit == 0) & (c.past(lit) == 0))
    for number in range(4):
        nibble = value.word_select(number, 4)
        c.implication(f"digit-{number}", f"Digit {number} shows its four bits as a hexadecimal "
                      "digit.", when=lit[number],
                      then=segments == (Array(HEX_SEGMENTS)[nibble] ^ 0xFF))
    c.implication("no-point", "The point is never on.", when=lit.any(), then=segments[7])


def describe(c: Contract, dut: SevenSegment) -> None:
    """Watch it by itself."""
    watch_display(c, "", segments=dut.segments, digits=dut.digits, value=dut.value,
                  enable=dut.enable)


DISPLAY = Component(make=SevenSegment, describe=describe, depth=30,
                    cases=(Case({"scan_bits": 3}), Case({"scan_bits": 17}, real=True)))
