"""A machine at the other end of a port that speaks the GRBL 1.1 protocol."""

import re

from tb.models.gcode_language import ORIGIN, Interpreter, RefusedLine, Word
from tests.host.fake import FakePort

__all__ = ["GREETING", "FakeGCode"]

GREETING = b"\r\nGrbl 1.1h ['$' for help]\r\n"
SIZE = 128
"""Of its receive buffer, of which one place stays free."""


class FakeGCode(FakePort):
    """A machine that carries out a line at each read, if it does not hold.

    Attributes
    ----------
    received : bytes
        Its receive buffer.
    most : int
        Most bytes that were in it.
    lines : list of str
        Those it has taken out of it.
    state : str
        As it is reported.
    machine : Interpreter
        What it makes of the lines.
    deaf, mute : bool
        It takes nothing; it reports no status.
    lose : int
        Answers that are lost.
    alarms : dict of str to int
        Lines that raise an alarm, after which it resets itself.
    settings : dict of str to str
        What ``$$`` lists.
    touches : float, optional
        Z at which a probe touches.
    real_time : list of bytes
        Real-time commands that it received, without ``?``.
    """

    def __init__(self) -> None:
        super().__init__(lambda line: b"")
        self.most, self.lines, self.lose = 0, [], 0
        self.deaf = self.mute = False
        self.alarms: dict[str, int] = {}
        self.settings: dict[str, str] = {}
        self.touches: float | None = None
        self.real_time: list[bytes] = []
        self.reports = 0
        self.reset()

    def reset(self, state: str = "Idle") -> None:
        """Begin anew, and greet."""
        position = getattr(self, "machine", Interpreter()).position
        self.machine = Interpreter(position)
        self.received, self.state = b"", state
        self.say(GREETING)

    def write(self, data: bytes) -> None:
        self.written.append(data)
        for byte in data if not self.deaf else b"":
            match chr(byte):
                case "?":
                    if not self.mute:
                        self.say(self.report())
                    continue
                case "!":
                    self.state = "Hold:0" if self.state in ("Run", "Idle") else self.state
                case "~":
                    self.state = "Run" if self.state == "Hold:0" else self.state
                case "\x18":
                    self.reset()
                case "\x85":
                    self.state = "Idle" if self.state == "Jog" else self.state
                case _:
                    self.received += bytes([byte])
                    self.most = max(self.most, len(self.received))
                    continue
            self.real_time.append(bytes([byte]))

    def report(self) -> bytes:
        """Return a status report; the offset is in some only."""
        self.reports += 1
        x, y, z = (at / 1e6 for at in self.machine.position)
        a, b, c = (at / 1e6 for at in self.machine.origin)
        offset = f"|WCO:{a:.3f},{b:.3f},{c:.3f}" if self.reports % 3 == 0 else ""
        return (f"<{self.state}|MPos:{x:.3f},{y:.3f},{z:.3f}|Bf:15,{SIZE - len(self.received)}"
                f"|FS:0,0{offset}>\r\n").encode()

    def idle(self) -> None:
        super().idle()
        line, end, rest = self.received.partition(b"\n")
        if self.state not in ("Idle", "Run", "Jog", "Alarm"):
            return
        if not end:
            self.state = "Alarm" if self.state == "Alarm" else "Idle"
            return
        self.received = rest
        self.obey(line.decode())

    def obey(self, line: str) -> None:
        """Carry out a line, and answer it."""
        self.lines.append(line)
        if line in self.alarms:
            self.say(b"ALARM:%d\r\n" % self.alarms[line])
            self.reset("Alarm")
            return
        answer = b"ok\r\n"
        if line == "$$":
            for number, value in self.settings.items():
                self.say(f"${number}={value}\r\n".encode())
        elif line in ("$X", "$H"):
            if line == "$H":
                self.machine.position = ORIGIN
            self.state = "Idle"
        elif line.startswith("$J="):
            self.state = "Jog"
            self.machine.jog(_words(line))
        elif "G38." in line:
            x, y, z = (at / 1e6 for at in self.machine.position)
            found = self.touches is not None
            z = self.touches if found else z
            self.say(f"[PRB:{x:.3f},{y:.3f},{z:.3f}:{found:d}]\r\n".encode())
        elif line == "$G":
            answer = b"[GC:G38.2 G54 G17 G20 G90 G94 M3 M9 T0 F0 S0]\r\nok\r\n"
        elif line == "$I":
            answer = b"[VER:1.1h.20190830:]\r\n[OPT:VM,15,128]\r\nok\r\n"
        elif self.state == "Alarm":
            answer = b"error:9\r\n"
        else:
            self.state = "Run"
            try:
                self.machine.line(_words(line))
            except RefusedLine as refused:
                answer = b"error:%d\r\n" % refused.args[0]
        if self.lose:
            self.lose -= 1
        else:
            self.say(answer)


def _words(line: str) -> list[Word]:
    return [Word(letter, round(float(number) * 10**6))
            for letter, number in re.findall(r"([A-Z])([-\d.]+)", line)]
