"""Lines of the mill's order source: the same on both sides, and found in anything."""

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
    answer = mill.hear(request(Kind.TELL))
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
    answer = bytearray(OrdersModel().hear(request(Kind.TELL)))
    for digit in b"0123456789ABCDEF":
        changed = answer.copy()
        changed[at] = digit
        assert bool(AnswerReader().feed(bytes(changed))) == (changed == answer)


@pytest.mark.parametrize(("make", "says"), [
    (lambda: Order(Kind.TELL), "an order is to go, up or down"),
    (lambda: Order(Kind.GO, 65536, 0), "x must be from 0 to 65535, not 65536"),
    (lambda: Order(Kind.GO, 0, -1), "y must be from 0 to 65535, not -1"),
])
def test_impossible(make, says):
    with pytest.raises(ValueError, match=says):
        make()
