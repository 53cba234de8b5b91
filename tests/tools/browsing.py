"""What tests of pages in a real browser share."""

from collections.abc import Callable

import pytest

from tests.tools.process import PATIENCE

__all__ = ["Page", "resize"]


def resize(browser, width: int, height: int, *, scheme: str = "light", touch: bool = False) -> None:
    """Make the page so wide and high, in whole pixels, and light or dark."""
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", {
        "width": width, "height": height, "deviceScaleFactor": 1, "mobile": touch})
    browser.execute_cdp_cmd("Emulation.setTouchEmulationEnabled", {"enabled": touch})
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {
        "features": [{"name": "prefers-color-scheme", "value": scheme}]})
    # A page may draw itself anew when it sees its new size, with the next picture.
    browser.execute_async_script("const done = arguments[0];"
                                 "requestAnimationFrame(() => requestAnimationFrame(done))")


class Page:
    """A page, as a person reads and touches it."""

    def __init__(self, browser, address: str) -> None:
        self.browser = browser
        self.address = address
        browser.get(address)
        self.until(lambda: self.script("return document.body.dataset.connection") == "open")

    def find(self, identifier: str):
        """Give the element with this id."""
        return self.browser.find_element("id", identifier)

    def script(self, text: str, *arguments: object):
        """Run JavaScript; give what it returns."""
        return self.browser.execute_script(text, *arguments)

    def until(self, holds: Callable[[], object], what: str = "") -> object:
        """Wait until something holds, and give it; fail with what the page says if it never does.

        An element that is being replaced counts as not there yet.
        """
        from selenium.common.exceptions import TimeoutException
        from selenium.webdriver.support.wait import WebDriverWait

        try:
            return WebDriverWait(self.browser, PATIENCE, 0.03).until(lambda _: holds())
        except TimeoutException:
            pytest.fail(f"{what or 'it'} did not happen; the page says {self.status!r}")

    @property
    def status(self) -> str:
        """What the page says is to be known."""
        return self.find("status").text
