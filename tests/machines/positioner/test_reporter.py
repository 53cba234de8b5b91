# amaranth: UnusedElaboratable=no

"""Reports and answers on a line: against a model of the line, and by their times."""

import gc
import random

import pytest
from amaranth import Module, Shape
from amaranth.lib import wiring
from amaranth.lib.wiring import connect

from fresa.machines.positioner import ANSWERS, TOP_SPEED
from fresa.protocol import Reporter, UARTTransmitter
from fresa.protocol.positioner import state_layout
from tb.boards import component
from tb.engines import AmaranthEngine, CXXRTLEngine
from tb.machines.positioner.model import ReporterModel

BIT, PERIOD = 16, 13_728  # the least
BYTE = 10 * BIT
NAMES = [*(answer.decode().lstrip("! ").rstrip().upper() for answer in ANSWERS), "STATE"]
STATE = state_layout(TOP_SPEED)
EXTREMES = [2**31 - 1, -2**31, 0, -1, 10, 1_000_000_000]


class Talker(wiring.Component):
    """A reporter with a line."""

    def __init__(self) -> None:
        self._reporter = Reporter(state=STATE, answers=ANSWERS, period=PERIOD, byte=BYTE)
        self._transmitter = UARTTransmitter(period=BIT)
        members = dict(self._reporter.signature.members)
        del members["bytes"]
        super().__init__({**members, "tx": self._transmitter.signature.members["tx"]})

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.reporter = reporter = self._reporter
        m.submodules.transmitter = transmitter = self._transmitter
        connect(m, reporter.bytes, transmitter.bytes)
        m.d.comb += [
            reporter.enable.eq(self.enable), self.tick.eq(reporter.tick),
            *(getattr(reporter, name).eq(getattr(self, name)) for name in STATE.members),
            reporter.answers.payload.eq(self.answers.payload),
            reporter.answers.valid.eq(self.answers.valid),
            self.answers.ready.eq(reporter.answers.ready), self.fault.eq(reporter.fault),
            self.tx.eq(transmitter.tx),
        ]
        return m


def talk(clocks: int, seed: int, *, busy: float, resets: float = 0,
         places: list[int] | None = None, only: str = "", full: bool = False
         ) -> tuple[list[tuple[int, bytes]], list[str]]:
    """Compare every clock with the model; return when lines began, what they are, and answers."""
    rng = random.Random(seed)
    model = ReporterModel(byte=BYTE, period=PERIOD)
    answer, state, enable = "", dict.fromkeys(STATE.members, 0), 1
    lines: dict[int, bytes] = {}
    taken = []
    given: dict[str, list[int]] = {}
    expected: dict[str, list[int]] = {"tx": [], "tick": []}
    answered: list[tuple[int, bool]] = []
    for clock in range(clocks):
        if not answer and rng.random() < busy:
            answer = only or rng.choice(NAMES[1:])
        if rng.random() < 0.01 or not clock:
            state = {name: rng.choice([(1 << Shape.cast(shape).width) - 1, *([
                        0, rng.getrandbits(Shape.cast(shape).width)] * (not full))])
                     for name, shape in STATE.members.items()}
            for number in (1, 2, 3):
                state[f"position_{number}"] = rng.choice(
                    places or [*EXTREMES, rng.randrange(-2000, 2000)])
            if rng.random() < 0.01 and resets:
                enable ^= 1
        rst = rng.random() < resets
        for name, value in {
                "enable": enable, "answers_valid": int(bool(answer)), "rst": int(rst),
                "answers_payload": NAMES.index(answer) if answer else 0,
                **{name: value % 2**32 for name, value in state.items()}}.items():
            given.setdefault(name, []).append(value)
        expected["tx"].append(model.tx)
        expected["tick"].append(int(model.tick))
        takes = model.clock(enable=bool(enable), state=list(state.values()), answer=answer)
        if answer:
            answered.append((clock, takes))
        if takes:
            taken.append(answer)
            answer = ""
        if rst:
            model.reset()
        elif model.text:
            lines[model.began] = model.text
    kind = AmaranthEngine if CXXRTLEngine.missing() else CXXRTLEngine
    with kind(component("talker", Talker())) as engine:
        seen = engine.apply(given, [*expected, "answers_ready"])
    assert {name: seen[name].tolist() for name in expected} == expected
    assert [(clock, seen["answers_ready"][clock]) for clock, _ in answered] == answered
    return sorted(lines.items()), taken


class TestReporter:
    def test_reports_keep_their_times_whatever_is_answered(self):
        lines, taken = talk(4 * PERIOD, 0, busy=1, places=[-2**31])
        at_ticks = [(began, text) for began, text in lines if text[:1] in b"#S"]
        assert [began for began, _ in at_ticks] == [n * PERIOD + 4 for n in (1, 2, 3)]
        assert {len(text) for _, text in at_ticks if text.startswith(b"#")} <= {43}
        answers = [text for _, text in lines if not text.startswith(b"#")]
        assert [text.split()[0] for text in answers] == [
            {"OK": b"ok", "STATE": b"STATE"}.get(answer, b"!") for answer in taken[:len(answers)]]
        assert len(answers) > 5

    def test_the_longest_state_is_sent_in_place_of_a_report_before_the_next_tick(self):
        lines, taken = talk(3 * PERIOD, 1, busy=1, places=[-2**31], only="STATE", full=True)
        assert taken == ["STATE"] * 2 and [began for began, _ in lines] == [
            PERIOD + 4, 2 * PERIOD + 4]
        assert {text for _, text in lines} == {
            b"STATE 1 1 1 1 2047 2047 2047 1 1 1 -2147483648 -2147483648 -2147483648 2147483647\n"}

    @pytest.mark.parametrize("seed", range(3))
    def test_is_its_model_in_every_clock(self, seed):
        lines, taken = talk(3 * PERIOD, seed, busy=[0.001, 0.01, 0.1][seed], resets=0.0001)
        assert len(lines) > 1 and taken

    @pytest.mark.filterwarnings("ignore::amaranth.hdl.UnusedElaboratable")
    @pytest.mark.parametrize(("period", "byte", "says"), [
        (13_727, 160, "report period must be a whole number from 13728 to 67108864, not 13727"),
        (10_600, 0, "byte must be a whole number from 1 to 67108864, not 0"),
        (2**26, 2**26, "a byte of 67108864 clocks is too long to report"),
    ])
    def test_impossible(self, period, byte, says):
        message = None
        try:  # what was made before the refusal is let go of here, not later
            Reporter(state=STATE, answers=ANSWERS, period=period, byte=byte)
        except ValueError as error:
            message = str(error)
        gc.collect()
        assert message == says
