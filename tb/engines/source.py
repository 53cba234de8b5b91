"""A design as text: RTLIL, and the Verilog for users."""

import re
from collections.abc import Callable
from unittest.mock import patch
from weakref import WeakValueDictionary

from amaranth import Value
from amaranth.back import rtlil as backend
from amaranth.hdl._ir import PortDirection
from amaranth.hdl._nir import Value as Nets

from fresa_boards.verilog import from_rtlil

from ..design import Design

__all__ = ["rtlil", "top_module", "verilog"]

_designs: WeakValueDictionary[int, Design] = WeakValueDictionary()
_texts: dict[int, dict[str, str]] = {}


def rtlil(design: Design) -> str:
    """Return the RTLIL of a design, stored with it, since gateware is elaborated only once."""
    def convert() -> str:
        ports = {"clk": (design.clk, PortDirection.Input)}
        ports |= {name: (Value.cast(s), PortDirection.Input) for name, s in design.inputs.items()}
        ports |= {name: (Value.cast(s), PortDirection.Output)
                  for name, s in design.outputs.items()}
        with patch.object(backend.ModuleEmitter, "emit_memory", _emit_memory):
            return backend.convert(design.top, name=design.name, ports=ports, emit_src=False)

    return _remembered(design, "rtlil", convert)


def _emit_memory(emitter, index: int, cell) -> None:
    """Write what a memory has at power-up by rows: Amaranth makes an object of each bit."""
    width, bits = cell.width, cell.width * cell.depth
    rows = "".join(f"{row & (1 << width) - 1:0{width}b}" for row in reversed(cell.init))
    emitter.builder.cell(
        "$meminit_v2", src_loc=cell.src_loc,
        parameters={"MEMID": emitter.memories[index].memid, "ABITS": 0, "WIDTH": width,
                    "WORDS": cell.depth, "PRIORITY": 0},
        ports={"ADDR": emitter.sigspec(),
               "DATA": f"{bits}'{rows}" if bits else emitter.sigspec(),
               "EN": emitter.sigspec(Nets.ones(width))})


def verilog(design: Design) -> str:
    """Return the Verilog of a design, by the emitter for boards and users."""
    return _remembered(design, "verilog", lambda: from_rtlil(rtlil(design)))


def _remembered(design: Design, what: str, convert: Callable[[], str]) -> str:
    key = id(design)
    if _designs.get(key) is not design:
        for gone in [other for other in _texts if other not in _designs]:
            del _texts[gone]
        _designs[key], _texts[key] = design, {}
    texts = _texts[key]
    if what not in texts:
        texts[what] = convert()
    return texts[what]


def top_module(design: Design) -> str:
    """Return the name of the top module in the Verilog."""
    return re.sub(r"\W", "_", design.name.replace(".", "__"))
