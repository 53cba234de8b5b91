"""Lines of a G-code machine before its interpreter: `$` lines as GRBL has them, and what it adds.

What this machine adds are error 12, of settings with which drivers could not make the highest
speed, and single axes that are homed while others are not.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from decimal import ROUND_HALF_UP, Decimal

from .gcode_coordinates import POSITION, SYSTEM
from .gcode_line import Item

__all__ = ["GateModel", "Levels"]

LISTS = {"$": "HELP", "$G": "MODES", "$#": "COORDINATES", "$I": "BUILD", "$N": "STARTUP"}
HOMED = {"$H": 3, "$HX": 0, "$HY": 1, "$HZ": 2}
TEXTS = {"$N0=": 1, "$N1=": 2, "$I=": 3}
RESTORES = "$RST=$", "$RST=#", "$RST=*"
COORDINATES = range(SYSTEM, POSITION)
"""Words that are erased: origins, the offset of G92, the length of the tool, G28 and G30."""
ALWAYS, LETTERS = "$GCXJ", "$GCXJ#HSIRN"
"""Second characters of lines that GRBL looks at in any state, and of all that are no setting."""


@dataclass(frozen=True)
class Levels:
    """The state of the machine while a line is judged, and what comes of it.

    Attributes
    ----------
    locked, jogging, resting, stopped, door : bool
        Inputs of the gate by these names.
    too_long : bool
        The line brings a text that has too many characters.
    accepted : bool
        The line is answered without an error.
    """

    locked: bool
    jogging: bool
    resting: bool
    stopped: bool
    door: bool
    too_long: bool
    accepted: bool


@dataclass
class GateModel:
    """The actions of lines, one line after the other.

    Attributes
    ----------
    values : dict of int to int
        Settings by number, in thousandths where they have decimals.
    known : mapping of int to (int, int, bool, int)
        Least and highest value, decimals or not, and the value at power-up.
    fastest : int
        Highest value of $110 that the drivers can make.
    checking : bool
        Check mode.
    """

    values: dict[int, int]
    known: Mapping[int, tuple[int, int, bool, int]]
    fastest: int
    checking: bool = False

    def line(self, items: Sequence[Item], levels: Levels) -> list[str]:
        """Return what is done with a line, in order, and behind its answer."""
        *inside, end = items
        command, slot = self._command(items), self.slot(items)
        jog = command == "$J="
        if not end.system:
            refused = (levels.locked or levels.jogging) and end.status != 11 and (
                inside or end.status)
            return [*(item.character for item in inside), f"end {9 if refused else end.status}"]
        last = max(at for at, item in enumerate(inside) if item.kind == "CHARACTER")
        words = [item.character for item in inside[last:] if item.kind == "WORD"]
        if jog:
            words = [word.lower() for word in words]
        elif slot not in (1, 2):
            words = []
        status, done, later = (end.status, [], []) if end.status else self._judge(
            command, slot, levels)
        if slot and not status and levels.accepted:
            later = [f"keep {slot}"]
        return [*words, *done, f"end {status}{' of a jog' * jog}", *later]

    def slot(self, items: Sequence[Item]) -> int:
        """Return the number of the text that a line brings, or 0."""
        return next((slot for text, slot in TEXTS.items()
                     if self._command(items).startswith(text)), 0)

    def _command(self, items: Sequence[Item]) -> str:
        return "".join(item.character for item in items if item.kind == "CHARACTER")

    def _judge(self, command: str, slot: int, levels: Levels
               ) -> tuple[int, list[str], list[str]]:
        """Return the status of a system line, what it does, and what at its answer."""
        rests = levels.resting
        sets = re.fullmatch(r"\$(\d+)=([-+]?(?:\d+\.?\d*|\.\d+))", command)
        if command == "$X" and not levels.stopped:
            return (13, [], []) if levels.locked and levels.door else (0, ["unlock"], [])
        if command in ("$", "$G"):
            return 0, [f"list {LISTS[command]}"], []
        if command == "$C" and self.checking:
            self.checking = False
            return 0, [], ["restart"]
        if command == "$J=":
            return 8 * (not levels.jogging and (not rests or levels.locked)), [], []
        if slot:
            return (8 if not rests or (levels.locked and slot < 3) else
                    14 if levels.too_long else 0), [], []
        whole = sets or command in {"$X", "$$", "$C", "$SLP", *LISTS, *HOMED, *RESTORES}
        if not whole and (rests or command[1] in ALWAYS):
            return self._no_command(command), [], []
        busy = not rests and not (command == "$$" and (levels.jogging or self.checking))
        if busy or (levels.stopped and command in {"$X", "$SLP", *HOMED}) or (
                levels.locked and command == "$C"):
            return 8, [], []
        if sets:
            return *self._set(int(sets[1]), Decimal(sets[2])), []
        if command == "$C":
            self.checking = True
            return 0, [], []
        if command == "$SLP":
            return 0, [], ["sleep"]
        if command in HOMED:
            if not self.values[22]:
                return 5, [], []
            return (13, [], []) if levels.door else (0, [f"home {HOMED[command]}"], [])
        if command in LISTS:
            return 0, [f"list {LISTS[command]}"], []
        if command == "$$":
            return 0, [f"show {number}={value}" for number, value in self.values.items()], []
        return 0, [*self._restore(command[-1]), "restored"], [
            "restart", *["texts"] * command.endswith("*")]

    def _no_command(self, command: str) -> int:
        """Return 2 where a number has to be and is not, else 3."""
        if command[1] in LETTERS:
            return 3
        value = re.match(r"\$\d+=(.?)", command)
        missing = not re.match(r"[-+.\d]", value[1] if value else command[1])
        return 2 if missing else 3

    def _restore(self, which: str) -> list[str]:
        done = []
        if which in "$*":
            self.values.update({number: each[3] for number, each in self.known.items()})
            done = [f"write {number}={value}" for number, value in self.values.items()]
        return done + [f"erase {word}" for word in COORDINATES if which in "#*"]

    def _set(self, number: int, value: Decimal) -> tuple[int, list[str]]:
        """Change a setting, or say why not."""
        if number not in self.known:
            return 3, []
        least, most, decimal, _ = self.known[number]
        thousandths = int((value * 1000).to_integral_value(ROUND_HALF_UP))
        stored = thousandths if decimal else int(value)
        if thousandths < 0:
            return 4, []
        if thousandths >= 1 << 27 or (not decimal and value != int(value)) or stored > most:
            return 38, []
        if stored < least:
            return 4, []
        if number == 20 and stored and not self.values[22]:
            return 10, []
        done = [f"try {number}={stored}"]
        if {**self.values, number: stored}[110] > self.fastest:
            return 12, [*done, "as before"]
        if number == 22 and not stored:
            self.values[20] = 0
            done.append("write 20=0")
        self.values[number] = stored
        return 0, [*done, f"write {number}={stored}"]
