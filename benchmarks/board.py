"""Speed of the board's page compared with its engine alone, and delay of a click."""

import asyncio
import statistics
import struct
import sys
import time
from pathlib import Path

import numpy as np
from aiohttp import ClientSession, ClientWebSocketResponse, WSMsgType
from PIL import Image

from tb.engines import Engine, choose
from tb.milling import AUTOMATIC, BUTTON, press, ready_to_mill
from tools.board.build import timing_of
from tools.board.scene import unpack
from tools.console import Parser, command, whole
from tools.simulate import EXAMPLE

ABOUT = """\
Starts tools.board on the example, mills, and connects like a page. In alternation, so that other
load affects both equally: for some seconds the board runs with a page connected that takes every
frame; then the board is paused and the same engine runs alone, without watching outputs. Finally
the page moves SW7 repeatedly and waits until LD7 shows it.
"""

ROOT = Path(__file__).parents[1]
ROUNDS = 10
CLICKS = 100
#: Seconds after which a click without an effect counts as lost.
CLICK_TIMEOUT_S = 30


class Page:
    """A page that draws nothing."""

    def __init__(self, socket: ClientWebSocketResponse) -> None:
        self._socket = socket
        self.clock, self.leds, self.frames = 0, bytes(8), 0

    async def send(self, name: str, **fields: object) -> None:
        """Send a request."""
        await self._socket.send_json({"do": name, **fields})

    async def frame(self) -> None:
        """Receive one frame."""
        while (message := await self._socket.receive()).type != WSMsgType.BINARY:
            if message.type != WSMsgType.TEXT:
                raise RuntimeError("the board has ended")
        parts = unpack(message.data)
        if isinstance(now := parts.get("time"), bytes):
            self.clock = int(struct.unpack("<df", now)[0])
        if isinstance(leds := parts.get("leds"), bytes):
            self.leds = leds
        self.frames += 1
        await self.send("next")

    async def watch(self, seconds: float) -> tuple[float, float]:
        """Receive frames for a number of seconds; return clocks and frames per second."""
        await self.frame()
        start, clock, frames = time.perf_counter(), self.clock, self.frames
        while time.perf_counter() - start < seconds:
            await self.frame()
        took = time.perf_counter() - start
        return (self.clock - clock) / took, (self.frames - frames) / took

    async def automatic(self, on: bool) -> None:
        """Set or clear SW7, and leave the other switches unchanged."""
        await self.send("switches", mask=AUTOMATIC, value=AUTOMATIC if on else 0)

    async def click(self, on: bool) -> float:
        """Set or clear SW7, and return the seconds until LD7, ready, follows."""
        start = time.perf_counter()
        await self.automatic(on)
        while (self.leds[7] > 0) != on:
            if time.perf_counter() - start > CLICK_TIMEOUT_S:
                raise TimeoutError(f"SW7 is {'on' if on else 'off'}, but LD7 does not follow")
            await self.frame()
        return time.perf_counter() - start


def alone(engine: Engine, seconds: float) -> float:
    """Run an engine for a number of seconds; return its clocks per second."""
    clocks = 1000
    start, first = time.perf_counter(), engine.clock
    while (took := time.perf_counter() - start) < seconds:
        engine.run(clocks)
        clocks = min(2 * clocks, 200_000)
    return (engine.clock - first) / took


async def measure(address: str, seconds: float, engine: Engine) -> None:
    """Measure a running board at an address."""
    async with ClientSession() as session, session.ws_connect(address + "ws") as socket:
        page = Page(socket)
        await page.frame()
        await page.automatic(True)
        await page.watch(0.2)
        for level in (BUTTON["start"], 0):
            await page.send("buttons", value=level)
            await page.watch(0.2)
        boards, frames, engines = [], [], []
        for _ in range(ROUNDS):
            await page.send("run")
            speed, rate = await page.watch(seconds)
            await page.send("pause")
            boards.append(speed)
            frames.append(rate)
            engines.append(alone(engine, seconds))
        ratios = [board / other for board, other in zip(boards, engines, strict=True)]
        print(f"engine alone      {statistics.median(engines):.3g} clocks/s")
        print(f"board with a page {statistics.median(boards):.3g} clocks/s, "
              f"{statistics.median(frames):.1f} frames/s")
        print(f"board : alone     {statistics.median(ratios):.3f}, each round "
              f"{' '.join(f'{ratio:.2f}' for ratio in ratios)}")
        await page.send("run")
        await page.automatic(False)
        await page.watch(0.5)
        waits = sorted([await page.click(n % 2 == 1) for n in range(1, CLICKS + 1)])
        print("click to LEDs     " + ", ".join(
            f"{name} {1000 * waits[int(place * (CLICKS - 1))]:.0f} ms"
            for name, place in [("median", 0.5), ("95 of 100", 0.95), ("slowest", 1.0)]))


@command
def main(argv: list[str] | None = None) -> int:
    """Run the benchmark."""
    parser = Parser(prog="python -m benchmarks.board", description=ABOUT)
    parser.add_argument("seconds", metavar="SECONDS", type=whole(1, 3600), nargs="?", default=1,
                        help="seconds of each piece (default: %(default)s)")
    asyncio.run(_compare(parser.parse_args(argv).seconds))
    return 0


async def _compare(seconds: float) -> None:
    """Mill on the board's page, and on an engine alone."""
    kind = choose()
    period, scan_bits = timing_of(kind)
    pixels = ~np.asarray(Image.open(EXAMPLE).convert("1"))
    engine = ready_to_mill(pixels, kind, period=period, scan_bits=scan_bits)
    engine.set(switches=AUTOMATIC)
    engine.run(100)
    press(engine, "start")
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "tools.board", cwd=ROOT, stdout=asyncio.subprocess.PIPE)
    try:
        assert process.stdout is not None
        address = (await process.stdout.readline()).decode().strip()
        await measure(address, seconds, engine)
    finally:
        process.terminate()
        await process.wait()
        engine.close()


if __name__ == "__main__":
    raise SystemExit(main())
