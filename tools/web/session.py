"""Pages that are sent a state over WebSockets; a slow page does not delay the others.

A page has at most one frame under way. When it sends ``next``, it gets all changes since its last
frame in one frame. Text messages are rare and stored by topic: a page that has not been sent one
yet gets the newest only.
"""

import asyncio
import json
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Protocol

from aiohttp import WSCloseCode, WSMsgType, web

from ..console import UserError
from .site import Refused

__all__ = ["FRAME_INTERVAL", "Pages", "Backend", "View"]

#: Seconds from one frame to the next, at least.
FRAME_INTERVAL = 1 / 30

MOST_PAGES = 16
MOST_ERRORS = 50
MOST_ORDERS = 300  # a second
LONGEST_MESSAGE = 4096

#: Seconds after which a page without an answer to a ping is disconnected.
HEARTBEAT = 30


class View(Protocol):
    """The frames of one page."""

    def frame(self) -> bytes | None:
        """Return changes that the page has not been sent, and mark them as sent; None if none."""
        ...


class Backend(Protocol):
    """What pages show and control."""

    def view(self) -> View:
        """Open a view for a new page."""
        ...

    def left(self, view: View) -> None:
        """Close the view of a page."""
        ...

    def do(self, view: View, name: str, message: Mapping[str, object]) -> None:
        """Carry out a request of a page.

        Raises
        ------
        UserError
            If it cannot be carried out. The page shows the message.
        """
        ...


class _Page:
    """A page that is connected."""

    def __init__(self, view: View) -> None:
        self.view = view
        self.texts: dict[str, str] = {}
        self.ready = True
        self.woken = asyncio.Event()
        self._second, self._orders = 0.0, 0

    def count(self, now: float) -> None:
        """Count a request at a time in seconds; too many are an error."""
        if now >= self._second + 1:
            self._second, self._orders = now, 0
        self._orders += 1
        if self._orders > MOST_ORDERS:
            raise UserError(f"more than {MOST_ORDERS} orders in a second: send fewer")


class Pages:
    """All connected pages.

    Parameters
    ----------
    backend : Backend
        What they show and control.
    changed : callable
        Called when a page connects or disconnects, or can take a frame.

    Attributes
    ----------
    texts : dict of str to str
        Messages that are sent to each new page first, by topic. Set by `publish`.
    """

    def __init__(self, backend: Backend, changed: Callable[[], None] = lambda: None) -> None:
        self._backend = backend
        self._changed = changed
        self._pages: dict[_Page, web.WebSocketResponse] = {}
        self.texts: dict[str, str] = {}

    def __len__(self) -> int:
        return len(self._pages)

    @property
    def ready(self) -> bool:
        """Whether a page can take a frame."""
        return any(page.ready for page in self._pages)

    def publish(self, about: str, fields: Mapping[str, object]) -> None:
        """Send a message to all pages, and to those that connect later."""
        text = json.dumps({"topic": about, **fields})
        if self.texts.get(about) == text:
            return
        self.texts[about] = text
        for page in self._pages:
            page.texts[about] = text
            page.woken.set()

    def wake(self) -> None:
        """Send a frame to every page that can take one and has changes to show."""
        for page in self._pages:
            page.woken.set()

    async def close(self) -> None:
        """Close every connection."""
        await asyncio.gather(*(
            socket.close(code=WSCloseCode.GOING_AWAY, message=b"the server has ended")
            for socket in list(self._pages.values())))

    async def handle(self, request: web.Request) -> web.StreamResponse:
        """Serve a page while it is connected: the handler of its WebSocket."""
        if len(self._pages) >= MOST_PAGES:
            raise Refused(f"{MOST_PAGES} pages are open: close one first", 503)
        socket = web.WebSocketResponse(max_msg_size=LONGEST_MESSAGE, compress=False,
                                       heartbeat=HEARTBEAT, timeout=1.0)
        await socket.prepare(request)
        page = _Page(self._backend.view())
        page.texts = dict(self.texts)
        page.woken.set()
        self._pages[page] = socket
        self._changed()
        sender = asyncio.create_task(self._send(page, socket))
        try:
            await self._receive(page, socket)
        finally:
            del self._pages[page]
            sender.cancel()
            with suppress(asyncio.CancelledError, ConnectionError):
                await sender
            self._backend.left(page.view)
            self._changed()
        return socket

    async def _send(self, page: _Page, socket: web.WebSocketResponse) -> None:
        with suppress(ConnectionError):
            while True:
                await page.woken.wait()
                page.woken.clear()
                while page.texts:
                    await socket.send_str(page.texts.pop(next(iter(page.texts))))
                if page.ready and (frame := page.view.frame()) is not None:
                    page.ready = False
                    await socket.send_bytes(frame)

    async def _receive(self, page: _Page, socket: web.WebSocketResponse) -> None:
        errors = 0
        with suppress(ConnectionError):
            async for message in socket:
                if message.type not in (WSMsgType.TEXT, WSMsgType.BINARY):
                    break
                try:
                    self._handle(page, message.data)
                except UserError as error:
                    errors += 1
                    await socket.send_str(json.dumps({"error": str(error)}))
                    if errors >= MOST_ERRORS:
                        await socket.close(code=WSCloseCode.POLICY_VIOLATION,
                                           message=b"too many mistakes")
                        break

    def _handle(self, page: _Page, data: str | bytes) -> None:
        page.count(asyncio.get_running_loop().time())
        try:
            message = json.loads(data) if isinstance(data, str) else None
        except (ValueError, RecursionError):
            message = None
        if not isinstance(message, dict) or not isinstance(name := message.get("do"), str):
            raise UserError('a message must be JSON, {"do": NAME, ...}')
        if name != "next":
            self._backend.do(page.view, name, message)
        elif not page.ready:
            page.ready = True
            self._changed()
