"""What the tests of the page share: the command that serves it, a person at the page."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fresa.panel.display import HEX_SEGMENTS
from tests.tools import browsing
from tests.tools.browsing import resize
from tests.tools.process import PATIENCE, ROOT, command

__all__ = ["PATIENCE", "ROOT", "Page", "keys", "resize", "save", "seen", "serve", "shown", "speed",
           "tab_to"]

TAB, LEFT, END = "\ue004", "\ue012", "\ue010"
"""Keys, as WebDriver names them."""


def save(pixels: np.ndarray, path: Path) -> Path:
    """Write pixels as a picture: black where to cut."""
    Image.fromarray(~pixels).save(path)
    return path


@contextmanager
def serve(image: Path, *options: str) -> Iterator[str]:
    """Run the command on a free port, give the address that it prints, and end it by Ctrl-C."""
    with command("tools.board", "--image", image, "--port", 0, *options,
                 says=r"http://127\.0\.0\.1:\d+/\S+") as address:
        yield address


class Page(browsing.Page):
    """The page of a board, as a person reads and touches it."""

    @property
    def step(self) -> int:
        """The step of the four that is marked; 0 if none is."""
        return self.script("return Number(document.querySelector('.steps [aria-current]')"
                           "?.dataset.step ?? 0)")

    def duty(self, light: str) -> int:
        """Tell how bright an LED (``led7``) or segment (``3``) is: 0 to 255."""
        selector = f"#{light}" if light.startswith("led") else f"[data-segment='{light}']"
        return int(self.script(f"return document.querySelector(\"{selector}\").dataset.duty ?? 0"))

    def is_on(self, switch: int) -> bool:
        """Tell whether a switch is on."""
        return self.find(f"sw{switch}").get_attribute("aria-checked") == "true"

    def set_switches(self, value: int) -> None:
        """Put the switches so, by clicks."""
        for bit in range(8):
            if self.is_on(bit) != bool(value >> bit & 1):
                self.find(f"sw{bit}").click()

    def motor(self, axis: str) -> dict[str, str]:
        """Give what a motor's drawing says: position, word, angle."""
        return self.script(f"return {{...document.getElementById('motor-{axis}').dataset}}")

    def position(self, axis: str) -> int:
        """Give the position of an axis in steps."""
        return int(self.motor(axis).get("position", 0))

    def cut(self) -> int:
        """Give the number of pixels cut."""
        return int(self.find("table").get_attribute("data-cut") or 0)

    def fresh(self) -> None:
        """Make the machine as it was when it was switched on, all switches off, time running."""
        self.script("scrollTo(0, 0)")  # nothing is below the bar that stays in view
        if self.find("run").text == "Run":
            self.find("run").click()
        self.set_switches(0)
        self.until(lambda: not self.duty("led5"), "the end of a job")  # there is no question then
        # Not with the mouse: the picture of a new job may still be loading, and move the button.
        self.programmed(lambda: self.script("document.getElementById('power').click()"))
        self.until(lambda: self.cut() == 0 and self.step == 2
                   and all(self.position(axis) == 0 for axis in "xyz"), "a fresh machine")
        if self.find("run").text == "Run":
            self.find("run").click()
            self.until(lambda: self.find("run").text != "Run", "time going on")
        self.until(lambda: "Manual" in self.status, "manual mode")

    def programmed(self, work: Callable[[], object]) -> None:
        """Do what makes another machine, and wait until it is there."""
        def number() -> str | None:
            return self.find("job").get_attribute("data-number")

        before = number()
        work()
        self.until(lambda: number() != before, "another machine")

    def choose(self, path: Path) -> None:
        """Choose a picture in the dialog, and wait for the preview, which moves the buttons."""
        shown = """const image = document.getElementById("preview");
            return image.complete && image.naturalWidth > 50 ? image.src : "";"""
        before = self.script(shown)
        self.find("file").send_keys(str(path))
        self.until(lambda: self.script(shown) not in ("", before)
                   and self.find("program").is_enabled(), "a preview")

    def goes_on(self, frames: int) -> None:
        """Wait until the page has shown so many later times."""
        for _ in range(frames):
            at = self.find("clock").text
            self.until(lambda at=at: self.find("clock").text != at, "time going on")

    def pause(self) -> None:
        """Make time stand still, and wait for the last of what is shown: words overtake it."""
        self.find("run").click()
        self.until(lambda: self.find("run").text == "Run", "pause")
        shown = ""

        def stays() -> bool:
            nonlocal shown
            time.sleep(0.3)
            before, shown = shown, self.find("clock").text
            return before == shown

        self.until(stays, "rest")

    def mill(self) -> None:
        """Set SW7, press BTN1, and wait until the job is done."""
        self.set_switches(1 << 7)
        self.until(lambda: self.step == 3 and self.duty("led7") > 0, "ready")
        self.find("btn1").click()
        self.until(lambda: "Done" in self.status, "the end of the job")
        self.goes_on(2)  # words overtake what is shown


def seen(page, shape: tuple[int, int], name: str) -> np.ndarray:
    """Tell of which pixels of the plate a place beside the middle has this colour."""
    colour, colours = page.script("""
        const view = document.getElementById("table").dataset;
        const plate = document.querySelector("canvas[data-layer=plate]").getContext("2d");
        const at = (steps, edge) => Math.floor((steps - view[edge]) * view.scale);
        const places = arguments[0].map(([row, column]) =>
            plate.getImageData(at(128 * column + 32, "left"), at(128 * row + 16, "top"), 1, 1));
        const style = getComputedStyle(document.documentElement);
        return [style.getPropertyValue(arguments[1]).trim(),
                places.map(({data}) => [...data.slice(0, 3)])]""",
        [list(map(int, place)) for place in np.ndindex(shape)], name)
    wanted = tuple(bytes.fromhex(colour.removeprefix("#")))
    return np.array([tuple(found) == wanted for found in colours]).reshape(shape)


def shown(page) -> str:
    """Read the display, digit by digit; what is no digit is a question mark."""
    text = ""
    for place in (3, 2, 1, 0):
        lit = sum((page.duty(str(8 * place + n)) > 0) << n for n in range(8))
        text += f"{HEX_SEGMENTS.index(lit):X}" if lit in HEX_SEGMENTS else " ?"[lit > 0]
    return text


@contextmanager
def speed(page, wanted: str) -> Iterator[None]:
    """Slide to a speed, and in the end to as fast as it goes."""
    slider = page.find("speed")
    for _ in range(20):
        if page.find("speed-wanted").text == wanted:
            break
        slider.send_keys(LEFT)
    else:
        pytest.fail(f"there is no speed {wanted}")
    yield
    slider.send_keys(END)


def keys(page, *pressed: str, hold: float = 0.1) -> None:
    """Press keys one after the other, and let go of each."""
    from selenium.webdriver.common.action_chains import ActionChains

    chain = ActionChains(page.browser)
    for key in pressed:
        chain = chain.key_down(key).pause(hold).key_up(key)
    chain.perform()


def tab_to(page, identifier: str) -> None:
    """Go to an element by Tab alone."""
    if page.script("return document.activeElement.id") == identifier:
        keys(page, TAB, hold=0)  # by a click, which does not show it
    for _ in range(60):
        if page.script("return document.activeElement.id") == identifier:
            return
        keys(page, TAB, hold=0)
    pytest.fail(f"Tab does not lead to {identifier}")
