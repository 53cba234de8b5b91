"""Engines: what runs a design. All are used alike, see `Engine`."""

from .base import PERIOD, Changes, Engine, EngineError
from .cxxrtl import CXXRTLEngine
from .ghdl import GHDLEngine
from .icarus import IcarusEngine
from .netlist import NetlistEngine, NetlistIcarusEngine
from .piped import UnknownLevelError
from .pysim import AmaranthEngine
from .verilator import VerilatorEngine

__all__ = ["ENGINES", "PERIOD", "Changes", "Engine", "EngineError", "UnknownLevelError", "choose"]

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
