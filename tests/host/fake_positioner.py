"""A positioner at the other end of a port."""

import re

from tests.host.fake import FakePort

__all__ = ["FakePositioner"]


class FakePositioner(FakePort):
    """A positioner that is quick: it goes a thousand steps from one report to the next.

    Attributes
    ----------
    refuse : dict of bytes to bytes
        The answer to a first word instead of obeying it.
    deaf : list of bytes
        Lines that are lost, each once.
    mute : list of bytes
        Lines whose answers are lost, each once.
    blocked : list of bytes
        Movements towards a limit switch that is on.
    damage : dict of bytes to bytes
        What lines become on their way, each once; without its end, one goes on with the next.
    backlash : int
        Reports until axes move that are sent somewhere.
    original : bool
        It sends nothing but reports.
    seconds : int
        Seconds since power-up.
    orders : list of bytes
        What was written, without the lines by which answers are obtained.
    """

    def __init__(self) -> None:
        super().__init__(self.obey)
        self.refuse: dict[bytes, bytes] = {}
        self.deaf: list[bytes] = []
        self.mute: list[bytes] = []
        self.blocked: list[bytes] = []
        self.damage: dict[bytes, bytes] = {}
        self.original, self.backlash = False, 0
        self.seconds = 1000
        self.reset(seconds=self.seconds)

    @property
    def orders(self) -> list[bytes]:
        return [line for line in self.written
                if line not in (b"\n", b"STATE\n", b"ACK 1\n", b"ACK 0\n")]

    @property
    def resting(self) -> bool:
        """Whether it is where it goes to."""
        return self.steps == self.target

    def reset(self, *, seconds: int = 0) -> None:
        """Switch it off and on, so many seconds ago."""
        self.seconds = seconds
        self.connected = self.acknowledges = self.damaged = False
        self.points: dict[str, list[int]] = {}
        self.steps, self.target = [0, 0, 0], [0, 0, 0]
        self.speeds = [200, 200, 200]
        self.begun = b""
        self.queue: list[bytes] = []  # a STATE that is asked for, and the answers behind it

    def _aim(self, motor: str, there: int) -> None:
        number = int(motor[-1]) - 1
        self.target = [*self.target[:number], there, *self.target[number + 1:]]

    def broken(self) -> None:
        self.target, self.damaged = self.steps, True

    def obey(self, line: bytes) -> bytes:
        """Take a line; return what is sent for it."""
        line = self.damage.pop(line, line)
        if line in self.deaf:
            self.deaf.remove(line)
            return b""
        line, self.begun = self.begun + line, b""
        if not line.endswith(b"\n"):
            self.begun = line
            return b""
        answer = self._answer(line)
        if line in self.mute:
            self.mute.remove(line)
            return b""
        if answer.endswith(b"ok\n") and not self.acknowledges:
            answer = answer.removesuffix(b"ok\n")
        if self.original:
            return b""
        if not self.queue and answer != b"STATE\n":
            return answer
        limit, answer = re.findall(rb"(?s)((?:! LIMIT.*?\n)*)(.*)", answer)[0]
        self.queue.append(answer)
        return limit

    def _answer(self, line: bytes) -> bytes:
        if self.damaged:
            self.damaged = False
            return b"! DAMAGED\n"
        word = (line.split() or [b""])[0]
        if line in self.blocked:
            return b"! LIMIT " + line.split()[1] + b"\nok\n"
        if word in self.refuse:
            return self.refuse[word]
        match line.decode().split():
            case ["CONNECT"]:
                self.connected = True
            case ["DISCONNECT"]:
                self.connected, self.target = False, self.steps
            case ["ACK", on]:
                self.acknowledges = on == "1"
            case ["STATE"]:
                return line
            case ["P", point, *place]:
                if not all(re.fullmatch("-?[0-9]+", number) for number in place):
                    return b"! ARGUMENT\n"
                self.points[point] = [int(number) for number in place]
            case ["GOTO", point]:
                if point not in self.points:
                    return b"! EMPTY\n"
                self.target = self.points[point]
            case ["MOV", motor, way]:
                if way not in ("C", "CC"):
                    return b"! ARGUMENT\n"
                self._aim(motor, 10**6 if way == "C" else -10**6)
            case ["VEL", motor, speed]:
                if not speed.isdigit() or speed == "0":
                    return b"! RANGE\n"
                self.speeds[int(motor[-1]) - 1] = int(speed)
            case ["POS", *place]:
                self.steps = self.target = [int(number) for number in place]
            case ["ORIGIN"]:
                self.steps = self.target = [0, 0, 0]
            case ["STOP", ("MOT1" | "MOT2" | "MOT3") as motor]:
                self._aim(motor, self.steps[int(motor[-1]) - 1])
            case _:
                return b"! COMMAND\n"
        return b"ok\n"

    def idle(self) -> None:
        super().idle()
        if self.coming:
            return
        if self.backlash and not self.resting:
            self.backlash -= 1
        elif self.connected:
            self.steps = [at + max(-1000, min(1000, to - at))
                          for at, to in zip(self.steps, self.target, strict=True)]
        if self.queue:
            self.say(self._state())
            del self.queue[0]
            while self.queue and self.queue[0] != b"STATE\n":
                self.say(self.queue.pop(0))
        elif self.connected:
            self.say(b"# POS %d %d %d :" % tuple(self.steps))

    def _state(self) -> bytes:
        moving = [int(at != to) for at, to in zip(self.steps, self.target, strict=True)]
        numbers = [int(self.connected), *moving, *self.speeds, 0, 0, 0, *self.steps, self.seconds]
        return f"STATE {' '.join(map(str, numbers))}\n".encode()
