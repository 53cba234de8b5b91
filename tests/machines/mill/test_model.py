"""Models, scripts and the comparison: each finds what it is there to find."""

import numpy as np

from tb.compare import first_difference
from tb.machines.mill.actions import Hold, Jog, Mode, Order, Reset, Stop, Together, record
from tb.machines.mill.model import MillInputs, MillModel


def model(**parameters) -> MillModel:
    return MillModel(**{"period": 2, "scan_bits": 3, "z_travel": 3, **parameters})


class TestModel:
    def test_square_by_hand(self):
        """Four sides of 3 steps, 2 clocks each; the order, its end and the rest take 6 clocks."""
        script = [Mode(1), *(Order(x, y) for x, y in [(3, 0), (3, 3), (0, 3), (0, 0)]), Hold(1)]
        machine = model()
        recording = record(machine, script)
        assert machine.phase == [0, 0, 0]
        assert recording.expected["ready"][0] == recording.expected["ready"][-1] == 1
        changes = np.flatnonzero(np.diff(recording.expected["axis_x"]))
        assert np.diff(changes[:3]).tolist() == [2, 2]
        assert len(changes) == 6

    def test_coils_survive_everything_but_power(self):
        machine = model()
        record(machine, [Mode(1), Order(2, 1), Reset(), Mode(0), Hold(2), Mode(1), Stop(), Hold(4)])
        assert machine.phase == [2, 1, 0]


class TestScript:
    def test_levels(self):
        recording = record(
            model(),
            [
                Hold(1),
                Jog(5, 2),
                Hold(1),
                Jog(3, 1, release=False),
                Hold(1),
                Reset(2),
                Stop(1),
                Together((("up", 1), ("start", 1))),
                Hold(1),
            ],
        )
        assert recording.stimulus["jog"] == [0, 5, 5, 0, 3, 3, 3, 3, 3, 3, 3]
        assert recording.stimulus["rst"] == [0] * 6 + [1, 1, 0, 0, 0]
        assert recording.stimulus["stop"] == [0] * 8 + [1, 0, 0]
        assert recording.stimulus["up"] == [0] * 9 + [1, 1]
        assert recording.during(1) == Jog(5, 2) == recording.during(2)
        assert len(recording) == 11

    def test_an_order_waits_for_ready(self):
        recording = record(model(), [Mode(1), Order(4, 0), Order(0, 4)])
        second = recording.actions[-1][0]
        assert recording.expected["ready"][second - 1 : second + 2] == [1, 1, 0]
        assert recording.expected["ready"][-1] == 1
        assert sum(recording.stimulus["start"]) == 2

    def test_an_order_gives_up(self):
        assert len(record(model(), [Mode(1), Stop(), Order(4, 0)])) == 1 + 1 + Order.PATIENCE
        assert len(record(model(), [Order(4, 0)])) == 1  # manual mode

    def test_goes_on_from_the_pins(self):
        pins = MillInputs(mode=1, jog=7)
        recording = record(model(), [Hold(2)], pins)
        assert recording.stimulus["mode"] == [1, 1]
        assert recording.stimulus["jog"] == [7, 7]


class TestCompare:
    def test_first_difference(self):
        expected = {"a": [1, 2, 3, 4], "b": [5, 6, 7, 8]}
        assert first_difference(expected, {**expected, "c": [0]}) is None
        difference = first_difference(expected, {"a": [1, 2, 0, 0], "b": [5, 6, 9, 8]})
        assert difference is not None
        assert (difference.clock, difference.outputs) == (2, {"a": (3, 0), "b": (7, 9)})
        assert str(difference) == "clock 2: a is 0x0, not 0x3, b is 0x9, not 0x7"
