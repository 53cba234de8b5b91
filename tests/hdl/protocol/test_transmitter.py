# amaranth: UnusedElaboratable=no

"""The transmitter, against a model that writes a byte as a list of levels."""

import random

import pytest

from fresa.protocol import UARTTransmitter
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.uart import encode


def model(period, offered, rst):
    """Yield ready and tx of each clock; `offered` has a byte or None for each, `rst` resets."""
    to_send = []
    for byte, reset in zip(offered, rst, strict=True):
        ready = len(to_send) <= 1
        yield int(ready), to_send[0] if to_send else 1
        to_send = to_send[1:]
        if byte is not None and ready:
            to_send = encode(bytes([byte]), period)
        if reset:
            to_send = []


def check(period, offered, rst):
    dut = UARTTransmitter(period=period)
    assert dut.period == period
    with AmaranthEngine(component("transmitter", dut)) as engine:
        seen = engine.apply({
            "bytes_valid": [int(byte is not None) for byte in offered],
            "bytes_payload": [byte or 0 for byte in offered],
            "rst": rst,
        }, ["bytes_ready", "tx"])
    expected = list(model(period, offered, rst))
    assert list(zip(seen["bytes_ready"].tolist(), seen["tx"].tolist(), strict=True)) == expected


class TestUARTTransmitter:
    @pytest.mark.parametrize("period", [16, 17, 31])
    def test_every_clock(self, period):
        rng = random.Random(period)
        clocks = 60 * period
        offered = [rng.choice([None] * 3 * period + [rng.randrange(256)]) for _ in range(clocks)]
        rst = [int(rng.random() < 0.1 / period) for _ in range(clocks)]
        check(period, offered, rst)
