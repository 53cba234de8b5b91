# amaranth: UnusedElaboratable=no

"""Fuzzing `vplotter`: mistakes in its gateware, and at its pins, are found; and no other."""

from collections.abc import Callable

import numpy as np
import pytest
from amaranth import Const, Mux

from fresa.drive import HALF_STEP
from tb.engines import AmaranthEngine, CXXRTLEngine
from tb.fuzz import fuzz, run_session
from tb.fuzz.inputs import Input
from tb.machines.vplotter import SHORT
from tb.machines.vplotter.fuzz import ANEW, FUZZ, HOME
from tb.machines.vplotter.fuzz_check import BIT
from tb.mistake import Mistake
from tb.uart import FRAME, high, levels

MISTAKES = {  # a few bytes, what is found, the mistake
    "another reply": (b":Q\n", "answer", Mistake(
        "dialect.texts.numbers__payload", lambda right, _: Mux(right == 18, 19, right))),
    "a command without a reply": (b":S3\n:P1\n", "answer", Mistake(
        "dialect.texts.numbers__valid",
        lambda right, at: right & (at("dialect.texts.numbers__payload") != 23))),
    "answers to a command": (b":S0\n", "answer", Mistake(
        "reporter.answers__valid", lambda *_: Const(1))),
}


def kinds(text: bytes, mistake: Mistake | None = None) -> set[str]:
    """Send a few bytes, and return the kinds of what is found."""
    sent = [Input("rest", b"", high(6000)), Input("bytes", text, levels(text, BIT)),
            Input("rest", b"", high(60 * FRAME * BIT))]
    design = FUZZ.design() if mistake is None else mistake.planted(FUZZ.design())
    with AmaranthEngine(design) as engine:
        return {failure.kind for failure in run_session(FUZZ, engine, sent).findings.failures}


@pytest.mark.long
@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_are_found(name):
    text, kind, mistake = MISTAKES[name]
    assert kind in kinds(text, mistake)


@pytest.mark.long
def test_nothing_is_found_where_there_is_no_mistake():
    assert kinds(b"".join(text for text, *_ in MISTAKES.values())) == set()


@pytest.mark.compiler
@pytest.mark.long
def test_a_session_finds_nothing():
    (outcome,) = fuzz(FUZZ, 2, 1500)
    assert outcome.findings.failures == []
    assert outcome.findings.answers > 60
    assert outcome.findings.steps > 50


PAUSE = 700 * FRAME * BIT
"""Clocks between the texts of a session."""

QUIET = b"\x18" + bytes(400) + b"\n:S1\n"
"""A reset, and a command; neither waits for a motion."""


@pytest.fixture(scope="module")
def session():
    """Levels of a session: a reset that noise follows, lines and commands, and where it ends."""
    sent = [Input("rest", b"", high(6000)),
            *(Input("bytes", text, np.concatenate([levels(text, BIT), high(PAUSE)]))
              for text in (b"\x18N\n", QUIET, b"$X\nG0X9Y7M3\n", b":S0\nM5\n",
                           ANEW + HOME))]
    line = np.concatenate([item.levels for item in sent])
    with CXXRTLEngine(FUZZ.design()) as engine:
        return {"rx": line, **engine.apply({"rx": line}, FUZZ.outputs)}


def _steps(words: np.ndarray) -> list[int]:
    """Return the clocks in which a motor makes its steps."""
    return [int(clock) + 1 for clock in np.flatnonzero(np.diff(words))
            if words[clock] and words[clock + 1]]


def _turned(words: np.ndarray, rows: int) -> np.ndarray:
    """Return the words of a motor that is some rows further."""
    other = {0: 0, **{word: HALF_STEP[(row + rows) % 8] for row, word in enumerate(HALF_STEP)}}
    return np.array([other[word] for word in words.tolist()], words.dtype)


def _lose(seen: dict) -> None:
    words = seen["left"]
    at = _steps(words)[5]
    turn = (HALF_STEP.index(words[at]) - HALF_STEP.index(words[at - 1]) + 4) % 8 - 4
    words[at:] = _turned(words[at:], -turn)


def _jump(seen: dict) -> None:
    at = _steps(seen["right"])[5]
    seen["right"][at:] = _turned(seen["right"][at:], 3)


def _hasten(seen: dict) -> None:
    words = seen["right"]
    before, at = _steps(words)[4:6]
    words[before + SHORT.period - 1:at] = words[at]


def _light(seen: dict) -> None:
    seen["left"][seen["left"] != 0] |= 8


def _stand(seen: dict) -> None:
    seen["moving"][:] = 0


def _touch(seen: dict) -> None:
    seen["pen"][:] = 1


def _lift(seen: dict) -> None:
    for rise in np.flatnonzero(np.diff(seen["servo"].astype(np.int8)) == 1):
        seen["servo"][rise + 201:rise + 700] = 0


def _omit(seen: dict) -> None:
    seen["servo"] &= ~seen["pen"] & 1


def _silence(seen: dict) -> None:
    seen["tx"][-PAUSE - len(levels(ANEW + HOME, BIT)):] = 1
    seen["moving"][-1] = 1


def _mute(seen: dict) -> None:
    """Take the greeting of the second reset of three."""
    begin = 6000 + PAUSE + len(levels(b"\x18N\n", BIT))
    seen["tx"][begin:begin + PAUSE + len(levels(QUIET, BIT))] = 1


def _ask(seen: dict) -> None:
    """Send a command behind the second reset; noise follows the first."""
    text = levels(b":Q\n", BIT)
    at = 6000 + sum(PAUSE + len(levels(each, BIT)) for each in (b"\x18N\n", QUIET))
    at -= PAUSE // 2
    seen["rx"][at:at + len(text)] = text


CHANGES: dict[str, tuple[Callable[[dict], None], str]] = {
    "nothing": (lambda seen: None, ""),
    "a step that is lost": (_lose, "place"),
    "a coil that is always on": (_light, "pins"),
    "a jump": (_jump, "pins"),
    "a step that is too soon": (_hasten, "pins"),
    "steps while nothing moves": (_stand, "step"),
    "a pen that touches": (_touch, "pen"),
    "a servo that does not follow the pen": (_lift, "pen"),
    "pulses that are left out": (_omit, "pen"),
    "no greeting while it moves": (_silence, "answer"),
    "no greeting of a reset before others": (_mute, "answer"),
    "no reply behind a reset; noise followed the one before": (_ask, "answer"),
}


@pytest.mark.compiler
@pytest.mark.long  # the machine is compiled for a minute
@pytest.mark.parametrize("name", CHANGES)
def test_levels_at_the_pins_that_are_changed_are_found(session, name):
    change, kind = CHANGES[name]
    seen = {name: row.copy() for name, row in session.items()}
    change(seen)
    found = {failure.kind for failure in FUZZ.check(seen["rx"], seen).failures}
    assert kind in found if kind else not found


@pytest.mark.compiler
@pytest.mark.long
@pytest.mark.parametrize(("end", "answers"), [(b"\n", 0), (b"\r", 0), (b"\r\n", 1)])
def test_a_wake_up_has_no_answer_beside_its_text_but_of_a_line_feed_behind_it(end, answers):
    """That comes after the reset, and is an empty line."""
    text = b":P0\n:P1" + end
    sent = [Input("rest", b"", high(10_000)), Input("bytes", text, levels(text, BIT)),
            Input("rest", b"", high(200 * FRAME * BIT))]
    with CXXRTLEngine(FUZZ.design()) as engine:
        findings = run_session(FUZZ, engine, sent).findings
    assert (findings.failures, findings.answers) == ([], answers)
