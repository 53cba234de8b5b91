"""Sums of coordinates, as GRBL makes them, over the words that are stored."""

from collections.abc import Collection

from .gcode_language import VALUES

__all__ = ["summed"]

LETTER = {letter: at for at, letter in enumerate(VALUES)}
PROBED, SYSTEM, OFFSET, LENGTH, PREDEFINED, POSITION, FEED, SPEED, TOOL = (
    13, 16, 34, 37, 38, 44, 47, 48, 49)
NEW, TARGET, HOME, ORIGIN = 50, 53, 56, 60


def summed(what: str, words: list[int], *, letters: Collection[str], relative: bool = False,
           system: int = 0, machine: bool = False, of_length: bool = False, second: bool = False,
           p: int = 0, of_position: bool = False) -> tuple[list[int], list[int]]:
    """Return the stored words after a sum, and the sums of X, Y and Z.

    Parameters
    ----------
    what : str
        Name of a `CoordinateSum`.
    words : list of int
        64 words, by their addresses.
    letters : collection of str
        Those that the line gives.
    relative, system
        Modes.
    machine, of_length, second, p, of_position
        G53; axis words belong to G43.1; G30, not G28; P, a system or 0; L20, not L2.
    """
    after, sums = list(words), []
    chosen = p - 1 if p and what.endswith("COORDINATES") else system
    predefined = PREDEFINED + 3 * second
    axes = [axis for axis in range(3) if "XYZ"[axis] in letters]
    for axis in range(3):
        value, position = words[LETTER["XYZ"[axis]]], words[POSITION + axis]
        offset, length = words[OFFSET + axis], words[LENGTH] * (axis == 2)
        origin = words[SYSTEM + 3 * chosen + axis]
        here, to = axis in axes, None
        match what:
            case "TARGET":
                to = TARGET + axis
                if not here or of_length:
                    total = position
                else:
                    total = value + (0 if machine else position if relative
                                     else offset + length + origin)
            case "COORDINATES":
                to = NEW + axis
                total = (origin if not here else value if not of_position
                         else position - offset - length - value)
            case "OFFSET":
                total, to = position - origin - length - value if here else offset, NEW + axis
            case "HOME":
                total, to = words[predefined + axis] if here or not axes else position, HOME + axis
            case "DISTANCE":
                total = words[TARGET + axis] - position
            case "SET_COORDINATES":
                total, to = words[NEW + axis], SYSTEM + 3 * chosen + axis
            case "SET_OFFSET":
                total, to = words[NEW + axis], OFFSET + axis
            case "SET_LENGTH":
                total, to = words[LETTER["Z"]], LENGTH if axis == 2 else None
            case "ORIGIN_CHANGE":
                total = offset + length + origin - words[ORIGIN + axis]
            case "SET_ORIGIN":
                total, to = offset + length + origin, ORIGIN + axis
            case "PREDEFINE":
                total, to = position, predefined + axis
            case "TAKE_HOME":
                total, to = words[HOME + axis], TARGET + axis
            case "ARRIVE":
                total, to = words[TARGET + axis], POSITION + axis
            case "SET_FEED" | "SET_SPEED" | "SET_TOOL":
                letter, place = {"SET_FEED": ("F", FEED), "SET_SPEED": ("S", SPEED),
                                 "SET_TOOL": ("T", TOOL)}[what]
                total, to = words[LETTER[letter]], place if axis == 0 else None
            case "CLEAR_OFFSET" | "CLEAR_LENGTH" | "CLEAR_RATES" | "CLEAR_PROBED":
                place = {"CLEAR_OFFSET": OFFSET, "CLEAR_LENGTH": LENGTH, "CLEAR_RATES": FEED,
                         "CLEAR_PROBED": PROBED}[what]
                total, to = 0, place + (axis if what != "CLEAR_LENGTH" else 0)
            case _:
                raise ValueError(what)
        sums.append(total)
        if to is not None:
            after[to] = total
    return after, sums
