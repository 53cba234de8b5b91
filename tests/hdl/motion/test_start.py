# amaranth: UnusedElaboratable=no

"""Orders over the thesis's handshake, to a controller that does its worst."""

import random

import pytest

from fresa.motion import StartHandshake
from tb.boards import component
from tb.engines import AmaranthEngine


class Controller:
    """Takes an order where `start` meets `ready`, once for each start; ready falls, then rises.

    How long it takes to see a start, how long it is busy and whether it fails is up to chance.
    """

    def __init__(self, rng: random.Random, fails: float = 0) -> None:
        self.rng, self.fails = rng, fails
        self.taken: list[int] = []
        self.busy = 0
        self.error = 0
        self.started = False

    @property
    def ready(self) -> bool:
        return self.busy == 0

    def clock(self, start: int, order: int) -> None:
        if self.busy:
            self.busy -= 1
        elif start and not self.started and self.rng.random() < 0.7:
            self.started = True
            self.taken.append(order)
            self.error = int(self.rng.random() < self.fails)
            self.busy = self.rng.choice([1, 1, 2, 3, 30])
        self.started = self.started and bool(start)


def run(seed: int, *, fails: float = 0, clocks: int = 1500):
    rng = random.Random(seed)
    controller = Controller(rng, fails)
    controller.busy = rng.randrange(40)  # not ready at first
    source = [rng.getrandbits(34) for _ in range(200)]
    taken, offered, held = [], False, 0
    with AmaranthEngine(component("start", StartHandshake())) as engine:
        for _ in range(clocks):
            offered = offered or rng.random() < 0.5
            payload = source[len(taken)]
            engine.set(
                orders_valid=offered,
                orders_payload=payload if offered else 0,
                ready=controller.ready,
                error=controller.error,
            )
            start, order, ready, fault = engine.get("start", "order", "orders_ready", "fault")
            assert not fault
            assert not start or (offered and order == payload)
            if ready and offered:
                # Not before the controller has carried it out.
                assert controller.taken == [*taken, payload]
                assert controller.ready and not controller.error
                taken.append(payload)
                offered = False
            controller.clock(start, order)
            engine.run(1)
            held += start
    return controller, source, taken


class TestStartHandshake:
    @pytest.mark.parametrize("seed", range(3))
    def test_loses_no_order_and_doubles_none(self, seed):
        controller, source, taken = run(seed)
        assert len(taken) > 20
        assert taken == source[: len(taken)]
        assert controller.taken in (taken, source[: len(taken) + 1])

    @pytest.mark.parametrize("seed", range(3))
    def test_an_error_ends_it(self, seed):
        """The order in error is the last that the controller sees, and is never taken."""
        controller, source, taken = run(seed, fails=0.2)
        assert controller.error
        assert taken == source[: len(taken)]
        assert controller.taken == source[: len(taken) + 1]
