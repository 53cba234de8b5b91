"""Base of engines that are a process: a bench that executes orders from stdin.

The process lives as long as the engine. Orders are sent and answers read in blocks, so that Python
is not called in each clock. The orders are those of ``bench.v`` and ``bench.vhd``.
"""

import subprocess
import tempfile
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from contextlib import suppress
from os import PathLike
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from ..design import Design
from .base import Engine, EngineError, Rows
from .ports import Port, from_digits, numbered, to_digits

__all__ = ["PipedEngine", "UnknownLevelError"]

#: Bytes of orders before answers are read, which must fit into a pipe.
BLOCK = 1 << 13


class UnknownLevelError(EngineError):
    """An output is X or Z.

    Attributes
    ----------
    output : str
        The output; of several, the first of the design.
    clock : int
        The first clock in which it is.
    before : dict of str to array
        The outputs of the rows before.
    """

    def __init__(self, design: str, output: str, clock: int, digits: str) -> None:
        super().__init__(f"Output {output} of {design} is not known at clock {clock}: hex {digits}")
        self.output = output
        self.clock = clock
        self.before: dict[str, NDArray] = {}


class PipedEngine(Engine):
    """Runs a design in a process of its own. See `Engine`.

    An output that is not 0 or 1 in every bit, watched or not, raises an `UnknownLevelError` in any
    clock.
    """

    program: ClassVar[str]

    def __init__(self, design: Design, *, vcd: str | PathLike[str] | None = None,
                 traceable: bool = False, stretches: bool = False) -> None:
        super().__init__(design, vcd=vcd, traceable=traceable, stretches=stretches)
        self._process = None
        if reason := self.missing():
            raise EngineError(reason)
        self._in, self._out = numbered(design)
        self._columns: dict[str, slice] = {}
        end = 0
        for port in self._out:
            self._columns[port.name] = slice(end, end := end + port.digits)
        self._digits = end
        self._levels = {port.name: 0 for port in self._in}
        self._set_since = False
        if vcd is not None:
            try:
                Path(vcd).touch()
            except OSError as error:
                raise EngineError(f"Waveform {vcd} cannot be written") from error
        self._work = tempfile.TemporaryDirectory(prefix="fresa-")
        try:
            command = self._command(design, Path(self._work.name))
        except BaseException:
            self._work.cleanup()
            raise
        self._stderr = tempfile.TemporaryFile()  # read only if it dies
        self._process = subprocess.Popen(
            command, cwd=self._work.name, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=self._stderr, start_new_session=True)  # Ctrl-C is for the parent
        if vcd is not None:
            self._read_answer()  # confirms that it is open

    @abstractmethod
    def _command(self, design: Design, work: Path) -> list[str]:
        """Build the program of a design in a folder; return the command that runs it there.

        With `vcd` it writes that waveform, and prints a line once the file is open.
        """

    def _close(self) -> None:
        process = self._process
        if process is None:
            return
        if self.vcd is not None and self._set_since:
            with suppress(EngineError):
                self._send()
        self._process = None
        try:
            process.communicate(timeout=0.01 if self.vcd is None else 60)
        except (subprocess.TimeoutExpired, BrokenPipeError):
            process.kill()
            process.communicate()
        self._stderr.close()
        self._work.cleanup()

    def __del__(self) -> None:
        if getattr(self, "_process", None):
            self.close()

    def _send(self, *orders: bytes) -> None:
        process = self._process
        assert process is not None and process.stdin is not None
        if self._set_since:
            levels = to_digits((p.digits, np.array([self._levels[p.name]], np.uint64))
                               for p in self._in)
            orders = (b"s %s\n" % levels.tobytes(), *orders)
            self._set_since = False
        try:
            process.stdin.write(b"".join(orders))
            process.stdin.flush()
        except BrokenPipeError:
            self._died()

    def _read_answer(self, size: int | None = None) -> bytes:
        """Read a line, or a number of bytes."""
        process = self._process
        assert process is not None and process.stdout is not None
        message = process.stdout.readline() if size is None else process.stdout.read(size)
        if not message or (size is not None and len(message) < size):
            self._died(message)
        return message

    def _died(self, message: bytes = b"") -> None:
        """Raise with the reason for a missing answer, as far as it was printed."""
        self._stderr.seek(0)
        reported = [line for line in message.decode(errors="replace").split("\n") if ":" in line]
        why = (*reported, self._stderr.read().decode(errors="replace").split("\n")[0])[0]
        self.close()
        raise EngineError(f"{self.program} has ended: {why or 'for an unknown reason'}")

    def _read(self, text: NDArray[np.uint8], clocks: Sequence[int] | NDArray) -> list[NDArray]:
        """Read all outputs, one row of digits per clock."""
        columns = {}
        first: tuple[int, Port] | None = None
        for port in self._out:
            digits = text[:, self._columns[port.name]]
            columns[port.name], unknown = from_digits(digits)
            if unknown.any() and (first is None or unknown.argmax() < first[0]):
                first = int(unknown.argmax()), port
        if first is not None:
            row, port = first
            digits = text[row, self._columns[port.name]].tobytes().decode()
            error = UnknownLevelError(self.design.name, port.name, int(clocks[row]), digits)
            error.before = {name: values[:row] for name, values in columns.items()}
            raise error
        return list(columns.values())

    def _set(self, values: Mapping[str, int]) -> None:
        self._levels |= values
        self._set_since = True

    def _get(self, names: Sequence[str]) -> tuple[int, ...]:
        if not self._out:
            return ()
        self._send(b"g\n")
        text = np.frombuffer(self._read_answer()[:-1], np.uint8)[None, :]
        values = dict(zip(self._columns, self._read(text, [self.clock]), strict=True))
        return tuple(int(values[name][0]) for name in names)

    def _run(
        self, clocks: int, watch: Sequence[str], last: Sequence[int], until: Mapping[str, int],
        once: bool,
    ) -> Rows:
        before = dict(zip(watch, last, strict=True))
        full = {name: (1 << 4 * port.digits) - 1 for name, port in self._named_out().items()}
        enable = sum(1 << n for n, name in enumerate(self._columns) if name in until)
        self._send(b"r %d %d %s %s %0*x %s\n" % (
            clocks, once, self._all({name: full[name] for name in watch}), self._all(before),
            -(-len(self._out) // 4), enable, self._all(until)))
        clock: list[int] = []
        lines: list[bytes] = []
        while True:
            made, _, rest = self._read_answer()[:-1].partition(b" ")
            if made == b"=":
                break
            clock.append(int(made))
            lines.append(rest)
        text = np.frombuffer(b"".join(lines), np.uint8).reshape(len(lines), self._digits)
        columns = dict(zip(self._columns, self._read(text, self.clock + np.array(clock, np.int64)),
                           strict=True))
        values = np.array([columns[name] for name in watch], np.uint64)
        return Rows(int(rest), np.array(clock, np.int64), values.reshape(len(watch), len(clock)))

    def _named_out(self) -> dict[str, Port]:
        return {port.name: port for port in self._out}

    def _all(self, values: Mapping[str, int]) -> bytes:
        """Write a value for every output, 0 if it has none."""
        return b"".join(b"%0*x" % (p.digits, values.get(p.name, 0)) for p in self._out) or b"0"

    def _play(
        self, stimulus: Mapping[str, NDArray[np.uint64]], rows: int, outputs: Sequence[str]
    ) -> NDArray[np.uint64]:
        given = [(p.digits, stimulus[p.name] if p.name in stimulus
                  else np.full(rows, self._levels[p.name], np.uint64)) for p in self._in]
        given = given or [(1, np.zeros(rows, np.uint64))]
        ends = np.full((rows, 1), ord("\n"), np.uint8)
        orders = np.hstack([to_digits(given), ends])
        block = max(1, BLOCK // orders.shape[1])
        self._levels |= {name: int(values[-1]) for name, values in stimulus.items() if rows}
        self._set_since = False  # the first row sets all
        samples = np.empty((len(outputs), rows), np.uint64)
        for start in range(0, rows, block):
            part = orders[start:start + block]
            self._send(b"p %d\n" % len(part), part.tobytes())
            answer = self._read_answer(len(part) * (self._digits + 1))
            text = np.frombuffer(answer, np.uint8).reshape(len(part), -1)[:, :-1]
            try:
                columns = self._read(text, self.clock + start + np.arange(len(part)))
            except UnknownLevelError as error:
                error.before = {name: np.concatenate([samples[n, :start], error.before[name]])
                                for n, name in enumerate(outputs)}
                raise
            seen = dict(zip(self._columns, columns, strict=True))
            for n, name in enumerate(outputs):
                samples[n, start:start + len(part)] = seen[name]
        return samples
