"""The pictures of the documentation, taken of the page in a real browser.

The test takes them into a folder of its own. To renew those of docs/::

    FRESA_PICTURES=docs python -m pytest -n 0 -m browser -k pictures tests/tools/board
"""

import os
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.tools.board.browser import ROOT, Page, resize, serve

pytestmark = pytest.mark.browser

VIEWS = {  # name: width, height, scheme
    "board": (1280, 800, "light"),
    "board-dark": (1280, 800, "dark"),
    "board-phone": (360, 740, "light"),
}
EXAMPLE = ROOT / "examples" / "strawberry.png"


def test_pictures(libraries, chromium, tmp_path):
    """Mill a part of the example, pause, and take a picture of each view."""
    folder = ROOT / os.environ["FRESA_PICTURES"] if "FRESA_PICTURES" in os.environ else tmp_path
    with serve(EXAMPLE, "--period", "100") as address:
        page = Page(chromium(), address)
        page.fresh()
        page.set_switches(1 << 7)
        page.until(lambda: page.step == 3 and page.duty("led7"), "ready")
        page.find("btn1").click()
        page.until(lambda: page.cut() > 200, "two thirds of the cut")
        page.pause()
        for name, (width, height, scheme) in VIEWS.items():
            resize(page.browser, width, height, scheme=scheme)
            take(page, folder / f"{name}.png")
            check(folder / f"{name}.png", width, height, dark=scheme == "dark")


def take(page: Page, path: Path) -> None:
    """Take a picture when nothing moves any more."""
    page.browser.set_script_timeout(10)
    page.browser.execute_async_script("""
        scrollTo(0, 0);
        document.activeElement.blur();
        setTimeout(arguments[arguments.length - 1], 400);""")
    assert page.browser.save_screenshot(str(path))


def check(path: Path, width: int, height: int, *, dark: bool) -> None:
    """See that there is a picture with the board in it, light or dark as it should be."""
    with Image.open(path) as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    assert pixels.shape == (height, width, 3)
    corner = pixels[-1, 0].mean()
    assert corner < 60 if dark else corner > 200
    green = (np.abs(pixels - (15, 61, 58)).max(axis=2) < 6).mean()
    assert green > 0.05
