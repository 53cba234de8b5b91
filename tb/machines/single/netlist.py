"""What of `single` is checked as a netlist: by its own pins, without RAMs, and on a Nexys 2."""

from fresa.machines import Single
from tb import boards
from tb.netlist.part import NetlistPart
from tb.netlist.subject import Subject
from tb.netlist.unknown import Runnable, serial_stimulus

from . import MACHINE

__all__ = ["NETLIST", "RUN"]

RAW = Subject("single", lambda: boards.component("single", Single()), (("rst", 0),), "fault",
              rams=False)
BOARD = Subject("nexys2-single", lambda: boards.board("single", Single()), (("reset", 0),),
                "fault")
"""The Nexys 2 with its block RAMs."""

_DUT = MACHINE.dut("single")
RUN = Runnable("single", _DUT.design, serial_stimulus(_DUT), ("RTL",))

NETLIST = NetlistPart(
    equal=(RAW,), flipped=((RAW, 1),), codes=(BOARD,), pins=(BOARD,), unknown=(RUN,),
    leaves_out={"unknown": {
        "netlist of single": "Yosys has no model of its block RAMs"}})
