"""Number of steps and step rates of an axis."""

from typing import Any

import numpy as np

from .decode import Axis
from .options import Query

__all__ = ["counted", "line"]


def counted(query: Query, axis: Axis, start: int, end: int) -> dict[str, Any]:
    """Count the steps of an axis from one time to another, both in ticks.

    Returns
    -------
    dict
        Its name as ``axis``, numbers of ``steps``, ``forward`` and ``back``, and its final
        ``position``. With two steps or more, also their maximum and mean rate in steps per second,
        and the least interval, as text, and in clocks if there is a clock.
    """
    inside = (axis.times >= start) & (axis.times <= end)
    times, signs = axis.times[inside], axis.signs[inside]
    facts: dict[str, Any] = {
        "axis": axis.name, "steps": len(times), "forward": int((signs > 0).sum()),
        "back": int((signs < 0).sum()),
        "position": int(axis.signs[axis.times <= end].sum()),
    }
    if len(times) > 1:
        apart = np.diff(times)
        facts["most_steps_per_second"] = 1 / float(int(apart.min()) * query.wave.tick)
        facts["mean_steps_per_second"] = (len(times) - 1) / float(
            int(times[-1] - times[0]) * query.wave.tick)
        facts["least_apart"] = query.timeline.text(int(apart.min()))
        if len(query.timeline.rises):
            facts["least_clocks"] = int(np.diff(query.timeline.clocks(times)).min())
    return facts


def line(fact: dict[str, Any]) -> str:
    """Format the counts of an axis as a line."""
    text = (f"{fact['axis']}: {fact['steps']} steps, {fact['forward']} forward, {fact['back']} "
            f"back, at {fact['position']}")
    if "least_apart" in fact:
        clocks = f" ({fact['least_clocks']}clk)" if "least_clocks" in fact else ""
        text += (f"; at least {fact['least_apart']}{clocks} apart, at most "
                 f"{fact['most_steps_per_second']:.6g} steps/s, "
                 f"mean {fact['mean_steps_per_second']:.6g}")
    return text
