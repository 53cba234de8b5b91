"""Windows of waveform: their files, signals, and drawings.

`tools.wave` reads them in a process of its own, so that a large window does not block the page.
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

#: Most clocks of a window. `tools.wave` limits the signals of a drawing.
MOST_CLOCKS = 1_000_000

#: Seconds that a query of a window may take.
QUERY_TIMEOUT_S = 60

#: Advice that needs a terminal. The page lists the signals itself.
ADVICE = re.compile("; python -m tools\\.wave .*")

ROOT = Path(__file__).parents[2]


class Windows:
    """The window that was recorded last, in a temporary folder.

    Attributes
    ----------
    last : Window or None
        That window.
    """

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="fresa-", ignore_cleanup_errors=True)
        self._number = 0
        self._querying = asyncio.Lock()
        self.last: Window | None = None

    def close(self) -> None:
        """Delete what was recorded."""
        self._folder.cleanup()

    @property
    def folder(self) -> str:
        """The temporary folder."""
        return self._folder.name

    def place(self) -> Path:
        """Return a path for a new window."""
        self._number += 1
        return Path(self._folder.name) / f"{self._number}.vcd"

    def keep(self, window: Window) -> None:
        """Keep a complete window, and delete those before it.

        A later one may be being recorded.
        """
        self.last = window
        for path in Path(self._folder.name).glob("*.vcd"):
            if int(path.stem) < int(Path(window.path).stem):
                path.unlink(missing_ok=True)

    def about(self) -> dict[str, int] | None:
        """Describe the last window for pages."""
        window = self.last
        return window and {"from": window.clock, "clocks": window.clocks,
                           "requested": window.requested, "bytes": window.size}

    async def signals(self) -> list[dict[str, object]]:
        """List the signals of the last window: path and width in bits."""
        listed = json.loads(await self._query("list", "--json", "--", self._path()))
        return [{"path": signal["path"], "width": signal["bits"]} for signal in listed]

    async def drawing(self, signals: Sequence[str]) -> bytes:
        """Draw signals of the last window, as SVG.

        Raises
        ------
        UserError
            If there is no window, no such signal, or there are too many.
        """
        if not signals:
            raise UserError("choose a signal")
        drawing = self.place().with_suffix(".svg")
        try:
            await self._query("draw", "-o", str(drawing), "--", self._path(), *signals)
            return drawing.read_bytes()
        finally:
            drawing.unlink(missing_ok=True)

    def _path(self) -> str:
        if self.last is None:
            raise UserError("nothing has been recorded: record a window first")
        return self.last.path

    async def _query(self, *arguments: str) -> bytes:
        async with self._querying:
            process = await asyncio.create_subprocess_exec(
                sys.executable, "-m", "tools.wave", *arguments, cwd=ROOT,
                stdin=asyncio.subprocess.DEVNULL, stdout=asyncio.subprocess.PIPE,
                stderr=asyncio.subprocess.PIPE, start_new_session=True)
            try:
                output, errors = await asyncio.wait_for(process.communicate(), QUERY_TIMEOUT_S)
            except TimeoutError:
                raise UserError("that takes too long: record a shorter window") from None
            finally:
                # The process may have started others.
                with suppress(ProcessLookupError):
                    os.killpg(process.pid, signal.SIGKILL)
                await process.wait()
        if process.returncode != 0:
            lines = errors.decode(errors="replace").strip().splitlines() or ["no reason given"]
            line = ADVICE.sub("", lines[-1].removeprefix("error: "))
            raise UserError(line.replace(self._path(), "the window"))
        return output
