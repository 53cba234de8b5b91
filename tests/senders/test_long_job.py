"""A job of 20 000 lines, sent by pygrbl-streamer to a machine with belts on an Icepi Zero."""

from collections.abc import Iterator

import numpy as np
import pytest

from tb.engines import ENGINES
from tests.senders.machine import Machine, serve
from tests.senders.test_pygrbl_streamer import PygrblStreamer

LINES = 20_000
MIDDLE, RADIUS = -60, 50

NEAR = 0.03
"""Of the curve, in mm: what belts with 80 steps/mm, decimals and chords are off."""


def curve(lines: int) -> np.ndarray:
    """Give places along a figure of Lissajous, which has no corners."""
    angle = np.linspace(0, 2 * np.pi, lines)
    return MIDDLE + RADIUS * np.sin([3 * angle, 4 * angle]).T


@pytest.fixture(scope="module")
def machine(libraries) -> Iterator[Machine]:
    """A machine that is served as fast as the computer can."""
    if reason := ENGINES["cxxrtl"].missing():
        pytest.skip(reason)
    with serve("--kinematics", "corexy", "--board", "icepi-zero", "--speed", "max") as machine:
        yield machine


@pytest.mark.senders
def test_a_long_job_is_drawn_to_its_end(machine):
    library = pytest.importorskip("pygrbl_streamer", reason="pygrbl-streamer missing: "
                                  "pip install -e '.[senders]'")
    start, *way = (f"X{x:.3f}Y{y:.3f}" for x, y in curve(LINES))
    with PygrblStreamer(library, machine) as sender:
        sender.unlock()
        sender.start(["G21 G90 G94", f"G0 {start}"])
        sender.wait()
        assert machine.wait_to_be("Idle").position[:2] == (MIDDLE, MIDDLE)

        begun, reported = len(machine.received), len(machine.reports)
        machine.ask = sender.ask
        sender.start([f"G1 F6000 {start}", *way])
        machine.wait_for("ok", begun, LINES)
        sender.wait()
        machine.wait_to_be("Idle")
    assert machine.count("ok", begun) == LINES
    assert machine.refused(begun) == []
    assert machine.reports[-1].position == (MIDDLE, MIDDLE, 0)

    # Between its ends, it is where it says it is, at many places all over the curve.
    places = np.array([report.position[:2] for report in machine.reports[reported:]])
    ideal = curve(50 * LINES)
    off = [np.hypot(*(ideal - place).T).min() for place in places]
    assert max(off) < NEAR
    assert len(np.unique(places.round(), axis=0)) > 30
