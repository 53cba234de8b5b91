"""Steps decoded: from coil words, or from STEP and DIR."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tb.plant import Motor

from ..console import UserError
from .options import Query
from .reader import Signal

__all__ = ["Axis", "from_coils", "from_pulses"]

UNKNOWN = 1 << 20
"""Code of an unknown coil word."""


@dataclass(frozen=True)
class Axis:
    """Steps of a motor.

    Attributes
    ----------
    name : str
        The signal.
    times, signs : array of int64
        Times of its steps, in ticks, and their directions: 1 or -1.
    faults : list of tuple of int and str
        Times, in ticks, of inputs that it cannot follow, and a description.
    """

    name: str
    times: NDArray[np.int64]
    signs: NDArray[np.int64]
    faults: list[tuple[int, str]]


def from_coils(query: Query, signal: Signal) -> Axis:
    """Decode a signal whose values are coil words.

    Raises
    ------
    UserError
        If its values are not words of four bits.
    """
    if signal.kind != "bits" or signal.bits != 4:
        raise UserError(f"{signal.path} has {signal.bits} bits: a coil word has 4")
    trace = query.wave.trace(signal)
    if not len(trace):
        return Axis(signal.path, trace.times, trace.times, [])
    words = np.where(trace.unknown, UNKNOWN, trace.numbers.astype(np.int64))
    rows, signs, illegal, jumps = Motor().feed(trace.times, words)

    def word(row: int) -> str:
        return query.radixes.text(signal, trace.value(row))

    faults = [(int(trace.times[row]), f"{word(row)} is not a coil word") for row in illegal]
    faults += [(int(trace.times[row]), f"a jump to {word(row)}, two words on")
               for row in jumps]
    return Axis(signal.path, trace.times[rows], signs, sorted(faults))


def from_pulses(query: Query, step: Signal, direction: Signal) -> list[Axis]:
    """Decode pulses and directions; words of several bits are an axis each, the lowest first.

    Raises
    ------
    UserError
        If their widths differ.
    """
    if step.bits != direction.bits or not 0 < step.bits <= 64:
        raise UserError(f"{step.path} has {step.bits} bits and {direction.path} "
                        f"{direction.bits}: they cannot be STEP and DIR")
    pulses, signs = query.wave.trace(step), query.wave.trace(direction)
    axes = []
    for bit in range(step.bits):
        level = np.where(pulses.codes >= 0, -1, pulses.numbers.astype(np.uint64) >> np.uint64(bit)
                         & np.uint64(1)).astype(np.int64)
        times = pulses.times[1:][(level[:-1] == 0) & (level[1:] == 1)]
        # An unknown direction is -1, and counts as forward.
        sign = np.where(signs.codes >= 0, -1, signs.numbers.astype(np.uint64) >> np.uint64(bit)
                       & np.uint64(1)).astype(np.int64)
        sign = np.append(sign, -1)
        now, before = sign[signs.rows(times)], sign[signs.rows(times - 1)]
        name = step.path if step.bits == 1 else f"{step.path}[{bit}]"
        faults = [(int(time), "a step while the direction is unknown") for time in times[now < 0]]
        faults += [(int(time), "the direction changes with the step")
                   for time in times[(now >= 0) & (before >= 0) & (now != before)]]
        axes.append(Axis(name, times, np.where(now == 0, -1, 1), sorted(faults)))
    return axes
