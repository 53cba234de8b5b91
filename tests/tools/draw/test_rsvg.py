"""Outlines of icons that others made, compared with what librsvg draws of the same files."""

import io
import shutil
import subprocess
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, fromstring, tostring

import numpy as np
import pytest
import svgelements
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFilter

from tests.tools.draw.test_icons import SHARE, THEMES, drawings
from tools.console import UserError
from tools.draw.document import SVG, local_name
from tools.draw.svg import BASIC, read_drawing

SIDE = 600
"""Pixels of a picture."""

NEAR = 7
"""Pixels across in which the other picture must have a line: 3 on each side."""

STRAY = 20
"""Pixels that may be without: where thin strokes end or cross, librsvg has them pale."""

STYLE = ("* { opacity: 1 !important; clip-path: none !important; mask: none !important; "
         "filter: none !important; overflow: visible !important }"
         + ", ".join(sorted(BASIC)) + " { fill: none !important; stroke: #000 !important; "
         "stroke-opacity: 1 !important; stroke-dasharray: none !important; stroke-linejoin: round "
         "!important; marker: none !important }")
"""Everything by its outline, in thin black lines."""


def outlined(path: Path) -> tuple[bytes, float]:
    """Return a drawing in which all shapes have thin outlines, and its width and height in it."""
    root = fromstring(path.read_bytes())
    box = root.get("viewBox")
    side = max(float(each) for each in (box.split()[2:] if box else (
        root.get(key, "").rstrip("px") for key in ("width", "height"))))
    _thin(root, svgelements.Matrix(), 1.2 * side / SIDE)
    style = SubElement(root, f"{SVG}style")
    style.text = STYLE
    root.set("width", str(side))
    root.set("height", str(side))
    root.set("viewBox", box or f"0 0 {side} {side}")
    return tostring(root), side


def _thin(element: Element, matrix: svgelements.Matrix, width: float) -> None:
    """Give shapes a stroke that is as wide everywhere, whatever their groups do to it."""
    if transform := element.get("transform"):
        matrix = svgelements.Matrix(transform) * matrix
    if local_name(element) in BASIC:
        axes = np.array([[matrix.a, matrix.c], [matrix.b, matrix.d]], float)
        least = max(float(np.linalg.svd(axes)[1][1]), 1e-9)
        element.set("style", f"{element.get('style', '')};stroke-width:{width / least} !important")
    for child in element:
        _thin(child, matrix, width)


def of_librsvg(data: bytes) -> NDArray:
    """Return the picture that librsvg makes."""
    done = subprocess.run(["rsvg-convert", "-w", str(SIDE), "-h", str(SIDE), "-b", "white"],
                          input=data, capture_output=True, check=True)
    return np.asarray(Image.open(io.BytesIO(done.stdout)).convert("L"))


def of_ours(path: Path, side: float) -> NDArray:
    """Return the picture of our lines."""
    image = Image.new("L", (SIDE, SIDE), 255)
    draw = ImageDraw.Draw(image)
    for shape in read_drawing(path).shapes:
        for outline in shape.outlines:
            points = np.concatenate([curve.chords(side / SIDE / 20) for curve in outline])
            at = points * SIDE / side - (0.5 + 0.5j)
            draw.line([(point.real, point.imag) for point in at.tolist()], 0, 1)
    return np.asarray(image)


def without(lines: NDArray, others: NDArray) -> int:
    """Return how many dark pixels of one picture have none of the other near."""
    grown = Image.fromarray(((others < 160) * 255).astype(np.uint8)).filter(
        ImageFilter.MaxFilter(NEAR))
    return int(((lines < 160) & (np.asarray(grown) == 0)).sum())


@pytest.mark.drawings
@pytest.mark.parametrize("package", THEMES)
def test_outlines_are_those_of_librsvg(package, tmp_path):
    if shutil.which("rsvg-convert") is None:
        pytest.skip("rsvg-convert missing: apt-get install librsvg2-bin")
    if not (files := drawings(THEMES[package])[::10]):
        pytest.skip(f"{package} missing: apt-get install {package}")
    compared = 0
    for path in files:
        data, side = outlined(path)
        (copy := tmp_path / "drawing.svg").write_bytes(data)
        try:
            ours = of_ours(copy, side)
        except UserError:
            continue  # which test_icons.py counts
        theirs = of_librsvg(data)
        where = path.relative_to(SHARE)
        assert (ours < 160).sum() > 100, where
        assert without(ours, theirs) <= STRAY and without(theirs, ours) <= STRAY, where
        compared += 1
    assert compared >= 0.9 * len(files) >= 18
