"""Waveform files, read by pywellen. Only this module uses it: its interface changes often.

pywellen panics on some malformed files, and Rust reports that on stderr before Python raises; a
time that goes back is reported on stdout and left out. Both outputs are suppressed while it reads,
and a panic becomes an ordinary error.
"""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from pathlib import Path
from typing import Any

import pywellen

from ..console import Progress, UserError
from .quiet import muffled, uncollected
from .trace import Kind, Trace, collect

__all__ = ["LATEST", "Signal", "Wave", "printable"]

BLOCK = 1 << 13
"""Changes converted to arrays at a time: Python's own numbers take much memory."""

WIDEST = 1 << 20
"""Most bits of a signal in a file: every change of it takes as much memory."""

MANY = 2_000_000
"""Changes from which a progress bar is shown."""

LATEST = 1 << 62
"""Largest time in ticks: sums of two times fit in 64 bits."""

LARGE = 300_000_000
"""File size in bytes from which reading takes some time, so that a message announces it."""

NANOSECOND = Fraction(1, 10**9)


@dataclass(frozen=True)
class Signal:
    """A signal as its file declares it.

    Attributes
    ----------
    parts : tuple of str
        Its scopes and its name. ``\\order.x`` of Verilog is two parts.
    bits : int
        Width; 0 if it has none.
    kind : Kind
        How its values are read.
    id : str
        Signals with equal `id` are one signal with several names.
    """

    parts: tuple[str, ...]
    bits: int
    kind: Kind
    id: str
    native: Any = field(repr=False, compare=False)

    @property
    def path(self) -> str:
        """Its path, as a command takes it."""
        return ".".join(self.parts)

    @property
    def declared(self) -> str:
        """Its path as the file writes it, for other programs."""
        return self.native.full_name

    @property
    def name(self) -> str:
        """Its name without scopes."""
        return self.parts[-1]


class Wave:
    """A waveform file: VCD, FST or GHW.

    Opening reads its declarations only; the first trace reads all of it.

    Parameters
    ----------
    path : path
        The file.

    Attributes
    ----------
    signals : list of Signal
        All signals, in the order of the file.
    tick : Fraction
        Unit of its times, in seconds. Nanoseconds if the file does not give it.

    Raises
    ------
    UserError
        If it cannot be read.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        if self.path.exists() and not self.path.is_file():
            raise UserError(f"cannot read {self.path}: it is not a file")
        with self.path.open("rb"):  # its error message is the clearest
            pass
        # Threads would make it no faster, and panics in them could not be suppressed.
        with self._reading():
            wave = pywellen.Waveform(os.fspath(self.path), multi_threaded=False)
            self.format = str(wave.file_format)
            self.tick = _tick(wave.timescale)
            self.signals = [_signal(var) for var in wave.all_vars()]
        self._traces: dict[str, Trace] = {}
        self._loaded = False
        self._widest = max((signal.bits for signal in self.signals), default=0)

    def trace(self, signal: Signal, *, keep: bool = True) -> Trace:
        """Return all changes of a signal.

        Parameters
        ----------
        signal : Signal
            The signal.
        keep : bool
            Whether to keep it for the next call. With many signals that are read once each, that
            would take much memory.

        Raises
        ------
        UserError
            If its changes cannot be read.
        """
        if signal.id in self._traces:
            return self._traces[signal.id]
        native = self._native(signal)
        enum = signal.native.enum_type
        names = {int(bits, 2): name for bits, name in enum[1]} if enum else None
        try:
            with uncollected():
                trace = collect(_blocks(native, signal.path), len(native), kind=signal.kind,
                                bits=signal.bits, names=names)
        except OverflowError:
            raise self._late() from None
        if len(trace) and trace.times[-1] > LATEST:
            raise self._late()
        trace.words[:] = map(printable, trace.words)
        if keep:
            self._traces[signal.id] = trace
        return trace

    def changes(self, signal: Signal) -> int:
        """Count the changes of a signal, without making arrays of them."""
        return len(self._native(signal))

    @cached_property
    def span(self) -> tuple[int, int]:
        """The times of the first and of the last change of any signal, in ticks.

        A later end that the file gives is not available from pywellen.
        """
        firsts, lasts = [], []
        for signal in {signal.id: signal for signal in self.signals}.values():
            if len(native := self._native(signal)):
                firsts.append(int(native[0][0]))
                lasts.append(int(native[-1][0]))
        if lasts and max(lasts) > LATEST:
            raise self._late()
        return (min(firsts), max(lasts)) if firsts else (0, 0)

    def _native(self, signal: Signal) -> Any:
        if self._widest > WIDEST:
            raise UserError(f"cannot read {self.path}: it has a signal of {self._widest} bits, and "
                            f"{WIDEST} are the most")
        if not self._loaded and self.path.stat().st_size > LARGE and sys.stderr is not None:
            print(f"reading {self.path} ...", file=sys.stderr, flush=True)
        self._loaded = True
        with self._reading():
            return signal.native.signal

    def _late(self) -> UserError:
        return UserError(f"cannot read {self.path}: a time or a value in it is too large")

    @contextmanager
    def _reading(self) -> Iterator[None]:
        try:
            with muffled():
                yield
        except (RuntimeError, UnicodeError) as error:
            raise UserError(
                f"cannot read {self.path}: it is not a VCD, FST or GHW file, or it is incomplete "
                f"({printable(' '.join(str(error).split()))[:100]})") from error
        except BaseException as error:
            # A panic is not an Exception, and its class is not exported.
            if type(error).__name__ != "PanicException":
                raise
            raise UserError(f"cannot read {self.path}: its contents are malformed") from None


def printable(text: str) -> str:
    """Escape characters that would act on a terminal or cannot be written to a file."""
    return text if text.isprintable() else text.encode("unicode_escape").decode("ascii")


def _blocks(native: Any, name: str) -> Iterator[tuple]:
    shown = Progress(len(native), "changes", f"reading {name}") if len(native) > MANY else None
    with shown or nullcontext():
        for start in range(0, len(native), BLOCK):
            times, values = zip(*native[start:start + BLOCK], strict=True)
            yield times, values
            if shown is not None:
                shown.advance(len(times))


def _signal(var: Any) -> Signal:
    bits = var.bitwidth or 0
    kind: Kind = "bits"
    if var.is_real:
        kind = "real"
    elif var.is_string or var.enum_type:
        kind = "text"
    elif var.var_type == "Event" or not bits:
        kind = "event"
    elif var.var_type == "Integer":
        kind = "signed"
    # A backslash begins an escaped identifier of Verilog.
    parts = tuple(map(printable, var.full_name.replace("\\", "").split(".")))
    return Signal(parts, bits, kind, str(var.signal_id), var)


def _tick(timescale: Any) -> Fraction:
    if timescale is None or timescale.unit.to_exponent() is None:
        return NANOSECOND
    return timescale.factor * Fraction(10) ** timescale.unit.to_exponent()
