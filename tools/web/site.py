"""A server for one user on one computer: no one else gets in, and no request of another site.

It listens on the loopback only. That keeps out other machines but not the pages of other sites,
which the user's browser also shows, and not other users of the same computer. So every address
starts with a token that only the user knows, a request must be for this very host (a name that
resolves to the loopback is not enough), and one that comes from a page must come from ours.
"""

import asyncio
import errno
import mimetypes
import secrets
import signal
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Iterator
from contextlib import asynccontextmanager, contextmanager
from pathlib import Path

from aiohttp import web
from aiohttp.web_protocol import RequestHandler

from ..console import UserError

__all__ = ["Refused", "serve", "site", "stopping"]

HOST = "127.0.0.1"

#: What pages share: the connection to the server, and how things look.
SHARED = Path(__file__).parent / "page"

#: Browsers leave this one out of what they send.
DEFAULT_PORT = 80

#: Bytes of an address with its query. That of a drawing has the paths of its signals.
LONGEST_ADDRESS = 1 << 16

HEADERS = {
    # Only content of this server, never in a frame of another page; its address goes to no one.
    "Content-Security-Policy": "default-src 'self'; img-src 'self' blob: data:; "
    "style-src 'self' 'unsafe-inline'; connect-src 'self' ws://127.0.0.1:* ws://localhost:*; "
    "object-src 'none'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}

#: Python takes types from the system, where some of these are wrong.
TYPES = {".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml",
         ".html": "text/html", ".png": "image/png"}

#: Connections at most that have not shown the token, and seconds that each has to do so.
MOST_STRANGERS = 32
STRANGER_TIMEOUT_S = 5.0

_TOKEN = web.AppKey("token", str)
_LARGEST = web.AppKey("largest", int)
_PORT = web.AppKey("port", list[int])


class _Strangers:
    """Connections that have not shown the token: few, and not for long.

    One too many ends the oldest of them. So they never keep out who has the token and shows it.
    """

    def __init__(self) -> None:
        self._deadlines: dict[asyncio.Transport, asyncio.TimerHandle] = {}

    def add(self, connection: asyncio.Transport) -> None:
        """Count a new connection."""
        for ended in [each for each in self._deadlines if each.is_closing()]:
            self.forget(ended)
        if len(self._deadlines) >= MOST_STRANGERS:
            self._end(next(iter(self._deadlines)))
        loop = asyncio.get_running_loop()
        self._deadlines[connection] = loop.call_later(STRANGER_TIMEOUT_S, self._end, connection)

    def forget(self, connection: asyncio.Transport | None) -> None:
        """Count a connection no more: it has shown the token, or has ended."""
        if connection is not None and (deadline := self._deadlines.pop(connection, None)):
            deadline.cancel()

    def _end(self, connection: asyncio.Transport) -> None:
        self.forget(connection)
        connection.abort()

    def watch(self, server: web.Server) -> None:
        """Count the connections of a server from now on."""
        made = server.connection_made

        def connection_made(handler: RequestHandler, transport: asyncio.Transport) -> None:
            made(handler, transport)
            self.add(transport)

        server.connection_made = connection_made


_STRANGERS = web.AppKey("strangers", _Strangers)


class Refused(UserError):
    """A request that cannot be served; its text, one line, is what to do instead.

    Parameters
    ----------
    message : str
        That line.
    status : int
        Status of HTTP, 400 to 499, or 503 for what may go well later.
    """

    def __init__(self, message: str, status: int = 400) -> None:
        super().__init__(message)
        self.status = status


def site(pages: Path, routes: Iterable[web.RouteDef], *, largest: int) -> web.Application:
    """Make a site: its page, the files of the page, and what else it answers.

    Parameters
    ----------
    pages : path
        Folder of ``index.html``, which is served at ``./``, and of the files that it needs, at
        ``page/NAME``, beside those that all pages share. No folder in it is served.
    routes : iterable of RouteDef
        What else is served. Their paths begin with ``/`` and lie below the token.
    largest : int
        Most bytes of a request's body.

    Returns
    -------
    web.Application
        To be given to `serve`.
    """
    token = secrets.token_urlsafe(16)
    app = web.Application(middlewares=[_errors, _guard], client_max_size=largest)
    app[_TOKEN], app[_LARGEST], app[_PORT] = token, largest, []
    app[_STRANGERS] = _Strangers()
    files = {path.name: path for folder in (SHARED, pages) for path in folder.iterdir()
             if path.is_file()}

    async def index(_: web.Request) -> web.StreamResponse:
        return _file(pages / "index.html")

    async def file(request: web.Request) -> web.StreamResponse:
        path = files.get(request.match_info["name"])
        if path is None:
            raise Refused("there is no such file", 404)
        return _file(path)

    app.router.add_routes([
        web.get(f"/{token}/", index),
        web.get(f"/{token}/page/{{name}}", file),
        *(web.route(route.method, f"/{token}{route.path}", route.handler) for route in routes),
    ])
    return app


def _file(path: Path) -> web.Response:
    kind = TYPES.get(path.suffix) or mimetypes.guess_type(path.name)[0]
    kind = kind or "application/octet-stream"
    charset = "utf-8" if kind.startswith("text/") else None
    return web.Response(body=path.read_bytes(), content_type=kind, charset=charset)


Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


@web.middleware
async def _errors(request: web.Request, handler: Handler) -> web.StreamResponse:
    """Answer what goes wrong in one line of JSON, and give every answer our headers."""
    try:
        response = await handler(request)
    except Refused as error:
        response = _error(str(error), error.status)
    except UserError as error:
        response = _error(str(error), 400)
    except web.HTTPRequestEntityTooLarge:
        limit = request.app[_LARGEST] >> 20
        response = _error(f"that is larger than {limit} MiB: make it smaller first", 413)
    except ConnectionError:
        if request.transport is not None:
            raise
        response = _error("the connection has ended", 400)  # which nobody reads
    except web.HTTPException as error:
        response = _error(_ADVICE.get(error.status, error.reason.lower()), error.status)
    if not response.prepared:
        response.headers.update(HEADERS)
    return response


_ADVICE = {
    404: "there is nothing at this address: open the one that the command printed",
    405: "this address is not asked that way",
}


def _error(message: str, status: int) -> web.Response:
    return web.json_response({"error": " ".join(message.split())}, status=status)


@web.middleware
async def _guard(request: web.Request, handler: Handler) -> web.StreamResponse:
    names = (HOST, "localhost")
    ours = {f"{name}:{port}" for name in names for port in request.app[_PORT]}
    if DEFAULT_PORT in request.app[_PORT]:
        ours |= set(names)
    if request.headers.get("Host", "").lower() not in ours:
        raise Refused("this host is not served here: open the address that the command printed",
                      403)
    origin = request.headers.get("Origin")
    if origin is not None and origin.lower() not in {f"http://{host}" for host in ours}:
        raise Refused("pages of other sites are not served", 403)
    if request.path.startswith(f"/{request.app[_TOKEN]}/"):
        request.app[_STRANGERS].forget(request.transport)
    return await handler(request)


_WHY = {errno.EADDRINUSE: "in use", errno.EACCES: "not allowed"}


@asynccontextmanager
async def serve(app: web.Application, port: int = 0) -> AsyncIterator[str]:
    """Serve a site while the body runs; yield its address.

    Parameters
    ----------
    app : web.Application
        From `site`.
    port : int
        Where to listen; any that is free if 0.

    Raises
    ------
    UserError
        If the port is taken, or cannot be had for another reason.
    """
    runner = web.AppRunner(app, access_log=None, handle_signals=False, shutdown_timeout=1,
                           max_line_size=LONGEST_ADDRESS)
    await runner.setup()
    assert runner.server is not None
    app[_STRANGERS].watch(runner.server)
    try:
        listener = web.TCPSite(runner, HOST, port)
        try:
            await listener.start()
        except OSError as error:
            why = _WHY.get(error.errno or 0, f"not to be had ({error.strerror})")
            raise UserError(f"port {port} is {why}: choose another with --port, or none") from error
        bound: int = runner.addresses[0][1]
        app[_PORT].append(bound)
        yield f"http://{HOST}:{bound}/{app[_TOKEN]}/"
    finally:
        await runner.cleanup()


@contextmanager
def stopping() -> Iterator[asyncio.Event]:
    """Yield an event that Ctrl-C and SIGTERM set, instead of what they do otherwise."""
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stop.set)
    try:
        yield stop
    finally:
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.remove_signal_handler(number)
