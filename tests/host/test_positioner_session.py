"""The session of a positioner: bytes and times go in, and nothing waits."""

from typing import Any

import pytest

from fresa_host import LimitReached, LineLost, PositionError, Refused, TimedOut
from fresa_host.axis_monitor import STILL
from fresa_host.positioner_lines import AXES, Limit, Refusal, Steps
from fresa_host.positioner_session import REFUSAL_TIMEOUT_S, PositionerSession
from fresa_host.positioner_state import BREAK_TIMEOUT_S, STALE_AFTER
from tests.host.fake import BREAK
from tests.host.fake_positioner import FakePositioner

STOP = [b"STOP MOT1\n", b"STOP MOT2\n", b"STOP MOT3\n"]
HERE = Steps(0, 0, 0)
FAR = Steps(10**6, 0, 0)
PERIOD = 0.1


class World:
    """A session, a positioner that reports every 0.1 s, and the time."""

    def __init__(self, *, left: Steps | None = None, **options: Any) -> None:
        self.fake = FakePositioner()
        self.fake.pause = 0.0
        self.fake.can_break = options.setdefault("can_break", False)
        self.session = PositionerSession(baud=10**6, **options)
        self.now = 100.0
        self.messages: list = []
        self.run(self.session.connect() if left is None else self.session.restore(left))
        self.fake.written.clear()

    def send(self) -> None:
        for data, after_break in self.session.take_outputs():
            if after_break:
                self.fake.send_break()
            self.fake.write(data)

    def hear(self, data: bytes = b"") -> None:
        data, self.fake.coming = self.fake.coming + data, b""
        self.messages += self.session.receive(data, self.now)
        self.send()

    def tick(self, count: int = 1) -> None:
        for _ in range(count):
            if self.session.deadline < self.now + PERIOD:
                self.session.tick(self.session.deadline)
                self.send()
            self.now += PERIOD
            self.fake.idle()
            self.hear()

    def do(self, work: Any, *args: object) -> None:
        work(*args, self.now)
        self.send()

    def run(self, steps: Any) -> Any:
        operation = self.session.begin(steps, self.now)
        self.send()
        for _ in range(1000):
            if operation.done:
                return operation.result()
            self.tick()
        raise AssertionError("it never ends")


@pytest.fixture
def world() -> World:
    return World()


@pytest.fixture
def attended() -> World:
    """A world whose session is attended and can break."""
    world = World(left=HERE, attended=True, can_break=True)
    world.do(world.session.keep_reset_marker)
    world.fake.written.clear()
    return world


class TestOperations:
    def test_an_order_is_obeyed_when_two_reports_came_without_a_refusal(self, world):
        begun = world.now
        world.run(world.session.command(b"VEL MOT1 100\n"))
        assert world.now == pytest.approx(begun + 2 * PERIOD)
        world.fake.refuse = {b"VEL": b"! RANGE\n"}
        with pytest.raises(Refused, match="RANGE"):
            world.run(world.session.command(b"VEL MOT1 100\n"))

    def test_a_report_before_the_order_is_on_the_line_counts_for_nothing(self):
        session = PositionerSession(baud=1000)
        operation = session.begin(session.command(10 * b"x"), 5.0)
        assert session.sent_at == operation.deadline == session.deadline == pytest.approx(5.1)
        session.receive(b"# POS 0 0 0 :\n" * 9, 5.05)
        session.tick(5.1)
        assert session.deadline == pytest.approx(5.1 + REFUSAL_TIMEOUT_S)
        session.receive(b"# POS 0 0 0 :\n", 5.15)
        assert not operation.done
        session.receive(b"# POS 0 0 0 :\n", 5.16)
        assert operation.done

    def test_silence_ends_what_waits_at_its_deadline(self, world):
        world.fake.connected = False
        operation = world.session.begin(world.session.command(b"VEL MOT1 100\n"), world.now)
        world.session.tick(world.session.sent_at)
        due = world.session.deadline
        assert due == pytest.approx(world.now + 2, abs=0.01)
        world.session.tick(due - 0.01)
        assert not operation.done
        world.session.tick(due)
        with pytest.raises(TimedOut, match="it may not have obeyed"):
            operation.result()

    def test_a_machine_that_is_not_there(self):
        session = PositionerSession(name="/dev/tty", timeout=1.5)
        operation = session.begin(session.connect(), 7.0)
        assert session.deadline == 8.5
        session.tick(8.5)
        with pytest.raises(TimedOut, match="no machine reports at /dev/tty: is it on"):
            operation.result()
        assert not session.connected

    def test_a_lost_line_fails_what_waits_and_all_that_follows(self, world):
        operation = world.session.begin(world.session.command(b"VEL MOT1 100\n"), world.now)
        world.session.take_outputs()
        world.session.lose(LineLost("unplugged"))
        with pytest.raises(LineLost, match="unplugged"):
            operation.result()
        for work in (world.session.check, world.session.place,
                     lambda now: world.session.begin(world.session.connect(), now)):
            with pytest.raises(LineLost, match="unplugged"):
                work(world.now)
        world.session.halt(world.now)
        assert not world.session.take_outputs()

    def test_what_is_cancelled_does_not_go_on(self, world):
        operation = world.session.begin(world.session.move_to(7, FAR), world.now)
        world.send()
        operation.cancel()
        world.tick(5)
        assert world.fake.written == [b"P 7 1000000 0 0\n"]


class TestGoing:
    def test_it_goes_when_the_place_was_not_refused(self, world):
        world.run(world.session.move_to(7, Steps(5000, -3000, 0)))
        assert world.fake.written == [b"P 7 5000 -3000 0\n", b"GOTO 7\n"]
        assert world.session.target == (5000, -3000, 0)
        while not (progress := world.run(world.session.progress())).arrived:
            assert world.session.in_motion
            world.tick()
        assert progress.place.steps == (5000, -3000, 0) and world.session.target is None

    def test_from_where_it_was_sent_it_goes_on_at_once(self, world):
        world.run(world.session.move_to(7, Steps(1, 2, 3)))
        while not world.run(world.session.progress()).arrived:
            world.tick()
        for to in ((50_000, None, None), (9, 9, 9), (None, 5, None)):  # also on the way
            operation = world.session.begin(world.session.move_to(7, to), world.now)
            assert [line[:4] for line, _ in world.session.take_outputs()] == [b"P 7 ", b"GOTO"]
            world.tick()
            operation.cancel()  # what it was sent is not known then
            assert world.session.sent("x") is None
            world.run(world.session.move_to(7, Steps(1, 2, 3)))

    def test_from_elsewhere_the_place_is_known_before_it_goes(self, world):
        world.run(world.session.move_to(7, Steps(1, 2, 3)))
        world.session.stop(["y"], world.now)
        world.send()
        world.session.begin(world.session.move_to(7, Steps(5, 5, 5)), world.now)
        assert [line[:4] for line, _ in world.session.take_outputs()] == [b"P 7 "]

    def test_a_refused_place_stops_all_until_they_stand(self, world):
        world.run(world.session.move_to(7, FAR))
        world.fake.written.clear()
        world.fake.damage = {b"P 7 5 0 0\n": b"P 7 x 0 0\n", STOP[1]: b"STOX MOT2\n"}
        with pytest.raises(Refused, match="ARGUMENT"):
            world.run(world.session.move_to(7, Steps(5, 0, 0)))
        assert world.fake.written == [b"P 7 5 0 0\n", b"GOTO 7\n", *STOP, *STOP]
        assert world.fake.resting
        assert world.session.target is None

    def test_an_axis_that_does_not_hear_to_stop_is_stopped_by_a_break(self):
        world = World(can_break=True)
        world.fake.damage = {b"P 7 1000 0 0\n": b"P 7 -1000000 0 0\n"}
        world.fake.deaf = 3 * [STOP[0]]
        world.run(world.session.move_to(7, Steps(1000, 0, 0)))
        with pytest.raises(PositionError, match="did not go to"):
            for _ in range(50):
                world.tick()
                world.run(world.session.progress())
        assert world.fake.written.count(BREAK) == 1 and world.fake.resting
        world.tick(5)
        world.session.check(world.now)  # the line that the break damaged is refused to no call

    def test_an_axis_that_stands_elsewhere_is_an_error_after_20_seconds(self, world):
        world.fake.damage = {b"P 7 1000 0 0\n": b"P 7 100 0 0\n"}
        world.run(world.session.move_to(7, Steps(1000, 0, 0)))
        begun = world.now
        with pytest.raises(PositionError, match="it stands at"):
            while True:
                world.tick()
                world.run(world.session.progress())
        assert world.now - begun == pytest.approx(STILL * PERIOD, abs=6 * PERIOD)

    def test_axes_ordered_since_do_not_depart(self, world):
        operation = world.session.begin(world.session.move_to(7, Steps(10**6, 5, 0)), world.now)
        world.send()
        world.do(world.session.stop, ["x"])
        world.tick(6)
        assert operation.done and world.fake.written[-2:] == [b"GOTO 7\n", STOP[0]]
        assert world.session.target == (None, 5, 0)
        operation = world.session.begin(world.session.move_to(7, FAR), world.now)
        world.send()
        world.do(world.session.stop, AXES)
        world.fake.written.clear()
        world.tick(6)
        assert operation.done and not world.fake.written


class TestLimits:
    def test_one_that_may_be_of_a_movement_before_ends_the_one_since(self, world):
        world.do(world.session.jog, "x", -1)
        world.hear(b"! LIMIT MOT1\n")
        assert world.fake.written == [b"MOV MOT1 CC\n", STOP[0]] and world.fake.resting
        with pytest.raises(LimitReached, match="x"):
            world.session.check(world.now)
        assert world.session.limits == {"x"}

    def test_one_that_is_of_this_movement_needs_no_stop(self, world):
        world.do(world.session.jog, "x", -1)
        world.tick(2)
        world.hear(b"! LIMIT MOT1\n")
        assert world.fake.written == [b"MOV MOT1 CC\n"]
        with pytest.raises(LimitReached):
            world.session.check(world.now)
        world.session.check(world.now)  # once
        world.do(world.session.jog, "x", 1)
        assert not world.session.limits

    def test_a_held_jog_goes_on_unless_it_is_blocked_again(self, attended):
        attended.do(attended.session.jog, "x", -1)
        attended.hear(b"! LIMIT MOT1\n")
        assert attended.fake.written == 2 * [b"MOV MOT1 CC\n"] and not attended.session.limits
        attended.tick(2)
        attended.hear(b"! LIMIT MOT1\n")
        assert attended.messages[-1] == Limit("x") and attended.session.limits == {"x"}
        assert attended.fake.written == 2 * [b"MOV MOT1 CC\n"]


class TestAttended:
    def test_what_moves_without_an_order_is_stopped_and_then_broken(self, attended):
        attended.fake.target = [10**6, 0, 0]
        attended.fake.deaf = 2 * [STOP[0]]
        attended.tick()
        assert attended.fake.written == STOP[:1]
        attended.tick()
        assert attended.fake.written == [STOP[0], BREAK, STOP[0], *STOP, b"P 7 0 0 0\n"]
        assert attended.session.halts == 1

    def test_no_break_while_another_axis_is_to_move(self, attended):
        attended.do(attended.session.jog, "y", 1)
        attended.fake.target[0] = 10**6
        attended.fake.deaf = 3 * [STOP[0]]
        attended.tick(6)
        assert attended.fake.written == [b"MOV MOT2 C\n", *4 * STOP[:1]]

    def test_a_session_that_is_not_attended_stops_nothing_by_itself(self, world):
        world.fake.target = [10**6, 0, 0]
        world.tick(5)
        assert not world.fake.written

    def test_a_break_sends_again_what_it_may_have_damaged(self, attended):
        attended.do(attended.session.set_speed, "y", 200)
        attended.fake.written.clear()
        attended.do(attended.session.halt)
        assert attended.fake.written == [BREAK, STOP[0], *STOP, b"VEL MOT2 200\n", b"P 7 0 0 0\n"]
        attended.messages.clear()
        attended.tick(2)
        assert attended.messages == [Steps(0, 0, 0)]  # and no refusal
        attended.now += BREAK_TIMEOUT_S
        attended.hear(b"! DAMAGED\n")
        assert attended.messages[-1] == Refusal("DAMAGED")

    def test_a_travel_ends_with_the_order_to_go_and_restores_its_point(self, attended):
        attended.do(attended.session.travel, 7, Steps(500, 0, 0))
        assert attended.session.in_motion
        attended.tick(2)
        assert attended.fake.written == [b"P 7 500 0 0\n", b"GOTO 7\n", b"P 7 0 0 0\n"]
        attended.tick(5)
        assert not attended.session.in_motion and attended.session.in_position()

    def test_it_departs_to_what_the_point_was(self, attended):
        attended.do(attended.session.travel, 3, Steps(500, 0, 0))
        attended.do(attended.session.keep_point, 3, Steps(1, 1, 1))
        attended.tick(2)
        assert attended.fake.written == [b"P 3 500 0 0\n", b"GOTO 3\n", b"P 3 1 1 1\n"]
        attended.do(attended.session.keep_point, 7, Steps(1, 1, 1))
        assert attended.fake.written[3:] == []

    @pytest.mark.parametrize("between", [
        lambda it: it.do(it.session.jog, "z", 1), lambda it: it.do(it.session.stop, ["z"]),
        lambda it: it.do(it.session.halt), lambda it: it.do(it.session.call_origin),
        lambda it: it.hear(b"! LIMIT MOT3\n"), lambda it: it.hear(b"! RANGE\n"),
        lambda it: it.do(it.session.travel, 1, HERE)])
    def test_what_comes_in_between_calls_it_off(self, attended, between):
        attended.do(attended.session.travel, 7, Steps(500, 0, 0))
        between(attended)
        attended.tick(5)
        assert b"GOTO 7\n" not in attended.fake.written
        assert attended.fake.points["7"] == [0, 0, 0]

    def test_silence_calls_it_off(self, attended):
        attended.fake.connected = False
        attended.do(attended.session.travel, 7, Steps(500, 0, 0))
        attended.tick(25)
        attended.fake.connected = True
        attended.tick(5)
        assert attended.fake.written == [b"P 7 500 0 0\n", b"P 7 0 0 0\n"]

    def test_what_is_refused_on_the_way_stops_all(self, attended):
        attended.do(attended.session.travel, 1, FAR)
        attended.tick(4)
        attended.hear(b"! COMMAND\n")
        assert attended.messages[-1] == Refusal("COMMAND") and attended.fake.resting
        assert not attended.session.in_motion and attended.session.halts == 1

    def test_reports_that_do_not_come(self, attended):
        assert not attended.session.stale(attended.now + STALE_AFTER)
        assert attended.session.stale(attended.now + STALE_AFTER + 0.01)


class TestRestoring:
    def test_what_was_left_moving_is_stopped(self):
        world = World(left=HERE, attended=True)
        world.fake.target = [10**6, 0, 0]
        world.fake.deaf = 2 * [STOP[0]]
        assert world.run(world.session.restore(HERE)) is False
        assert world.fake.resting and world.session.steps == tuple(world.fake.steps)

    def test_a_machine_that_was_reset_is_told_its_place(self):
        world = World(left=Steps(5, -5, 7), attended=True)
        assert world.session.connected and world.session.steps == (5, -5, 7)
        assert world.fake.steps == [5, -5, 7]
        assert not world.messages  # nothing before is to be acted on

    def test_a_machine_that_stands_at_an_origin_of_its_own_is_believed(self):
        world = World(left=HERE, attended=True)
        world.do(world.session.keep_reset_marker)
        assert world.run(world.session.restore(Steps(5, -5, 7))) is False
        assert world.session.steps == (0, 0, 0)
        assert not any(line.startswith(b"POS") for line in world.fake.written)

    def test_it_is_left_still_and_without_power(self, attended):
        attended.do(attended.session.jog, "x", 1)
        attended.tick(3)
        attended.run(attended.session.bring_to_rest())
        attended.do(attended.session.leave)
        assert not attended.fake.connected and attended.fake.resting
        assert attended.session.steps == tuple(attended.fake.steps)
        assert not attended.session.connected
