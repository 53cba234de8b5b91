"""Icons and clip art of Debian: drawn within the area, or refused in a line."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from fresa_host.gcode_lines import program
from tools.console import UserError
from tools.draw.plan import length, plan
from tools.draw.program import gcode
from tools.draw.svg import read_drawing
from tools.draw.wall import Wall

THEMES = {"tango-icon-theme": "icons/Tango/scalable", "adwaita-icon-theme": "icons/Adwaita"}
CLIP_ART = {"openclipart-svg": "openclipart/svg"}
SHARE = Path("/usr/share")
WALL = Wall()

EVERY = 60
"""Of so many clip arts one is taken."""


def drawings(folder: str) -> list[Path]:
    """Return the files of a package, those once that are there under several names."""
    return sorted(path for path in (SHARE / folder).rglob("*.svg") if not path.is_symlink())


def chosen(package: str) -> list[Path]:
    """Return what is drawn of a package: of clip art some, each once if it is in two folders."""
    if package in THEMES:
        return drawings(THEMES[package])
    by_name = {path.name: path for path in drawings(CLIP_ART[package])}
    return [*by_name.values()][::EVERY]


@pytest.mark.drawings
@pytest.mark.parametrize("package", [*THEMES, *CLIP_ART])
def test_each_is_drawn_within_the_area_or_refused(package):
    if not (files := chosen(package)):
        pytest.skip(f"{package} missing: apt-get install {package}")
    assert len(files) >= 30
    done = Counter()
    for path in files:
        try:
            planned = plan(read_drawing(path), WALL, effort=0.01, vpype=False)
        except UserError as error:
            assert "\n" not in str(error) and str(path) in str(error)
            done["refused"] += 1
            continue
        done["drawn"] += 1
        points = np.concatenate(planned.lines)
        assert WALL.contains(points), path
        # It fills the area in one direction, up to what is left out as too small.
        size = np.array([np.ptp(points.real) / 1568, np.ptp(points.imag) / 1468])
        assert size.max() == pytest.approx(1, abs=1e-3), path
        assert length(planned.lines) > 100
        for order in planned.orders:
            assert order.after <= order.before + 1, path
        text = gcode(planned.parts, WALL, 1800)
        assert len(program(text.splitlines())) > 5 and text.isascii()
    assert done["drawn"] >= 0.95 * len(files)
