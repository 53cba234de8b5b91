"""The session of `single`: bytes and times go in, and nothing waits."""

import pytest

from fresa_host import Refused, TimedOut, WasReset
from fresa_host.single_lines import frame
from fresa_host.single_session import SILENCE_S, SingleSession
from tests.host.session_line import SessionLine


class Line(SessionLine):
    """A session that is open."""

    def __init__(self) -> None:
        super().__init__(SingleSession(name="tty", timeout=2.0))
        opened = self.begin(self.session.open())
        self.tick(SILENCE_S)
        assert self.sent == b":v?\r"
        self.hear(b"v:100\r\nok\r\n")
        opened.result()


@pytest.fixture
def line() -> Line:
    return Line()


def test_a_question_is_sent_at_once_and_its_answer_may_come_in_pieces(line):
    operation = line.begin(line.session.value("x"))
    assert line.sent == b":x?\r"
    for byte in b"x:777\r\nok\r":
        assert not operation.done
        line.hear(bytes([byte]))
    assert operation.result() == 777


def test_what_is_refused_leaves_no_set_point(line):
    operation = line.begin(line.session.move_to(500))
    line.hear(b"err range\r\n")
    with pytest.raises(Refused, match="range"):
        operation.result()
    assert line.session.target is None
    operation = line.begin(line.session.move_to(500))
    line.hear(b"ok\r\n")
    assert operation.done and line.session.target == 500


def test_after_a_time_out_the_next_question_waits_for_silence(line):
    operation = line.begin(line.session.value("x"))
    assert line.sent and line.session.deadline == line.now + 2
    line.tick(2)
    with pytest.raises(TimedOut, match="the machine at tty does not answer"):
        operation.result()
    operation = line.begin(line.session.value("v"))
    line.tick(SILENCE_S / 2)
    line.hear(b"x:777\r\nok\r\n")
    line.tick(SILENCE_S / 2)
    assert not line.sent and line.session.deadline == pytest.approx(line.now + SILENCE_S / 2)
    line.tick(SILENCE_S / 2 + 0.001)
    assert line.sent == b":v?\r"
    line.hear(b"v:60\r\nok\r\n")
    assert operation.result() == 60


def test_a_reset_is_raised_once_and_nothing_is_sent(line):
    line.session.target = 50
    line.hear(b"\r\nfresa single\r\na frame is : command return\r\n")
    operation = line.begin(line.session.ask(frame("x", 5)))
    with pytest.raises(WasReset):
        operation.result()
    assert not line.sent and line.session.target is None
    operation = line.begin(line.session.value("x"))
    line.hear(b"x:\r\nfresa single\r\n")  # in the middle of an answer
    with pytest.raises(WasReset):
        operation.result()


def test_who_never_falls_silent_is_no_machine():
    session = SingleSession(timeout=1.0)
    operation = session.begin(session.open(), 0.0)
    for tenth in range(20):
        session.receive(b"blah\n", tenth / 10)
    with pytest.raises(TimedOut, match="does not stop talking"):
        operation.result()
    assert not session.take_outputs()
