"""Model of the G-code language: what a line of words means, in whole nanometres.

Written from GRBL 1.1's documented behaviour: modal groups after NIST RS274/NGC version 3 (table 4),
error codes and their order as GRBL gives them. A line that is refused changes nothing.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from math import isqrt

from .gcode_line import Item, read_lines
from .thesis import in_grbl

__all__ = ["G_CODES", "MAX_LINE_NUMBER", "M_CODES", "OF_JOG", "VALUES", "Action", "Arc", "Coolant",
           "Dwell", "End", "Interpreter", "Jog", "Line", "Modes", "Offsets", "Pause", "Probe",
           "RefusedLine", "Spindle", "Vector", "Word", "centre_by_radius", "check_radii",
           "nanometres", "per_second", "read_jog", "read_words", "words"]

Vector = tuple[int, int, int]
"""X, Y and Z, in nm."""

ORIGIN: Vector = (0, 0, 0)
AXES = "XYZ"
SYSTEMS = 6
MAX_LINE_NUMBER = 10_000_000
MAX_TOOL = 255
REACH = 1 << 35
"""Positions are below this, in nm: 36 bits with the sign."""


MAX_RADIUS = 1 << 33
"""Radii of arcs are below this, in nm."""
MAX_RADIUS_STEPS = 1 << 21
"""They are at most so many steps of each axis of their plane."""
TOP_FEED = (1 << 31) - 1
"""In nm/s."""


class RefusedLine(Exception):
    """A line is refused; its argument is GRBL's code."""


@dataclass(frozen=True)
class Word:
    """A letter and its number, in millionths.

    Attributes
    ----------
    letter : str
        A capital.
    value : int
        In units of 10^-6, rounded half away from 0.
    overflow : bool
        The number has more than 43 bits, without its sign.
    """

    letter: str
    value: int
    overflow: bool = False

    @property
    def code(self) -> tuple[int, int]:
        """Its whole part and hundredths, as of ``G38.2``: (38, 20); 100 if there is more behind."""
        whole, rest = divmod(abs(self.value), 1_000_000)
        return whole, 100 if rest % 10_000 else rest // 10_000


@dataclass(frozen=True)
class Line:
    """A straight line; `feed` in nm/s, None at the highest speed, or per minute with `inverse`."""

    target: Vector
    feed: int | None
    inverse: bool = False


@dataclass(frozen=True)
class Arc:
    """An arc or helix: `centre` is given from its start, in the plane of the axes `plane`.

    `radius` is that of its line, in nm, if there is one: then the centre follows from it.
    """

    target: Vector
    centre: tuple[int, int]
    plane: tuple[int, int]
    clockwise: bool
    feed: int
    inverse: bool = False
    radius: int | None = field(default=None, compare=False)


@dataclass(frozen=True)
class Probe:
    """A straight line, as a `Line`, that ends where the probe touches, or, `away`, leaves.

    Without either it is an alarm, or with `no_error` none.
    """

    target: Vector
    feed: int
    inverse: bool = False
    away: bool = False
    no_error: bool = False


@dataclass(frozen=True)
class Dwell:
    """Standing still for so many us."""

    time: int


@dataclass(frozen=True)
class Spindle:
    """`direction` is 1 clockwise, -1 counter-clockwise, 0 off; `speed` in 10^-6 rev/min."""

    direction: int
    speed: int


@dataclass(frozen=True)
class Coolant:
    """What is on."""

    mist: bool
    flood: bool


@dataclass(frozen=True)
class Offsets:
    """Work coordinates have changed: their origin in the machine's, in nm."""

    origin: Vector


@dataclass(frozen=True)
class Pause:
    """A stop of the program until it is resumed."""


@dataclass(frozen=True)
class End:
    """The end of the program."""


@dataclass(frozen=True)
class Jog:
    """A straight line that is no part of a program; `feed` in nm/s."""

    target: Vector
    feed: int


Action = Line | Jog | Arc | Probe | Dwell | Spindle | Coolant | Offsets | Pause | End


@dataclass(frozen=True)
class Modes:
    """What stays from line to line.

    Attributes
    ----------
    motion : int
        0 to 3 for G0 to G3, 382 to 385 for G38.2 to G38.5, 80 for none.
    plane : int
        0 for XY (G17), 1 for ZX, 2 for YZ.
    relative, inches, inverse : bool
        G91, G20, G93.
    system : int
        0 for G54 to 5 for G59.
    spindle : int
        1 for M3, -1 for M4, 0 for M5.
    mist, flood : bool
        M7, M8.
    """

    motion: int = 0
    plane: int = 0
    relative: bool = False
    inches: bool = False
    inverse: bool = False
    system: int = 0
    spindle: int = 0
    mist: bool = False
    flood: bool = False


_NON_MODAL = {(4, 0), (10, 0), (28, 0), (28, 10), (30, 0), (30, 10), (53, 0), (92, 0), (92, 10)}
_GROUPS = {**dict.fromkeys([0, 1, 2, 3, 38, 80], "motion"), **dict.fromkeys([17, 18, 19], "plane"),
           90: "distance", 91: "distance", 93: "feed", 94: "feed", 20: "units", 21: "units",
           40: "compensation", 43: "length", 49: "length",
           **dict.fromkeys(range(54, 60), "system"), 61: "path"}
_M_GROUPS = {0: "flow", 1: "flow", 2: "flow", 30: "flow", 3: "spindle", 4: "spindle",
             5: "spindle", 7: "coolant", 8: "coolant", 9: "coolant"}
VALUES = "FIJKLNPRSTXYZ"
"""Letters whose values are stored, in the order of their addresses."""
OF_JOG = {"non-modal", "distance", "units"}
"""Groups of which a jog may have a word."""
G_CODES = sorted({code for code, _ in _NON_MODAL} | {*_GROUPS})
M_CODES = sorted(_M_GROUPS)


@dataclass
class _Line:
    """What the words of a line say, before anything of it is checked together."""

    modes: Modes
    groups: set[str] = field(default_factory=set)
    values: dict[str, int] = field(default_factory=dict)
    non_modal: tuple[int, int] | None = None
    axes: str = ""  # what the axis words are for: motion, non-modal or length
    tool_length: str = ""
    flow: int = 0


class Interpreter:
    """Runs a program line by line.

    Parameters
    ----------
    position : tuple of int
        That of the machine at the start, in nm.
    probing : bool
        It has a probe: else G38 is unknown. A probing ends at its target, as if nothing touched.
    steps_per_metre : sequence of int
        Of X, Y and Z; 0 for any number, so that no arc is of too many steps.

    Attributes
    ----------
    modes : Modes
        What the lines so far have set.
    position : tuple of int
        Where the last motion ends, in the machine's coordinates, in nm.
    feed, spindle_speed, tool : int
        Values of F (nm/s, or as written with G93), S (10^-6) and T.
    systems : list of tuple
        Origins of G54 to G59, in nm.
    offset, predefined : tuple of int, and a list of two
        That of G92, and the positions of G28 and G30, in nm.
    tool_length : int
        In nm, along Z.
    """

    def __init__(self, position: Vector = ORIGIN, *, probing: bool = True,
                 steps_per_metre: Sequence[int] = ORIGIN) -> None:
        self.probing, self.steps_per_metre = probing, tuple(steps_per_metre)
        self.modes = Modes()
        self.position = position
        self.feed = self.spindle_speed = self.tool = self.tool_length = 0
        self.systems: list[Vector] = [ORIGIN] * SYSTEMS
        self.offset: Vector = ORIGIN
        self.predefined: list[Vector] = [ORIGIN, ORIGIN]

    @property
    def origin(self) -> Vector:
        """That of the work coordinates in the machine's, in nm."""
        return self._origin(self.modes.system)

    def set_position(self, axis: int, value: int) -> None:
        """Set the position of an axis, in nm."""
        self.position = _vector(value if n == axis else self.position[n] for n in range(3))

    def reset(self) -> None:
        """Keep the position, the coordinate systems, and the positions of G28 and G30 only."""
        kept = self.position, self.systems, self.predefined
        self.__init__(probing=self.probing, steps_per_metre=self.steps_per_metre)
        self.position, self.systems, self.predefined = kept

    def line(self, words: Iterable[Word]) -> list[Action]:
        """Return what a line does, in order, and keep what it sets.

        Raises
        ------
        RefusedLine
            With GRBL's code, if the line is refused; then nothing has changed.
        """
        given = list(words)
        if not given:  # as of a comment, which is no line to GRBL's parser
            return []
        line = self.read(given)
        self._check_values(line)
        return self._check_and_run(line)

    def jog(self, words: Iterable[Word], inside: Callable[[Vector], bool] = lambda _: True
            ) -> list[Action]:
        """Return what a jog of these words does, and keep where it ends.

        Parameters
        ----------
        words : iterable of Word
            What is behind ``$J=``.
        inside : callable
            Whether a target is one to which it may go.

        Raises
        ------
        RefusedLine
            With GRBL's code, if it is refused.
        """
        line = self.read(words)
        line.modes = replace(line.modes, motion=1, inverse=False)
        self._check_values(line, needs_feed=True)
        values, given = line.values, [axis in line.values for axis in AXES]
        lengths = [nanometres(values.get(axis, 0), line.modes.inches) for axis in AXES]
        feed = per_second(nanometres(values["F"], line.modes.inches))
        moves = line.axes in ("", "motion") and any(given)
        target = self._target(line, lengths, given) if moves else self.position
        if any(not -REACH <= place < REACH for place in target):
            raise RefusedLine(33)
        if line.axes == "motion" and not feed:
            raise RefusedLine(22)
        used = {(4, 0): "NFP", (10, 0): "NFPL"}.get(line.non_modal or (0, 0), "NF")
        if any(letter not in used for letter in values if not (line.axes and letter in AXES)):
            raise RefusedLine(36)
        if line.groups - OF_JOG or line.non_modal not in (None, (53, 0)):
            raise RefusedLine(16)
        if moves and not inside(target):
            raise RefusedLine(15)
        self.position = target
        return [Jog(target, feed)] if moves else []

    def _origin(self, system: int) -> Vector:
        x, y, z = (a + b for a, b in zip(self.systems[system], self.offset, strict=True))
        return x, y, z + self.tool_length

    # Words, as they come

    def read(self, words: Iterable[Word]) -> _Line:
        """Return the modes and values of a line that may not be right as a whole.

        Parameters
        ----------
        words : iterable of Word
            Its words, or the first of them.

        Raises
        ------
        RefusedLine
            With GRBL's code, if one is wrong.
        """
        line = _Line(self.modes)
        for word in words:
            if word.letter in "GM" and (word.overflow or word.value < 0):
                raise RefusedLine(20 if word.letter == "G" else 23)
            if word.letter == "G":
                self._g(line, *word.code)
            elif word.letter == "M":
                self._m(line, *word.code)
            elif word.letter in VALUES:
                if word.letter == "T" and (word.overflow or word.value > MAX_TOOL * 1_000_000):
                    raise RefusedLine(38)
                if word.letter in line.values:
                    raise RefusedLine(25)
                if word.overflow and word.letter != "N":
                    raise RefusedLine(38)
                if word.letter in "FNPTS" and word.value < 0 and not word.overflow:
                    raise RefusedLine(4)
                # Of one that overflows the sign does not count.
                line.values[word.letter] = abs(word.value) if word.overflow else word.value
            else:
                raise RefusedLine(20)
        return line

    def _g(self, line: _Line, whole: int, hundredths: int) -> None:
        group = _GROUPS.get(whole)
        if whole in (4, 10, 28, 30, 53, 92):
            group = "non-modal"
            takes_axes = whole not in (4, 53) and not hundredths
            if takes_axes and line.axes:
                raise RefusedLine(24)
            if takes_axes:
                line.axes = group
            if (whole, hundredths) not in _NON_MODAL:
                raise RefusedLine(20 if whole in (28, 30, 92) else 23)
            line.non_modal = whole, hundredths
        elif group is None or (whole == 38 and not self.probing):
            raise RefusedLine(20)
        elif group == "motion":
            self._takes_axes(line, "motion", whole != 80)
            if whole == 38:
                if hundredths not in (20, 30, 40, 50):
                    raise RefusedLine(20)
                whole, hundredths = 380 + hundredths // 10, 0
            line.modes = replace(line.modes, motion=whole)
        elif group == "distance" and hundredths:
            if (whole, hundredths) != (91, 10):
                raise RefusedLine(20)
            group, hundredths = "arc distance", 0
        elif group == "length":
            self._takes_axes(line, "length", True)
            if whole == 43 and hundredths != 10:
                raise RefusedLine(20)
            line.tool_length, hundredths = "cancel" if whole == 49 else "set", 0
        elif whole == 61 and hundredths:
            raise RefusedLine(20)
        else:
            changes = {"plane": {"plane": whole - 17}, "distance": {"relative": whole == 91},
                       "feed": {"inverse": whole == 93}, "units": {"inches": whole == 20},
                       "system": {"system": whole - 54}}.get(group, {})
            line.modes = replace(line.modes, **changes)
        if hundredths and group != "non-modal":
            raise RefusedLine(23)
        self._once(line, group)

    @staticmethod
    def _takes_axes(line: _Line, use: str, takes: bool) -> None:
        if takes:
            if line.axes:
                raise RefusedLine(24)
            line.axes = use

    def _m(self, line: _Line, whole: int, hundredths: int) -> None:
        if hundredths:
            raise RefusedLine(23)
        group = _M_GROUPS.get(whole)
        if group is None:
            raise RefusedLine(20)
        if group == "flow":
            line.flow = 0 if whole == 1 else 30 if whole == 2 else whole or -1
        else:
            changes = {3: {"spindle": 1}, 4: {"spindle": -1}, 5: {"spindle": 0},
                       7: {"mist": True}, 8: {"flood": True},
                       9: {"mist": False, "flood": False}}[whole]
            line.modes = replace(line.modes, **changes)
        self._once(line, group)

    @staticmethod
    def _once(line: _Line, group: str) -> None:
        if group in line.groups:
            raise RefusedLine(21)
        line.groups.add(group)

    # A line as a whole

    def _check_values(self, line: _Line, *, needs_feed: bool = False) -> None:
        values = line.values
        if not line.axes and any(axis in values for axis in AXES):
            line.axes = "motion"
        if values.get("N", 0) // 1_000_000 > MAX_LINE_NUMBER:
            raise RefusedLine(27)
        needs_feed |= (line.modes.inverse and line.axes == "motion"
                       and line.modes.motion not in (0, 80))
        if needs_feed and "F" not in values:
            raise RefusedLine(22)
        if line.non_modal == (4, 0) and "P" not in values:
            raise RefusedLine(28)
        if line.tool_length == "set" and [axis for axis in AXES if axis in values] != ["Z"]:
            raise RefusedLine(37)
        given = any(axis in values for axis in AXES)
        if line.non_modal in ((10, 0), (92, 0)) and not given:
            raise RefusedLine(26)
        if line.non_modal == (10, 0):
            if "P" not in values and "L" not in values:
                raise RefusedLine(28)
            if values.get("P", 0) // 1_000_000 > SYSTEMS:
                raise RefusedLine(29)
            kind = values.get("L", 0) // 1_000_000
            if kind not in (2, 20) or (kind == 2 and "R" in values):
                raise RefusedLine(20)
        elif line.non_modal == (53, 0) and line.modes.motion not in (0, 1):
            raise RefusedLine(30)
        if any(not -REACH <= nanometres(value, line.modes.inches) < REACH
               for letter, value in values.items() if letter in "IJKRXYZ"):
            raise RefusedLine(38)

    def _feed(self, line: _Line) -> int:
        """Return F as it is from this line on."""
        if line.modes.inverse:
            return line.values.get("F", 0)
        if self.modes.inverse and "F" not in line.values:
            return 0
        if "F" not in line.values:
            return self.feed
        inches = line.modes.inches and not self.modes.inverse
        return per_second(nanometres(line.values["F"], inches))

    def _check_and_run(self, line: _Line) -> list[Action]:
        values, modes = dict(line.values), line.modes
        given = [axis in values for axis in AXES]
        words = [nanometres(values.get(axis, 0), modes.inches) for axis in AXES]
        feed = self._feed(line)
        target = self.position
        coordinates: tuple[int, Vector] | None = None
        offset, home, intermediate = self.offset, None, None
        for letter in "P" if line.non_modal == (4, 0) else "":
            values.pop(letter)

        if line.non_modal == (10, 0):
            coordinates = self._set_coordinates(line, values, words, given)
        elif line.non_modal == (92, 0):
            origin = self.systems[modes.system]
            offset = _vector(
                self.position[n] - origin[n] - words[n] - (self.tool_length if n == 2 else 0)
                if given[n] else self.offset[n] for n in range(3))
        else:
            if line.axes != "length" and any(given):
                target = self._target(line, words, given)
            if line.non_modal in ((28, 0), (30, 0)):
                stored = self.predefined[line.non_modal[0] == 30]
                home = _vector(stored[n] if given[n] or not any(given) else self.position[n]
                               for n in range(3))
                intermediate = target if any(given) else None
            elif line.non_modal == (92, 10):
                offset = ORIGIN

        if any(not -REACH <= place < REACH for place in
               (*target, *(coordinates[1] if coordinates else offset))):
            raise RefusedLine(33)
        moves, used = self._motion(line, words, given, target, feed)
        if any(letter not in f"NFST{used}" for letter in values
               if not (line.axes and letter in AXES)):
            raise RefusedLine(36)
        return self._run(line, feed, moves, coordinates, offset, home, intermediate)

    def _set_coordinates(self, line: _Line, values: dict[str, int], words: Sequence[int],
                         given: Sequence[bool]) -> tuple[int, Vector]:
        number = values.get("P", 0) // 1_000_000
        kind = values.get("L", 0) // 1_000_000
        for letter in "PL":
            values.pop(letter, None)
        system = number - 1 if number else line.modes.system
        length = (0, 0, self.tool_length)
        return system, _vector(
            self.systems[system][n] if not given[n] else words[n] if kind == 2 else
            self.position[n] - self.offset[n] - words[n] - length[n] for n in range(3))

    def _target(self, line: _Line, words: Sequence[int], given: Sequence[bool]) -> Vector:
        origin = ORIGIN if line.non_modal == (53, 0) else \
            self.position if line.modes.relative else self._origin(line.modes.system)
        return _vector(origin[n] + words[n] if given[n] else self.position[n] for n in range(3))

    def _motion(self, line: _Line, words: Sequence[int], given: Sequence[bool], target: Vector,
                feed: int) -> tuple[list[Action], str]:
        """Return the motion of the line, and which letters beside axes it used."""
        motion = line.modes.motion
        if motion == 80:
            if any(given):
                raise RefusedLine(31)
            return [], ""
        if line.axes != "motion":
            return [], ""
        if motion == 0:
            return [Line(target, None)] if any(given) else [], ""
        if feed == 0:
            raise RefusedLine(22)
        if motion == 1:
            return [Line(target, feed, line.modes.inverse)] if any(given) else [], ""
        if motion >= 382:
            if not any(given):
                raise RefusedLine(26)
            if target == self.position:
                raise RefusedLine(33)
            return [Probe(target, feed, line.modes.inverse, away=motion >= 384,
                          no_error=motion in (383, 385))], ""
        centre, plane, used = self._centre(line, given, target)
        radius = nanometres(line.values["R"], line.modes.inches) if used == "R" else None
        return [Arc(target, centre, plane, motion == 2, feed, line.modes.inverse, radius)], used

    def _centre(self, line: _Line, given: Sequence[bool], target: Vector
                ) -> tuple[tuple[int, int], tuple[int, int], str]:
        a, b = plane = ((0, 1), (2, 0), (1, 2))[line.modes.plane]
        if not any(given):
            raise RefusedLine(26)
        if not (given[a] or given[b]):
            raise RefusedLine(32)
        x, y = target[a] - self.position[a], target[b] - self.position[b]
        steps = max(self.steps_per_metre[axis] for axis in plane)
        if "R" in line.values:
            if target == self.position:
                raise RefusedLine(33)
            radius = nanometres(line.values["R"], line.modes.inches)
            return centre_by_radius(x, y, radius, clockwise=line.modes.motion == 2,
                                    steps_per_metre=steps), plane, "R"
        letters = "IJK"
        if not (letters[a] in line.values or letters[b] in line.values):
            raise RefusedLine(35)
        i, j = (nanometres(line.values.get(letters[n], 0), line.modes.inches) for n in plane)
        return check_radii(i, j, x, y, steps_per_metre=steps), plane, letters

    def _run(self, line: _Line, feed: int, moves: list[Action],
             coordinates: tuple[int, Vector] | None, offset: Vector, home: Vector | None,
             intermediate: Vector | None) -> list[Action]:
        """Do what is right, in GRBL's order of execution."""
        before, modes = self.modes, line.modes
        actions: list[Action] = []
        self.feed = feed
        speed = line.values.get("S", self.spindle_speed)
        if modes.spindle != before.spindle or ("S" in line.values and modes.spindle):
            actions.append(Spindle(modes.spindle, speed))
        self.spindle_speed = speed
        self.tool = line.values.get("T", self.tool * 1_000_000) // 1_000_000
        if (modes.mist, modes.flood) != (before.mist, before.flood):
            actions.append(Coolant(modes.mist, modes.flood))
        if line.non_modal == (4, 0):
            actions.append(Dwell(line.values["P"]))
        origin = self.origin
        self.modes = modes
        if line.tool_length:
            self.tool_length = 0 if line.tool_length == "cancel" else \
                nanometres(line.values["Z"], modes.inches)
        if coordinates is not None:
            self.systems[coordinates[0]] = coordinates[1]
        self.offset = offset
        if self.origin != origin:
            actions.append(Offsets(self.origin))
        if home is not None:
            places = [home] if intermediate is None else [intermediate, home]
            moves = [Line(place, None) for place in places]
        if line.non_modal in ((28, 10), (30, 10)):
            self.predefined[line.non_modal[0] == 30] = self.position
        for move in moves:
            assert isinstance(move, Line | Arc | Probe)
            self.position = move.target
        actions += moves
        if line.flow == -1:
            actions.append(Pause())
        elif line.flow:
            actions += self._end()
        return actions

    def _end(self) -> list[Action]:
        actions: list[Action] = []
        origin = self.origin
        if self.modes.spindle:
            actions.append(Spindle(0, self.spindle_speed))
        if self.modes.mist or self.modes.flood:
            actions.append(Coolant(mist=False, flood=False))
        self.modes = Modes(motion=1, inches=self.modes.inches)
        if self.origin != origin:
            actions.append(Offsets(self.origin))
        return [*actions, End()]


def words(line: str, dialect: str = "grbl") -> list[Word]:
    """Return the words of a line, by the model of the reader.

    Raises
    ------
    RefusedLine
        If it cannot be read, with GRBL's code.
    """
    found, status = read_words(line, dialect)
    if status:
        raise RefusedLine(status)
    return found


def read_words(line: str, dialect: str = "grbl") -> tuple[list[Word], int]:
    """Return the words of a line up to its first error, and GRBL's code of that, or 0.

    A system line, also one that a line of the thesis' dialect means, has no words.
    """
    items = read_lines(line.rstrip("\n") + "\n")
    *items, end = in_grbl(items) if dialect == "thesis" else items
    return [_word(item) for item in items if not item.system], end.status


def read_jog(line: str) -> tuple[list[Word], int]:
    """Return, of a line that begins with ``$J=``, the words behind that, likewise."""
    *items, end = read_lines(line.rstrip("\n") + "\n")
    return [_word(item) for item in items if item.kind == "WORD"], end.status


def _word(item: Item) -> Word:
    return Word(item.character, item.number["value"], bool(item.number["overflow"]))


def _vector(values: Iterable[int]) -> Vector:
    x, y, z = values
    return x, y, z


def nanometres(value: int, inches: bool) -> int:
    """Return nm of a value in millionths of a mm, or of an inch, rounded half away from 0."""
    if not inches:
        return value
    size = (abs(value) * 254 + 5) // 10
    return -size if value < 0 else size


def per_second(per_minute: int) -> int:
    """Return nm/s of nm a minute: at least 1, unless it is 0."""
    return min(max(per_minute // 60, 1), TOP_FEED) if per_minute else 0


def centre_by_radius(x: int, y: int, radius: int, *, clockwise: bool,
                     steps_per_metre: int = 0) -> tuple[int, int]:
    """Return the centre of an arc of a radius to (x, y), within a nm of the exact one.

    A negative radius is that of the longer arc.

    Raises
    ------
    RefusedLine
        If the radius is less than half the chord; otherwise if it is `MAX_RADIUS` or more, or as
        `check_radii` says of the centre.
    """
    chord = x * x + y * y
    rest = 4 * radius * radius - chord
    if rest < 0 or not chord:
        raise RefusedLine(34)
    scale = 64
    ratio = isqrt((rest << 2 * scale) // chord)
    if clockwise == (radius > 0):
        ratio = -ratio
    half = 1 << scale
    if abs(radius) >= MAX_RADIUS:
        raise RefusedLine(33)
    return check_radii(((x << scale) - y * ratio + half) >> scale + 1,
                       ((y << scale) + x * ratio + half) >> scale + 1, x, y,
                       steps_per_metre=steps_per_metre)


def check_radii(i: int, j: int, x: int, y: int, *, steps_per_metre: int = 0) -> tuple[int, int]:
    """Return the centre (i, j) of an arc to (x, y); lengths are in nm.

    `steps_per_metre` are those of the axis of the plane that has more of them.

    Raises
    ------
    RefusedLine
        If the arc ends at another radius than it begins with, by over 0.5 mm, or by over 0.005 mm
        and 0.1 %; if it has none, to below 1 nm; if it has `MAX_RADIUS` or more, or one that may
        be over `MAX_RADIUS_STEPS`: known to the nm below, it may be as long as that above.
    """
    radius = isqrt(i * i + j * j)
    difference = abs(isqrt((x - i) ** 2 + (y - j) ** 2) - radius)
    if difference > 500_000 or (difference > 5_000 and 1000 * difference > radius):
        raise RefusedLine(33)
    if not 0 < radius < MAX_RADIUS or (radius + 1) * steps_per_metre > MAX_RADIUS_STEPS * 10**9:
        raise RefusedLine(33)
    return i, j
