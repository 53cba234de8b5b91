"""Step times at the pins, of many rates, while the line is as busy as it can be."""

import random
from collections.abc import Iterator
from dataclasses import dataclass
from math import ceil

import numpy as np

from ..engines import CXXRTLEngine, Engine
from ..uart import FRAME, high, levels
from .inputs import Input
from .session import run_session
from .target import FuzzTarget, Rates
from .trajectory import Failure

__all__ = ["Times", "measure", "spread"]

#: Steps of each motor that are looked at, if its rate is not very low; and at least.
STEPS, LEAST = 200, 4


@dataclass(frozen=True)
class Times:
    """What was measured with some rates, one a motor, all at once.

    Attributes
    ----------
    rates : tuple of int
        As the machine is told them.
    steps : int
        Steps that were looked at.
    deviation : float
        How many clocks one of them is later than another, each compared with its exact time: under
        1 if each comes in the first clock that is not too early.
    failures : list of Failure
        What else is wrong.
    """

    rates: tuple[int, ...]
    steps: int
    deviation: float
    failures: list[Failure]

    @property
    def beyond(self) -> int:
        """Clocks of jitter that are no rounding."""
        return max(0, ceil(self.deviation) - 1)


def spread(rates: Rates, count: int) -> list[int]:
    """Choose rates: the least and the most, primes, and others in between; or all there are."""
    if count >= rates.most:
        return list(range(1, rates.most + 1))
    primes = [n for n in (2, 3, 7, 31, 97, 997, 1499, 4999, 9973, 59_999) if n <= rates.most]
    chosen = {1, rates.most, rates.most - 1, *primes}
    more = np.geomspace(1, rates.most, max(2, count - len(chosen) + 2))
    return sorted(chosen | {round(rate) for rate in more})


def measure(target: FuzzTarget, chosen: list[int], seed: int, *, kind: type[Engine] = CXXRTLEngine
            ) -> Iterator[Times]:
    """Measure rates, as many at once as there are motors, and each on every motor.

    Raises
    ------
    ValueError
        If the machine has no rates.
    """
    if target.rates is None:
        raise ValueError(f"{target.name} has no rates to set")
    rates, design = target.rates, target.design()
    for first in range(0, len(chosen), rates.motors):
        # Motors that are left over go as fast as they can.
        own = chosen[first:first + rates.motors]
        own += [rates.most] * (rates.motors - len(own))
        for _ in range(rates.motors):
            sent = _busy(target, rates, own, random.Random(f"{seed} {own}"))
            with kind(design) as engine:
                findings = run_session(target, engine, sent).findings
            yield Times(tuple(own), findings.timed, findings.deviation, findings.failures)
            own = [*own[1:], own[0]]


def _busy(target: FuzzTarget, rates: Rates, own: list[int], rng: random.Random) -> list[Input]:
    """Set rates, begin to move, and then fill the line with what changes nothing."""
    period, protocol = target.period, target.protocol
    slowest = rates.modulus / min(own)
    clocks = max(round(LEAST * slowest), min(round(STEPS * slowest), 20_000), 5_000)
    begin = rates.begin(own)
    pause = high((begin.count(protocol.end) + 3) * protocol.answer * FRAME * period)
    noise = bytearray()
    while len(noise) * FRAME * period < clocks:
        noise += rng.choice(protocol.quiet)
        noise += bytes(byte for byte in rng.randbytes(rng.randrange(3)) if byte > 127)
    return [Input("rest", b"", high(4 * FRAME * period)),
            Input("bytes", begin, levels(begin, period)), Input("rest", b"", pause),
            Input("flood", bytes(noise), levels(bytes(noise), period))]
