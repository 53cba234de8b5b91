# amaranth: UnusedElaboratable=no

"""The ledger of orders, against a model that keeps a list, in every clock."""

import random

import pytest
from amaranth import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from fresa.motion import OrderLedger, Outcome, RequestKind
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.models import orders as model
from tb.models.orders import LedgerModel

FIELDS = ("kind", "session", "number", "x", "y")


class Apart(wiring.Component):
    """A ledger whose requests and answers come in parts: engines have ports of 64 bits at most."""

    def __init__(self, dut: OrderLedger) -> None:
        self.dut = dut
        super().__init__({
            **{name: In(bits) for name, bits in [
                ("valid", 1), ("good", 1), ("kind", 8), ("session", 32), ("number", 24), ("x", 16),
                ("y", 16), ("ready", 1), ("take", 1), ("enable", 1), ("error", 1),
                ("stopped", 1)]},
            **{f"o_{name}": Out(bits) for name, bits in [
                ("room", 1), ("answered", 1), ("outcome", 4), ("state", 4), ("session", 32),
                ("taken", 24), ("done", 24), ("offered", 1), ("order", 34), ("busy", 1)]},
        })

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.dut = dut = self.dut
        request, answer = dut.requests.p.value, dut.answers.p
        m.d.comb += [
            dut.requests.valid.eq(self.valid), dut.requests.p.good.eq(self.good),
            *(getattr(request, name).eq(getattr(self, name)) for name in FIELDS),
            dut.answers.ready.eq(self.ready), dut.orders.ready.eq(self.take),
            dut.enable.eq(self.enable), dut.error.eq(self.error), dut.stopped.eq(self.stopped),
            self.o_room.eq(dut.requests.ready), self.o_answered.eq(dut.answers.valid),
            self.o_outcome.eq(answer.outcome), self.o_session.eq(answer.session),
            self.o_state.eq(answer.error | answer.stopped << 1 | answer.manual << 2
                            | answer.reserved << 3),
            self.o_taken.eq(answer.taken), self.o_done.eq(answer.done),
            self.o_offered.eq(dut.orders.valid), self.o_order.eq(dut.orders.payload.as_value()),
            self.o_busy.eq(dut.busy),
        ]
        return m


def likely(rng: random.Random, ledger: LedgerModel) -> dict[str, int]:
    """A request that is more often near to what is expected than not."""
    return {
        "good": rng.random() < 0.9,
        "kind": rng.choice([0, 1, 2, 2, 2, 3, 4, rng.randrange(256)]),
        "session": rng.choice([ledger.session] * 6 + [0, 1, 2**31, 2**32 - 1]),
        "number": (ledger.taken + rng.choice([1, 1, 1, 1, 0, 2, -1, 256, 2**23])) % 2**24,
        "x": rng.randrange(2**16), "y": rng.randrange(2**16),
    }


class TestEveryClock:
    @pytest.mark.parametrize(("depth", "share"), [
        (2, 0.02), (16, 0.3),
        *(pytest.param(*both, marks=pytest.mark.long) for both in [(2, 0.3), (16, 0.02)])])
    def test_is_its_model(self, depth, share):
        rng = random.Random(f"{depth} {share}")
        ledger, outcome, ready = LedgerModel(depth=depth), None, 1
        seen, done = set(), 0
        with AmaranthEngine(component("ledger", Apart(OrderLedger(depth=depth)))) as engine:
            for clock in range(5000):
                if outcome is not None or not ready:  # else who takes answers stays ready
                    ready = int(rng.random() < 0.7)
                requested = likely(rng, ledger)
                here = {"valid": int(rng.random() < 0.6), "take": int(rng.random() < share),
                        "enable": int(rng.random() > 0.004), "error": rng.randrange(2),
                        "stopped": rng.randrange(2), "rst": int(rng.random() < 0.002)}
                engine.set(**here, **requested, ready=ready)

                room = int(ready and outcome is None)
                offered = int(bool(ledger.waiting) and here["enable"])
                assert engine.get("o_room", "o_answered", "o_offered", "o_busy") == (
                    room, int(outcome is not None), offered, int(bool(ledger.waiting))), clock
                if outcome is not None:
                    state = here["error"] | here["stopped"] << 1 | (not here["enable"]) << 2
                    assert engine.get(*(f"o_{name}" for name in (
                        "outcome", "state", "session", "taken", "done"))) == (
                        outcome, state, ledger.session, ledger.taken, ledger.done), clock
                    seen.add(outcome)
                if offered:
                    kind, x, y = ledger.waiting[0]
                    assert engine.get("o_order") == (
                        x | y << 16 | (kind == 3) << 32 | (kind == 4) << 33), clock

                if here["valid"] and room:
                    good = requested.pop("good")
                    kind = requested["kind"] if good else None
                    outcome = ledger.request(**{**requested, "kind": kind}, enable=here["enable"])
                elif ready:
                    outcome = None
                if offered and here["take"]:
                    ledger.carry_out()
                    done += 1
                if here["rst"]:
                    outcome = None
                if here["rst"] or not here["enable"]:
                    ledger.reset()
                engine.run(1)
        rare = {model.FULL, model.MANUAL} if share > 0.1 else {model.MANUAL}
        assert seen >= set(range(11)) - rare and done > 20


def test_the_model_counts_as_the_gateware():
    assert [outcome.value for outcome in Outcome] == list(range(11))
    assert all(getattr(model, outcome.name) == outcome.value for outcome in Outcome)
    assert all(getattr(model, kind.name) == kind.value for kind in RequestKind)


class TestParameters:
    def test_odd_depth(self):
        with pytest.raises(ValueError, match="^depth must be a power of two, not 6$"):
            OrderLedger(depth=6)
