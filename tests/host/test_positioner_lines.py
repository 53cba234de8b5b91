"""What a positioner says and is sent, in lines."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fresa.motion.positioner import START_SPEED
from fresa_host import Place
from fresa_host import positioner_lines as positioner
from fresa_host.lines import LineSplitter
from fresa_host.positioner_lines import (
    Limit,
    Ok,
    Refusal,
    State,
    Steps,
    delimited,
    read_line,
)

NUMBERS = st.integers(-2**31, 2**31 - 1)


class TestPositioner:
    @given(NUMBERS, NUMBERS, NUMBERS)
    def test_a_report_is_read(self, x, y, z):
        assert read_line(f"# POS {x} {y} {z} :") == (x, y, z)

    @pytest.mark.parametrize("line", [
        "# POS 1 2 3", "# POS 1 2 :", "POS 1 2 3 :", "# POS 1  2 3 :", "# POS 1 2 3 : ",
        "# POS 1 2 3 4 :", "# POS +1 2 3 :", "# POS 2147483648 0 0 :", "# POS ١ 2 3 :",
        "# POS 1 2 3 :# POS 1 2 3 :", "! ", "! range", "! LIMIT MOT4\x00", "", "OK", "okok", "ok ",
        "STATE", "STATE 1 0 0 0 1 2 3 0 0 0 1 2 3", "STATE 2 0 0 0 1 2 3 0 0 0 1 2 3 4",
        "STATE 1 0 0 0 1 -2 3 0 0 0 1 2 3 4", "STATE 1 0 0 0 1 2 3 0 0 0 2147483648 2 3 4",
        "STATE 1 0 0 0 1 2 3 0 0 0 1 2 3 4 5", "STATE 1 0 0 0 1 2 3 0 0 0 1 2 3 -4",
        "STATE 1 0 0 0 1 2 3 0 0 0 1 2 3 2147483648"])
    def test_half_a_line_is_none(self, line):
        assert read_line(line) is None

    def test_complaints_are_read(self):
        assert read_line("! RANGE") == Refusal("RANGE")
        assert [read_line(f"! LIMIT MOT{n}") for n in (1, 2, 3)] == [
            Limit("x"), Limit("y"), Limit("z")]

    def test_a_state_is_read(self):
        assert read_line("ok") == Ok()
        assert read_line("STATE 1 0 1 0 1 200 1500 0 0 1 -5 0 2147483647 90061") == State(
            connected=True, moving=(False, True, False), speeds=(1, 200, 1500),
            switches=(False, False, True), steps=Steps(-5, 0, 2**31 - 1), seconds=90061)

    @pytest.mark.parametrize("size", [1, 7, 1000])
    def test_reports_have_no_ends_and_answers_come_between_them(self, size):
        stream = (b"ok\n# POS 0 0 0 :ok\n! RANGE\n# POS 0 0 1 :# POS 0 0 2 :\n# POS 0 0 3 :\r\n"
                  b"# POS 7 # POS 0 0 4 :9 :o# POS 0 0 5 :ok\n")
        splitter, read = LineSplitter(), []
        for begin in range(0, len(stream), size):
            read += splitter.feed(delimited(stream[begin:begin + size]))
        assert [message for message in map(read_line, read) if message is not None] == [
            Ok(), (0, 0, 0), Ok(), Refusal("RANGE"), *[(0, 0, n) for n in range(1, 6)], Ok()]

    @given(st.text(max_size=80))
    def test_any_line_can_be_read(self, text):
        read = read_line(text)
        assert read is None or isinstance(read, (Steps, Ok, Refusal, State, Limit))

    def test_commands_are_those_of_the_machine(self):
        assert positioner.jog("x", 1) == b"MOV MOT1 C\n"
        assert positioner.jog("z", -1) == b"MOV MOT3 CC\n"
        assert positioner.stop() == b"STOP MOT1\nSTOP MOT2\nSTOP MOT3\n"
        assert positioner.speed("y", 1500) == b"VEL MOT2 1500\n"
        assert positioner.store(7, Steps(1, -2, 3)) == b"P 7 1 -2 3\n"
        assert positioner.go_to(1) == b"GOTO 1\n"
        assert positioner.place(Steps(-2**31, 0, 2**31 - 1)) == b"POS -2147483648 0 2147483647\n"

    @pytest.mark.parametrize(("make", "message"), [
        (lambda: positioner.jog("w", 1), "axis must be x, y or z, not 'w'"),
        (lambda: positioner.jog("x", 0), "direction must be 1 or -1, not 0"),
        (lambda: positioner.speed("x", 0), "speed must be 1 to 1500 steps/s, not 0"),
        (lambda: positioner.speed("x", 1501), "speed must be 1 to 1500 steps/s, not 1501"),
        (lambda: positioner.go_to(0), "point must be 1 to 7, not 0"),
        (lambda: positioner.store(8, Steps(0, 0, 0)), "point must be 1 to 7, not 8"),
        (lambda: positioner.place(Steps(0, 2**31, 0)), "y is out of the machine's reach"),
        (lambda: Place(float("nan"), 0, 0).steps, "x in um must be a number, not nan"),
    ])
    def test_what_the_machine_would_refuse_is_not_sent(self, make, message):
        with pytest.raises(ValueError, match=message):
            make()

    @given(NUMBERS, NUMBERS, NUMBERS)
    def test_steps_and_um_lead_to_each_other(self, x, y, z):
        assert Place.of(Steps(x, y, z)).steps == (x, y, z)

    def test_a_um_is_57_steps(self):
        assert Place(1, -1000, 14_000).steps == (57, -56_761, 794_654)


def test_the_speed_after_a_reset_is_that_of_the_gateware():
    assert positioner.START_SPEED == START_SPEED
