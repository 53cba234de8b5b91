# amaranth: UnusedElaboratable=no

"""Every board but the Nexys 2: its pins, and each machine on it."""

import argparse
import json
import re
from collections import Counter
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest
from amaranth import Module

from fresa.machines import MillStation, Positioner, SerialOrders
from fresa.machines.mill import MillTiming
from fresa.machines.positioner import PositionerTiming
from fresa.roles import MachineComponent
from fresa_boards.board import Board, pin_table
from fresa_boards.boards import BOARDS
from fresa_boards.drawing import pin_drawing
from fresa_boards.wiring import prepare
from tb.boards import behind_pins
from tb.boards import board as on_board
from tb.engines import AmaranthEngine
from tb.machines import machines
from tb.uart import encode
from tools.machines.options import values_of

pytestmark = pytest.mark.usefixtures("unused")

OPEN = {name: board for name, board in BOARDS.items() if board.flow}
FAMILIES = {board.family: board for board in OPEN.values()}
PAIRS = [(family, name) for family, board in FAMILIES.items() for name in board.allotments]
EACH_PAIR = pytest.mark.parametrize(("family", "name"), PAIRS)
EACH_POSITIONER = pytest.mark.parametrize("family", [
    family for family, name in PAIRS if name == "positioner"])
COMMITTED = json.loads(Path(__file__).with_name("pins.json").read_text())
SITE = re.compile(r"""^(?:set_io\ (?P<ice40>\S+\ \S+)
                        | LOCATE\ COMP\ "(?P<ecp5>\S+"\ SITE\ "\S+)";
                        | IO_LOC\ "(?P<gowin>\S+"\ \S+);)$""", re.M | re.X)


def made(board: Board, name: str) -> MachineComponent:
    """Make a machine for a board, with the line for orders if it is the mill."""
    if name == "mill":
        return MillStation(source=SerialOrders(period=16),
                           timing=MillTiming.real(clock=board.clock))
    machine = machines()[name]
    values = values_of(argparse.Namespace(), machine.options)
    found = machine.make(**machine.real(board.clock, **values))
    assert isinstance(found, MachineComponent)
    return found


def test_boards_have_pins_for_machines_that_there_are():
    assert all({*board.allotments} and {*board.allotments} <= {*machines()}
               for board in BOARDS.values())


def test_no_pins_are_taken_away():
    assert {family: {*of} for family, of in COMMITTED.items()} == {
        family: {*board.allotments} for family, board in FAMILIES.items()}


@EACH_PAIR
def test_pins_are_those_committed(family, name):
    board = FAMILIES[family]
    rows = board.pin_rows(made(board, name), board.allotment(name))
    assert {row.place: [row.port, row.pin] for row in rows} == COMMITTED[family][name], (
        "a pin that somebody has wired would change its meaning: put it back; or, if that is "
        "meant, change it here, too, and say so in CHANGELOG.md")


@EACH_PAIR
def test_each_pin_is_constrained_once(family, name, monkeypatch):
    """Whatever is behind the pins."""
    board = FAMILIES[family]
    machine = made(board, name)
    monkeypatch.setattr(type(machine), "elaborate", lambda machine, platform: Module())
    files = prepare(board, name, machine).files
    (constraints,) = (text.decode() for file, text in files.items()
                      if file.endswith((".pcf", ".lpf", ".cst")))
    sites = [match[match.lastgroup or 0].replace('"', "").split(" ")[-1]
             for match in SITE.finditer(constraints)]
    assert max(Counter(sites).values()) == 1
    pins = {pin for _, pin in COMMITTED[family][name].values()}
    bits = sum(map(len, board.allotment(name).places(machine).values()))
    assert pins < {*sites} and len(sites) == bits + 1 + len(board.held)  # and the clock
    assert not any(name.endswith(".debug.v") for name in files)


def test_sockets_of_the_nexys_2_are_seen_as_they_lie():
    """On its right edge, where the page draws them too: pin 1 at the top of the left column."""
    for layout in BOARDS["nexys2-500"].layouts:
        assert layout.view == "components up, the sockets at the right"
        assert layout.left.split()[0] == f"{layout.name}1"
        assert layout.right.split()[0] == f"{layout.name}7"


@pytest.mark.parametrize("family", FAMILIES)
def test_layouts_show_each_header_pin_once(family):
    board = FAMILIES[family]
    shown = Counter(" ".join(f"{each.left} {each.right}" for each in board.layouts).split())
    assert {label: shown[label] for label in board.header} == dict.fromkeys(board.header, 1)
    assert {each.left.count(" ") for each in board.layouts} == {
        each.right.count(" ") for each in board.layouts}


@pytest.mark.parametrize(("family", "name"), [*PAIRS, ("nexys2", "positioner")])
def test_table_and_drawing_have_the_same_pins(family, name):
    board = (FAMILIES | {"nexys2": BOARDS["nexys2-500"]})[family]
    machine, allotment = made(board, name), board.allotment(name)
    drawing = ET.fromstring(pin_drawing(board, name, machine, allotment))
    words = [element.text or "" for element in drawing.iter("{http://www.w3.org/2000/svg}text")]
    table = pin_table(board, machine, allotment)
    for row in board.pin_rows(machine, allotment):
        assert f"| {row.place} | {row.pin} | {row.port} | {row.role} |" in table
        assert (row.place in words and any(word.startswith(row.port) for word in words)
                or f"{row.place}: {row.port}" in words)


@pytest.mark.parametrize(("family", "reserved"), [
    ("tang_nano_9k", {"36", "79", "86"}), ("icepi_zero", set())])
def test_pins_that_are_not_for_machines_are_dashed(family, reserved):
    board = FAMILIES[family]
    drawing = [*ET.fromstring(pin_drawing(
        board, "positioner", made(board, "positioner"), board.allotment("positioner")))]
    dashed = {after.text for box, after in pairwise(drawing) if "stroke-dasharray" in box.attrib}
    assert dashed >= reserved and not dashed & {*board.header, "GND", "3V3", "5V"}
    legends = [each for each in drawing if (each.text or "").startswith("dashed: ")]
    assert len(legends) == bool(dashed) == bool(reserved)


def test_contacts_on_a_header_are_to_ground():
    board = BOARDS["icepi-zero"]
    machine, allotment = made(board, "positioner"), board.allotment("positioner")
    table = pin_table(board, machine, allotment)
    drawing = pin_drawing(board, "positioner", machine, allotment)
    assert "| limits[0] | limit switch, to GND |" in table and "| reset | button |" in table
    assert drawing.count("(limit switch, to GND)") == 3 == table.count("to GND")


@EACH_POSITIONER
def test_positioner_moves_at_the_pins(family):
    """With the levels of the board: LEDs, the reset, and contacts to ground."""
    board = FAMILIES[family]
    timing = PositionerTiming(clock=16_000, baud=1000, top_speed=1500, width=2, low=3, setup=2,
                              hold=4, settle=30, report=14_000)
    machine, allotment = Positioner(timing=timing), board.allotment("positioner")
    engine = AmaranthEngine(on_board("positioner", machine, debounce=3, on=board))
    reset = next(name for name, bits in allotment.places(machine).items()
                 if [str(bit) for bit in bits] == ["reset"])
    port = board.request(board.platform(), machine, allotment)[reset]
    free = int(port.invert[0])
    engine.set(rx=1, limits=7, **{reset: free})
    text = encode(b"CONNECT\nMOV MOT2 C\n", 16)
    engine.apply({"rx": [1] * 80 + text + [1] * 200}, [])
    assert engine.get("direction", "enable") == (0b010, 0b111)
    engine.apply({reset: [1 - free] * 12, "rx": [1] * 12}, [])
    assert engine.get("enable") == 0


@EACH_POSITIONER
def test_what_is_wired_to_the_pins_has_the_levels_of_the_machine(family):
    """Contacts are on at 1 and drivers too, and the machine starts after the board."""
    board = FAMILIES[family]
    timing = PositionerTiming(clock=16_000, baud=1000, top_speed=1500, width=2, low=3, setup=2,
                              hold=4, settle=30, report=14_000)
    design = behind_pins("positioner", Positioner(timing=timing), clock=16_000, on=board)
    assert {*design.inputs} == {"rx", "limits", "reset"}
    assert {*design.outputs} == {"step", "direction", "enable", "buzzer", "tx"}
    engine = AmaranthEngine(design)
    line = ([1] * 8 + encode(b"CONNECT\nMOV MOT2 C\n", 16) + [1] * 200)
    for limits, moves in ((0b111, False), (0, True)):
        engine.set(rx=1, reset=1, limits=limits)
        engine.run(400)  # as long as contacts may bounce
        assert engine.get("enable") == 0 and engine.get("tx") == 1
        engine.set(reset=0)
        engine.run(400)
        engine.apply({"rx": line}, [])
        assert engine.get("enable") == 0b111
        assert (len(engine.run(1000, ("step",))) > 1) == moves


@pytest.mark.parametrize(("name", "seed"), [
    ("icepi-zero", ["--seed", "1"]), ("ulx3s-25f", ["--seed", "1"]), ("icebreaker", [])])
def test_random_numbers_of_place_and_route_begin_where_board_or_family_says(name, seed):
    board = BOARDS[name]
    plan = prepare(board, "single", made(board, "single"))
    assert board.flow is not None
    _, route, _ = board.flow.commands(plan.files, "single")
    assert route[3:3 + len(seed)] == seed and ("--seed" in route) == bool(seed)


class TestStartUp:
    def test_is_20_us(self):
        assert {name: board.start_up for name, board in OPEN.items()} == {
            name: -(-board.clock // 50_000) for name, board in OPEN.items()}

    @pytest.mark.parametrize("name", ["nexys2-500", "nexys2-1200"])
    def test_a_nexys2_has_none(self, name):
        assert BOARDS[name].start_up == 0


def test_the_esp32_of_an_ulx3s_is_kept_from_starting_it_anew():
    board = BOARDS["ulx3s-12f"]
    plan = prepare(board, "single", made(board, "single"))
    assert 'SITE "L2"' in plan.files["single.lpf"].decode()
    assert re.search(r"connect \\held_0\S* 1'1|connect \\o 1'1|esp32_0__gpio0__io", plan.rtlil)


def test_sources_have_no_path_of_the_machine():
    board = BOARDS["icebreaker"]
    plan = prepare(board, "single", made(board, "single"))
    assert "attribute \\src" not in plan.rtlil
    assert not any(str(Path.home()).encode() in text for text in plan.files.values())


def test_the_board_of_the_guide():
    """docs/adding-a-board.md makes a board, and a machine runs on it."""
    page = (Path(__file__).parents[2] / "docs" / "adding-a-board.md").read_text()
    (source,) = re.findall(r"```python\n(.*?)```", page, re.S)
    module: dict = {"__name__": "fresa_boards.of_the_guide", "__package__": "fresa_boards"}
    exec(compile(source, "adding-a-board.md", "exec"), module)
    (board,) = module["BOARDS"]
    plan = prepare(board, "single", made(board, "single"))
    assert "set_io coils_0__io[0] B1" in plan.files["single.pcf"].decode()
    shown = " ".join(f"{each.left} {each.right}" for each in board.layouts).split()
    assert {*board.header} <= {*shown}
    drawing = pin_drawing(board, "single", made(board, "single"), board.allotment("single"))
    assert "coils[0]" in drawing
