"""What pages may ask for, and who holds which axis."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tools.console import UserError
from tools.panel import orders
from tools.panel.jogging import HOLD_TIMEOUT_S, Jogging

ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4))
READERS = [orders.read_axis, orders.read_speed, orders.read_number, orders.read_name,
           orders.read_page, orders.read_directions, orders.read_point, orders.read_switch]


class TestOrders:
    def test_what_may_be_asked_for(self):
        assert orders.read_axis({"axis": 2}) == 2
        assert orders.read_speed({"speed": 26}) == 26
        assert orders.read_number({"number": 1}) == 1
        assert orders.read_name({"port": "COM3"}) == "COM3"
        assert orders.read_page({"name": "1-2"}) == "1-2"
        assert orders.read_directions({"directions": [-1, 0, 1]}) == (-1, 0, 1)
        assert orders.read_switch({"end": "X+", "pressed": True}) == ("X+", True)
        assert orders.read_point({"place": [1, None, -14_000]}) == (1.0, None, -14_000.0)

    @pytest.mark.parametrize(("read", "message", "error"), [
        (orders.read_axis, {"axis": 3}, "axis must be a whole number from 0 to 2"),
        (orders.read_axis, {"axis": True}, "axis must be a whole number"),
        (orders.read_speed, {"speed": 0}, "speed must be a whole number from 1 to 26"),
        (orders.read_speed, {"speed": 27}, "from 1 to 26"),
        (orders.read_speed, {"speed": 1.5}, "from 1 to 26"),
        (orders.read_number, {"number": 8}, "number must be a whole number from 1 to 7"),
        (orders.read_number, {}, "number must be"),
        (orders.read_name, {"port": ""}, "choose a port first"),
        (orders.read_page, {"name": 1}, "a page must have a name"),
        (orders.read_page, {"name": "x" * 201}, "a page must have a name"),
        (orders.read_name, {"port": "x" * 201}, "choose a port first"),
        (orders.read_directions, {"directions": [0, 0]}, "directions must be three of -1, 0 and 1"),
        (orders.read_directions, {"directions": [0, 0, 2]}, "directions must be three"),
        (orders.read_directions, {"directions": [0, 0, 0.0]}, "directions must be three"),
        (orders.read_switch, {"end": 0, "pressed": True}, "must have a name"),
        (orders.read_switch, {"end": "X+", "pressed": 1}, "pressed or not"),
        (orders.read_point, {"place": [0, 0]}, "place must be three numbers of um"),
        (orders.read_point, {"place": [0, 14_001, 0]}, "y must be from -14000 to 14000 um"),
        (orders.read_point, {"place": [0, 0, "1"]}, "z must be"),
        (orders.read_point, {"place": [float("nan"), 0, 0]}, "x must be"),
    ])
    def test_invalid(self, read, message, error):
        with pytest.raises(UserError, match=error):
            read(message)

    @given(st.sampled_from(READERS), st.dictionaries(
        st.sampled_from(["axis", "speed", "number", "port", "directions", "place"]), ANYTHING))
    def test_any_message_can_be_read(self, read, message):
        try:
            read(message)
        except UserError:
            pass


class TestJogging:
    def test_one_page_holds_the_last_one_that_began(self):
        jogging = Jogging()
        jogging.hold("one", (1, 1, 0), 0.0)
        assert jogging.directions(0.1) == (1, 1, 0)
        jogging.hold("two", (-1, 0, -1), 0.1)
        assert jogging.directions(0.2) == (-1, 0, -1)
        jogging.hold("one", (0, 0, 0), 0.2)
        jogging.leave("one")
        jogging.refresh("one", 0.2)
        assert jogging.directions(0.3) == (-1, 0, -1)
        jogging.leave("two")
        assert jogging.directions(0.4) == (0, 0, 0)

    def test_who_falls_silent_holds_no_longer(self):
        jogging = Jogging()
        jogging.hold("one", (1, 0, 0), 0.0)
        jogging.refresh("one", 0.9 * HOLD_TIMEOUT_S)
        assert jogging.directions(1.8 * HOLD_TIMEOUT_S) == (1, 0, 0)
        assert jogging.directions(1.9 * HOLD_TIMEOUT_S) == (0, 0, 0)
        jogging.refresh("one", 2 * HOLD_TIMEOUT_S)
        assert jogging.directions(2 * HOLD_TIMEOUT_S) == (0, 0, 0)
