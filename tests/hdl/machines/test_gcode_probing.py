# amaranth: UnusedElaboratable=no

"""G38.2 to G38.5 of `gcode`, with a plate that the tool touches."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from fresa.machines.gcode import GCode, GCodeSettings
from tb.boards import component
from tb.engines import CXXRTLEngine, Engine
from tb.models.protocol import bits
from tests.hdl.machines.test_gcode import (
    GREETING,
    LOCKED,
    SETTINGS,
    STEPS,
    UNLOCKED,
    Belts,
    Session,
    elaborated_once,
)

pytestmark = pytest.mark.compiler

Z_STEPS = 250
PLATE = -300
"""Highest place of Z at which the tool touches, in steps: -1.2 mm."""

FEED, ACCELERATION = 600, 1000
"""mm/min, and mm/s²."""

WAY = (FEED / 60) ** 2 / 2 / ACCELERATION
"""On which that stops, in mm."""


class Probing(Session):
    """A session with a plate below the tool, unless a test sets the probe itself."""

    plate: int | None = PLATE
    touched: list[int] | None = None
    """Where the axes were when it was touched first, in steps."""

    def run(self, clocks: int) -> None:
        """Let time pass; the probe follows Z, which takes 100 clocks for a step at its fastest."""
        end = self.engine.clock + clocks
        while self.plate is not None and self.engine.clock < end:
            on = self.position[2] <= self.plate
            if on and self.touched is None:
                self.touched = [*self.position]
            self.engine.set(probe=on)
            left = end - self.engine.clock
            far = 90 * (abs(self.position[2] - self.plate) - 2)
            super().run(min(max(20, far // 20 * 20), left))
        super().run(end - self.engine.clock)

    def say(self, text: str) -> None:
        """Begin to send text, and let no time pass."""
        self.waiting += [level for byte in text.encode("latin-1") for level in bits(byte)]

    def run_until(self, condition: Callable[[], object], clocks: int = 100) -> None:
        """Let time pass until that is so, in steps of so many clocks."""
        end = self.engine.clock + 2_000_000
        while not condition():
            assert self.engine.clock < end
            self.run(clocks)

    def rests_where_it_says(self) -> None:
        """Check that it rests, knows where, and finds back to 0."""
        state, place = self.state()
        assert state == "Idle"
        assert place == [pytest.approx(at / float(steps), abs=5.1e-4)
                         for at, steps in zip(self.position, self.steps_per_mm, strict=True)]
        assert self.send("G90G0X0Y0Z0\n") == ["ok"]
        assert self.position == [0, 0, 0]

    def send(self, text: str, **how: bool) -> list[str]:
        """Send text, as :class:`Session` does; a probing is answered after it was listed."""
        lines = super().send(text, **how)
        self.run(12_000)
        while how.get("wait", True) and self.engine.get("moving"):
            self.run(10_000)
        return [*lines, *(self.read() if how.get("read", True) else [])]

    def probed(self) -> str:
        """Return where ``$#`` says that it touched."""
        self.send("$#\n", read=False)
        self.run(80_000)
        (line,) = (line for line in self.read() if line.startswith("[PRB:"))
        return line


@pytest.fixture
def engine():
    with CXXRTLEngine(elaborated_once()) as engine:
        yield engine
        assert not engine.get("fault")


@pytest.fixture
def session(engine):
    return Probing(engine)


def anew(engine: Engine, *, probe: int = 0) -> Probing:
    """Return a session without a plate, the same in each clock from power-up on."""
    engine.set(rst=1, abort=0)
    engine.run(1)
    engine.set(rst=0)
    session = Probing(engine)
    session.plate = None
    engine.set(probe=probe)
    return session


def test_it_ends_where_it_touches_and_says_where(session):
    found = "[PRB:1.000,0.000,-1.200:1]"
    assert session.send(f"G1X1F{FEED}\nG38.2Z-5\n") == ["ok", found, "ok"]
    assert session.touched == [80, 0, PLATE]
    assert session.probed() == found
    # It has braked, and knows where it is.
    beyond = (PLATE - session.position[2]) / Z_STEPS
    assert WAY - 1 / Z_STEPS <= beyond < WAY + 0.02
    state, place = session.state()
    assert (state, place) == ("Idle", [1, 0, pytest.approx(session.position[2] / Z_STEPS)])
    assert session.send("G91G0Z1\n") == ["ok"]
    assert session.position[2] == PLATE - round(beyond * Z_STEPS) + Z_STEPS
    assert session.send("G90G0X0Z0\n") == ["ok"]
    assert session.position == [0, 0, 0]
    assert "G0 " in session.send("$G\n")[0]


def test_a_probing_waits_for_the_motion_before_it(session):
    answers = session.send(f"G1X3F{FEED}\nG38.2Z-5\nG0Z0\n")
    assert answers == ["ok", "[PRB:3.000,0.000,-1.200:1]", "ok", "ok"]
    assert session.touched == [240, 0, PLATE]
    assert session.position == [240, 0, 0]


@pytest.mark.parametrize("code", [2, 3])
def test_what_it_does_not_find(session, code):
    session.plate = None
    end = "[PRB:0.000,0.000,-0.500:0]" if code == 3 else "[PRB:0.000,0.000,0.000:0]"
    alarm = [] if code == 3 else ["ALARM:5"]
    assert session.send(f"G38.{code}Z-.5F{FEED}\n") == [*alarm, end, "ok"]
    assert session.position == [0, 0, -125]
    if alarm:
        assert session.send("G0Z0\n$X\n") == ["error:9", UNLOCKED, "ok"]
    assert session.send("G0Z0\n") == ["ok"]
    assert session.position == [0, 0, 0]


def test_what_touches_already_is_an_alarm_and_nothing_moves(session):
    session.plate = 0
    assert session.send(f"G38.2Z-1F{FEED}\nG0X1\n") == ["ALARM:4", "ok", "error:9"]
    assert session.position == [0, 0, 0]
    assert session.send("$X\n") == [UNLOCKED, "ok"]
    assert session.send("G91G0X1\n") == ["ok"]
    assert session.position == [80, 0, 0]


@pytest.mark.parametrize("code", [4, 5])
def test_away_from_a_contact(session, code):
    session.plate = 50
    answers = session.send(f"G38.{code}Z5F{FEED}\n")
    assert answers == ["[PRB:0.000,0.000,0.204:1]", "ok"]  # 51 steps
    assert session.position[2] >= 51
    assert session.send(f"G38.{code}Z0\n")[0] == "ALARM:4"  # it does not touch any more


def test_a_hold_goes_on_with_the_probing(session):
    session.send(f"G38.2Z-5F{FEED}\n", wait=False)
    session.run(50_000)
    session.send("!", wait=False)
    session.run(200_000)
    stands = [*session.position]
    assert 0 > stands[2] > PLATE
    assert session.state()[0] == "Hold:0"
    session.run(100_000)
    assert session.position == stands
    assert session.send("~") == ["[PRB:0.000,0.000,-1.200:1]", "ok"]


def test_a_reset_ends_it_and_forgets_where_it_touched(session):
    session.send(f"G38.2Z-2F{FEED}\nG0Z0\n")
    assert session.probed().endswith(":1]")
    session.plate = None
    session.send(f"G38.2Z-2F{FEED}\n", wait=False)
    session.run(100_000)
    assert session.send("\x18") == [GREETING]
    assert -500 < session.position[2] < 0
    assert session.probed() == "[PRB:0.000,0.000,0.000:0]"
    session.send("G0Z0\n")
    assert session.position == [0, 0, 0]


def test_checked_lines_probe_nothing(session):
    session.plate = 0
    lines = f"$C\nG38.2Z-2F{FEED}\nG91G38.2Z-2\nG38.2\nG38.2Z0\n$C\n"
    answers = [line for line in session.send(lines) if not line.startswith("[")]
    assert answers[:6] == ["ok", "ok", "ok", "error:26", "error:33", "ok"]
    assert session.position == [0, 0, 0]


@pytest.mark.parametrize(("line", "answer"), [("G2X3I1", "ok"), ("G2X2I1", "error:33")])
def test_an_arc_is_checked_from_where_a_checked_probing_ends(session, line, answer):
    """It would be refused, or not, if it began where the probing does."""
    session.plate = 0
    lines = session.send(f"$C\nG38.2X1F{FEED}\n{line}\n$C\n")
    assert lines[:4] == ["[MSG:Enabled]", "ok", "ok", answer]
    assert session.position == [0, 0, 0]


def test_overrides_leave_a_probing_as_it_is(session):
    times = []
    for overrides in "", "\x91" * 5, "\x92" * 5:
        session.send(f"\x90{overrides}G0Z0\n")
        session.path.clear()
        session.send(f"G38.2Z-2F{FEED}\n")
        at = {place[2]: clock for clock, place in session.path}
        times.append(at[-250] - at[-50])
    assert times[0] == times[1] == times[2]
    assert times[0] == pytest.approx(200 / Z_STEPS * 60 / FEED * SETTINGS.clock, rel=0.01)


def test_soft_limits_count(session):
    """A line that would leave the travel is alarm 2: nothing moves, and no line is answered."""
    assert session.send("$22=1\n$132=2\n$20=1\n") == ["ok"] * 3
    assert session.send(f"G38.2Z-2.5F{FEED}\n") == ["ALARM:2", "[MSG:Reset to continue]"]
    assert session.path == []
    assert session.state()[0] == "Alarm"
    assert session.send("G0X1\n$X\n") == ["error:9", "error:8"]
    session.send("\x18", wait=False)
    assert session.send("$X\n") == [UNLOCKED, "ok"]
    assert session.probed() == "[PRB:0.000,0.000,0.000:0]"
    assert session.send(f"G38.2Z-2F{FEED}\n") == ["[PRB:0.000,0.000,-1.200:1]", "ok"]
    session.rests_where_it_says()


def test_soft_limits_count_in_check_mode(session):
    """As of a line; GRBL looks at no limits of a probing that it checks."""
    assert session.send("$22=1\n$132=2\n$20=1\n") == ["ok"] * 3
    assert session.send(f"$C\nG38.2Z-1.5F{FEED}\n") == ["[MSG:Enabled]", "ok", "ok"]
    assert session.send("G38.2Z-2.5\n") == ["ALARM:2", "[MSG:Reset to continue]"]
    assert session.path == []


def test_the_end_of_a_program_does_not_wait_in_an_alarm(session):
    assert session.send(f"G38.2Z-.1F{FEED}M30\n") == [
        "ALARM:5", "[PRB:0.000,0.000,0.000:0]", "[MSG:Pgm End]", "ok"]
    assert session.send("$X\nG0X1\n") == [UNLOCKED, "ok", "ok"]


def test_a_pause_does_not_wait_in_an_alarm(session):
    """M0 in the line of a probing: with no alarm it waits, otherwise lists and $H are possible."""
    session.send(f"G38.3Z-.1F{FEED}M0\n", wait=False)
    session.run_until(lambda: not session.engine.get("moving"))
    session.run(50_000)
    assert session.read() == ["[PRB:0.000,0.000,-0.100:0]", "ok"]
    assert session.state()[0] == "Hold:0"
    session.send("~G0Z0\n")
    session.plate = None
    session.send(f"G38.2Z-.1F{FEED}M0\n", wait=False, read=False)
    session.run(80_000)
    assert session.read() == ["ALARM:5", "[PRB:0.000,0.000,-0.100:0]", "ok"]
    assert session.engine.get("moving") == 0
    assert session.send("$N\n")[-1] == "ok"
    assert session.send("$X\nG0X1\n") == [UNLOCKED, "ok", "ok"]
    assert session.position == [80, 0, -25]
    session.rests_where_it_says()


@pytest.mark.parametrize(("alarm", "before"), [(4, 200), (5, 8000)])
def test_no_alarm_follows_a_reset(engine, alarm, before):
    """A reset in each clock around the end of a probing is before its alarm, or behind it.

    While the line brakes to its end a reset waits for that, and takes effect when it would be one.
    """
    def probing() -> Probing:
        session = anew(engine, probe=alarm == 4)
        session.say("G38.2Z-.004F600\n")
        return session

    session = probing()
    begin = engine.clock
    session.run_until(lambda: engine.get("alarm"), 1)
    end = engine.clock - begin
    answers = []
    for clocks in [*range(end - before, end - 16, before // 8), *range(end - 16, end + 4)]:
        session = probing()
        session.run(clocks)
        engine.set(abort=1)
        session.run(20_000)
        answers.append(session.read())
        assert engine.get("alarm") == (len(answers[-1]) > 1)
    behind = [f"ALARM:{alarm}", GREETING, LOCKED]
    first = answers.index(behind)
    assert 8 < first < len(answers) - 4
    assert answers == [[GREETING]] * first + [behind] * (len(answers) - first)


def test_the_rest_of_its_line_is_done(session):
    answers = session.send(f"G54G38.3Z-5F{FEED}M3S100M8M30\n")
    assert answers == ["[PRB:0.000,0.000,-1.200:1]", "[MSG:Pgm End]", "ok"]
    session.run(50_000)
    assert session.engine.get("spindle", "flood") == (0, 0)
    assert session.on == {0, 1}
    assert "G1 " in session.send("$G\n")[0]


def test_a_report_meanwhile_is_of_where_it_is(session):
    """Of many reports during a probing the last ones stay where it stands."""
    session.send(f"G38.2Z-5F{FEED}\n", wait=False, read=False)
    places = []
    for _ in range(60):
        session.send("?", wait=False, read=False)
        places += [float(line.split("|")[1].split(",")[2]) for line in session.read()
                   if line.startswith("<")]
    assert len(places) == 60
    assert places == sorted(places, reverse=True)
    assert places[-1] == pytest.approx(session.position[2] / Z_STEPS)


def test_a_report_at_its_end_is_of_where_it_is(engine):
    """Requested in the clocks before it has braked, when the planner is told where it touched."""
    def probing() -> Probing:
        session = anew(engine)
        session.say(f"G38.2Z-1F{FEED}\n")
        session.run(21_000)
        engine.set(probe=1)
        return session

    session = probing()
    begin = engine.clock
    session.run_until(lambda: not engine.get("moving"), 1)
    standing = engine.clock - begin
    place = session.position[2] / Z_STEPS
    for clocks in range(standing - 320, standing - 160, 4):
        session = probing()
        session.run(clocks)
        session.say("?")
        session.run(30_000)
        report, found, answer = sorted(session.read())
        assert report.split("|")[1] == f"MPos:0.000,0.000,{place:.3f}"
        assert f"{place:.3f}" not in found and found.endswith(":1]")
        assert answer == "ok"


PHASES: dict[str, Callable[[Probing], object]] = {
    "before": lambda session: session.position[0] == 20,
    "moves": lambda session: session.position[2] == -20,
    "brakes": lambda session: session.position[2] == -44,
    "begins": lambda session: session.touched and not session.engine.get("moving"),
    "answers": lambda session: "P" in session.text,
}
"""What shows that a probing has come so far."""


def begun(session: Probing, phase: str) -> list[str]:
    """Begin a probing behind a line in X, and let it come so far; return what was said."""
    session.plate = -40
    session.say(f"G1X.5F{FEED}\nG38.2Z-1\n")
    session.run_until(lambda: PHASES[phase](session) and not session.waiting)
    return session.read()


@pytest.mark.parametrize("phase", PHASES)
@pytest.mark.parametrize("door", [0, 1])
def test_what_holds_it_lets_it_go_on(session, phase, door):
    lines = begun(session, phase)
    session.engine.set(door=door)
    session.say("" if door else "!")
    session.run(60_000)
    lines += session.read()
    stands = [*session.position]
    assert session.state()[0] == ("Door:1" if door else "Hold:0")
    session.run(40_000)
    session.say("~" if door else "!")  # of no effect
    session.run(20_000)
    assert session.position == stands
    session.engine.set(door=0)
    session.run(100)
    lines += session.send("~")
    expected = ["ok", "[PRB:0.500,0.000,-0.160:1]", "ok"]
    assert [line for line in lines if not line.startswith("[MSG")] == expected
    assert lines.count("[MSG:Check Door]") == door
    assert session.touched == [40, 0, -40]
    session.rests_where_it_says()


@pytest.mark.parametrize("phase", PHASES)
@pytest.mark.parametrize(("pin", "alarm"), [("limits", 1), ("stop", 10), (None, None)])
def test_what_ends_it_drops_its_answer(session, phase, pin, alarm):
    """A reset brakes, the others stop; it is not answered, and where the axes are stays known."""
    lines = begun(session, phase)
    stands = [*session.position]
    if pin:
        session.engine.set(**{pin: 1})
        session.run(20_000)
        assert all(abs(now - at) <= 1 for now, at in zip(session.position, stands, strict=True))
        lines += session.read()
        session.engine.set(**{pin: 0})
        session.run(100)
    session.say("\x18")
    session.run(60_000)
    assert session.position[2] >= -1.5 * 44
    answer, *listed = (line for line in [*lines, *session.read()] if "MSG" not in line)
    if phase == "answers":  # its beginning had been sent
        cut, *listed = listed
        assert "[PRB:0.500,0.000,-0.160:1]".startswith(cut)
    assert (answer, listed) == ("ok", [*([f"ALARM:{alarm}"] if pin else []), GREETING])
    if pin:
        assert session.send("$X\n") == [UNLOCKED, "ok"]
    known = session.probed()
    assert known == "[PRB:0.000,0.000,0.000:0]"
    session.rests_where_it_says()


@pytest.mark.long
def test_corexy_probes_in_x_and_y():
    settings = replace(SETTINGS, kinematics="corexy", steps_per_mm=Belts.steps_per_mm)
    with CXXRTLEngine(component("gcode", GCode(settings=settings))) as engine:
        session = Belts(engine, (9, 9, 9))
        session.send(f"G38.2X3Y1F{FEED}\n", wait=False)
        session.run(200_000)
        begin = session.axes()
        engine.set(probe=1)
        session.send("", read=False)
        session.run(20_000)
        found, answer = session.read()
        engine.set(probe=0)
        *at, last = found[5:-1].replace(":", ",").split(",")
        assert (answer, last) == ("ok", "1")
        # It has gone on while the filter and the bytes of the line took their time.
        for axis in range(2):
            assert begin[axis] <= float(at[axis]) * STEPS <= session.axes()[axis]
        assert begin[0] == pytest.approx(3 * begin[1], abs=2) and begin[0] > 40
        session.send("G0X0Y0\n")
        assert session.position == [0, 0, 0]
        assert not engine.get("fault")


def test_a_machine_without_it_says_so():
    assert "Without probing" not in GCodeSettings().notes
    assert "Without probing" in GCodeSettings(probing=False).notes
    assert "Without probing" in GCodeSettings(dialect="thesis").notes
