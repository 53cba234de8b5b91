# amaranth: UnusedElaboratable=no

"""The mill on its board: each switch, button, LED and pin, in simulation and in the netlist."""

import gc
import re
from pathlib import Path

import numpy as np
import pytest
from amaranth.hdl import _nir as nir

from fresa.machines import MillStation, SerialOrders
from fresa.machines.mill import MillTiming
from fresa.motion import CoordinateGenerator, SquareGenerator
from fresa_boards.nexys2 import NEXYS2_500, NEXYS2_1200
from fresa_boards.wiring import prepare, simulation_ports
from tb.boards import board as on_board
from tb.engines import AmaranthEngine
from tb.mistake import Mistake
from tb.plant import Plant
from tests.platform.pins import DISPLAY, LINE, buffers, check_pins, netlist_of, pins_of, users

boards = pytest.mark.parametrize("where", [NEXYS2_500, NEXYS2_1200], ids=lambda where: where.name)

DOCS = Path(__file__).parents[2] / "docs"
PERIOD, TRAVEL, STILL, SIDE, PITCH = 3, 4, 3, 6, 4
SETTLE = 2 * STILL + 4
AUTOMATIC = 1 << 7
RESET, START, UNUSED, STOP = 1, 2, 4, 8
BUSY, ERROR, READY = 1 << 5, 1 << 6, 1 << 7
AXES = ["axis_x", "axis_y", "axis_z"]
WORDS = [0b0110, 0b0011, 0b1001, 0b1100]
PINS = {
    **pins_of("JA1 JA2 JA3 JA4", "axis_x[0] axis_x[1] axis_x[2] axis_x[3]"),
    **pins_of("JA7 JA8 JA9 JA10", "axis_y[0] axis_y[1] axis_y[2] axis_y[3]"),
    **pins_of("JB1 JB2 JB3 JB4", "axis_z[0] axis_z[1] axis_z[2] axis_z[3]"),
    **pins_of("SW0 SW1 SW2 SW3 SW4 SW5 SW7",
             "jog[0] jog[1] jog[2] jog[3] jog[4] jog[5] automatic"),
    **pins_of("BTN0 BTN1 BTN3", "reset start stop"),
    **pins_of("LD0 LD1 LD2 LD3 LD5 LD6 LD7",
             "leds[0] leds[1] leds[2] leds[3] busy error ready"),
    **LINE, **DISPLAY,
}
PICTURE = np.array([[0, 1, 1, 0], [0, 0, 0, 1], [1, 0, 0, 0]], bool)


class Board:
    """A board on the bench, with someone at its switches."""

    def __init__(self, source, *, period: int = PERIOD, stop: int = 1, still: int = STILL,
                 mistake: Mistake | None = None) -> None:
        machine = MillStation(source=source, timing=MillTiming(period, 3, stop_period=stop),
                              z_travel=TRAVEL)
        design = on_board("mill", machine, debounce=still)
        self.engine = AmaranthEngine(mistake.planted(design) if mistake else design)
        self.plant = Plant(pitch=PITCH, travel=TRAVEL)
        self.wait(0)

    def wait(self, clocks: int = 1, **until: int):
        changes = self.engine.run(clocks, [*AXES, "leds"], until=until)
        self.plant.feed(changes)
        return changes

    def turn(self, switches: int) -> None:
        self.engine.set(switches=switches)
        self.wait(SETTLE)

    def press(self, button: int, clocks: int = SETTLE) -> None:
        self.engine.set(buttons=button)
        self.wait(clocks)
        self.engine.set(buttons=0)
        self.wait(SETTLE)

    @property
    def leds(self) -> int:
        return self.engine.get("leds")

    def finish(self) -> None:
        """Wait for the end of the job."""
        for _ in range(3000):
            self.wait(20)
            if not self.leds & BUSY:
                self.wait(2)
                return
        raise AssertionError("the job never ends")


@pytest.fixture
def square():
    return Board(SquareGenerator(side=SIDE))


def milling(picture=PICTURE) -> Board:
    return Board(CoordinateGenerator(picture.tolist(), pixel_steps=PITCH))


def places(plant: Plant) -> list[tuple[int, int]]:
    return [(int(x), int(y)) for x, y, _ in plant.corners]


class TestSwitches:
    @pytest.mark.parametrize(
        ("switch", "axis", "sign"),
        [(0, 0, 1), (1, 0, -1), (2, 1, 1), (3, 1, -1), (4, 2, 1), (5, 2, -1)],
    )
    def test_jog(self, square, switch, axis, sign):
        square.turn(0)
        square.turn(1 << switch)
        square.wait(10 * PERIOD)
        square.turn(0)
        position = square.plant.position
        assert position[axis] * sign > 8
        assert [n for n in range(3) if position[n]] == [axis]
        assert square.plant.least[AXES[axis]] == PERIOD

    def test_mode(self, square):
        assert not square.leds & READY
        square.turn(AUTOMATIC)
        assert square.leds == READY
        square.turn(0)
        assert square.leds == WORDS[0]

    def test_switch_6_does_nothing(self, square):
        before = square.engine.get("leds", "digits", *AXES)
        square.turn(1 << 6)
        assert square.engine.get("leds", "digits", *AXES) == before

    @pytest.mark.parametrize(("select", "count"), [(0, 0), (1, SIDE), (2, SIDE), (3, 0)])
    def test_counts(self, square, select, count):
        """Stop on the second corner: main count, X, Y and Z."""
        square.turn(AUTOMATIC | select)
        square.press(START)
        for _ in range(2000):
            square.wait()
            if square.plant.position == (SIDE, SIDE, 0):
                break
        square.engine.set(buttons=STOP)
        square.wait(SETTLE)
        shown = {}
        for _ in range(4 * 8):
            square.wait()
            segments, digits = square.engine.get("segments", "digits")
            lit = [n for n in range(4) if not digits >> n & 1]
            assert len(lit) <= 1
            for place in lit:
                shown[place] = 0xFF ^ segments
        digit = {0: 0b0111111, SIDE: 0b1111101}
        if select:
            assert [shown[n] for n in range(4)] == [digit[count], *[digit[0]] * 3]
        assert set(shown) == {0, 1, 2, 3}

    def test_a_bounce_does_nothing(self, square):
        square.turn(0)
        for bit in range(8):
            for clocks in range(1, STILL):
                square.engine.set(switches=1 << bit)
                square.wait(clocks)
                square.engine.set(switches=0)
                square.wait(SETTLE)
        assert square.plant.position == (0, 0, 0)


class TestButtons:
    def test_start_walks_the_square(self, square):
        square.turn(AUTOMATIC)
        square.press(START)
        assert square.leds & BUSY
        square.finish()
        assert places(square.plant) == [(0, 0), (SIDE, 0), (SIDE, SIDE), (0, SIDE), (0, 0)]
        assert square.leds == READY

    def test_start_counts_once_however_long(self, square):
        square.turn(AUTOMATIC)
        square.engine.set(buttons=START)
        square.wait(4 * SIDE * PERIOD * 5)
        square.finish()
        assert sum(square.plant.steps.values()) == 4 * SIDE
        square.press(0)
        square.press(START)
        square.finish()
        assert sum(square.plant.steps.values()) == 8 * SIDE

    def test_start_held_into_automatic_mode_does_not_start(self, square):
        square.engine.set(buttons=START)
        square.wait(SETTLE)
        square.turn(AUTOMATIC)
        square.wait(200)
        assert square.leds == READY
        assert square.plant.position == (0, 0, 0)

    def test_start_held_through_reset_does_not_start(self, square):
        square.turn(AUTOMATIC)
        for buttons in (START, START | RESET, START):
            square.engine.set(buttons=buttons)
            square.wait(3 * SETTLE)
        assert square.leds & (BUSY | READY) == READY
        square.engine.set(buttons=0)
        square.wait(SETTLE)
        square.press(START)
        assert square.leds & BUSY

    def test_start_in_manual_mode_does_nothing(self, square):
        square.press(START)
        square.turn(AUTOMATIC)
        square.wait(200)
        assert not sum(square.plant.steps.values())

    def test_start_while_busy_does_nothing(self, square):
        square.turn(AUTOMATIC)
        square.press(START)
        square.press(START)
        square.finish()
        assert sum(square.plant.steps.values()) == 4 * SIDE

    def test_stop_holds_until_reset(self, square):
        square.turn(AUTOMATIC)
        square.press(START)
        square.wait(4 * PERIOD)
        square.press(STOP)
        before = square.engine.get(*AXES)
        square.wait(300)
        square.press(START)
        assert square.engine.get(*AXES) == before
        assert not square.leds & READY
        square.turn(0)
        square.turn(0b010101)
        assert square.engine.get(*AXES) == before
        square.turn(AUTOMATIC)
        square.press(RESET)
        assert square.leds == READY
        assert square.engine.get(*AXES) == before

    def test_reset_ends_the_job_and_lets_go(self, square):
        square.turn(AUTOMATIC)
        square.press(START)
        square.wait(4 * PERIOD)
        square.press(RESET)
        before, here = square.engine.get(*AXES), square.plant.position
        square.wait(300)
        assert square.leds == READY
        assert square.engine.get(*AXES) == before
        square.press(START)
        square.finish()
        assert square.plant.position == here
        assert not square.plant.faults
        assert square.plant.least["axis_x"] >= PERIOD

    def test_unused_button(self, square):
        square.turn(AUTOMATIC)
        square.press(UNUSED)
        square.wait(100)
        assert square.leds == READY


class TestStop:
    """The stop waits for its own time, and not for the debouncer."""

    still, stop, period = 60, 8, 20

    def moving(self) -> Board:
        board = Board(SquareGenerator(side=500), period=self.period, stop=self.stop,
                      still=self.still)
        board.wait(3 * self.still)
        board.engine.set(switches=1)
        board.wait(3 * self.still)
        assert board.plant.position[0] > 0
        return board

    @pytest.mark.parametrize("after", [
        *range(0, 60, 21), *(pytest.param(after, marks=pytest.mark.long)
                             for after in range(0, 60, 7) if after % 21)])
    def test_at_most_one_step_wherever_in_the_period_of_the_debouncer(self, after):
        board = self.moving()
        board.wait(after)
        before = board.plant.position[0]
        board.engine.set(buttons=STOP)
        board.wait(self.stop + 4)
        there = board.plant.position[0]
        assert there - before <= 1
        board.engine.set(buttons=0)  # it is latched
        board.wait(10 * self.period)
        assert board.plant.position[0] == there

    def test_a_glitch_does_nothing_however_often(self):
        board = self.moving()
        for _ in range(30):
            before = board.plant.position[0]
            for level, clocks in ((STOP, self.stop - 1), (0, 2 * self.period)):
                board.engine.set(buttons=level)
                board.wait(clocks)
            assert board.plant.position[0] >= before + 2

    def test_bounces_then_steady(self):
        board = self.moving()
        for clocks in (2, 1, 5, 3, 7, 1):
            for level in (STOP, 0):
                board.engine.set(buttons=level)
                board.wait(clocks)
        board.engine.set(buttons=STOP)
        board.wait(self.stop + 4)
        there = board.plant.position[0]
        board.wait(10 * self.period)
        assert board.plant.position[0] == there

    def test_reset_ends_it_once_the_button_is_released(self):
        board = self.moving()
        for buttons in (STOP, STOP | RESET, STOP):
            board.engine.set(buttons=buttons)
            board.wait(3 * self.still)
        board.turn(0)
        there = board.plant.position[0]
        for buttons in (RESET, 0):
            board.engine.set(buttons=buttons)
            board.wait(3 * self.still)
        board.engine.set(switches=1)
        board.wait(3 * self.still)
        assert board.plant.position[0] > there

    def test_time_on_the_board(self):
        assert MillTiming.real().stop_period == 500  # 10 us
        assert "10 us" in (DOCS / "nexys2.md").read_text("utf-8")


class TestPins:
    def test_power_up(self, square):
        assert square.engine.get(*AXES) == (WORDS[0],) * 3
        assert square.engine.get("digits") == 0xF
        assert square.leds == WORDS[0]

    def test_leds_are_of_the_axis_that_moves(self, square):
        square.turn(0b000100)
        for _ in range(20):
            before = square.leds
            square.wait()
            assert square.engine.get("axis_y") == before  # the pins come a clock after the machine
        square.turn(0)

    def test_display_is_dark_in_manual_mode(self, square):
        for _ in range(64):
            square.wait()
            assert square.engine.get("digits") == 0xF


class TestPicture:
    @pytest.mark.parametrize("clocks", [0, 40, 111, 222, 345])
    def test_a_mode_change_begins_anew_from_a_new_origin(self, clocks):
        board = milling()
        board.turn(AUTOMATIC)
        board.press(START)
        board.wait(clocks)
        board.turn(0)
        x, y, z = board.plant.position
        # The tool is lifted by hand; where it is then is where the new plate begins.
        if z:
            board.engine.set(switches=1 << 4)
            while board.plant.position[2] < 0:
                board.wait()
            board.turn(0)
            board.engine.set(switches=1 << 5)
            while board.plant.position[2] > 0:
                board.wait()
            board.turn(0)
        board.turn(AUTOMATIC)
        fresh = Plant(PICTURE, pitch=PITCH, travel=TRAVEL)
        board.plant = fresh
        board.engine.run(0, ["leds"])
        board.wait(0)
        board.press(START)
        board.finish()
        assert (fresh.cut == PICTURE).all()
        assert (fresh.wrong_steps, fresh.position, fresh.faults) == (0, (0, 0, 0), [])

    def test_an_empty_memory_is_an_error_until_reset(self):
        board = Board(CoordinateGenerator(PICTURE.tolist(), pixel_steps=PITCH),
                      mistake=Mistake("source.found", lambda right, _: right & 0))
        board.turn(AUTOMATIC)
        board.press(START)
        board.wait(500)
        assert board.leds & (BUSY | ERROR | READY) == ERROR
        board.turn(0)  # manual mode resets the source, and no error is forgotten
        board.turn(0b000001)
        board.wait(100)
        board.turn(AUTOMATIC)
        assert board.leds & (BUSY | ERROR | READY) == ERROR
        assert board.plant.position == (0, 0, 0)
        board.press(RESET)
        assert board.leds == READY

    def test_twice(self):
        board = milling()
        board.turn(AUTOMATIC)
        for _ in range(2):
            board.plant = Plant(PICTURE, pitch=PITCH, travel=TRAVEL)
            board.engine.run(0, ["leds"])
            board.wait(0)
            board.press(START)
            board.finish()
            assert (board.plant.cut == PICTURE).all()
            assert board.plant.wrong_steps == 0


@pytest.fixture(scope="module")
def netlist() -> nir.Netlist:
    return netlist_of(NEXYS2_500, "mill", MillStation(source=SquareGenerator(side=SIDE)))


@pytest.mark.usefixtures("unused")
class TestAllotment:
    @boards
    def test_are_as_committed(self, where):
        """SW6, BTN2 and LD4 have no meaning."""
        check_pins(where, "mill", MillStation(source=SerialOrders(period=5208)), PINS, spare=3)

    def test_motors_are_as_documented(self):
        documented = re.findall(r"^\| ([XYZ]) \| (J.*?) \|",
                                (DOCS / "nexys2.md").read_text("utf-8"), re.M)
        assert documented == [
            (axis.upper(), ", ".join(place for place, bit in PINS.items()
                                     if bit.startswith(f"axis_{axis}["))) for axis in "xyz"]

    @boards
    def test_display_is_active_low_once(self, where):
        """The ports are declared inverted, and so is what goes in: the pads are as the machine."""
        machine = MillStation(source=SerialOrders(period=5208))
        allotment = where.allotment("mill")
        for ports in (where.request(where.platform(), machine, allotment),
                      simulation_ports(where, machine, allotment)):
            low = {name for name, port in ports.items() if any(port.invert)}
            assert low == {"segments", "digits"}
            assert all(all(ports[name].invert) for name in low)


class TestNetlist:
    @pytest.mark.parametrize("axis", AXES)
    def test_every_coil_comes_straight_from_a_flip_flop_in_its_block(self, netlist, axis):
        [(_, buffer)] = buffers(netlist, axis)
        assert buffer.o is not None and len(buffer.o) == 4
        for bit, net in enumerate(buffer.o):
            cell = netlist.cells[net.cell]
            assert isinstance(cell, nir.FlipFlop)
            assert cell.attributes["IOB"] == "TRUE"
            assert cell.init >> net.bit & 1 == WORDS[0] >> bit & 1
            assert cell.arst == nir.Net.from_const(0)
            # A flip-flop in an I/O block serves its pin alone.
            assert users(netlist, {net.cell}) == {n for n, _ in buffers(netlist, axis)}

    @pytest.mark.parametrize("name", ["switch_", "button_"])
    def test_every_input_passes_two_flip_flops_and_the_debouncer(self, netlist, name):
        pins = {n for n, _ in buffers(netlist, name)}
        assert sum(len(netlist.cells[n].port) for n in pins) == {"switch_": 8, "button_": 4}[name]
        for _ in range(2):
            pins = users(netlist, pins)
            for n in pins:
                cell = netlist.cells[n]
                assert isinstance(cell, nir.FlipFlop)
                assert cell.attributes["ASYNC_REG"] == "TRUE"
        modules = {netlist.cells[n].module_idx for n in users(netlist, pins)}
        behind = {netlist.modules[index].name[-1] for index in modules}
        assert behind - {"divider"} == {"debouncer", "stop_filter"}  # the stop alone passes it by

    def test_one_clock(self, netlist):
        flip_flops = [cell for cell in netlist.cells if isinstance(cell, nir.FlipFlop)]
        [(pin, _)] = buffers(netlist, "clk50")
        assert {cell.clk for cell in flip_flops} == {nir.Net.from_cell(pin, 0)}
        assert {cell.clk_edge for cell in flip_flops} == {"pos"}

    @boards
    def test_verilog_says_so(self, where):
        station = MillStation(source=SquareGenerator(side=SIDE))
        verilog = prepare(where, "mill", station).files["mill.v"].decode()
        marked = re.findall(r'\(\* IOB = "TRUE" \*\)\s+reg \[3:0\] \S+ += 4\'h(\d);', verilog)
        assert marked == ["6"] * 3
        registers = re.findall(r"^  reg (?!.*=).*;$", verilog, re.M)
        assert not registers, "registers without a value at power-up"


class TestDebounce:
    @pytest.mark.filterwarnings("ignore::amaranth.hdl.UnusedElaboratable")
    @pytest.mark.parametrize("debounce", [0, -1, 2**26 + 1])
    def test_impossible(self, debounce):
        message = None
        try:  # what was made before the refusal is let go of here, not later
            on_board("mill", MillStation(source=SquareGenerator(side=1)), debounce=debounce)
        except ValueError as error:
            message = str(error)
        gc.collect()
        limit = "a whole number from 1 to 67108864"
        assert message == f"debounce period must be {limit}, not {debounce}"
