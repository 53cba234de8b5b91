# amaranth: UnusedElaboratable=no

"""Messages to lines, against the CRC of zlib."""

import random
import re

import pytest

from fresa.protocol import HexWriter
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.models.orders import checked

OUTPUTS = ["messages_ready", "bytes_valid", "bytes_payload"]


def model(digits, start, offered, ready, rst):
    """Yield the outputs of each clock; `offered` has a message or None for each."""
    rest = b""
    for message, take, reset in zip(offered, ready, rst, strict=True):
        yield int(not rest), int(bool(rest)), rest[0] if rest else None
        if not rest and message is not None:
            rest = start + checked(f"{message:0{digits}X}").encode() + b"\r\n"
        elif take:
            rest = rest[1:]
        if reset:
            rest = b""


class TestHexWriter:
    @pytest.mark.parametrize(("digits", "start"), [(2, b":"), (8, b"="), (14, b"!")])
    @pytest.mark.parametrize("share", [0.4, 1.0])
    def test_every_clock(self, digits, start, share):
        rng = random.Random(f"{digits} {share}")
        clocks = 3000
        offered = [rng.choice([None, rng.randrange(16**digits)]) for _ in range(clocks)]
        ready = [int(rng.random() < share) for _ in range(clocks)]
        rst = [int(rng.random() < 0.003) for _ in range(clocks)]
        with AmaranthEngine(component("writer", HexWriter(digits=digits, start=start))) as engine:
            seen = engine.apply({
                "messages_valid": [int(message is not None) for message in offered],
                "messages_payload": [message or 0 for message in offered],
                "bytes_ready": ready, "rst": rst}, OUTPUTS)
        lines = 0
        for clock, (room, valid, byte) in enumerate(model(digits, start, offered, ready, rst)):
            row = tuple(int(seen[name][clock]) for name in OUTPUTS)
            assert row == (room, valid, row[2] if byte is None else byte), clock
            lines += byte == ord("\n")
        assert lines > 30

    @pytest.mark.parametrize("start", [b"", b"==", "="])
    def test_impossible_start(self, start):
        message = f"a line starts with one character, not {start!r}"
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            HexWriter(digits=2, start=start)
