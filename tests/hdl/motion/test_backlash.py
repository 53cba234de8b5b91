# amaranth: UnusedElaboratable=no

"""The play of gears, against a motor and the load that it pushes."""

import random
import re

import pytest

from fresa.motion import MAX_PLAY, Backlash
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.models import played
from tb.models.motion import BacklashModel
from tb.stimulus import moods


def counted(max_play: int, **rows) -> list[int]:
    with AmaranthEngine(component("backlash", Backlash(max_play=max_play))) as engine:
        return engine.play(rows, ["counted"])["counted"].tolist()


class TestBacklash:
    @pytest.mark.parametrize("max_play", [1, 2, 5, 12, 1000])
    @pytest.mark.parametrize("seed", range(3))
    def test_is_its_model_in_every_clock(self, max_play, seed):
        """Also where the play changes while it is taken up."""
        stimulus = moods({"play": [max_play.bit_length()], "moved": [1], "direction": [1],
                          "rst": [1]}, seed, max_play, 3000)
        assert counted(max_play, **stimulus) == played(BacklashModel().clock, stimulus)["counted"]

    @pytest.mark.parametrize("play", range(6))
    def test_a_load_follows_its_motor(self, play):
        """By a mechanism of two bodies: a pin of the motor in a slot of the load."""
        rng = random.Random(play)
        ways = [way for _ in range(150) for way in [rng.randrange(2)] * rng.randrange(1, 9)]
        seen = counted(5, play=[play] * len(ways), moved=[1] * len(ways), direction=ways)
        pin = slot = 0  # the slot is from `slot` to `slot + play`; it rests where down leaves it
        for way, says in zip(ways, seen, strict=True):
            pin += 1 if way else -1
            pushed = max(slot, pin - play) if way else min(slot, pin)
            assert says == (pushed != slot)
            slot = pushed

    def test_the_play_is_taken_up_at_each_reversal(self):
        ways = [1] * 6 + [0] * 5 + [1] * 2 + [0] * 3
        seen = counted(3, play=[3] * 16, moved=[1] * 16, direction=ways)
        assert seen == [0, 0, 0, 1, 1, 1, 0, 0, 0, 1, 1, 0, 0, 0, 0, 1]

    def test_reset_moves_no_gear(self):
        ways = [1] * 8
        seen = counted(7, play=[5] * 8, moved=[1, 1, 1, 0, 1, 1, 1, 1], direction=ways,
                       rst=[0, 0, 0, 1, 0, 0, 0, 0])
        assert seen == [0, 0, 0, 0, 0, 0, 1, 1]

    @pytest.mark.parametrize("max_play", [0, -1, MAX_PLAY + 1, 2.5])
    def test_impossible_play(self, max_play):
        message = f"max_play must be a whole number from 1 to 1048576, not {max_play!r}"
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            Backlash(max_play=max_play)
