"""`single`: one motor behind a serial line."""

from typing import Any

from fresa.machines.single import FINE, TOP_SPEED, Single, SingleTiming

from ...diagram import Diagram
from ...machine import Coverage, Machine

__all__ = ["MACHINE"]


def _model(*, timing: SingleTiming, ramp: int = 0, top_speed: int = TOP_SPEED, greeting: bytes,
           help_text: bytes):
    """Make a model, which counts rates in the unit of the ramp, if there is one."""
    from fresa.motion import ramp_rates

    from .model import SingleModel

    rate, modulus = timing.rate * (FINE if ramp else 1), timing.modulus * (FINE if ramp else 1)
    rates = ramp_rates(acceleration=ramp, top=top_speed * rate, modulus=modulus,
                       clock=timing.clock) if ramp else ()
    return SingleModel(bit=timing.bit, modulus=modulus, rate=rate, ramp=rates, greeting=greeting,
                       help_text=help_text)


def _directed(seed: int, clocks: int, **options: Any):
    from .stimulus import directed

    return directed(_model(**options), seed, clocks)


def _random(seed: int, block: int, rows: int, *, timing: SingleTiming, **options: Any):
    from .stimulus import random_rows

    return random_rows(timing.bit, seed, block, rows)


def _scenarios():
    from .scenarios import single

    return [single]


def _fuzz():
    from .fuzz import TARGET

    return TARGET


def _faults():
    from .faults import targets

    return targets()


MACHINE = Machine(
    name="single", order=1, about="one motor on a serial line", make=Single,
    short={"timing": SingleTiming.real(clock=48_000, baud=3000), "greeting": b"!\r\n",
           "help_text": b"?\r\n"},
    variants={"single-ramp": {
        "timing": SingleTiming.real(clock=240_000, baud=15_000, turn=5), "ramp": 150_000,
        "top_speed": 25_000}},
    model=_model, directed=_directed, random=_random,
    without=dict.fromkeys(("netlist", "netlist-icarus"),
                          "it takes block RAMs, of which Yosys has no model"),
    fuzz=_fuzz, faults=_faults,
    scenarios=_scenarios,
    diagrams=(Diagram(
        "single",
        "The end of the frame `:x5`. With its stop bit the set-point is 5, and the motor is on its "
        "way: the first step is made at once, the others 10 clocks apart, 5987 rpm at the 48 kHz "
        "of this bench, or 11 now and then. `tx` falls when the answer begins.",
        "line: rx tx outputs: moving coils position enable", 11940, 12040,
        radix=("position=dec",)),),
    coverage=Coverage(3_000_000, 98, 93))
