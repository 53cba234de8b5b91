"""The page of the virtual board in a real browser: what a person mills with it."""

import io
import json
import re
import urllib.error
import urllib.request

import numpy as np
import pytest
from PIL import Image

from tb.plant import STEP, WORDS
from tests.tools.board.browser import keys, seen, shown, speed
from tools.picture import CUT, FRAME
from tools.wave.draw import MOST_ROWS

pytestmark = pytest.mark.browser


def canvas(page, layer: str = "plate") -> np.ndarray:
    """Give what is drawn on a layer of the table, in colours."""
    size, data = page.script(
        "const c = document.querySelector(`canvas[data-layer=${arguments[0]}]`);"
        "const d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;"
        "return [c.width, Array.from(d)]", layer)
    return np.array(data, np.uint8).reshape(size, size, 4)


def get(address: str) -> bytes:
    with urllib.request.urlopen(address, timeout=10) as answer:
        return answer.read()


def panes(picture: np.ndarray) -> list[np.ndarray]:
    """Give what is inside the frames of a picture of a cut."""
    framed = (picture == FRAME).all(axis=2)
    longest = framed.sum(axis=1) > 100
    top, bottom = np.flatnonzero(longest)[[0, -1]]
    sides = np.flatnonzero(framed[top:bottom + 1].all(axis=0))
    assert len(sides) == 4
    return [picture[top + 1:bottom, left + 1:right] for left, right in (sides[:2], sides[2:])]


def squares(pane: np.ndarray, shape: tuple[int, int]) -> np.ndarray:
    """Tell which pixels are cut, by a place in each where no way leads, straight or diagonal."""
    side = pane.shape[0] // shape[0]
    assert pane.shape[:2] == (side * shape[0], side * shape[1])
    return (pane[side // 8::side, side // 3::side] == CUT).all(axis=2)


class TestMilling:
    def test_the_cut_is_what_was_asked(self, fresh, figure):
        page = fresh
        assert "Manual" in page.status
        assert (seen(page, figure.shape, "--target") == figure).all()
        assert not seen(page, figure.shape, "--cut").any()
        page.set_switches(1 << 7)
        page.until(lambda: page.step == 3 and page.duty("led7"), "ready")
        assert "Press BTN1" in page.status
        with speed(page, "3 k clocks/s"):  # else the whole job may pass between two looks
            page.find("btn1").click()
            page.until(lambda: page.duty("led5") > 0, "LD5, work")
        page.until(lambda: "Done" in page.status, "the end of the job")
        page.goes_on(2)  # words overtake what is shown
        assert page.duty("led7") > 0 and not page.duty("led5")
        assert page.cut() == figure.sum()
        assert (seen(page, figure.shape, "--cut") == figure).all()
        assert [page.position(axis) for axis in "xyz"] == [0, 0, 0]
        assert f"{figure.sum()} of {figure.sum()}" in page.find("cut-count").text
        # Two figures apart: between them the tool went through the air.
        assert canvas(page, "way")[..., 3].any()

    def test_the_cut_can_be_had_as_a_picture(self, fresh, figure):
        fresh.mill()
        picture = Image.open(io.BytesIO(get(fresh.find("cut-link").get_attribute("href"))))
        assert picture.format == "PNG"
        # Two panes: asked, and milled; in each, a pixel of the job is a square of the same side.
        wanted, milled = panes(np.asarray(picture.convert("RGB")))
        for pane in (wanted, milled):
            assert (squares(pane, figure.shape) == figure).all()

    def test_drawn_anew_it_is_the_same(self, fresh, figure):
        page = fresh
        page.mill()
        before = canvas(page), canvas(page, "way")
        assert (before[0] != canvas(page, "tool")).any()
        page.browser.refresh()
        page.until(lambda: page.cut() == figure.sum() and (
            seen(page, figure.shape, "--cut") == figure).all(), "the cut, after a reload")
        after = canvas(page), canvas(page, "way")
        assert (before[0] == after[0]).all()
        # Lines over lines differ by a shade where they were drawn in several goes.
        assert ((before[1][..., 3] > 0) == (after[1][..., 3] > 0)).mean() > 0.999

    def test_another_job_begins_on_a_new_plate(self, fresh, figure):
        page = fresh
        page.mill()
        with speed(page, "3 k clocks/s"):
            page.find("btn1").click()
            page.until(lambda: page.duty("led5") and page.cut() == 0, "a new plate")
            page.pause()
            # On a slow computer some pixels have been cut meanwhile.
            cut = seen(page, figure.shape, "--cut")
            assert cut.sum() == page.cut() < figure.sum()
            assert (seen(page, figure.shape, "--target") | cut == figure).all()
            page.find("run").click()

    def test_a_change_of_mode_in_the_middle_of_a_job(self, fresh, figure):
        page = fresh
        page.set_switches(1 << 7)
        page.until(lambda: page.duty("led7"), "ready")
        with speed(page, "3 k clocks/s"):
            page.find("btn1").click()
            page.until(lambda: page.cut() > 0, "a part of the job")
            page.find("sw7").click()
            page.until(lambda: not page.duty("led5") and page.step == 2, "the end of the work")
        cut, deep = page.cut(), page.position("z")
        assert 0 < cut < figure.sum()
        # The tool is still in the plate. By hand it comes out again.
        page.find("sw4").click()
        page.until(lambda: page.position("z") < deep, "the way up")
        assert page.cut() == cut

    def test_stop_holds_until_reset(self, fresh):
        page = fresh
        page.set_switches(1 << 7)
        page.until(lambda: page.duty("led7"), "ready")
        with speed(page, "3 k clocks/s"):
            page.find("btn1").click()
            page.until(lambda: page.position("z") > 0, "a movement")
            page.find("btn3").click()
            page.until(lambda: "Stopped" in page.status, "stop")
        # What is told is here at once; the picture of the machine may be of shortly before.
        page.goes_on(2)
        assert 0 < page.position("z") < 1152
        before = [page.position(axis) for axis in "xyz"]
        page.goes_on(1)
        assert [page.position(axis) for axis in "xyz"] == before
        # A page that comes later knows it too, and so does manual mode.
        page.browser.refresh()
        page.until(lambda: "Stopped" in page.status, "the same after a reload")
        page.find("sw7").click()
        page.until(lambda: not page.is_on(7) and "Stopped" in page.status, "the same by hand")
        page.find("sw7").click()
        page.find("btn0").click()
        page.until(lambda: "position is unknown" in page.status and page.duty("led7"), "reset")
        assert page.position("z") == before[2]


class TestDisplay:
    def test_dark_in_manual_mode(self, fresh):
        fresh.until(lambda: shown(fresh) == "    ", "darkness")

    def test_it_shows_the_count_that_the_switches_choose(self, fresh):
        page = fresh
        page.set_switches(1 << 7 | 1)
        page.until(lambda: shown(page) == "0000" and page.duty("led7"), "four digits")
        with speed(page, "3 k clocks/s"):
            page.find("btn1").click()
            page.until(lambda: page.cut() > 0, "the first pixel")
            page.find("btn3").click()
            page.until(lambda: "Stopped" in page.status, "stop")
        for count, axis in ((1, "x"), (2, "y")):
            page.set_switches(1 << 7 | count)
            place = page.position(axis)
            assert place > 0
            page.until(lambda place=place: shown(page) == f"{place:04X}", f"the count of {axis}")

    def test_as_bright_as_scanned(self, fresh):
        page = fresh
        page.set_switches(1 << 7)
        # 0: all but the middle segment and the point, for the whole turn of a digit.
        page.until(lambda: min(page.duty(str(8 * place + n))
                               for place in range(4) for n in range(6)) > 230, "full brightness")
        assert not any(page.duty(str(8 * place + n)) for place in range(4) for n in (6, 7))

    def test_half_the_time_lit_is_bright_as_eyes_see_it(self, fresh):
        page = fresh
        page.find("sw0").click()
        # Each coil is on for two of four steps.
        page.until(lambda: 100 < page.duty("led0") < 155, "half the light")
        opacity, duty = map(float, page.script(
            "const led = document.getElementById('led0');"
            "return [led.style.opacity, led.dataset.duty]"))
        assert opacity == pytest.approx((duty / 255) ** (1 / 2.2), abs=1e-3)
        assert opacity > 0.6

    def test_in_slow_motion_one_digit_at_a_time(self, fresh):
        page = fresh
        page.set_switches(1 << 7)
        page.until(lambda: shown(page) == "0000", "four digits")
        with speed(page, "300 clocks/s"):
            page.until(lambda: len(shown(page).replace(" ", "")) == 1, "one digit")


class TestByHand:
    @pytest.mark.parametrize(("switch", "axis", "sign"), [
        (0, "x", 1), (1, "x", -1), (2, "y", 1), (3, "y", -1), (4, "z", -1), (5, "z", 1)])
    def test_a_switch_moves_an_axis_while_it_is_on(self, fresh, switch, axis, sign):
        page = fresh
        with speed(page, "1 M clocks/s"):
            page.find(f"sw{switch}").click()
            page.until(lambda: sign * page.position(axis) > 20, "movement")
            page.find(f"sw{switch}").click()
        page.until(lambda: page.script(
            "return new Promise(done => { const p = document.getElementById(arguments[0]).dataset;"
            "const was = p.position; setTimeout(() => done(p.position === was), 150) })",
            f"motor-{axis}"), "rest")
        assert [other for other in "xyz" if page.position(other)] == [axis]
        text = page.find(f"motor-{axis}").text.replace("\u2009", "")
        assert f"{page.position(axis)} steps" in text
        assert f"{page.position(axis) * STEP:.3f} mm" in text

    def test_coils_and_needle_agree_at_every_step(self, fresh):
        page = fresh
        page.pause()
        page.find("sw0").click()
        for steps in range(1, 6):
            page.find("one-step").click()
            page.until(lambda steps=steps: page.position("x") == steps, f"step {steps}")
            motor = page.motor("x")
            word = int(motor["word"], 2)
            assert word == WORDS[steps % 4]
            # Between the two coils that are on, a quarter further with each step.
            assert float(motor["angle"]) == 45 + 90 * steps
            lit = page.script("return [...document.querySelectorAll('#motor-x .coil')]"
                              ".map(coil => coil.classList.contains('on'))")
            assert lit == [bool(word >> bit & 1) for bit in range(4)]

    def test_leds_show_the_coils_of_x_at_rest(self, fresh):
        page = fresh
        page.until(lambda: [page.duty(f"led{n}") == 255 for n in range(4)]
                   == [bool(WORDS[0] >> n & 1) for n in range(4)], "the first word")

    def test_the_table_grows_with_the_tool(self, fresh):
        page = fresh
        before = float(page.find("table").get_attribute("data-side"))
        page.find("sw1").click()
        page.until(lambda: page.position("x") < -2000, "a long way")
        page.find("sw1").click()
        assert float(page.find("table").get_attribute("data-side")) > before
        assert float(page.find("table").get_attribute("data-top")) < -2000


class TestTime:
    def test_paused_nothing_goes_on_but_clock_by_clock(self, fresh):
        page = fresh
        page.pause()
        assert "press Run" in page.status
        before = clock(page)
        page.find("one-clock").click()
        page.until(lambda: clock(page) == before + 1, "one clock")

    def test_a_step_that_does_not_come_can_be_ended(self, fresh):
        page = fresh
        field = page.find("period")
        field.clear()
        page.programmed(lambda: field.send_keys(field.get_attribute("max"), "\n"))
        page.pause()
        with speed(page, "100 k clocks/s"):
            page.find("one-step").click()
            page.until(lambda: page.find("run").text == "Pause" and "under way" in page.status,
                       "work")
            page.find("run").click()
            page.until(lambda: page.find("run").text == "Run" and "press Run" in page.status,
                       "rest")
        at = clock(page)
        page.browser.refresh()
        page.until(lambda: page.step == 2 and clock(page) == at, "the same clock")
        field = page.find("period")
        field.clear()
        page.programmed(lambda: field.send_keys("10\n"))

    def test_slow_motion_is_slow_and_says_so(self, fresh):
        page = fresh
        with speed(page, "1 clock/s"):
            page.until(lambda: "50,000,000 times" in page.find("ratio").text, "the ratio")
        page.until(lambda: "50,000,000 times" not in page.find("ratio").text, "full speed")
        assert page.find("speed-wanted").text == "no limit"

    def test_another_step_rate(self, fresh):
        page = fresh
        field = page.find("period")
        for period, rate in (("1000", "50 k steps/s"), ("10", "5 M steps/s")):
            field.clear()
            page.programmed(lambda period=period: field.send_keys(period, "\n"))
            assert rate in page.find("period-note").text


class TestProgress:
    def test_share_and_times_are_shown(self, fresh, figure):
        page = fresh
        meter = page.find("meter")
        page.set_switches(1 << 7)
        page.until(lambda: page.step == 3 and page.duty("led7") > 0, "ready")
        with speed(page, "3 k clocks/s"):
            page.find("btn1").click()
            page.until(lambda: page.cut() > 0, "the first pixel")
            text = page.until(lambda: "left" in meter.text and meter.text, "the time left")
            assert re.fullmatch(r"\d+ %, \d+ s elapsed, about .* left\.", str(text))
            assert re.fullmatch(r"On the real board: .* of about .*\.", page.find("real").text)
        page.until(lambda: meter.text.startswith("Milled after"), "the end")
        # 8 pixels of 128 steps, and 2 times 1152 for each stroke, at 101 steps a second.
        page.until(lambda: re.fullmatch(r"On the real board: [12] min \d+ s\.",
                                        page.find("real").text), "the time of the real board")

    def test_the_tab_shows_it_although_nothing_is_drawn(self, fresh):
        """A tab behind others gets no animation frames."""
        page = fresh
        page.browser.execute_cdp_cmd("Emulation.setFocusEmulationEnabled", {"enabled": False})
        page.script("window.requestAnimationFrame = () => 1")
        page.set_switches(1 << 7)
        keys(page, "e")
        page.until(lambda: page.browser.title.startswith("Done"), "the end of the job")
        page.browser.refresh()
        # Until it knows that, it asks whether the job may end.
        page.until(lambda: page.status.startswith("Done"), "the page")
        page.programmed(page.find("power").click)
        page.until(lambda: page.browser.title.startswith("Fresa"), "another job")

    def test_a_build_is_shown_to_go_on(self, page):
        text, title = page.browser.execute_async_script("""
            const done = arguments[0];
            import(new URL("page/progress.js", location)).then(({ describe, title }) => {
              const progress = { building_s: 94, job: null };
              done([describe(progress, 0), title(progress, 0, {})]);
            });""")
        assert text.startswith("Building for 1 min 34 s") and title.startswith("Building")


class TestWaveform:
    def test_record_download_and_draw(self, fresh):
        page = fresh
        field = page.find("record-clocks")
        field.clear()
        field.send_keys("500\n")
        page.until(lambda: page.find("vcd").is_displayed(), "a waveform")
        page.until(lambda: page.script("return document.getElementById('wave').naturalWidth") > 0,
                   "a drawing")
        assert b"$enddefinitions" in get(page.find("vcd").get_attribute("href"))
        assert not page.find("wave-error").text
        signals = json.loads(get(page.address + "wave.json"))
        boxes = page.script("return document.querySelectorAll('#signals input').length")
        assert boxes == len(signals["signals"]) > 5

    def test_one_that_ends_early_says_so(self, fresh):
        page = fresh
        field = page.find("record-clocks")
        with speed(page, "1 k clocks/s"):
            field.clear()
            field.send_keys("1000000\n")
            page.until(lambda: page.find("wave-state").text == "recording", "a recording")
            page.programmed(page.find("power").click)
            page.until(lambda: page.find("wave-state").text.endswith(" of 1 M, ended early"), "end")
            page.until(lambda: page.find("wave").is_displayed(), "a drawing")
        field.clear()
        field.send_keys("2000\n")
        page.until(lambda: page.find("wave-state").text == "2 k clocks", "another")

    def test_as_many_signals_as_a_figure_can_have(self, fresh):
        page = fresh
        page.script("document.getElementById('signals').replaceChildren()")
        page.find("record").click()
        paths = page.until(lambda: page.script(
            "return [...document.querySelectorAll('#signals input')].map(({value}) => value)"),
            "a list of signals")
        assert len(paths) > MOST_ROWS
        longest = sorted(paths, key=len)[-MOST_ROWS:]
        for chosen, error in [(paths, f"at most {MOST_ROWS} rows"), (longest, "")]:
            page.script("""
                for (const box of document.querySelectorAll('#signals input'))
                    box.checked = arguments[0].includes(box.value);
                document.getElementById('draw').click();""", chosen)
            page.until(lambda error=error: error in page.find("wave-error").text, "what is wrong")
            page.until(lambda error=error: page.find("wave").is_displayed() != bool(error), error)
        page.until(lambda: page.script("return document.getElementById('wave').naturalHeight")
                   > 10 * MOST_ROWS, "all rows")

    def test_no_signal_no_drawing(self, fresh):
        page = fresh
        before = page.script("return document.getElementById('wave').src")
        page.find("record").click()
        page.until(lambda: page.script("""
            const wave = document.getElementById("wave");
            return wave.src !== arguments[0] && wave.complete && wave.naturalWidth""", before),
            "another drawing")
        page.script("for (const box of document.querySelectorAll('#signals input'))"
                    " box.checked = false")
        page.find("draw").click()
        page.until(lambda: page.find("wave-error").text == "Choose a signal.", "advice")


def clock(page) -> int:
    return int(page.find("clock").text.removeprefix("clock ").replace("\u2009", ""))


def test_without_the_token_there_is_nothing(page, board):
    for address in (board.rsplit("/", 2)[0] + "/", board[:-2] + "/"):
        with pytest.raises(urllib.error.HTTPError):
            get(address)
