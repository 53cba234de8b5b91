"""The benches: of components and boards, a module each room; of machines, their scenarios."""

from collections.abc import Mapping, Sequence
from functools import cache

from ..bench import Bench
from ..machine import Machine
from ..machines import machines
from . import (
    arithmetic,
    axis,
    blocks,
    board,
    control,
    drive,
    gantry,
    gcode_control,
    gcode_gate,
    gcode_parts,
    guard,
    motion,
    order_ledger,
    orders,
    panel,
    plan,
    profile,
    protocol,
    ramp,
    serial_line,
    strings,
    targets,
    walk,
)

__all__ = ["benches", "groups"]

COMPONENTS = (drive, motion, control, guard, orders, order_ledger, panel, axis, gantry, targets,
              ramp, profile, plan, walk, strings, arithmetic, blocks, gcode_control, serial_line,
              protocol, gcode_gate, gcode_parts)


def groups() -> Mapping[str, Sequence[Bench]]:
    """Return the benches by group, in reading order."""
    return _groups(tuple(machines().values()))


def benches() -> dict[str, Bench]:
    """Return the benches by name, in that order."""
    return {bench.name: bench for group in groups().values() for bench in group}


@cache
def _groups(known: Sequence[Machine]) -> Mapping[str, Sequence[Bench]]:
    return {
        "components": [bench for room in COMPONENTS for bench in _of(room)],
        "machine": [bench for machine in known if machine.scenarios
                    for bench in machine.scenarios()],
        "board": list(_of(board))}


def _of(room) -> list[Bench]:
    return [bench for bench in vars(room).values() if isinstance(bench, Bench)]
