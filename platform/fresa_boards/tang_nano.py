"""Sipeed Tang Nano 9K and 20K: Gowin FPGAs that carry the number of each pin beside it.

The platforms are ours: amaranth-boards has no 20K, and of the 9K it has LEDs and buttons at 3.3 V,
where their bank has 1.8 V.
"""

from amaranth.build import Attrs, Clock, Pins, Resource
from amaranth_boards.resources import ButtonResources, LEDResources, UARTResource

from .board import Allotment, Board, Capacity, Layout, Loader, Pin
from .flow import GOWIN
from .gowin import HimbaechelPlatform

__all__ = ["BOARDS", "TangNano9KPlatform", "TangNano20KPlatform"]

_LVCMOS33 = Attrs(IO_TYPE="LVCMOS33")
_PULLED_UP = Attrs(IO_TYPE="LVCMOS33", PULL_MODE="UP")


class TangNano9KPlatform(HimbaechelPlatform):
    """Tang Nano 9K. Nothing of it is at 3.3 V on pins 3 to 16 and 79 to 88."""

    part = "GW1NR-LV9QN88PC6/I5"
    family = "GW1NR-9C"
    default_clk = "clk27"
    resources = [
        Resource("clk27", 0, Pins("52", dir="i"), Clock(27e6), _LVCMOS33),
        *ButtonResources(pins="3 4", invert=True, attrs=Attrs(IO_TYPE="LVCMOS18", PULL_MODE="UP")),
        *LEDResources(pins="10 11 13 14 15 16", invert=True, attrs=Attrs(IO_TYPE="LVCMOS18")),
        UARTResource(0, rx="18", tx="17", attrs=_PULLED_UP),
    ]
    connectors = []


class TangNano20KPlatform(HimbaechelPlatform):
    """Tang Nano 20K. Its buttons are on the pins that choose how it is configured."""

    part = "GW2AR-LV18QN88C8/I7"
    family = "GW2AR-18C"
    default_clk = "clk27"
    resources = [
        Resource("clk27", 0, Pins("4", dir="i"), Clock(27e6), _LVCMOS33),
        *ButtonResources(pins="88 87", attrs=_LVCMOS33),
        *LEDResources(pins="15 16 17 18 19 20", invert=True, attrs=_LVCMOS33),
        UARTResource(0, rx="70", tx="69", attrs=_PULLED_UP),
    ]
    connectors = []


def _panel(buttons: tuple[str, str]) -> dict[str, tuple[Pin, ...]]:
    return {
        "clk": (Pin("27 MHz", "clk27"),),
        "buttons": tuple(Pin(label, "button", number) for number, label in enumerate(buttons)),
        "leds": tuple(Pin(f"LED{number}", "led", number) for number in range(6)),
        "rx": (Pin("RXD", "uart", 0, "rx"),),
        "tx": (Pin("TXD", "uart", 0, "tx"),),
    }


_9K = Board(
    "tang-nano-9k", "tang_nano_9k", TangNano9KPlatform,
    Capacity(luts=8_640, flip_flops=6_480, block_rams=26, multipliers=20),
    {pin: pin for pin in ("25 26 27 28 29 30 33 34 40 35 41 42 51 53 54 "  # the left row
                          "32 31 49 48 76 77").split()},  # the right one, from its GND on
    _panel(("button:3", "button:4")),
    outputs=_LVCMOS33, pulled_up=_PULLED_UP,
    allotments={
        "mill": Allotment(
            header={"axis_x": "25 26 27 28", "axis_y": "29 30 33 34", "axis_z": "40 35 41 42",
                    "reset": "32"},
            panel={"buttons": "start stop", "leds": "error busy ready", "rx": "rx", "tx": "tx"},
            constant={"automatic": 1, "jog": 0}),
        "positioner": Allotment(
            header={"step": "25 28 33", "direction": "26 29 34", "enable": "27 30 40",
                    "buzzer": "35", "limits": "32 31 49"},
            panel={"buttons": "reset", "leds": "moving fault connected", "rx": "rx", "tx": "tx"}),
        "single": Allotment(
            header={"coils": "25 26 27 28", "enable": "29"},
            panel={"buttons": "reset", "leds": "moving fault enable", "rx": "rx", "tx": "tx"}),
    },
    title="Tang Nano 9K, Gowin GW1NR-9C",
    source="Sipeed's constraint files (github.com/sipeed/TangNano-9K-example) and three carrier "
           "boards for the order of the rows",
    layouts=(Layout(
        "pins", "components up, USB at the top",
        "38 37 36 39 25 26 27 28 29 30 33 34 40 35 41 42 51 53 54 55 56 57 68 69",
        "63 86 85 84 83 82 81 80 79 77 76 75 74 73 72 71 70 5V 48 49 31 32 GND 3V3"),),
    start_up_us=20, flow=GOWIN, loader=Loader("tangnano9k", "0403:6010"))

_20K = Board(
    "tang-nano-20k", "tang_nano_20k", TangNano20KPlatform,
    Capacity(luts=20_736, flip_flops=15_552, block_rams=46, multipliers=48),
    {pin: pin for pin in ("73 74 77 27 28 25 29 30 31 "  # the left row
                          "42 41 48 72 71").split()},
    _panel(("S1", "S2")),
    outputs=_LVCMOS33, pulled_up=_PULLED_UP,
    allotments={
        # Of the outputs that a machine can do without there is room for two.
        "gcode": Allotment(
            header={"step": "73 27 29", "direction": "74 28 30", "enable": "77",
                    "limits": "72 71 48", "stop": "41", "probe": "42", "pwm": "25",
                    "servo": "31"},
            panel={"buttons": "hold start", "leds": "moving alarm fault", "rx": "rx", "tx": "tx"},
            constant={"abort": 0}),
        "mill": Allotment(
            header={"axis_x": "73 74 77 27", "axis_y": "28 25 29 30", "axis_z": "42 41 48 71",
                    "reset": "72"},
            panel={"buttons": "start stop", "leds": "error busy ready", "rx": "rx", "tx": "tx"},
            constant={"automatic": 1, "jog": 0}),
        "positioner": Allotment(
            header={"step": "73 27 29", "direction": "74 28 30", "enable": "77 25 31",
                    "buzzer": "42", "limits": "72 71 48"},
            panel={"buttons": "reset", "leds": "moving fault connected", "rx": "rx", "tx": "tx"}),
        "single": Allotment(
            header={"coils": "28 25 29 30", "enable": "31"},
            panel={"buttons": "reset", "leds": "moving fault enable", "rx": "rx", "tx": "tx"}),
        "vplotter": Allotment(
            header={"left": "73 74 77 27", "right": "28 25 29 30", "limits": "72 71",
                    "stop": "41", "door": "42", "pen": "48", "servo": "31"},
            panel={"buttons": "hold start", "leds": "moving alarm fault", "rx": "rx", "tx": "tx"},
            constant={"abort": 0}),
    },
    title="Tang Nano 20K, Gowin GW2AR-18C",
    source="Sipeed's constraint files (github.com/sipeed/TangNano-20K-example) and three carrier "
           "boards for the order of the rows",
    layouts=(Layout(
        "pins", "components up, USB at the top",
        "73 74 75 85 77 15 16 27 28 25 26 29 30 31 17 20 19 18 3V3 GND",
        "5V GND 76 80 42 41 56 54 51 48 55 49 86 79 GND 3V3 72 71 53 52"),),
    start_up_us=20, flow=GOWIN, loader=Loader("tangnano20k", "0403:6010"))

BOARDS = (_20K, _9K)
