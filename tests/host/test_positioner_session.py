"""The session of a positioner: bytes and times go in, and nothing waits."""

import math
from typing import Any

import pytest

from fresa_host import LimitReached, LineLost, PositionError, Refused, TimedOut, WasReset
from fresa_host.axis_monitor import STILL
from fresa_host.positioner_attended import AttendedSession
from fresa_host.positioner_lines import AXES, Limit, Refusal, Steps
from fresa_host.positioner_session import ANSWER_TIMEOUT_S, PositionerSession
from fresa_host.positioner_state import STALE_AFTER
from tests.host.fake import BREAK
from tests.host.fake_positioner import FakePositioner

STOP = [b"STOP MOT1\n", b"STOP MOT2\n", b"STOP MOT3\n"]
HERE = Steps(0, 0, 0)
FAR = Steps(10**6, 0, 0)
PERIOD = 0.1


class World:
    """A session, a positioner that reports every 0.1 s, and the time."""

    def __init__(self, kind: type[PositionerSession] = PositionerSession, *,
                 left: Steps | None = None, least: float = 0.0, can_break: bool = False,
                 reset: bool = False) -> None:
        self.fake = FakePositioner()
        if left is not None and not reset:
            self.fake.speeds = [227, 114, 57]  # as it was left
        self.fake.pause = 0.0
        self.fake.can_break = can_break
        self.session: Any = kind(baud=10**6, can_break=can_break)
        self.now = 100.0
        self.messages: list = []
        self.run(self.session.connect() if left is None else self.session.restore(left, least))
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
    return World(AttendedSession, left=HERE, can_break=True)


class TestAnswers:
    def test_an_order_ends_with_its_answer(self, world):
        operation = world.session.begin(world.session.command(b"VEL MOT1 100\n"), world.now)
        world.send()
        world.hear(b"# POS 0 0 0 :")
        assert operation.done  # at once: no report is waited for
        world.fake.refuse = {b"VEL": b"! RANGE\n"}
        with pytest.raises(Refused, match="RANGE"):
            world.run(world.session.command(b"VEL MOT1 100\n"))

    def test_what_is_refused_is_the_line_that_is_refused(self, world):
        """And not the one behind it, whose answer comes with it."""
        world.do(world.session.jog, "x", 1)
        operation = world.session.begin(world.session.command(b"VEL MOT1 100\n"), world.now)
        world.hear()
        world.fake.damage = {b"MOV MOT2 C\n": b"MOV MOT2 x\n"}
        world.do(world.session.jog, "y", 1)
        world.hear()
        operation.result()
        with pytest.raises(Refused, match="ARGUMENT"):
            world.run(world.session.command(b"VEL MOT1 50\n"))  # which is not sent then
        assert world.fake.orders == [b"MOV MOT1 C\n", b"VEL MOT1 100\n", b"MOV MOT2 C\n"]

    @pytest.mark.parametrize("lost", ["deaf", "mute"])
    def test_an_order_or_answer_that_is_lost_is_seen_by_the_state(self, world, lost):
        setattr(world.fake, lost, [b"VEL MOT1 100\n"])
        begun = world.now
        world.run(world.session.command(b"VEL MOT1 100\n"))
        assert world.fake.written == [b"VEL MOT1 100\n", b"STATE\n", b"VEL MOT1 100\n"]
        assert world.now < begun + ANSWER_TIMEOUT_S + 4 * PERIOD and world.fake.speeds[0] == 100

    def test_lines_that_have_merged_shift_no_answer_for_ever(self, world):
        for _ in range(3):
            world.fake.damage = {b"MOV MOT1 C\n": b"MOV MOT1 C"}
            world.do(world.session.jog, "x", 1)
            world.do(world.session.jog, "y", 1)
            world.do(world.session.jog, "z", 1)
            world.hear()
            with pytest.raises(Refused, match="COMMAND"):
                world.run(world.session.check())  # of the first
            world.run(world.session.check())
        world.fake.damage = {b"VEL MOT1 5\n": b"VEL MOT1 5", b"VEL MOT2 5\n": b"VEL MOT2 x\n"}
        with pytest.raises(Refused):  # with the STATE behind it
            world.run(world.session.command(b"VEL MOT1 5\n"))
        with pytest.raises(Refused, match="RANGE"):
            world.run(world.session.command(b"VEL MOT2 5\n"))
        world.run(world.session.command(b"VEL MOT3 5\n"))
        assert world.fake.speeds == [200, 200, 5]

    @pytest.mark.parametrize("damaged", [b"STATE", b"STAT\n"])
    def test_a_state_that_is_lost_is_asked_for_again(self, world, damaged):
        world.fake.damage = {b"STATE\n": damaged}
        state = world.run(world.session.state())
        assert state == (True, (False,) * 3, (200,) * 3, (False,) * 3, (0, 0, 0), 1000)
        assert world.fake.written == [b"STATE\n", *4 * [b"\n"], b"STATE\n"]
        world.fake.refuse = {b"VEL": b"! RANGE\n"}
        with pytest.raises(Refused, match="RANGE"):  # not the answer to the empty line
            world.run(world.session.command(b"VEL MOT1 100\n"))

    def test_answers_that_are_late_are_not_those_of_later_lines(self, world):
        operation = world.session.begin(world.session.command(b"VEL MOT1 100\n"), world.now)
        world.session.take_outputs()
        for _ in range(2):  # no answer; none to the STATE
            world.now += ANSWER_TIMEOUT_S + 0.1
            world.session.tick(world.now)
        operation.cancel()
        operation = world.session.begin(world.session.command(b"VEL MOT2 1\n"), world.now)
        state = b"STATE 1 0 0 0 200 200 200 0 0 0 0 0 0 7\n"
        world.session.take_outputs()
        for late in (b"! RANGE\n" + state, 2 * b"! COMMAND\n" + state):
            world.now += 0.3
            world.session.receive(late, world.now)
            assert not operation.done and world.session._unanswered.in_doubt
        world.send()
        world.tick(20)
        assert operation.result() is None and world.fake.speeds[1] == 1

    def test_the_answer_to_a_state_that_another_program_asked_for(self):
        world = World()
        world.fake.queue = [b"STATE\n"]  # it was ended then
        world.run(world.session.connect())
        world.run(world.session.command(b"VEL MOT2 1\n"))

    def test_an_overflow_stands_for_any_number_of_lines(self, world):
        world.do(world.session.jog, "x", 1)
        world.hear()
        world.fake.mute = [b"MOV MOT2 C\n", b"MOV MOT3 C\n"]
        world.do(world.session.jog, "y", 1)
        world.do(world.session.jog, "z", 1)
        world.hear(b"! OVERFLOW\n")
        world.fake.written.clear()
        world.run(world.session.command(b"VEL MOT1 5\n"))
        assert world.fake.orders == [b"MOV MOT2 C\n", b"MOV MOT3 C\n", b"VEL MOT1 5\n"]

    def test_lines_at_once_that_keep_coming_hold_up_no_order(self, world):
        """The order waits for the answers to those before it only."""
        world.do(world.session.stop, ["x"])
        operation = world.session.begin(world.session.command(b"VEL MOT1 5\n"), world.now)
        for _ in range(10):
            world.do(world.session.stop, ["x"])
            first, _, rest = world.fake.coming.partition(b"\n")
            world.fake.coming = b""
            world.hear(first + b"\n")
            world.fake.coming = rest + world.fake.coming
        assert world.session._unanswered.last is not None and operation.done

    @pytest.mark.parametrize("lost", ["deaf", "mute"])
    @pytest.mark.parametrize("call", [
        lambda it: it.check(), lambda it: it.state(), lambda it: it.command(b"VEL MOT2 9\n"),
        lambda it: it.store(1, HERE), lambda it: it.move_to(7, (None, 5, 0)),
        lambda it: it.rename_axis("y", 5)])
    def test_an_order_to_stop_at_once_that_is_lost_is_sent_again(self, world, lost, call):
        world.do(world.session.jog, "x", 1)
        world.tick(2)
        setattr(world.fake, lost, [STOP[0]])
        world.do(world.session.stop, ["x"])
        world.fake.written.clear()
        world.run(call(world.session))
        assert world.fake.target[0] == world.fake.steps[0] and world.fake.orders[0] == STOP[0]

    def test_an_order_to_jog_that_is_lost_is_sent_again_unless_another_came(self, world):
        world.fake.deaf = [b"MOV MOT1 C\n", b"MOV MOT2 C\n", b"MOV MOT3 C\n"]
        for axis in AXES:
            world.do(world.session.jog, axis, 1)
        world.do(world.session.stop, ["y"])
        world.fake.written.clear()
        world.run(world.session.move_to(7, (None, None, 5)))
        assert [line for line in world.fake.orders if line.startswith(b"MOV")] == [b"MOV MOT1 C\n"]
        assert world.session.target == (None, 0, 5)

    def test_one_that_never_arrives_is_an_error(self, world):
        world.do(world.session.jog, "x", 1)
        world.tick()
        world.fake.deaf = 9 * [STOP[0]]
        world.do(world.session.stop, ["x"])
        with pytest.raises(TimedOut, match="it may not have obeyed"):
            world.run(world.session.check())

    def test_what_was_ordered_before_the_machine_answers_is_checked(self):
        world = World()
        world.run(world.session.disconnect())
        world.do(world.session.release)
        world.fake.refuse = {b"MOV": b"! DISCONNECTED\n"}
        world.do(world.session.jog, "x", 1)
        with pytest.raises(Refused, match="DISCONNECTED"):
            world.run(world.session.check())

    def test_unanswered_lines_are_bounded(self, world):
        world.fake.original = True
        for _ in range(100):
            world.do(world.session.stop, ["x"])
        assert len(world.session._unanswered._lines) < 32
        world.fake.original = False
        world.run(world.session.command(b"VEL MOT3 5\n"))

    def test_a_line_that_never_ends_is_not_kept(self, world):
        for noise in (b"#", b"# POS 1", b"ok", b"STATE 1 ", b"\x00"):
            world.hear(1000 * noise)
        assert len(world.session._splitter._begun) <= 256
        world.hear(b"\n")
        world.run(world.session.command(b"VEL MOT3 5\n"))

    def test_silence_ends_what_waits(self, world):
        world.fake.original = True
        begun = world.now
        with pytest.raises(TimedOut, match="no machine answers at the port: is it on"):
            world.run(world.session.command(b"VEL MOT1 100\n"))
        assert world.now - begun < 2 + ANSWER_TIMEOUT_S + 2 * PERIOD

    def test_a_machine_that_is_not_there_or_was_built_as_the_original(self):
        session = PositionerSession(name="/dev/tty", timeout=1.5)
        operation = session.begin(session.connect(), 7.0)
        while not operation.done:
            assert session.deadline <= 8.5
            session.receive(b"# POS 0 0 0 :", session.deadline)
        with pytest.raises(TimedOut, match="no machine answers at /dev/tty: is it on, and built "
                                           "without --original.$"):
            operation.result()
        assert not session.connected

    def test_a_machine_that_was_reset(self, world):
        world.fake.steps = world.fake.target = [5, 0, 0]
        world.tick()
        world.fake.reset()
        with pytest.raises(WasReset):
            world.run(world.session.command(b"VEL MOT1 100\n"))
        assert world.session.steps == (5, 0, 0)  # not that of a machine that has lost it
        world.run(world.session.connect())
        world.run(world.session.command(b"VEL MOT1 100\n"))

    @pytest.mark.parametrize("call", [
        lambda it: it.state(), lambda it: it.check(), lambda it: it.move_to(7, HERE),
        lambda it: it.progress()])
    def test_every_call_says_so_until_it_is_connected_again(self, world, call):
        world.fake.reset()
        world.fake.refuse = {b"MOV": b"! DISCONNECTED\n"}
        world.do(world.session.jog, "x", 1)
        world.tick(int(STALE_AFTER / PERIOD) + 2)
        for _ in range(2):
            with pytest.raises(WasReset):
                world.run(call(world.session))
        world.run(world.session.connect())
        world.run(call(world.session))

    def test_one_damaged_state_is_no_reset(self, world):
        world.do(world.session.tick)
        operation = world.session.begin(world.session.state(), world.now)
        world.session.take_outputs()
        world.session.receive(b"STATE 0 0 0 0 200 200 200 0 0 0 0 0 0 7\n", world.now)
        world.send()
        world.tick(3)
        assert operation.result().connected

    def test_it_answers_no_more_when_it_is_left(self, world):
        world.do(world.session.release)
        assert world.fake.written == [b"ACK 0\n"] and not world.fake.acknowledges


class TestOperations:
    def test_a_lost_line_fails_what_waits_and_all_that_follows(self, world):
        operation = world.session.begin(world.session.command(b"VEL MOT1 100\n"), world.now)
        world.session.take_outputs()
        world.session.lose(LineLost("unplugged"))
        with pytest.raises(LineLost, match="unplugged"):
            operation.result()
        for work in (world.session.place,
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

    def test_a_refused_place_stops_all_until_they_stand(self, world):
        world.run(world.session.move_to(7, FAR))
        world.fake.written.clear()
        world.fake.damage = {b"P 7 5 0 0\n": b"P 7 x 0 0\n", STOP[1]: b"STOX MOT2\n"}
        with pytest.raises(Refused, match="ARGUMENT"):
            world.run(world.session.move_to(7, Steps(5, 0, 0)))
        assert world.fake.orders == [b"P 7 5 0 0\n", *STOP] and world.fake.resting
        assert world.session.target is None

    def test_an_order_to_stop_that_is_lost_is_repeated(self, world):
        world.run(world.session.move_to(7, FAR))
        world.fake.damage = {b"GOTO 7\n": b"GOTO 9\n"}
        world.fake.deaf = 2 * [STOP[0]]
        world.fake.written.clear()
        with pytest.raises(Refused, match="EMPTY"):
            world.run(world.session.go_to(7) if 7 in world.session._points else
                      world.session.move_to(7, FAR))
        assert world.fake.orders == [b"GOTO 7\n", *3 * STOP] and world.fake.resting

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
        world.run(world.session.check())  # the line that the break damaged is refused to no call

    def test_an_axis_that_stands_elsewhere_is_an_error_after_a_second(self, world):
        world.fake.damage = {b"P 7 1000 0 0\n": b"P 7 100 0 0\n"}
        world.run(world.session.move_to(7, Steps(1000, 0, 0)))
        begun = world.now
        with pytest.raises(PositionError, match="it stands at"):
            while True:
                world.tick()
                world.run(world.session.progress())
        assert world.now - begun == pytest.approx(STILL * PERIOD, abs=8 * PERIOD)

    def test_one_that_takes_up_backlash_is_on_its_way(self, world):
        world.fake.backlash = 3 * STILL
        world.run(world.session.move_to(7, Steps(1000, 0, 0)))
        while not world.run(world.session.progress()).arrived:
            world.tick()
        assert world.fake.steps == [1000, 0, 0] and not world.fake.backlash

    def test_axes_ordered_since_do_not_depart(self, world):
        operation = world.session.begin(world.session.move_to(7, Steps(10**6, 5, 0)), world.now)
        world.send()
        world.do(world.session.stop, ["x"])
        world.tick(6)
        assert operation.done and world.fake.orders[-2:] == [b"GOTO 7\n", STOP[0]]
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
        world.fake.coming = b"! LIMIT MOT1\n" + world.fake.coming
        world.hear()
        assert world.fake.written == [b"MOV MOT1 CC\n", STOP[0]] and world.fake.resting
        with pytest.raises(LimitReached, match="x"):
            world.run(world.session.check())
        assert world.session.limits == {"x"}

    def test_one_that_is_of_this_movement_needs_no_stop(self, world):
        world.do(world.session.jog, "x", -1)
        world.tick(2)
        world.hear(b"! LIMIT MOT1\n")
        assert world.fake.written == [b"MOV MOT1 CC\n"]
        with pytest.raises(LimitReached):
            world.run(world.session.check())
        world.run(world.session.check())  # once
        world.do(world.session.jog, "x", 1)
        assert not world.session.limits

    def test_a_held_jog_goes_on_unless_it_is_blocked_again(self, attended):
        attended.do(attended.session.jog, "x", -1)
        attended.fake.coming = b"! LIMIT MOT1\n" + attended.fake.coming
        attended.hear()
        assert attended.fake.orders == 2 * [b"MOV MOT1 CC\n"] and not attended.session.limits
        attended.tick(2)
        attended.hear(b"! LIMIT MOT1\n")
        assert attended.messages[-1] == Limit("x") and attended.session.limits == {"x"}
        assert attended.fake.orders == 2 * [b"MOV MOT1 CC\n"]


class TestAttended:
    def test_what_is_released_stands_by_the_machines_word(self, attended):
        attended.do(attended.session.jog, "x", 1)
        attended.tick(5)
        assert not attended.session.at_rest and not attended.session.in_motion
        attended.do(attended.session.stop, ["x"])
        assert not attended.session.at_rest
        attended.tick(2)
        assert attended.session.at_rest and attended.fake.orders == [b"MOV MOT1 C\n", STOP[0]]
        attended.fake.written.clear()
        attended.tick(20)
        assert not attended.fake.written  # nothing is asked without a reason

    @pytest.mark.parametrize("lost", [
        lambda fake: fake.deaf.append(STOP[0]),
        lambda fake: fake.damage.update({STOP[0]: b"STOP MOT1"}),  # merges with STATE
        lambda fake: fake.deaf.extend([STOP[0], b"STATE\n"])])
    def test_an_order_to_stop_that_is_lost_is_repeated(self, attended, lost):
        attended.do(attended.session.jog, "x", 1)
        attended.tick(5)
        lost(attended.fake)
        attended.do(attended.session.stop, ["x"])
        attended.tick(4)
        assert attended.fake.resting
        attended.tick(12)
        assert attended.session.at_rest and not attended.session.halts

    def test_what_moves_without_an_order_is_stopped_and_then_broken(self, attended):
        attended.fake.target = [10**6, 0, 0]
        attended.fake.deaf = 2 * [STOP[0]]
        attended.tick(2)
        assert attended.fake.written == [b"STATE\n", STOP[0], b"STATE\n"]
        assert not attended.session.at_rest
        attended.tick(6)
        assert attended.session.halts == 1 and attended.fake.written.count(BREAK) == 1
        assert attended.fake.resting and attended.session.at_rest

    def test_no_break_while_another_axis_is_to_move(self, attended):
        attended.do(attended.session.jog, "y", 1)
        attended.fake.target[0] = 10**6
        attended.fake.deaf = 3 * [STOP[0]]
        attended.tick(8)
        assert attended.fake.orders == [b"MOV MOT2 C\n", *4 * STOP[:1]]
        assert attended.fake.target[1] == 10**6

    def test_a_session_that_is_not_attended_stops_nothing_by_itself(self, world):
        world.fake.target = [10**6, 0, 0]
        world.tick(5)
        assert not world.fake.written

    def test_settings_are_sent_until_they_are_obeyed_the_last_of_each(self, attended):
        attended.fake.deaf = [b"VEL MOT2 200\n"]
        for speed in (200, 300, 400):
            attended.do(attended.session.set_speed, "y", speed)
        attended.do(attended.session.keep_point, 7, Steps(1, 2, 3))
        attended.tick(12)
        assert attended.fake.orders == 2 * [b"VEL MOT2 200\n"] + [
            b"VEL MOT2 400\n", b"P 7 1 2 3\n"]

    def test_one_that_is_refused_is_shown_and_given_up(self, attended):
        attended.fake.refuse = {b"VEL": b"! RANGE\n"}
        attended.do(attended.session.set_speed, "y", 1500)
        attended.do(attended.session.keep_point, 7, Steps(1, 2, 3))
        attended.tick(10)
        assert attended.messages.count(Refusal("RANGE")) == 3
        assert attended.fake.points["7"] == [1, 2, 3]

    def test_one_that_the_line_damages_is_not_given_up(self, attended):
        attended.fake.refuse = {b"VEL": b"! DAMAGED\n"}
        attended.do(attended.session.set_speed, "y", 1500)
        attended.tick(20)
        attended.fake.refuse = {}
        attended.tick(15)  # it is sent again every second
        assert attended.fake.speeds[1] == 1500

    def test_one_that_is_always_refused_does_not_keep_it_connecting(self):
        world = World(AttendedSession, left=HERE)
        world.fake.refuse = {b"VEL": b"! COMMAND\n"}
        world.session.set_speed("y", 1500, world.now)
        with pytest.raises(TimedOut, match="it may not have obeyed"):
            world.run(world.session.restore(HERE, 0))

    @pytest.mark.parametrize("lost", ["deaf", "mute"])
    def test_an_origin_is_sent_until_it_is_obeyed(self, attended, lost):
        attended.fake.steps = attended.fake.target = [5, 0, 0]
        setattr(attended.fake, lost, [b"ORIGIN\n"])
        attended.run(attended.session.call_origin())
        assert attended.fake.steps == [0, 0, 0] and attended.session.steps == HERE
        assert attended.fake.orders.count(b"ORIGIN\n") == 2

    def test_there_is_no_origin_where_it_moves(self, attended):
        attended.do(attended.session.jog, "x", 1)
        attended.tick(2)
        with pytest.raises(TimedOut, match="x moves: stop it first"):
            attended.run(attended.session.call_origin())
        assert b"ORIGIN\n" not in attended.fake.orders

    @pytest.mark.parametrize("seen", [1, 4])
    def test_one_that_is_reset_in_a_jog_is_not_at_rest(self, attended, seen):
        attended.do(attended.session.jog, "x", 1)
        attended.tick(seen)
        attended.fake.reset()
        attended.do(attended.session.stop, ["x"])
        attended.tick(20)
        assert not attended.session.at_rest
        assert attended.fake.written.count(b"STATE\n") < 8  # it is not asked for ever
        with pytest.raises(WasReset):
            attended.run(attended.session.bring_to_rest())

    def test_a_break_loses_no_setting(self, attended):
        attended.do(attended.session.jog, "x", 1)
        attended.hear()
        attended.fake.deaf = [b"VEL MOT2 150\n"]  # the break damages it
        attended.do(attended.session.set_speed, "y", 150)
        attended.do(attended.session.halt)
        assert attended.fake.orders == [
            b"MOV MOT1 C\n", b"VEL MOT2 150\n", BREAK, *STOP]
        attended.messages.clear()
        attended.tick(5)
        assert attended.fake.speeds[1] == 150 and attended.session.at_rest
        assert set(map(type, attended.messages)) == {Steps}  # and no refusal
        attended.hear(b"! DAMAGED\n")
        assert attended.messages[-1] == Refusal("DAMAGED")

    def test_a_travel_departs_when_its_point_is_obeyed(self, attended):
        begun = attended.now
        attended.do(attended.session.travel, 7, Steps(500, 0, 0))
        assert attended.session.in_motion and attended.fake.orders == [b"P 7 500 0 0\n"]
        attended.hear()
        assert attended.fake.orders == [b"P 7 500 0 0\n", b"GOTO 7\n"] and attended.now == begun
        attended.tick(5)
        assert not attended.session.in_motion and attended.session.in_position()
        assert attended.session.at_rest

    @pytest.mark.parametrize(("order", "lost"), [
        (b"P 7 500 0 0\n", "deaf"), (b"GOTO 7\n", "deaf"), (b"P 7 500 0 0\n", "mute"),
        (b"GOTO 7\n", "mute")])
    def test_a_travel_goes_though_a_line_or_an_answer_is_lost(self, attended, order, lost):
        setattr(attended.fake, lost, [order])
        attended.do(attended.session.travel, 7, Steps(500, 0, 0))
        attended.tick(15)
        assert attended.fake.steps == [500, 0, 0] and attended.session.at_rest
        assert attended.fake.orders.count(order) == 2 and not attended.session.halts

    def test_it_departs_to_what_the_point_was(self, attended):
        attended.do(attended.session.travel, 3, Steps(500, 0, 0))
        attended.do(attended.session.keep_point, 3, Steps(1, 1, 1))
        attended.tick(6)
        assert attended.fake.orders == [b"P 3 500 0 0\n", b"GOTO 3\n", b"P 3 1 1 1\n"]
        assert attended.fake.steps == [500, 0, 0]

    def test_an_edit_that_is_lost_does_not_come_between(self, attended):
        attended.fake.deaf = [b"P 3 1 1 1\n"]
        attended.do(attended.session.keep_point, 3, Steps(1, 1, 1))
        attended.do(attended.session.keep_point, 3, Steps(500, 0, 0))
        attended.do(attended.session.travel, 3, Steps(500, 0, 0))
        attended.tick(15)
        assert attended.fake.steps == [500, 0, 0]
        assert attended.fake.orders == [b"P 3 1 1 1\n", b"P 3 500 0 0\n", b"GOTO 3\n",
                                        b"P 3 500 0 0\n"]

    @pytest.mark.parametrize("between", [
        lambda it: it.do(it.session.jog, "z", 1), lambda it: it.do(it.session.stop, ["z"]),
        lambda it: it.do(it.session.halt),
        lambda it: it.session.begin(it.session.call_origin(), it.now),
        lambda it: it.do(it.session.travel, 1, HERE)])
    def test_what_comes_in_between_calls_it_off(self, attended, between):
        attended.do(attended.session.travel, 7, Steps(500, 0, 0))
        between(attended)
        attended.tick(5)
        assert b"GOTO 7\n" not in attended.fake.orders

    @pytest.mark.parametrize("first", [b"! LIMIT MOT3\n", b"! RANGE\n"])
    def test_what_is_heard_in_between_calls_it_off(self, attended, first):
        attended.do(attended.session.travel, 7, Steps(500, 0, 0))
        attended.fake.coming = first
        attended.tick(5)
        assert b"GOTO 7\n" not in attended.fake.orders and not attended.session.in_motion
        assert attended.session.halts == (b"RANGE" in first)

    def test_silence_calls_it_off(self, attended):
        attended.fake.original = True
        attended.do(attended.session.travel, 7, Steps(500, 0, 0))
        attended.tick(30)
        assert not attended.session.in_motion
        attended.fake.original = False
        attended.tick(5)
        assert b"GOTO 7\n" not in attended.fake.orders

    def test_a_refused_order_to_go_stops_all(self, attended):
        attended.do(attended.session.travel, 1, FAR)
        attended.tick(4)
        attended.fake.damage = {b"GOTO 2\n": b"GOTO 3\n"}
        attended.do(attended.session.travel, 2, HERE)
        attended.tick(4)
        assert Refusal("EMPTY") in attended.messages and attended.fake.resting
        assert not attended.session.in_motion and attended.session.halts == 1

    def test_an_axis_that_does_not_go_there_is_stopped(self, attended):
        attended.fake.damage = {b"P 1 1000000 0 0\n": b"P 1 -1000000 0 0\n"}
        attended.do(attended.session.travel, 1, FAR)
        attended.tick(8)
        assert attended.fake.resting and attended.fake.steps[0] < 0
        x = attended.fake.steps[0]
        attended.fake.damage = {b"P 2 %d 50 0\n" % x: b"P 2 %d 5 0\n" % x}
        attended.do(attended.session.travel, 2, Steps(x, 50, 0))
        attended.tick(STILL + 5)
        assert attended.fake.steps == [x, 5, 0] and not attended.session.in_motion
        assert attended.session.at_rest

    def test_reports_that_do_not_come(self, attended):
        assert not attended.session.stale(attended.now + STALE_AFTER)
        assert attended.session.stale(attended.now + STALE_AFTER + 0.01)


class TestRestoring:
    """The fake is on for 1000 s."""

    LEFT = Steps(5, -5, 7)

    def test_what_was_left_moving_is_stopped(self):
        world = World(AttendedSession, left=HERE)
        world.fake.target = [10**6, 0, 0]
        world.fake.deaf = 2 * [STOP[0]]
        assert world.run(world.session.restore(HERE, 0)) == (False, 1000)
        assert world.fake.resting and world.session.steps == tuple(world.fake.steps)

    def test_a_machine_that_was_reset_is_sent_its_place(self):
        world = World(AttendedSession, left=self.LEFT, least=1001)
        assert world.session.connected and world.session.steps == (5, -5, 7)
        assert world.fake.steps == [5, -5, 7]
        assert not world.messages  # nothing before is to be acted on
        assert world.session.at_rest

    def test_its_speeds_tell_that_it_was_reset(self):
        """The computer's clock may have been set back since, or the reset have come soon."""
        world = World(AttendedSession, left=self.LEFT, least=-5.0, reset=True)
        assert world.fake.steps == [5, -5, 7]
        world = World(AttendedSession, left=self.LEFT, least=-math.inf, reset=True)
        assert world.fake.steps == [0, 0, 0]  # it was never connected

    def test_seconds_that_the_line_damaged_are_asked_for_again(self):
        for damaged in (0, 1):
            world = World(AttendedSession, left=HERE)
            states = iter([*(2 + damaged) * [100], 9000, *9 * [100]])  # two until it stands

            def state(world=world, states=states) -> bytes:
                world.fake.seconds = next(states)
                return FakePositioner._state(world.fake)

            world.fake._state = state
            assert world.run(world.session.restore(self.LEFT, 1000)) == (True, 100)
            assert world.fake.steps == [5, -5, 7]

    def test_one_that_has_moved_since_is_not(self):
        world = World(AttendedSession, left=HERE)
        world.fake.steps = world.fake.target = [0, 0, 5]
        assert world.run(world.session.restore(self.LEFT, 1001)) == (True, 1000)
        assert world.session.steps == (0, 0, 5) == tuple(world.fake.steps)

    def test_a_machine_that_stands_at_an_origin_of_its_own_is_believed(self):
        world = World(AttendedSession, left=self.LEFT, least=1000)
        assert world.session.steps == (0, 0, 0) == tuple(world.fake.steps)

    def test_a_place_that_is_lost_on_the_line_is_sent_again(self):
        world = World(AttendedSession, left=HERE)
        world.fake.deaf = [b"POS 5 -5 7\n"]
        assert world.run(world.session.restore(self.LEFT, 1001)) == (True, 1000)
        assert world.fake.steps == [5, -5, 7] == list(world.session.steps or ())

    def test_it_is_left_still_without_power_and_silent(self, attended):
        attended.do(attended.session.jog, "x", 1)
        attended.tick(3)
        attended.run(attended.session.bring_to_rest())
        attended.do(attended.session.leave)
        assert not attended.fake.connected and attended.fake.resting
        assert not attended.fake.acknowledges
        assert attended.session.steps == tuple(attended.fake.steps)
        assert not attended.session.connected
