"""The page of the virtual board in a real browser: uploads, company, mishaps, sizes."""

import http.server
import io
import threading
from collections.abc import Iterator

import numpy as np
import pytest
from PIL import Image

from tests.tools.board.browser import PATIENCE, Page, resize, save
from tests.tools.browsing import PHONES, overlaps

pytestmark = pytest.mark.browser

SOCKETS = """\
window.sockets = [];
window.WebSocket = class extends WebSocket {
  constructor(...all) { super(...all); window.sockets.push(this); }
};
"""


class TestUpload:
    @pytest.fixture
    def dialog(self, fresh) -> Iterator[Page]:
        """Give the page with the dialog open, and put the figure back at the end."""
        fresh.find("choose").click()
        yield fresh
        if fresh.find("job-dialog").get_attribute("open"):
            fresh.find("cancel").click()

    def test_garbage_is_refused_and_nothing_is_lost(self, dialog, figure, tmp_path):
        page = dialog
        garbage = tmp_path / "garbage.png"
        garbage.write_bytes(np.random.default_rng(1).bytes(20_000))
        page.find("file").send_keys(str(garbage))
        page.until(lambda: page.find("job-error").text, "an error")
        assert "\n" not in page.find("job-error").text
        assert not page.find("program").is_enabled()
        page.find("cancel").click()
        page.mill()
        assert page.cut() == figure.sum()

    def test_nothing_to_mill_is_said_so(self, dialog, tmp_path):
        white = tmp_path / "white.png"
        Image.new("L", (20, 20), 255).save(white)
        dialog.find("file").send_keys(str(white))
        page = dialog
        page.script("const t = document.querySelector('[name=threshold]'); t.value = 10;"
                    "t.dispatchEvent(new Event('input', {bubbles: true}))")
        page.until(lambda: "nothing to mill" in page.find("job-error").text, "advice")

    def test_a_picture_becomes_the_job(self, dialog, figure, tmp_path):
        page = dialog
        cross = np.eye(5, dtype=bool) | np.eye(5, dtype=bool)[::-1]
        page.choose(save(cross, tmp_path / "a cross.png"))
        page.programmed(page.find("program").click)
        assert "5 × 5, 9 pixels" in page.find("job").text
        assert "a cross.png" in page.find("job").text
        page.mill()
        assert page.cut() == 9
        page.find("choose").click()
        page.choose(save(figure, tmp_path / "figure.png"))
        page.programmed(page.find("program").click)
        assert f"{figure.sum()} pixels" in page.find("job").text

    def test_a_name_is_text_and_nothing_else(self, dialog, figure, tmp_path):
        page = dialog
        name = "<img src=x onerror=document.title=1>.png"
        page.choose(save(figure, tmp_path / name))
        page.programmed(page.find("program").click)
        assert "<img" in page.find("job").text
        assert page.script("return document.querySelectorAll('#job *').length") == 0

    def test_what_is_shown_follows_the_options(self, dialog, tmp_path):
        page = dialog
        page.find("file").send_keys(str(save(np.ones((9, 9), bool), tmp_path / "full.png")))
        image = "return document.getElementById('preview').src"
        before = page.until(lambda: page.script(image))
        page.script("const s = document.querySelector('[name=figure]'); s.value = 'outline';"
                    "s.dispatchEvent(new Event('input', {bubbles: true}))")
        page.until(lambda: page.script(image) not in (before, ""), "another preview")


class TestCompany:
    def test_two_pages_show_the_same_and_the_last_one_may_leave(self, fresh, chromium, board):
        page = fresh
        other = Page(chromium(), board)
        other.find("sw0").click()
        page.until(lambda: page.is_on(0), "the other's switch")
        page.find("sw0").click()
        other.until(lambda: not other.is_on(0), "this one's switch")
        page.goes_on(3)  # what is shown may be of shortly before
        page.until(lambda: page.position("x") == other.position("x") > 0, "one position")
        place = page.position("x")
        other.browser.get("about:blank")
        page.browser.get("about:blank")
        again = Page(page.browser, board)
        again.until(lambda: again.position("x") == place, "the machine as it was left")

    def test_a_foreign_page_gets_nothing(self, page, board, figure):
        other = io.BytesIO()
        Image.new("L", (3, 3)).save(other, "PNG")
        number = page.until(lambda: page.find("job").get_attribute("data-number"), "a job")
        job = page.find("job").text
        server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Blank)
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        browser = page.browser
        try:
            browser.get(f"http://127.0.0.1:{server.server_port}/")
            browser.set_script_timeout(PATIENCE)
            result = browser.execute_async_script("""
                const done = arguments[arguments.length - 1];
                const socket = new WebSocket(arguments[0].replace("http", "ws") + "ws");
                socket.onopen = () => done("open");
                socket.onerror = () => done("refused");""", board)
            browser.execute_async_script("""
                const done = arguments[arguments.length - 1];
                fetch(arguments[0] + "job", {method: "POST", mode: "no-cors",
                  body: new Uint8Array(arguments[1])}).then(() => done(), () => done());""",
                board, list(other.getvalue()))
        finally:
            server.shutdown()
            thread.join()
            server.server_close()
            page = Page(browser, board)
        assert result == "refused"
        # A page is not told what became of what it posts elsewhere: it has become nothing. What is
        # posted by the page of the board itself comes after it, and is the next job.
        page.until(lambda: page.find("job").get_attribute("data-number"), "a job")
        assert page.find("job").text == job
        assert page.find("job").get_attribute("data-number") == number
        page.browser.execute_async_script("""
            const done = arguments[arguments.length - 1];
            fetch("job?name=figure.png", {method: "POST", body: new Uint8Array(arguments[0])})
              .then(() => done(), () => done());""", list(png(figure)))
        page.until(lambda: page.find("job").get_attribute("data-number") != number, "the next job")
        assert page.find("job").get_attribute("data-number") == str(int(number) + 1)
        assert f"{figure.sum()} pixels" in page.find("job").text


def png(pixels: np.ndarray) -> bytes:
    """Give pixels as the bytes of a picture."""
    data = io.BytesIO()
    Image.fromarray(~pixels).save(data, "PNG")
    return data.getvalue()


class Blank(http.server.BaseHTTPRequestHandler):
    """A page of somebody else."""

    def do_GET(self) -> None:
        """Answer with an empty page."""
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()

    def log_message(self, format: str, *args: object) -> None:
        """Say nothing."""


class TestMishaps:
    def test_a_lost_connection_is_said_and_found_again(self, chromium, board, figure):
        browser = chromium()
        browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": SOCKETS})
        page = Page(browser, board)
        page.fresh()
        page.mill()
        page.script("""
            window.states = [];
            new MutationObserver(() => window.states.push(
                [document.body.dataset.connection, document.getElementById("connection").innerText])
            ).observe(document.body, {attributes: true, attributeFilter: ["data-connection"]});
            window.sockets.at(-1).close()""")
        page.until(lambda: [state[0] for state in page.script("return window.states")]
                   == ["lost", "open"], "loss and return")
        page.until(lambda: page.cut() == figure.sum() and "Done" in page.status, "all of it again")

    def test_what_makes_no_sense_leads_to_a_new_connection(self, chromium, board):
        browser = chromium()
        browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": SOCKETS})
        page = Page(browser, board)
        page.script("window.sockets[0].onmessage({data: new Uint8Array([9, 9]).buffer})")
        page.until(lambda: page.script("return window.sockets.length") == 2, "a new one")
        page.until(lambda: page.script(
            "return document.body.dataset.connection") == "open", "connection")

    def test_a_first_frame_before_size_and_picture_are_known(self, chromium, board):
        browser = chromium()
        browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": """
            window.ResizeObserver = class { observe() {} };
            Object.defineProperty(HTMLImageElement.prototype, "src", { set() {} });"""})
        Page(browser, board).goes_on(3)

    def test_a_drawing_that_fails_once(self, chromium, board):
        page = Page(chromium(), board)
        page.goes_on(3)
        page.script("""
            const context = CanvasRenderingContext2D.prototype;
            const { stroke } = context;
            Object.defineProperty(context, "stroke", { configurable: true, get() {
              Object.defineProperty(context, "stroke", { value: stroke });
            } });""")
        page.goes_on(3)
        page.until(lambda: "has failed" in page.status, "the failure")

    def test_nothing_came_from_elsewhere_and_nothing_went_wrong(self, fresh, board):
        page = fresh
        page.browser.get_log("browser")
        page.browser.refresh()
        page.until(lambda: page.step == 2, "the page")
        names = page.script("return performance.getEntriesByType('resource').map(e => e.name)")
        assert len(names) > 10
        assert all(name.startswith((board, "blob:")) for name in names)
        assert page.browser.get_log("browser") == []


class TestSizes:
    @pytest.mark.parametrize("width", [320, 360, 768, 1024, 1920])
    def test_no_sideways_scrolling(self, fresh, width):
        resize(fresh.browser, width, 740)
        try:
            fresh.until(lambda: fresh.script(
                "return document.documentElement.scrollWidth <= innerWidth"), f"fit at {width}")
        finally:
            resize(fresh.browser, 1280, 800)

    @pytest.mark.parametrize(("width", "height"), [*PHONES, (1024, 768)])
    def test_nothing_covers_anything(self, fresh, width, height):
        resize(fresh.browser, width, height)
        try:
            assert overlaps(fresh) == []
            assert fresh.script("return document.documentElement.scrollWidth") <= width
        finally:
            resize(fresh.browser, 1280, 800)

    def test_stop_stays_in_view_and_stops(self, fresh):
        resize(fresh.browser, 240, 320)
        try:
            # The page is laid out anew for a while after it was resized.
            fresh.until(lambda: fresh.script("""
                scrollTo(0, document.documentElement.scrollHeight);
                const { top, bottom } = document.getElementById("stop").getBoundingClientRect();
                return scrollY > 500 && top >= 0 && bottom <= innerHeight"""), "it in view")
            fresh.find("stop").click()
            fresh.until(lambda: "Stopped by BTN3" in fresh.status, "the stop")
        finally:
            resize(fresh.browser, 1280, 800)

    def test_on_a_phone_fingers_hit(self, fresh):
        resize(fresh.browser, 360, 740)
        try:
            fresh.until(lambda: fresh.script(
                "return document.querySelector('#board svg').viewBox.baseVal.width") < 400)
            # A waveform has been recorded, so that all that there is shows.
            fresh.find("record").click()
            fresh.until(lambda: fresh.script(
                "return document.querySelectorAll('#signals label').length"), "signals")
            assert fresh.script(SMALL, "body") == []
            fresh.find("choose").click()
            assert fresh.script(SMALL, "dialog") == []
            fresh.find("cancel").click()
        finally:
            resize(fresh.browser, 1280, 800)

    def test_the_board_keeps_its_state_when_it_is_drawn_anew(self, fresh):
        page = fresh
        page.set_switches(1 << 7 | 1)
        page.until(lambda: page.duty("led7"), "ready")
        for width in (360, 1280):
            resize(page.browser, width, 740)
            page.until(lambda: page.is_on(7) and page.is_on(0) and page.duty("led7"), "the same")
            assert [page.is_on(bit) for bit in range(1, 7)] == [False] * 6


#: All that can be touched but is smaller than 40 pixels. A box to check is as large as its label.
SMALL = """\
return [...document.querySelector(arguments[0]).querySelectorAll(
    "button, a, select, input, [role=switch], [role=button]")]
  .map(e => [e, (e.type === "checkbox" ? e.closest("label") : e).getBoundingClientRect()])
  .filter(([, r]) => r.width && Math.min(r.width, r.height) < 39.99)
  .map(([e, r]) => `${e.id || e.name || e.outerHTML} ${r.width} x ${r.height}`)
"""


def test_from_a_click_to_the_leds(fresh):
    """Measure how long SW7 takes to light LD7, ten times; print it, and bound it generously."""
    page = fresh
    page.browser.set_script_timeout(PATIENCE)
    lags = sorted(page.browser.execute_async_script(LAG, 10))
    print(f"click to LED: median {lags[len(lags) // 2]:.0f} ms, most {lags[-1]:.0f} ms")
    assert lags[len(lags) // 2] < 1000


LAG = """\
const done = arguments[arguments.length - 1];
const led = document.getElementById("led7");
const lags = [];
let begun = 0;
let lit = led.dataset.duty > 0;
const click = () => {
  begun = performance.now();
  document.getElementById("sw7").dispatchEvent(new MouseEvent("click", {bubbles: true}));
};
new MutationObserver(() => {
  const now = led.dataset.duty > 0;
  if (now === lit || !begun) return;
  lit = now;
  lags.push(performance.now() - begun);
  begun = 0;
  if (lags.length === arguments[0]) done(lags);
  else setTimeout(click, 120 + 17 * lags.length);
}).observe(led, {attributes: true, attributeFilter: ["data-duty"]});
click();
"""
