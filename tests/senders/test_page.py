"""What docs/gcode.md says of senders is what is tried with them."""

import re

import pytest

from tests.senders import test_bcnc, test_cncjs, test_grbl_streamer, test_pygrbl_streamer
from tests.tools.process import ROOT

TRIED = {"pygrbl-streamer": test_pygrbl_streamer.TestPygrblStreamer,
         "grbl-streamer": test_grbl_streamer.TestGrblStreamer,
         "cncjs": test_cncjs.TestCncjs, "bCNC": test_bcnc.TestBCNC}
COLUMNS = ["connect", "home", "stream", "hold and resume", "reset", "reconnect", "jog", "overrides",
           "probing", "inches"]
INSTALLED = {"PyPI": ("pyproject.toml", '"{}=={}"'), "npm": (".ci/run", "{}@{}")}
"""What installs the version that the page names, and how it is written there."""


def table() -> list[list[str]]:
    """Return the rows of the table, the first of them its head."""
    section = (ROOT / "docs" / "gcode.md").read_text(encoding="utf-8").split("\n## Senders\n")[1]
    rows = re.findall(r"^\| (.*) \|$", section.partition("\n## ")[0], re.M)
    return [row.split(" | ") for row in rows if not row.startswith("---")]


def tried(tests: type, what: str) -> str:
    """Return what the page says of a column of a sender."""
    test = getattr(tests, f"test_{what.replace(' ', '_')}", None)
    return "–" if test is None else "yes"


def test_each_row_is_of_a_sender_that_is_tried():
    head, *rows = table()
    assert head == ["sender", "from", "version", *COLUMNS]
    assert [name for name, *_ in rows] == [*TRIED]


@pytest.mark.parametrize("name", TRIED)
def test_a_row_says_what_is_tried(name):
    (_, origin, version, *cells), = (row for row in table() if row[0] == name)
    tests = TRIED[name]
    assert version == tests.version
    assert cells == [tried(tests, what) for what in COLUMNS]
    if origin in INSTALLED:
        path, written = INSTALLED[origin]
        assert written.format(name, version) in (ROOT / path).read_text(encoding="utf-8")
