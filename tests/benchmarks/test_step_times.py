"""How near to their instants steps have to be."""

import json
import random
from dataclasses import replace

import pytest

from benchmarks import step_times
from benchmarks.ideal import ideal
from benchmarks.step_instants import Instants, instants, program
from benchmarks.step_times import MOST_APART, MOST_PART, is_right, main, step_line, step_summary

SLOW, FAST = ("lines", "1 lines 37"), ("short", "short 3")
"""Programs: four moves of a step, at 1.7 steps/s, and short segments."""


def run(kind: str, seed: str) -> Instants:
    """Run a random program."""
    return instants(program(kind, random.Random(seed)))


def test_where_ticks_are_long_a_step_is_within_millionths_of_its_time():
    found = run(*SLOW)
    assert found.fastest < 4 and len(found.ticks) == 4
    figure = step_summary([found])
    assert figure["apart"] == (abs(found.ticks) > MOST_APART).sum() == 3 and is_right(figure)
    assert figure["apart_part"] == abs(found.parts).max() < 1e-6 < MOST_PART
    assert "3 beyond 8 clocks by 0.95 millionths of a step at most" in step_line(figure)


def test_a_part_is_of_a_step_at_the_nominal_speed():
    made = program(*SLOW[:1], random.Random(SLOW[1]))
    found = instants(made)
    clocks = found.ticks / found.parts
    assert (clocks >= 50_000_000 / made.rate * 0.999).all()
    assert (clocks <= found.seconds * 50_000_000).all()


@pytest.mark.parametrize(("of", "late"), [(SLOW, 6), (FAST, 9)])
def test_steps_that_are_later_are_not_right(of, late):
    found = run(*of)
    assert is_right(step_summary([found]))
    of_each = found.ticks / found.parts  # clocks of a step
    ticks = found.ticks * late if of is SLOW else found.ticks + late
    figure = step_summary([found, replace(found, ticks=ticks, parts=ticks / of_each)])
    assert not is_right(figure)


@pytest.mark.parametrize(("of", "by"), [
    (SLOW, lambda clocks: clocks * 1.00001), (FAST, lambda clocks: clocks + 9)])
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
    assert capsys.readouterr().out.count(f"beyond {apart} clocks") == len(facts["steps"]) == 5
