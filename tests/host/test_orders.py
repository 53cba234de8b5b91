"""Orders over a line that drops, doubles and changes bytes, to a model of the mill's gateware."""

import random
from collections.abc import Iterator

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from fresa.motion import Outcome as GatewareOutcome
from fresa.motion import RequestKind
from fresa.protocol import BAUD
from fresa_host import order_lines, port
from fresa_host.errors import LineLost, MachineError, WasReset
from fresa_host.order_lines import (
    LAST_NUMBER,
    Answer,
    AnswerReader,
    Kind,
    Order,
    Outcome,
    request,
)
from fresa_host.orders import (
    RUNS,
    JobRefused,
    NotReady,
    OrderRefused,
    Phase,
    Sender,
    begin_raised,
    deliver,
)
from tb.models.orders import OrdersModel
from tests.noise import Noise


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
        heard = self.mill.hear(self.there.through(sender.send(self.now)))
        if self.mill.ledger.waiting and self.rng.random() < carry_out:
            self.carry_out()
        sender.receive(self.back.through(heard), self.now)
        self.now += max(0.07, sender.wait(self.now) * self.rng.random())

    def run(self, sender: Sender, steps: int = 10**6) -> None:
        sender.connected(self.now)
        for _ in range(steps):
            if sender.finished:
                return
            self.step(sender)
        assert steps < 10**6, "it never ends"


class TestEachIsDoneOnce:
    @pytest.mark.parametrize(("count", "noise"), [(10_000, 0.001), (2_000, 0.01), (300, 0.03)])
    def test_over_a_bad_line(self, count, noise):
        world, orders = World(noise=noise, seed=count), job(count)
        sender = Sender(orders)
        world.run(sender)
        assert world.done == orders
        assert world.there.faults > 20 and world.back.faults > 20

    @given(st.integers(0, 2**32), st.integers(1, 30), st.floats(0, 0.05))
    @settings(max_examples=40, deadline=None)
    def test_of_any_kind(self, seed, count, noise):
        world, orders = World(noise=noise, seed=seed), job(count, seed)
        world.run(Sender(orders))
        assert world.done == orders

    @given(st.integers(0, 2**32), st.lists(st.integers(0, 40), max_size=8))
    @settings(max_examples=40, deadline=None)
    def test_by_hosts_that_come_and_go(self, seed, lives):
        """Each sender is cut off at any time; the next knows nothing but the job."""
        world, orders = World(noise=0.01, seed=seed), job(25, seed)
        for steps in lives:
            sender = Sender(orders)
            world.run(sender, steps)
            if sender.done == len(orders):  # who knows that sends it no more
                break
        else:
            world.run(Sender(orders))
        assert world.done == orders

    @given(st.binary(max_size=300))
    @example(b":" * 300)
    @example(request(Kind.GO, 0, 1))
    def test_hostile_bytes_order_nothing(self, data):
        mill = OrdersModel()
        assert mill.hear(request(Kind.OPEN, 77, 0))
        mill.hear(data)
        assert not mill.ledger.waiting and mill.ledger.taken == 0

    def test_a_good_line_sends_each_once(self):
        """Nothing is said twice where nothing is lost, so that the line is free."""
        world, orders = World(), job(200)
        sender, sent = Sender(orders), []
        sender.connected(0)
        while not sender.finished:
            line = sender.send(world.now)
            sent += [line] if line else []
            sender.receive(world.mill.hear(line), world.now)
            while world.mill.ledger.waiting:
                world.carry_out()
            world.now += 0.01
        assert len(sent) <= len(orders) + 4

    def test_a_mill_without_room_is_not_pressed(self):
        world, sender = World(), Sender(job(5))
        sender.connected(0)
        lines = 0
        while world.now < 10:
            line = sender.send(world.now)
            lines += bool(line)
            sender.receive(world.mill.hear(line), world.now)
            world.now += 0.01
        assert sender.taken == 2 and lines < 60

    def test_answers_to_repeated_requests_do_not_make_more(self):
        """After one answer that came too late everything is soon said once again."""
        world, orders = World(), job(60)
        sender, late = Sender(orders), []
        sender.connected(0)
        lines = 0
        while not sender.finished:
            line = sender.send(world.now)
            lines += bool(line)
            answer = world.mill.hear(line)
            late += [answer] if answer else []
            if lines > 3 and late:  # those before are held back until they are repeated
                sender.receive(late.pop(0), world.now)
            while world.mill.ledger.waiting:
                world.carry_out()
            world.now += 0.05
        assert world.done == orders
        assert lines < len(orders) + 15


class TestPlaces:
    def test_the_same_job_again_is_another_run(self):
        world, orders = World(), job(5)
        for run in range(1, 4):
            world.run(Sender(orders))
            assert world.done == orders * run

    def test_a_tool_that_another_job_left_down_is_raised_first(self):
        world = World()
        sender = Sender([Order(Kind.UP), Order(Kind.DOWN), Order(Kind.GO, 9, 9)])
        while world.mill.ledger.taken < 2:
            world.step(sender)
        while world.mill.ledger.waiting:
            world.carry_out()
        assert world.done[-1] == Order(Kind.DOWN)
        world.run(Sender(begin_raised([Order(Kind.GO, 3, 4)])))
        assert world.done[2:] == [Order(Kind.UP), Order(Kind.GO, 3, 4)]

    def test_a_job_that_raises_the_tool_is_left_alone(self):
        orders = [Order(Kind.UP), Order(Kind.GO, 1, 1)]
        assert begin_raised(orders) == orders
        assert begin_raised([]) == [Order(Kind.UP)]

    @pytest.mark.parametrize("digest", [0, 1, 253, 254, 255, 2**24 - 1])
    def test_another_run_has_another_number(self, digest):
        """If it had not, the mill would take it for the one that is open."""
        for run in range(1, RUNS):
            sender = Sender(job(3), again=True)
            sender._digest = digest
            answer = Answer(Outcome.TOLD, False, False, False, digest << 8 | run, 1, 1)
            sender._take(answer, 0)
            assert sender._session >> 8 == digest
            assert sender._session % RUNS not in (0, run)

    def test_a_run_that_somebody_else_began_is_not_its_own(self):
        """After a reset the same job may be begun by another computer."""
        numbers = {Sender(job(3))._session for _ in range(50)}
        assert len(numbers) > 10 and len({number >> 8 for number in numbers}) == 1

    def test_many_runs(self):
        world, orders = World(), job(1)
        for _ in range(600):
            world.run(Sender(orders))
        assert len(world.done) == 600

    def test_another_job_follows(self):
        world = World()
        world.run(Sender(job(5, 1)))
        world.run(Sender(job(6, 2)))
        assert world.done == job(5, 1) + job(6, 2)

    def test_another_job_waits_for_none(self):
        world = World()
        sender = Sender(job(5, 1))
        sender.connected(0)
        while not world.mill.ledger.waiting:
            world.step(sender, carry_out=0)
        with pytest.raises(JobRefused, match="another job"):
            world.run(Sender(job(6, 2)))

    def test_a_job_that_was_finished_meanwhile_is_not_done_twice(self):
        world, orders = World(), job(5)
        sender = Sender(orders)
        while world.mill.ledger.taken < 5:
            world.step(sender)
        while world.mill.ledger.waiting:
            world.carry_out()
        world.run(again := Sender(orders))
        assert again.resumed and world.done == orders

    def test_a_session_that_cannot_be_closed(self):
        world, orders = World(), job(5)
        sender = Sender(orders)
        while sender.phase is not Phase.CLOSING:
            world.step(sender)
        for _ in range(20):
            sender.send(world.now)
            world.now += 1
        assert sender.finished

    def test_again_begins_anew(self):
        world, orders = World(), job(20)
        world.run(Sender(orders), 8)
        before = len(world.done) + len(world.mill.ledger.waiting)
        assert 0 < before < 20
        world.run(Sender(orders, again=True))
        assert world.done == orders[:before] + orders

    def test_resumed_is_told(self):
        world, orders = World(), job(20)
        first = Sender(orders)
        world.run(first, 8)
        second = Sender(orders)
        world.run(second, 3)
        assert (first.resumed, second.resumed) == (False, True)
        assert second.taken >= first.taken

    def test_from_an_order(self):
        world, orders = World(), job(20)
        orders[6] = Order(Kind.UP)
        sender = Sender(orders, first=7)
        world.run(sender)
        assert world.done == orders[6:] and sender.done == 20

    def test_paused_sends_nothing(self):
        world, orders = World(), job(20)
        sender = Sender(orders)
        world.run(sender, 5)
        sender.paused = True
        for _ in range(30):
            world.step(sender)
        taken = world.mill.ledger.taken
        for _ in range(30):
            world.step(sender)
        assert world.mill.ledger.taken == taken == sender.done < 20
        sender.paused = False
        world.run(sender)
        assert world.done == orders


class TestWhatGoesWrong:
    def begun(self) -> tuple[World, Sender]:
        world, sender = World(), Sender(job(20))
        world.run(sender, 8)
        assert 0 < sender.taken < 20
        return world, sender

    def test_a_reset_is_no_progress(self):
        world, sender = self.begun()
        world.mill.ledger.reset()
        done = list(world.done)
        with pytest.raises(WasReset):
            world.run(sender)
        assert world.done == done

    def test_a_reset_before_the_session_is_nothing(self):
        world, sender = World(), Sender(job(5))
        while sender.phase is not Phase.OPENING:
            world.step(sender)
        world.mill.ledger.reset()
        world.run(sender)
        assert world.done == job(5)

    def test_manual_mode(self):
        world, sender = self.begun()
        world.mill.ledger.reset()
        world.mill.enable = 0
        with pytest.raises(NotReady, match="manual mode after order"):
            world.run(sender)

    @pytest.mark.parametrize(("what", "says"), [
        ("stopped", "is stopped: reset"), ("error", "shows an error: reset"),
        ("enable", "is in manual mode: bring")])
    def test_not_ready(self, what, says):
        world = World()
        setattr(world.mill, what, what != "enable")
        with pytest.raises(NotReady, match=says):
            world.run(Sender(job(3)))
        assert not world.done

    def test_a_refused_order_is_named(self):
        world, sender = self.begun()
        while not world.mill.ledger.waiting:
            world.step(sender, carry_out=0)
        world.mill.error = 1
        with pytest.raises(OrderRefused) as caught:
            for _ in range(9):
                world.step(sender, carry_out=0)
        assert caught.value.number == len(world.done) + 1
        assert f"order {len(world.done) + 1}, {job(20)[len(world.done)]}" in str(caught.value)

    def test_stopped_in_the_middle(self):
        world, sender = self.begun()
        world.mill.stopped = 1
        with pytest.raises(NotReady, match="stopped"):
            world.run(sender)

    def test_numbers_that_cannot_be(self):
        world, sender = self.begun()
        world.mill.ledger.done = 21
        world.mill.ledger.waiting.clear()
        with pytest.raises(MachineError, match="counts 21 orders taken and 21 done, of 20"):
            world.run(sender)


class Cable:
    """Ports to a mill, of which each is gone after some reads."""

    def __init__(self, world: World, lives: Iterator[int]) -> None:
        self.world, self.lives, self.opened = world, lives, 0

    def connect(self):
        life = next(self.lives)
        if life < 0:
            raise LineLost("no such port")
        self.opened += 1
        self.left, self.heard = life, b""
        return self

    @property
    def waiting(self) -> bool:
        return False

    def write(self, data: bytes) -> None:
        self.heard += self.world.mill.hear(data)

    def read(self) -> bytes:
        self.world.now += 0.07
        if self.world.mill.ledger.waiting:
            self.world.carry_out()
        self.left -= 1
        if self.left < 0:
            raise LineLost("unplugged")
        heard, self.heard = self.heard, b""
        return heard

    def close(self) -> None:
        self.heard = b""


class TestDeliver:
    def deliver(self, lives, orders):
        world = World()
        cable, seen = Cable(world, iter([*lives, 10**6])), []

        def rest(seconds: float) -> None:
            world.now += seconds

        deliver(Sender(orders), cable.connect, watch=seen.append, clock=lambda: world.now,
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


class TestLines:
    def test_both_sides_mean_the_same(self):
        assert {kind.name: kind.value for kind in Kind} == {
            kind.name: kind.value for kind in RequestKind}
        assert {outcome.name: outcome.value for outcome in Outcome} == {
            outcome.name: outcome.value for outcome in GatewareOutcome}
        assert port.BAUD == BAUD

    @given(st.binary(max_size=200))
    def test_answers_are_found_in_anything(self, data):
        mill = OrdersModel()
        answer = mill.hear(request(Kind.TELL))
        assert len(AnswerReader().feed(data.replace(b"=", b"-") + answer)) == 1

    @given(st.binary(max_size=400))
    def test_noise_is_no_answer(self, data):
        assert AnswerReader().feed(data) == []

    def test_memory_is_bounded(self):
        reader = AnswerReader()
        reader.feed(b"=" + b"0" * 10**6)
        assert len(reader._begun or b"") <= order_lines.LENGTH + 1

    @pytest.mark.parametrize("at", range(1, 31))
    def test_a_digit_changed_is_found(self, at):
        answer = bytearray(OrdersModel().hear(request(Kind.TELL)))
        for digit in b"0123456789ABCDEF":
            changed = answer.copy()
            changed[at] = digit
            assert bool(AnswerReader().feed(bytes(changed))) == (changed == answer)

    @pytest.mark.parametrize(("make", "says"), [
        (lambda: Order(Kind.TELL), "an order is to go, up or down"),
        (lambda: Order(Kind.GO, 65536, 0), "x must be from 0 to 65535, not 65536"),
        (lambda: Order(Kind.GO, 0, -1), "y must be from 0 to 65535, not -1"),
        (lambda: Sender([]), f"a job has 1 to {LAST_NUMBER} orders, not 0"),
        (lambda: Sender(job(3), first=4), "the first order must be from 1 to 3, not 4"),
        (lambda: Sender([Order(Kind.GO, 1, 2)]), "raising the tool, not with go 1 2"),
        (lambda: Sender([Order(Kind.UP), Order(Kind.DOWN)], first=2), "not with down"),
    ])
    def test_impossible(self, make, says):
        with pytest.raises(ValueError, match=says):
            make()
