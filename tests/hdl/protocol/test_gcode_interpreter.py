# amaranth: UnusedElaboratable=no

"""The interpreter of G-code: each line does what its model does, whoever waits for whom."""

import random
import re

import pytest
from amaranth import Cat, Const, Module, Value, signed
from amaranth.lib import data, wiring
from amaranth.lib.wiring import In, Out

from fresa.protocol import (
    GCodeAction,
    GCodeActionKind,
    GCodeInterpreter,
    GCodeModes,
    Operand,
)
from fresa.protocol.gcode_reader import GCodeKind, GCodeStatus, gcode_layout
from tb.boards import component
from tb.engines import AmaranthEngine, CXXRTLEngine, Engine
from tb.models.gcode_language import (
    Action,
    Arc,
    Coolant,
    Dwell,
    End,
    Interpreter,
    Jog,
    Line,
    Offsets,
    Pause,
    Probe,
    RefusedLine,
    Spindle,
    Vector,
    Word,
    centre_by_radius,
    check_radii,
)

WIDTH = 44
LAYOUT = gcode_layout(WIDTH)
POSITION = data.StructLayout({"axis": 3, "value": signed(WIDTH)})
PLACES = (0, 1, 2, 4, 5, 6)
"""Axes with which positions come: those of the machine, and where the probe touched."""

LONGEST = 1500  # clocks of a line
RESET = 126  # clocks until the first can come


def word(given: Word, *, system: bool = False) -> int:
    """Return the item of a word, of a jog if it is of the `system`."""
    whole, hundredths = given.code
    overflow = given.overflow or not -2**43 < given.value < 2**43
    value = {"value": 0 if overflow else given.value, "overflow": overflow,
             "whole": 2**24 - 1 if given.overflow else min(whole, 2**24 - 1),
             "hundredths": min(hundredths, 99),
             "exact": hundredths < 100, "integer": given.value % 10**6 == 0}
    return _bits(LAYOUT, {"kind": GCodeKind.WORD, "system": system,
                          "character": ord(given.letter), "number": value})


def end(status: GCodeStatus = GCodeStatus.GOOD, *, system: bool = False) -> int:
    return _bits(LAYOUT, {"kind": GCodeKind.END, "status": status, "system": system})


def _bits(layout: data.Layout, values) -> int:
    return Const.cast(layout.const(values)).value


def words(text: str) -> list[Word]:
    return [Word(letter, round(float(number) * 10**6))
            for letter, number in re.findall(r"([A-Z])([-+]?[\d.]+)", text)]


class Narrow(wiring.Component):
    """The interpreter with its items in two ports, since engines have none of more than 64 bits."""

    def __init__(self, *, probing: bool = True) -> None:
        self.interpreter = GCodeInterpreter(width=WIDTH, probing=probing)
        ports = dict(self.interpreter.signature.members.items())
        del ports["words"]
        super().__init__({**ports, "word_low": In(64), "word_high": In(64), "word_valid": In(1),
                          "word_ready": Out(1)})

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.interpreter = inner = self.interpreter
        names = self.signature.members.keys() & inner.signature.members.keys()
        for name in sorted(names):
            _join(m, self.signature.members[name], getattr(self, name), getattr(inner, name))
        m.d.comb += [inner.words.valid.eq(self.word_valid), self.word_ready.eq(inner.words.ready),
                     inner.words.payload.eq(Cat(self.word_low, self.word_high))]
        return m


def _join(m: Module, member, outer, inner) -> None:
    """Join a port, or a stream, of the frame to that of what is in it."""
    if member.is_port:
        driven, source = (inner, outer) if member.flow == In else (outer, inner)
        m.d.comb += Value.cast(driven).eq(Value.cast(source))
    else:
        wiring.connect(m, wiring.flipped(outer), inner)


class Pair:
    """The gateware and its model: a line to both."""

    def __init__(self, engine: Engine, seed: int = 0, haste: float = 1, *,
                 probing: bool = True) -> None:
        self.engine, self.model = engine, Interpreter(probing=probing)
        self.rng, self.haste = random.Random(seed), haste
        self.verdicts: list[int] = []
        self.longest = 0
        self.outside = False  # a jog leaves the travel
        self.touches: list[tuple[int, int]] = []  # positions that a probing sets, by their axes
        self.probed = [0, 0, 0]
        engine.set(answers_ready=0, actions_ready=0, word_valid=0)

    def line(self, given: list[Word], *, jog: bool = False) -> list[Action] | int:
        """Run a line on both; return what it does, or its error."""
        position = self.model.position
        try:
            expected = 0, self.model.jog(given, lambda _: not self.outside) if jog \
                else self.model.line(given)
        except RefusedLine as refused:
            expected = refused.args[0], []
        try:
            actions = self._send([*(word(each, system=jog) for each in given), end(system=jog)],
                                 position)
            found = 0, actions
        except RefusedLine as refused:
            found = refused.args[0], []
        assert found == expected, given
        assert self._modes() == self.model.modes.__dict__
        assert self.engine.get("feed_zero") == (self.model.feed == 0)
        assert self._vector(Operand.POSITION) == self.model.position
        assert self._vector(Operand.ORIGIN) == self.model.origin
        assert self._vector(Operand.PROBED) == tuple(self.probed)
        return expected[1] if not expected[0] else expected[0]

    def position(self, axis: int, value: int) -> None:
        """Set a position on both, or one where the probe touched, where that is taken."""
        if axis >= 4:
            self.probed[axis - 4] = value
        else:
            self.model.set_position(axis, value)
        self.engine.set(position_valid=1, word_valid=0,
                        position_payload=_bits(POSITION, {"axis": axis, "value": value}))
        assert self.engine.get("position_ready")
        self.engine.run(1)
        self.engine.set(position_valid=0)

    def reset(self, line: list[Word]) -> None:
        """Reset both, the gateware within a line; the next line can come at once."""
        self.model.reset()
        self.probed = [0, 0, 0]
        for item in map(word, line):
            self.engine.set(word_valid=1, word_low=item & 2**64 - 1, word_high=item >> 64)
            self.engine.run(3)
        self.engine.set(word_valid=0, rst=1)
        self.engine.run(1)
        self.engine.set(rst=0)
        self.engine.run(RESET)
        assert self.engine.get("position_ready")
        assert self._vector(Operand.ORIGIN) == self.model.origin

    def _read(self, address: int) -> int:
        self.engine.set(operand_address=address)
        self.engine.run(1)
        value = self.engine.get("operand")
        return value - (value >> WIDTH - 1 << WIDTH)

    def _vector(self, address: int) -> Vector:
        x, y, z = (self._read(address + axis) for axis in range(3))
        return x, y, z

    def _modes(self) -> dict:
        return _modes(GCodeModes.from_bits(self.engine.get("modes")))

    def _send(self, items: list[int], position) -> list[Action]:
        engine, rng = self.engine, self.rng
        actions: list[Action] = []
        clocks = 0
        probing = False  # a probe's line is taken, and its end is not
        while True:
            clocks += 1
            assert clocks < LONGEST
            valid = bool(items) and rng.random() < self.haste
            item = items[0] if valid else 0
            engine.set(word_valid=valid, word_low=item & 2**64 - 1, word_high=item >> 64)
            wait = rng.random() >= self.haste
            if engine.get("actions_valid") and not wait:
                action = GCodeAction.from_bits(engine.get("actions_payload"))
                if action.kind == GCodeActionKind.CHECK_ARC:
                    verdict = self._judge(action, position)
                    engine.set(verdict=verdict)
                elif action.kind == GCodeActionKind.CHECK_JOG:
                    engine.set(verdict=self.outside)
                elif probing:
                    assert action.kind == GCodeActionKind.PROBED
                    engine.set(word_valid=0)
                    for axis, value in self.touches:
                        self.position(axis, value)
                    probing = False
                else:
                    actions.append(self._action(action, position))
                    probing = isinstance(actions[-1], Probe)
                engine.set(actions_ready=1)
            if engine.get("answers_valid") and not wait:
                answer = engine.get("answers_payload")
                engine.set(answers_ready=1)
                engine.run(1)
                engine.set(answers_ready=0, word_valid=0)
                self.longest = max(self.longest, clocks)
                assert not probing
                if answer:
                    assert not actions
                    raise RefusedLine(answer)
                return actions
            taken = valid and engine.get("word_ready")
            engine.run(1)
            engine.set(actions_ready=0, word_valid=0)
            if taken:
                items = items[1:]

    def _judge(self, action, position) -> int:
        """Judge an arc as the model does, which knows its geometry."""
        arc = self._arc(action, position)
        try:
            self.centre = arc()
        except RefusedLine as refused:
            return refused.args[0]
        return 0

    def _arc(self, action, position):
        a, b = ((0, 1), (2, 0), (1, 2))[action.modes.plane]
        target = self._vector(Operand.TARGET)
        x, y = target[a] - position[a], target[b] - position[b]
        if action.by_radius:
            radius = self._read(Operand.RADIUS)
            clockwise = action.modes.motion.value == 2
            return lambda: centre_by_radius(x, y, radius, clockwise=clockwise)
        i, j = (self._read(Operand.CENTRE + axis) for axis in (a, b))
        return lambda: check_radii(i, j, x, y)

    def _action(self, action, position) -> Action:
        """Return what an action of the gateware is, as the model has it."""
        modes, kind = action.modes, action.kind
        target = self._vector(Operand.TARGET)
        if kind == GCodeActionKind.RAPID:
            return Line(target, None)
        if kind == GCodeActionKind.JOG:
            return Jog(target, self._read(Operand.RATE))
        feed = self._read(Operand.FEED)
        if kind == GCodeActionKind.LINE:
            return Line(target, feed, bool(modes.inverse))
        if kind == GCodeActionKind.PROBE:
            motion = modes.motion.value
            return Probe(target, feed, bool(modes.inverse), away=bool(motion & 2),
                         no_error=bool(motion & 1))
        if kind == GCodeActionKind.ARC:
            return Arc(target, self.centre, ((0, 1), (2, 0), (1, 2))[modes.plane],
                       modes.motion.value == 2, feed, bool(modes.inverse))
        if kind == GCodeActionKind.DWELL:
            return Dwell(self._read(Operand.DWELL))
        if kind == GCodeActionKind.SPINDLE:
            return Spindle(modes.clockwise - modes.counter_clockwise, self._read(Operand.SPEED))
        if kind == GCodeActionKind.COOLANT:
            return Coolant(bool(modes.mist), bool(modes.flood))
        if kind == GCodeActionKind.OFFSETS:
            return Offsets(self._vector(Operand.ORIGIN))
        return {GCodeActionKind.PAUSE: Pause(), GCodeActionKind.END: End()}[kind]


def _modes(modes) -> dict:
    motion = {4: 80, 8: 382, 9: 383, 10: 384, 11: 385}
    return {"motion": motion.get(modes.motion.value, modes.motion.value), "plane": modes.plane,
            "relative": bool(modes.relative), "inches": bool(modes.inches),
            "inverse": bool(modes.inverse), "system": modes.system,
            "spindle": modes.clockwise - modes.counter_clockwise, "mist": bool(modes.mist),
            "flood": bool(modes.flood)}


PROGRAM = """\
G0 X10
G1 X10 Y15 Z0 F100
G2 X60 Y30 I30 J10 F100
G0 X0 Y10
G2 X60 Y30 I30 J10
G20 G91 X.00001 Y-1 F10
G21 G90 G3 X50 R100 F60
X0 R-60
X0 R1
G92 X0 Z-2
G55 X1
G10 L2 P2 X2 Y-3
G10 L20 P0 Z7
X1
G53 G0 X1
G92.1
G43.1 Z1.5
Z0
G49
G28.1
G0 X9 Y9
G30
G28
G91 G28 Z5
G90
M3 S1000 M8 G4 P.5
S2000
M7
G1 X1 F60 M5
M9
M0
M1
G93 G1 X1 F2
X2
G94
X3
X3 F60
G1 F0
X4
G20 F350000
G21
F1
G80
X1
G38.2 X5 F60
X6 Y7
G38.3 Z-3 M0
G38.4 X0
G93 G38.5 X1 F2
G94
G4 P1
G92 X0
G28 Z1
G28
F60 G91 G38.2 Y-1 S4 T3 N5 M3
G18 G90 G2 X1 Z1 F60 K1
G19 G3 Y5 Z5 J5
M4 S5 G55 G91 G20 M8 M30
"""

REFUSED = """\
A1|G5|M6|G43 Z1|G90.1|G61.1|G28.2|G-1|M-3|G10 L3 P1 X0|G10 L2 P1 X0 R1|G0 G1 X1
G10 L-2 P1 X0|G10 L-20 P1 X0
G0 G80|G17 G18|M3 M4|G90 G91|G1.5 F1|M3.1|G4.1|G10 G28|G43.1 G1 Z1|X1 X2|F-1|S-1|P-1|N-1|T256
T255.5|N10000001|G1 X1|G1|G4|G10 X1|G10 L2 P7 X1|G10 L2 P1|G92|G2 F1|G2 G53 X1 F1|G80 X1
G80 G92 X1|G2 Z1 I1 F1|G2 X0 Y0 R1 F1|G2 X1 F1|G1 X1 F1 I1|G4 P1 L2|P1|G43.1 X1|G43.1|X40000
G20 X2000|G93 G1 X1|G1.004|G91.2|G10.1|G53.1
G38 X1|G38.2|G38.2 F1|G38.5 X0 F1
""".replace("\n", "|").split("|")[:-1]


def random_line(rng: random.Random) -> list[Word]:
    """Return words of which many are right together."""
    found = [Word("G", code * 10**4) for code in rng.sample(
        [0, 100, 200, 300, 8000, 400, 1000, 1700, 1800, 1900, 2000, 2100, 2800, 2810, 3000, 3010,
         4000, 4310, 4900, 5300, 5400, 5700, 5900, 6100, 9000, 9100, 9110, 9200, 9210, 9300, 9400,
         3820, 3830, 3840, 3850, 3800, 3860, 7000, 9150], rng.choice([0, 0, 1, 1, 2, 3]))]
    found += [Word("M", code * 10**6) for code in rng.sample(
        [0, 1, 2, 30, 3, 4, 5, 7, 8, 9, 6], rng.choice([0, 0, 0, 1, 2]))]
    letters = rng.choice(["XYZ", "XYIJ", "XYR", "XZIKF", "XYZF", "YZJKF", "PL", "P", "XYZPL", "FST",
                          "N", "XYZIJKRPLFSTN"])
    for letter in letters:
        if rng.random() < 0.8:
            size = rng.choice([1, 10, 1000, 30_000])
            value = rng.randrange(-size * 10**6, size * 10**6)
            if letter in "PLFSTN":
                value = rng.choice([abs(value), value, 10**6, 2 * 10**6, 20 * 10**6])
            found.append(Word(letter, value, rng.random() < 0.01))
    if rng.random() < 0.9:
        rng.shuffle(found)
    return found


def random_jog(rng: random.Random) -> list[Word]:
    """Return words of which many may stand in a jog together."""
    found = [Word("G", code * 10**6) for code in rng.sample([20, 21, 53, 90, 91], rng.choice(
        [0, 1, 1, 2]))]
    if rng.random() < 0.1:
        found.append(rng.choice([Word("G", 10**6), Word("M", 3 * 10**6), Word("G", 94 * 10**6),
                                 Word("G", 4 * 10**6), Word("G", 17 * 10**6), Word("M", 0)]))
    for letter, share in zip("XYZFNSTPI", (0.5, 0.5, 0.5, 0.9, 0.1, 0.05, 0.05, 0.03, 0.03),
                             strict=True):
        if rng.random() < share:
            size = rng.choice([0, 1, 1000])
            value = rng.randint(-size * 10**6, size * 10**6)
            found.append(Word(letter, value if letter in "XYZI" else abs(value) % (200 * 10**6)))
    return found


def run(kind: type[Engine], lines: list[list[Word]], seed: int = 0, haste: float = 1) -> Pair:
    """Run lines on both, with positions and resets between them if there is a `seed`."""
    with kind(component("interpreter", Narrow())) as engine:
        pair, rng = Pair(engine, seed, haste), random.Random(seed)
        engine.run(RESET)
        for line in lines:
            if seed and rng.random() < 0.05:
                pair.reset(random_line(rng))
            while seed and rng.random() < 0.2:
                pair.position(rng.choice(PLACES), rng.randrange(-2**35, 2**35))
            if seed and rng.random() < 0.2:
                pair.outside = rng.random() < 0.3
                pair.line(random_jog(rng), jog=True)
            pair.touches = [(rng.choice(PLACES), rng.randrange(-2**35, 2**35))
                            for _ in range(rng.randrange(3) if seed else 0)]
            pair.line(line)
        assert not engine.get("fault")
        return pair


def test_a_program():
    run(AmaranthEngine, [words(line) for line in PROGRAM.splitlines()])


@pytest.mark.parametrize(("line", "clocks"), [
    ("G4 P1", 84), ("X2", 107), ("G28", 157), ("G1 X1 Y2 F100", 199), ("G20 X2", 109 + 65),
    ("G20 X1 Y1 Z1", 113 + 3 * 65)])
def test_clocks_of_a_line(line, clocks):
    with AmaranthEngine(component("interpreter", Narrow())) as engine:
        pair = Pair(engine)
        engine.run(RESET)
        pair.line(words("G1 F100"))
        pair.longest = 0
        pair.line(words(line))
        assert pair.longest == clocks


def test_what_is_refused():
    with AmaranthEngine(component("interpreter", Narrow())) as engine:
        pair = Pair(engine)
        engine.run(RESET)
        for line in REFUSED:
            assert isinstance(pair.line(words(line)), int), line


def test_a_jog_changes_nothing_but_the_position():
    with AmaranthEngine(component("interpreter", Narrow())) as engine:
        pair = Pair(engine)
        engine.run(RESET)
        pair.line(words("G93 G2 X2 I1 F2 G55"))
        assert pair.line(words("X-1 F60"), jog=True) == [Jog((-1_000_000, 0, 0), 1_000_000)]
        assert pair.line(words("G91 G20 Y1 F1"), jog=True) == [
            Jog((-1_000_000, 25_400_000, 0), 423_333)]
        assert pair.line(words("G80")) == []
        assert pair.line(words("G53 X7 F60 N4"), jog=True) == [
            Jog((7_000_000, 25_400_000, 0), 1_000_000)]
        assert pair.line(words("F1"), jog=True) == []
        assert pair.line(words("G94 G1 X1")) == 22
        pair.line(words("G94 G1 F5"))
        pair.line(words("X1 F60"), jog=True)
        assert pair.line(words("X2")) == [Line((2_000_000, 25_400_000, 0), 83_333)]


@pytest.mark.parametrize(("line", "error"), [
    ("", 22), ("X1", 22), ("X1 F0", 22), ("F0", 0), ("X1 F1 S1", 36), ("X1 F1 T1", 36),
    ("X1 F1 P1", 36), ("X1 F1 I1", 36), ("G1 X1 F1", 16), ("G0 F1", 16), ("G80 X1 F1", 16),
    ("G94 X1 F1", 16), ("G54 X1 F1", 16), ("G91.1 X1 F1", 16), ("M3 X1 F1", 16), ("M0 F1", 16),
    ("M8 F1", 16), ("G28 F1", 16), ("G92.1 F1", 16), ("G17 F1", 16), ("G61 F1", 16), ("G49 F1", 16),
    ("G40 F1", 16), ("G4 P1 F1", 16), ("X1 X2 F1", 25), ("G5 X1 F1", 20), ("G90 G91 X1 F1", 21),
    ("X40000 F1", 38), ("N10000001 X1 F1", 27)])
def test_jogs_that_are_refused(line, error):
    with AmaranthEngine(component("interpreter", Narrow())) as engine:
        pair = Pair(engine)
        engine.run(RESET)
        assert (pair.line(words(line), jog=True) or 0) == error
        pair.outside = True
        assert (pair.line(words(line), jog=True) or 0) == error
        assert pair.line(words("X1 F1"), jog=True) == 15


REFUSED_PROBINGS = [
    ("G38 X1 F1", 20), ("G38.1 X1 F1", 20), ("G38.6 X1 F1", 20), ("G38.21 X1 F1", 20),
    ("G38.204 X1 F1", 20), ("G38.2 G1 X1 F1", 24), ("G1 G38.2 X1 F1", 24), ("G1 G38 X1", 24),
    ("G38.2 G92 X1 F1", 24), ("G10 G38.2 L2 P1 X1", 24), ("G43.1 G38.2 Z1 F1", 24),
    ("G80 G38.3 X1 F1", 21), ("G38.2 X1 X1", 25), ("G53 G38.2", 30), ("G53 G38.2 X1 F1", 30),
    ("G38.2", 22), ("G38.2 X0", 22), ("G93 G38.2 X1", 22), ("G93 G38.2 F0", 22),
    ("G38.2 X1 F0", 22), ("G38.2 F1", 26), ("G38.2 F1 I1", 26), ("G38.2 X0 F1", 33),
    ("G38.2 X0 R1 F1", 33), ("G91 G38.4 X0 Y0 Z0 F1", 33), ("G38.2 X34400 F1", 38),
    ("G91 G38.2 X34000 P1 F1", 36), ("G38.5 X1 P1 F1", 36), ("G38.2 X1 L1 F1", 36),
    ("G38.2 X1 R1 F1", 36), ("G38.3 X1 I1 F1", 36), ("G38.3 X1 K1 F1", 36)]


def test_probings_that_are_refused():
    with AmaranthEngine(component("interpreter", Narrow())) as engine:
        pair = Pair(engine)
        engine.run(RESET)
        for line, error in REFUSED_PROBINGS:
            assert pair.line(words(line)) == error, line


def test_a_probing_goes_on_where_the_probe_touched():
    with AmaranthEngine(component("interpreter", Narrow())) as engine:
        pair = Pair(engine)
        engine.run(RESET)
        pair.touches = [(2, -3_000_000), (6, -2_999_999), (4, 7), (5, 2**35 - 1)]
        assert pair.line(words("G38.2 Z-10 F60")) == [
            Probe((0, 0, -10_000_000), 1_000_000)]
        assert pair.model.position == (0, 0, -3_000_000)
        pair.touches = []
        assert pair.line(words("G91 X1")) == [Probe((1_000_000, 0, -3_000_000), 1_000_000)]
        pair.touches = [(0, 4)]
        assert pair.line(words("G90 G38.5 X0 M30")) == [
            Probe((0, 0, -3_000_000), 1_000_000, away=True, no_error=True), End()]
        assert pair.line(words("X1")) == [Line((1_000_000, 0, -3_000_000), 1_000_000)]
        pair.reset([])
        assert pair._vector(Operand.PROBED) == (0, 0, 0)
        assert pair.line(words("G93 G38.3 Y1 F2")) == [
            Probe((1_000_000, 1_000_000, -3_000_000), 2_000_000, inverse=True, no_error=True)]


def test_without_a_probe_there_is_no_probing():
    with AmaranthEngine(component("interpreter", Narrow(probing=False))) as engine:
        pair = Pair(engine, probing=False)
        engine.run(RESET)
        for line in ("G38.2 X1 F1", "G38.2 G1 X1 F1", "G1 G38.2", "G38", "G38.6"):
            assert pair.line(words(line)) == 20
        pair.reset([])
        assert pair.line(words("G38.2 X1 F1")) == 20
        assert pair.line(words("G1 X1 F60")) == [Line((1_000_000, 0, 0), 1_000_000)]


def test_a_line_for_which_the_machine_is_not_ready_is_refused_with_that():
    with AmaranthEngine(component("interpreter", Narrow())) as engine:
        pair = Pair(engine)
        engine.run(RESET)
        for status, error in ((GCodeStatus.LOCKED, 9), (GCodeStatus.NOT_IDLE, 8),
                              (GCodeStatus.NO_NUMBER, 20)):
            with pytest.raises(RefusedLine, match=f"^{error}$"):
                pair._send([word(Word("G", 5 * 10**6)), end(status)], (0, 0, 0))


def test_a_reset_leaves_coordinate_systems():
    with AmaranthEngine(component("interpreter", Narrow())) as engine:
        pair = Pair(engine)
        engine.run(RESET)
        for line in ("G10 L2 P1 X5", "G10 L2 P2 X7", "G0 X1", "G28.1", "G92 Y2", "G43.1 Z3",
                     "G91 G55 G20 S3 F2"):
            pair.line(words(line))
        pair.reset(words("G20 X1"))
        assert [pair._vector(address) for address in (
            Operand.SYSTEM, Operand.SYSTEM + 3, Operand.PREDEFINED, Operand.OFFSET, Operand.FEED
        )] == [(5_000_000, 0, 0), (7_000_000, 0, 0), (6_000_000, 0, 0), (0, 0, 0), (0, 0, 0)]
        assert pair.line(words("G1 X1")) == 22  # no feed
        assert pair.line(words("G28")) == [Line((6_000_000, 0, 0), None)]


def test_a_position_is_taken_where_a_line_begins():
    with AmaranthEngine(component("interpreter", Narrow())) as engine:
        pair = Pair(engine)
        engine.set(position_valid=1)
        assert not engine.get("position_ready")
        engine.run(RESET)
        assert engine.get("position_ready") and not engine.get("word_ready")
        for axis, value in enumerate((-1, 2**35 - 1, -2**35)):
            pair.position(axis, value)
        pair.position(0, 4)
        assert pair.line(words("G91 G0 X1 Y-2")) == [Line((1_000_004, 2**35 - 2_000_001, -2**35),
                                                          None)]
        engine.set(position_payload=3, position_valid=1)  # no axis
        engine.run(1)
        engine.set(position_valid=0)
        assert pair._read(Operand.FEED) == 0
        item = word(Word("Z", 0))
        engine.set(word_valid=1, word_low=item & 2**64 - 1, word_high=item >> 64)
        for _ in range(2):
            assert not engine.get("word_ready")
            engine.run(1)
        assert engine.get("word_ready")
        engine.set(position_valid=1)
        assert not engine.get("word_ready")
        engine.run(1)
        engine.set(position_valid=0)
        engine.run(1)
        engine.set(position_valid=1)
        assert not engine.get("position_ready")


@pytest.mark.compiler
@pytest.mark.parametrize("seed", [1, 2])
def test_random_lines(seed):
    rng = random.Random(seed)
    pair = run(CXXRTLEngine, [random_line(rng) for _ in range(400)], seed, (1, 0.4)[seed % 2])
    assert pair.longest < LONGEST
