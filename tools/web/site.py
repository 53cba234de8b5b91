"""An HTTP server for one user of one computer, closed to other users and other sites.

It listens on the loopback only. That excludes other computers, but neither pages of other sites in
the user's browser nor other users of this computer. So every path starts with a secret token, the
Host header must be this host (a name that resolves to the loopback is not enough), and a request
with an Origin must come from a page of this server.
"""

import asyncio
import errno
import logging
import mimetypes
import secrets
import signal
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Iterator
from contextlib import asynccontextmanager, contextmanager
from pathlib import Path

from aiohttp import http_exceptions, web
from aiohttp.web_protocol import RequestHandler

from ..console import UserError

__all__ = ["Refused", "serve", "site", "stopping"]

HOST = "127.0.0.1"

#: Files that all pages share: the connection to the server, and styles.
SHARED = Path(__file__).parent / "page"

#: The default port, which browsers leave out of the Host header.
DEFAULT_PORT = 80

#: Most bytes of a path with its query. That of a drawing has the paths of its signals.
LONGEST_ADDRESS = 1 << 16

HEADERS = {
    # Only content of this server, never in a frame of another page, and no Referer.
    "Content-Security-Policy": "default-src 'self'; img-src 'self' blob: data:; "
    "style-src 'self' 'unsafe-inline'; connect-src 'self' ws://127.0.0.1:* ws://localhost:*; "
    "object-src 'none'; base-uri 'none'; form-action 'self'; frame-ancestors 'none'",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}

#: Python takes MIME types from the system, where some of these are wrong.
TYPES = {".js": "text/javascript", ".css": "text/css", ".svg": "image/svg+xml",
         ".html": "text/html", ".png": "image/png"}

#: Connections at most that have not shown the token, and seconds that each has to do so.
MOST_STRANGERS = 32
STRANGER_TIMEOUT_S = 5.0

#: What a client causes alone, by a request that breaks the protocol or breaks off.
THEIRS = (http_exceptions.HttpProcessingError, web.RequestPayloadError, ConnectionError)


class _Ours(logging.Filter):
    """Logs mistakes of ours: without a token a client could fill a disk with tracebacks."""

    def filter(self, record: logging.LogRecord) -> bool:
        error = record.exc_info[1] if record.exc_info else None
        return not isinstance(error, THEIRS)


_LOG = logging.getLogger(__name__)
_LOG.addFilter(_Ours())

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
    """A request that is refused; the message, one line, names the remedy.

    Parameters
    ----------
    message : str
        The message.
    status : int
        Status of HTTP: 400 to 499, or 503 if it may succeed later.
    """

    def __init__(self, message: str, status: int = 400) -> None:
        super().__init__(message)
        self.status = status


def site(pages: Path, routes: Iterable[web.RouteDef], *, largest: int) -> web.Application:
    """Make a site: its page, the files of the page, and further routes.

    Parameters
    ----------
    pages : path
        Folder of ``index.html``, which is served at ``./``, and of its files, which are served at
        ``page/NAME``, as are those that all pages share. Subfolders are not served.
    routes : iterable of RouteDef
        Further routes. Their paths begin with ``/`` and lie below the token.
    largest : int
        Most bytes of a request's body.

    Returns
    -------
    web.Application
        The argument of `serve`.
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
    """Answer an error with one line of JSON, and give every answer the security headers."""
    try:
        response = await handler(request)
    except Refused as error:
        response = _error(str(error), error.status)
    except UserError as error:
        response = _error(str(error), 400)
    except web.HTTPRequestEntityTooLarge:
        limit = request.app[_LARGEST] >> 20
        response = _error(f"that is larger than {limit} MiB: make it smaller first", 413)
    except web.RequestPayloadError:
        response = _error("the body of the request is damaged: send it again", 400)
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
    405: "this address does not take that method",
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
        TCP port; any free one if 0.

    Raises
    ------
    UserError
        If the port cannot be bound.
    """
    runner = web.AppRunner(app, access_log=None, handle_signals=False, shutdown_timeout=1,
                           max_line_size=LONGEST_ADDRESS, logger=_LOG)
    await runner.setup()
    assert runner.server is not None
    app[_STRANGERS].watch(runner.server)
    try:
        listener = web.TCPSite(runner, HOST, port)
        try:
            await listener.start()
        except OSError as error:
            why = _WHY.get(error.errno or 0, f"not available ({error.strerror})")
            raise UserError(f"port {port} is {why}: choose another with --port, or leave it out"
                            ) from error
        bound: int = runner.addresses[0][1]
        app[_PORT].append(bound)
        yield f"http://{HOST}:{bound}/{app[_TOKEN]}/"
    finally:
        await runner.cleanup()


@contextmanager
def stopping() -> Iterator[asyncio.Event]:
    """Yield an event that Ctrl-C and SIGTERM set, instead of ending the process."""
    stop = asyncio.Event()
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, stop.set)
    try:
        yield stop
    finally:
        for number in (signal.SIGINT, signal.SIGTERM):
            loop.remove_signal_handler(number)
