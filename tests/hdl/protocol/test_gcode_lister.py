# amaranth: UnusedElaboratable=no

"""Lists of a G-code machine, as they are sent, against GRBL's documentation."""

import random

import pytest
from amaranth import Module, ResetInserter, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out, connect, flipped

from fresa.protocol import GCodeList, GCodeLister, GCodeModes, GCodeReporter, UnitConverter
from tb.boards import component
from tb.engines import choose
from tb.models.gcode_list import listed

WIDTH = 44
LINES = {"": GCodeList.HELP, "G": GCodeList.MODES, "#": GCodeList.COORDINATES,
         "I": GCodeList.BUILD, "N": GCodeList.STARTUP, "PRB": GCodeList.PROBED}
MOTIONS = 0, 1, 2, 3, 4, 8, 9, 10, 11
MODES = {"motion": 1, "plane": 3, "relative": 2, "inches": 2, "inverse": 2, "system": 6,
         "clockwise": 2, "counter_clockwise": 2, "mist": 2, "flood": 2}
"""How many there are of each."""


class Lines(wiring.Component):
    """The lister, with what divides its words, and the reporter that sends its parts."""

    def __init__(self) -> None:
        self.reporter = GCodeReporter(options="VC", blocks=31, receive=96, stores=False)
        lines = self.reporter.signature.members
        super().__init__({
            "start": In(1), "list": In(GCodeList), "modes": In(GCodeModes), "probed": In(1),
            "feed_zero": In(1), "inches": In(1), "address": Out(6), "word": In(signed(WIDTH)),
            "done": Out(1), "reset": In(1), "answers": lines["answers"], "request": In(1),
            "bytes": lines["bytes"]})

    def elaborate(self, platform) -> Module:
        m = Module()
        lister, divider = GCodeLister(), UnitConverter(width=WIDTH)
        m.submodules.lister = ResetInserter(self.reset)(lister)
        m.submodules.divider = ResetInserter(self.reset)(divider)
        m.submodules.reporter = reporter = self.reporter
        connect(m, lister.parts, reporter.listed)
        connect(m, flipped(self.answers), reporter.answers)
        connect(m, reporter.bytes, flipped(self.bytes))
        m.d.sync += divider.word.eq(self.word)  # the second clock
        m.d.comb += [
            lister.start.eq(self.start), lister.list.eq(self.list), lister.modes.eq(self.modes),
            lister.probed.eq(self.probed), lister.inches.eq(self.inches),
            lister.feed_zero.eq(self.feed_zero),
            reporter.inches.eq(self.inches),
            self.address.eq(lister.address), self.done.eq(lister.done),
            divider.divide.eq(lister.divide), divider.division.eq(lister.division),
            lister.divided.eq(divider.divided), lister.quotient.eq(divider.data),
            reporter.abandon.eq(self.reset), reporter.request.eq(self.request)]
        return m


class Host:
    """What surrounds them: the memory, and the line."""

    def __init__(self, engine, seed: object = 0) -> None:
        self.engine, self.rng = engine, random.Random(f"{seed}")
        self.modes, self.words, self.sent = dict.fromkeys(MODES, 0), [0] * 64, bytearray()
        self.probed = self.inches = self.feed_zero = False
        engine.set(rst=1, answers_valid=0, request=0, reset=0, start=0)
        engine.run(1)
        engine.set(rst=0)

    def run(self, clocks: int = 1, *, share: float = 1, **inputs: int) -> bool:
        """Run some clocks, with inputs, `start` and `reset` for one; return if `done` came."""
        done = False
        for _ in range(clocks):
            ready = int(self.rng.random() < share)
            self.engine.set(bytes_ready=ready, **inputs)
            valid, byte, address, through = self.engine.get(
                "bytes_valid", "bytes_payload", "address", "done")
            if valid and ready:
                self.sent.append(byte)
            done = done or bool(through)
            self.engine.run(1)
            self.engine.set(word=self.words[address] % (1 << WIDTH), start=0, reset=0)
            inputs = {}
        return done

    def begin(self, line: str) -> None:
        bits = GCodeModes.const(self.modes).as_bits()
        self.run(start=1, list=LINES[line].value, modes=bits, probed=self.probed,
                 inches=self.inches, feed_zero=self.feed_zero)

    def list(self, line: str, share: float = 1) -> bytes:
        """Have something listed; return all lines of it."""
        self.sent.clear()
        self.begin(line)
        for _ in range(20_000):
            if self.run(share=share):
                break
        self.run(2000)
        return bytes(self.sent)


@pytest.fixture(scope="module")
def engine():
    with choose()(component("lines", Lines())) as engine:
        yield engine


def test_modes_and_coordinates_as_they_are_at_power_up(engine):
    host = Host(engine)
    assert host.list("G") == b"[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]\r\n"
    assert host.list("#").startswith(b"[G54:0.000,0.000,0.000]\r\n[G55:0.000")
    assert host.list("I") == b"[VER:1.1h.20190830:]\r\n[OPT:VC,31,96]\r\n"


def test_where_the_probe_touched(engine):
    host = Host(engine)
    host.words[13:16] = 1_500, -2_000_499, 7
    assert host.list("PRB") == b"[PRB:0.002,-2.000,0.000:0]\r\n"
    host.probed = True
    assert host.list("PRB") == b"[PRB:0.002,-2.000,0.000:1]\r\n"
    assert host.list("#").endswith(b"\r\n[TLO:0.000]\r\n[PRB:0.002,-2.000,0.000:1]\r\n")
    assert host.list("#").count(b"\r\n") == 11


def test_inches(engine):
    host = Host(engine)
    host.inches = True
    host.words[16:19] = 25_400_000, -1269, -1270
    host.words[47] = 423_334  # 1.000001 inch/min
    host.words[48] = 500 * 10**6
    assert host.list("G").endswith(b" F1.0 S500]\r\n")
    assert host.list("#").startswith(b"[G54:1.0000,0.0000,-0.0001]\r\n[G55:0.0000,")
    host.modes["inverse"], host.words[47] = 1, 2_350_000  # 1/min
    assert host.list("G").endswith(b" F2.4 S500]\r\n")
    host.feed_zero = True
    assert host.list("G").endswith(b" F0.0 S500]\r\n")


def test_a_feed_that_does_not_hold_is_0(engine):
    host = Host(engine)
    host.words[47:50] = 8_333_333, 500 * 10**6, 3 * 10**6
    assert host.list("G").endswith(b" T3 F500 S500]\r\n")
    host.feed_zero = True
    assert host.list("G").endswith(b" T3 F0 S500]\r\n")


@pytest.mark.parametrize("motion", MOTIONS)
def test_each_motion_is_listed(engine, motion):
    host = Host(engine)
    host.modes["motion"] = motion
    said = {4: "80", 8: "38.2", 9: "38.3", 10: "38.4", 11: "38.5"}.get(motion, str(motion))
    assert host.list("G").startswith(f"[GC:G{said} G54 ".encode())


@pytest.mark.parametrize("seed", [
    0, *(pytest.param(seed, marks=pytest.mark.long) for seed in range(1, 4))])
def test_lists_are_those_of_the_model(engine, seed):
    rng = random.Random(seed)
    host = Host(engine, seed)
    for _ in range(3 if seed else 1):
        host.modes = {name: rng.randrange(count) for name, count in MODES.items()}
        host.modes["motion"], host.probed = rng.choice(MOTIONS), rng.random() < 0.5
        host.inches, host.feed_zero = rng.random() < 0.5, rng.random() < 0.3
        host.modes["counter_clockwise"] &= 1 - host.modes["clockwise"]
        host.words = [rng.choice([0, 500, 499, -500,
                                  rng.randint(-2**35, 2**35 - 1) >> rng.randrange(35)])
                      for _ in range(64)]
        host.words[47] = rng.randrange(1 << 31) >> rng.randrange(31)
        host.words[48] = rng.randrange(1 << 43) >> rng.randrange(43)
        host.words[49] = rng.randint(0, 255_000_000)
        for line in LINES:
            assert host.list(line, rng.choice([0.3, 1])) == listed(
                line, modes=host.modes, words=dict(enumerate(host.words)), options="VC,31,96",
                probed=host.probed, inches=host.inches, feed_zero=host.feed_zero)


@pytest.fixture(scope="module")
def whole(engine) -> bytes:
    return Host(engine).list("#")


@pytest.mark.parametrize("clocks", [
    *range(0, 60, 7), *range(60, 900, 123),
    *(pytest.param(clocks, marks=pytest.mark.long) for clocks in range(60, 900, 41)
      if (clocks - 60) % 123)])
def test_a_list_that_is_abandoned_ends_its_line(engine, whole, clocks):
    host = Host(engine, clocks)
    host.begin("#")
    host.run(clocks)
    host.run(reset=1)
    host.run(300, answers_valid=1, answers_payload=0)
    host.run(200, answers_valid=0)
    lines = bytes(host.sent).split(b"\r\n")
    *before, answer = (line for line in lines if line)
    first = lines.index(b"ok")
    assert answer == b"ok"
    assert b"" not in lines[:first]
    for said, line in zip(before, whole.split(b"\r\n"), strict=False):
        assert line.startswith(said) or said == b"ok"
    assert host.list("N").endswith(b"$N0=\r\n$N1=\r\n")


def test_nothing_comes_into_a_line_of_a_list(engine):
    host = Host(engine)
    host.begin("#")
    for _ in range(400):
        host.run(7, request=1, answers_valid=1, answers_payload=3)
    host.run(3000, request=0, answers_valid=0)
    lines = bytes(host.sent).split(b"\r\n")
    kinds = {line[:2] for line in lines}
    assert kinds == {b"[G", b"[T", b"[P", b"<I", b"er", b""}
    listing = b"".join(line + b"\r\n" for line in lines if line[:1] == b"[")
    assert listing == listed("#", modes=host.modes, words=dict.fromkeys(range(64), 0))
