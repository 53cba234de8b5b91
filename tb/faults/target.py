"""What fault injection must know of a machine: motors, answers, work."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ..design import Design
from .rows import Rows

__all__ = ["Coils", "Line", "FaultTarget", "Pulses"]


@dataclass(frozen=True)
class Coils:
    """A motor that is driven by coil words.

    Attributes
    ----------
    name : str
        What it is called.
    count : str
        Path of the register that counts its steps; of its bits the lowest 32 are compared.
    output : str
        The output with the coil word.
    words : sequence of int
        Legal ones, forward.
    power : str
        The output without which all coils are off from the next clock on, and the motor stays where
        it is; none if there is always power.
    may_be_off : bool
        All coils may be off, and no output shows when: the motor stays where it is.
    first : int
        The count where the position is 0.
    """

    name: str
    count: str
    output: str
    words: Sequence[int]
    power: str = ""
    may_be_off: bool = False
    first: int = 0


@dataclass(frozen=True)
class Pulses:
    """A motor that is driven by STEP, DIR and ENABLE: a bit of three outputs.

    ENABLE may be one for all motors.

    Attributes
    ----------
    name, count : str
        See `Coils`.
    bit : int
        Which bit.
    times : tuple of int
        Least clocks that its driver module requires: STEP high, which is how long it is, and low;
        DIR and ENABLE still before STEP rises, and after it fell.
    """

    name: str
    count: str
    bit: int
    times: tuple[int, int, int, int]


@dataclass(frozen=True)
class Line:
    """The serial line of a machine.

    Attributes
    ----------
    bit : int
        Clocks of a bit.
    answers : bytes
        With which bytes its answers begin; other lines are no answers.
    question : tuple
        Work behind a reset, the number of its answers by how they begin, and the steps that each
        motor makes for it.
    """

    bit: int
    answers: bytes
    question: tuple[Rows, tuple[int, ...], tuple[int, ...]]


@dataclass(frozen=True)
class FaultTarget:
    """A machine for fault injection.

    Attributes
    ----------
    name : str
        What it is called.
    design : Design
        Its gateware.
    motors : tuple of Coils or Pulses
        What it drives.
    idle : tuple of str and int
        An output, and the level that it has where the machine waits for work.
    fault : str
        The output that shows faults.
    origin : mapping of str to int
        Inputs, and the level of each at which the position is 0 by definition.
    kept : tuple of str
        Ends of the paths of the registers that a reset does not set.
    work : callable
        Gives work by a seed, for upsets. A row that waits is not its last.
    work_to_reset : callable
        Gives work by a seed and the number of a chunk.
    gap : int
        Most clocks from reset to reset.
    window : int
        Clocks of work after an upset, at least, before its verdict.
    timeout : int
        Clocks more than a row took without an upset after which the machine counts as stuck.
    ignored : tuple of str
        Prefixes of the names of registers that only drive displays.
    line : Line, optional
        Its serial line.
    guard : bool, optional
        Whether it has its guard, if it can have one.
    shared : int
        Upsets of the same work: the next ones are of another.
    """

    name: str
    design: Design
    motors: tuple[Coils | Pulses, ...]
    idle: tuple[str, int]
    fault: str
    origin: dict[str, int]
    kept: tuple[str, ...]
    work: Callable[[int], Rows]
    work_to_reset: Callable[[int, int], Rows]
    gap: int
    window: int
    timeout: int
    ignored: tuple[str, ...] = ()
    line: Line | None = None
    guard: bool | None = None
    shared: int = 20_000
