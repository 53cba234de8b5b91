# amaranth: UnusedElaboratable=no

"""The board's pins against a table copied from its constraint files, and its use from Amaranth."""

import re

import pytest
from amaranth.build import Attrs, Pins, Resource, ResourceError
from amaranth.lib import io
from amaranth_boards.test.blinky import Blinky

from fresa_boards.board import Capacity
from fresa_boards.nexys2 import Nexys2_1200Platform, Nexys2Platform

# Resource, number, part of it: pins, first bit first.
PINS = {
    ("clk50", 0, ""): "B8",
    ("clk_socket", 0, ""): "U9",
    **{("switch", n, ""): pin
       for n, pin in enumerate("G18 H18 K18 K17 L14 L13 N17 R17".split())},
    **{("button", n, ""): pin for n, pin in enumerate("B18 D18 E18 H13".split())},
    **{("led", n, ""): pin for n, pin in enumerate("J14 J15 K15 K14".split())},
    ("display_7seg", 0, "a"): "L18",
    ("display_7seg", 0, "b"): "F18",
    ("display_7seg", 0, "c"): "D17",
    ("display_7seg", 0, "d"): "D16",
    ("display_7seg", 0, "e"): "G14",
    ("display_7seg", 0, "f"): "J17",
    ("display_7seg", 0, "g"): "H14",
    ("display_7seg", 0, "dp"): "C17",
    ("display_7seg_an", 0, ""): "F17 H17 C18 F15",
    ("uart", 0, "rx"): "U6",
    ("uart", 0, "tx"): "P9",
    ("ps2", 0, "clk"): "R12",
    ("ps2", 0, "dat"): "P11",
    ("vga", 0, "r"): "R9 T8 R8",
    ("vga", 0, "g"): "N8 P8 P6",
    ("vga", 0, "b"): "U5 U4",
    ("vga", 0, "hs"): "T4",
    ("vga", 0, "vs"): "U3",
    ("epp", 0, "astb"): "V14",
    ("epp", 0, "dstb"): "U14",
    ("epp", 0, "wait"): "N9",
    ("epp", 0, "write"): "V16",
    ("epp", 0, "db"): "R14 R13 P13 T12 N11 R11 P10 R10",
}
LEDS = {
    Nexys2Platform: "E17 P15 F4 R4",
    Nexys2_1200Platform: "E16 P16 E4 P4",
}
PMODS = [  # pins 1 to 4 and 7 to 10 of JA, JB, JC, JD
    "L15 K12 L17 M15 K13 L16 M14 M16",
    "M13 R18 R15 T17 P17 R16 T18 U18",
    "G15 J16 G13 H16 H15 F14 G16 J12",
    "J13 M18 N18 P18 K14 K15 J15 J14",
]
INVERTED = {
    *((("display_7seg", 0, part)) for part in "a b c d e f g dp".split()),
    ("display_7seg_an", 0, ""),
    *((("epp", 0, part)) for part in "astb dstb write".split()),
}

boards = pytest.mark.parametrize("board", LEDS)


def ports(platform) -> dict[tuple[str, int, str], io.SingleEndedPort]:
    """Every port of every resource of a board."""
    found = {}
    for name, number in platform.resources:
        port = platform.request(name, number, dir="-")
        parts = {"": port} if isinstance(port, io.SingleEndedPort) else vars(port)
        found |= {(name, number, part): value for part, value in parts.items()}
    return found


@boards
class TestPins:
    def test_resources(self, board):
        expected = PINS | {("led", 4 + n, ""): pin for n, pin in enumerate(LEDS[board].split())}
        assert expected == {
            name: " ".join(bit.name for bit in port.io.metadata)
            for name, port in ports(board()).items()
        }

    def test_no_pin_twice(self, board):
        pins = [bit.name for port in ports(board()).values() for bit in port.io.metadata]
        assert len(set(pins)) == len(pins)

    def test_connectors(self, board):
        assert {
            f"pmod_{connector}:{number}": pin
            for connector, pins in enumerate(PMODS)
            for number, pin in zip([1, 2, 3, 4, 7, 8, 9, 10], pins.split(), strict=True)
        } == {name: pin for connector in board().connectors.values() for name, pin in connector}

    def test_active_low(self, board):
        for name, port in ports(board()).items():
            assert set(port.invert) == {name in INVERTED}, name

    def test_standard(self, board):
        for name, port in ports(board()).items():
            expected = {"IOSTANDARD": "LVCMOS33"} | ({"PULLUP": "TRUE"} if "ps2" in name else {})
            assert all(bit.attrs == expected for bit in port.io.metadata), name

    @pytest.mark.parametrize(("jd", "led"), [("7", 3), ("8", 2), ("9", 1), ("10", 0)])
    def test_half_of_jd_is_leds(self, board, jd, led):
        platform = board()
        platform.add_resources([
            Resource("motor", 0, Pins(jd, dir="o", conn=("pmod", 3)), Attrs(IOSTANDARD="LVCMOS33")),
        ])
        platform.request("motor", dir="-")
        with pytest.raises(ResourceError, match=r"already used by resource component motor_0 "):
            platform.request("led", led, dir="-")

    def test_clock(self, board):
        platform = board()
        assert (platform.default_clk, platform.default_rst) == ("clk50", None)
        assert platform.default_clk_frequency == 50e6

    def test_runs_what_others_write(self, board):
        files = board().prepare(Blinky(), "blinky").files
        locations = dict(re.findall(r'^NET "(\S+)" LOC="(\S+)"', files["blinky.ucf"], re.M))
        assert locations["clk50_0__io"] == "B8"
        leds = f"J14 J15 K15 K14 {LEDS[board]}".split()
        assert [locations[f"led_{n}__io"] for n in range(8)] == leds


@pytest.mark.parametrize(
    ("board", "device", "capacity"),
    [
        (Nexys2Platform, "xc3s500e", Capacity(9312, 9312, 20, 20)),
        (Nexys2_1200Platform, "xc3s1200e", Capacity(17344, 17344, 28, 28)),
    ],
)
def test_fpga(board, device, capacity):
    assert (board.device, board.package, board.speed) == (device, "fg320", "4")
    assert board.capacity == capacity
    assert board().family == "spartan3e"
