# amaranth: UnusedElaboratable=no

"""What must hold of a component, as gateware that can be proved.

A contract puts a component on a bench that leaves every input free in every clock, also reset, and
watches it. Each property has a name, a sentence, a premise (when it says anything) and a
consequence. It becomes an assertion, and a cover that shows that its premise can come about.

A property of registers inside is as good as one about pins: induction starts from any state that
keeps all of them, and what makes it succeed is an invariant more, not a clock more.
"""

from collections.abc import Callable, Collection, Iterator, Mapping
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
"""What Amaranth takes for a value; its arithmetic is more than annotations can follow."""


@dataclass(frozen=True)
class Property:
    """What must hold.

    Attributes
    ----------
    name, description : str
        A few words, and one sentence.
    upset : bool
        It is about codes that no state machine gets into by itself.
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
        As the component takes them.
    real : bool
        They are those of the board, whose long times no cover can wait for: the other cases have
        the covers.
    upset : bool
        Every register of the component begins with any value, as if it had just been upset in
        whatever it did; only the properties about that are looked at.
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
    """The register of a state machine, and the codes of its states by name."""

    def __init__(self, register: Bits) -> None:
        self.register = register
        self.codes = {}
        for code in range(1 << len(register)):
            try:
                self.codes[register.decoder(code).partition("/")[0]] = code
            except KeyError:
                break

    def __call__(self, *names: str) -> Bits:
        """Be in one of these states."""
        return _any(self.register == self.codes[name] for name in names)

    def is_unused(self) -> Bits:
        """Be in a code that no state has."""
        return self.register > max(self.codes.values())


class Unknown(wiring.Component):
    """In place of a part of a component: what it says is anything, see :meth:`Contract.unknown`."""

    def __init__(self, part: wiring.Component) -> None:
        Fragment.get(part, None)  # else Amaranth says that it was made for nothing
        super().__init__(dict(part.signature.members))

    def elaborate(self, platform) -> Module:
        return Module()


class Contract:
    """A component, its free inputs, and what must hold of it.

    Parameters
    ----------
    dut : wiring.Component
        The component, not elaborated yet.
    describe : callable
        States the properties: is given this and `dut`.
    upset : bool
        See :class:`Case`.
    only : collection of str, optional
        Properties to assert; all by default.
    broken : bool
        Nothing is asserted: each property is a cover of the clock in which it breaks.

    Attributes
    ----------
    m : Module
        The bench, with the component in it.
    rst : Value
        What resets the component.
    properties : dict of str to Property
        What is stated.
    parts : bool
        State as well what a part states by itself, where its own proof is enough: then a mutant
        inside the part is seen as it is in the part by itself.
    fragment : Fragment
        The component, elaborated.
    upset : bool
        As given.
    kept : dict of str to Signal
        Registers of the contract itself, by name; of a part that keeps its own contract after
        the path, as in ``sequencer:under_way``.
    """

    parts = False

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
        """Write it for Yosys. An assertion has the name of its property, its cover a ``?`` more."""
        inputs = [Value.cast(value) for _, member, value in self._dut.signature.flatten(self._dut)
                  if member.flow == In]
        return rtlil.convert(self.m, name="top",
                             ports=[self._clock.clk, self.rst, *inputs, *self._free])

    # What a property is made of

    def implication(self, name: str, description: str, *, when: Bits, then: Bits,
                    upset: bool = False, lemma: bool = False) -> None:
        """State that in every clock with `when` there is `then`.

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
        """State `condition` of every clock; `cover` is when that is worth something.

        The rest is as in :meth:`implication`.
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
        """Put this name before those of all properties: of one part of several that are alike."""
        before = self._prefix
        self._prefix = f"{before}{name}-"
        yield
        self._prefix = before

    def keeps(self, path: str, component: "Component", *, reset: Bits = None) -> None:
        """State of a part inside what its own contract states.

        What it assumes of its inputs is a lemma here: it has to hold in this component. A case with
        `upset` leaves all of it to the part. What the part makes of inputs that this component
        never gives it is not seen, nor is anything that its contract restricts covers to: the
        proofs of the part by itself are about that.

        Parameters
        ----------
        path : str
            Leads to the part.
        component : Component
            Its contract.
        reset : Value, optional
            What resets it, if that is more than the reset of this component.
        """
        if self.upset:
            return
        before = self._prefix, self._root, self._assumed, self.rst
        self._prefix, self._root, self._assumed = f"{path}:", f"{path}.", 0
        self.rst = self.rst if reset is None else reset
        component.describe(self, self.part(""))
        self._prefix, self._root, self._assumed, self.rst = before

    def unknown(self, path: str) -> None:
        """Let an `Unknown` part inside say anything in any clock."""
        for names, member, value in self.part(path).signature.flatten(self.part(path)):
            if member.flow == Out:
                said = Value.cast(value)
                self.m.d.comb += said.eq(self.free(
                    len(said), name="_".join([path, *map(str, names)])))

    def assume(self, condition: Bits) -> None:
        """Leave out what the component is never given."""
        if self._root:
            self._assumed += 1
            self.invariant(f"assumed-{self._assumed}", "It is used as it is meant to be.",
                           condition, cover=condition, lemma=True)
        else:
            self.m.d.comb += Assume(condition)

    def restrict_covers(self, condition: Bits) -> None:
        """Let covers, and nothing else, look only where this holds: they are found sooner."""
        if not self._root:
            self.m.d.comb += Assume(condition, "restrict-covers")

    def past(self, value: Bits, *, init: int = 0) -> Any:
        """Return `value` one clock ago; `init` in the first clock. Reset does not touch it."""
        value = Value.cast(value)
        before = Signal(value.shape(), init=init, reset_less=True)
        self.m.d.sync += before.eq(value)
        return before

    def keep(self, shape, *, init: int = 0, name: str | None = None) -> Any:
        """Return a register of the contract's own, that reset does not touch; see `kept`."""
        register = Signal(shape, init=init, reset_less=True, name=name or "watched")
        self.kept[f"{self._prefix}{name}"] = register
        return register

    def part(self, path: str) -> Any:
        """Find a component inside, such as ``orders.divider``; an empty path is the outermost."""
        return next(origin for origin in self._inside(path).origins or ()
                    if isinstance(origin, wiring.Component))

    def _inside(self, path: str) -> Fragment:
        fragment = self.fragment
        for name in filter(None, f"{self._root}{path}".split(".")):
            fragment = fragment.find_subfragment(name)
        return fragment

    def signal(self, path: str) -> Any:
        """Find a signal that is driven inside, such as ``orders.divider.count``."""
        where, _, name = path.rpartition(".")
        fragment = self._inside(where)
        # A register comes before a port that has its name.
        for domain in sorted(fragment.statements, key="comb".__eq__):
            for signal in fragment.statements[domain]._lhs_signals():
                if signal.name == name:
                    return signal
        raise LookupError(f"no signal {path!r} is driven in the component")

    def state(self, path: str) -> State:
        """Find a state machine inside the component by the path and name that it was given."""
        return State(self.signal(f"{path}_state"))

    def free(self, shape, *, name: str) -> Any:
        """Return an input of the contract's own, that may be anything in any clock."""
        self._free.append(Signal(shape, name=name))
        return self._free[-1]

    def words(self, path: str) -> list[Any]:
        """Look into a memory inside, such as ``to_mill``: return its words."""
        depth, words = self.part(path).depth, []
        for address in range(depth):
            words.append(Signal(self.part(path).shape, name=f"word_{address}"))
            self._inside(path).read_port(
                domain="comb", addr=Const(address, range(depth)), data=words[-1], en=Const(1),
                transparent_for=())
        return words

    def write(self, path: str, words: Bits, *, when: Bits) -> None:
        """Write words of a bit to a memory inside, from address 0 on, all in a clock."""
        for address, word in enumerate(words):
            self._inside(path).write_port(
                domain="sync", addr=Const(address, range(self.part(path).depth)), data=word,
                en=when)

    def any_code(self, path: str) -> State:
        """Find a state machine that begins with any code in a case with `upset`, as all does."""
        return self.state(path)

    def leaves_unused_codes(self, path: str, *, fault: Bits, shows: Bits,
                            reset: Bits = None) -> None:
        """State what every state machine does about an upset register.

        Parameters
        ----------
        path : str
            As in :meth:`state`.
        fault : Value
            Shows an upset, and nothing else.
        shows : Value
            What else there is to see of an upset: that nothing is done.
        reset : Value, optional
            What resets it, if that is more than the reset of the component.
        """
        state = self.any_code(path)
        name = path.rpartition(".")[2].replace("_", "-")
        known, was_reset = self.past(1), self.past(self.rst if reset is None else reset)
        if max(state.codes.values()) + 1 < 1 << len(state.register):
            self.implication(f"{name}-leaves-unused-codes",
                             "From a code that no state has, FAULT comes with the next clock.",
                             when=known & self.past(state.is_unused()) & ~was_reset,
                             then=state("FAULT"), upset=True)
            self.implication(f"{name}-shows-unused-codes",
                             "A code that no state has shows at once, and nothing is done in it.",
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
        self.invariant(f"{name}-no-false-alarm", "No fault shows unless the register was upset.",
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
        Makes the component of the parameters of a case.
    describe : callable
        States its properties; see :class:`Contract`.
    cases : tuple of Case
        Mutants that break its properties are looked for in one after the other.
    depth : int
        Clocks in which every premise can come about and a mutant can break every property.
    """

    make: Callable[..., wiring.Component]
    describe: Callable[..., None]
    cases: tuple[Case, ...] = (Case(),)
    depth: int = 12

    def contract(self, case: Case, *, only: Collection[str] | None = None,
                 broken: bool = False) -> Contract:
        """Set up a case; see :class:`Contract`."""
        return Contract(self.make(**case.parameters), self.describe, upset=case.upset, only=only,
                        broken=broken)

    def properties(self) -> dict[str, Property]:
        """List what is stated in any case, by name."""
        return {name: found for case in self.cases
                for name, found in self.contract(case).properties.items()}
