# amaranth: UnusedElaboratable=no

"""What of `vplotter` is checked as a netlist: its pins on a Nexys 2, and parts by themselves."""

from collections.abc import Callable

from amaranth.lib.wiring import Component

from fresa.drive import StringMotor
from fresa.machines.vplotter import VPlotter
from fresa.motion import Hanging, StringHoming
from fresa.protocol import WallDialect
from fresa_boards.nexys2 import NEXYS2_1200
from tb import boards
from tb.netlist.part import NetlistPart
from tb.netlist.subject import Subject
from tb.netlist.unknown import Runnable, serial_stimulus

from . import DEFAULT, MACHINE

__all__ = ["NETLIST"]

BOARD = Subject("nexys2-vplotter", lambda: boards.board("vplotter", VPlotter(), on=NEXYS2_1200),
                (("reset", 0),), "fault")


def _part(name: str, make: Callable[..., Component], built: dict[str, int],
          shows: str = "fault") -> Subject:
    return Subject(f"vplotter-{name}", lambda: boards.component(name, make(**built)),
                   (("rst", 0),), shows, rams=False)


HOMING = _part("homing", StringHoming, DEFAULT.string_homing)
MOTOR = _part("motor", StringMotor, DEFAULT.string_motors[0], "")
HANGING = _part("hanging", Hanging, DEFAULT.hanging)
DIALECT = _part("dialect", WallDialect, DEFAULT.wall)

DUT = MACHINE.dut("vplotter")

NETLIST = NetlistPart(
    equal=(HOMING, MOTOR, HANGING), flipped=((HOMING, 1), (MOTOR, 1)), codes=(HOMING, DIALECT),
    pins=(BOARD,),
    unknown=(Runnable("vplotter", DUT.design, serial_stimulus(DUT), ("RTL",)),),
    leaves_out={
        "equal": {"vplotter": "its memories would be tens of thousands of flip-flops; of its parts "
                              "three are compared"},
        "codes": {BOARD.name: "a solver takes minutes for all of its state machines; those of its "
                              "own parts are looked at"},
        "unknown": {"netlist of vplotter": "Yosys has no model of its block RAMs"}})
