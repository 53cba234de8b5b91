"""The benches, a module a room."""

from ..bench import Bench
from . import (
    axis,
    board,
    control,
    drive,
    guard,
    mill,
    motion,
    orders,
    panel,
    positioner,
    positioner_parts,
    protocol,
    ramp,
    serial_line,
    serial_orders,
    single,
)

__all__ = ["BENCHES", "GROUPS"]

ROOMS = {
    "components": (drive, motion, control, guard, orders, serial_orders, panel, axis, ramp,
                   serial_line, protocol, positioner_parts),
    "machine": (mill, single, positioner),
    "board": (board,),
}

MACHINES = ("mill", "single", "positioner")

GROUPS = {
    group: [bench for room in rooms for bench in vars(room).values() if isinstance(bench, Bench)
            and (bench.name in MACHINES) == (group == "machine")]
    for group, rooms in ROOMS.items()
}
"""Benches, in the order in which they are best read."""

BENCHES = {bench.name: bench for group in GROUPS.values() for bench in group}
"""Benches by name."""
