# amaranth: UnusedElaboratable=no

"""A second motor of `gcode`: its pins on each board, and nothing else has another place."""

import re

import pytest

from fresa.machines.gcode import GCode, GCodeSettings
from fresa_boards.board import Allotment, Board
from fresa_boards.boards import BOARDS
from fresa_boards.wiring import prepare

pytestmark = pytest.mark.usefixtures("unused")

FAMILIES = {board.family: board for board in BOARDS.values()
            if "gcode" in board.allotments and "second_step" in board.allotment("gcode").header}
COMMITTED = {
    "icepi_zero": {"GPIO5": ("second_step", "STEP", "E1"),
                   "GPIO6": ("second_direction", "DIR", "F3"),
                   "GPIO13": ("second_limit", "limit switch, to GND", "E3")},
    "ulx3s": {"GN0": ("second_step", "STEP", "C11"),
              "GP0": ("second_direction", "DIR", "B11"),
              "GN1": ("second_limit", "limit switch, to GND", "A11")},
    "nexys2": {"JA9": ("second_step", "STEP", "M14"),
               "JA10": ("second_direction", "DIR", "M16"),
               "JD1": ("second_limit", "limit switch, to GND", "J13")},
}


def places(board: Board, second_motor: str | None) -> dict[str, tuple[str, str, str]]:
    """Return port, role and pin of the FPGA at each place of a board."""
    machine = GCode(settings=GCodeSettings(clock=board.clock, second_motor=second_motor))
    return {row.place: (row.port, row.role, row.pin)
            for row in board.pin_rows(machine, board.allotment("gcode"))}


@pytest.mark.parametrize("family", FAMILIES)
def test_pins_are_those_committed_and_all_others_stay(family):
    without, given = places(FAMILIES[family], None), places(FAMILIES[family], "y")
    assert given == without | COMMITTED[family], (
        "a pin that somebody has wired would change its meaning: put it back; or, if that is "
        "meant, change it here, too, and say so in CHANGELOG.md")
    assert not without.keys() & COMMITTED[family].keys()


@pytest.mark.parametrize("family", [
    family if family == "nexys2" else pytest.param(family, marks=pytest.mark.long)
    for family in FAMILIES])
def test_each_has_a_pin_of_its_own_in_the_constraints(family):
    board = FAMILIES[family]
    machine = GCode(settings=GCodeSettings(clock=board.clock, second_motor="y"))
    files = prepare(board, "gcode", machine).files
    (text,) = (text.decode() for name, text in files.items() if name.endswith((".lpf", ".ucf")))
    for port, _, pin in COMMITTED[family].values():
        assert len(re.findall(rf'"?{port}_0__io"?.*"{pin}"', text)) == 1
    pulled = [line for line in text.splitlines() if "second_" in line and "PULL" in line]
    assert len(pulled) == 1 and "second_limit" in pulled[0]


def test_a_board_without_pins_for_it_is_refused():
    board = BOARDS["icepi-zero"]
    given = board.allotment("gcode")
    header = {port: pins for port, pins in given.header.items() if port != "second_limit"}
    machine = GCode(settings=GCodeSettings(second_motor="y"))
    with pytest.raises(ValueError, match="^second_limit of the machine, limit switch, has no pin "
                                         "on the board$"):
        Allotment(header, given.panel).places(machine)
