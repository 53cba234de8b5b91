# amaranth: UnusedElaboratable=no

"""Positions: every step made is in them, and there is no way round."""

import random
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fresa.motion import MoveTo
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.models.motion import MoveToModel

RANDOM = settings(deadline=None, database=None, derandomize=True, max_examples=60)


class Axis:
    """A component and its model, clock by clock, and a motor that makes steps when it likes."""

    def __init__(self, width: int, seed: int = 0) -> None:
        self.engine = AmaranthEngine(component("position", MoveTo(width=width)))
        self.model, self.width = MoveToModel(width=width), width
        self.rng = random.Random(seed)

    def __enter__(self) -> "Axis":
        return self

    def __exit__(self, *_) -> None:
        self.engine.close()

    def clock(self, target: int, *, run: int = 1, load: int = 0, place: int = 0, rst: int = 0,
              eager: float = 1) -> None:
        """Make a clock in which both are told the same."""
        mask = (1 << self.width) - 1
        self.engine.set(target=target & mask, run=run, load=load, place=place & mask, rst=rst)
        step, direction = self.model.request(target=target, run=run, load=load)
        moved = int(step and not rst and self.rng.random() < eager)
        self.engine.set(moved=moved)
        assert self.engine.get("step") == step
        assert not step or self.engine.get("direction") == direction
        assert self.engine.get("position") == self.model.position & mask
        self.engine.run(1)
        self.model.clock(moved=moved, direction=direction, load=load, place=place, rst=rst)


def places(width: int) -> st.SearchStrategy[int]:
    end = 1 << width - 1
    return st.one_of(st.integers(max(-4, -end), min(4, end - 1)), st.integers(-end, end - 1),
                     st.sampled_from([-end, 1 - end, end - 2, end - 1]))


class TestMoveTo:
    @pytest.mark.parametrize("width", [2, 5, 32, 64])
    def test_is_its_model_in_every_clock(self, width):
        @RANDOM
        @given(st.lists(st.tuples(places(width), places(width), st.integers(1, 12),
                                  st.sampled_from([0.2, 1]), st.integers(0, 15)), max_size=12),
               st.integers(0, 99))
        def run(phases, seed) -> None:
            with Axis(width, seed) as axis:
                for target, place, clocks, eager, odd in phases:
                    for clock in range(clocks):
                        axis.clock(target, run=int(odd != 1), load=int(odd == 2 and not clock),
                                   place=place, rst=int(odd == 3 and clock == 1), eager=eager)

        run()

    @pytest.mark.parametrize("target", [3, -3, 0])
    def test_goes_there_and_stays(self, target):
        with Axis(8) as axis:
            for _ in range(abs(target)):
                assert axis.model.position != target
                axis.clock(target)
            for _ in range(5):
                assert axis.model.position == target
                axis.clock(target)

    def test_a_target_behind_is_turned_to_at_once(self):
        with Axis(8) as axis:
            for _ in range(5):
                axis.clock(100)
            assert axis.model.position == 5
            axis.clock(-100)
            assert axis.model.position == 4

    @pytest.mark.parametrize("end", [-(1 << 31), (1 << 31) - 1])
    def test_a_movement_without_end_stops_at_the_end(self, end):
        """Across the whole range, in which the way is longer than a position can say."""
        inwards = -1 if end > 0 else 1
        with Axis(32) as axis:
            axis.clock(0, load=1, place=end + 3 * inwards)
            for _ in range(6):
                axis.clock(end)
            assert axis.model.position == end
            axis.clock(~end)
            assert axis.model.position == end + inwards

    def test_stopped_the_target_can_be_set_to_the_place(self):
        with Axis(16) as axis:
            for _ in range(7):
                axis.clock(1000)
            for _ in range(3):
                axis.clock(1000, run=0)
            stopped = axis.model.position
            for _ in range(3):
                axis.clock(stopped)
            assert axis.model.position == stopped == 7

    @pytest.mark.parametrize("width", [1, 65, 3.0])
    def test_impossible_widths(self, width):
        message = f"width must be a whole number from 2 to 64, not {width!r}"
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            MoveTo(width=width)
