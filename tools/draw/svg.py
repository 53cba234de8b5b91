"""From SVG to the curves that a pen can follow.

The tree is walked here, since layers, what is invisible and what is left out have to be known of
every element; path data and colours are read by svgelements.
"""

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from math import isfinite
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element

import numpy as np
import svgelements as svg

from ..console import UserError
from .curves import Affine, Cubic, Curve, Ellipse, Polyline, Straight
from .document import INKSCAPE, MARKERS, MOST_DEPTH, Styles, href, local_name, read
from .values import Unreadable, length, origin, transform

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
PARTS_OF_TEXT = {"tspan", "textPath", "tref", "altGlyph", "a", "flowPara", "flowDiv", "flowSpan",
                 "flowLine"}
DRAWN = BASIC | GROUPS | TEXTS | {"image", "symbol", "foreignObject"}

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


class _View(NamedTuple):
    """What cuts off what is drawn beyond it: from the document to it, its size, what is said."""

    inverse: Affine
    width: float
    height: float
    note: str


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
    nested: int = 0
    uses: tuple[str, ...] = ()
    views: tuple[_View, ...] = ()


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
    root = read(path)
    try:
        drawing = _Reader(path, root, progress).drawing
    except Unreadable as error:
        raise UserError(f"{path}: {error}") from error
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
        width, height = _page(root, self._styles.of(root, {}))
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
        nested = self._deeper(context)
        name = local_name(element)
        if name not in DRAWN or element.get("requiredExtensions"):
            return  # what describes, defines, animates, or is not SVG
        style = self._styles.of(element, context.style)
        if not _displayed(style):
            return
        if not _understood(element):
            self.drawing.omitted["what is for another language than English"] += 1
            return
        affine = context.affine.after(self._transform(context, style))
        if not affine.determinant:
            return
        context = replace(context, affine=affine, style=style, nested=nested)
        for effect in ("clip-path", "mask", "filter"):
            if style[effect] not in ("none", ""):
                self.drawing.omitted[f"{effect} ignored"] += 1
        if name == "use":
            self._use(element, context)
        elif name in GROUPS or name == "symbol":
            self._group(name, element, context, size)
        elif name in TEXTS:
            self._refuse_text(element, context)
        elif name in BASIC:
            self._shape(name, element, context)
        else:
            self.drawing.omitted["image" if name == "image" else "foreign object"] += 1

    def _group(self, name: str, element: Element, context: _Context,
               size: tuple[float, float] | None) -> None:
        children = list(element)
        if name == "switch":
            fitting = [child for child in children if local_name(child) in DRAWN
                       and _understood(child) and not child.get("requiredExtensions")]
            children = ([child for child in fitting if local_name(child) != "foreignObject"]
                        or fitting)[:1]
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

    def _deeper(self, context: _Context) -> int:
        """Return how deep an element is nested."""
        if context.nested >= MOST_DEPTH:
            raise UserError(f"{self._path} has elements nested deeper than {MOST_DEPTH}, those "
                            "used again included: ungroup some")
        return context.nested + 1

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
        shift = _place(element, context)
        size = None
        if local_name(referred) in ("svg", "symbol"):
            whole = _size(referred, self._styles.of(referred, context.style), context)
            size = _size(element, context.style, context, whole)
        self._visit(referred, replace(
            context, affine=context.affine.after(Affine(origin=shift)),
            uses=(*context.uses, target)), size)

    def _viewport(self, element: Element, context: _Context, size: tuple[float, float] | None
                  ) -> _Context | None:
        """Return the context in an ``<svg>`` or ``<symbol>``; None if it has no area."""
        is_root = size is not None and not context.uses
        at = 0j if is_root else _place(element, context)
        width, height = size or _size(element, context.style, context)
        if width <= 0 or height <= 0:
            return None
        box = _view_box(element)
        if box is not None and (box[2] <= 0 or box[3] <= 0):
            return None
        affine = context.affine.after(Affine(origin=at))
        views = context.views
        if is_root:
            if box is not None or None not in _sides(element, context.style):
                views = (_View(affine.inverse(), width, height,
                               "outside the page, drawn all the same"),)
        elif context.style["overflow"] not in ("visible", "auto"):
            views = (*views, _View(affine.inverse(), width, height, "viewport clipping ignored"))
        if box is not None:
            aspect = element.get("preserveAspectRatio", "xMidYMid").replace("defer", "").strip()
            affine = affine.after(transform(svg.Viewbox.viewbox_transform(
                0, 0, width, height, *box, aspect), 0, 0))
            width, height = box[2:]
        if any(element.get(key) for key in ("refX", "refY")):
            self.drawing.omitted["refX and refY ignored"] += 1
        return replace(context, affine=affine, width=width, height=height, views=views)

    def _transform(self, context: _Context, style: Mapping[str, str]) -> Affine:
        """Return what an element's own transform does."""
        for each in ("translate", "rotate", "scale", "offset-path"):
            if style[each] != "none":
                raise Unreadable(f"the property {each} of CSS is not read: use transform")
        size = context.width, context.height
        made = transform(style["transform"], *size)
        if made == Affine():
            return made
        if style["transform-box"] != "view-box":
            raise Unreadable(f"transform-box {style['transform-box'][:60]!r} is not read: "
                             "only view-box is")
        about = origin(style["transform-origin"], *size)
        made = Affine(origin=about).after(made).after(Affine(origin=-about))
        if not np.all(np.isfinite(made)):
            raise self._beyond()
        return made

    def _refuse_text(self, element: Element, context: _Context) -> None:
        text = " ".join("".join(self._seen(element, context)).split())
        if text:
            if len(text) > 24:
                text = text[:24] + "..."
            raise UserError(f"{self._path} has text, {text!r}: convert text to paths (in Inkscape: "
                            "Path > Object to Path)")

    def _seen(self, element: Element, context: _Context) -> Iterator[str]:
        """Yield what can be read of a text."""
        nested = self._deeper(context)
        painted = _paint(context.style) is not None
        yield (element.text or "") * painted
        for child in element:
            style = self._styles.of(child, context.style)
            if local_name(child) in PARTS_OF_TEXT and _displayed(style):
                yield from self._seen(child, replace(context, style=style, nested=nested))
            yield (child.tail or "") * painted

    def _shape(self, name: str, element: Element, context: _Context) -> None:
        if (paint := _paint(context.style)) is None:
            return
        colour, stroked = paint
        style = context.style
        if name == "path" and style["d"] != "none":
            self.drawing.omitted["path data of style ignored"] += 1
        if name == "line" and not stroked:
            return
        outlines = []
        dots = stroked and style["stroke-linecap"] in ("round", "square")
        for outline in self._outlines(name, element, context, dots):
            start, end = outline[0].start, outline[-1].end
            if not stroked and start != end:  # the edge of a filled area is closed
                outline.append(Straight(start, end)._replace(start=end, end=start))
            outlines.append([curve.moved(context.affine) for curve in outline])
        if not outlines:
            return
        numbers = np.array([part for outline in outlines for curve in outline for part in curve])
        if not np.all(np.isfinite(numbers)) or np.abs(numbers).max() > LARGEST:
            raise self._beyond()
        for view in context.views:
            if _beyond_view(outlines, view):
                self.drawing.omitted[view.note] += 1
                break
        if stroked and style["stroke-dasharray"] not in ("none", "") and re.search(
                "[1-9]", style["stroke-dasharray"]):
            self.drawing.omitted["dashes drawn whole"] += 1
        if any(style[each] != "none" for each in MARKERS):
            self.drawing.omitted["marker ignored"] += 1
        self.drawing.shapes.append(Shape(outlines, context.layer, colour))

    def _outlines(self, name: str, element: Element, context: _Context, dots: bool
                  ) -> list[list[Curve]]:
        """Return the subpaths of a shape, in its own coordinates."""
        try:
            if name == "path":
                path = svg.Path(pathd_loaded=True)
                try:
                    path.parse(element.get("d", ""))
                except (ValueError, IndexError, TypeError, AttributeError):
                    # SVG has a path drawn up to where it cannot be read any more.
                    self.drawing.omitted["path data damaged, drawn up to there"] += 1
                return list(_subpaths(path, dots))
            return list(_subpaths(svg.Path(_basic(name, element, context)), dots))
        except (OverflowError, ZeroDivisionError) as error:
            raise self._beyond() from error

    def _beyond(self) -> UserError:
        return UserError(f"{self._path} has coordinates that are too large, or no numbers")


def _basic(name: str, element: Element, context: _Context) -> svg.Shape | str:
    """Return a basic shape."""
    diagonal = float(np.hypot(context.width, context.height) / np.sqrt(2))

    def given(key: str) -> float | None:
        whole = context.width if key in ACROSS else context.height if key in DOWN else diagonal
        return length(context.style.get(key, element.get(key)), whole)

    def number(key: str) -> float:
        return given(key) or 0.0

    if name in ("rect", "ellipse"):  # what is not given of radii, or below 0, is as the other one
        rx, ry = (None if value is None or value < 0 else value for value in map(
            given, ("rx", "ry")))
        rx, ry = (ry or 0.0) if rx is None else rx, (rx or 0.0) if ry is None else ry
    else:
        rx = ry = number("r")
    if name == "rect":
        x, y, width, height = map(number, ("x", "y", "width", "height"))
        if width <= 0 or height <= 0:
            return ""
        return svg.Rect(x, y, width, height, min(rx, width / 2), min(ry, height / 2))
    if name in ("circle", "ellipse"):
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


def _subpaths(path: svg.Path, dots: bool) -> Iterator[list[Curve]]:
    """Yield what lies between two moves of a path, without what has no length.

    With `dots`, one that has lines, but altogether no length, is a line from a point to itself.
    """
    outline: list[Curve] = []
    dot: list[Curve] = []
    for segment in path:
        if isinstance(segment, svg.Move) or segment.start is None:
            if outline or dot:
                yield outline or dot
            outline, dot = [], []
            if not isinstance(segment, svg.Move):
                return  # it does not begin with a move, so it is no path
            continue
        curve = _curve(segment)
        if curve is not None:
            outline.append(curve)
        elif dots:
            dot = [Straight(_complex(segment.end), _complex(segment.end))]
        if isinstance(segment, svg.Close) and (outline or dot):
            yield outline or dot
            outline, dot = [], []
    if outline or dot:
        yield outline or dot


def _curve(segment: svg.PathSegment) -> Curve | None:
    start, end = _complex(segment.start), _complex(segment.end)
    if isinstance(segment, svg.CubicBezier | svg.QuadraticBezier):
        curve = (Cubic(start, _complex(segment.control1), _complex(segment.control2), end)
                 if isinstance(segment, svg.CubicBezier) else
                 Cubic.quadratic(start, _complex(segment.control), end))
        return None if set(curve) == {start} else curve
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
    try:
        width = length(style["stroke-width"], 100)
    except Unreadable:
        width = None  # as any width does
    for kind, shows in (("stroke", width is None or width > 0), ("fill", True)):
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


def _displayed(style: Mapping[str, str]) -> bool:
    return style["display"] != "none" and _number(style["opacity"], 1) > 0


def _understood(element: Element) -> bool:
    """Return whether an element is for those who read English."""
    languages = element.get("systemLanguage")
    return languages is None or any(re.fullmatch("en(-.*)?", each.strip().lower())
                                    for each in languages.split(","))


def _beyond_view(outlines: list[list[Curve]], view: _View) -> bool:
    """Return whether a view cuts off what is drawn, by more than a thousandth of its size."""
    slack = 1e-3 * max(view.width, view.height)

    def beyond(points: Polyline) -> bool:
        return bool(np.any((points.real < -slack) | (points.real > view.width + slack)
                           | (points.imag < -slack) | (points.imag > view.height + slack)))

    curves = [curve for outline in outlines for curve in outline]
    around = np.array([point for curve in curves for point in (
        curve.corners() if isinstance(curve, Ellipse) else curve)])
    back = view.inverse
    return beyond(back.x * around.real + back.y * around.imag + back.origin) and any(
        beyond(curve.moved(back).bounds()) for curve in curves)


def _place(element: Element, context: _Context) -> complex:
    """Return x and y of what makes a viewport, or of a use."""
    x, y = (length(context.style.get(key, element.get(key)), whole) or 0.0
            for key, whole in (("x", context.width), ("y", context.height)))
    return complex(x, y)


def _size(element: Element, style: Mapping[str, str], context: _Context,
          auto: tuple[float, float] | None = None) -> tuple[float, float]:
    """Return width and height of what makes a viewport, or of a use; if not given, these or all."""
    width, height = context.width, context.height
    own = [length(style.get(key, element.get(key)), whole)
           for key, whole in (("width", width), ("height", height))]
    first, second = (default if given is None else given
                     for given, default in zip(own, auto or (width, height), strict=True))
    return first, second


def _page(root: Element, style: Mapping[str, str]) -> tuple[float, float]:
    """Return width and height of a document in pixels: by its units, or else by its view box."""
    box = _view_box(root)
    width, height = _sides(root, style)
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


def _sides(root: Element, style: Mapping[str, str]) -> list[float | None]:
    """Return width and height that a document gives; None where the window decides."""
    found: list[float | None] = []
    for key in ("width", "height"):
        text = style.get(key, root.get(key, "auto"))
        try:
            found.append(None if text.strip().endswith("%") else length(text, 0))
        except Unreadable:
            found.append(None)
    return found


def _number(text: str, default: float) -> float:
    """Return a number, or per cent of 1."""
    try:
        return float(text[:-1]) / 100 if text.endswith("%") else float(text)
    except ValueError:
        return default
