# amaranth: UnusedElaboratable=no

"""Positions: every step made is in them, and there is no way round."""

import random

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
        """Make a clock with the same inputs for both."""
        mask = (1 << self.width) - 1
        self.engine.set(target_n=~target & mask, run=run, load=load, place=place & mask, rst=rst)
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
