# amaranth: UnusedElaboratable=no

"""Actions to blocks: the words of each against the model of planning."""

import random
from collections.abc import Mapping, Sequence
from fractions import Fraction
from math import atan2, cos, hypot, pi, sin, tau

import pytest

from fresa.arithmetic import Line
from fresa.motion.blocks import BlockHeader, BlockKind, BlockWord, OverrideKind
from fresa.motion.gcode_planner import GCodePlanner, HomingRequest
from fresa.protocol import SETTINGS as SETTING_LIST
from fresa.protocol import (
    GCodeAction,
    GCodeActionKind,
    GCodeMotion,
    Operand,
    setting_values,
)
from tb.boards import component
from tb.design import Design
from tb.engines import AmaranthEngine, CXXRTLEngine, Engine
from tb.models.gcode_plan import MotionBlock, Planner, PlanSettings

WORD = 1 << 36
LINE = Line(clock=2_000_000, speeds=(50_000_000, 40_000_000, 10_000_000),
            accelerations=(1_000_000_000, 800_000_000, 2_000_000_000),
            steps=(80_000, 40_000, 250_000), deviation=20_000)
GAP = 6
SETTINGS = PlanSettings(LINE.clock, LINE.speeds, LINE.accelerations, LINE.steps, LINE.deviation)

OVERRIDES = {GCodeActionKind.LINE: OverrideKind.FEED, GCodeActionKind.RAPID: OverrideKind.RAPID,
             GCodeActionKind.PROBE: OverrideKind.NONE}
"""What overrides the speed of a straight line."""


class Machine:
    """The gateware between an interpreter and a queue."""

    def __init__(self, engine: Engine) -> None:
        self.engine = engine
        self.operands: Mapping[int, int] = {}
        self.settings = setting_values({})
        self.committed = 0
        self.words: dict[int, int] = {}
        self.positions: list[int] = []
        engine.set(words_ready=1, positions_ready=1, room=1, feed_override=100,
                   rapid_override=100)
        engine.run(1)

    def clock(self) -> None:
        """Go to the next clock: take what is offered, and read an operand."""
        valid, word, position_valid, position, address = self.engine.get(
            "words_valid", "words_payload", "positions_valid", "positions_payload",
            "operand_address")
        if valid:
            self.words[word & 31] = word >> 5 & WORD - 1
            self.committed |= word >> 41
        if position_valid:
            assert position & 3 == len(self.positions)
            self.positions.append((position >> 2 ^ 1 << 43) - (1 << 43))
        setting = self.engine.get("setting_address")
        self.engine.run(1)
        self.engine.set(operand=self.operands.get(address, 0) % (1 << 44),
                        setting=self.settings[min(setting, len(SETTING_LIST) - 1)])

    def do(self, kind: GCodeActionKind, operands: Mapping[int, int], **modes: int
           ) -> dict[int, int] | None:
        """Do an action; return the words of its block, if it has one."""
        self.operands, self.committed = operands, 0
        self.engine.set(actions_valid=1, actions_payload=GCodeAction.const(
            {"kind": kind, "modes": modes}).as_bits())
        return self._wait("actions_ready")

    def begin(self, steps: Sequence[int]) -> dict[int, int] | None:
        """Begin at a place."""
        self.committed = 0
        self.positions = []
        self.engine.set(begin=1, **{f"steps_{axis}": each % WORD
                                    for axis, each in enumerate(steps)})
        return self._wait("begun")

    def configure(self, values: Mapping[int, int]) -> int:
        """Take settings; return the verdict."""
        self.settings = setting_values(values)
        self.engine.set(configure=1)
        self._wait("configured")
        return self.engine.get("verdict")

    def home(self, kind: HomingRequest, **request: int) -> dict[int, int] | None:
        """Serve a homing cycle."""
        self.committed = 0
        self.engine.set(homing_kind=kind.value, **{
            f"homing_{name}": value for name, value in request.items()})
        return self._wait("homed")

    def _wait(self, name: str) -> dict[int, int] | None:
        while not self.engine.get(name):
            self.clock()
        self.clock()
        self.engine.set(actions_valid=0, begin=0, configure=0, homing_kind=0)
        self.clock()
        words, self.words = self.words, {}
        return words if self.committed else None


def pair(words: Mapping[int, int], high: int) -> int:
    return words[high] * WORD + words[high + 1]


def check(engine: Engine, seed: int, count: int) -> None:
    """Do random actions, and compare all blocks."""
    rng = random.Random(seed)
    machine = Machine(engine)
    steps = [rng.randint(-10**5, 10**5) for _ in range(3)]
    begin = machine.begin(steps)
    model = Planner(SETTINGS, machine.positions)
    for at, count_steps, per_metre in zip(machine.positions, steps, LINE.steps, strict=True):
        assert abs(at * per_metre - count_steps * 10**9) <= per_metre
    assert begin and BlockHeader.from_bits(begin[0]).kind == BlockKind.PLACE
    assert tuple(begin[BlockWord.PLACE + axis] for axis in range(3)) == model.places(
        model.position)
    outputs_before = False
    for _ in range(count):
        feed = rng.randint(1, 2 << 29)
        size = rng.choice([0, 1, 1000, 10**6, 10**9])
        target = [at + rng.choice([0, rng.randint(-size, size)]) for at in model.position]
        operands = {Operand.FEED: feed, Operand.SPEED: rng.getrandbits(30),
                    Operand.DWELL: rng.choice([0, 1, 10**6, 1 << 40])}
        operands |= {Operand.TARGET + axis: each for axis, each in enumerate(target)}
        operands |= {Operand.ORIGIN + axis: rng.randint(-1 << 34, 1 << 34) for axis in range(3)}
        kind = rng.choice([GCodeActionKind.LINE] * 3 + [
            GCodeActionKind.RAPID, GCodeActionKind.PROBE, GCodeActionKind.DWELL,
            GCodeActionKind.SPINDLE,
            GCodeActionKind.COOLANT, GCodeActionKind.PAUSE, GCodeActionKind.OFFSETS])
        modes = {name: rng.getrandbits(1) for name in ("clockwise", "mist", "flood")}
        if rng.random() < 0.3:
            model.feed_override = rng.choice([10, 99, 100, 200, rng.randint(10, 200)])
            model.rapid_override = rng.choice([25, 50, 100])
            engine.set(feed_override=model.feed_override, rapid_override=model.rapid_override)
        override = model.feed_override
        if kind == GCodeActionKind.PROBE:
            model.feed_override = 100
        percent = (model.rapid_override if kind == GCodeActionKind.RAPID
                   else model.feed_override)
        inverse = rng.random() < 0.2
        words = machine.do(kind, operands, inverse=inverse, **modes)
        if kind == GCodeActionKind.OFFSETS:
            assert words is None
            for axis in range(3):
                engine.set(shown_read=1, shown_address=12 + axis)
                engine.run(1)
                engine.set(shown_read=0)
                engine.run(1)
                origin = (engine.get("shown") ^ 1 << 26) - (1 << 26)
                assert abs(origin * 1000 - operands[Operand.ORIGIN + axis]) <= 500
            continue
        block = None
        if kind in OVERRIDES:
            before = model.nominal
            block = model.line(target, None if kind == GCodeActionKind.RAPID else feed,
                               inverse=inverse)
            model.feed_override = override
            if block is None:
                assert words is None
                assert model.nominal == before
                continue
            outputs_before = False
        assert words
        header = BlockHeader.from_bits(words[BlockWord.HEADER])
        assert {name: header.outputs[name] for name in modes} == modes
        limit = words[18] + words[19] * WORD
        if block:
            assert header.kind == BlockKind.MOTION
            assert [header.channel[axis] for axis in range(3)] == [0, 1, 2]
            assert not header.arc
            assert block == motion(words, percent)
            assert header.override == OVERRIDES[kind]
            assert words[BlockWord.EXTRA] == operands[Operand.SPEED]
            programmed = (words[BlockWord.MODULUS] >> 14) + (words[BlockWord.ENERGY] >> 26 << 22)
            if kind == GCodeActionKind.RAPID:
                assert programmed == (1 << 32) - 1
            elif not inverse:
                assert programmed == feed
        elif kind in {GCodeActionKind.SPINDLE, GCodeActionKind.COOLANT}:
            if outputs_before:
                model.stop()
            outputs_before = True
            assert (header.kind, limit) == (BlockKind.OUTPUTS, model.nominal)
            assert words[BlockWord.EXTRA] == operands[Operand.SPEED]
        else:
            model.stop()
            outputs_before = False
            assert limit == 0
            if kind == GCodeActionKind.DWELL:
                assert header.kind == BlockKind.DWELL
                assert words[BlockWord.EXTRA] == min(operands[Operand.DWELL], WORD - 1)
            else:
                assert header.kind == BlockKind.PAUSE
    assert not engine.get("fault")


def planner():
    return component("gcode_planner", GCodePlanner(line=LINE, gap=GAP, motors=2))


@pytest.fixture(scope="module")
def design() -> Design:
    return planner()


def motion(words: Mapping[int, int], percent: int = 100) -> MotionBlock:
    """Return what the words of a block say of a motion, with an override."""
    hundredth, fastest = words[BlockWord.HUNDREDTH], words[BlockWord.FASTEST]
    return MotionBlock(
        pair(words, BlockWord.ENERGY) % (1 << 62), pair(words, BlockWord.MODULUS) % (1 << 50),
        BlockHeader.from_bits(words[0]).log2_ticks, hundredth, fastest,
        min(hundredth * percent // 256, fastest)**2,
        words[16] + words[17] * WORD, words[18] + words[19] * WORD,
        tuple(words[BlockWord.PLACE + axis] for axis in range(3)))


@pytest.mark.compiler
@pytest.mark.parametrize("seed", [
    *range(2), *(pytest.param(seed, marks=pytest.mark.long) for seed in (2, 3))])
def test_settings_hold_from_the_next_line_on(design, seed):
    """A setting is in thousandths; a block is as if the machine had been built with it."""
    rng = random.Random(seed)
    with CXXRTLEngine(design) as engine:
        machine = Machine(engine)
        for _ in range(6):
            values = {number: rng.randint(1, most) for number, most in (
                *((100 + axis, 2 * 10**6) for axis in range(3)),
                *((110 + axis, 10**7) for axis in range(3)),
                *((120 + axis, 17_179_869) for axis in range(3)), (11, 268_435),
                (0, rng.choice([1, 500, 501, 5_000, 255_000])))}
            speeds, accelerations = (
                [values[first + axis] * 1000 // divisor for axis in range(3)]
                for first, divisor in ((110, 60), (120, 1)))
            width = -(-values[0] * LINE.clock // 10**9)
            most = Fraction(LINE.clock, (width + GAP) * 2)
            fast = any(Fraction(speed * values[100 + axis], 10**9) > most
                       for axis, speed in enumerate(speeds))
            assert machine.configure(values) == fast
            assert engine.get("pulse") == width
            assert engine.get(*(f"steps_per_metre_{axis}" for axis in range(3))) == tuple(
                values[100 + axis] for axis in range(3))
            settings = PlanSettings(LINE.clock, speeds, accelerations,
                                    [values[100 + axis] for axis in range(3)], values[11] * 1000)
            machine.begin([0, 0, 0])
            model = Planner(settings, machine.positions)
            for _ in range(3):
                target = [rng.randint(-10**8, 10**8) for _ in range(3)]
                words = machine.do(GCodeActionKind.LINE, {
                    Operand.FEED: 10**8,
                    **{Operand.TARGET + axis: at for axis, at in enumerate(target)}})
                assert words
                assert motion(words) == model.line(target, 10**8)
        assert not engine.get("fault")


@pytest.mark.compiler
@pytest.mark.parametrize("clock", [2_000_000, 50_000_000, 99_999_989])
def test_pulses_must_be_able_to_make_the_highest_speed(clock):
    """It is refused where it is too high by the least that a setting can say, and not below."""
    rng, gap = random.Random(clock), 37
    made = component("gcode_planner", GCodePlanner(line=Line(clock=clock), gap=gap))
    with CXXRTLEngine(made) as engine:
        machine = Machine(engine)
        for _ in range(5):
            pulse = rng.choice([1, 1000, rng.randint(1, 255_000)])
            width = -(-pulse * clock // 10**9)
            steps, axis = rng.randint(1, 10**6), rng.randrange(3)
            # um/min of which nm/s, rounded down, are no more than that
            most = 10**9 * clock // (width + gap) // steps
            highest = min(-(-(most + 1) * 60 // 1000) - 1, 128_849_018)
            for rate in highest, highest + 1:
                if 1 <= rate <= 128_849_018:
                    fast = rate * 1000 // 60 * steps * (width + gap) > clock * 10**9
                    assert machine.configure({0: pulse, 110 + axis: rate, 100 + axis: steps,
                                              **{110 + each: 1 for each in range(3)
                                                 if each != axis}}) == fast
                    assert engine.get("pulse") == width


@pytest.mark.compiler
def test_a_homing_cycle_has_its_lines(design):
    with CXXRTLEngine(design) as engine:
        machine = Machine(engine)
        machine.begin([100, -200, 3000])
        model = Planner(SETTINGS, machine.positions)
        values = {24: 25_000, 25: 600_000, 27: 1_000, 130: 20_000, 131: 30_000, 132: 50_000,
                  **{100 + axis: steps for axis, steps in enumerate(LINE.steps)}}
        machine.settings = setting_values(values)
        for axis, thousandths, back, near, slow in [
                (2, 1500, 0, 0, 0), (0, 5000, 1, 1, 1), (1, 1000, 0, 1, 0), (1, 1500, 1, 0, 0),
                (0, 1500, 0, 0, 1), (2, 1000, 1, 1, 0)]:
            words = machine.home(HomingRequest.MOVE, axis=axis, back=back, near=near, slow=slow,
                                 thousandths=thousandths, from_switch=0)
            offset = (-1 if back else 1) * values[27 if near else 130 + axis] * thousandths
            target = [at + offset * (each == axis) for each, at in enumerate(model.position)]
            assert words
            assert motion(words) == model.line(target, values[24 if slow else 25] * 1000 // 60)

        for wait in (0, 250, 65_535):
            machine.settings = setting_values({**values, 26: wait})
            words = machine.home(HomingRequest.WAIT)
            assert words
            assert BlockHeader.from_bits(words[BlockWord.HEADER]).kind == BlockKind.DWELL
            assert words[BlockWord.EXTRA] == 1000 * wait
            assert [words[word] for word in range(16, 20)] == [0] * 4
            model.stop()

        # A switch 20 mm below 0, where axis X is now, then 1 mm up from it
        machine.home(HomingRequest.PLACE, axis=0, back=1, thousandths=1000)
        assert engine.get("switch") == -1600 % WORD
        machine.begin([-1600, 0, 0])
        model = Planner(SETTINGS, machine.positions)
        words = machine.home(HomingRequest.MOVE, axis=0, back=0, thousandths=1000, near=1, slow=0,
                             from_switch=1)
        assert words
        assert motion(words) == model.line([-19 * 10**6, 0, 0], 10**7)
        for axis in 1, 2:
            for thousandths, back in (1000, 1), (0, 1), (1000, 0):
                machine.home(HomingRequest.PLACE, axis=axis, back=back, thousandths=thousandths)
                place = values[130 + axis] * LINE.steps[axis] * thousandths // 10**9
                assert engine.get("switch") == (-place if back else place) % WORD


@pytest.mark.compiler
@pytest.mark.parametrize("kind", [GCodeActionKind.LINE, GCodeActionKind.RAPID])
def test_soft_limits_let_nothing_out_of_the_travel(design, kind):
    inside = [(0, 0, 0), (-300_000_000, -10**6, -7), (-1, -20_000_000, -5_000_000), (0, -1, 0)]
    outside = [(1, 0, 0), (0, -20_000_001, 0), (-1, 0, 1), (0, 1, 0), (-5, -5, -5_000_001),
               (-300_000_001, 0, 0)]
    with CXXRTLEngine(design) as engine:
        machine = Machine(engine)

        def do(target, **how):
            return machine.do(kind, {Operand.FEED: 10**6, **{
                Operand.TARGET + axis: at for axis, at in enumerate(target)}}, **how)

        values = {130: 300_000, 131: 20_000, 132: 5_000}
        assert machine.configure(values) == 0
        machine.begin([-800, -800, -1000])
        engine.set(soft=1)
        for target in inside:
            assert do(target)
        for target in outside:
            engine.set(actions_valid=1, actions_payload=GCodeAction.const({"kind": kind}).as_bits())
            machine.operands = {Operand.FEED: 10**6, **{
                Operand.TARGET + axis: at for axis, at in enumerate(target)}}
            machine.committed = 0
            for _ in range(1000):
                machine.clock()
            assert engine.get("beyond", "actions_ready") == (1, 0), target
            assert not machine.committed
            engine.set(rst=1, actions_valid=0)
            engine.run(1)
            engine.set(rst=0)
        engine.set(soft=0)
        for target in outside:
            assert do(target)


def furthest(start: Sequence[float], centre: Sequence[float], end: Sequence[float], *,
             clockwise: bool) -> list[tuple[float, float]]:
    """Return how far an arc goes along both axes of its plane; its end is on the circle."""
    radius = hypot(start[0] - centre[0], start[1] - centre[1])
    first, last = (atan2(at[1] - centre[1], at[0] - centre[0]) for at in (start, end))
    sweep = (first - last if clockwise else last - first) % tau or tau
    found = []
    for axis in range(2):
        reached = [start[axis], end[axis]]
        for sign in 1, -1:
            turn = axis * pi / 2 + (0 if sign > 0 else pi) - first
            if (-turn if clockwise else turn) % tau < sweep:
                reached.append(centre[axis] + sign * radius)
        found.append((min(reached), max(reached)))
    return found


@pytest.mark.compiler
def test_soft_limits_let_no_arc_out_of_the_travel_on_its_way(design):
    rng = random.Random(7)
    travel = [30_000, 20_000, 10_000]  # um
    seen = {False: 0, True: 0}
    with CXXRTLEngine(design) as engine:
        machine = Machine(engine)
        assert machine.configure({130 + axis: each for axis, each in enumerate(travel)}) == 0
        engine.set(soft=1)
        for _ in range(30):
            machine.begin([-rng.randrange(length * per_metre // 10**6)
                           for length, per_metre in zip(travel, LINE.steps, strict=True)])
            plane, clockwise = rng.randrange(3), rng.random() < 0.5
            u, v = ((0, 1), (2, 0), (1, 2))[plane]
            start = [machine.positions[axis] for axis in (u, v)]
            i, j = (rng.randint(-6_000_000, 6_000_000) for _ in range(2))
            centre = start[0] + i, start[1] + j
            angle, radius = rng.uniform(0, tau), hypot(i, j)
            end = [round(centre[0] + radius * cos(angle)), round(centre[1] + radius * sin(angle))]
            if rng.random() < 0.1:
                end = start
            target = list(machine.positions)
            target[u], target[v] = end
            margins = [margin for axis, (low, high) in zip(
                (u, v), furthest(start, centre, end, clockwise=clockwise), strict=True)
                for margin in (-high, low + travel[axis] * 1000)]
            if abs(min(margins)) < 1000:
                continue
            out = min(margins) < 0
            seen[out] += min(*(-at for at in end), *(
                at + travel[axis] * 1000 for axis, at in zip((u, v), end, strict=True))) >= 0
            modes = {"plane": plane, "motion": GCodeMotion.CLOCKWISE if clockwise
                     else GCodeMotion.COUNTER_CLOCKWISE}
            engine.set(actions_valid=1, actions_payload=GCodeAction.const(
                {"kind": GCodeActionKind.ARC, "modes": modes}).as_bits())
            machine.committed = 0
            machine.operands = {Operand.FEED: 10**6, Operand.CENTRE + u: i, Operand.CENTRE + v: j,
                                **{Operand.TARGET + axis: at for axis, at in enumerate(target)}}
            while engine.get("beyond", "actions_ready") == (0, 0):
                machine.clock()
            assert engine.get("beyond") == out, (start, centre, end, clockwise, plane)
            assert bool(machine.committed) == (not out)
            machine.clock()
            engine.set(rst=1, actions_valid=0)
            engine.run(1)
            engine.set(rst=0)
    assert min(seen.values()) > 4, "an arc that ends within, and leaves, or does not"


@pytest.mark.compiler
@pytest.mark.parametrize("seed", [
    0, *(pytest.param(seed, marks=pytest.mark.long) for seed in (1, 2))])
def test_blocks_are_those_of_the_model(design, seed):
    with CXXRTLEngine(design) as engine:
        check(engine, seed, 60)


def test_blocks_are_those_of_the_model_without_a_compiler():
    with AmaranthEngine(planner()) as engine:
        check(engine, 7, 3)
