#!/usr/bin/env python3
"""Draw the pictures of this folder: `python examples/draw.py [FOLDER]`."""

import math
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFilter

Point = tuple[float, float]

BLACK, WHITE = 0, 255


def strawberry() -> Image.Image:
    """Fresa is Spanish for a milling cutter, and for this. 64 x 64, in lines one pixel wide."""
    image = Image.new("L", (64, 64), WHITE)
    middle = 32

    flank = [(41, 12.4), (50, 14.5), (56, 22), (56.4, 31), (53.6, 41), (48, 50), (40.4, 57.6)]
    far = [(2 * middle - x, y) for x, y in reversed(flank)]
    figure(image, smooth([(middle, 14), *flank, (middle, 61), *far], closed=True))
    # Leaves of the calyx, the hindmost first: angle from straight down, length.
    for angle, length in ((86, 23), (47, 21), (0, 18.5)):
        figure(image, leaf((middle, 13), angle, length))
    for x, y in ((0, 39), (0, 52), (8, 32), (18, 31), (13, 41), (6, 46)):
        line(image, [(middle + x, y), (middle + x, y + 2)])
    mirror_left(image, middle)

    stem = [(30, 14), (30, 9), (32, 5.4), (36, 2), (39.4, 4), (36.4, 7), (34.4, 10), (34, 14)]
    figure(image, smooth(stem, closed=True))
    return image


def geometry() -> Image.Image:
    """Square, circle, triangle, rhombus: 48 x 48, in lines one pixel wide."""
    image = Image.new("L", (48, 48), WHITE)
    pen = ImageDraw.Draw(image)
    pen.rectangle((3, 3, 21, 21), outline=BLACK)
    pen.ellipse((27, 3, 45, 21), outline=BLACK)
    # Two steps down for one aside: the same on both flanks.
    for step in range(19):
        for side in (-1, 1):
            pen.point((12 + side * (step // 2), 27 + step), BLACK)
    pen.line((3, 45, 21, 45), BLACK)
    pen.polygon([(36, 27), (45, 36), (36, 45), (27, 36)], outline=BLACK)
    return image


def photo() -> Image.Image:
    """What a camera would see: a ball in the light, its shadow, a word. 640 x 480 greys."""
    width, height = 640, 480
    y, x = np.mgrid[0:height, 0:width].astype(float)
    # The wall is paler towards the lamp, above on the left.
    image = Image.fromarray(shade(238 - 0.09 * np.hypot(x - 120, y - 40)))

    shadow = Image.new("L", image.size, BLACK)
    ImageDraw.Draw(shadow).ellipse((215, 300, 505, 350), 150)
    image.paste(70, mask=shadow.filter(ImageFilter.GaussianBlur(14)))

    radius = 130
    across, down = (x - 320) / radius, (y - 190) / radius
    towards = np.sqrt(np.clip(1 - across**2 - down**2, 0, 1))
    lit = np.clip(-0.55 * across - 0.6 * down + 0.58 * towards, 0, 1)
    ball = Image.fromarray(shade(28 + 175 * lit + 52 * lit**24))
    inside = Image.fromarray(shade(255 * (radius + 0.5 - np.hypot(x - 320, y - 190))))
    image.paste(ball, mask=inside)

    letters = {
        "F": [[(0, 2), (0, 0), (1, 0)], [(0, 0.95), (0.8, 0.95)]],
        "R": [[(0, 2), (0, 0), (0.8, 0), (1, 0.2), (1, 0.8), (0.8, 1), (0, 1)], [(0.5, 1), (1, 2)]],
        "E": [[(1, 0), (0, 0), (0, 2), (1, 2)], [(0, 0.95), (0.8, 0.95)]],
        "S": [[(1, 0.15), (0.8, 0), (0.2, 0), (0, 0.2), (0, 0.75), (0.2, 0.95), (0.8, 0.95),
               (1, 1.15), (1, 1.8), (0.8, 2), (0.2, 2), (0, 1.85)]],
        "A": [[(0, 2), (0.5, 0), (1, 2)], [(0.17, 1.35), (0.83, 1.35)]],
    }  # fmt: skip
    pen = ImageDraw.Draw(image)
    for place, strokes in enumerate(letters.values()):
        for stroke in strokes:
            path = [(140 + 82 * place + 40 * x, 370 + 38 * y) for x, y in stroke]
            pen.line(path, 48, 12, "curve")
            for x, y in (path[0], path[-1]):
                pen.ellipse((x - 5.5, y - 5.5, x + 5.5, y + 5.5), 48)
    return image.filter(ImageFilter.GaussianBlur(0.8))


def shade(values: np.ndarray) -> np.ndarray:
    """Greys of 8 bits, the nearest to `values`."""
    return np.clip(values, 0, 255).round().astype(np.uint8)


def mirror_left(image: Image.Image, middle: int) -> None:
    """Replace what is left of the column `middle` by the mirrored right side."""
    right = image.crop((middle + 1, 0, image.width, image.height))
    image.paste(right.transpose(Image.Transpose.FLIP_LEFT_RIGHT), (2 * middle - image.width + 1, 0))


def leaf(foot: Point, angle: float, length: float) -> list[Point]:
    """A pointed leaf that hangs from `foot`, turned by degrees."""
    width = length * 0.27
    shape = [(0, 0), (0.9, 0.25), (1, 0.5), (0.45, 0.8), (0, 1)]
    right = smooth([(width * x, length * y) for x, y in shape])
    edge = right + [(-x, y) for x, y in reversed(right[:-1])]
    sine, cosine = math.sin(math.radians(angle)), math.cos(math.radians(angle))
    return [(foot[0] + x * cosine + y * sine, foot[1] + y * cosine - x * sine) for x, y in edge]


def smooth(knots: Sequence[Point], closed: bool = False) -> list[Point]:
    """A curve through all knots (Catmull-Rom), as points less than a pixel apart."""
    ends = (knots[-1], knots[0], knots[1]) if closed else (knots[0], knots[-1], knots[-1])
    run = [ends[0], *knots, *ends[1:]]
    curve = []
    for a, b, c, d in zip(run, run[1:], run[2:], run[3:], strict=False):
        for step in range(64):
            t = step / 64
            curve.append(tuple(
                (2 * q + (r - p) * t + (2 * p - 5 * q + 4 * r - s) * t**2
                 + (3 * q - p - 3 * r + s) * t**3) / 2
                for p, q, r, s in zip(a, b, c, d, strict=True)
            ))  # fmt: skip
    return curve


def figure(image: Image.Image, edge: Sequence[Point]) -> None:
    """Draw a closed line, and clear what lies behind it."""
    ImageDraw.Draw(image).polygon([(nearest(x), nearest(y)) for x, y in edge], WHITE)
    line(image, [*edge, edge[0]])


def line(image: Image.Image, points: Sequence[Point]) -> None:
    """Draw a line one pixel wide: where it goes round a corner of a pixel, it cuts it."""
    walk: list[tuple[int, int]] = []
    for a, b in zip(points, points[1:], strict=False):
        steps = max(1, math.ceil(2 * math.dist(a, b)))
        for step in range(steps + 1):
            t = step / steps
            pixel = nearest(a[0] + (b[0] - a[0]) * t), nearest(a[1] + (b[1] - a[1]) * t)
            if walk and pixel == walk[-1]:
                continue
            if len(walk) > 1 and max(abs(p - q) for p, q in zip(pixel, walk[-2], strict=True)) == 1:
                walk.pop()
            walk.append(pixel)
    for pixel in walk:
        image.putpixel(pixel, BLACK)


def nearest(value: float) -> int:
    """The nearest whole number; halves go up."""
    return math.floor(value + 0.5)


def main() -> None:
    """Write all pictures."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    for picture in (strawberry, geometry):
        picture().convert("1").save(folder / f"{picture.__name__}.png", optimize=True)
    photo().save(folder / "photo.png", optimize=True)


if __name__ == "__main__":
    main()
