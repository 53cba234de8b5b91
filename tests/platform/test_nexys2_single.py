# amaranth: UnusedElaboratable=no

"""`single` on its board: the terminal, the button, each LED and pin, in simulation."""

import re

import pytest

from fresa.machines import Single
from fresa.machines.single import PHASES, SingleTiming
from fresa_boards.board import Allotment, pin_table
from fresa_boards.nexys2 import NEXYS2_500, NEXYS2_1200
from fresa_boards.wiring import prepare
from tb.boards import board as on_board
from tb.engines import AmaranthEngine
from tb.uart import decode_output, encode
from tests.platform.pins import DISPLAY, LINE, check_pins, pins_of

pytestmark = pytest.mark.usefixtures("unused")
TIMING = SingleTiming.real(clock=48_000, baud=3000)
STILL = 3
OUTPUTS = ["tx", "leds", "segments", "digits", "coils", "enable"]
SHAPES = {0x3F: 0, 0x06: 1, 0x5B: 2, 0x4F: 3, 0x66: 4, 0x6D: 5, 0x7D: 6, 0x07: 7, 0x7F: 8, 0x6F: 9,
          0x77: 10, 0x7C: 11, 0x39: 12, 0x5E: 13, 0x79: 14, 0x71: 15}


def machine(**options: bool) -> Single:
    return Single(timing=TIMING, greeting=b"!\r\n", help_text=b"?\r\n", **options)


@pytest.fixture
def board():
    with AmaranthEngine(on_board("single", machine(), debounce=STILL, scan_bits=3)) as engine:
        engine.set(rx=1)
        engine.run(9)  # the line is seen to be there
        yield engine


def type_in(board, text: bytes, after: int = 0):
    return board.apply({"rx": encode(text, TIMING.bit) + [1] * after}, OUTPUTS)


def number(seen) -> int:
    """Read the display from a turn of all its digits."""
    digits = {}
    for segments, anodes in zip(seen["segments"][-32:], seen["digits"][-32:], strict=True):
        if anodes != 0xF:
            place = [n for n in range(4) if not int(anodes) >> n & 1]
            assert len(place) == 1
            digits[place[0]] = SHAPES[0xFF ^ int(segments)]
    return sum(digits[place] << 4 * place for place in range(4))


class TestBoard:
    def test_terminal_motor_and_lights(self, board):
        board.run(8 * 160)
        seen = type_in(board, b":v59999\r:x300\r", after=3000)
        assert b"ok\r\nok\r\n" in decode_output(seen["tx"], TIMING.bit).text
        assert number(seen) == 300
        assert set(seen["coils"].tolist()) == set(PHASES)
        assert seen["coils"][-1] == PHASES[300 % 8]
        # The pins are a clock behind what the lights show.
        assert (seen["leds"][:-1] & 0xF == seen["coils"][1:]).all()
        moving = seen["leds"] >> 5 & 1
        assert moving.any() and not moving[-1]
        assert set(seen["leds"] >> 6) == {0b10} and seen["enable"].all()

        seen = type_in(board, b":e0\r", after=600)
        assert (seen["enable"][-1], seen["coils"][-1], seen["leds"][-1]) == (0, 0, 0)

    def test_the_button_makes_this_place_0(self, board):
        type_in(board, b":v59999\r:x9\r", after=300)
        assert number(board.apply({"rx": [1] * 40}, OUTPUTS)) == 9
        board.set(buttons=1)
        board.run(2 * STILL + 5)
        board.set(buttons=0)
        seen = board.apply({"rx": [1] * 2000}, OUTPUTS)
        assert number(seen) == 0
        assert set(seen["coils"]) == {PHASES[1]}
        assert decode_output(seen["tx"], TIMING.bit).text.startswith(b"!\r\n?\r\n")

    def test_a_bounce_of_the_button_does_nothing(self, board):
        type_in(board, b":v59999\r:x9\r", after=300)
        for clocks in range(1, STILL):
            board.set(buttons=1)
            board.run(clocks)
            board.set(buttons=0)
            board.run(4 * STILL)
        assert number(board.apply({"rx": [1] * 40}, OUTPUTS)) == 9

    def test_the_motor_has_no_power_before_the_first_clock(self):
        with AmaranthEngine(on_board("single", machine(), debounce=STILL, scan_bits=3)) as engine:
            seen = engine.apply({"rx": [1] * 9}, ["coils", "enable"])
        assert seen["enable"].tolist() == [0, *[1] * 8]
        assert seen["coils"].tolist() == [0, 0, *[PHASES[0]] * 7]


@pytest.mark.parametrize("where", [NEXYS2_500, NEXYS2_1200], ids=lambda where: where.name)
def test_pins_are_as_committed(where):
    """LD4 has no meaning."""
    check_pins(where, "single", machine(), {
        **pins_of("JA1 JA2 JA3 JA4 JA7", "coils[0] coils[1] coils[2] coils[3] enable"),
        "BTN0": "reset",
        **pins_of("LD0 LD1 LD2 LD3 LD5 LD6 LD7",
                 "coils[0] coils[1] coils[2] coils[3] moving fault enable"),
        **LINE, **DISPLAY}, spare=1)


def test_pins_in_the_constraint_file():
    files = {name: text.decode()
             for name, text in prepare(NEXYS2_500, "single", machine()).files.items()}
    pins = dict(re.findall(r'^NET "(\S+)" LOC="(\S+)"', files["single.ucf"], re.M))
    assert [pins[f"coils_0__io<{bit}>"] for bit in range(4)] == ["L15", "K12", "L17", "M15"]
    assert [pins[name] for name in ("enable_0__io", "uart_0__rx__io", "uart_0__tx__io")] == [
        "K13", "U6", "P9"]
    assert files["single.v"].count('(* IOB = "TRUE" *)') >= 2


def test_table_for_people():
    table = pin_table(NEXYS2_500, machine(), NEXYS2_500.allotment("single")).splitlines()
    assert table[0] == "| nexys2-500 | FPGA | machine | |"
    assert table[2:4] == ["| JA1 | L15 | coils[0] | coils |", "| JA2 | K12 | coils[1] | coils |"]
    assert "| LD6 | F4 | fault | LED |" in table


def test_a_port_without_a_pin():
    with pytest.raises(ValueError, match=r"^coils of the machine, coils, has no pin on the board$"):
        Allotment(header={"enable": "JA7"}, panel={"rx": "rx", "tx": "tx", "leds": "coils"}).places(
            machine())


def test_too_few_pins():
    with pytest.raises(ValueError, match=r"^coils has 4 bits, not those of JA1 JA2 JA3$"):
        Allotment(header={"coils": "JA1 JA2 JA3"}).places(machine())
