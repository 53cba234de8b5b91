"""What of `positioner` is checked as a netlist: by its own pins, without RAMs, and on a Nexys 2."""

from fresa.machines import Positioner
from tb import boards
from tb.netlist.part import NetlistPart
from tb.netlist.subject import Subject
from tb.netlist.unknown import Runnable, serial_stimulus

from . import MACHINE

__all__ = ["NETLIST", "RUN"]

RAW = Subject("positioner", lambda: boards.component("positioner", Positioner()), (("rst", 0),),
              "fault", rams=False)
BOARD = Subject("nexys2-positioner", lambda: boards.board("positioner", Positioner()),
                (("reset", 0),), "fault")
"""The Nexys 2 with its block RAMs."""

_DUT = MACHINE.dut("positioner")
RUN = Runnable("positioner", _DUT.design, serial_stimulus(_DUT), ("RTL",))

NETLIST = NetlistPart(
    equal=(RAW,), flipped=((RAW, 1),), codes=(BOARD,), pins=(BOARD,), unknown=(RUN,),
    leaves_out={"unknown": {
        "netlist of positioner": "Yosys has no model of its block RAMs"}})
