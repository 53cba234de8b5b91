"""Engines, which run designs; all have the interface of `Engine`."""

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

T = TypeVar("T")

ENGINES: dict[str, type[Engine]] = {
    engine.name: engine
    for engine in (CXXRTLEngine, AmaranthEngine, VerilatorEngine, IcarusEngine, NetlistEngine,
                   NetlistIcarusEngine, GHDLEngine)
}


def choose(name: str | None = None) -> type[Engine]:
    """Return an engine by name, or the fastest available.

    Raises
    ------
    EngineError
        If there is no such engine, or it is not available.
    """
    if name is None:
        return AmaranthEngine if CXXRTLEngine.missing() else CXXRTLEngine
    if name not in ENGINES:
        raise EngineError(f"No engine is named {name!r}; there are {', '.join(sorted(ENGINES))}")
    if reason := ENGINES[name].missing():
        raise EngineError(reason)
    return ENGINES[name]


def why_slow(name: str | None = None) -> str | None:
    """Return why `choose` returns the slow engine, in a line that names what to install.

    Parameters
    ----------
    name : str, optional
        The name that was chosen, if any.

    Returns
    -------
    str or None
        None if an engine was chosen by name, or the fast one is available.
    """
    reason = CXXRTLEngine.missing() if name is None else None
    return reason and _slow_note(reason)


def _slow_note(reason: str) -> str:
    return (f"{reason}; using the slow engine, {AmaranthEngine.name}, "
            "which takes hundreds of times as long")


def build_with_fallback(name: str | None,
                        make: Callable[[type[Engine]], T]) -> tuple[T, str | None]:
    """Build something on an engine by name, or on the fastest that works.

    Parameters
    ----------
    name : str, optional
        The engine. Without it, the slow one is used if the fast one fails.
    make : callable
        Builds it, given the class of the engine.

    Returns
    -------
    Made
        What `make` returned.
    str or None
        Why the fast engine failed, as a message, if it did.

    Raises
    ------
    EngineError
        As of `choose`, or if nothing can be built.
    """
    engine = choose(name)
    try:
        return make(engine), None
    except EngineError as error:
        if name is not None or engine is AmaranthEngine:
            raise
        note = _slow_note(str(error))
    return make(AmaranthEngine), note
