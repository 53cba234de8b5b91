# amaranth: UnusedElaboratable=no

"""`gcode` from the bytes of its line to the steps at its pins."""

import math
import random
import re
from dataclasses import replace
from fractions import Fraction
from functools import cache
from math import hypot

import numpy as np
import pytest

from fresa.machines.gcode import GCode, GCodeSettings
from tb.boards import component
from tb.design import Design
from tb.engines import Changes, CXXRTLEngine, Engine
from tb.machines.gcode import SHORT
from tb.models.gcode_language import Interpreter, RefusedLine, words
from tb.models.protocol import bits
from tb.uart import Decoder

pytestmark = pytest.mark.compiler

GREETING = "Grbl 1.1h ['$' for help]"
HELP = "[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? ctrl-x]"
CHECK_LIMITS = "[MSG:Check Limits]"
LOCKED, UNLOCKED = "[MSG:'$H'|'$X' to unlock]", "[MSG:Caution: Unlocked]"
STEPS = 80
SETTINGS = GCodeSettings(
    clock=2_500_000, baud=125_000, steps_per_mm=(Fraction(STEPS), Fraction(40), Fraction(250)),
    max_rate=(Fraction(6000),) * 3, acceleration=(Fraction(1000),) * 3)
SECOND = SETTINGS.clock
MS = SECOND // 1000


class Session:
    """A terminal, and what the motors have made of the steps."""

    settings = SETTINGS
    steps_per_mm = SETTINGS.steps_per_mm
    greeting = GREETING

    def __init__(self, engine: Engine) -> None:
        self.engine = engine
        self.bit = self.settings.bit
        self.decoder = Decoder(self.bit)
        self.waiting = [1] * 10  # levels of the line, a bit each
        self.text = ""
        self.position = [0, 0, 0]
        self.path: list[tuple[int, tuple[int, ...]]] = []
        self.high = 0
        self.on: set[int] = set()  # spindle and flood, if they ever were
        self.run(20_000)
        assert self.read() == [self.greeting]

    def run(self, clocks: int) -> None:
        """Let time pass, on the line as well."""
        end = self.engine.clock + clocks
        while self.engine.clock < end:
            level, span = 1, end - self.engine.clock
            if self.waiting:
                level, alike = self.waiting[0], 1
                while alike * self.bit < span and self.waiting[alike:alike + 1] == [level]:
                    alike += 1
                self.waiting, span = self.waiting[alike:], alike * self.bit
            self.engine.set(rx=level)
            seen = self.engine.run(span, (
                "step", "direction", "tx", "spindle", "flood"))
            self.on |= set(np.flatnonzero([seen["spindle"].any(), seen["flood"].any()]).tolist())
            for clock, step, direction, tx in zip(
                    seen.clock.tolist(), seen["step"].tolist(), seen["direction"].tolist(),
                    seen["tx"].tolist(), strict=True):
                self.text += self.decoder.feed(clock, tx).decode()
                rises, self.high = step & ~self.high, step
                for axis in range(3):
                    if rises >> axis & 1:
                        self.position[axis] += 1 if direction >> axis & 1 else -1
                if rises:
                    self.path.append((clock, tuple(self.position)))
        self.text += self.decoder.feed(self.engine.clock, self.engine.get("tx")).decode()

    def read(self) -> list[str]:
        """Return the lines that have come."""
        *lines, self.text = self.text.split("\r\n")
        return lines

    def send(self, text: str, *, wait: bool = True, read: bool = True) -> list[str]:
        """Send text, wait until nothing moves, and return the lines that came."""
        self.waiting += [level for byte in text.encode("latin-1") for level in bits(byte)]
        self.run(self.bit * len(self.waiting))
        self.run(12_000)
        while wait and self.engine.get("moving"):
            self.run(10_000)
        self.run(5_000)
        return self.read() if read else []

    def state(self) -> tuple[str, list[float]]:
        """Request a report; return the state, and the position in mm."""
        (report,) = self.send("?", wait=False)
        found = re.match(r"<(\w+(?::\d)?)\|MPos:([-\d.]+),([-\d.]+),([-\d.]+)\|", report)
        assert found, report
        return found[1], [float(each) for each in found.groups()[1:]]

    def axes(self) -> list[float]:
        """Return where the axes are, in steps."""
        return [*self.position]

    def at(self, *millimetres: float) -> bool:
        """Return whether the axes are at a place."""
        return self.axes() == [
            round(each * float(steps))
            for each, steps in zip(millimetres, self.steps_per_mm, strict=True)]


@cache
def elaborated_once() -> Design:
    """Return the machine of all tests: to convert it takes seconds."""
    return component("gcode", GCode(settings=SETTINGS))


def steps(target) -> list[int]:
    """Return a position in steps, to the nearest, of two the higher."""
    return [(2 * at * round(per_mm * 1000) + 10**9) // (2 * 10**9)
            for at, per_mm in zip(target, SETTINGS.steps_per_mm, strict=True)]


def program(rng: random.Random, count: int) -> list[str]:
    """Return lines and arcs, right and wrong ones."""
    lines = []
    for _ in range(count):
        x, y, z = (f"{axis}{rng.uniform(-2, 2):.3f}" for axis in "XYZ")
        arc = rng.choice(["G2", "G3"])
        radius = rng.uniform(0.2, 2)
        lines.append(rng.choice([
            f"G1{x}{y}F{rng.randint(500, 9000)}", f"G0{x}{z}", f"G1{x}{y}{z}", f"G1{x}{y}",
            f"G91{arc}X0Y0I{radius:.3f}F4000 G90", f"G91G17{arc}X{radius:.3f}Y0R{radius:.3f}",
            f"G91 G18 {arc} X{radius:.3f} Z{radius / 2:.3f} R{radius:.3f}", "G90 G17",
            f"G91G17{arc}X{2 * radius:.3f}Y0I{radius:.3f}Z0.1", f"{arc}{x}{y}I1", "G21 G94",
            f"G20 X{rng.uniform(-0.05, 0.05):.4f} G21", f"G93 G1 {x} F{rng.randint(300, 3000)}",
            f"G92 {x}", "G92.1", f"G10 L2 P1 {y}", "X1 X2", "M8", "M3 S100", "G4 P0.002", "M5"]))
    return [*lines, "G94 G90 G21", "G53 G0 X0 Y0 Z0"]


def language() -> Interpreter:
    """Return the model of the language, with the steps of this machine."""
    return Interpreter(steps_per_metre=[int(each * 1000) for each in SETTINGS.steps_per_mm])


def answered(model: Interpreter, line: str) -> str:
    """Run a line on the model, and return its answer."""
    try:
        model.line(words(line))
    except RefusedLine as refused:
        return f"error:{refused.args[0]}"
    return "ok"


@pytest.mark.parametrize("seed", [
    0, *(pytest.param(seed, marks=pytest.mark.long) for seed in (1, 2))])
def test_programs_end_where_the_language_says_and_each_line_is_answered(session, seed):
    model = language()
    for line in program(random.Random(seed), 40):
        try:
            actions = model.line(words(line))
            expected = "ok"
        except RefusedLine as refused:
            actions, expected = [], f"error:{refused.args[0]}"
        assert session.send(line + "\n") == [expected], line
        assert session.position == steps(model.position), (line, actions)


@pytest.mark.parametrize("seed", [
    0, *(pytest.param(seed, marks=pytest.mark.long) for seed in (1, 2))])
def test_programs_that_are_sent_at_once_end_there_too(session, seed):
    """Lines and arcs in one motion, each line sent when there is room for it."""
    model, expected = language(), []
    for line in program(random.Random(100 + seed), 60):
        expected.append(answered(model, line))
        session.send(line + "\n", wait=False, read=False)
    session.run(200_000)
    assert session.send("") == expected
    assert session.position == steps(model.position) == [0, 0, 0]


def test_a_program_that_is_sent_at_once_is_looked_ahead(session):
    """Of 30 short lines in one direction none is slow but those at the ends."""
    lines = ["G1F3000", *(f"X{n / 10:.3f}Y0.000" for n in range(1, 31))]
    assert session.send("".join(f"{line}\n" for line in lines)) == ["ok"] * 31
    assert session.at(3, 0, 0)
    times = [clock for clock, _ in session.path]
    gaps = [b - a for a, b in zip(times, times[1:], strict=False)]
    # 50 mm/s are reached after 1.25 mm.
    assert max(gaps[110:130]) <= 1.05 * SETTINGS.clock / 50 / STEPS + 40


def test_an_arc_stays_on_its_circle(session):
    assert session.send("G1X2F5000\nG3X2Y0I-2J0Z0.4\n") == ["ok", "ok"]
    assert session.at(2, 0, 0.4)
    begin = next(n for n, (_, at) in enumerate(session.path) if at == (160, 0, 0))
    off = [abs(hypot(x / STEPS, y / 40) - 2) for _, (x, y, _) in session.path[begin:]]
    assert max(off) < 1 / 40


@pytest.mark.parametrize("line", ["G1X4Y1F6000", "G2X0Y0I1.5J1F6000"])
def test_a_hold_goes_on_exactly(session, line):
    session.send(line + "\n", wait=False)
    session.run(20_000)
    session.send("!", wait=False)
    session.run(400_000)
    stands = list(session.position)
    state, _ = session.state()
    assert state == "Hold:0"
    session.run(200_000)
    assert session.position == stands
    assert stands not in ([0, 0, 0], [320, 40, 0])
    session.send("~")
    assert session.position == ([320, 40, 0] if "G1" in line else [0, 0, 0])
    assert session.state()[0] == "Idle"


def test_a_motion_has_its_acceleration_however_long_it_is(design):
    """The 80th step, which comes at 79.5, after x / v + v / 2 a; 16 m/s² to 100 mm/s."""
    ramps = []
    for millimetres in 2, 50, 300, 5000:
        with CXXRTLEngine(design) as engine:
            session = Session(engine)
            session.send("$120=16000\n")
            session.send(f"G91 G1 X{millimetres} F6000\n", wait=False)
            session.run(60_000)
            ramps.append([clock for clock, _ in session.path[:STEPS]])
            assert not engine.get("fault")
    for each in ramps:
        seconds = (each[-1] - each[0]) / SETTINGS.clock
        first = (2 * 0.5 / STEPS / 16_000) ** 0.5
        assert seconds == pytest.approx(79.5 / STEPS / 100 + 100 / 16_000 / 2 - first, rel=0.003)


def test_a_reset_brakes_and_knows_the_place(session):
    session.send("G1X4Y-1F6000\nG1X0\n", wait=False)
    session.run(60_000)
    assert session.send("\x18") == [GREETING]
    state, place = session.state()
    assert state == "Idle"
    assert 0 < session.position[0] < 320
    assert place[:2] == [pytest.approx(at / float(steps), abs=5.1e-4) for at, steps in zip(
        session.position[:2], SETTINGS.steps_per_mm[:2], strict=True)]
    assert session.send("G0X0Y0Z0\n") == ["ok"]
    assert session.at(0, 0, 0)


@pytest.mark.parametrize(("pin", "alarm"), [("limits", 1), ("stop", 10), ("motor_fault", 17)])
def test_switches_stop_at_once(session, pin, alarm):
    session.send("G1X4F6000\n", wait=False)
    session.run(100_000)
    session.engine.set(**{pin: 1})
    session.run(100)
    stands = list(session.position)
    session.run(100_000)
    assert abs(session.position[0] - stands[0]) <= 1
    assert f"ALARM:{alarm}" in session.read()
    assert session.engine.get("alarm") == 1
    session.engine.set(**{pin: 0})
    assert session.send("G0X0\n$X\n", wait=False) == ["error:9", "error:8"]
    assert session.engine.get("alarm") == 1  # a reset is wanted first
    session.send("\x18", wait=False)
    assert session.send("G0X0\n$X\nG0X0\n") == ["error:9", UNLOCKED, "ok", "ok"]
    assert session.at(0, 0, 0)


@pytest.mark.long
@pytest.mark.parametrize(("contact", "kinematics", "strict"), [
    ("limits", "cartesian", 0), ("stop", "cartesian", 0), ("motor_fault", "cartesian", 0),
    ("abort", "cartesian", 1), ("stop", "corexy", 0)])
def test_a_stop_and_a_reset_in_any_clock(contact, kinematics, strict):
    """A contact is on around the time of a step, and a reset comes at any time between two.

    In the clock after it is on, the alarm shows. From three clocks after it no step begins until
    one is ordered, though the profile is not at rest when the reset comes.
    """
    settings = replace(SHORT, max_rate=(Fraction(12_000),) * 3, kinematics=kinematics,
                       others=((200, Fraction(strict)),))
    period = settings.clock * 60 // (12_000 * STEPS)
    found = []
    with CXXRTLEngine(component("gcode", GCode(settings=settings))) as engine:
        decoder, text, stepped = Decoder(settings.bit), "", False

        def run(clocks: int, **until: int) -> Changes:
            nonlocal text, stepped
            seen = engine.run(clocks, ("step", "alarm", "tx"), until=until)
            for clock, tx in zip(seen.clock.tolist(), seen["tx"].tolist(), strict=True):
                text += decoder.feed(clock, tx).decode()
            stepped |= bool(seen["step"].any())
            return seen

        def send(line: bytes) -> None:
            for level in (level for byte in line for level in bits(byte)):
                engine.set(rx=level)
                run(settings.bit)

        engine.set(rx=1)
        run(10_000)
        for number in range((period + 2) * (1 if kinematics == "cartesian" else 3)):
            way = 100 * (-1)**number
            send(b"G91G1X%dF%d\n" % (way, 12_000 - number) if kinematics == "cartesian" else
                 b"G91G1X%dY%dF%d\n" % (way, way, 16_970 - number))
            run(60_000)
            run(2 * period, step=0)
            run(2 * period, step=1)
            after = period + 4 - number % (2 * settings.filter)
            before = run(after)
            engine.set(**{contact: 1})
            seen = run(1_000)
            on = int(seen.clock[np.flatnonzero(seen["alarm"])[0]]) - 1
            step = np.concatenate([before["step"], seen["step"]]).astype(int)
            rises = np.concatenate([before.clock, seen.clock])[np.diff(step, prepend=0) > 0]
            found.append(int(max((*rises, on - period)) - on))
            engine.set(**{contact: 0})
            text, stepped = "", False
            run((number - after) % (period + 2))
            send(b"\x18$X\n")
            run(25_000)
            assert not stepped and f"{UNLOCKED}\r\nok" in text, number
        assert not engine.get("fault")
    assert 0 <= max(found) <= 3
    assert len({*found}) > (8 if strict else settings.filter // 2)
    assert sum(at > -9 for at in found) > 5


def test_power_stays_until_the_pulses_of_all_motors_have_ended(session):
    session.send("G1X4F6000\n", wait=False)
    session.engine.run(100_000, until={"step": 1})  # Y and Z rest
    session.engine.set(rst=1)
    session.engine.run(100, ("step",), until={"step": 0})
    assert session.engine.get("step", "enable") == (0, 1)
    session.engine.run(100)
    assert session.engine.get("enable") == 0


def test_a_door_holds_until_it_is_closed(session):
    session.send("G1X4F6000\n", wait=False)
    session.run(100_000)
    session.engine.set(door=1, probe=1)
    session.run(400_000)
    assert session.read() == ["[MSG:Check Door]"]
    session.send("?", wait=False, read=False)
    session.run(20_000)
    (report,) = session.read()
    assert report.startswith("<Door:1|")
    assert "|Pn:PD" in report
    stands = list(session.position)
    session.send("~", wait=False)
    session.run(100_000)
    assert session.position == stands
    session.engine.set(door=0, probe=0)
    session.run(100)
    assert session.state()[0] == "Door:0"
    session.send("~")
    assert session.at(4, 0, 0)


def test_contacts_that_open_have_a_filter_that_is_set(session):
    """A broken wire stops, once $202 says that the contact is closed at rest."""
    session.send("$6=1\n$201=200\n$202=7\n", wait=False, read=False)
    session.run(40_000)
    assert session.read()[:3] == ["ok", "ok", "ALARM:10"]
    assert session.engine.get("alarm") == 1  # all of them are open
    session.engine.set(stop=1, door=1, motor_fault=1, probe=1)
    session.run(100)
    session.send("\x18$X\n", wait=False)
    assert session.state()[0] == "Idle"
    session.engine.set(stop=0)
    session.run(500)  # 200 us
    assert session.engine.get("alarm") == 0
    session.run(260)
    assert session.engine.get("alarm") == 1


def test_a_pause_waits_for_a_start_and_a_dwell_takes_its_time(session):
    session.send("G0X1\nM0\nG0X2\n", wait=False)
    session.run(800_000)
    assert session.at(1, 0, 0)
    assert session.state()[0] == "Hold:0"
    session.send("~")
    assert session.at(2, 0, 0)
    session.path.clear()
    session.send("G4P0.25\nG0X2.0125\n")
    sent = session.engine.clock
    assert session.at(2.0125, 0, 0)
    assert sent - session.path[0][0] < 0.3 * SETTINGS.clock


def test_outputs_change_in_motion_without_a_stop(session):
    session.send("G1X1F3000\nM3S1000\nX2\nM8\nX3\nM5M9\n")
    assert session.on == {0, 1}
    times = [clock for clock, _ in session.path]
    gaps = [b - a for a, b in zip(times, times[1:], strict=False)]
    assert max(gaps[60:180]) < 3 * SETTINGS.clock / 50 / STEPS
    assert session.engine.get("spindle", "flood") == (0, 0)


@pytest.mark.parametrize("seed", [0, pytest.param(1, marks=pytest.mark.long)])
def test_every_line_of_rubbish_is_answered_once(session, seed):
    rng = random.Random(seed)
    for _ in range(40):
        line = "".join(chr(rng.choice([*b"GMXYZFSIJKR0123456789.-+ ()$;", rng.randrange(32, 127)]))
                       for _ in range(rng.randint(1, 60)))
        line = line.translate({ord(each): "_" for each in "!?~"})
        # A pause or an end would wait.
        if re.search("M *0*[0126]|M *30", line, re.I):
            continue
        answers = session.send(line + "\n")
        assert len(answers) == 1, (line, answers)
        assert re.fullmatch(r"ok|error:\d+", answers[0])


class Switches(Session):
    """A session with limit switches at places of the axes, in mm from power-up."""

    def __init__(self, engine: Engine, places: tuple[float, float, float]) -> None:
        self.places = [round(at * float(steps)) for at, steps in zip(
            places, self.steps_per_mm, strict=True)]
        super().__init__(engine)

    def run(self, clocks: int) -> None:
        """Let time pass, and the axes meet their switches."""
        end = self.engine.clock + clocks
        while self.engine.clock < end:
            super().run(min(2500, end - self.engine.clock))
            self.engine.set(limits=sum(
                (at >= place if place > 0 else at <= place) << axis
                for axis, (at, place) in enumerate(zip(self.axes(), self.places, strict=True))))


HOMED = ["$22=1", "$23=2", "$24=1500", "$25=3000", "$27=0.4", "$130=20", "$131=15", "$132=5"]


def _home(session: Session, line: str = "$H") -> None:
    """Send a line for homing, and wait until it is answered."""
    assert session.send(f"{line}\n", wait=False) == []
    while not (answers := session.send("", wait=False)):
        assert session.engine.clock < 40_000_000
    assert answers == ["ok"]


def test_homing_finds_the_place_and_soft_limits_keep_to_it(design):
    with CXXRTLEngine(design) as engine:
        session = Switches(engine, (3, -4, 1))
        session.send("G0X1\n")
        for line in HOMED:
            assert session.send(line + "\n") == ["ok"]
        _home(session)
        assert session.state() == ("Idle", [-0.4, -14.6, -0.4])
        # The switches are where they are said to be, but for what they were late.
        for axis, (home, place) in enumerate(zip((0, -15, 0), session.places, strict=True)):
            per_mm = float(SETTINGS.steps_per_mm[axis])
            off = session.position[axis] - place - [-0.4, 0.4, -0.4][axis] * per_mm
            assert abs(off) <= 0.05 * per_mm + 1, home
        session.position = [-32, -584, -100]  # from now on counted as the machine does
        session.places = [10**6] * 3
        assert session.send("G91X-1Y1Z-1\nG90\n") == ["ok", "ok"]
        assert session.at(-1.4, -13.6, -1.4)
        assert session.send("G53Z-0.4\n") == ["ok"]
        assert session.send("$20=1\nG53G0X-20Y-15\n") == ["ok", "ok"]
        assert session.position[:2] == [-1600, -600]
        assert session.send("G53G0X-20.001\n") == ["ALARM:2", "[MSG:Reset to continue]"]
        assert session.send("G53G0X-1\n") == ["error:9"]
        assert session.state()[0] == "Alarm"
        assert session.send("G0X-1\n$X\n") == ["error:9", "error:8"]
        assert session.send("\x18", wait=False) == [GREETING, LOCKED]
        assert session.send("$X\n$20=0\nG53G0X-20.1\n") == [UNLOCKED, "ok", "ok", "ok"]
        assert session.position[0] == -1608
        assert not engine.get("fault")


def _listed(session: Session, text: str) -> list[str]:
    """Return what comes after text while it is listed."""
    session.send(text, read=False)
    session.run(200_000)
    return session.read()


def test_lists_say_what_the_machine_has(session):
    assert session.send("G10L2P2X1Y-2.0005Z3\nG55G20G93T7M8\nM4S250.6\n") == ["ok"] * 3
    assert session.send("$G\n") == ["[GC:G0 G55 G17 G20 G90 G93 M4 M8 T7 F0 S251]", "ok"]
    listed = _listed(session, "$#\n")
    assert listed[:2] == ["[G54:0.000,0.000,0.000]", "[G55:1.000,-2.001,3.000]"]
    assert [line[1:4] for line in listed[:-1]] == [
        "G54", "G55", "G56", "G57", "G58", "G59", "G28", "G30", "G92", "TLO", "PRB"]
    assert _listed(session, "$I\n$N\n") == [
        "[VER:1.1h.20190830:]", "[OPT:VMH+,63,128]",
        "[MSG:Settings and coordinates last until power-off]", "ok",
        "$N0=", "$N1=", "ok"]
    assert session.send("$\n")[0] == HELP
    assert "|Bf:63,128|" in session.send("?", wait=False)[0]
    assert session.send("G1X2F1\n$G\n$#\n", wait=False)[1:] == [
        "[GC:G1 G55 G17 G20 G90 G93 M4 M8 T7 F1 S251]", "ok", "error:8"]
    assert not session.engine.get("fault")


@pytest.mark.parametrize(("options", "letters"), [
    ({}, "VMH+"), ({"dialect": "thesis"}, ""), ({"kinematics": "corexy"}, "VMCH+"),
    ({"dialect": "thesis", "kinematics": "corexy"}, "C"), ({"second_motor": "y"}, "VMH+2"),
    ({"kinematics": "corexy", "second_motor": "z"}, "VMCH+2"), ({"single_axes": False}, "VM+")])
def test_letters_of_the_build(options, letters):
    assert GCodeSettings(**options).options == letters


def test_nothing_moves_in_check_mode(session):
    assert session.send("G1X1F6000\n$C\n", wait=False) == ["ok", "error:8"]
    session.send("")
    session.on.clear()
    assert session.send("$C\n") == ["[MSG:Enabled]", "ok"]
    assert session.state() == ("Check", [1, 0, 0])
    before = list(session.position)
    assert session.send("G1X3Y3M3S100M8\nG2X5I1\nG2X9I99\nG4P0.01\nM0\n$X\n$H\nG99\nM30\n") == [
        "ok", "ok", "error:33", "ok", "ok", "ok", "error:8", "error:20", "ok"]
    assert session.position == before
    assert session.on == set()
    assert session.send("$C\n") == ["[MSG:Disabled]", "ok", GREETING]
    assert session.position == before
    assert session.state() == ("Idle", [1, 0, 0])
    assert session.send("G91G0X1\n") == ["ok"]
    assert session.at(2, 0, 0)


def test_asleep_the_motors_are_off_until_a_reset(session):
    session.send("M3S500\nG0X1\n")
    assert session.engine.get("enable", "spindle") == (1, 1)
    assert session.send("$SLP\n") == ["ok", "[MSG:Sleeping]"]
    assert session.engine.get("enable", "spindle") == (0, 0)
    assert session.state()[0] == "Sleep"
    assert session.send("G0X2\n") == ["error:9"]
    assert session.send("\x18") == [GREETING, LOCKED]
    assert session.send("$X\nG0X0\n") == [UNLOCKED, "ok", "ok"]
    assert session.at(0, 0, 0)


def test_what_was_changed_is_as_at_power_up(session):
    before = _listed(session, "$$\n"), _listed(session, "$#\n")
    changes = "$21=0\n$101=33\n$223=7\nG10L2P3X1\nG28.1\nG30.1\n"
    for which, comes_back in ("$", (True, False)), ("#", (False, True)), ("*", (True, True)):
        assert session.send(changes) == ["ok"] * 6
        assert session.send(f"$RST={which}\n") == [
            "[MSG:Restoring defaults]", "ok", GREETING]
        after = _listed(session, "$$\n"), _listed(session, "$#\n")
        assert (after[0] == before[0], after[1] == before[1]) == comes_back
    assert session.send("G91G0Y1\n") == ["ok"]
    assert session.at(0, 1, 0)
    assert session.send("$RST=1\n") == ["error:3"]


@pytest.mark.parametrize("clocks", [0, 2_000, 9_000, 20_011, 40_000])
def test_a_reset_ends_a_list(session, clocks):
    session.send("$#\n", wait=False, read=False)
    session.run(clocks)
    session.send("\x18", wait=False)
    lines = session.send("$X\n")
    session.read()
    assert session.send("G0X1\n$G\n") == ["ok", "[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]", "ok"]
    assert lines[-1] == "ok"


@pytest.mark.parametrize(("line", "answer"), [
    ("G2X0Y0I0J0F500", "error:33"), ("G2X1Y0I.5J-8600F500", "error:33"),
    ("G2X1Y0I.5J-8580F500", "ok"), ("G91G19G2X1Y0R1F500", "error:34"), ("G91G2X2Y0R-1F500", "ok"),
    ("G91G2X0J8589.934591F500", "ok"), ("G91G2X0J8589.934592F500", "error:33"),
    ("G91G19G2Y0J8388.607999F500", "ok"), ("G91G19G2Y0J8388.608F500", "error:33"),
    ("G0X34359", "ok"), ("G0X34360", "error:38"), ("G91G0X-34359", "error:33"),
    ("G1.004X1F10", "error:23"), ("M65539", "error:20"), ("S000000000001.5", "ok")])
def test_lines_that_are_answered_otherwise_than_by_grbl(session, line, answer):
    """As docs/gcode.md says, and the model; nothing moves in check mode."""
    assert session.send(f"$C\nG0X-1\n{line}\n") == ["[MSG:Enabled]", "ok", "ok", answer]
    model = language()
    model.line(words("G0X-1"))
    assert answered(model, line) == answer


@pytest.mark.parametrize(("line", "answer"), [
    ("$11=0", "error:4"), ("$27=0", "error:4"), ("$7=-1", "error:3"), ("$20=2", "error:38"),
    ("$10.5=1", "error:3"), ("$+10=3", "error:3"), ("$JG91X1", "error:3"),
    ("$J=X.1F0G0", "error:22"), ("$J=X.1F9G2", "error:16"), ("$N0=$G", "error:1"),
    ("$J=F5000", "ok")])
def test_system_lines_that_are_answered_otherwise_than_by_grbl(session, line, answer):
    """The last would go to 0 with GRBL."""
    session.send("G0X1\n")
    before = list(session.position)
    assert session.send(f"{line}\n") == [answer]
    assert session.position == before


def test_a_feed_beyond_the_fastest_is_listed_as_that(session):
    assert "F128849 " in session.send("F200000\n$G\n")[1]


def test_a_feed_that_does_not_hold_is_listed_as_0(session):
    """As GRBL has it: F of G93 is that of its line alone, and a change of the mode leaves none."""
    for line, feed in (("F500", "F500"), ("X0", "F500"), ("G93", "F0"), ("F7", "F7"), ("X0", "F0"),
                       ("F8", "F8"), ("G94", "F0"), ("G93F3", "F3"), ("G94F40", "F40"),
                       ("G0X0", "F40"), ("F0", "F0")):
        assert f" {feed} " in session.send(f"{line}\n$G\n", wait=False)[1], line
    session.send("F500\nG93\nG94\n")
    assert session.send("G1X1\n$G\n") == [
        "error:22", "[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]", "ok"]


def tools(session) -> tuple[int, int]:
    """Return whether the spindle turns, and the coolant flows."""
    return tuple(session.engine.get("spindle", "flood"))


def long_report(session) -> str:
    """Return a report that has more than usual in it."""
    session.send("?", wait=False, read=False)
    session.run(20_000)
    (line,) = session.read()
    return line


def test_an_open_door_turns_spindle_and_coolant_off_and_they_start_one_after_the_other(session):
    session.send("M3S500M8\n")
    session.send("G1X4F6000\n", wait=False)
    session.run(20_000)
    session.engine.set(door=1)
    session.run(400)
    assert tools(session) == (1, 1)
    session.run(400_000)
    assert tools(session) == (0, 0)
    session.read()
    told = long_report(session) + long_report(session)
    assert told.count("<Door:1|") == 2
    assert "|A:" not in told
    stands = list(session.position)
    session.engine.set(door=0)
    session.run(1000)
    session.send("~", wait=False)
    assert tools(session) == (1, 0)
    assert long_report(session).startswith("<Door:3|")
    session.run(1000 * MS)
    session.engine.set(door=1)
    session.run(10_000)
    assert tools(session) == (0, 0)
    assert session.read() == ["[MSG:Check Door]"]
    session.engine.set(door=0)
    session.run(1000)
    session.send("~", wait=False)
    session.run(4050 * MS)
    assert (tools(session), long_report(session)[:7]) == ((1, 0), "<Door:3")
    session.run(100 * MS)
    assert (tools(session), long_report(session)[:7]) == ((1, 1), "<Door:3")
    session.run(900 * MS)
    assert session.position == stands
    session.run(200 * MS)
    assert tools(session) == (1, 1)
    session.send("")
    assert session.at(4, 0, 0)


def open_door(session, before: str) -> None:
    """Send lines, then have the door open by its command, until both are off."""
    session.send(f"{before}\x84", wait=False)
    session.run(20_000)
    assert tools(session) == (0, 0)


def test_each_opening_of_the_door_is_said(session):
    assert session.send("\x84", wait=False) == ["[MSG:Check Door]"]
    assert session.send("\x84", wait=False) == ["[MSG:Check Door]"]
    session.engine.set(door=1)
    session.run(20_000)
    assert session.read() == ["[MSG:Check Door]"]
    session.engine.set(door=0)
    session.run(1000)
    assert session.send("~?", wait=False)[0].startswith("<Idle|")


def test_what_the_door_turned_off_stays_so_behind_a_reset_and_a_stop(session):
    session.send("M3S500M8\n")
    for cause in "\x18", "":
        open_door(session, "")
        session.on.clear()
        if not cause:
            session.engine.set(stop=1)
        session.send(cause, wait=False)
        session.run(100_000)
        session.engine.set(stop=0)
        session.send("\x18", wait=False)
        session.run(20_000)
        session.send("$X\n", wait=False)
        session.run(100_000)
        assert session.on == set()
        session.read()
        assert session.send("M3S500M8\n") == ["ok"]
        assert tools(session) == (1, 1)


@pytest.mark.parametrize(("tool", "resumes"), [("M3S500M8", False), ("$32=1\nM3S500M8", True)])
def test_an_alarm_of_a_probing_behind_the_door_turns_nothing_on(session, tool, resumes):
    """A probing that would not move waits until the door is closed, and all is on again."""
    session.send(f"{tool}\n\x84", wait=False)
    session.engine.set(probe=1)
    session.run(20_000)
    session.send("G38.2Z-1F100\n", wait=False, read=False)
    if resumes:
        session.send("~", wait=False, read=False)
    session.run(200_000)
    assert (session.engine.get("spindle"), session.engine.get("alarm")) == (0, 0)
    session.read()
    session.send("~", wait=False, read=False)
    session.run(5300 * MS)
    assert session.read()[0] == "ALARM:4"
    assert tools(session) == (1, 1)


def test_coolant_that_is_switched_by_hand_is_waited_for(session):
    open_door(session, "\xa0")
    session.send("~", wait=False)
    assert (tools(session), session.state()[0]) == ((0, 1), "Door:3")
    session.run(1030 * MS)
    assert session.state()[0] == "Idle"
    open_door(session, "M8\n\xa0")
    assert session.send("~?", wait=False)[-1].startswith("<Idle|")


@pytest.mark.parametrize("lines", ["G38.2X1F100\n", "$C\n"])
def test_a_door_is_not_looked_at_in_an_alarm_and_check_mode(session, lines):
    session.send("M3S500M8\n")
    session.engine.set(probe=1)
    session.run(1000)
    session.send(lines, wait=False)
    session.engine.set(door=1)
    session.run(20_000)
    assert "[MSG:Check Door]" not in session.read()
    assert tools(session) == (1, 1)


def test_coolant_is_switched_in_a_jog(session):
    session.send(JOG.format(4, 3000), wait=False)
    session.send("\xa0", wait=False)
    assert (session.state()[0], tools(session)) == ("Jog", (0, 1))


def test_a_laser_is_off_in_a_hold_and_turned_on_by_its_command(session):
    session.send("$32=1\nM3S500\n")
    session.send("G1X4F600\n", wait=False)
    session.run(20_000)
    assert session.engine.get("spindle") == 1
    session.send("!", wait=False)
    session.run(100_000)
    assert long_report(session).startswith("<Hold:0|")
    assert session.engine.get("spindle", "pwm") == (0, 0)
    for on in 1, 0:
        session.send("\x9e", wait=False)
        assert session.engine.get("spindle") == on
    session.send("~", wait=False)
    assert session.engine.get("spindle") == 1


def test_a_laser_does_not_burn_while_the_coolant_starts(session):
    open_door(session, "$32=1\nM3S500M8\n")
    session.send("~", wait=False)
    assert tools(session) == (0, 1)
    session.run(1000 * MS)
    assert tools(session) == (0, 1)
    session.run(50 * MS)
    assert tools(session) == (1, 1)


def test_homing_that_finds_no_switch_is_an_alarm(design):
    with CXXRTLEngine(design) as engine:
        session = Session(engine)
        session.send("$22=1\n$132=1\n$25=6000\n")
        assert _listed(session, "$H\n") == ["ALARM:9", GREETING, LOCKED]
        assert session.at(0, 0, 1.5)
        assert session.state()[0] == "Alarm"
        assert session.send("G0X1\n$X\nG0X1\n") == ["error:9", UNLOCKED, "ok", "ok"]


@pytest.mark.parametrize("door", [True, False])
def test_homing_that_is_ended_starts_anew_and_is_not_answered(design, door):
    with CXXRTLEngine(design) as engine:
        session = Session(engine)
        session.send("$22=1\n$132=5\n$25=600\n")
        session.send("$H\n", wait=False)
        if door:
            engine.set(door=1)
        assert _listed(session, "" if door else "\x18") == [
            "ALARM:7" if door else "ALARM:6", GREETING, LOCKED]
        if door:
            assert session.send("$X\n$H\n$HX\n") == ["error:13"] * 3
            engine.set(door=0)
        assert session.send("$X\nG91G0X1\n") == [UNLOCKED, "ok", "ok"]
        assert session.position[0] == STEPS


def test_one_axis_homes_where_the_others_stay(design):
    with CXXRTLEngine(design) as engine:
        session = Switches(engine, (3, -4, 1))
        assert session.send("$HX\n") == ["error:5"]
        session.send("G0Y1Z-1\n")
        for line in HOMED:
            session.send(line + "\n")
        assert session.send("$HA\n") == ["error:3"]
        session.send("$N0=G91\nG90\n")
        _home(session, "$HX")
        assert _listed(session, "") == []  # no startup line is run
        assert session.state() == ("Idle", [-0.4, 1, -1])
        assert session.position[1:] == [40, -250]
        assert " G90 " in session.send("$G\n")[0]
        _home(session, "$HY")
        assert session.state() == ("Idle", [-0.4, -14.6, -1])
        _home(session, "$HZ")
        assert session.state() == ("Idle", [-0.4, -14.6, -0.4])
        assert not engine.get("fault")


def test_the_end_of_a_program_is_said_and_answered_when_it_is_made(session):
    answers = session.send("G1X4F600\nM30\nG0X5\n", wait=False)
    assert answers == ["ok"]
    assert session.state()[0] == "Run"
    session.send("!", wait=False)
    session.run(200_000)
    assert session.read() == []
    assert _listed(session, "~") == ["[MSG:Pgm End]", "ok", "ok"]
    assert session.send("M2\nM2\n") == ["[MSG:Pgm End]", "ok"] * 2
    assert session.send("$C\nM30\n") == ["[MSG:Enabled]", "ok", "ok"]


def test_a_reset_before_the_end_of_a_program_drops_its_answer(session):
    session.send("G1X4F600\nM30\n", wait=False)
    assert session.send("\x18") == [GREETING]
    assert session.send("G90\nM2\n") == ["ok", "[MSG:Pgm End]", "ok"]


@pytest.mark.parametrize("line", [
    "G4P0.01", "M3S1", "M8", "G10L20P1X0", "G54G4P0", "G28.1", "G30.1", "G10L2P1X0", "G10L2P2X1",
    "G92.1", "G43.1Z1", "G49"])
def test_system_lines_wait_behind_what_grbl_waits_for(session, line):
    answers = _listed(session, f"G1X1F6000\n{line}\n$#\n$J=G91X.1F1000\n")
    assert answers[:2] == ["ok"] * 2 and answers[2].startswith("[G54:")
    assert answers[-2:] == ["ok"] * 2
    assert _listed(session, "G1X2\n$#\n")[1] == "error:8"  # a motion is not waited for
    assert session.send("$C\nG4P1\n$#\n$C\n")[1:4] == ["ok", "ok", "error:8"]


@pytest.mark.parametrize("line", ["G92.1G1X2", "G28.1G1X2", "G90G21G54", "G2X2Y0R.1"])
def test_system_lines_do_not_wait_behind_a_motion(session, line):
    """Whatever comes in its line before it, or behind it and does nothing."""
    answers = _listed(session, f"M3S1\nG1X1F6000\n{line}\n$#\n")
    assert answers[1:] == ["ok", "error:34" if "R" in line else "ok", "error:8"]


def test_system_lines_wait_behind_a_line_that_is_refused_as_before_it(session):
    answers = _listed(session, "G1X1F6000\nM3S1\nG2X2Y0R.1\n$#\n")
    assert answers[2] == "error:34" and answers[3].startswith("[G54:")


@pytest.mark.parametrize("cause", ["limits", "stop", "door", "soft"])
def test_a_program_s_end_that_does_not_come_is_not_answered(session, cause):
    if cause == "soft":
        session.send("$22=1\n$130=3\n$20=1\n$X\n")
    session.send("G1X-2F600\nM30\n" + "G1X-9\n" * (cause == "soft"), wait=False)
    if cause != "soft":
        session.engine.set(**{cause: 1})
    session.run(400_000 if cause != "soft" else 0)
    answers = session.read()
    session.engine.set(limits=0, stop=0, door=0)
    if cause == "door":
        assert answers == ["[MSG:Check Door]"]
        session.send("~", wait=False, read=False)
        session.run(SECOND)
        assert session.read() == ["[MSG:Pgm End]", "ok"]
    elif cause == "soft":  # the line that leaves the travel waits behind the end
        assert answers + _listed(session, "") == [
            "[MSG:Pgm End]", "ok", "ALARM:2", "[MSG:Reset to continue]"]
    else:
        assert answers[0] == f"ALARM:{10 if cause == 'stop' else 1}"
    if cause != "door":
        session.send("\x18$X\n", wait=False)
    assert session.send("M2\n") == ["[MSG:Pgm End]", "ok"]


def test_system_lines_wait_behind_a_pause(session):
    session.send("G1X1F6000\nM0\n$#\n", wait=False)
    session.run(400_000)
    assert session.state()[0] == "Hold:0"
    assert _listed(session, "~")[0].startswith("[G54:")


def test_a_line_without_words_leaves_the_feed_of_g93(session):
    assert session.send("G93\nG1X.1F2705\n\n(c)\n") == ["ok"] * 4
    assert " F2705 " in session.send("$G\n")[0]


def test_further_differences_from_grbl(session):
    """As docs/gcode.md says."""
    assert _listed(session, "G0X.001\n$#\n") == ["ok", "error:8"]
    assert session.send("G4P.1\n?", wait=False)[1].startswith("<Run|")
    session.send("")
    assert session.send("\x91$C\nM30\n") == ["[MSG:Enabled]", "ok", "ok"]
    session.engine.set(door=1)
    assert _listed(session, "$C\n") == [
        "[MSG:Disabled]", "[MSG:Check Door]", "ok", GREETING, "[MSG:Check Door]"]
    session.engine.set(door=0)
    session.send("~\x91", wait=False)
    session.send("$SLP\n")
    assert "|Ov:100,100,100" in "".join(_listed(session, "?")[0] for _ in range(2))
    session.engine.set(limits=1)
    session.run(12_000)
    assert _listed(session, "G0X1\n$\n$#\n\n") == [
        "error:9", HELP, "ok", "error:8", "ok"]
    session.engine.set(limits=0)


def test_a_report_comes_in_a_homing_cycle(session):
    session.send("$22=1\n$132=5\n$25=600\n")
    assert _listed(session, "$H\n?")[0].startswith("<Home|")


def test_limit_switches_are_looked_at_one_by_one(session):
    """One that is on when hard limits are wanted is no alarm, but another is."""
    session.send("$21=0\n")
    session.engine.set(limits=1)
    for line in "G0X1\n", "$21=1\n", "G0X2\n":
        assert session.send(line) == ["ok"]
    session.engine.set(limits=3)
    session.run(12_000)
    assert session.read() == ["ALARM:1", "[MSG:Reset to continue]"]
    session.engine.set(limits=0)
    session.run(1000)
    assert session.send("\x18") == [GREETING, LOCKED]


def test_a_door_that_opens_in_sleep_is_said(session):
    session.send("$SLP\n")
    assert session.send("\x84", wait=False) == ["[MSG:Check Door]"]
    session.engine.set(door=1)
    session.run(12_000)
    assert session.read() == ["[MSG:Check Door]"]
    assert session.state()[0] == "Sleep"


def test_a_spindle_that_was_stopped_by_hand_turns_again_and_that_is_said(session):
    session.send("M3S500\n!", wait=False)
    for said in [], ["[MSG:Restoring spindle]"], []:
        assert session.send("\x9e", wait=False) == said
    assert session.send("~", wait=False) == ["[MSG:Restoring spindle]"]
    assert session.engine.get("spindle") == 1
    session.send("M5\n!", wait=False)
    assert session.send("\x9e", wait=False) + session.send("~", wait=False) == []
    session.send("M3S500\n!\x9e", wait=False)  # a reset turns nothing on
    assert session.send("\x18", wait=False) == [GREETING]


def test_settings_are_listed_changed_and_kept(session):
    listed = _listed(session, "$$\n")
    assert listed[-1] == "ok"
    numbers = {line.partition("=")[0]: line.partition("=")[2] for line in listed[:-1]}
    assert (numbers["$100"], numbers["$101"], numbers["$22"]) == ("80.000", "40.000", "0")
    assert session.send("$100=160\n$110=99999999\n$110=90000\n$101=0\n$7=1\n$100=100000\n") == [
        "ok", "error:38", "ok", "error:4", "error:3", "error:12"]
    session.path.clear()
    assert session.send("G0X2\n") == ["ok"]
    assert session.position == [320, 0, 0]
    assert session.state() == ("Idle", [2, 0, 0])
    assert session.send("\x18") == [GREETING]
    assert _listed(session, "$$\n") == [
        {"$100=80.000": "$100=160.000", "$110=6000.000": "$110=90000.000"}.get(line, line)
        for line in listed]
    assert session.send("$100=80\n") == ["ok"]
    assert session.state()[1] == [4, 0, 0]  # the motors are where they were


@pytest.mark.parametrize("number", range(3))
def test_rates_and_accelerations_have_bounds(session, number):
    assert session.send(f"$10{number}=1\n") == ["ok"]
    for setting, most, beyond in ((f"$11{number}", "128849.018", "128849.019"),
                                  (f"$12{number}", "17179.869", "17179.870")):
        assert session.send(f"{setting}=0\n{setting}={beyond}\n") == ["error:4", "error:38"]
        assert session.send(f"{setting}={most}\n") == ["ok"]
        assert f"{setting}={most}" in _listed(session, "$$\n")


@pytest.mark.parametrize("rate", [45555, 128849.018])
@pytest.mark.parametrize(("line", "axes"), [
    ("G0X400", 1), ("G0X400Y400", 2), ("G0X400Y400Z-400", 3)])
def test_the_fastest_path_takes_its_time(session, line, rate, axes):
    """Below 2**31 nm/s along the path, and with the most acceleration of a path."""
    for text in (*(f"${number}{axis}={value}" for axis in range(3) for number, value in (
            (10, 1), (11, rate), (12, 17179.869))), "G91"):
        assert session.send(f"{text}\n") == ["ok"]
    session.path.clear()
    session.send(f"{line}\n")
    assert session.position == [400, 400 * (axes > 1), -400 * (axes > 2)]
    speed, acceleration = min(rate / 60, (2**31 - 1) / 1e6 / math.sqrt(axes)), (
        17179.869 / math.sqrt(axes))  # of an axis
    seconds = (session.path[-1][0] - session.path[0][0]) / SETTINGS.clock
    # From the first step to the last, each of which is half a step from where it rests
    wanted = speed / acceleration + 400 / speed - 2 * math.sqrt(1 / acceleration)
    assert seconds == pytest.approx(wanted, abs=2e-3)


@pytest.mark.parametrize(("line", "end"), [
    ("G1X0.00005F0.1", 7), ("G0X0.00004", 5), ("G2X0.00002I0.00001F1", 3),
    ("G3X0.000001I0.000001F0.001", 0), *(pytest.param(*slow, marks=pytest.mark.long) for slow in [
        ("G1Y-0.00001F0.001", 0), ("G1X0.00003Y0.0001Z-0.00002F99", 4), ("G93G1X0.00003F30", 4),
        ("G2X-0.000002Y0.00002Z0.00001I0.00001F0.001", 0)])])
def test_a_line_ends_however_slow_it_is(session, line, end):
    """With the least acceleration and the shortest steps that settings have."""
    assert session.send("$110=1\n$100=134217.727\n$120=0.001\n$121=0.001\n$122=0.001\n") == [
        "ok"] * 5
    assert session.send(f"{line}\n", wait=False) == ["ok"]
    for _ in range(100):
        session.run(500_000)
        if not session.engine.get("moving"):
            break
    state, place = session.state()
    assert (state, place[0]) == ("Idle", 0)
    assert session.position[0] == end


def test_steps_per_metre_may_be_odd(session):
    for text, place in (("26.667", 27), ("80.001", 80), ("79.999", 80)):
        assert session.send(f"G0X0Y0\n$100={text}\nG0X1Y1\n") == ["ok"] * 3
        assert session.position[:2] == [place, 40]
        assert session.send("G2X1Y1I0.5F4000\nG0X0Y0\n") == ["ok"] * 2
        assert session.position == [0, 0, 0]
        assert not session.engine.get("fault")


def test_the_spindle_stays_on_while_a_setting_is_changed(session):
    session.send("M3S1000M8\n")
    session.waiting += [level for byte in b"$27=2\n" for level in bits(byte)]
    for _ in range(200):
        session.run(100)
        assert session.engine.get("spindle", "flood") == (1, 1)
    assert session.read() == ["ok"]
    session.send("\x18")
    assert session.engine.get("spindle", "flood") == (0, 0)


def test_a_reset_in_a_list_of_settings_does_not_change_what_it_says(session):
    right = {line.split("=")[0]: line for line in _listed(session, "$$\n")}
    for wait in range(0, 60_000, 7_000):
        session.waiting += [level for byte in b"$$\n" for level in bits(byte)]
        session.run(800 + wait)
        session.waiting += [level for byte in b"\x18" for level in bits(byte)]
        session.run(60_000)
        for line in session.read():
            assert not line.startswith("$") or line == right[line.split("=")[0]]


def test_no_homing_cycle_is_begun_before_a_reset_that_is_due(session):
    session.send("$22=1\n")
    session.engine.set(stop=1)
    session.run(12_000)
    session.read()
    assert session.send("$H\n", wait=False) == ["error:8"]
    session.engine.set(stop=0)
    assert session.send("\x18")[0] == GREETING


def test_directions_and_switches_may_be_inverted(session):
    assert session.send("$3=1\nG0X1Y1\n") == ["ok", "ok"]
    assert session.position == [-80, 40, 0]
    session.engine.set(limits=0b111)
    session.run(12_000)
    assert session.read() == ["ALARM:1", "[MSG:Reset to continue]"]
    assert session.send("\x18$5=1\n") == [GREETING, CHECK_LIMITS, LOCKED, "ok"]
    assert session.send("$X\nG0X0\n") == [UNLOCKED, "ok", "ok"]
    assert session.position == [0, 40, 0]
    session.engine.set(limits=0b011)  # Z is on now
    session.run(12_000)
    assert session.read() == ["ALARM:1", "[MSG:Reset to continue]"]
    session.engine.set(limits=0b111)
    assert session.send("\x18$21=0\n$5=0\n")[2:] == ["ok", "ok"]
    assert session.send("$X\nG0X1\n") == [UNLOCKED, "ok", "ok"]


def test_motion_refuses_system_lines_that_have_to_wait(session):
    session.send("G1X4F600\n", wait=False)
    assert session.send("$$\n$100=1\n$H\n$X\n", wait=False) == ["error:8"] * 3 + ["ok"]
    session.send("\x18")


PROGRAM = b"G21G90\nG1X1F6000\nM0\nY1\nM30\nX3\n"


@pytest.fixture(scope="module")
def stored():
    return component("gcode", GCode(settings=replace(SETTINGS, program=PROGRAM)))


@pytest.mark.long  # each of these machines is compiled, for a minute
class TestStoredProgram:
    @pytest.fixture
    def machine(self, stored):
        with CXXRTLEngine(stored) as engine:
            yield Session(engine)
            assert not engine.get("fault")

    def press(self, machine, clocks: int = 200_000) -> None:
        machine.engine.set(start=1)
        machine.run(100)
        machine.engine.set(start=0)
        machine.run(clocks)

    def test_start_runs_it_to_its_end_in_silence(self, machine):
        for _ in range(2):
            self.press(machine)
            assert machine.at(1, machine.position[1] / 40, 0)
            assert machine.state()[0] == "Hold:0"
            self.press(machine)
            assert machine.at(1, 1, 0)  # the line behind M30 is not run
            assert machine.read() == ["[MSG:Pgm End]"]
        assert machine.send("X2\n") == ["ok"]
        assert machine.at(2, 1, 0)

    def test_lines_come_behind_it(self, machine):
        self.press(machine, 0)
        assert machine.send("G1Y2F6000\n", wait=False) == []
        machine.run(400_000)
        assert machine.at(1, 0, 0)
        self.press(machine, 500_000)
        assert machine.at(1, 2, 0)
        assert machine.read() == ["[MSG:Pgm End]", "ok"]

    def test_a_line_that_has_begun_does_not_keep_it_back(self, machine):
        machine.send("G1 X", wait=False)
        self.press(machine)
        self.press(machine)
        assert machine.at(1, 1, 0)
        assert machine.read() == ["error:11", "[MSG:Pgm End]"]
        assert machine.send("9\nG0X2\n") == ["ok"]  # the rest of that line
        assert machine.at(2, 1, 0)

    def test_it_ends_with_a_line_that_is_refused_and_with_a_reset(self, machine):
        assert machine.send("G93\n") == ["ok"]
        self.press(machine)
        assert machine.read() == ["error:22"]  # Y1, without a feed of its own
        self.press(machine)
        assert machine.at(1, 0, 0)
        assert machine.send("G94G0X0\n") == ["ok"]
        self.press(machine)
        assert machine.state()[0] == "Hold:0"
        machine.send("\x18", wait=False)
        assert machine.send("G0X2\n") == ["ok"]
        assert machine.at(2, 0, 0)

    def test_start_does_nothing_while_there_is_an_alarm(self, machine):
        machine.engine.set(stop=1)
        machine.run(1000)
        machine.engine.set(stop=0)
        machine.run(1000)
        self.press(machine)
        assert machine.at(0, 0, 0)


class Belts(Switches):
    """A machine whose first two motors move X and Y together: A = X + Y, B = X - Y."""

    steps_per_mm = (Fraction(STEPS), Fraction(STEPS), Fraction(250))

    def axes(self) -> list[float]:
        a, b, z = self.position
        return [(a + b) / 2, (a - b) / 2, z]


@pytest.fixture(scope="module")
def belts():
    return component("gcode", GCode(settings=replace(
        SETTINGS, kinematics="corexy", steps_per_mm=Belts.steps_per_mm)))


@pytest.mark.long
class TestCoreXY:
    @pytest.fixture
    def session(self, belts):
        with CXXRTLEngine(belts) as engine:
            session = Belts(engine, (3, -3, 1))
            yield session
            assert not engine.get("fault")

    def test_both_motors_move_each_axis(self, session):
        session.send("G0X1\n")
        assert session.position == [80, 80, 0]
        session.send("Y2\n")
        assert session.position == [240, -80, 0]
        session.send("G1X0Y0Z1F3000\n")
        assert session.position == [0, 0, 250]

    def test_paths_end_where_they_should_and_are_reported(self, session):
        rng = random.Random(1)
        for _ in range(12):
            x, y = (round(rng.uniform(-2, 2), 2) for _ in range(2))
            session.send(f"G1X{x}Y{y}F{rng.choice([600, 6000])}\n")
            assert session.at(x, y, 0)
        session.send("G0X0Y0\nG2I1F3000\n")
        assert session.at(0, 0, 0)
        session.send("X1.5Y-0.5\n")
        assert session.state() == ("Idle", [1.5, -0.5, 0.0])
        assert session.send("$101=10\n") == ["ok"]  # steps of X count for both
        session.send("X1Y1\n")
        assert session.at(1, 1, 0)

    def test_axes_find_their_switches_one_by_one(self, session):
        for line in ("$22=1", "$23=2", "$25=3000", "$24=1500", "$27=0.4", "$130=5", "$131=5",
                     "$132=2"):
            assert session.send(line + "\n") == ["ok"]
        session.send("$H\n", wait=False, read=False)
        while not (answers := session.read()):
            session.run(10_000)
            assert session.engine.clock < 20_000_000
        assert answers == ["ok"]
        assert session.state() == ("Idle", [-0.4, -4.6, -0.4])
        for at, place, per_mm, way in zip(session.axes(), session.places, session.steps_per_mm,
                                          (-0.4, 0.4, -0.4), strict=True):
            assert abs(at - place - way * per_mm) <= 0.05 * per_mm + 1


def share(session: Session, pin: str, clocks: int) -> float:
    """Return for which share of some clocks a pin is on."""
    level, at, on = session.engine.get(pin), session.engine.clock, 0
    seen = session.engine.run(clocks, (pin,))
    for clock, new in zip(seen.clock.tolist(), seen[pin].tolist(), strict=True):
        on, at, level = on + (clock - at) * level, clock, new
    return (on + (session.engine.clock - at) * level) / clocks


class TestSpindle:
    @pytest.mark.parametrize(("speed", "duty"), [(0, 0), (1, 1 / 256), (250, 0.25), (5000, 1)])
    def test_duty_follows_the_speed(self, session, speed, duty):
        session.send(f"M3S{speed}\n")
        session.run(5000)
        assert share(session, "pwm", 100_000) == pytest.approx(duty, abs=0.003)
        session.send("M5\n")
        session.run(5000)
        assert share(session, "pwm", 100_000) == 0

    def test_range_is_a_setting(self, session):
        session.send("$30=24000\n$31=4000\nM3S14000\n")
        session.run(5000)
        assert share(session, "pwm", 100_000) == pytest.approx(0.5, abs=0.003)

    def test_an_emergency_stop_ends_it_at_once(self, session):
        session.send("M3S1000\nG1X4F6000\n", wait=False)
        session.run(100_000)
        assert share(session, "pwm", 1000) == 1
        session.engine.set(stop=1)
        session.run(55)  # 15 us, for the filter, and some clocks
        assert not session.engine.get("spindle")
        assert share(session, "pwm", 100_000) == 0

    def test_pulses_of_a_servo(self, session):
        session.run(SECOND // 10)
        assert share(session, "servo", SECOND // 50) == pytest.approx(0.5 / 20, abs=1e-4)
        session.send("$211=1500\nM3S500\n")
        session.run(SECOND // 10)
        assert share(session, "servo", SECOND // 50) == pytest.approx(1.0 / 20, abs=1e-4)


class TestLaser:
    def test_power_follows_the_speed_with_m4(self, session):
        """A line of 1.2 s with ramps of 0.05 s: so much of its time is at full speed."""
        assert session.send("$32=1\nM4S1000\n") == ["ok", "ok"]
        assert share(session, "pwm", 100_000) == 0  # it stands
        session.send("G1X60F3000\n", wait=False)
        session.run(SECOND // 10)
        assert share(session, "pwm", 100_000) == pytest.approx(1, abs=0.003)
        session.send("!", wait=False)
        session.run(SECOND // 10)
        assert session.state()[0] == "Hold:0"
        assert share(session, "pwm", 100_000) == 0
        session.send("\x18", wait=False)
        session.run(SECOND // 10)
        assert not session.engine.get("spindle")

    def test_power_is_in_proportion_where_the_speed_is_not_reached(self, session):
        """The axis makes no more than 6000 mm/min of the 24000 that the program wants."""
        session.send("$32=1\nM4S1000\nG1X60F24000\n", wait=False)
        session.run(SECOND // 5)
        assert share(session, "pwm", 100_000) == pytest.approx(0.25, abs=0.003)
        session.send("\x18", wait=False)
        session.run(SECOND // 10)

    def test_g0_has_no_power_and_m3_has_a_constant_one(self, session):
        session.send("$32=1\nM3S500\nG1X1F6000\n")
        session.run(5000)
        assert share(session, "pwm", 100_000) == pytest.approx(0.5, abs=0.003)
        session.send("G0X40\n", wait=False)
        session.run(SECOND // 10)
        assert share(session, "pwm", 100_000) == 0
        session.send("\x18", wait=False)
        session.run(SECOND // 10)


JOG = "$J=G91X{}F{}\n"


def test_a_jog_is_no_part_of_the_program(session):
    assert session.send("G55G90G18\n$J=G91X1Y-1F3000\n", wait=False) == ["ok", "ok"]
    assert session.state()[0] == "Jog"
    assert session.send("G0X0\n$J=Y0F3000\n$#\n\n$G\n", wait=False) == [
        "error:9", "ok", "error:8", "ok", "[GC:G0 G55 G18 G21 G90 G94 M5 M9 T0 F0 S0]", "ok"]
    session.send("")
    assert session.at(1, 0, 0)
    assert session.state()[0] == "Idle"
    assert session.send("G1X0\n$J=X2F6000\nG1X0F600\n") == ["error:22", "ok", "error:9"]
    assert session.at(2, 0, 0)
    assert session.send("G1X0F600\n$J=G53X1F100\n", wait=False) == ["ok", "error:8"]
    session.send("")
    assert session.at(0, 0, 0)


@pytest.mark.parametrize(("jogs", "each", "byte"), [
    (1, 4, "\x85"), (3, 2, "!"), (80, 0.4, "\x85"),
    *(pytest.param(*many, marks=pytest.mark.long) for many in [
        (1, 4, "!"), (3, 2, "\x85"), (70, 0.4, "!"), (70, 0.4, "\x85"), (80, 0.4, "!")])])
def test_a_jog_is_cancelled_where_it_is(session, jogs, each, byte):
    """With more of them than the queue has room for, too: then one waits in the planner."""
    said = session.send(JOG.format(each, 3000) * jogs + "?", wait=False) + session.send(byte)
    (report,) = (line for line in said if line != "ok")
    assert report.startswith("<Jog|")
    while said.count("ok") < jogs or session.engine.get("moving"):  # what had no room goes on
        assert session.engine.clock < 40_000_000
        said += session.send("")
    state, place = session.state()
    assert state == "Idle"
    assert not session.engine.get("moving")
    assert 0 < session.position[0] < STEPS * each * jogs
    assert place[0] == pytest.approx(session.position[0] / STEPS, abs=5.1e-4)
    assert session.send(JOG.format(-0.1, 300)) == ["ok"]
    was = session.position[0]
    assert session.send("G91G1X1F600\nG90G0X0\n") == ["ok", "ok"]
    assert was and session.at(0, 0, 0)


@pytest.mark.parametrize("line", ["G1X1", "$N0=G1X1"])
def test_a_line_that_is_half_there_when_a_jog_is_cancelled_is_refused(session, line):
    assert session.send("G91\n") == ["ok"]
    said = session.send(JOG.format(4, 3000) + line, wait=False) + session.send("\x85")
    was = session.position[0]
    assert said + session.send("F600\n") == ["ok", "error:9"]
    assert session.position[0] == was
    assert session.send("$N\n")[0] == "$N0="
    assert session.send("G1X1F600\n") == ["ok"]
    assert session.position[0] == was + STEPS


def test_a_jog_does_not_leave_the_travel(design):
    with CXXRTLEngine(design) as engine:
        session = Switches(engine, (3, -4, 1))
        for line in HOMED:
            session.send(line + "\n")
        _home(session)
        session.places = [10**6] * 3
        assert session.send("$20=1\n$J=G91X1F100\n$J=G53X0.001F100\n$J=G53X0F3000\n") == [
            "ok", "error:15", "error:15", "ok"]
        assert session.state() == ("Idle", [0, -14.6, -0.4])
        assert session.send("G90G53G0X-1\n") == ["ok"]
        assert not engine.get("fault")


def test_a_door_that_opens_ends_a_jog_and_holds(session):
    session.send(JOG.format(4, 3000), wait=False)
    session.engine.set(door=1)
    session.run(MS)
    assert session.engine.get("moving")  # it brakes, and says so meanwhile
    session.run(4 * MS)
    assert session.read() == ["[MSG:Check Door]"]
    session.run(200_000)
    assert session.read() == []
    assert session.state()[0] == "Door:1"
    session.engine.set(door=0)
    session.run(1000)
    session.send("~", wait=False)
    assert session.state()[0] == "Idle"
    assert 0 < session.position[0] < 4 * STEPS
    assert session.send("G0X0\n") == ["ok"]
    assert session.at(0, 0, 0)


def report(session) -> str:
    (line,) = session.send("?", wait=False)
    return line


def ideal_clocks(length: float, speed: float) -> float:
    """Return the clocks from the first to the last step of a motion in mm, with a speed in mm/s."""
    acceleration, first = 1000, 0.5 / STEPS
    speed = min(speed, (acceleration * length)**0.5)
    seconds = length / speed + speed / acceleration - 2 * (2 * first / acceleration)**0.5
    return seconds * SETTINGS.clock


def clocks_of(session, line: str) -> int:
    """Return the clocks from the first to the last step of a line."""
    session.path.clear()
    assert session.send(line) == ["ok"]
    return session.path[-1][0] - session.path[0][0]


class TestOverrides:
    @pytest.mark.parametrize(("line", "commands", "length", "speed", "shown"), [
        ("G91 G1 X2 F1200\n", "\x91\x91\x91\x94", 2, 25.8, "129,100,100"),
        pytest.param("G91 G1 X2 F1200\n", "\x92" * 12, 2, 2, "10,100,100",
                     marks=pytest.mark.long),
        ("G91 G1 X2 F1200\n", "\x91" * 11 + "\x95\x96", 2, 40, "200,50,100"),
        ("G91 G1 X2 F1200\n", "\x91\x93\x90", 2, 20, "100,100,100"),
        ("G91 G0 X4\n", "\x96\x91", 4, 50, "110,50,100"),
        ("G91 G0 X4\n", "\x97\x92", 4, 25, "90,25,100"),
        ("G91 G1 X12 F5900\n", "\x91" * 10, 12, 100, "200,100,100")])
    def test_speeds_are_multiplied_and_shown(self, session, line, commands, length, speed, shown):
        session.send(commands, wait=False)
        assert f"|Ov:{shown}" in report(session) + report(session)
        assert clocks_of(session, line) == pytest.approx(ideal_clocks(length, speed), rel=0.01)

    def test_an_arc_has_the_feed_that_is_multiplied(self, session):
        session.send("\x92" * 5, wait=False)
        assert clocks_of(session, "G91 G2 X2 I1 F1200\n") == pytest.approx(
            ideal_clocks(math.pi, 10), rel=0.02)

    def test_what_moves_and_what_is_planned_obeys_at_once(self, session):
        session.send("G91 G1 X2 F600\nX2 F1200\n", wait=False)
        session.send("\x92" * 5, wait=False)
        session.run(150_000)
        assert "|FS:300," in report(session)
        session.send("\x91" * 9, wait=False)
        session.run(200_000)
        assert "|FS:840," in report(session)
        assert any("|FS:1680," in report(session) for _ in range(100))
        session.send("")
        assert session.at(4, 0, 0)

    def test_no_override_changes_a_jog_and_a_reset_and_the_end_restore_all(self, session):
        normal = clocks_of(session, "$J=G91X2F1200\n")
        session.send("\x92\x92\x97\x9b", wait=False)
        assert clocks_of(session, "$J=G91X2F1200\n") == pytest.approx(normal, abs=4)
        for ends, shown in ("\x18", "70,25,80"), ("M30\n", "90,25,90"):
            session.send("\x92\x97\x9b", wait=False)
            assert f"|Ov:{shown}" in report(session) + report(session)
            session.send(ends)
            assert "|Ov:100,100,100" in report(session) + report(session)

    def test_the_spindle_is_faster_and_stops_during_a_hold(self, session):
        session.send("$30=1000\nM3 S400\n")
        session.run(20_000)
        session.send("\x9a\x9a\x9a\x9c\x9d\x9b", wait=False)
        assert "|Ov:100,100,120|A:S>" in report(session) + report(session)
        session.run(20_000)
        assert share(session, "pwm", 100_000) == pytest.approx(0.48, abs=0.003)
        session.send("\x9e", wait=False)
        assert session.engine.get("spindle") == 1
        session.send("G91 G1 X2 F600\n", wait=False)
        session.send("!", wait=False)
        session.run(20_000)
        session.send("\x9e", wait=False)
        assert session.engine.get("spindle", "pwm") == (0, 0)
        told = report(session) + report(session)
        assert "|Ov:" in told
        assert "A:" not in told
        session.engine.set(door=1)
        session.run(20_000)
        session.read()
        assert "<Door" in report(session)
        assert session.engine.get("spindle", "pwm") == (0, 0)
        session.engine.set(door=0)
        session.send("~", wait=False)
        assert session.engine.get("spindle") == 1
        session.run(4100 * MS)
        session.send("!", wait=False)
        session.run(20_000)
        assert session.engine.get("spindle") == 1
        session.send("\x9e", wait=False)
        assert session.engine.get("spindle") == 0
        session.send("\x9e", wait=False)
        assert session.engine.get("spindle") == 1
        session.send("\x9e", wait=False)
        session.send("~")
        assert session.engine.get("spindle") == 1
        assert session.at(2, 0, 0)

    def test_coolant_is_switched_by_hand_until_the_program_switches_it(self, session):
        session.send("M8\n")
        assert session.engine.get("flood", "mist") == (1, 0)
        session.send("\xa0\xa1", wait=False)
        assert session.engine.get("flood", "mist") == (0, 1)
        assert "|A:M>" in report(session) + report(session)
        session.send("M9\n")
        assert session.engine.get("flood", "mist") == (0, 1)
        session.send("\xa1\xa0", wait=False)
        assert session.engine.get("flood", "mist") == (1, 0)
        session.send("M8\n")
        assert session.engine.get("flood", "mist") == (1, 0)


def test_behind_alarm_1_it_answers_and_overrides_are_100(session):
    """As docs/gcode.md says, where GRBL reads nothing before the reset."""
    session.send("\x91\x91", wait=False)
    session.engine.set(limits=1, probe=1)
    session.run(12_000)
    assert session.read() == ["ALARM:1", "[MSG:Reset to continue]"]
    reports = []
    for _ in range(12):  # of which not all have the overrides
        session.send("?", wait=False, read=False)
        session.run(20_000)
        reports += session.read()
    assert all(each.startswith("<Alarm|") and "|Pn:PX" in each for each in reports)
    assert {field for each in reports for field in each[1:-1].split("|") if field[:2] == "Ov"} == {
        "Ov:100,100,100"}
    assert session.send("$13=0\nG1X1F100\n$X\n$H\n$C\n$SLP\n$J=X1F100\n", wait=False) == [
        "ok", "error:9", *["error:8"] * 5]
    # A switch that is still on is none behind the reset, so that the machine can leave it.
    assert session.send("\x18") == [GREETING, CHECK_LIMITS, LOCKED]
    assert session.send("$X\nG0X1\n") == [UNLOCKED, "ok", "ok"]
    session.engine.set(limits=0, probe=0)


def test_a_feed_of_g93_and_the_end_of_a_program_in_one_line(session):
    assert " F300 " in session.send("G21G93F5M30\n$G\n")[2]


@pytest.mark.parametrize(("line", "answer"), [
    ("$100=--5", "error:3"), ("$J=G3F100X1Y1T0", "error:36"),
    ("$J=G2F100X1", "error:16")])
def test_lines_that_grbl_refuses_otherwise(session, line, answer):
    assert session.send(f"{line}\n") == [answer]
