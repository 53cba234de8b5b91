"""A real browser."""

import shutil

import pytest

from tb.engines import ENGINES
from tests.tools.browsing import resize


@pytest.fixture(scope="module")
def chromium():
    """Give a function that opens a browser; all are closed in the end."""
    webdriver = pytest.importorskip(
        "selenium.webdriver", reason="selenium missing: pip install -e '.[browser]'")
    if reason := ENGINES["cxxrtl"].missing():
        pytest.skip(reason)  # on the slow engine a job takes minutes
    binary = shutil.which("chromium") or shutil.which("google-chrome")
    driver = shutil.which("chromedriver")
    if not (binary and driver):
        pytest.skip("Chromium or its driver missing: apt install chromium chromium-driver")
    opened = []

    def start(width: int = 1280, height: int = 800):
        options = webdriver.ChromeOptions()
        options.binary_location = binary
        for argument in ("--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"):
            options.add_argument(argument)
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        service = webdriver.ChromeService(executable_path=driver)
        opened.append(browser := webdriver.Chrome(options=options, service=service))
        resize(browser, width, height)
        return browser

    yield start
    for browser in opened:
        browser.quit()
