"""Windows of waveform: their files, signals, and drawings.

`tools.wave` reads them in a process of its own, so that a large window does not block the page. It
is started with the first recording and kept, since starting takes longer than a query.
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
        self._reader: asyncio.Task[asyncio.subprocess.Process] | None = None
        self.last: Window | None = None

    async def close(self) -> None:
        """Delete what was recorded, and end the process that reads it."""
        await self._end_reader()
        self._folder.cleanup()

    def prepare(self) -> None:
        """Begin to start the process that reads windows, if it does not run."""
        if self._reader is None:
            self._reader = asyncio.create_task(asyncio.create_subprocess_exec(
                sys.executable, "-m", "tools.wave.resident", cwd=ROOT,
                stdin=asyncio.subprocess.PIPE, stdout=asyncio.subprocess.PIPE,
                start_new_session=True))

    async def _end_reader(self) -> None:
        """End that process, with all that it started."""
        starting, self._reader = self._reader, None
        if starting is not None:
            reader = await starting
            with suppress(ProcessLookupError):
                os.killpg(reader.pid, signal.SIGKILL)
            await reader.wait()

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
        folder = Path(self._folder.name)
        output, errors = folder / "output", folder / "errors"
        async with self._querying:
            self.prepare()
            assert self._reader is not None
            reader = await self._reader
            assert reader.stdin is not None and reader.stdout is not None
            order = json.dumps([arguments, str(output), str(errors)]) + "\n"
            status = b""
            try:
                reader.stdin.write(order.encode())
                status = await asyncio.wait_for(reader.stdout.readline(), QUERY_TIMEOUT_S)
            except TimeoutError:
                raise UserError("that takes too long: record a shorter window") from None
            finally:
                if not status:  # it has ended, or a late answer would be taken for the next one
                    await self._end_reader()
            if status.strip() != b"0":
                raise UserError(self._reason(status, errors))
            return output.read_bytes()

    def _reason(self, status: bytes, errors: Path) -> str:
        if not status:
            return "the process that reads waveforms has ended: try again"
        lines = errors.read_text(errors="replace").strip().splitlines() or ["no reason given"]
        line = ADVICE.sub("", lines[-1].removeprefix("error: "))
        return line.replace(self._path(), "the window")
