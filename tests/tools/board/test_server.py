"""The board behind its page: a server, the gateware in a process, and pages without a browser."""

import asyncio
import io
import json
import os
import signal
import struct
import time
from collections.abc import Awaitable, Callable, Mapping

import numpy as np
import pytest
from aiohttp import ClientSession, ClientWebSocketResponse, WSMsgType
from PIL import Image

from tb.milling import AUTOMATIC, BUTTON
from tools.board import scene as scenes
from tools.board.board import RECORD_INTERVAL, Board
from tools.board.messages import PIXEL, Job
from tools.board.pictures import LARGEST_UPLOAD
from tools.board.routes import board_site
from tools.board.scene import PARTS, unpack
from tools.wave.draw import MOST_ROWS
from tools.web import serve

FIGURE = np.array([[1, 0], [1, 1]], bool)
PATIENCE = 240
OTHER_WAYS = ["power", *(pytest.param(how, marks=pytest.mark.long)
                         for how in ("step_period", "job"))]
"""How another machine is made."""


class Page:
    """A page without a screen: it takes frames until something is so."""

    def __init__(self, socket: ClientWebSocketResponse) -> None:
        self._socket = socket
        self.fixed: dict[str, bytes] = {}
        self.lists = {"path": b"", "cut": b""}
        self.messages: dict[str, dict] = {}
        self.errors: list[str] = []

    async def do(self, name: str, **fields: object) -> None:
        await self._socket.send_json({"do": name, **fields})

    async def take(self) -> None:
        """Take one message, and say that it is drawn if it is a frame."""
        message = await self._socket.receive(PATIENCE)
        if message.type == WSMsgType.TEXT:
            text = json.loads(message.data)
            if "error" in text and "topic" not in text:
                self.errors.append(text["error"])
            else:
                self.messages[text["topic"]] = text
            return
        assert message.type == WSMsgType.BINARY, message
        for name, part in unpack(message.data).items():
            if isinstance(part, bytes):
                self.fixed[name] = part
            else:
                kept = self.lists[name][:part[0] * scenes.LISTS[name]]
                self.lists[name] = kept + part[1]
        await self.do("next")

    async def until(self, so: Callable[[], object]) -> None:
        """Take messages until something is so."""
        end = time.monotonic() + PATIENCE
        while not so():
            assert time.monotonic() < end
            await self.take()

    async def ready(self, number: int = 1) -> None:
        """Wait until a machine runs."""
        await self.until(lambda: "job" in self.messages and self.messages["job"]["number"] >= number
                         and self.fixed.keys() == PARTS.keys()
                         and self.messages["state"]["building"] is False)

    @property
    def clock(self) -> int:
        return int(struct.unpack("<df", self.fixed["time"])[0])

    @property
    def leds(self) -> bytes:
        return self.fixed["leds"]

    @property
    def state(self) -> Mapping:
        return self.messages["state"]

    @property
    def cut(self) -> set[int]:
        return set(np.frombuffer(self.lists["cut"], PIXEL).tolist())

    @property
    def places(self) -> tuple[int, ...]:
        return tuple(place for _, place in struct.iter_unpack("<Bi", self.fixed["motors"]))


class Served:
    """A board that is served."""

    def __init__(self, board: Board, address: str, client: ClientSession) -> None:
        self.board, self.address, self.client = board, address, client

    async def page(self) -> Page:
        page = Page(await self.client.ws_connect(self.address + "ws"))
        await page.ready()
        return page

    async def get(self, path: str) -> tuple[int, bytes]:
        async with self.client.get(self.address + path) as answer:
            return answer.status, await answer.read()

    async def post(self, path: str, body: bytes) -> tuple[int, bytes]:
        async with self.client.post(self.address + path, data=io.BytesIO(body)) as answer:
            return answer.status, await answer.read()


Test = Callable[[Served], Awaitable[None]]


def run(test: Test, *, engine: str = "amaranth", period: int = 1) -> None:
    """Run a test against a board with the figure."""
    async def whole() -> None:
        board = Board(Job(FIGURE, "figure", period), engine)
        try:
            async with (serve(board_site(board)) as address, ClientSession() as client,
                        asyncio.timeout(PATIENCE)):
                await test(Served(board, address, client))
        finally:
            await board.close()

    asyncio.run(whole())


def png(pixels: np.ndarray) -> bytes:
    buffer = io.BytesIO()
    Image.fromarray(~pixels).save(buffer, "PNG")
    return buffer.getvalue()


def pixels_of(data: bytes) -> np.ndarray:
    return ~np.asarray(Image.open(io.BytesIO(data)).convert("1"))


async def press(page: Page, button: str) -> None:
    await page.do("buttons", value=BUTTON[button])
    await page.do("buttons", value=0)


async def mill(page: Page) -> None:
    """Set SW7, press BTN1, and wait until the job is done."""
    await page.do("switches", mask=0xFF, value=AUTOMATIC)
    await press(page, "start")
    await page.until(lambda: page.leds[5])
    await page.until(lambda: page.state["done"] and not page.leds[5])


async def record(page: Page, clocks: int, *, end: bool = False) -> None:
    """Record, and wait until that is under way, or has ended."""
    before = page.state["wave"]
    await page.do("record", clocks=clocks)
    await page.until(lambda: page.state["recording"] or page.state["wave"] != before)
    if end:
        await page.until(lambda: page.state["wave"] != before and not page.state["recording"])


async def another(served: Served, page: Page, how: str) -> None:
    """Make another machine, in one of the ways, and wait until it is there."""
    number = page.messages["job"]["number"]
    if how == "job":
        assert (await served.post("job", png(FIGURE)))[0] == 200
    else:
        await page.do(how, **({"clocks": 7} if how == "step_period" else {}))
    await page.ready(number + 1)


class TestJob:
    @pytest.mark.parametrize(("engine", "period"), [
        ("amaranth", 1),
        pytest.param("cxxrtl", 500, marks=[pytest.mark.compiler, pytest.mark.long])])
    def test_to_the_end(self, libraries, engine, period):
        async def test(served):
            page = await served.page()
            assert page.messages["hello"]["engine"] == engine
            job = page.messages["job"]
            assert (job["rows"], job["columns"], job["count"], job["period"]) == (
                2, 2, 3, period)
            assert job["name"] == "figure"
            await mill(page)
            await page.until(lambda: page.cut == {0, 2, 3})
            assert page.places == (0, 0, 0)
            status, target = await served.get("target.png")
            assert status == 200 and (pixels_of(target) == FIGURE).all()
            status, drawn = await served.get("cut.png")
            assert status == 200 and Image.open(io.BytesIO(drawn)).width > 100

        run(test, engine=engine, period=period)

    def test_another_picture(self):
        async def test(served):
            page = await served.page()
            await mill(page)
            other = np.array([[0, 1, 1]], bool)
            status, preview = await served.post("job/preview?size=9x9", png(other))
            assert status == 200 and Image.open(io.BytesIO(preview)).format == "PNG"
            assert page.messages["job"]["number"] == 1
            status, answer = await served.post("job?turn=90&name=mine.png&invert=0", png(other))
            assert status == 200
            assert json.loads(answer) == {"rows": 3, "columns": 1, "count": 2}
            await page.ready(2)
            assert page.messages["job"] | {"rows": 3, "columns": 1, "count": 2, "name": "mine.png",
                                       "period": 1} == page.messages["job"]
            # The switches stay where they are; the plate is new.
            await page.until(lambda: page.fixed["inputs"] == bytes([AUTOMATIC, 0]) and not page.cut)
            await mill(page)
            assert page.cut == {1, 2}
            assert (pixels_of((await served.get("target.png"))[1]) == np.rot90(other, -1)).all()

        run(test)

    def test_picture_that_is_none(self):
        async def test(served):
            page = await served.page()
            noise = np.random.default_rng(1).random((60, 60)) < 0.5
            large = io.BytesIO()
            Image.new("1", (20_000, 20_000)).save(large, "PNG")
            for query, body, status in [
                ("", b"", 400), ("", b"GIF89a" + bytes(99), 400), ("", png(noise)[:300], 400),
                ("", large.getvalue(), 400), ("?size=0x9", png(FIGURE), 400),
                ("?threshold=a", png(FIGURE), 400), ("?outline=1&thin=1", png(FIGURE), 400),
                ("?outline=yes", png(FIGURE), 400), ("?image=/etc/passwd", png(FIGURE), 400),
                ("?--size=1x1", png(FIGURE), 400), ("", bytes(33 << 20), 413),
            ]:
                for path in ("job/preview", "job"):
                    got, answer = await served.post(path + query, body)
                    assert got == status, (query, answer)
                    error = json.loads(answer)["error"]
                    assert "\n" not in error and "/tmp" not in error and "--help" not in error
            before = page.clock
            await page.until(lambda: page.clock > before + 100)  # the machine has gone on
            assert page.messages["job"]["number"] == 1

        run(test)

    def test_picture_with_nothing_to_mill(self):
        async def test(served):
            status, answer = await served.post("job?threshold=10", png(np.zeros((3, 3), bool)))
            assert status == 400 and "nothing to mill" in json.loads(answer)["error"]

        run(test)


async def clock(served: Served) -> int:
    """Ask for the clock. Before any job, clocks are counted from power-up."""
    return (await served.board.cut()).clocks


class TestTime:
    def test_clocks_per_step_as_they_are_keep_the_machine(self):
        async def test(served):
            page = await served.page()
            await page.do("step_period", clocks=1)
            await page.do("step_period", clocks=3)
            await page.until(lambda: page.messages["job"]["period"] == 3)
            assert page.messages["job"]["number"] == 2

        run(test)

    def test_progress_is_told_to_the_end(self):
        async def test(served):
            page = await served.page()
            assert page.messages["progress"]["job"] is None
            await mill(page)
            await page.until(lambda: page.messages["progress"]["job"]
                             and not page.messages["progress"]["job"]["busy"])
            job = page.messages["progress"]["job"]
            assert job["cut"] == FIGURE.sum()
            assert job["real_s"] == round((await served.board.cut()).job_seconds())
            await page.do("power")
            await page.until(lambda: page.messages["progress"]
                             == {"topic": "progress", "building_s": None, "job": None})

        run(test)

    def test_pause_clocks_step_run(self):
        async def test(served):
            page = await served.page()
            await page.do("pause")
            await page.until(lambda: not page.state["running"])
            at = await clock(served)
            for count, fields in [(1, {}), (37, {"count": 37})]:
                await page.do("clock", **fields)
                at += count
                await page.until(lambda at=at: page.clock == at)
                assert await clock(served) == at
            await page.do("switches", mask=0xFF, value=0b01)
            await page.do("step")
            await page.until(lambda: page.places[0] == 1)
            at = await clock(served)
            await page.do("step")
            await page.until(lambda: page.places[0] == 2)
            assert await clock(served) == at + 5
            assert not page.state["advancing"]
            await page.do("run")
            await page.until(lambda: page.clock > at + 200 and page.state["running"])

        run(test, period=5)

    def test_a_step_that_does_not_come_can_be_ended(self):
        async def test(served):
            page = await served.page()
            await page.do("pause")
            await page.do("step")  # nothing moves: this goes on for some ten thousand clocks
            await page.until(lambda: page.state["advancing"] and not page.state["running"])
            await page.do("pause")
            await page.until(lambda: not page.state["advancing"])
            at = await clock(served)
            await asyncio.sleep(0.1)
            assert await clock(served) == at < 1 << 15

        run(test)

    def test_stop_is_told_until_reset(self):
        async def test(served):
            page = await served.page()
            for button, stopped in [("stop", True), ("start", True), ("reset", False)]:
                await press(page, button)
                await page.until(lambda stopped=stopped: page.state["stopped"] is stopped)

        run(test)

    def test_speed(self):
        async def test(served):
            page = await served.page()
            await page.do("speed", clocks_per_second=200)
            await page.until(lambda: page.state["speed"] == 200)
            before = page.clock
            await page.until(lambda: page.clock > before)  # a frame from after that
            start, at = time.monotonic(), page.clock
            await page.until(lambda: page.clock >= at + 100)
            # A busy computer may be slower; it makes up for a quarter of a second at most.
            assert time.monotonic() - start > 0.2
            await page.do("speed", clocks_per_second=None)
            await page.until(lambda: page.state["speed"] is None)

        run(test)

    def test_power_and_step_period(self):
        async def test(served):
            page = await served.page()
            await page.do("switches", mask=0xFF, value=0b01)
            await page.until(lambda: page.places[0] > 5)
            await page.do("switches", mask=0xFF, value=AUTOMATIC)
            await page.do("power")
            await page.ready(2)
            await page.until(lambda: page.clock < 50_000 and page.leds[7])  # the switch stayed
            assert page.fixed["inputs"] == bytes([AUTOMATIC, 0])
            await page.do("step_period", clocks=50)
            await page.ready(3)
            assert page.messages["job"]["period"] == 50
            assert page.messages["job"]["steps_per_second"] == 1e6
            # Another picture keeps it.
            await served.post("job", png(FIGURE))
            await page.ready(4)
            assert page.messages["job"]["period"] == 50

        run(test)

    @pytest.mark.parametrize("message", [
        {"do": "dance"}, {"do": "switches"}, {"do": "switches", "value": 1},
        *({"do": "switches", "mask": 255, "value": value} for value in (256, -1, 1.0, True, "1")),
        *({"do": "switches", "mask": mask, "value": 0} for mask in (0, 256, None)),
        {"do": "switches", "mask": 2, "value": 1},
        {"do": "buttons", "value": 16}, {"do": "clock", "count": 0},
        {"do": "clock", "count": 10**9}, {"do": "speed", "clocks_per_second": 0},
        *({"do": "speed", "clocks_per_second": speed}
          for speed in (-5, float("nan"), float("inf"), 10**400, True, "1", [1])),
        {"do": "step_period", "clocks": 0},
        {"do": "step_period", "clocks": 493_215}, {"do": "record", "clocks": 0},
        {"do": "record", "clocks": 10**7}, {"do": "serve"}, {"do": "__init__"},
    ], ids=lambda message: str(message)[:60])
    def test_refuses(self, message, one):
        async def test(served):
            page = await served.page()
            await page._socket.send_json(message)
            await page.until(lambda: page.errors)
            assert "\n" not in page.errors[0]
            at = page.clock
            await page.until(lambda: page.clock > at)

        one(test)


@pytest.fixture(scope="module")
def one():
    """Give a function that runs a test against one and the same board."""
    loop = asyncio.new_event_loop()
    stop = asyncio.Event()
    served: asyncio.Future[Served] = loop.create_future()

    async def whole() -> None:
        board = Board(Job(FIGURE, "figure", 1), "amaranth")
        async with serve(board_site(board)) as address, ClientSession() as client:
            place = Served(board, address, client)
            page = await place.page()
            # It runs beside all tests of this file.
            await page.do("speed", clocks_per_second=1000)
            await page.until(lambda: page.state["speed"] == 1000)
            await page._socket.close()
            served.set_result(place)
            await stop.wait()
        await board.close()

    task = loop.create_task(whole())
    loop.run_until_complete(asyncio.wait({task, served}, return_when=asyncio.FIRST_COMPLETED))
    place = served.result() if served.done() else task.result()
    yield lambda test: loop.run_until_complete(asyncio.wait_for(test(place), PATIENCE))
    stop.set()
    loop.run_until_complete(task)
    loop.close()


def test_a_picture_that_breaks_off_is_no_mistake_of_ours(caplog):
    async def test(served):
        host, token = served.address.split("/")[2:4]
        for end in ("abort", "close"):
            _, writer = await asyncio.open_connection(*host.split(":"))
            writer.write(f"POST /{token}/job HTTP/1.1\r\nHost: {host}\r\n"
                         f"Content-Length: {LARGEST_UPLOAD}\r\n\r\n".encode())
            writer.write(bytes(1 << 20))
            await writer.drain()
            getattr(writer.transport, end)()
        # The next one is not kept waiting.
        status, _ = await served.post("job/preview", png(FIGURE))
        assert status == 200

    run(test)
    assert not caplog.records


class TestPages:
    def test_two_pages_agree(self):
        async def test(served):
            first, second = await served.page(), await served.page()
            await first.do("switches", mask=0xFF, value=0b01)
            await second.until(lambda: second.fixed["inputs"] == b"\1\0")
            await second.do("switches", mask=0xFF, value=AUTOMATIC)
            await press(second, "start")
            await asyncio.gather(*(page.until(lambda page=page: page.cut == {0, 2, 3}
                                              and page.state["done"]) for page in (first, second)))
            await first.do("pause")
            for page in (first, second):
                await page.until(lambda page=page: not page.state["running"])
            scene = served.board._scene.fixed  # a last figure may follow the pause
            for page in (first, second, first):
                await page.until(lambda page=page: page.fixed["time"] == scene["time"])
            assert first.fixed == second.fixed and first.lists == second.lists
            third = await served.page()
            assert third.fixed == first.fixed and third.lists == first.lists
            assert third.messages["hello"]["pages"] == 3

        run(test)

    def test_a_page_moves_the_switches_that_it_names(self):
        async def test(served):
            first, second = await served.page(), await served.page()
            for page, mask, value in [(first, 0b0101, 0b0101), (second, 0b1010, 0b0010),
                                      (first, 0b0001, 0)]:
                await page.do("switches", mask=mask, value=value)
            await first.until(lambda: first.fixed["inputs"] == bytes([0b0110, 0]))

        run(test)

    def test_a_button_is_down_while_any_page_holds_it(self):
        async def test(served):
            pages = first, second = await served.page(), await served.page()
            for page, held, down in [(first, 0b01, 0b01), (second, 0b10, 0b11), (first, 0b11, 0b11),
                                     (second, 0, 0b11), (first, 0, 0)]:
                await page.do("buttons", value=held)
                for each in pages:
                    await each.until(lambda each=each, down=down:
                                     each.fixed["inputs"] == bytes([0, down]))

        run(test)

    def test_the_machine_goes_on_without_pages(self):
        async def test(served):
            page = await served.page()
            await page.do("switches", mask=0xFF, value=AUTOMATIC)
            await press(page, "start")
            await page.until(lambda: page.leds[5])
            await page._socket.close()
            await asyncio.sleep(0.3)
            page = await served.page()
            assert page.fixed["inputs"] == bytes([AUTOMATIC, 0])
            await page.until(lambda: page.cut == {0, 2, 3} and page.state["done"])

        run(test)

    def test_a_page_that_leaves_lets_go_of_its_buttons(self):
        async def test(served):
            stays, leaves = await served.page(), await served.page()
            await leaves.do("switches", mask=0xFF, value=AUTOMATIC)
            await leaves.do("buttons", value=BUTTON["stop"])
            await stays.until(lambda: stays.fixed["inputs"] == bytes([AUTOMATIC, 8]))
            await leaves._socket.close()
            await stays.until(lambda: stays.fixed["inputs"] == bytes([AUTOMATIC, 0]))

        run(test)

    def test_a_slow_page_gets_fewer_frames(self):
        async def test(served):
            quick = await served.page()
            slow = await served.client.ws_connect(served.address + "ws")
            await mill(quick)
            await quick.until(lambda: quick.cut == {0, 2, 3})
            frames = 0
            with pytest.raises(TimeoutError):
                while True:
                    frames += (await slow.receive(0.2)).type == WSMsgType.BINARY
            assert frames == 1
            page = Page(slow)
            await page.do("next")
            await page.until(lambda: page.cut == {0, 2, 3})

        run(test)


class TestWaves:
    def test_record_and_look(self):
        async def test(served):
            page = await served.page()
            for path in ("wave.vcd", "wave.json", "wave.svg?signals=leds"):
                status, answer = await served.get(path)
                assert status >= 400 and "record" in json.loads(answer)["error"]
            await page.do("switches", mask=0xFF, value=AUTOMATIC)
            await page.do("record", clocks=300)
            await page.do("record", clocks=300)
            await page.until(lambda: page.errors)
            assert "wait a moment" in page.errors[0]
            await page.until(lambda: page.state["wave"])
            wave = page.state["wave"]
            assert wave["clocks"] == 300
            status, vcd = await served.get("wave.vcd")
            assert status == 200 and len(vcd) == wave["bytes"]
            assert b"$enddefinitions" in vcd and f"#{wave['from'] * 20_000_000}\n".encode() in vcd
            status, listed = await served.get("wave.json")
            signals = {signal["path"]: signal["width"] for signal in json.loads(listed)["signals"]}
            assert signals["bench.top.switches"] == 8
            status, drawn = await served.get("wave.svg?signals=bench.top.switches,leds")
            assert status == 200 and b"<svg" in drawn and b"switches" in drawn
            for names, error in [("none", "no signal"), ("", "choose a signal"),
                                 (",".join(signals), f"at most {MOST_ROWS} rows"),
                                 ("--help", "no signal"), ("-o", "no signal")]:
                status, answer = await served.get(f"wave.svg?signals={names}")
                assert status == 400
                assert error in json.loads(answer)["error"]
                assert served.board.windows.last.path not in json.loads(answer)["error"]
                assert "python" not in json.loads(answer)["error"]

        run(test)

    @pytest.mark.parametrize("how", OTHER_WAYS)
    def test_another_machine_ends_it_early(self, how):
        async def test(served):
            page = await served.page()
            await page.do("speed", clocks_per_second=2000)
            at = page.clock
            await record(page, 1_000_000)
            with pytest.raises(TimeoutError):  # it goes on, with more than a clock
                async with asyncio.timeout(0.1):
                    await page.until(lambda: not page.state["recording"])
            await another(served, page, how)
            await page.until(lambda: page.state["wave"])
            wave = page.state["wave"]
            assert at <= wave["from"] and 0 < wave["clocks"] < wave["requested"] == 1_000_000
            assert (await served.get("wave.vcd"))[1].startswith(b"$")
            assert (await served.get("wave.svg?signals=leds"))[0] == 200
            await page.until(lambda: not page.state["recording"])
            assert page.state["unrecorded"] is page.state["error"] is None

        run(test)

    @pytest.mark.parametrize("how", OTHER_WAYS)
    def test_one_that_another_machine_ends_before_its_first_clock(self, how):
        async def test(served):
            page = await served.page()
            await record(page, 10, end=True)
            good = page.state["wave"]
            await page.do("pause")
            await asyncio.sleep(RECORD_INTERVAL)
            await record(page, 20)
            await another(served, page, how)
            await page.until(lambda: page.state["unrecorded"])
            assert "before its first clock" in page.state["unrecorded"]
            # Nothing else suffers: the machine runs, and the waveform before is still there.
            assert page.state["error"] is None and page.state["wave"] == good
            assert (await served.get("wave.svg?signals=leds"))[0] == 200
            await page.do("run")
            await asyncio.sleep(RECORD_INTERVAL)  # from the one that has ended
            await record(page, 20, end=True)
            await page.until(lambda: page.state["unrecorded"] is None)
            assert page.state["wave"]["clocks"] == 20

        run(test)

    def test_one_without_a_machine_and_one_that_dies_with_it(self):
        async def test(served):
            page = await served.page()
            await page.do("power")
            await page.do("record", clocks=10)
            await page.until(lambda: page.state["unrecorded"])
            assert "no machine" in page.state["unrecorded"]
            await page.ready(2)
            await page.do("pause")
            await asyncio.sleep(RECORD_INTERVAL)
            await record(page, 10)
            await asyncio.sleep(RECORD_INTERVAL)
            await page.do("record", clocks=10)
            await page.until(lambda: page.errors)
            assert "wait until it ends" in page.errors[0]
            os.kill(served.board._simulation.pid, signal.SIGKILL)
            await page.until(lambda: page.state["error"])
            assert "lost" in page.state["unrecorded"] and not page.state["recording"]

        run(test)


class TestLife:
    @pytest.mark.long
    def test_the_simulation_dies(self):
        async def test(served):
            page = await served.page()
            await page.do("switches", mask=0xFF, value=0b01)
            await page.until(lambda: page.places[0] > 2)
            os.kill(served.board._simulation.pid, signal.SIGKILL)
            await page.until(lambda: page.state["error"])
            assert "power" in page.state["error"] and not page.state["running"]
            await page.do("run")
            await page.until(lambda: page.errors)
            assert (await served.get("cut.png"))[0] == 400
            await page.do("power")
            await page.ready(2)
            assert page.state["error"] is None and page.state["running"]
            assert page.fixed["inputs"] == b"\1\0"
            for _ in range(3):  # frames of the new machine come by themselves
                before = page.fixed["time"]
                await page.until(lambda before=before: page.fixed["time"] != before)

        run(test)

    @pytest.mark.compiler
    @pytest.mark.long
    def test_a_build_that_fails_leaves_the_old_machine(self, libraries, monkeypatch, tmp_path):
        """The compiler is told to fail by a file that is there or not.

        It compiles anew each time, so it does not optimise.
        """
        script, fail = tmp_path / "c++", tmp_path / "fail"
        script.write_text(f'#!/bin/sh\ntest -e {fail} && exit 1\nexec g++ "$@" -O0\n')
        script.chmod(0o755)
        monkeypatch.setenv("CXX", str(script))

        async def test(served):
            page = await served.page()
            await page.do("speed", clocks_per_second=10_000)  # leaves the processor to builds
            fail.touch()
            rng = np.random.default_rng()
            other = rng.random((9, 9)) < 0.5  # a picture that is in no cache
            other[0, 0] = True
            status, _ = await served.post("job", png(other))
            assert status == 200
            await page.until(lambda: page.state["error"] and not page.state["building"])
            assert "failed" in page.state["error"]
            assert page.messages["job"]["number"] == 1
            at = page.clock
            await page.until(lambda: page.clock > at)
            await page.do("power")  # the machine that works comes back, not what failed
            await page.ready(3)
            assert page.state["error"] is None
            assert page.messages["job"]["rows"] == 2
            fail.unlink()
            await served.post("job", png(other))
            await page.ready(4)
            assert page.state["error"] is None
            assert page.messages["job"]["rows"] == 9

        run(test, engine="cxxrtl")
