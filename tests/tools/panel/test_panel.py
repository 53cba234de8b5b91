"""The panel between pages and a machine: what is sent, what is told, what is kept."""

import asyncio
import json
import threading
import time
from collections.abc import Callable
from contextlib import asynccontextmanager, suppress
from pathlib import Path

import pytest

from fresa_host import LineLost, positioner_link
from fresa_host.positioner_lines import Steps
from tests.host.fake import FakePositioner
from tools.console import UserError
from tools.panel import Panel, connecting, jogging, line, machine, panel
from tools.panel.kept import Kept, load, save

PORT = "/dev/fake"
STOP = [b"STOP MOT1\n", b"STOP MOT2\n", b"STOP MOT3\n"]


class Direct:
    """Says at once what the panel says in a thread of its own."""

    def __init__(self, send: Callable[[bytes], None]) -> None:
        self._send = send

    def say(self, orders: bytes) -> None:
        with suppress(LineLost):
            self._send(orders)

    def close(self) -> None:
        pass


@pytest.fixture
def fake(monkeypatch) -> FakePositioner:
    fake = FakePositioner()
    monkeypatch.setattr(line, "Speaker", Direct)
    monkeypatch.setattr(positioner_link, "Port", lambda name: fake)
    monkeypatch.setattr(panel, "LOOK", 0.01)
    monkeypatch.setattr(panel, "SAVE", 0.01)
    return fake


@pytest.fixture
def path(tmp_path) -> Path:
    return tmp_path / "panel.json"


class Site:
    """A panel, and what a page would know of it."""

    def __init__(self, panel: Panel) -> None:
        self.panel = panel
        self.page = panel.view()

    def told(self, about: str) -> dict:
        return json.loads(self.panel.pages.texts[about])

    def do(self, name: str, **fields: object) -> None:
        self.panel.do(self.page, name, fields)

    async def until(self, holds: Callable[[], object]) -> None:
        async with asyncio.timeout(20):
            while not holds():
                await asyncio.sleep(0.005)

    async def connect(self) -> None:
        self.do("connect", port=PORT)
        await self.until(lambda: not self.told("state")["doing"])
        assert self.told("state")["connected"], self.told("state")


@asynccontextmanager
async def opened(path: Path):
    panel = Panel(path, PORT, only=True)
    try:
        yield Site(panel)
    finally:
        await panel.close()


def session(path: Path, what: Callable) -> None:
    async def run() -> None:
        async with opened(path) as site:
            await what(site)

    asyncio.run(run())


def test_connecting_tells_the_machine_what_was_kept(fake, path):
    save(path, Kept("", Steps(0, 0, 0), (1, 2, 26)).with_point(2, (1, 1, 1)).with_point(
        3, (1, None, 1)))

    async def what(site):
        assert not site.told("state")["connected"]
        await site.connect()
        assert fake.written == [
            b"CONNECT\n", *STOP, b"CONNECT\n", *STOP, b"VEL MOT1 57\n", b"VEL MOT2 114\n",
            b"VEL MOT3 1476\n", b"P 2 57 57 57\n", b"P 7 0 0 0\n"]
        assert site.told("state")["note"].startswith("Connected")
        site.do("disconnect")
        await site.until(lambda: not site.told("state")["connected"])

    session(path, what)
    assert fake.written[-4:] == [*STOP, b"DISCONNECT\n"]
    assert fake.closed and load(path).port == PORT


def test_a_machine_that_was_off_is_told_where_it_is(fake, path, monkeypatch):
    save(path, Kept("", Steps(500, -500, 7)))

    def obey(line: bytes) -> bytes:
        late = b"# POS 0 0 0 :\n" * 2 if line.startswith(b"POS") else b""  # was on its way already
        return late + fake.obey(line)

    async def what(site):
        fake.answer = obey
        tell, places = site.panel.pages.tell, []
        monkeypatch.setattr(site.panel.pages, "tell", lambda about, fields: (
            tell(about, fields), places.append(fields["steps"]) if about == "place" else None))
        assert site.told("place")["steps"] == [500, -500, 7]  # before anything is connected
        await site.connect()
        await site.until(lambda: site.told("place")["reports"] > 3)
        assert set(places) == {(500, -500, 7)}
        assert b"POS 500 -500 7\n" in fake.written
        assert "had forgotten" in site.told("state")["note"]
        assert site.told("place")["steps"] == [500, -500, 7]

    session(path, what)
    assert load(path).steps == (500, -500, 7)


def test_a_machine_that_was_on_knows_better(fake, path):
    save(path, Kept("", Steps(500, -500, 7)))
    fake.steps = fake.target = [1, 2, 3]

    async def what(site):
        await site.connect()
        assert not any(line.startswith(b"POS") for line in fake.written)
        assert site.told("place")["steps"] == [1, 2, 3]
        assert site.told("place")["um"] == pytest.approx([1 / 56.761, 2 / 56.761, 3 / 56.761],
                                                         rel=1e-5)

    session(path, what)
    assert load(path).steps == (1, 2, 3)


def test_what_is_held_moves_and_what_is_let_go_stops(fake, path):
    async def what(site):
        await site.connect()
        begun = len(fake.written)
        site.do("jog", ways=[1, -1, 0])
        site.do("jog", ways=[0, -1, 0])
        site.do("jog", ways=[0, 0, 1])
        site.do("jog", ways=[0, 0, 1])
        assert site.told("state")["ways"] == [0, 0, 1]
        site.panel.left(site.page)
        assert fake.written[begun:] == [
            b"MOV MOT1 C\n", b"MOV MOT2 CC\n", b"STOP MOT1\n", b"STOP MOT2\n", b"MOV MOT3 C\n",
            b"STOP MOT3\n"]

    session(path, what)


def test_a_page_that_hangs_holds_nothing(fake, path, monkeypatch):
    monkeypatch.setattr(jogging, "PATIENCE", 60)

    async def what(site):
        await site.connect()
        site.do("jog", ways=[1, 0, 0])
        await asyncio.sleep(0.05)
        site.do("holding")
        assert fake.written[-1] == b"MOV MOT1 C\n"
        monkeypatch.setattr(jogging, "PATIENCE", 0.01)
        await site.until(lambda: fake.written[-1] == b"STOP MOT1\n")
        site.do("holding")  # too late: it must be pressed again
        await asyncio.sleep(0.05)
        assert fake.written[-1] == b"STOP MOT1\n"

    session(path, what)


def test_stop_stops_what_others_hold(fake, path):
    async def what(site):
        await site.connect()
        site.do("jog", ways=[1, 0, 0])
        site.panel.do(site.panel.view(), "stop", {})
        site.do("holding")
        await asyncio.sleep(0.05)
        assert fake.written[-4:] == [b"MOV MOT1 C\n", b"STOP MOT1\n", b"STOP MOT2\n",
                                     b"STOP MOT3\n"]

    session(path, what)


def test_points_are_stored_and_gone_to(fake, path):
    async def what(site):
        site.do("point", number=1, place=[100, 50, None])  # also before it is connected
        await site.connect()
        with pytest.raises(UserError, match="point 1 has an empty field"):
            site.do("go", number=1)
        site.do("point", number=1, place=[100, 50, 0])
        site.do("go", number=1)
        assert fake.written[-2:] == [b"P 1 5676 2838 0\n", b"GOTO 1\n"]
        assert site.told("state")["goal"] == 1
        await site.until(lambda: site.told("state")["goal"] is None)
        assert site.told("state")["note"] == "At point 1."
        assert site.told("place")["steps"] == [5676, 2838, 0]
        site.do("origin")
        await site.until(lambda: site.told("place")["steps"] == [0, 0, 0])
        fake.steps = fake.target = [57, 0, -57]
        await site.until(lambda: site.told("place")["steps"] == [57, 0, -57])
        site.do("here", number=6)
        assert fake.written[-1] == b"P 6 57 0 -57\n"
        site.do("speed", axis=1, speed=20)
        await site.until(lambda: fake.written[-1] == b"VEL MOT2 1135\n")

    session(path, what)
    kept = load(path)
    assert kept.points[0] == (100, 50, 0) and kept.points[5] == (1, 0, -1)
    assert kept.speeds == (4, 20, 4) and kept.steps == (57, 0, -57)


def resting(fake: FakePositioner) -> bool:
    return fake.steps == fake.target


def test_a_machine_that_was_left_moving_is_stopped(fake, path):
    """The panel was killed, say, or the plug pulled, while a button was held."""
    fake.deaf = [STOP[1], STOP[1]]
    fake.connected, fake.target = True, [10**6, -10**6, 0]

    async def what(site):
        await site.connect()
        assert resting(fake) and site.told("place")["steps"] == fake.steps

    session(path, what)


def test_a_machine_that_does_not_stop_is_not_connected(fake, path, monkeypatch):
    monkeypatch.setattr(connecting, "PATIENCE", 0.1)
    fake.target, fake.refuse = [10**9, 0, 0], {b"STOP": b"! DAMAGED\n"}

    async def what(site):
        site.do("connect", port=PORT)
        await site.until(lambda: site.told("state")["note"])
        assert "does not stop: it moves" in site.told("state")["note"]
        assert not site.told("state")["connected"] and fake.closed
        assert not fake.connected  # without power it does

    session(path, what)


@pytest.mark.parametrize("stop", [lambda site: site.do("jog", ways=[0, 0, 0]),
                                  lambda site: site.do("stop")])
def test_an_order_to_stop_that_is_lost_is_repeated(fake, path, stop):
    async def what(site):
        await site.connect()
        site.do("jog", ways=[0, 1, 0])
        await site.until(lambda: fake.steps[1] > 5000)
        fake.deaf = [STOP[1]] * 3
        stop(site)
        await site.until(lambda: not fake.deaf and resting(fake))

    session(path, what)


def test_what_is_on_its_way_or_held_is_not_stopped(fake, path):
    async def what(site):
        await site.connect()
        begun = len(fake.written)
        site.do("point", number=1, place=[1000, 0, 300])
        site.do("go", number=1)
        await site.until(lambda: fake.steps[2] == fake.target[2])
        await asyncio.sleep(0.05)
        site.do("jog", ways=[0, 1, 0])
        await site.until(lambda: site.told("place")["steps"][0] == fake.target[0] == 56761)
        assert not any(line.startswith(b"STOP") for line in fake.written[begun:])
        # Once there it has no business to move.
        fake.target = [0, *fake.target[1:]]
        await site.until(lambda: STOP[0] in fake.written[begun:] and STOP[2] not in fake.written[
            begun:])

    session(path, what)


def test_a_machine_that_stands_at_its_origin_is_believed(fake, path):
    """Somebody may have made that the origin with another program since."""
    async def what(site):
        await site.connect()
        site.do("go", number=site.do("point", number=2, place=[20, 0, 0]) or 2)
        await site.until(lambda: site.told("place")["steps"] == [1135, 0, 0])
        site.do("go", number=site.do("point", number=7, place=[40, 0, 0]) or 7)
        await site.until(lambda: site.told("place")["steps"] == [2270, 0, 0])

    session(path, what)
    assert load(path).steps == (2270, 0, 0)
    assert fake.points["7"] == [0, 0, 0]  # asking for it will move nothing
    fake.steps = fake.target = [0, 0, 0]
    fake.written.clear()

    async def again(site):
        await site.connect()
        await asyncio.sleep(0.05)
        assert site.told("place")["steps"] == [0, 0, 0] == fake.steps
        assert b"GOTO 7\n" in fake.written and site.told("state")["note"].startswith("Connected")

    session(path, again)
    assert not any(line.startswith(b"POS") for line in fake.written)


def test_asking_whether_it_was_reset_moves_a_step_at_most(fake, path):
    """Another program has put the point elsewhere; what moves is stopped in the same breath."""
    save(path, Kept("", Steps(5, 5, 5)))
    fake.points["7"] = [10**6, 0, 0]

    async def what(site):
        await site.connect()
        assert resting(fake)

    session(path, what)
    asked = fake.written.index(b"GOTO 7\n")
    assert fake.written[asked - 3:asked + 4] == [
        b"VEL MOT1 1\n", b"VEL MOT2 1\n", b"VEL MOT3 1\n", b"GOTO 7\n", *STOP]


@pytest.mark.parametrize("wrong", [b"", b"! COMMAND\n", b"! RANGE\n", b"! DAMAGED\n"])
def test_a_question_that_was_disturbed_is_asked_again(fake, path, wrong):
    save(path, Kept("", Steps(5, 5, 5)))
    damaged = [b"GOTO 7\n"] if wrong else [b"VEL MOT1 0\n", b"GOTO 7\n"]

    def obey(line: bytes) -> bytes:
        if line in damaged:
            damaged.remove(line)
            return wrong
        return fake.obey(line)

    async def what(site):
        fake.answer = obey
        await site.connect()
        assert site.told("place")["steps"] == [5, 5, 5] == fake.steps and not damaged

    session(path, what)


def test_a_place_that_was_lost_on_the_line_is_told_again(fake, path):
    save(path, Kept("", Steps(5, 5, 5)))
    fake.deaf = [b"POS 5 5 5\n"]

    async def what(site):
        await site.connect()
        assert fake.steps == [5, 5, 5] and not fake.deaf

    session(path, what)


def test_a_place_that_was_told_does_not_freeze(fake, path):
    save(path, Kept("", Steps(5, 5, 5)))

    async def what(site):
        await site.connect()
        site.do("jog", ways=[1, 0, 0])
        begun = time.monotonic()
        await site.until(lambda: site.told("place")["steps"][0] > 2000)
        assert time.monotonic() < begun + connecting.PATIENCE / 2

    session(path, what)


def test_a_slider_does_not_hold_up_a_stop(fake, path, monkeypatch):
    monkeypatch.setattr(panel, "LOOK", 0.1)

    async def what(site):
        await site.connect()
        site.do("jog", ways=[1, 0, 0])
        begun = len(fake.written)
        for speed in range(1, 27):
            site.do("speed", axis=0, speed=speed)
        site.do("stop")
        assert fake.written[begun:begun + 3] == STOP
        await site.until(lambda: b"VEL MOT1 1476\n" in fake.written)
        assert sum(line.startswith(b"VEL") for line in fake.written[begun:]) == 1

    session(path, what)


def test_a_port_that_is_lost_while_it_connects_is_named(fake, path):
    def obey(line: bytes) -> bytes:
        fake.gone = True
        return b""

    async def what(site):
        fake.answer = obey
        site.do("connect", port=PORT)
        await site.until(lambda: site.told("state")["note"])
        assert site.told("state")["note"] == "fake is gone: unplugged"
        fake.gone, fake.answer = False, fake.obey
        await site.connect()

    session(path, what)


def test_a_port_that_takes_nothing_is_lost_and_holds_nobody_up(fake, path, monkeypatch):
    monkeypatch.undo()
    monkeypatch.setattr(positioner_link, "Port", lambda name: fake)
    full = threading.Event()
    written = fake.write

    def write(data: bytes) -> None:
        if full.is_set():
            time.sleep(0.3)
            raise LineLost("fake is gone: Write timeout")
        written(data)

    async def what(site):
        fake.write = write
        await site.connect()
        site.do("jog", ways=[1, 0, 0])
        await site.until(lambda: b"MOV MOT1 C\n" in fake.written)
        full.set()
        begun = time.monotonic()
        site.do("stop")
        await asyncio.sleep(0)
        assert time.monotonic() < begun + 0.2
        await site.until(lambda: not site.told("state")["connected"])
        assert site.told("state")["note"] == (
            "fake is gone: Write timeout. What moved may still move.")
        full.clear()
        await site.connect()
        assert resting(fake)

    session(path, what)


def test_what_needs_a_machine_says_so(fake, path):
    async def what(site):
        for name, fields in [("origin", {}), ("go", {"number": 1}), ("here", {"number": 1}),
                             ("jog", {"ways": [1, 0, 0]})]:
            with pytest.raises(UserError, match="not connected"):
                site.do(name, **fields)
        site.do("jog", ways=[0, 0, 0])
        site.do("stop")
        with pytest.raises(UserError, match="there is no port /etc/passwd: choose one of the list"):
            site.do("connect", port="/etc/passwd")
        with pytest.raises(UserError, match="there is no 'explode'"):
            site.do("explode")
        assert not fake.written

    session(path, what)


def test_what_the_machine_complains_of_is_told(fake, path):
    async def what(site):
        await site.connect()
        site.do("jog", ways=[1, 0, 0])
        fake.say(b"! LIMIT MOT1\n")
        await site.until(lambda: site.told("state")["limits"] == ["x"])
        assert site.told("state")["bad"] and "limit switch stopped X" in site.told("state")["note"]
        site.do("jog", ways=[-1, 0, 0])
        assert site.told("state")["limits"] == []
        fake.say(b"! RANGE\n")
        await site.until(lambda: "RANGE" in site.told("state")["note"])

    session(path, what)


def test_silence_and_a_lost_line_are_told(fake, path, monkeypatch):
    monkeypatch.setattr(machine, "SILENCE", 0.1)

    async def what(site):
        await site.connect()
        fake.connected = False
        await site.until(lambda: site.told("state")["silent"])
        fake.connected = True
        await site.until(lambda: not site.told("state")["silent"])
        fake.gone = True
        await site.until(lambda: not site.told("state")["connected"])
        assert "fake is gone: unplugged" in site.told("state")["note"]
        fake.gone = False
        await site.connect()

    session(path, what)


def test_a_port_without_a_machine(fake, path, monkeypatch):
    monkeypatch.setattr(line, "PATIENCE", 0.05)
    fake.refuse = {b"CONNECT": b""}

    async def what(site):
        site.do("connect", port=PORT)
        with pytest.raises(UserError, match="connecting: wait a moment"):
            site.do("connect", port=PORT)
        await site.until(lambda: site.told("state")["note"])
        assert site.told("state")["note"] == f"no positioner reports at {PORT}: is it on?"
        assert site.told("state")["bad"] and not site.told("state")["connected"] and fake.closed

    session(path, what)


def test_ending_while_it_connects(fake, path):
    fake.refuse = {b"CONNECT": b""}

    async def what(site):
        site.do("connect", port=PORT)
        await site.until(lambda: fake.written)

    session(path, what)
    assert fake.closed


def test_a_disk_that_is_full_is_told_and_stops_nothing(fake, path, monkeypatch):
    def full(*_):
        raise UserError("cannot write panel.json: No space left on device")

    async def what(site):
        await site.connect()
        monkeypatch.setattr(panel, "save", full)
        site.do("speed", axis=0, speed=9)
        await site.until(lambda: "Nothing is kept" in site.told("state")["note"])
        site.do("jog", ways=[1, 0, 0])
        assert b"MOV MOT1 C\n" in fake.written

    session(path, what)
