# amaranth: UnusedElaboratable=no

"""Orders over a serial line, by the pins of the gateware."""

import random
import re
from functools import cache
from pathlib import Path

import pytest

from fresa.machines import SerialOrders
from fresa_host.order_lines import Kind, Order, request
from fresa_host.orders import Sender
from tb.boards import component
from tb.design import Design
from tb.engines import AmaranthEngine
from tb.engines.cxxrtl import CXXRTLEngine
from tb.models.orders import OrdersModel
from tb.uart import SerialLine
from tests.noise import Noise

NO_COMPILER = CXXRTLEngine.missing()
DOCS = Path(__file__).parents[3] / "docs" / "serial-orders.md"
BIT = 16
BYTE = 10 * BIT
REST = 3 * BYTE
"""Clocks without a byte after which no answer is under way."""


def design() -> Design:
    return component("serial_orders", SerialOrders(period=BIT))


elaborated_once = cache(design)


class Mill:
    """The gateware, and a tool that carries out its orders."""

    def __init__(self) -> None:
        self.engine = AmaranthEngine(design()) if NO_COMPILER else CXXRTLEngine(elaborated_once())
        self.line = SerialLine(self.engine, BIT)
        self.engine.set(enable=1)
        self.line.run(4 * BIT)
        self.done: list[Order] = []

    def ask(self, line: bytes) -> bytes:
        self.line.send(line)
        return self.listen(len(line) * BYTE)

    def listen(self, clocks: int) -> bytes:
        received = self.line.run(clocks)
        while more := self.line.run(REST):
            received += more
        return received

    def carry_out(self) -> bytes:
        assert self.engine.get("orders_valid", "busy") == (1, 1)
        order = self.engine.get("orders_payload")
        kind = {0: Kind.GO, 1: Kind.UP, 2: Kind.DOWN}[order >> 32]
        x, y = (order & 0xFFFF, order >> 16 & 0xFFFF) if kind == Kind.GO else (0, 0)
        self.done.append(Order(kind, x, y))
        self.engine.set(orders_ready=1)
        received = self.line.run(1)
        self.engine.set(orders_ready=0)
        return received


@pytest.fixture
def mill():
    mill = Mill()
    with mill.engine:
        yield mill


class TestDialogue:
    @pytest.mark.parametrize("kind", ["model", "gateware"])
    def test_the_example_of_the_documentation(self, kind, mill):
        """Word for word: each request, its answer, and when an order is carried out."""
        model = OrdersModel()
        block = re.search(r"```text\n(.*?)```", DOCS.read_text(encoding="utf-8"), re.S)
        assert block
        requests = 0
        answers = b""
        for line in block[1].splitlines():
            mark, _, text = line.partition(" ")
            match mark:
                case ">":
                    assert not answers
                    requests += 1
                    data = text.encode() + b"\r"
                    answers = model.hear(data) if kind == "model" else mill.ask(data)
                case "<":
                    assert answers == text.encode() + b"\r\n"
                    answers = b""
                case "!":
                    assert text in ("1 is carried out", "2 is carried out", "3 is carried out")
                    if kind == "model":
                        model.ledger.carry_out()
                    else:
                        mill.carry_out()
                case _:
                    assert mark == "#"
        assert requests > 8 and not answers

    def test_every_line_is_answered_as_by_the_model(self, mill):
        lines, seed, outcomes = (6, 4, 4) if NO_COMPILER else (200, 6, 11)
        assert self.answered(mill, lines, seed=seed) >= outcomes

    def answered(self, mill: Mill, lines: int, *, seed: int) -> int:
        """Ask right and wrong lines, long and short, in every mode; give how many outcomes came."""
        rng, model = random.Random(seed), OrdersModel()
        noise = Noise(rng, 0.01)
        session, outcomes = 5, set()
        for _ in range(lines):
            for name in ("enable", "error", "stopped"):
                level = int(rng.random() < (0.95 if name == "enable" else 0.2))
                setattr(model, name, level)
                mill.engine.set(**{name: level})
            if not model.enable:
                model.ledger.reset()
            kind = rng.choice([0, 1, 1, 2, 2, 2, 3, 4, 5])
            line = noise.through(request(
                kind, rng.choice([session] * 9 + [6]),
                model.ledger.taken + rng.choice([1, 1, 1, 0, 2]), rng.randrange(2**16)))
            expected = model.hear(line)
            assert mill.ask(line) == expected
            outcomes |= {expected[1:2]} if expected else set()
            if model.ledger.waiting and rng.random() < 0.5:
                kind, x, y = model.ledger.carry_out()
                mill.carry_out()
                assert mill.done[-1].kind == kind
                assert kind != Kind.GO or (mill.done[-1].x, mill.done[-1].y) == (x, y)
        return len(outcomes)

    @pytest.mark.compiler
    def test_noise_is_no_order(self, mill):
        rng = random.Random(4)
        assert mill.ask(request(Kind.OPEN, 5)).startswith(b"=10" + b"00000005")
        mill.line.send(bytes(rng.choices([*range(256), *b":0123456789ABCDEF\r" * 9], k=300)))
        mill.listen(300 * BYTE)
        assert mill.engine.get("orders_valid", "busy", "fault") == (0, 0, 0)
        assert mill.ask(request(Kind.QUERY))[-35:-8].startswith(b"=0000000005" + b"0" * 12)

    def test_a_line_may_come_while_one_is_answered(self, mill):
        answers = mill.ask(request(Kind.OPEN, 5) + request(Kind.GO, 5, 1))
        assert [line[:2] for line in answers.split()] == [b"=1", b"=2"]

    def test_reset_closes_the_session_and_ends_an_answer(self, mill):
        mill.ask(request(Kind.OPEN, 5) + request(Kind.GO, 5, 1))
        mill.line.send(request(Kind.QUERY))
        mill.line.run(36 * BYTE)  # to somewhere in the answer
        mill.engine.set(rst=1)
        mill.line.run(1)
        mill.engine.set(rst=0)
        assert mill.engine.get("tx", "orders_valid", "busy") == (1, 0, 0)
        assert len(mill.line.run(45 * BYTE)) <= 1  # the byte that was cut off
        assert mill.ask(request(Kind.GO, 5, 2)).startswith(b"=70" + b"0" * 20)


def delivered(mill: Mill, orders: list[Order], *, noise: float, seed: int) -> Noise:
    """Send a job to the gateware over a bad line; its time is that of 9600 baud."""
    rng = random.Random(seed)
    there, back = Noise(rng, noise), Noise(rng, noise)
    sender = Sender(orders)
    sender.connected(0)
    while not sender.finished:
        now = mill.engine.clock / BIT / 9600
        mill.line.send(there.through(sender.send(now)))
        received = mill.line.run(20 * BYTE)
        if mill.engine.get("orders_valid") and rng.random() < 0.4:
            received += mill.carry_out()
        sender.receive(back.through(received), mill.engine.clock / BIT / 9600)
    return there


class TestBadLine:
    @pytest.mark.compiler
    @pytest.mark.parametrize(("noise", "count"), [(0.002, 99), (0.02, 30)])
    def test_every_order_is_done_once(self, mill, noise, count):
        rng = random.Random(9)
        orders = [Order(Kind.UP), *(Order(Kind.GO, rng.randrange(2**16), rng.randrange(2**16))
                                    for _ in range(count))]
        faults = delivered(mill, orders, noise=noise, seed=6).faults
        assert mill.done == orders and faults > 5


class TestParameters:
    def test_impossible_period(self):
        with pytest.raises(ValueError, match="period must be a whole number from 16 to"):
            SerialOrders(period=15)

    def test_impossible_depth(self):
        with pytest.raises(ValueError, match="depth must be a power of two, not 3"):
            SerialOrders(period=16, depth=3)
