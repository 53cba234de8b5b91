# amaranth: UnusedElaboratable=no

"""Contracts: the properties of a component, as gateware that can be proved.

A contract puts a component on a bench whose inputs, reset among them, are free in every clock. Each
property has a name, a sentence, a premise and a consequence. It becomes an assertion, and a cover
that shows that the premise is reachable.

Properties may also be about internal registers: induction starts from any state that satisfies all
of them, and it succeeds by more invariants rather than by more clocks.
"""

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from amaranth import ClockDomain, Const, Fragment, Module, Signal, Value
from amaranth.back import rtlil
from amaranth.hdl import Assert, Assume, Cover
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

__all__ = ["Bits", "Case", "Component", "Contract", "Property", "State", "Unknown"]

Bits: TypeAlias = Any
"""A value in Amaranth's sense; its arithmetic is beyond what annotations can express."""


@dataclass(frozen=True)
class Property:
    """A property.

    Attributes
    ----------
    name, description : str
        A few words, and one sentence.
    upset : bool
        It is about codes that no FSM reaches by itself.
    lemma : bool
        No mutant of the gateware has to break it: an induction needs it, or it is stated of a part
        inside, and a mutant breaks it in the part by itself.
    """

    name: str
    description: str
    upset: bool = False
    lemma: bool = False


@dataclass(frozen=True)
class Case:
    """Parameters with which a component is proved.

    Attributes
    ----------
    parameters : mapping
        Arguments of the component.
    real : bool
        They are those of the board, whose long times are beyond covers: the other cases have
        the covers.
    upset : bool
        Every register of the component starts with any value, as after an upset; only properties
        about upsets are asserted.
    """

    parameters: Mapping[str, object] = field(default_factory=dict)
    real: bool = False
    upset: bool = False

    def __str__(self) -> str:
        def brief(value: object) -> str:
            if not isinstance(value, list | tuple):
                return str(value)
            rows = [len(row) for row in value[:1] if isinstance(row, list | tuple)]
            return "x".join(map(str, [len(value), *rows]))

        words = [f"{name}={brief(value)}" for name, value in self.parameters.items()]
        return " ".join([*words, *(["upset"] if self.upset else [])]) or "-"


class State:
    """The register of an FSM, and the codes of its states by name."""

    def __init__(self, register: Bits) -> None:
        self.register = register
        self.codes = {}
        for code in range(1 << len(register)):
            try:
                self.codes[register.decoder(code).partition("/")[0]] = code
            except KeyError:
                break

    def __call__(self, *names: str) -> Bits:
        """Return whether it is in one of these states."""
        return _any(self.register == self.codes[name] for name in names)

    def is_unused(self) -> Bits:
        """Return whether its code belongs to no state."""
        return self.register > max(self.codes.values())


class Unknown(wiring.Component):
    """Replaces a part of a component; its outputs are free, see :meth:`Contract.unknown`."""

    def __init__(self, part: wiring.Component) -> None:
        Fragment.get(part, None)  # else Amaranth warns that it is unused
        super().__init__(dict(part.signature.members))

    def elaborate(self, platform) -> Module:
        return Module()


class Contract:
    """A component, its free inputs, and its properties.

    Parameters
    ----------
    dut : wiring.Component
        The component, not elaborated yet.
    describe : callable
        States the properties; its arguments are this contract and `dut`.
    upset : bool
        See :class:`Case`.
    only : collection of str, optional
        Properties to assert; all by default.
    broken : bool
        Assert nothing: each property becomes a cover of the clock in which it fails.

    Attributes
    ----------
    m : Module
        The bench, with the component in it.
    rst : Value
        The reset of the component.
    properties : dict of str to Property
        The stated properties.
    parts : bool
        State the contracts of parts as well, even where their own proofs are enough: then a mutant
        inside a part is found as in the part by itself.
    restricts : bool
        Covers are restricted as the contract has it.
    fragment : Fragment
        The component, elaborated.
    upset : bool
        As given.
    kept : dict of str to Signal
        Registers of the contract itself, by name; those of a part's contract after its path, as in
        ``sequencer:under_way``.
    """

    parts = False
    restricts = True

    def __init__(self, dut: wiring.Component, describe: Callable, *, upset: bool = False,
                 only: Collection[str] | None = None, broken: bool = False) -> None:
        self.m: Any = Module()
        self.properties: dict[str, Property] = {}
        self.kept: dict[str, Any] = {}
        self._clock, self._free = ClockDomain("sync"), []
        self._prefix = self._root = ""
        self.rst: Any = self._clock.rst
        self._assumed = 0
        self._dut, self.upset, self._only, self._broken = dut, upset, only, broken
        self.fragment = Fragment.get(dut, None)
        self.m.domains.sync = self._clock
        self.m.submodules.dut = self.fragment
        describe(self, dut)

    def rtlil(self) -> str:
        """Return it as RTLIL. An assertion is named like its property, its cover with a ``?``."""
        inputs = [Value.cast(value) for _, member, value in self._dut.signature.flatten(self._dut)
                  if member.flow == In]
        return rtlil.convert(self.m, name="top",
                             ports=[self._clock.clk, self.rst, *inputs, *self._free])

    # Elements of properties

    def implication(self, name: str, description: str, *, when: Bits, then: Bits,
                    upset: bool = False, lemma: bool = False) -> None:
        """State that `then` holds in every clock with `when`.

        Parameters
        ----------
        name : str
            A few words, with hyphens.
        description : str
            One sentence.
        when, then : Value
            Premise, which is also covered, and consequence.
        upset, lemma : bool
            As in :class:`Property`.
        """
        when = Value.cast(when).any()
        self._property(name, description, ~when | Value.cast(then).any(), when, upset, lemma)

    def invariant(self, name: str, description: str, condition: Bits, *, cover: Bits,
                  upset: bool = False, lemma: bool = False) -> None:
        """State `condition` for every clock; `cover` is a clock in which it is of interest.

        Other parameters are those of :meth:`implication`.
        """
        self._property(name, description, Value.cast(condition).any(), Value.cast(cover).any(),
                       upset, lemma)

    def _property(self, name: str, description: str, kept: Bits, cover: Bits, upset: bool,
                  lemma: bool) -> None:
        name = f"{self._prefix}{name}"
        if upset != self.upset:
            return
        if name in self.properties:
            raise ValueError(f"there are two properties {name!r}")
        self.properties[name] = Property(name, description, upset, lemma or bool(self._root))
        if self._only is not None and name not in self._only:
            return
        if self._broken:
            self.m.d.comb += Cover(~kept, f"{name}?")
        else:
            self.m.d.comb += [Assert(kept, name), Cover(cover, f"{name}?")]

    @contextmanager
    def each(self, name: str) -> Iterator[None]:
        """Put a prefix before the names of properties, for one of several equal parts."""
        before = self._prefix
        self._prefix = f"{before}{name}-"
        yield
        self._prefix = before

    def keeps(self, path: str, component: "Component", *, reset: Bits = None) -> None:
        """State the contract of a part inside.

        Its assumptions become lemmas here: they must hold in this component. A case with `upset`
        leaves all of it to the part. Behaviour of the part for inputs that this component never
        gives it is not covered, nor what its contract restricts covers to: that is in the proofs of
        the part by itself.

        Parameters
        ----------
        path : str
            Path of the part.
        component : Component
            Its contract.
        reset : Value, optional
            The reset of the part, if it is more than the reset of this component.
        """
        if self.upset:
            return
        before = self._prefix, self._root, self._assumed, self.rst
        self._prefix, self._root, self._assumed = f"{path}:", f"{path}.", 0
        self.rst = self.rst if reset is None else reset
        component.describe(self, self.part(""))
        self._prefix, self._root, self._assumed, self.rst = before

    def unknown(self, path: str) -> None:
        """Let the outputs of an `Unknown` part be anything in any clock."""
        for names, member, value in self.part(path).signature.flatten(self.part(path)):
            if member.flow == Out:
                free = Value.cast(value)
                self.m.d.comb += free.eq(self.free(
                    len(free), name="_".join([path, *map(str, names)])))

    def assume(self, condition: Bits) -> None:
        """Assume a condition on inputs that the component's environment meets."""
        if self._root:
            self._assumed += 1
            self.invariant(f"assumed-{self._assumed}", "The assumptions on its inputs hold.",
                           condition, cover=condition, lemma=True)
        else:
            self.m.d.comb += Assume(condition)

    def restrict_covers(self, condition: Bits) -> None:
        """Restrict covers, and nothing else, to clocks in which this holds, to find them sooner."""
        if self.restricts and not self._root:
            self.m.d.comb += Assume(condition, "restrict-covers")

    def past(self, value: Bits, *, init: int = 0) -> Any:
        """Return `value` one clock ago; `init` in the first clock. Reset has no effect on it."""
        value = Value.cast(value)
        before = Signal(value.shape(), init=init, reset_less=True)
        self.m.d.sync += before.eq(value)
        return before

    def keep(self, shape, *, init: Any = 0, name: str | None = None) -> Any:
        """Return a register of the contract's own, which reset does not change; see `kept`."""
        register = Signal(shape, init=init, reset_less=True, name=name or "watched")
        self.kept[f"{self._prefix}{name}"] = register
        return register

    def part(self, path: str) -> Any:
        """Return a component inside, such as ``orders.divider``; an empty path is the outermost."""
        return next(origin for origin in self._inside(path).origins or ()
                    if isinstance(origin, wiring.Component))

    def _inside(self, path: str) -> Fragment:
        fragment = self.fragment
        for name in filter(None, f"{self._root}{path}".split(".")):
            fragment = fragment.find_subfragment(name)
        return fragment

    def signal(self, path: str) -> Any:
        """Return a signal that is driven inside, such as ``orders.divider.count``."""
        where, _, name = path.rpartition(".")
        fragment = self._inside(where)
        # A register comes before a port that has its name.
        for domain in sorted(fragment.statements, key="comb".__eq__):
            for signal in fragment.statements[domain]._lhs_signals():
                if signal.name == name:
                    return signal
        raise LookupError(f"no signal {path!r} is driven in the component")

    def state(self, path: str) -> State:
        """Return an FSM inside the component by its path and name."""
        return State(self.signal(f"{path}_state"))

    def free(self, shape, *, name: str) -> Any:
        """Return an input of the contract's own, which is free in every clock."""
        self._free.append(Signal(shape, name=name))
        return self._free[-1]

    def words(self, path: str) -> list[Any]:
        """Return the words of a memory inside, such as ``to_mill``."""
        depth, words = self.part(path).depth, []
        for address in range(depth):
            words.append(Signal(self.part(path).shape, name=f"word_{address}"))
            self._inside(path).read_port(
                domain="comb", addr=Const(address, range(depth)), data=words[-1], en=Const(1),
                transparent_for=())
        return words

    def write(self, path: str, words: Iterable[Bits], *, when: Bits) -> None:
        """Write words to a memory inside, from address 0 on, all in one clock.

        What is read in that clock is what is written: in the first clock it is as if the memory
        had held it from power-up.
        """
        memory = self._inside(path)
        written = tuple(memory.write_port(
            domain="sync", addr=Const(address, range(self.part(path).depth)), data=word, en=when)
            for address, word in enumerate(words))
        for port in memory._read_ports:
            if port._domain != "comb":
                port._transparent_for += written

    def any_code(self, path: str) -> State:
        """Return an FSM that starts with any code in a case with `upset`."""
        return self.state(path)

    def leaves_unused_codes(self, path: str, *, fault: Bits, shows: Bits,
                            reset: Bits = None) -> None:
        """State the response of every FSM to an upset register.

        Parameters
        ----------
        path : str
            As in :meth:`state`.
        fault : Value
            Shows an upset, and nothing else.
        shows : Value
            Other effects of an upset: that nothing is done.
        reset : Value, optional
            The reset of the FSM, if it is more than the reset of the component.
        """
        state = self.any_code(path)
        name = path.rpartition(".")[2].replace("_", "-")
        known, was_reset = self.past(1), self.past(self.rst if reset is None else reset)
        if max(state.codes.values()) + 1 < 1 << len(state.register):
            self.implication(f"{name}-leaves-unused-codes",
                             "An unused code is followed by FAULT in the next clock.",
                             when=known & self.past(state.is_unused()) & ~was_reset,
                             then=state("FAULT"), upset=True)
            self.implication(f"{name}-shows-unused-codes",
                             "An unused code shows at once, and nothing is done in it.",
                             when=state.is_unused(), then=fault & shows, upset=True)
        self.implication(f"{name}-reset-leaves-any-code", "Reset ends any code, FAULT among them.",
                         when=known & was_reset, then=state.register == state.register.init,
                         upset=True)
        self.implication(f"{name}-fault-stays", "FAULT stays until reset.",
                         when=known & self.past(state("FAULT")) & ~was_reset, then=state("FAULT"),
                         upset=True)
        self.implication(f"{name}-fault-shows", "FAULT is shown, and nothing is done in it.",
                         when=state("FAULT"), then=fault & shows, upset=True)
        self.invariant(f"{name}-codes-in-use", "No input leads to FAULT or to an unused code.",
                       ~state("FAULT") & ~state.is_unused(),
                       cover=state.register != state.register.init)
        self.invariant(f"{name}-no-false-alarm", "No fault is shown unless the register was upset.",
                       ~fault, cover=state.register != state.register.init)


def _any(values) -> Bits:
    result = Value.cast(0)
    for value in values:
        result = result | value
    return result.any()


@dataclass(frozen=True)
class Component:
    """A component, its properties, and the cases in which they are proved.

    Attributes
    ----------
    make : callable
        Makes the component from the parameters of a case.
    describe : callable
        States its properties; see :class:`Contract`.
    cases : tuple of Case
        Mutants are searched for in one case after the other.
    depth : int
        Clocks within which every premise is reachable, and a mutant can violate every property.
    """

    make: Callable[..., wiring.Component]
    describe: Callable[..., None]
    cases: tuple[Case, ...] = (Case(),)
    depth: int = 12

    def contract(self, case: Case, *, only: Collection[str] | None = None,
                 broken: bool = False) -> Contract:
        """Make the contract of a case; see :class:`Contract`."""
        return Contract(self.make(**case.parameters), self.describe, upset=case.upset, only=only,
                        broken=broken)

    def properties(self) -> dict[str, Property]:
        """Return the properties of all cases, by name."""
        return {name: found for case in self.cases
                for name, found in self.contract(case).properties.items()}
