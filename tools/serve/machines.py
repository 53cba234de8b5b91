# amaranth: UnusedElaboratable=no

"""The machines that can be served: how each is built, and at which clock it runs here."""

import argparse
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

from fresa.machines import MillStation, SerialOrders
from fresa.machines.mill import MillTiming
from fresa.machines.positioner import LIMIT_ENDS, TOP_SPEED, Positioner, PositionerTiming
from fresa.machines.single import TURN, Single, SingleTiming
from fresa.panel import debounce_period
from fresa.protocol import BAUD, bit_period
from tb.boards import board, component
from tb.design import Design
from tb.engines import AmaranthEngine, Engine, EngineError, build_with_fallback, why_slow
from tb.milling import AUTOMATIC

from ..console import FIRST_TIME, Progress, UserError, warn
from ..machines import positioner, single

__all__ = ["BAUD", "MACHINES", "Served", "build"]

#: Clocks of a bit: enough to see a step's place in it, and few enough for real time. On the slow
#: engine as few as a receiver can do with.
BIT = 64
SLOW_BIT = 16


@dataclass(frozen=True)
class Served:
    """A machine that can be served.

    Attributes
    ----------
    about : str
        What it is, for `--help`.
    design : callable
        Makes its design, with ``rx`` and ``tx``, for a clock in Hz and a number of baud, and with
        its options; raises `ValueError` if they cannot be.
    levels : mapping of str to int
        Its other inputs, where they are not 0.
    switches : tuple of str
        The ends of its axes that have a limit switch, such as ``X+``, by the bits of its input
        ``limits``.
    add_options : callable
        Adds the options that only it has to a parser.
    options : callable
        Reads them; raises `UserError` if they do not go together.
    """

    about: str
    design: Callable[..., Design]
    levels: Mapping[str, int] = field(default_factory=dict)
    switches: tuple[str, ...] = ()
    add_options: Callable[[argparse._ArgumentGroup], None] = lambda group: None
    options: Callable[[argparse.Namespace], dict[str, Any]] = lambda args: {}

    def chosen(self, args: argparse.Namespace) -> "Served":
        """Return it with the options that were parsed."""
        options = self.options(args)
        return replace(self, design=partial(self.design, **options),
                       switches=options.get("limit_ends", self.switches))


def _single(clock: int, baud: int, *, turn: int = TURN, **options: Any) -> Design:
    timing = SingleTiming.real(clock=clock, baud=baud, turn=turn)
    return component("single", Single(timing=timing, **options))


def _positioner(clock: int, baud: int, *, top_speed: int = TOP_SPEED, **options: Any) -> Design:
    timing = PositionerTiming.real(clock=clock, baud=baud, top_speed=top_speed)
    return component("positioner", Positioner(timing=timing, **options))


def _mill(clock: int, baud: int) -> Design:
    machine = MillStation(source=SerialOrders(period=bit_period(clock, baud)),
                          timing=MillTiming.real(clock=clock))
    return board("mill", machine, debounce=debounce_period(clock))


MACHINES = {
    "single": Served("one motor; commands such as  :x100  and Return", _single,
                     add_options=single.add_machine_options, options=single.machine_options),
    "positioner": Served("three axes; commands such as  CONNECT  and line feed", _positioner,
                         switches=LIMIT_ENDS, add_options=positioner.add_machine_options,
                         options=positioner.machine_options),
    "mill": Served("the mill, with SW7 on, for  python -m tools.send  (docs/serial-orders.md)",
                   _mill, {"switches": AUTOMATIC}),
}


def build(served: Served, name: str | None = None) -> tuple[Engine, int]:
    """Make a machine at power-up; give it and the clocks of a bit of its serial line.

    Parameters
    ----------
    served : Served
        The machine.
    name : str, optional
        The engine. None for the fastest that runs here: if it fails, the slow one serves.

    Raises
    ------
    UserError
        If the engine cannot run here, or the machine not with these options.
    """
    with Progress(1, "machines", f"building the machine{FIRST_TIME}"):
        try:
            made, note = build_with_fallback(name, lambda kind: _make(served, kind))
        except EngineError as error:
            raise UserError(str(error)) from error
        except ValueError as error:
            raise UserError(f"a machine with these options cannot be simulated: {error}") from error
    if note := note or why_slow(name):
        warn(note)
    if isinstance(made[0], AmaranthEngine):
        warn("a second of the machine will take half a minute or so")
    return made


def _make(served: Served, kind: type[Engine]) -> tuple[Engine, int]:
    bit = SLOW_BIT if kind is AmaranthEngine else BIT
    engine = kind(served.design(bit * BAUD, BAUD))
    engine.set(**served.levels)
    return engine, bit
