"""The panel in a real browser, with the gateware of its machine behind it."""

import os
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fresa_host import Place
from tests.tools import browsing
from tests.tools.browsing import PHONES, live, overlaps, resize
from tests.tools.process import ROOT, command
from tools.panel.settings import load

pytestmark = pytest.mark.browser
PANEL = "tests.tools.panel.patient"
ADDRESS = r"http://127\.0\.0\.1:\d+/\S+"
WIDTH, HEIGHT = 1180, 800


class Page(browsing.Page):
    """The page of the panel, as a person reads and touches it."""

    def place(self, axis: str) -> float:
        """Give where an axis is, in um."""
        return float(self.find(f"place-{axis}").text.replace("\u2212", "-"))

    def connect(self) -> None:
        self.until(self.find("connect").is_enabled, "a port")
        if self.find("connect").text == "Connect":
            self.find("connect").click()
            self.until(lambda: self.find("connect").text == "Disconnect", "the connection")

    def origin(self) -> None:
        """Make the place the origin, and answer the question."""
        self.until(self.find("origin").is_enabled, "rest")
        self.find("origin").click()
        self.browser.find_element("css selector", ".ask [value=yes]").click()

    def rest(self) -> tuple[float, ...]:
        """Wait until four reports have said the same, and give the place."""
        def reports() -> int:
            return int(self.find("axes").get_attribute("data-reports"))

        place, since = None, 0

        def same() -> bool:
            nonlocal place, since
            if place != (now := tuple(self.place(axis) for axis in "xyz")):
                place, since = now, reports()
            return reports() >= since + 4

        self.until(same, "rest")
        return place or ()

    def hold(self, *keys: str):
        """Press keys; they stay down until `keys_up`."""
        from selenium.webdriver.common.action_chains import ActionChains

        chain = ActionChains(self.browser)
        for key in keys:
            chain = chain.key_down(key)
        chain.perform()

    def keys_up(self, *keys: str) -> None:
        from selenium.webdriver.common.action_chains import ActionChains

        chain = ActionChains(self.browser)
        for key in keys:
            chain = chain.key_up(key)
        chain.perform()

    def fill(self, number: int, *place: str) -> None:
        """Write a point into its fields."""
        for axis, text in zip("xyz", place, strict=True):
            field = self.find(f"point-{number}-{axis}")
            field.clear()
            field.send_keys(text)
        self.script("document.activeElement.blur()")

    def slide(self, axis: str, speed: int) -> None:
        self.script("""
            const slider = document.getElementById(arguments[0]);
            slider.value = arguments[1];
            slider.dispatchEvent(new Event("input", {bubbles: true}));""", f"speed-{axis}", speed)


@pytest.fixture(scope="module")
def home(libraries, tmp_path_factory) -> Iterator[Path]:
    """Give a folder of its own for what is kept."""
    with pytest.MonkeyPatch.context() as patch:
        home = tmp_path_factory.mktemp("home")
        patch.setenv("XDG_CONFIG_HOME", str(home))
        yield home


@pytest.fixture(scope="module")
def panel(home, chromium) -> Iterator[Page]:
    """Give the page of a panel, open in a browser."""
    with command(PANEL, "--simulate", says=ADDRESS) as address:
        yield Page(chromium(WIDTH, HEIGHT), address)


@pytest.fixture
def page(panel) -> Page:
    """Give the page, connected, at the origin, quick."""
    panel.browser.refresh()
    panel.until(lambda: panel.script("return document.body.dataset.connection") == "open")
    panel.connect()
    for axis in "xyz":
        panel.slide(axis, 26)
    panel.rest()
    panel.origin()
    panel.until(lambda: panel.rest() == (0, 0, 0), "the origin")
    panel.script("document.activeElement.blur()")
    return panel


class TestMoving:
    def test_two_keys_make_a_diagonal_and_letting_go_stops(self, page):
        page.hold("w", "d")
        page.until(lambda: page.place("x") > 5 and page.place("y") > 5, "a diagonal")
        assert page.find("jog-yp").get_attribute("aria-pressed") == "true"
        page.keys_up("w")
        page.until(lambda: page.find("jog-yp").get_attribute("aria-pressed") == "false")
        page.keys_up("d")
        x, y, z = page.rest()
        assert x > 5 and y > 5 and z == 0

    @pytest.mark.parametrize(("key", "axis", "sign"), [
        ("w", "y", 1), ("s", "y", -1), ("a", "x", -1), ("d", "x", 1), ("q", "z", -1),
        ("e", "z", 1)])
    def test_every_key_has_its_way(self, page, key, axis, sign):
        page.hold(key)
        page.until(lambda: sign * page.place(axis) > 1, "a move")
        page.keys_up(key)
        place = page.rest()
        assert [bool(um) for um in place] == [name == axis for name in "xyz"]

    def test_opposite_keys_stand_still(self, page):
        page.hold("a", "d")  # one after the other
        page.until(lambda: page.rest() == page.rest(), "rest with both keys down")
        page.keys_up("a")
        page.until(lambda: page.place("x") > 1, "a move to where the other key leads")
        page.keys_up("d")
        page.rest()

    def test_a_button_moves_while_the_mouse_is_down(self, page):
        from selenium.webdriver.common.action_chains import ActionChains

        ActionChains(page.browser).click_and_hold(page.find("jog-zm")).perform()
        page.until(lambda: page.place("z") < -1, "a move")
        ActionChains(page.browser).release().perform()
        assert page.rest()[:2] == (0, 0)

    @pytest.mark.parametrize("leave", [
        "dispatchEvent(new Event('blur'))",
        "document.dispatchEvent(new KeyboardEvent('keydown', {key: 'Escape', bubbles: true}))"])
    def test_leaving_the_window_and_escape_let_go(self, page, leave):
        page.hold("d")
        page.until(lambda: page.place("x") > 1, "a move")
        page.script(leave)
        page.rest()
        page.keys_up("d")

    def test_closing_the_page_lets_go(self, page):
        page.hold("d")
        page.until(lambda: page.place("x") > 1, "a move")
        page.browser.refresh()  # the key is still down, and the new page has not seen it go down
        page.until(lambda: page.find("place-x").text, "the place")
        page.rest()
        page.keys_up("d")

    def test_a_fast_axis_is_faster(self, page):
        page.slide("x", 4)
        page.hold("w", "d")
        page.until(lambda: page.place("y") > 10, "a move")
        page.keys_up("w", "d")
        x, y, _ = page.rest()
        assert 4 < y / x < 9  # 26 to 4; the two are neither begun nor ended at once

    def test_keys_do_nothing_where_numbers_are_typed_and_when_turned_off(self, page):
        page.find("point-1-x").click()
        page.hold("d")
        page.keys_up("d")
        page.script("document.activeElement.blur()")
        page.find("keys").click()
        page.hold("d")
        page.keys_up("d")
        page.find("keys").click()
        assert page.rest() == (0, 0, 0)


class TestPoints:
    def test_a_point_is_edited_stored_and_gone_to(self, page):
        page.fill(1, "12.5", "-8", "3")
        page.until(page.find("go-1").is_enabled, "a whole point")
        page.find("go-1").click()
        page.until(lambda: page.status == "Idle. At point 1.", "the arrival")
        assert [page.place(axis) for axis in "xyz"] == pytest.approx([12.5, -8, 3], abs=0.01)
        page.find("here-2").click()
        page.until(lambda: page.find("point-2-y").get_attribute("value") == "-8", "this place")

    def test_a_point_with_an_empty_field_cannot_be_gone_to(self, page):
        page.fill(3, "1", "", "1")
        page.until(lambda: page.find("point-3-x").get_attribute("value") == "1")
        assert not page.find("go-3").is_enabled()

    def test_stop_ends_it(self, page):
        page.fill(4, "5000", "0", "0")
        page.until(page.find("go-4").is_enabled)
        page.find("go-4").click()
        page.until(lambda: page.place("x") > 1, "a move")
        page.find("stop").click()
        page.until(lambda: page.status.startswith("Stopped."), "the stop")
        assert page.rest()[0] < 4000
        assert "point" not in page.status

    def test_a_jog_ends_the_way_to_a_point(self, page):
        page.fill(4, "5000", "5000", "0")
        page.until(page.find("go-4").is_enabled)
        page.find("go-4").click()
        page.until(lambda: page.place("x") > 1 and page.place("y") > 1, "a move")
        page.script("document.activeElement.blur()")
        page.hold("e")
        page.until(lambda: page.status.startswith("Jogging.") and page.place("z") > 1, "a jog")
        before = page.place("x"), page.place("y")
        page.until(lambda: page.place("z") > 10, "a longer jog")
        assert (page.place("x"), page.place("y")) == pytest.approx(before, abs=1)
        page.keys_up("e")
        page.until(lambda: page.status.startswith(("Idle.", "Stopped.")), "the end")

    def test_a_point_is_replaced_only_if_that_is_wanted(self, page):
        page.fill(5, "7", "8", "9")
        page.until(lambda: page.find("point-5-z").get_attribute("value") == "9")
        for answer, there in [("[value='']", "7"), ("[value=yes]", "0")]:
            page.find("here-5").click()
            assert "(7, 8, 9)" in page.browser.find_element("css selector", ".ask").text
            page.browser.find_element("css selector", f".ask {answer}").click()
            page.until(lambda there=there: page.find("point-5-x").get_attribute("value") == there)


class TestTwoPages:
    def test_the_second_takes_over_and_both_say_so(self, page, chromium):
        other = Page(chromium(WIDTH, HEIGHT), page.address)
        page.hold("d")
        page.until(lambda: page.status.startswith("Jogging.") and page.place("x") > 1, "a jog")
        other.until(lambda: "By another page" in other.status, "whose jog it is")
        other.hold("w")
        page.until(lambda: "Another page has taken over" in page.status, "the end of the control")
        page.until(lambda: page.find("jog-xp").get_attribute("aria-pressed") == "false", "release")
        other.until(lambda: other.place("y") > 3, "a jog of the other")
        assert other.status == "Jogging."
        before = page.place("x")
        page.until(lambda: page.place("y") > 8, "a longer jog of the other")
        assert page.place("x") == pytest.approx(before, abs=1.5)
        page.find("stop").click()  # of either
        other.until(lambda: other.status.startswith("Stopped."), "the stop")
        page.keys_up("d")
        other.keys_up("w")


def test_the_origin_is_asked_about(page):
    page.hold("d")
    page.until(lambda: page.place("x") > 2, "a move")
    assert not page.find("origin").is_enabled()
    page.keys_up("d")
    place = page.rest()
    page.until(page.find("origin").is_enabled)
    page.find("origin").click()
    assert f"X {place[0]:.2f}" in page.browser.find_element("css selector", ".ask").text
    page.browser.find_element("css selector", ".ask [value='']").click()
    assert page.rest() == place


def test_limit_switches_are_pressed_on_the_page(page):
    switch = page.find("limit-X+")
    switch.click()
    page.until(lambda: switch.get_attribute("aria-pressed") == "true", "a pressed switch")
    page.hold("d")
    page.until(lambda: "A limit switch stopped X" in page.status, "the stop")
    page.keys_up("d")
    assert page.rest() == (0, 0, 0)
    page.hold("a")  # the way back is free
    page.until(lambda: page.place("x") < -1, "the way back")
    page.keys_up("a")
    switch.click()
    page.until(lambda: switch.get_attribute("aria-pressed") == "false", "a released switch")


def test_everything_is_kept(libraries, tmp_path, monkeypatch, chromium):
    """End the panel and begin it again: it is as it was, though the machine was off."""
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    browser = chromium(WIDTH, HEIGHT)
    with command(PANEL, "--simulate", says=ADDRESS) as address:
        page = Page(browser, address)
        page.connect()
        page.slide("z", 17)
        page.fill(7, "1", "2", "3.25")
        page.hold("d")
        page.until(lambda: page.place("x") > 3, "a move")
        page.keys_up("d")
        seen = page.rest()
        page.until(page.find("stop").is_enabled, "a way to stop")
    page.until(lambda: "Stop with it" in page.status, "the lost connection")
    assert not page.find("stop").is_enabled()
    # What moved while the panel ended is kept too.
    steps = load(tmp_path / "fresa" / "panel-simulated.json").steps
    place = tuple(round(um, 2) for um in Place.of(steps))
    assert place == pytest.approx(seen, abs=2) and place[0] > 3
    with command(PANEL, "--simulate", says=ADDRESS) as address:
        page = Page(browser, address)
        page.until(lambda: page.find("point-7-z").get_attribute("value") == "3.25", "the point")
        assert tuple(page.place(axis) for axis in "xyz") == place
        assert page.find("speed-z").get_attribute("value") == "17"
        page.connect()
        page.until(lambda: "was reset" in page.status, "the restored position")
        assert page.rest() == place


def test_everything_has_a_name(page):
    assert page.script("""
        return [...document.querySelectorAll('button, input, select, output')]
          .filter(e => !(e.getAttribute('aria-label') || e.labels?.length || e.textContent.trim()))
          .map(e => e.outerHTML)""") == []


@pytest.mark.parametrize(("width", "height"), PHONES)
def test_nothing_covers_anything(page, width, height):
    resize(page.browser, width, height)
    try:
        assert overlaps(page) == []
        assert page.script("return document.documentElement.scrollWidth") <= width
        page.script("scrollTo(0, document.documentElement.scrollHeight)")
        assert page.script("""
            const { top, bottom } = document.getElementById("stop").getBoundingClientRect();
            return scrollY > 100 && top >= 0 && bottom <= innerHeight"""), "Stop is out of view"
    finally:
        page.script("scrollTo(0, 0)")
        resize(page.browser, WIDTH, HEIGHT)


def test_a_movement_is_not_announced_step_by_step(page):
    page.hold("d")
    page.until(lambda: page.place("x") > 1, "a move")
    before = page.place("x")
    assert live(page, 1) == []
    assert page.place("x") > before + 5
    page.keys_up("d")


def test_pictures(page, tmp_path):
    """Take the picture of the documentation; see the tests of the board for how to renew it."""
    folder = ROOT / os.environ["FRESA_PICTURES"] if "FRESA_PICTURES" in os.environ else tmp_path
    for number, place in enumerate([("0", "0", "0"), ("500", "0", "0"), ("500", "250", ""),
                                    ("12.5", "-8", "0")], start=1):
        page.fill(number, *place)
    page.hold("w", "d")
    page.until(lambda: page.place("x") > 4 and page.place("y") > 4, "a diagonal")
    for scheme, width, height, name in [("light", WIDTH, HEIGHT, "panel.png"),
                                        ("dark", 360, 740, "panel-phone.png")]:
        resize(page.browser, width, height, scheme=scheme)
        assert page.browser.save_screenshot(str(folder / name))
        with Image.open(folder / name) as image:
            pixels = np.asarray(image.convert("RGB")).astype(int)
        assert pixels.shape == (height, width, 3)
        corner = pixels[-1, 0].mean()
        assert corner < 60 if scheme == "dark" else corner > 200
        accent = (76, 194, 171) if scheme == "dark" else (10, 106, 91)
        assert (np.abs(pixels - accent).max(axis=2) < 6).mean() > 0.005, "no button is held"
    resize(page.browser, WIDTH, HEIGHT)
    page.keys_up("w", "d")
