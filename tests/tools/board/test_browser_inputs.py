"""The page of the virtual board in a real browser: keyboard, mouse and fingers."""

import time

import pytest

from tests.tools.board.browser import keys, resize, shown, speed, tab_to
from tests.tools.browsing import live

pytestmark = pytest.mark.browser


class TestKeyboard:
    def test_mill_a_picture_by_tab_and_space(self, fresh, figure):
        page = fresh
        page.browser.refresh()
        page.until(lambda: page.step == 2, "manual mode")
        tab_to(page, "sw7")
        keys(page, " ")
        page.until(lambda: page.step == 3 and page.duty("led7"), "ready")
        tab_to(page, "btn1")
        keys(page, "\ue007")
        page.until(lambda: "Done" in page.status, "the end of the job")
        assert page.cut() == figure.sum()

    def test_mill_a_picture_by_the_keys_that_are_shown(self, fresh, figure):
        page = fresh
        page.script("document.activeElement.blur()")
        keys(page, "7")
        page.until(lambda: page.step == 3 and page.duty("led7"), "ready")
        keys(page, page.find("btn1").get_attribute("aria-keyshortcuts"))
        page.until(lambda: "Done" in page.status, "the end of the job")
        assert page.cut() == figure.sum()

    def test_keys_do_nothing_where_text_is_typed(self, fresh):
        page = fresh
        page.find("record-clocks").click()
        keys(page, "7", "0")
        page.script("document.activeElement.blur()")
        assert not page.is_on(7) and not page.is_on(0)
        keys(page, "0")
        assert page.is_on(0)

    def test_keys_can_be_turned_off(self, fresh):
        page = fresh
        page.find("keys").click()
        keys(page, "7")
        assert not page.is_on(7)
        page.find("keys").click()
        keys(page, "7")
        assert page.is_on(7)

    def test_everything_has_a_name_and_shows_the_focus(self, fresh):
        page = fresh
        nameless = page.script("""
            return [...document.querySelectorAll(
                'button, input, select, a, [role=switch], [role=button], [role=img]')]
              .filter(e => !(e.getAttribute('aria-label') || e.labels?.length
                             || e.textContent.trim()))
              .map(e => e.outerHTML)""")
        assert nameless == []
        tab_to(page, "sw7")
        assert "rgb(255, 211, 77)" in page.script(
            "return getComputedStyle(document.querySelector('#sw7 .area')).stroke")
        assert page.find("sw7").get_attribute("aria-label") == "SW7 manual"
        keys(page, " ")
        page.until(lambda: page.find("sw7").get_attribute("aria-label") == "SW7 auto")


class TestRunningJob:
    """What is lost by a slip is asked about first."""

    @pytest.fixture
    def busy(self, fresh):
        fresh.set_switches(1 << 7)
        fresh.until(lambda: fresh.step == 3 and fresh.duty("led7") > 0, "ready")
        with speed(fresh, "3 k clocks/s"):
            fresh.find("btn1").click()
            fresh.until(lambda: fresh.duty("led5") and fresh.cut(), "a job")
            fresh.script("document.activeElement.blur()")
            yield fresh

    @pytest.mark.parametrize(("key", "control"), [("7", "SW7"), ("r", "BTN0")])
    def test_a_stray_key_does_not_end_it(self, busy, key, control):
        cut = busy.cut()
        keys(busy, key)
        busy.until(lambda: f"{control} would end" in busy.status, "what to do instead")
        busy.until(lambda: busy.cut() > cut, "the job going on")
        assert busy.is_on(7) and busy.duty("led5")
        keys(busy, "q")  # Stop needs no question
        busy.until(lambda: "Stopped" in busy.status, "the stop")
        keys(busy, key)
        busy.until(lambda: not busy.duty("led5"), "the end")

    def test_power_asks(self, busy):
        number = busy.find("job").get_attribute("data-number")
        cut = busy.cut()
        for answer in ("Cancel", "\ue00c"):
            busy.find("power").click()
            dialog = busy.browser.find_element("css selector", "dialog.ask")
            assert "would end" in dialog.text
            if answer == "Cancel":
                dialog.find_element("tag name", "button").click()
            else:
                keys(busy, answer)
            busy.until(lambda: not busy.script("return document.querySelector('.ask')"))
        busy.until(lambda: busy.cut() > cut, "the job going on")
        assert busy.find("job").get_attribute("data-number") == number
        busy.find("power").click()
        busy.programmed(busy.browser.find_element("css selector", ".ask [value=yes]").click)

    def test_clocks_per_step_as_they_are(self, busy):
        number = busy.find("job").get_attribute("data-number")
        cut = busy.cut()
        busy.find("period").send_keys("\n")
        busy.until(lambda: busy.cut() > cut, "the job going on")
        assert not busy.script("return document.querySelector('.ask')")
        assert busy.find("job").get_attribute("data-number") == number


class TestScreenReader:
    """What a screen reader finds, and what it announces by itself."""

    def test_lights_and_display_have_names_that_are_current(self, fresh):
        def names() -> list[str]:
            return page.script("return [...document.querySelectorAll('#board [role=img]')]"
                               ".map((part) => part.ariaLabel)")

        page = fresh
        assert "Display: dark" in names() and "LD7 ready: off" in names()
        assert sum(name.startswith("LD") for name in names()) == 8
        page.set_switches(1 << 7 | 1)
        page.until(lambda: "Display: 0 0 0 0" in names() and "LD7 ready: on" in names(), "names")
        page.pause()
        with speed(page, "30 k clocks/s"):
            page.find("run").click()
            page.find("btn1").click()
            page.until(lambda: "LD5 busy: on" in names(), "the job")
            page.until(lambda: f"Display: {' '.join(shown(page))}" in names() and (
                shown(page) != "0000"), "the count")

    def test_the_plate_says_how_much_is_cut(self, fresh, figure):
        fresh.mill()
        assert f"{figure.sum()} of {figure.sum()}" in fresh.find("table").get_attribute(
            "aria-label")

    def test_a_movement_is_not_announced_step_by_step(self, fresh):
        page = fresh
        page.find("sw0").click()
        page.until(lambda: page.position("x") > 20, "movement")
        before = page.position("x")
        assert live(page, 1) == []
        assert page.position("x") > before + 100

    def test_the_axes_of_the_plate_are_labelled_as_the_switches_move(self, fresh):
        page = fresh
        labels = page.script("return document.querySelector('.axes').innerText").split()
        assert labels == ["Y", "+", "→", "X", "+", "↓"]
        for bit, axis in ((0, "x"), (2, "y")):
            assert page.find(f"sw{bit}").get_attribute("aria-label") == f"SW{bit} {axis.upper()} +"
            assert page.find(f"sw{bit + 1}").get_attribute("aria-label").endswith("−")
            page.find(f"sw{bit}").click()
            page.until(lambda axis=axis: page.position(axis) > 20, "movement")
            page.find(f"sw{bit}").click()
        # The table shows X downwards and Y to the right.
        page.until(lambda: page.script("""
            const tool = document.querySelector("canvas[data-layer=tool]").getContext("2d");
            const view = document.getElementById("table").dataset;
            const at = (motor, edge) => (document.getElementById(motor).dataset.position
                                         - view[edge]) * view.scale;
            // The right arm of the cross, 11 pixels wide.
            return tool.getImageData(at("motor-y", "left") + 9, at("motor-x", "top"), 1, 1)
              .data[3] > 0"""), "the cross where the labels say")


class TestTwoPages:
    def test_switches_put_in_the_same_moment_all_count(self, fresh):
        page = fresh
        first = page.browser.current_window_handle
        page.script("window.other = open(location.href, '', 'popup')")
        try:
            page.until(lambda: page.script(
                "return other.document.body?.dataset.connection === 'open'"
                " && other.document.getElementById('sw1') !== null"), "another page")
            # Between two clicks of one script neither page hears of the other's.
            page.script("""
                const click = (page, id) =>
                    page.document.getElementById(id).dispatchEvent(new MouseEvent('click'));
                for (const [page, id] of [[window, 'sw0'], [other, 'sw1'], [other, 'sw2'],
                                          [window, 'sw3'], [other, 'sw2']]) click(page, id);""")
            wanted = [True, True, False, True]
            for shown in ("window", "other"):
                page.until(lambda shown=shown: wanted == page.script(f"""
                    return [0, 1, 2, 3].map((bit) => {shown}.document.getElementById('sw' + bit)
                        .getAttribute('aria-checked') === 'true')"""), f"that in {shown}")
            # What a page shows of its own change it has by now from the board.
            time.sleep(0.6)
            assert [page.is_on(bit) for bit in range(4)] == wanted
        finally:
            page.script("other.close()")
            page.browser.switch_to.window(first)


class TestHolding:
    def test_a_button_is_down_as_long_as_the_mouse_is(self, fresh):
        from selenium.webdriver.common.action_chains import ActionChains

        page = fresh
        button = page.find("btn0")
        # Away from it and still down, it is held; let go of elsewhere, it is up all the same.
        ActionChains(page.browser).click_and_hold(button).pause(0.3).move_by_offset(
            -200, -200).perform()
        assert button.get_attribute("aria-pressed") == "true"
        ActionChains(page.browser).release().perform()
        page.until(lambda: button.get_attribute("aria-pressed") == "false", "up")

    def test_leaving_the_window_lets_go(self, fresh):
        from selenium.webdriver.common.action_chains import ActionChains

        page = fresh
        ActionChains(page.browser).key_down("r").perform()
        button = page.find("btn0")
        page.until(lambda: button.get_attribute("aria-pressed") == "true", "down")
        page.script("window.dispatchEvent(new Event('blur'))")
        page.until(lambda: button.get_attribute("aria-pressed") == "false", "up")
        ActionChains(page.browser).key_up("r").perform()

    def test_two_fingers_hold_two_buttons(self, fresh):
        page = fresh
        resize(page.browser, 360, 740, touch=True)
        try:
            page.script("document.getElementById('btn0').scrollIntoView({block: 'center'})")
            points = [{**page.script(
                "const r = document.getElementById(arguments[0]).getBoundingClientRect();"
                "return {x: r.x + r.width / 2, y: r.y + r.height / 2}", f"btn{bit}"), "id": bit}
                for bit in (0, 2)]
            touch(page, "touchStart", points)
            page.until(lambda: [page.find(f"btn{bit}").get_attribute("aria-pressed")
                                for bit in range(4)] == ["true", "false", "true", "false"], "two")
            touch(page, "touchEnd", [])
            page.until(lambda: not page.script(
                "return document.querySelector('[aria-pressed=true]')"), "none")
        finally:
            resize(page.browser, 1280, 800)


def touch(page, kind: str, points: list[dict]) -> None:
    page.browser.execute_cdp_cmd("Input.dispatchTouchEvent", {
        "type": kind, "touchPoints": points})
