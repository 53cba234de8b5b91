# amaranth: UnusedElaboratable=no

"""Fuzzing `mill`: mistakes in its gateware are found, with few bytes; and no other."""

import pytest
from amaranth import Cat, Mux

from fresa.motion.order_ledger import Outcome
from tb.machines.mill.fuzz.lines import DOWN, GO, OPEN, request
from tb.mistake import Mistake
from tests.machines.fuzzing import BREAK, kinds, run

BEGIN = request(OPEN, 1)
MISTAKES = {  # few bytes, what is found, the mistake
    "an order taken out of turn": (request(DOWN, 1, 257), "answer", Mistake(
        "ledger.decided", lambda right, _: Mux(
            right == Outcome.UNEXPECTED.value, Outcome.TAKEN.value, right))),
    "an order to somewhere else": (request(GO, 1, 1, 0, 4), "step", Mistake(
        "ledger.orders__payload", lambda right, _: Cat(right[16:32], right[:16], right[32:]))),
    "steps too far apart": (request(GO, 1, 1, 0, 4), "time", Mistake(
        "orders.divider.count", lambda right, at: Mux(
            at("orders.divider.tick"), right - 1, right))),
}


class TestMistakes:
    def test_nothing_is_found_where_there_is_none(self):
        texts = dict.fromkeys(text for text, *_ in MISTAKES.values())
        found = run("mill", BEGIN + b"".join(texts), low=BREAK)
        assert found.failures == [] and found.steps

    @pytest.mark.parametrize("mistake", MISTAKES)
    def test_is_found_with_few_bytes(self, mistake):
        text, kind, planted = MISTAKES[mistake]
        assert kind in kinds("mill", BEGIN + text, mistake=planted)
