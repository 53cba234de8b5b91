"""`Positioner`: what is sent, what is waited for, and what is raised."""

import threading
import time
from collections.abc import Iterator
from typing import Any

import pytest

from fresa_host import (
    LimitReached,
    LineLost,
    Place,
    Positioner,
    PositionError,
    Refused,
    TimedOut,
    WasReset,
    axis_monitor,
    positioner_session,
)
from tests.host.fake import BREAK
from tests.host.fake_positioner import FakePositioner

STOP = [b"STOP MOT1\n", b"STOP MOT2\n", b"STOP MOT3\n"]


@pytest.fixture
def fake(monkeypatch) -> FakePositioner:
    monkeypatch.setattr(positioner_session, "ANSWER_TIMEOUT_S", 0.1)
    return FakePositioner()


@pytest.fixture
def positioner(fake) -> Iterator[Positioner]:
    with opened(fake) as positioner:
        yield positioner


def opened(fake: FakePositioner, **options: Any) -> Positioner:
    port: Any = fake
    return Positioner(port, **options)


def test_it_goes_where_it_is_sent_and_says_where_it_is(positioner, fake):
    assert positioner.connect() == (0, 0, 0)
    positioner.move_to(100, -50, 0.5)
    assert positioner.wait(timeout=10).steps == Place(100, -50, 0.5).steps == (5676, -2838, 28)
    assert fake.orders == [b"CONNECT\n", b"P 7 5676 -2838 28\n", b"GOTO 7\n"]
    positioner.move_by(y=50)
    assert positioner.wait(timeout=10).steps == (5676, 0, 28)
    positioner.origin()
    assert positioner.position == (0, 0, 0)
    positioner.call_place(1, 2, 3)
    assert positioner.steps == (57, 114, 170)


def test_it_goes_to_points_that_it_has_stored(positioner, fake):
    positioner.connect()
    positioner.store(3, 10, 20, 30)
    positioner.go_to(3)
    assert positioner.wait(timeout=10) == Place.of(Place(10, 20, 30).steps)
    assert fake.orders[-2:] == [b"P 3 568 1135 1703\n", b"GOTO 3\n"]
    with pytest.raises(ValueError, match="point 4 has not been stored: store it first"):
        positioner.go_to(4)


@pytest.mark.parametrize("call", [
    lambda it: it.move_to(x="7"), lambda it: it.move_to("y", "7"), lambda it: it.move_to(),
    lambda it: it.move_to(0, float("nan"), 0), lambda it: it.move_by(z="7"),
    lambda it: it.move_to("w", 1), lambda it: it.move_to("x", 1, 2), lambda it: it.move_to("x"),
    lambda it: it.velocity("x", None), lambda it: it.store(1, 0, None, 0),
    lambda it: it.store(1.0, 0, 0, 0), lambda it: it.call_place("7", 0, 0),
    lambda it: it.set_position_reference("x", None), lambda it: it.stop("w"),
    lambda it: it.jog("x", 0), lambda it: it.home("w"), lambda it: it.move_to(1e9, 0, 0)])
def test_what_is_no_number_or_axis_is_not_sent(positioner, fake, call):
    positioner.connect()
    fake.written.clear()
    with pytest.raises(ValueError):
        call(positioner)
    assert not fake.written


def test_its_state(positioner, fake):
    positioner.connect()
    positioner.velocity("y", 10)
    positioner.jog("z", 1)
    state = positioner.state()
    assert state.connected and state.moving == (False, False, True)
    assert state.speeds == (200, 568, 200) and state.seconds == 1000
    assert positioner.get_velocity("y") == pytest.approx(10, abs=0.01)
    assert positioner.get_velocity() == pytest.approx([3.52, 10, 3.52], abs=0.01)
    fake.reset()
    with pytest.raises(WasReset):
        positioner.velocity("y", 10)
    assert positioner.connect() == (0, 0, 0)
    positioner.velocity("y", 10)


def test_it_answers_no_more_when_it_is_closed(fake):
    with opened(fake) as positioner:
        positioner.connect()
        assert fake.acknowledges
    assert not fake.acknowledges and fake.written[-1] == b"ACK 0\n" and fake.closed


def test_short_ways_add_up(positioner, fake):
    positioner.connect()
    for _ in range(20):
        positioner.move_by(0.01, z=-0.01)
    assert positioner.wait(timeout=10).steps == Place(0.2, 0, -0.2).steps == (11, 0, -11)
    for _ in range(20):
        positioner.move_by("x", -0.01)
    assert positioner.wait(timeout=10).steps == (0, 0, -11)
    positioner.stop("z")
    fake.steps = fake.target = [0, 0, -50]  # it ran on for a moment
    while positioner.steps.z != -50:
        pass
    positioner.move_by(z=1)
    assert positioner.wait(timeout=10).steps == (0, 0, 7)


def test_an_axis_goes_and_the_others_do_as_before(positioner, fake):
    positioner.connect()
    positioner.move_to(1000, 1000, 0)
    positioner.move_to("y", 5)
    positioner.move_to(z=2)
    positioner.jog("y", 1)
    positioner.move_to(x=900)
    assert fake.orders[-1] == b"MOV MOT2 C\n"
    assert positioner.wait(timeout=10).steps[::2] == Place(900, 0, 2).steps[::2]
    assert positioner.is_moving("y") and fake.target[1] == 10**6
    with pytest.raises(ValueError, match="point 7 has not been stored"):
        positioner.go_to(7)  # it is no place of y
    positioner.stop("y")
    before = fake.steps[1]
    positioner.move_to(x=0)
    assert positioner.wait(timeout=10).steps == (0, before, Place(0, 0, 2).steps.z)


def test_an_axis_that_stands_at_its_limit_stays_there(positioner, fake):
    positioner.connect()
    fake.blocked = [b"MOV MOT1 C\n"]
    positioner.jog("x", 1)
    with pytest.raises(LimitReached):
        positioner.velocity("y", 1)
    positioner.move_to(y=5)
    assert positioner.wait(timeout=10).steps == (0, 284, 0) and positioner.limits == {"x"}


def test_whether_it_moves(positioner, fake):
    assert not positioner.is_moving()
    positioner.connect()
    assert not positioner.is_moving()
    positioner.jog("z", -1)
    assert positioner.is_moving() and positioner.is_moving("z") and not positioner.is_moving("x")
    positioner.stop()
    while positioner.is_moving():
        pass
    assert fake.resting
    positioner.move_to(x=5000)
    assert positioner.is_moving("x") and not positioner.is_moving("y")
    assert positioner.wait_move("y").x < 4999 < positioner.wait_move("x", timeout=10).x
    assert not positioner.is_moving()
    positioner.jog("x", 1)
    positioner.disconnect()
    assert not positioner.is_moving()


def test_names_that_other_stages_have(positioner, fake):
    positioner.connect()
    positioner.move_to(10, 20, 30)
    assert positioner.wait_move(timeout=10) == positioner.get_position() == positioner.position
    assert positioner.get_position("y") == positioner.position.y
    positioner.set_position_reference("y", 5)
    assert positioner.steps == (568, 284, 1703)
    assert positioner.home("x", timeout=10).steps == (0, 284, 1703)
    assert positioner.home(timeout=10).steps == (0, 0, 0)
    positioner.set_position_reference(position=1)
    assert positioner.steps == (57, 57, 57) and repr(positioner) == "Positioner('fake')"
    positioner.jog("z", 1)
    with pytest.raises(TimedOut, match="moves: stop it first"):
        positioner.set_position_reference("x", 0)


def test_one_that_was_closed_says_so(fake):
    with opened(fake) as positioner:
        positioner.connect()
    for call in (lambda: positioner.position, positioner.stop, positioner.is_moving,
                 positioner.check, positioner.connect, lambda: positioner.move_by(1)):
        with pytest.raises(LineLost, match="^fake was closed$"):
            call()
    assert not positioner.connected
    positioner.close()


def test_single_commands(positioner, fake):
    assert positioner.velocity("y", 10) == pytest.approx(10, abs=0.01)
    positioner.jog("x", -1)
    positioner.stop("x")
    positioner.store(3, 1, 1, 1)
    assert fake.orders == [b"VEL MOT2 568\n", b"MOV MOT1 CC\n", b"STOP MOT1\n", b"P 3 57 57 57\n"]
    with pytest.raises(ValueError, match="speed must be 1 to 1500 steps/s, not 1703"):
        positioner.velocity("y", 30)
    with pytest.raises(ValueError, match="speed in um/s must be a number"):
        positioner.velocity("y", float("inf"))


def test_what_is_refused_is_raised(positioner, fake):
    fake.refuse = {b"P": b"! RANGE\n", b"MOV": b"! DISCONNECTED\n"}
    with pytest.raises(Refused, match=r"less or more than it may be \(RANGE\)") as caught:
        positioner.store(1, 0, 0, 0)
    assert caught.value.reason == "RANGE"
    positioner.jog("x", 1)  # at once: it is told later
    with pytest.raises(Refused, match="DISCONNECTED"):
        positioner.velocity("x", 1)
    positioner.velocity("x", 1)
    positioner.connect()
    fake.refuse = {b"GOTO": b"! EMPTY\n"}
    with pytest.raises(Refused, match="EMPTY"):
        positioner.move_to(1, 2, 3)
    positioner.wait(timeout=5)  # it goes nowhere


def test_a_place_that_is_refused_is_not_gone_to(positioner, fake):
    positioner.connect()
    positioner.move_to(20, 0, 0)
    positioner.wait(timeout=10)
    positioner.move_to(10**6, 0, 0)
    fake.damage = {b"P 7 -2838 0 0\n": b"P 7 m2838 0 0\n", STOP[1]: b"STOX MOT2\n"}
    fake.written.clear()
    with pytest.raises(Refused, match="ARGUMENT"):
        positioner.move_to(-50, 0, 0)
    # What was on its way is stopped. The order to stop that was refused moved nothing.
    assert fake.orders == [b"P 7 -2838 0 0\n", *STOP] and fake.resting
    assert positioner.wait(timeout=0.01).steps == tuple(fake.steps)
    with pytest.raises(ValueError, match="point 7 has not been stored"):
        positioner.go_to(7)
    positioner.check()


def test_a_point_that_was_refused_is_not_gone_to(positioner, fake):
    positioner.connect()
    positioner.store(3, 10, 0, 0)
    fake.damage = {b"P 3 1135 0 0\n": b"P 3 1m35 0 0\n"}
    with pytest.raises(Refused):
        positioner.store(3, 20, 0, 0)
    with pytest.raises(ValueError, match="point 3 has not been stored"):
        positioner.go_to(3)


@pytest.mark.parametrize(("order", "call"), [
    (b"POS 0 0 0\n", lambda it: it.call_place(0, 0, 0)), (b"ORIGIN\n", lambda it: it.origin()),
    (b"GOTO 7\n", lambda it: it.go_to(7)), (b"DISCONNECT\n", lambda it: it.disconnect())])
def test_what_is_refused_on_the_way_to_a_place_leaves_nothing_moving(positioner, fake, order, call):
    positioner.connect()
    positioner.move_to(10**6, 0, 0)
    fake.damage = {order: b"X" + order}
    with pytest.raises(Refused):
        call(positioner)
    assert fake.resting and positioner.connected
    positioner.wait(timeout=0.01)  # it goes nowhere


def test_who_stops_before_the_machine_was_told_to_go_is_not_overruled(positioner, fake):
    def obey(line: bytes) -> bytes:
        if line.startswith(b"P "):
            stop()
        return fake.obey(line)

    positioner.connect()
    fake.answer, stop = obey, positioner.stop
    positioner.move_to(10**6, 0, 0)
    assert b"GOTO 7\n" not in fake.orders and fake.resting
    positioner.wait(timeout=0.01)
    stop = lambda: positioner.stop("x")  # noqa: E731
    positioner.move_to(10**6, 100, 0)
    assert positioner.wait(timeout=10).steps.y == 5676
    assert fake.orders[-2:] == [b"GOTO 7\n", STOP[0]] and fake.resting


def test_going_elsewhere_is_told(positioner, fake, monkeypatch):
    positioner.connect()
    fake.damage = {b"P 7 56761 0 0\n": b"P 7 -99956761 0 0\n"}
    positioner.move_to(1000, 0, 0)
    with pytest.raises(PositionError, match=r"did not go to Place\(x=999.9.*, and was stopped at "
                                            r"Place"):
        positioner.wait()
    assert fake.resting
    positioner.wait(timeout=0.01)  # it goes nowhere
    fake.steps = fake.target = [0, 0, 0]
    monkeypatch.setattr(axis_monitor, "STILL", 5)
    fake.damage = {b"P 7 5676 0 0\n": b"P 7 1676 0 0\n"}
    positioner.move_to(100, 0, 0)
    with pytest.raises(PositionError, match=r"stands at Place\(x=29.5.*, not at Place\(x=99.9"):
        positioner.wait()


def test_a_report_that_was_damaged_is_not_believed():
    for damaged in (9000, -9000, 130):
        monitor = axis_monitor.AxisMonitor(400)
        for x in (100, 110, 120, damaged, 140, 150):
            monitor.update(x)
            assert not monitor.leads_away and not monitor.stands


@pytest.mark.parametrize("again", [lambda it: it.jog("x", -1), lambda it: it.move_to(-900, 900, 0)])
def test_a_limit_that_may_be_of_a_movement_before_ends_the_one_since(positioner, fake, again):
    """Nobody knows which it ended; so that what is told is true, both have to be."""
    def obey(line: bytes) -> bytes:
        late = b"! LIMIT MOT1\n" if line in (b"MOV MOT1 CC\n", b"GOTO 7\n") else b""
        return late + fake.obey(line)

    positioner.connect()
    positioner.jog("x", 1)
    fake.answer = obey
    with pytest.raises(LimitReached):
        again(positioner)
        positioner.velocity("x", 1)
    assert STOP[0] in fake.orders
    positioner.wait(timeout=10)  # the others go on
    assert fake.resting and fake.steps[1] in (0, 51085)


def test_a_limit_ends_the_wait_and_is_told_once(positioner, fake):
    positioner.connect()
    fake.target = [10**9, 0, 0]
    positioner.move_to(10_000, 0, 0)
    threading.Timer(0.02, fake.say, [b"! LIMIT MOT1\n"]).start()
    with pytest.raises(LimitReached, match="x: move away from it") as caught:
        positioner.wait(timeout=10)
    assert caught.value.axes == positioner.limits == {"x"}
    positioner.check()
    positioner.wait(timeout=0.01)  # it goes nowhere any more
    positioner.jog("x", -1)
    assert positioner.limits == frozenset()
    positioner.stop()
    positioner.velocity("x", 1)
    fake.say(b"! LIMIT MOT1\n")
    while not positioner.limits:
        pass
    positioner.move_to(0, 0, 0)  # it is known, and over


def test_what_is_refused_is_told_to_the_call_that_said_it(fake):
    fake.baud = 2000  # it is refused before the call listens
    positioner = opened(fake)
    positioner.connect()
    positioner.move_to(10**6, 0, 0)
    waiting = threading.Thread(target=positioner.wait)
    waiting.start()
    fake.damage = {b"P 7 0 0 0\n": b"P 7 x 0 0\n"}
    with pytest.raises(Refused):
        positioner.move_to(0, 0, 0)
    waiting.join(timeout=10)  # it goes nowhere any more
    assert not waiting.is_alive() and fake.resting and fake.orders[-3:] == STOP
    positioner.close()


def test_stopping_ends_the_wait(positioner, fake):
    positioner.connect()
    positioner.move_to(10**6, 0, 0)
    threading.Timer(0.02, positioner.stop).start()
    assert positioner.wait(timeout=10).x < 10**6
    assert fake.orders[-3:] == [b"STOP MOT1\n", b"STOP MOT2\n", b"STOP MOT3\n"]


@pytest.mark.parametrize("part", [lambda it: it.stop("y"), lambda it: it.jog("y", 1)])
def test_an_axis_that_is_stopped_or_jogged_leaves_the_others_on_their_way(positioner, fake, part):
    positioner.connect()
    positioner.move_to(1000, 50_000, 0)
    part(positioner)
    x, y, _ = positioner.wait(timeout=10).steps
    assert x == 56_761 and y != Place(0, 50_000, 0).steps.y
    positioner.move_to(0, 0, 0)
    for axis in "xyz":
        positioner.stop(axis)
    assert positioner.wait(timeout=0.01).x > 0  # it goes nowhere any more


@pytest.mark.parametrize(("error", "can_break"), [(RuntimeError, False), (KeyboardInterrupt, True)])
def test_what_ends_a_block_with_an_error_stops_all_axes(fake, error, can_break):
    fake.can_break = can_break
    with pytest.raises(error), opened(fake) as positioner:
        positioner.connect()
        positioner.jog("x", 1)
        raise error
    assert fake.target == fake.steps and fake.closed
    assert fake.orders.count(BREAK) == can_break
    assert fake.orders[-3:] == [b"STOP MOT1\n", b"STOP MOT2\n", b"STOP MOT3\n"]
    fake.written.clear()
    with opened(fake):
        pass
    assert not fake.written


def test_an_error_is_not_hidden_by_a_line_that_is_gone(fake):
    with pytest.raises(RuntimeError), opened(fake) as positioner:
        positioner.connect()
        fake.gone = True
        raise RuntimeError
    assert fake.closed


def test_silence_is_not_taken_for_obedience(fake):
    with opened(fake, timeout=0.2) as positioner:
        positioner.connect()
        fake.original = True  # the line is cut
        with pytest.raises(TimedOut, match="no machine answers at fake: is it on"):
            positioner.velocity("x", 10)
        with pytest.raises(TimedOut, match="no machine answers"):
            positioner.is_moving()


def test_a_line_that_takes_nothing_is_lost(positioner, fake):
    def write(data: bytes) -> None:
        raise LineLost("fake is gone: Write timeout")

    positioner.connect()
    fake.write = write
    for call in (positioner.stop, positioner.check, lambda: positioner.steps):
        with pytest.raises(LineLost, match="Write timeout"):
            call()


def test_an_exception_of_a_listener_is_raised_and_reading_goes_on(fake, monkeypatch):
    raised = []
    monkeypatch.setattr(threading, "excepthook",
                        lambda arguments: raised.append(arguments.exc_value))

    def listen(steps):
        raise ZeroDivisionError("mine")

    with opened(fake, reported=listen) as positioner:
        positioner.connect()
        positioner.move_to(10, 0, 0)
        assert positioner.wait(timeout=10).steps.x == 568
    assert len(raised) > 1 and str(raised[0]) == "mine"


def test_a_machine_built_for_more_is_told_more(fake):
    with opened(fake, top_speed=3000) as positioner:
        assert positioner.velocity("y", 50) == pytest.approx(50, abs=0.01)
        with pytest.raises(ValueError, match="speed must be 1 to 3000 steps/s, not 3406"):
            positioner.velocity("y", 60)
    assert fake.orders == [b"VEL MOT2 2838\n"]


def test_waiting_has_an_end(positioner):
    positioner.connect()
    positioner.move_to(10**6, 0, 0)
    with pytest.raises(TimedOut, match="after 0.05 s it is at Place"):
        positioner.wait(timeout=0.05)
    with pytest.raises(TimeoutError):
        positioner.wait(timeout=0.05)


def test_a_machine_that_says_nothing_times_out(fake):
    with opened(fake, timeout=0.2) as positioner:
        fake.original = True
        with pytest.raises(TimedOut, match="no machine answers at fake: is it on, and built "
                                           "without --original.$"):
            positioner.connect()
        assert not positioner.connected
        with pytest.raises(TimedOut, match="reports only while it is connected"):
            _ = positioner.position
        fake.original = False
        positioner.connect()
        fake.connected = False  # it reports no more
        time.sleep(0.25)
        with pytest.raises(TimedOut, match="has not reported"):
            positioner.wait()


def test_what_was_typed_before_does_not_keep_it_from_connecting(positioner, fake):
    fake.begun = b"STO"
    assert positioner.connect() == (0, 0, 0)
    assert fake.written == [b"\n", b"\n", b"STATE\n", b"ACK 1\n", b"CONNECT\n", b"STATE\n"]


def test_noise_is_passed_over(positioner, fake):
    positioner.connect()
    fake.say(b"\x00\xff# POS 9 9\n\n# POS 99999999999 1 1 :\n" + b"x" * 1000)
    positioner.move_to(1, 1, 1)
    positioner.wait(timeout=10)


def test_disconnecting_is_said_until_it_is_heard(positioner, fake):
    positioner.connect()
    fake.deaf = [b"DISCONNECT\n"]
    positioner.disconnect()
    assert not fake.connected and not positioner.connected
    positioner.connect()
    fake.deaf = 9 * [b"DISCONNECT\n"]
    with pytest.raises(TimedOut, match="it may not have obeyed"):
        positioner.disconnect()
    assert positioner.connected and positioner.steps


def test_what_goes_astray_is_stopped_until_it_stands(fake):
    fake.can_break = True
    with opened(fake) as positioner:
        goes_astray(positioner, fake)


def goes_astray(positioner: Positioner, fake: FakePositioner) -> None:
    positioner.connect()
    fake.damage = {b"P 7 56761 0 0\n": b"P 7 -99956761 0 0\n", STOP[0]: b"STOP MOT3\n"}
    positioner.move_to(1000, 0, 0)
    with pytest.raises(PositionError):
        positioner.wait()
    assert fake.resting and fake.orders.count(STOP[0]) == 2
    fake.steps = fake.target = [0, 0, 0]
    fake.damage = {b"P 7 56761 0 0\n": b"P 7 -99956761 0 0\n"}
    fake.deaf = 3 * [STOP[0]]
    positioner.move_to(1000, 0, 0)
    with pytest.raises(PositionError):
        positioner.wait()
    assert fake.resting and fake.orders.count(BREAK) == 1


def test_disconnecting_ends_it(positioner, fake):
    positioner.connect()
    positioner.disconnect()
    assert fake.orders[-1] == b"DISCONNECT\n" and not positioner.connected
    with pytest.raises(TimedOut, match="only while it is connected"):
        _ = positioner.steps


def test_a_lost_line_is_raised_by_all(positioner, fake):
    positioner.connect()
    fake.gone = True
    with pytest.raises(LineLost, match="fake is gone"):
        positioner.move_to(10**6, 0, 0)
        positioner.wait()
    for call in (positioner.connect, positioner.check, positioner.stop, lambda: positioner.steps):
        with pytest.raises(LineLost):
            call()


def test_reports_are_handed_on(fake):
    seen = []
    with opened(fake, reported=seen.append) as positioner:
        positioner.connect()
        positioner.move_to(100, 0, 0)
        positioner.wait(timeout=10)
    assert seen[0] == (0, 0, 0) and seen[-1] == (5676, 0, 0) and fake.closed


def test_a_port_that_is_not_there():
    with pytest.raises(LineLost, match="/no/such/port cannot be opened"):
        Positioner("/no/such/port")


def test_a_jog_that_was_refused_is_not_ordered_again(fake):
    with Positioner(fake) as positioner:
        positioner.connect()
        fake.refuse = {b"MOV": b"! RANGE\n"}
        positioner.jog("y", 1)
        with pytest.raises(Refused):
            positioner.velocity("y", 1)
        fake.refuse = {}
        fake.written.clear()
        positioner.move_to(x=5)
        assert not any(line.startswith(b"MOV") for line in fake.written)


def test_one_that_was_reset_is_disconnected(fake):
    with Positioner(fake) as positioner:
        positioner.connect()
        fake.reset(seconds=0)
        positioner.disconnect()
        assert not positioner.connected
