"""Engines: what runs a design. All are used alike, see `Engine`."""

from collections.abc import Callable
from typing import TypeVar

from .base import PERIOD, Changes, Engine, EngineError
from .cxxrtl import CXXRTLEngine
from .ghdl import GHDLEngine
from .icarus import IcarusEngine
from .netlist import NetlistEngine, NetlistIcarusEngine
from .piped import UnknownLevelError
from .pysim import AmaranthEngine
from .verilator import VerilatorEngine

__all__ = ["ENGINES", "PERIOD", "Changes", "Engine", "EngineError", "UnknownLevelError", "choose",
           "made_on"]

Made = TypeVar("Made")

ENGINES: dict[str, type[Engine]] = {
    engine.name: engine
    for engine in (CXXRTLEngine, AmaranthEngine, VerilatorEngine, IcarusEngine, NetlistEngine,
                   NetlistIcarusEngine, GHDLEngine)
}


def choose(name: str | None = None) -> type[Engine]:
    """Give the engine of that name, or the fastest that runs here.

    Raises
    ------
    EngineError
        If there is no such engine or it cannot run here.
    """
    if name is None:
        return AmaranthEngine if CXXRTLEngine.missing() else CXXRTLEngine
    if name not in ENGINES:
        raise EngineError(f"No engine is named {name!r}; there are {', '.join(sorted(ENGINES))}")
    if reason := ENGINES[name].missing():
        raise EngineError(reason)
    return ENGINES[name]


def build_with_fallback(name: str | None, make: Callable[[type[Engine]], Made]) -> tuple[Made,
                                                                                         str
                                                                                         | None]:
    """Make something on the engine of that name, or on the fastest that works here.

    Parameters
    ----------
    name : str, optional
        The engine. Without it, the slow one serves where the fast one is there but fails.
    make : callable
        Makes it on an engine, of which it is given the class.

    Returns
    -------
    Made
        What was made.
    str or None
        Why the slow engine serves, for people to read, if it does for a failure.

    Raises
    ------
    EngineError
        As of `choose`, or if it cannot be made.
    """
    engine = choose(name)
    try:
        return make(engine), None
    except EngineError as error:
        if name is not None or engine is AmaranthEngine:
            raise
        note = f"{error}; going on with the slow engine, {AmaranthEngine.name}"
    return make(AmaranthEngine), note
