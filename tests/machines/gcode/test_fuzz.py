# amaranth: UnusedElaboratable=no

"""Fuzzing `gcode`: mistakes in its gateware are found, with few bytes; and no other."""

from dataclasses import replace

import numpy as np
import pytest
from amaranth import Const, Mux

from tb.engines import AmaranthEngine, CXXRTLEngine
from tb.fuzz import fuzz, run_session
from tb.fuzz.inputs import Input
from tb.fuzz.target import FuzzTarget
from tb.machines.gcode.fuzz import ANEW, BIT, FUZZ
from tb.mistake import Mistake
from tb.uart import FRAME, high, levels

MISTAKES = {  # a few bytes, what is found, the mistake
    "another error": (b"X1X2\n", "answer", Mistake(
        "interpreter.line.error", lambda right, _: Mux(right == 25, 24, right))),
    "a line that is not answered": (b"G5\nG5\nG21\n", "answer", Mistake(
        "reporter.answers__ready", lambda *_: Const(1))),
    "a pulse that is too short": (b"G0X0.05\n", "pins", Mistake(
        "driver_x.step_pin", lambda right, at: right & at("driver_x.wait")[-1])),
}


GANTRY, CONTACTS = FUZZ.others
OF_GANTRY = {
    "a second motor that makes no step": Mistake(
        "driver_z.second_step_pin", lambda *_: Const(0)),
    "a second motor that goes another way": Mistake(
        "driver_z.second_direction_pin", lambda right, _: ~right),
}


def kinds(text: bytes, mistake: Mistake | None = None, target: FuzzTarget = FUZZ) -> set[str]:
    """Send a few bytes, and return the kinds of what is found."""
    sent = [Input("rest", b"", high(6000)), Input("bytes", text, levels(text, BIT)),
            Input("rest", b"", high(65 * FRAME * BIT))]
    design = target.design() if mistake is None else mistake.planted(target.design())
    with AmaranthEngine(design) as engine:
        return {failure.kind for failure in run_session(target, engine, sent).findings.failures}


@pytest.mark.long
@pytest.mark.parametrize("name", MISTAKES)
def test_mistakes_are_found(name):
    text, kind, mistake = MISTAKES[name]
    assert kind in kinds(text, mistake)


@pytest.mark.long
def test_nothing_is_found_where_there_is_no_mistake():
    assert kinds(b"".join(text for text, *_ in MISTAKES.values())) == set()


@pytest.mark.long
@pytest.mark.parametrize("name", OF_GANTRY)
def test_mistakes_of_a_second_motor_are_found(name):
    assert kinds(b"G0Z0.05\n", OF_GANTRY[name], GANTRY) == {"pins"}


@pytest.mark.compiler
@pytest.mark.long
@pytest.mark.parametrize("target", [FUZZ, GANTRY, CONTACTS], ids=["gcode", "gantry", "contacts"])
def test_a_session_finds_nothing(target):
    (outcome,) = fuzz(target, 2, 1500)
    assert outcome.findings.failures == []
    assert outcome.findings.answers > 60
    assert outcome.findings.steps > 100


@pytest.mark.compiler
@pytest.mark.long  # the machine is compiled for a minute
def test_contacts_in_motions_find_steps_that_outlive_a_stop():
    target = replace(CONTACTS, design=lambda: Mistake(
        "drops", lambda *_: Const(0)).planted(CONTACTS.design()))
    (outcome,) = fuzz(target, 7, 12_000)
    assert outcome.findings.failures[0].kind == "answer"


@pytest.mark.compiler
@pytest.mark.long  # the machine is compiled for a minute
def test_a_place_that_is_lost_is_found():
    """By a level at the pins that differs from what the machine has made."""
    end = ANEW + b"$X\nG90G94G53G0X0Y0Z0\n"
    sent = [Input("rest", b"", high(6000)),
            *(Input("bytes", text, np.concatenate([levels(text, BIT), high(300 * FRAME * BIT)]))
              for text in (b"G91G0X0.1\n", end))]
    with CXXRTLEngine(FUZZ.design()) as engine:
        line = np.concatenate([item.levels for item in sent])
        seen = {"rx": line, **engine.apply({"rx": line}, FUZZ.outputs)}
    assert FUZZ.check(line, seen).failures == []
    rises = np.flatnonzero(np.diff(seen["step"] & 1, prepend=0) == 1)
    seen["step"][rises[3]:rises[3] + 20] &= 0b110
    assert {failure.kind for failure in FUZZ.check(line, seen).failures} == {"place"}
