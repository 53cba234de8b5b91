# amaranth: UnusedElaboratable=no

"""LEDs or display, never both."""

import pytest

from fresa.panel import Monitor
from tb.boards import component
from tb.engines import AmaranthEngine

X, Y, Z = 0b0110, 0b0011, 0b1001


@pytest.fixture
def engine():
    with AmaranthEngine(component("monitor", Monitor(scan_bits=3))) as engine:
        engine.set(axis_x=X, axis_y=Y, axis_z=Z)
        yield engine


class TestMonitor:
    @pytest.mark.parametrize(
        ("jogging", "word"),
        [
            (0b000, X),
            (0b001, X),
            (0b010, Y),
            (0b011, X),
            (0b100, Z),
            (0b101, X),
            (0b110, Y),
            (0b111, X),
        ],
    )
    def test_x_before_y_before_z(self, engine, jogging, word):
        engine.set(jogging=jogging)
        assert engine.get("leds") == word

    def test_manual_is_dark_on_the_display(self, engine):
        engine.set(count=0x8888)
        assert (engine.apply({"mode": [0] * 64}, ["digits"])["digits"] == 0xF).all()

    def test_automatic_is_dark_on_the_leds(self, engine):
        for jogging in range(8):
            engine.set(mode=1, jogging=jogging)
            assert engine.get("leds") == 0
        seen = engine.apply({"mode": [1] * 64}, ["digits"])["digits"]
        assert set(seen.tolist()) == {0xF, 0xE, 0xD, 0xB, 0x7}

    @pytest.mark.parametrize("scan_bits", [2, 25])
    def test_impossible_scan_bits(self, scan_bits):
        with pytest.raises(ValueError, match=rf"^scan_bits must be .*, not {scan_bits}$"):
            Monitor(scan_bits=scan_bits)
