"""What is said of a program that failed."""

import pytest

from fresa_boards.programs import last_words

TRACEBACK = """\
Preparing to run it.
Traceback (most recent call last):
  File "it.py", line 1, in <module>
    work()
OSError: [Errno 28] No space left on device
"""


@pytest.mark.parametrize(("output", "lines", "message"), [
    (TRACEBACK, 5, "OSError: [Errno 28] No space left on device"),
    ("one\ntwo\n\nthree\n", 1, "three"), ("one\ntwo\n\nthree\n", 2, "two\nthree"),
    ("ERROR: no such module\nwhat follows\n", 3, "ERROR: no such module"),
    ("", 1, "it says nothing")])
def test_why_a_program_failed(output, lines, message):
    assert last_words(output, lines) == message
