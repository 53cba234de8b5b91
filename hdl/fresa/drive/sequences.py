"""Coil words of steppers with four wires to drive, in the order in which a motor follows them.

A motor has two windings. In a word bit 3 is one end of the first, bit 2 one end of the second, and
bits 1 and 0 are their other ends: the order in which unipolar motors are listed and wired. Going
down a table, the field turns the same way in all of them.
"""

from collections.abc import Sequence

__all__ = ["FULL_STEP", "HALF_STEP", "ONE_PHASE", "swap_inner", "valid_sequence"]

HALF_STEP = (0b0110, 0b0010, 0b0011, 0b0001, 0b1001, 0b1000, 0b1100, 0b0100)
"""Both windings on and one alone, by turns: eight steps where the others have four."""

FULL_STEP = HALF_STEP[0::2]
"""Both windings on: BLACK, ORANGE, BROWN, YELLOW of states 1 to 4, ascending (thesis, table 1)."""

ONE_PHASE = HALF_STEP[1::2]
"""One winding on: half the power, and less torque."""


def swap_inner(sequence: Sequence[int]) -> tuple[int, ...]:
    """Swap bits 2 and 1 of each word, which puts the two ends of each winding side by side.

    So the inputs of an H-bridge for a bipolar motor are: bits 3 and 2 are then the ends of the
    first winding, bits 1 and 0 those of the second. The same again leads back.
    """
    return tuple(word & 0b1001 | (word & 0b0100) >> 1 | (word & 0b0010) << 1
                 for word in valid_sequence(sequence))


def valid_sequence(words: Sequence[int]) -> tuple[int, ...]:
    """Return `words` if a motor can go round through them, else raise ValueError."""
    sequence = tuple(words)
    if len(sequence) not in (4, 8) or len(set(sequence)) < len(sequence) or not all(
            isinstance(word, int) and 0 < word < 16 for word in sequence):
        raise ValueError("sequence must be 4 or 8 different coil words from 1 to 15, "
                         f"not {words!r}")
    return sequence
