# amaranth: UnusedElaboratable=no

"""What of `gcode` is checked as a netlist: its pins on a Nexys 2, and parts by themselves."""

from fresa.machines.gcode import GCode
from fresa.motion import BlockLoader, GCodeControl, GCodeHoming, PathWalk
from fresa.protocol import GCodeGate, GCodeLister
from tb import boards
from tb.netlist.part import NetlistPart
from tb.netlist.subject import Subject
from tb.netlist.unknown import Runnable, serial_stimulus

from . import MACHINE

__all__ = ["NETLIST"]

BOARD = Subject("nexys2-gcode", lambda: boards.board("gcode", GCode()), (("reset", 0),), "fault")

CONTROL, HOMING, GATE, LISTER, LOADER, WALK = (
    Subject(f"gcode-{name}", lambda name=name, make=make: boards.component(name, make()),
            (("rst", 0),), "fault", rams=False)
    for name, make in (("control", GCodeControl), ("homing", GCodeHoming), ("gate", GCodeGate),
                       ("lister", GCodeLister), ("loader", BlockLoader), ("walk", PathWalk)))

DUT = MACHINE.dut("gcode")

NETLIST = NetlistPart(
    equal=(WALK, HOMING), flipped=((HOMING, 1),),
    codes=(CONTROL, HOMING, GATE, LISTER, LOADER), pins=(BOARD,),
    unknown=(Runnable("gcode", DUT.design, serial_stimulus(DUT), ("RTL",)),),
    leaves_out={
        "equal": {"gcode": "its memories would be tens of thousands of flip-flops; of its parts "
                           "two are compared"},
        "codes": {BOARD.name: "a solver takes minutes for all of its state machines; some of "
                              "those in its parts are looked at"},
        "unknown": {"netlist of gcode": "Yosys has no model of its block RAMs"}})
