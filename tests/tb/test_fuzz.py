# amaranth: UnusedElaboratable=no

"""Fuzzing: mistakes in the gateware are found, with few bytes; and nothing where there is none."""

from dataclasses import replace

import numpy as np
import pytest
from amaranth import Cat, Const, Mux

from fresa.motion.order_ledger import Outcome
from fresa.protocol import frames
from fresa.protocol import positioner as commands
from tb.engines import AmaranthEngine, CXXRTLEngine
from tb.fuzz import fuzz, measure, run_session, shortest, spread, targets
from tb.fuzz.floods import Backlog, beyond_room, out_of_turn, unanswered
from tb.fuzz.frames import Frame
from tb.fuzz.inputs import OPENING, Input, random_inputs
from tb.fuzz.line import FRAME, BitTimingError, Text, decode, decode_output, high, levels
from tb.fuzz.ramp import Ramp, check_ramp
from tb.fuzz.target import Findings
from tb.fuzz.trajectory import Effect, Mode, Steps, check_trajectory
from tb.machines.mill.fuzz.lines import DOWN, GO, OPEN, request
from tb.machines.positioner.fuzz import limits
from tb.machines.positioner.fuzz import lines as positioner_lines
from tb.machines.positioner.fuzz.axes import load_steps
from tb.machines.positioner.fuzz.reasons import Reasons
from tb.machines.single.fuzz import lines as single_lines
from tb.mistake import Mistake
from tb.models.drive import RateModel
from tb.models.motion import RampModel
from tb.models.protocol import ReceiverModel

TARGETS = targets()
BIT = 16
BEGIN = {"single": b":v50000\r", "positioner": b"CONNECT\n", "mill": request(OPEN, 1)}
BREAK = (FRAME - 2) * BIT - BIT // 2 + BIT // 16 + 1 + FRAME * BIT
"""Clocks of the shortest break that begins with the second data bit of a byte."""
OBEYS_REFUSED = Mistake("commands.target", lambda right, at: Mux(
    at("commands.answer") == frames.Answer.RANGE.value, at("commands.value"), right))


def run(name: str, text: bytes, pressed: int = 0, low: int = 0, other: bool = False,
           mistake: Mistake | None = None) -> Findings:
    """Send some bytes, wait for as long as some more would take, and look at what came of it.

    Behind the bytes switches may be pressed for a moment, and the line may be low for some clocks
    from the second data bit of another on. Or it is the machine that is built in another way, or
    has a mistake in it.
    """
    target = TARGETS[name].others[0] if other else TARGETS[name]
    begin = BEGIN[name]
    sent = [Input("rest", b"", high(99 + 3 * FRAME * BIT)),
            Input("bytes", begin + text, levels(begin + text, BIT)),
            Input("rest", b"", high(100)),
            Input("rest", b"", high(100), np.full(100, pressed, np.uint8)),
            Input("break", b"", np.concatenate([
                levels(b"\xFF", BIT)[:2 * BIT * (low > 0)], np.zeros(low, np.uint8)])),
            Input("rest", b"", high(35 * FRAME * BIT))]
    design = target.design() if mistake is None else mistake.planted(target.design())
    with AmaranthEngine(design) as engine:
        return run_session(target, engine, sent).findings


def drifts(motor: str) -> Mistake:
    """With each step the next comes 40 parts of the modulus sooner."""
    return Mistake(f"{motor}rate.accumulator", lambda right, at: Mux(
        at(f"{motor}rate.due") & at(f"{motor}rate.moved"), right + 40, right))


MISTAKES = {  # machine, few bytes, what is found, the mistake
    "a wrong answer": ("single", b":x5a\r", "answer", Mistake(
        "commands.answer", lambda right, _: Mux(
            right == frames.Answer.NUMBER.value, frames.Answer.COMMAND.value, right))),
    "a refused frame that is obeyed": ("single", b":x10005\r", "step", OBEYS_REFUSED),
    "a speed that drifts": ("single", b":v20001\r:x9000\r", "time", drifts("")),
    "a position that is not that of the motor": ("single", b":x9\r:x?\r", "place", Mistake(
        "commands.writer.numbers__payload", lambda right, _: right ^ 1)),
    "no answer": ("positioner", b"P 1 0 0 2147483648\n", "answer", Mistake(
        "positioning.refusal", lambda right, _: Mux(
            right == commands.Answer.RANGE.value, commands.Answer.NONE.value, right))),
    "a motor that does not stop": ("positioner", b"MOV MOT2 C\nSTOP MOT2\n", "step", Mistake(
        "positioning.run", lambda right, at: right | at("positioning.run"))),
    "a rate that drifts": ("positioner", b"VEL MOT3 1499\nMOV MOT3 C\n", "time", drifts("z.")),
    "an order taken out of turn": ("mill", request(DOWN, 1, 257), "answer", Mistake(
        "ledger.decided", lambda right, _: Mux(
            right == Outcome.UNEXPECTED.value, Outcome.TAKEN.value, right))),
    "an order to somewhere else": ("mill", request(GO, 1, 1, 0, 4), "step", Mistake(
        "ledger.orders__payload", lambda right, _: Cat(right[16:32], right[:16], right[32:]))),
    "steps too far apart": ("mill", request(GO, 1, 1, 0, 4), "time", Mistake(
        "orders.divider.count", lambda right, at: Mux(
            at("orders.divider.tick"), right - 1, right))),
}


ON = b"MOV MOT1 C\nMOV MOT2 CC\n"
SWITCHES = {  # what is found, the mistake
    "a step towards a switch": ("step", Mistake(
        "x.limits.allowed", lambda _, at: at("x.limits.step"))),
    "a movement that goes on": ("answer", Mistake(
        "positioning.run", lambda right, at: right | at("positioning.stopped"))),
    "a switch that is not told of": ("answer", Mistake("positioning.pending_limits",
                                                       lambda *_: Const(0))),
    "a switch that is told of again": ("answer", Mistake(
        "positioning.pending_limits", lambda right, at: right | at("positioning.pending_limits"))),
    "no buzzer": ("pins", Mistake("buzzer", lambda *_: Const(0))),
}


class TestMistakes:
    @pytest.mark.parametrize("name", TARGETS)
    def test_nothing_is_found_where_there_is_none(self, name):
        texts = dict.fromkeys(text for of, text, *_ in MISTAKES.values() if of == name)
        found = run(name, b"".join(texts), low=BREAK)
        assert found.failures == [] and found.steps

    @pytest.mark.parametrize("mistake", MISTAKES)
    def test_is_found_with_few_bytes(self, mistake):
        name, text, kind, planted = MISTAKES[mistake]
        assert kind in {failure.kind for failure in run(name, text, mistake=planted).failures}

    def test_nothing_is_found_where_switches_do_what_they_should(self):
        found = run("positioner", ON, 0b011)  # MOT2 moves away from its switch
        assert found.failures == [] and found.blocked == 1

    @pytest.mark.parametrize("mistake", SWITCHES)
    def test_of_a_switch_is_found(self, mistake):
        kind, planted = SWITCHES[mistake]
        found = run("positioner", ON, 0b011, mistake=planted)
        assert kind in {failure.kind for failure in found.failures}

    def test_of_a_ramp_is_found(self):
        found = run("single", b":x7\r", other=True)
        assert found.failures == [] and found.timed == found.steps == 7
        up_too_long = Mistake("dut.move.goes_to", lambda right, at: Mux(
            at("dut.move.moved") & at("move.above") & (at("move.left") == at("move.level")),
            at("move.level") + 1, right))
        failure, = run("single", b":x7\r", other=True, mistake=up_too_long).failures
        assert failure.kind == "time" and "too early" in failure.message

    def test_of_breaks_that_begin_inside_a_byte_is_found(self):
        too_soon = Mistake("receiver.line_break", lambda right, at: right | (
            (at("receiver.low") == 10 * BIT - 2) & ~at("receiver.rx")))
        assert run("positioner", ON, low=BREAK - 1, mistake=too_soon).failures[0].kind == "step"

    @pytest.mark.compiler
    def test_what_finds_it_is_made_short(self, libraries):
        if reason := CXXRTLEngine.missing():
            pytest.skip(reason)
        target = TARGETS["single"]
        wrong = replace(target, design=lambda: OBEYS_REFUSED.planted(target.design()), others=())
        outcome = next(iter(fuzz(wrong, 1, 3000)))
        assert outcome.findings.failures
        short = shortest(outcome.target, outcome.inputs, 60)
        assert short.findings.failures[0].kind == outcome.findings.failures[0].kind
        assert len([item for item in short.inputs[OPENING:] if item.data]) <= 3


@pytest.mark.compiler
@pytest.mark.parametrize("name", TARGETS)
class TestMachines:
    @pytest.fixture(autouse=True)
    def _built(self, libraries):
        if reason := CXXRTLEngine.missing():
            pytest.skip(reason)

    def test_nothing_is_found(self, name):
        for outcome in fuzz(TARGETS[name], 5, 2000):
            findings = outcome.findings
            assert findings.failures == []
            assert findings.bytes >= 2000 and findings.answers > 20 and findings.steps > 1000
            assert findings.timed > findings.steps // 4

    def test_step_times(self, name):
        rates = TARGETS[name].rates
        if rates is None:
            with pytest.raises(ValueError, match=f"{name} has no rates to set"):
                next(measure(TARGETS[name], [1], 1))
            return
        chosen = [rates.most, rates.most - 1, 997, 613, 500, 499]
        seen = set()
        for times in measure(TARGETS[name], chosen, 1):
            assert times.failures == [] and times.beyond == 0 and times.steps > 50
            seen |= set(enumerate(times.rates))
        assert seen == {(motor, rate) for motor in range(rates.motors) for rate in chosen}


class TestLine:
    def test_decodes_what_a_receiver_decodes(self):
        rng = np.random.default_rng(3)
        parts = [high(40)]
        for _ in range(120):
            runs = rng.integers(1, rng.choice([3, 20, 60, 300]), 30)
            parts += [(np.arange(30) & 1).repeat(runs).astype(np.uint8),
                      levels(rng.bytes(int(rng.integers(4))), BIT)]
        line = np.concatenate(parts)
        model, expected, breaks, broken = ReceiverModel(period=BIT), [], [], False
        for clock, level in enumerate(line.tolist()):
            model.clock(level, True)
            if model.byte is not None:
                expected.append((clock, *model.byte))
            if model.line_break and not broken:
                breaks.append(clock)
            broken = model.line_break
        decoded = list(decode(line, BIT))
        assert expected == [one[:3] for one in decoded]
        assert len(expected) > 200 and {error for *_, error in expected} == {0, 1}
        assert breaks == [one.broken for one in decoded if one.broken >= 0]
        assert {byte == 0 for _, byte, _, clock in decoded if clock >= 0} == {True, False}

    def test_reads_what_is_said_and_refuses_what_is_no_byte(self):
        line = np.concatenate([high(9), levels(b"ok\r\n", BIT), high(3)])
        read = decode_output(line, BIT)
        assert (read.text, read.starts[:2]) == (b"ok\r\n", [9, 9 + FRAME * BIT])
        received = decode(np.concatenate([high(3), line]), BIT)
        assert [byte for _, byte, *_ in received] == [*b"ok\r\n"]
        line[9 + BIT - 1] ^= 1  # a start bit a clock too short
        with pytest.raises(BitTimingError):
            decode_output(line, BIT)

    def test_the_same_seed_sends_the_same(self):
        protocol = single_lines.PROTOCOL
        first, again, other = (
            [str(item) for item in random_inputs(protocol, seed, 500, BIT)] for seed in (1, 1, 2))
        assert first == again != other


@pytest.mark.parametrize(("text", "wrong"), [
    (b"x?", ""), (b"V?", ""), (b"d", ""), (b"X0009", ""), (b"e1", ""), (b"v59999", ""),
    (b"", "command"), (b"x?1", "command"), (b"dd", "command"), (b"y1", "command"),
    (b"x", "number"), (b"x 1", "number"), (b"x-1", "number"), (b"x12a", "number"),
    (b"x10000", "range"), (b"v0", "range"), (b"v60000", "range"), (b"e2", "range"),
])
def test_frames_that_are_refused(text, wrong):
    assert single_lines.refusal(text) == wrong


@pytest.mark.parametrize(("text", "wrong"), [
    (b"CONNECT", ""), (b"MOV MOT3 CC", ""), (b"VEL MOT1 +0007", ""), (b"GOTO 7", ""),
    (b"POS 0 -2147483648 2147483647", ""),
    (b"", "COMMAND"), (b"connect", "COMMAND"), (b" CONNECT", "COMMAND"), (b"MOT1", "COMMAND"),
    (b"CONNECT ", "ARGUMENT"), (b"MOV MOT4 C", "ARGUMENT"), (b"MOV MOT1 CCC", "ARGUMENT"),
    (b"MOV  MOT1 C", "ARGUMENT"), (b"GOTO -", "ARGUMENT"), (b"P 1 2 3", "ARGUMENT"),
    (b"VEL MOT1 0", "RANGE"), (b"VEL MOT1 1501x", "RANGE"), (b"P 8", "RANGE"),
    (b"POS 0 0 2147483648", "RANGE"),
])
def test_lines_that_are_refused(text, wrong):
    assert positioner_lines.refusal(text)[0] == wrong


class TestTrajectory:
    GO = Effect(100, 110, Mode(50, 50, 2, True))
    REST = Effect(-1, -1, Mode(0, 0, 2, False))

    def check(self, clocks, ways=None, effects=None):
        clocks = np.array(clocks)
        ways = np.ones(len(clocks)) if ways is None else np.array(ways)
        return check_trajectory(Steps.of(clocks, ways), effects or [self.REST, self.GO], 21, 400, 5)

    def test_exact_times(self):
        clocks = [120 + -(-21 * n // 2) for n in range(26)]
        found = self.check(clocks)
        assert found.failures == [] and found.timed == 26 and 0 < found.deviation < 1

    @pytest.mark.parametrize("place", [1, 12, 25])
    def test_one_that_is_late_by_a_clock(self, place):
        clocks = [120 + -(-21 * n // 2) + (n == place) for n in range(26)]
        found = self.check(clocks)
        assert [failure.kind for failure in found.failures] == (
            ["time"] if place != 12 else []) or found.deviation >= 1

    def test_too_few(self):
        assert [failure.kind for failure in self.check([120, 131, 141]).failures] == ["step"]

    def test_before_it_may_and_the_wrong_way(self):
        steps = [99, *(120 + -(-21 * n // 2) for n in range(26))]
        assert self.check(steps).failures[0].clock == 99
        assert "down from 0" in self.check([115], [-1]).failures[0].message

    def test_past_where_it_goes(self):
        effects = [self.REST, Effect(100, 110, Mode(2, 2, 2, True))]
        assert self.check([112, 123], effects=effects).failures == []
        assert self.check([112, 123, 133], effects=effects).failures[0].clock == 133


class TestRamp:
    RATES, MODULUS, CLOCKS = (10, 24, 32, 38), 1000, 1500
    GO = Mode(9, 9, 35, True)
    EFFECTS = (Effect(-1, -1, Mode(0, 0, 35, True)), Effect(300, 304, GO))
    OFF = (Effect(447, 450, GO._replace(run=False)), Effect(452, 457, GO))

    def made(self, off=()):
        """Give when a motor makes its steps, without power in some clocks."""
        motor = RampModel(steps=self.RATES, width=15)
        rate, clocks = RateModel(modulus=self.MODULUS, max_rate=40), []
        for clock in range(self.CLOCKS):
            now = {"target": 9 * (clock > 301), "run": int(clock not in off)}
            moved = int(motor.request(**now)[0] and rate.is_due())
            clocks += [clock + 1] * moved  # the coils change
            rate.clock(rate=motor.rate(35), moved=moved)
            motor.clock(**now, asked=35, moved=moved)
        return clocks

    def check(self, clocks, effects=EFFECTS):
        return check_ramp(Steps.of(np.array(clocks), np.ones(len(clocks))), effects,
                     Ramp(self.RATES, self.MODULUS, 1, 0), self.CLOCKS)

    def test_nothing_is_found_where_it_keeps_to_the_ramp(self):
        clocks = self.made()
        found = self.check(clocks)
        assert found.failures == [] and found.timed == 9 and 0 < found.deviation < 1
        assert np.diff(clocks).max() == 100 and np.diff(clocks).min() < 30

    @pytest.mark.parametrize(("changed", "kind"), [
        (lambda clocks: clocks[:8], "step"), (lambda clocks: [*clocks, clocks[-1] + 100], "step"),
        (lambda clocks: [*clocks[:5], clocks[5] - 2, *clocks[6:]], "time"),
        (lambda clocks: [*clocks[:5], clocks[5] + 2, *clocks[6:]], "step"),
        (lambda clocks: [*clocks[:1], *(each - 2 for each in clocks[1:])], "time"),
        (lambda clocks: [250, *clocks[1:]], "step"),
    ])
    def test_other_steps_are_found(self, changed, kind):
        failure, = self.check(changed(self.made())).failures
        assert failure.kind == kind

    def test_power_lost_is_speed_lost(self):
        effects = (*self.EFFECTS, *self.OFF)
        assert self.check(self.made(range(448, 455)), effects).failures == []
        assert self.check(self.made(range(448, 455))).failures
        assert self.check(self.made(), effects).failures


class TestFloods:
    """Of frames that take ten bytes each, with room for fifty."""

    FRAMES = [Frame(1000 + 100 * number, b"x1234567", "") for number in range(9)]

    def test_frames_have_room_until_so_many_wait(self):
        backlog = Backlog(60, 10)
        for frame in self.FRAMES[:5]:
            assert backlog.fits(frame)
            backlog.answered(frame, 1500)
        assert not backlog.fits(self.FRAMES[5])
        assert not backlog.fits(Frame(9000, b"", ""))  # it may be what is left of some

    def test_frames_that_are_read_make_room(self):
        backlog = Backlog(30, 10)
        for frame in self.FRAMES:
            assert backlog.fits(frame)
            backlog.answered(frame, frame.clock + 90)

    def test_answers_are_in_turn_one_a_return(self):
        ends = [1000, 1050, 1100, 1200]
        def may(answer, frame):
            return answer == b"damaged" or bool(frame and frame.text == answer)
        def found(*answers):
            return out_of_turn(answers, ends, self.FRAMES[:3], may)
        right, damaged = self.FRAMES[0].text, b"damaged"
        assert found((1010, right), (1051, damaged), (1110, right), (1210, right)) is None
        assert found(*[(1300, damaged)] * 4) is None
        assert found(*[(1300, damaged)] * 5) == 4
        assert found((1010, right), (1110, damaged), (1130, damaged), (1150, damaged)) == 3
        assert found((1300, right), (1300, right), (1300, right), (1300, right)) == 3
        assert found((1300, b"other")) == 0

    def test_more_answers_than_there_is_room_for_are_found(self):
        ends = [1000, 1100, 2000]
        held = [(1050, 10), (1150, 10), *((1200 + 9 * number, 10) for number in range(5))]
        assert beyond_room([*held, (2010, 10), (2020, 50)], ends, 50) is None
        assert beyond_room([*held, (1900, 1)], ends, 50) == 7

    def test_silence_behind_a_frame_is_found(self):
        output = Text(b"a" * 4, [1010, 1110, 1210, 1400])
        assert unanswered(self.FRAMES[:4], output, 10, 2000) == []
        failure, = unanswered([*self.FRAMES[:4], Frame(1700, b"x", "")], output, 10,
                              2000)
        assert failure.clock == 1780
        # still to come
        assert unanswered([Frame(1700, b"x", "")], output, 10, 1750) == []


class TestReasons:
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
        reasons = Reasons(answers, lambda clock: clock + 20 * self.BYTE, self.BYTE, 10**6)
        for number in range(self.LINES):
            clock = 1000 + number * self.BYTE
            if failure := reasons.refuse(b"", "COMMAND", clock, clock + 40):
                return failure
        return reasons.rest()

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
                                          lambda clock: clock + 450, 9000)

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


def test_rates_that_are_chosen():
    rates = TARGETS["single"].rates
    assert rates
    chosen = spread(rates, 60)
    assert {1, 2, 59_999, 59_998, 997} <= set(chosen) and 40 < len(chosen) <= 70
    assert spread(rates, 60_000) == list(range(1, 60_000))
