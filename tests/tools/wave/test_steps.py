"""Steps out of coil words and out of STEP and DIR."""

import csv
import json
import random

import pytest

from tb.plant import WORDS


def coils(words: list[int | str], apart: int = 10) -> str:
    return "|".join(f"#{apart * n}|b{word if isinstance(word, str) else format(word, 'b')} a"
                    for n, word in enumerate(words))


class TestCoils:
    def test_a_walk(self, vcd, wave, tmp_path):
        rng = random.Random(5)
        signs = [rng.choice([1, -1]) for _ in range(200)]
        phases = [0]
        for sign in signs:
            phases.append((phases[-1] + sign) % 4)
        path = vcd("wire 4 a axis_x", coils([WORDS[phase] for phase in phases]))
        table = tmp_path / "steps.csv"
        status, out, _ = wave("steps", path, "axis_x", "--csv", table, "--json")
        found = json.loads(out)
        assert status == 0 and found["faults"] == []
        assert [row["direction"] for row in found["steps"]] == signs
        assert found["steps"][-1]["position"] == sum(signs) == found["axes"][0]["position"]
        assert found["axes"][0]["most_steps_per_second"] == pytest.approx(1e8)
        rows = list(csv.DictReader(table.read_text().splitlines()))
        assert [int(row["direction"]) for row in rows] == signs
        assert float(rows[0]["seconds"]) == pytest.approx(1e-8)

    def test_the_mill(self, mill, wave):
        """The bench goes to (5, 2), cuts to (8, 5), goes home, and is stopped 4 steps on."""
        status, out, _ = wave("steps", mill, "--summary")
        x, y, z = out.splitlines()
        assert status == 0
        assert "at 7; at least 80ns (4clk) apart" in x  # three by hand, four of the last order
        assert "at -2" in y and "6 forward, 6 back, at 0" in z

    def test_every_word_that_no_motor_can_follow(self, vcd, wave):
        path = vcd("wire 4 a axis_x", coils(
            [WORDS[0], WORDS[1], 0b1111, WORDS[2], WORDS[0], "x1x0", 0, WORDS[1], 0b1110]))
        status, out, _ = wave("steps", path, "axis_x", "--json")
        found = json.loads(out)
        assert status == 1
        assert [(fault["time"], fault["fault"]) for fault in found["faults"]] == [
            ("20ns", "0b1111 is not a coil word"), ("40ns", "a jump to 0b0110, two words on"),
            ("50ns", "x1x0 is not a coil word"), ("60ns", "0b0000 is not a coil word"),
            ("80ns", "0b1110 is not a coil word")]
        assert [row["position"] for row in found["steps"]] == [1, 2, 3]
        status, out, _ = wave("steps", path, "axis_x")
        assert status == 1 and out.count("fault ") == 5

    def test_unknown_at_the_start_is_told(self, vcd, wave):
        path = vcd("wire 4 a axis_x", coils(["xxxx", WORDS[0], WORDS[1]]))
        status, out, _ = wave("steps", path, "axis_x")
        assert status == 1 and "xxxx is not a coil word" in out and "+1 to 1" in out

    def test_within_a_window_positions_are_those_of_the_wave(self, vcd, wave):
        path = vcd("wire 4 a axis_x", coils([WORDS[n % 4] for n in range(10)]))
        _, out, _ = wave("steps", path, "axis_x", "--from", "50ns", "--to", "60ns")
        assert [line.split()[-1] for line in out.splitlines()[:2]] == ["5", "6"]
        assert "2 steps, 2 forward, 0 back, at 6" in out

    def test_the_usual_axes_are_those_that_are_there(self, vcd, wave):
        path = vcd("wire 4 a axis_x\nwire 4 b axis_w", coils([WORDS[0], WORDS[1]]))
        status, out, _ = wave("steps", path, "--summary")
        assert status == 0 and out.startswith("top.axis_x: 1 steps") and out.count("\n") == 1
        status, _, err = wave("steps", vcd("wire 4 a coil", "#0|b1 a"))
        assert status == 2 and "has none of axis_x, axis_y, axis_z" in err

    def test_no_coil_word(self, vcd, wave):
        shown = wave("steps", vcd("wire 3 a a", "#0|b1 a"), "a")[2]
        assert "has 3 bits: a coil word has 4" in shown


class TestPulses:
    def test_forward_and_back(self, vcd, wave):
        path = vcd("wire 1 s step\nwire 1 d dir",
                   "#0|0s|1d|#5|1s|#6|0s|#9|1s|#10|0s|#12|0d|#15|1s|#16|0s")
        status, out, _ = wave("steps", path, "--pair", "step,dir", "--json")
        assert status == 0
        assert [(row["time"], row["position"]) for row in json.loads(out)["steps"]] == [
            ("5ns", 1), ("9ns", 2), ("15ns", 1)]

    def test_faults(self, vcd, wave):
        path = vcd("wire 1 s step\nwire 1 d dir", "#0|0s|#5|1s|#6|0s|#7|1d|#9|1s|0d|#10|0s")
        status, out, _ = wave("steps", path, "--pair", "step,dir", "--json")
        assert status == 1
        assert [(fault["time"], fault["fault"]) for fault in json.loads(out)["faults"]] == [
            ("5ns", "a step while the direction is unknown"),
            ("9ns", "the direction changes with the step")]

    def test_words_are_an_axis_a_bit(self, vcd, wave):
        path = vcd("wire 2 s step\nwire 2 d dir",
                   "#0|b0 s|b10 d|#5|b11 s|#6|b0 s|#9|b10 s|#10|b0 s")
        axes = json.loads(wave("steps", path, "--pair", "step,dir", "--json")[1])["axes"]
        assert [(axis["axis"], axis["position"]) for axis in axes] == [
            ("top.step[0]", -1), ("top.step[1]", 2)]
        assert wave("steps", path, "--pair", "step,nobody")[0] == 2
