# amaranth: UnusedElaboratable=no

"""Texts out of a ROM."""

import random

import pytest

from fresa.protocol import TextSource
from tb.boards import component
from tb.engines import AmaranthEngine

OUTPUTS = ("numbers_ready", "bytes_valid", "bytes_payload")
TABLES = [
    (b"ok\r\n",), (b"a", b"b"), (b"ok\r\n", b"err command\r\n", b"?", b"x: ", bytes(range(256))),
]


def model(texts, offered, ready, rst):
    """Yield the outputs of each clock; `offered` has a number or None for each."""
    rest, seen = b"", False
    for number, take, reset in zip(offered, ready, rst, strict=True):
        yield int(not rest), int(seen), rest[0] if seen else None
        if not rest and number is not None and number < len(texts):
            rest = texts[number]
        elif seen and take:
            rest = rest[1:]
            seen = bool(rest)
        else:
            seen = bool(rest)
        if reset:
            rest, seen = b"", False


class TestTextSource:
    @pytest.mark.parametrize("texts", TABLES, ids=len)
    @pytest.mark.parametrize("share", [0.3, 1.0])
    def test_every_clock(self, texts, share):
        rng = random.Random(f"{len(texts)} {share}")
        clocks = 3000
        bits = max(1, (len(texts) - 1).bit_length())
        offered = [rng.choice([None, rng.randrange(2**bits)]) for _ in range(clocks)]
        ready = [int(rng.random() < share) for _ in range(clocks)]
        rst = [int(rng.random() < 0.002) for _ in range(clocks)]
        with AmaranthEngine(component("text", TextSource(texts))) as engine:
            seen = engine.apply({
                "numbers_valid": [int(number is not None) for number in offered],
                "numbers_payload": [number or 0 for number in offered],
                "bytes_ready": ready, "rst": rst}, list(OUTPUTS))
        sent = set()
        for clock, (room, valid, byte) in enumerate(model(texts, offered, ready, rst)):
            row = tuple(int(seen[name][clock]) for name in OUTPUTS)
            assert row == (room, valid, row[2] if byte is None else byte), clock
            sent.add(byte)
        assert sent == {None, *b"".join(texts)}

    @pytest.mark.parametrize(("texts", "message"), [
        ([], "there are 1 to 256 texts, not 0"),
        ([b"a"] * 257, "there are 1 to 256 texts, not 257"),
        ([b"a", b""], "a text has bytes, at least one, not b''"),
        (["ok"], "a text has bytes, at least one, not 'ok'"),
        ([b"a" * 10_000] * 2, "all texts together have 16384 bytes at most, not 20000"),
    ])
    def test_impossible_texts(self, texts, message):
        with pytest.raises(ValueError, match=f"^{message}$"):
            TextSource(texts)
