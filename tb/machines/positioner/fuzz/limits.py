"""Limit reports of `positioner`, and its buzzer."""

from bisect import bisect_right
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tb.fuzz.trajectory import Failure

from .answers import STATE, Due

__all__ = ["check_buzzer", "check_limit_reports"]


BEFORE = 4
"""Answers that may come first: the one on the line, the next, and those of two other axes."""


def check_limit_reports(number: int, blocked: Sequence[int], perhaps: Sequence[int],
                        answers: Sequence[tuple[int, bytes]], due: Due, clocks: int,
                        *, state_waits: bool = False) -> list[Failure]:
    """Check the limit reports of a motor where switches have, or may have, ended its movements.

    Each end must be reported once, before the answers that wait. One report is of two ends where
    the motor was blocked again before it was sent. For `answers` and `due` see `Answers`. With
    `state_waits` a state may wait at the end, and all behind it.
    """
    failures, text = [], b"! LIMIT MOT%d\n" % number
    ends: dict[int, int] = {}  # by when each has been reported
    for at in sorted([*blocked, *perhaps]):
        clock, before = at, bisect_right(answers, (at, b"\xFF"))
        if before:
            clock = max(at, due.after(*answers[before - 1]))
        for begin, what in answers[before:before + BEFORE + 1]:
            if begin > due(clock, what):
                break
            clock = due.after(begin, what)
            if what == text:
                ends[at] = begin
                break
        last = due(due.after(due(clock, STATE), STATE)) if state_waits else due(clock)
        if at not in ends and at in blocked and last < clocks:
            failures.append(Failure(at, "answer", f"a switch ends a movement of motor {number}, "
                                    "which is not told"))
            break
    left = sorted(ends)
    for clock in (begin for begin, what in answers if what == text):
        reason = next((at for at in left if at < clock), None)
        if reason is None:
            failures.append(Failure(clock, "answer", "it says that a switch blocks motor "
                                    f"{number}, and none does, or again"))
            break
        left.remove(reason)
    return failures


def check_buzzer(buzzer: NDArray, blocked: Sequence[int], perhaps: Sequence[int],
                 period: int) -> list[Failure]:
    """Check that the buzzer sounds from each end to the second tick, one in `period` clocks.

    It must for `blocked`, and may for `perhaps`.
    """
    must, may = np.zeros((2, len(buzzer)), bool)
    for chosen, at in [(must, at) for at in blocked] + [(may, at) for at in (*blocked, *perhaps)]:
        chosen[at:((at + period) // period + 1) * period] = True
    wrong = np.flatnonzero((must & (buzzer == 0)) | (~may & (buzzer != 0)))
    return [Failure(int(at), "pins", f"the buzzer is {'on' if buzzer[at] else 'off'}")
            for at in wrong[:1]]
