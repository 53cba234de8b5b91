"""`python -m tools.board` as people start and end it."""

import os
import re
import signal
import socket
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest

from tools.board.__main__ import main

ROOT = Path(__file__).parents[3]
PATIENCE = 180


@pytest.fixture
def started(tmp_path) -> Iterator[subprocess.Popen]:
    """Start the command on a machine that is quick to make. It has a folder for what is passing."""
    process = subprocess.Popen(
        [sys.executable, "-m", "tools.board", "--engine", "amaranth", "--size", "5x5"], cwd=ROOT,
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env={**os.environ, "TMPDIR": str(tmp_path)})
    yield process
    process.kill()
    process.communicate()


def address(process: subprocess.Popen) -> str:
    assert process.stdout is not None
    line = process.stdout.readline()
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/[\w-]{20,}/\n", line)
    return line.strip()


def family(pid: int) -> set[int]:
    """Processes that a process has started, and those that these have."""
    parents = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdecimal():
            try:
                stat = (entry / "stat").read_text()
            except OSError:
                continue
            parents[int(entry.name)] = int(stat.rpartition(")")[2].split()[1])
    found = {pid}
    while more := {child for child, parent in parents.items() if parent in found} - found:
        found |= more
    return found - {pid}


def alive(pids: set[int]) -> set[int]:
    """Give those that have not ended; a zombie has."""
    living = set()
    for pid in pids:
        try:
            state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
        except OSError:
            continue
        if state != "Z":
            living.add(pid)
    return living


def wait_for_none(pids: set[int]) -> None:
    end = time.monotonic() + PATIENCE
    while alive(pids):
        assert time.monotonic() < end, "processes are left"
        time.sleep(0.05)


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks for processes in /proc")
class TestEnd:
    @pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
    def test_leaves_nothing(self, started, number):
        place = address(started)
        with urllib.request.urlopen(place, timeout=PATIENCE) as answer:
            assert answer.status == 200
        children = family(started.pid)
        assert children
        started.send_signal(number)
        _, errors = started.communicate(timeout=PATIENCE)
        assert started.returncode == 0
        assert "Traceback" not in errors and "error" not in errors
        wait_for_none(children)

    def test_killed_it_leaves_nothing_either(self, started, tmp_path):
        address(started)
        children = family(started.pid)
        assert list(tmp_path.iterdir())
        started.kill()
        _, errors = started.communicate(timeout=PATIENCE)
        assert "Traceback" not in errors
        wait_for_none(children)
        assert not list(tmp_path.iterdir())

    def test_open_tells_the_token_to_nobody_else(self, tmp_path):
        """All people on a machine can read what a browser is started with."""
        browser, opened = tmp_path / "browser", tmp_path / "told"
        browser.write_text(f'#!/bin/sh\necho "$1" > {opened}.part && mv {opened}.part {opened}\n')
        browser.chmod(0o755)
        process = subprocess.Popen(
            [sys.executable, "-m", "tools.board", "--engine", "amaranth", "--size", "5x5",
             "--open"], cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
            env={**os.environ, "BROWSER": f"{browser} %s"})
        place = address(process)
        try:
            end = time.monotonic() + PATIENCE
            while not opened.exists():
                assert time.monotonic() < end
                time.sleep(0.05)
            given = opened.read_text().strip()
            assert place.split("/")[-2] not in given
            file = Path(given.removeprefix("file://"))
            assert place in file.read_text()
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=PATIENCE)
        finally:
            process.kill()
            process.communicate()
        assert process.returncode == 0 and not file.exists()

    def test_control_c_of_a_terminal_reaches_all(self):
        """A terminal sends it to every process of the group; nobody complains."""
        process = subprocess.Popen(
            [sys.executable, "-m", "tools.board", "--engine", "amaranth", "--size", "5x5"],
            cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, process_group=0)
        address(process)
        children = family(process.pid)
        os.killpg(process.pid, signal.SIGINT)
        _, errors = process.communicate(timeout=PATIENCE)
        assert process.returncode == 0
        assert "Traceback" not in errors
        wait_for_none(children)


def run(*arguments: object) -> int:
    return main([str(argument) for argument in arguments])


class TestWrong:
    def test_port_in_use(self, capsys):
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            taken.listen()
            assert run("--port", taken.getsockname()[1], "--engine", "amaranth") == 2
        out, err = capsys.readouterr()
        assert out == "" and err.count("\n") == 1 and "in use" in err

    @pytest.mark.parametrize("arguments", [
        ["--port", "65536"], ["--port", "x"], ["--engine", "icarus"], ["--period", "0"],
        ["--period", "493215"], ["--step-rate", "101"], ["--step-rate", "x"],
        ["--period", "5", "--step-rate", "200"], ["--image", "nowhere.png"], ["--size", "0x1"],
    ], ids=" ".join)
    def test_arguments(self, capsys, arguments):
        assert run(*arguments) == 2
        out, err = capsys.readouterr()
        assert out == "" and err.startswith("error: ") and err.count("\n") == 1

    def test_no_compiler(self, capsys, monkeypatch):
        monkeypatch.setenv("CXX", "/nowhere/g++")
        assert run("--engine", "cxxrtl") == 2
        assert "C++ compiler" in capsys.readouterr().err

    @pytest.mark.compiler
    def test_compiler_that_fails(self, capsys, monkeypatch, tmp_path):
        """Its engine was asked for: an error. Else the slow one serves: see test_build.py."""
        monkeypatch.setenv("CXX", "false")
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
        monkeypatch.setenv("YOWASP_CACHE_DIR", str(Path.home() / ".cache" / "YoWASP"))
        assert run("--engine", "cxxrtl", "--size", "5x5") == 2
        err = capsys.readouterr().err
        assert err.splitlines()[-1].startswith("error: ") and "failed" in err


def test_help_teaches(capsys):
    with pytest.raises(SystemExit) as ended:
        run("--help")
    assert ended.value.code == 0
    out = capsys.readouterr().out
    assert "examples:" in out and "SW7" in out and "--step-rate" in out
    assert all(len(line) <= 100 for line in out.splitlines())
