"""The server of our pages: who gets in, what is served, and that no page holds anybody up."""

import asyncio
import errno
import io
import json
import socket
import stat
from collections.abc import Awaitable, Callable
from contextlib import suppress
from importlib import import_module
from pathlib import Path

import pytest
from aiohttp import ClientSession, ClientWebSocketResponse, WSMsgType, web

from tools.console import UserError
from tools.web import Pages, Refused, redirect, serve, site
from tools.web import session as sessions
from tools.web.site import _PORT

LARGEST = 1 << 20

sites = import_module("tools.web.site")  # the package has a function of its name


class Count:
    """Something to look at: a number, and every number that a page has not been shown."""

    def __init__(self) -> None:
        self.numbers: list[int] = []
        self.left_views: list[object] = []
        self.done: list[tuple[str, object]] = []

    def view(self) -> "CountView":
        return CountView(self)

    def left(self, view) -> None:
        self.left_views.append(view)

    def do(self, view, name, message) -> None:
        if name == "fail":
            raise UserError("that cannot be done")
        self.done.append((name, message.get("value")))


class CountView:
    def __init__(self, count: Count) -> None:
        self.count, self.at = count, 0

    def frame(self) -> bytes | None:
        new, self.at = bytes(self.count.numbers[self.at:]), len(self.count.numbers)
        return new or None


class Server:
    """A site with a page, a folder beside it and routes that go wrong."""

    def __init__(self, folder) -> None:
        (folder / "pages" / "deep").mkdir(parents=True)
        (folder / "secret.txt").write_text("secret")
        (folder / "pages" / "deep" / "x.js").write_text("deep")
        (folder / "pages" / "index.html").write_text("<h1>it</h1>")
        (folder / "pages" / "it.js").write_text("export {}")
        (folder / "pages" / "odd.bin").write_bytes(b"\0")
        self.count = Count()
        self.pages = Pages(self.count)

        async def post(request: web.Request) -> web.Response:
            return web.json_response({"bytes": len(await request.read())})

        async def refused(_: web.Request) -> web.Response:
            raise Refused("not\nnow", 409)

        async def wrong(_: web.Request) -> web.Response:
            raise UserError("it is wrong")

        self.app = site(folder / "pages", [
            web.get("/ws", self.pages.handle), web.post("/post", post),
            web.get("/refused", refused), web.get("/wrong", wrong),
        ], largest=LARGEST)


@pytest.fixture
def run(tmp_path) -> Callable[[Callable[..., Awaitable[None]]], None]:
    """Run a test against a server: it is given the server, its address and a client."""
    def run(test: Callable[..., Awaitable[None]]) -> None:
        async def whole() -> None:
            server = Server(tmp_path)
            async with serve(server.app) as address, ClientSession() as client:
                async with asyncio.timeout(20):
                    await test(server, address, client)
                await server.pages.close()

        asyncio.run(whole())

    return run


def paths(address: str) -> tuple[str, str]:
    """Take an address apart: what comes before the token, and the token."""
    root, token, rest = address.rsplit("/", 2)
    assert rest == "" and len(token) >= 20
    return root, token


def port_of(address: str) -> int:
    return int(paths(address)[0].rsplit(":", 1)[1])


async def connect(address: str, request: bytes = b""
                  ) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    """Connect to the server, and send the bytes of a request."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port_of(address))
    writer.write(request)
    with suppress(ConnectionError):  # what is too long is not read to its end
        await writer.drain()
    return reader, writer


async def check_served(address: str, client: ClientSession) -> None:
    """Check that the server still serves its page."""
    async with client.get(address) as answer:
        assert answer.status == 200


class TestSite:
    def test_page_and_its_files(self, run):
        async def test(_, address, client):
            for path, kind, text in [("", "text/html", "<h1>it</h1>"),
                                     ("page/it.js", "text/javascript", "export {}"),
                                     ("page/odd.bin", "application/octet-stream", "\0")]:
                async with client.get(address + path) as answer:
                    assert (answer.status, answer.content_type) == (200, kind)
                    assert await answer.text() == text
                    assert answer.headers["Cache-Control"] == "no-store"
                    assert "default-src 'self'" in answer.headers["Content-Security-Policy"]
                    assert answer.headers["Referrer-Policy"] == "no-referrer"

        run(test)

    def test_two_servers_have_two_tokens(self, tmp_path):
        async def whole():
            tokens = set()
            for name in "ab":
                (tmp_path / name).mkdir()
                async with serve(Server(tmp_path / name).app) as address:
                    tokens.add(paths(address)[1])
            assert len(tokens) == 2

        asyncio.run(whole())

    @pytest.mark.parametrize("path", [
        "page/none.js", "page/", "page/deep", "page/deep/x.js", "page/..%2fsecret.txt",
        "page/%2e%2e/secret.txt", "page/..", "secret.txt", "page/%00", "page/%ff", "none",
    ])
    def test_nothing_else(self, run, path):
        async def test(_, address, client):
            from yarl import URL
            async with client.get(URL(address + path, encoded=True)) as answer:
                assert answer.status == 404
                assert list(await answer.json()) == ["error"]

        run(test)

    @pytest.mark.parametrize("token", ["", "x", "%ff%fe", "..", "{token}x", "{TOKEN}"])
    def test_token(self, run, token):
        async def test(_, address, client):
            root, real = paths(address)
            wrong = token.format(token=real, TOKEN=real.swapcase())
            for path in ("", "page/it.js", "ws", "post"):
                async with client.get(f"{root}/{wrong}/{path}") as answer:
                    assert answer.status == 404
                    assert "address" in (await answer.json())["error"]

        run(test)

    @pytest.mark.parametrize(("header", "value", "status"), [
        ("Host", "127.0.0.1:{port}", 200), ("Host", "localhost:{port}", 200),
        ("Host", "LOCALHOST:{port}", 200), ("Host", "evil.example:{port}", 403),
        ("Host", "127.0.0.1", 403), ("Host", "127.0.0.1:1", 403), ("Host", "", 403),
        ("Host", "127.0.0.1:{port}.evil.example", 403), ("Host", "localhost.:{port}", 403),
        ("Origin", "http://127.0.0.1:{port}", 200), ("Origin", "http://localhost:{port}", 200),
        ("Origin", "https://127.0.0.1:{port}", 403), ("Origin", "http://evil.example", 403),
        ("Origin", "null", 403), ("Origin", "", 403), ("Origin", "http://127.0.0.1:1", 403),
        ("Origin", "http://127.0.0.1:{port}.evil.example", 403),
    ])
    def test_host_and_origin(self, run, header, value, status):
        async def test(server, address, client):
            port = port_of(address)
            headers = {header: value.format(port=port)}
            async with client.get(address, headers=headers) as answer:
                assert answer.status == status
                if status == 403:
                    assert "served" in (await answer.json())["error"]
            async with client.get(address + "ws", headers={
                    **headers, "Connection": "Upgrade", "Upgrade": "websocket",
                    "Sec-WebSocket-Version": "13", "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==",
            }) as answer:
                assert answer.status == (101 if status == 200 else status)
            if status != 200:
                assert len(server.pages) == 0

        run(test)

    @pytest.mark.parametrize(("port", "status"), [(80, 200), (8080, 403)])
    def test_browsers_leave_out_port_80(self, run, port, status):
        async def test(server, address, client):
            server.app[_PORT].append(port)  # as if it listened there too
            for name in ("127.0.0.1", "localhost"):
                headers = {"Host": name, "Origin": f"http://{name}"}
                async with client.get(address, headers=headers) as answer:
                    assert answer.status == status
            async with client.get(address, headers={"Host": "evil.example"}) as answer:
                assert answer.status == 403

        run(test)

    def test_errors_are_a_line(self, run):
        async def test(_, address, client):
            for path, status, error in [("refused", 409, "not now"), ("wrong", 400, "it is wrong")]:
                async with client.get(address + path) as answer:
                    assert answer.status == status
                    assert await answer.json() == {"error": error}
            async with client.post(address + "wrong") as answer:
                assert answer.status == 405

        run(test)

    def test_largest_body(self, run):
        async def test(_, address, client):
            async with client.post(address + "post", data=io.BytesIO(bytes(LARGEST))) as answer:
                assert await answer.json() == {"bytes": LARGEST}

            async def endless():
                for _ in range(64):
                    yield bytes(LARGEST // 8)

            for body in (io.BytesIO(bytes(LARGEST + 1)), endless()):
                async with client.post(address + "post", data=body) as answer:
                    assert answer.status == 413
                    assert "1 MiB" in (await answer.json())["error"]

        run(test)

    def test_listens_on_the_loopback_only(self, run):
        async def test(_, address, client):
            port = port_of(address)
            with open("/proc/net/tcp") as file:
                listening = [line.split()[1] for line in file if line.split()[3] == "0A"]
            assert f"0100007F:{port:04X}" in listening
            assert f"00000000:{port:04X}" not in listening

        run(test)

    def test_port_in_use(self, tmp_path):
        async def whole():
            with socket.socket() as taken:
                taken.bind(("127.0.0.1", 0))
                taken.listen()
                port = taken.getsockname()[1]
                with pytest.raises(UserError, match=f"^port {port} is in use: choose another"):
                    async with serve(Server(tmp_path).app, port):
                        pass

        asyncio.run(whole())

    def test_port_that_cannot_be_had(self, tmp_path, monkeypatch):
        async def start(_) -> None:
            raise OSError(errno.EADDRNOTAVAIL, "Cannot assign requested address")

        async def whole():
            with pytest.raises(UserError, match="^port 81 is not available .Cannot assign"):
                async with serve(Server(tmp_path).app, 81):
                    pass

        monkeypatch.setattr(web.TCPSite, "start", start)
        asyncio.run(whole())

    def test_garbage(self, run, capfd):
        """What is no HTTP is answered by an error, and the server lives."""
        async def test(_, address, client):
            for garbage in (b"\0\xff\n\n", b"GET\r\n\r\n", b"OPTIONS * HTTP/1.1\r\n\r\n",
                            b"GET " + b"/" * 100_000 + b" HTTP/1.1\r\n\r\n"):
                reader, writer = await connect(address, garbage)
                assert (await reader.readline()).split()[1].startswith(b"4")
                writer.close()
            await check_served(address, client)

        run(test)
        assert capfd.readouterr().err == ""


class TestStrangers:
    """Other users of the computer can connect; without the token they get nothing."""

    def test_lock_nobody_out(self, run, caplog):
        async def test(_, address, client):
            idle = [await connect(address) for _ in range(4 * sites.MOST_STRANGERS)]
            async with client.ws_connect(address + "ws") as page, client.get(address) as answer:
                assert answer.status == 200
                for _ in range(4 * sites.MOST_STRANGERS):
                    idle.append(await connect(address))
                await page.send_json({"do": "run"})
                await check_served(address, client)
            ended = [reader for reader, _ in idle[:sites.MOST_STRANGERS] if reader.at_eof()]
            assert len(ended) == sites.MOST_STRANGERS
            for _, writer in idle:
                writer.transport.abort()

        run(test)
        assert not caplog.records

    @pytest.mark.parametrize("data", [b"", b"GET / HTTP/1.1\r\nHost: ",
                                      b"GET /x/ HTTP/1.1\r\nHost: localhost\r\n\r\n"])
    def test_are_not_waited_for(self, run, monkeypatch, data):
        monkeypatch.setattr(sites, "STRANGER_TIMEOUT_S", 0.2)

        async def test(_, address, client):
            async with client.ws_connect(address + "ws") as page:
                reader, writer = await connect(address, data)
                with suppress(ConnectionError):
                    await reader.read()  # to its end
                writer.close()
                await asyncio.sleep(0.3)
                await page.send_json({"do": "fail"})  # who has shown the token stays
                assert "error" in await page.receive_json()

        run(test)

    @pytest.mark.parametrize("data", [
        b"\x16\x03\x01\x02\0\r\n\r\n", b"GET / HTTP/9.9\r\n\r\n",
        b"GET http://[::1 HTTP/1.1\r\n\r\n",
        b"GET / HTTP/1.1\r\nA\0b: c\r\n\r\n", b"GET /" + bytes(1 << 17) + b" HTTP/1.1\r\n\r\n",
        b"POST / HTTP/1.1\r\nContent-Length: -5\r\n\r\n",
        b"POST / HTTP/1.1\r\nContent-Length: 9\r\nContent-Encoding: gzip\r\n\r\n123456789"])
    def test_write_no_tracebacks(self, run, caplog, data):
        async def test(_, address, client):
            for end in ("abort", "close"):
                reader, writer = await connect(address, data)
                if end == "close":
                    with suppress(ConnectionError, TimeoutError):
                        await asyncio.wait_for(reader.read(100), 0.5)
                getattr(writer.transport, end)()
                await asyncio.sleep(0.1)
            await check_served(address, client)

        run(test)
        assert not caplog.records

    def test_a_damaged_body_is_refused(self, run, caplog):
        async def test(_, address, client):
            headers = {"Content-Encoding": "gzip"}
            async with client.post(address + "post", data=b"no gzip", headers=headers) as answer:
                assert answer.status == 400 and "damaged" in (await answer.json())["error"]

        run(test)
        assert not caplog.records

    def test_our_own_mistakes_are_logged(self, run, caplog, monkeypatch):
        def wrong(*_) -> None:
            raise KeyError("of a test")

        async def test(_, address, client):
            monkeypatch.setattr(sites, "_file", wrong)
            async with client.get(address) as answer:
                assert answer.status == 500

        run(test)
        assert "of a test" in caplog.text

    def test_an_upload_that_is_dropped_is_no_mistake_of_ours(self, run, caplog):
        async def test(server, address, client):
            host, token = paths(address)
            for sent, ended in ((0, "abort"), (LARGEST // 2, "abort"), (LARGEST // 2, "close")):
                _, writer = await connect(
                    address, f"POST /{token}/post HTTP/1.1\r\nHost: {host[7:]}\r\n"
                    f"Content-Length: {LARGEST}\r\n\r\n".encode() + bytes(sent))
                await asyncio.sleep(0.1)
                getattr(writer.transport, ended)()
                await asyncio.sleep(0.1)
            await check_served(address, client)

        run(test)
        assert not caplog.records


async def frame(page: ClientWebSocketResponse, seconds: float = 5) -> bytes:
    """Take the next frame, whatever is received before."""
    while (message := await page.receive(seconds)).type == WSMsgType.TEXT:
        pass
    assert message.type == WSMsgType.BINARY, message
    return message.data


async def quiet(page: ClientWebSocketResponse) -> None:
    """Expect nothing."""
    with pytest.raises(asyncio.TimeoutError):
        await page.receive(0.1)


class TestPages:
    def test_frames_on_demand(self, run):
        async def test(server, address, client):
            async with client.ws_connect(address + "ws") as page:
                await quiet(page)
                server.count.numbers += [1]
                server.pages.wake()
                assert await frame(page) == b"\1"
                # A slow page: nothing is kept for it but what is new when it asks again.
                for n in range(2, 200):
                    server.count.numbers += [n]
                    server.pages.wake()
                await quiet(page)
                assert not server.pages.ready
                await page.send_json({"do": "next"})
                while not server.pages.ready:
                    await asyncio.sleep(0.001)
                server.pages.wake()
                assert await frame(page) == bytes(range(2, 200))
                await quiet(page)

        run(test)

    def test_a_slow_page_holds_nobody_up(self, run):
        async def test(server, address, client):
            async with (client.ws_connect(address + "ws") as slow,
                        client.ws_connect(address + "ws") as quick):
                for n in range(200):
                    server.count.numbers += [n]
                    server.pages.wake()
                    assert await frame(quick) == bytes([n])
                    await quick.send_json({"do": "next"})
                    while not server.pages.ready:
                        await asyncio.sleep(0)
                assert await frame(slow) == b"\0"
                await quiet(slow)

        run(test)

    def test_texts_are_told_to_all_and_kept_for_those_who_come(self, run):
        async def test(server, address, client):
            server.pages.publish("job", {"rows": 1})
            async with client.ws_connect(address + "ws") as first:
                assert await first.receive_json() == {"topic": "job", "rows": 1}
                server.pages.publish("job", {"rows": 1})  # is known
                server.pages.publish("state", {"done": True})
                assert await first.receive_json() == {"topic": "state", "done": True}
                async with client.ws_connect(address + "ws") as second:
                    received = [await second.receive_json() for _ in range(2)]
                    assert received == [{"topic": "job", "rows": 1},
                                        {"topic": "state", "done": True}]

        run(test)

    def test_only_the_newest_of_a_kind_waits(self, run):
        async def test(server, address, client):
            async with client.ws_connect(address + "ws") as page:
                await page.send_json({"do": "look"})
                while not server.count.done:
                    await asyncio.sleep(0.001)
                for n in range(1000):  # without giving the page time to take one
                    server.pages.publish("state", {"n": n})
                assert (await page.receive_json())["n"] == 999
                await quiet(page)

        run(test)

    @pytest.mark.parametrize("message", [
        "", "x", "[]", "1", "null", '"do"', "{}", '{"do": 1}', '{"do": null}', '{"do": ["run"]}',
        "[" * 4000, '{"do": "fail"}', "\ud7ff\x00", b"", b"\0\1", '{"do": "next"}x',
    ], ids=repr)
    def test_nonsense_is_answered(self, run, message):
        async def test(server, address, client):
            async with client.ws_connect(address + "ws") as page:
                send = page.send_str if isinstance(message, str) else page.send_bytes
                await send(message)
                assert list(await page.receive_json()) == ["error"]
                await page.send_json({"do": "run", "value": 7})
                while not server.count.done:
                    await asyncio.sleep(0.001)
                assert server.count.done == [("run", 7)]

        run(test)

    def test_too_much_nonsense(self, run):
        async def test(server, address, client):
            async with client.ws_connect(address + "ws") as page:
                for _ in range(sessions.MOST_ERRORS):
                    await page.send_str("x")
                for _ in range(sessions.MOST_ERRORS):
                    assert "JSON" in (await page.receive_json())["error"]
                assert (await page.receive()).type == WSMsgType.CLOSE
                assert page.close_code == 1008

        run(test)

    def test_too_many_orders(self, run):
        async def test(server, address, client):
            most, errors = sessions.MOST_ORDERS, 0
            async with client.ws_connect(address + "ws") as page:
                for _ in range(3 * most):
                    await page.send_json({"do": "run"})
                while (message := await page.receive()).type == WSMsgType.TEXT:
                    assert "orders in a second" in json.loads(message.data)["error"]
                    errors += 1
                assert page.close_code == 1008
            assert errors == sessions.MOST_ERRORS
            assert most <= len(server.count.done) < 3 * most

        run(test)

    def test_too_long(self, run):
        async def test(server, address, client):
            async with client.ws_connect(address + "ws") as page:
                await page.send_str(json.dumps({"do": "run", "value": "x" * 4000}))
                await page.send_str(json.dumps({"do": "run", "value": "x" * 5000}))
                assert (await page.receive()).type == WSMsgType.CLOSE
                assert page.close_code == 1009
            assert [name for name, _ in server.count.done] == ["run"]

        run(test)

    def test_pages_are_bounded(self, run):
        async def test(server, address, client):
            pages = [await client.ws_connect(address + "ws") for _ in range(sessions.MOST_PAGES)]
            async with client.get(address + "ws") as answer:
                assert answer.status == 503
            await pages[0].close()
            while len(server.pages) == sessions.MOST_PAGES:
                await asyncio.sleep(0.001)
            assert len(server.count.left_views) == 1
            async with client.ws_connect(address + "ws"):
                pass
            for page in pages[1:]:
                await page.close()

        run(test)

    def test_a_page_that_breaks_off(self, run):
        async def test(server, address, client):
            page = await client.ws_connect(address + "ws")
            assert len(server.pages) == 1
            transport = page.get_extra_info("socket")
            assert transport is not None
            page._response.connection.transport.abort()
            while len(server.pages):
                await asyncio.sleep(0.001)
            server.pages.wake()
            assert len(server.count.left_views) == 1

        run(test)

    def test_goodbye(self, run):
        async def test(server, address, client):
            async with client.ws_connect(address + "ws") as page:
                closing = asyncio.create_task(server.pages.close())
                assert (await page.receive()).type == WSMsgType.CLOSE
                assert page.close_code == 1001
                await closing

        run(test)


def test_redirect_is_private():
    with redirect("http://127.0.0.1:1/token/") as place:
        file = Path(place.removeprefix("file://"))
        assert stat.S_IMODE(file.stat().st_mode) == 0o600
        assert 'url=http://127.0.0.1:1/token/"' in file.read_text()
        assert "token" not in place
    assert not file.exists()
