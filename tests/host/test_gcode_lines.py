"""What GRBL says, in lines: right, half, wrong, and noise; and what is sent."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fresa_host import BlockRefused
from fresa_host.gcode_lines import BUFFER, Message, Position, Status, block, decode, program


@pytest.mark.parametrize(("line", "message"), [
    ("ok", Message("ok", "ok")), ("error:20", Message("error", "error:20", 20)),
    ("ALARM:1", Message("alarm", "ALARM:1", 1)),
    ("Grbl 1.1h ['$' for help]", Message("greeting", "Grbl 1.1h ['$' for help]")),
    ("[MSG:Caution: Unlocked]", Message("text", "[MSG:Caution: Unlocked]")),
    (">G54:ok", Message("text", ">G54:ok")), ("error:x", Message("text", "error:x")),
    ("<Idle|MPos:0.000,1.500,-2.000|FS:0,0>",
     Status("Idle", 0, Position(0, 1.5, -2), feed=0, speed=0)),
    ("<Hold:1|WPos:1,2,3|Bf:12,127|F:500|WCO:4,5,6|Pn:XP|Ov:100,25,90|A:SF|New:x>",
     Status("Hold", 1, None, Position(1, 2, 3), Position(4, 5, 6), 500, None, "XP", 12, 127,
            (100, 25, 90))),
    ("<Idle>", None), ("<Idle|MPos:1,2>", None), ("<Idle|MPos:1,2,nan>", None),
    ("<Idle|MPos:1,2,3", None), ("<Idle|MPos:1,2,3|FS:1>", None), ("<<Idle|MPos:1,2,3>", None),
])
def test_lines_say_this(line, message):
    assert decode(line) == message


@given(st.text(st.sampled_from("<>|:,.-0123456789okIdleMPosWCOFBv\x00\xff"), max_size=80))
def test_any_line_is_something_or_nothing(line):
    message = decode(line)
    assert message is None or isinstance(message, Message) or message.machine or message.work


@given(st.data())
def test_a_damaged_report_is_no_other_one_of_another_shape(draw):
    line = "<Run|MPos:1.000,2.000,3.000|FS:500,0>"
    at = draw.draw(st.integers(0, len(line) - 1))
    message = decode(line[:at] + line[at + 1:])
    if isinstance(message, Status) and message.machine is not None:
        assert len(message.machine) == 3


@pytest.mark.parametrize(("line", "sent"), [
    ("G1 X1\r\n", "G1 X1"), (" g0x1 ; away (really)", "g0x1"), ("G1(what? ever!)X1", "G1X1"),
    ("(not ended", ""), ("%", ""), ("\tG1\tX1", "G1 X1"), ("", ""), ("$H", "$H"),
    ("X" * (BUFFER - 1), "X" * (BUFFER - 1)),
])
def test_what_is_sent_of_a_line(line, sent):
    assert block(line) == sent


@pytest.mark.parametrize("line", ["G1?", "!", "~", "G1\x18", "X1\nX2", "X\x85", "µ", "X\x00"])
def test_real_time_commands_are_not_sent_in_a_line(line):
    with pytest.raises(ValueError, match="may not be in a line"):
        block(line)


def test_lines_have_their_numbers():
    assert program(["%", "G0 X1", "", "(x)", "M2"]) == [(2, "G0 X1"), (5, "M2")]
    with pytest.raises(ValueError, match="line 2: a line has at most 126 characters: 'X1X1"):
        program(["", "X1" * 63 + "X"])
    with pytest.raises(ValueError, match=re.escape("line 1: '!' may not be")):
        program(["G0!"])


def test_errors_name_the_line_and_what_is_wrong():
    error = BlockRefused(20, "G99", 7)
    assert str(error) == ("the machine refused: line 7: there is no such command, in 'G99' "
                          "(error:20)")
    assert (error.code, error.line, error.text, error.reason) == (20, 7, "G99", "error:20")
    assert "it does not say more" in str(BlockRefused(250, "G99"))
