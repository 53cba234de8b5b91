"""A machine that is quick, and a file."""

from pathlib import Path

import pytest

from tests.host.fake import FakePositioner
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
