# amaranth: UnusedElaboratable=no

"""`single`: every pin at every clock as the model says, and promises that need no model."""

import random
import re
from fractions import Fraction
from functools import cache
from math import sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fresa.drive import FULL_STEP, HALF_STEP, swap_inner
from fresa.machines import Single
from fresa.machines.single import PHASES, SingleTiming
from fresa.motion import ramp_rates
from tb.boards import component
from tb.design import Design
from tb.engines import AmaranthEngine, CXXRTLEngine, Engine
from tb.machines.single.model import BIPOLAR, UNIPOLAR, SingleModel
from tb.machines.single.stimulus import directed, random_rows
from tb.runners import ModelRunner
from tb.uart import decode_output, encode

OUTPUTS = ["tx", "coils", "enable", "position", "moving", "fault"]
TIMING = SingleTiming.real(clock=48_000, baud=3000)
HELLO = b"hi\r\n?\r\n"
KINDS = {  # parameters, and the phases that they give
    "bipolar": ({}, BIPOLAR), "unipolar": ({"unipolar": True}, UNIPOLAR),
    "full steps": ({"full_step": True}, BIPOLAR[1::2]),
    "unipolar full steps": ({"unipolar": True, "full_step": True}, UNIPOLAR[1::2]),
}
RANDOM = settings(deadline=None, database=None, derandomize=True, max_examples=10)


def design(**options) -> Design:
    return component("single", Single(greeting=HELLO[:4], help_text=HELLO[4:], **options))


elaborated_once = cache(design)  # it takes more time than most of what is done with it


def single(engine: type[Engine] = AmaranthEngine, *, timing: SingleTiming = TIMING,
           ramp: int = 0, **options: bool) -> Engine:
    make = elaborated_once if engine is CXXRTLEngine else design
    return engine(make(timing=timing, ramp=ramp, **options))


def model(*, timing: SingleTiming = TIMING, phases=BIPOLAR) -> SingleModel:
    return SingleModel(bit=timing.bit, modulus=timing.modulus, rate=timing.rate, phases=phases,
                       greeting=HELLO[:4], help_text=HELLO[4:])


def check(stimulus, *, engine: type[Engine] = AmaranthEngine, timing: SingleTiming = TIMING,
          kind: str = "bipolar"):
    options, phases = KINDS[kind]
    stimulus = {"rst": np.zeros(len(stimulus["rx"]), int), **stimulus}
    with single(engine, timing=timing, **options) as machine:
        seen = machine.apply(stimulus, OUTPUTS)
    expected = ModelRunner(model(timing=timing, phases=phases)).apply(
        {name: np.asarray(row) for name, row in stimulus.items()}, OUTPUTS)
    for name in OUTPUTS:
        differ = np.flatnonzero(seen[name] != expected[name])
        assert not differ.size, (name, differ[0])
    return seen


def sent(seen, timing: SingleTiming = TIMING) -> bytes:
    return decode_output(seen["tx"], timing.bit).text


def session(*frames: bytes, after: int = 0, engine: type[Engine] = AmaranthEngine,
            timing: SingleTiming = TIMING, pause: int = 20):
    """Type frames one after the other, `pause` bits apart; give all pins."""
    line = [1] * 4 * timing.bit
    for frame in frames:
        line += encode(b":" + frame + b"\r", timing.bit) + [1] * pause * timing.bit
    with single(engine, timing=timing) as machine:
        return machine.apply({"rx": line + [1] * after}, OUTPUTS)


class TestEveryClock:
    @pytest.mark.compiler
    @pytest.mark.parametrize("kind", [
        pytest.param(kind, marks=[pytest.mark.long] * (kind in ("unipolar", "full steps")))
        for kind in KINDS])
    def test_frames_in_turn(self, kind):
        _, phases = KINDS[kind]
        seen = check(directed(model(phases=phases), 1, 100_000), engine=CXXRTLEngine, kind=kind)
        assert seen["position"].max() > 100
        assert set(seen["coils"].tolist()) == {0, *phases}

    @pytest.mark.compiler
    @pytest.mark.parametrize("seed", range(2))
    def test_lines_of_any_kind(self, seed):
        check(random_rows(TIMING.bit, seed, 0), engine=CXXRTLEngine)

    @pytest.mark.compiler
    def test_another_clock(self):
        """One with which a speed is no whole number of steps in a whole number of clocks."""
        timing = SingleTiming.real(clock=50_001, baud=1923)
        assert (timing.bit, timing.modulus, timing.rate) == (26, 250_005, 4)
        check(random_rows(timing.bit, 7, 0), engine=CXXRTLEngine, timing=timing)

    def test_on_amaranths_own_simulator(self):
        check(random_rows(TIMING.bit, 3, 0, 9000))

    @pytest.mark.compiler
    def test_any_line(self):
        @RANDOM
        @given(st.lists(st.one_of(
            st.tuples(st.integers(0, 1), st.integers(1, 60)).map(lambda run: [run[0]] * run[1]),
            st.sampled_from([b":x9\r", b":v59999\r", b":e0\r", b":x?\r"]).map(
                lambda text: encode(text, TIMING.bit))), max_size=6),
            st.lists(st.integers(0, 2000), max_size=2))
        def run(pieces, resets) -> None:
            line = [1] * 5 + [level for piece in pieces for level in piece] + [1] * 900
            check({"rx": line, "rst": [int(clock in resets) for clock in range(len(line))]},
                  engine=CXXRTLEngine)

        run()


class TestSession:
    def test_says_hello_and_does_nothing(self):
        seen = session(after=3000)
        assert sent(seen) == HELLO
        assert not seen["position"].any() and not seen["moving"].any()
        assert seen["enable"].all() and set(seen["coils"][1:]) == {PHASES[0]}

    def test_goes_there_and_back(self):
        seen = session(b"v50000", b"x20", b"x?", b"x3", b"x?", pause=120)
        assert sent(seen)[len(HELLO):].split() == [
            b"ok", b"ok", b"x:20", b"ok", b"ok", b"x:3", b"ok"]
        assert seen["position"].max() == 20 and seen["position"][-1] == 3

    def test_a_new_set_point_is_turned_to_at_once(self):
        """In the middle of the way, with the next step."""
        seen = session(b"v6000", b"x900", b"x0", after=9000)
        place = seen["position"].astype(int)
        top = place.max()
        assert 0 < top < 900 and place[-1] == 0
        steps = np.flatnonzero(np.diff(place))
        assert set(np.diff(steps[1:])) == {10}

    @pytest.mark.compiler
    def test_more_frames_than_can_be_answered(self):
        """Nothing hangs: what does not fit is lost or refused, and then all is well again."""
        seen = session(*[b"x?"] * 200, pause=0, after=300_000, engine=CXXRTLEngine)
        lines = sent(seen)[len(HELLO):].split(b"\r\n")
        assert set(lines) == {b"x:0", b"ok", b"err command", b""}
        assert lines.count(b"x:0") == lines.count(b"ok") > 40

class TestTimes:
    @pytest.mark.compiler
    @pytest.mark.parametrize("speed", [1, 333, 7001, 59_999])
    def test_steps_are_exact_while_the_line_is_busy(self, speed):
        """The n-th step is less than a clock after its time, for all n, whatever is typed."""
        clocks = max(120_000, 4 * TIMING.modulus // speed)
        line = encode(b":v%d\r:x9999\r" % speed, TIMING.bit)
        rng = random.Random(speed)
        while len(line) < clocks:  # nothing that changes speed or set-point
            line += encode(rng.choice([b":x?\r", b":d\r", b"noise", b":v\r", b":xx\r"]), TIMING.bit)
        with single(CXXRTLEngine) as machine:
            seen = machine.apply({"rx": [1] * 9 + line}, OUTPUTS)
        steps = np.flatnonzero(np.diff(seen["coils"].astype(int))[2:])
        step = Fraction(60 * 48_000, 48 * speed)
        assert len(steps) > 2
        # When the sum began is known to a clock, from the first step of all that are alike.
        due = [-(-n * step.numerator // step.denominator) for n in range(len(steps))]
        late = steps[1:] - steps[1] - (np.array(due)[1:] - due[1])
        assert late.max() - late.min() <= 1, speed
        assert abs(int(steps[-1] - steps[1]) - float(step * (len(steps) - 2))) < 1

    @pytest.mark.compiler
    def test_a_new_speed_counts_for_the_step_under_way(self):
        """At 1 rpm a step takes 60 000 clocks; the rest of one at 10 000 takes 6 or fewer."""
        frames = [b"v1", b"x5", b"v10000"]
        seen = session(*frames, pause=60, after=600, engine=CXXRTLEngine)
        steps = np.flatnonzero(np.diff(seen["position"].astype(int)))
        ended = sum(len(frame) + 2 + 6 for frame in frames) * 160
        assert len(steps) == 5 and steps[1] - ended < 1200
        assert set(np.diff(steps[1:])) == {6}

    @pytest.mark.parametrize(("clock", "baud", "timing"), [
        (50_000_000, 9600, SingleTiming(5208, 62_500_000, 1)),
        (48_000, 3000, SingleTiming(16, 60_000, 1, 48_000)),
        (1_000_001, 9600, SingleTiming(104, 5_000_005, 4, 1_000_001)),
    ])
    def test_pace(self, clock, baud, timing):
        assert SingleTiming.real(clock=clock, baud=baud) == timing
        assert Fraction(timing.modulus, timing.rate) == Fraction(60 * clock, 48)

    @pytest.mark.parametrize(("facts", "message"), [
        ({"clock": 47_999}, "clock must be a whole number from 48000 to 1000000000, not 47999"),
        ({"clock": 5e7}, "clock must be a whole number from 48000 to 1000000000, not 50000000.0"),
        ({"turn": 0}, "turn must be a whole number from 1 to 10000, not 0"),
        ({"baud": 0}, "baud at a clock of 50000000 Hz must be a whole number from 1 to 3125000, "
                      "not 0"),
    ])
    def test_impossible_paces(self, facts, message):
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            SingleTiming.real(**facts)


class TestRamp:
    """At 48 kHz, with 2000 steps/s² up to 1000 rpm, which are 800 steps/s, in 160 steps."""

    RAMP = 2000

    def run(self, *pieces: bytes | int) -> dict[str, np.ndarray]:
        """Type frames, and wait so many clocks."""
        line = [1] * 4 * TIMING.bit
        for piece in pieces:
            line += [1] * piece if isinstance(piece, int) else encode(b":" + piece + b"\r",
                                                                     TIMING.bit)
        with single(CXXRTLEngine, ramp=self.RAMP) as machine:
            return machine.apply({"rx": line}, OUTPUTS)

    def check(self, seen, begins: int, *movements: int) -> None:
        """Demand of coil changes that they are movements of so many steps, each with a whole ramp.

        Between two steps it takes as long as it does for a constant acceleration, or at the speed
        that is set; sooner by two clocks at the new rate at most, later by two.
        """
        words = seen["coils"].astype(int)
        place = np.array([PHASES.index(word) for word in words[begins:]])
        steps = (np.diff(place) + 4) % 8 - 4
        times = begins + np.flatnonzero(steps)
        ways = steps[steps != 0]
        assert [int(way) for way in ways] == [
            np.sign(number) for number in movements for _ in range(abs(number))]
        first = 0
        for number in map(abs, movements):
            took = np.diff(times[first:first + number])
            levels = np.minimum(np.arange(1, number), np.arange(number - 1, 0, -1))
            exact = 48_000 * sqrt(2 / self.RAMP) * (np.sqrt(levels) - np.sqrt(levels - 1))
            exact = np.maximum(exact, 60)  # 800 steps/s
            turn = number // 2
            assert (np.diff(took[:turn]) <= 1).all() and (np.diff(took[turn:]) >= -1).all()
            before = np.concatenate(([exact[0]], exact[:-1]))
            assert (took - exact > -1 - 2 * exact / before).all()
            assert (took - exact < 2 + exact / 400).all()  # rates are rounded
            first += number

    @pytest.mark.compiler
    def test_there_and_back(self):
        """Up to the top, there for a while, and down to the set-point; then a short way back."""
        seen = self.run(b"v1000", b"x400", 50_000, b"x350", 20_000)
        begins = np.flatnonzero(seen["moving"])[0]
        self.check(seen, begins, 400, -50)
        assert seen["position"][-1] == 350 and not seen["moving"][-1]

    @pytest.mark.compiler
    def test_turned_back_in_the_middle(self):
        """It slows down as it sped up, stands, and comes back with a whole ramp."""
        seen = self.run(b"v1000", b"x400", 14_000, b"x20", 50_000)
        place = seen["position"].astype(int)
        top = place.max()
        assert 100 < top < 300 and place[-1] == 20
        self.check(seen, np.flatnonzero(seen["moving"])[0], int(top), 20 - int(top))

    @pytest.mark.compiler
    def test_above_the_top_and_without_power(self):
        """Faster than the ramp goes is as fast as it goes; power lost is speed lost."""
        seen = self.run(b"v9999", b"x400", b"v?", 25_000, b"e0", b"e1", 40_000)
        assert b"v:9999\r\nok" in sent(seen)
        steps = np.flatnonzero(np.diff(seen["position"].astype(int)))
        took = np.diff(steps)
        assert took.min() in (59, 60) and seen["position"][-1] == 400
        on = int(np.flatnonzero(np.diff(seen["enable"].astype(int)) == 1)[0])
        number = np.searchsorted(steps, on)
        first = 48_000 * sqrt(2 / self.RAMP)
        assert abs(took[number] - first) < 6 and abs(took[number + 1] - first * 0.4142) < 6

    @pytest.mark.compiler
    @pytest.mark.parametrize("stimulus", [
        lambda: directed(model(), 4, 80_000), lambda: random_rows(TIMING.bit, 5, 0)])
    def test_is_its_model_in_every_clock(self, stimulus):
        line = stimulus()
        with single(CXXRTLEngine, ramp=self.RAMP) as machine:
            seen = machine.apply(line, OUTPUTS)
        rates = ramp_rates(acceleration=self.RAMP, top=16 * 1000, modulus=16 * TIMING.modulus,
                           clock=48_000)
        as_told = SingleModel(bit=TIMING.bit, modulus=16 * TIMING.modulus, rate=16, ramp=rates,
                              greeting=HELLO[:4], help_text=HELLO[4:])
        expected = ModelRunner(as_told).apply(line, OUTPUTS)
        for name in OUTPUTS:
            differ = np.flatnonzero(seen[name] != expected[name])
            assert not differ.size, (name, differ[0])
        assert seen["position"].any()

    @pytest.mark.parametrize(("facts", "message"), [
        ({"ramp": -1}, "ramp must be a whole number from 0 to 1000000, not -1"),
        ({"ramp": 1000, "top_speed": 0}, "top_speed must be a whole number from 1 to 59999, not 0"),
        ({"ramp": 10}, "at 10 steps/s² it takes more than 4096 steps to the highest rate: "
                       "have more acceleration, or a lower rate"),
    ])
    def test_impossible(self, facts, message):
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            Single(**facts)


class TestPhases:
    def test_tables_are_those_of_the_drivers_the_other_way(self):
        """A motor that is wired as sequences say turns the other way: so it is told which it is."""
        half = [*reversed(swap_inner(HALF_STEP))]
        start = half.index(PHASES[0])
        assert tuple(half[start:] + half[:start]) == PHASES == BIPOLAR
        assert swap_inner(PHASES) == UNIPOLAR
        assert set(UNIPOLAR[1::2]) == set(FULL_STEP)
