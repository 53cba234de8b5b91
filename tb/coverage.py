"""Coverage: states and transitions of FSMs by proof, lines and toggles by simulation.

FSMs are those that :func:`fresa.fsm.leave_unused_codes` has marked. Their transitions are found in
the elaborated gateware; a cover shows that inputs lead there from power-up. The state for upset
registers is covered where unused codes exist, which lead to it; where every code is in use only an
upset itself does.
"""

from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeAlias

from amaranth import Fragment, Signal
from amaranth.hdl import Cover
from amaranth.hdl._ast import Assign, Switch

from .contracts import Component
from .contracts.contract import Case, Contract, State
from .contracts.proof import reach
from .engines.coverage import CoverageEngine, NamedCoverageEngine, Point
from .machines import machines
from .mutation.benches import kind_of
from .registry import components, duts
from .runners import stimuli

__all__ = ["Reached", "cover_lines", "cover_states", "with_state_machine"]

#: Source of the transition that belongs to no state.
UNUSED = "unused codes"


FURTHER = 12
"""Clocks beyond those of its contract, in which a state or a transition is still sought."""


@dataclass(frozen=True)
class Reached:
    """A state or a transition, and the first clock in which it is reached.

    Attributes
    ----------
    component : str
        The component of the FSM.
    kind : str
        ``state`` or ``transition``.
    name : str
        ``IDLE``, or ``IDLE -> DECIDE``.
    upset : bool
        Whether reaching it takes a register that starts with any code.
    clock : int or None
        Counted from power-up; None if it was not reached.
    """

    component: str
    kind: str
    name: str
    upset: bool
    clock: int | None = None


def with_state_machine() -> dict[str, list[Component]]:
    """Return the gateware that has a state machine of its own: all its contracts, by a name."""
    same: dict[type, dict[str, Component]] = {}
    for name, component in components().items():
        same.setdefault(_kind(component), {})[name] = component
    found = {}
    for group in same.values():
        for name, component in group.items():
            if _machine(component, component.cases[0]) is not None:
                found[name] = list(group.values())
                break
    return found


def cover_states(name: str, contracts: Sequence[Component], folder: Path,
                 lock: AbstractContextManager) -> list[Reached]:
    """Search for inputs that lead to every state and transition of a component.

    Any contract of the same gateware will do: what one assumes of its inputs may exclude a
    transition that is there for the others. What is left of all is sought once more, `FURTHER`
    clocks further, and without what contracts restrict their own covers to.

    Parameters
    ----------
    name : str
        Its name in the points.
    contracts : sequence of Component
        Its contracts, as `with_state_machine` gives them.
    folder : Path
        Empty folder to work in.
    lock : context manager
        Held during elaboration.
    """
    wanted: list[Reached] = []
    for further in (False, True):
        for component, case in ((each, case) for each in contracts for case in each.cases
                                if not case.real):
            left = {_label(point) for point in wanted
                    if point.upset == case.upset and point.clock is None}
            if wanted and not left:
                continue
            with lock:
                contract, covers = _covers(name, component, case, left, restricts=not further)
            wanted = wanted or covers
            clocks = reach(contract, folder, component.depth + FURTHER * further, upset=case.upset)
            wanted = [point if point.clock is not None else
                      replace(point, clock=clocks.get(_label(point))) for point in wanted]
    return wanted


def _kind(component: Component) -> type:
    """Return the class of its gateware: contracts may have one derived from it."""
    classes = kind_of(component).__mro__
    return next((one for one in classes if one.__module__.startswith("fresa.")), classes[0])


Transition: TypeAlias = tuple[Collection[str] | None, int]
"""Source codes as patterns, or None for any; and the destination code."""


def _machine(component: Component, case: Case) -> tuple[Signal, list[Transition]] | None:
    """Return the register of a component's own FSM, and its transitions."""
    fragment = Fragment.get(component.make(**case.parameters), None)
    for statements in fragment.statements.values():
        for signal in statements._lhs_signals():
            if "fsm_encoding" in signal.attrs:
                return signal, list(_transitions(statements, signal, None))
    return None


def _transitions(statements, register: Signal, codes) -> Iterator[Transition]:
    for statement in statements:
        if isinstance(statement, Switch):
            for patterns, body, *_ in statement.cases:
                yield from _transitions(
                    body, register, patterns if statement.test is register else codes)
        elif isinstance(statement, Assign) and statement.lhs is register:
            yield codes, statement.rhs.value


def _covers(name: str, component: Component, case: Case, left: Collection[str], *,
            restricts: bool) -> tuple[Contract, list[Reached]]:
    """Make a case without properties that covers the FSM; return it and its points.

    Points that are not `left`, by their labels, are not covered; all are if there is none.
    """
    machine = _machine(component, case)
    assert machine is not None
    points: list[Reached] = []

    def describe(c: Contract, dut) -> None:
        c.restricts = restricts
        component.describe(c, dut)  # for its assumptions
        register = c.signal(str(machine[0].name))
        state = State(register)
        names = {code: word for word, code in state.codes.items()}
        before, goes_on = c.past(register), c.past(1) & ~c.past(c.rst)
        transitions = {
            (names[code], names[to]) for codes, to in machine[1] if codes is not None
            for code in names if f"{code:0{len(register)}b}" in codes}
        fault = next(names[to] for codes, to in machine[1] if codes is None)

        def cover(kind: str, what: str, upset: bool, when) -> None:
            point = Reached(name, kind, what, upset)
            points.append(point)
            if upset == case.upset and (not left or _label(point) in left):
                c.m.d.comb += Cover(when, f"{_label(point)}?")

        unused = max(names) + 1 < 1 << len(register)
        for word, code in state.codes.items():
            if word != fault:
                cover("state", word, False, register == code)
            elif unused:  # with every code in use nothing leads there but an upset itself
                cover("state", word, True, goes_on & (before != code) & (register == code))
        for old, new in sorted(transitions):
            cover("transition", f"{old} -> {new}", False,
                  goes_on & (before == state.codes[old]) & (register == state.codes[new]))
        if unused:
            cover("transition", f"{UNUSED} -> {fault}", True,
                  goes_on & (before > max(names)) & (register == state.codes[fault]))

    contract = Contract(component.make(**case.parameters), describe, upset=case.upset, only=())
    return contract, points


def _label(point: Reached) -> str:
    return f"{point.kind}:{point.name}".replace(" ", "_")


def cover_lines(name: str, seed: int, clocks: int,
                advance: Callable[[int], object] = lambda clocks: None) -> list[Point]:
    """Run the stimulus of `tools.cosim`; return the coverage points.

    Parameters
    ----------
    name : str
        The machine. If its declaration has an explorer, that continues the run.
    seed, clocks : int
        As in :func:`tb.runners.stimuli`.
    advance : callable
        Called with the number of clocks done.
    """
    dut, goal = duts()[name], machines()[name].coverage
    kind = NamedCoverageEngine if goal and goal.named else CoverageEngine
    with kind(dut.shared) as engine:
        for block in stimuli(dut, seed, clocks):
            engine.apply(block, ())
            advance(len(next(iter(block.values()))))
        if goal and goal.explore:
            goal.explore(engine)
        return engine.points()
