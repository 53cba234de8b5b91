# amaranth: UnusedElaboratable=no

"""Lines that `gcode` runs at every start, and the text of the user in `$I`."""

from dataclasses import replace

import pytest

from fresa.machines.gcode import GCode, GCodeSettings
from fresa.protocol import STORED_LENGTH
from tb.boards import component
from tb.engines import CXXRTLEngine
from tb.models.protocol import bits
from tests.hdl.machines.test_gcode import (
    GREETING,
    HOMED,
    LOCKED,
    SETTINGS,
    UNLOCKED,
    Session,
    Switches,
)

pytestmark = pytest.mark.compiler


def listed(session) -> list[str]:
    session.send("$N\n", read=False)
    session.run(20_000)
    return session.read()


def reset(session) -> list[str]:
    session.send("\x18", read=False)
    session.run(60_000)
    return session.read()


def test_lines_are_done_when_they_are_stored_and_at_every_start(session):
    assert session.send("$N0=g91 (away) g0 x1 ; one more\n") == ["ok"]
    assert session.send("$n1 = G20\n") == ["ok"]
    assert session.at(1, 0, 0)
    assert listed(session) == ["$N0=G91G0X1", "$N1=G20", "ok"]
    assert session.send("G21G90\n") == ["ok"]
    assert reset(session) == [GREETING, ">G91G0X1:ok", ">G20:ok"]
    assert session.at(2, 0, 0)
    assert session.send("$G\n") == ["[GC:G0 G54 G17 G20 G91 G94 M5 M9 T0 F0 S0]", "ok"]
    assert session.send("$N0=\n") == ["ok"]
    assert listed(session) == ["$N0=", "$N1=G20", "ok"]
    assert reset(session) == [GREETING, ">G20:ok"]
    assert session.at(2, 0, 0)


def test_a_line_comes_behind_them(session):
    assert session.send("$N0=G91\n$N1=G0X1\n") == ["ok", "ok"]
    session.send("\x18", wait=False, read=False)
    assert session.send("G0X1\nG90\n") == [GREETING, ">G91:ok", ">G0X1:ok", "ok", "ok"]
    assert session.at(3, 0, 0)


@pytest.mark.parametrize(("line", "answer"), [
    ("$N0=G999", "error:20"), ("$N0=X", "error:2"), ("$N1=%", "error:1"), ("$N2=G54", "error:3"),
    ("$N=G54", "error:3"), ("$N01=G54", "error:3"), ("$N0=$X", "error:1"), ("$N0", "error:3"),
    (f"$N0=G1F100X{'0' * STORED_LENGTH}", "error:14"), (f"$I={'a' * 128}", "error:14"),
    ("$NO=G54", "error:3")])
def test_what_is_refused_is_not_stored(session, line, answer):
    assert session.send("$N0=G55\n$N1=G21\n$I=mine\n") == ["ok"] * 3
    assert session.send(f"{line}\n") == [answer]
    assert listed(session) == ["$N0=G55", "$N1=G21", "ok"]
    assert reset(session) == [GREETING, ">G55:ok", ">G21:ok"]


def test_the_longest_line(session):
    line = "G1F100" + "X" + "0" * (STORED_LENGTH - 7)
    assert session.send(f"$N1={line}\n") == ["ok"]
    assert listed(session) == ["$N0=", f"$N1={line}", "ok"]
    assert reset(session) == [GREETING, f">{line}:ok"]


def test_one_that_is_refused_at_the_start_says_so(session):
    assert session.send("G91F600\n$N0=G1X1\n") == ["ok", "ok"]
    assert session.send("$N1=G4P0.001\n") == ["ok"]
    assert reset(session) == [GREETING, ">G1X1:error:22", ">G4P0.001:ok"]  # without a feed
    assert session.at(1, 0, 0)


def test_none_is_stored_while_it_moves_or_in_an_alarm(session):
    answers = session.send("G91G1X2F600\n$N0=G54\n$I=it\n", wait=False)
    assert answers == ["ok", "error:8", "error:8"]
    session.run(2_000_000)
    assert session.send("$C\n$N0=G54\n$C\n")[:3] == ["[MSG:Enabled]", "ok", "error:8"]
    session.run(50_000)
    session.read()
    session.engine.set(limits=1)
    session.run(1000)
    session.engine.set(limits=0)
    session.run(50_000)
    assert session.read()[0] == "ALARM:1"
    assert session.send("$N0=G54\n$I=it\n") == ["error:8", "ok"]
    assert reset(session) == [GREETING, LOCKED]
    assert session.send("$X\n") == [UNLOCKED, "ok"]
    assert listed(session) == ["$N0=", "$N1=", "ok"]


def test_none_is_run_while_the_machine_is_locked(session):
    assert session.send("$N0=G91G0X1\n") == ["ok"]
    assert session.send("$SLP\n", wait=False)[0] == "ok"
    assert session.at(1, 0, 0)
    assert reset(session) == [GREETING, LOCKED]
    assert session.send("$X\n") == [UNLOCKED, "ok"]
    assert session.at(1, 0, 0)
    assert reset(session) == [GREETING, ">G91G0X1:ok"]
    assert session.at(2, 0, 0)


def test_the_text_of_the_user(session):
    assert session.send("$I=Mill of (not) Ana, 2026 -1.5X\n") == ["ok"]
    session.send("$I\n", read=False)
    session.run(100_000)
    lines = session.read()
    assert lines[0] == "[VER:1.1h.20190830:MILLOFANA,2026-1.5X]"
    assert lines[1] == "[OPT:VMH+,63,128]" and lines[-1] == "ok"
    assert reset(session) == [GREETING]


def test_everything_restored_is_as_at_power_up(session):
    assert session.send("$N0=G91\n$N1=G20\n$I=X\n") == ["ok"] * 3
    for what in "$#":
        session.send(f"$RST={what}\n", wait=False, read=False)
        session.run(60_000)
        assert session.read()[-2:] == [">G91:ok", ">G20:ok"]
    session.send("$RST=*\n", wait=False, read=False)
    session.run(60_000)
    assert session.read()[-1] == GREETING
    session.send("$I\n", read=False)
    session.run(100_000)
    assert session.read()[0] == "[VER:1.1h.20190830:]"
    assert listed(session) == ["$N0=", "$N1=", "ok"]
    assert session.send("$N1=G55\n") == ["ok"]
    assert listed(session) == ["$N0=", "$N1=G55", "ok"]


@pytest.mark.parametrize("clocks", [*range(0, 1200, 53)])
def test_a_reset_at_any_time_stores_a_line_or_not(session, clocks):
    assert session.send("$N0=G55\n") == ["ok"]
    session.waiting += [level for byte in b"$N0=G56\n" for level in bits(byte)]
    session.run(len(session.waiting) * session.bit + clocks)
    session.engine.set(abort=1)
    session.run(60_000)
    session.engine.set(abort=0)
    lines = session.read()
    assert lines[-1] == (">G56:ok" if lines[0] == "ok" else ">G55:ok")
    assert lines[-2] == GREETING
    assert session.send("G0X1\n") == ["ok"]


def test_nothing_is_restored_in_what_is_being_said(session):
    assert session.send("$N0=G91G20\n$N1=G55\n") == ["ok", "ok"]
    session.send("\x18$RST=*\n", wait=False, read=False)
    session.run(100_000)
    assert session.read() == [GREETING, ">G91G20:ok", ">G55:ok", "[MSG:Restoring defaults]", "ok",
                              GREETING]


def test_none_is_run_while_the_door_is_open(session):
    assert session.send("$N0=M3S500\n") == ["ok"]
    session.send("\x18", read=False)
    session.run(60_000)
    session.send("\x18", wait=False, read=False)
    session.engine.set(door=1)
    session.run(100_000)
    session.read()
    session.send("\x18", wait=False, read=False)
    session.run(100_000)
    assert session.read() == [GREETING, "[MSG:Check Door]"]
    assert not session.engine.get("spindle")
    session.engine.set(door=0)
    assert session.send("G0X1\n", wait=False) == []
    assert session.send("~") == [">M3S500:ok", "ok"]
    assert session.engine.get("spindle")
    assert session.at(1, 0, 0)


@pytest.mark.parametrize("clocks", [*range(0, 24_000, 997)])
def test_a_reset_while_they_are_run_runs_them_anew(session, clocks):
    assert session.send("$N0=G55\n$N1=G21\n") == ["ok", "ok"]
    session.send("\x18", wait=False, read=False)
    session.run(clocks)
    session.send("\x18", wait=False, read=False)
    session.run(60_000)
    lines = session.read()
    assert lines[-3:] == [GREETING, ">G55:ok", ">G21:ok"]
    assert set(lines) == {GREETING, ">G55:ok", ">G21:ok"}


def test_they_are_run_behind_homing(design):
    with CXXRTLEngine(design) as engine:
        machine = Switches(engine, (3, -4, 1))
        for line in HOMED:
            assert machine.send(f"{line}\n") == ["ok"]
        assert machine.send("$N0=G91\n$N1=G0X-1\n") == ["ok", "ok"]
        machine.send("$H\nX-1\n", read=False)
        while "ok" not in machine.text:
            assert engine.clock < 40_000_000
            machine.run(100_000)
        machine.run(200_000)
        assert machine.read() == ["ok", ">G91:ok", ">G0X-1:ok", "ok"]
        assert machine.send("?")[0].startswith("<Idle|MPos:-2.400,-14.600,-0.400|")
        assert not engine.get("fault")


class Power(Session):
    """A session with a machine that says more than its greeting at power-up."""

    def read(self) -> list[str]:
        """Return the lines that have come, at first the greeting alone."""
        lines = super().read()
        if self.engine.clock <= 20_000:
            self.more = lines[1:]
            return lines[:1]
        return lines


@pytest.mark.long
def test_they_may_be_in_the_bitstream():
    settings = replace(SETTINGS, startup=("G91G20", "G55"))
    with CXXRTLEngine(component("gcode", GCode(settings=settings))) as engine:
        session = Power(engine)
        assert session.more == [">G91G20:ok", ">G55:ok"]
        assert reset(session) == [GREETING, ">G91G20:ok", ">G55:ok"]
        assert session.send("$N1=\n") == ["ok"]
        assert reset(session) == [GREETING, ">G91G20:ok"]
        session.send("$RST=*\n", wait=False, read=False)
        session.run(60_000)
        assert session.read()[-2:] == [">G91G20:ok", ">G55:ok"]


@pytest.mark.parametrize(("options", "message"), [
    ({"startup": ("g54",)}, "startup line 0 must be upper case"),
    ({"startup": ("", "G54 G21")}, "startup line 1 must be upper case, without blanks"),
    ({"startup": ("G54",) * 3}, "number of startup lines must be"),
    ({"startup": ("X" * 128,)}, "characters of startup line 0 must be"),
    ({"startup": ("G54",), "startup_lines": False}, "there is no room for startup lines"),
    ({"startup": ("G54",), "dialect": "thesis"}, "there is no room for startup lines")])
def test_impossible_lines(options, message):
    with pytest.raises(ValueError, match=message):
        GCodeSettings(**options)
