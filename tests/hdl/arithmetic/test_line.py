# amaranth: UnusedElaboratable=no

"""Formulas of lines: the tables against exact numbers, the gateware against the tables."""

import random
from fractions import Fraction
from math import floor

import pytest

from fresa.arithmetic import Line, line_formulas
from fresa.arithmetic.line import CORNER, REGISTERS, TABLES
from fresa.motion import SpeedProfile
from tb.boards import component
from tb.engines import AmaranthEngine, CXXRTLEngine
from tb.models.formulas import AXES, SIZE, FormulaModel
from tb.models.line import BEYOND, ONE, Bounds, Path, junction, place
from tests.hdl.arithmetic.registers import FormulaGateware


class Machine(FormulaModel):
    """The registers of lines."""

    def __init__(self, line: Line) -> None:
        super().__init__(REGISTERS, TABLES, line)


def number(rng: random.Random, bits: int) -> int:
    """Return a number of any length, often a round one, from 1."""
    size = rng.randint(1, bits)
    return min((1 << bits) - 1, max(1, rng.choice([rng.getrandbits(size), 1 << size - 1,
                                                   (1 << size) - 1])))


def settings(rng: random.Random) -> Line:
    """Return usual settings, or those at an end."""
    if rng.random() < 0.5:
        return Line(speeds=[rng.randint(10**6, 10**9) for _ in AXES],
                    accelerations=[rng.randint(10**7, 10**10) for _ in AXES],
                    steps=[rng.choice([40_000, 80_000, 250_000, 1_600_000]) for _ in AXES],
                    deviation=rng.randint(1_000, 100_000))
    return Line(clock=rng.choice([2_000_000, 50_000_000, (1 << 27) - 1, 100_000_000]),
                speeds=[rng.choice([2, 10**6, rng.randint(2, 1 << 30), (1 << 31) - 1])
                        for _ in AXES],
                accelerations=[rng.choice([1000, rng.randint(10**6, 1 << 33), (1 << 34) - 1])
                               for _ in AXES],
                steps=[max(1, number(rng, 27)) for _ in AXES], deviation=number(rng, 28))


def moves(rng: random.Random) -> list[int]:
    """Return a change of position of any length: a direction, or one axis, or almost one axis."""
    way = [rng.choice([0, 1, -1, rng.uniform(-1, 1), rng.uniform(-1e-6, 1e-6)]) for _ in AXES]
    length = rng.choice([number(rng, 35), number(rng, 24), rng.randint(1, 3)])
    return [min(CORNER, max(-CORNER, round(each * length))) for each in way]


def check(machine: Machine, start: list[int], end: list[int], before: list[int], feed: int,
          percent: int = 100) -> None:
    """Compare all results of a line with exact numbers."""
    line = machine.line
    places = [place(at, steps) for at, steps in zip(start, line.steps, strict=True)]
    increments = [place(to, steps) - at
                  for to, steps, at in zip(end, line.steps, places, strict=True)]
    assert [each % SIZE for each in machine.each("increment")] == [
        each % SIZE for each in increments]
    if start == end:
        return
    path = Path(start, end)
    small = 1 - Fraction(1, 1 << 33)
    unit = machine.each("unit")
    assert all(abs(a - b) <= 2 for a, b in zip(unit, path.unit(), strict=True))

    fastest = machine.get("fastest")
    assert fastest in Bounds(path.speed(SIZE, line.speeds, line.clock, short=1) * small - 1,
                             path.speed(SIZE, line.speeds, line.clock))
    hundredth = max(28, -(-256 * feed // 100))
    assert machine.get("hundredth") == hundredth
    assert hundredth == 28 or hundredth * 100 // 256 == feed
    assert machine.pair("nominal") == min(hundredth * percent // 256, fastest)**2
    speed = machine.get("speed")
    assert speed == min(hundredth, fastest)

    acceleration = machine.get("acceleration")
    top = (1 << 34) - 1
    assert acceleration in Bounds(
        min(top, path.along(line.accelerations, short=1)) * small - 1,
        min(Fraction(top), path.along(line.accelerations)))

    ticks = machine.get("ticks")
    gain = 2 * acceleration * path.length
    assert machine.pair("energy") == machine.pair("gain") >> ticks
    assert machine.pair("gain") == machine.pair("energy") << ticks
    assert machine.pair("gain") in Bounds(gain * small - (1 << ticks), gain)
    assert machine.pair("gain") < 1 << SpeedProfile().brake_bits
    if speed:
        modulus = path.length * line.clock * (1 << 16) / (1 << ticks)
        assert machine.pair("modulus") in Bounds(modulus * small - 1, modulus)
        assert 0 <= ticks <= 36
        finest = min(36, (46 if acceleration >= 5000 else 42) - 36 + max(
            abs(to - at) for to, at in zip(end, start, strict=True)).bit_length())
        assert ticks == finest or machine.pair("modulus") < 4 * speed << 16
        assert machine.pair("energy") >= 2
        assert ticks == 0 or 2 * modulus >= (4 * speed << 16)
    check_junction(machine, unit, before)


def check_junction(machine: Machine, unit: list[int], before: list[int]) -> None:
    line = machine.line
    found = machine.pair("junction")
    near = Fraction(1, 10**6)
    short = near + Fraction(1, min(line.accelerations))  # rounded down to nm/s²
    error = Fraction(8, ONE)  # counts where it turns back, to 0.05 degrees
    values = [junction(unit, before, line.accelerations, line.deviation, error=each)
              for each in (-error, error)]
    assert found in Bounds(values[0] * (1 - short) - 1, values[1] * (1 + near))
    assert machine.pair("limit") == min(found, machine.pair("nominal"),
                                        machine.pair("nominal_before"))


class TestTables:
    def test_take_their_clocks(self):
        assert {table.name: table.clocks(36) for table in TABLES} == {
            "line": 2761, "accept": 69, "report": 755, "begin": 471, "round": 399,
            "work": 21}

    @pytest.mark.parametrize("seed", range(4))
    def test_are_exact_for_random_programs(self, seed):
        rng = random.Random(seed)
        for _ in range(40):
            machine = Machine(settings(rng))
            at = [rng.choice([0, rng.randint(-CORNER, CORNER)]) for _ in AXES]
            machine.set(**{f"from_{axis}": word for axis, word in zip(AXES, at, strict=True)},
                        **{f"place_before_{axis}": place(word, steps) + 17 * 512 * steps
                           for axis, word, steps in zip(AXES, at, machine.line.steps,
                                                        strict=True)})
            for _ in range(10):
                to = [min(CORNER, max(-CORNER, a + b))
                      for a, b in zip(at, moves(rng), strict=True)]
                feed, percent = number(rng, 31), rng.choice([100, 10, 200, rng.randint(10, 200)])
                machine.set(feed=feed, override=percent << 28, **{f"to_{axis}": word
                                          for axis, word in zip(AXES, to, strict=True)})
                before = machine.each("unit_before")
                machine.run("line")
                check(machine, at, to, before, feed, percent)
                if at != to:
                    machine.run("accept")
                    at = to

    @pytest.mark.parametrize("turned", [(0, 0, 0), (1, 0, 0), (0, -1, 0), (2, 2, 1), (-40, 0, 9)])
    @pytest.mark.parametrize("way", [1, -1, 0])
    @pytest.mark.parametrize("end", [
        (1, 0, 0), (0, -1, 0), (1, 1, 1), (CORNER, 0, 0), (CORNER, CORNER, -CORNER),
        (CORNER, 1, 0), (-3, 4, 0), (10**9, 1, -1), (2**35 - 1 - 2**34, 7, 0)])
    def test_are_exact_where_a_path_goes_on_turns_back_or_begins(self, end, way, turned):
        machine = Machine(Line(speeds=[2**31 - 1, 10**6, 2], steps=[80_000, 250_000, 2**27 - 1]))
        ends = dict(zip(("to_x", "to_y", "to_z"), end, strict=True))
        machine.set(feed=10**7, **ends)
        machine.run("line")  # for its direction
        before = [way * a + b for a, b in zip(machine.each("unit"), turned, strict=True)]
        machine.set(**{f"unit_before_{axis}": word
                       for axis, word in zip(AXES, before, strict=True)},
                    **{f"place_before_{axis}": 17 * 512 * steps
                       for axis, steps in zip(AXES, machine.line.steps, strict=True)})
        machine.run("line")
        check(machine, [0, 0, 0], list(end), before, 10**7)
        if way == 1 and not any(turned):
            assert machine.pair("junction") == BEYOND

    @pytest.mark.parametrize(("acceleration", "ticks"), [(5000, 26), (5001, 30)])
    def test_ticks_of_little_acceleration_are_longer(self, acceleration, ticks):
        machine = Machine(Line(accelerations=[acceleration] * 3))
        machine.set(feed=1000, to_x=(1 << 20) - 1)
        machine.run("line")
        assert machine.get("ticks") == ticks

    def test_the_energy_of_the_longest_path_is_what_a_profile_takes(self):
        machine = Machine(Line(speeds=[2**31 - 1] * 3, accelerations=[2**34 - 1] * 3))
        machine.set(feed=10**9, override=100 << 28,
                    **{f"from_{axis}": -CORNER for axis in AXES},
                    **{f"to_{axis}": CORNER for axis in AXES})
        machine.run("line")
        assert machine.pair("gain").bit_length() == SpeedProfile().brake_bits


class TestPositions:
    def test_of_steps_and_what_begins_there(self):
        rng = random.Random(3)
        for _ in range(100):
            machine = Machine(settings(rng))
            per_metre = machine.line.steps
            speed = number(rng, 31)
            steps = [rng.choice([0, *(sign * min(34 * each, number(rng, 33)) for sign in (1, -1))])
                     for each in per_metre]
            spindle, unit = number(rng, 36), rng.choice([1000, 2540])
            machine.set(unit=unit, speed_now=speed, spindle=spindle, **{f"steps_now_{axis}": count
                                            for axis, count in zip(AXES, steps, strict=True)})
            machine.run("report")
            nanometres = [(1 if count >= 0 else -1)
                          * round_half_up(Fraction(abs(count) * 10**9, each))
                          for count, each in zip(steps, per_metre, strict=True)]
            assert machine.each("position") == nanometres
            assert machine.get("speed_now") == round_half_up(
                Fraction(speed * 60, 1000 * unit))
            assert machine.get("spindle") == round_half_up(Fraction(spindle, 10**6))
            machine.run("begin")
            assert machine.each("from") == nanometres
            assert machine.each("unit_before") == [0, 0, 0]
            assert machine.pair("nominal_before") == 0
            assert [machine.get(f"place_before_{axis}") for axis in AXES] == [
                (place(at, each) + 17 * 512 * each) % SIZE
                for at, each in zip(nanometres, per_metre, strict=True)]
            origin = [rng.choice([0, rng.randint(-CORNER, CORNER)]) for _ in AXES]
            machine.set(**{f"origin_{axis}": at for axis, at in zip(AXES, origin, strict=True)})
            machine.run("work")
            machine.run("round")
            assert machine.each("position") == [
                (1 if at >= zero else -1) * round_half_up(Fraction(abs(at - zero), unit))
                for at, zero in zip(nanometres, origin, strict=True)]


def round_half_up(value: Fraction) -> int:
    return floor(value + Fraction(1, 2))


def compare(engine, rounds: int, seed: int) -> None:
    """Carry out lines, each from the registers that the one before has left."""
    rng = random.Random(seed)
    gateware = FormulaGateware(engine, TABLES)
    machine = Machine(settings(rng))
    for _ in range(rounds):
        position = machine.each("from")
        machine.set(feed=number(rng, 31), steps_now_x=rng.getrandbits(36), **{
            f"to_{axis}": min(CORNER, max(-CORNER, at + change))
            for axis, at, change in zip(AXES, position, moves(rng), strict=True)})
        if machine.each("to") == position:
            continue
        tables = "line", "report", "round", "accept"
        found = gateware.run(machine.words, *tables)
        machine.run(*tables)
        assert found == machine.words


class TestGateware:
    def test_is_the_table(self):
        with AmaranthEngine(component("formulas", line_formulas())) as engine:
            compare(engine, 3, 1)

    @pytest.mark.compiler
    def test_is_the_table_compiled(self):
        with CXXRTLEngine(component("formulas", line_formulas())) as engine:
            for seed in range(2):
                compare(engine, 200, seed)
