"""Contracts of parts, kept also where the part is inside a machine.

A machine states what people rely on; its parts state the rest, each by itself. A mutant of a part
that is inside must break the contract of that part, wherever it is: so the properties of the part
are stated there too. What the part assumes of its inputs has to hold in the machine.
"""

from collections.abc import Callable
from typing import Any

from ..contracts import COMPONENTS
from ..contracts.contract import Bits, Contract, State

__all__ = ["keep_inside"]


class _Inside:
    """What the contract of a part sees of the contract of the whole."""

    def __init__(self, whole: Contract, path: str, rst: Bits) -> None:
        self._whole, self._path = whole, path
        self.m, self.rst = whole.m, rst
        self.kept: dict[str, Bits] = {}
        self.past = whole.past
        self._assumed = 0

    def _at(self, path: str) -> str:
        return ".".join(filter(None, [self._path, path]))

    def implication(self, name: str, description: str, **options: Any) -> None:
        self._whole.implication(f"{self._path}:{name}", description, **options)

    def invariant(self, name: str, description: str, condition: Bits, **options: Any) -> None:
        self._whole.invariant(f"{self._path}:{name}", description, condition, **options)

    def assume(self, condition: Bits) -> None:
        self._assumed += 1
        self.invariant(f"assumed-{self._assumed}", "It is used as it is meant to be.", condition,
                       cover=condition)

    def restrict_covers(self, condition: Bits) -> None:
        pass

    def keep(self, shape: Any, *, init: int = 0, name: str | None = None) -> Any:
        register = self._whole.keep(shape, init=init, name=name)
        self.kept[name or ""] = register
        return register

    def part(self, path: str) -> Any:
        return self._whole.part(self._at(path))

    def signal(self, path: str) -> Any:
        return self._whole.signal(self._at(path))

    def state(self, path: str) -> State:
        return self._whole.state(self._at(path))

    def any_code(self, path: str) -> State:
        return self._whole.any_code(self._at(path))

    def leaves_unused_codes(self, path: str, **options: Any) -> None:
        Contract.leaves_unused_codes(self, path, **options)  # type: ignore


def keep_inside(whole: Contract, path: str, mode: Bits) -> None:
    """Let what a controller has inside keep its contract: the sequencer, and manual control.

    Parameters
    ----------
    whole : Contract
        Of the machine.
    path : str
        Leads to the controller.
    mode : Value
        1 in automatic mode; in manual mode the sequencer is held in reset.
    """
    prefix = f"{path}." if path else ""
    _keep("manual", _Inside(whole, f"{prefix}manual", whole.rst))
    inside = _Inside(whole, f"{prefix}sequencer", whole.rst | ~mode)
    _keep("sequencer", inside)
    order = whole.state(f"{prefix}automatic.orders.order_state")
    inside.invariant("under-way-by-order", "What moves was ordered.",
                     inside.kept["under_way"] | order("REST", "FAULT"), cover=order("MOVING"),
                     bug=())
    moves = inside.part("").moves
    inside.invariant("taken-at-once", "A move is offered when it can be taken.",
                     ~moves.valid | moves.ready | order("FAULT"), cover=moves.valid)


def _keep(name: str, inside: _Inside) -> None:
    describe: Callable[[Any, Any], None] = COMPONENTS[name].describe
    describe(inside, inside.part(""))
