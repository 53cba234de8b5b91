"""Lines of a G-code machine, as GRBL 1.1's interface documents them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

__all__ = ["MESSAGES", "STATES", "Reports", "Sample", "alarm", "answer"]

STATES = ("Idle", "Run", "Hold", "Jog", "Alarm", "Door", "Check", "Home", "Sleep")

MESSAGES: Mapping[str, bytes] = {
    "GREETING": b"Grbl 1.1h ['$' for help]\r\n",
    "LOCKED": b"[MSG:'$H'|'$X' to unlock]\r\n",
    "UNLOCKED": b"[MSG:Caution: Unlocked]\r\n",
    "ENABLED": b"[MSG:Enabled]\r\n",
    "DISABLED": b"[MSG:Disabled]\r\n",
    "RESET_TO_CONTINUE": b"[MSG:Reset to continue]\r\n",
    "CHECK_DOOR": b"[MSG:Check Door]\r\n",
    "PROGRAM_END": b"[MSG:Pgm End]\r\n",
    "SLEEPING": b"[MSG:Sleeping]\r\n",
    "RESTORING": b"[MSG:Restoring defaults]\r\n",
    "CHECK_LIMITS": b"[MSG:Check Limits]\r\n",
    "RESTORING_SPINDLE": b"[MSG:Restoring spindle]\r\n",
}


@dataclass(frozen=True)
class Sample:
    """What a report shows: positions in um, feed in mm/min, speed in rpm, letters of pins.

    Overrides are in percent: of feed, rapids and spindle. Accessories are letters, too. What it
    shows is that of $10, of which two bits count. In inches positions have four decimals, and the
    feed has one.
    """

    state: str = "Idle"
    substate: int = 0
    position: Sequence[int] = (0, 0, 0)
    origin: Sequence[int] = (0, 0, 0)
    blocks: int = 0
    room: int = 0
    feed: int = 0
    speed: int = 0
    pins: str = ""
    overrides: Sequence[int] = (100, 100, 100)
    accessories: str = ""
    shown: int = 3
    inches: bool = False


@dataclass
class Reports:
    """Status reports one after the other: which of them have offsets and overrides."""

    since_origin: int = field(default=0)
    since_overrides: int = field(default=0)
    every_origin: int = 0
    every_overrides: int = 0

    def change_origin(self) -> None:
        """Have the offsets in the next report."""
        self.since_origin = self.every_origin

    def change_overrides(self) -> None:
        """Have the overrides in the next report without offsets."""
        self.since_overrides = self.every_overrides

    def line(self, sample: Sample) -> bytes:
        """Return the next report."""
        moves = sample.state in ("Run", "Hold", "Jog", "Door", "Home")
        state = sample.state
        if state in ("Hold", "Door"):
            state += f":{sample.substate}"
        decimals = 4 if sample.inches else 3
        fields = [state, f"{'MPos' if sample.shown & 1 else 'WPos'}:"
                  f"{_vector(sample.position, decimals)}"]
        if sample.shown & 2:
            fields.append(f"Bf:{sample.blocks},{sample.room}")
        feed = _decimal(sample.feed, 1) if sample.inches else sample.feed
        fields.append(f"FS:{feed},{sample.speed}")
        if sample.pins:
            fields.append(f"Pn:{sample.pins}")
        self.since_overrides += 1
        if self.since_origin >= self.every_origin:
            self.since_origin, self.every_origin = 1, 30 if moves else 10
            fields.append(f"WCO:{_vector(sample.origin, decimals)}")
        else:
            self.since_origin += 1
            if self.since_overrides > self.every_overrides:
                self.since_overrides, self.every_overrides = 0, 19 if moves else 9
                fields.append(f"Ov:{','.join(map(str, sample.overrides))}")
                if sample.accessories:
                    fields.append(f"A:{sample.accessories}")
        return f"<{'|'.join(fields)}>\r\n".encode()


def answer(number: int) -> bytes:
    """Return the answer to a line: accepted with 0, or refused with an error."""
    return b"error:%d\r\n" % number if number else b"ok\r\n"


def alarm(number: int) -> bytes:
    """Return the line of an alarm."""
    return b"ALARM:%d\r\n" % number


def _vector(values: Sequence[int], decimals: int) -> str:
    return ",".join(_decimal(value, decimals) for value in values)


def _decimal(value: int, decimals: int) -> str:
    whole, rest = divmod(abs(value), 10**decimals)
    return f"{'-' if value < 0 else ''}{whole}.{rest:0{decimals}}"
