# amaranth: UnusedElaboratable=no

"""The dialect of the wall: lines of G-code pass, commands are carried out or answered."""

import random
import re

import pytest

from fresa.protocol import HomingStage, LineEnd, WallDialect
from tb.boards import component
from tb.engines import AmaranthEngine

WIDTH, TOP, HEIGHT, FEED = 1768, 200, 1700, 3000
COMMANDS = "Commands: :P1 :P0 :H :Ixxxxyyyy :Fxxxxyyyy :S0 :S1 :S2"
SYNTAX = {"P": "Power of the motors: :P1 on, :P0 off", "H": "Home: :H",
          "I": "Start point, x and y in mm, four digits each: :Ixxxxyyyy",
          "F": "End point, x and y in mm, four digits each: :Fxxxxyyyy",
          "S": "State: :S0 of the master, :S1 and :S2 of the motors"}
OFF = f"Off the wall: x is 0000 to {WIDTH}, y is 0{TOP} to {HEIGHT}"
BUSY, UNKNOWN = "Busy: wait until it stands.", "The place is unknown. Home first: :H"
NO_START = "Give a start point first: :Ixxxxyyyy"
HOMING = ["Homing motor 1.", "Homing motor 2.", "Going to the place of rest."]
HOMED = "Homed. Give a start point: :Ixxxxyyyy"
POWERED, RELEASED = "Motors powered.", "Motors released: the place is unknown."
REFUSED = "Refused: ? tells the state. $X or :H ends an alarm, ~ a hold, :P1 a sleep"
DAMAGED, STOPPED = "That came damaged: send it again.", "Stopped before the end."
GO = ["Going to the start point.", "At the start point. Give the end point: :Fxxxxyyyy"]
DRAW = ["Drawing.", "Line drawn. Give a start point: :Ixxxxyyyy"]
TEXTS = {COMMANDS, *SYNTAX.values(), OFF, BUSY, UNKNOWN, NO_START, *HOMING, HOMED, POWERED,
         RELEASED, REFUSED, DAMAGED, STOPPED, *GO, *DRAW}


class Machine:
    """What is around it: a host, and what carries out lines of G-code."""

    def __init__(self, engine, seed: int = 0) -> None:
        self.engine, self.rng = engine, random.Random(seed)
        self.source: list[tuple[int, int]] = []  # items that are to come
        self.passed: list[tuple[bool, str, int]] = []  # own, line, end
        self.said: list[str] = []
        self.line, self.text = b"", b""
        self.timer, self.asked, self.own, self.refuses = 0, "", False, False
        self.moves = self.wakes = 0
        self.stages: list[HomingStage] = []
        self.pen: list[int] = []
        self.pins = {"homed": 0, "powered": 0, "sleeping": 0, "moving": 0, "stage": 0,
                     "emergency": 0}

    def send(self, text: str | bytes, end: LineEnd = LineEnd.GOOD) -> None:
        """Let a line come."""
        data = text.encode() if isinstance(text, str) else text
        self.source += [*((byte, 0) for byte in data), (end.value, 1)]

    def clock(self, *, renewed: bool = False) -> None:
        """Do a clock."""
        engine, pins = self.engine, dict(self.pins)
        offered = bool(self.source) and self.rng.random() < 0.8
        item = self.source[0] if offered else (0, 0)
        pins |= {"lines_valid": int(offered), "lines_payload": item[0] | item[1] << 8,
                 "items_ready": int(self.rng.random() < 0.7),
                 "bytes_ready": int(self.rng.random() < 0.9), "answered": 0, "refused": 0}
        if self.wakes:
            self.wakes -= 1
            renewed = renewed or not self.wakes
        if self.asked and not self.timer:
            pins |= {"answered": 1, "refused": int(self.refuses)}
        engine.set(**pins, renewed=int(renewed))
        ready, valid, given, own, speaks, byte, power, wake, pen = engine.get(
            "lines_ready", "items_valid", "items_payload", "own", "bytes_valid", "bytes_payload",
            "power", "wake", "pen")
        self.pen = [*self.pen[-1:], pen] if self.pen[-1:] != [pen] else self.pen
        if speaks and pins["bytes_ready"]:
            self.text += bytes([byte])
            if byte == 10:
                assert self.text.endswith(b"\r\n")
                self.said.append(self.text.decode().strip())
                self.text = b""
        if offered and ready:
            self.source.pop(0)
        if self.timer:
            self.timer -= 1
        elif self.asked:
            self.answer()
        if valid and pins["items_ready"]:
            assert not self.asked
            self.own = bool(own) if not self.line else self.own
            assert self.own == bool(own)
            if given >> 8:
                self.passed.append((bool(own), self.line.decode("latin1"), given & 255))
                self.asked, self.timer = self.line.decode("latin1") or "-", self.rng.randint(1, 40)
                if self.line == b"$H":
                    self.stages = [HomingStage.FIRST, HomingStage.SECOND, HomingStage.REST]
                    self.timer = 400 if not self.refuses else 5
                self.line = b""
            else:
                self.line += bytes([given & 255])
        if self.stages and not self.refuses and self.asked == "$H":
            self.pins["stage"] = self.stages[max(0, min(2, (399 - self.timer) // 130))].value
        if self.moves:
            self.moves -= 1
            self.pins["moving"] = int(self.moves > 0)
        if power:
            self.pins["powered"] = 1
        if wake:
            assert self.pins["sleeping"]
            self.wakes = self.rng.randint(2, 20)
        if renewed:
            self.pins |= {"sleeping": 0, "moving": 0, "stage": 0}
            self.asked, self.timer, self.line, self.moves, self.stages = "", 0, b"", 0, []
            while self.source and offered and ready and not item[1]:  # the rest of its line
                item = self.source.pop(0)
        engine.run(1)

    def answer(self) -> None:
        """Do what the line says that is answered in this clock."""
        if not self.refuses:
            if self.asked.startswith("$J"):
                self.moves = self.rng.randint(80, 200)
                self.pins["moving"] = 1
            elif self.asked == "$H":
                self.pins |= {"homed": 1, "stage": 0}
            elif self.asked == "$SLP":
                self.pins |= {"homed": 0, "powered": 0, "sleeping": 1}
        self.asked = ""

    def expect(self, *said: str, ordered: bool = True) -> None:
        """Wait until these lines are said, and that is all."""
        for _ in range(3000):
            if len(self.said) >= len(said) and not self.source and not self.moves:
                break
            self.clock()
        for _ in range(20):
            self.clock()
        assert (self.said if ordered else sorted(self.said)) == (
            [*said] if ordered else sorted(said))
        self.said.clear()


@pytest.fixture(scope="module")
def dialect():
    return component("wall_dialect", WallDialect(width=WIDTH, top=TOP, height=HEIGHT, feed=FEED))


@pytest.fixture
def machine(dialect):
    with AmaranthEngine(dialect) as engine:
        yield Machine(engine)


def home(machine: Machine) -> None:
    """Home it."""
    machine.send(":P1")
    machine.send(":H")
    machine.expect(POWERED, *HOMING, HOMED)


def test_a_line_is_drawn(machine):
    machine.send(":S0")
    machine.expect("00")
    machine.send("G1 X:2")
    home(machine)
    machine.send(":S0")
    machine.expect("05")
    machine.send(":i00100300")
    machine.expect(*GO)
    machine.send(":s0")
    machine.expect("15")
    assert machine.pen == [0]
    machine.send(":F17680200")
    machine.expect(*DRAW)
    assert machine.pen == [1, 0]
    machine.send("G2")
    machine.send(":F00000200")  # not from there: what is drawn has an end
    machine.expect(NO_START)
    assert machine.passed == [
        (False, "G1 X:2", 0), (True, "$H", 0), (True, f"$J=G21G90G53X-1758Y-100F{FEED}", 0),
        (True, f"$J=G21G90G53X0Y0F{FEED}", 0), (False, "G2", 0)]


@pytest.mark.parametrize(("line", "said"), [
    (":", COMMANDS), (":x", COMMANDS), (": ", COMMANDS), (b":\xc8", COMMANDS),
    (":P", SYNTAX["P"]), (":P2", SYNTAX["P"]), (":p11", SYNTAX["P"]), (":h0", SYNTAX["H"]),
    (":i0010030", SYNTAX["I"]), (":I001003000", SYNTAX["I"]), (":I0010O300", SYNTAX["I"]),
    (":I" + "0" * 40, SYNTAX["I"]), (":F 0100300", SYNTAX["F"]), (":s", SYNTAX["S"]),
    (":s3", SYNTAX["S"]), (":S00", SYNTAX["S"]), (b":H\xb0", SYNTAX["H"]),
    (":F00100300", UNKNOWN), (":I99999999", UNKNOWN)])
def test_what_is_wrong_is_answered(dialect, line, said):
    with AmaranthEngine(dialect) as engine:
        machine = Machine(engine)
        machine.send(line)
        machine.send("G0")
        machine.expect(said)
        assert machine.passed == [(False, "G0", 0)]


@pytest.mark.parametrize("end", [LineEnd.LONG, LineEnd.DAMAGED])
def test_a_damaged_command_does_nothing(machine, end):
    machine.send(":H", end)
    machine.send("G1", end)
    machine.send("", end)
    machine.expect(DAMAGED)
    assert machine.passed == [(False, "G1", end.value), (False, "", end.value)]


def test_it_stays_on_the_wall(machine):
    home(machine)
    for x, y, there in [(0, TOP, True), (WIDTH, HEIGHT, True), (WIDTH + 1, TOP, False),
                        (0, TOP - 1, False), (5, HEIGHT + 1, False), (9999, 9999, False)]:
        machine.send(f":I{x:04}{y:04}")
        machine.expect(*(GO if there else [OFF]))
    assert [line for _, line, _ in machine.passed[1:]] == [
        f"$J=G21G90G53X{-WIDTH}Y0F{FEED}", f"$J=G21G90G53X0Y{TOP - HEIGHT}F{FEED}"]


def test_while_it_moves_only_its_state_is_given(machine):
    home(machine)
    machine.send(":I00100300")
    machine.send(":F00200300")
    machine.send(":S0")
    machine.send("G4P0")
    machine.expect(BUSY, "0D", *GO, ordered=False)
    assert [line for _, line, _ in machine.passed[2:]] == ["G4P0"]
    machine.send(":F00200300")
    machine.send(":S1")
    machine.send(":H")
    machine.send(":S0")
    machine.expect(BUSY, "15", "2D", *DRAW, ordered=False)  # a motor learns its speed


def test_states_of_motors_while_they_home(machine):
    machine.send(":P1")
    machine.send(":H")
    seen = {}
    for _ in range(1200):
        machine.clock()
        if stage := machine.pins["stage"]:
            machine.clock()
            if machine.pins["stage"] == stage:
                seen[stage] = machine.engine.get("states_0", "states_1", "states_2")
    assert seen == {1: (0x03, 0x0B, 0x09), 2: (0x03, 0x0F, 0x0B), 3: (0x03, 0x0D, 0x0D)}


def test_sleep_and_power(machine):
    home(machine)
    machine.send(":P0")
    machine.expect(RELEASED)
    assert machine.pins["sleeping"] and not machine.engine.get("states_0") & 1
    machine.send(":P1")
    machine.expect(POWERED)
    assert machine.pins["powered"] and not machine.pins["sleeping"]
    machine.send(":I00100300")
    machine.expect(UNKNOWN)


def test_a_line_that_is_refused_begins_nothing(machine):
    machine.refuses = True
    machine.send(":H")
    machine.expect(REFUSED)
    machine.refuses = False
    home(machine)
    machine.send(":I00100300")
    machine.expect(*GO)
    machine.refuses = True
    machine.send(":F00200300")
    machine.expect(REFUSED)
    assert machine.pen == [0]
    machine.refuses = False
    machine.send(":S0")
    machine.send(":F00200300")  # it is still where it shall begin
    machine.expect("15", *DRAW)


def test_what_has_begun_goes_where_its_command_says(machine):
    """Another command that comes before its line is sent does not change that."""
    home(machine)
    for text in (":Z", ":I00200220", ":I00400450"):
        machine.send(text)
    machine.expect(COMMANDS, BUSY, *GO)
    for text in (":Z", ":F05000500", ":S0"):
        machine.send(text)
    machine.expect(COMMANDS, "2D", *DRAW)
    assert [line for _, line, _ in machine.passed[-2:]] == [
        f"$J=G21G90G53X{x - WIDTH}Y{TOP - y}F{FEED}" for x, y in ((20, 220), (500, 500))]


def test_states_are_given_while_a_line_waits_for_its_answer(machine):
    machine.send("$H")
    for _ in range(100):
        machine.clock()
    for text in (":S0", ":S2", ":Z", ":P1", ":I00100300", "G4P0"):
        machine.send(text)
    machine.expect("02", "08", COMMANDS, POWERED, *GO)
    assert [line for _, line, _ in machine.passed[-2:]] == [
        f"$J=G21G90G53X{10 - WIDTH}Y{TOP - 300}F{FEED}", "G4P0"]


def test_no_power_in_an_emergency_stop(machine):
    machine.pins["emergency"] = 1
    machine.send(":P1")
    machine.expect("Emergency stop, or a motor's fault: end that first.")
    assert not machine.pins["powered"]
    machine.pins["emergency"] = 0
    machine.send(":P1")
    machine.expect(POWERED)


def test_what_is_cancelled_is_said(machine):
    home(machine)
    machine.send(":I00100300")
    for _ in range(500):
        machine.clock()
        if machine.moves == 50:
            machine.engine.set(cancelled=1)
            machine.clock()
            machine.engine.set(cancelled=0)
    machine.expect(GO[0], STOPPED)
    machine.send(":F00200300")
    machine.expect(NO_START)


@pytest.mark.parametrize("after", range(1, 40, 3))
def test_a_reset_while_a_command_comes_or_its_line_goes(dialect, after):
    """In each state: then all goes on, and what had begun has an end."""
    with AmaranthEngine(dialect) as engine:
        machine = Machine(engine, after)
        machine.pins |= {"homed": 1, "powered": 1}
        machine.send(":I00100300")
        for _ in range(after * 4):
            machine.clock()
        machine.source.clear()
        machine.clock(renewed=True)
        for _ in range(150):
            machine.clock()
        assert engine.get("own", "pen", "fault") == (0, 0, 0)
        assert machine.said in ([], [STOPPED], [GO[0], STOPPED])
        machine.said.clear()
        passed = len(machine.passed)
        machine.send("G0")
        machine.send(":I00200400")
        machine.send("G1")
        machine.expect(*GO)
        assert machine.passed[passed:] == [
            (False, "G0", 0), (True, f"$J=G21G90G53X-1748Y-200F{FEED}", 0), (False, "G1", 0)]


def test_a_reset_in_the_clock_in_which_a_command_acts(dialect):
    """Its line would never be sent, and its answer never come."""
    acted = 0
    with AmaranthEngine(dialect) as engine:
        for clock in range(6):
            engine.set(rst=1)
            engine.run(1)
            engine.set(rst=0, homed=1, powered=1, items_ready=1, bytes_ready=1)
            for byte, end in [(ord(":"), 0), (ord("H"), 0), (0, 1)]:
                engine.set(lines_valid=1, lines_payload=byte | end << 8)
                engine.run(1)
            engine.set(lines_valid=0)
            engine.run(clock)
            engine.set(renewed=1)
            engine.run(1)
            engine.set(renewed=0)
            engine.run(60)
            assert engine.get("own", "fault") == (0, 0)
            acted += engine.get("items_valid")
    assert not acted


@pytest.mark.parametrize("seed", range(3))
def test_whatever_comes_lines_are_whole_and_in_order(dialect, seed):
    """Commands, lines and resets at random."""
    rng, sent = random.Random(seed), []
    with AmaranthEngine(dialect) as engine:
        machine = Machine(engine, seed)
        machine.pins["homed"] = 1
        for number in range(40):
            if rng.random() < 0.4:
                sent.append(f"G{number}")
                machine.send(sent[-1])
            else:
                machine.send(rng.choice([":S0", ":I00100300", ":F00200300", ":h", ":p1", ":p0",
                                         ":q", ":I9999", "::S1"]))
            machine.refuses = rng.random() < 0.1
            for _ in range(rng.choice([1, 10, 100])):
                machine.clock()
        for _ in range(1500):
            machine.clock()
        assert not machine.source and not engine.get("own") and not engine.get("fault")
    assert [line for own, line, _ in machine.passed if not own] == sent
    assert all(re.fullmatch(r"\$H|\$SLP|\$J=G21G90G53X-?\d+Y-?\d+F3000", line)
               for own, line, _ in machine.passed if own)
    assert all(text in TEXTS or re.fullmatch("[0-9A-F]{2}", text) for text in machine.said)


@pytest.mark.parametrize(("parameters", "message"), [
    ({"width": 0}, "width of the wall in mm must be a whole number from 1 to 9999, not 0"),
    ({"height": 10_000}, "height of the wall in mm must be a whole number from 1 to 9999, "
                         "not 10000"),
    ({"top": 101}, "least y in mm must be a whole number from 0 to 100, not 101"),
    ({"feed": 0}, "feed in mm/min must be a whole number from 1 to 1000000, not 0")])
def test_impossible(parameters, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        WallDialect(**{"width": 100, "top": 10, "height": 100, "feed": 1000, **parameters})
