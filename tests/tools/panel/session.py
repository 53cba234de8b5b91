"""A panel, as pages have it, with a machine that a test makes."""

import asyncio
import json
from collections.abc import Callable
from contextlib import asynccontextmanager
from pathlib import Path

from fresa_host import LineLost, Port
from fresa_host.session import Output
from tools.panel import Panel

__all__ = ["PORT", "STOP", "Direct", "Site", "session"]

PORT = "/dev/fake"
STOP = [b"STOP MOT1\n", b"STOP MOT2\n", b"STOP MOT3\n"]


class Direct:
    """Sends at once what the panel sends in a thread of its own."""

    def __init__(self, port: Port, lost: Callable[[LineLost], None]) -> None:
        self._port, self._lost = port, lost

    def send(self, output: Output) -> None:
        try:
            if output.after_break:
                self._port.send_break()
            self._port.write(output.data)
        except LineLost as error:
            self._lost(error)

    def close(self) -> None:
        pass


class Site:
    """A panel, and what a page would know of it."""

    def __init__(self, panel: Panel) -> None:
        self.panel = panel
        self.page = panel.view()

    def told(self, about: str) -> dict:
        return json.loads(self.panel.pages.texts[about])

    def do(self, name: str, **fields: object) -> None:
        self.panel.do(self.page, name, fields)

    async def until(self, holds: Callable[[], object]) -> None:
        async with asyncio.timeout(20):
            while not holds():
                await asyncio.sleep(0.005)

    async def connect(self) -> None:
        self.do("connect", port=PORT)
        await self.until(lambda: not self.told("state")["doing"])
        assert self.told("state")["connected"], self.told("state")


@asynccontextmanager
async def opened(path: Path):
    panel = Panel(path, PORT)
    try:
        yield Site(panel)
    finally:
        await panel.close()


def session(path: Path, what: Callable) -> None:
    async def run() -> None:
        async with opened(path) as site:
            await what(site)

    asyncio.run(run())
