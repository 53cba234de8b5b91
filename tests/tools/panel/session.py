"""A panel, as pages have it, with a machine that a test makes."""

import asyncio
import json
from collections.abc import Callable
from contextlib import asynccontextmanager, suppress
from pathlib import Path

from fresa_host import LineLost
from fresa_host.positioner_link import PositionerLink
from tools.panel import Panel

__all__ = ["PORT", "STOP", "Direct", "Site", "session"]

PORT = "/dev/fake"
STOP = [b"STOP MOT1\n", b"STOP MOT2\n", b"STOP MOT3\n"]


class Direct:
    """Says at once what the panel says in a thread of its own."""

    def __init__(self, link: PositionerLink) -> None:
        self._link = link

    def say(self, orders: bytes) -> None:
        with suppress(LineLost):
            self._link.send(orders)

    def halt(self) -> None:
        with suppress(LineLost):
            self._link.halt()

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
