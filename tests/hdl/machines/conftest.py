"""The machine that tests of `gcode` share, and a terminal at it."""

import pytest

from tb.engines import CXXRTLEngine
from tests.hdl.machines.test_gcode import Session, elaborated_once


@pytest.fixture(scope="module")
def design():
    """Give the machine of all tests."""
    return elaborated_once()


@pytest.fixture
def session(design):
    """Give a terminal at it, from power-up on, and see that it shows no fault in the end."""
    with CXXRTLEngine(design) as engine:
        yield Session(engine)
        assert not engine.get("fault")
