"""From SVG to the curves that a pen can follow.

The tree is walked here, since layers, what is invisible and what is left out have to be known of
every element; numbers, transforms, path data and colours are read by svgelements.
"""

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from math import isfinite
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
import svgelements as svg

from ..console import UserError
from .curves import Affine, Cubic, Curve, Ellipse, Straight
from .document import INKSCAPE, Styles, href, local_name, read

__all__ = ["MM_PER_PX", "Drawing", "Shape", "read_drawing"]

MM_PER_PX = 25.4 / 96
"""A pixel of SVG, as CSS has it."""

MOST_ELEMENTS = 500_000
"""Visited, with all that is used again."""

LARGEST = 1e9
"""Pixels from the origin that a drawing may extend."""

BASIC = {"rect", "circle", "ellipse", "line", "polyline", "polygon", "path"}
GROUPS = {"g", "a", "svg", "switch", "use"}
TEXTS = {"text", "flowRoot"}

ACROSS, DOWN = {"x", "width", "cx", "rx", "x1", "x2"}, {"y", "height", "cy", "ry", "y1", "y2"}
"""Lengths that may be in per cent of the viewport's width, and of its height."""


@dataclass(frozen=True)
class Shape:
    """What is drawn of one element.

    Attributes
    ----------
    outlines : list of list of Curve
        Each is drawn without raising the pen, in pixels of the document.
    layer : str
        Name of the Inkscape layer that it is in, or else of the topmost group.
    colour : str
        That of its stroke, or of its fill if there is no stroke, such as ``#ff0000``.
    """

    outlines: list[list[Curve]]
    layer: str
    colour: str


@dataclass
class Drawing:
    """What there is to draw, and what is not drawn of a file.

    Attributes
    ----------
    shapes : list of Shape
        In the order of the file.
    has_layers : bool
        Some are in layers of Inkscape.
    omitted : Counter of str
        What is left out or drawn without, by name, and how often.
    """

    shapes: list[Shape] = field(default_factory=list)
    has_layers: bool = False
    omitted: Counter[str] = field(default_factory=Counter)

    def notes(self) -> str:
        """Say in one line what is not drawn as it looks; nothing if all is."""
        return ", ".join(f"{what} ({count})" if count > 1 else what
                         for what, count in sorted(self.omitted.items()))

    def bounds(self) -> tuple[complex, complex]:
        """Return the upper left and lower right corners of all that is drawn."""
        points = np.concatenate([curve.bounds() for shape in self.shapes
                                 for outline in shape.outlines for curve in outline])
        low = complex(points.real.min(), points.imag.min())
        high = complex(points.real.max(), points.imag.max())
        return low, high


@dataclass(frozen=True)
class _Context:
    """What an element inherits."""

    affine: Affine
    style: Mapping[str, str]
    width: float
    height: float
    layer: str = ""
    in_layer: bool = False
    group: str = ""
    depth: int = 0
    uses: tuple[str, ...] = ()


def read_drawing(path: Path, progress: Callable[[int], None] = lambda done: None) -> Drawing:
    """Read an SVG file.

    Parameters
    ----------
    path : Path
        The file.
    progress : callable
        Called with how many elements were visited since the last call.

    Raises
    ------
    UserError
        If it is no SVG, has text or nothing to draw, or is meant to exhaust its reader.
    """
    reader = _Reader(path, read(path), progress)
    drawing = reader.drawing
    if not drawing.shapes:
        notes = drawing.notes()
        raise UserError(f"{path} has nothing that a pen can draw"
                        + (f"; what there is: {notes}" if notes else ""))
    return drawing


class _Reader:
    """Walks the tree of a file."""

    def __init__(self, path: Path, root: Element, progress: Callable[[int], None]) -> None:
        self._path, self._progress = path, progress
        self._styles = Styles(root)
        self._by_id = {name: element for element in root.iter()
                       if (name := element.get("id")) is not None}
        self._visited = 0
        self.drawing = Drawing()
        width, height = _page(root)
        self._visit(root, _Context(Affine(), {}, width, height), (width, height))
        if self._styles.ignored:
            self.drawing.omitted["style rules not understood"] = self._styles.ignored

    def _visit(self, element: Element, context: _Context,
               size: tuple[float, float] | None = None) -> None:
        """Draw an element; `size` is that of its viewport, if what refers to it gives one."""
        self._visited += 1
        self._progress(1)
        if self._visited > MOST_ELEMENTS:
            raise UserError(f"{self._path} has more than {MOST_ELEMENTS} elements, those used "
                            "again included: split it")
        name = local_name(element)
        if name not in BASIC | GROUPS | TEXTS | {"image", "symbol", "foreignObject"}:
            return  # what describes, defines, animates, or is not SVG
        style = self._styles.of(element, context.style)
        if style["display"] == "none" or _number(style["opacity"], 1) <= 0:
            return
        affine = self._transform(context.affine, style["transform"])
        if not affine.determinant or element.get("requiredExtensions"):
            return
        context = replace(context, affine=affine, style=style)
        for effect in ("clip-path", "mask", "filter"):
            if style[effect] not in ("none", ""):
                self.drawing.omitted[f"{effect} ignored"] += 1
        if name in GROUPS or name == "symbol":
            self._group(name, element, context, size)
        elif name in TEXTS:
            self._refuse_text(element, style)
        elif name in BASIC:
            self._shape(name, element, context)
        else:
            self.drawing.omitted["image" if name == "image" else "foreign object"] += 1

    def _group(self, name: str, element: Element, context: _Context,
               size: tuple[float, float] | None) -> None:
        children = list(element)
        if name == "use":
            self._use(element, context)
            return
        if name == "switch":
            children = [child for child in children if local_name(child) not in
                        ("", "foreignObject") and not child.get("requiredExtensions")][:1]
        elif name == "g":
            context = self._layer(element, context)
        elif name in ("svg", "symbol"):
            viewport = self._viewport(element, context, size)
            if viewport is None:
                return
            context = viewport
            if size is not None and not context.depth and not context.uses:
                context = replace(context, depth=1)  # the root: what is in it is at the top
        for child in children:
            if local_name(child) != "symbol":  # which is drawn where it is used
                self._visit(child, context)

    def _layer(self, element: Element, context: _Context) -> _Context:
        """Return the context in a group: the outermost layer, or group, names what is in it."""
        label = element.get(f"{INKSCAPE}label") or element.get("id") or ""
        if element.get(f"{INKSCAPE}groupmode") == "layer" and not context.in_layer:
            self.drawing.has_layers = True
            return replace(context, in_layer=True, layer=label or "layer without name",
                           depth=context.depth + 1)
        if context.depth == 1 and not context.layer:
            context = replace(context, layer=label or "group without name")
        return replace(context, depth=context.depth + 1)

    def _use(self, element: Element, context: _Context) -> None:
        target = href(element) or ""
        referred = self._by_id.get(target[1:]) if target.startswith("#") else None
        if referred is None:
            self.drawing.omitted["use of what is not in the file"] += 1
            return
        if target in context.uses:
            raise UserError(f"{self._path}: {target} uses itself")
        if len(context.uses) > 64:
            raise UserError(f"{self._path}: uses of uses are nested deeper than 64")
        shift = complex(_length(element.get("x"), context.width),
                        _length(element.get("y"), context.height))
        size = None
        if local_name(referred) in ("svg", "symbol"):
            width, height = (element.get(key, referred.get(key, "100%"))
                             for key in ("width", "height"))
            size = _length(width, context.width), _length(height, context.height)
        self._visit(referred, replace(
            context, affine=context.affine.after(Affine(origin=shift)),
            uses=(*context.uses, target)), size)

    def _viewport(self, element: Element, context: _Context, size: tuple[float, float] | None
                  ) -> _Context | None:
        """Return the context in an ``<svg>`` or ``<symbol>``; None if it has no area."""
        at = (0.0, 0.0)
        if size is None or context.uses:
            at = (_length(element.get("x"), context.width),
                  _length(element.get("y"), context.height))
        width, height = size or (_length(element.get("width", "100%"), context.width),
                                 _length(element.get("height", "100%"), context.height))
        if width <= 0 or height <= 0:
            return None
        if (box := _view_box(element)) is None:
            affine = context.affine.after(Affine(origin=complex(*at)))
            return replace(context, affine=affine, width=width, height=height)
        if box[2] <= 0 or box[3] <= 0:
            return None
        aspect = element.get("preserveAspectRatio", "xMidYMid").replace("defer", "").strip()
        text = svg.Viewbox.viewbox_transform(*at, width, height, *box, aspect)
        return replace(context, affine=self._transform(context.affine, text),
                       width=box[2], height=box[3])

    def _transform(self, affine: Affine, text: str) -> Affine:
        if not text or text == "none":
            return affine
        try:
            matrix = svg.Matrix(text)
            matrix.render(ppi=96, width=0, height=0)
            numbers = [float(each) for each in
                       (matrix.a, matrix.b, matrix.c, matrix.d, matrix.e, matrix.f)]
        except (ValueError, TypeError, IndexError, KeyError, OverflowError) as error:
            raise UserError(f"{self._path}: transform {text[:60]!r} cannot be read") from error
        if not all(map(isfinite, numbers)):
            raise self._beyond()
        a, b, c, d, e, f = numbers
        return affine.after(Affine(complex(a, b), complex(c, d), complex(e, f)))

    def _refuse_text(self, element: Element, style: Mapping[str, str]) -> None:
        text = " ".join("".join(element.itertext()).split())
        if text and _paint(style) is not None:
            if len(text) > 24:
                text = text[:24] + "..."
            raise UserError(f"{self._path} has text, {text!r}: convert text to paths (in Inkscape: "
                            "Path > Object to Path)")

    def _shape(self, name: str, element: Element, context: _Context) -> None:
        if (paint := _paint(context.style)) is None:
            return
        colour, stroked = paint
        if name == "line" and not stroked:
            return
        outlines = []
        for outline in self._outlines(name, element, context):
            start, end = outline[0].start, outline[-1].end
            if not stroked and start != end:  # the edge of a filled area is closed
                outline.append(Straight(start, end)._replace(start=end, end=start))
            outlines.append([curve.moved(context.affine) for curve in outline])
        if not outlines:
            return
        numbers = np.array([part for outline in outlines for curve in outline for part in curve])
        if not np.all(np.isfinite(numbers)) or np.abs(numbers).max() > LARGEST:
            raise self._beyond()
        style = context.style
        if stroked and style["stroke-dasharray"] not in ("none", "") and re.search(
                "[1-9]", style["stroke-dasharray"]):
            self.drawing.omitted["dashes drawn whole"] += 1
        if any(style[f"marker-{each}"] != "none" for each in ("start", "mid", "end")):
            self.drawing.omitted["marker ignored"] += 1
        self.drawing.shapes.append(Shape(outlines, context.layer, colour))

    def _outlines(self, name: str, element: Element, context: _Context) -> list[list[Curve]]:
        """Return the subpaths of a shape, in its own coordinates."""
        try:
            if name == "path":
                path = svg.Path(pathd_loaded=True)
                try:
                    path.parse(element.get("d", ""))
                except (ValueError, IndexError, TypeError, AttributeError):
                    # SVG has a path drawn up to where it cannot be read any more.
                    self.drawing.omitted["path data damaged, drawn up to there"] += 1
                return list(_subpaths(path))
            return list(_subpaths(svg.Path(_basic(name, element, context))))
        except (OverflowError, ZeroDivisionError) as error:
            raise self._beyond() from error

    def _beyond(self) -> UserError:
        return UserError(f"{self._path} has coordinates that are too large, or no numbers")


def _basic(name: str, element: Element, context: _Context) -> svg.Shape | str:
    """Return a basic shape."""
    diagonal = float(np.hypot(context.width, context.height) / np.sqrt(2))

    def number(key: str, default: str = "0") -> float:
        whole = context.width if key in ACROSS else context.height if key in DOWN else diagonal
        return _length(element.get(key, default), whole)

    if name == "rect":
        x, y, width, height = map(number, ("x", "y", "width", "height"))
        if width <= 0 or height <= 0:
            return ""
        rx, ry = (None if element.get(key, "auto") == "auto" else number(key)
                  for key in ("rx", "ry"))
        rx, ry = (ry or 0.0) if rx is None else rx, (rx or 0.0) if ry is None else ry
        return svg.Rect(x, y, width, height, min(rx, width / 2), min(ry, height / 2))
    if name in ("circle", "ellipse"):
        rx, ry = (number("r"),) * 2 if name == "circle" else (
            number("rx", element.get("ry", "0")), number("ry", element.get("rx", "0")))
        if rx <= 0 or ry <= 0:
            return ""
        return svg.Ellipse(cx=number("cx"), cy=number("cy"), rx=rx, ry=ry)
    if name == "line":
        return svg.SimpleLine(*map(number, ("x1", "y1", "x2", "y2")))
    numbers = [float(each) for each in re.findall(
        r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?", element.get("points", ""))]
    points = list(zip(numbers[::2], numbers[1::2], strict=False))
    if not points:
        return ""
    return svg.Polygon(*points) if name == "polygon" else svg.Polyline(*points)


def _subpaths(path: svg.Path) -> Iterator[list[Curve]]:
    """Yield what lies between two moves of a path, without what has no length."""
    outline: list[Curve] = []
    for segment in path:
        if isinstance(segment, svg.Move) or segment.start is None:
            if outline:
                yield outline
            outline = []
            if not isinstance(segment, svg.Move):
                return  # it does not begin with a move, so it is no path
            continue
        curve = _curve(segment)
        if curve is not None:
            outline.append(curve)
        if isinstance(segment, svg.Close) and outline:
            yield outline
            outline = []
    if outline:
        yield outline


def _curve(segment: svg.PathSegment) -> Curve | None:
    start, end = _complex(segment.start), _complex(segment.end)
    if isinstance(segment, svg.CubicBezier):
        return Cubic(start, _complex(segment.control1), _complex(segment.control2), end)
    if isinstance(segment, svg.QuadraticBezier):
        return Cubic.quadratic(start, _complex(segment.control), end)
    if isinstance(segment, svg.Arc) and segment.sweep:
        centre = _complex(segment.center)
        u, v = _complex(segment.prx) - centre, _complex(segment.pry) - centre
        area = (u.conjugate() * v).imag
        if area:
            from_centre = start - centre
            begin = np.arctan2((u.conjugate() * from_centre).imag / area,
                               (from_centre.conjugate() * v).imag / area)
            return Ellipse(centre, u, v, float(begin), float(segment.sweep))
    return None if start == end else Straight(start, end)


def _complex(point: svg.Point | None) -> complex:
    assert point is not None  # of a segment that the library has completed
    return complex(point)


def _paint(style: Mapping[str, str]) -> tuple[str, bool] | None:
    """Return the colour that an element shows, and whether it is of its stroke; None if none."""
    if style["visibility"] != "visible":
        return None
    width = _length(style["stroke-width"], 100)
    for kind, shows in (("stroke", width > 0), ("fill", True)):
        text = style[kind]
        if text.lower() == "currentcolor":
            text = style["color"]
        if not shows or text in ("none", "") or _number(style[f"{kind}-opacity"], 1) <= 0:
            continue
        # Of gradients and patterns it is unknown; the library has black for what it does not know.
        colour = svg.Color("black" if text.startswith("url(") else text)
        if colour.value is not None and colour.opacity:
            return colour.hexrgb or "#000000", kind == "stroke"
    return None


def _page(root: Element) -> tuple[float, float]:
    """Return width and height of a document in pixels: by its units, or else by its view box."""
    box = _view_box(root)
    width, height = (None if text is None or text.strip().endswith("%") or text == "auto"
                     else _length(text, 0) for text in (root.get("width"), root.get("height")))
    if box is None or box[2] <= 0 or box[3] <= 0:
        return width or 300.0, height or 150.0  # as browsers have it
    if width is None:
        width = box[2] if height is None else height * box[2] / box[3]
    return width, width * box[3] / box[2] if height is None else height


def _view_box(element: Element) -> tuple[float, float, float, float] | None:
    words = re.split(r"[\s,]+", element.get("viewBox", "").strip())
    try:
        x, y, width, height = map(float, words)
    except ValueError:
        return None
    return (x, y, width, height) if all(map(isfinite, (x, y, width, height))) else None


def _length(text: str | None, whole: float) -> float:
    """Return a length in pixels; `whole` is what 100 % are. What is no length is 0."""
    text = (text or "0").strip().replace("rem", "em")
    try:
        value = svg.Length(text).value(ppi=96, relative_length=whole, font_size=16, font_height=8)
        return float(value)
    except (ValueError, TypeError):
        return 0.0


def _number(text: str, default: float) -> float:
    """Return a number, or per cent of 1."""
    try:
        return float(text[:-1]) / 100 if text.endswith("%") else float(text)
    except ValueError:
        return default
