# amaranth: UnusedElaboratable=no

"""LEDs or display: what they show is tested with the machine."""

import pytest

from fresa.panel import Monitor


@pytest.mark.parametrize("scan_bits", [2, 25])
def test_impossible_scan_bits(scan_bits):
    with pytest.raises(ValueError, match=rf"^scan_bits must be .*, not {scan_bits}$"):
        Monitor(scan_bits=scan_bits)
