"""CXXRTL: the design as C++, compiled and loaded. A thousand times as fast as Amaranth's own.

Yosys writes the design as C++. See `build` for how it becomes a library.
"""

import ctypes

from ..design import Design
from . import build
from .compiled import CompiledEngine

__all__ = ["CXXRTLEngine"]


class CXXRTLEngine(CompiledEngine):
    """Runs a design compiled by CXXRTL. See `Engine`.

    Waveforms hold every signal with its path, but not the rows of memories nor the names of states.
    """

    name = "cxxrtl"

    @classmethod
    def missing(cls) -> str | None:
        return build.missing()

    @classmethod
    def _library(cls, design: Design, *, debug: bool) -> ctypes.CDLL:
        return build.library(design, debug=debug)
