# amaranth: UnusedElaboratable=no

# pyright: reportIncompatibleMethodOverride=false, reportAssignmentType=false
# pyright: reportGeneralTypeIssues=false

"""A mistake in a design: a signal, named by its path, is assigned something else.

It is planted in the fragment and not in the source text, so that it is in the design for every
engine, for the netlist and for proofs.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from difflib import get_close_matches
from typing import Any

from amaranth import Fragment, Signal, Value
from amaranth.hdl import _ast
from amaranth.hdl._xfrm import StatementTransformer, ValueTransformer
from amaranth.lib import wiring

from .design import Design

__all__ = ["Find", "Mistake", "connections"]

Find = Callable[[str], Any]
"""Returns a signal of the design by its path."""


@dataclass(frozen=True)
class Mistake:
    """A mistake to plant in a design.

    A path consists of the names of the submodules that lead to a signal, and its own, such as
    ``driver.coils``. The first of them may be left out: then the signal nearest to the top is
    meant, if it is unique. Ports of the design have a name only.

    Attributes
    ----------
    path : str
        A signal that statements assign: a register or a combinational signal.
    becomes : callable, optional
        Returns the new right-hand side. Arguments: the correct one, for a register its next value,
        and a function that returns other signals by their paths.
    reset_less : bool, optional
        Whether the register keeps its value in a reset.
    init : int, optional
        Value of the register at power-up.
    """

    path: str
    becomes: Callable[[Any, Find], Any] | None = None
    reset_less: bool | None = None
    init: int | None = None

    def planted(self, design: Design) -> Design:
        """Return the design with the mistake in it; the design passed in must not be used any more.

        Raises
        ------
        LookupError
            If a path has no signal or several, or the signal is never assigned.
        """
        fragment = Fragment.get(design.top, None)
        self.plant(fragment, {**design.inputs, **design.outputs})
        return replace(design, top=fragment)

    def plant(self, fragment: Fragment, ports: dict[str, Any] | None = None) -> None:
        """Plant it in a fragment; raises like :meth:`planted`.

        Parameters
        ----------
        fragment : Fragment
            The fragment, changed in place.
        ports : dict of str to Value, optional
            Signals that have a name only.
        """
        def find(path: str) -> Any:
            if ports and path in ports:
                return Value.cast(ports[path])
            return _find(fragment, path)

        signal = find(self.path)
        if self.reset_less is not None:
            signal._reset_less = self.reset_less
        if self.init is not None:
            signal._init = self.init
        if self.becomes is None:
            return
        inside, domain = _driver(fragment, signal, self.path)
        right: Any = Signal.like(signal, name=f"{signal.name}_right", attrs={})
        wrong = self.becomes(right, find)
        statements = inside.statements[domain]
        inside.statements[domain] = type(statements)()
        if domain == "comb":
            rest = _Assigning(lambda s: right if s is signal else s)(statements)
        else:
            following = _Assigning(lambda s: right if s is signal else _unused(s),
                                   only=signal)(statements)
            inside.add_statements("comb", right.eq(signal), *following)
            rest = _Assigning(lambda s: _unused(s) if s is signal else s,
                              without=signal)(statements)
        inside.add_statements(domain, *rest, signal.eq(wrong))


def _unused(signal: Signal) -> Signal:
    """A sink for parts of an assignment that are not of interest."""
    return Signal.like(signal, name=f"{signal.name}_unused", attrs={})


class _Targets(ValueTransformer):
    """Replace signals on the left-hand side of an assignment; those that it reads stay."""

    def __init__(self, other: Callable[[Signal], Signal]) -> None:
        self._other = other

    def on_Signal(self, value):
        return self._other(value)

    def on_Part(self, value):
        return _ast.Part(self.on_value(value.value), value.offset, value.width, value.stride)

    def on_SwitchValue(self, value):
        return _ast.SwitchValue(value.test, [(patterns, self.on_value(one))
                                             for patterns, one in value.cases])


class _Assigning(StatementTransformer):
    """Redirect assignments; drop those that are not `only` to one, or to one."""

    def __init__(self, other: Callable[[Signal], Signal], *, only: Signal | None = None,
                 without: Signal | None = None) -> None:
        self._targets, self._only, self._without = _Targets(other), only, without

    def on_Assign(self, stmt):
        signals = list(stmt._lhs_signals())
        if self._only is not None and not any(s is self._only for s in signals):
            return []
        if self._without is not None and all(s is self._without for s in signals):
            return []
        return _ast.Assign(self._targets(stmt.lhs), stmt.rhs)

    def on_Print(self, stmt):
        return [] if self._only is not None else stmt

    on_Property = on_Print


def _walk(fragment: Fragment, path: str = "") -> Iterator[tuple[str, Fragment]]:
    yield path, fragment
    for inner, name, _ in fragment.subfragments:
        yield from _walk(inner, f"{path}{name}.")


def _driver(fragment: Fragment, signal: Signal, path: str) -> tuple[Fragment, str]:
    for _, inside in _walk(fragment):
        for domain, statements in inside.statements.items():
            if any(s is signal for s in statements._lhs_signals()):
                return inside, domain
    raise LookupError(f"nothing assigns {path!r} in this design")


def connections(fragment: Fragment) -> dict[str, Signal]:
    """Return the ports in a design, by path, that are connected or combinational."""
    assigned = {id(signal) for _, inside in _walk(fragment)
                for signal in inside.statements.get("comb", _ast._StatementList())._lhs_signals()}
    found: dict[str, Signal] = {}
    for path, port in _ports(fragment):
        if isinstance(port, Signal) and id(port) in assigned:
            found.setdefault(path, port)
    return found


def _ports(fragment: Fragment) -> Iterator[tuple[str, Value]]:
    for path, inside in _walk(fragment):
        for origin in inside.origins or ():
            if isinstance(origin, wiring.Component):
                for names, _, value in origin.signature.flatten(origin):
                    yield f"{path}{'__'.join(map(str, names))}", Value.cast(value)


def _named(fragment: Fragment) -> Iterator[tuple[str, Signal]]:
    """Name registers, ports of components, and other assigned signals."""
    ports: dict[int, tuple[str, Any]] = {}
    for path, port in _ports(fragment):
        ports.setdefault(id(port), (path, port))
    assigned = [(domain, id(signal), (f"{path}{signal.name}", signal))
                for path, inside in _walk(fragment)
                for domain, statements in inside.statements.items()
                for signal in statements._lhs_signals() if isinstance(signal, Signal)]
    yield from (ports.get(key, named) for domain, key, named in assigned if domain != "comb")
    yield from ports.values()
    yield from (named for domain, key, named in assigned if domain == "comb" and key not in ports)


def _find(fragment: Fragment, path: str) -> Signal:
    names: dict[str, Signal] = {}
    for name, signal in _named(fragment):
        names.setdefault(name, signal)
    found = [name for name in names if name == path or name.endswith(f".{path}")]
    found = [name for name in found if name.count(".") == min(n.count(".") for n in found)]
    if len(found) == 1:
        return names[found[0]]
    if found:
        raise LookupError(f"{path!r} matches {', '.join(found)}")
    near = get_close_matches(path, names, 5, 0)
    raise LookupError(f"no signal {path!r} in this design; there are {', '.join(near)} ...")
