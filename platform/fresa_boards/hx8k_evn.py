"""Lattice iCE40-HX8K-B-EVN, the breakout board."""

from amaranth.build import Attrs
from amaranth_boards.ice40_hx8k_b_evn import ICE40HX8KBEVNPlatform

from .board import Allotment, Board, Capacity, Layout, Loader, Pin
from .flow import ICE40

__all__ = ["BOARDS"]

_OTHERS = {1: "1V2", 2: "3V3", 3: "1V2", **dict.fromkeys((7, 8, 15, 16, 23, 24, 31, 32, 39, 40),
                                                          "GND")}

_HEADER = {f"J2.{pin}": f"j_2:{pin}" for pin in range(4, 39) if pin not in _OTHERS}


def _column(first: int) -> str:
    return " ".join(_OTHERS.get(pin, f"J2.{pin}") for pin in range(first, 41, 2))


_PANEL = {
    "clk": (Pin("12 MHz", "clk12"),),
    "leds": tuple(Pin(f"D{number + 2}", "led", number) for number in range(8)),
    "rx": (Pin("RXD", "uart", 0, "rx"),),
    "tx": (Pin("TXD", "uart", 0, "tx"),),
}

_ALLOTMENTS = {
    "mill": Allotment(
        header={"axis_x": "J2.9 J2.10 J2.11 J2.12", "axis_y": "J2.17 J2.18 J2.19 J2.20",
                "axis_z": "J2.25 J2.26 J2.27 J2.28", "start": "J2.33", "stop": "J2.34",
                "reset": "J2.35"},
        panel={"leds": "leds - busy error ready", "rx": "rx", "tx": "tx"},
        constant={"automatic": 1, "jog": 0}),
    "positioner": Allotment(
        header={"step": "J2.9 J2.17 J2.25", "direction": "J2.10 J2.18 J2.26",
                "enable": "J2.11 J2.19 J2.27", "buzzer": "J2.28", "limits": "J2.33 J2.34 J2.36",
                "reset": "J2.35"},
        panel={"leds": "moving limits fault connected", "rx": "rx", "tx": "tx"}),
    "single": Allotment(
        header={"coils": "J2.9 J2.10 J2.11 J2.12", "enable": "J2.13", "reset": "J2.35"},
        panel={"leds": "coils - moving fault enable", "rx": "rx", "tx": "tx"}),
}

BOARDS = (Board(
    "hx8k-evn", "hx8k_evn", ICE40HX8KBEVNPlatform,
    Capacity(luts=7_680, flip_flops=7_680, block_rams=32, multipliers=0, block_ram_bits=4096),
    _HEADER, _PANEL,
    outputs=Attrs(IO_STANDARD="SB_LVCMOS"),
    pulled_up=Attrs(IO_STANDARD="SB_LVCMOS", PULLUP=1),
    allotments=_ALLOTMENTS,
    title="iCE40-HX8K-B-EVN, Lattice iCE40HX8K",
    source="hx8kboard.pcf (github.com/YosysHQ/icestorm) for clock and LEDs; the header as several "
           "public projects have it",
    layouts=(Layout("J2", "pin 1 at the top left", _column(1), _column(2)),),
    start_up_us=20, flow=ICE40, loader=Loader("ice40_generic", "0403:6010")),)
