"""Contract of the filter of real-time commands."""

from amaranth import Cat

from fresa.protocol import RealtimeFilter

from .contract import Case, Component, Contract

__all__ = ["REALTIME"]

SINGLE = (0x18, 0x21, 0x3F, 0x7E, 0x84, 0x85, 0xA0, 0xA1)
RANGES = ((0x90, 0x97), (0x99, 0x9E))
"""The bytes that are commands, alone and from first to last."""


def describe(c: Contract, dut: RealtimeFilter) -> None:
    """Each byte is a command, dropped, or passed on, and no command waits."""
    byte, error = dut.bytes.p.byte, dut.bytes.p.error
    listed = Cat([byte == one for one in SINGLE],
                 [(byte >= first) & (byte <= last) for first, last in RANGES]).any()
    command = listed & ~error
    other = error | (~listed & (byte < 0x80))

    c.implication("command-taken", "A command is taken at once.",
                  when=dut.bytes.valid & command, then=dut.bytes.ready)
    c.implication("command-shown", "It shows in the clock after it, with its code.",
                  when=c.past(dut.bytes.valid & command & ~c.rst),
                  then=dut.command & (dut.code == c.past(byte)))
    c.implication("no-other-command", "Nothing else shows as a command.", when=dut.command,
                  then=c.past(dut.bytes.valid & command))
    c.implication("others-pass", "Another byte, or one with an error, is offered as it is.",
                  when=dut.bytes.valid & other,
                  then=dut.rest.valid & (dut.rest.payload.as_value()
                                         == dut.bytes.payload.as_value())
                  & (dut.bytes.ready == dut.rest.ready))
    c.implication("commands-do-not-pass", "A command is not offered, nor a byte from 0x80 on.",
                  when=dut.bytes.valid & ~other, then=~dut.rest.valid & dut.bytes.ready)
    c.implication("nothing-of-nothing", "Without a byte nothing is offered.",
                  when=~dut.bytes.valid, then=~dut.rest.valid)


REALTIME = Component(make=RealtimeFilter, describe=describe, cases=(Case(),), depth=4)
