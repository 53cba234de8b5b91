# amaranth: UnusedElaboratable=no

"""What of `vplotter` is checked as a netlist: its pins on a Nexys 2, and parts by themselves."""

from fresa.drive import StringMotor
from fresa.machines.vplotter import LENGTH_BITS, PLACE_BITS, VPlotter
from fresa.motion import Hanging, StringHoming
from fresa.protocol import WallDialect
from tb import boards
from tb.netlist.part import NetlistPart
from tb.netlist.subject import Subject
from tb.netlist.unknown import Runnable, serial_stimulus

from . import DEFAULT, MACHINE

__all__ = ["NETLIST"]

BOARD = Subject("nexys2-vplotter", lambda: boards.board("vplotter", VPlotter()), (("reset", 0),),
                "fault")


def _homing() -> StringHoming:
    return StringHoming(pace=DEFAULT.pace, most=DEFAULT.most_wound, most_off=510)


def _motor() -> StringMotor:
    return StringMotor(bits=LENGTH_BITS, period=DEFAULT.period, first=31_834)


def _hanging() -> Hanging:
    across, below = (DEFAULT.ticks(place) for place in DEFAULT.rest)
    return Hanging(width=DEFAULT.ticks(DEFAULT.wall_width), bits=PLACE_BITS, first_across=across,
                   first_below=below)


def _dialect() -> WallDialect:
    return WallDialect(width=DEFAULT.wall_width, top=DEFAULT.least_y, height=DEFAULT.wall_height,
                       feed=3000)


HOMING, MOTOR, HANGING, DIALECT = (
    Subject(f"vplotter-{name}", lambda name=name, make=make: boards.component(name, make()),
            (("rst", 0),), shows, rams=False)
    for name, make, shows in (
        ("homing", _homing, "fault"), ("motor", _motor, ""), ("hanging", _hanging, "fault"),
        ("dialect", _dialect, "fault")))

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
