"""Waveform files, through pywellen. Nothing else here knows it: its interface changes often.

pywellen panics on some files that are not as they should be, and Rust tells so on stderr before
Python hears of it; of a time that goes back it tells on stdout and leaves it out. Both are kept
from the terminal while it reads, and a panic is an error as any other.
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
"""Changes that are turned into arrays at a time: Python's own numbers take much memory."""

WIDEST = 1 << 20
"""Bits of the widest signal of a file that is read: every change of it takes so much memory."""

MANY = 2_000_000
"""Changes from which a bar shows that they are read."""

LATEST = 1 << 62
"""Ticks beyond which no time is understood: sums of two times stay in 64 bits."""

LARGE = 300_000_000
"""Bytes from which reading takes some time. Nothing can be shown while it lasts."""

NANOSECOND = Fraction(1, 10**9)


@dataclass(frozen=True)
class Signal:
    """A signal as its file declares it.

    Attributes
    ----------
    parts : tuple of str
        Its scopes and its name. ``\\order.x`` of Verilog is two parts.
    bits : int
        Width; 0 for what has none.
    kind : Kind
        How its values are to be read.
    id : str
        Signals with the same are one signal by several names.
    """

    parts: tuple[str, ...]
    bits: int
    kind: Kind
    id: str
    native: Any = field(repr=False, compare=False)

    @property
    def path(self) -> str:
        """The name by which people ask for it."""
        return ".".join(self.parts)

    @property
    def declared(self) -> str:
        """The name that the file gives it, by which other programs know it."""
        return self.native.full_name

    @property
    def name(self) -> str:
        """The last part."""
        return self.parts[-1]


class Wave:
    """A waveform file: VCD, FST or GHW.

    Only its declarations are read at first, and all of it when a trace is asked for.

    Parameters
    ----------
    path : path
        The file.

    Attributes
    ----------
    signals : list of Signal
        All signals, in the order of the file.
    tick : Fraction
        Unit of its times, in seconds. A file that tells none counts nanoseconds.

    Raises
    ------
    UserError
        If it cannot be read.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = Path(path)
        if self.path.exists() and not self.path.is_file():
            raise UserError(f"cannot read {self.path}: it is not a file")
        with self.path.open("rb"):  # its error is the clearest, if the file cannot be read
            pass
        # Threads of its own make it no faster, and their panics could not be kept quiet.
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
            Whether to have it at hand when it is asked for again. Of many signals that are each
            looked at once, that would take much memory.

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

        What a file tells of a later end, pywellen keeps for itself.
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
                            f"{WIDEST} are understood")
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
                f"cannot read {self.path}: it is no VCD, FST or GHW file, or it breaks off early "
                f"({printable(' '.join(str(error).split()))[:100]})") from error
        except BaseException as error:
            # A panic is no Exception, and its class is not exported.
            if type(error).__name__ != "PanicException":
                raise
            raise UserError(f"cannot read {self.path}: something in it is not as a waveform file "
                            "should be") from None


def printable(text: str) -> str:
    """Escape what would do something to a terminal or could not be written to a file."""
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
    # A backslash begins a name of Verilog with odd characters in it.
    parts = tuple(map(printable, var.full_name.replace("\\", "").split(".")))
    return Signal(parts, bits, kind, str(var.signal_id), var)


def _tick(timescale: Any) -> Fraction:
    if timescale is None or timescale.unit.to_exponent() is None:
        return NANOSECOND
    return timescale.factor * Fraction(10) ** timescale.unit.to_exponent()
