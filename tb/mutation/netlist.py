# amaranth: UnusedElaboratable=no

"""A component with its contract as gates and flip-flops, and every mutant of it behind a switch.

Yosys lists the mutants and puts all of them into one netlist, each with an input of its own that
turns it on. So the netlist is made once, and one pass through its gates can serve hundreds of
mutants; with every switch off it is the component as it is.
"""

import json
import random
import re
import subprocess
import tempfile
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from amaranth import Value
from amaranth.back import rtlil
from amaranth.hdl import Assume
from amaranth.hdl._ir import PortDirection
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from fresa_boards.programs import ProgramError, last_words

from ..contracts import Component
from ..contracts.contract import Bits, Contract, State
from ..contracts.proof import named
from ..rtlil import canonical
from ..yosys import YOSYS

__all__ = ["Assertion", "Flop", "Gate", "Mutable", "Mutant", "MutationError", "Netlist", "choose",
           "listed"]

_LIST = """\
read_rtlil design.il
proc
flatten top.dut
select -module top.dut
opt
wreduce
opt_clean
dffunmap
opt_clean
select -clear
write_rtlil base.il
write_json base.json
tee -q -o list.txt mutate -list 1000000 -module top.dut -o mutants.txt
"""
_APPLY = """\
read_rtlil base.il
{mutants}
flatten
async2sync
memory -nordff
memory_map
opt_clean
chformal -lower
dffunmap
opt_clean
chtype -set flop t:$dff
techmap
opt_clean
write_json all.json
"""
#: Inputs of a gate, by its type.
_GATES = {"$_NOT_": "A", "$_BUF_": "A", "$_AND_": "AB", "$_OR_": "AB", "$_XOR_": "AB",
          "$_MUX_": "ABS", "$_NAND_": "AB", "$_NOR_": "AB", "$_XNOR_": "AB", "$_ANDNOT_": "AB",
          "$_ORNOT_": "AB"}
#: The least constant nets: every other has a greater number.
FALSE, TRUE = 0, 1


class MutationError(ProgramError):
    """Yosys did not do its work; says what it said."""


@dataclass(frozen=True)
class Mutant:
    """A change of one bit at one port of one cell.

    Its text names it by what depends on the design alone, in its canonical form.

    Attributes
    ----------
    command : str
        The command of Yosys that makes it.
    path : str
        The part that the cell is in, such as ``automatic.orders``; empty for the component itself,
        and for what Yosys makes of more than one part.
    cell : str
        Type of the cell.
    number : int
        Which of the cells of that type in that part.
    """

    command: str
    path: str
    cell: str
    number: int

    def __str__(self) -> str:
        words = dict(zip(*[iter(self.command.split()[1:])] * 2, strict=True))
        mode, port, bit = words["-mode"], words["-port"], words["-portbit"]
        change = {"inv": "inverted", "const0": "stuck at 0", "const1": "stuck at 1"}.get(
            mode, f"inverted where bit {words.get('-ctrlbit')} is {mode[-1]}")
        return f"{f'{self.path}: ' if self.path else ''}{self.cell} {self.number}: " \
               f"{port}[{bit}] {change}"


@dataclass(frozen=True)
class Gate:
    """One gate: its type, the net that it drives and the nets that it looks at."""

    kind: str
    out: int
    inputs: tuple[int, ...]


@dataclass(frozen=True)
class Flop:
    """A flip-flop.

    Attributes
    ----------
    q, d : int
        Its nets.
    init : int
        Level at power-up.
    free : bool
        It belongs to a state machine, whose register an upset may leave at any code.
    """

    q: int
    d: int
    init: int
    free: bool


@dataclass(frozen=True)
class Assertion:
    """A property: its name, whether it is about upset registers, and the net of its being kept."""

    name: str
    upset: bool
    kept: int


@dataclass
class Netlist:
    """Gates in the order of their evaluation, flip-flops, and what the nets mean.

    Attributes
    ----------
    inputs, outputs : mapping of str to nets
        Those of the component, by the names of the members of its signature, and ``rst``.
    mutants : list of Mutant
        Mutants.
    switches : list of int
        The net that turns each of them on.
    assertions : list of Assertion
        What must hold.
    assumed : list of int
        Nets that are 1 as long as the component is used as it is meant to be.
    start : int
        Net that is 1 where every state machine begins where it does, or in a code of an upset.
    machines : list of list of int
        Places of the flip-flops of each state machine, the lowest bit first.
    upsets : list of list of int
        Those of them that an upset may leave at any code.
    """

    gates: list[Gate]
    flops: list[Flop]
    inputs: dict[str, list[int]]
    outputs: dict[str, list[int]]
    mutants: list[Mutant]
    switches: list[int]
    assertions: list[Assertion]
    assumed: list[int]
    start: int
    machines: list[list[int]]
    upsets: list[list[int]]


class _Whole(Contract):
    """Both kinds of properties, those about upset registers too."""

    parts = True

    def __init__(self, dut: wiring.Component, describe) -> None:
        self.about_upsets: set[str] = set()
        self._machines: dict[str, State] = {}
        super().__init__(dut, describe)
        started: Bits = Value.cast(1)
        for state in self._machines.values():
            register = state.register
            upset = register >= state.codes["FAULT"] if "FAULT" in state.codes else register < 0
            started = started & ((register == register.init) | upset)
        self.m.d.comb += Assume(Value.cast(started).any(), "start")

    def pins(self) -> dict[str, tuple[Any, PortDirection]]:
        """Return what the netlist has as pins, by name: members of the component, and ``rst``."""
        found = {"rst": (self.rst, PortDirection.Input)}
        for path, member, value in self._dut.signature.flatten(self._dut):
            flow = PortDirection.Input if member.flow is In else PortDirection.Output
            found["_".join(map(str, path))] = (Value.cast(value), flow)
        return found

    def rtlil(self) -> str:
        # Inside the component, a port may have to share its name with one of a part of it.
        pins = {f"pin_{name}": pin for name, pin in self.pins().items()}
        return rtlil.convert(self.m, name="top", emit_src=False, ports={
            "clk": (self._clock.clk, PortDirection.Input), **pins,
            **{f"free_{number}": (value, PortDirection.Input)
               for number, value in enumerate(self._free)}})

    def _property(self, name, description, kept, cover, upset, lemma) -> None:
        self.upset = upset
        super()._property(name, description, kept, cover, upset, lemma)
        self.upset = False
        if upset:
            self.about_upsets.add(f"{self._prefix}{name}")

    def state(self, path: str) -> State:
        state = super().state(path)
        state.register.attrs["of_a_machine"] = 1
        return state

    def any_code(self, path: str) -> State:
        state = super().any_code(path)
        state.register.attrs["any_at_start"] = 1
        self._machines[path] = state
        return state


class Mutable:
    """A component with all mutants that there are of it.

    Parameters
    ----------
    component : Component
        What must hold of it.
    dut : wiring.Component
        The component, not elaborated yet.
    checked : bool
        With it false the contract is empty: a control, for which nothing may be found.

    Attributes
    ----------
    mutants : list of Mutant
        All of them.
    text : str
        The component and its contract as RTLIL, in canonical form.

    Raises
    ------
    MutationError
        If Yosys cannot do it.
    """

    def __init__(self, component: Component, dut: wiring.Component, *, checked: bool = True
                 ) -> None:
        self._contract = _Whole(dut, component.describe if checked else lambda *_: None)
        self.text = canonical(named(self._contract.rtlil()))
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            self.mutants, self._inside = _list(self.text, folder)
            self._base = (folder / "base.il").read_text() if self.mutants else self.text

    def choose(self, count: int, seed: int) -> list[Mutant]:
        """Choose so many mutants by chance; all, if there are no more."""
        return choose(self.mutants, count, seed)

    def netlist(self, mutants: Sequence[Mutant]) -> Netlist:
        """Make the netlist with some mutants."""
        lines = [f"{mutant.command} -ctrl mutant_{number} 1 1"
                 for number, mutant in enumerate(mutants)]
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            (folder / "base.il").write_text(self._base, encoding="utf-8")
            _run(folder, _APPLY.format(mutants="\n".join(lines)))
            module = json.loads((folder / "all.json").read_text())["modules"]["top"]
        return _read(module, self._inside, list(mutants), self._contract)


def listed(text: str, folder: Path) -> list[Mutant]:
    """List the mutants of a design, and leave it as ``base.il``, of which their commands are.

    Parameters
    ----------
    text : str
        The design, in canonical form.
    folder : Path
        Empty folder.
    """
    return _list(text, folder)[0]


def _list(text: str, folder: Path) -> tuple[list[Mutant], Mapping]:
    (folder / "design.il").write_text(text, encoding="utf-8")
    if not re.search(r"^module \\top\.dut$", text, re.M):  # it has no cell with these parameters
        return [], {}
    _run(folder, _LIST)
    modules = json.loads((folder / "base.json").read_text())["modules"]
    inside = next(module for name, module in modules.items() if name != "top")
    return _read_mutants((folder / "mutants.txt").read_text(), inside), inside


def choose(mutants: list[Mutant], count: int, seed: int) -> list[Mutant]:
    """Choose so many mutants by chance; all, if there are no more."""
    # Yosys' own choice of some of them runs for ever where most of them are requested.
    if count >= len(mutants):
        return mutants
    chosen = random.Random(seed).sample(range(len(mutants)), count)
    return [mutants[number] for number in sorted(chosen)]


def _run(folder: Path, script: str) -> None:
    (folder / "script.ys").write_text(script)
    done = subprocess.run([*YOSYS, "-q", "script.ys"], cwd=folder, stdin=subprocess.DEVNULL,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          encoding="utf-8", check=False)
    if done.returncode:
        raise MutationError(last_words(done.stdout, 3))


def _read_mutants(text: str, module: Mapping) -> list[Mutant]:
    """Read the list, in the order of the cells; a changed clock is no mutant of a component."""
    cells, numbers = module["cells"], {}
    counts: Counter = Counter()
    for name in sorted(cells, key=_natural):
        kind = _part_of(name), cells[name]["type"]
        counts[kind] += 1
        numbers[name] = (*kind, counts[kind])
    found = []
    for line in text.splitlines():
        words = line.split(" -src ")[0].split(" -wire ")[0].split()
        options = dict(zip(*[iter(words[1:])] * 2, strict=True))
        path, kind, number = numbers[options["-cell"].removeprefix("\\")]
        # What a memory holds is no gateware; its ports are.
        port = options["-port"]
        if port == "CLK" or kind.startswith("$meminit") or (
                kind.startswith("$memrd") and port not in ("ADDR", "DATA")):
            continue
        found.append(Mutant(" ".join(words), path, kind.strip("$"), number))
    return sorted(found, key=lambda mutant: _natural(str(mutant)))


def _part_of(cell: str) -> str:
    """Return the path of the part that a cell of the flattened component was in."""
    found = re.match(r"\$flatten\\(.*?)\.\$", cell)
    return found[1].replace("\\", "") if found else ""


def _natural(name: str) -> list[tuple[int, str]]:
    """Sort numbers in a text by their values."""
    return [(int(word), "") if word.isdigit() else (-1, word)
            for word in re.split(r"(\d+)", name)]


def _read(module: Mapping, inside: Mapping, mutants: list[Mutant],
          contract: _Whole) -> Netlist:
    """Read what Yosys wrote."""
    names = module["netnames"]
    net: dict = {"0": FALSE, "1": TRUE, "x": FALSE}
    for wire in names.values():
        for bit in wire["bits"]:
            net.setdefault(bit, len(net) - 1)

    def bits(name: str) -> list[int]:
        return [net[bit] for bit in names[name]["bits"]]

    # A mutant at the output of a flip-flop leaves the name, and with it what is said of power-up,
    # on its own output. So this is read from the netlist without mutants.
    before = {_flattened(name): cell for name, cell in inside["cells"].items()}
    inits, machines, upset = _power_up(inside)
    own_inits, *_ = _power_up(module)
    frees = {bit for bits in upset for bit in bits}
    states = {bit for bits in machines for bit in bits}
    gates, flops, assertions, assumed, start = [], [], [], [], TRUE
    places: dict = {}
    extra = len(net)

    def at_least(one: int, other: int) -> int:
        """Add ``one or not other``."""
        nonlocal extra
        gates.append(Gate("$_ORNOT_", extra, (one, other)))
        extra += 1
        return extra - 1

    for name, cell in module["cells"].items():
        kind, port = cell["type"], cell["connections"]
        if kind in _GATES:
            looked_at = tuple(net.get(port[pin][0], FALSE) for pin in _GATES[kind])
            gates.append(Gate(kind, net[port["Y"][0]], looked_at))
        elif kind == "flop":
            known = before.get(name)
            at_start, free = (inits, frees) if known else (own_inits, set())
            for bit, d, q in zip((known or cell)["connections"]["Q"], port["D"], port["Q"],
                                 strict=True):
                if known and bit in states:
                    places[bit] = len(flops)
                flops.append(Flop(net[q], net[d], at_start.get(bit, 0), bit in free))
        elif kind in ("$assert", "$assume"):
            said = name.partition("property:")[2]
            kept = at_least(net[port["A"][0]], net[port["EN"][0]])
            if kind == "$assert":
                assertions.append(Assertion(said, said in contract.about_upsets, kept))
            elif said == "start":
                start = kept
            elif said != "restrict-covers":
                assumed.append(kept)
        elif kind not in ("$cover", "$scopeinfo"):
            raise MutationError(f"no mutants can be made of a cell {kind}")
    switches = [bits(f"dut.mutant_{number}")[0] for number in range(len(mutants))]
    pins: dict[PortDirection, dict[str, list[int]]] = {
        PortDirection.Input: {}, PortDirection.Output: {}}
    for name, (_, flow) in contract.pins().items():
        pins[flow][name] = bits(f"pin_{name}")
    made = pins[PortDirection.Input]
    made |= {name: bits(name) for name in names if name.startswith("free_")}
    sources = {FALSE, TRUE, *switches, *(flop.q for flop in flops),
               *(bit for row in made.values() for bit in row)}
    return Netlist(_in_order(gates, sources), flops, made,
                   pins[PortDirection.Output], mutants, switches, assertions, assumed, start,
                   *([[places[bit] for bit in bits] for bits in registers]
                     for registers in (machines, upset)))


def _flattened(name: str) -> str:
    """Return the name of a cell of the component once it is flattened into the bench."""
    if name.startswith("$"):  # of a part of the component it has been flattened before
        return f"$flatten\\dut.{name.removeprefix('$flatten')}"
    return f"dut.{name}"


def _power_up(module: Mapping) -> tuple[dict, list[tuple], list[tuple]]:
    """Return the levels at power-up, the registers of state machines, and those with upsets."""
    inits, machines, upsets = {}, {}, {}
    for wire in module["netnames"].values():
        attributes = wire.get("attributes", {})
        if "init" in attributes:
            for bit, level in zip(wire["bits"], reversed(attributes["init"]), strict=False):
                if level in "01":
                    inits[bit] = int(level)
        if "of_a_machine" in attributes:
            machines[tuple(wire["bits"])] = None
        if "any_at_start" in attributes:
            upsets[tuple(wire["bits"])] = None
    return inits, list(machines), list(upsets)


def _in_order(gates: Sequence[Gate], sources: set[int]) -> list[Gate]:
    """Sort gates so that each comes after those that it looks at."""
    driver = {gate.out: gate for gate in gates}
    done, ordered = set(sources), []
    for gate in gates:
        stack = [gate]
        while stack:
            top = stack[-1]
            if top.out in done:
                stack.pop()
                continue
            waits = []
            for net in top.inputs:
                if net not in done:
                    if net not in driver:
                        done.add(net)  # driven by nothing: it is not looked at by what matters
                    else:
                        waits.append(driver[net])
            if not waits:
                done.add(top.out)
                ordered.append(top)
                stack.pop()
            elif len(stack) > 9 * len(gates):
                raise MutationError("the gates of the component run in a circle")
            else:
                stack.extend(waits)
    return ordered
