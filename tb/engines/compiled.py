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


class _Buffers:
    """What a run is given and gives back, kept for further runs: short ones are many.

    Attributes
    ----------
    last : array
        Levels of the watched outputs before the run.
    values : array
        Levels at which outputs stop it.
    clock, rows : array
        Clocks of differing rows, and these: a row per output.
    used, met
        The number of these; whether an output has stopped the run.
    arguments : tuple
        All of it, as the library takes it.
    """

    def __init__(self, watch: Sequence[int], until: Sequence[int], capacity: int) -> None:
        watched, stops = np.array(watch, np.int32), np.array(until, np.int32)
        self.last, self.values = np.empty(len(watch), np.uint64), np.empty(len(until), np.uint64)
        self.clock = np.empty(capacity, np.int64)
        self.rows = np.empty((len(watch), capacity), np.uint64)
        self.used, self.met = ctypes.c_int64(), ctypes.c_int32()
        self._ports = watched, stops
        self.arguments = (
            watched.ctypes.data, len(watch), self.last.ctypes.data, stops.ctypes.data,
            self.values.ctypes.data, len(until), self.clock.ctypes.data, self.rows.ctypes.data,
            capacity, self.used, self.met)


class CompiledEngine(Engine):
    """Runs a compiled design. See `Engine`."""

    def __init__(self, design: Design, *, vcd: str | PathLike[str] | None = None,
                 traceable: bool = False, stretches: bool = False) -> None:
        super().__init__(design, vcd=vcd, traceable=traceable, stretches=stretches)
        self._handle = None
        self._buffers: dict[tuple[Sequence[str], tuple[str, ...], bool], _Buffers] = {}
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
        key = watch, tuple(until), once
        buffers = self._buffers.get(key)
        if buffers is None:
            buffers = self._buffers[key] = _Buffers([self._pads[name] for name in watch],
                                                    [self._pads[name] for name in until],
                                                    1 if once else ROWS)
        if watch:
            buffers.last[:] = last
        if until:
            buffers.values[:] = list(until.values())
        clock, rows, used, met = buffers.clock, buffers.rows, buffers.used, buffers.met
        parts = []
        made, met.value = 0, 0
        while made < clocks and not met.value:
            now = self._lib.fresa_run(self._handle, min(clocks - made, CLOCKS), *buffers.arguments)
            if used.value or not parts:
                parts.append((made + clock[:used.value], rows[:, :used.value].copy()))
            made += now
            if once and used.value:
                break
        if len(parts) == 1:
            return Rows(made, *parts[0])
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
    ports, bits = array(np.int32), array(np.uint64)
    lib.fresa_new.restype = handle
    lib.fresa_new.argtypes = [ctypes.c_char_p]
    lib.fresa_delete.restype = None
    lib.fresa_delete.argtypes = [handle]
    lib.fresa_set.restype = None
    lib.fresa_set.argtypes = [handle, i32, u64]
    lib.fresa_get.restype = u64
    lib.fresa_get.argtypes = [handle, i32]
    lib.fresa_run.restype = i64
    pointer = ctypes.c_void_p  # checked nowhere, for speed: `_Buffers` makes them
    lib.fresa_run.argtypes = [handle, i64, pointer, i32, pointer, pointer, pointer, i32, pointer,
                              pointer, i64, ref(i64), ref(i32)]
    lib.fresa_play.restype = None
    lib.fresa_play.argtypes = [handle, i64, ports, i32, bits, ports, i32, bits, i64, i64]
    return lib
