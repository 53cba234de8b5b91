"""The panel's address: who gets in, and what a page is messages first."""

import asyncio

import pytest
from aiohttp import ClientSession, WSServerHandshakeError

from tools.panel import Panel
from tools.panel.routes import panel_site
from tools.web import serve


def test_a_page_with_the_address_is_told_everything_and_can_ask(tmp_path):
    async def session():
        panel = Panel(tmp_path / "panel.json", "/dev/fake")
        async with serve(panel_site(panel)) as address, ClientSession() as browser:
            for name in ("", "page/main.js", "page/link.js", "page/base.css", "page/hold.js"):
                async with browser.get(address + name) as answer:
                    assert answer.status == 200
            async with browser.ws_connect(address + "ws") as socket:
                messages = [await socket.receive_json(timeout=10) for _ in range(4)]
                assert {message["topic"] for message in messages} == {"hello", "state", "place",
                                                                "settings"}
                await socket.send_json({"do": "speed", "axis": 1, "speed": 9})
                while (messages := await socket.receive_json(timeout=10))["topic"] != "settings":
                    pass
                assert messages["speeds"] == [4, 9, 4]
                await socket.send_json({"do": "connect", "port": "spy:///dev/ttyS0"})
                while "error" not in (messages := await socket.receive_json(timeout=10)):
                    pass
                assert "there is no port spy:///dev/ttyS0" in messages["error"]
        await panel.close()

    asyncio.run(session())


@pytest.mark.parametrize("headers", [{"Origin": "http://evil.example"}, {"Host": "evil.example"}])
def test_pages_of_others_do_not_get_in(tmp_path, headers):
    async def session():
        panel = Panel(tmp_path / "panel.json", "/dev/fake")
        async with serve(panel_site(panel)) as address, ClientSession() as browser:
            with pytest.raises(WSServerHandshakeError) as caught:
                await browser.ws_connect(address + "ws", headers=headers)
            assert caught.value.status == 403
            root = address.rsplit("/", 2)[0]
            for name in ("/", "/ws", "/page/main.js"):
                async with browser.get(root + name) as answer:
                    assert answer.status == 404
        await panel.close()

    asyncio.run(session())


def test_a_request_that_breaks_off_is_no_mistake_of_ours(tmp_path, caplog):
    async def session():
        panel = Panel(tmp_path / "panel.json", "/dev/fake")
        async with serve(panel_site(panel)) as address, ClientSession() as browser:
            host, token = address.split("/")[2:4]
            for path, size in ((f"/{token}/ws", 1 << 25), (f"/{token}/", 100), ("/", 1 << 25)):
                _, writer = await asyncio.open_connection(*host.split(":"))
                writer.write(f"POST {path} HTTP/1.1\r\nHost: {host}\r\n"
                             f"Content-Length: {size}\r\n\r\n".encode() + bytes(50))
                await writer.drain()
                writer.transport.abort()
            async with browser.get(address) as answer:
                assert answer.status == 200
        await panel.close()

    asyncio.run(session())
    assert not caplog.records
