"""RTL = netlist: the same outputs and the same next state, whatever the inputs and the registers.

Each flip-flop of the netlist is paired with one of the RTL by a name that both still have. Then all
of them are cut: what they hold becomes an input, what they are about to hold an output. What is
left has no memory, and Yosys proves every ``$equiv`` cell between the two by itself, for every
value of every register, also for the codes that no state has. As both start alike, they are equal
for ever.

To pair all that has the same name, as Yosys would, is not enough and too much: synthesis leaves
some registers without the name that they had, and some names without a driver.

A design with memories is read from the Verilog that users get, and all its memories are made of
flip-flops on both sides: Yosys has no model of a block RAM. There nets have lost more names, so
the Verilog is optimised before the flip-flops are paired, as Yosys does at the begin of synthesis.

A flip-flop that the netlist does without must be a constant or the same as another, which is proved
of the RTL, or have no effect, which is proved by leaving it free. Where not even its name is left
it is a constant if it stays as it starts, by itself.
"""

import re
from collections.abc import Collection
from dataclasses import dataclass, replace
from itertools import starmap
from pathlib import Path

from ..engines.base import EngineError
from .flat import CUT, Bit, Flat, Net, add_to, alias, bit_name, load, models, yosys

__all__ = ["Verdict", "compare", "same"]

_RTL = ("read_rtlil rtl.il; hierarchy -top {top}; proc -norom; flatten; memory -nordff; "
        "opt_expr -keepdc; opt_clean; write_json gold.json; select {top}; "
        "write_rtlil -selected gold.il; design -reset")
_VERILOG = (_RTL.replace("read_rtlil rtl.il", "read_verilog rtl.v")
            .replace("write_json", "opt -full; dffunmap; opt_clean; write_json"))
_CUT = f"{CUT}; {{more}}opt_clean; rename {{top}} {{side}}; design -stash {{side}}"
_BOTH = "design -copy-from gold gold; design -copy-from gate gate; "
_EQUIV = (f"{_BOTH}equiv_make gold gate equiv; hierarchy -top equiv; opt_clean; "
          "equiv_simple; equiv_status")
_MITER = (f"{_BOTH}miter -equiv -flatten gold gate miter; hierarchy -top miter; opt_clean; "
          "sat -prove trigger 0 miter")
_STAYED = re.compile(r"SAT proof finished - (no model|model) found")
_TRIED = re.compile(r"Trying to prove \$equiv for \\(.+):\n(?:ezsat\n)* (success!|failed\.)")
_STATUS = re.compile(r"Found (\d+) \$equiv cells in equiv:\n"
                     r"  Of those cells (\d+) are proven and (\d+) are unproven\.")


@dataclass(frozen=True)
class Verdict:
    """What became of a comparison.

    Attributes
    ----------
    cells, proved : int
        ``$equiv`` cells, and how many of them are proved.
    outputs, registers : int
        Bits of outputs, and flip-flops that are in both, of which there is a cell each; the netlist
        may have one for several that are always the same.
    constant, unused : int
        Flip-flops that the netlist does without: constants, of which there is a cell each too, and
        those that nothing depends on.
    wrong : list of str
        What is not equal.
    """

    cells: int
    proved: int
    outputs: int
    registers: int
    constant: int
    unused: int
    wrong: list[str]


@dataclass(frozen=True)
class _Pairs:
    """What the flip-flops of one side are on the other."""

    both: list[Net]
    merged: list[tuple[Net, Net]]
    constant: list[tuple[Net, str]]
    lost: list[tuple[Net, str]]
    unused: int
    wrong: list[str]


def compare(top: str, rtl: str, netlist: str, folder: Path, *,
            only: Collection[Net] | None = None, verilog: bool = False) -> Verdict:
    """Compare RTL and netlist.

    Parameters
    ----------
    top : str
        Name of both modules.
    rtl, netlist : str
        Both, the one in RTLIL, the other in Verilog.
    folder : path
        Where to work.
    only : collection of Net, optional
        Outputs and registers to look at; all by default.
    verilog : bool
        The RTL is in Verilog, and has memories.

    Raises
    ------
    EngineError
        If Yosys fails, or compares anything but what it should.
    """
    (folder / ("rtl.v" if verilog else "rtl.il")).write_text(rtl, encoding="utf-8")
    read = (_VERILOG if verilog else _RTL).format(top=top)
    yosys(f"{read}; {models(netlist, top, 'gate', folder)}", folder)
    gold, gates = load(folder / "gold.json", top), load(folder / "gate.json", top)
    if boxes := sorted({cell.type for cell in gates.cells if not cell.type.startswith("$")}):
        raise EngineError(f"Yosys has no model of {', '.join(boxes)}, which {top} takes")
    pairs = _settle(top, _pair(gold, gates), folder)
    wrong = [*pairs.wrong, *_unclocked(gold), *_unclocked(gates), *_undefined(gates)]
    log, names, ports = _cut_and(_EQUIV, top, gates, pairs, folder, only)
    status = _STATUS.search(log)
    cells, proved, _ = map(int, status.groups()) if status else (0, 0, 0)
    outputs = sum(len(gates.outputs[port]) for port in ports)
    if cells != outputs + len(names):
        raise EngineError(f"Yosys compared {cells} bits of {top}, not {outputs + len(names)}")
    failed = [what for what, how in _TRIED.findall(log) if how == "failed."]
    wrong += [bit_name(names[what[:-2]]) if what.endswith(".d") else what.replace(" ", "")
              for what in failed]
    if proved + len(failed) != cells:
        raise EngineError(f"Yosys says of {cells - proved - len(failed)} bits of {top} neither "
                          "that they are equal nor that they are not")
    constant = sum(name.startswith("ff_c") for name in names)
    return Verdict(cells, proved, outputs, len(names) - constant, constant, pairs.unused, wrong)


def same(top: str, netlist: str, other: str, folder: Path, *, only: Collection[Net]) -> bool:
    """Return whether two netlists that differ in a cell are equal: one formula for all of it."""
    yosys("; ".join([models(netlist, top, "gold", folder), models(other, top, "gate", folder)]),
          folder)
    gold, gate = load(folder / "gold.json", top), load(folder / "gate.json", top)
    log, _, _ = _cut_and(_MITER, top, gate, _pair(gold, gate), folder, only)
    verdict = re.search(r"SAT proof finished - (no model|model) found", log)
    if verdict is None:
        raise EngineError(f"Yosys came to no end with {top}")
    return verdict[1] == "no model"


def _cut_and(what: str, top: str, gate: Flat, pairs: _Pairs, folder: Path,
             only: Collection[Net] | None) -> tuple[str, dict[str, Net], list[str]]:
    """Cut both sides and go on; give the log, what the names of registers mean, and the ports."""
    names = {f"ff_{n}": name for n, name in enumerate(pairs.both)}
    constants = {f"ff_c{n}": name for n, (name, _) in enumerate(pairs.constant)}
    merged = {f"ff_m{n}": name for n, (name, _) in enumerate(pairs.merged)}
    add_to(folder / "gold.il", "".join(starmap(alias, {**names, **merged, **constants}.items())))
    add_to(folder / "gate.il", "".join(starmap(alias, names.items())))
    # Where the netlist has a constant, the RTL has it now, and must have it with the next clock.
    levels = [(f"ff_c{n}", level) for n, (_, level) in enumerate(pairs.constant)]
    now = "".join(f"delete -input w:{ff}.q; connect -set {ff}.q 1'{n}; " for ff, n in levels)
    then = "".join(f"add -output {ff}.d 1; connect -set {ff}.d 1'{n}; " for ff, n in levels)
    # Where it has one for two, they are the same now, and must be so in the next clock.
    plain_of = {name: plain for plain, name in names.items()}
    twins = [(ff, plain_of[twin]) for ff, (_, twin) in zip(merged, pairs.merged, strict=True)]
    now += "".join(f"delete -input w:{ff}.q; connect -set {ff}.q {twin}.q; " for ff, twin in twins)
    then += "".join(f"add -output {ff}.d 1; connect -set {ff}.d {twin}.d; " for ff, twin in twins)
    names = {**names, **merged, **constants}
    ports, keep = list(gate.outputs), ""
    if only is not None:
        bits = {gate.names[name] for name in only if name in gate.names}
        names = {plain: name for plain, name in names.items() if gate.names.get(name) in bits}
        ports = [port for port, bits in gate.outputs.items()
                 if any((port, index) in only for index in range(len(bits)))]
        kept = [f"w:{plain}.d" for plain in names] + [f"w:{port}" for port in ports]
        keep = f"delete -output o:* {kept[0]} {' '.join(f'{name} %u' for name in kept[1:])} %d; "
    log = yosys("; ".join([_CUT.format(top=top, side="gold", more=now + keep),
                           _CUT.format(top=top, side="gate", more=then + keep), what]), folder)
    return log, names, ports


def _pair(gold: Flat, gate: Flat) -> _Pairs:
    """Find each flip-flop of one side on the other, by any name that it has."""
    both, merged, constant, lost, wrong, unused = [], [], [], [], [], 0
    taken: dict[Bit, Net] = {}
    for bit in gold.registers:
        names = [name for name in gold.aliases.get(bit, []) if name in gate.names]
        if found := [name for name in names if gate.names[name] in gate.registers]:
            name, twin = found[0], gate.names[found[0]]
            if gold.start(bit) != gate.start(twin):
                wrong.append(f"{bit_name(name)} starts at {gate.start(twin)}, "
                             f"not {gold.start(bit)}")
            if twin in taken:
                merged.append((name, taken[twin]))
            else:
                taken[twin] = name
                both.append(name)
        elif found := [name for name in names if gate.names[name] in ("0", "1")]:
            level = str(gate.names[found[0]])
            if str(gold.start(bit)) != level:
                wrong.append(f"{bit_name(found[0])} starts at {level}, not {gold.start(bit)}")
            constant.append((found[0], level))
        elif (start := gold.start(bit)) is not None and gold.aliases.get(bit):
            lost.append((gold.aliases[bit][0], str(start)))
        else:
            unused += 1
    wrong += [f"{gate.name(bit)} is new" for bit in gate.registers if bit not in taken]
    return _Pairs(both, merged, constant, lost, unused, wrong)


def _settle(top: str, pairs: _Pairs, folder: Path) -> _Pairs:
    """Find which lost flip-flops stay as they start: these are constants, the others free."""
    if not pairs.lost:
        return pairs
    text = (folder / "gold.il").read_text(encoding="utf-8")
    (folder / "lost.il").write_text(text, encoding="utf-8")
    add_to(folder / "lost.il", "".join(
        alias(f"ff_{n}", name) for n, (name, _) in enumerate(pairs.lost)))
    log = yosys("; ".join([CUT.format(side="lost"), "delete t:$dff", "opt_clean", *(
        f"sat -set ff_{n}.q {level} -prove ff_{n}.d {level} {top}"
        for n, (_, level) in enumerate(pairs.lost))]), folder)
    stays = [verdict == "no model" for verdict in _STAYED.findall(log)]
    if len(stays) != len(pairs.lost):
        raise EngineError(f"Yosys came to no end with the flip-flops that {top} has lost")
    constant = [net for net, stay in zip(pairs.lost, stays, strict=True) if stay]
    return replace(pairs, constant=[*pairs.constant, *constant], lost=[],
                   unused=pairs.unused + stays.count(False))


def _undefined(gate: Flat) -> list[str]:
    """Name cells and outputs of the netlist that look at an X, which a solver takes for 0."""
    return [*(f"an X at {port} of {cell.name}" for cell in gate.cells
              for port, bits in cell.inputs.items() if "x" in bits),
            *(f"an X at output {port}" for port, bits in gate.outputs.items() if "x" in bits)]


def _unclocked(flat: Flat) -> list[str]:
    """Name flip-flops with another clock than the input `clk`, for the proof looks at no clock."""
    (clock,) = flat.inputs["clk"]
    return [f"the clock of {flat.name(bit)}" for bit, cell in flat.registers.items()
            if cell.type != "$dff" or cell.inputs["CLK"] != (clock,)
            or int(cell.parameters["CLK_POLARITY"], 2) != 1]

