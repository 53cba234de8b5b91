"""Serial ports, as pseudo-terminals: who may open one, and what is said of it."""

import os
import tty
from collections.abc import Iterator
from pathlib import Path

import pytest

import fresa_host
from fresa_host import LineLost, Port

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


OPENED = [each for each in vars(fresa_host).values() if hasattr(each, "close")]


@pytest.mark.parametrize("other", OPENED)
def test_two_never_have_it_open(name, other, tmp_path):
    port = Port(name)
    link = tmp_path / "port"
    link.symlink_to(name)
    for called in (name, link):
        with pytest.raises(LineLost, match="this program has it open already; close that object"):
            other(called)
    port.close()
    Port(name).close()


def test_two_programs_never_have_it_open(name):
    fcntl = pytest.importorskip("fcntl")
    with open(name, "rb") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        with pytest.raises(LineLost, match="another program has it open; end that first"):
            Port(name)


def test_one_that_was_closed_says_so(name):
    port = Port(Path(name))
    port.close()
    for work in (port.read, lambda: port.write(b"x"), lambda: port.waiting):
        with pytest.raises(LineLost, match=f"^{name} was closed$"):
            work()


@pytest.mark.parametrize(("name", "message"), [
    ("/dev/ttyUSB99", "there is no such port; is it plugged in?"),
    ("/dev/pts/99999", "there is no such port; python -m tools.serve prints another each time"),
    (__file__, "it is no serial port"), ("socket://127.0.0.1:1", "no program listens there"),
    ("bogus://x", "protocol 'bogus' not known"),
])
def test_what_cannot_be_opened(name, message):
    with pytest.raises(LineLost) as caught:
        Port(name)
    assert str(caught.value).startswith(f"{name} cannot be opened: ")
    assert message in str(caught.value)


@pytest.fixture
def breaks(monkeypatch) -> list[bool]:
    """Give what any port of pyserial's is told of breaks."""
    import serial

    writes = []
    monkeypatch.setattr(serial.SerialBase, "break_condition", property(
        lambda self: False, lambda self, value: writes.append(value)))
    return writes


def test_a_break_begins_and_ends(breaks):
    port = Port("loop://")
    assert port.can_break
    port.write(b"MOV MOT1 C")  # and is heard by nobody
    port.send_break()
    assert not port.waiting
    assert breaks == [True, False]
    port.close()


def test_a_converter_that_knows_no_break_is_left_in_peace(breaks, monkeypatch):
    def refuse(value: bool) -> None:
        raise OSError(25, "Inappropriate ioctl for device")

    port = Port("loop://")
    monkeypatch.setattr("serial.SerialBase.break_condition", property(
        lambda self: False, lambda self, value: refuse(value)))
    port.send_break()
    port.write(b"STOP")
    assert port.read() == b"STOP"
    port.close()


def test_a_terminal_by_whatever_name_carries_no_break(name, breaks, tmp_path):
    link = tmp_path / "port"
    link.symlink_to(name)
    for other in (name, str(link)):
        port = Port(other)
        assert not port.can_break
        port.send_break()
        port.close()
    assert breaks == []


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
