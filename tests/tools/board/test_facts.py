"""Facts that the page or its documentation must write down a second time."""

import re
from pathlib import Path

from fresa.machines.mill import TOP_SPEED, step_period
from fresa.panel.display import HEX_SEGMENTS
from tb.milling import DEBOUNCE
from tb.plant import WORDS

ROOT = Path(__file__).parents[3]


def test_coil_words():
    """A step forward is the next word, and turns the needle by a quarter."""
    text = (ROOT / "tools" / "board" / "page" / "motors.js").read_text()
    found = re.search(r"const FIELD = new Map\(\[(.*)\]\);", text)
    assert found
    field = {int(word, 2): int(angle)
             for word, angle in re.findall(r"\[0b(\d+), (\d+)\]", found[1])}
    assert field == {word: 45 + 90 * phase for phase, word in enumerate(WORDS)}


def test_shapes_of_digits():
    text = (ROOT / "tools" / "board" / "page" / "drawing.js").read_text()
    found = re.search(r"const DIGITS = \[([^]]*)\];", text)
    assert found
    assert [int(shape, 16) for shape in found[1].split(",")] == list(HEX_SEGMENTS)


def test_numbers_of_the_documentation():
    text = (ROOT / "docs" / "board.md").read_text()
    assert f"{step_period(TOP_SPEED):,}".replace(",", " ") in text
    assert "takes " + {2: "two"}[DEBOUNCE] + " clocks" in text
