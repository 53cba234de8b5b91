"""What words of G-code say, and which go together in a line: from GRBL's description of them."""

import random
from dataclasses import dataclass, field

__all__ = ["LineModel", "some_number"]

VALUES = "FIJKLNPRSTXYZ"
"""Letters whose values are stored, in the order of their addresses."""

GROUPS = {
    "non_modal": (4, 10, 28, 30, 53, 92), "motion": (0, 1, 2, 3, 38, 80), "plane": (17, 18, 19),
    "distance": (90, 91), "feed": (93, 94), "units": (20, 21), "radius": (40,),
    "length": (43, 49), "system": (54, 55, 56, 57, 58, 59), "path": (61,),
}
GROUP_OF = {code: group for group, codes in GROUPS.items() for code in codes}
M_GROUP_OF = {0: "flow", 1: "flow", 2: "flow", 30: "flow", 3: "spindle", 4: "spindle",
              5: "spindle", 7: "coolant", 8: "coolant", 9: "coolant"}
WITH_FRACTION = {28: {0, 10}, 30: {0, 10}, 92: {0, 10}, 38: {20, 30, 40, 50}, 43: {10}, 61: {0},
                 90: {0}, 91: {0, 10}}
"""Hundredths that are there, of codes that may have some; what else they have is unsupported."""
FRACTIONS = ".1", ".10", ".2", ".3", ".4", ".5", ".6", ".01", ".105"
NON_MODAL = {(4, 0): 1, (10, 0): 2, (28, 0): 3, (28, 10): 4, (30, 0): 3, (30, 10): 4, (53, 0): 5,
             (92, 0): 6, (92, 10): 7}
MOTION, OF_NON_MODAL, OF_LENGTH = 1, 2, 3


def some_number(rng: random.Random, letter: str) -> str:
    """Return a number that may follow a letter: mostly one that is known, or nearly so."""
    if letter in "GM":
        known = GROUP_OF if letter == "G" else M_GROUP_OF
        code = rng.choice([*known, *known, rng.randrange(130),
                           rng.choice([*known]) + (128 << rng.randrange(16))])
        return str(code) + rng.choice(["", "", "", "", *FRACTIONS])
    return rng.choice([
        "0", "1", "2", "-1", "-0.5", "20", "254", "255", "255.5", "256", "-256", "10000000",
        "10000001", "17179.869183", "17179.869184", "34359.738367", "34359.738368", "-34359.738368",
        "-34359.738369", "99999999999", f"{rng.uniform(-300, 300):.3f}"])


@dataclass
class LineModel:
    """Takes the words of a line one by one; each is a letter and what the reader says of a number.

    Attributes
    ----------
    reach : int
        Bits of a length, with its sign.
    error : int
        The first, or 0.
    modes, said : dict of str to int
        Modes, and what else the line says: as `GCodeLineState` has them.
    """

    reach: int
    error: int = 0
    modes: dict[str, int] = field(default_factory=dict)
    said: dict[str, int] = field(default_factory=dict)
    groups: set[str] = field(default_factory=set)

    def clear(self, modes: dict[str, int]) -> None:
        """Begin a line."""
        self.error, self.modes, self.said, self.groups = 0, dict(modes), {}, set()

    def end_program(self) -> None:
        """Make it a line that sets the modes of a program's end."""
        self.modes = {"inches": self.modes.get("inches", 0), "motion": 1}
        self.said |= {"letters": 0, "axes": 0, "non_modal": 0}

    def line(self) -> dict[str, int | dict[str, int]]:
        """Return what it says: axis words that nothing takes are for a motion."""
        axes = self.said.get("axes", 0)
        if not axes and any(self._has(letter) for letter in "XYZ"):
            axes = MOTION
        return self.said | {"axes": axes, "modes": self.modes}

    def take(self, letter: str, number: dict[str, int]) -> None:
        """Take a word; after an error nothing is changed."""
        if not self.error:
            self.error = (self._take_g(number) if letter == "G" else self._take_m(number)
                          if letter == "M" else self._take_value(letter, number))

    def _take_g(self, number: dict[str, int]) -> int:
        code, hundredths = number["whole"], number["hundredths"] if number["exact"] else None
        if number["overflow"] or number["value"] < 0 or code not in GROUP_OF:
            return 20
        axes = (MOTION if code in (0, 1, 2, 3, 38) else OF_LENGTH if code in (43, 49) else
                OF_NON_MODAL if code in (10, 28, 30, 92) and hundredths == 0 else 0)
        if axes and self.said.get("axes"):
            return 24
        if code in WITH_FRACTION and hundredths not in WITH_FRACTION[code]:
            return 20
        if hundredths != 0 and code not in WITH_FRACTION and code != 49:
            return 23
        group = GROUP_OF[code] if (code, hundredths) != (91, 10) else "arc distance"
        if (error := self._join(group)):
            return error
        if axes:
            self.said["axes"] = axes
        if group not in ("non_modal", "distance", "units"):
            self.said["not_of_jog"] = 1
        if group == "non_modal":
            assert hundredths is not None
            self.said |= {"non_modal": NON_MODAL[code, hundredths], "second": int(code == 30)}
        elif group == "length":
            self.said["cancels"] = int(code == 49)
        elif group == "motion":
            self.modes["motion"] = {38: 6 + (hundredths or 0) // 10, 80: 4}.get(code, code)
        else:
            name, choice = {
                "plane": ("plane", code - 17), "distance": ("relative", code - 90),
                "feed": ("inverse", 94 - code), "units": ("inches", 21 - code),
                "system": ("system", code - 54)}.get(group, ("", 0))
            if name:
                self.modes[name] = choice
        return 0

    def _take_m(self, number: dict[str, int]) -> int:
        code = number["whole"]
        if number["overflow"] or number["value"] < 0 or not number["exact"] or number["hundredths"]:
            return 23
        if code not in M_GROUP_OF:
            return 20
        if (error := self._join(M_GROUP_OF[code])):
            return error
        self.said["not_of_jog"] = 1
        match M_GROUP_OF[code]:
            case "flow":
                self.said["flow"] = {0: 1, 1: 0}.get(code, 2)
            case "spindle":
                self.modes |= {"clockwise": int(code == 3), "counter_clockwise": int(code == 4)}
            case "coolant":
                self.modes |= {"mist": 0, "flood": 0} if code == 9 else {
                    "mist" if code == 7 else "flood": 1}
        return 0

    def _take_value(self, letter: str, number: dict[str, int]) -> int:
        if letter not in VALUES:
            return 20
        negative = not number["overflow"] and number["value"] < 0
        whole = number["whole"]
        if letter == "T" and (number["overflow"] or (not negative and (
                whole > 255 or (whole == 255 and not number["integer"])))):
            return 38
        if self._has(letter):
            return 25
        if number["overflow"] and letter != "N":
            return 38
        if negative and letter in "FNPST":
            return 4
        self.said["letters"] = self.said.get("letters", 0) | 1 << VALUES.index(letter)
        if letter in "LP":
            self.said[f"{letter.lower()}_whole"] = 255 if negative else min(whole, 255)
        elif letter == "N":
            self.said["number_too_large"] = int(whole > 10_000_000)
        elif letter == "F":
            self.said["zero_feed"] = int(number["value"] == 0)
        elif letter in "IJKRXYZ":
            if not -(1 << self.reach - 1) <= number["value"] < 1 << self.reach - 1:
                self.said["too_long"] = 1
        return 0

    def _join(self, group: str) -> int:
        if group in self.groups:
            return 21
        self.groups.add(group)
        return 0

    def _has(self, letter: str) -> bool:
        return bool(self.said.get("letters", 0) >> VALUES.index(letter) & 1)
