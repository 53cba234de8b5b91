"""The declaration of a machine: all that commands and checks ask about it, in one value.

Parts that are heavy to import, such as a model, are functions that import when they are called. All
that concern one build of the machine take the keyword arguments of `make` for it.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, ClassVar, Protocol

from amaranth.lib import wiring
from numpy.typing import NDArray

from .bench import Bench
from .design import Design, Entity
from .diagram import Diagram
from .engines import Engine

if TYPE_CHECKING:
    from .faults.target import FaultTarget
    from .fuzz import FuzzTarget

__all__ = ["Coverage", "Machine", "Model", "Options"]

Options = Mapping[str, Any]
"""Keyword arguments of a machine's `make`."""


class Model(Protocol):
    """A machine in plain Python, clock by clock."""

    Inputs: ClassVar[type]
    """A dataclass of its input pins, all 0 unless given."""

    def outputs(self, pins, /) -> object:
        """Return the outputs in this clock, as attributes."""
        ...

    def edge(self, pins, /) -> None:
        """Go to the next clock."""


@dataclass(frozen=True)
class Coverage:
    """What a cosimulation is expected to come by.

    Attributes
    ----------
    cycles : int
        Clocks to run.
    lines, bits : float
        Percents of the lines and branches, and of the bits, to come by in them.
    explore : callable, optional
        Is given the engine at the end of these clocks, and leads it where no stimulus gets.
    """

    cycles: int
    lines: float
    bits: float
    explore: Callable[[Engine], object] | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class Machine:
    """A machine. What it does not have is None, and commands say so.

    Attributes
    ----------
    name : str
        That of its folder.
    about : str
        What it is, in a line.
    make : callable
        Makes its component of keyword arguments, its options.
    short : mapping of str to object
        Options with which much happens in few clocks, for simulations of every clock.
    variants : mapping of str to mapping
        Other builds that are simulated likewise, by name: what differs from `short`.
    model : callable, optional
        Makes its `Model` of the same options.
    directed : callable
        Gives, of a seed, a number of clocks and options, at most so many clocks of stimulus that
        goes through what there is to see.
    random : callable
        Gives, of a seed, the number of a block, a number of rows and options, the first rows of
        that block of random stimulus.
    vhdl : callable, optional
        Gives its description in VHDL, of the same options.
    without : mapping of str to str
        Engines that cannot run it, and why.
    scenarios : callable, optional
        Gives its benches.
    diagrams : sequence of Diagram
        What the page of timing diagrams shows of them.
    coverage : Coverage, optional
        What its stimulus is expected to come by.
    fuzz : callable, optional
        Gives the `tb.fuzz.FuzzTarget` of its serial line.
    faults : callable, optional
        Gives its builds for fault injection, each a `tb.faults.target.FaultTarget`.
    order : int
        Its place among the machines: the least is first, and is the default of commands.
    """

    name: str
    about: str
    make: Callable[..., wiring.Component]
    short: Options
    variants: Mapping[str, Options] = field(default_factory=dict)
    model: Callable[..., Model] | None = None
    directed: Callable[..., Mapping[str, NDArray]]
    random: Callable[..., Mapping[str, NDArray]]
    vhdl: Callable[..., Entity] | None = None
    without: Mapping[str, str] = field(default_factory=dict)
    scenarios: Callable[[], Sequence[Bench]] | None = None
    diagrams: Sequence[Diagram] = ()
    coverage: Coverage | None = None
    fuzz: "Callable[[], FuzzTarget] | None" = None
    faults: "Callable[[], Sequence[FaultTarget]] | None" = None
    order: int = 100

    @property
    def builds(self) -> dict[str, Options]:
        """What is simulated: the options of the machine and of its variants, by name."""
        return {self.name: self.short, **{
            name: {**self.short, **changes} for name, changes in self.variants.items()}}

    def design(self, **options: Any) -> Design:
        """Return its design for engines: it by its own pins, and its VHDL if it has some."""
        from .boards import component

        return replace(component(self.name, self.make(**options)),
                       vhdl=self.vhdl(**options) if self.vhdl else None)
