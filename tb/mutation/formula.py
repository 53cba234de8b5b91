"""Netlists as formulas: unrolled over clocks, mutants as what differs, decided by z3.

Equal formulas are the same number, however they came about. So a mutant costs what it changes, and
where it changes nothing that matters there is nothing left to decide.
"""

import heapq
import resource
import subprocess
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import Literal, TypeAlias

from ..contracts.proof import solver
from .netlist import FALSE, TRUE, Netlist

__all__ = ["Formulas", "Frame", "Unrolled", "limit_processor"]

NO, YES = 0, 1

Frame: TypeAlias = Mapping[int, int]
"""Formulas of nets in one clock; what is not in it is as in the component without mutants."""


class Formulas:
    """Formulas of variables, each known by a number whose lowest bit says "not"."""

    def __init__(self) -> None:
        self._nodes: list[tuple[int, ...]] = [()]
        self._known: dict[tuple[int, ...], int] = {}

    def __len__(self) -> int:
        return len(self._nodes)

    def variable(self) -> int:
        """Make a variable."""
        self._nodes.append(())
        return 2 * (len(self._nodes) - 1)

    def forget(self, size: int) -> None:
        """Forget all formulas but the first so many."""
        for key in self._nodes[size:]:
            self._known.pop(key, None)
        del self._nodes[size:]

    def _node(self, *key: int) -> int:
        number = self._known.get(key)
        if number is None:
            self._nodes.append(key)
            number = self._known[key] = 2 * (len(self._nodes) - 1)
        return number

    def both(self, a: int, b: int) -> int:
        """Return a and b."""
        if a > b:
            a, b = b, a
        if a == NO or a == b ^ 1:
            return NO
        if a == YES or a == b:
            return b
        return self._node(a, b)

    def either(self, a: int, b: int) -> int:
        """Return a or b."""
        return self.both(a ^ 1, b ^ 1) ^ 1

    def differ(self, a: int, b: int) -> int:
        """Return whether a is not b."""
        turn = (a ^ b) & 1
        a, b = sorted((a & ~1, b & ~1))
        if a == b:
            return turn
        if a == 0:
            return b ^ turn
        return self._node(a, b, -1) ^ turn

    def choose(self, a: int, b: int, which: int) -> int:
        """Return b where `which` is, and a elsewhere."""
        if which & 1:
            a, b, which = b, a, which ^ 1
        if which == NO or a == b:
            return a
        if a == b ^ 1:
            return self.differ(a, which)
        if a <= YES:
            return self.both(b, which) if a == NO else self.either(b, which ^ 1)
        if b <= YES:
            return self.both(a, which ^ 1) if b == NO else self.either(a, which)
        return self._node(a, b, which, -2)

    def any_of(self, items: Iterable[int]) -> int:
        """Return whether any of them is."""
        result = NO
        for item in items:
            result = self.either(result, item)
        return result

    def all_of(self, items: Iterable[int]) -> int:
        """Return whether all of them are."""
        return self.any_of(item ^ 1 for item in items) ^ 1

    def gate(self, kind: str, x: Sequence[int]) -> int:
        """Return what a gate gives."""
        match kind:
            case "$_AND_":
                return self.both(x[0], x[1])
            case "$_OR_":
                return self.either(x[0], x[1])
            case "$_XOR_":
                return self.differ(x[0], x[1])
            case "$_MUX_":
                return self.choose(x[0], x[1], x[2])
            case "$_NOT_":
                return x[0] ^ 1
            case "$_BUF_":
                return x[0]
            case "$_XNOR_":
                return self.differ(x[0], x[1]) ^ 1
            case "$_NAND_":
                return self.both(x[0], x[1]) ^ 1
            case "$_NOR_":
                return self.either(x[0], x[1]) ^ 1
            case "$_ANDNOT_":
                return self.both(x[0], x[1] ^ 1)
            case _:  # $_ORNOT_
                return self.either(x[0], x[1] ^ 1)

    def solve(self, goal: int, values: Sequence[int] = (), *, seconds: float = 10
              ) -> dict[int, int] | Literal[False] | None:
        """Look for levels of the variables with which `goal` is.

        Parameters
        ----------
        goal : int
            What is to be.
        values : sequence of int
            Formulas whose values are told if it can be.
        seconds : float
            Time of a processor to look, see :func:`limit_processor`.

        Returns
        -------
        dict or False or None
            The values, False if it can never be, or None if time was up.
        """
        if goal <= YES and not values:
            return {} if goal else False
        if goal == NO:
            return False
        numbers: dict[int, int] = {}
        clauses: list[str] = []
        stack = [goal >> 1, *(value >> 1 for value in values)]
        while stack:
            node = stack.pop()
            if node in numbers:
                continue
            numbers[node] = len(numbers) + 1
            key = self._nodes[node]
            stack.extend(item >> 1 for item in key[:3] if item >= 0)

        def name(item: int) -> int:
            return -numbers[item >> 1] if item & 1 else numbers[item >> 1]

        for node, n in numbers.items():
            key = self._nodes[node]
            if node == 0:
                clauses.append(f"-{n} 0")
            elif len(key) == 2:
                a, b = name(key[0]), name(key[1])
                clauses.append(f"-{n} {a} 0\n-{n} {b} 0\n{n} {-a} {-b} 0")
            elif len(key) == 3:
                a, b = name(key[0]), name(key[1])
                clauses.append(f"-{n} {a} {b} 0\n-{n} {-a} {-b} 0\n{n} {-a} {b} 0\n{n} {a} {-b} 0")
            elif key:
                a, b, s = map(name, key[:3])
                clauses.append(f"{s} -{n} {a} 0\n{s} {n} {-a} 0\n{-s} -{n} {b} 0\n{-s} {n} {-b} 0")
        clauses.append(f"{name(goal)} 0")
        lines = sum(clause.count("\n") + 1 for clause in clauses)
        text = f"p cnf {len(numbers)} {lines}\n" + "\n".join(clauses) + "\n"
        done = subprocess.run([solver() or "z3", "-in", "-dimacs"], input=text, text=True,
                              capture_output=True, check=False,
                              preexec_fn=limit_processor(seconds))
        if "s UNSATISFIABLE" in done.stdout:
            return False
        if "s SATISFIABLE" not in done.stdout:
            return None
        levels = {int(word) for line in done.stdout.splitlines() if line.startswith("v")
                  for word in line[1:].split()}
        return {value: int(name(value) in levels) for value in values}


def limit_processor(seconds: float) -> Callable[[], None]:
    """Return what limits the process that calls it to so many seconds of a processor, at least one.

    The kernel counts them: so other work on the machine makes no difference, and a solver ends
    that nothing waits for any more.
    """
    most = max(1, round(seconds))
    return partial(resource.setrlimit, resource.RLIMIT_CPU, (most, most))


class Unrolled:
    """A netlist over some clocks, and what its mutants change of that.

    Parameters
    ----------
    netlist : Netlist
        All of it; every mutant is off.
    clocks : int
        How many.
    begin : str
        ``power-up``; ``upset``, with the registers of state machines at any code; or ``anywhere``.
    """

    def __init__(self, netlist: Netlist, clocks: int, begin: str) -> None:
        self.formulas = Formulas()
        self.netlist = netlist
        self.frames: list[dict[int, int]] = []
        self._order = {gate.out: place for place, gate in enumerate(netlist.gates)}
        self._readers: dict[int, list[int]] = {}
        for place, gate in enumerate(netlist.gates):
            for net in set(gate.inputs):
                self._readers.setdefault(net, []).append(place)
        self._inputs = [bit for row in netlist.inputs.values() for bit in row]
        self._begin = begin
        while len(self.frames) < clocks:
            self._frame()
        self.marks = len(self.formulas)

    def _frame(self) -> None:
        netlist, formulas = self.netlist, self.formulas
        levels = {FALSE: NO, TRUE: YES}
        levels.update(dict.fromkeys(netlist.switches, NO))
        for bit in self._inputs:
            levels[bit] = formulas.variable()
        for flop in netlist.flops:
            if self.frames:
                levels[flop.q] = self.frames[-1].get(flop.d, NO)
            elif self._begin == "anywhere" or (self._begin == "upset" and flop.free):
                levels[flop.q] = formulas.variable()
            else:
                levels[flop.q] = flop.init
        for gate in netlist.gates:
            levels[gate.out] = formulas.gate(gate.kind,
                                             [levels.get(net, NO) for net in gate.inputs])
        self.frames.append(levels)

    def mutant(self, number: int, clocks: int, state: Mapping[int, int] | None = None
               ) -> list[dict[int, int]]:
        """Return what a mutant changes in the first clocks, each as the nets that differ.

        Parameters
        ----------
        number : int
            The mutant.
        clocks : int
            How many.
        state : mapping of int to int
            Flip-flops that begin otherwise.
        """
        changed: list[dict[int, int]] = []
        begin = dict(state or {})
        for clock in range(clocks):
            changed.append(self._changes(self.frames[clock],
                                         {**begin, self.netlist.switches[number]: YES}))
            begin = {flop.q: changed[-1][flop.d] for flop in self.netlist.flops
                     if flop.d in changed[-1]}
        return changed

    def _changes(self, base: Mapping[int, int], changes: dict[int, int]) -> dict[int, int]:
        gates, readers, gate = self.netlist.gates, self._readers, self.formulas.gate
        changes = {net: level for net, level in changes.items() if base.get(net) != level}
        waiting = sorted({place for net in changes for place in readers.get(net, ())})
        queued = set(waiting)
        while waiting:
            place = heapq.heappop(waiting)
            at = gates[place]
            level = gate(at.kind, [changes[net] if net in changes else base.get(net, NO)
                                   for net in at.inputs])
            if level != base[at.out]:
                changes[at.out] = level
                for reader in readers.get(at.out, ()):
                    if reader not in queued:
                        queued.add(reader)
                        heapq.heappush(waiting, reader)
        return changes

    def at(self, clock: int, net: int, changed: Sequence[Mapping[int, int]] = ()) -> int:
        """Return the formula of a net in a clock, in a mutant if its changes are given."""
        if changed and net in changed[clock]:
            return changed[clock][net]
        return self.frames[clock].get(net, NO)
