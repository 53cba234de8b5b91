"""Jobs of steps that are computed, without a machine."""

from fractions import Fraction
from math import sqrt

import numpy as np

from fresa.machines.gcode import GCodeSettings
from tools.gcode.job import Job
from tools.gcode.path import Asked
from tools.gcode.simulation import Steps

__all__ = ["BEGIN", "CLOCK", "SETTINGS", "job", "moves"]

CLOCK = 2_500_000
SETTINGS = GCodeSettings(clock=CLOCK, steps_per_mm=(Fraction(80), Fraction(80), Fraction(400)),
                         max_rate=(Fraction(3000),) * 3)
BEGIN = 0.1


def moves(*each: tuple[int, float, float, float]) -> Steps:
    """Return the steps of moves of one axis each, that speed up and slow down evenly.

    Each is an axis, a length in mm, an acceleration in mm/s², and a rest after it in seconds.
    """
    rows, time = [], BEGIN
    for axis, length, acceleration, rest in each:
        per_mm = float(SETTINGS.steps_per_mm[axis])
        whole = 2 * sqrt(abs(length) / acceleration)
        for number in range(round(abs(length) * per_mm)):
            at = (number + 0.5) / per_mm
            half = at <= abs(length) / 2
            left = at if half else abs(length) - at
            moment = sqrt(2 * left / acceleration)
            rows.append((time + (moment if half else whole - moment), axis,
                         1 if length > 0 else -1))
        time += whole + rest
    change = np.zeros((len(rows), 3), np.int8)
    for row, (_, axis, way) in enumerate(rows):
        change[row, axis] = way
    return Steps(np.array([round(at * CLOCK) for at, *_ in rows], np.int64), change)


def job(steps: Steps, *lines: str, seconds: float = 3.0) -> Job:
    program = Asked()
    for line in lines:
        program.add(line)
    return Job(len(lines), program.segments, SETTINGS, steps, BEGIN, seconds, 0)
