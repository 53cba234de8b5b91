# amaranth: UnusedElaboratable=no

"""Fuzzing `positioner`: mistakes in its gateware are found, with few bytes; and no other."""

import numpy as np
import pytest
from amaranth import Const, Mux

from fresa.protocol import positioner as commands
from tb.machines.positioner.fuzz import limits, lines
from tb.machines.positioner.fuzz.answers import Answers, Due
from tb.machines.positioner.fuzz.axes import load_steps
from tb.mistake import Mistake
from tests.machines.fuzzing import BIT, BREAK, drifts, kinds, mistakes_are_found, run

BEGIN = b"CONNECT\n"
MISTAKES = {  # few bytes, what is found, the mistake
    "no answer": (b"P 1 0 0 4294967296\n", "answer", Mistake(
        "positioning.refusal", lambda right, _: Mux(
            right == commands.Answer.RANGE.value, commands.Answer.NONE.value, right))),
    "a motor that does not stop": (b"MOV MOT2 C\nSTOP MOT2\n", "step", Mistake(
        "positioning.run", lambda right, at: right | at("positioning.run"))),
    "a rate that drifts": (b"VEL MOT3 1499\nMOV MOT3 C\n", "time", drifts("z.")),
}
ON = BEGIN + b"MOV MOT1 C\nMOV MOT2 CC\n"
SWITCHES = {  # what is found, the mistake
    "a step towards a switch": ("step", Mistake(
        "x.blocked", lambda *_: Const(0))),
    "a movement that goes on": ("answer", Mistake(
        "positioning.run", lambda right, at: right | at("positioning.stopped"))),
    "a switch that is not told of": ("answer", Mistake("positioning.pending_limits",
                                                       lambda *_: Const(0))),
    "a switch that is told of again": ("answer", Mistake(
        "positioning.pending_limits", lambda right, at: right | at("positioning.pending_limits"))),
    "no buzzer": ("pins", Mistake("buzzer", lambda *_: Const(0))),
}


TestMistakes = mistakes_are_found("positioner", BEGIN, MISTAKES)


class TestOtherMistakes:
    def test_nothing_is_found_where_switches_do_what_they_should(self):
        found = run("positioner", ON, 0b011)  # MOT2 moves away from its switch
        assert found.failures == [] and found.blocked == 1

    @pytest.mark.parametrize("mistake", [
        pytest.param(mistake, marks=[pytest.mark.long] * (mistake != "a step towards a switch"))
        for mistake in SWITCHES])
    def test_of_a_switch_is_found(self, mistake):
        kind, planted = SWITCHES[mistake]
        assert kind in kinds("positioner", ON, pressed=0b011, mistake=planted)

    def test_of_breaks_that_begin_inside_a_byte_is_found(self):
        too_soon = Mistake("receiver.line_break", lambda right, at: right | (
            (at("receiver.low") == 10 * BIT - 2) & ~at("receiver.rx")))
        assert run("positioner", ON, low=BREAK - 1, mistake=too_soon).failures[0].kind == "step"


@pytest.mark.parametrize(("text", "wrong"), [
    (b"CONNECT", ""), (b"MOV MOT3 CC", ""), (b"VEL MOT1 +0007", ""), (b"GOTO 7", ""),
    (b"POS 0 -2147483648 4294967295", ""), (b"ACK 0", ""), (b"STATE", ""),
    (b"", "COMMAND"), (b"connect", "COMMAND"), (b" CONNECT", "COMMAND"), (b"MOT1", "COMMAND"),
    (b"CONNECT ", "ARGUMENT"), (b"MOV MOT4 C", "ARGUMENT"), (b"MOV MOT1 CCC", "ARGUMENT"),
    (b"MOV  MOT1 C", "ARGUMENT"), (b"GOTO -", "ARGUMENT"), (b"P 1 2 3", "ARGUMENT"),
    (b"VEL MOT1 0", "RANGE"), (b"VEL MOT1 1501x", "RANGE"), (b"P 8", "RANGE"),
    (b"POS 0 0 4294967296", "RANGE"), (b"POS -2147483649 0 0", "RANGE"), (b"ACK 2", "RANGE"),
    (b"ACK", "ARGUMENT"), (b"STATE 1", "ARGUMENT"),
])
def test_lines_that_are_refused(text, wrong):
    assert lines.refusal(text)[0] == wrong


class Soon(Due):
    """Answers are sent within so many clocks."""

    def __init__(self, clocks):
        super().__init__(1, 10**6)
        self.clocks = clocks

    def __call__(self, begin, text=b""):
        return begin + self.clocks


class TestAnswers:
    """A flood of bad lines, one a byte, each answer of which takes as long as eleven."""

    BYTE, LINES = 160, 60

    def answers(self, queue=32):
        """Give what a queue of so many places would have said."""
        answers, waiting, free, clock = [], [], 0, 0
        lines = [1000 + number * self.BYTE for number in range(self.LINES)]
        while lines or waiting:
            clock += 1
            if waiting and clock >= free:  # begins, and then there is room for another
                answers.append((clock, waiting.pop(0)))
                free = clock + 11 * self.BYTE
            if lines and clock == lines[0] + 5:
                lines.pop(0)
                if len(waiting) <= queue:
                    waiting.append(b"! COMMAND\n" if len(waiting) < queue else b"! OVERFLOW\n")
        return answers

    def run(self, answers):
        answered = Answers(answers, Soon(20 * self.BYTE), self.BYTE, 10**6)
        for number in range(self.LINES):
            clock = 1000 + number * self.BYTE
            if failure := answered.answer(b"", b"! COMMAND\n", clock, clock + 40):
                return failure
        return answered.rest()

    def test_one_answer_each_and_one_for_those_that_are_too_many(self):
        answers = self.answers()
        assert self.run(answers) is None and 33 < len(answers) < self.LINES
        texts = [text for _, text in answers]
        assert texts == sorted(texts) and 1 < texts.count(b"! OVERFLOW\n") < 9

    @pytest.mark.parametrize("change", [
        lambda answers: answers[:1], lambda answers: answers[:20] + answers[21:],
        lambda answers: answers[:-1],
        lambda answers: [*answers, (answers[-1][0] + 3000, b"! COMMAND\n")],
        lambda answers: [(clock, b"! COMMAND\n") for clock, _ in answers],
        lambda answers: [*answers[:5], (answers[5][0], b"! RANGE\n"), *answers[6:]],
        lambda answers: [*answers[:9], *((clock + 5000, text) for clock, text in answers[9:])],
    ])
    def test_less_is_found(self, change):
        assert self.run(change(self.answers()))

    @pytest.mark.parametrize("queue", [1, 16, 30, 34])
    def test_of_other_places_is_found(self, queue):
        assert self.run(self.answers(queue))


class TestLimits:
    SAID = [(500, b"! RANGE\n"), (900, b"! LIMIT MOT2\n"), (1300, b"! LIMIT MOT1\n")]

    def check(self, number, blocked, perhaps=()):
        return limits.check_limit_reports(number, blocked, perhaps, self.SAID,
                                          Soon(450), 9000)

    def test_each_is_reported_once(self):
        assert self.check(1, [700]) == self.check(2, [800]) == self.check(3, []) == []
        assert self.check(1, [700, 1200]) == []  # before it was said
        assert self.check(3, [], [700]) == self.check(2, [], [700]) == []

    @pytest.mark.parametrize(("number", "blocked"), [
        (3, [700]), (2, []), (2, [950]), (1, [700, 1400]), (1, [1400])])
    def test_others_are_found(self, number, blocked):
        assert self.check(number, blocked)

    def test_the_buzzer_sounds_to_the_second_tick(self):
        buzzer = np.zeros(1000, np.uint8)
        buzzer[150:300] = buzzer[399:600] = 1
        assert limits.check_buzzer(buzzer, [150, 399, 401], [], 100) == []
        assert limits.check_buzzer(buzzer, [150, 399], [420], 100) == []
        for wrong in ([150, 399], [150, 399, 401, 500], [150], [150, 398, 401], [151, 399, 401]):
            assert limits.check_buzzer(buzzer, wrong, [], 100)

    def test_play_is_a_gap(self):
        ways = [1, 1, 1, 1, -1, 1, -1, -1, -1, 1]
        seen = {name: np.zeros(40, np.uint8) for name in ("step", "direction", "enable")}
        seen["enable"] += 7
        for number, way in enumerate(ways):
            seen["step"][3 * number + 1] = 4
            seen["direction"][3 * number:3 * number + 3] = 4 * (way > 0)
        (_, _, z), failures = load_steps(seen, (0, 0, 2))
        assert failures == []
        assert z.place.tolist() == [0, 0, 0, 1, 2, 2, 2, 2, 2, 1, 1]
