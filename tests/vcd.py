"""Waveforms of engines and benches, read."""

import re
from pathlib import Path

__all__ = ["read_changes", "read_types"]

NANOSECONDS = {"s": 10**9, "ms": 10**6, "us": 1000, "ns": 1, "ps": 1e-3, "fs": 1e-6}
"""Nanoseconds of a unit of time."""


def read_types(vcd: Path) -> dict[str, str]:
    """Return the types of the variables of a VCD by the names that GTKWave gives them."""
    scope, found = [], {}
    for line in vcd.read_text().partition("$enddefinitions")[0].splitlines():
        if new := re.fullmatch(r"\$scope \w+ (\S+) \$end", line):
            scope.append(new[1])
        elif line == "$upscope $end":
            scope.pop()
        elif var := re.fullmatch(r"\$var (\w+) (\d+) \S+ (\S+) \$end", line):
            span = f"[{int(var[2]) - 1}:0]" if var[2] != "1" else ""
            found[".".join((*scope, var[3])) + span] = var[1]
    return found


def read_changes(vcd: Path) -> dict[str, list[tuple[int, str]]]:
    """Return the changes of each variable of a VCD by its name without scopes.

    A change is the time in ns and the value: binary without leading zeros, or a text.
    """
    head, body = vcd.read_text().split("$enddefinitions $end")
    scale = re.search(r"\$timescale\s+(\d+)\s?(\w+)", head)
    assert scale
    unit = int(scale[1]) * NANOSECONDS[scale[2]]
    names: dict[str, set[str]] = {}
    for code, name in re.findall(r"\$var \w+ +\d+ (\S+) (\S+?)(?:\[\d+:\d+\])? ", head):
        names.setdefault(code, set()).add(name)
    read: dict[str, list[tuple[int, str]]] = {}
    time = 0
    for line in body.splitlines():
        if line.startswith("#"):
            time = round(int(line[1:]) * unit)
        elif match := re.fullmatch(r"(?:[bs](\S+) |([01]))(\S+)", line):
            value = (match[1] or match[2]).lstrip("0")
            for name in names[match[3]]:
                changes = read.setdefault(name, [])
                if not changes or changes[-1][1] != value:
                    changes.append((time, value))
    return read
