# amaranth: UnusedElaboratable=no

"""Fuzzing `mill`: mistakes in its gateware are found, with few bytes; and no other."""

from amaranth import Cat, Mux

from fresa.motion.order_ledger import Outcome
from tb.machines.mill.fuzz.lines import DOWN, GO, OPEN, request
from tb.mistake import Mistake
from tests.machines.fuzzing import mistakes_are_found

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


TestMistakes = mistakes_are_found("mill", BEGIN, MISTAKES)
