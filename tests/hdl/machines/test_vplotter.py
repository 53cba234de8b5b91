# amaranth: UnusedElaboratable=no

"""`vplotter`: sessions on its line, with a plant that knows two strings and gravity alone."""

import random
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from fractions import Fraction
from math import hypot

import pytest

from fresa.machines.vplotter import VPlotter, VPlotterSettings
from tb.boards import component
from tb.design import Design
from tb.engines import CXXRTLEngine
from tb.machines.vplotter.scenarios import GREETING, WallSession, from_chord
from tests.tools.process import ROOT

SETTINGS = VPlotterSettings(
    clock=2_000_000, baud=125_000, wall_width=60, wall_height=60, least_y=10, rest=(30, 30),
    string_rate=4000, max_rate=(Fraction(6000), Fraction(6000), Fraction(12_000)),
    acceleration=(Fraction(2000),) * 3)
STEP = 1 / 25.4648
"""A half step of string, in mm."""

compiled = pytest.mark.compiler


@pytest.fixture(scope="module")
def design():
    return component("vplotter", VPlotter(settings=SETTINGS))


@contextmanager
def started(design: Design, settings: VPlotterSettings) -> Iterator[WallSession]:
    """Give a session with the machine, and check what holds in every one."""
    with CXXRTLEngine(design) as engine:
        made = WallSession(engine, settings, place=(20, 40), switch=20)
        assert made.take(20_000, GREETING) == GREETING
        yield made
        assert engine.get("fault") == 0
        assert made.plant.left.jumps == made.plant.right.jumps == 0
        assert not made.plant.torn
        assert min(made.plant.left.nearest, made.plant.right.nearest) >= settings.period


@pytest.fixture
def session(design):
    with started(design, SETTINGS) as made:
        yield made


def home(session: WallSession) -> None:
    assert session.ask("$H", "ok", 8_000_000) == b"ok\r\n"
    session.rest()
    apart(session, SETTINGS.rest)


def apart(session: WallSession, place) -> None:
    """Check that the pen is where it should be, as far as half a step of each string says."""
    x, y = session.pen
    assert hypot(x - place[0], y - place[1]) < 2 * STEP, (x, y, place)


def goes_on(session: WallSession) -> None:
    """Check that it obeys after a reset, and knows its place."""
    assert session.ask("\x18$X", "ok").endswith(b"ok\r\n")
    before = where(session)
    assert session.ask("$J=G91X0.1F600", "ok") == b"ok\r\n"
    session.rest()
    assert where(session)[0] == pytest.approx(before[0] + 0.1, abs=0.01)
    apart(session, where(session))


def command(session: WallSession, text: str, answer: str, within: int = 40_000) -> None:
    assert session.ask(text, answer, within).decode() == f"{answer}\r\n"


def where(session: WallSession) -> tuple[float, float]:
    """Return where a report says that it is, on the wall as the thesis has it."""
    report = session.ask("?", ">", 20_000).decode()
    x, y, _ = map(float, report.split("MPos:")[1].split("|")[0].split(","))
    return x + SETTINGS.wall_width, SETTINGS.least_y - y


class TestThesis:
    pytestmark = compiled

    def test_session(self, session):
        for text, answer in (
                (":S0", "00"), (":P1", "Motors powered."), (":S0", "01"), (":S1", "01"),
                (":S2", "01"), (":I00100020", "The place is unknown. Home first: :H"),
                (":H", "Homing motor 1."), (":S0", "03"), (":S1", "0B"), (":S2", "09")):
            command(session, text, answer)
        assert session.take(8_000_000, b"2.\r\n") == b"Homing motor 2.\r\n"
        for text, answer in ((":S0", "03"), (":S1", "0F"), (":S2", "0B"),
                             (":I00100020", "Busy: wait until it stands.")):
            command(session, text, answer)
        assert session.take(8_000_000, b"rest.\r\n") == b"Going to the place of rest.\r\n"
        command(session, ":S1", "0D")
        assert session.take(8_000_000, b"yyyy\r\n") == b"Homed. Give a start point: :Ixxxxyyyy\r\n"
        apart(session, SETTINGS.rest)
        for text, answer in (
                (":S0", "05"), (":S1", "05"), (":S2", "05"),
                (":F00200022", "Give a start point first: :Ixxxxyyyy"),
                (":I00100020", "Going to the start point."), (":S0", "0D"), (":S2", "0D")):
            command(session, text, answer)
        assert session.take(4_000_000, b"\r\n") == (
            b"At the start point. Give the end point: :Fxxxxyyyy\r\n")
        apart(session, (10, 20))
        for text, answer in ((":S0", "15"), (":f00500055", "Drawing."), (":S0", "2D"),
                             (":S1", "2D")):
            command(session, text, answer)
        assert session.take(4_000_000, b"\r\n") == (
            b"Line drawn. Give a start point: :Ixxxxyyyy\r\n")
        command(session, ":S0", "05")
        (line,) = session.path
        assert from_chord(line, (10, 20), (50, 55)) < 0.1 + STEP
        assert len(line) > 500
        apart(session, (50, 55))
        assert session.ask(":P0", "[MSG:Sleeping]", 40_000).count(
            b"Motors released: the place is unknown.\r\n") == 1
        command(session, ":S0", "00")
        woken = session.ask(":P1", "unlock]", 40_000)
        assert b"Motors powered.\r\n" in woken and b"Grbl" in woken
        command(session, ":S0", "01")
        command(session, ":I00100020", "The place is unknown. Home first: :H")

    @pytest.mark.parametrize(("text", "says"), [
        (":", "Commands: "), (":Z", "Commands: "), (":P", "Power of"), (":P2", "Power of"),
        (":P11", "Power of"), (":H1", "Home: "), (":I0010002", "Start point, "),
        (":I001000200", "Start point, "), (":F0010002x", "End point, "), (":F", "End point, "),
        (":F-0100020", "End point, "), (":S", "State: "), (":S3", "State: "),
        (":" + "9" * 300, "Commands: "), (": P1", "Commands: ")])
    def test_malformed_command_is_answered_with_its_form(self, session, text, says):
        assert session.ask(text, "never", 60_000 + 200 * len(text)).decode().startswith(says)
        command(session, ":S0", "00")

    def test_off_the_wall(self, session):
        home(session)
        for text in (":I00610030", ":I00300009", ":I00300061", ":I99999999"):
            command(session, text, "Off the wall: x is 0000 to 0060, y is 0010 to 0060")
        apart(session, SETTINGS.rest)
        command(session, ":I00000010", "Going to the start point.")
        session.take(4_000_000, b"yyyy\r\n")
        apart(session, (0, 10))

    def test_commands_need_not_wait_for_texts(self, session):
        home(session)
        session.send(":I00200020\n")
        session.take(4_000_000, b"yyyy\r\n")
        session.send(":F00220020\n:S0\nG4P0\n")
        said = session.take(2_000_000)
        assert said.count(b"Line drawn.") == 1 and said.count(b"ok\r\n") <= 1
        assert b"2D\r\n" in said

    def test_commands_that_come_meanwhile_change_nothing(self, session):
        home(session)
        session.send(":Z\n:I00200020\n:I00400045\n")
        assert session.take(4_000_000, b"yyyy\r\n").count(b"\r\n") == 4
        apart(session, (20, 20))

    @pytest.mark.parametrize(("line", "says"), [
        ("$J=G91X5F6000", "Busy: wait until it stands."), ("G90", "Give a start point first"),
        ("G1X30F6000", "Busy: wait until it stands.")])
    def test_answers_are_in_the_order_of_lines(self, session, line, says):
        home(session)
        session.send(f"{line}\n:F00500050\n")
        assert session.take(100_000).startswith(f"ok\r\n{says}".encode())

    def test_power_does_not_overtake_a_sleep(self, session):
        session.send("$X\n$$\n$SLP\n:P1\n")
        said = session.take(400_000, b"powered.\r\n")
        assert said.index(b"Sleeping") < said.index(b"Motors powered.")
        command(session, ":S0", "01")

    def test_states_while_it_homes_by_a_line(self, session):
        session.send("$H\n:S0\n")
        assert session.take(100_000, b"\r\n") == b"03\r\n"

    def test_no_power_in_an_emergency_stop(self, session):
        session.engine.set(stop=1)
        session.take(40_000)
        command(session, ":P1", "Emergency stop, or a motor's fault: end that first.")
        command(session, ":S0", "00")
        session.engine.set(stop=0)
        command(session, ":P1", "Motors powered.")

    @pytest.mark.parametrize("byte", [
        "!", *(pytest.param(byte, marks=pytest.mark.long) for byte in ("\x85", "\x18"))])
    def test_line_that_is_cancelled_is_not_drawn(self, session, byte):
        home(session)
        session.send(":I00200020\n")
        session.take(4_000_000, b"yyyy\r\n")
        command(session, ":F00500050", "Drawing.")
        session.run(300_000)
        session.send(byte)
        said = session.take(1_000_000)
        assert b"Stopped before the end.\r\n" in said and b"drawn" not in said
        assert session.engine.get("pen") == 0
        assert from_chord(session.path[0], (20, 20), (50, 50)) < 0.1 + STEP
        apart(session, where(session))
        command(session, ":S0", "05")

    def test_draws_from_where_it_said_only(self, session):
        home(session)
        session.send(":I00200020\n")
        session.take(4_000_000, b"yyyy\r\n")
        assert session.ask("G91G0X1", "ok") == b"ok\r\n"
        session.rest()
        command(session, ":F00500050", "Give a start point first: :Ixxxxyyyy")


class TestGCode:
    pytestmark = compiled

    def test_arc_with_the_pen(self, session):
        home(session)
        for line in ("G0X30Y10", "M3", "G2X20Y20R10F3000", "M5", "G0Z-1", "G1X40", "G0Z1", "G0X50"):
            assert session.ask(line, "ok", 4_000_000) == b"ok\r\n"
        session.rest(4_000_000)
        arc, line = session.path
        assert max(abs(hypot(x - 30, 60 - y - 20) - 10) for x, y in arc) < 0.1 + STEP
        assert from_chord(line, (20, 40), (40, 40)) < 0.1 + STEP
        assert line[-1][0] == pytest.approx(40, abs=2 * STEP)
        apart(session, (50, 40))

    @pytest.mark.parametrize("line", ["$20=0", "$22=0", "$100=200", "$101=0.5", "$130=60",
                                      "$131=9", "$110=6000.001", "$111=9999"])
    def test_what_follows_from_the_wall_cannot_be_set(self, session, line):
        assert b"error" in session.ask(line, "never", 40_000)
        session.ask("$X", "ok")
        assert session.ask("$110=3000", "ok") == b"ok\r\n"

    def test_soft_limits_are_the_wall(self, session):
        home(session)
        for x, y in ((-0.1, 10), (60.1, 10), (10, -0.1), (10, 50.1)):
            assert b"ALARM:2" in session.ask(f"G1X{x}Y{y}F6000", "never", 60_000)
            session.ask("\x18$X", "ok")
            apart(session, SETTINGS.rest)

    @pytest.mark.long
    def test_straight_lines_all_over_the_wall(self, session):
        home(session)
        rng = random.Random(1)
        place = (30.0, 30.0)
        worst = 0.0
        assert session.ask("M3", "ok") == b"ok\r\n"
        for _ in range(12):
            to = rng.uniform(0, 60), rng.uniform(20, 60)
            session.path.clear()
            session._pen = 0
            assert session.ask(f"G1X{to[0]:.3f}Y{60 - to[1]:.3f}F6000", "ok").endswith(b"ok\r\n")
            session.rest(4_000_000)
            worst = max(worst, from_chord(session.path[0], place, to))
            place = to
            apart(session, place)
        assert worst < 0.1 + STEP


class TestHoming:
    pytestmark = compiled

    @pytest.mark.parametrize(("switch", "alarm"), [
        (0, b"ALARM:9"), pytest.param(1 << 30, b"ALARM:8", marks=pytest.mark.long)])
    def test_switch_that_fails(self, design, switch, alarm):
        with CXXRTLEngine(design) as engine:
            session = WallSession(engine, SETTINGS, place=(20, 40), switch=20)
            session.take(20_000, GREETING)
            session.plant.left.switch = switch
            session.plant.left.length += 100_000
            session.plant.right.length += 100_000
            said = session.ask(":H", "never", 12_000_000)
            assert alarm in said and b"Stopped before the end." in said
            before = session.plant.left.steps + session.plant.right.steps
            assert session.ask("\x18$X", "ok").endswith(b"ok\r\n")
            session.take(100_000)
            assert session.plant.left.steps + session.plant.right.steps == before
            assert where(session) == pytest.approx(SETTINGS.rest, abs=0.01)
            command(session, ":S0", "01")

    @pytest.mark.long
    def test_stays_slack(self, session):
        """While a string is wound the other one is never too short for the way between."""
        session.send("$H\n")
        stages = 0
        while b"ok" not in session.texts and session.engine.clock < 9_000_000:
            session.run(2000)
            plant = session.plant
            stages |= plant.limits
            assert sum(each.length - each.switch for each in (plant.left, plant.right)) >= (
                SETTINGS.wall_width / STEP - 3)
        assert stages == 3 and b"ok" in session.texts

    def test_stop_keeps_the_place(self, session):
        home(session)
        session.send("G1X50Y40F6000\n")
        session.run(600_000)
        session.engine.set(stop=1)
        session.run(100)
        before = session.plant.left.steps + session.plant.right.steps
        session.run(100_000)
        assert session.plant.left.steps + session.plant.right.steps == before
        session.engine.set(stop=0)
        goes_on(session)

    @pytest.mark.long
    def test_no_stop_locks_it(self, session):
        """Wherever a stop comes, with a step of a string that is not made yet or not."""
        home(session)
        rng = random.Random(3)
        for number in range(25):
            to = (10, 50) if number % 2 else (50, 12)
            session.send(f"G1X{to[0]}Y{to[1]}F6000\n")
            session.run(rng.randint(150_000, 900_000))
            session.engine.set(stop=1)
            session.run(rng.randint(1, 2000))
            session.engine.set(stop=0)
            goes_on(session)

    @pytest.mark.parametrize("clocks", [
        2, *(pytest.param(clocks, marks=pytest.mark.long) for clocks in (0, 1, 3))])
    def test_a_hold_as_it_begins_keeps_the_place(self, session, clocks):
        home(session)
        assert session.ask("G0X20Y40", "ok") == b"ok\r\n"
        session.rest(4_000_000)
        session.send("$H\n")
        session.run(clocks)
        session.engine.set(hold=1)
        session.run(500)
        session.engine.set(hold=0)
        goes_on(session)

    @pytest.mark.parametrize("on", ["M3", pytest.param("G0Z-1", marks=pytest.mark.long)])
    def test_the_pen_is_off_where_it_may_not_draw(self, session, on):
        home(session)
        assert session.ask(on, "ok") == b"ok\r\n"
        session.run(100_000)
        session.rest(2_000_000)
        assert session.engine.get("pen") == 1
        session.path.clear()
        session.send(":I00100020\n")
        session.run(20_000)
        assert session.engine.get("pen") == 0
        session.take(4_000_000, b"yyyy\r\n")
        session.engine.set(stop=1)
        session.run(100)
        assert session.engine.get("pen") == 0
        session.engine.set(stop=0)
        assert session.ask("\x18$X", "ok").endswith(b"ok\r\n")
        session.send(":H\n")
        session.run(100_000)
        assert session.engine.get("pen") == 0

    @pytest.mark.parametrize("on", ["M3", "G0Z-1"])
    def test_the_pen_is_off_behind_an_open_door_and_on_again_before_it_goes_on(self, session, on):
        ms = SETTINGS.clock // 1000
        home(session)
        assert session.ask(on, "ok") == b"ok\r\n"
        session.run(100_000)
        session.rest(2_000_000)
        session.send("\x84G1X40F600\n")
        session.run(40_000)
        assert session.engine.get("pen", "moving") == (0, 1)
        session.send("~")
        session.run(400 * ms)
        stands = where(session)
        assert session.engine.get("pen") == 1
        session.run(20 * ms)
        assert where(session) == stands
        session.run(200 * ms)
        assert where(session) != stands

    def test_a_stop_takes_the_pen_off_while_it_draws(self, session):
        home(session)
        session.send(":I00200020\n")
        session.take(4_000_000, b"yyyy\r\n")
        command(session, ":F00500050", "Drawing.")
        session.run(300_000)
        assert session.engine.get("pen") == 1
        session.engine.set(stop=1)
        session.run(100)
        assert session.engine.get("pen") == 0

    def test_lines_wait_for_the_end_of_a_command(self, session):
        home(session)
        session.send(":I00200020\n")
        session.take(4_000_000, b"yyyy\r\n")
        session.send(":F00300020\n$J=G91Y10F6000\n")
        said = session.take(6_000_000, b"ok\r\n")
        assert said.index(b"Line drawn.") < said.index(b"ok\r\n")
        assert from_chord(session.path[0], (20, 20), (30, 20)) < 0.1 + STEP

    def test_the_origin_is_restored(self, session):
        home(session)
        for line in ("G10L2P1X0Y0Z0", "$RST=#"):
            assert session.ask(line, "ok").endswith(b"ok\r\n")
        report = b""
        while b"WCO:" not in report:
            report = session.ask("?", ">", 20_000)
        assert b"WCO:-60.000,-50.000,-20.000" in report


class TestSettings:
    @pytest.mark.parametrize(("changes", "says"), [
        ({"wall_width": 5}, "wall_width in mm must be"), ({"least_y": 60}, "least_y in mm must be"),
        ({"rest": (30, 5)}, "y of the place of rest"), ({"rest": (61, 30)}, "x of the place"),
        ({"string_steps": Fraction(4000)}, "with 4000 half steps a mm .* 16 mm wide and high"),
        ({"string_steps": Fraction(0)}, "with 0 half steps a mm .* 0 mm wide and high"),
        ({"string_rate": 10**6}, "string_rate .by max_rate of X and Y .* must be"),
        ({"others": ((20, Fraction(0)),)}, r"\$20 follows from the wall"),
        ({"others": ((100, Fraction(9)),)}, r"\$100 follows from the wall")])
    def test_refused(self, changes, says):
        with pytest.raises(ValueError, match=says):
            VPlotterSettings(**{"wall_width": 60, "wall_height": 60, "least_y": 10,
                                "rest": (30, 30), **changes})

    def test_of_the_thesis(self):
        settings = VPlotterSettings()
        assert settings.steps_per_mm[0] == Fraction("203.718")
        assert settings.ticks(1768) == 360_173
        assert settings.line_baud == 9600

    def test_the_largest_wall(self):
        assert VPlotterSettings(wall_width=2573, wall_height=2573).ticks(2573) < 1 << 19
        with pytest.raises(ValueError, match="2573 mm wide and high at most, not 2574"):
            VPlotterSettings(wall_height=2574)
        assert "A wall may be 2573 mm wide and\nhigh at most" in (
            ROOT / "docs" / "vplotter.md").read_text(encoding="utf-8")


@compiled
@pytest.mark.long
def test_letters_of_the_build_have_none_of_coolant():
    assert SETTINGS.options == "V+"


def test_a_place_of_rest_at_edges_is_within_the_limits():
    settings = replace(SETTINGS, rest=(0, 60))
    with started(component("vplotter", VPlotter(settings=settings)), settings) as session:
        for line in ("G1X10F6000", "G1Y10F6000"):
            assert session.ask("$H", "ok", 12_000_000) == b"ok\r\n"
            assert session.ask(line, "ok") == b"ok\r\n"
            session.rest(2_000_000)
            assert b"ALARM" not in session.texts


@compiled
@pytest.mark.long
def test_a_program_of_its_own_and_commands():
    """Its lines are not answered, those of the line and commands are."""
    settings = replace(SETTINGS, program=b"G91G21\nM3\nG1X1F6000\nM5\n")
    with CXXRTLEngine(component("vplotter", VPlotter(settings=settings))) as engine:
        session = WallSession(engine, settings, place=settings.rest)
        session.take(20_000, GREETING)
        assert session.ask("$X", "ok").endswith(b"ok\r\n")
        command(session, ":S0", "00")
        engine.set(start=1)
        session.run(2000)
        engine.set(start=0)
        session.run(400_000)
        session.rest()
        assert session.take(20_000) == b"" and session.path[0][-1][0] > 30.9
        for text, answer in ((":S0", "01"), ("G4P0", "ok"), (":S1", "01"), ("$X", "ok")):
            command(session, text, answer)


@compiled
@pytest.mark.long
def test_a_program_of_its_own_breaks_a_line():
    """One that had begun is refused, its rest is dropped, and what comes then is obeyed."""
    with programmed(b"G91G21\nG1X1F6000\n") as session:
        session.send("G1X5")
        session.run(8000)
        press(session)
        session.run(400_000)
        session.rest()
        assert session.take(20_000) == b"error:11\r\n"
        apart(session, (31, 30))
        session.send("F100\n")
        assert session.take(20_000) == b""
        for text, answer in ((":S0", "01"), ("$X", "ok"), (":P1", "Motors powered."),
                             (":S1", "01"), ("$X", "ok")):
            command(session, text, answer)


@compiled
@pytest.mark.long
@pytest.mark.parametrize(("text", "said"), [
    (":P0", "Motors released: the place is unknown."),
    (":I00250025", "Going to the start point.")])
def test_a_program_of_its_own_does_not_run_within_a_command(text, said):
    """Wherever within; its line waits until the end of the command before is said."""
    with programmed(b"G1X1F0\n") as session:
        assert session.ask("$H", "ok", 8_000_000) == b"ok\r\n"
        for wait in (-600, 0, 300, 2000, 5000, 6000, 7000, 8000, 20_000):
            session.send(":I00300030\n")
            session.take(1_000_000, b"At the")
            line = f"{text}\n"
            early = min(wait, 0) // 160 or len(line)
            session.send(line[:early])
            session.run(max(wait, 0))
            press(session)
            session.send(line[early:])
            came = session.take(1_000_000, f"{said}\r\n".encode())
            assert came.count(b"error") == (wait < 0) and b"Refused" not in came, (wait, came)
            assert said.encode() in came, (wait, came)
            session.rest(2_000_000)
            session.take(60_000)
            if text == ":P0":
                command(session, ":P1", "Motors powered.")
                assert session.ask("$H", "ok", 8_000_000).endswith(b"ok\r\n")


@compiled
@pytest.mark.long
def test_a_command_does_not_begin_while_a_program_of_its_own_runs():
    with programmed(b"G91G21\n" + 200 * b"M5\n" + b"G1X1F6000\n") as session:
        press(session)
        for text in (":P0", ":H", ":I00250025"):
            command(session, text, "Busy: wait until it stands.")
        session.run(800_000)
        session.rest()
        apart(session, (31, 30))
        assert not session.texts


def press(session: WallSession) -> None:
    """Press START."""
    session.engine.set(start=1)
    session.run(2000)
    session.engine.set(start=0)


@contextmanager
def programmed(program: bytes) -> Iterator[WallSession]:
    """Give a session with a machine that has a program, unlocked."""
    settings = replace(SETTINGS, program=program)
    with CXXRTLEngine(component("vplotter", VPlotter(settings=settings))) as engine:
        session = WallSession(engine, settings, place=settings.rest)
        session.take(20_000, GREETING)
        assert session.ask("$X", "ok").endswith(b"ok\r\n")
        yield session
