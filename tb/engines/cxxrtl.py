"""The engine CXXRTL: the design as C++, compiled. A thousand times as fast as Amaranth's own.

Yosys writes the C++; see `build` for how it becomes a library.
"""

import ctypes

from ..design import Design
from . import build
from .base import CUT_SHORT, EngineError
from .compiled import CompiledEngine

__all__ = ["CXXRTLEngine"]


class CXXRTLEngine(CompiledEngine):
    """Runs a design compiled by CXXRTL. See `Engine`.

    Waveforms have every signal with its path, but neither rows of memories nor names of states.
    """

    name = "cxxrtl"
    can_trace = True

    @classmethod
    def missing(cls) -> str | None:
        return build.missing()

    @classmethod
    def _library(cls, design: Design, *, debug: bool, stretches: bool) -> ctypes.CDLL:
        return build.library(design, debug=debug, stretches=stretches)

    def _trace(self, path: str | None) -> None:
        trace = self._lib.fresa_trace
        trace.restype, trace.argtypes = ctypes.c_bool, [ctypes.c_void_p, ctypes.c_char_p]
        if not trace(self._handle, None if path is None else path.encode()):
            raise EngineError(CUT_SHORT if path is None else f"Waveform {path} cannot be written")

    def _close(self) -> None:
        try:
            if self.tracing or self.vcd is not None:
                self._trace(None)
        finally:
            super()._close()
