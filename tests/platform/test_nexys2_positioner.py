# amaranth: UnusedElaboratable=no

"""The positioner on its board: each pin, in simulation and in the netlist."""

import re
from functools import cache

import numpy as np
import pytest
from amaranth.hdl import _nir as nir

from fresa.machines import Positioner
from fresa.machines.positioner import PositionerTiming
from fresa_boards.nexys2 import NEXYS2_500, NEXYS2_1200
from fresa_boards.wiring import prepare
from tb.boards import board as on_board
from tb.design import Design
from tb.engines import AmaranthEngine, CXXRTLEngine
from tb.machines.positioner.model import PositionerModel
from tb.runners import ModelRunner
from tb.uart import encode
from tests.platform.pins import LINE, buffers, check_pins, netlist_of, pins_of, users

BIT = 16
TIMING = PositionerTiming(clock=16_000, baud=1000, top_speed=1500, width=2, low=3, setup=2, hold=4,
                      settle=30, report=14_000)
MOTORS = ["step", "direction", "enable"]
OUTPUTS = ["tx", "buzzer", "leds", *MOTORS]
RELEASED = 7


def design(*turned: str, **options) -> Design:
    return on_board("positioner", Positioner(timing=TIMING, **options), debounce=3,
                    inverted=turned)


elaborated_once = cache(design)


class Board:
    """A board on the bench, with someone at its line."""

    def __init__(self, *turned: str, **options) -> None:
        self.engine = (AmaranthEngine(design(*turned, **options)) if CXXRTLEngine.missing() else
                       CXXRTLEngine(elaborated_once(*turned, **options)))
        self.engine.set(rx=1, limits=RELEASED)
        self.seen = {name: np.empty(0, int) for name in OUTPUTS}
        self.apply([1] * 80)

    def apply(self, rx: list[int]) -> None:
        for name, values in self.engine.apply({"rx": rx}, OUTPUTS).items():
            self.seen[name] = np.concatenate([self.seen[name], values])

    def say(self, text: str, wait: int = 80) -> None:
        self.apply(encode(text.encode(), BIT) + [1] * wait)

    def steps(self) -> list[int]:
        return [int((np.diff(self.seen["step"] >> motor & 1) == 1).sum()) for motor in range(3)]


class TestBoard:
    def test_leds_and_motors(self):
        board = Board()
        assert board.engine.get("leds", *MOTORS) == (0, 0, 0, 0)
        board.say("CONNECT\nMOV MOT2 C\n", 1000)
        assert board.engine.get("leds") == 0b10000010
        assert board.engine.get("direction", "enable") == (0b010, 0b111)
        assert board.steps()[0] == board.steps()[2] == 0 < board.steps()[1]

    def test_a_limit_is_on_where_its_pin_is_pulled_down(self):
        board = Board()
        board.engine.set(limits=0b101)
        board.say("CONNECT\nMOV MOT2 C\nMOV MOT1 C\n", 1000)
        assert board.steps()[1] == 0 < board.steps()[0]
        assert board.engine.get("leds") == 0b10010001 and board.engine.get("buzzer")

    def test_switches_that_open_where_they_are_pressed(self):
        board = Board("limits")
        board.engine.set(limits=0b010)
        board.apply([1] * 40)
        assert board.engine.get("leds") == 0b00010000
        board.say("CONNECT\nMOV MOT2 C\nMOV MOT1 C\n", 1000)
        assert board.steps()[1] == 0 < board.steps()[0]

    @pytest.mark.parametrize("inverted", [False, pytest.param(True, marks=pytest.mark.long)])
    def test_enable_that_gives_power_where_it_is_low(self, inverted):
        board, other = Board("enable", inverted=inverted), Board(inverted=inverted)
        for one in (board, other):
            one.say("CONNECT\nMOV MOT1 C\n", 1000)
            one.say("DISCONNECT\n")
        assert (board.seen["enable"] == other.seen["enable"] ^ 0b111).all()
        assert board.seen["enable"][0] == 0b111 and 0 in board.seen["enable"]
        for name in ("step", "direction"):
            assert (board.seen[name] == other.seen[name]).all()

    def test_the_button_resets_when_it_is_still(self):
        board = Board()
        board.say("CONNECT\nMOV MOT2 C\n")
        board.engine.set(buttons=1)
        board.apply([1] * 2)
        board.engine.set(buttons=0)
        board.apply([1] * 10)
        assert board.engine.get("leds") == 0b10000010
        board.engine.set(buttons=1)
        board.apply([1] * 20)
        assert board.engine.get("leds") == 0
        board.engine.set(buttons=0)
        board.apply([1] * 20)
        board.say("CONNECT\n")
        assert board.engine.get("leds") == 0b10000000

    @pytest.mark.parametrize("inverted", [False, pytest.param(True, marks=pytest.mark.long)])
    def test_pins_are_those_of_the_model_a_clock_later(self, inverted):
        """And two clocks later what comes in."""
        options = {"inverted": inverted, "backlash": (2, 0, 1)}
        board, model = Board(**options), PositionerModel(timing=TIMING, bit=BIT, **options)
        text = "CONNECT\nP 1 9 -4 6\nGOTO 1\nGOTO 2\nMOV MOT3 CC\n"
        board.say(text, 12_000)
        rx = [1] * 80 + encode(text.encode(), BIT) + [1] * 12_000
        levels = np.array([1, 1, *rx[:-2]])
        names = ("tx", "buzzer", "step", "direction", "enable")
        rows = ModelRunner(model).apply(
            {"rx": levels, "limits": 0 * levels, "rst": 0 * levels}, names)
        for name in names:
            assert board.seen[name][1:].tolist() == rows[name][:-1].tolist()
        rest = 0b111 if inverted else 0
        assert [board.seen[name][0] for name in MOTORS] == [rest, rest, 0]


@pytest.mark.usefixtures("unused")
@pytest.mark.parametrize("where", [NEXYS2_500, NEXYS2_1200], ids=lambda where: where.name)
def test_pins_are_as_committed(where):
    check_pins(where, "positioner", Positioner(), {
        **pins_of("JA1 JA2 JA3", "step[0] direction[0] enable[0]"),
        **pins_of("JA7 JA8 JA9", "step[1] direction[1] enable[1]"),
        **pins_of("JB1 JB2 JB3 JB4", "step[2] direction[2] enable[2] buzzer"),
        **pins_of("JC1 JC2 JC3", "limits[0] limits[1] limits[2]"),
        "BTN0": "reset",
        **pins_of("LD0 LD1 LD2 LD3 LD4 LD5 LD6 LD7",
                 "moving[0] moving[1] moving[2] limits[0] limits[1] limits[2] fault connected"),
        **LINE})


@pytest.fixture(scope="module")
def netlist() -> nir.Netlist:
    return netlist_of(NEXYS2_500, "positioner", Positioner())


class TestNetlist:
    @pytest.mark.parametrize("name", ["step", "direction", "enable", "buzzer", "uart_0__tx"])
    def test_what_goes_out_comes_straight_from_a_flip_flop_in_its_block(self, netlist, name):
        [(number, buffer)] = buffers(netlist, name)
        assert buffer.o is not None
        for net in buffer.o:
            cell = netlist.cells[net.cell]
            assert isinstance(cell, nir.FlipFlop) and cell.attributes["IOB"] == "TRUE"
            assert cell.arst == nir.Net.from_const(0)
            # A flip-flop in an I/O block serves its pin alone.
            assert users(netlist, {net.cell}) == {number}

    @pytest.mark.parametrize("name", ["button_0", "limits", "uart_0__rx"])
    def test_what_comes_in_passes_two_flip_flops(self, netlist, name):
        cells = {n for n, _ in buffers(netlist, name)}
        for _ in range(2):
            cells = {user for n in cells for user in self.behind_inverters(netlist, n)}
            assert cells
            for n in cells:
                cell = netlist.cells[n]
                assert isinstance(cell, nir.FlipFlop)
                assert cell.attributes["ASYNC_REG"] == "TRUE"

    @staticmethod
    def behind_inverters(netlist: nir.Netlist, number: int) -> set[int]:
        """The cells that look at what a cell gives, through an inverter as well."""
        found = set()
        for n in users(netlist, {number}):
            cell = netlist.cells[n]
            found |= users(netlist, {n}) if isinstance(cell, nir.Operator) else {n}
        return found

    @pytest.mark.parametrize("where", [NEXYS2_500, NEXYS2_1200])
    def test_verilog_and_constraints(self, where):
        files = prepare(where, "positioner", Positioner()).files
        verilog, ucf = (files[name].decode() for name in ("positioner.v", "positioner.ucf"))
        assert len(re.findall(r'\(\* IOB = "TRUE" \*\)\s+reg', verilog)) == 5
        registers = re.findall(r"^  reg (?:\[\d+:0\] )?(\w+);$", verilog, re.M)
        memories = re.findall(r"^ +(\w+) <= (?:ring|rom|places)\[\w+\];$", verilog, re.M)
        assert {*registers} == {*memories}, "registers without a value at power-up"
        assert ucf.count("PULLUP") == 3
