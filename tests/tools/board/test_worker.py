"""Orders on their way to the process that runs, and what it does with too many."""

import threading
from collections.abc import Iterator
from contextlib import closing
from multiprocessing import Pipe
from multiprocessing.connection import Connection

import numpy as np
import pytest

from tb.engines import AmaranthEngine
from tb.milling import ready_to_mill
from tools.board import worker as workers
from tools.board.machine import Machine
from tools.board.messages import Job
from tools.board.outbox import MOST_WAITING, Outbox
from tools.board.worker import Worker


class Flood:
    """The end of a connection at which orders never end, until three were answered."""

    def __init__(self) -> None:
        self.taken = self.answered = 0

    def poll(self, _: float) -> bool:
        return True

    def recv(self) -> tuple[str]:
        self.taken += 1
        assert self.taken < 10_000, "it obeys and does nothing else"
        return ("snapshot",) if self.answered < 3 else ("quit",)

    def send(self, message: tuple) -> None:
        self.answered += message[0] == "snapshot"


def test_a_flood_of_orders_does_not_stop_it():
    flood = Flood()
    Worker(flood, "amaranth").serve()  # type: ignore[arg-type]
    assert flood.answered == 3


def test_a_step_that_does_not_come_is_given_up(monkeypatch):
    pixels = np.array([[1]], bool)
    ours, its = Pipe()
    worker = Worker(its, "amaranth")
    worker._machine = Machine(
        ready_to_mill(pixels, AmaranthEngine, period=2, scan_bits=3, traceable=True),
        Job(pixels, "dot", 2))
    worker.step()
    worker._advance()
    assert worker._moving
    monkeypatch.setattr(workers, "STEP_TIMEOUT_S", 0)
    worker.step()
    worker._advance()
    assert not worker._moving
    assert worker._machine.clock <= 2 * workers.FIRST_SLICE * 2
    worker._switch_off()


@pytest.fixture
def pair() -> Iterator[tuple[Outbox, Connection]]:
    """Give an outbox and the other end of its connection."""
    ours, its = Pipe()
    with closing(Outbox(ours)) as outbox:
        yield outbox, its


class TestOutbox:
    def test_nobody_waits_and_the_newest_counts(self, pair):
        outbox, its = pair

        def put() -> None:
            for n in range(20_000):
                outbox.put("inputs", n, 0)
                outbox.put("speed", n)
            outbox.put("quit")

        giver = threading.Thread(target=put, daemon=True)
        giver.start()
        giver.join(30)
        assert not giver.is_alive(), "it waits for one who does not listen"
        assert len(outbox) <= MOST_WAITING + 3
        got = []
        while not got or got[-1] != ("quit",):
            assert its.poll(30)
            got.append(its.recv())
        for name in ("inputs", "speed"):
            numbers = [order[1] for order in got if order[0] == name]
            assert numbers == sorted(numbers)
            assert numbers[0] == 0 and numbers[-1] == 19_999
        assert len(got) < 20_000

    def test_few_orders_all_arrive(self, pair):
        outbox, its = pair
        orders = [("inputs", 0, n % 2) for n in range(MOST_WAITING)]
        for order in orders:
            outbox.put(*order)
        assert [its.recv() for _ in orders] == orders

    def test_a_broken_connection_is_nothing_to_it(self):
        ours, its = Pipe()
        its.close()
        before = threading.enumerate()
        outbox = Outbox(ours)
        thread, = (thread for thread in threading.enumerate() if thread not in before)
        outbox.put("run")
        thread.join(30)
        assert not thread.is_alive()
        outbox.put("run")
        outbox.close()
