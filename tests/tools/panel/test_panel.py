"""The panel between pages and a machine: what is sent, what is told, what is kept."""

import asyncio
import json
import os
import time

import pytest

from tests.tools.panel.session import PORT, STOP, session
from tools.console import UserError
from tools.panel import machine, store
from tools.panel.settings import Settings, load, save
from tools.panel.stage import Steps


def test_connecting_tells_the_machine_what_was_kept(fake, path):
    save(path, Settings("", Steps(0, 0, 0), (1, 2, 26)).with_point(2, (1, 1, 1)).with_point(
        3, (1, None, 1)))

    async def what(site):
        assert not site.told("state")["connected"]
        await site.connect()
        assert fake.orders == [*STOP, b"VEL MOT1 57\n", b"VEL MOT2 114\n", b"VEL MOT3 1476\n",
                               b"P 2 57 57 57\n", b"CONNECT\n"]
        assert site.told("state")["note"].startswith("Connected")
        site.do("disconnect")
        await site.until(lambda: not site.told("state")["connected"])

    session(path, what)
    assert fake.written[-5:] == [*STOP, b"DISCONNECT\n", b"ACK 0\n"]
    assert fake.closed and load(path).port == PORT


@pytest.mark.parametrize("older", [False, True])
def test_a_machine_that_was_off_is_told_where_it_is(fake, path, monkeypatch, older):
    save(path, Settings("", Steps(500, -500, 7), on_since=time.time() - 3600))
    if older:  # it was on when the file was written
        settings = json.loads(path.read_text())
        del settings["on_since"], settings["known"]
        path.write_text(json.dumps(settings))
        os.utime(path, (0, time.time() - 60))
    fake.seconds = 50

    async def what(site):
        publish, places = site.panel.pages.publish, []
        monkeypatch.setattr(site.panel.pages, "publish", lambda about, fields: (
            publish(about, fields), places.append(fields["steps"]) if about == "place" else None))
        assert site.told("place")["steps"] == [500, -500, 7]  # before anything is connected
        await site.connect()
        await site.until(lambda: site.told("place")["reports"] > 3)
        assert set(places) == {(500, -500, 7)}
        assert b"POS 500 -500 7\n" in fake.written
        assert "was reset" in site.told("state")["note"]
        assert site.told("place")["steps"] == [500, -500, 7]

    session(path, what)
    assert load(path).steps == (500, -500, 7)


def test_that_it_moves_is_saved_before_it_does(fake, path):
    marks = []

    def obey(line: bytes) -> bytes:
        if line.startswith((b"MOV", b"GOTO 1")):
            marks.append(path.with_name("panel.json.lock").read_bytes())
        return fake.obey(line)

    async def what(site):
        await site.connect()
        fake.answer = obey
        site.do("point", number=1, place=[200, 0, 0])
        for move in (lambda: site.do("jog", directions=[1, 0, 0]),
                     lambda: site.do("go", number=1)):
            move()
            await site.until(lambda: not fake.resting)
            assert site.told("place")["moving"]
            site.do("stop")
            await site.until(lambda: not site.told("place")["moving"])
            assert fake.resting and load(path).steps == tuple(fake.steps)

    session(path, what)
    assert marks == [b"moving "] * 2


def killed_in_a_jog(fake, path) -> None:
    """Leave what a panel leaves that is killed while an axis is held."""
    async def what(site):
        await site.connect()
        site.do("jog", directions=[1, 0, 0])
        await site.until(lambda: load(path).steps.x > 0)

    session(path, what)
    lock = path.with_name("panel.json.lock")
    assert lock.read_bytes() == b"at rest"
    lock.write_bytes(b"moving ")


def test_where_it_is_is_not_asserted_after_a_kill_in_a_jog(fake, path):
    killed_in_a_jog(fake, path)
    fake.reset()

    async def what(site):
        assert site.told("place")["moving"]
        await site.connect()
        assert fake.steps == [0, 0, 0]  # no place was sent
        assert not site.told("place")["known"] and "not known where" in site.told("state")["note"]
        site.do("jog", directions=[1, 0, 0])
        await site.until(lambda: fake.steps[0] > 0)
        site.do("jog", directions=[0, 0, 0])
        await site.until(lambda: site.told("state")["mode"] == "Idle")
        assert not site.told("place")["known"]

    session(path, what)
    assert not load(path).known
    fake.reset()

    async def again(site):
        await site.connect()
        assert not site.told("place")["known"] and fake.steps == [0, 0, 0]
        fake.deaf = [b"ORIGIN\n"]
        site.do("origin")
        await site.until(lambda: not fake.deaf)
        assert not site.told("place")["known"]  # it has not answered yet
        await site.until(lambda: site.told("place")["known"])
        assert fake.orders.count(b"ORIGIN\n") == 2

    session(path, again)
    assert load(path).known


def test_a_machine_that_stayed_on_after_a_kill_knows_where_it_is(fake, path):
    killed_in_a_jog(fake, path)
    fake.steps = fake.target = [1234, 0, 0]

    async def what(site):
        await site.connect()
        assert site.told("place")["known"] and site.told("place")["steps"] == [1234, 0, 0]

    session(path, what)


def test_a_machine_that_was_on_knows_better(fake, path):
    save(path, Settings("", Steps(500, -500, 7), on_since=time.time() - 1000))
    fake.steps = fake.target = [1, 2, 3]
    fake.speeds = [227, 227, 227]  # as a panel left it

    async def what(site):
        await site.connect()
        assert site.told("place")["known"]
        assert not any(line.startswith(b"POS") for line in fake.written)
        assert site.told("place")["steps"] == [1, 2, 3]
        assert site.told("place")["um"] == pytest.approx([1 / 56.761, 2 / 56.761, 3 / 56.761],
                                                         rel=1e-5)

    session(path, what)
    assert load(path).steps == (1, 2, 3)


def test_a_machine_that_was_reset_in_a_jog_is_not_at_rest(fake, path):
    async def what(site):
        await site.connect()
        site.do("jog", directions=[1, 0, 0])
        await site.until(lambda: fake.steps[0] > 0)
        fake.reset()
        site.do("jog", directions=[0, 0, 0])
        await site.until(lambda: site.told("state")["mode"] == "Lost")
        site.do("disconnect")
        await site.until(lambda: not site.told("state")["doing"])
        assert site.told("place")["moving"]

    session(path, what)
    assert path.with_name("panel.json.lock").read_bytes() == b"moving "


def test_a_machine_that_was_reset_is_restored_though_the_clock_was_set_back(fake, path):
    save(path, Settings("", Steps(5, 5, 5), on_since=time.time() + 3600))

    async def what(site):
        await site.connect()
        assert fake.steps == [5, 5, 5]

    session(path, what)
    assert load(path).on_since == pytest.approx(time.time() - 1000, abs=30)


def test_points_are_stored_and_gone_to(fake, path):
    async def what(site):
        site.do("point", number=1, place=[100, 50, None])  # also before it is connected
        await site.connect()
        with pytest.raises(UserError, match="point 1 has an empty field"):
            site.do("go", number=1)
        site.do("point", number=1, place=[100, 50, 0])
        site.do("go", number=1)
        assert b"GOTO 1\n" not in fake.written
        assert site.told("state")["goal"] == 1
        await site.until(lambda: b"GOTO 1\n" in fake.orders)
        await site.until(lambda: site.told("state")["goal"] is None)
        await site.until(lambda: site.told("state")["note"] == "At point 1.")
        assert site.told("place")["steps"] == [5676, 2838, 0]
        site.do("origin")
        await site.until(lambda: site.told("place")["steps"] == [0, 0, 0])
        fake.steps = fake.target = [57, 0, -57]
        await site.until(lambda: site.told("place")["steps"] == [57, 0, -57])
        site.do("here", number=6)
        await site.until(lambda: fake.orders[-1] == b"P 6 57 0 -57\n")
        site.do("speed", axis=1, speed=20)
        await site.until(lambda: fake.orders[-1] == b"VEL MOT2 1135\n")

    session(path, what)
    settings = load(path)
    assert settings.points[0] == (100, 50, 0) and settings.points[5] == (1, 0, -1)
    assert settings.speeds == (4, 20, 4) and settings.steps == (57, 0, -57)


def test_a_machine_that_stands_at_its_origin_is_believed(fake, path):
    """Another program may have made that the origin since: it was not reset."""
    async def what(site):
        await site.connect()
        site.do("go", number=site.do("point", number=7, place=[20, 0, 0]) or 7)
        await site.until(lambda: site.told("place")["steps"] == [1135, 0, 0])

    session(path, what)
    assert load(path).steps == (1135, 0, 0)
    assert fake.points["7"] == [1135, 0, 0]  # as the page has it
    fake.steps = fake.target = [0, 0, 0]

    async def again(site):
        await site.connect()
        assert site.told("place")["steps"] == [0, 0, 0] == fake.steps
        assert site.told("state")["note"].startswith("Connected") and site.told("place")["known"]

    session(path, again)
    assert not any(line.startswith(b"POS") for line in fake.written)


def test_a_machine_that_is_reset_while_it_is_connected(fake, path):
    fake.steps = fake.target = [5, 5, 5]

    async def what(site):
        await site.connect()
        await site.until(lambda: load(path).steps == (5, 5, 5))
        fake.reset(seconds=0)
        await site.until(lambda: site.told("state")["mode"] == "Lost")
        site.do("jog", directions=[1, 0, 0])
        await asyncio.sleep(0.1)
        site.do("disconnect")
        await site.until(lambda: not site.told("state")["doing"])
        assert site.told("place")["steps"] == [5, 5, 5]  # and not what it counts now
        await site.connect()
        assert "was reset" in site.told("state")["note"]
        # Restored, or unknown if it may have moved for the order to jog: never what it counts.
        assert fake.steps == [5, 5, 5] or not site.told("place")["known"]
        assert site.told("state")["mode"] == "Idle"

    session(path, what)


def test_a_machine_that_was_reset_and_moved_since_does_not_know_where_it_is(fake, path):
    save(path, Settings("", Steps(5, 5, 5), on_since=time.time() - 1100))
    fake.steps = fake.target = [0, 7, 0]

    async def what(site):
        await site.connect()
        assert not site.told("place")["known"] and "not known where" in site.told("state")["note"]
        assert site.told("place")["steps"] == [0, 7, 0] == fake.steps

    session(path, what)
    assert load(path).on_since == pytest.approx(time.time() - 1000, abs=30)


def test_a_place_that_was_lost_on_the_line_is_told_again(fake, path):
    save(path, Settings("", Steps(5, 5, 5), on_since=0.0))
    fake.deaf = [b"POS 5 5 5\n"]

    async def what(site):
        await site.connect()
        assert fake.steps == [5, 5, 5] and not fake.deaf

    session(path, what)


def test_a_place_that_was_told_does_not_freeze(fake, path, monkeypatch):
    monkeypatch.setattr(machine, "ANSWER_TIMEOUT_S", 60)  # longer than anything is waited for
    save(path, Settings("", Steps(5, 5, 5), on_since=0.0))

    async def what(site):
        await site.connect()
        site.do("jog", directions=[1, 0, 0])
        await site.until(lambda: site.told("place")["steps"][0] > 2000)

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


def test_what_needs_a_machine_says_so(fake, path):
    async def what(site):
        for name, fields in [("origin", {}), ("go", {"number": 1}), ("here", {"number": 1}),
                             ("jog", {"directions": [1, 0, 0]})]:
            with pytest.raises(UserError, match="not connected"):
                site.do(name, **fields)
        site.do("jog", directions=[0, 0, 0])
        site.do("stop")
        with pytest.raises(UserError, match="there is no port /etc/passwd: choose one of the list"):
            site.do("connect", port="/etc/passwd")
        with pytest.raises(UserError, match="a real machine's limit switches are pressed by hand"):
            site.do("limit", end="X+", pressed=True)
        with pytest.raises(UserError, match="there is no 'explode'"):
            site.do("explode")
        assert not fake.written

    session(path, what)


def test_what_the_machine_complains_of_is_told(fake, path):
    async def what(site):
        await site.connect()
        fake.blocked = [b"MOV MOT1 C\n"]
        site.do("jog", directions=[1, 0, 0])
        await site.until(lambda: site.told("state")["limits"] == ["x"])
        assert site.told("state")["bad"] and "limit switch stopped X" in site.told("state")["note"]
        site.do("jog", directions=[-1, 0, 0])
        assert site.told("state")["limits"] == []
        fake.say(b"! RANGE\n")
        await site.until(lambda: "RANGE" in site.told("state")["note"])

    session(path, what)


def test_silence_and_a_lost_line_are_told(fake, path, soon_stale):
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
    monkeypatch.setattr(machine, "ANSWER_TIMEOUT_S", 0.05)
    fake.original = True

    async def what(site):
        site.do("connect", port=PORT)
        with pytest.raises(UserError, match="connecting: wait a moment"):
            site.do("connect", port=PORT)
        await site.until(lambda: site.told("state")["note"])
        assert site.told("state")["note"] == (
            f"no machine answers at {PORT}: is it on, and built without --original?")
        assert site.told("state")["bad"] and not site.told("state")["connected"] and fake.closed

    session(path, what)


def test_ending_while_it_connects(fake, path):
    fake.original = True

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
        monkeypatch.setattr(store, "save", full)
        site.do("speed", axis=0, speed=9)
        await site.until(lambda: "settings are not saved" in site.told("state")["note"])
        site.do("jog", directions=[1, 0, 0])
        assert b"MOV MOT1 C\n" in fake.written

    session(path, what)


def test_a_speed_and_a_point_that_change_while_it_connects_are_sent(fake, path):
    async def what(site):
        site.do("connect", port=PORT)
        await asyncio.sleep(0)
        site.do("speed", axis=1, speed=20)
        site.do("point", number=2, place=[1, 2, 3])
        await site.until(lambda: site.told("state")["connected"])
        await site.until(lambda: fake.speeds[1] == 1135 and "2" in fake.points)

    session(path, what)
