"""What the panel says that the machine does: one word, which is true."""

import asyncio

import pytest

from fresa_host import LineLost
from tests.tools.panel.session import STOP, session


def mode(site) -> str:
    return site.told("state")["mode"]


def note(site) -> str:
    return site.told("state")["note"]


def test_going_ends_with_stop(fake, path):
    async def what(site):
        assert mode(site) == "Not connected"
        await site.connect()
        assert mode(site) == "Idle" and note(site).startswith("Connected")
        site.do("point", number=2, place=[5000, 0, 0])
        site.do("go", number=2)
        assert (mode(site), note(site)) == ("Going", "To point 2.")
        await site.until(lambda: not fake.resting)
        site.do("stop")
        assert mode(site) == "Going" and note(site) == ""  # it has not been seen to stand yet
        await site.until(lambda: mode(site) == "Stopped")
        assert fake.resting and note(site) == ""
        site.do("jog", directions=[0, 0, 1])
        assert mode(site) == "Jogging"
        site.do("jog", directions=[0, 0, 0])
        await site.until(lambda: mode(site) == "Idle")
        assert fake.resting
        site.do("disconnect")
        await site.until(lambda: mode(site) == "Not connected")

    session(path, what)


def test_arriving_is_idle(fake, path):
    async def what(site):
        await site.connect()
        site.do("point", number=2, place=[50, 0, 0])
        site.do("go", number=2)
        await site.until(lambda: mode(site) == "Idle")
        assert note(site) == "At point 2." and fake.steps[0] == 2838
        site.do("jog", directions=[1, 0, 0])
        site.do("jog", directions=[0, 0, 0])
        await site.until(lambda: mode(site) == "Idle")
        assert note(site) == ""  # it is not there any more

    session(path, what)


def test_a_jog_ends_going_with_all_axes(fake, path):
    async def what(site):
        await site.connect()
        site.do("point", number=1, place=[5000, 5000, 5000])
        site.do("go", number=1)
        await site.until(lambda: fake.steps[2] > 0)
        begun = len(fake.written)
        site.do("jog", directions=[0, -1, 0])
        assert mode(site) == "Jogging" and note(site) == ""
        await site.until(lambda: fake.steps[1] < 0)
        assert fake.written[begun:begun + 4] == [*STOP, b"MOV MOT2 CC\n"]
        assert fake.steps[0] == fake.target[0] and fake.steps[2] == fake.target[2]
        assert mode(site) == "Jogging" and site.told("state")["goal"] is None

    session(path, what)


def test_going_ends_a_jog(fake, path):
    async def what(site):
        await site.connect()
        site.do("point", number=1, place=[1, 1, 1])
        site.do("jog", directions=[1, 0, 0])
        await site.until(lambda: fake.steps[0] > 3000)
        site.do("go", number=1)
        assert mode(site) == "Going" and site.told("state")["directions"] == [0, 0, 0]
        await site.until(lambda: mode(site) == "Idle")
        assert fake.steps == [57, 57, 57]

    session(path, what)


def test_a_limit(fake, path):
    async def what(site):
        await site.connect()
        fake.blocked = [b"MOV MOT1 C\n"]
        site.do("jog", directions=[1, 0, 0])
        await site.until(lambda: mode(site) == "Limit")  # although it is held
        site.do("jog", directions=[1, 1, 0])
        assert mode(site) == "Jogging"
        site.do("jog", directions=[0, 0, 0])
        await site.until(lambda: mode(site) == "Limit")
        site.do("jog", directions=[-1, 0, 0])
        assert mode(site) == "Jogging"
        site.do("jog", directions=[0, 0, 0])
        await site.until(lambda: mode(site) == "Idle")

    session(path, what)


@pytest.mark.parametrize("what_fails", ["reports", "line"])
def test_lost(fake, path, soon_stale, what_fails):
    async def what(site):
        await site.connect()
        site.do("jog", directions=[1, 0, 0])
        if what_fails == "reports":
            fake.connected = False
        else:
            fake.gone = True
        await site.until(lambda: mode(site) == "Lost")
        fake.connected, fake.gone = True, False
        if what_fails == "line":
            assert isinstance(site.panel._machine._session.lost, LineLost)
            await site.connect()
            assert mode(site) == "Idle"
        else:
            await site.until(lambda: mode(site) != "Lost")

    session(path, what)


class TestTwoPages:
    def test_the_second_takes_over(self, fake, path):
        async def what(site):
            await site.connect()
            other = site.panel.view()
            for page, name in ((site.page, "one"), (other, "two")):
                site.panel.do(page, "page", {"name": name})
            site.do("jog", directions=[1, 0, 0])
            assert site.told("state")["controller"] == "one"
            await site.until(lambda: fake.steps[0] > 0)
            site.panel.do(other, "jog", {"directions": [0, 1, 0]})
            assert site.told("state")["controller"] == "two"
            assert site.told("state")["directions"] == [0, 1, 0]
            await site.until(lambda: fake.steps[1] > 0)
            assert fake.steps[0] == fake.target[0]
            # The first still holds its key; that and letting go of it change nothing.
            site.do("holding")
            site.do("jog", directions=[0, 0, 0])
            await asyncio.sleep(0.05)
            assert site.told("state")["directions"] == [0, 1, 0]
            site.do("point", number=1, place=[1, 1, 1])
            site.do("go", number=1)
            assert site.told("state")["controller"] == "one" and mode(site) == "Going"
            site.panel.left(site.page)
            await site.until(lambda: site.told("state")["controller"] is None)

        session(path, what)

    def test_stop_of_either_stops(self, fake, path):
        async def what(site):
            await site.connect()
            other = site.panel.view()
            site.do("jog", directions=[1, 0, 0])
            await site.until(lambda: fake.steps[0] > 0)
            site.panel.do(other, "stop", {})
            await site.until(lambda: mode(site) == "Stopped")
            assert fake.resting

        session(path, what)
