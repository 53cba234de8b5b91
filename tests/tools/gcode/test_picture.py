"""The picture of a job."""

import numpy as np

from tests.tools.gcode.jobs import job, moves
from tools.canvas import COLOURS
from tools.gcode.picture import GAP, PLOT, draw_job

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
    dark = [int((picture(*lines).max(axis=2) < 150).sum()) for lines in (
        LINES, (*LINES, "G1 X0 Y2"))]
    assert dark[1] > dark[0] + 300


def test_z_has_a_plot_if_it_moves():
    flat, high = picture(*LINES), picture(*LINES, moved=(*MOVES, (2, 1, 100, 0)))
    assert high.shape[0] == flat.shape[0] + PLOT + GAP


def test_a_job_without_an_extent():
    """Nothing moves, or one axis does: it is drawn all the same."""
    none, across, up = (picture(moved=moved) for moved in ((), MOVES[:1], ((2, 1, 100, 0),)))
    assert none.shape == across.shape
    assert up.shape[0] == none.shape[0] + PLOT + GAP
