"""Choices among words, in few lookup tables of four inputs."""

from collections.abc import Sequence

from amaranth import Cat, Const, Mux, Value

__all__ = ["ALL_ONES", "add_choice", "choice_code", "choose", "look_up"]

ALL_ONES = 0b11
"""The code by which :func:`choose` chooses no word, but all ones."""


def choice_code(number: int) -> int:
    """Return the code by which :func:`choose` chooses the word of a number."""
    pair, second = divmod(number, 2)
    return 1 << second if pair == 0 else 2 << pair | (ALL_ONES if second else 0)


def choose(words: Sequence[Value], code: Value, bits: int):
    """Choose one of some words, or 0 with the code 0.

    Each table has two words to choose from, so half as many as there are words choose. The first
    has two bits of the code, and gives a word, or 0 or 1. The others have a bit each: with 0 they
    pass on what is before them, with 1 it says which of their words they take.

    Parameters
    ----------
    words : sequence of Value
        The words, an even number of them.
    code : Value
        A `choice_code`, best from a register.
    bits : int
        Bits of what is chosen.
    """
    first, second, *others = (Mux(bit, (1 << bits) - 1, 0) for bit in code)
    chosen = (first & words[0]) | (second & words[1]) | (first & second)
    # What is before a table is written once, else the text of all tables would be 3 ** tables long.
    for takes, low, high in zip(others, words[2::2], words[3::2], strict=True):
        chosen = ((takes & low) ^ (chosen & (~takes | (low ^ high))))[:bits]
    return chosen[:bits]


def look_up(words: Sequence[int], number: Value, bits: int):
    """Return one of some constants by its number: each bit is a table of its own, of these bits.

    A switch would compare the number with each that there is.

    Parameters
    ----------
    words : sequence of int
        The constants, from number 0 on. Others are 0.
    number : Value
        Which.
    bits : int
        Bits of a constant.
    """
    tables = (sum((word >> bit & 1) << place for place, word in enumerate(words))
              for bit in range(bits))
    return Cat(Const(table, 1 << len(number)).bit_select(number, 1) for table in tables)


def add_choice(number: Value, chosen: Value, carry: Value | None = None):
    """Return ``number + chosen``, and ``+ carry`` if that is given.

    It is written as a difference, of which synthesis inverts the second operand in the lookup
    tables of the carry: those also have room for what chooses it. A sum has none. A bit below the
    lowest takes the carry.

    Parameters
    ----------
    number : Value
        A number.
    chosen : Value
        Another: such as a `Mux`, or what is inverted by a signal. As wide as the sum.
    carry : Value, optional
        One bit more to add.
    """
    inverse = ~(chosen << 1) if carry is None else ~chosen << 1 | ~carry
    return ((number << 1) - inverse) >> 1
