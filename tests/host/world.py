"""A sender of orders, a mill, the line between them, and the time."""

import random

from fresa_host.order_lines import Kind, Order
from fresa_host.orders import Sender
from tb.models.orders import OrdersModel
from tests.noise import Noise

__all__ = ["World", "job"]


def job(count: int, seed: int = 0) -> list[Order]:
    rng = random.Random(seed)

    def order(kind: Kind) -> Order:
        return Order(kind, rng.randrange(2**16), rng.randrange(2**16)) if kind == Kind.GO else (
            Order(kind))

    kinds = rng.choices([Kind.GO, Kind.UP, Kind.DOWN], [6, 1, 1], k=count - 1)
    return [Order(Kind.UP), *map(order, kinds)]


class World:
    """A sender, a mill, the line between them, and the time."""

    def __init__(self, mill: OrdersModel | None = None, *, noise: float = 0, seed: int = 0) -> None:
        self.mill = mill or OrdersModel()
        self.rng = random.Random(seed)
        self.there, self.back = (Noise(self.rng, noise) for _ in range(2))
        self.now = 0.0
        self.done: list[Order] = []

    def carry_out(self) -> None:
        kind, x, y = self.mill.ledger.carry_out()
        self.done.append(Order(Kind(kind), x, y) if kind == Kind.GO else Order(Kind(kind)))

    def step(self, sender: Sender, *, carry_out: float = 0.6) -> None:
        received = self.mill.hear(self.there.through(sender.send(self.now)))
        if self.mill.ledger.waiting and self.rng.random() < carry_out:
            self.carry_out()
        sender.receive(self.back.through(received), self.now)
        self.now += max(0.07, sender.wait(self.now) * self.rng.random())

    def run(self, sender: Sender, steps: int = 10**6) -> None:
        sender.connected(self.now)
        for _ in range(steps):
            if sender.finished:
                return
            self.step(sender)
        assert steps < 10**6, "it never ends"
