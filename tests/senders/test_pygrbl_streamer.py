"""pygrbl-streamer, a library for Python, with the gateware."""

from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from importlib.metadata import version

import pytest

from tests.senders.machine import LIMIT_S, Machine
from tests.senders.session import Sender, Session


class PygrblStreamer(Sender):
    """Its class `GrblStreamer`. While it streams it does not ask for reports."""

    def __init__(self, library, machine: Machine) -> None:
        self._library, self._machine = library, machine
        self._streamer = library.GrblStreamer(machine.port)
        self._pool = ThreadPoolExecutor()
        self._job: Future[bool] = Future()
        machine.ask = self._ask

    def version(self) -> str:
        return version("pygrbl-streamer")

    def connect(self) -> None:
        self._streamer.connect()

    def disconnect(self) -> None:
        self._streamer.disconnect()

    def check(self) -> None:
        assert self._streamer.state is self._library.State.IDLE
        assert all(map(self._streamer.command, ("$$", "$I", "$G", "$#")))

    def position(self) -> tuple[float, ...]:
        _, place, *_ = self._streamer.last_status["raw"].split("|")
        return tuple(map(float, place.removeprefix("MPos:").split(",")))

    def send(self, line: str) -> None:
        assert self._streamer.command(line)

    def home(self) -> None:
        homed = self._pool.submit(self._streamer.home, LIMIT_S, wait_idle=True)
        self._machine.wait(homed.done, "home")
        assert homed.result()

    def unlock(self) -> None:
        assert self._streamer.unlock()

    def start(self, program: Sequence[str]) -> None:
        self._job = self._pool.submit(self._streamer.stream, program, len(program))

    def wait(self) -> None:
        assert self._job.result(LIMIT_S)

    def hold(self) -> None:
        self._streamer.pause()

    def resume(self) -> None:
        self._streamer.resume()

    def reset(self) -> None:
        self._streamer.stop()
        assert not self._job.result(LIMIT_S)
        assert self._streamer.sync() is self._library.State.IDLE

    def ask(self) -> None:
        """Ask for a report."""
        self._streamer.realtime(b"?")

    def _ask(self) -> None:
        if self._streamer.state is not self._library.State.STREAMING:
            self.ask()


@pytest.fixture(scope="module")
def sender(machine) -> Iterator[Sender]:
    """It, connected."""
    library = pytest.importorskip("pygrbl_streamer", reason="pygrbl-streamer missing: "
                                  "pip install -e '.[senders]'")
    with PygrblStreamer(library, machine) as sender:
        yield sender
        machine.ask = lambda: None


class TestPygrblStreamer(Session):
    version = "1.0.5"
