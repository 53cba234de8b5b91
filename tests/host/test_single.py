"""`Single`: questions and answers, and answers that do not come."""

import math
import re
from typing import Any

import numpy as np
import pytest

from fresa_host import LineLost, Refused, Single, Stalled, TimedOut, WasReset, single_session
from fresa_host import single as module
from tests.host.fake import FakePort

GREETING = b"\r\nfresa single\r\na frame is : command return\r\n"


class FakeSingle(FakePort):
    """A motor that takes ten steps whenever somebody looks."""

    def __init__(self) -> None:
        super().__init__(self.obey, ends=b"\r")
        self.position, self.target, self.speed = 0, 0, 100
        self.power = True

    def obey(self, line: bytes) -> bytes:
        matched = re.fullmatch(r":([xved])(\d*|\?)\r", line.decode())
        assert matched
        match matched.groups():
            case "x", "?":
                if self.power:
                    self.position += max(-10, min(10, self.target - self.position))
                return b"x:%d\r\nok\r\n" % self.position
            case "v", "?":
                return b"v:%d\r\nok\r\n" % self.speed
            case "d", "":
                return b"a frame is : command return\r\nok\r\n"
            case "x", value:
                self.target = int(value)
            case "v", value:
                self.speed = int(value)
            case "e", value:
                self.power = value == "1"
        return b"ok\r\n"


@pytest.fixture
def fake(monkeypatch) -> FakeSingle:
    monkeypatch.setattr(single_session, "SILENCE_S", 0.02)
    monkeypatch.setattr(module, "POLL_S", 0.001)
    return FakeSingle()


def opened(fake: FakeSingle, timeout: float = 0.2) -> Single:
    port: Any = fake
    return Single(port, timeout=timeout)


def test_it_goes_where_it_is_sent(fake):
    fake.say(GREETING)  # it was just switched on
    with opened(fake) as motor:
        motor.speed = 60
        assert motor.speed == 60
        motor.move_to(95)
        assert motor.wait(timeout=10) == 95 == motor.position
        motor.power(False)
        assert motor.help() == "a frame is : command return"
    assert fake.written[:3] == [b":v?\r", b":v60\r", b":v?\r"]
    assert b":e0\r" in fake.written and fake.closed


def test_what_is_refused_is_raised_and_the_next_answer_is_right(fake):
    with opened(fake) as motor:
        fake.answer = lambda line: b"err range\r\n"
        with pytest.raises(Refused, match="the number may not be"):
            motor.move_to(5)
        fake.answer = fake.obey
        assert motor.wait() == 0  # it was sent nowhere


def test_no_answer_and_one_that_is_late(fake):
    with opened(fake) as motor:
        fake.answer = lambda line: b""
        with pytest.raises(TimedOut, match="fake does not answer"):
            _ = motor.position
        # The answer comes after some more reads, and in any case before that to another question.
        late = [b"x:777\r\nok\r\n"]
        reads = iter(range(100))

        def answer(line: bytes) -> bytes:
            return b"".join(late) + fake.obey(line)

        def idle() -> None:
            if late and next(reads) == 3:
                fake.say(late.pop())

        fake.answer, fake.idle = answer, idle
        assert motor.position == 0
        assert motor.speed == 100


def test_waiting_has_an_end(fake):
    with opened(fake) as motor:
        motor.move_to(9999)
        with pytest.raises(TimedOut, match="not at 9999, after 0.02 s"):
            motor.wait(timeout=0.02)


def test_a_motor_that_passes_its_set_point_is_not_there(fake, monkeypatch):
    way = [95, 100, 105, 108, 104, 100]
    monkeypatch.setattr(Single, "position", property(lambda self: way.pop(0) if way[1:] else 100))
    with opened(fake) as motor:
        motor.move_to(100)
        assert motor.wait(timeout=10, settle=0.01) == 100
    assert way == [100]


def test_a_reset_is_told_once(fake):
    with opened(fake) as motor:
        motor.move_to(50)
        fake.say(GREETING)
        with pytest.raises(WasReset, match="position 0 again"):
            _ = motor.position
        assert motor.position == 10
        # Also in the middle of an answer.
        fake.answer = lambda line: b"x:" + GREETING
        with pytest.raises(WasReset):
            _ = motor.position
        fake.answer = fake.obey
        assert motor.speed == 100


def test_who_is_no_machine_is_no_machine(fake):
    fake.answer = lambda line: b"login: \r\n"
    with pytest.raises(TimedOut):
        opened(fake)
    assert fake.closed
    talker = FakeSingle()
    talker.idle = lambda: talker.say(b"blah\n")
    with pytest.raises(TimedOut, match="does not stop talking"):
        opened(talker)


def test_a_lost_line_is_raised(fake):
    with opened(fake) as motor:
        fake.gone = True
        with pytest.raises(LineLost):
            _ = motor.position


@pytest.mark.parametrize("value", [1.5, None, math.nan, "7", "?", -1, 10**9])
@pytest.mark.parametrize("order", [
    lambda motor, value: motor.move_to(value), lambda motor, value: motor.move_by(value),
    lambda motor, value: setattr(motor, "speed", value),
    lambda motor, value: motor.power(value)], ids=["move_to", "move_by", "speed", "power"])
def test_what_is_no_number_of_the_machine_s_is_not_sent(fake, order, value):
    with opened(fake) as motor:
        motor.move_to(0)
        fake.written.clear()
        with pytest.raises(ValueError, match="must be"):
            order(motor, value)
    assert not fake.written


def test_numbers_of_numpy_are_numbers(fake):
    with opened(fake) as motor:
        motor.move_to(np.int16(30))
        assert motor.wait(timeout=10) == 30
    assert b":x30\r" in fake.written


def test_it_stops_where_it_is(fake):
    with opened(fake) as motor:
        motor.move_to(9000)
        assert motor.is_moving()
        motor.stop()
        assert motor.wait(timeout=10) == fake.target == fake.position < 100
        assert not motor.is_moving()


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt])
def test_what_ends_a_block_with_an_error_stops_the_motor(fake, error):
    with pytest.raises(error), opened(fake) as motor:
        motor.move_to(9000)
        raise error
    assert fake.target == fake.position < 100 and fake.power and fake.closed


def test_a_motor_that_does_not_answer_the_order_to_stop_loses_its_power(fake):
    with pytest.raises(RuntimeError), opened(fake, timeout=0.05) as motor:
        motor.move_to(9000)
        fake.answer = lambda line: b""
        raise RuntimeError
    assert fake.written[-1] == b":e0\r" and fake.closed


def test_an_error_is_not_hidden_by_a_reset_or_a_line_that_is_gone(fake):
    with pytest.raises(RuntimeError), opened(fake) as motor:
        fake.say(GREETING)
        raise RuntimeError
    with pytest.raises(RuntimeError), opened(fake) as motor:
        motor.move_to(50)
        fake.gone = True
        raise RuntimeError
    assert fake.closed


def test_waiting_without_power_ends(fake, monkeypatch):
    with opened(fake) as motor:
        motor.power(False)
        motor.move_to(50)
        with pytest.raises(Stalled, match=r"at 0, not at 50, and has no power: power\("):
            motor.wait()
        assert not motor.is_moving()
        motor.power(True)
        assert motor.wait(timeout=10) == 50
        fake.power = False  # by another program
        motor.move_to(0)
        monkeypatch.setattr(module, "STALLED_AFTER_S", 0.02)
        monkeypatch.setattr(module, "TURN_S", 1.0)
        with pytest.raises(Stalled, match="stands at 50, not at 0: it may have no power"):
            motor.wait()


def test_steps_add_up(fake):
    with opened(fake) as motor:
        fake.position = fake.target = 7
        for _ in range(20):
            motor.move_by(3)
        assert motor.wait_move(timeout=10) == 67 == motor.get_position()
        motor.move_by(-60)
        assert motor.wait(timeout=10) == 7
        assert motor.home(timeout=10) == 0


def test_a_motor_that_another_program_sent_somewhere_is_moving(fake, monkeypatch):
    monkeypatch.setattr(module, "STALLED_AFTER_S", 0.02)
    with opened(fake) as motor:
        assert not motor.is_moving()
        fake.target = 100
        assert motor.is_moving()


def test_it_says_what_it_is(fake):
    with opened(fake) as motor:
        assert repr(motor) == "Single('fake')"
