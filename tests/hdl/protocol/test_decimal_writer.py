# amaranth: UnusedElaboratable=no

"""Numbers in decimal, against Python's own."""

import random

import pytest

from fresa.protocol import DecimalWriter
from tb.boards import component
from tb.engines import AmaranthEngine

OUTPUTS = ("numbers_ready", "bytes_valid", "bytes_payload", "fault")


def model(width, is_signed, offered, ready, rst):
    """Yield the outputs of each clock; `offered` has a number or None for each."""
    digits = len(str(2 ** (width - is_signed) - (not is_signed)))
    plan: list[str | None] = []  # what is to be offered; None for a clock of counting
    for number, take, reset in zip(offered, ready, rst, strict=True):
        now = plan[0] if plan else None
        yield int(not plan), int(now is not None), ord(now) if now else None
        if not plan and number is not None:
            text = str(abs(number)).rjust(digits)
            plan = ["-"] if number < 0 else []
            for digit in text:
                plan += [None] if digit == " " else [*[None] * (int(digit) + 1), digit]
        elif now is None or take:
            plan = plan[1:]
        if reset:
            plan = []


def check(width, is_signed, offered, ready, rst):
    dut = DecimalWriter(width=width, is_signed=is_signed)
    with AmaranthEngine(component("writer", dut)) as engine:
        seen = engine.apply({
            "numbers_valid": [int(number is not None) for number in offered],
            "numbers_payload": [(number or 0) % 2**width for number in offered],
            "bytes_ready": ready, "rst": rst,
        }, list(OUTPUTS))
    expected = model(width, is_signed, offered, ready, rst)
    for clock, (room, valid, byte) in enumerate(expected):
        row = [int(seen[name][clock]) for name in OUTPUTS]
        assert row == [room, valid, row[2] if byte is None else byte, 0], clock


def written(numbers, width=32, is_signed=False) -> bytes:
    text = bytearray()
    dut = DecimalWriter(width=width, is_signed=is_signed)
    with AmaranthEngine(component("writer", dut)) as engine:
        for number in numbers:
            engine.set(numbers_valid=1, numbers_payload=number % 2**width, bytes_ready=1)
            assert engine.get("numbers_ready")
            engine.run(1)
            engine.set(numbers_valid=0)
            began = engine.clock
            while not engine.get("numbers_ready"):
                valid, byte = engine.get("bytes_valid", "bytes_payload")
                text += bytes([byte] if valid else [])
                engine.run(1)
            assert engine.clock - began <= 11 * dut.digits + 1
            text += b" "
    return bytes(text)


class TestDecimalWriter:
    @pytest.mark.parametrize("is_signed", [False, True])
    @pytest.mark.parametrize("width", [5, 8, 32])
    def test_every_clock(self, width, is_signed):
        rng = random.Random(width)
        low, high = (-2**(width - 1), 2**(width - 1)) if is_signed else (0, 2**width)
        clocks = 2000

        def number() -> int | None:
            return rng.choice([None, low, high - 1, 0, rng.randrange(low, high),
                               rng.randrange(low, high) >> rng.randrange(width)])

        check(width, is_signed, [number() for _ in range(clocks)],
              [int(rng.random() < 0.5) for _ in range(clocks)],
              [int(rng.random() < 0.005) for _ in range(clocks)])

    def test_points(self):
        """Numbers have as many decimals as it says, and a digit before the point."""
        with AmaranthEngine(component("writer", DecimalWriter(
                width=12, is_signed=True, most_decimals=3))) as engine:
            text, expected = "", ""
            for number in [0, 1, -1, 10, -99, 100, 2047, -2048]:
                for decimals in 3, 1, 0, 2:
                    engine.set(numbers_valid=1, numbers_payload=number % 2**12,
                               decimals=decimals, bytes_ready=1)
                    engine.run(1)
                    engine.set(numbers_valid=0, decimals=3 - decimals)
                    while not engine.get("numbers_ready"):
                        valid, byte = engine.get("bytes_valid", "bytes_payload")
                        text += chr(byte) if valid else ""
                        engine.run(1)
                    text += " "
                    expected += f"{number / 10**decimals:.{decimals}f} "
        assert text == expected

    @pytest.mark.parametrize("decimals", [-1, 4])
    def test_impossible_decimals(self, decimals):
        with pytest.raises(ValueError, match=f"from 0 to 3, not {decimals}"):
            DecimalWriter(width=12, is_signed=True, most_decimals=decimals)

    @pytest.mark.parametrize("width", [4, 33])
    def test_impossible(self, width):
        with pytest.raises(ValueError, match=f"must be a whole number from 5 to 32, not {width}"):
            DecimalWriter(width=width)

    @pytest.mark.parametrize(("width", "is_signed"), [
        (5, False), (5, True), (32, False), (32, True), (10, False)])
    def test_ends_and_powers(self, width, is_signed):
        low, high = (-2**(width - 1), 2**(width - 1)) if is_signed else (0, 2**width)
        numbers = {low, low + 1, high - 1, high - 2, 0, *(
            sign * (10**n + more) for n in range(10) for more in (-1, 0, 1) for sign in (1, -1))}
        numbers = sorted(n for n in numbers if low <= n < high)
        assert written(numbers, width, is_signed).decode().split() == [str(n) for n in numbers]
