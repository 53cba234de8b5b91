"""Icepi Zero 1.3 by Chengyin Yao: an ECP5 in the shape of a Raspberry Pi Zero.

Boards of version 1.2 and earlier have their clock on another pin: a bitstream of this one does
nothing there. The version is printed on the back.
"""

from amaranth.build import Attrs
from amaranth_boards.icepi_zero import IcepiZero1_3Platform

from .board import Allotment, Board, Capacity, Layout, Loader, Pin
from .flow import ECP5

__all__ = ["BOARDS"]

_HEADER = {f"GPIO{number}": f"gpio_0:{number}" for number in (
    2, 3, 4, 14, 15, 17, 18, 27, 22, 23, 24, 10, 9, 25, 11, 8, 7, 0, 1, 5, 6, 12, 13, 19, 16, 26,
    20, 21)}

_LAYOUTS = (Layout(
    "GPIO", "components up, the header at the right",
    "3V3 GPIO2 GPIO3 GPIO4 GND GPIO17 GPIO27 GPIO22 3V3 GPIO10 GPIO9 GPIO11 GND GPIO0 GPIO5 GPIO6 "
    "GPIO13 GPIO19 GPIO26 GND",
    "5V 5V GND GPIO14 GPIO15 GPIO18 GND GPIO23 GPIO24 GND GPIO25 GPIO8 GPIO7 GPIO1 GND GPIO12 GND "
    "GPIO16 GPIO20 GPIO21"),)

_PANEL = {
    "clk": (Pin("50 MHz", "clk50"),),
    "buttons": tuple(Pin(f"SW{number + 1}", "button", number) for number in range(2)),
    "leds": tuple(Pin(f"D{number + 1}", "led", number) for number in range(5)),
    "rx": (Pin("RXD", "uart", 0, "rx"),),
    "tx": (Pin("TXD", "uart", 0, "tx"),),
}

_ALLOTMENTS = {
    "gcode": Allotment(
        header={"step": "GPIO2 GPIO17 GPIO10", "direction": "GPIO3 GPIO27 GPIO9",
                "enable": "GPIO4", "limits": "GPIO14 GPIO15 GPIO18", "stop": "GPIO23",
                "door": "GPIO22", "probe": "GPIO24", "motor_fault": "GPIO11",
                "spindle": "GPIO25", "reverse": "GPIO8", "pwm": "GPIO12", "servo": "GPIO16",
                "mist": "GPIO7", "flood": "GPIO1",
                "abort": "GPIO21", "reset": "GPIO20",
                "second_step": "GPIO5", "second_direction": "GPIO6", "second_limit": "GPIO13"},
        panel={"buttons": "hold start", "leds": "moving alarm fault", "rx": "rx", "tx": "tx"}),
    "mill": Allotment(
        header={"axis_x": "GPIO0 GPIO5 GPIO6 GPIO13", "axis_y": "GPIO25 GPIO8 GPIO7 GPIO1",
                "axis_z": "GPIO19 GPIO16 GPIO26 GPIO20", "reset": "GPIO21"},
        panel={"buttons": "start stop", "leds": "error busy ready", "rx": "rx", "tx": "tx"},
        constant={"automatic": 1, "jog": 0}),
    "positioner": Allotment(
        header={"step": "GPIO2 GPIO17 GPIO10", "direction": "GPIO3 GPIO27 GPIO9",
                "enable": "GPIO4 GPIO22 GPIO11", "limits": "GPIO14 GPIO15 GPIO18",
                "buzzer": "GPIO25"},
        panel={"buttons": "reset", "leds": "moving fault connected", "rx": "rx", "tx": "tx"}),
    "single": Allotment(
        header={"coils": "GPIO0 GPIO5 GPIO6 GPIO13", "enable": "GPIO19"},
        panel={"buttons": "reset", "leds": "moving fault enable", "rx": "rx", "tx": "tx"}),
    "vplotter": Allotment(
        header={"left": "GPIO0 GPIO5 GPIO6 GPIO13", "right": "GPIO25 GPIO8 GPIO7 GPIO1",
                "limits": "GPIO14 GPIO15", "stop": "GPIO23", "door": "GPIO22",
                "motor_fault": "GPIO11", "pen": "GPIO2", "servo": "GPIO16", "abort": "GPIO21",
                "reset": "GPIO20"},
        panel={"buttons": "hold start", "leds": "moving alarm fault", "rx": "rx", "tx": "tx"}),
}

BOARDS = (Board(
    "icepi-zero", "icepi_zero", IcepiZero1_3Platform,
    Capacity(luts=24_288, flip_flops=24_288, block_rams=56, multipliers=28),
    _HEADER, _PANEL,
    outputs=Attrs(IO_TYPE="LVCMOS33", DRIVE="4"),
    pulled_up=Attrs(IO_TYPE="LVCMOS33", PULLMODE="UP"),
    allotments=_ALLOTMENTS,
    title="Icepi Zero 1.3, Lattice LFE5U-25F",
    source="its KiCad board file and icepi-zero.lpf, version 1.3 (github.com/cheyao/icepi-zero)",
    layouts=_LAYOUTS, start_up_us=20, flow=ECP5,
    loader=Loader("icepi-zero", "0403:6015")),)
