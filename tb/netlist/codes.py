"""Unused codes: every state machine of the netlist leaves each of them with the next clock.

The flip-flops are cut, so that the registers hold anything at all, and a SAT solver looks for a way
from an unused code to any state but FAULT, and for one that does not show. FAULT itself must stay,
and show. Block RAMs, which Yosys has no model of, give anything too.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..contracts.contract import State
from ..engines.base import EngineError
from .flat import CUT, Bit, Flat, add_to, alias, load, models, yosys

__all__ = ["FAULT", "Codes", "prove"]

FAULT = "FAULT"
"""The state that every state machine goes to."""

_VERDICT = re.compile(r"SAT (?:proof|solving) finished - (no model|model) found")


@dataclass(frozen=True)
class Codes:
    """What became of the unused codes of a state machine.

    Attributes
    ----------
    register : str
        Name of its register.
    unused : int
        Codes that no state has.
    wrong : list of str
        What is wrong.
    """

    register: str
    unused: int
    wrong: list[str]


def prove(top: str, netlist: str, states: Mapping[str, State], running: Sequence[tuple[str, int]],
          shows: str, folder: Path) -> list[Codes]:
    """Prove of every state machine that it leaves its unused codes.

    Parameters
    ----------
    top, netlist : str
        Name of the module, and the netlist.
    states : mapping of str to State
        State machines by the names of their registers.
    running : sequence of (str, int)
        Inputs and registers with the levels that hold no state machine in reset.
    shows : str
        Output that is 1 while one is in an unused code or in FAULT, or in the clock after, where
        the fault of the machine is a register.
    folder : path
        Where to work.

    Raises
    ------
    EngineError
        If Yosys fails, or the levels in `running` contradict each other.
    """
    yosys(models(netlist, top, "all", folder), folder)
    flat = load(folder / "all.json", top)
    cuts = _Cuts(flat)
    found = [Codes(name, (1 << len(state.register)) - len(state.codes), [])
             for name, state in states.items()]
    held = " ".join(f"-set {cuts.now(name)} {level}" for name, level in running)
    # An output that is a register shows a fault a clock later.
    shown = cuts.then(shows) if cuts.is_register(shows) else shows
    questions: list[_Question] = []
    for codes, state in zip(found, states.values(), strict=True):
        bits = [f"{codes.register}[{index}]" for index in reversed(range(len(state.register)))]
        if lost := [bit for bit in bits if not cuts.is_register(bit)]:
            codes.wrong.append(f"the netlist has no register {', '.join(lost)}")
        elif FAULT not in state.codes:
            codes.wrong.append(f"it has no state {FAULT}")
        else:
            then, fault = ",".join(map(cuts.then, bits)), _const(state.codes[FAULT], len(bits))
            now = ",".join(map(cuts.now, bits))
            cases = {FAULT: f"-set {now} {fault}"}
            if codes.unused:
                cases["an unused code"] = f"-set {cuts.at_least(bits, len(state.codes))} 1"
            for case, given in cases.items():
                questions += [
                    _Question(codes, "", given),
                    _Question(codes, f"{case} does not always lead to {FAULT}",
                              f"{given} -prove {then} {fault}"),
                    _Question(codes, f"{shows} does not always show {case}",
                              f"{given} -prove {shown} 1")]
    cuts.write(folder / "all.il")
    script = [CUT.format(side="all"), cuts.keep(shows), "opt_clean",
              *(f"sat -ignore-unknown-cells {held} {question.options}" for question in questions)]
    answers = _VERDICT.findall(yosys("; ".join(script), folder))
    if len(answers) != len(questions):
        raise EngineError(f"Yosys answered {len(answers)} questions of {len(questions)}")
    for question, answer in zip(questions, answers, strict=True):
        if not question.wrong and answer == "no model":
            raise EngineError(f"{question.codes.register} cannot be upset with {dict(running)}")
        if question.wrong and answer == "model":
            question.codes.wrong.append(question.wrong)
    return found


@dataclass(frozen=True)
class _Question:
    """What a solver is asked, and what is wrong if it finds something; empty if that is right."""

    codes: Codes
    wrong: str
    options: str


def _const(value: int, width: int) -> str:
    return f"{width}'b{value:0{width}b}"


class _Cuts:
    """Names for the flip-flops that are asked about, which they keep when they are cut."""

    def __init__(self, flat: Flat) -> None:
        self._flat = flat
        self._plain: dict[Bit, str] = {}
        self._cells: list[str] = []

    def is_register(self, name: str) -> bool:
        return self._flat.bit(name) in self._flat.registers

    def now(self, name: str) -> str:
        """Return what it holds, or an input."""
        return f"{self._cut(name)}.q" if self.is_register(name) else name

    def then(self, name: str) -> str:
        """Return what it will hold."""
        return f"{self._cut(name)}.d"

    def at_least(self, names: Sequence[str], least: int) -> str:
        """Return whether registers, the most significant first, hold so much."""
        plain = f"ff_least_{len(self._cells)}"
        bits = " ".join(f"\\{self._cut(name)}" for name in names)
        parameters = {"A_SIGNED": 0, "A_WIDTH": len(names), "B_SIGNED": 0, "B_WIDTH": len(names),
                      "Y_WIDTH": 1}
        lines = [f"  attribute \\keep 1\n  wire \\{plain}", f"  cell $ge $auto${plain}",
                 *(f"    parameter \\{name} {value}" for name, value in parameters.items()),
                 f"    connect \\A {{ {bits} }}",
                 f"    connect \\B {len(names)}'{least:0{len(names)}b}",
                 f"    connect \\Y \\{plain}", "  end"]
        self._cells.append("\n".join([*lines, ""]))
        return plain

    def keep(self, port: str) -> str:
        """Return the command that leaves nothing but these, and an output."""
        kept = "".join(f" w:{plain}.d %u" for plain in self._plain.values())
        return f"delete -output o:* w:{port.partition('[')[0]}{kept} %d"

    def write(self, path: Path) -> None:
        """Put the names into an RTLIL file."""
        add_to(path, "".join([*(alias(plain, self._flat.aliases[bit][0])
                                for bit, plain in self._plain.items()), *self._cells]))

    def _cut(self, name: str) -> str:
        bit = self._flat.bit(name)
        assert bit is not None
        return self._plain.setdefault(bit, f"ff_{len(self._plain)}")
