# amaranth: UnusedElaboratable=no

"""Lines of a G-code machine, against GRBL's documentation."""

import random
import re
from typing import Any

import pytest
from amaranth import Fragment

from fresa.machines.gcode import GCodeSettings
from fresa.machines.vplotter import VPlotterSettings
from fresa.protocol import GCodeMessage, GCodeReporter, GCodeState, GCodeText, TextSource
from tb.boards import component
from tb.engines import choose
from tb.models.gcode_report import MESSAGES, STATES, Reports, Sample, alarm, answer

BITS = 27
LEAST, MOST = -2**(BITS - 1), 2**(BITS - 1) - 1
LETTERS = "PXYZDRHS"
ACCESSORIES = "SCFM"


class Line:
    """The reporter and what it should have sent; its inputs keep still while it reports."""

    def __init__(self, engine, *, share: float = 1.0, seed: object = 0) -> None:
        self.engine, self.share, self.rng = engine, share, random.Random(f"{seed}")
        self.expected, self.sent = bytearray(), bytearray()
        self.reports, self.sample = Reports(), Sample()
        self.was_reporting, self.lines = 0, []
        self.numbers: dict[int, int] = {}
        self.number = 0  # that was read

    def show(self, sample: Sample) -> None:
        """Set what a report shows."""
        self.sample = sample
        self.numbers = {3: sample.feed, 4: sample.speed, **dict(enumerate(sample.position, 8)),
                        **dict(enumerate(sample.origin, 12))}
        self.engine.set(
            state=STATES.index(sample.state), substate=sample.substate,
            free_blocks=sample.blocks, free_bytes=sample.room, shown=sample.shown,
            inches=sample.inches,
            pins=sum(1 << LETTERS.index(letter) for letter in sample.pins),
            accessories=sum(1 << ACCESSORIES.index(letter) for letter in sample.accessories),
            **{f"overrides_{which}": each for which, each in enumerate(sample.overrides)})

    def run(self, clocks: int = 1, **inputs: int) -> dict[str, bool]:
        """Run some clocks; return which of the streams were taken in the last of them."""
        taken = {}
        for _ in range(clocks):
            ready = int(self.rng.random() < self.share)
            self.engine.set(bytes_ready=ready, **inputs)
            reporting, valid, byte, reads, address, *accepts = self.engine.get(
                "reporting", "bytes_valid", "bytes_payload", "number_read", "number_address",
                "answers_ready", "alarms_ready", "messages_ready")
            taken = {name: bool(accept and inputs.get(f"{name}_valid")) for name, accept in
                     zip(("answers", "alarms", "messages"), accepts, strict=True)}
            if reporting and not self.was_reporting:
                self.expect("report", self.reports.line(self.sample))
            if taken["answers"]:
                self.expect("answer", answer(inputs["answers_payload"]))
            if taken["alarms"]:
                self.expect("alarm", alarm(inputs["alarms_payload"]))
            if taken["messages"]:
                self.expect("message", MESSAGES[GCodeMessage(inputs["messages_payload"]).name])
            if inputs.get("origin_changed"):
                self.reports.change_origin()
            if inputs.get("overridden"):
                self.reports.change_overrides()
            if valid and ready:
                self.sent.append(byte)
                assert self.expected.startswith(self.sent[-1:], len(self.sent) - 1), self.sent
            self.was_reporting = reporting
            self.engine.run(1)
            self.engine.set(number=self.number)
            if reads:
                self.number = self.numbers.get(address, 0) % 2**BITS
        return taken

    def expect(self, kind: str, line: bytes) -> None:
        """Expect a line, behind whole ones."""
        assert len(self.expected) == len(self.sent), "torn"
        self.lines.append(kind)
        self.expected += line

    def report(self, sample: Sample) -> bytes:
        """Request a report, and return it."""
        self.show(sample)
        began = len(self.sent)
        self.run(request=1)
        self.run(3, request=0)
        while self.sent != self.expected:
            self.run(8)
        self.run(4)
        return bytes(self.sent[began:])


def random_sample(rng) -> Sample:
    def position() -> int:
        value = rng.randrange(LEAST, MOST + 1)
        return rng.choice([value, value >> rng.randrange(BITS), 0, LEAST, MOST])

    return Sample(
        rng.choice(STATES), rng.randrange(4), [position() for _ in "xyz"],
        [position() for _ in "xyz"], rng.randrange(256), rng.randrange(256),
        rng.randrange(2**(BITS - 1)) >> rng.randrange(BITS), rng.randrange(30_000),
        "".join(letter for letter in LETTERS if rng.random() < 0.3),
        [rng.randrange(256) for _ in range(3)],
        "".join(letter for letter in ACCESSORIES if rng.random() < 0.3), rng.randrange(4),
        rng.random() < 0.5)


@pytest.fixture(scope="module")
def engine():
    with choose()(component("reporter", GCodeReporter(position_bits=BITS))) as engine:
        yield engine


@pytest.fixture
def line(engine):
    engine.set(rst=1, bytes_ready=0, answers_valid=0, alarms_valid=0, messages_valid=0,
               request=0, origin_changed=0, overridden=0)
    engine.run(1)
    engine.set(rst=0)
    return Line(engine)


def test_states_are_those_of_the_model():
    assert [state.name.capitalize() for state in GCodeState] == list(STATES)
    assert [message.name for message in GCodeMessage] == list(MESSAGES)


def test_reports_word_by_word(line):
    assert line.report(Sample()) == (
        b"<Idle|MPos:0.000,0.000,0.000|Bf:0,0|FS:0,0|WCO:0.000,0.000,0.000>\r\n")
    assert line.report(Sample("Hold", 1, (-1, 1, -999), blocks=63, room=128, feed=500,
                              speed=8000)) == (
        b"<Hold:1|MPos:-0.001,0.001,-0.999|Bf:63,128|FS:500,8000|Ov:100,100,100>\r\n")
    assert line.report(Sample("Door", 2, (LEAST, MOST, 1000), pins="YD")) == (
        b"<Door:2|MPos:-67108.864,67108.863,1.000|Bf:0,0|FS:0,0|Pn:YD>\r\n")
    assert line.sent == line.expected


@pytest.mark.parametrize(("shown", "fields"), [
    (0, "WPos:0.001,-0.002,0.000"), (1, "MPos:0.001,-0.002,0.000"),
    (2, "WPos:0.001,-0.002,0.000|Bf:9,8"), (3, "MPos:0.001,-0.002,0.000|Bf:9,8")])
def test_what_it_shows(line, shown, fields):
    text = line.report(Sample("Run", position=(1, -2, 0), blocks=9, room=8, feed=5, shown=shown))
    assert text.decode() == f"<Run|{fields}|FS:5,0|WCO:0.000,0.000,0.000>\r\n"


def test_inches(line):
    sample = Sample("Run", position=(1, -20_000, LEAST), origin=(-9, 10_000, MOST), feed=12,
                    speed=500, inches=True)
    assert line.report(sample).decode() == (
        "<Run|MPos:0.0001,-2.0000,-6710.8864|Bf:0,0|FS:1.2,500|WCO:-0.0009,1.0000,6710.8863>\r\n")


@pytest.mark.parametrize("state", ["Run", "Alarm"])
def test_origin_and_overrides_come_now_and_then(line, state):
    origin, overrides = 0, 0
    line.engine.set(bytes_ready=1)
    for _ in range(43):
        text = line.report(Sample(state, position=(1, 2, 3), origin=(1, 0, -5)))
        assert not (b"WCO" in text and b"Ov" in text)
        origin += b"|WCO:0.001,0.000,-0.005" in text
        overrides += b"|Ov:" in text
    assert (origin, overrides) == ((2, 3) if state == "Run" else (5, 5))
    line.run(origin_changed=1)
    line.run(origin_changed=0)
    assert b"|WCO:" in line.report(Sample(state))
    line.report(Sample(state))
    line.run(overridden=1)
    line.run(overridden=0)
    changed = Sample(state, pins="YS", overrides=(10, 25, 200), accessories="CM")
    assert line.report(changed).endswith(b"|Pn:YS|Ov:10,25,200|A:CM>\r\n")
    assert b"Ov" not in line.report(changed)


@pytest.mark.parametrize("share", [0.15, 1.0])
def test_everything_at_once(line, share):
    """Lines are whole, in the order in which they were taken, and hold what was sampled."""
    rng = random.Random(share)
    line.share = share
    inputs = {f"{name}_{what}": 0 for name in ("answers", "alarms", "messages")
              for what in ("valid", "payload")}
    taken = {}
    for _ in range(8_000):
        for name, chance, most in (("answers", 0.02, 256), ("alarms", 0.0005, 16),
                                   ("messages", 0.001, 8)):
            if taken.get(name):
                inputs[f"{name}_valid"] = 0
            if not inputs[f"{name}_valid"] and rng.random() < chance:
                inputs |= {f"{name}_valid": 1,
                           f"{name}_payload": rng.choice([0, rng.randrange(most)])}
        if not line.was_reporting and rng.random() < 0.05:
            line.show(random_sample(rng))
        taken = line.run(**inputs, request=int(rng.random() < 0.002),
                         origin_changed=int(rng.random() < 0.0005),
                         overridden=int(rng.random() < 0.001))
    line.run(2000, answers_valid=0, alarms_valid=0, messages_valid=0, request=0, origin_changed=0,
             overridden=0)
    line.share = 1
    line.run(3000)
    assert line.sent == line.expected
    assert set(line.lines) == {"report", "answer", "alarm", "message"}


def test_an_answer_waits_for_one_report(line):
    line.show(Sample())
    line.run(request=1)
    for number in range(6):
        for _ in range(3000):
            if line.run(request=1, answers_valid=1, answers_payload=number)["answers"]:
                break
    assert line.lines == ["report", "answer"] * 6


def test_requests_while_one_waits_are_dropped(line):
    line.show(Sample())
    line.run(request=1)
    line.run(200, request=1)
    line.run(1500, request=0)
    assert line.lines == ["report", "report"]
    assert line.sent == line.expected


def test_alarm_then_message_then_report_then_answer(line):
    line.show(Sample())
    line.run(2, answers_valid=1, answers_payload=3)  # busy with an answer
    line.run(request=1)
    inputs = {"answers": 1, "alarms": 1, "messages": 1}
    for _ in range(3000):
        valid = {f"{name}_valid": on for name, on in inputs.items()}
        taken = line.run(**valid, answers_payload=7, alarms_payload=2, messages_payload=1,
                         request=0)
        inputs = {name: int(on and not taken[name]) for name, on in inputs.items()}
    assert line.lines == ["answer", "alarm", "message", "report", "answer"]


@pytest.mark.parametrize(("dialect", "greeting"), [
    ("grbl", b"Grbl 1.1h ['$' for help]\r\n"), ("thesis", b"start\r\n")])
def test_greeting(dialect, greeting):
    with choose()(component("reporter", GCodeReporter(dialect=dialect))) as engine:
        engine.set(messages_valid=1, bytes_ready=1)
        engine.run(2)
        engine.set(messages_valid=0)
        sent = bytearray()
        for _ in range(200):
            valid, byte = engine.get("bytes_valid", "bytes_payload")
            sent += bytes([byte] if valid else [])
            engine.run(1)
    assert sent == greeting


def texts(notes: list[str], **parameters: Any) -> TextSource:
    """Return what a reporter with these notes says."""
    reporter = GCodeReporter(notes=notes, **parameters)
    Fragment.get(reporter, None)  # else Amaranth warns that it is unused
    return reporter.texts


def test_what_a_build_says():
    source = texts(["made by (x)", "2"])
    text = source.texts[32 + GCodeText.BUILD.value]
    assert text == (b"[VER:1.1h.20190830:\xbb]\r\n[OPT:V,63,128]\r\n[MSG:made by (x)]\r\n"
                    b"[MSG:2]\r\n")


@pytest.mark.parametrize("settings", [
    GCodeSettings(), GCodeSettings(probing=False, startup_lines=False, single_axes=False),
    GCodeSettings(kinematics="corexy", second_motor="z"), GCodeSettings(dialect="thesis"),
    VPlotterSettings(), VPlotterSettings(bowed=True)])
def test_texts_are_in_one_block_ram(settings):
    assert texts(settings.notes, options=settings.options, stores=settings.stores,
                 dialect=settings.dialect).size <= 2048


@pytest.mark.parametrize(("parameters", "message"), [
    *(({"notes": ["a", note]},
       f"a note is printable ASCII without brackets, not {re.escape(repr(note))}")
      for note in ("a[", "a]", "\r", "\xe4")),
    ({"dialect": "basic"}, "dialect must be grbl or thesis, not 'basic'"),
    ({"position_bits": 33}, "position_bits must be a whole number from 12 to 32, not 33"),
])
def test_impossible(parameters, message):
    with pytest.raises(ValueError, match=f"^{message}$"):
        GCodeReporter(**parameters)
