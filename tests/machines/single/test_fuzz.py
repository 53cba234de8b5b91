# amaranth: UnusedElaboratable=no

"""Fuzzing `single`: mistakes in its gateware are found, with few bytes; and no other."""

import pytest
from amaranth import Mux

from fresa.protocol import frames
from tb.machines.single.fuzz import lines
from tb.mistake import Mistake
from tests.machines.fuzzing import drifts, mistakes_are_found, run

BEGIN = b":v50000\r"
OBEYS_REFUSED = Mistake("commands.target", lambda right, at: Mux(
    at("commands.answer") == frames.Answer.RANGE.value, at("commands.value"), right))
MISTAKES = {  # few bytes, what is found, the mistake
    "a wrong answer": (b":x5a\r", "answer", Mistake(
        "commands.answer", lambda right, _: Mux(
            right == frames.Answer.NUMBER.value, frames.Answer.COMMAND.value, right))),
    "a refused frame that is obeyed": (b":x10005\r", "step", OBEYS_REFUSED),
    "a speed that drifts": (b":v20001\r:x9000\r", "time", drifts("")),
    "a position that is not that of the motor": (b":x9\r:x?\r", "place", Mistake(
        "commands.writer.numbers__payload", lambda right, _: right ^ 1)),
}


TestMistakes = mistakes_are_found("single", BEGIN, MISTAKES)


class TestOtherMistakes:
    def test_of_a_ramp_is_found(self):
        found = run("single", BEGIN + b":x7\r", other=True)
        assert found.failures == [] and found.timed == found.steps == 7
        up_too_long = Mistake("dut.move.goes_to", lambda right, at: Mux(
            at("dut.move.moved") & at("move.above") & (at("move.left") == at("move.level")),
            at("move.level") + 1, right))
        failure, = run("single", BEGIN + b":x7\r", other=True, mistake=up_too_long).failures
        assert failure.kind == "time" and "too early" in failure.message


@pytest.mark.parametrize(("text", "wrong"), [
    (b"x?", ""), (b"V?", ""), (b"d", ""), (b"X0009", ""), (b"e1", ""), (b"v59999", ""),
    (b"", "command"), (b"x?1", "command"), (b"dd", "command"), (b"y1", "command"),
    (b"x", "number"), (b"x 1", "number"), (b"x-1", "number"), (b"x12a", "number"),
    (b"x10000", "range"), (b"v0", "range"), (b"v60000", "range"), (b"e2", "range"),
])
def test_frames_that_are_refused(text, wrong):
    assert lines.refusal(text) == wrong
