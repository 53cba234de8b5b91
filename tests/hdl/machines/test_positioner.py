# amaranth: UnusedElaboratable=no

"""The positioner on its pins: as its model at every clock, and as its users rely on it."""

import gc
import random
import re
from functools import cache

import numpy as np
import pytest

from fresa.machines import Positioner
from fresa.machines.positioner import PositionerTiming
from tb.boards import component
from tb.design import Design
from tb.engines import AmaranthEngine, CXXRTLEngine
from tb.machines.positioner.model import PositionerModel
from tb.models.protocol import bits
from tb.runners import ModelRunner
from tb.uart import decode_output, encode

NO_COMPILER = CXXRTLEngine.missing()
PINS = ["tx", "step", "direction", "enable", "buzzer", "connected", "moving", "fault"]
BIT = 16
TIMING = PositionerTiming(clock=16_000, baud=1000, top_speed=1500, width=2, low=3, setup=2, hold=4,
                      settle=30, report=14_000)
BACKLASH = (3, 0, 12)
REPORT = re.compile(rb"# POS (-?\d+) (-?\d+) (-?\d+) :")
ON_THE_WIRE = BIT * 10


def design_of(timing: PositionerTiming, **options) -> Design:
    return component("positioner", Positioner(timing=timing, **options))


elaborated_once = cache(design_of)  # it takes more time than most of what is done with it


def engine_of(timing: PositionerTiming = TIMING, **options):
    if NO_COMPILER:
        return AmaranthEngine(design_of(timing, **options))
    return CXXRTLEngine(elaborated_once(timing, **options))


def encoded(*lines: str) -> list[int]:
    """Put lines on the serial line, one after the other."""
    return encode("".join(f"{line}\n" for line in lines).encode(), BIT)


class Desk:
    """The machine with someone at the line."""

    def __init__(self, **options) -> None:
        self.engine = engine_of(**options)
        self.inverted = options.get("inverted", False)
        self.seen = {name: np.empty(0, int) for name in PINS}
        self.engine.set(rx=1)
        self.wait(60)

    def apply(self, rx: list[int]) -> None:
        for name, values in self.engine.apply({"rx": rx}, PINS).items():
            self.seen[name] = np.concatenate([self.seen[name], values])

    def wait(self, clocks: int) -> None:
        self.apply([1] * clocks)

    def say(self, *lines: str) -> None:
        self.apply(encoded(*lines) + [1] * 60)

    @property
    def text(self) -> bytes:
        return decode_output(self.seen["tx"], BIT).text

    @property
    def answers(self) -> list[str]:
        return REPORT.sub(b"", self.text).decode().split("\n")[:-1]

    def motors(self) -> list[int]:
        """Count what left the pins."""
        flip = 7 if self.inverted else 0
        step, way = self.seen["step"] ^ flip, self.seen["direction"] ^ flip
        rises = ~step[:-1] & step[1:]
        return [int((np.where(way[1:] >> n & 1, 1, -1) * (rises >> n & 1)).sum())
                for n in range(3)]

    def reported(self) -> list[int]:
        """Wait for a report, and return it."""
        self.wait(TIMING.report + 50 * ON_THE_WIRE)
        return [int(number) for number in REPORT.findall(self.text)[-1]]


@pytest.fixture
def desk():
    made = Desk()
    yield made
    made.engine.close()


class TestSession:
    @pytest.mark.compiler
    def test_points_and_reports(self, desk):
        desk.say("CONNECT", "VEL MOT1 1500", "VEL MOT2 1000", "P 1 40 -30 5", "GOTO 1")
        assert desk.reported() == [40, -30, 5] == desk.motors()
        desk.say("ORIGIN", "P 2 -10 0 7", "GOTO 2")
        assert desk.reported() == [-10, 0, 7]
        assert desk.motors() == [30, -30, 12]
        desk.say("POS 1000000 -2147483648 2147483647")
        assert desk.reported() == [1000000, -2**31, 2**31 - 1]
        assert desk.answers == [] and desk.motors() == [30, -30, 12]

    def test_a_cr_before_the_line_feed_is_not_part_of_a_line(self, desk):
        desk.say("CONNECT\r", "POS 1 2 3\r", "\r", "STOP\r MOT1", "ORIGIN\r\r")
        assert desk.reported() == [1, 2, 3]
        assert desk.answers == ["! COMMAND"] * 3

    def test_a_byte_without_stop_bit_damages_its_line_alone(self, desk):
        desk.say("CONNECT")
        desk.apply(encode(b"MOV MOT1", BIT) + [0] * 10 * BIT + [1] * 20
                   + encode(b" C\nPOS 7 8 9\n", BIT))
        assert desk.reported() == [7, 8, 9]
        assert desk.answers == ["! DAMAGED"]

    @pytest.mark.compiler
    def test_all_answers_are_whole_lines_at_any_time(self, desk):
        """A flood of bad lines, with movements under it: nothing is garbled, no report is late."""
        desk.say("CONNECT", "MOV MOT1 C", "MOV MOT2 CC")
        for _ in range(15):
            desk.say("MOV MOT9 C", "GOTO 99", "FOO")
        desk.wait(12 * TIMING.report)
        output = decode_output(desk.seen["tx"], BIT)
        reports = [clock for clock, byte in zip(output.starts, output.text, strict=True)
                   if byte == ord("#")]
        assert set(np.diff(reports)) == {TIMING.report}
        assert desk.answers == ["! ARGUMENT", "! RANGE", "! COMMAND"] * 15

    @pytest.mark.compiler
    def test_more_bad_lines_than_can_be_answered(self, desk):
        """No byte is lost, a stop acts at once all the same, and then all is well."""
        desk.say("CONNECT", "MOV MOT2 C")
        desk.apply(encode(b"\n" * 150, BIT))
        assert desk.engine.get("moving") == 0b010
        desk.say("STOP MOT2")
        assert desk.engine.get("moving") == 0
        y = desk.motors()[1]
        desk.wait(20 * TIMING.report)
        known = desk.answers.count("! COMMAND")
        rest = len(desk.answers) - known
        assert desk.answers == ["! COMMAND"] * known + ["! OVERFLOW"] * rest
        assert known > 31 and 0 < rest < 150 - known
        assert desk.reported() == [0, y, 0] == desk.motors()

    @pytest.mark.compiler
    def test_each_line_has_one_answer_in_its_order(self, desk):
        desk.say("CONNECT", "ACK 1", "MOV MOT1 C", "STOP MOT1", "FOO", "STATE", "ACK 1", "ACK 0",
                 "CONNECT", "GOTO 1", "ACK 2")
        x = desk.motors()[0]
        desk.wait(4 * TIMING.report)
        *answers, state = sorted(desk.answers, key=lambda line: line.startswith("STATE"))
        assert answers == ["ok", "ok", "ok", "! COMMAND", "ok", "! EMPTY", "! RANGE"]
        assert desk.answers.index(state) == 4 and x > 0
        seconds = int(state.split()[-1])
        assert state == f"STATE 1 0 0 0 200 200 200 0 0 0 {x} 0 0 {seconds}"
        output = decode_output(desk.seen["tx"], BIT)
        at = output.starts[output.text.index(b"STATE")]
        assert seconds == at // TIMING.clock and at % TIMING.report == 4

    @pytest.mark.compiler
    def test_the_state_has_all_that_a_host_needs_also_when_not_connected(self, desk):
        desk.engine.set(limits=0b110)
        desk.say("STATE")
        desk.wait(2 * TIMING.report)
        desk.say("VEL MOT3 7", "POS 4294967246 5 4294967295", "CONNECT", "MOV MOT2 CC",
                 "STATE")
        desk.wait(2 * TIMING.report)
        before, after = ([int(word) for word in line.split()[1:]] for line in desk.answers)
        assert before[:-1] == [0, 0, 0, 0, 200, 200, 200, 0, 1, 1, 0, 0, 0]
        y = after.pop(11)
        assert after[:-1] == [1, 0, 1, 0, 200, 200, 7, 0, 1, 1, -50, -1]
        assert y < 5 and after[-1] > before[-1]

    @pytest.mark.compiler
    def test_a_reset_begins_the_seconds_anew_and_ends_acknowledging(self, desk):
        desk.say("ACK 1")
        desk.wait(3 * TIMING.clock)
        desk.engine.set(rst=1)
        desk.wait(1)
        desk.engine.set(rst=0)
        desk.wait(60)
        desk.say("CONNECT", "STATE")
        desk.wait(2 * TIMING.report)
        first, state = desk.answers
        assert first == "ok" and re.fullmatch("STATE 1 0 0 0 200 200 200 0 0 0 0 0 0 [012]", state)

    @pytest.mark.compiler
    def test_as_the_original_it_sends_reports_and_nothing_else(self):
        desk = Desk(original=True)
        desk.engine.set(limits=1)
        desk.say("ACK 1", "FOO", "STATE", "CONNECT", "MOV MOT1 C", "MOV MOT2 C", "\n" * 60, "ACK 1")
        desk.say("STOP MOT2", "POS 4294967246 0 0", "STATE")
        desk.wait(3 * TIMING.report)
        assert re.fullmatch(rb"# POS 0 (\d+) 0 :(# POS -50 0 0 :)+", desk.text)
        desk.engine.close()


class TestLimits:
    @pytest.mark.compiler
    def test_a_limit_blocks_one_way_of_one_axis(self):
        limit_ends = "Z-", "X-", "Y+"
        for number, limit_end in enumerate(limit_ends):
            axis, up = "XYZ".index(limit_end[0]), limit_end[1] == "+"
            towards, away = ("C", "CC") if up else ("CC", "C")
            desk = Desk(limit_ends=limit_ends)
            desk.engine.set(limits=1 << number)
            desk.say("CONNECT", *(f"MOV MOT{n} {towards}" for n in (1, 2, 3)))
            desk.wait(1000)
            moved = desk.motors()
            assert moved[axis] == 0 and all(moved[n] for n in range(3) if n != axis)
            assert desk.engine.get("buzzer")
            desk.say(f"MOV MOT{axis + 1} {away}")
            desk.wait(1000)
            assert desk.motors()[axis] * (1 if up else -1) < 0
            desk.wait(2 * TIMING.report)
            assert desk.answers == [f"! LIMIT MOT{axis + 1}"] and not desk.engine.get("buzzer")
            desk.engine.close()

    def test_a_movement_that_was_blocked_does_not_go_on(self, desk):
        desk.say("CONNECT", "P 1 50 50 50", "GOTO 1")
        desk.engine.set(limits=1)
        desk.wait(200)
        at = desk.motors()[0]
        desk.engine.set(limits=0)
        assert desk.reported() == [at, 50, 50] and 0 < at < 50


class TestTimes:
    def check(self, seen, timing: PositionerTiming, motor: int, *, inverted: bool = False) -> int:
        """Lay a ruler on the pins of a motor; return its steps."""
        def level(name):
            return (seen[name] >> motor & 1) ^ (inverted and name != "enable")

        step = level("step")
        edges = np.diff(step.astype(int))
        rises, falls = np.flatnonzero(edges == 1) + 1, np.flatnonzero(edges == -1) + 1
        assert (falls - rises[:len(falls)] == timing.width).all()
        assert (rises[1:] - falls[:len(rises) - 1] >= timing.low).all()
        assert level("enable")[rises].all()
        for name in ("direction", "enable"):
            for change in np.flatnonzero(np.diff(level(name).astype(int))) + 1:
                assert not step[change - 1:change + 1].any()
                after, before = rises[rises >= change], falls[falls <= change]
                assert not after.size or after[0] - change >= timing.setup
                assert not before.size or change - before[-1] >= timing.hold
        return len(rises)

    @pytest.mark.compiler
    @pytest.mark.parametrize("inverted", [False, True])
    def test_of_the_driver_modules(self, inverted):
        desk = Desk(inverted=inverted, backlash=BACKLASH)
        rng = random.Random(inverted)
        desk.say("CONNECT", *(f"VEL MOT{n} 1500" for n in (1, 2, 3)))
        for _ in range(60):
            n = rng.randint(1, 3)
            desk.say(rng.choice([f"MOV MOT{n} C", f"MOV MOT{n} CC", f"STOP MOT{n}", "CONNECT"]))
            desk.wait(rng.randrange(300))
        desk.say("DISCONNECT")
        assert min(self.check(desk.seen, TIMING, n, inverted=inverted) for n in range(3)) > 40
        assert desk.engine.get("step", "direction")[0] == (7 if inverted else 0)
        desk.engine.close()

    @pytest.mark.compiler
    def test_backlash_is_taken_up_and_not_counted(self):
        desk = Desk(backlash=BACKLASH)
        desk.say("CONNECT", "P 1 20 20 20", "P 2 0 0 0", "GOTO 1")
        assert desk.reported() == [20, 20, 20] and desk.motors() == [23, 20, 32]
        desk.say("GOTO 2")
        assert desk.reported() == [0, 0, 0] == desk.motors()
        desk.engine.close()

    @pytest.mark.compiler
    @pytest.mark.parametrize("rates", [(1, 1500, 200), (7, 1499, 997), (1500, 1500, 1500)])
    def test_steps_have_no_jitter_beyond_the_rounding_of_the_rate(self, rates):
        """All axes at once, while the line is busy both ways: less than a clock, for every step."""
        timing = PositionerTiming.real(clock=153_600)
        with engine_of(timing) as engine:
            orders = "CONNECT\n" + "".join(
                f"VEL MOT{n} {rate}\nMOV MOT{n} {'CC' if n == 2 else 'C'}\n"
                for n, rate in enumerate(rates, 1))
            engine.set(rx=1)
            engine.run(60)
            engine.apply({"rx": encode(orders.encode(), BIT) + [1] * 100}, PINS)
            busy = encoded("FOO", "POS 1 2", "P 1 2 3 4", "VEL MOT1 0", "STOP MOT4", "CONNECT")
            seen = engine.apply({"rx": (busy * (400_000 // len(busy) + 1))[:400_000]}, PINS)
        sent = decode_output(seen["tx"], BIT).text
        assert len(sent) > 400_000 // 160 * 0.8
        for motor, rate in enumerate(rates):
            step = seen["step"] >> motor & 1
            rises = np.flatnonzero(np.diff(step.astype(int)) == 1)
            assert len(rises) >= 400_000 * rate // timing.clock - 1
            # Each is the first clock at or after the time when it should be.
            late = rises * rate - np.arange(len(rises)) * timing.clock
            assert late.max() - late.min() < rate if len(rises) else rate < 5

    @pytest.mark.compiler
    def test_a_million_steps_a_second(self):
        """At the board's clock, with pulses for such a module, while it reports at 9600 baud."""
        timing = PositionerTiming.real(top_speed=1_000_000, width_ns=400, low_ns=400, setup_ns=200,
                                   hold_ns=200)
        rates = (1_000_000, 999_983, 31_415)
        orders = "CONNECT\n" + "".join(f"VEL MOT{n} {rate}\nMOV MOT{n} C\n"
                                       for n, rate in enumerate(rates, 1))
        with engine_of(timing) as engine:
            engine.set(rx=1)
            engine.run(20_000)
            for level in encode(orders.encode() + b"BUSY\n", 1):
                engine.set(rx=level)
                changes = engine.run(5208, ["step"])
            changes = engine.run(1_000_000, ["step"])
        for motor, rate in enumerate(rates):
            step = changes.values["step"] >> motor & 1
            rises = changes.clock[1:][np.diff(step.astype(int)) == 1]
            assert abs(len(rises) - rate // 50) <= 1
            late = rises * rate - np.arange(len(rises)) * timing.clock
            assert late.max() - late.min() < rate


def order(rng: random.Random) -> str:
    """Give a line, most of them good."""
    n, way = rng.randint(1, 3), rng.choice(["C", "CC"])
    near = [rng.randrange(-60, 60) for _ in range(3)]
    anywhere = [rng.choice([0, 1, -1, 5, 30, -30, 2**31 - 1, -2**31, 2**31, 2**32 - 50, 2**32])
                for _ in range(3)]
    return rng.choice([
        "CONNECT", "CONNECT", f"MOV MOT{n} {way}", f"MOV MOT{n} {way}", f"STOP MOT{n}",
        f"VEL MOT{n} {rng.choice([1, 50, 900, 1499, 1500, 1501, 0])}",
        "P {} {} {} {}".format(n, *near), "P {} {} {} {}".format(rng.randrange(9), *anywhere),
        f"GOTO {n}", f"GOTO {n}", "POS {} {} {}".format(*near), "POS {} {} {}".format(*anywhere),
        "STATE", f"ACK {rng.choice([0, 1, 1, 2])}",
        rng.choice(["ORIGIN", "ORIGIN\r", "FOO", "", "MOV MOT4 C", "CONNECT ", "GOTO -",
                    "DISCONNECT\nCONNECT", "DISCONNECT", *["x" * 260] * (rng.random() < 0.1)])])


def stimulus(seed: int, clocks: int) -> dict[str, np.ndarray]:
    """A terminal, a line with noise, switches, and now and then a reset."""
    rng = random.Random(seed)
    rx, limits = [1] * 40 + encoded("CONNECT"), []
    while len(rx) < clocks:
        line = bytearray(order(rng).encode() + b"\n")
        if rng.random() < 0.1:
            line[rng.randrange(len(line))] = rng.randrange(256)
        for byte in line:
            rx += [level for bit in bits(byte, stop=int(rng.random() > 0.001))
                   for level in [bit] * BIT]
        rx += [1] * rng.choice([0, 1, 7, 100, 1000, 3000])
        if rng.random() < 0.03:
            rx += [rng.randrange(2) for _ in range(rng.randrange(200))] + [1] * 20
    while len(limits) < clocks:
        limits += [rng.randrange(8) if rng.random() < 0.2 else 0] * rng.randrange(1, 3000)
    rst = [int(rng.random() < 1 / 50_000) for _ in range(clocks)]
    return {name: np.array(row[:clocks]) for name, row in
            {"rx": rx, "limits": limits, "rst": rst}.items()}


class TestModel:
    @pytest.mark.parametrize(("seed", "options"), [
        (1, {"inverted": True, "backlash": BACKLASH}),
        *(pytest.param(seed, options, marks=pytest.mark.long) for seed, options in [
            (0, {}), (4, {"original": True}),
            (12, {"limit_ends": ("X-", "Y+", "X+"), "backlash": (0, 1, 0)}),
            (3, {"limit_ends": ("Z-", "X-", "Y+")})])])
    def test_is_its_model_in_every_clock(self, seed, options):
        clocks = 12_000 if NO_COMPILER else 60_000
        given = stimulus(seed, clocks)
        with engine_of(**options) as engine:
            seen = engine.apply(given, PINS)
        model = PositionerModel(timing=TIMING, bit=BIT, **options)
        rows = ModelRunner(model).apply(given, PINS)
        for name in PINS:
            differs = np.flatnonzero(seen[name] != rows[name])
            assert not differs.size, (name, differs[0])
        assert NO_COMPILER or np.count_nonzero(np.diff(seen["step"])) > 40


class TestTiming:
    def test_real(self):
        assert PositionerTiming.real() == PositionerTiming(
            clock=50_000_000, baud=9600, top_speed=1500, width=95, low=95, setup=33, hold=33,
            settle=500_000, report=5_000_000)

    @pytest.mark.parametrize(("given", "expected"), [
        ({"clock": 0}, "clock must be a whole number from 1 to 1000000000, not 0"),
        ({"width_ns": 0}, "width_ns must be a whole number from 1 to 1310720, not 0"),
        ({"hold_ns": 1.5}, "hold_ns must be a whole number from 1 to 1310720, not 1.5"),
        ({"report_us": 10**7}, "report_us must be a whole number from 1 to 1342177, not 10000000"),
    ])
    def test_impossible_times(self, given, expected):
        with pytest.raises(ValueError, match=f"^{re.escape(expected)}$"):
            PositionerTiming.real(**given)

    @pytest.mark.filterwarnings("ignore::amaranth.hdl.UnusedElaboratable")
    @pytest.mark.parametrize(("timing", "options", "expected"), [
        ({"top_speed": 1_000_000}, {}, "top speed must be at most 263157 steps/s with pulses 190 "
         "clocks apart, not 1000000"),
        ({"top_speed": 0}, {}, "top speed must be a whole number from 1 to 50000000, not 0"),
        ({"report_us": 60_000}, {}, "baud must be at least 13838 for a report period of 3000000 "
         "clocks, not 9600"),
        ({"report_us": 50}, {}, "report period must be a whole number from 4323088 to 67108864, "
         "not 2500"),
        ({"baud": 8300}, {}, "baud must be at least 8301 for a report period of 5000000 clocks, "
         "not 8300"),
        ({"baud": 0}, {}, "baud at a clock of 50000000 Hz must be a whole number from 1 to "
         "3125000, not 0"),
        ({}, {"backlash": (1, 2)}, "there is a backlash and a limit end for each of 3 axes, not "
         "(1, 2) and ('X+', 'Y+', 'Z+')"),
        ({}, {"backlash": (1, 2, -1)}, "backlash must be a whole number from 0 to 1048576, not -1"),
        ({}, {"limit_ends": ("X+", "X+", "Y-")}, "limit ends must be different ends of X-, X+, "
                                                 "Y-, Y+, "
         "Z-, Z+, not ('X+', 'X+', 'Y-')"),
        ({}, {"limit_ends": ("X+", "Y", "Z-")}, "limit ends must be different ends of X-, X+, Y-, "
                                                "Y+, "
         "Z-, Z+, not ('X+', 'Y', 'Z-')"),
    ])
    def test_what_does_not_go_together(self, timing, options, expected):
        message = None
        try:  # what was made before the refusal is let go of here, not later
            Positioner(timing=PositionerTiming.real(**timing), **options)
        except ValueError as error:
            message = str(error)
        gc.collect()
        assert message == expected
