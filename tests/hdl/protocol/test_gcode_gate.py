# amaranth: UnusedElaboratable=no

"""Which lines reach the interpreter, and with which error; system lines."""

import random
from collections.abc import Mapping
from decimal import ROUND_HALF_UP, Decimal
from typing import Any

import pytest
from amaranth import Cat, Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from fresa.protocol import (
    LISTED,
    SETTINGS,
    GCodeGate,
    GCodeKind,
    GCodeList,
    GCodeText,
    Operand,
    gcode_layout,
    setting_index,
)
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.models.gcode_line import read_lines

WIDTH = 44
LAYOUT = gcode_layout(WIDTH)
DEFAULTS = {each.number: each.default for each in SETTINGS}


class Ports(wiring.Component):
    """The gate, with its items in several ports, since engines have none of more than 64 bits."""

    def __init__(self) -> None:
        self.gate = gate = GCodeGate(width=WIDTH)
        self.others = {name: member for name, member in gate.signature.members.items()
                       if name not in {"words", "passed"}}
        super().__init__({
            **self.others, "item": In(17), "wide": In(WIDTH),
            "number": In(LAYOUT.size - 17 - WIDTH), "words_valid": In(1), "words_ready": Out(1),
            "out": Out(17), "passed_valid": Out(1), "passed_ready": In(1)})

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.gate = gate = self.gate
        wiring.connect(m, gate.listed, wiring.flipped(self.listed))
        for name, member in self.others.items():
            if member.is_port:
                outer, inner = getattr(self, name), getattr(gate, name)
                m.d.comb += inner.eq(outer) if member.flow == In else outer.eq(inner)
        m.d.comb += [
            gate.words.payload.eq(Cat(self.item, self.wide, self.number)),
            gate.words.valid.eq(self.words_valid), self.words_ready.eq(gate.words.ready),
            self.out.eq(gate.passed.payload), self.passed_valid.eq(gate.passed.valid),
            gate.passed.ready.eq(self.passed_ready)]
        return m


class Machine:
    """The gate, with a store, an interpreter and a planner around it."""

    def __init__(self, engine: AmaranthEngine, values: Mapping[int, int], *, seed: int = 0,
                 locked: bool = False, resting: bool = True, fastest: int = 1 << 27) -> None:
        self.engine, self.rng = engine, random.Random(seed)
        self.values = [values[each.number] for each in SETTINGS]
        self.read = 0  # the setting of which it is known what is known a clock later
        self.fastest = fastest  # highest value of $110 that is not refused
        self.letters = ""  # those of jogs small
        self.jogs = 0
        self.statuses: list[int] = []
        self.listed: list[tuple[int, int]] = []
        self.unlocks = self.homes = self.restored = 0
        self.axes: list[int] = []
        self.lists: list[str] = []
        self.erased: list[int] = []
        self.after: list[str] = []  # what begins with an answer
        self.listing = 0
        self.answer_in = self.busy = self.asked = self.rests_in = 0
        engine.set(locked=locked, resting=resting)

    def clock(self) -> bool:
        """Do what the parts around it do in a clock; return whether an item was taken."""
        engine = self.engine
        self.answer_in = max(0, self.answer_in - 1)
        self.busy = max(0, self.busy - 1)
        if self.rests_in:
            self.rests_in -= 1
            engine.set(resting=not self.rests_in)
        takes = self.rng.random() < 0.5 and not self.answer_in
        lists = self.rng.random() < 0.2
        engine.set(passed_ready=takes, listed_ready=lists, answered=self.answer_in == 1,
                   configured=0, homed=0, all_listed=self.listing == 1)
        self.listing = max(0, self.listing - 1)
        begins, which, erases, at, restores, restart, sleep = engine.get(
            "listing", "list", "erase", "erase_address", "restoring", "restart", "sleep")
        if begins:
            self.lists.append(GCodeList(which).name)
            self.listing = 15
        if erases:
            self.erased.append(at)
        self.restored += restores
        assert self.answer_in == 1 or not (restart or sleep)
        self.after += ["restart"] * restart + ["sleep"] * sleep
        trial, at, data = engine.get("trial", "write_address", "data")
        candidate = list(self.values)
        if trial:
            candidate[at] = data
        asked, self.asked = self.asked, engine.get("configure")  # the settings are read later
        if asked and self.asked and self.rng.random() < 0.3:
            engine.set(configured=1, refused=candidate[setting_index(110)] > self.fastest)
        if engine.get("home"):
            self.homes += 1
            self.axes.append(engine.get("homes"))
            self.busy = 20
        elif self.busy == 1:
            engine.set(homed=1)
        ready, address, valid, payload, unlock, listed_valid, listed, write = engine.get(
            "words_ready", "address", "passed_valid", "out", "unlock", "listed_valid",
            "listed_payload", "write")
        self.unlocks += unlock
        if valid and takes:
            out: Any = LAYOUT.from_bits(payload)
            if out.kind == GCodeKind.END:
                self.statuses.append(out.status.value)
                self.jogs += out.system
                self.answer_in = self.rng.randint(2, 12)
            else:
                letter = chr(out.character)
                self.letters += letter.lower() if out.system else letter
        if listed_valid and lists:
            line: Any = LISTED.from_bits(listed)
            decimal = SETTINGS[setting_index(line.code)].decimal
            assert line.text == (GCodeText.DECIMAL_SETTING if decimal
                                 else GCodeText.WHOLE_SETTING)
            assert line.ends
            self.listed.append((line.code, line.value))
        if write:
            self.values[at] = data
        engine.run(1)
        last = len(SETTINGS) - 1
        known, self.read = SETTINGS[self.read], min(at, last)
        engine.set(value=candidate[min(address, last)], number=known.number,
                   decimal=known.decimal, least=known.least, most=known.most,
                   initial=known.default)
        return bool(ready)

    def send(self, text: str) -> None:
        """Send lines, and wait for their ends."""
        for item in read_lines(text):
            number = dict(item.number)
            if number:  # undefined with overflow
                number["value"] = (number["value"] + (1 << 43)) % (1 << WIDTH) - (1 << 43)
            bits = LAYOUT.const({
                "kind": GCodeKind[item.kind].value, "status": item.status, "system": item.system,
                "character": ord(item.character) if item.character else 0,
                "number": number}).as_bits()
            self.engine.set(words_valid=1, item=bits % (1 << 17), number=bits >> 17 + WIDTH,
                            wide=bits >> 17 & (1 << WIDTH) - 1)
            while not self.clock():
                pass
            self.engine.set(words_valid=0)


    def wait(self) -> None:
        """Wait for the answer."""
        while self.answer_in:
            self.clock()
        self.clock()


@pytest.fixture(scope="module")
def gate():
    return component("gate", Ports())


@pytest.mark.parametrize(("locked", "text", "expected"), [
    (False, "G1X2\n", ("GX", [0], 0)), (True, "G1X2\n", ("GX", [9], 0)),
    (True, "\n", ("", [0], 0)), (False, "$X\n", ("", [0], 1)), (True, "$x\nG0\n", ("G", [0, 9], 1)),
    (False, "$Z\n", ("", [2], 0)), (False, "$H\n", ("", [5], 0)), (False, "$XX\n", ("", [3], 0)),
    (True, "$100=2.5\n", ("", [0], 0)), (False, "X 1 X\n", ("X", [2], 0)),
    (False, "G\n", ("", [2], 0)), (True, "G\n", ("", [9], 0)), (True, "1\n", ("", [9], 0)),
    (True, "$J=X1\nG1\n", ("xG", [8, 9], 0)), (False, "$J=X1 F2\nG1\n", ("xfG", [0, 0], 0)),
    (False, "$j=\n", ("", [0], 0)), (False, "$J=X\n", ("", [2], 0)),
    (False, "$J\n$J=1\n$JJ=X1\n$J5=X1\n", ("", [3, 1, 3, 3], 0))])
def test_lines(gate, locked, text, expected):
    with AmaranthEngine(gate) as engine:
        machine = Machine(engine, DEFAULTS, locked=locked)
        machine.send(text)
        assert (machine.letters, machine.statuses, machine.unlocks) == expected


def test_during_a_jog_there_may_be_another_and_no_other_line(gate):
    with AmaranthEngine(gate) as engine:
        machine = Machine(engine, DEFAULTS, resting=False)
        machine.send("$J=X1\nG0\n")
        engine.set(jogging=1)
        machine.send("$J=Y1\nG1\nG\n$$\n$G\n\n")
        assert (machine.letters, machine.statuses, machine.jogs) == (
            "xGyG", [8, 0, 0, 9, 9, 0, 0, 0], 2)


def test_there_is_no_homing_cycle_before_a_reset_that_is_due(gate):
    with AmaranthEngine(gate) as engine:
        engine.set(stopped=1)
        machine = Machine(engine, {**DEFAULTS, 22: 1})
        machine.send("$H\n$100=7\n$X\n")
        assert (machine.statuses, machine.homes, machine.unlocks) == ([8, 0, 8], 0, 0)


@pytest.mark.parametrize("text", ["$$", "$100=1", "$H", "$HX", "$5", "$=", "$Q", "$N5", "$#",
                                  "$I", "$N", "$C", "$SLP", "$RST=$", "$RST=#", "$RST=*"])
def test_what_has_to_wait_for_rest_is_refused(gate, text):
    with AmaranthEngine(gate) as engine:
        machine = Machine(engine, {**DEFAULTS, 22: 1}, resting=False)
        machine.send(text + "\n$X\nG0\n")
        assert machine.statuses == [8, 0, 0]
        assert (machine.homes, machine.listed, machine.lists, machine.after) == (0, [], [], [])
        assert not engine.get("checking")


def test_lists_begin_and_are_through_before_their_end(gate):
    with AmaranthEngine(gate) as engine:
        machine = Machine(engine, DEFAULTS)
        machine.send("$\n$G\n$#\n$I\n$n\n")
        assert machine.statuses == [0] * 5
        assert machine.lists == ["HELP", "MODES", "COORDINATES", "BUILD", "STARTUP"]
        engine.set(resting=0)
        machine.send("$\n$G\n$N\n")
        assert machine.statuses[5:] == [0, 0, 8]
        assert machine.lists[5:] == ["HELP", "MODES"]


def test_check_mode_begins_at_rest_and_ends_with_a_reset(gate):
    with AmaranthEngine(gate) as engine:
        machine = Machine(engine, DEFAULTS, locked=True)
        machine.send("$C\n")
        engine.set(locked=0)
        machine.send("$C\n")
        assert machine.statuses == [8, 0]
        assert engine.get("checking")
        engine.set(resting=0)
        machine.send("G1\n$$\n$H\n$C\n")
        assert machine.statuses[2:] == [0, 0, 8, 0]
        assert len(machine.listed) == len(SETTINGS)
        assert not engine.get("checking")
        assert machine.after == []
        machine.wait()
        assert machine.after == ["restart"]


def test_sleep_begins_with_the_answer(gate):
    with AmaranthEngine(gate) as engine:
        machine = Machine(engine, DEFAULTS)
        machine.send("$SLP\n")
        machine.wait()
        assert machine.after == ["sleep"]


@pytest.mark.parametrize("which", "$#*")
def test_what_was_changed_is_as_at_power_up(gate, which):
    with AmaranthEngine(gate) as engine:
        machine = Machine(engine, {**DEFAULTS, 21: 0, 101: 7, 223: 9})
        before = list(machine.values)
        machine.send(f"$RST={which}\n")
        machine.wait()
        assert machine.statuses == [0]
        assert (machine.restored, machine.after) == (1, ["restart"])
        assert machine.values == ([*DEFAULTS.values()] if which in "$*" else before)
        assert machine.erased == ([*range(Operand.SYSTEM, Operand.POSITION)]
                                  if which in "#*" else [])


def test_a_homing_cycle_is_answered_when_it_is_through(gate):
    with AmaranthEngine(gate) as engine:
        machine = Machine(engine, {**DEFAULTS, 22: 1})
        machine.send("$H\n")
        assert (machine.statuses, machine.homes, machine.busy) == ([0], 1, 0)


def test_all_settings_are_listed_behind_the_answer_of_the_line_before(gate):
    with AmaranthEngine(gate) as engine:
        machine = Machine(engine, {**DEFAULTS, 101: 1234})
        machine.send("G0\n$$\n")
        assert machine.statuses == [0, 0]
        assert machine.listed == [*{**DEFAULTS, 101: 1234}.items()]


def expected(number: str, value: str, values: dict[int, int], fastest: int) -> int:
    """Return how a line that sets a setting is answered, and set it."""
    known = {each.number: each for each in SETTINGS}
    of = known.get(int(number))
    if not of:
        return 3
    exact = Decimal(value).quantize(Decimal("1e-6"), ROUND_HALF_UP)
    if exact < 0:
        return 4
    if abs(exact) >= 1 << 23 or not of.decimal and exact != int(exact):
        return 38
    stored = int((exact * (1000 if of.decimal else 1)).to_integral_value(ROUND_HALF_UP))
    if stored > of.most:
        return 38
    if stored < of.least:
        return 4
    if of.number == 20 and stored and not values[22]:
        return 10
    if of.number == 110 and stored > fastest:
        return 12
    values[of.number] = stored
    if not values[22]:
        values[20] = 0
    return 0


@pytest.mark.parametrize("seed", [
    0, *(pytest.param(seed, marks=pytest.mark.long) for seed in range(1, 4))])
def test_settings_are_changed_or_refused(gate, seed):
    rng = random.Random(seed)
    values, statuses, text = dict(DEFAULTS), [], ""
    for _ in range(60):
        number = str(rng.choice([*DEFAULTS, 20, 22, 110, 0, 1, 256 + 100, 99999999]))
        value = rng.choice([
            f"{rng.uniform(0, 1000):.{rng.randint(0, 8)}f}", "0", "1", "0.0005", "0.00049", "7",
            "-1", "-0.5", "1e", "134217.7279", "200000", "99999999999", str(rng.randint(0, 9))])
        text += f"${number}={value}\n"
        statuses.append(3 if "e" in value else expected(number, value, values, 400_000))
    with AmaranthEngine(gate) as engine:
        machine = Machine(engine, DEFAULTS, seed=seed, fastest=400_000)
        machine.values[setting_index(110)] = values_110 = 300_000
        if values[110] == DEFAULTS[110]:
            values[110] = values_110
        machine.send(text)
        assert [*zip(text.splitlines(), machine.statuses, strict=True)] == [
            *zip(text.splitlines(), statuses, strict=True)]
        assert dict(zip(DEFAULTS, machine.values, strict=True)) == values


@pytest.mark.parametrize("text", ["$J", "$X1", "$$1", "$GX", "$C=", "$J5=1"])
def test_what_begins_as_what_may_come_at_any_time_is_none_at_any_time(gate, text):
    with AmaranthEngine(gate) as engine:
        machine = Machine(engine, DEFAULTS, resting=False)
        machine.send(text + "\n")
        assert machine.statuses == [3]


@pytest.mark.parametrize("text", ["$100=", "$=1", "$=", "$Q", "$Q100=1", "$100==1", "$100=X"])
def test_where_a_number_has_to_be(gate, text):
    with AmaranthEngine(gate) as engine:
        machine = Machine(engine, DEFAULTS)
        machine.send(text + "\n")
        assert machine.statuses == [2]
        assert machine.values == [*DEFAULTS.values()]


def test_settings_are_listed_while_it_jogs(gate):
    with AmaranthEngine(gate) as engine:
        engine.set(jogging=1)
        machine = Machine(engine, DEFAULTS, resting=False)
        machine.send("$$\n$#\n")
        assert (machine.statuses, len(machine.listed)) == ([0, 8], len(SETTINGS))


@pytest.mark.parametrize("line", ["$$", "$#", "$J=X1F1", "$G", "$X", "$100=1"])
def test_a_system_line_waits_where_grbl_does(gate, line):
    with AmaranthEngine(gate) as engine:
        engine.set(waiting=1)
        machine = Machine(engine, DEFAULTS, resting=False)
        machine.rests_in = 300
        machine.send(f"{line}\n")
        assert (machine.statuses, machine.rests_in) == ([0], 0)


@pytest.mark.parametrize("level", ["locked", "checking"])
def test_it_does_not_wait_where_it_would_not_end(gate, level):
    with AmaranthEngine(gate) as engine:
        machine = Machine(engine, DEFAULTS)
        if level == "checking":
            machine.send("$C\n")
        else:
            engine.set(locked=1)
        engine.set(waiting=1, resting=0)
        machine.send("$#\n")
        assert machine.statuses[-1] == 8


def test_homing_of_one_axis(gate):
    with AmaranthEngine(gate) as engine:
        machine = Machine(engine, {**DEFAULTS, 22: 1})
        machine.send("$HX\n$HY\n$hz\n$H\n$HA\n$HXY\n$H1\n")
        assert (machine.statuses, machine.axes) == ([0] * 4 + [3] * 3, [0, 1, 2, 3])
    with AmaranthEngine(gate) as engine:
        machine = Machine(engine, DEFAULTS)
        machine.send("$HX\n")
        assert machine.statuses == [5]


def test_with_the_door_open_nothing_homes_and_no_alarm_ends(gate):
    with AmaranthEngine(gate) as engine:
        engine.set(door=1)
        machine = Machine(engine, {**DEFAULTS, 22: 1}, locked=True)
        machine.send("$X\n$H\n$HY\n")
        assert (machine.statuses, machine.homes, machine.unlocks) == ([13] * 3, 0, 0)
        engine.set(locked=0)
        machine.send("$X\n$H\n")
        assert (machine.statuses[3:], machine.homes, machine.unlocks) == ([0, 13], 0, 1)


@pytest.mark.parametrize(("text", "status"), [
    # Where a number has to be, and is not
    *((text, 2) for text in ("$100=", "$=1", "$=", "$Q", "$Q100=1", "$100==1", "$100=X")),
    *((text, 3) for text in (
        "$100", "$RST", "$RST=", "$RST=$$", "$SL", "$N5", "$I1", "$SLPP", "$RST=1", "$RST=$1",
        "$GX", "$XRST=$", "$RST=$RST=$", "$100=1X", "$X100=1", "$1X=1", "$-100=1", "$100.0=1",
        "$$1", "$100=1-60", "$100=--50", "$100=1.5.70", "$100=+-60", "$100=.-60"))])
def test_what_only_looks_like_a_setting_is_refused(gate, text, status):
    with AmaranthEngine(gate) as engine:
        machine = Machine(engine, DEFAULTS)
        machine.send(text + "\n")
        assert machine.statuses == [status]
        assert machine.values == [*DEFAULTS.values()]
