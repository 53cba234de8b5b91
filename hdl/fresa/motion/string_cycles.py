"""Homing cycles and bowed lines of a point that hangs from two strings, one at a time."""

from amaranth import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from .bowed_line import BowedLine
from .string_homing import StringHoming

__all__ = ["StringCycles"]


class StringCycles(wiring.Component):
    """Is a :class:`StringHoming` that draws a :class:`BowedLine` instead, where that is wanted.

    Parameters
    ----------
    homing : StringHoming
        What homes; it has not been elaborated.
    line : BowedLine
        What draws lines.

    Members
    -------
    Those of both; what both have by the same name is that of the one that is active, and

    bows : In(1)
        A bowed line is to be drawn. With ``start``.
    """

    def __init__(self, homing: StringHoming, line: BowedLine) -> None:
        self.homing, self.line = homing, line
        super().__init__({"bows": In(1), **dict(line.signature.members),
                          **dict(homing.signature.members)})

    def elaborate(self, platform) -> Module:
        m = Module()
        homing, line = self.homing, self.line
        m.submodules.homing, m.submodules.line = homing, line
        own, of_homing, of_line = (
            {path: (member.flow, port) for path, member, port in part.signature.flatten(part)}
            for part in (self, homing, line))
        for path, (flow, port) in own.items():
            inner = [ports[path][1] for ports in (of_homing, of_line) if path in ports]
            if path == ("start",):
                m.d.comb += [homing.start.eq(port & ~self.bows), line.start.eq(port & self.bows)]
            elif flow is In:
                m.d.comb += [each.eq(port) for each in inner]
            else:  # that of a part at rest is 0
                m.d.comb += port.eq(inner[0] if len(inner) == 1 else inner[0] | inner[1])
        return m
