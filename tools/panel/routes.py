"""HTTP routes of the panel's page: the WebSocket for its messages."""

from pathlib import Path

from aiohttp import web

from ..web import site
from .panel import Panel

__all__ = ["panel_site"]

PAGE = Path(__file__).parent / "page"

#: Most bytes of a request's body; the page sends none.
LARGEST = 1 << 10


def panel_site(panel: Panel) -> web.Application:
    """Make the site of a panel; see `tools.web.site`."""
    app = site(PAGE, [web.get("/ws", panel.pages.handle)], largest=LARGEST)

    async def close(_: web.Application) -> None:
        await panel.pages.close()

    app.on_shutdown.append(close)
    return app
