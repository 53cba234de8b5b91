"""Orders over a line that drops, doubles and changes bytes, to a model of the mill's gateware."""

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from fresa_host.errors import MachineError, WasReset
from fresa_host.jobs import begin_raised
from fresa_host.order_lines import LAST_NUMBER, Answer, Kind, Order, Outcome, request
from fresa_host.orders import (
    RUNS,
    JobHalfDone,
    JobRefused,
    NotReady,
    OrderRefused,
    Phase,
    Sender,
)
from tb.models.orders import OrdersModel
from tests.host.world import World, job


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
        world.run(Sender(begin_raised([Order(Kind.GO, 3, 4)]), force=True))
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
            answer = Answer(Outcome.REPORTED, False, False, False, digest << 8 | run, 1, 1)
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

    def test_another_job_does_not_throw_one_away_that_is_half_done(self):
        world, first = World(), Sender(job(5, 1))
        first.connected(0)
        while not world.done or world.mill.ledger.waiting:
            world.step(first)
        session, done = world.mill.ledger.session, len(world.done)
        with pytest.raises(JobHalfDone, match=f"another job up to its order {done}") as why:
            world.run(Sender(job(6, 2)))
        assert why.value.done == done and world.mill.ledger.session == session
        world.run(Sender(job(5, 1)))  # it goes on
        assert world.done == job(5, 1)

    def test_another_job_is_thrown_away_by_force(self):
        world, first = World(), Sender(job(5, 1))
        first.connected(0)
        while not world.done or world.mill.ledger.waiting:
            world.step(first)
        done = list(world.done)
        world.run(Sender(job(6, 2), force=True))
        assert world.done == done + job(6, 2)

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
        with pytest.raises(NotReady, match="manual mode in the middle"):
            world.run(sender)

    @pytest.mark.parametrize(("what", "message"), [
        ("stopped", "is stopped: reset"), ("error", "shows an error: reset"),
        ("enable", "is in manual mode: bring")])
    def test_not_ready(self, what, message):
        world = World()
        setattr(world.mill, what, what != "enable")
        with pytest.raises(NotReady, match=message):
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


@pytest.mark.parametrize(("make", "message"), [
    (lambda: Sender([]), f"a job has 1 to {LAST_NUMBER} orders, not 0"),
    (lambda: Sender(job(3), first=4), "the first order must be from 1 to 3, not 4"),
    (lambda: Sender([Order(Kind.GO, 1, 2)]), "raising the tool, not with go 1 2"),
    (lambda: Sender([Order(Kind.UP), Order(Kind.DOWN)], first=2), "not with down"),
])
def test_impossible(make, message):
    with pytest.raises(ValueError, match=message):
        make()
