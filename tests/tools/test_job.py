# amaranth: UnusedElaboratable=no

"""Jobs: the orders of pictures are those of the gateware; lists of orders are read or refused."""

import re
from pathlib import Path

import numpy as np
import pytest

from fresa.machines.mill import TOP_SPEED, Z_TRAVEL
from fresa.motion import CoordinateGenerator
from fresa_host.jobs import check_cuts
from fresa_host.order_lines import LAST_NUMBER, Kind, Order
from tb.boards import component
from tb.engines import AmaranthEngine
from tools import job
from tools.console import UserError
from tools.job import picture_orders, read_orders, stroke_start, write_orders
from tools.raster import outlined

UP, DOWN = Order(Kind.UP), Order(Kind.DOWN)


def go(x: int, y: int) -> Order:
    return Order(Kind.GO, x, y)


def gateware_orders(pixels, pitch: int) -> list[Order]:
    source = CoordinateGenerator(pixels.tolist(), pixel_steps=pitch)
    orders = []
    with AmaranthEngine(component("coordinates", source)) as engine:
        engine.set(start=1, orders_ready=1)
        engine.run(1)
        engine.set(start=0)
        while engine.get("busy"):
            if engine.get("orders_valid"):
                payload = engine.get("orders_payload")
                orders.append({0: go(payload & 0xFFFF, payload >> 16 & 0xFFFF), 1: UP, 2: DOWN}[
                    payload >> 32])
            engine.run(1)
    return orders


class TestPicture:
    @pytest.mark.parametrize(("rows", "columns", "share"), [
        (1, 1, 1.0), (1, 9, 0.4), (7, 1, 0.5), (6, 9, 0.3), (9, 6, 0.7), (12, 12, 0.05),
        (5, 12, 0.02)])
    def test_orders_are_those_of_the_gateware(self, rows, columns, share):
        rng = np.random.default_rng([rows, columns])
        pixels = rng.random((rows, columns)) < share
        pixels[rng.integers(rows), rng.integers(columns)] = True
        assert picture_orders(pixels, 8) == gateware_orders(pixels, 8)

    def test_what_the_order_of_the_spiral_costs(self):
        """A rectangle could be milled in one stroke. The search leaves single pixels in corners."""
        def plunges(pixels) -> int:
            return picture_orders(pixels).count(DOWN)

        rectangle = np.ones((13, 17), bool)
        assert plunges(rectangle) == 6 and plunges(outlined(rectangle)) == 1
        assert float(2 * Z_TRAVEL / TOP_SPEED) == pytest.approx(22.7, abs=0.05)

    def test_the_largest(self):
        pixels = np.random.default_rng(1).random((400, 400)) < 0.1
        orders = picture_orders(pixels)
        assert sum(order == DOWN for order in orders) == sum(order == UP for order in orders) - 1
        check_cuts(orders)


class TestList:
    def read(self, tmp_path, text: str | bytes) -> list[Order]:
        path = tmp_path / "job.txt"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return read_orders(path)

    def test_lines(self, tmp_path):
        text = "# a job\r\nup\n\n  GO 128   65535 # there\nDown\ngo 0 00\n"
        assert self.read(tmp_path, text) == [UP, go(128, 65535), DOWN, go(0, 0)]

    def test_what_is_written_is_read(self, tmp_path):
        orders = [UP, go(1, 2), DOWN, go(1, 3), UP]
        assert self.read(tmp_path, write_orders(orders)) == orders

    @pytest.mark.parametrize(("text", "message"), [
        ("up\ngo 1\n", "line 2: an order is .*, not 'go 1'"),
        ("go 1 65536", "line 1: .*, not 'go 1 65536'"), ("go -1 1", "line 1"),
        ("go 1 2 3", "line 1"), ("up 3", "line 1"), ("fly", "line 1"), ("go ٣ 1", "line 1"),
        ("go " + "9" * 10**6 + " 1", r"9\.\.\.'$"), ("", "0 orders"), ("# nothing", "0 orders"),
        (b"\xff\xfe", "not text"),
    ])
    def test_what_is_no_order(self, tmp_path, text, message):
        with pytest.raises(UserError, match=message) as caught:
            self.read(tmp_path, text)
        assert len(str(caught.value)) < 300


    def test_what_has_no_end_is_not_read_to_it(self, tmp_path, monkeypatch):
        monkeypatch.setattr(job, "LARGEST", 20)
        assert len(self.read(tmp_path, "up\n" * 6)) == 6
        for path in (tmp_path / "long", Path("/dev/zero")):
            (tmp_path / "long").write_bytes(b"up\n" * 7)
            with pytest.raises(UserError, match="too long for a list of orders"):
                read_orders(path)

    def test_there_is_room_for_raising_the_tool(self, tmp_path, monkeypatch):
        monkeypatch.setattr(job, "MOST", 3)
        assert len(self.read(tmp_path, "up\n" * 3)) == 3
        with pytest.raises(UserError, match="has 4 orders; a job has 1 to 3"):
            self.read(tmp_path, "up\n" * 4)
        monkeypatch.undo()
        assert job.MOST + 1 == LAST_NUMBER


class TestCuts:
    @pytest.mark.parametrize("orders", [
        [go(0, 0), DOWN, go(3, 3)], [go(0, 0), DOWN, go(0, 9)], [go(0, 0), DOWN, go(0, 0)],
        [go(3, 4)], [UP, go(1, 1), DOWN, UP, go(3, 4)], [go(1, 2), DOWN],
        [go(9, 5), DOWN, go(5, 9)]])
    def test_along_8_directions(self, orders):
        check_cuts(orders)

    @pytest.mark.parametrize(("orders", "message"), [
        ([DOWN, go(0, 4)], "order 1, down: the place is unknown"),
        ([UP, DOWN, UP], "order 2, down: the place is unknown; first go"),
        ([go(0, 0), DOWN, go(3, 4)], "order 3, go 3 4: from 0 0 no"),
        ([go(1, 1), DOWN, go(2, 1), go(3, 4)], "order 4, go 3 4: from 2 1 no")])
    def test_no_other(self, orders, message):
        with pytest.raises(ValueError, match=re.escape(message)):
            check_cuts(orders)

    def test_a_stroke_begins_where_the_tool_is_raised(self):
        orders = [UP, go(1, 1), DOWN, go(2, 2), UP, go(9, 9), DOWN, UP, go(0, 0)]
        assert [stroke_start(orders, n) for n in range(1, 10)] == [1, 1, 1, 1, 5, 5, 5, 8, 8]
        assert stroke_start([go(1, 1), DOWN], 2) == 1
