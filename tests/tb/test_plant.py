"""The plant, against a decoder that takes one word at a time, and on walks worked out by hand."""

from math import sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tb.engines import Changes
from tb.plant import STEP, WORDS, Fault, Plant

AXES = ("axis_x", "axis_y", "axis_z")


def changes(clocks, words) -> Changes:
    table = np.array(words, np.int64).reshape(len(clocks), 3)
    return Changes(np.array(clocks, np.int64), dict(zip(AXES, table.T, strict=True)))


def walk(moves) -> Changes:
    """Coil words of a machine that makes (dx, dy, dz) steps, one a clock, after a first row."""
    places = np.concatenate([np.zeros((1, 3), int), np.cumsum(np.array(moves, int), axis=0)])
    return changes(np.arange(len(places)), np.array(WORDS)[places % 4])


def line(dx, dy, dz, steps) -> list[tuple[int, int, int]]:
    return [(dx, dy, dz)] * steps


class Reference:
    """Three axes, word by word; the pixels by trying each."""

    def __init__(self, target, pitch, travel):
        self.target, self.pitch, self.travel = target, pitch, travel
        self.place, self.steps = [0, 0, 0], [0, 0, 0]
        self.word: list[int | None] = [None] * 3
        self.phase: list[int | None] = [None] * 3
        self.last: list[int | None] = [None] * 3
        self.least: list[int | None] = [None] * 3
        self.faults, self.places, self.cut, self.wrong = [], [[0, 0, 0]], set(), []
        self.order = []

    def feed(self, clock, words):
        before = list(self.place)
        for n, word in enumerate(words):
            if word == self.word[n]:
                continue
            self.word[n] = word
            if word not in WORDS:
                self.faults.append(Fault(clock, AXES[n], "illegal", word))
                continue
            phase = WORDS.index(word)
            was, self.phase[n] = self.phase[n], phase
            turn = 0 if was is None else (phase - was) % 4
            if turn == 2:
                self.faults.append(Fault(clock, AXES[n], "jump", word))
            elif turn:
                self.place[n] += 1 if turn == 1 else -1
                self.steps[n] += 1
                last, self.last[n] = self.last[n], clock
                if last is not None:
                    self.least[n] = min(self.least[n] or clock - last, clock - last)
        if self.place != before:
            self.places.append(list(self.place))
            self.judge(clock, *self.place)

    def judge(self, clock, x, y, z):
        if z == -self.travel and x % self.pitch == 0 and y % self.pitch == 0:
            pixel = (x // self.pitch, y // self.pitch)
            if 0 <= pixel[0] < self.target.shape[0] and 0 <= pixel[1] < self.target.shape[1]:
                if pixel not in self.cut:
                    self.order.append(pixel)
                self.cut.add(pixel)
        if z < 0:
            # Every centre around, on the picture or not; the nearest may be several.
            far = {
                (r, c): (x - r * self.pitch) ** 2 + (y - c * self.pitch) ** 2
                for r in range(x // self.pitch - 1, x // self.pitch + 3)
                for c in range(y // self.pitch - 1, y // self.pitch + 3)
            }
            nearest = [pixel for pixel in far if far[pixel] == min(far.values())]
            rows, columns = self.target.shape
            target = self.target
            if not any(0 <= r < rows and 0 <= c < columns and target[r, c] for r, c in nearest):
                self.wrong.append((clock, x, y, z))


@st.composite
def traces(draw):
    """Words of three axes, mostly legal steps, with clocks and places to cut the trace."""
    word = st.integers(0, 15)
    moves = draw(
        st.lists(
            st.tuples(st.integers(1, 9), *[st.sampled_from([0, 0, 1, 1, 1, 3, 3, 2, "any"])] * 3),
            max_size=60,
        )
    )
    phases = [draw(st.integers(0, 3)) for _ in AXES]
    words = [WORDS[phase] for phase in phases]
    if draw(st.booleans()):
        words = [draw(word) for _ in AXES]
    clock, rows = draw(st.integers(0, 5)), []
    rows.append((clock, tuple(words)))
    for gap, *turns in moves:
        clock += gap
        for n, turn in enumerate(turns):
            if turn == "any":
                words[n] = draw(word)
            else:
                phases[n] = (phases[n] + turn) % 4
                words[n] = WORDS[phases[n]]
        rows.append((clock, tuple(words)))
    cuts = draw(st.lists(st.integers(0, len(rows)), max_size=4).map(sorted))
    return rows, cuts


class TestPlant:
    @given(
        traces(),
        st.integers(1, 4),
        st.integers(1, 3),
        st.lists(st.booleans(), min_size=6, max_size=6),
    )
    def test_equals_reference_however_cut(self, trace, pitch, travel, pixels):
        rows, cuts = trace
        target = np.array(pixels).reshape(3, 2)
        plant = Plant(target, pitch=pitch, travel=travel)
        reference = Reference(target, pitch, travel)
        for clock, words in rows:
            reference.feed(clock, words)
        corners, turns_seen, milled = [], 0, []
        for start, stop in zip([0, *cuts], [*cuts, len(rows)], strict=True):
            part = rows[start:stop]
            plant.feed(changes([clock for clock, _ in part], [words for _, words in part]))
            corners.append(plant.corners_from(turns_seen)[:-1])
            turns_seen += len(corners[-1])
            milled += [tuple(pixel) for pixel in plant.milled_from(len(milled)).tolist()]
        assert plant.position == tuple(reference.place)
        assert plant.steps == dict(zip(AXES, reference.steps, strict=True))
        assert plant.least == dict(zip(AXES, reference.least, strict=True))
        assert plant.faults == sorted(reference.faults)
        assert {(int(r), int(c)) for r, c in np.argwhere(plant.cut)} == reference.cut
        assert [tuple(wrong) for wrong in plant.wrong] == reference.wrong
        assert plant.wrong_steps == len(reference.wrong)

        places = np.array(reference.places)
        turns = np.diff(places, axis=0)
        kept = [0, *(1 + np.flatnonzero((turns[1:] != turns[:-1]).any(axis=1))), len(places) - 1]
        assert (plant.corners == places[sorted(set(kept))]).all()
        assert plant.turns == turns_seen
        assert (np.concatenate(corners) == plant.corners[:-1]).all()
        assert milled == reference.order
        down = places[:, 2] < 0
        assert plant.lifts == np.count_nonzero(down[:-1] & ~down[1:])
        flat, wet = np.count_nonzero(turns[:, :2], axis=1), down[:-1] | down[1:]
        assert plant.air.steps == np.count_nonzero(flat[~wet])
        assert plant.milled.steps == np.count_nonzero(flat[wet])
        assert plant.milled.mm == pytest.approx(np.sqrt(flat[wet]).sum() * STEP)

    def test_table_goes_up(self):
        plant = Plant()
        plant.feed(changes(range(6), [[word, 6, 6] for word in (6, 3, 9, 12, 6, 12)]))
        assert plant.position == (3, 0, 0)
        assert plant.steps == {"axis_x": 5, "axis_y": 0, "axis_z": 0}
        assert plant.faults == []

    def test_first_word_is_where_the_motor_stands(self):
        plant = Plant()
        plant.feed(changes([7], [[9, 3, 12]]))
        assert plant.position == (0, 0, 0)
        assert len(plant.corners) == 1

    def test_faults_have_their_clocks(self):
        plant = Plant()
        plant.feed(changes([0, 10, 20, 30], [[6, 6, 6], [15, 6, 6], [15, 9, 6], [3, 9, 6]]))
        assert plant.faults == [Fault(10, "axis_x", "illegal", 15), Fault(20, "axis_y", "jump", 9)]
        assert plant.position == (1, 0, 0)

    def test_illegal_word_that_stays_is_one_fault(self):
        plant = Plant()
        for clock in range(3):
            plant.feed(changes([clock], [[0, 6, 6]]))
        assert plant.faults == [Fault(0, "axis_x", "illegal", 0)]

    def test_least_distance_joins_chunks(self):
        plant = Plant()
        for clock, word in [(0, 6), (100, 3), (103, 9), (200, 3)]:
            plant.feed(changes([clock], [[word, 6, 6]]))
        assert plant.least == {"axis_x": 3, "axis_y": None, "axis_z": None}

    def test_mills_a_diagonal(self):
        # The anti-diagonal of a 2 x 2 picture: half way it is as near to two clear pixels.
        target = np.array([[0, 1], [1, 0]], bool)
        plant = Plant(target, pitch=4, travel=3)
        plant.feed(
            walk(
                [
                    *line(0, 1, 0, 4),
                    *line(0, 0, -1, 3),
                    *line(1, -1, 0, 4),
                    *line(0, 0, 1, 3),
                    *line(-1, 0, 0, 4),
                ]
            )
        )
        assert (plant.cut == target).all()
        assert (plant.wrong_steps, plant.wrong, plant.lifts) == (0, [], 1)
        assert plant.position == (0, 0, 0)
        assert plant.air.steps == 8
        assert plant.air.mm == pytest.approx(8 * STEP)
        assert plant.milled.steps == 4
        assert plant.milled.mm == pytest.approx(4 * sqrt(2) * STEP)
        assert [(part.cut, part.points.tolist()) for part in plant.path] == [
            (False, [[0, 0], [0, 4]]),
            (True, [[0, 4], [4, 0]]),
            (False, [[4, 0], [0, 0]]),
        ]
        assert len(plant.corners) == 6

    def test_nearest_decides(self):
        # Down three quarters of the way to a clear pixel, then back to half way.
        plant = Plant(np.array([[1, 0]], bool), pitch=4, travel=1)
        plant.feed(walk([*line(0, 1, 0, 3), (0, 0, -1), (0, -1, 0)]))
        assert plant.wrong == [(4, 0, 3, -1)]

    @pytest.mark.parametrize("pixel", [(0, 0), (0, 1), (1, 0), (1, 1)])
    def test_on_a_corner_all_four_are_nearest(self, pixel):
        target = np.zeros((2, 2), bool)
        target[pixel] = True
        away = 1 - 2 * pixel[0]
        plant = Plant(target, pitch=4, travel=1)
        plant.feed(walk([*line(1, 1, 0, 2), (0, 0, -1), (away, 0, 0)]))
        assert plant.wrong == [(4, 2 + away, 2, -1)]

    def test_going_down_on_the_way_cuts(self):
        plant = Plant()
        plant.feed(walk([(1, 0, 0), (1, 0, -1), (1, 0, 1), (1, 0, 0)]))
        assert [(part.cut, part.points.tolist()) for part in plant.path] == [
            (False, [[0, 0], [1, 0]]),
            (True, [[1, 0], [2, 0], [3, 0]]),
            (False, [[3, 0], [4, 0]]),
        ]
        assert (plant.air.steps, plant.milled.steps) == (2, 2)

    def test_grazing_does_not_cut(self):
        plant = Plant(np.ones((2, 2), bool), pitch=4, travel=2)
        plant.feed(walk([*line(1, 0, 0, 1), *line(0, 0, -1, 2), *line(0, 1, 0, 4)]))
        assert not plant.cut.any()
        assert plant.wrong_steps == 0

    def test_shallow_does_not_cut(self):
        plant = Plant(np.ones((1, 2), bool), pitch=4, travel=2)
        plant.feed(walk([*line(0, 0, -1, 1), *line(0, 1, 0, 4)]))
        assert not plant.cut.any()

    def test_off_the_picture_is_wrong(self):
        plant = Plant(np.ones((1, 1), bool), pitch=2, travel=1)
        plant.feed(walk([(0, 0, -1), *line(-1, 0, 0, 3)]))
        assert [(wrong.x, wrong.z) for wrong in plant.wrong] == [(-2, -1), (-3, -1)]

    def test_without_a_picture_nothing_is_wrong(self):
        plant = Plant()
        plant.feed(walk([(0, 0, -1), (1, 1, 0)]))
        assert plant.wrong_steps == 0
        assert plant.milled.steps == 1

    def test_wrong_steps_are_all_counted(self):
        plant = Plant(np.zeros((1, 1), bool), travel=1)
        plant.feed(walk([(0, 0, -1), *line(1, 0, 0, Plant.KEPT), (1, 0, 0)]))
        assert plant.wrong_steps == Plant.KEPT + 2
        assert len(plant.wrong) == Plant.KEPT

    def test_pixels_come_in_the_order_of_cutting(self):
        plant = Plant(np.ones((1, 3), bool), pitch=2, travel=1)
        plant.feed(walk([*line(0, 1, 0, 4), *line(0, 0, -1, 1), *line(0, -1, 0, 4),
                         *line(0, 1, 0, 4)]))
        assert plant.milled_from(0).tolist() == [[0, 2], [0, 1], [0, 0]]
        assert plant.milled_from(2).tolist() == [[0, 0]]
        assert plant.milled_from(3).tolist() == []

    def test_path_can_be_forgotten(self):
        plant = Plant(np.ones((1, 9), bool), pitch=2, travel=1)
        moves = [*line(0, 0, -1, 1), *line(0, 1, 0, 6), *line(1, 0, 0, 3)]
        rows = walk(moves)
        for start, stop in ((0, 6), (6, len(rows))):
            plant.feed(changes(rows.clock[start:stop],
                               np.stack([rows[axis][start:stop] for axis in AXES], axis=1)))
            if start == 0:
                plant.forget_path()
                assert plant.corners.tolist() == [[0, 4, -1]]
        assert plant.corners.tolist() == [[0, 4, -1], [0, 6, -1], [3, 6, -1]]
        assert plant.milled_from(1).tolist() == [[0, 1], [0, 2], [0, 3]]
        assert plant.milled.steps == 9

    def test_empty_changes(self):
        plant = Plant()
        plant.feed(changes([], []))
        plant.feed(changes([3], [[6, 6, 6]]))
        assert plant.path == []
        assert plant.position == (0, 0, 0)

    @pytest.mark.parametrize("wrong", [{"pitch": 0}, {"travel": 0}, {"axes": ("axis_x",)}])
    def test_parameters(self, wrong):
        with pytest.raises(ValueError, match=r"^Pitch and travel must be at least 1 "):
            Plant(**wrong)

    def test_picture_is_flat(self):
        with pytest.raises(ValueError, match=r"^Picture must be rows and columns, not the shape"):
            Plant(np.zeros(4, bool))
