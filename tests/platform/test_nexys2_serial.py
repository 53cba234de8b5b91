# amaranth: UnusedElaboratable=no

"""The mill on its board with orders from the RS-232 port: its pins, its switches, whole jobs."""

from functools import cache

import pytest

from fresa.machines import MillStation, SerialOrders
from fresa.machines.mill import MillTiming
from fresa_host.errors import WasReset
from fresa_host.order_lines import Kind, Order, request
from fresa_host.orders import NotReady, OrderRefused, Sender
from tb.boards import board as on_board
from tb.design import Design
from tb.engines.cxxrtl import CXXRTLEngine
from tb.uart import SerialLine

PERIOD, TRAVEL, STILL = 3, 4, 3
SETTLE = 2 * STILL + 4
AUTOMATIC = 1 << 7
RESET, STOP = 1, 8
BUSY, ERROR, READY = 1 << 5, 1 << 6, 1 << 7
AXES = ["axis_x", "axis_y", "axis_z"]
BIT = 16
BYTE = 10 * BIT


@cache
def design() -> Design:
    machine = MillStation(source=SerialOrders(period=BIT), timing=MillTiming(PERIOD, 3),
                          z_travel=TRAVEL)
    return on_board("mill", machine, debounce=STILL)


class Board:
    """A board with a host at its RS-232 port, and someone at its switches."""

    def __init__(self) -> None:
        self.engine = CXXRTLEngine(design())
        self.line = SerialLine(self.engine, BIT)
        self.line.run(4 * BIT)
        self.turn(AUTOMATIC)

    def turn(self, switches: int) -> None:
        self.engine.set(switches=switches)
        self.line.run(SETTLE)

    def press(self, button: int) -> None:
        for level in (button, 0):
            self.engine.set(buttons=level)
            self.line.run(SETTLE)

    @property
    def now(self) -> float:
        return self.engine.clock / BIT / 9600

    @property
    def leds(self) -> int:
        return self.engine.get("leds")

    def ask(self, line: bytes) -> bytes:
        self.line.send(line)
        return self.line.run(80 * BYTE)

    def deliver(self, sender: Sender, *, until: int | None = None) -> None:
        """Send until the job is finished, or so many of its orders are done."""
        sender.connected(self.now)
        while not sender.finished and (until is None or sender.done < until):
            self.line.send(sender.send(self.now))
            sender.receive(self.line.run(10 * BYTE), self.now)
            assert self.engine.clock < 10**6


@pytest.fixture
def board():
    board = Board()
    with board.engine:
        yield board


JOB = [Order(Kind.UP), Order(Kind.GO, 4, 8), Order(Kind.DOWN), Order(Kind.GO, 8, 12),
       Order(Kind.UP)]


@pytest.mark.compiler
class TestSerialOrders:
    def test_a_job(self, board):
        board.deliver(Sender(JOB))
        assert board.leds == READY
        # Full steps have four words: 8 and 12 steps away the coils are as they were.
        assert board.engine.get(*AXES) == (0b0110,) * 3

    def test_orders_go_on_where_a_host_left(self, board):
        board.deliver(Sender(JOB), until=2)
        again = Sender(JOB)
        board.deliver(again)
        assert again.resumed and again.done == 5

    def test_busy_is_shown_while_an_order_is_carried_out(self, board):
        board.ask(request(Kind.OPEN, 5))
        board.line.send(request(Kind.GO, 5, 1, 900, 0))
        board.line.run(40 * BYTE)
        assert board.leds & (BUSY | READY) == BUSY

    def test_start_button_does_nothing(self, board):
        board.press(2)
        board.line.run(200)
        assert board.leds == READY

    def test_manual_mode_is_told_and_ends_the_job(self, board):
        sender = Sender(JOB)
        board.deliver(sender, until=1)
        board.turn(0)
        with pytest.raises(NotReady, match="manual mode in the middle"):
            board.deliver(sender)
        assert board.ask(request(Kind.OPEN, 5)).startswith(b"=84" + b"0" * 20)
        board.turn(AUTOMATIC)
        board.deliver(Sender(JOB))

    def test_reset_is_told(self, board):
        sender = Sender(JOB)
        board.deliver(sender, until=1)
        board.press(RESET)
        with pytest.raises(WasReset):
            board.deliver(sender)

    def test_stop_is_told_until_reset(self, board):
        sender = Sender(JOB)
        board.deliver(sender, until=1)
        board.press(STOP)
        before = board.engine.get(*AXES)
        with pytest.raises(NotReady, match="stopped"):
            board.deliver(sender)
        board.turn(0)
        assert board.ask(request(Kind.QUERY))[2:3] == b"6"  # stopped, and manual
        assert board.engine.get(*AXES) == before
        board.turn(AUTOMATIC)
        board.press(RESET)
        assert board.ask(request(Kind.QUERY))[2:3] == b"0"

    def test_a_refused_order_is_told_and_not_passed_over(self, board):
        job = [Order(Kind.UP), Order(Kind.GO, 4, 4), Order(Kind.DOWN), Order(Kind.GO, 5, 9)]
        sender = Sender(job)
        with pytest.raises(OrderRefused) as caught:
            board.deliver(sender)
        assert caught.value.number == 4
        assert board.leds & ERROR
        before = board.engine.get(*AXES)
        board.line.run(2000)
        assert board.engine.get(*AXES) == before
        assert board.ask(request(Kind.QUERY))[1:3] == b"01"
