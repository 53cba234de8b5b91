"""The interface of engines: inputs by name, clocks in runs, outputs by name."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from os import PathLike, fspath
from typing import ClassVar, NamedTuple, Self, overload

import numpy as np
from amaranth import Signal, Value
from numpy.typing import ArrayLike, NDArray

from fresa_boards.programs import ProgramError

from ..design import Design

__all__ = ["CUT_SHORT", "PERIOD", "Changes", "Engine", "EngineError", "Rows"]

#: Message for a waveform that could not be written to its end.
CUT_SHORT = "The waveform is cut short: its disk is full, or it is gone"

#: Nanoseconds per clock in a waveform: the 50 MHz of the boards.
PERIOD = 20


class EngineError(ProgramError):
    """An engine cannot run here, or cannot run this design; the message says what to do."""


@dataclass(frozen=True)
class Changes:
    """Changes of watched outputs.

    Attributes
    ----------
    clock : array of int64
        Clocks since power-up, counted after the edge. Ascending, each at most once.
    values : mapping of str to array
        The level of each watched output from then on, one row per element of `clock`.
        ``int64``, or ``uint64`` for an output of 64 bits.
    """

    clock: NDArray[np.int64]
    values: Mapping[str, NDArray]

    def __getitem__(self, name: str) -> NDArray:
        return self.values[name]

    def __len__(self) -> int:
        return len(self.clock)


class Rows(NamedTuple):
    """Clocks made, clocks of differing rows (from the start of the run), and rows per output."""

    clocks: int
    clock: NDArray[np.int64]
    values: NDArray[np.uint64]


class Engine(ABC):
    """A running design.

    It starts with every input at 0, at clock 0, before any edge. Outputs are sampled between edges,
    with the clock low and everything settled. Ports are bit vectors: a signed one is read and set
    as the unsigned number with the same bits.

    Parameters
    ----------
    design : Design
        The design.
    vcd : path, optional
        Path of a waveform of the whole run. It is complete once the engine is closed.
    traceable : bool
        Whether `trace` can be used. Not every engine supports it.
    stretches : bool
        Whether to make stretches of clocks at once where it is proved that all registers only go on
        counting, if the engine can. What shows is the same. It takes longer to build, and pays
        where the design waits for hundreds of clocks with its inputs unchanged.

    Attributes
    ----------
    name : str
        Name of the engine, as commands take it.
    clock : int
        Clocks so far.

    Raises
    ------
    ValueError
        If a port is not 1 to 64 bits wide, or two ports have the same name.
    EngineError
        If the engine is not available, cannot run this design, or cannot trace.
    """

    name: ClassVar[str]
    can_trace: ClassVar[bool] = False

    def __init__(self, design: Design, *, vcd: str | PathLike[str] | None = None,
                 traceable: bool = False, stretches: bool = False) -> None:
        if traceable and not self.can_trace:
            able = "engines that can are cxxrtl and amaranth"
            raise EngineError(f"Engine {self.name} cannot record a part of a run; {able}")
        if traceable and vcd is not None:
            raise ValueError("A waveform is of the whole run or of parts of it, not both")
        names = ["clk", *design.inputs, *design.outputs]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"Design {design.name} has two ports named {name!r}")
        self.design = design
        self.vcd = vcd
        self.traceable = traceable
        self.stretches = stretches
        self.tracing = False
        self.clock = 0
        self._inputs = {name: _width(name, port) for name, port in design.inputs.items()}
        self._outputs = {name: _width(name, port) for name, port in design.outputs.items()}
        self._watch: tuple[str, ...] = ()
        self._last: tuple[int, ...] | None = None
        self._watched_to = 0
        self._closed = False

    @classmethod
    @abstractmethod
    def missing(cls) -> str | None:
        """Return one line on what to install before this engine is available; None if it is."""

    @abstractmethod
    def _set(self, values: Mapping[str, int]) -> None:
        """Apply validated inputs."""

    @abstractmethod
    def _get(self, names: Sequence[str]) -> tuple[int, ...]:
        """Settle, then read outputs."""

    @abstractmethod
    def _run(
        self, clocks: int, watch: Sequence[str], last: Sequence[int], until: Mapping[str, int],
        once: bool,
    ) -> Rows:
        """Run one clock or more; return the rows that differ from `last` and from each other.

        With `once` stop after the first such row.
        """

    @abstractmethod
    def _play(
        self, stimulus: Mapping[str, NDArray[np.uint64]], rows: int, outputs: Sequence[str]
    ) -> NDArray[np.uint64]:
        """Apply, settle, sample and clock each row; return one row per output."""

    def _trace(self, path: str | None) -> None:
        """Begin a waveform, or finish the present one; for engines that can."""
        raise NotImplementedError

    @abstractmethod
    def _close(self) -> None:
        """Release the design and finish the waveform."""

    def close(self) -> None:
        """Release the design and finish the waveform. A second call does nothing.

        Raises
        ------
        EngineError
            If the waveform could not be written to its end. The design is released all the same.
        """
        if not self._closed:
            self._closed = True
            self._close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_) -> None:
        self.close()

    def set(self, **inputs: int) -> None:
        """Set inputs, which keep their levels until they are set again.

        Raises
        ------
        ValueError
            If there is no such input or a value is out of range. Then nothing is set.
        """
        self._open()
        for name, value in inputs.items():
            width = self._known(name, self._inputs, "input")
            if not 0 <= value < 1 << width:
                raise ValueError(_out_of_range(name, width, value))
        self._set({name: int(value) for name, value in inputs.items()})

    @overload
    def get(self, name: str, /) -> int: ...

    @overload
    def get(self, name: str, other: str, /, *names: str) -> tuple[int, ...]: ...

    @overload
    def get(self) -> tuple[()]: ...

    def get(self, *names: str) -> int | tuple[int, ...]:
        """Return the present outputs: one as a number, several as a tuple."""
        self._open()
        for name in names:
            self._known(name, self._outputs, "output")
        values = self._get(names)
        return values[0] if len(names) == 1 else values

    def trace(self, path: str | PathLike[str] | None) -> None:
        """Start a waveform, or with None stop it.

        It has the present levels of the signals and all later changes, at times counted from
        power-up, `PERIOD` per clock. It is complete once it is stopped or the engine is closed. A
        waveform that is being written is finished first.

        Raises
        ------
        EngineError
            If the engine was not made ``traceable``, or the file cannot be written, or the one
            before could not be written to its end. Then it continues without a waveform.
        """
        self._open()
        if not self.traceable:
            raise EngineError("The engine is not traceable; make it so")
        if self.tracing:
            self.tracing = False
            self._trace(None)
        if path is not None:
            self._trace(fspath(path))
            self.tracing = True

    def run(
        self, clocks: int, watch: Sequence[str] = (), *, until: Mapping[str, int] | None = None,
        once: bool = False,
    ) -> Changes:
        """Make `clocks` rising edges with the inputs unchanged.

        The first run that watches an output starts with a row of the present levels. A run that
        watches the same outputs as the one before continues its rows, so that joined rows are those
        of one long run. Only if other calls made clocks in between and the outputs have changed, it
        starts with a row of the present levels again. An output that an input changes without an
        edge is seen after the next edge.

        Parameters
        ----------
        clocks : int
            Number of edges.
        watch : sequence of str
            Outputs to watch.
        until : mapping of str to int
            Stop after the first edge with any of these outputs at its value.
        once : bool
            Stop after the first edge that changes a watched output.
        """
        self._open()
        watch, until = tuple(watch), until or {}
        for name in watch:
            self._known(name, self._outputs, "output")
        for name, value in until.items():
            width = self._known(name, self._outputs, "output")
            if not 0 <= value < 1 << width:
                raise ValueError(_out_of_range(name, width, value))
        if clocks < 0:
            raise ValueError(f"Number of clocks must not be negative, not {clocks!r}")
        start, first, last = self.clock, False, self._last
        if watch and (last is None or watch != self._watch or self._watched_to != start):
            present = self._get(watch)
            first = watch != self._watch or present != last
            last = present
        rows = Rows(0, np.empty(0, np.int64), np.empty((len(watch), 0), np.uint64))
        if clocks > 0:
            with self._or_closed():
                rows = self._run(clocks, watch, last if watch and last else (), until, once)
            self.clock += rows.clocks
        clock, values = start + rows.clock, rows.values
        if first:
            clock = np.concatenate([np.array([start], np.int64), clock])
            values = np.concatenate([np.array(last, np.uint64)[:, None], values], axis=1)
        if watch:
            self._watch, self._watched_to = watch, self.clock
            self._last = tuple(int(v) for v in values[:, -1]) if len(clock) else last
        return Changes(clock, self._named(watch, values))

    def apply(self, stimulus: Mapping[str, ArrayLike], outputs: Sequence[str]) -> dict[str,
                                                                                       NDArray]:
        """Apply a stimulus, one row per clock, and return the outputs of every clock.

        For each row: apply the inputs, settle, sample the outputs, then make one rising edge. Other
        inputs keep their levels, and those of the stimulus keep their last row.

        Raises
        ------
        ValueError
            If a name is unknown, a value is out of range, or numbers of rows differ. Then nothing
            has run.
        """
        self._open()
        ready: dict[str, NDArray[np.uint64]] = {}
        rows: int | None = None
        for name, given in stimulus.items():
            width = self._known(name, self._inputs, "input")
            values = np.asarray(given)
            if values.ndim != 1 or (len(values) and values.dtype.kind not in "biu"):
                raise ValueError(f"Stimulus of {name} must be one row of integers")
            rows = len(values) if rows is None else rows
            if len(values) != rows:
                raise ValueError(f"Stimulus of {name} has {len(values)} rows, not {rows}")
            bits = values.astype(np.uint64, copy=False)
            if len(values) and (values.min() < 0 or int(bits.max()) >> width):
                wrong = (values < 0) | (bits > np.uint64((1 << width) - 1))
                raise ValueError(_out_of_range(name, width, int(values[wrong.argmax()])))
            ready[name] = np.ascontiguousarray(bits)
        for name in outputs:
            self._known(name, self._outputs, "output")
        with self._or_closed():
            values = self._play(ready, rows or 0, outputs)
        self.clock += rows or 0
        return self._named(outputs, values)

    def _named(self, names: Sequence[str], values: NDArray[np.uint64]) -> dict[str, NDArray]:
        return {
            name: row if self._outputs[name] == 64 else row.view(np.int64)
            for name, row in zip(names, values, strict=True)
        }

    @contextmanager
    def _or_closed(self) -> Iterator[None]:
        """After an interrupted run, by Ctrl-C for example, the number of clocks is unknown."""
        try:
            yield
        except BaseException:
            self.close()
            raise

    def _open(self) -> None:
        if self._closed:
            raise EngineError("The engine is closed; make a new one")

    def _known(self, name: str, ports: Mapping[str, int], kind: str) -> int:
        if name not in ports:
            raise ValueError(f"Design {self.design.name} has no {kind} named {name!r}")
        return ports[name]


def _out_of_range(name: str, width: int, value: int) -> str:
    return f"Value of {name} must be 0 to {(1 << width) - 1}, not {value!r}"


def _width(name: str, port: Signal) -> int:
    width = len(Value.cast(port))
    if not 1 <= width <= 64:
        raise ValueError(f"Port {name} must be 1 to 64 bits wide, not {width}")
    return width
