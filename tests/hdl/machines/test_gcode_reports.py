# amaranth: UnusedElaboratable=no

"""What reports of `gcode` show, and in which unit: $10 and $13, at its pins."""

import re

import pytest

from .test_gcode import Session

pytestmark = pytest.mark.compiler

MOVED = "G10 L2 P1 X0.1 Y-0.25 Z1.0005\nG92 X1\nG43.1 Z0.5\nG53 G0 X1.5 Y-0.5 Z0.252\n"
"""The place of the machine, and an origin at -1, -0.25 and 1.5005."""


def report(session: Session) -> list[str]:
    """Return the fields of a report, without those that come now and then."""
    session.send("?", wait=False, read=False)
    session.run(10_000)
    (line,) = session.read()
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


def test_inches(session):
    """Rounded half away from zero: 0.00005 inch are 1.27 um."""
    session.send("G21 G10 L2 P1 X25.4 Y0.00127 Z-0.00127\nG10 L2 P2 Y0.00126 Z-12.7\n")
    session.send("G53 G0 X1.5 Y-0.5 Z0.252\nG1 F254\nS500\nG43.1 Z2.54\n")
    assert session.send("$13=1\n") == ["ok"]
    assert report(session)[1:] == ["MPos:0.0591,-0.0197,0.0099", "Bf:63,128", "FS:0.0,0",
                                   "WCO:1.0000,0.0001,0.1000"]
    assert session.send("$G\n", wait=False)[0].endswith(" T0 F10.0 S500]")
    coordinates = listed(session, "$#\n")
    assert coordinates[:2] == ["[G54:1.0000,0.0001,-0.0001]", "[G55:0.0000,0.0000,-0.5000]"]
    assert coordinates[9:] == ["[TLO:0.1000]", "[PRB:0.0000,0.0000,0.0000:0]", "ok"]
    settings = listed(session, "$$\n")
    assert {"$13=1", "$11=0.010", "$110=6000.000"} <= set(settings)
    assert session.send("$10=0\n") == ["ok"]
    assert report(session)[1:] == ["WPos:-0.9409,-0.0197,-0.0900", "FS:0.0,0",
                                   "WCO:1.0000,0.0001,0.1000"]
    assert session.send("G93F4.16\n$G\n", wait=False)[1].endswith(" F4.2 S500]")
    assert session.send("$13=2\n") == ["error:38"]
    assert session.send("$13=0\n") == ["ok"]
    assert report(session)[1:] == ["WPos:-23.900,-0.501,-2.287", "FS:0,0",
                                   "WCO:25.400,0.001,2.539"]


def test_the_speed_in_inches(session):
    session.send("$13=1\n$10=1\n")
    session.send("G1 X8 F2540\n", wait=False)
    session.run(150_000)
    (moving,) = session.send("?", wait=False)
    assert moving.startswith("<Run|MPos:0.")
    assert "|FS:100.0,0" in moving


def test_where_the_probe_touched_in_inches(session):
    session.send("$13=1\n")
    assert listed(session, "G38.3 Y-1.27 F2000\n") == ["[PRB:0.0000,-0.0502,0.0000:0]", "ok"]


def test_a_report_has_one_origin_however_often_that_changes(session):
    session.send("$10=0\n")
    lines = [line for first in range(1, 61, 15) for line in listed(session, "".join(
        f"G92 X{n}\n??????" for n in range(first, first + 15)))]
    assert lines.count("ok") == 60
    shown = [(float(work), float(origin)) for each in lines
             for work, origin in re.findall(r"WPos:([^,]*),.*WCO:([^,]*),", each)]
    assert len(shown) > 10
    assert all(work == -origin for work, origin in shown)


def test_units_hold_for_a_whole_line_whenever_they_change(session):
    session.send("G92 X-50.8\nG0 X-48.26\n")
    lines = listed(session, "?" + "".join(
        f"$13={inches}\n??$#\n?" for inches in (1, 0, 1, 0, 1)) + "$RST=$\n?????")
    shown = {each.split("|")[1] + re.sub(".*WCO", " WCO", each)[:-1] for each in lines
             if each[:1] == "<" and "WCO" in each}
    assert shown == {"MPos:2.538,0.000,0.000 WCO:50.800,0.000,0.000",
                     "MPos:0.0999,0.0000,0.0000 WCO:2.0000,0.0000,0.0000"}
    probed = [each for each in lines if each.startswith("[PRB")]
    assert probed == [f"[PRB:{','.join(['0.0000' if inches else '0.000'] * 3)}:0]"
                      for inches in (1, 0, 1, 0, 1)]


def test_numbers_are_those_of_the_field_whenever_the_mask_changes(session):
    """Reports are asked for all the time."""
    session.send("G92 X-5\nG0 X-4\n")
    lines = listed(session, "?" + "".join(f"$10={mask}\n??" for mask in (0, 3, 2, 1, 0, 3)) + "?"
                   "$10=0\n$RST=$\n?????")
    reports = [each.split("|")[1] for each in lines if each[:1] == "<"]
    assert set(reports) == {"MPos:1.000,0.000,0.000", "WPos:-4.000,0.000,0.000"}
