"""What tests of pages in a real browser share."""

from collections.abc import Callable

import pytest

from tests.tools.process import PATIENCE

__all__ = ["PHONES", "Page", "live", "overlaps", "resize"]

#: Sizes of small screens: upright, on their side, and the least that a page must fit.
PHONES = [(390, 844), (844, 390), (568, 320), (240, 320)]


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


def overlaps(page: "Page") -> list[str]:
    """Give pairs of texts and controls that cover each other, but for what stays in view."""
    return page.script("""
        const shown = [];
        const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
        while (texts.nextNode()) {
          const { currentNode: node } = texts;
          if (node.parentElement.closest("#bar, svg, option")) continue;
          const range = document.createRange();
          range.selectNodeContents(node);
          for (const box of range.getClientRects()) {
            if (node.data.trim()) shown.push([node.parentElement, box, node.data.trim()]);
          }
        }
        for (const part of document.querySelectorAll(
          "button, .button, input, select, svg, progress, [role=img]")) {
          if (part.closest("#bar") || part.parentElement.closest("svg")) continue;
          shown.push([part, part.getBoundingClientRect(), part.id || part.tagName]);
        }
        const cover = (a, b) => Math.min(a.right, b.right) - Math.max(a.left, b.left) > 2
          && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 2;
        return shown.flatMap(([first, a, name], n) => shown.slice(n + 1)
          .filter(([second, b]) => !first.contains(second) && !second.contains(first)
                                   && cover(a, b))
          .map(([, , other]) => `${name} | ${other}`));""")


def live(page: "Page", seconds: float) -> list[str]:
    """Give what screen readers would announce within a time: changes of live regions."""
    return page.browser.execute_async_script("""
        const [seconds, done] = arguments;
        const live = "output, [aria-live]:not([aria-live=off]), [role=status], [role=alert], "
          + "[role=log], [role=timer]";
        const heard = [];
        new MutationObserver((changes) => {
          for (const { target } of changes) {
            const element = target.nodeType === Node.TEXT_NODE ? target.parentElement : target;
            const region = element?.closest(live);
            if (region) heard.push(region.textContent);
          }
        }).observe(document.body, { subtree: true, childList: true, characterData: true });
        setTimeout(() => done(heard), 1000 * seconds);""", seconds)


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
