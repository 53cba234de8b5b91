# amaranth: UnusedElaboratable=no

"""The pins that are committed: somebody's machine is wired by them."""

import gc
import re
from pathlib import Path

import pytest

from fresa.machines import MillStation, Positioner, SerialOrders, Single
from fresa_boards.board import Allotment, pin_table
from fresa_boards.nexys2 import NEXYS2_500, NEXYS2_1200
from fresa_boards.wiring import check_names, prepare, simulation_ports

pytestmark = pytest.mark.filterwarnings("ignore::amaranth.hdl.UnusedElaboratable")


@pytest.fixture(autouse=True)
def unused():
    """Collect machines that were made for their roles alone while their warning is ignored."""
    yield
    gc.collect()


DOCS = Path(__file__).parents[2] / "docs"
MACHINES = {
    "mill": lambda: MillStation(source=SerialOrders(period=5208)),
    "single": Single,
    "positioner": Positioner,
}
_LINE = {"RXD": "rx", "TXD": "tx"}
_DISPLAY = {**{f"C{part}": f"segments[{bit}]"
               for bit, part in enumerate("A B C D E F G DP".split())},
            **{f"AN{digit}": f"digits[{digit}]" for digit in range(4)}}


def places(labels: str, bits: str) -> dict[str, str]:
    return dict(zip(labels.split(), bits.split(), strict=True))


COMMITTED = {
    "mill": {
        **places("JA1 JA2 JA3 JA4", "axis_x[0] axis_x[1] axis_x[2] axis_x[3]"),
        **places("JA7 JA8 JA9 JA10", "axis_y[0] axis_y[1] axis_y[2] axis_y[3]"),
        **places("JB1 JB2 JB3 JB4", "axis_z[0] axis_z[1] axis_z[2] axis_z[3]"),
        **places("SW0 SW1 SW2 SW3 SW4 SW5 SW7",
                 "jog[0] jog[1] jog[2] jog[3] jog[4] jog[5] automatic"),
        **places("BTN0 BTN1 BTN3", "reset start stop"),
        **places("LD0 LD1 LD2 LD3 LD5 LD6 LD7",
                 "leds[0] leds[1] leds[2] leds[3] busy error ready"),
        **_LINE, **_DISPLAY,
    },
    "single": {
        **places("JA1 JA2 JA3 JA4 JA7", "coils[0] coils[1] coils[2] coils[3] enable"),
        "BTN0": "reset",
        **places("LD0 LD1 LD2 LD3 LD5 LD6 LD7",
                 "coils[0] coils[1] coils[2] coils[3] moving fault enable"),
        **_LINE, **_DISPLAY,
    },
    "positioner": {
        **places("JA1 JA2 JA3", "step[0] direction[0] enable[0]"),
        **places("JA7 JA8 JA9", "step[1] direction[1] enable[1]"),
        **places("JB1 JB2 JB3 JB4", "step[2] direction[2] enable[2] buzzer"),
        **places("JC1 JC2 JC3", "limits[0] limits[1] limits[2]"),
        "BTN0": "reset",
        **places("LD0 LD1 LD2 LD3 LD4 LD5 LD6 LD7",
                 "moving[0] moving[1] moving[2] limits[0] limits[1] limits[2] fault connected"),
        **_LINE,
    },
}
SPARE = {"mill": 3, "single": 1}
"""Pins that are requested and have no meaning: SW6, BTN2 and LD4; and LD4."""


@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("board", [NEXYS2_500, NEXYS2_1200], ids=lambda board: board.name)
def test_pins_are_as_committed(board, name):
    rows = board.pin_rows(MACHINES[name](), board.allotment(name))
    now = {row.place: row.port for row in rows}
    assert now == COMMITTED[name], (
        "a pin that somebody has wired would change its meaning: put it back; or, if that is "
        "meant, change it here, too, and say so in CHANGELOG.md")


@pytest.mark.parametrize("name", MACHINES)
@pytest.mark.parametrize("board", [NEXYS2_500, NEXYS2_1200], ids=lambda board: board.name)
def test_every_word_of_an_allotment_is_a_port(board, name):
    allotment, ports = board.allotment(name), {*MACHINES[name]().roles, "reset", "-"}
    ports |= {"segments", "digits"} if allotment.number else set()
    assert {*allotment.header} | set(" ".join(allotment.panel.values()).split()) <= ports
    assert allotment.number is None or allotment.number in ports


@pytest.mark.parametrize("name", MACHINES)
def test_table_is_of_the_constraint_file(name):
    files = prepare(NEXYS2_500, name, MACHINES[name]()).files
    pins = re.findall(r'LOC="(\w+)"', files[f"{name}.ucf"].decode())
    rows = NEXYS2_500.pin_rows(MACHINES[name](), NEXYS2_500.allotment(name))
    assert {row.pin for row in rows} < {*pins}
    assert len(pins) == len(rows) + SPARE.get(name, 0) + 1  # and the clock


def test_table_for_people():
    table = pin_table(NEXYS2_500, Single(), NEXYS2_500.allotment("single")).splitlines()
    assert table[0] == "| nexys2-500 | FPGA | machine | |"
    assert table[2:4] == ["| JA1 | L15 | coils[0] | coils |", "| JA2 | K12 | coils[1] | coils |"]
    assert "| LD6 | F4 | fault | LED |" in table


def test_documented_motors_of_the_mill():
    rows = NEXYS2_500.pin_rows(MACHINES["mill"](), NEXYS2_500.allotment("mill"))
    documented = re.findall(r"^\| ([XYZ]) \| (J.*?) \|", (DOCS / "nexys2.md").read_text("utf-8"),
                            re.M)
    assert documented == [
        (axis.upper(), ", ".join(row.place for row in rows if row.port.startswith(f"axis_{axis}[")))
        for axis in "xyz"]


def test_what_shows_a_bit_to_a_check():
    def names(machine: str) -> dict[str, str]:
        made, allotment = MACHINES[machine](), NEXYS2_500.allotment(machine)
        return check_names(made, simulation_ports(NEXYS2_500, made, allotment), allotment)

    mill = names("mill")
    assert [mill[bit] for bit in ("error", "automatic", "reset", "axis_y[3]", "rx")] == [
        "leds[6]", "debouncer.level[7]", "debouncer.level[8]", "axis_y[3]", "rx"]
    assert names("single")["reset"] == "debouncer.o"
    assert names("positioner")["fault"] == "leds[6]"
    # What a LED shows too is checked on its own pin.
    assert [names("single")[bit] for bit in ("coils[2]", "enable")] == ["coils[2]", "enable"]
    assert names("positioner")["limits[1]"] == "limits[1]"


@pytest.mark.parametrize("board", [NEXYS2_500, NEXYS2_1200], ids=lambda board: board.name)
def test_display_is_active_low_once(board):
    """The ports are declared inverted, and so is what goes in: the pads are as the machine."""
    machine, allotment = MACHINES["mill"](), board.allotment("mill")
    for ports in (board.request(board.platform(), machine, allotment),
                  simulation_ports(board, machine, allotment)):
        low = {name for name, port in ports.items() if any(port.invert)}
        assert low == {"segments", "digits"}
        assert all(all(ports[name].invert) for name in low)


def test_no_pins_for_a_machine():
    with pytest.raises(ValueError, match=r"^nexys2-500 has no pins allotted to lathe$"):
        NEXYS2_500.allotment("lathe")


def test_a_port_without_a_pin():
    with pytest.raises(ValueError, match=r"^coils of the machine, coils, has no pin on the board$"):
        Allotment(header={"enable": "JA7"}, panel={"rx": "rx", "tx": "tx", "leds": "coils"}).places(
            Single())


def test_too_few_pins():
    with pytest.raises(ValueError, match=r"^coils has 4 bits, not those of JA1 JA2 JA3$"):
        Allotment(header={"coils": "JA1 JA2 JA3"}).places(Single())
