"""Nothing moves that nobody holds, whatever becomes of orders to stop."""

import asyncio
import threading

import pytest

from fresa_host import LineLost
from tests.host.fake import BREAK
from tests.tools.panel.session import PORT, STOP, session
from tools.panel import jogging, machine, panel


def test_what_is_held_moves_and_what_is_let_go_stops(fake, path):
    async def what(site):
        await site.connect()
        begun = len(fake.written)
        site.do("jog", directions=[1, -1, 0])
        site.do("jog", directions=[0, -1, 0])
        site.do("jog", directions=[0, 0, 1])
        site.do("jog", directions=[0, 0, 1])
        assert site.told("state")["directions"] == [0, 0, 1]
        site.panel.left(site.page)
        assert fake.written[begun:] == [
            b"MOV MOT1 C\n", b"MOV MOT2 CC\n", b"STOP MOT1\n", b"STOP MOT2\n", b"MOV MOT3 C\n",
            b"STOP MOT3\n"]

    session(path, what)


def test_a_page_that_hangs_holds_nothing(fake, path, monkeypatch):
    monkeypatch.setattr(jogging, "HOLD_TIMEOUT_S", 60)

    async def what(site):
        await site.connect()
        site.do("jog", directions=[1, 0, 0])
        await asyncio.sleep(0.05)
        site.do("holding")
        assert fake.orders[-1] == b"MOV MOT1 C\n"
        monkeypatch.setattr(jogging, "HOLD_TIMEOUT_S", 0.01)
        await site.until(lambda: fake.orders[-1] == b"STOP MOT1\n")
        site.do("holding")  # too late: it must be pressed again
        await asyncio.sleep(0.05)
        assert fake.orders[-1] == b"STOP MOT1\n"

    session(path, what)


def test_stop_stops_what_others_hold(fake, path):
    async def what(site):
        await site.connect()
        site.do("jog", directions=[1, 0, 0])
        site.panel.do(site.panel.view(), "stop", {})
        site.do("holding")
        await asyncio.sleep(0.05)
        assert fake.orders[-4:] == [b"MOV MOT1 C\n", *STOP]

    session(path, what)


def test_a_machine_that_was_left_moving_is_stopped(fake, path):
    """The panel was killed, say, or the plug pulled, while a button was held."""
    fake.deaf = [STOP[1], STOP[1]]
    fake.connected, fake.target = True, [10**6, -10**6, 0]

    async def what(site):
        await site.connect()
        assert fake.resting and site.told("place")["steps"] == fake.steps

    session(path, what)


def test_a_machine_that_does_not_stop_is_not_connected(fake, path, monkeypatch):
    monkeypatch.setattr(machine, "ANSWER_TIMEOUT_S", 0.1)
    fake.target, fake.refuse = [10**9, 0, 0], {b"STOP": b"! DAMAGED\n"}

    async def what(site):
        site.do("connect", port=PORT)
        await site.until(lambda: site.told("state")["note"])
        assert "does not stop: it moves" in site.told("state")["note"]
        assert not site.told("state")["connected"] and fake.closed
        assert not fake.connected  # without power it does

    session(path, what)


@pytest.mark.parametrize("stop", [lambda site: site.do("jog", directions=[0, 0, 0]),
                                  lambda site: site.do("stop")])
def test_an_order_to_stop_that_is_lost_is_repeated(fake, path, stop):
    async def what(site):
        await site.connect()
        site.do("jog", directions=[0, 1, 0])
        await site.until(lambda: fake.steps[1] > 5000)
        fake.deaf = [STOP[1]] * 3
        stop(site)
        await site.until(lambda: not fake.deaf and fake.resting)

    session(path, what)


def test_what_is_on_its_way_or_held_is_not_stopped(fake, path):
    async def what(site):
        await site.connect()
        begun = len(fake.written)
        site.do("point", number=1, place=[1000, 0, 300])
        site.do("go", number=1)
        await site.until(lambda: fake.steps[2] == fake.target[2] != 0)
        await site.until(lambda: site.told("place")["steps"][0] == fake.target[0] == 56761)
        await site.until(lambda: site.told("state")["mode"] == "Idle")
        site.do("jog", directions=[0, 1, 0])
        await site.until(lambda: site.told("place")["steps"][1] > 0)
        assert not any(line.startswith(b"STOP") for line in fake.written[begun:])
        # Once there it has no business to move.
        fake.target = [0, *fake.target[1:]]
        await site.until(lambda: STOP[0] in fake.written[begun:] and STOP[2] not in fake.written[
            begun:])

    session(path, what)


def test_stop_sends_a_break_and_tells_again_what_that_may_have_damaged(fake, path):
    fake.can_break = True

    async def what(site):
        await site.connect()
        assert BREAK not in fake.written  # of an answer to it nobody knew yet
        site.do("speed", axis=0, speed=26)
        site.do("jog", directions=[1, 0, 0])
        await site.until(lambda: fake.steps[0] > 0)
        begun = len(fake.written)
        note = site.told("state")["note"]
        fake.deaf = [b"VEL MOT2 1476\n"]  # the break damages it
        site.do("speed", axis=1, speed=26)
        site.do("stop")
        assert fake.orders[-4:] == [BREAK, *STOP]
        assert fake.written[begun:begun + 3] == [b"VEL MOT2 1476\n", BREAK, b"\n"]
        await site.until(lambda: fake.speeds[:2] == [1476, 1476])
        reports = site.told("place")["reports"]
        await site.until(lambda: site.told("place")["reports"] > reports + 5)
        assert fake.resting and site.told("state")["note"] == note  # the damaged line is our doing
        fake.say(b"! RANGE\n")
        await site.until(lambda: "RANGE" in site.told("state")["note"])
        fake.written.clear()
        site.do("disconnect")
        await site.until(lambda: not site.told("state")["connected"])

    session(path, what)
    assert fake.written[:5] == [BREAK, b"\n", *STOP]
    assert fake.written[-5:] == [*STOP, b"DISCONNECT\n", b"ACK 0\n"]


@pytest.mark.parametrize("let_go", [
    lambda site: site.do("jog", directions=[0, 0, 0]), lambda site: site.panel.left(site.page)])
def test_an_axis_that_does_not_hear_that_it_is_let_go_of_is_stopped_by_a_break(fake, path, let_go):
    fake.can_break = True

    async def what(site):
        await site.connect()
        site.do("jog", directions=[0, 1, 0])
        await site.until(lambda: fake.steps[1] > 5000)
        fake.deaf = [STOP[1]] * 1000
        let_go(site)
        await site.until(lambda: fake.resting)
        assert fake.written.count(BREAK) == 1 and fake.deaf
        fake.deaf = []

    session(path, what)


def test_a_break_ends_nothing_that_is_held(fake, path):
    fake.can_break = True

    async def what(site):
        await site.connect()
        site.do("jog", directions=[1, 1, 0])
        await site.until(lambda: fake.steps[1] > 5000)
        fake.deaf = [STOP[1]] * 5
        site.do("jog", directions=[1, 0, 0])
        await site.until(lambda: not fake.deaf and fake.target[1] != 10**6)
        assert BREAK not in fake.written and not fake.resting

    session(path, what)


def test_a_slider_does_not_hold_up_a_stop(fake, path, monkeypatch):
    monkeypatch.setattr(panel, "POLL_S", 0.1)

    async def what(site):
        await site.connect()
        site.do("jog", directions=[1, 0, 0])
        begun = len(fake.orders)
        for speed in range(1, 27):
            site.do("speed", axis=0, speed=speed)
        site.do("stop")
        assert fake.orders[begun:][-3:] == STOP and len(fake.orders) <= begun + 4
        await site.until(lambda: b"VEL MOT1 1476\n" in fake.written)
        assert sum(line.startswith(b"VEL") for line in fake.orders[begun:]) <= 2

    session(path, what)


def test_a_port_that_takes_nothing_is_lost_and_holds_nobody_up(fake, path, monkeypatch):
    monkeypatch.undo()
    monkeypatch.setattr(panel, "Port", lambda name: fake)
    full, over = threading.Event(), threading.Event()
    written = fake.write

    def write(data: bytes) -> None:
        if full.is_set():
            over.wait(20)
            raise LineLost("fake is gone: Write timeout")
        written(data)

    async def what(site):
        fake.write = write
        await site.connect()
        site.do("jog", directions=[1, 0, 0])
        await site.until(lambda: b"MOV MOT1 C\n" in fake.written)
        full.set()
        site.do("stop")
        await asyncio.sleep(0)
        assert site.told("state")["connected"]  # here before the port has given up
        over.set()
        await site.until(lambda: not site.told("state")["connected"])
        assert site.told("state")["note"] == (
            "fake is gone: Write timeout. The machine may still be moving.")
        full.clear()
        await site.connect()
        assert fake.resting

    session(path, what)
