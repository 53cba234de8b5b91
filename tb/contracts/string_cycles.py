"""Contract of cycles of a point that hangs from two strings: one at a time, each as it is alone."""

from amaranth import Cat, Value
from amaranth.lib.wiring import Component as Part
from amaranth.lib.wiring import Out

from fresa.machines.vplotter import VPlotterSettings
from fresa.motion import BowedLine, StringCycles, StringHoming

from .contract import Bits, Case, Component, Contract

__all__ = ["STRING_CYCLES"]


def describe(c: Contract, dut: StringCycles) -> None:
    """While a part is active the outputs are its own, and those of the other one are 0."""
    parts = [c.part("homing"), c.part("line")]
    c.assume(~dut.start | ~dut.active)
    one, other = (part.active for part in parts)
    c.invariant("one-at-a-time", "A homing cycle goes on, or a line, and never both.",
                ~(one & other) & (dut.active == (one | other)), cover=other)
    for active, wanted, name in (one, ~dut.bows, "homes"), (other, dut.bows, "draws"):
        c.implication(f"{name}-as-wanted", "What is wanted begins with the start.",
                      when=c.past(~c.rst & dut.start), then=active == c.past(wanted))
    own, *alone = map(_outputs, [dut, *parts])
    for part, outputs, name in zip(parts, alone, ("homing", "line"), strict=True):
        c.implication(f"{name}-alone", "While it is active nothing else has a say.",
                      when=part.active, then=Cat(
                          port == outputs.get(path, 0) for path, port in own.items()).all())
    c.implication("rests", "Otherwise nothing is done.", when=~dut.active,
                  then=~Cat(own.values()).any())


def _outputs(part: Part) -> dict[tuple, Bits]:
    """Return its outputs by name, but where a line leads, of which no tick makes use."""
    return {path: Value.cast(port) for path, member, port in part.signature.flatten(part)
            if member.flow == Out and path[0] != "up"}


def make(*, homing: dict[str, int], line: dict[str, int]) -> StringCycles:
    """Make it of its parts."""
    return StringCycles(StringHoming(**homing), BowedLine(**line))


SETTINGS = VPlotterSettings()

STRING_CYCLES = Component(
    make=make, describe=describe, depth=12,
    cases=(Case({"homing": {"pace": 2, "most": 2, "most_off": 1},
                 "line": {"pace": 2, "place_bits": 2, "length_bits": 3}}),
           Case({"homing": SETTINGS.string_homing, "line": SETTINGS.bowed_line}, real=True)))
