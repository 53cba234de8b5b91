"""The machines that can be served: how each is built, and at which clock it runs here."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from tb.design import Design
from tb.engines import AmaranthEngine, Engine, EngineError, choose

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
    levels : mapping of str to int
        Its other inputs, where they are not 0.
    """

    about: str
    design: Callable[[int, int], Design]
    levels: Mapping[str, int] = field(default_factory=dict)


MACHINES: dict[str, Served] = {}


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
            kind = choose(name)
            try:
                return _make(served, kind)
            except EngineError as error:
                if name is not None or kind is AmaranthEngine:
                    raise
                warn(f"{error}; going on with the slow engine, amaranth")
                return _make(served, AmaranthEngine)
        except EngineError as error:
            raise UserError(str(error)) from error


def _make(served: Served, kind: type[Engine]) -> tuple[Engine, int]:
    bit = SLOW_BIT if kind is AmaranthEngine else BIT
    engine = kind(served.design(bit * BAUD, BAUD))
    engine.set(**served.levels)
    return engine, bit
