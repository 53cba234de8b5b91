"""What the panel keeps: whole, or not at all, and never something that was not written."""

import json
import os
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.tools.process import ROOT
from tools.console import UserError
from tools.panel.settings import Settings, _read, folder, load, save
from tools.panel.stage import Steps
from tools.panel.store import Store

UM = st.none() | st.floats(-14_000, 14_000)
SETTINGS = st.builds(
    Settings, st.text(max_size=20), st.builds(Steps, *[st.integers(-2**31, 2**31 - 1)] * 3),
    st.tuples(*[st.integers(1, 26)] * 3), st.tuples(*[st.tuples(UM, UM, UM)] * 7), st.booleans())
JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=8) | st.dictionaries(st.text(max_size=5), inner))


def test_what_was_written_is_read(tmp_path):
    settings = Settings("/dev/ttyUSB0", Steps(1, -2, 3), (1, 26, 4))
    settings = settings.with_point(7, (1.5, None, -14_000))
    path = tmp_path / "new" / "folder" / "panel.json"
    save(path, settings)
    assert load(path) == settings
    assert os.listdir(path.parent) == ["panel.json"]


@given(SETTINGS)
def test_all_of_it_comes_back(settings):
    from dataclasses import asdict

    assert _read(json.loads(json.dumps(asdict(settings))), 0.0) == settings


def test_a_new_beginning(tmp_path):
    assert load(tmp_path / "none.json") == Settings()


@pytest.mark.parametrize("change", [
    {"steps": [1, 2]}, {"steps": [1, 2, 3.5]}, {"steps": [1, 2, 2**31]}, {"steps": [True, 1, 1]},
    {"speeds": [0, 1, 1]}, {"speeds": [27, 1, 1]}, {"speeds": None}, {"port": 5},
    {"points": [[None] * 3] * 6}, {"points": [[None] * 2] * 7}, {"points": [[1, 2, 14_001]] * 7},
    {"points": [[1, 2, "3"]] * 7}, {"points": [[1, 2, float("nan")]] * 7}])
def test_what_nobody_wrote_is_put_aside(tmp_path, change, capsys):
    path = tmp_path / "panel.json"
    save(path, Settings())
    path.write_text(json.dumps({**json.loads(path.read_text()), **change}))
    assert load(path) == Settings()
    assert not path.exists() and (tmp_path / "panel.json.damaged").exists()
    assert "the panel starts with defaults" in capsys.readouterr().err


@pytest.mark.parametrize("on_since", [True, "5", -1, 1e12, float("nan"), [0]])
def test_a_time_that_nobody_wrote_is_none(tmp_path, on_since):
    path = tmp_path / "panel.json"
    save(path, Settings("/dev/ttyUSB0"))
    path.write_text(json.dumps({**json.loads(path.read_text()), "on_since": on_since}))
    assert load(path) == Settings("/dev/ttyUSB0")


@pytest.mark.parametrize("data", [b"", b"{}", b"[" * 100_000, b"\xff\xfe", b"null", b'"x"',
                                  b"{" + b" " * 70_000 + b"}"])
def test_what_is_no_file_of_ours_is_put_aside(tmp_path, data):
    path = tmp_path / "panel.json"
    path.write_bytes(data)
    assert load(path) == Settings()
    assert (tmp_path / "panel.json.damaged").read_bytes() == data


@given(JSON)
def test_any_json_can_be_read(data):
    try:
        assert isinstance(_read(data, 0.0), Settings)
    except (ValueError, TypeError, KeyError):
        pass


def test_a_failure_leaves_what_was_there(tmp_path, monkeypatch):
    path = tmp_path / "panel.json"
    save(path, Settings("old"))

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(UserError, match="No space left"):
        save(path, Settings("new"))
    monkeypatch.undo()
    assert load(path) == Settings("old") and os.listdir(tmp_path) == ["panel.json"]


def test_a_folder_that_cannot_be_made(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="cannot make folder"):
        save(tmp_path / "file" / "panel.json", Settings())
    with pytest.raises(UserError, match="cannot read"):
        load(tmp_path)


class TestStore:
    def test_one_panel_at_a_time(self, tmp_path):
        path = tmp_path / "new" / "panel.json"
        store = Store(path)
        with pytest.raises(UserError, match="another panel uses .*panel.json: end it first"):
            Store(path)
        other = Store(tmp_path / "new" / "panel-simulated.json")
        other.close()
        store.close()
        Store(path).close()

    def test_a_process_that_is_killed_leaves_no_lock_but_its_mark(self, tmp_path):
        path = tmp_path / "panel.json"
        script = ("import os, signal, sys; from pathlib import Path;"
                  "from tools.panel.store import Store;"
                  "Store(Path(sys.argv[1])).mark(moving=True);"
                  "os.kill(os.getpid(), signal.SIGKILL)")
        assert subprocess.run([sys.executable, "-c", script, path], cwd=ROOT).returncode < 0
        store = Store(path)
        assert store.moving
        store.mark(moving=False)
        store.close()
        store = Store(path)
        assert not store.moving
        store.close()

    def test_a_folder_that_cannot_be_written_to(self, tmp_path, capsys):
        (tmp_path / "file").write_text("")
        with pytest.raises(UserError, match="cannot read"):
            Store(tmp_path / "file" / "panel.json")
        assert "cannot lock" in capsys.readouterr().err


def test_it_is_kept_in_the_users_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    assert folder() == tmp_path / "fresa"
    monkeypatch.delenv("XDG_CONFIG_HOME")
    monkeypatch.setenv("HOME", str(tmp_path))
    assert folder() == tmp_path / ".config" / "fresa"
