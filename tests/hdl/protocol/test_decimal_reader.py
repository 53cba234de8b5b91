# amaranth: UnusedElaboratable=no

"""Decimal numbers, against Python's own."""

import random

import pytest

from fresa.protocol import DecimalReader
from tb.boards import component
from tb.engines import AmaranthEngine

END = 0x100
NONE, NO_DIGITS, OVERFLOW = range(3)
OUTPUTS = ("items_ready", "numbers_valid", "numbers_payload")


def belongs(text: str, item: int, is_signed: bool) -> bool:
    """Say whether an item goes on with what was read of a number."""
    return item < END and (chr(item) in "0123456789"
                           or (is_signed and not text and chr(item) in "+-"))


def meaning(text: str, width: int, is_signed: bool) -> tuple[int, int | None]:
    """Return error and value of what was read."""
    if not text.strip("+-"):
        return NO_DIGITS, None
    low, high = (-2**(width - 1), 2**(width - 1)) if is_signed else (0, 2**width)
    return (NONE, int(text)) if low <= int(text) < high else (OVERFLOW, None)


def check(width, is_signed, offered, ready, rst=None):
    """Compare every clock; `offered` has an item or None for each. Return what was taken."""
    rst = rst or [0] * len(offered)
    dut = DecimalReader(width=width, is_signed=is_signed)
    with AmaranthEngine(component("reader", dut)) as engine:
        seen = {name: [] for name in OUTPUTS}
        for item, take, reset in zip(offered, ready, rst, strict=True):
            engine.set(items_valid=int(item is not None), items_payload=item or 0,
                       numbers_ready=take, rst=reset)
            for name, value in zip(OUTPUTS, engine.get(*OUTPUTS), strict=True):
                seen[name].append(value)
            engine.run(1)
    text, waits, numbers = "", False, []
    for clock, (item, take, reset) in enumerate(zip(offered, ready, rst, strict=True)):
        room, valid, number = (seen[name][clock] for name in OUTPUTS)
        goes_on = item is not None and not waits and belongs(text, item, is_signed)
        assert valid == waits, clock
        if item is not None:
            assert room == goes_on, clock
        if waits:
            error, value = meaning(text, width, is_signed)
            assert number >> width == error, clock
            assert value is None or number % 2**width == value % 2**width, clock
            if take:
                numbers.append((error, value))
                text, waits = "", False
        elif item is not None and goes_on:
            text += chr(item)
        elif item is not None:
            waits = True
        if reset:
            text, waits = "", False
    return numbers


def read(*texts: str, width: int = 32, is_signed: bool = False) -> list[tuple[int, int | None]]:
    """Read one number of each line; return its error and its value."""
    offered = []
    for text in texts:
        at = 0
        while at < len(text) and belongs(text[:at], ord(text[at]), is_signed):
            offered.append(ord(text[at]))
            at += 1
        rest = ord(text[at]) if at < len(text) else END
        offered += [rest, rest]  # until the number is taken
    return check(width, is_signed, offered, [1] * len(offered))


class TestEveryClock:
    @pytest.mark.parametrize("is_signed", [False, True])
    @pytest.mark.parametrize("width", [5, 32])
    def test_items_of_any_kind(self, width, is_signed):
        rng = random.Random(width)
        kinds = [*b"0123456789" * width, *b"+-" * 3, *b" x?", END, 0x130, 0x12D, None, None]
        numbers = check(width, is_signed, [rng.choice(kinds) for _ in range(3000)],
                        [int(rng.random() < 0.7) for _ in range(3000)],
                        [int(rng.random() < 0.01) for _ in range(3000)])
        assert {error for error, _ in numbers} == {NONE, NO_DIGITS, OVERFLOW}


class TestDecimalReader:
    def test_unsigned(self):
        numbers = [
            ("0", (NONE, 0)), ("007", (NONE, 7)), ("4294967295", (NONE, 2**32 - 1)),
            ("0" * 50 + "1", (NONE, 1)), ("4294967296", (OVERFLOW, None)),
            ("42949672960", (OVERFLOW, None)), ("9" * 40, (OVERFLOW, None)),
            ("1" + "0" * 64, (OVERFLOW, None)), ("12a", (NONE, 12)), ("", (NO_DIGITS, None)),
            ("-1", (NO_DIGITS, None)), ("+1", (NO_DIGITS, None)), (" 1", (NO_DIGITS, None)),
            ("1.5", (NONE, 1)), ("/", (NO_DIGITS, None)), (":", (NO_DIGITS, None)),
        ]
        texts = [text for text, _ in numbers]
        assert read(*texts) == [expected for _, expected in numbers]
