"""From any picture to the pixels that are milled.

A prepared picture is an array of bool, one row of it a row of pixels, True where the tool cuts. The
machine's x is the row and grows downwards; its y is the column and grows to the right.
"""

import io
import os
import stat
import warnings
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Literal

import numpy as np
from PIL import Image, ImageDraw, ImageFont, ImageOps, UnidentifiedImageError

from fresa.machines.mill import PIXEL_STEPS, RESOLUTION

from .console import UserError, describe
from .raster import otsu, outlined, thinned

__all__ = [
    "LARGEST",
    "MM_PER_PIXEL",
    "PictureError",
    "Prepared",
    "encode",
    "load",
    "prepare",
    "preview",
]

MM_PER_PIXEL = float(PIXEL_STEPS * RESOLUTION)

# Pixels on a side that the machine can address: 65 536 steps.
LARGEST = 65_536 // PIXEL_STEPS

# The formats of cameras, scanners and drawing programs. Others are left out on purpose: some of
# them start programs to be read.
FORMATS = ("PNG", "JPEG", "GIF", "BMP", "TIFF", "WEBP", "PPM")
MEGAPIXELS = 64

# Colours of the preview: a light board, cut through to the dark.
PAPER = (255, 255, 255)
BLANK = (244, 236, 221)
FRAME = (201, 187, 160)
CUT = (43, 38, 34)

Turn = Literal[0, 90, 180, 270]
Mirror = Literal["horizontal", "vertical"]


class PictureError(UserError, ValueError):
    """A picture that cannot be read or milled. Its text, one line, is what to do."""


@dataclass(frozen=True, eq=False)
class Prepared:
    """Pixels to mill, and how they came about.

    Attributes
    ----------
    pixels : array of bool, shape (rows, columns)
        True where the tool cuts. Read-only.
    threshold : int
        Darkest is 0, lightest 255. Up to this value, a grey counted as dark.
    automatic : bool
        Whether the threshold was found by Otsu's method.
    scale : float
        Pixels here for a pixel of the picture. 1 means that no pixel was touched.
    source : tuple of int
        Width and height of the picture, in its pixels.
    """

    pixels: np.ndarray
    threshold: int
    automatic: bool
    scale: float
    source: tuple[int, int]

    @property
    def width(self) -> int:
        """Columns."""
        return self.pixels.shape[1]

    @property
    def height(self) -> int:
        """Rows."""
        return self.pixels.shape[0]

    @property
    def count(self) -> int:
        """Pixels to mill."""
        return int(self.pixels.sum())

    @property
    def share(self) -> float:
        """Part of the pixels that is milled, up to 1."""
        return self.count / self.pixels.size

    def facts(self) -> dict[str, object]:
        """List what was done, ready for JSON."""
        return {
            "width": self.width,
            "height": self.height,
            "width_mm": round(self.width * MM_PER_PIXEL, 3),
            "height_mm": round(self.height * MM_PER_PIXEL, 3),
            "pixels": self.count,
            "share": round(self.share, 6),
            "threshold": self.threshold,
            "automatic_threshold": self.automatic,
            "scale": self.scale,
            "source_width": self.source[0],
            "source_height": self.source[1],
        }

    def summary(self) -> str:
        """Say in one line what is to be milled."""
        by = "found" if self.automatic else "given"
        return (
            f"{_size_text(self.pixels)}, {self.count} to mill ({self.share:.1%}), "
            f"threshold {self.threshold} ({by}), scale {self.scale:.4g}"
        )


def load(path: str | os.PathLike) -> Image.Image:
    """Read a picture from a file, as grey.

    The camera's orientation is applied, what is transparent becomes white, and of an animation the
    first picture is taken. A drawing in white on a transparent ground becomes black on white.

    Parameters
    ----------
    path : path
        A PNG, JPEG, GIF, BMP, TIFF, WebP or PPM file of up to 64 megapixels.

    Returns
    -------
    PIL.Image.Image
        The picture in mode ``L``: 0 is black, 255 is white.

    Raises
    ------
    PictureError
        If there is no such file, or no picture in it that can be read.
    """
    data = _read(Path(path))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # Pillow's doubts about tags that do not matter here
        try:
            image = Image.open(io.BytesIO(data), formats=FORMATS)
        except Image.DecompressionBombError as error:
            raise PictureError(_too_large(path)) from error
        except UnidentifiedImageError as error:
            raise PictureError(
                f"{path} is not a picture, or of a kind not read here: save it as PNG or JPEG first"
            ) from error
        except Exception as error:
            raise PictureError(_damaged(path)) from error
        if image.width * image.height > MEGAPIXELS * 10**6:
            raise PictureError(_too_large(path))
        # A decoder that is given a damaged file may raise anything.
        try:
            return _grey(ImageOps.exif_transpose(image))
        except Exception as error:
            raise PictureError(_damaged(path)) from error


def prepare(
    image: Image.Image,
    *,
    width: int = 400,
    height: int = 400,
    threshold: int | None = None,
    invert: bool = False,
    outline: bool = False,
    thin: bool = False,
    turn: Turn = 0,
    mirror: Mirror | None = None,
    enlarge: bool = False,
    keep_lines: bool = False,
) -> Prepared:
    """Turn a grey picture into pixels to mill.

    It is turned, mirrored, fitted, cut at the threshold, and reduced to outlines or lines, in this
    order. A picture that fits is not scaled: if it has two values, its pixels come through exactly.

    Parameters
    ----------
    image : PIL.Image.Image
        The picture, as `load` gives it. Other modes are made grey in the same way.
    width, height : int
        Columns and rows that it must fit into, keeping its proportions. 1 to 512.
    threshold : int
        Greys from 0 up to this are dark, those above up to 255 are light. Found by `otsu` if None.
    invert : bool
        Mill what is light rather than what is dark.
    outline : bool
        Mill only the edge of each figure.
    thin : bool
        Mill only the middle line of each figure.
    turn : int
        Degrees clockwise: 0, 90, 180 or 270.
    mirror : str
        ``"horizontal"`` swaps left and right, ``"vertical"`` top and bottom.
    enlarge : bool
        Let a smaller picture grow until it fits: by a whole number if it has two values.
    keep_lines : bool
        When shrinking, let one pixel of the figure win over the ground, so that a thin line becomes
        thicker rather than paler.

    Returns
    -------
    Prepared
        At least one of its pixels is set.

    Raises
    ------
    PictureError
        If there would be nothing to mill.
    ValueError
        If a parameter is out of its range.
    """
    for side in (width, height):
        if not 1 <= side <= LARGEST:
            raise ValueError(f"Width and height must be 1 to {LARGEST} pixels, not {side!r}")
    if threshold is not None and not 0 <= threshold <= 255:
        raise ValueError(f"Threshold must be 0 to 255, not {threshold!r}")
    if turn not in (0, 90, 180, 270):
        raise ValueError(f"Turn must be 0, 90, 180 or 270 degrees, not {turn!r}")
    if mirror not in (None, "horizontal", "vertical"):
        raise ValueError(f"Mirror must be None, 'horizontal' or 'vertical', not {mirror!r}")
    if outline and thin:
        raise ValueError("Outline and thin exclude each other")

    grey = np.rot90(np.asarray(_grey(image)), -turn // 90)
    if mirror == "horizontal":
        grey = np.fliplr(grey)
    elif mirror == "vertical":
        grey = np.flipud(grey)
    if grey.size == 0:
        raise PictureError("the picture has no pixels: choose another")
    winner = np.maximum if invert else np.minimum
    grey, scale = _fit(grey, width, height, enlarge, winner if keep_lines else None)

    level = otsu(np.bincount(grey.ravel(), minlength=256)) if threshold is None else threshold
    pixels = (grey > level) if invert else (grey <= level)
    if not pixels.any() and grey.min() == grey.max():
        raise PictureError("nothing to mill: the picture is one grey all over")
    if not pixels.any():
        wanted = "lighter than" if invert else "as dark as"
        # Not with the other ground: there everything would be milled.
        raise PictureError(
            f"nothing to mill: no pixel is {wanted} the threshold {level}; try another --threshold"
        )
    if outline:
        pixels = outlined(pixels)
    if thin:
        pixels = thinned(pixels)
    pixels = np.ascontiguousarray(pixels)
    pixels.flags.writeable = False
    return Prepared(pixels, level, threshold is None, scale, image.size)


def encode(image: Image.Image) -> bytes:
    """Return a picture as the bytes of a PNG file."""
    buffer = io.BytesIO()
    image.save(buffer, "PNG", optimize=True)
    return buffer.getvalue()


def preview(pixels: np.ndarray, scale: int | None = None) -> Image.Image:
    """Draw what is milled, dark on light, with its size and a bar of millimetres.

    Parameters
    ----------
    pixels : array of bool, shape (rows, columns)
        What is milled.
    scale : int
        Side of a milled pixel in the drawing, in its pixels. If None, such that the longer side is
        about 800.

    Returns
    -------
    PIL.Image.Image
        The drawing, in colour.

    Raises
    ------
    ValueError
        If the scale is less than 1.
    """
    if scale is None:
        scale = max(1, min(32, 800 // max(pixels.shape)))
    if scale < 1:
        raise ValueError(f"Scale must be at least 1, not {scale!r}")
    margin, text = 24, 16
    height, width = (side * scale for side in pixels.shape)
    font = ImageFont.load_default(text)
    caption = f"{_size_text(pixels)}, {int(pixels.sum())} to mill"
    bar_mm = _round_length(width * MM_PER_PIXEL / scale / 3)
    bar = round(bar_mm / MM_PER_PIXEL * scale)
    bar_text = f"{bar_mm:g} mm"

    wide = max(width, round(font.getlength(caption)), bar + 8 + round(font.getlength(bar_text)))
    canvas = Image.new("RGB", (wide + 2 * margin, height + 3 * margin + 3 * text), PAPER)
    draw = ImageDraw.Draw(canvas)
    draw.rectangle((margin - 1, margin - 1, margin + width, margin + height), BLANK, FRAME)
    cut = Image.fromarray(np.where(pixels, 255, 0).astype(np.uint8)).resize((width, height), 0)
    canvas.paste(CUT, (margin, margin), cut)

    y = 2 * margin + height
    draw.line([(margin, y), (margin, y + 12)], CUT, 2)
    draw.line([(margin + bar, y), (margin + bar, y + 12)], CUT, 2)
    draw.line([(margin, y + 6), (margin + bar, y + 6)], CUT, 2)
    draw.text((margin + bar + 8, y + 6), bar_text, CUT, font, anchor="lm")
    draw.text((margin, y + 2 * text), caption, CUT, font, anchor="lm")
    return canvas


def _read(path: Path) -> bytes:
    try:
        status = path.stat()
        if stat.S_ISDIR(status.st_mode):
            raise PictureError(f"{path} is a folder: name a picture in it")
        if not stat.S_ISREG(status.st_mode):
            raise PictureError(f"{path} is not a file: save the picture to one first")
        if status.st_size == 0:
            raise PictureError(f"{path} is empty: save the picture again")
        if status.st_size > 8 * MEGAPIXELS * 10**6:
            raise PictureError(_too_large(path))
        return path.read_bytes()
    except FileNotFoundError as error:
        raise PictureError(f"there is no file {path}: check its name") from error
    except OSError as error:
        raise PictureError(f"cannot read {describe(error)}") from error


def _too_large(path: str | os.PathLike) -> str:
    return f"{path} is larger than {MEGAPIXELS} megapixels: make it smaller first"


def _damaged(path: str | os.PathLike) -> str:
    return f"{path} is damaged or cut short: save or download it again"


def _grey(image: Image.Image) -> Image.Image:
    if image.mode == "L" and not image.has_transparency_data:
        image.load()
        return image
    if image.mode == "F":
        return Image.fromarray(_stretch(np.asarray(image)))
    if image.mode.startswith("I"):  # 16 bits a pixel, held in 16 or 32
        return Image.fromarray((np.asarray(image).clip(0, 65535) // 257).astype(np.uint8))
    if image.mode == "LAB":
        return image.getchannel(0)
    if image.has_transparency_data:
        image = image.convert("RGBA")
        opacity = image.getchannel("A")
        image = Image.alpha_composite(Image.new("RGBA", image.size, "white"), image)
        if image.convert("RGB").convert("L").getextrema() == (255, 255):  # white, if anything
            return ImageOps.invert(opacity)
    return image.convert("RGB").convert("L")


def _stretch(values: np.ndarray) -> np.ndarray:
    finite = np.isfinite(values)
    if not finite.any():
        return np.full(values.shape, 255, np.uint8)
    low, high = float(values[finite].min()), float(values[finite].max())
    values = np.where(finite, values, high).astype(float)
    return np.rint((values - low) * (255 / (high - low) if high > low else 0)).astype(np.uint8)


def _fit(
    grey: np.ndarray, width: int, height: int, enlarge: bool, winner: np.ufunc | None
) -> tuple[np.ndarray, float]:
    """Scale `grey` to fit; give it with the scale used.

    Where it shrinks, `winner` chooses among the pixels that become one. None blends them.
    """
    rows, columns = grey.shape
    scale = min(Fraction(width, columns), Fraction(height, rows))
    if scale == 1 or (scale > 1 and not enlarge):
        return grey, 1.0
    if scale > 1 and len(np.unique(grey)) <= 2:
        factor = int(scale)
        return grey.repeat(factor, axis=0).repeat(factor, axis=1), float(factor)
    size = max(1, round(columns * scale)), max(1, round(rows * scale))
    if scale < 1 and winner is not None:
        grey = winner.reduceat(grey, np.arange(size[0]) * columns // size[0], axis=1)
        grey = winner.reduceat(grey, np.arange(size[1]) * rows // size[1], axis=0)
        return grey, float(scale)
    image = Image.fromarray(np.ascontiguousarray(grey))
    return np.asarray(image.resize(size, Image.Resampling.LANCZOS)), float(scale)


def _size_text(pixels: np.ndarray) -> str:
    height, width = pixels.shape
    return f"{width} x {height} pixels, {width * MM_PER_PIXEL:.1f} x {height * MM_PER_PIXEL:.1f} mm"


def _round_length(most: float) -> float:
    """Return the longest of 1, 2, 5, 10, ... that is at most `most`, or else its tenth parts."""
    unit = 10.0 ** np.floor(np.log10(most))
    return max(float(unit * factor) for factor in (1, 2, 5) if unit * factor <= most * (1 + 1e-9))
