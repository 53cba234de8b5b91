"""Going to points over a line that damages what is sent, and what comes in between."""

import asyncio

import pytest

from fresa_host import axis_monitor
from tests.tools.panel.session import STOP, session
from tools.panel import machine


def go(site, number: int, x: int, y: int = 0) -> None:
    site.do("point", number=number, place=[x, y, 0])
    site.do("go", number=number)


async def settle(site) -> None:
    """Let the machine report a few times."""
    reports = site.told("place")["reports"]
    await site.until(lambda: site.told("place")["reports"] > reports + 5)


@pytest.mark.parametrize("damaged", [b"P 7 -1x028 0 0\n", b"X 7 -17028 0 0\n"])
def test_a_point_that_is_refused_is_not_gone_to(fake, path, damaged):
    async def what(site):
        await site.connect()
        go(site, 1, 200)
        await site.until(lambda: "At point 1" in site.told("state")["note"])
        site.do("point", number=7, place=[-300, 0, 0])
        await settle(site)
        begun = len(fake.orders)
        fake.damage = {b"P 7 -17028 0 0\n": damaged}
        site.do("go", number=7)
        await site.until(lambda: "refused" in site.told("state")["note"])
        assert site.told("state")["goal"] is None and site.told("state")["bad"]
        await settle(site)
        assert fake.orders[begun:] == [b"P 7 -17028 0 0\n", *STOP]
        assert fake.steps == [11352, 0, 0] and fake.resting
        fake.target = [10**6, 0, 0]  # nobody sent it there
        await site.until(lambda: fake.resting)

    session(path, what)


def test_an_order_to_go_that_is_refused_ends_the_way_before(fake, path):
    async def what(site):
        await site.connect()
        go(site, 1, 10_000)
        await site.until(lambda: not fake.resting)
        fake.refuse = {b"VEL": b"! RANGE\n"}
        site.do("speed", axis=2, speed=9)
        await site.until(lambda: "RANGE" in site.told("state")["note"])
        assert site.told("state")["goal"] == 1 and not fake.resting  # which is another line
        fake.damage = {b"GOTO 2\n": b"GOTO 9\n"}
        go(site, 2, 10)
        await site.until(lambda: "EMPTY" in site.told("state")["note"])
        await site.until(lambda: fake.resting)
        assert site.told("state")["goal"] is None and fake.steps[0] < 567_000

    session(path, what)


def test_going_elsewhere_is_ended_and_told(fake, path, monkeypatch):
    async def what(site):
        await site.connect()
        for number, y in [(1, 10_000), (2, 10)]:
            site.do("point", number=number, place=[0, y, 0])
        await settle(site)
        fake.damage = {b"P 1 0 567610 0\n": b"P 1 0 -99967610 0\n",
                       b"P 2 0 568 0\n": b"P 2 0 1568 0\n"}
        site.do("go", number=1)
        await site.until(lambda: "did not reach point 1" in site.told("state")["note"])
        await site.until(lambda: fake.resting)
        assert site.told("state")["goal"] is None and site.told("state")["bad"]
        monkeypatch.setattr(axis_monitor, "STILL", 5)
        site.do("go", number=2)
        await site.until(lambda: "did not reach point 2" in site.told("state")["note"])
        assert fake.steps == [0, 1568, 0]

    session(path, what)


@pytest.mark.parametrize("between", [
    lambda site: site.do("stop"), lambda site: site.do("jog", directions=[0, 0, 1]),
    lambda site: site.do("origin"), lambda site: site.do("go", number=2)])
def test_what_comes_before_it_departs_calls_it_off(fake, path, between):
    async def what(site):
        await site.connect()
        site.do("point", number=2, place=[0, 0, 0])
        go(site, 7, 100)
        between(site)
        await settle(site)
        assert b"GOTO 7\n" not in fake.written

    session(path, what)


def test_it_departs_to_what_the_point_was(fake, path):
    async def what(site):
        await site.connect()
        go(site, 3, 100)
        site.do("point", number=3, place=[1, 1, 1])
        await site.until(lambda: "At point 3" in site.told("state")["note"])
        assert fake.steps == [5676, 0, 0] and fake.points["3"] == [57, 57, 57]

    session(path, what)


def test_a_machine_that_falls_silent_does_not_depart_later(fake, path, monkeypatch):
    monkeypatch.setattr(machine, "ANSWER_TIMEOUT_S", 0.5)

    async def what(site):
        await site.connect()
        fake.original = True
        go(site, 1, 100)
        await asyncio.sleep(1.2)
        fake.original = False
        await site.until(lambda: "did not reach point 1" in site.told("state")["note"])
        await settle(site)
        assert fake.steps == [0, 0, 0] and b"GOTO 1\n" not in fake.written

    session(path, what)


def test_a_refusal_right_behind_a_break_may_be_of_the_point(fake, path):
    fake.can_break = True

    async def what(site):
        await site.connect()
        site.do("stop")
        await settle(site)
        fake.refuse = {b"P": b"! DAMAGED\n"}
        go(site, 1, 100)
        await site.until(lambda: "DAMAGED" in site.told("state")["note"])
        await settle(site)
        assert b"GOTO 1\n" not in fake.written

    session(path, what)


def test_a_limit_that_was_on_its_way_does_not_end_the_way_back(fake, path):
    def obey(line: bytes) -> bytes:
        late = b"! LIMIT MOT1\n" if line in late_at else b""
        late_at.discard(line)
        return late + fake.obey(line)

    late_at = {b"MOV MOT1 CC\n", b"GOTO 1\n"}

    async def what(site):
        await site.connect()
        fake.answer = obey
        site.do("jog", directions=[1, 0, 0])
        site.do("jog", directions=[-1, 0, 0])
        await settle(site)
        assert site.told("state")["limits"] == [] and fake.target[0] == -10**6
        assert fake.orders[-2:] == [b"MOV MOT1 CC\n"] * 2
        fake.blocked = [b"MOV MOT1 CC\n"]
        fake.say(b"! LIMIT MOT1\n")  # by now it is of this way
        await site.until(lambda: site.told("state")["limits"] == ["x"])
        site.do("stop")
        await settle(site)
        # On the way to a point nobody holds anything: the axis stands, as is told, the other goes.
        x = fake.steps[0]
        go(site, 1, 10_000, 10)
        await site.until(lambda: fake.steps[1] == 568)
        assert site.told("state")["limits"] == ["x"] and fake.steps[0] < x + 5000 and fake.resting

    session(path, what)
