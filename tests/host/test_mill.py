"""The mill from Python: jobs over a fake port, to a model of its gateware."""

import runpy

import pytest

from fresa_host import (
    JobHalfDone,
    JobStopped,
    Kind,
    LineLost,
    Mill,
    NotReady,
    Order,
    OrderRefused,
    TimedOut,
    order_lines,
)
from tests.host.world import World, job
from tests.tools.process import PATIENCE, ROOT

DOWN, UP = Order(Kind.DOWN), Order(Kind.UP)


class Wire:
    """A port to a model of the mill, whose orders take a read each; it counts who has it open."""

    def __init__(self) -> None:
        self.world = World()
        self.open = self.reads = 0
        self.dead_from, self.dead = -1, False

    def __call__(self, name: str) -> "Wire":
        if name != "mill":
            raise LineLost(f"{name} cannot be opened")
        self.open += 1
        self.received = b""
        return self

    waiting = False

    def write(self, data: bytes) -> None:
        if not self.dead:
            self.received += self.world.mill.hear(data)

    def read(self) -> bytes:
        self.reads += 1
        if self.reads == self.dead_from:
            raise LineLost("unplugged")
        if self.world.mill.ledger.waiting and not self.world.mill.error:
            self.world.carry_out()
        received, self.received = self.received, b""
        return received

    def close(self) -> None:
        self.open -= 1


@pytest.fixture
def wire(monkeypatch):
    wire = Wire()
    monkeypatch.setattr("fresa_host.delivery.Port", wire)
    monkeypatch.setattr("fresa_host.delivery.RETRY_S", 0.001)
    monkeypatch.setattr("fresa_host.mill.ANSWER_TIME", 0.001)
    monkeypatch.setattr("fresa_host.mill.SILENCE", 0.001)
    monkeypatch.setattr("fresa_host.orders.ANSWER_TIME", 0.001)
    monkeypatch.setattr("fresa_host.orders.QUIET", 0.001)
    monkeypatch.setattr("fresa_host.orders.PAUSE", 0.001)
    return wire


def straight(count: int) -> list[Order]:
    return [Order(Kind.GO), DOWN, *(Order(Kind.GO, 0, y) for y in range(1, count - 1))]


class TestCarryOut:
    def test_whole_jobs_one_after_the_other(self, wire):
        reported = []
        with Mill("mill", timeout=PATIENCE) as mill:
            mill.carry_out(straight(5), progress=lambda done, total: reported.append((done, total)))
            mill.carry_out([UP, Order(Kind.GO, 7, 8)])
            assert mill.state().done == mill.state().taken and wire.open == 1
        assert wire.world.done == [UP, *straight(5), UP, Order(Kind.GO, 7, 8)]
        assert reported[0] == (0, 5) and reported[-1] == (5, 5)
        assert sorted(set(reported)) == reported
        assert wire.open == 0

    def test_the_same_job_twice(self, wire):
        with Mill("mill", timeout=PATIENCE) as mill:
            for _ in range(2):
                mill.carry_out(straight(3))
        assert wire.world.done == 2 * [UP, *straight(3)]

    def test_over_a_port_that_goes_and_comes(self, wire):
        with Mill("mill", timeout=PATIENCE) as mill:
            wire.dead_from = wire.reads + 9
            mill.carry_out(straight(9))
            assert wire.reads > wire.dead_from and wire.open == 1
        assert wire.world.done == [UP, *straight(9)]

    def test_goes_on_after_an_exception(self, wire):
        def give_up(done: int, total: int) -> None:
            if done == 4:
                raise KeyboardInterrupt

        with Mill("mill", timeout=PATIENCE) as mill, pytest.raises(KeyboardInterrupt):
            mill.carry_out(straight(9), progress=give_up)
        with Mill("mill", timeout=PATIENCE) as mill:
            mill.carry_out(straight(9))
        assert wire.world.done == [UP, *straight(9)]

    def test_another_job_is_thrown_away_by_force_alone(self, wire):
        def give_up(done: int, total: int) -> None:
            if done == 4:
                raise KeyboardInterrupt

        with Mill("mill", timeout=PATIENCE) as mill:
            with pytest.raises(KeyboardInterrupt):
                mill.carry_out(straight(9), progress=give_up)
            while wire.world.mill.ledger.waiting:
                mill.state()
            done = list(wire.world.done)
            for call in (mill.home, lambda: mill.carry_out([UP])):
                with pytest.raises(JobHalfDone, match=f"up to its order {len(done)}"):
                    call()
            assert wire.world.done == done
            mill.home(force=True)
        assert wire.world.done == [*done, UP, Order(Kind.GO)]

    def test_it_is_stopped_from_another_thread_and_goes_on(self, wire):
        def stop(done: int, total: int) -> None:
            if done == 3:
                assert mill.is_moving()
                mill.stop()

        with Mill("mill", timeout=PATIENCE) as mill:
            assert not mill.is_moving() and repr(mill) == "Mill('mill')"
            mill.stop()  # nothing to stop
            with pytest.raises(JobStopped, match="[345] of 9 orders are done, the same call goes"):
                mill.carry_out(straight(9), progress=stop)
            assert not mill.is_moving() or wire.world.mill.ledger.waiting
            mill.carry_out(straight(9))
        assert wire.world.done == [UP, *straight(9)]

    @pytest.mark.parametrize(("orders", "message"), [
        ([], "at least one order"),
        ([Order(Kind.GO), DOWN, Order(Kind.GO, 3, 4)], "order 3, go 3 4: .* no straight line"),
        ([DOWN, Order(Kind.GO, 0, 4)], "order 1, down: the place is unknown")])
    def test_what_cannot_be_is_not_begun(self, wire, orders, message):
        with Mill("mill", timeout=PATIENCE) as mill, pytest.raises(ValueError, match=message):
            mill.carry_out(orders)
        assert not wire.world.done and not wire.world.mill.ledger.session


def test_the_example(wire, capsys):
    rosette = runpy.run_path(str(ROOT / "examples" / "mill_rosette.py"))
    rosette["main"]("mill")
    cuts, at, lowered = set(), (0, 0), False
    for order in wire.world.done:
        if order.kind == Kind.GO:
            if lowered:
                cuts.add(frozenset({at, (order.x, order.y)}))
            at = order.x, order.y
        lowered = order.kind == Kind.DOWN or lowered and order.kind == Kind.GO
    assert len(cuts) == 4 * 2 * 3 and at == (0, 0) and not lowered
    corners = {corner for cut in cuts for corner in cut}
    assert {(y, x) for x, y in corners} == corners == {(144 - x, y) for x, y in corners}
    assert capsys.readouterr().out.endswith("44 of 44 orders done\n")


class TestWrong:
    def test_answers_to_earlier_questions_are_old_news(self, wire):
        with Mill("mill", timeout=PATIENCE) as mill:
            wire.write(order_lines.request(Kind.QUERY))  # asked, and not waited for
            wire.world.mill.enable = 0
            assert mill.state().manual

    def test_a_refused_order_is_numbered_as_it_was_given(self, wire):
        def refuse(done: int, total: int) -> None:
            wire.world.mill.error = int(done == 2)

        with Mill("mill", timeout=PATIENCE) as mill:
            with pytest.raises(OrderRefused, match="refuses order 4, ") as why:
                mill.carry_out(straight(5), progress=refuse)
        assert (why.value.number, why.value.order) == (4, straight(5)[3])

    @pytest.mark.parametrize("timeout", [1.9, 0, -1, float("nan")])
    def test_too_short_a_time(self, timeout):
        with pytest.raises(ValueError, match="timeout must be at least 2 s"):
            Mill("mill", timeout=timeout)

    def test_no_port(self, wire):
        with pytest.raises(LineLost, match="nothing cannot be opened"):
            Mill("nothing")

    def test_no_mill(self, wire, monkeypatch):
        monkeypatch.setattr("fresa_host.mill.LEAST_TIMEOUT", 0)
        wire.dead = True
        with pytest.raises(TimedOut, match="--orders serial"):
            Mill("mill", timeout=0.01)
        assert wire.open == 0

    def test_silence_in_the_middle(self, wire):
        def switch_off(done: int, total: int) -> None:
            if done == 3:
                wire.dead, mill._timeout = True, 0.01

        with Mill("mill", timeout=PATIENCE) as mill:
            with pytest.raises(TimedOut, match="3 of 9 orders are done, the same call goes on"):
                mill.carry_out(straight(9), progress=switch_off)
            wire.dead, mill._timeout = False, PATIENCE
            mill.carry_out(straight(9))
        assert wire.world.done == [UP, *straight(9)]

    def test_silence_when_all_is_done(self, wire):
        def switch_off(done: int, total: int) -> None:
            if done == total:
                wire.dead, mill._timeout = True, 0.01

        with Mill("mill", timeout=PATIENCE) as mill:
            mill.carry_out(straight(4), progress=switch_off)
        assert wire.world.done == [UP, *straight(4)]

    def test_a_port_that_went_and_came_between_two_jobs(self, wire):
        with Mill("mill", timeout=PATIENCE) as mill:
            wire.dead_from = wire.reads + 1
            mill.carry_out(straight(4))
        assert wire.world.done == [UP, *straight(4)]

    def test_manual_mode(self, wire):
        wire.world.mill.enable = 0
        with Mill("mill", timeout=PATIENCE) as mill:
            assert mill.state().manual
            with pytest.raises(NotReady, match="manual"):
                mill.carry_out(job(3))

    def test_a_port_that_goes_while_it_is_asked(self, wire):
        with Mill("mill", timeout=PATIENCE) as mill:
            wire.dead_from = wire.reads + 1
            with pytest.raises(LineLost):
                mill.state()
            assert mill.state().done == 0 and wire.open == 1
