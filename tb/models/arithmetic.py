"""Model of arithmetic: operations on words, and tables of them."""

from collections.abc import Iterable, Sequence
from math import isqrt

__all__ = ["compute", "run_table"]


def compute(name: str, high: int, low: int, b: int, flag: int, *,
            width: int) -> tuple[list[int | None], int]:
    """Return the words of a result, None for one that may be any, and the flag after it.

    Parameters
    ----------
    name : str
        Of the operation.
    high, low, b : int
        Both words of the first operand, and the second.
    flag : int
        The flag before it.
    width : int
        Bits of a word.
    """
    size = 1 << width
    pair = high * size + low

    def signed(word: int) -> int:
        return word - size if word >= size // 2 else word

    def words(value: int) -> list[int | None]:
        return [value // size % size, value % size]

    def result(value: int) -> tuple[list[int | None], int]:
        return [value % size], int(not 0 <= value < size)

    match name:
        case "ADD":
            return result(high + b)
        case "ADD_CARRY":
            return result(high + b + flag)
        case "SUBTRACT":
            return result(high - b)
        case "SUBTRACT_BORROW":
            return result(high - b - flag)
        case "DIFFERENCE":
            value = signed(high) - signed(b)
            return [value % size], int(value < 0)
        case "SELECT":
            return [high if flag else b], flag
        case "NEGATE":
            return [(-b if flag else b) % size], flag
        case "MULTIPLY":
            return words(high * b), flag
        case "DIVIDE":
            return [min(pair // b, size - 1) if b else size - 1], flag
        case "REMAINDER":
            return [pair % b if high < b else None], flag
        case "RATIO":
            return [(high << (width - 2)) // b if high < 2 * b else None], flag
        case "ROOT":
            return [isqrt(pair)], flag
        case "NORMALISE":
            amount = min(width + 1, 2 * width - pair.bit_length())
            return [words(pair << amount)[0], amount], flag
        case "SHIFT_LEFT":
            return words(pair << b) if b <= width + 4 else [None, None], flag
        case "SHIFT_RIGHT":
            return words(pair >> b) if b <= width + 4 else [None, None], flag
        case "SHIFT_RIGHT_LONG":
            return words(pair >> b) if b < 2 << width.bit_length() else [None, None], flag
    raise ValueError(f"no operation is named {name!r}")


def run_table(rows: Iterable[tuple[str, int, int, int]], registers: Sequence[int], *,
              width: int) -> list[int]:
    """Return the registers after a table of (operation, a, b, destination).

    A second word goes to the register whose number differs in the lowest bit, and the low word of
    a comes from there. A word that may be any is 0.
    """
    words, flag = list(registers), 0
    for name, a, b, destination in rows:
        found, flag = compute(name, words[a], words[a ^ 1], words[b], flag, width=width)
        for second, word in enumerate(found):
            words[destination ^ second] = word or 0
    return words
