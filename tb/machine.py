# amaranth: UnusedElaboratable=no

"""The declaration of a machine: all that commands and checks ask about it, in one value.

Parts that are heavy to import, such as a model, are functions that import when they are called. All
that concern one build of the machine take the keyword arguments of `make` for it.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from importlib import import_module
from typing import TYPE_CHECKING, Any

from amaranth.lib import wiring
from numpy.typing import NDArray

from fresa.protocol import BAUD

from .bench import Bench
from .design import Design, Entity
from .diagram import Diagram
from .engines import Engine
from .runners import Dut, Model

if TYPE_CHECKING:
    from .contracts import Component
    from .faults.target import FaultTarget
    from .fuzz import FuzzTarget
    from .netlist.part import NetlistPart

__all__ = ["Coverage", "Machine", "Option", "Options", "Recorded", "Serve", "parts"]

Options = Mapping[str, Any]
"""Keyword arguments of a machine's `make`."""


@dataclass(frozen=True)
class Coverage:
    """What a cosimulation is expected to cover.

    Attributes
    ----------
    cycles : int
        Clocks to run.
    lines, bits : float
        Percents of the lines and branches, and of the bits, to cover in them.
    explore : callable, optional
        Is given the engine at the end of these clocks, and leads it where no stimulus gets.
    named : bool
        Count bits of those signals alone that have a name in the gateware: what is left of a large
        machine can be compiled soon.
    """

    cycles: int
    lines: float
    bits: float
    explore: Callable[[Engine], object] | None = None
    named: bool = False


@dataclass(frozen=True)
class Option:
    """What people choose when a machine is built or served: an option of these commands.

    Attributes
    ----------
    name : str
        That of the argument of `Machine.real`.
    help : str
        What it does; ``%(default)s`` stands for its default.
    default : object
        Its value unless given. An option whose default is False is a switch.
    least, most : int, optional
        Range of a whole number, if it is one.
    metavar : str or tuple of str, optional
        How help shows its value; of a tuple, it takes as many values.
    choices : sequence of str
        The values that there are, if only some.
    aliases : tuple of str
        Further names, with their dashes.
    serve : bool
        Offered also where the machine is served: it changes what its line does.
    """

    name: str
    help: str
    default: Any
    least: int | None = None
    most: int | None = None
    metavar: str | tuple[str, ...] | None = None
    choices: Sequence[str] = ()
    aliases: tuple[str, ...] = ()
    serve: bool = False


@dataclass(frozen=True)
class Serve:
    """How a machine is served, with its serial line ``rx`` and ``tx``.

    Attributes
    ----------
    about : str
        What it is and how one speaks to it, in a line.
    design : callable, optional
        Makes its design for a clock in Hz, ``baud`` and the values of its options; without one it
        is the machine by its own pins.
    levels : mapping of str to int
        Its other inputs, where they are not 0.
    switches : callable, optional
        Gives, of the values of its options, the ends of its axes that have a limit switch, such as
        ``X+``, by the bits of its input ``limits``.
    further_switches : callable, optional
        Gives, likewise, the limit switches that have an input of their own: its name, by their
        names, such as ``Y2+``.
    contacts : sequence of str
        Further inputs of one bit that a person switches, such as that of a door.
    plant : callable, optional
        Makes what its motors move, of the arguments of `Machine.make`: with outputs that move it,
        and levels of inputs.
    baud : int
        Bits a second on its line.
    least_clock : int
        The lowest clock in Hz that it can have; with one the slow engine does not serve it.
    """

    about: str
    design: Callable[..., Design] | None = None
    levels: Mapping[str, int] = field(default_factory=dict)
    switches: Callable[..., Sequence[str]] | None = None
    further_switches: Callable[..., Mapping[str, str]] | None = None
    contacts: Sequence[str] = ()
    plant: Callable[..., Any] | None = None
    baud: int = BAUD
    least_clock: int = 0


@dataclass(frozen=True)
class Recorded:
    """What the record of verification has of a machine beside what it has of every machine.

    Attributes
    ----------
    benchmarks : mapping of str to (str, str)
        Benchmarks whose figures are recorded, by what they are of: the words of the command but for
        that of its figures, and of one that takes half a minute, or nothing.
    of_models : sequence of str
        Those of them that run the models alone.
    sizes : mapping of str to (str, str)
        Builds whose resources are counted, by name: the arguments of `tools.build`, but for the
        machine, and what decides the resources, as `tools.fingerprints` names it.
    campaign : int
        Clocks of a campaign; 0 for none.
    faults : mapping of str to (int, int)
        How many ``resets`` and ``flips`` are injected, and where there is little time; of those
        that are not named, as many as of other machines.
    unmutated : str
        Why there are no mutants of the machine as a whole, if there are none.
    mutated : sequence of str
        General components whose mutants are recorded with those of its own.
    mutants_least : float
        Percent of mutants that are to be killed, of those that are not equivalent.
    quick_mutants : str
        Of its components the one whose mutants are tried where there is little time.
    """

    benchmarks: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    of_models: Sequence[str] = ()
    sizes: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    campaign: int = 0
    faults: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    unmutated: str = ""
    mutated: Sequence[str] = ()
    mutants_least: float = 99
    quick_mutants: str = ""


def parts(package: str, *modules: str) -> dict[str, Any]:
    """Return the parts of a `Machine` that modules of its folder hold.

    Parameters
    ----------
    package : str
        The machine's, ``__name__`` of its declaration.
    modules : str
        Such as ``fuzz``, whose value ``FUZZ`` is the part of that name.

    Returns
    -------
    dict of str to callable
        For `Machine`, each by its name: imports the module when it is called.
    """
    def value(module: str) -> Any:
        return getattr(import_module(f"{package}.{module}"), module.upper())

    return {module: partial(value, module) for module in modules}


def _as_short(clock: int, **values: Any) -> Options:
    """Stand for the times of `Machine.short`."""
    raise NotImplementedError


def _values_alone(clock: int, made: Options, **values: Any) -> tuple[dict[str, Any], str]:
    return values, f"clock {clock / 1e6:g} MHz"


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
    benched : mapping of str to object
        The build that its bench runs: what differs from `short`. Its mutants meet that bench, and
        its model of the same build.
    model : callable, optional
        Makes its `Model` of the same options.
    directed : callable
        Gives, of a seed, a number of clocks and options, at most so many clocks of stimulus that
        goes through what there is to see: a column for every input, ``rst`` among them.
    random : callable
        Gives, of a seed, the number of a block, a number of rows and options, the first rows of
        that block of random stimulus, likewise.
    vhdl : callable, optional
        Gives its description in VHDL, of the same options.
    without : mapping of str to str
        Engines that cannot run it, and why.
    options : sequence of Option
        What people choose when it is built or served.
    real : callable
        Gives the arguments of `make` in real times, of a clock in Hz and the values of `options`.
        It raises `ValueError` if these do not go together. Without it they are `short`.
    on_boards : mapping of str to mapping
        Values of options whose default is None, on boards by their names: what a small FPGA leaves
        out, unless it is chosen.
    inverted : callable, optional
        Gives, of the values of `options`, the ports whose pins have the other level.
    figures : callable
        Gives, of a clock, what `real` gave and the values of `options`, what the report of a build
        has of it, ready for JSON, and the same in a line. Without it these are the values.
    serve : Serve, optional
        How it is served, if it has a serial line.
    contracts : callable, optional
        Gives what is proved of it and of the parts that it alone has: components by name, with the
        machine itself by its own name.
    scenarios : callable, optional
        Gives the benches of the machine and of the parts that it alone has.
    diagrams : sequence of Diagram
        What the page of timing diagrams shows of them.
    coverage : Coverage, optional
        What its stimulus is expected to cover.
    survivors : callable, optional
        Gives why nothing kills some mutants of its own components: a sentence by component and
        mutant, as `tools.mutate` writes it.
    fuzz : callable, optional
        Gives the `tb.fuzz.FuzzTarget` of its serial line.
    faults : callable, optional
        Returns what makes its builds for fault injection, each a `tb.faults.target.FaultTarget`,
        by whether they have a guard: None for a machine that can have none, and then a word for
        each further build.
    modelled : callable, optional
        Gives what its models of events say of some work, as text: benchmarks run these models.
    netlist : callable, optional
        Gives what of it is checked as a netlist, a `tb.netlist.part.NetlistPart`.
    recorded : Recorded
        What the record of verification has of it alone.
    order : int
        Its place among the machines: the least is first, and is the default of commands.
    """

    name: str
    about: str
    make: Callable[..., wiring.Component]
    short: Options
    variants: Mapping[str, Options] = field(default_factory=dict)
    benched: Options = field(default_factory=dict)
    model: Callable[..., Model] | None = None
    directed: Callable[..., Mapping[str, NDArray]]
    random: Callable[..., Mapping[str, NDArray]]
    vhdl: Callable[..., Entity] | None = None
    without: Mapping[str, str] = field(default_factory=dict)
    options: Sequence[Option] = ()
    real: Callable[..., Options] = _as_short
    on_boards: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    inverted: Callable[..., Sequence[str]] | None = None
    figures: Callable[..., tuple[dict[str, Any], str]] = _values_alone
    serve: Serve | None = None
    contracts: "Callable[[], Mapping[str, Component]] | None" = None
    scenarios: Callable[[], Sequence[Bench]] | None = None
    diagrams: Sequence[Diagram] = ()
    coverage: Coverage | None = None
    survivors: Callable[[], Mapping[tuple[str, str], str]] | None = None
    fuzz: "Callable[[], FuzzTarget] | None" = None
    faults: "Callable[[], Mapping[Any, Callable[[], FaultTarget]]] | None" = None
    modelled: Callable[[], Callable[[], Iterable[str]]] | None = None
    netlist: "Callable[[], NetlistPart] | None" = None
    recorded: Recorded = Recorded()
    order: int = 100

    def __post_init__(self) -> None:
        if self.real is _as_short:
            object.__setattr__(self, "real", lambda clock, **values: self.short)

    @property
    def builds(self) -> dict[str, Options]:
        """What is simulated: the options of the machine and of its variants, by name."""
        return {self.name: self.short, **{
            name: {**self.short, **changes} for name, changes in self.variants.items()}}

    @property
    def bench_options(self) -> Options:
        """The options of the build that its bench runs."""
        return {**self.short, **self.benched}

    def values_on(self, board: str, values: Options) -> dict[str, Any]:
        """Return values of its options, with those of a board for what is not chosen."""
        return {**values, **{name: value for name, value in self.on_boards.get(board, {}).items()
                             if values[name] is None}}

    def design(self, **options: Any) -> Design:
        """Return its design for engines: it by its own pins, and its VHDL if it has some."""
        from .boards import component

        return replace(component(self.name, self.make(**options)),
                       vhdl=self.vhdl(**options) if self.vhdl else None)

    def dut(self, name: str, options: Options | None = None) -> Dut:
        """Return a build, to be cosimulated: of its `builds`, unless it has other options."""
        options = self.builds[name] if options is None else options
        ghdl = {} if self.vhdl else {"ghdl": "it has no description in VHDL"}
        return Dut(
            name, partial(self.design, **options),
            directed=partial(self.directed, **options), random=partial(self.random, **options),
            model=partial(self.model, **options) if self.model else None,
            without={**ghdl, **self.without})
