# amaranth: UnusedElaboratable=no

"""The machines that can be served: how each is built, and at which clock it runs here."""

from collections.abc import Callable
from dataclasses import dataclass

from fresa.machines.positioner import Positioner, PositionerPace
from fresa.machines.single import Single, SinglePace
from tb.boards import component
from tb.design import Design
from tb.engines import AmaranthEngine, Engine, EngineError, made_on

from ..console import FIRST_TIME, Progress, UserError, warn

__all__ = ["BAUD", "MACHINES", "Served", "build"]

#: Bits a second of every machine's serial line.
BAUD = 9600

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
        Makes its design, with ``rx`` and ``tx``, for a clock in Hz and a number of baud.
    """

    about: str
    design: Callable[[int, int], Design]


def _single(clock: int, baud: int) -> Design:
    return component("single", Single(pace=SinglePace.real(clock=clock, baud=baud)))


def _positioner(clock: int, baud: int) -> Design:
    return component("positioner", Positioner(pace=PositionerPace.real(clock=clock, baud=baud)))


MACHINES = {
    "single": Served("one motor; commands such as  :x100  and Return", _single),
    "positioner": Served("three axes; commands such as  CONNECT  and line feed", _positioner),
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
        If the engine cannot run here.
    """
    with Progress(1, "machines", f"building the machine{FIRST_TIME}"):
        try:
            made, note = made_on(name, lambda kind: _make(served, kind))
        except EngineError as error:
            raise UserError(str(error)) from error
    if note:
        warn(note)
    if isinstance(made[0], AmaranthEngine):
        warn("a second of the machine will take half a minute or so; with a C++ compiler "
             "(g++ or clang++) it takes a second")
    return made


def _make(served: Served, kind: type[Engine]) -> tuple[Engine, int]:
    bit = SLOW_BIT if kind is AmaranthEngine else BIT
    return kind(served.design(bit * BAUD, BAUD)), bit
