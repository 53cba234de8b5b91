"""One motor: the table of its maker."""

from fresa.drive import FULL_STEP

#: Black, orange, brown, yellow.
TABLE = ["-++-", "--++", "+--+", "++--"]


def test_table():
    assert list(FULL_STEP) == [int(row.replace("+", "1").replace("-", "0"), 2) for row in TABLE]
