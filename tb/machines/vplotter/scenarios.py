"""Scenarios of `vplotter`: a session on its line, with a plant."""

from collections.abc import Sequence
from math import hypot

from ...bench import Run, bench
from ...engines import Engine
from ...uart import FRAME, Decoder, encode
from ...wall_plant import WallPlant
from . import MACHINE, SHORT

__all__ = ["SCENARIOS", "WallSession", "from_chord"]

GREETING = b"Grbl 1.1h ['$' for help]\r\n[MSG:'$H'|'$X' to unlock]\r\n"
END = (9.0, 7.5)


class WallSession:
    """The machine on an engine, with a plant: two strings, their end switches, and gravity.

    Attributes
    ----------
    plant : WallPlant
        The strings.
    path : list of tuple
        Where the pen is in mm, from the left pulley, y down, at each step of a string with which it
        touches; a list for each time that it does.
    texts : bytes
        What came from the machine, and was not taken.
    """

    def __init__(self, engine: Engine, settings=SHORT, *, place: tuple[float, float] = (10, 13),
                 switch: int = 6) -> None:
        self.engine, self.settings = engine, settings
        self._decoder = Decoder(settings.bit)
        per_mm = settings.steps_of_string
        self.plant = WallPlant(settings.wall_width, per_mm, *place, switch_mm=switch / per_mm,
                               period=settings.period)
        self.path: list[list[tuple[float, float]]] = []
        self.texts = b""
        self._pen = 0
        engine.set(rx=1)

    @property
    def pen(self) -> tuple[float, float]:
        """Where the pen hangs."""
        return self.plant.pen

    def run(self, clocks: int) -> None:
        """Let time pass; a switch is felt in the time of a step."""
        end = self.engine.clock + clocks
        while self.engine.clock < end:
            self.engine.set(limits=self.plant.limits)
            seen = self.engine.run(min(self.plant.free, end - self.engine.clock),
                                   ("tx", "left", "right", "pen"))
            for clock, tx, left, right, pen in zip(
                    seen.clock.tolist(), *(each.tolist() for each in seen.values.values()),
                    strict=True):
                self.texts += self._decoder.feed(clock, tx)
                steps = self.plant.left.steps + self.plant.right.steps
                self.plant.feel([(clock, left, right)])
                if pen and not self._pen:
                    self.path.append([self.pen])
                elif pen and self.plant.left.steps + self.plant.right.steps != steps:
                    self.path[-1].append(self.pen)
                self._pen = pen
            self.texts += self._decoder.feed(self.engine.clock, self.engine.get("tx"))

    def send(self, text: str) -> None:
        """Send bytes, one after the other."""
        line = encode(text.encode("latin-1"), self.settings.bit)
        for place in range(0, len(line), self.settings.bit):
            self.engine.set(rx=line[place])
            self.run(self.settings.bit)

    def take(self, clocks: int, until: bytes = b"") -> bytes:
        """Return what comes in some clocks, or as soon as it ends so."""
        end = self.engine.clock + clocks
        while self.engine.clock < end and not (until and self.texts.endswith(until)):
            self.run(min(self.settings.bit * FRAME, end - self.engine.clock))
        texts, self.texts = self.texts, b""
        return texts

    def ask(self, text: str, answer: str, within: int = 20_000) -> bytes:
        """Send a line, and return what comes until the answer, a line, has come."""
        self.send(f"{text}\n")
        return self.take(within, f"{answer}\r\n".encode())

    def rest(self, within: int = 200_000) -> None:
        """Let time pass until nothing moves."""
        end = self.engine.clock + within
        self.run(1000)
        while self.engine.get("moving") and self.engine.clock < end:
            self.run(1000)
        self.run(4 * self.settings.period)  # motors have made their last step


def from_chord(path: Sequence[tuple[float, float]], start: tuple[float, float],
               end: tuple[float, float]) -> float:
    """Return how far places are from the line through two points at most."""
    along = hypot(end[0] - start[0], end[1] - start[1])
    return max(abs((x - start[0]) * (end[1] - start[1]) - (y - start[1]) * (end[0] - start[0]))
               / along for x, y in path)


def _expect(run: Run, session: WallSession, text: str, answer: str, within: int = 20_000) -> None:
    """Send a command, and expect what it says."""
    run.expect(text, session.ask(text, answer.rsplit("\r\n", 1)[-1], within).decode(),
               f"{answer}\r\n")


@bench
def vplotter(run: Run) -> str:
    """Commands of the thesis, and a line of G-code from where it hangs."""
    with run.engine(MACHINE.design(settings=SHORT)) as engine:
        session = WallSession(engine, place=SHORT.rest)
        run.expect("greeting", session.take(20_000, GREETING), GREETING)
        _expect(run, session, ":s1", "00")
        _expect(run, session, ":H1", "Home: :H")
        session.send("$X\nM3\n")  # it takes for granted that it hangs at the place of rest
        x, y = END[0], SHORT.wall_height - END[1]
        session.send(f"G1X{x}Y{y}F60000\nM5\n")
        session.take(60_000, b"ok\r\n" * 3)
        session.rest(60_000)
        (line,) = session.path
        step = 1 / SHORT.steps_of_string
        for name, place, wanted in ("begin", line[0], SHORT.rest), ("end", line[-1], END):
            run.expect(f"{name} of the line within a step", hypot(
                place[0] - wanted[0], place[1] - wanted[1]) < step, True)
        off = from_chord(line, SHORT.rest, END)
        run.expect("within a step of the chord", off < step, True)
        plant = session.plant
        run.expect("words that no motor can follow", plant.left.jumps + plant.right.jumps, 0)
        run.expect("fault", engine.get("fault"), 0)
    return f"a line from point to point {off / step:.2f} steps off its chord at most"


SCENARIOS = [vplotter]
