"""The machine that senders are tried with."""

from collections.abc import Iterator

import pytest

from tb.engines import ENGINES
from tests.senders.machine import Machine, serve


@pytest.fixture(scope="module")
def machine(libraries) -> Iterator[Machine]:
    """A machine that is served to one sender."""
    if reason := ENGINES["cxxrtl"].missing():
        pytest.skip(reason)  # the slow engine takes minutes for a job
    with serve() as machine:
        yield machine
