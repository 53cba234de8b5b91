# amaranth: UnusedElaboratable=no

"""`benchmarks.load`: what it finds on the gateware and on its model, and that it finds mistakes."""

import random
from fractions import Fraction
from itertools import islice

import numpy as np
import pytest

from benchmarks import load
from benchmarks.load import figures, on_model, received_ends
from benchmarks.load_sender import SETTINGS, Machine, Path, nearest, ordered
from fresa.machines.gcode import GCode
from tb.boards import component
from tb.engines import CXXRTLEngine
from tb.models.gcode_ends import moved
from tb.uart import levels

IDLE = np.ones(200, np.uint8)


def ends(data: bytes) -> int | None:
    return received_ends(np.concatenate([IDLE, levels(data, SETTINGS.bit), IDLE]))


class TestPath:
    @pytest.mark.parametrize("short", [False, True])
    @pytest.mark.parametrize("relative", [False, True])
    def test_lines_say_where_they_end(self, relative, short):
        path = Path("some", length=300, turn=9, relative=relative, short=short)
        at, absolute = [Fraction(0)] * 3, False
        lines = [path.line() for _ in range(2000)]
        um = np.cumsum([line.move for line in lines], axis=0)
        for line, end in zip(lines, um.tolist(), strict=True):
            text = line.text.decode().strip()
            if line.answer != b"ok":
                assert text in ("G5", "X1X2", "G1X", "G0G1X1")
                continue
            if text[:2] == "G9":
                absolute, text = text[2] == "0", text[3:]
            text = text.removeprefix("G1")
            for word in text.replace("X", " X").replace("Y", " Y").replace("Z", " Z").split():
                axis = "XYZ".index(word[0])
                at[axis] = Fraction(word[1:]) + at[axis] * (not absolute)
            assert [1000 * each for each in at] == end
        assert absolute is not relative or any(b"G90" in line.text for line in lines)
        assert any(line.answer != b"ok" for line in lines) is not relative
        assert 4000 < abs(um).max() < 12_000


def test_ends_and_steps_are_those_of_rounded_places():
    assert nearest(np.array([2, -1, 2])).tolist() == [1, 0, 1]
    end, steps = ordered([(3, 0, 0), (-3, 1000, 0), (1, 0, -2000)])
    assert end.tolist() == [0, 320, -500] and steps.tolist() == [2, 320, 500]


@pytest.mark.parametrize(("data", "found"), [
    (b"X1\nX2\r\n\r\n\rX", 4), (b"X1?\n!~\x85\x84\n", 2), (b"X\x18\n", None), (b"", 0)])
def test_ends_of_lines_are_counted_as_the_receiver_finds_them(data, found):
    assert ends(data) == found


def test_a_damaged_end_of_a_line_is_an_end():
    line = np.concatenate([IDLE, levels(b"\n\n", SETTINGS.bit), IDLE])
    line[200 + 9 * SETTINGS.bit:200 + 10 * SETTINGS.bit] = 0
    assert received_ends(line) == 1  # and the next begins in what is then a break


class TestModel:
    def test_every_line_ends_where_it_says(self):
        lines, wrong, off = on_model("some", 0.2)
        assert lines > 900 and (wrong, off) == (0, 0)

    def test_a_step_that_is_missing_is_found(self, monkeypatch):
        def without_one(blocks):
            steps = moved(blocks)
            steps[100, 1] -= 1
            return steps

        monkeypatch.setattr(load, "moved", without_one)
        lines, _, off = on_model("some", 0.1)
        assert lines - 120 < off < lines - 90

    def test_a_wrong_answer_is_found(self, monkeypatch):
        line = Path.line
        monkeypatch.setattr(Path, "line", lambda path: line(path)._replace(answer=b"error:20"))
        lines, wrong, _ = on_model("some", 0.05)
        assert lines - 10 < wrong <= lines


@pytest.mark.compiler
@pytest.mark.long
@pytest.mark.usefixtures("libraries")
class TestGateware:
    def test_all_is_as_asked(self):
        found = [*figures(0.06)]
        assert not [str(each) for each in found if not each.right]
        assert len(found) > 30

    def test_an_answer_too_few_and_a_step_too_many_are_found(self, monkeypatch):
        take = Machine._line
        monkeypatch.setattr(Machine, "_line", lambda machine, line: (
            None if line == b"ok" and len(machine.answers) == 40 else take(machine, line)))
        monkeypatch.setattr(load, "ordered", lambda moves: [
            each - 1 for each in ordered(moves)])
        found = {each.name: each for each in islice(figures(0.02), 7)}
        assert not found["streaming: answers not as they should be"].right
        assert found["streaming: steps off the end"].measured == 3
        assert found["streaming: steps that were not ordered"].measured == 3

    def test_a_reaction_that_is_late_is_found(self, monkeypatch):
        monkeypatch.setattr(load, "ALLOWED", -20_000)
        with CXXRTLEngine(component("gcode", GCode(settings=SETTINGS))) as engine:
            found = {each.name: each for each in load._reaction(
                Machine(engine), 1, random.Random(1))}
        assert not found["reset: full speed before it brakes, the longest"].right
        assert not found["hold: full speed before it brakes, the longest"].right


def test_neither_gateware_nor_model_is_a_mistake(capsys):
    assert load.main(["--seconds", "0"]) == 2
    assert "--model-hours" in capsys.readouterr().err
