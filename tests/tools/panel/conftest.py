"""A machine that is quick, and a file."""

from pathlib import Path

import pytest

from tests.host.fake_positioner import FakePositioner
from tests.tools.panel.session import Direct
from tools.panel import line, panel, ports


@pytest.fixture
def fake(monkeypatch) -> FakePositioner:
    fake = FakePositioner()
    monkeypatch.setattr(line, "Writer", Direct)
    monkeypatch.setattr(panel, "Port", lambda name: fake)
    monkeypatch.setattr(ports, "find_ports", list)
    monkeypatch.setattr(panel, "POLL_S", 0.01)
    monkeypatch.setattr(panel, "SAVE_INTERVAL_S", 0.01)
    return fake


@pytest.fixture
def path(tmp_path) -> Path:
    return tmp_path / "panel.json"


@pytest.fixture
def soon_stale(monkeypatch) -> None:
    """Take a report for old after a tenth of a second."""
    monkeypatch.setattr("fresa_host.positioner_state.STALE_AFTER", 0.1)
