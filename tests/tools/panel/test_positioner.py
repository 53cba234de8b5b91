"""The panel and the machine's own gateware: what is remembered, and by whom."""

import asyncio
import os
import time
from collections.abc import Callable
from contextlib import asynccontextmanager
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from fresa.protocol import BAUD
from fresa_host import Positioner
from tb.engines import ENGINES
from tests.tools.process import PATIENCE
from tools.console import UserError
from tools.panel import Panel
from tools.panel.settings import load, save
from tools.panel.simulated import Simulated
from tools.serve import Service, Switches, build, servable

pytest.importorskip("serial", reason="pyserial missing: pip install -e '.[host]'")


@pytest.fixture(autouse=True)
def slow(monkeypatch) -> None:
    """Let the simulation be slower than the machine, where there is much else to compute."""
    monkeypatch.setattr("fresa_host.positioner_session.ANSWER_TIMEOUT_S", 20)
    monkeypatch.setattr("tools.panel.machine.ANSWER_TIMEOUT_S", PATIENCE)
    monkeypatch.setattr("tools.panel.settings.CLOCK_TOLERANCE", 0.95)


@asynccontextmanager
async def switched_on():
    """Give the port of a machine that has just been switched on."""
    engine, period = build(servable()["positioner"], "cxxrtl")
    async with Service(engine, period, speed=period * BAUD) as service:
        yield service.path


async def until(holds: Callable[[], object]) -> None:
    async with asyncio.timeout(PATIENCE):
        while not holds():
            await asyncio.sleep(0.01)


@asynccontextmanager
async def connected(path: Path, port: str, simulated: Simulated | None = None):
    panel = Panel(path, port, simulated=simulated)
    page = panel.view()
    try:
        panel.do(page, "connect", {"port": port})
        await until(lambda: not panel._busy.doing)
        assert panel._machine.connected, panel._broadcast.note
        yield lambda name, **fields: panel.do(page, name, fields), panel
    finally:
        await panel.close()


def use(port: str) -> None:
    """Move the machine, and make that its origin, with another program."""
    with Positioner(port, timeout=PATIENCE) as positioner:
        positioner.connect()
        positioner.velocity("x", 26)
        positioner.jog("x", 1)
        while positioner.steps.x < 400:
            time.sleep(0.01)
        positioner.stop()
        positioner.origin()


def test_a_break_goes_to_the_service():
    """A pseudo-terminal would not carry it."""
    machine, terminal = os.openpty()
    breaks = []
    service: Any = SimpleNamespace(path=os.ttyname(terminal), send_break=lambda: breaks.append(1))
    simulated = Simulated(service, Switches((), service))
    port = simulated.open(simulated.port)
    assert port.can_break
    port.send_break()
    assert breaks == [1]
    port.close()
    os.close(terminal)
    os.close(machine)


@pytest.mark.compiler
def test_a_break_and_limit_switches_in_simulation(tmp_path, libraries, monkeypatch):
    if reason := ENGINES["cxxrtl"].missing():
        pytest.skip(reason)

    async def session():
        engine, period = build(servable()["positioner"], "cxxrtl")
        async with Service(engine, period, speed=period * BAUD) as service:
            switches = Switches(servable()["positioner"].switches, service)
            simulated = Simulated(service, switches)
            send_break, breaks = service.send_break, []
            monkeypatch.setattr(service, "send_break", lambda: (breaks.append(1), send_break()))
            async with connected(tmp_path / "panel.json", service.path, simulated) as (do, panel):
                def moves() -> bool:
                    return engine.get("moving") != 0

                do("speed", axis=0, speed=26)
                do("jog", directions=[1, 0, 0])
                await until(moves)
                # By a break alone: whoever holds the button goes on holding it.
                send_break()
                await until(lambda: not moves())
                do("jog", directions=[0, 0, 0])
                await until(lambda: "DAMAGED" in panel._broadcast.note)
                do("jog", directions=[1, 0, 0])
                await until(moves)
                assert not breaks
                do("stop")
                await until(lambda: not moves())
                assert len(breaks) == 1
                await asyncio.sleep(0.3)  # what the panel has damaged by its own is nobody's matter
                assert "refused" not in panel._broadcast.note
                do("jog", directions=[1, 0, 0])
                do("limit", end="X+", pressed=True)
                await until(lambda: "limit switch stopped X" in panel._broadcast.note)
                assert not moves()
                do("jog", directions=[-1, 0, 0])  # the way back is free
                await until(moves)
                do("stop")
                do("limit", end="X+", pressed=False)
                with pytest.raises(UserError, match="no limit switch 'X-'"):
                    do("limit", end="X-", pressed=True)

    asyncio.run(session())


@pytest.mark.compiler
def test_a_reset_is_told_from_an_origin(tmp_path, libraries):
    if reason := ENGINES["cxxrtl"].missing():
        pytest.skip(reason)
    path = tmp_path / "panel.json"

    async def session():
        async with switched_on() as port:
            async with connected(path, port) as (do, panel):
                do("point", number=7, place=[3, -2, 1])
                for axis in range(3):
                    do("speed", axis=axis, speed=26)
                do("go", number=7)
                await until(lambda: panel._broadcast.note == "At point 7.")
            assert load(path).steps == (170, -114, 57)
            async with connected(path, port) as (_, panel):
                assert panel._machine.steps == (170, -114, 57)
            await asyncio.to_thread(use, port)
            async with connected(path, port) as (do, panel):
                assert panel._broadcast.note.startswith("Connected")
                await asyncio.sleep(0.3)
                assert panel._machine.steps == (0, 0, 0)  # and to ask has moved nothing
                do("go", number=7)
                await until(lambda: panel._broadcast.note == "At point 7.")
        settings = load(path)
        save(path, replace(settings, on_since=(settings.on_since or 0) - 86_400))
        async with switched_on() as port, connected(path, port) as (do, panel):
            assert "reset" in panel._broadcast.note
            assert panel._machine.steps == (170, -114, 57)
            do("jog", directions=[1, 0, 0])
            await until(lambda: (panel._machine.steps or (0,))[0] > 200)
            # What nobody stops when the panel is gone, the next one does.
            line, panel._machine._line = panel._machine._line, None
            assert line
            await asyncio.to_thread(line.close)
            panel._store.close()
            async with connected(path, port) as (_, other):
                still = other._machine.steps
                await asyncio.sleep(0.3)
                assert other._machine.steps == still

    asyncio.run(session())
