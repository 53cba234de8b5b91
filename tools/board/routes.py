"""HTTP routes of the board's page: pictures in and out, and waveforms."""

import asyncio
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from aiohttp import web
from PIL import Image

from ..cut_picture import draw_cut
from ..picture import Prepared, encode, preview
from ..web import Refused, site
from .board import Board
from .messages import Job
from .pictures import LARGEST_UPLOAD, prepared

__all__ = ["board_site"]

PAGE = Path(__file__).parent / "page"

LONGEST_NAME = 100

#: Seconds within which a picture must arrive.
UPLOAD_TIMEOUT_S = 30


def board_site(board: Board) -> web.Application:
    """Make the site of a board; see `tools.web.site`."""
    routes = _Routes(board)
    app = site(PAGE, [
        web.get("/ws", board.pages.handle),
        web.post("/job/preview", routes.preview),
        web.post("/job", routes.program),
        web.get("/cut.png", routes.cut),
        web.get("/target.png", routes.target),
        web.get("/wave.vcd", routes.vcd),
        web.get("/wave.json", routes.signals),
        web.get("/wave.svg", routes.drawing),
    ], largest=LARGEST_UPLOAD)

    async def close(_: web.Application) -> None:
        await board.pages.close()

    app.on_shutdown.append(close)
    return app


class _Routes:
    """Handlers of a board's routes. Slow work is done in a thread, one job at a time."""

    def __init__(self, board: Board) -> None:
        self._board = board
        self._working = asyncio.Lock()

    async def preview(self, request: web.Request) -> web.Response:
        _, picture = await self._prepare(request)
        return _png(await asyncio.to_thread(lambda: encode(preview(picture.pixels))))

    async def program(self, request: web.Request) -> web.Response:
        name, picture = await self._prepare(request)
        self._board.program(Job(picture.pixels, name))
        return web.json_response(
            {"rows": picture.height, "columns": picture.width, "count": picture.count})

    async def _prepare(self, request: web.Request) -> tuple[str, Prepared]:
        query: Mapping[str, str] = dict(request.query)
        name = query.pop("name", "")[:LONGEST_NAME] or "picture"
        async with self._working:  # one body at a time, to bound memory
            try:
                data = await asyncio.wait_for(request.read(), UPLOAD_TIMEOUT_S)
            except TimeoutError:
                raise Refused("the picture did not arrive in time: send it again", 408) from None
            return name, await asyncio.to_thread(prepared, data, query)

    async def cut(self, _: web.Request) -> web.Response:
        async with self._working:
            cut = await self._board.cut()
            return _png(await asyncio.to_thread(lambda: encode(draw_cut(cut))), name="cut.png")

    async def target(self, _: web.Request) -> web.Response:
        job = self._board.job
        if job is None:
            raise Refused("the machine is being built: wait for it", 404)
        pixels = np.asarray(job.pixels)
        return _png(await asyncio.to_thread(lambda: encode(Image.fromarray(~pixels))))

    async def vcd(self, _: web.Request) -> web.StreamResponse:
        window = self._board.windows.last
        if window is None:
            raise Refused("nothing has been recorded: record a window first", 404)
        return web.FileResponse(window.path, headers={
            "Content-Type": "application/octet-stream",
            "Content-Disposition": 'attachment; filename="wave.vcd"'})

    async def signals(self, _: web.Request) -> web.Response:
        return web.json_response({"signals": await self._board.windows.signals()})

    async def drawing(self, request: web.Request) -> web.Response:
        names = [name for name in request.query.get("signals", "").split(",") if name]
        svg = await self._board.windows.drawing(names)
        return web.Response(body=svg, content_type="image/svg+xml")


def _png(data: bytes, *, name: str | None = None) -> web.Response:
    response = web.Response(body=data, content_type="image/png")
    if name is not None:
        response.headers["Content-Disposition"] = f'inline; filename="{name}"'
    return response
