"""What the boards of all machines have in common: clock, reset, and pins with their flip-flops."""

from collections.abc import Mapping
from fractions import Fraction
from math import ceil

from amaranth import ClockDomain, ClockSignal, Module, ResetSignal, Signal, Value
from amaranth.lib import io
from amaranth.lib.cdc import FFSynchronizer

from fresa.drive import MAX_PERIOD
from fresa.machines.mill import CLOCK

__all__ = ["DEBOUNCE", "debounce_period", "drive_pins", "synchronize", "wire_clock"]

DEBOUNCE = Fraction(1, 100)
"""Time for which a contact must be still, in seconds."""


def debounce_period(seconds: Fraction | float = DEBOUNCE, clock: int = CLOCK) -> int:
    """Clocks in `seconds`, one more rather than one less.

    Raises
    ------
    ValueError
        If it takes no clock, or more than a debouncer counts.
    """
    if not 0 < seconds * clock <= MAX_PERIOD:
        raise ValueError(f"debounce time must be over 0 and at most {MAX_PERIOD / clock:g} s, "
                         f"not {seconds!r}")
    return ceil(Fraction(seconds) * clock)


def wire_clock(m: Module, ports: Mapping[str, io.PortLike], reset: Value) -> None:
    """Make the domain ``sync`` of the port ``clk`` and a level."""
    m.domains.sync = ClockDomain()
    m.submodules.clk = clk = io.Buffer("i", ports["clk"])
    m.d.comb += [ClockSignal().eq(clk.i), ResetSignal().eq(reset)]


def synchronize(m: Module, name: str, port: io.PortLike, inside: Signal, *, init: int = 0) -> None:
    """Lead a port inside through two flip-flops, which begin with its level at rest."""
    m.submodules[name] = buffer = io.Buffer("i", port)
    m.submodules[f"{name}_synchronizer"] = FFSynchronizer(buffer.i, inside, init=init)


def drive_pins(m: Module, name: str, port: io.PortLike, value: Value, *, init: int) -> None:
    """Lead a value to a port through flip-flops in the I/O blocks, which no reset touches.

    ``io.FFBuffer`` would do that too, but powers up at 0, which is not what every pin rests at.
    """
    m.submodules[name] = buffer = io.Buffer("o", port)
    pins = Signal(len(value), name=f"{name}_pins", init=init, reset_less=True,
                  attrs={"IOB": "TRUE"})
    m.d.sync += pins.eq(value)
    m.d.comb += buffer.o.eq(pins)
