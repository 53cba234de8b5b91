"""`Single`: questions and answers, and answers that do not come."""

import re
from typing import Any

import pytest

from fresa_host import LineLost, Refused, Single, TimedOut, WasReset, single_session
from fresa_host import single as module
from tests.host.fake import FakePort

GREETING = b"\r\nfresa single\r\na frame is : command return\r\n"


class FakeSingle(FakePort):
    """A motor that takes ten steps whenever somebody looks."""

    def __init__(self) -> None:
        super().__init__(self.obey, ends=b"\r")
        self.position, self.target, self.speed = 0, 0, 100

    def obey(self, line: bytes) -> bytes:
        asked = re.fullmatch(r":([xved])(\d*|\?)\r", line.decode())
        assert asked
        match asked.groups():
            case "x", "?":
                self.position = min(self.target, self.position + 10)
                return b"x:%d\r\nok\r\n" % self.position
            case "v", "?":
                return b"v:%d\r\nok\r\n" % self.speed
            case "d", "":
                return b"a frame is : command return\r\nok\r\n"
            case "x", value:
                self.target = int(value)
            case "v", value:
                self.speed = int(value)
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
