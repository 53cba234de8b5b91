"""Windows of waveform: where they are kept, their signals, and a drawing of some.

`tools.wave` looks into them, in a process of its own: however large a window is, the page goes on.
"""

import asyncio
import json
import os
import re
import signal
import sys
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from ..console import UserError
from .messages import Window

__all__ = ["MOST_CLOCKS", "Windows"]

#: Clocks of a window at most. `tools.wave` limits the signals of a drawing.
MOST_CLOCKS = 1_000_000

#: Seconds that looking into a window may take.
PATIENCE = 60

#: Advice that needs a terminal. On the page the signals are listed.
ADVICE = re.compile("; python -m tools\\.wave .*")

ROOT = Path(__file__).parents[2]


class Windows:
    """The window that was recorded last, in a folder that goes away with this.

    Attributes
    ----------
    last : Window or None
        That window.
    """

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="fresa-", ignore_cleanup_errors=True)
        self._number = 0
        self._looking = asyncio.Lock()
        self.last: Window | None = None

    def close(self) -> None:
        """Delete what was recorded."""
        self._folder.cleanup()

    @property
    def folder(self) -> str:
        """The folder."""
        return self._folder.name

    def place(self) -> Path:
        """Return a place for a new window."""
        self._number += 1
        return Path(self._folder.name) / f"{self._number}.vcd"

    def keep(self, window: Window) -> None:
        """Keep a window that is complete, and delete those before it.

        One after it may be under way.
        """
        self.last = window
        for path in Path(self._folder.name).glob("*.vcd"):
            if int(path.stem) < int(Path(window.path).stem):
                path.unlink(missing_ok=True)

    def about(self) -> dict[str, int] | None:
        """Describe the last window for pages."""
        window = self.last
        return window and {"from": window.clock, "clocks": window.clocks, "asked": window.asked,
                           "bytes": window.size}

    async def signals(self) -> list[dict[str, object]]:
        """List the signals of the last window: path and width in bits."""
        listed = json.loads(await self._look("list", "--json", "--", self._path()))
        return [{"path": signal["path"], "width": signal["bits"]} for signal in listed]

    async def drawing(self, signals: Sequence[str]) -> bytes:
        """Draw signals of the last window, as SVG.

        Raises
        ------
        UserError
            If there is no window, no such signal, or too many are asked for.
        """
        if not signals:
            raise UserError("choose a signal")
        drawing = self.place().with_suffix(".svg")
        try:
            await self._look("draw", "-o", str(drawing), "--", self._path(), *signals)
            return drawing.read_bytes()
        finally:
            drawing.unlink(missing_ok=True)

    def _path(self) -> str:
        if self.last is None:
            raise UserError("nothing has been recorded: record a window first")
        return self.last.path

    async def _look(self, *arguments: str) -> bytes:
        async with self._looking:
            process = await asyncio.create_subprocess_exec(
                sys.executable, "-m", "tools.wave", *arguments, cwd=ROOT,
                stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.PIPE,
                stderr=asyncio.subprocess.PIPE, start_new_session=True)
            try:
                said, errors = await asyncio.wait_for(process.communicate(), PATIENCE)
            except TimeoutError:
                raise UserError("that takes too long: record a shorter window") from None
            finally:
                # It may have started processes of its own.
                with suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
                await process.wait()
        if process.returncode != 0:
            lines = errors.decode(errors="replace").strip().splitlines() or ["no reason given"]
            line = ADVICE.sub("", lines[-1].removeprefix("error: "))
            raise UserError(line.replace(self._path(), "the window"))
        return said
