"""Lengths and transforms, as SVG and CSS write them."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from math import cos, pi, sin, tan

from .curves import Affine

__all__ = ["Unreadable", "length", "origin", "transform"]

PX = {"": 1.0, "px": 1.0, "in": 96.0, "cm": 96 / 2.54, "mm": 96 / 25.4, "q": 96 / 101.6,
      "pt": 96 / 72, "pc": 16.0, "em": 16.0, "rem": 16.0, "ex": 8.0, "ch": 8.0}
"""Pixels of a unit, those of fonts as browsers have them at first."""

RADIANS = {"": pi / 180, "deg": pi / 180, "rad": 1.0, "grad": pi / 200, "turn": 2 * pi}

ACROSS = {"left": "0", "center": "50%", "right": "100%"}
DOWN = {"top": "0", "center": "50%", "bottom": "100%"}

QUANTITY = re.compile(r"([-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?)([a-z]+|%)?")
FUNCTION = re.compile(r"[\s,]*([a-z][a-z0-9]*)\s*\(([^()]*)\)")
SEPARATOR = re.compile(r"(?:\s*,)?\s*")


class Unreadable(ValueError):
    """Says in a line what is not understood, but would have an effect."""


def length(text: str | None, whole: float) -> float | None:
    """Return a length in pixels; None if it is none, such as ``auto``.

    Parameters
    ----------
    text : str, optional
        As it is in the file.
    whole : float
        What 100 % are.

    Raises
    ------
    Unreadable
        If it is to be calculated, or has a unit that is unknown here, such as those of windows.
    """
    text = (text or "").strip().lower()
    found = QUANTITY.fullmatch(text)
    if "(" in text or found and not (found[2] == "%" or (found[2] or "") in PX):
        raise Unreadable(f"length {text[:60]!r} cannot be read: give it in mm or px")
    if found is None:
        return None
    return float(found[1]) * (whole / 100 if found[2] == "%" else PX[found[2] or ""])


def origin(text: str, width: float, height: float) -> complex:
    """Return the point that transforms are about, in pixels, given what 100 % are.

    Raises
    ------
    Unreadable
        If it is not understood.
    """
    words = text.lower().split()
    if len(words) == 3 and words[2] in ("0", "0px"):
        words.pop()
    x, y = words if len(words) == 2 else (*words, "center") if len(words) == 1 else ("?", "?")
    if x in ("top", "bottom") or y in ("left", "right"):
        x, y = y, x
    right, down = length(ACROSS.get(x, x), width), length(DOWN.get(y, y), height)
    if right is None or down is None:
        raise Unreadable(f"transform-origin {text[:60]!r} cannot be read")
    return complex(right, down)


def transform(text: str, width: float, height: float) -> Affine:
    """Return what a list of transforms does.

    Parameters
    ----------
    text : str
        As it is in the file.
    width, height : float
        What 100 % are.

    Raises
    ------
    Unreadable
        If any of it is not understood.
    """
    rest = re.sub(r"/\*.*?\*/", " ", text).strip().lower()
    whole = Affine()
    if rest == "none":
        return whole
    while rest:
        try:
            function = _matched(FUNCTION, rest, 0)
            counts, make = FUNCTIONS[function[1]]
            given = _Arguments(_quantities(function[2].strip()), (width, height))
            if given.count not in counts:
                raise Unreadable
            whole = whole.after(make(given))
        except (ValueError, KeyError) as error:
            raise Unreadable(f"transform {text[:60]!r} cannot be read") from error
        rest = rest[function.end():].strip()
    return whole


def _quantities(text: str) -> list[tuple[float, str]]:
    """Return numbers with their units."""
    found, at = [], 0
    while at < len(text):
        quantity = _matched(QUANTITY, text, at)
        found.append((float(quantity[1]), quantity[2] or ""))
        at = _matched(SEPARATOR, text, quantity.end()).end()
    return found


def _matched(pattern: re.Pattern[str], text: str, at: int) -> re.Match[str]:
    if (match := pattern.match(text, at)) is None:
        raise Unreadable
    return match


@dataclass(frozen=True)
class _Arguments:
    """Of a function. A unit that does not fit is a KeyError."""

    found: list[tuple[float, str]]
    sizes: tuple[float, float]

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self.found)

    def number(self, index: int) -> float:
        """Return one that is a number, or per cent of 1."""
        value, unit = self.found[index]
        return value * {"": 1.0, "%": 0.01}[unit]

    def angle(self, index: int) -> float:
        """Return one that is an angle, in radians."""
        value, unit = self.found[index]
        return value * RADIANS[unit]

    def point(self, index: int) -> complex:
        """Return a point, of one or two lengths, in pixels."""
        x, y = (value * (whole / 100 if unit == "%" else PX[unit]) for (value, unit), whole in zip(
            (*self.found, (0.0, ""))[index:index + 2], self.sizes, strict=True))
        return complex(x, y)


def _matrix(given: _Arguments) -> Affine:
    a, b, c, d, e, f = map(given.number, range(6))
    return Affine(complex(a, b), complex(c, d), complex(e, f))


def _move(given: _Arguments) -> Affine:
    return Affine(origin=given.point(0))


def _move_down(given: _Arguments) -> Affine:
    return Affine(origin=_Arguments([(0.0, ""), *given.found], given.sizes).point(0))


def _scale(given: _Arguments) -> Affine:
    return Affine(given.number(0), 1j * given.number(given.count - 1))


def _rotate(given: _Arguments) -> Affine:
    turn = complex(cos(given.angle(0)), sin(given.angle(0)))
    about = given.point(1) if given.count > 1 else 0j
    return Affine(turn, 1j * turn, about - turn * about)


def _skew(given: _Arguments) -> Affine:
    y = tan(given.angle(1)) if given.count > 1 else 0.0
    return Affine(complex(1, y), complex(tan(given.angle(0)), 1))


FUNCTIONS: dict[str, tuple[tuple[int, ...], Callable[[_Arguments], Affine]]] = {
    "matrix": ((6,), _matrix),
    "translate": ((1, 2), _move), "translatex": ((1,), _move), "translatey": ((1,), _move_down),
    "translate3d": ((3,), _move), "translatez": ((1,), lambda given: Affine()),
    "scale": ((1, 2), _scale), "scalex": ((1,), lambda given: Affine(x=given.number(0))),
    "scaley": ((1,), lambda given: Affine(y=1j * given.number(0))),
    "rotate": ((1, 3), _rotate), "rotatez": ((1,), _rotate),
    "skew": ((1, 2), _skew), "skewx": ((1,), _skew),
    "skewy": ((1,), lambda given: Affine(x=complex(1, tan(given.angle(0)))))}
"""How many arguments each may have, and what it does. What moves along Z moves nothing here, as
nothing has a perspective."""
