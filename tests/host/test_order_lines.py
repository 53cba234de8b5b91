"""Lines of the mill's order source: the same on both sides, and found in anything."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fresa.motion import Outcome as GatewareOutcome
from fresa.motion import RequestKind
from fresa.protocol import BAUD
from fresa_host import order_lines, port
from fresa_host.order_lines import AnswerReader, Kind, Order, Outcome, request
from tb.models.orders import OrdersModel


def test_both_sides_mean_the_same():
    assert {kind.name: kind.value for kind in Kind} == {
        kind.name: kind.value for kind in RequestKind}
    assert {outcome.name: outcome.value for outcome in Outcome} == {
        outcome.name: outcome.value for outcome in GatewareOutcome}
    assert port.BAUD == BAUD


@given(st.binary(max_size=200))
def test_answers_are_found_in_anything(data):
    mill = OrdersModel()
    answer = mill.hear(request(Kind.QUERY))
    assert len(AnswerReader().feed(data.replace(b"=", b"-") + answer)) == 1


@given(st.binary(max_size=400))
def test_noise_is_no_answer(data):
    assert AnswerReader().feed(data) == []


def test_memory_is_bounded():
    reader = AnswerReader()
    reader.feed(b"=" + b"0" * 10**6)
    assert len(reader._begun or b"") <= order_lines.LENGTH + 1


@pytest.mark.parametrize("at", range(1, 31))
def test_a_digit_changed_is_found(at):
    answer = bytearray(OrdersModel().hear(request(Kind.QUERY)))
    for digit in b"0123456789ABCDEF":
        changed = answer.copy()
        changed[at] = digit
        assert bool(AnswerReader().feed(bytes(changed))) == (changed == answer)


class TestOrder:
    def test_numbers_are_whole(self):
        order = Order(Kind.GO, np.int64(3), True)  # pyright: ignore[reportArgumentType]
        assert (str(order), type(order.x)) == ("go 3 1", int)
        assert request(order.kind, 1, 1, order.x, order.y)
        assert str(Order(4)) == "down"  # pyright: ignore[reportArgumentType]

    @pytest.mark.parametrize(("order", "message"), [
        ((Kind.GO, 24.0, 0), "x must be a whole number, not 24.0"),
        ((Kind.GO, 0, "7"), "y must be a whole number, not '7'"),
        ((Kind.GO, 0, 65536), "y must be 0 to 65535, not 65536"),
        ((Kind.GO, -1, 0), "x must be 0 to 65535, not -1"),
        ((Kind.QUERY, 0, 0), "an order is to go, up or down"), (("go", 0, 0), "not 'go'")])
    def test_what_is_none(self, order, message):
        with pytest.raises(ValueError, match=message):
            Order(*order)
