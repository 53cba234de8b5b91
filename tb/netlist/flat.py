"""A flattened module as Yosys writes it down in JSON: cells, and who drives and reads a bit."""

import functools
import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from ..engines.cache import call
from ..yosys import YOSYS

__all__ = ["CUT", "Bit", "Cell", "Flat", "Net", "Pin", "add_to", "alias", "cells",
           "load", "models", "bit_name", "yosys"]

Bit = int | str
"""A net of one bit: its number, or ``0``, ``1``, ``x`` or ``z``."""

Net = tuple[str, int]
"""A bit of a wire: the name of the wire, and the number of the bit."""

# Reading these takes longer than all else that is done to a small netlist.
_RAMS = "read_verilog -lib +/xilinx/cells_xtra.v; "
_MODELS = ("read_verilog -overwrite +/xilinx/cells_sim.v; read_verilog {side}.v; "
           "hierarchy -top {top}; proc; flatten; opt_expr; opt_clean; select {top}; "
           "write_json -selected {side}.json; write_rtlil -selected {side}.il; design -reset")
_CELLS = ("read_verilog -lib +/xilinx/cells_sim.v; read_verilog cells.v; hierarchy -top {top}; "
          "select {top}; write_json -selected cells.json")

# A flip-flop and the output that shows it become two things, with a buffer between them. What has
# no name that begins with `ff_` loses its own: Yosys pairs by public names.
CUT = ("read_rtlil {side}.il; rename -hide w:* w:ff_* %d; setattr -unset iopad_external_pin w:*; "
       "iopadmap -bits -outpad $_BUF_ A:Y; expose -evert-dff; setattr -unset init w:*; "
       "delete -output w:ff_*.c")
"""Commands that cut flip-flops: ``ff_1`` becomes an input ``ff_1.q`` and an output ``ff_1.d``."""

_NAME = re.compile(r"(.*?)(?:\[(\d+)\])?")


@dataclass(frozen=True)
class Cell:
    """A cell: its name, its type, and the nets on its inputs and outputs."""

    name: str
    type: str
    parameters: Mapping[str, str]
    inputs: Mapping[str, tuple[Bit, ...]]
    outputs: Mapping[str, tuple[Bit, ...]]

    @property
    def is_flip_flop(self) -> bool:
        """Whether it is one, of Yosys or of the Spartan-3E."""
        return "dff" in self.type if self.type.startswith("$") else self.type.startswith("FD")


@dataclass(frozen=True)
class Pin:
    """An input of a cell that reads a net."""

    cell: Cell
    port: str


class Flat:
    """A module without modules in it.

    Parameters
    ----------
    module : mapping
        As in Yosys' JSON.

    Attributes
    ----------
    cells : list of Cell
        All that is in it.
    names : dict of Net to Bit
        Net of each bit of everything that has a public name.
    inputs, outputs : dict of str to tuple of Bit
        Ports.
    """

    def __init__(self, module: Mapping) -> None:
        self.cells = list(_cells(module["cells"]))
        self.names: dict[Net, Bit] = {}
        self._starts: dict[Bit, int] = {}
        for name, net in module["netnames"].items():
            start = net.get("attributes", {}).get("init", "")
            for index, bit in enumerate(net["bits"]):
                if not net["hide_name"]:
                    self.names[name, index] = bit
                if index < len(start) and start[-1 - index] in "01":
                    self._starts[bit] = int(start[-1 - index])
        ports = module["ports"].items()
        self.inputs = {name: tuple(p["bits"]) for name, p in ports if p["direction"] == "input"}
        self.outputs = {name: tuple(p["bits"]) for name, p in ports if p["direction"] == "output"}

    @functools.cached_property
    def readers(self) -> Mapping[Bit, list[Pin]]:
        """Inputs of cells on each net."""
        found: dict[Bit, list[Pin]] = {}
        for cell in self.cells:
            for port, bits in cell.inputs.items():
                for bit in bits:
                    found.setdefault(bit, []).append(Pin(cell, port))
        return found

    @functools.cached_property
    def registers(self) -> Mapping[Bit, Cell]:
        """The flip-flop that drives a net."""
        return {bit: cell for cell in self.cells if cell.is_flip_flop
                for bit in cell.outputs["Q"]}

    @functools.cached_property
    def aliases(self) -> Mapping[Bit, list[Net]]:
        """Names of each net."""
        found: dict[Bit, list[Net]] = {}
        for name, bit in self.names.items():
            found.setdefault(bit, []).append(name)
        return found

    def name(self, bit: Bit) -> str:
        """Return the display name of a net: no name of a cell's port, if it has another."""
        names = self.aliases.get(bit, [("a net without a name", 0)])
        return bit_name(min(names, key=lambda name: name[0].startswith("_")))

    def start(self, bit: Bit) -> int | None:
        """Return the level that a register has at power-up; None if it has none."""
        return self._starts.get(bit)

    def bit(self, name: str) -> Bit | None:
        """Find a net by a name such as ``leds[6]``; None if there is none."""
        match = _NAME.fullmatch(name)
        return self.names.get((match[1], int(match[2] or 0))) if match else None


def _cells(found: Mapping) -> Iterator[Cell]:
    for name, cell in found.items():
        if cell["type"] == "$scopeinfo":
            continue
        sides: dict[str, dict[str, tuple[Bit, ...]]] = {"input": {}, "output": {}}
        for port, bits in cell["connections"].items():
            sides[cell["port_directions"][port]][port] = tuple(bits)
        yield Cell(name, cell["type"], cell["parameters"], sides["input"], sides["output"])


def cells(netlist: str, top: str, folder: Path) -> Flat:
    """Read a netlist cell by cell.

    Parameters
    ----------
    netlist, top : str
        In Verilog, and the name of its module.
    folder : path
        Where to work.
    """
    (folder / "cells.v").write_text(netlist, encoding="utf-8")
    yosys(_rams(netlist) + _CELLS.format(top=top), folder)
    return load(folder / "cells.json", top)


def models(netlist: str, top: str, side: str, folder: Path) -> str:
    """Return the commands that put Yosys' models into a netlist; block RAMs have none.

    They write it to files that are named after `side`, as RTLIL and as JSON.
    """
    (folder / f"{side}.v").write_text(netlist, encoding="utf-8")
    return _rams(netlist) + _MODELS.format(top=top, side=side)


def _rams(netlist: str) -> str:
    return _RAMS if "RAMB16" in netlist else ""


def load(path: Path, top: str) -> Flat:
    """Read a module that Yosys' ``write_json`` wrote."""
    return Flat(json.loads(path.read_text(encoding="utf-8"))["modules"][top])


def bit_name(net: Net) -> str:
    """Write a bit of a wire as Verilog does."""
    return f"{net[0]}[{net[1]}]"


def alias(plain: str, net: Net) -> str:
    """Write in RTLIL that a net has one more name."""
    return f"  wire \\{plain}\n  connect \\{plain} \\{net[0]} [{net[1]}]\n"


def add_to(path: Path, lines: str) -> None:
    """Put lines at the end of the module in an RTLIL file."""
    body, end, _ = path.read_text(encoding="utf-8").rpartition("end\n")
    path.write_text(f"{body}{lines}{end}", encoding="utf-8")


def yosys(script: str, folder: Path) -> str:
    """Run Yosys in a folder; give its log.

    Parameters
    ----------
    script : str
        Commands, joined by ``; ``.
    folder : path
        Where its files are.

    Raises
    ------
    EngineError
        If it fails.
    """
    (folder / "script.ys").write_text(script.replace("; ", "\n") + "\n", encoding="utf-8")
    return call([*YOSYS, "-s", "script.ys"], folder)
