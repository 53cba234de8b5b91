"""Formulas of a G-code machine beside those of paths: its settings, homing, and its travel."""

from .arc import TABLES as ARC_TABLES
from .arc import arc_registers, by_plane, chosen, signed_by, squares
from .formulas import Formulas, FormulaTable, Registers
from .line import AXES, WIDTH, Line, Rows, magnitude, nearest

__all__ = ["gcode_formulas"]


def _registers() -> Registers:
    """Return the registers of paths, with those of the machine."""
    registers = arc_registers()
    registers.word(*(f"travel_{axis}" for axis in AXES), "distance", "back", "home_at", "from_home",
                   "beyond", "filter", "pulse", "between", "motors")
    for name, value in {"512": 512, "256000": 256_000, "256e6": 256 * 10**6,
                        "below_256e6": 256 * 10**6 - 1, "half_1e6": 10**6 // 2}.items():
        registers.word(name, init=value)
    return registers


REGISTERS = _registers()
"""Registers of all formulas of a G-code machine, by name."""


def _scaled(name: str, factor: str) -> Rows:
    yield "MULTIPLY", name, factor, "product"
    yield "ADD", "product.low", "zero", name


def _speed(name: str) -> Rows:
    """Take um/min as nm/s, rounded down."""
    yield "MULTIPLY", name, "1e3", "product"
    yield "DIVIDE", "product", "60", name


def _pulse() -> Rows:
    """Take ns as clocks, rounded up, and let ``part`` be the most that pulses of them can make.

    That is 10**9 clocks / interval, rounded down, in 10**-9 steps/s: the quotient of the clock,
    which is a word, and of what remains.
    """
    yield "MULTIPLY", "pulse", "clock", "product"  # the register has 256 times the clock
    yield "SUBTRACT", "product.low", "1", "product.low"
    yield "SUBTRACT_BORROW", "product", "zero", "product"
    yield "DIVIDE", "product", "256e6", "pulse"
    yield "MULTIPLY", "pulse", "1", "product"
    yield "DIVIDE", "product", "1e3", "pulse"
    yield "ADD", "pulse", "1", "pulse"
    yield "ADD", "pulse", "between", "b"
    yield from _scaled("b", "motors")
    yield "MULTIPLY", "clock", "1", "part"
    yield "DIVIDE", "part", "b", "a"
    yield "REMAINDER", "part", "b", "flag"
    yield "MULTIPLY", "flag", "1e9", "product"
    yield "DIVIDE", "product", "b", "flag"
    yield "MULTIPLY", "a", "1e9", "part"
    yield "ADD", "part.low", "flag", "part.low"
    yield "ADD_CARRY", "part", "zero", "part"


def _configure() -> Rows:
    """Take the settings as the formulas of paths want them, and refuse what pulses cannot make.

    At first the registers have the settings in thousandths.
    """
    yield "ADD", "zero", "zero", "verdict"
    yield from _pulse()
    for axis in AXES:
        yield from _speed(f"max_speed_{axis}")
        yield "MULTIPLY", f"max_speed_{axis}", f"steps_{axis}", "product"
        yield "SUBTRACT", "part.low", "product.low", "flag"
        yield "SUBTRACT_BORROW", "part", "product", "flag"
        yield "SELECT", "1", "verdict", "verdict"
        yield from _scaled(f"max_acceleration_{axis}", "1e3")
        yield from _scaled(f"steps_{axis}", "512")
        yield from _scaled(f"travel_{axis}", "1e3")
    yield from _scaled("deviation", "256000")
    yield "MULTIPLY", "filter", "clock", "product"
    yield "ADD", "product.low", "below_256e6", "product.low"
    yield "ADD_CARRY", "product", "zero", "product"
    yield "DIVIDE", "product", "256e6", "filter"


def _in_steps() -> Rows:
    yield "MULTIPLY", "a", "b", "product"
    yield "ADD", "product.low", "half_1e6", "product.low"
    yield "ADD_CARRY", "product", "zero", "product"
    yield "DIVIDE", "product", "1e6", "a"


def _offset() -> Rows:
    """Take a distance in um, and how often, as an offset in nm, which goes back or not."""
    yield from _speed("feed")
    yield "MULTIPLY", "distance", "a", "product"
    yield "SUBTRACT", "zero", "back", "flag"
    yield "NEGATE", "product.low", "product.low", "distance"


def _offset_of(moved: str) -> Rows:
    """Let a line of one axis end at an offset from where it begins, or from the switch."""
    for axis in AXES:
        yield "ADD", f"from_{axis}", "zero", f"to_{axis}"
    yield "SUBTRACT", "zero", "from_home", "flag"
    yield "SELECT", "home_at", f"from_{moved}", "a"
    yield "ADD", "a", "distance", f"to_{moved}"


def _wait() -> Rows:
    """Take ms as us."""
    yield "MULTIPLY", "a", "1e3", "product"


def _home() -> Rows:
    """Take an offset as the place of a switch: in nm, and in steps, of ``a`` per metre."""
    yield "ADD", "distance", "zero", "home_at"
    yield from magnitude("distance", "zero", "b")
    yield "MULTIPLY", "b", "a", "product"
    yield from nearest("home_at", "1e9", "a")


def _travel() -> Rows:
    """Compare where a motion ends with the travel, which is from 0 down."""
    yield "ADD", "zero", "zero", "beyond"
    for axis in AXES:
        yield "ADD", f"to_{axis}", f"travel_{axis}", "a"
        for place, bound in ("a", "zero"), ("zero", f"to_{axis}"):
            yield "DIFFERENCE", place, bound, "flag"
            yield "SELECT", "1", "beyond", "beyond"


def _arc_travel() -> Rows:
    """Take how far the centre of an arc is beyond each bound of the travel, and its radius.

    The order is that of the quarters of a circle: along u, along v, against u, against v. 128 nm
    of the radius are left for rounding.
    """
    yield from by_plane([("lower", ("travel_x", "travel_z", "travel_y")),
                         ("upper", ("travel_y", "travel_x", "travel_z"))])
    yield from chosen("SUBTRACT", "zero", "swapped", ("lower", "lower", "series"),
                      ("upper", "lower", "lower"), ("series", "upper", "upper"))
    for axis, length in ("u", "lower"), ("v", "upper"):
        yield from magnitude(f"start_{axis}", "zero", f"chord_{axis}")
        yield "ADD", f"from_{axis}", f"middle_{axis}", f"centre_{axis}"
        yield "ADD", f"centre_{axis}", length, length
        yield "SUBTRACT", "zero", length, length
    yield from squares("chord_u", "chord_v", "part")
    yield "ROOT", "part", "zero", "ratio"
    yield "SUBTRACT", "ratio", "128", "ratio"
    yield "SUBTRACT", "angle_end", "angle", "a"
    yield from signed_by("SUBTRACT", "zero", "mirrored", "a", "a")
    yield "SUBTRACT", "zero", "1", "b"
    yield from chosen("SUBTRACT", "a", "epsilon", ("b", "a", "series"))  # or a full turn


def _quarter() -> Rows:
    """Look at a quarter of the circle, if it is between start and end, and take the next."""
    yield "ADD", "centre_u", "ratio", "a"
    yield "DIFFERENCE", "zero", "a", "flag"
    yield "SELECT", "1", "beyond", "a"
    yield "SUBTRACT", "zero", "angle", "b"
    yield from signed_by("SUBTRACT", "zero", "mirrored", "b", "b")
    yield from chosen("SUBTRACT", "series", "b", ("beyond", "a", "beyond"))
    yield "SUBTRACT", "angle", "quarter_turn", "angle"
    for name, following in ("centre_u", "centre_v"), ("centre_v", "lower"), ("lower", "upper"):
        yield "ADD", following, "zero", name


TABLES = ARC_TABLES + tuple(
    FormulaTable.of(name, REGISTERS, rows) for name, rows in [
        ("configure", _configure()), ("in_steps", _in_steps()), ("offset", _offset()),
        *((f"offset_{axis}", _offset_of(axis)) for axis in AXES),
        ("home", _home()), ("wait", _wait()), ("travel", _travel()), ("arc_travel", _arc_travel()),
        ("quarter", _quarter())])
"""Tables of formulas: those of lines and arcs, and

- ``configure``: settings from thousandths, as the registers have them at first, to what all other
  tables want; ``verdict`` is 1 if pulses, ``between`` clocks from one to the next, cannot make the
  highest speed of an axis, or of as many axes as ``motors`` says; ``pulse`` from ns and ``filter``
  from us to clocks, rounded up;
- ``in_steps``: ``a`` from um to steps, of ``b`` per metre, rounded to nearest;
- ``offset``: ``distance`` in um x ``a`` is ``distance`` in 10**-3 um, or in nm if ``a`` is in
  thousandths; below 0 if ``back`` is not 0; ``feed`` from um/min is in nm/s;
- ``offset_x`` and so on: let ``to_*`` be from where the last line ended, or if ``from_home`` is not
  0 from ``home_at``, by ``distance`` of one axis;
- ``home``: let ``home_at`` be the offset ``distance``, and ``a`` the same in steps;
- ``wait``: ``product.low`` is ``a`` from ms in us;
- ``travel``: ``beyond`` is 1 if ``to_*`` is above 0, or more than ``travel_*`` below;
- ``arc_travel`` and then four times ``quarter``: after ``arc_path``, ``beyond`` is also 1 if the
  arc goes out of the travel on its way, by 1 um or more.
"""


def gcode_formulas(line: Line | None = None, *, gap: int = 1, motors: int = 1) -> Formulas:
    """Return the formulas of a G-code machine, with settings, and what pulses have to keep."""
    values = {**(line or Line()).values(), "between": gap, "motors": motors << 8}
    return Formulas(tables=TABLES, init=REGISTERS.image(values), width=WIDTH)
