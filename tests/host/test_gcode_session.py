"""The session of GRBL's protocol: bytes and times go in, and nothing waits."""

import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fresa_host import Alarmed, BlockRefused, JobStopped, TimedOut, WasReset
from fresa_host.gcode_lines import BUFFER, program
from fresa_host.gcode_session import MOST_LINES, GCodeSession
from fresa_host.session import Operation
from tests.host.session_line import SessionLine

IDLE = b"<Idle|MPos:0.000,0.000,0.000|FS:0,0|WCO:0.000,0.000,0.000>\r\n"
GREETING = b"Grbl 1.1h ['$' for help]\r\n"


class Line(SessionLine):
    """A session that is open."""

    def __init__(self) -> None:
        super().__init__(GCodeSession(name="tty", timeout=5.0))
        opened = self.begin(self.session.open())
        assert self.sent == b"?"
        self.hear(IDLE)
        opened.result()

    def stream(self, *lines: str, line_by_line: bool = False) -> Operation:
        return self.begin(self.session.stream(program(lines), line_by_line=line_by_line))


@pytest.fixture
def line() -> Line:
    return Line()


def test_characters_are_counted(line):
    """Of 20-byte lines the buffer has room for six; each answer makes room for one more."""
    text = "G1 X1.0000 Y1.00000"
    operation = line.stream(*[text] * 8)
    assert line.sent == 6 * f"{text}\n".encode()
    line.hear(b"o")
    assert not line.sent
    line.hear(b"k\r\nok\r")
    assert line.sent == 2 * f"{text}\n".encode() and line.session.done == 2
    line.hear(5 * b"ok\r\n")
    assert not operation.done
    line.hear(b"ok\r\n")
    assert operation.result() is None and line.session.done == line.session.total == 8


@given(st.lists(st.integers(1, BUFFER - 1), min_size=1, max_size=30), st.integers())
@settings(max_examples=60, deadline=None, database=None, derandomize=True)
def test_the_buffer_never_overflows_and_is_filled(sizes, seed):
    """Whatever the lengths and however the answers come; a line waits only if it does not fit."""
    line, chance = Line(), random.Random(seed)
    operation = line.stream(*("X" * size for size in sizes))
    waiting, left = [], [size + 1 for size in sizes]
    while not operation.done:
        for part in line.sent.replace(b"?", b"").splitlines(keepends=True):
            assert left.pop(0) == len(part)
            waiting.append(len(part))
        assert sum(waiting) <= 127 and (not left or sum(waiting) + left[0] > 127)
        assert line.session.waiting == sum(waiting)
        for _ in range(chance.randint(1, len(waiting))):
            waiting.pop(0)
            line.hear(b"ok\r\n")
    operation.result()
    assert not left and not waiting


def test_line_by_line_waits_for_each_answer(line):
    operation = line.stream("G1 X1", "G99", "G1 X2", line_by_line=True)
    assert line.sent == b"G1 X1\n"
    line.hear(b"ok\r\n")
    assert line.sent == b"G99\n"
    line.hear(b"error:20\r\n")
    assert not line.sent
    with pytest.raises(BlockRefused, match="line 2: there is no such command"):
        operation.result()


def test_a_refused_line_ends_the_program_when_the_others_are_answered(line):
    operation = line.stream("G99", "X1", *["G1 X1.0000 Y1.00000"] * 9)
    sent = line.sent.count(b"\n")
    line.hear(b"error:20\r\n")
    assert not operation.done and not line.sent
    line.hear(b"error:22\r\n" + b"ok\r\n" * (sent - 2))
    with pytest.raises(BlockRefused) as caught:
        operation.result()
    assert (caught.value.line, caught.value.code) == (1, 20)
    assert line.session.waiting == 0


def test_answers_without_a_line_are_nothing(line):
    line.hear(b"ok\r\nerror:3\r\n")
    operation = line.begin(line.session.ask("$G"))
    assert not operation.done
    line.hear(b"[GC:G0 G54]\r\nok\r\n")
    assert operation.result() == ["[GC:G0 G54]"]


def test_an_answer_to_a_cancelled_line_is_not_that_of_the_next(line):
    line.begin(line.session.ask("$H")).cancel()
    operation = line.begin(line.session.ask("$G"))
    assert line.sent == b"$H\n"
    line.hear(b"error:5\r\n")
    assert line.sent == b"$G\n" and not operation.done
    line.hear(b"ok\r\n")
    assert operation.result() == []


def test_a_machine_that_is_silent(line):
    operation = line.stream("G1 X1")
    for _ in range(30):
        line.tick(0.2)
    assert line.sent.count(b"?") > 10
    with pytest.raises(TimedOut, match="the machine at tty is silent since 5 s"):
        operation.result()


@pytest.mark.parametrize(("text", "seconds", "state"), [
    ("G1 X1", 4.5, b"Idle"), ("G4 P60", 64, b"Idle"), ("g04p60", 64, b"Idle"),
    ("G1 X1", 600, b"Run"), ("M0", 600, b"Hold:0")])
def test_a_line_may_take_long_while_the_machine_reports(line, text, seconds, state):
    """But if it is idle, and the line no dwell, the answer was lost."""
    operation = line.stream(text)
    end, report = line.now + seconds, IDLE.replace(b"Idle", state)
    while line.now < end:
        line.tick(0.2)
        line.hear(report)
    assert not operation.done
    for _ in range(10):
        line.tick(0.2)
        line.hear(IDLE)
    if state != b"Idle":
        return
    with pytest.raises(TimedOut, match="the answer to .* was lost"):
        operation.result()


@pytest.mark.parametrize("code", [*range(1, 11), 17])
def test_alarms_say_what_they_are(line, code):
    line.hear(b"ALARM:%d\r\n" % code)
    with pytest.raises(Alarmed) as caught:
        line.begin(line.session.ask("$X")).result()
    assert caught.value.code == code and "does not say more" not in str(caught.value)


def test_an_alarm_is_raised_once(line):
    operation = line.stream("G1 X1000", "X2")
    line.hear(b"ALARM:2\r\n")
    with pytest.raises(Alarmed, match="beyond the travel") as caught:
        operation.result()
    assert caught.value.code == 2
    line.hear(GREETING)  # it resets itself then
    assert line.session.waiting == 0 and line.sent
    operation = line.begin(line.session.ask("$X"))
    line.hear(b"[MSG:Caution: Unlocked]\r\nok\r\n")
    assert operation.result() == ["[MSG:Caution: Unlocked]"]


def test_a_reset_is_raised_once_and_nothing_is_sent(line):
    line.hear(GREETING)
    operation = line.stream("G1 X1")
    with pytest.raises(WasReset, match="has forgotten what it was sent"):
        operation.result()
    assert not line.sent
    operation = line.stream("G1 X1")
    assert line.sent == b"G1 X1\n"
    line.hear(GREETING)
    with pytest.raises(WasReset):
        operation.result()


def test_what_does_not_wait_for_an_alarm_before(line):
    line.hear(b"ALARM:1\r\n" + GREETING)
    operation = line.begin(line.session.ask("$X", clear=True))
    assert line.sent == b"$X\n"
    line.hear(b"ok\r\n")
    operation.result()


def test_a_stop_holds_and_resets_when_it_stands(line):
    streamed = line.stream("G1 X1")
    line.session.stopping = True
    line.tick(0.05)
    with pytest.raises(JobStopped):
        streamed.result()
    operation = line.begin(line.session.stop())
    assert line.sent == b"G1 X1\n!?"
    line.hear(b"<Hold:1|MPos:0,0,0>\r\n")
    line.tick(0.25)
    assert line.sent == b"?"
    line.hear(b"<Hold:0|MPos:0,0,0>\r\n")
    line.tick(0.25)
    assert line.sent == b"?"
    line.hear(b"<Hold:0|MPos:0,0,0>\r\n")
    assert line.sent == b"\x18" and not operation.done
    line.hear(GREETING)
    operation.result()
    assert not line.session.stopping and line.session.waiting == 0
    line.stream("G1 X1")
    assert line.sent == b"G1 X1\n"


def test_a_stop_of_a_homing_cycle_does_not_wait_for_a_hold(line):
    operation = line.begin(line.session.stop())
    line.hear(b"<Home|MPos:0,0,0>\r\n")
    assert line.sent == b"!?\x18"
    line.hear(GREETING)
    operation.result()


def test_a_stop_of_one_that_does_not_report_resets_it(line):
    operation = line.begin(line.session.stop())
    line.tick(5)
    assert line.sent == b"!?\x18"
    line.tick(5)
    with pytest.raises(TimedOut, match="does not answer to a reset"):
        operation.result()
    assert not line.session.stopping


def test_positions(line):
    line.session.offset = None
    operation = line.begin(line.session.place())
    line.hear(b"<Idle|MPos:1.000,2.000,3.000>\r\n")
    assert not operation.done and line.sent == b"??"
    line.hear(b"<Idle|MPos:1.000,2.000,3.000|WCO:0.100,0.000,-1.000>\r\n")
    assert operation.result() == (0.9, 2, 4)
    for work, expected in [(True, (1, 1, 1)), (False, (1.1, 1, 0))]:
        operation = line.begin(line.session.place(work=work))
        line.hear(b"<Run|WPos:1.000,1.000,1.000>\r\n")
        assert operation.result() == expected


def test_waiting_until_it_stands(line):
    operation = line.begin(line.session.still(1.0))
    for state in (b"Idle", b"Run", b"Idle", b"Idle"):  # the first is from before the last line
        assert not operation.done
        line.hear(IDLE.replace(b"Idle", state))
        line.tick(0.2)
    assert operation.result() is None
    operation = line.begin(line.session.still(1.0))
    for _ in range(6):
        line.hear(IDLE.replace(b"Idle", b"Hold:0"))
        line.tick(0.2)
    line.hear(IDLE.replace(b"Idle", b"Hold:0"))
    with pytest.raises(TimedOut, match="it is in state Hold after 1 s"):
        operation.result()
    operation = line.begin(line.session.still())
    line.hear(IDLE.replace(b"Idle", b"Alarm"))
    with pytest.raises(Alarmed, match="it is locked"):
        operation.result()


def test_no_machine():
    session = GCodeSession(name="tty", timeout=1.0)
    operation = session.begin(session.open(), 0.0)
    for tenth in range(11):
        session.receive(b"noise\xff" * 100, tenth / 10)
    with pytest.raises(TimedOut, match="no machine answers at tty"):
        operation.result()
    assert 2 <= len(session.take_outputs()) <= 4


@given(st.lists(st.binary(max_size=300), max_size=20))
@settings(max_examples=60, deadline=None, database=None, derandomize=True)
def test_any_bytes_may_come(parts):
    line = Line()
    operation = line.stream(*["G1 X1"] * 100)
    for part in [*parts, b"x\n" * (MOST_LINES + 9), b"<" * 5000]:
        line.hear(part)
    assert not operation.done or line.session.reports or line.session.resets
    assert len(line.session._texts) <= MOST_LINES and line.session.waiting <= BUFFER
