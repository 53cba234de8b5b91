"""What of the mill is checked as a netlist: by its own pins, and on a Nexys 2."""

from typing import Any

import numpy as np
from amaranth import Mux

from fresa.machines import MillStation
from fresa.machines.mill import PIXEL_STEPS, Z_TRAVEL, MillTiming
from fresa.machines.station import OrderSource
from fresa.motion import CoordinateGenerator, SquareGenerator
from fresa_boards import wiring
from fresa_boards.nexys2 import NEXYS2_500
from tb import boards
from tb.contracts.contract import State
from tb.design import Design
from tb.mistake import Mistake
from tb.netlist.part import BuiltPins, NetlistPart
from tb.netlist.subject import Subject
from tb.netlist.unknown import Runnable, random_stimulus
from tb.stimulus import Stimulus

from . import MACHINE

__all__ = ["MILL", "NETLIST", "PANEL", "RUN"]


def _station(source: OrderSource) -> Design:
    return boards.board("mill", MillStation(source=source))


def _real(**options: bool) -> Design:
    return MACHINE.design(timing=MillTiming.real(), z_travel=Z_TRAVEL, **options)


def _square() -> SquareGenerator:
    return SquareGenerator(side=20 * PIXEL_STEPS)


# Enough pixels for a block RAM. Which ones are set makes no difference to a check.
_PIXELS = [[(row * row + column) % 3 == 0 for column in range(40)] for row in range(40)]
_RUNNING = (("automatic", 1), ("reset", 0))

MILL = Subject("mill", _real, (("rst", 0), ("mode", 1)), "error")
GUARDED = Subject("mill-guarded", lambda: _real(guard=True), MILL.running, MILL.shows)
BOARD = Subject("nexys2-square", lambda: _station(_square()), _RUNNING, "error")
"""The Nexys 2 that walks the thesis's square: all of it but the block RAMs."""

PICTURE = Subject("nexys2-picture",
                  lambda: _station(CoordinateGenerator(_PIXELS, pixel_steps=PIXEL_STEPS)),
                  _RUNNING, "error")


def _unused(state: Any) -> Any:
    """Have a code that no state has."""
    return state > max(State(state).codes.values())


_SEQUENCER = "sequencer.motion_state_state"
_STAYS = Mistake(_SEQUENCER, lambda right, at: Mux(
    _unused(at(_SEQUENCER)), at(_SEQUENCER), right))
_HIDDEN = Mistake("sequencer.fault", lambda right, at: right & ~_unused(at(_SEQUENCER)))
_DIRECT = Mistake("machine.mill.stop", lambda right, at: right | at("buttons.i")[3])
_INVERTED = Mistake("contacts_synchronizer.stage0", lambda right, _: ~right)


def _verilog() -> str:
    """Make the Verilog that ISE is given."""
    plan = wiring.prepare(NEXYS2_500, "mill", MillStation(source=_square()))
    return plan.files["mill.v"].decode()


def _contacts(seed: int, clocks: int, resets: bool):
    """Switches and buttons at random, each level for a while."""
    rng = np.random.default_rng(seed)
    changes = np.cumsum(rng.integers(0, 24, clocks) == 0)
    switches = rng.integers(0, 1 << 8, clocks, np.uint8)[changes]
    buttons = rng.integers(0, 1 << 4, clocks, np.uint8)[changes]
    rows: Stimulus = {"switches": switches, "buttons": buttons if resets else buttons & 0b1110}
    yield rows


_DUTS = {name: MACHINE.dut(name) for name in (MILL.name, GUARDED.name)}
RUN = Runnable(MILL.name, _DUTS[MILL.name].design, random_stimulus(_DUTS[MILL.name]), control=True)
PANEL = Runnable(
    BOARD.name,
    lambda: boards.board("mill", MillStation(source=SquareGenerator(side=3), z_travel=2,
                                             timing=MillTiming(period=2, scan_bits=3)), debounce=1),
    _contacts)

_NO_RAM = {PICTURE.name: "Yosys has no model of the block RAM that the picture is in"}

NETLIST = NetlistPart(
    equal=(MILL, GUARDED, BOARD), flipped=((MILL, None),), codes=(MILL, BOARD, PICTURE),
    pins=(PICTURE,), built=(BuiltPins("nexys2-500", "mill", _verilog, "clk50_0__io"),),
    unknown=(RUN, Runnable(GUARDED.name, _DUTS[GUARDED.name].design,
                           random_stimulus(_DUTS[MILL.name])), PANEL),
    mistakes={"codes": ((MILL.with_mistake(_STAYS), "unused codes stay"),
                        (MILL.with_mistake(_HIDDEN), "unused codes do not show")),
              "pins": ((BOARD.with_mistake(_DIRECT), "BTN3 stops the machine directly"),
                       (BOARD.with_mistake(_INVERTED), "inverters at the pins"))},
    leaves_out={"equal": _NO_RAM, "unknown": _NO_RAM,
                "pins": {MILL.name: "its inputs are no pins, and keep to the clock by contract"}})
