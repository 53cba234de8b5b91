"""The page of the virtual board in a real browser: keyboard, mouse and fingers."""

import time

import pytest

from tests.tools.board.browser import keys, resize, tab_to

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
