"""Commands of a plotter in programs of G-code, which are refused before anything is sent."""

import pytest

from fresa_host import VPlotter
from tests.host.fake_gcode import FakeGCode


@pytest.fixture
def fake():
    return FakeGCode()


@pytest.fixture
def plotter(fake):
    with VPlotter(fake, timeout=60) as plotter:
        yield plotter


@pytest.mark.parametrize(("send", "where"), [
    (lambda plotter: plotter.stream(["G0 X1", ":I05000500"]), "line 2: ':I05000500'"),
    (lambda plotter: plotter.command(" :S0"), "':S0'")])
def test_commands_are_no_lines_of_a_program(fake, plotter, send, where):
    with pytest.raises(ValueError, match=f"{where} is a command of the plotter, not G-code"):
        send(plotter)
    assert not fake.lines
    plotter.stream(["G0 X1"])
    assert fake.lines == ["G0 X1"]
