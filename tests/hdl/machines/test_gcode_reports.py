# amaranth: UnusedElaboratable=no

"""What status reports of `gcode` show: $10, at its pins."""

import pytest

from fresa.machines.gcode import GCode
from tb.boards import component
from tb.engines import CXXRTLEngine

from .test_gcode import SETTINGS, Session

pytestmark = pytest.mark.compiler

MOVED = "G10 L2 P1 X0.1 Y-0.25 Z1.0005\nG92 X1\nG43.1 Z0.5\nG53 G0 X1.5 Y-0.5 Z0.252\n"
"""The place of the machine, and an origin at -1, -0.25 and 1.5005."""


@pytest.fixture(scope="module")
def design():
    return component("gcode", GCode(settings=SETTINGS))


@pytest.fixture
def session(design):
    with CXXRTLEngine(design) as engine:
        yield Session(engine)
        assert not engine.get("fault")


def report(session: Session) -> list[str]:
    """Return the fields of a report, without those that come now and then."""
    (line,) = session.send("?", wait=False)
    assert line.startswith("<Idle|")
    return [each for each in line[1:-1].split("|") if each[:3] != "Ov:"]


def listed(session: Session, text: str) -> list[str]:
    """Send what is answered by many lines, and return these."""
    session.send(text, read=False)
    session.run(400_000)
    return session.read()


@pytest.mark.parametrize(("mask", "fields"), [
    (0, ["WPos:2.500,-0.250,-1.249", "FS:0,0"]), (1, ["MPos:1.500,-0.500,0.252", "FS:0,0"]),
    (254, ["WPos:2.500,-0.250,-1.249", "Bf:63,128", "FS:0,0"]),
    (255, ["MPos:1.500,-0.500,0.252", "Bf:63,128", "FS:0,0"])])
def test_it_shows_what_the_mask_says(session, mask, fields):
    assert session.send(MOVED) == ["ok"] * 4
    assert session.send(f"$10={mask}\n") == ["ok"]
    idle, *shown, origin = report(session)
    assert (idle, shown) == ("Idle", fields)
    assert origin == "WCO:-1.000,-0.250,1.501"
    assert session.send("$10=256\n") == ["error:38"]
    assert report(session)[1:] == fields
    assert f"$10={mask}" in listed(session, "$$\n")


def test_it_is_there_after_a_reset_until_settings_are_restored(session):
    assert session.send("$10=0\nG92 X-1\n") == ["ok", "ok"]
    session.send("\x18")
    assert report(session)[1:] == ["WPos:0.000,0.000,0.000", "FS:0,0", "WCO:0.000,0.000,0.000"]
    session.send("$RST=$\n")
    assert report(session)[1:3] == ["MPos:0.000,0.000,0.000", "Bf:63,128"]


def test_numbers_are_those_of_the_field_whenever_the_mask_changes(session):
    """Reports are asked for all the time."""
    session.send("G92 X-5\nG0 X-4\n")
    lines = listed(session, "?" + "".join(f"$10={mask}\n??" for mask in (0, 3, 2, 1, 0, 3)) + "?"
                   "$10=0\n$RST=$\n?????")
    reports = [each.split("|")[1] for each in lines if each[:1] == "<"]
    assert set(reports) == {"MPos:1.000,0.000,0.000", "WPos:-4.000,0.000,0.000"}
