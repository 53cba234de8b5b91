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

__all__ = ["ENGINES", "PERIOD", "Changes", "Engine", "EngineError", "UnknownLevelError",
           "build_with_fallback", "choose", "why_slow"]

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


def why_slow(name: str | None = None) -> str | None:
    """Return why `choose` gives the slow engine, in a line that says what to install.

    Parameters
    ----------
    name : str, optional
        The engine that was chosen by name, if one was.

    Returns
    -------
    str or None
        None if the engine was chosen by name, or the fast one runs here.
    """
    reason = CXXRTLEngine.missing() if name is None else None
    return reason and _going_on(reason)


def _going_on(reason: str) -> str:
    return (f"{reason}; going on with the slow engine, {AmaranthEngine.name}, "
            "which takes hundreds of times as long")


def build_with_fallback(name: str | None,
                        make: Callable[[type[Engine]], Made]) -> tuple[Made, str | None]:
    """Make something on the engine of that name, or on the fastest that works here.

    Parameters
    ----------
    name : str, optional
        The engine. Without it, the slow one serves where the fast one is there but fails.
    make : callable
        Makes it, given the class of the engine.

    Returns
    -------
    Made
        What was made.
    str or None
        How the fast engine failed, for people to read, if it did.

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
        note = _going_on(str(error))
    return make(AmaranthEngine), note
