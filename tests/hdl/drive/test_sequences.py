"""Tables of coil words: what physics wants of them."""

import pytest

from fresa.drive import FULL_STEP, HALF_STEP, ONE_PHASE, swap_inner

FORWARD = [0b0001, 0b0101, 0b0100, 0b0110, 0b0010, 0b1010, 0b1000, 0b1001]
"""Of a small bipolar motor on an L298, phases 1 to 8, the first bit for the lowest pin."""


def angle(word: int) -> int:
    """Where the field points, in eighths of a turn: windings 3 to 0 pull to 0, 2, 4 and 6."""
    pulls = [2 * (3 - bit) for bit in range(4) if word >> bit & 1]
    if len(pulls) == 1:
        return pulls[0]
    low, high = sorted(pulls)
    return (low + high) // 2 if high - low == 2 else 7


class TestSequences:
    @pytest.mark.parametrize(("sequence", "turn"), [(FULL_STEP, 2), (ONE_PHASE, 2), (HALF_STEP, 1)])
    def test_every_step_turns_the_field_as_far(self, sequence, turn):
        """And the same way in all tables, from the last row to the first too."""
        angles = [angle(word) for word in sequence]
        assert {(b - a) % 8 for a, b in zip(angles, angles[1:] + angles[:1], strict=True)} == {turn}

    @pytest.mark.parametrize("sequence", [FULL_STEP, ONE_PHASE, HALF_STEP])
    def test_no_winding_has_both_ends_on(self, sequence):
        for word in sequence:
            assert not word & word >> 2 & 0b11
        for word in swap_inner(sequence):
            assert 0b11 not in (word & 0b11, word >> 2)

    def test_how_many_windings_are_on(self):
        assert [word.bit_count() for word in FULL_STEP] == [2] * 4
        assert [word.bit_count() for word in ONE_PHASE] == [1] * 4
        assert [word.bit_count() for word in HALF_STEP] == [2, 1] * 4

    def test_bipolar_is_the_order_of_bridges(self):
        """As an L298 wants it: from where the first winding is on alone, the lowest pin first."""
        words = [int(f"{word:04b}"[::-1], 2) for word in swap_inner(HALF_STEP)]
        assert words[5:] + words[:5] == FORWARD
        assert swap_inner(swap_inner(HALF_STEP)) == HALF_STEP

    @pytest.mark.parametrize("words", [
        (), (1,), (1, 2, 4), (1, 2, 4, 4), (1, 2, 4, 16), (0, 1, 2, 4), (1, 2, 4, 8.), range(1, 17),
    ])
    def test_impossible_words(self, words):
        with pytest.raises(ValueError, match=r"^sequence must be 4 or 8 different coil words"):
            swap_inner(words)
