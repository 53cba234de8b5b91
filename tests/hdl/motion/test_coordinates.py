# amaranth: UnusedElaboratable=no

"""Orders that mill a picture, as a tool follows them."""

import random
import re

import pytest

from fresa.motion import CoordinateGenerator
from fresa_boards.verilog import emit
from tb.boards import component
from tb.engines import AmaranthEngine
from tb.mistake import Mistake

PATIENCE = 300_000


class Tool:
    """Carries out the orders of a generator, each after a while, and minds the contract."""

    def __init__(self, picture, pitch: int, seed: int = 0) -> None:
        self.target = {(r, c) for r, row in enumerate(picture) for c, bit in enumerate(row) if bit}
        self.pitch, self.rng = pitch, random.Random(seed)
        source = CoordinateGenerator(picture, pixel_steps=pitch)
        self.engine = AmaranthEngine(component("coordinates", source))
        self.forget()

    def forget(self) -> None:
        """Take the tool to the origin, raised, and a new plate."""
        self.at, self.lowered = (0, 0), False
        self.milled: list[tuple[int, int]] = []
        self.orders = 0

    def start(self) -> None:
        assert not self.engine.get("busy")
        self.engine.set(start=1)
        self.engine.run(1)
        self.engine.set(start=0)
        assert self.engine.get("busy")

    def order(self) -> bool:
        """Carry out the next order; tell whether there was one."""
        engine = self.engine
        engine.set(orders_ready=0)
        if not engine.get("orders_valid"):
            engine.run(PATIENCE, until={"orders_valid": 1, "busy": 0})
        assert engine.get("orders_valid") or not engine.get("busy"), "it orders nothing for ever"
        if not engine.get("busy"):
            return False
        payload = engine.get("orders_payload")
        for _ in range(self.rng.choice([0, 1, 5])):  # a start meanwhile is lost
            engine.set(start=self.rng.randrange(2))
            engine.run(1)
            assert engine.get("orders_valid", "orders_payload") == (1, payload)
        engine.set(start=0, orders_ready=1)
        engine.run(1)
        engine.set(orders_ready=0)
        self.follow(payload)
        return True

    def follow(self, payload: int) -> None:
        x, y, up, down = payload & 0xFFFF, payload >> 16 & 0xFFFF, payload >> 32 & 1, payload >> 33
        self.orders += 1
        assert not (up and down)
        if up or down:
            self.lowered = bool(down)
        else:
            assert x % self.pitch == y % self.pitch == 0
            there = (x // self.pitch, y // self.pitch)
            if self.lowered:
                away = [abs(a - b) for a, b in zip(there, self.at, strict=True)]
                assert max(away) == 1, f"milled from {self.at} to {there}"
            self.at = there
        if self.lowered:
            assert self.at in self.target, f"the tool is down on {self.at}"
            self.milled.append(self.at)

    def finish(self) -> None:
        while self.order():
            pass
        assert set(self.milled) == self.target
        assert len(self.milled) == len(self.target), "a pixel was milled twice"
        assert (self.at, self.lowered) == ((0, 0), False)
        assert not self.engine.get("fault")


def blob(rows: int, columns: int, seed: int, share: float) -> list[list[bool]]:
    rng = random.Random(seed)
    picture = [[rng.random() < share for _ in range(columns)] for _ in range(rows)]
    picture[rng.randrange(rows)][rng.randrange(columns)] = True
    return picture


def drawing(text: str) -> list[list[bool]]:
    return [[bit == "#" for bit in row] for row in text.split()]


PICTURES = {
    "one pixel": drawing("#"),
    "one of many": drawing("..... ..... ....# ....."),
    "a row": drawing("####.###"),
    "a column": drawing("# # . # #"),
    "all": drawing("##### ##### ##### #####"),
    "board": drawing("#.#.# .#.#. #.#.# .#.#."),
    "corners": drawing("#......# ........ ........ #......#"),
    "ring": drawing("..###.. .#...#. #..#..# .#...#. ..###.."),
}


class TestContract:
    @pytest.mark.parametrize("picture", PICTURES.values(), ids=PICTURES)
    @pytest.mark.parametrize("pitch", [1, 128])
    def test_drawings(self, picture, pitch):
        tool = Tool(picture, pitch)
        tool.start()
        tool.finish()

    def test_more_than_a_block_ram(self):
        """130 x 130 pixels are two bits wide in memories of 2 ** 14 words."""
        picture = [[False] * 130 for _ in range(130)]
        for n in range(130):
            picture[n][0] = picture[129][n] = True
        tool = Tool(picture, 128)
        tool.start()
        tool.finish()


class TestAgain:
    def test_without_being_reloaded(self):
        tool = Tool(blob(6, 7, 3, 0.5), 4)
        for _ in range(3):
            tool.forget()
            tool.start()
            tool.finish()

    @pytest.mark.parametrize(("orders", "clocks"), [(0, 1), (1, 0), (3, 2), (9, 30)])
    def test_after_a_job_broken_off(self, orders, clocks):
        tool = Tool(PICTURES["ring"], 4)
        tool.start()
        for _ in range(orders):
            tool.order()
        tool.engine.run(clocks)
        tool.engine.set(rst=1)
        tool.engine.run(1)
        tool.engine.set(rst=0)
        tool.forget()
        tool.start()
        tool.finish()


class TestMemory:
    """What the tool that builds the bitstream makes of the memories is not seen here."""

    @pytest.mark.parametrize("picture", [drawing("#"), drawing("..#"), PICTURES["ring"],
                                         blob(90, 91, 1, 0.1), [[True] * 390] * 340])
    def test_no_array_is_a_bit_wide_and_all_are_block_ram(self, picture):
        text = emit(CoordinateGenerator(picture, pixel_steps=1), name="coordinates")
        arrays = re.findall(r"(.*\n)  reg (.*) \w+ \[\d+:0\];", text)
        assert len(arrays) >= 2
        assert all('(* ram_style = "block" *)' in before for before, _ in arrays)
        assert all(re.fullmatch(r"\[[1-9]\d*:0\]", width) for _, width in arrays)

    @pytest.mark.parametrize("picture", [drawing("#"), drawing("..#"), PICTURES["ring"]])
    def test_an_empty_one_is_a_fault_until_reset(self, picture):
        dut = CoordinateGenerator(picture, pixel_steps=4)
        design = Mistake("found", lambda right, _: right & 0).planted(component("empty", dut))
        with AmaranthEngine(design) as engine:
            engine.set(start=1)
            engine.run(1)
            engine.set(start=0)
            longest = max(len(picture), len(picture[0]))
            limit = 2 * (2 * longest - 1) ** 2 + 200
            engine.run(limit, until={"fault": 1})
            assert engine.get("fault", "busy", "orders_valid") == (1, 0, 0)
            assert engine.clock >= 2 * (2 * longest - 1) ** 2  # not before all has been looked at
            engine.set(start=1, orders_ready=1)
            engine.run(100)
            assert engine.get("fault", "busy", "orders_valid") == (1, 0, 0)
            engine.set(rst=1, start=0)
            engine.run(1)
            assert engine.get("fault", "busy") == (0, 0)


RAGGED = "picture must have rows of the same length, and at least one pixel, not rows of "


class TestParameters:
    @pytest.mark.parametrize(
        ("picture", "pitch", "message"),
        [
            (
                [],
                1,
                RAGGED + "[] pixels",
            ),
            (
                [[]],
                1,
                RAGGED + "[0] pixels",
            ),
            (
                [[1], [1, 0]],
                1,
                RAGGED + "[1, 2] pixels",
            ),
            ([[0, 0]], 1, "picture must have a pixel to mill, not 0"),
            (
                [[1] * 513],
                1,
                "rows and columns of the picture must be a whole number from 1 to 512, not 513",
            ),
            (
                [[1]] * 513,
                1,
                "rows and columns of the picture must be a whole number from 1 to 512, not 513",
            ),
            ([[1]], 0, "pixel_steps must be a whole number from 1 to 65535, not 0"),
            ([[1] * 512], 129, "pixel_steps must be a whole number from 1 to 128, not 129"),
            ([[1] * 3], 32_768, "pixel_steps must be a whole number from 1 to 32767, not 32768"),
        ],
    )
    def test_impossible_values(self, picture, pitch, message):
        with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
            CoordinateGenerator(picture, pixel_steps=pitch)

    def test_limits(self):
        assert CoordinateGenerator([[True] * 512] * 2, pixel_steps=128).columns == 512
        assert CoordinateGenerator([[True]], pixel_steps=65_535).rows == 1
