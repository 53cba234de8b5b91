# amaranth: UnusedElaboratable=no

"""What a line of digits may start with."""

import re

import pytest

from fresa.protocol import HexWriter


@pytest.mark.parametrize("start", [b"", b"==", "="])
def test_impossible_start(start):
    message = f"a line starts with one character, not {start!r}"
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        HexWriter(digits=2, start=start)
