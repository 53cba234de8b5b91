"""The path that a program asks for, and how far points are from it."""

from math import cos, dist, pi, sin, tau

import pytest

from tb.models.gcode_language import RefusedLine
from tools.gcode.path import Asked, Curve, Follower, Straight


def asked(*lines: str) -> list[Straight | Curve]:
    program = Asked()
    for line in lines:
        program.add(line)
    return program.segments


def points(segments, count=400):
    """Return points of a path, evenly on each segment, made without the code under test."""
    found = []
    for each in segments:
        for n in range(count + 1):
            part = n / count
            if isinstance(each, Straight):
                found.append(tuple(a + (b - a) * part
                                   for a, b in zip(each.start, each.end, strict=True)))
            else:
                angle = each.begin + part * each.sweep
                place = [0.0] * 3
                place[each.plane[0]] = each.centre[0] + each.radius * cos(angle)
                place[each.plane[1]] = each.centre[1] + each.radius * sin(angle)
                place[3 - sum(each.plane)] = each.low + part * each.rise
                found.append(tuple(place))
    return found


class TestAsked:
    def test_lines(self):
        first, second = asked("G0 X3 Y4", "G91 G1 F100 X-1 Z2", "G1 X0", "G4 P1", "M8", "$X")
        assert first == Straight((0, 0, 0), (3, 4, 0), rapid=True) and first.length == 5
        assert (second.start, second.end, second.rapid) == ((3, 4, 0), (2, 4, 2), False)

    @pytest.mark.parametrize(("line", "length"), [
        ("G2 X10 I5", 5 * pi), ("G3 X10 I5", 5 * pi), ("G2 X5 Y5 I5", 2.5 * pi),
        ("G3 X5 Y5 I5", 7.5 * pi), ("G2 X0 I5", 10 * pi), ("G3 X0 Y0 J-1", tau),
        ("G2 X10 Z3 I5", ((5 * pi) ** 2 + 9) ** 0.5), ("G18 G2 X10 Z0 I5", 5 * pi),
        ("G19 G3 Y10 Z0 J5", 5 * pi), ("G2 X10 R5", 5 * pi), ("G2 X5 Y5 R-5", 7.5 * pi),
    ])
    def test_arcs(self, line, length):
        (arc,) = asked("G1 F100", line)
        assert arc.length == pytest.approx(length)
        assert arc.start == pytest.approx((0, 0, 0), abs=1e-9)

    def test_the_side_of_an_arc(self):
        (right,) = asked("G1 F100", "G2 X10 I5")
        (left,) = asked("G1 F100", "G3 X10 I5")
        assert right.points(1e-3)[len(right.points(1e-3)) // 2][1] > 4.9
        assert left.points(1e-3)[len(left.points(1e-3)) // 2][1] < -4.9

    def test_an_arc_whose_end_is_off_its_circle_has_a_line_behind_it(self):
        arc, line = asked("G1 F100", "G2 X10.004 I5")
        assert isinstance(arc, Curve) and line.start == arc.end
        assert line.end == (10.004, 0, 0) and line.length == pytest.approx(0.004)

    def test_what_is_refused_changes_nothing(self):
        program = Asked()
        program.add("G1 X1 F100")
        with pytest.raises(RefusedLine, match="25"):
            program.add("X2 X3")
        assert len(program.segments) == 1


class TestFollower:
    PATHS = {
        "square": ["G1 X5 F100", "Y5", "X0", "Y0"],
        "there and back": ["G1 X5 F100", "X0", "X5", "X0"],
        "circles": ["G1 F100", "G2 X0 I3", "G2 X0 I3", "G3 X0 I1"],
        "helix": ["G1 F100", "G3 X0 Y0 Z4 I0.5", "G18 G2 X2 Z5 I1 K0.5"],
        "short ones": ["G1 F100", *(f"X{0.001 * n:.3f}Y{0.0005 * (n % 3):.4f}"
                                    for n in range(1, 300))],
        "eight": ["G1 F100", "G2 X0 I3", "G2 X0 I-3", "G1 X6", "Y1"],
    }

    @pytest.mark.parametrize("name", PATHS)
    def test_its_own_points_are_on_it(self, name):
        segments = asked(*self.PATHS[name])
        follower = Follower(segments, 0.0125)
        assert max(map(follower.distance, points(segments))) < 1e-6
        assert follower.done == pytest.approx(sum(each.length for each in segments), abs=0.02)

    def test_a_point_aside(self):
        segments = asked("G1 X5 F100", "G3 X5 Y4 J2", "G1 X0")
        follower = Follower(segments, 0.0125)
        seen = [follower.distance(point) for point in (
            (1, 0.3, 0), (2, 0, -0.4), (5, 0, 0), (7.1, 2, 0), (6.9, 2, 0.1), (2, 4.2, 0))]
        assert seen == pytest.approx([0.3, 0.4, 0, 0.1, 2 ** 0.5 / 10, 0.2])

    def test_a_corner_that_is_cut_off(self):
        follower = Follower(asked("G1 X5 F100", "Y5"), 0.0125)
        way = [(4 + n / 100, n / 100, 0) for n in range(101)]
        assert max(map(follower.distance, way)) == pytest.approx(0.5)

    def test_a_part_that_is_left_out(self):
        follower = Follower(asked("G1 X5 F100", "Y5", "Y0", "X10"), 0.0125)
        seen = [follower.distance((n / 80, 0, 0)) for n in range(801)]
        assert max(seen[:401]) == 0 and seen[800] == pytest.approx(5)
        follower = Follower(asked("G1 X5 F100", "G2 X5 I1"), 0.0125)
        assert max(follower.distance((n / 80, 0, 0)) for n in range(401)) == 0
        assert follower.done == 5

    def test_a_path_that_crosses_itself(self):
        """What lies on another part of the path is aside all the same."""
        segments = asked("G1 X10 F100", "Y5", "X5", "Y-5")
        follower = Follower(segments, 0.0125)
        assert follower.distance((4, 0, 0)) == 0
        assert follower.distance((5, -2, 0)) == pytest.approx(2)

    def test_beside_a_helix(self):
        segments = asked("G1 F100", "G3 X0 Y0 Z1 I2")
        (curve,) = segments
        brute = points(segments, 20_000)
        follower = Follower(segments, 0.0125)
        for part in (0.1, 0.4, 0.9):
            x, y, z = curve.at(part)
            point = (x * 1.01, y * 1.01, z + 0.01)
            assert follower.distance(point) == pytest.approx(
                min(dist(point, each) for each in brute), abs=2e-4)

    def test_no_path(self):
        assert Follower([], 1).distance((0, 0, 0)) == 0
