"""Windows of waveform as files, and the processes that look into them."""

import asyncio
import os
import sys
import time
from pathlib import Path

import pytest

from tools.board import waves
from tools.board.messages import Window
from tools.board.waves import Windows
from tools.console import UserError


def test_keep_deletes_only_what_came_before():
    async def test():
        windows = Windows()
        places = [windows.place() for _ in range(11)]
        for place in places:
            place.touch()
        windows.keep(Window(str(places[9]), 0, 1, 1, 0))
        assert [place.exists() for place in places] == [False] * 9 + [True] * 2
        await windows.close()
        assert not places[10].parent.exists()

    asyncio.run(test())


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks for a process in /proc")
def test_what_takes_too_long_is_ended_with_all_that_it_started(monkeypatch, tmp_path):
    script, child = tmp_path / "python", tmp_path / "child"
    script.write_text(f"#!/bin/sh\nsleep 300 &\necho $! > {child}\nwait\n")
    script.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(script))
    monkeypatch.setattr(waves, "QUERY_TIMEOUT_S", 1.0)

    async def test():
        windows = Windows()
        windows.last = Window("it.vcd", 0, 1, 1, 0)
        with pytest.raises(UserError, match="too long"):
            await windows.signals()
        await windows.close()

    asyncio.run(test())
    pid = int(child.read_text())
    try:
        end = time.monotonic() + 10
        while running(pid):
            assert time.monotonic() < end, "a process is left"
            time.sleep(0.02)
    finally:
        if running(pid):
            os.kill(pid, 9)


def test_queries_share_one_process(monkeypatch, tmp_path):
    """Starting Python takes longer than to read a window."""
    started = []
    start = asyncio.create_subprocess_exec

    async def count(*arguments, **options):
        started.append(process := await start(*arguments, **options))
        return process

    monkeypatch.setattr(asyncio, "create_subprocess_exec", count)
    wave = tmp_path / "it.vcd"
    wave.write_text("$timescale 1ns $end $scope module top $end $var wire 1 ! a $end $upscope $end"
                    " $enddefinitions $end\n#0\n0!\n#5\n1!\n")

    async def test():
        windows = Windows()
        windows.last = Window(str(wave), 0, 1, 1, 0)
        windows.prepare()
        for _ in range(2):
            assert await windows.signals() == [{"path": "top.a", "width": 1}]
            assert b"<svg" in await windows.drawing(["top.a"])
            with pytest.raises(UserError, match="no signal"):
                await windows.drawing(["top.b"])
        assert len(started) == 1
        # A file that cannot be read ends the command only, and the process may end too.
        wave.write_bytes(b"$end" * 100)
        with pytest.raises(UserError):
            await windows.signals()
        assert len(started) == 1
        started[0].kill()
        with pytest.raises(UserError, match="has ended: try again"):
            await windows.signals()
        wave.write_text("$timescale 1ns $end $var wire 1 ! b $end $enddefinitions $end\n#0\n0!\n")
        assert await windows.signals() == [{"path": "b", "width": 1}]
        await windows.close()
        assert started[-1].returncode is not None

    asyncio.run(test())


def running(pid: int) -> bool:
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"
