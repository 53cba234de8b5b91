"""Ends of many blocks at once: by how many steps each axis moves, without the instants of steps."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .gcode_blocks import Event, Motion, corrective
from .walk import Walked, half_turns

__all__ = ["moved"]

GROUP = 1000
"""Arcs of about as many half turns that are turned side by side."""


def moved(blocks: Sequence[Motion | Event]) -> NDArray[np.int64]:
    """Return the steps that the walk makes of motions, a row for each, a column for each axis.

    A line is a sum. Arcs are turned side by side, half turn by half turn, as the gateware rounds
    each of them; what crosses a step on the way is not looked at. Then come the corrective steps.
    """
    blocks = [block for block in blocks if isinstance(block, Motion)]
    made = np.zeros((len(blocks), 3), np.int64)
    arcs = [number for number, block in enumerate(blocks) if block.segment.arc]
    for number, block in enumerate(blocks):
        segment = block.segment
        by_channel = [start + increment >> 8 for start, increment in zip(
            segment.start, segment.increment, strict=True)]
        made[number] = [by_channel[channel] for channel in segment.channel]
    arcs.sort(key=lambda number: blocks[number].segment.turns)
    for place in range(0, len(arcs), GROUP):
        group = arcs[place:place + GROUP]
        plane = _arc_ends([blocks[number].segment for number in group], *(np.array(
            [getattr(blocks[number], name) for number in group]) for name in ("fine", "coarse")))
        for number, ends in zip(group, plane.tolist(), strict=True):
            for axis, channel in enumerate(blocks[number].segment.channel):
                if channel < 2:
                    made[number, axis] = ends[channel]
    wanted = np.array([block.steps for block in blocks], np.int64).reshape(-1, 3)
    return made + corrective(wanted, made)


def _arc_ends(arcs: Sequence[Walked], fine: NDArray, coarse: NDArray) -> NDArray[np.int64]:
    """Return for each arc the steps of the channels u and v, before corrective ones.

    The arcs are in the order of their half turns, the fewest first.
    """
    x, y, shift, clockwise, turns, start, residual = (np.array(values, np.int64) for values in zip(
        *((arc.x, arc.y, arc.shift, arc.clockwise, arc.turns, arc.start[0], arc.residual)
          for arc in arcs), strict=True))
    begin = np.stack([start, (32 - (x >> 30)) % 256]) << 36
    sums = begin.copy()
    for turn, (channel, distance) in enumerate(
            half_turns(x, y, shift, clockwise, int(turns[-1]))):
        ended = np.searchsorted(turns, turn, side="right")
        sums[channel, ended:] += distance[ended:]
    # Quarter steps of v are counted from that of the start, and go back in a mirrored arc.
    quarters = (sums[1] >> 42) - (begin[1] >> 42)
    quarters = np.where(clockwise, -quarters, quarters)
    return np.stack([sums[0] >> 44, (residual + quarters * coarse) // (4 * fine)], axis=1)
