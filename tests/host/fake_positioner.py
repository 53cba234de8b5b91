"""A positioner at the other end of a port."""

import re

from tests.host.fake import FakePort

__all__ = ["FakePositioner"]


class FakePositioner(FakePort):
    """A positioner that is quick: it goes a thousand steps from one report to the next.

    Attributes
    ----------
    refuse : dict of bytes to bytes
        What is said to a first word instead of obeying it.
    deaf : list of bytes
        Lines that are lost, each once.
    blocked : list of bytes
        Movements towards a limit switch that is on.
    damage : dict of bytes to bytes
        What lines become on their way, each once.
    """

    def __init__(self) -> None:
        super().__init__(self.obey)
        self.connected = False
        self.steps, self.target = [0, 0, 0], [0, 0, 0]
        self.points: dict[str, list[int]] = {}
        self.refuse: dict[bytes, bytes] = {}
        self.deaf: list[bytes] = []
        self.blocked: list[bytes] = []
        self.damage: dict[bytes, bytes] = {}
        self.damaged = False

    @property
    def resting(self) -> bool:
        """Whether it is where it goes to."""
        return self.steps == self.target

    def reset(self) -> None:
        """Switch it off and on."""
        self.connected, self.points = False, {}
        self.steps, self.target = [0, 0, 0], [0, 0, 0]

    def _aim(self, motor: str, there: int) -> None:
        number = int(motor[-1]) - 1
        self.target = [*self.target[:number], there, *self.target[number + 1:]]

    def broken(self) -> None:
        self.target, self.damaged = self.steps, True

    def obey(self, line: bytes) -> bytes:
        if self.damaged:
            self.damaged = False
            return b"! DAMAGED\n"
        line = self.damage.pop(line, line)
        if line in self.deaf:
            self.deaf.remove(line)
            return b""
        if line in self.blocked:
            return b"! LIMIT " + line.split()[1] + b"\n"
        if (word := line.split()[0]) in self.refuse:
            return self.refuse[word]
        match line.decode().split():
            case ["CONNECT"]:
                self.connected = True
            case ["DISCONNECT"]:
                self.connected = False
            case ["P", point, *place]:
                if not all(re.fullmatch("-?[0-9]+", number) for number in place):
                    return b"! ARGUMENT\n"
                self.points[point] = [int(number) for number in place]
            case ["GOTO", point]:
                if point not in self.points:
                    return b"! EMPTY\n"
                self.target = self.points[point]
            case ["MOV", motor, way]:
                self._aim(motor, 10**6 if way == "C" else -10**6)
            case ["VEL", _, speed]:
                return b"! RANGE\n" if speed == "0" else b""
            case ["POS", *place]:
                self.steps = self.target = [int(number) for number in place]
            case ["ORIGIN"]:
                self.steps = self.target = [0, 0, 0]
            case ["STOP", motor]:
                self._aim(motor, self.steps[int(motor[-1]) - 1])
            case _:
                return b"! COMMAND\n"
        return b""

    def idle(self) -> None:
        super().idle()
        if self.connected and not self.coming:
            self.steps = [at + max(-1000, min(1000, to - at))
                          for at, to in zip(self.steps, self.target, strict=True)]
            self.say(b"# POS %d %d %d :\n" % tuple(self.steps))
