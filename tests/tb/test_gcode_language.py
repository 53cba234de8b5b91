"""The model of the G-code language: what it accepts, what it refuses, and with which code."""

import copy
import math
import re
from decimal import ROUND_HALF_UP, Decimal

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tb.models.gcode_language import (
    Action,
    Arc,
    Coolant,
    Dwell,
    End,
    Interpreter,
    Line,
    Modes,
    Offsets,
    Pause,
    Probe,
    RefusedLine,
    Spindle,
    Word,
)


def words(text: str) -> list[Word]:
    """Return the words of a line that has no mistake in its letters and digits."""
    found = re.findall(r"([A-Z])([-+]?[\d.]+)", text.replace(" ", ""))
    return [Word(letter, int((Decimal(number) * 10**6).to_integral_value(ROUND_HALF_UP)))
            for letter, number in found]


def run(*lines: str) -> tuple[Interpreter, list[list[Action] | int]]:
    """Run lines; return what each does, or the code with which it is refused."""
    machine, found = Interpreter(), []
    for line in lines:
        try:
            found.append(machine.line(words(line)))
        except RefusedLine as refused:
            found.append(refused.args[0])
    return machine, found


def mm(x: float, y: float = 0, z: float = 0) -> tuple[int, int, int]:
    return round(x * 10**6), round(y * 10**6), round(z * 10**6)


class TestLines:
    def test_the_highest_speed_and_a_feed(self):
        _, found = run("G0 X10", "G1 X10 Y15 Z0 F100", "Y2")
        assert found == [[Line(mm(10), None)], [Line(mm(10, 15), 1_666_666)],
                         [Line(mm(10, 2), 1_666_666)]]

    def test_relative_and_inches(self):
        machine, found = run("G91 G0 X1 Y-1", "X1", "G20 X.1 F10", "G1 X.00001 F10", "G90 X1")
        assert [line[-1] for line in found if isinstance(line, list)] == [
            Line(mm(1, -1), None), Line(mm(2, -1), None), Line(mm(4.54, -1), None),
            Line(mm(4.540254, -1), 4_233_333), Line(mm(25.4, -1), 4_233_333)]
        assert machine.modes == Modes(motion=1, inches=True)

    def test_offsets(self):
        machine, found = run("G0 X5", "G92 X0", "G0 X1", "G55 G0 X1", "G10 L2 P2 X2", "X1",
                             "G53 G0 X1", "G92.1", "G10 L20 P0 X7", "G54 X0")
        assert found == [
            [Line(mm(5), None)], [Offsets(mm(5))], [Line(mm(6), None)], [Line(mm(6), None)],
            [Offsets(mm(7))], [Line(mm(8), None)], [Line(mm(1), None)], [Offsets(mm(2))],
            [Offsets(mm(-6))], [Offsets(mm(0)), Line(mm(0), None)]]
        assert machine.systems[1] == mm(-6)

    def test_tool_length(self):
        machine, found = run("G43.1 Z1.5", "G0 Z0", "G49", "G0 Z0")
        assert found == [[Offsets(mm(0, 0, 1.5))], [Line(mm(0, 0, 1.5), None)],
                         [Offsets(mm(0))], [Line(mm(0), None)]]
        assert machine.position == mm(0)

    def test_predefined_positions(self):
        _, found = run("G0 X1 Y2 Z3", "G28.1", "G0 X0 Y0 Z0", "G30", "G28", "G91 G28 Z5")
        assert found[3:] == [
            [Line(mm(0), None)], [Line(mm(1, 2, 3), None)],
            [Line(mm(1, 2, 8), None), Line(mm(1, 2, 3), None)]]

    def test_per_minute(self):
        _, found = run("G93 G1 X1 F2", "X2", "G94 X3", "G94 X3 F60")
        assert found == [[Line(mm(1), 2_000_000, inverse=True)], 22, 22, [Line(mm(3), 1_000_000)]]


    def test_probings(self):
        machine, found = run("G38.2 X1 F60", "Z-1", "G38.3 X2", "G38.4 X3", "G93 G38.5 X4 F2")
        assert found == [
            [Probe(mm(1), 10**6)], [Probe(mm(1, 0, -1), 10**6)],
            [Probe(mm(2, 0, -1), 10**6, no_error=True)], [Probe(mm(3, 0, -1), 10**6, away=True)],
            [Probe(mm(4, 0, -1), 2 * 10**6, inverse=True, away=True, no_error=True)]]
        assert machine.modes == Modes(motion=385, inverse=True)
        without = Interpreter(probing=False)
        without.reset()
        with pytest.raises(RefusedLine, match="^20$"):
            without.line(words("G38.2 X1 F60"))


class TestArcs:
    def test_an_example_of_the_thesis(self):
        """It begins at (0, 10): from elsewhere the radii differ."""
        _, found = run("G2 X60 Y30 I30 J10 F100", "G0 Y10", "G2 X60 Y30 I30 J10 F100")
        assert found == [33, [Line(mm(0, 10), None)],
                         [Arc(mm(60, 30), (30_000_000, 10_000_000), (0, 1), True, 1_666_666)]]

    def test_planes(self):
        for plane, axes, letters in [(17, (0, 1), "XYIJ"), (18, (2, 0), "ZXKI"),
                                     (19, (1, 2), "YZJK")]:
            a, b, i, j = letters
            _, found = run(f"G{plane} G3 {a}1 {b}1 {i}0 {j}1 F60", f"{a}0 {b}0 {i}-1 {j}0")
            x, y, z = (10**6 if axis in axes else 0 for axis in range(3))
            assert found == [[Arc((x, y, z), (0, 10**6), axes, False, 10**6)],
                             [Arc((0, 0, 0), (-10**6, 0), axes, False, 10**6)]]

    @given(x=st.integers(-10**8, 10**8), y=st.integers(-10**8, 10**8),
           more=st.integers(0, 10**9), clockwise=st.booleans(), long=st.booleans())
    @settings(deadline=None, database=None, derandomize=True, max_examples=60)
    def test_the_centre_by_radius(self, x, y, more, clockwise, long):
        """It has the radius from both ends, and is on the right side."""
        if not (x or y):
            return
        radius = math.isqrt(x * x + y * y) // 2 + 1 + more
        given_radius = -radius if long else radius
        machine = Interpreter()
        (arc,) = machine.line([Word("G", (2 if clockwise else 3) * 10**6), Word("F", 10**6),
                               Word("X", x), Word("Y", y), Word("R", given_radius)])
        assert isinstance(arc, Arc)
        i, j = arc.centre
        # A nm beside the exact centre, at a chord that is nearly a diameter, is more along it.
        for end in (math.hypot(i, j), math.hypot(x - i, y - j)):
            assert abs(end - radius) < 2
        side = x * j - y * i  # positive if the centre is left of the chord
        if abs(side) > 2 * math.hypot(x, y):
            assert (side > 0) == (clockwise == long)

    @pytest.mark.parametrize(("line", "answer"), [
        ("G2 I0 J0 X0 F60", 33), ("G2 X0 I.000001 F60", 0),
        ("G2 X0 J8589.934591 F60", 0), ("G2 X0 J8589.934592 F60", 33),
        ("G2 X1 R8589.9 F60", 0), ("G2 X1 R-8589.934592 F60", 33), ("G3 X1 R9000 F60", 33),
        ("G2 X17500 R8600 F60", 34), ("G19 G2 Y0 J8388.607999 F60", 0),
        ("G19 G2 Y0 J8388.608 F60", 33), ("G18 G2 X0 I8388.608 F60", 33),
        ("G19 G2 Y1 R8388.6 F60", 0), ("G19 G2 Y1 R8388.609 F60", 33)])
    def test_radii_have_bounds(self, line, answer):
        """From 1 nm, below 2**33 nm, to 2**21 steps of the finer axis of the plane."""
        machine = Interpreter(steps_per_metre=(80_000, 40_000, 250_000))
        if answer:
            with pytest.raises(RefusedLine, match=f"^{answer}$"):
                machine.line(words(line))
        else:
            assert isinstance(machine.line(words(line))[0], Arc)

    def test_a_reset_leaves_the_steps(self):
        machine = Interpreter(steps_per_metre=(80_000, 40_000, 250_000))
        machine.reset()
        with pytest.raises(RefusedLine, match="^33$"):
            machine.line(words("G19 G2 Y0 J8388.608 F60"))

    def test_full_circle_and_helix(self):
        _, found = run("G2 X0 I5 F60", "G3 X0 Y10 Z2 J5")
        assert found == [[Arc(mm(0), (5_000_000, 0), (0, 1), True, 10**6)],
                         [Arc(mm(0, 10, 2), (0, 5_000_000), (0, 1), False, 10**6)]]


class TestFromOutside:
    def test_a_position_is_where_the_next_line_starts(self):
        machine, _ = run("G92 X1", "G91")
        machine.set_position(0, 5_000_000)
        assert machine.line(words("G0 X1")) == [Line(mm(6), None)]

    def test_a_reset_leaves_position_systems_and_predefined_positions(self):
        machine, _ = run("G0 X3", "G28.1", "G10 L2 P1 Y2", "G92 X0", "G43.1 Z1", "G20 G91 G55 M3",
                         "G1 F10 S5 T3")
        machine.reset()
        expected = Interpreter(mm(3))
        expected.systems[0], expected.predefined[0] = mm(0, 2), mm(3)
        assert vars(machine) == vars(expected)


class TestOthers:
    def test_they_come_in_the_order_of_execution(self):
        _, found = run("M3 S1000 M8 G4 P.5", "S2000", "G1 X1 F60 M5", "M7", "M9", "M0", "M1",
                       "M3 G55 G91 G20 M30")
        assert found == [
            [Spindle(1, 10**9), Coolant(mist=False, flood=True), Dwell(500_000)],
            [Spindle(1, 2 * 10**9)], [Spindle(0, 2 * 10**9), Line(mm(1), 10**6)],
            [Coolant(mist=True, flood=True)], [Coolant(mist=False, flood=False)], [Pause()], [],
            [Spindle(1, 2 * 10**9), Spindle(0, 2 * 10**9), End()]]

    def test_an_end_resets_modes(self):
        machine, _ = run("G10 L2 P2 X3", "G55 G18 G91 G93 M8", "G20 M2")
        assert machine.modes == Modes(motion=1, inches=True)
        assert machine.origin == mm(0)

    @pytest.mark.parametrize(("line", "code"), [
        ("A1", 20), ("G5", 20), ("M6", 20), ("G38 X1 F1", 20),
        ("G38.6 X1 F1", 20), ("G38.2 X1", 22), ("G38.2 F1", 26), ("G38.2 X0 F1", 33),
        ("G38.5 X1 P1 F1", 36), ("G43 Z1", 20), ("G90.1", 20),
        ("G61.1", 20), ("G28.2", 20), ("G-1", 20), ("M-3", 23), ("G10 L3 P1 X0", 20),
        ("G10 L2 P1 X0 R1", 20), ("G10 L-2 P1 X0", 20),
        ("G0 G1 X1", 24), ("G0 G80", 21), ("G17 G18", 21), ("M3 M4", 21),
        ("G90 G91", 21), ("G1.5 F1", 23), ("M3.1", 23), ("G4.1", 23), ("G10 G28", 24),
        ("G43.1 G1 Z1", 24), ("X1 X2", 25), ("F-1", 4), ("S-1", 4), ("P-1", 4), ("N-1", 4),
        ("T256", 38), ("N10000001", 27), ("G1 X1", 22), ("G1", 22), ("G4", 28), ("G10 X1", 28),
        ("G10 L2 P7 X1", 29), ("G10 L2 P1", 26), ("G92", 26), ("G2 F1", 26), ("G2 G53 X1 F1", 30),
        ("G80 X1", 31), ("G80 G92 X1", 31), ("G2 Z1 I1 F1", 32), ("G2 X0 Y0 R1 F1", 33),
        ("G2 X10 I4 F1", 33), ("G2 X10 R4 F1", 34), ("G2 X1 F1", 35), ("G1 X1 F1 I1", 36),
        ("G4 P1 L2", 36), ("P1", 36), ("G43.1 X1", 37), ("G43.1", 37), ("X40000", 38),
        ("G20 X2000", 38),
        ("G93 G1 X1", 22),
    ])
    def test_refused(self, line, code):
        machine, found = run(line)
        assert found == [code]
        assert vars(machine) == vars(Interpreter())

    @pytest.mark.parametrize("line", [
        "", "N10000000", "T255", "G61", "G40", "G91.1", "G49", "G80", "G4 P0", "G2 X10 I4.9995 F1",
        "G0", "F0", "M1", "G53 G0 X1",
    ])
    def test_accepted(self, line):
        _, (found,) = run(line)
        assert isinstance(found, list)

    def test_out_of_reach(self):
        _, found = run("G0 X34000", "G91 X34000", "G92 X-34000", "G10 L20 P1 X-34000", "X-1")
        assert found[1:] == [33, 33, 33, [Line(mm(-1), None)]]

    def test_numbers_that_do_not_fit(self):
        for letter, code in [("G", 20), ("M", 23), ("N", 27), ("T", 38), ("X", 38), ("F", 38)]:
            with pytest.raises(RefusedLine) as refused:
                Interpreter().line([Word(letter, 1 << 44, overflow=True)])
            assert refused.value.args == (code,)
        with pytest.raises(RefusedLine, match="^27$"):
            Interpreter().line([Word("N", -1 << 44, overflow=True)])

    @given(st.lists(st.tuples(st.sampled_from("GMFIJKLNPRSTXYZQ"), st.integers(-2, 100),
                              st.sampled_from([0, 100_000, 500_000])), max_size=6))
    @settings(deadline=None, database=None, derandomize=True, max_examples=300)
    def test_a_refused_line_changes_nothing(self, given_words):
        machine, _ = run("G1 X1 Y2 Z3 F60 S10", "G55 G10 L2 P2 X1", "G92 Y3", "G19 G91 M3")
        before = copy.deepcopy(vars(machine))
        try:
            machine.line([Word(letter, whole * 10**6 + part)
                          for letter, whole, part in given_words])
        except RefusedLine:
            assert vars(machine) == before
