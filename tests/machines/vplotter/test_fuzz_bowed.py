# amaranth: UnusedElaboratable=no

"""Fuzzing `vplotter` with bowed lines: what is wrong with one is found, and nothing else."""

import random
from collections.abc import Callable

import numpy as np
import pytest
from amaranth import Mux

from fresa.drive import HALF_STEP
from tb.engines import CXXRTLEngine
from tb.fuzz import fuzz
from tb.fuzz.inputs import Input
from tb.fuzz.switches import press_switches, switch_levels
from tb.machines.vplotter import SHORT
from tb.machines.vplotter.fuzz import ANEW, FUZZ, HOME
from tb.machines.vplotter.fuzz_bowed import REST, Bow, bows, ends, sequence
from tb.machines.vplotter.fuzz_check import BIT
from tb.mistake import Mistake
from tb.uart import high, levels

(BOWED,) = FUZZ.others
PACE = SHORT.pace
START, LONG = 1000, 100_000
SAID = [(START + 5, b"Drawing."), (START + 9000, b"Line drawn. Give a start point: :Ixxxxyyyy")]


def steps(fast: int = 8, slow: int = 3) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Return the steps of a line, of which the right string makes fewer, and back."""
    due = START + PACE * np.arange(fast)
    rest = fast // 2 + slow * np.arange(1, fast + 1)
    taken = np.diff(rest // fast, prepend=0) > 0
    return {"left": (due, np.ones(fast, int)),
            "right": (due[taken], -np.ones(int(taken.sum()), int))}


def messages(found, said=SAID, *, drawn: bool | None = True) -> list[str]:
    return [each.message for each in Bow(START - 1, START + 8 * PACE, drawn).failures(found, said)]


def test_a_line_that_is_right():
    for fast in range(1, 20):
        for slow in range(fast + 1):
            found = steps(fast, slow)
            assert len(found["right"][0]) == slow
            assert list(Bow(START - 1, START + fast * PACE, True).failures(found, SAID)) == []
    assert messages(steps(), [(START + 5, b"Drawing."), (START + 99, b"ALARM:1")],
                    drawn=False) == []
    assert messages(steps(), [], drawn=None) == []


def _late(found):
    found["left"][0][5:] += 1
    found["right"][0][2:] += 1


def _apart(found):
    found["right"][0][1] += 1


def _uneven(found):
    found["right"] = found["left"][0][:3], found["right"][1]


def _back(found):
    found["left"][1][2] = -1


@pytest.mark.parametrize(("change", "message"), [
    (_late, f"its steps are not {PACE} clocks apart"), (_apart, "do not step together"),
    (_uneven, "are not spread evenly"), (_back, "the left string goes to and fro")])
def test_steps_that_are_wrong_are_found(change, message):
    found = steps()
    change(found)
    assert any(message in each for each in messages(found))


def test_what_is_said_wrongly_is_found():
    assert messages(steps(), SAID[1:]) == [f"a line is drawn, and it says {SAID[1][1]!r}"]
    ended = [SAID[0], (START + 3000, b"Stopped before the end.")]
    assert messages(steps(), ended, drawn=False) == [
        "a line has ended early, and there is no alarm"]


def test_a_line_is_seen_at_the_pins():
    seen = {"pen": np.zeros(20_000, np.uint8), "moving": np.zeros(20_000, np.uint8)}
    seen["pen"][START - 1:START + 8 * PACE] = 1
    assert bows(seen, steps(), SAID, 2) == [Bow(START - 1, START + 8 * PACE, True)]
    assert bows(seen, steps(), SAID[:1], 2)[0].drawn is None
    assert bows(seen, steps(), [*SAID[:1], (9000, b"Stopped before the end.")], 2)[0].drawn is False
    assert bows(seen, steps(2, 1), SAID, 2) == []
    seen["moving"][START + 5] = 1  # a planned motion
    assert bows(seen, steps(), SAID, 2) == []


def test_where_a_line_may_end():
    bow = Bow(START, START + 100, True)
    commands = [(300, b":F00080008"), (500, b":f00000012"), (600, b":F0008"), (700, b":I00030003"),
                (START + 1, b":F00010003")]
    assert ends(commands, [(400, b"Line drawn.")], bow) == {(48, 80)}
    assert ends(commands, [], bow) == {(REST, REST), (48, 80)}


def test_sequences_have_switches_of_their_own():
    rng = random.Random(1)
    made = [sequence(rng, BIT) for _ in range(60)]
    assert all(each.pressed is not None and len(each.pressed) == len(each.levels)
               for each in made)
    assert all(word in b"".join(each.data for each in made)
               for word in (b":H\n", b"$H\n", b":I", b":F", b"$21=1\n", b"\x84", ANEW))
    kept = [*press_switches(iter(made), 2, 1, BIT)]
    assert (switch_levels(kept) == switch_levels(made)).all() and kept[0] is made[0]


def _homing() -> Input:
    line = np.concatenate([levels(b":H\n", BIT), high(20_000)])
    pressed = np.zeros(len(line), np.uint8)
    pressed[2000:3000], pressed[5000:6000] = 1, 2
    return Input("sequence", b":H\n", line, pressed)


def _sent(*lines: tuple[bytes, int]) -> dict[str, np.ndarray]:
    """Home, send lines with clocks behind each, and end the session."""
    sent = [Input("rest", b"", high(6000)), _homing(), *(
        Input("bytes", text, np.concatenate([levels(text, BIT), high(clocks)]))
        for text, clocks in (*lines, (ANEW + HOME + b"\n", LONG)))]
    return {"rx": np.concatenate([item.levels for item in sent]), "limits": switch_levels(sent)}


def _seen(inputs: dict[str, np.ndarray], mistake: Mistake | None = None) -> dict[str, np.ndarray]:
    design = BOWED.design()
    with CXXRTLEngine(design if mistake is None else mistake.planted(design)) as engine:
        return {**inputs, **engine.apply(inputs, BOWED.outputs)}


def _kinds(seen: dict[str, np.ndarray]) -> set[str]:
    return {failure.kind for failure in BOWED.check(seen["rx"], seen).failures}


LINE = (b":I00080008\n", 12_000), (b":F00150004\n", 8000), (b":S0\n", 30_000)
"""A line, and a question in the middle of it."""


@pytest.fixture(scope="module")
def session():
    """Levels of a session with two bowed lines, the second of which a reset ends."""
    return _seen(_sent(*LINE, (b":I00130006\n", LONG), (b":F00030012\n", 9000)))


def _drawn(seen: dict) -> slice:
    """Return the clocks of the first line."""
    edges = np.flatnonzero(np.diff(seen["pen"].astype(np.int8)))
    return slice(int(edges[0]) + 1, int(edges[1]) + 1)


def _omit(seen: dict) -> None:
    """Leave the last step of a string out of a line."""
    clocks = _drawn(seen)
    words = seen["left"][clocks]
    last = int(np.flatnonzero(np.diff(words))[-1]) + 1
    at = HALF_STEP.index(words[last - 1]) - HALF_STEP.index(words[last])
    other = {0: 0, **{word: HALF_STEP[(row + at) % 8] for row, word in enumerate(HALF_STEP)}}
    rest = seen["left"][clocks.start + last:]
    rest[:] = [other[word] for word in rest.tolist()]


def _shift(seen: dict) -> None:
    """Let a string make its steps a clock later, but for its first one."""
    clocks = _drawn(seen)
    words = seen["left"][clocks]
    first = int(np.flatnonzero(np.diff(words))[0]) + 2
    words[first + 1:] = words[first:-1].copy()


def _lift(seen: dict) -> None:
    seen["pen"][_drawn(seen)] = 0


CHANGES: dict[str, tuple[Callable[[dict], None], str]] = {
    "nothing": (lambda seen: None, ""), "a step that is left out": (_omit, "bow"),
    "steps that come later": (_shift, "bow"), "a pen that does not touch": (_lift, "pen"),
}


MISTAKES = {
    "steps that come too soon": ("bow", Mistake(
        "homing.line.left", lambda right, _: Mux(right == PACE - 1, PACE - 2, right))),
    "another end": ("bow", Mistake("homing.target__0", lambda right, _: right - 32)),
    "another text": ("answer", Mistake(
        "dialect.event", lambda right, _: Mux(right == 8, 9, right))),
    "another state": ("answer", Mistake("dialect.shown", lambda right, _: right ^ 8)),
}


@pytest.mark.compiler
@pytest.mark.long  # the machine is compiled for a minute
@pytest.mark.parametrize("name", CHANGES)
def test_levels_at_the_pins_that_are_changed_are_found(session, name):
    change, kind = CHANGES[name]
    seen = {name: row.copy() for name, row in session.items()}
    change(seen)
    found = _kinds(seen)
    assert kind in found if kind else not found


@pytest.mark.compiler
@pytest.mark.long
@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_in_the_gateware_are_found(name):
    kind, mistake = MISTAKES[name]
    assert kind in _kinds(_seen(_sent(*LINE), mistake))


@pytest.mark.compiler
@pytest.mark.long
def test_sessions_find_nothing():
    (outcome,) = fuzz(BOWED, 2, 3000)
    assert outcome.findings.failures == []
    assert any(item.kind == "sequence" for item in outcome.inputs)
    assert outcome.findings.steps > 100
