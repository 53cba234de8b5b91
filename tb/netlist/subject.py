"""A design that is checked as a netlist, with the times that are built.

Gateware is elaborated once into one fragment, and from that come the RTL, the Verilog, the netlist
and the list of its state machines.
"""

import re
import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

from amaranth import Fragment, Signal

from ..contracts.contract import State
from ..design import Design
from ..engines import source
from ..engines.netlist import netlist
from ..mistake import Mistake

__all__ = ["ELABORATING", "Built", "Subject", "elaborate", "state_machines"]

ELABORATING = threading.Lock()
"""Held while gateware is elaborated and written: what is written is remembered without a lock."""


@dataclass(frozen=True)
class Built:
    """A design and what was made of it.

    Attributes
    ----------
    design : Design
        Whose `top` is elaborated.
    top : str
        Name of its module in the Verilog and in the netlist.
    rtl : str
        As Amaranth writes it, in RTLIL; in Verilog, as users get it, if it has no RAMs.
    netlist : str
        The netlist, in Verilog.
    states : dict of str to State
        Its state machines, by the names of their registers.
    """

    design: Design
    top: str
    rtl: str
    netlist: str
    states: Mapping[str, State]


@dataclass(frozen=True)
class Subject:
    """A design to check.

    Attributes
    ----------
    name : str
        The name shown to people.
    make : callable
        Makes the design.
    running : tuple of (str, int)
        Inputs and registers that hold no part of it in reset, with their levels then; on a board
        by their names in the machine.
    shows : str
        The output that shows an upset register of states, likewise.
    rams : bool
        Its memories become RAMs, if it has any; else flip-flops.
    mistake : Mistake, optional
        What to plant in it.
    """

    name: str
    make: Callable[[], Design]
    running: tuple[tuple[str, int], ...]
    shows: str
    rams: bool = True
    mistake: Mistake | None = None

    def with_mistake(self, mistake: Mistake) -> "Subject":
        """Return the same with a mistake planted in it."""
        return replace(self, mistake=mistake)

    def build(self) -> Built:
        """Elaborate and synthesise it; takes 5 to 15 s, and then is found again."""
        design = elaborate(self.make, self.mistake)
        rtl = source.rtlil(design) if self.rams else source.verilog(design)
        return Built(design, source.top_module(design), rtl, netlist(design, rams=self.rams),
                     dict(state_machines(Fragment.get(design.top, None))))


def elaborate(make: Callable[[], Design], mistake: Mistake | None = None) -> Design:
    """Make a design and its Verilog, with a mistake in it if there is one."""
    with ELABORATING:
        made = make()
        design = mistake.planted(made) if mistake is not None else replace(
            made, top=Fragment.get(made.top, None))
        source.verilog(design)
    return design


def state_machines(fragment: Fragment, path: str = "") -> Iterator[tuple[str, State]]:
    """Find every state machine in a design, whether it has marked its register or not."""
    registers: dict[int, Signal] = {
        id(signal): signal for domain, statements in fragment.statements.items()
        if domain != "comb" for signal in statements._lhs_signals()}
    for signal in registers.values():
        # Amaranth gives the register of a state machine, and of nothing else, names like IDLE/0.
        if signal.decoder is not None and re.fullmatch(r".+/0", str(signal.decoder(0))):
            yield f"{path}{signal.name}", State(signal)
    for inner, name, _ in fragment.subfragments:
        yield from state_machines(inner, f"{path}{name}.")
