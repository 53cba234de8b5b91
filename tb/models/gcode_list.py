"""Lists of a G-code machine, as GRBL 1.1's interface documents them."""

from collections.abc import Mapping
from fractions import Fraction

__all__ = ["listed", "quotient"]

HELP = b"[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? ctrl-x]\r\n"


def listed(which: str, *, modes: Mapping[str, int], words: Mapping[int, int],
           options: str = "VM,63,128", probed: bool = False, inches: bool = False,
           feed_zero: bool = False) -> bytes:
    """Return what ``$``, ``$G``, ``$#``, ``$I`` or ``$N`` lists; of ``PRB``, what ends ``$#``.

    Parameters
    ----------
    which : str
        The line, without its ``$``.
    modes : mapping of str to int
        The modes by the names in `GCodeModes`.
    words : mapping of int to int
        Stored words by their addresses: lengths in nm, others in millionths, and the feed in nm/s
        unless it is ``inverse``.
    options : str
        Of the build.
    probed : bool
        The probe has touched in the last probing.
    inches : bool
        Lengths are in inches, and the feed as well.
    feed_zero : bool
        No feed holds, as behind G93: GRBL lists 0, whatever was set before.
    """
    match which:
        case "":
            return HELP
        case "I":
            return f"[VER:1.1h.20190830:]\r\n[OPT:{options}]\r\n".encode()
        case "N":
            return b"$N0=\r\n$N1=\r\n"
        case "G":
            return _modes(modes, {**words, 47: 0} if feed_zero else words, inches)
        case "PRB":
            return _probed(words, probed, inches)
    # Origins of the systems from 16 on, of G28 and G30 from 38, the offset of G92 from 34
    places = {**{54 + system: 16 + 3 * system for system in range(6)}, 28: 38, 30: 41, 92: 34}
    lines = [f"[G{number}:{_place(words, at, inches)}]" for number, at in places.items()]
    lines.append(f"[TLO:{_length(words[37], inches)}]")
    return "".join(f"{line}\r\n" for line in lines).encode() + _probed(words, probed, inches)


def quotient(word: int, unit: str, *, inches: bool = False, nearest: bool = True) -> int:
    """Return a stored word in the units that a list has: a part of the last decimal that it shows.

    Parameters
    ----------
    word : int
        The word.
    unit : str
        Name of a `GCodeUnit`.
    inches : bool
        As for :func:`listed`.
    nearest : bool
        Round half away from zero, else towards 0.
    """
    value = Fraction(word, 10**6)
    match unit:
        case "LENGTH":
            value = value * 10_000 / Fraction("25.4") if inches else value * 1000
        case "FEED":
            value = value * 600 / Fraction("25.4") if inches else value * 60
        case "INVERSE":
            value = value * 10 if inches else value
    return _rounded(value) if nearest else int(value)


def _probed(words: Mapping[int, int], probed: bool, inches: bool) -> bytes:
    return f"[PRB:{_place(words, 13, inches)}:{int(probed)}]\r\n".encode()


def _place(words: Mapping[int, int], at: int, inches: bool) -> str:
    return ",".join(_length(words[at + axis], inches) for axis in range(3))


def _modes(modes: Mapping[str, int], words: Mapping[int, int], inches: bool) -> bytes:
    of = modes.__getitem__
    coolant = [name for name, on in (("M7", of("mist")), ("M8", of("flood"))) if on] or ["M9"]
    spindle = 3 if of("clockwise") else 4 if of("counter_clockwise") else 5
    feed = Fraction(words[47], 10**6)  # mm/s, or 1/min
    if not of("inverse"):
        feed = feed * 60 / (Fraction("25.4") if inches else 1)
    motion = {4: "80", 8: "38.2", 9: "38.3", 10: "38.4", 11: "38.5"}
    said = [f"G{motion.get(of('motion'), of('motion'))}",
            f"G{54 + of('system')}", f"G{17 + of('plane')}", "G20" if of("inches") else "G21",
            "G91" if of("relative") else "G90", "G93" if of("inverse") else "G94",
            f"M{spindle}", *coolant, f"T{words[49] // 10**6}", f"F{_decimal(feed, int(inches))}",
            f"S{_rounded(Fraction(words[48], 10**6))}"]
    return f"[GC:{' '.join(said)}]\r\n".encode()


def _rounded(value: Fraction) -> int:
    """Return a number rounded half away from zero."""
    return int(value + Fraction(1, 2)) if value >= 0 else -int(-value + Fraction(1, 2))


def _decimal(value: Fraction, decimals: int) -> str:
    whole, rest = divmod(abs(_rounded(value * 10**decimals)), 10**decimals)
    point = f".{rest:0{decimals}}" if decimals else ""
    return f"{'-' if _rounded(value * 10**decimals) < 0 else ''}{whole}{point}"


def _length(nanometres: int, inches: bool) -> str:
    if inches:
        return _decimal(Fraction(nanometres, 25_400_000), 4)
    return _decimal(Fraction(nanometres, 10**6), 3)
