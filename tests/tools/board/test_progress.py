"""The time of a job, and what is told of it."""

from dataclasses import dataclass

import numpy as np
import pytest

from tb.milling import Cut
from tb.plant import Plant
from tools.board.progress import JobTimer


@dataclass
class Board:
    """As much of a machine as is timed."""

    jobs: int = 0
    stopped: bool = False
    busy: bool = False

    def cut(self) -> Cut:
        pixels = np.ones((1, 2), bool)
        plant = Plant(pixels)
        plant.cut[0, 0] = True
        return Cut(pixels, plant, 10, 150_000_000, 0.0, "none")


def test_only_the_time_in_which_it_mills_counts():
    timer, board = JobTimer(), Board()
    timer.update(board, 10.0, moving=True, building=False)
    assert timer.report(board) == {"building_s": None, "job": None}
    board.jobs, board.busy = 1, True
    for now, moving in [(11, True), (15, True), (20, False), (22, True)]:
        timer.update(board, now, moving=moving, building=False)
    # 3 s of clocks on the real board too: no step was made.
    job = {"busy": True, "cut": 1, "elapsed_s": 6, "real_s": 3}
    assert timer.report(board)["job"] == job
    board.stopped = True
    timer.update(board, 30, moving=True, building=False)
    board.stopped, board.busy = False, False
    timer.update(board, 40, moving=True, building=False)
    assert timer.report(board)["job"] == {**job, "busy": False}
    board.jobs, board.busy = 2, True
    timer.update(board, 41, moving=True, building=False)
    timer.update(board, 43, moving=True, building=False)
    assert timer.report(board)["job"] == {**job, "elapsed_s": 2}
    # Another machine has made no job.
    timer.update(other := Board(), 44, moving=True, building=False)
    assert timer.report(other)["job"] is None


@pytest.mark.parametrize("machine", [None, Board()])
def test_the_time_of_a_build(machine):
    timer = JobTimer()
    for now, building in [(1, False), (5, True), (7.2, True)]:
        timer.update(machine, now, moving=False, building=building)
    assert timer.report(machine)["building_s"] == 2
    timer.update(machine, 8, moving=False, building=False)
    assert timer.report(machine)["building_s"] is None
