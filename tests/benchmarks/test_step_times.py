"""How near to their instants steps have to be."""

import json
import random
from dataclasses import replace

import numpy as np
import pytest

from benchmarks import step_times
from benchmarks.ideal import ideal
from benchmarks.step_instants import Instants, instants, program
from benchmarks.step_times import MOST_APART, is_right, main, step_line, step_summary

SLOW, FAST = ("lines", "1 lines 37"), ("short", "short 3")
"""Programs: four moves of a step, at 1.7 steps/s, and short segments."""


def run(kind: str, seed: str) -> Instants:
    """Run a random program."""
    return instants(program(kind, random.Random(seed)))


def test_a_step_that_takes_long_is_within_two_clocks_too():
    found = run(*SLOW)
    assert found.fastest < 4 and len(found.ticks) == 4 and found.seconds > 1
    assert abs(found.ticks).max() < MOST_APART and is_right(step_summary([found]))


def test_where_no_motion_begins_but_the_first_none_is_apart():
    found = run(*FAST)
    assert not len(found.begins) and step_summary([found])["begins"] == [0, 0]


def test_a_motion_begins_behind_the_one_before():
    found = run("lines", "lines 2")
    assert len(found.begins) and abs(found.begins).max() < MOST_APART
    figure = step_summary([found])
    assert figure["begins"] == [round(min(0, found.begins.min()), 2),
                                round(max(0, found.begins.max()), 2)]
    assert f"begins {figure['begins'][0]:+.2f} to {figure['begins'][1]:+.2f}" in step_line(figure)
    late = step_summary([replace(found, begins=np.append(found.begins, 2.5))])
    assert not is_right(late)


@pytest.mark.parametrize("of", [SLOW, FAST])
@pytest.mark.parametrize("late", [-3, 3])
def test_steps_that_are_later_or_earlier_are_not_right(of, late):
    found = run(*of)
    assert is_right(step_summary([found]))
    assert not is_right(step_summary([found, replace(found, ticks=found.ticks + late)]))


@pytest.mark.parametrize(("of", "by"), [
    (SLOW, lambda clocks: clocks * 1.000001), (FAST, lambda clocks: clocks + 3)])
def test_a_profile_that_is_another_is_not_right(of, by, monkeypatch):
    monkeypatch.setattr("benchmarks.step_instants.ideal", lambda *block: by(ideal(*block)))
    assert not is_right(step_summary([run(*of)]))


@pytest.mark.parametrize(("apart", "status"), [(MOST_APART, 0), (0.5, 1)])
def test_it_says_so(apart, status, monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(step_times, "MOST_APART", apart)
    file = tmp_path / "times.json"
    assert main(["--steps", "5", "--programs", "0", "--jobs", "1", "--json", str(file)]) == status
    facts = json.loads(file.read_text(encoding="utf-8"))
    assert facts["good"] == (not status)
    assert capsys.readouterr().out.count("begins ") == len(facts["steps"]) == 5
