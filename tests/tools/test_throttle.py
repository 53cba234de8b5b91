"""The schedule of clocks, and the rate that is shown, in made-up seconds."""

import numpy as np
import pytest

from tools.throttle import LEAST_REST_S, Rate, Throttle


def run(throttle: Throttle, seconds: float, *, most: int, each: float = 0.0) -> tuple[int, int]:
    """Run for some seconds on a computer that makes `most` clocks at once, in `each` seconds."""
    now = start = 1000.0
    throttle.begin(now)
    made = runs = 0
    while now < start + seconds:
        due = min(throttle.due(now), most)
        if due > 0:
            now += each
            throttle.made(due, now)
            made, runs = made + due, runs + 1
        now += max(throttle.wait(now), 1e-4)
    return made, runs


class TestPace:
    @pytest.mark.parametrize("speed", [0.1, 1, 7.3, 100, 12_345, 1e6])
    def test_keeps_the_schedule(self, speed):
        throttle = Throttle()
        throttle.speed = speed
        made, runs = run(throttle, 100, most=1 << 20, each=0.0005)
        assert made == pytest.approx(100 * speed, abs=1 + speed * 0.01)
        assert runs <= 1.01 * min(made, 100 / LEAST_REST_S) + 1
        assert not throttle.restarts

    def test_does_not_make_up_for_what_cannot_be_done(self):
        throttle = Throttle()
        throttle.speed = 1e6
        made, _ = run(throttle, 10, most=1000, each=0.01)  # a tenth of that speed
        assert made == pytest.approx(1e6, rel=0.05)
        assert throttle.restarts > 10
        # And after that all is due no faster than it should be.
        now = 2000.0
        throttle.begin(now)
        assert throttle.due(now + 0.1) == pytest.approx(100_000, abs=1)
        assert throttle.due(now + 3600) <= 1

    def test_without_a_limit_all_is_due(self):
        throttle = Throttle()
        throttle.begin(0)
        throttle.made(10, 0)
        assert throttle.due(0) > 1e9
        assert throttle.wait(0) == 0

    def test_begins_anew(self):
        throttle = Throttle()
        throttle.speed = 10
        throttle.begin(0)
        assert throttle.due(0.2) == 2
        throttle.begin(0.2)
        assert (throttle.due(0.2), throttle.due(0.31)) == (0, 1)


class TestRate:
    def test_of_the_last_second(self):
        rate = Rate()
        assert rate.update(0, 0) == 0
        clocks = np.cumsum([10] * 60 + [1000] * 90)
        shown = [rate.update(n / 30, int(clock)) for n, clock in enumerate(clocks, start=1)]
        assert shown[10] == pytest.approx(300)
        assert shown[-1] == pytest.approx(30_000, rel=0.04)

    def test_over_a_longer_time_if_asked(self):
        rate = Rate()
        shown = [rate.update(n / 30, n // 300, 50) for n in range(3000)]  # a clock in 10 s
        assert all(value == pytest.approx(0.1, rel=0.3) for value in shown[1500:])

    def test_forgets(self):
        rate = Rate()
        rate.update(0, 1_000_000)
        rate.clear()
        assert rate.update(1, 5) == 0
        assert rate.update(2, 6) == 1
