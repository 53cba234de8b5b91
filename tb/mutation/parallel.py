"""Bit-parallel simulation: all mutants of a netlist at once, each a bit of every number.

A net is a whole number with a bit for each mutant, and bit 0 for the component as it is. A gate is
one operation of Python on such numbers, so a thousand mutants cost hardly more than one.
"""

from collections.abc import Callable, Collection, Sequence
from typing import TypeAlias

from .netlist import FALSE, TRUE, Netlist

__all__ = ["ParallelSimulation"]

Step: TypeAlias = Callable[[Sequence[int], Sequence[int]], tuple[list[int], list[int]]]

_TEXTS = {"$_AND_": "{0}&{1}", "$_OR_": "{0}|{1}", "$_XOR_": "{0}^{1}", "$_NAND_": "A^({0}&{1})",
          "$_NOR_": "A^({0}|{1})", "$_XNOR_": "A^{0}^{1}", "$_ANDNOT_": "{0}&(A^{1})",
          "$_ORNOT_": "{0}|(A^{1})", "$_NOT_": "A^{0}", "$_BUF_": "{0}",
          "$_MUX_": "{0}^({2}&({0}^{1}))"}


class ParallelSimulation:
    """The component and some of its mutants, ready to run.

    Parameters
    ----------
    netlist : Netlist
        All of it.
    mutants : sequence of int
        Numbers of those that run, in bits 1, 2 and so on.
    watch : sequence of int
        Nets to look at.

    Attributes
    ----------
    every : int
        All bits set.
    state : list of int
        Level of each flip-flop; power-up at first.
    """

    def __init__(self, netlist: Netlist, mutants: Sequence[int], watch: Sequence[int]) -> None:
        self.mutants = list(mutants)
        self.every = (1 << len(self.mutants) + 1) - 1
        self._netlist, self._watch, self._flops = netlist, list(watch), netlist.flops
        self._step = _compile(netlist, self.mutants, watch, self.every)
        self.state: list[int] = []
        self.power_up()

    def power_up(self) -> None:
        """Begin anew."""
        self.state = [self.every if flop.init else 0 for flop in self._flops]

    def without(self, mutants: Collection[int]) -> "ParallelSimulation":
        """Return what is left without some mutants, if that is worth while; else all, as it is."""
        left = [number for number in self.mutants if number not in mutants]
        if len(left) > 0.7 * len(self.mutants):
            return self
        other = ParallelSimulation(self._netlist, left, self._watch)
        places = [0, *(place for place, number in enumerate(self.mutants, start=1)
                       if number not in mutants)]
        other.state = [sum((level >> old & 1) << new for new, old in enumerate(places))
                       for level in self.state]
        return other

    def look(self, inputs: Sequence[int]) -> tuple[list[int], list[int]]:
        """Return the next state, and the nets watched, with these inputs."""
        return self._step(self.state, inputs)


def _compile(netlist: Netlist, mutants: Sequence[int], watch: Sequence[int], every: int) -> Step:
    """Write the netlist as one function. What depends on no mutant that runs is folded."""
    text = {FALSE: "0", TRUE: "A"}
    bit_of = {netlist.switches[number]: 1 << place
            for place, number in enumerate(mutants, start=1)}
    for switch in netlist.switches:
        text[switch] = str(bit_of[switch]) if switch in bit_of else "0"
    bits = [bit for row in netlist.inputs.values() for bit in row]
    sources = {flop.q for flop in netlist.flops} | set(bits)
    lines: list[tuple[int, str]] = []
    uses: dict[int, list[int]] = {}
    for gate in netlist.gates:
        operands = [text.get(net) or (f"v{net}" if net in sources else "0")
                    for net in gate.inputs]
        simple = _simple(gate.kind, operands)
        if simple is None:
            lines.append((gate.out, _TEXTS[gate.kind].format(*operands)))
            uses[gate.out] = [int(operand[1:]) for operand in operands if operand[0] == "v"]
            text[gate.out] = f"v{gate.out}"
        else:
            text[gate.out] = simple

    def of(net: int) -> str:
        return text.get(net) or (f"v{net}" if net in sources else "0")

    nexts = [of(flop.d) for flop in netlist.flops]
    seen = [of(net) for net in watch]
    needed, stack = set(), [int(item[1:]) for item in nexts + seen if item[0] == "v"]
    while stack:
        net = stack.pop()
        if net not in needed:
            needed.add(net)
            stack.extend(uses.get(net, ()))
    code = ["def step(S, I):",
            f" [{', '.join(f'v{flop.q}' for flop in netlist.flops)}] = S" if netlist.flops else "",
            f" [{', '.join(f'v{bit}' for bit in bits)}] = I",
            *(f" v{out}={line}" for out, line in lines if out in needed),
            f" return [{', '.join(nexts)}], [{', '.join(seen)}]"]
    names = {"A": every}
    exec("\n".join(code), names)
    return names["step"]  # type: ignore[return-value]


def _simple(kind: str, operands: Sequence[str]) -> str | None:
    """Return what a gate comes to where one of its inputs is constant; None if it stays a gate."""
    a, b = operands[0], operands[min(1, len(operands) - 1)]
    match kind:
        case "$_BUF_":
            return a
        case "$_NOT_":
            return {"0": "A", "A": "0"}.get(a)
        case "$_AND_":
            return "0" if "0" in (a, b) else b if a == "A" else a if b == "A" else None
        case "$_OR_":
            return "A" if "A" in (a, b) else b if a == "0" else a if b == "0" else None
        case "$_XOR_":
            return b if a == "0" else a if b == "0" else None
        case "$_MUX_":
            return {"0": a, "A": b}.get(operands[2]) or (a if a == b else None)
    return None
