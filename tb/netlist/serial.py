"""What of a machine with a serial line is checked as a netlist."""

from collections.abc import Callable

from fresa.roles import MachineComponent

from .. import boards
from ..runners import Dut
from .part import NetlistPart
from .subject import Subject
from .unknown import Runnable, serial_stimulus

__all__ = ["serial_part"]


def serial_part(dut: Dut, make: Callable[[], MachineComponent]) -> NetlistPart:
    """Return what is checked of a machine: by its own pins, without RAMs, and on a Nexys 2.

    Parameters
    ----------
    dut : Dut
        The machine with short times.
    make : callable
        Makes it with the times that are built.
    """
    raw = Subject(dut.name, lambda: boards.component(dut.name, make()), (("rst", 0),), "fault",
                  rams=False)
    board = Subject(f"nexys2-{dut.name}", lambda: boards.board(dut.name, make()), (("reset", 0),),
                    "fault")
    return NetlistPart(
        equal=(raw,), flipped=((raw, 1),), codes=(board,), pins=(board,),
        unknown=(Runnable(dut.name, dut.design, serial_stimulus(dut), ("RTL",)),),
        leaves_out={"unknown": {
            f"netlist of {dut.name}": "Yosys has no model of its block RAMs"}})
