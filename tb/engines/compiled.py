"""Base of engines whose design is a C++ library, called by ctypes.

The loops over clocks are in C++ (``loops.h``), so that Python is called once per run.
"""

import ctypes
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from os import PathLike, fspath

import numpy as np
from numpy.typing import NDArray

from ..design import Design
from .base import Engine, EngineError, Rows

__all__ = ["CompiledEngine"]

#: Most rows and clocks of one call, to bound memory and to notice Ctrl-C.
ROWS = 1 << 16
CLOCKS = 1 << 20


class CompiledEngine(Engine):
    """Runs a compiled design. See `Engine`."""

    def __init__(self, design: Design, *, vcd: str | PathLike[str] | None = None,
                 traceable: bool = False, stretches: bool = False) -> None:
        super().__init__(design, vcd=vcd, traceable=traceable, stretches=stretches)
        self._handle = None
        self._pins = {name: n for n, name in enumerate(design.inputs)}
        self._pads = {name: n for n, name in enumerate(design.outputs)}
        self._lib = _declare(self._library(design, debug=traceable or vcd is not None,
                                           stretches=stretches))
        self._handle = self._lib.fresa_new(fspath(vcd).encode() if vcd is not None else None)
        if not self._handle:
            raise EngineError(f"Waveform {vcd} cannot be written")

    @classmethod
    @abstractmethod
    def _library(cls, design: Design, *, debug: bool, stretches: bool) -> ctypes.CDLL:
        """Load the library of a design, built if necessary; with `debug` it supports waveforms."""

    def _close(self) -> None:
        if self._handle:
            self._lib.fresa_delete(self._handle)
            self._handle = None

    def __del__(self) -> None:
        if getattr(self, "_handle", None):
            self.close()

    def _set(self, values: Mapping[str, int]) -> None:
        for name, value in values.items():
            self._lib.fresa_set(self._handle, self._pins[name], value)

    def _get(self, names: Sequence[str]) -> tuple[int, ...]:
        return tuple(self._lib.fresa_get(self._handle, self._pads[name]) for name in names)

    def _run(
        self, clocks: int, watch: Sequence[str], last: Sequence[int], until: Mapping[str, int],
        once: bool,
    ) -> Rows:
        watched = np.array([self._pads[name] for name in watch], np.int32)
        present = np.array(last, np.uint64)
        stops = np.array([self._pads[name] for name in until], np.int32)
        values = np.array(list(until.values()), np.uint64)
        capacity = 1 if once else min(ROWS, clocks)
        clock = np.empty(capacity, np.int64)
        rows = np.empty((len(watch), capacity), np.uint64)
        used, met = ctypes.c_int64(), ctypes.c_int32()
        parts = [(clock[:0], rows[:, :0])]
        made = 0
        while made < clocks and not met.value:
            now = self._lib.fresa_run(
                self._handle,
                min(clocks - made, CLOCKS),
                watched,
                len(watched),
                present,
                stops,
                values,
                len(stops),
                clock,
                rows,
                capacity,
                used,
                met,
            )
            parts.append((made + clock[: used.value], rows[:, : used.value].copy()))
            made += now
            if once and used.value:
                break
        return Rows(
            made,
            np.concatenate([part for part, _ in parts]),
            np.concatenate([part for _, part in parts], axis=1),
        )

    def _play(
        self, stimulus: Mapping[str, NDArray[np.uint64]], rows: int, outputs: Sequence[str]
    ) -> NDArray[np.uint64]:
        inputs = np.array([self._pins[name] for name in stimulus], np.int32)
        table = np.array(list(stimulus.values()), np.uint64).reshape(len(inputs), rows)
        pads = np.array([self._pads[name] for name in outputs], np.int32)
        samples = np.empty((len(pads), rows), np.uint64)
        for start in range(0, rows, CLOCKS):
            self._lib.fresa_play(
                self._handle,
                rows,
                inputs,
                len(inputs),
                table,
                pads,
                len(pads),
                samples,
                start,
                min(rows, start + CLOCKS),
            )
        return samples


def _declare(lib: ctypes.CDLL) -> ctypes.CDLL:
    def array(kind):
        return np.ctypeslib.ndpointer(kind, flags="C_CONTIGUOUS")

    i32, i64, u64, ref = ctypes.c_int32, ctypes.c_int64, ctypes.c_uint64, ctypes.POINTER
    handle = ctypes.c_void_p
    ports, bits, clock = array(np.int32), array(np.uint64), array(np.int64)
    lib.fresa_new.restype = handle
    lib.fresa_new.argtypes = [ctypes.c_char_p]
    lib.fresa_delete.restype = None
    lib.fresa_delete.argtypes = [handle]
    lib.fresa_set.restype = None
    lib.fresa_set.argtypes = [handle, i32, u64]
    lib.fresa_get.restype = u64
    lib.fresa_get.argtypes = [handle, i32]
    lib.fresa_run.restype = i64
    lib.fresa_run.argtypes = [
        handle,
        i64,
        ports,
        i32,
        bits,
        ports,
        bits,
        i32,
        clock,
        bits,
        i64,
        ref(i64),
        ref(i32),
    ]
    lib.fresa_play.restype = None
    lib.fresa_play.argtypes = [handle, i64, ports, i32, bits, ports, i32, bits, i64, i64]
    return lib
