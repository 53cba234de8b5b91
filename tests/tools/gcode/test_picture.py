"""The picture of a job."""

import numpy as np
import pytest

from tests.tools.gcode.jobs import job, moves
from tools.gcode.picture import ASKED, COLOURS, draw_job

MOVES = (0, 4, 100, 0.1), (1, 2, 25, 0)
LINES = "G1 X4 F1000", "Y2"


def picture(*lines: str, moved=MOVES) -> np.ndarray:
    done = job(moves(*moved), *lines, seconds=1.2)
    return np.asarray(draw_job(done, done.motion(), "a job", ["a fact"]))[:, 100:1050]


def near(pixels: np.ndarray, colour: tuple[int, int, int]) -> np.ndarray:
    return np.abs(pixels.astype(int) - colour).sum(axis=2) < 60


def test_the_fast_part_has_the_colour_of_the_highest_speed():
    pixels = picture(*LINES)
    rows, columns = np.nonzero(near(pixels, COLOURS[-1]))
    assert len(rows) and np.ptp(rows) < 10 < np.ptp(columns)  # in the line along X


def test_what_was_asked_for_lies_over_what_was_made():
    """Where the pins left the path out, there is only the thin line."""
    dark = [int(near(picture(*lines), ASKED).sum()) for lines in (LINES, (*LINES, "G1 X0 Y2"))]
    assert dark[1] > dark[0] + 300


@pytest.mark.parametrize(("moved", "plots"), [
    (MOVES, 2), ((*MOVES, (2, 1, 100, 0)), 3), (((2, 1, 100, 0),), 3)])
def test_z_has_a_plot_if_it_moves(moved, plots):
    pixels = picture(moved=moved)
    assert pixels.shape[0] > 300 + 206 * plots
    frames = (np.abs(pixels.astype(int) - 120).sum(axis=2) < 30).mean(axis=1) > 0.9
    assert np.count_nonzero(np.diff(frames.astype(int)) == 1) == 2 * (plots + 1)
