# amaranth: UnusedElaboratable=no

"""Fuzzing: nothing is found in machines without a mistake, and what checks them is right."""

import numpy as np
import pytest

from tb.fuzz import fuzz, measure, spread
from tb.fuzz.floods import Backlog, beyond_room, out_of_turn, unanswered
from tb.fuzz.frames import Frame
from tb.fuzz.inputs import random_inputs
from tb.fuzz.ramp import Ramp, check_ramp
from tb.fuzz.trajectory import Effect, Mode, Steps, check_trajectory
from tb.machines.single.fuzz import lines
from tb.models.drive import RateModel
from tb.models.motion import RampModel
from tb.models.protocol import ReceiverModel
from tb.registry import fuzz_targets
from tb.uart import FRAME, BitTimingError, Text, decode, decode_output, high, levels

TARGETS = fuzz_targets()
BIT = 16
LONG = {"positioner", "single"}
"""Those with step times to measure, for which they are compiled; the record does it as well."""


@pytest.mark.compiler
@pytest.mark.usefixtures("libraries")
@pytest.mark.parametrize("name", [
    pytest.param(name, marks=[pytest.mark.long] * (name in LONG)) for name in TARGETS])
class TestMachines:
    @pytest.mark.long
    def test_nothing_is_found(self, name):
        for outcome in fuzz(TARGETS[name], 5, 8000):
            findings = outcome.findings
            assert findings.failures == []
            assert findings.bytes >= 8000 and findings.answers > 20
            assert findings.steps > (200 if name == "vplotter" else 500)  # its strings are coarse
            assert findings.timed > findings.steps // 4 or not TARGETS[name].times

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
        protocol = lines.PROTOCOL
        first, again, other = (
            [str(item) for item in random_inputs(protocol, seed, 500, BIT)] for seed in (1, 1, 2))
        assert first == again != other


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

    def made(self, off=(), rates=RATES):
        """Give when a motor makes its steps, without power in some clocks."""
        motor = RampModel(steps=rates, width=15)
        rate, clocks = RateModel(modulus=self.MODULUS, max_rate=40), []
        for clock in range(self.CLOCKS):
            now = {"target": 9 * (clock > 301), "run": int(clock not in off)}
            moved = int(motor.request(**now)[0] and rate.is_due())
            clocks += [clock + 1] * moved  # the coils change
            rate.clock(rate=motor.rate(35), moved=moved)
            motor.clock(**now, requested_rate=35, moved=moved)
        return clocks

    def check(self, clocks, effects=EFFECTS, rates=RATES):
        return check_ramp(Steps.of(np.array(clocks), np.ones(len(clocks))), effects,
                          Ramp(rates, self.MODULUS, 1, 0), self.CLOCKS)

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

    @pytest.mark.parametrize(("shift", "kinds"), [(0, []), (-1, ["time"]), (1, ["step"])])
    def test_times_begin_anew_after_a_wait(self, shift, kinds):
        """With the remainder of the wait the second step would be due a clock sooner: 45."""
        rates = (22, *self.RATES[1:])  # 46 clocks of 22 are 1012
        first, second, *_ = clocks = self.made(rates=rates)
        assert second - first == 46
        found = self.check([first, *(clock + shift for clock in clocks[1:])], rates=rates)
        assert [failure.kind for failure in found.failures] == kinds

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


def test_rates_that_are_chosen():
    rates = TARGETS["single"].rates
    assert rates
    chosen = spread(rates, 60)
    assert {1, 2, 59_999, 59_998, 997} <= set(chosen) and 40 < len(chosen) <= 70
    assert spread(rates, 60_000) == list(range(1, 60_000))
