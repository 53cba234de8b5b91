"""A drawing of lines, areas and texts, written as SVG or as a picture.

A style has one colour for light and one for dark pages. An SVG follows the page that it is on; a
picture uses the light colours.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Literal
from xml.sax.saxutils import escape

from PIL import Image, ImageDraw, ImageFont

__all__ = ["CHARACTER", "STYLES", "Scene", "Style"]

SIZE = 12
"""Font size in pixels."""

CHARACTER = 0.6 * SIZE
"""Width of a character in pixels: that of the fonts below, and more than that of Pillow's own."""

FONTS = "ui-monospace, SFMono-Regular, Menlo, Consolas, 'DejaVu Sans Mono', monospace"

SMOOTH = 4
"""Scale at which pictures are drawn before they are reduced, since Pillow draws hard edges."""

Point = tuple[float, float]
Anchor = Literal["start", "middle", "end"]


@dataclass(frozen=True)
class Style:
    """Colours of a line and of the area inside it, on light and dark pages."""

    line: tuple[str, str] | None = None
    fill: tuple[str, str] | None = None
    width: float = 1.2
    bold: bool = False


STYLES = {
    "paper": Style(("#dfe4e9", "#2c343d"), ("#ffffff", "#13171c"), 1),
    "grid": Style(("#e9edf1", "#222931"), width=1),
    "axis": Style(("#8894a0", "#7c8a97"), width=1),
    "title": Style(fill=("#1d2731", "#eef2f5"), bold=True),
    "name": Style(fill=("#1d2731", "#dfe5ea")),
    "note": Style(fill=("#66727e", "#93a0ac")),
    "group": Style(fill=("#66727e", "#93a0ac"), bold=True),
    "bit": Style(("#1f5fa8", "#7db8f5")),
    "high": Style(fill=("#dfecfa", "#1b3049")),
    "bus": Style(("#2f7155", "#82c9a6"), ("#eaf5ef", "#18291f")),
    "state": Style(("#9a5b12", "#e5ae68"), ("#fdf2e0", "#33260f")),
    "value": Style(fill=("#1d2731", "#eef2f5")),
    "curve": Style(("#7a3fa0", "#c79be6")),
    "under": Style(fill=("#f4ecf9", "#281d31")),
    "busy": Style(fill=("#9fb0c0", "#51606e")),
    "unknown": Style(("#c62828", "#ff8a80"), ("#fdecec", "#341a1a"), 0.9),
}


@dataclass(frozen=True)
class _Shape:
    style: str
    points: tuple[Point, ...]
    closed: bool


@dataclass(frozen=True)
class _Text:
    style: str
    place: Point
    text: str
    anchor: Anchor


@dataclass
class Scene:
    """A drawing.

    Parameters
    ----------
    width, height : float
        Its size in pixels.
    title, about : str
        Text for readers who cannot see it.
    """

    width: float
    height: float
    title: str
    about: str
    _shapes: list[_Shape | _Text] = field(default_factory=list)

    def line(self, style: str, points: Iterable[Point]) -> None:
        """Draw a line through points."""
        self._shapes.append(_Shape(style, tuple(points), False))

    def area(self, style: str, points: Iterable[Point]) -> None:
        """Draw an area between points, and its edge if the style has a line."""
        self._shapes.append(_Shape(style, tuple(points), True))

    def text(self, style: str, x: float, y: float, text: str, anchor: Anchor = "start") -> None:
        """Write text whose middle is at the height `y`."""
        self._shapes.append(_Text(style, (x, y), text, anchor))

    def svg(self) -> str:
        """Return it as SVG. Equal drawings give equal bytes."""
        size = f"{_number(self.width)} {_number(self.height)}"
        used = {shape.style for shape in self._shapes} | {"paper"}
        return "\n".join([
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size}" '
            f'width="{_number(self.width)}" height="{_number(self.height)}" role="img">',
            f"<title>{escape(self.title)}</title>",
            f"<desc>{escape(self.about)}</desc>",
            "<style>",
            f"text {{ font: {SIZE}px {FONTS}; dominant-baseline: central; white-space: pre }}",
            "path { stroke-linejoin: round; fill: none }",
            *_rules(used, 0),
            "@media (prefers-color-scheme: dark) {", *_rules(used, 1), "}",
            "</style>",
            f'<rect class="paper" x="0.5" y="0.5" width="{_number(self.width - 1)}" '
            f'height="{_number(self.height - 1)}" rx="6"/>',
            *map(_element, self._shapes),
            "</svg>", ""])

    def picture(self, scale: int = 2) -> Image.Image:
        """Return it as a picture, scaled by an integer."""
        zoom = scale * SMOOTH
        size = (round(self.width * zoom), round(self.height * zoom))
        paper = STYLES["paper"].fill
        assert paper is not None
        image = Image.new("RGB", size, paper[0])
        draw = ImageDraw.Draw(image)
        font = ImageFont.load_default(SIZE * zoom)
        for shape in self._shapes:
            style = STYLES[shape.style]
            fill = style.fill and style.fill[0]
            if isinstance(shape, _Text):
                x, y = (value * zoom for value in shape.place)
                draw.text((x, y), shape.text, fill, font,
                          anchor={"start": "lm", "middle": "mm", "end": "rm"}[shape.anchor])
                continue
            points = [(x * zoom, y * zoom) for x, y in shape.points]
            if shape.closed and fill:
                draw.polygon(points, fill)
            if style.line:
                whole = [*points, points[0]] if shape.closed else points
                draw.line(whole, style.line[0], round(style.width * zoom), joint="curve")
        return image.reduce(SMOOTH)


def _number(value: float) -> str:
    return f"{value:.1f}".removesuffix(".0")


def _rules(used: set[str], page: int) -> list[str]:
    """Return the colours of the styles that are used."""
    rules = []
    for name, style in STYLES.items():
        if name not in used:
            continue
        parts = []
        if style.line:
            parts.append(f"stroke: {style.line[page]}")
            parts += [f"stroke-width: {style.width}"] * (page == 0)
        if style.fill:
            parts.append(f"fill: {style.fill[page]}")
        parts += ["font-weight: 600"] * (style.bold and page == 0)
        # A path inherits no fill, so its own class has to name it.
        rules.append(f".{name} {{ {'; '.join(parts)} }}")
    return rules


def _element(shape: _Shape | _Text) -> str:
    if isinstance(shape, _Text):
        anchor = "" if shape.anchor == "start" else f' text-anchor="{shape.anchor}"'
        x, y = map(_number, shape.place)
        return f'<text class="{shape.style}" x="{x}" y="{y}"{anchor}>{escape(shape.text)}</text>'
    path = "M" + "L".join(f"{_number(x)} {_number(y)}" for x, y in shape.points)
    return f'<path class="{shape.style}" d="{path}{"Z" * shape.closed}"/>'
