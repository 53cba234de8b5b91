"""A job over ports that come and go."""

from collections.abc import Iterator

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fresa_host.delivery import deliver
from fresa_host.errors import LineLost
from fresa_host.orders import Sender
from tests.host.world import World, job


class Cable:
    """Ports to a mill, of which each is gone after some reads."""

    def __init__(self, world: World, lives: Iterator[int]) -> None:
        self.world, self.lives, self.opened = world, lives, 0

    def open(self):
        life = next(self.lives)
        if life < 0:
            raise LineLost("no such port")
        self.opened += 1
        self.left, self.received = life, b""
        return self

    @property
    def waiting(self) -> bool:
        return False

    def write(self, data: bytes) -> None:
        self.received += self.world.mill.hear(data)

    def read(self) -> bytes:
        self.world.now += 0.07
        if self.world.mill.ledger.waiting:
            self.world.carry_out()
        self.left -= 1
        if self.left < 0:
            raise LineLost("unplugged")
        received, self.received = self.received, b""
        return received

    def close(self) -> None:
        self.received = b""


class TestDeliver:
    def deliver(self, lives, orders):
        world = World()
        cable, seen = Cable(world, iter([*lives, 10**6])), []

        def rest(seconds: float) -> None:
            world.now += seconds

        deliver(Sender(orders), cable, watch=seen.append, clock=lambda: world.now,
                rest=rest)
        return world, cable, seen

    @given(st.lists(st.integers(-3, 12), max_size=9))
    @settings(max_examples=30, deadline=None)
    def test_unplugged_whenever(self, lives):
        world, cable, seen = self.deliver([3, *lives], job(15))
        assert world.done == job(15)
        assert cable.opened >= 2 and set(seen) == {True, False}

    def test_no_port_at_first_is_an_error(self):
        with pytest.raises(LineLost, match="no such port"):
            self.deliver([-1], job(3))
