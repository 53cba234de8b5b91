"""Serial ports, as pseudo-terminals: who may open one, and what is said of it."""

import os
import tty
from collections.abc import Iterator

import pytest

from fresa_host import LineLost, Port, Positioner, Single

pytest.importorskip("serial", reason="pyserial missing: pip install -e '.[host]'")
if not hasattr(os, "openpty"):
    pytest.skip("no pseudo-terminals here", allow_module_level=True)


@pytest.fixture
def name() -> Iterator[str]:
    """Give the name of a port at whose other end nobody says anything."""
    machine, port = os.openpty()
    tty.setraw(machine)
    yield os.ttyname(port)
    os.close(port)
    os.close(machine)


@pytest.mark.parametrize("other", [Port, Single, Positioner])
def test_two_never_have_it_open(name, other):
    port = Port(name)
    with pytest.raises(LineLost, match="another program has it open; end that first"):
        other(name)
    port.close()
    Port(name).close()


@pytest.mark.parametrize(("name", "says"), [
    ("/dev/ttyUSB99", "there is no such port; is it plugged in?"),
    ("/dev/pts/99999", "there is no such port; python -m tools.serve prints another each time"),
    (__file__, "it is no serial port"), ("socket://127.0.0.1:1", "nobody listens there"),
    ("bogus://x", "protocol 'bogus' not known"),
])
def test_what_cannot_be_opened(name, says):
    with pytest.raises(LineLost) as caught:
        Port(name)
    assert str(caught.value).startswith(f"{name} cannot be opened: ") and says in str(caught.value)


def test_the_end_of_a_terminal_is_told():
    machine, terminal = os.openpty()
    tty.setraw(machine)
    port = Port(os.ttyname(terminal))
    os.close(terminal)
    os.close(machine)
    for work in (port.read, lambda: port.write(b"x")):
        with pytest.raises(LineLost, match=f"{port.name} is gone: "):
            work()
    port.close()
    port.close()
