"""ULX3S by Radiona: an ECP5 of four sizes, on boards that are alike but for it.

Versions 2 and 3.0. A pin of the ESP32 beside the FPGA is held high, as otherwise its firmware may
start the board anew.
"""

from amaranth.build import Attrs
from amaranth_boards.resources import UARTResource
from amaranth_boards.ulx3s import (
    ULX3S_12F_Platform,
    ULX3S_25F_Platform,
    ULX3S_45F_Platform,
    ULX3S_85F_Platform,
)

from .board import Allotment, Board, Capacity, Layout, Loader, Pin
from .flow import ECP5

__all__ = ["BOARDS"]

# amaranth-boards leaves the line pulled down where no computer drives it: an endless break.
_UART = UARTResource(0, rx="M1", tx="L4", attrs=Attrs(IO_TYPE="LVCMOS33", PULLMODE="UP"))


def _platform(base: type) -> type:
    return type(base.__name__, (base,), {
        "resources": [*(each for each in base.resources if each.name != "uart"), _UART]})


def _names(numbers: range) -> list[str]:
    return [f"{part}{number}" for number in numbers for part in ("GN", "GP")]


# The right header first: its pins have 3.3 V always, those of the left one 2.5 V by a jumper. 11 to
# 13 are the ESP32's, too, 14 to 17 the converter's.
_HEADER = {name: f"gpio_0:{name[2:]}{'-' if name[1] == 'N' else '+'}" for name in (
    *_names(range(21, 28)), *_names(range(18, 21)), *_names(range(0, 11)))}



def _column(part: str, numbers: range) -> str:
    return " ".join(f"{part}{number}" for number in numbers)


_LAYOUTS = (
    Layout("J2", "seen from above, micro USB at the top: the right header",
              f"5V GND {_column('GN', range(27, 20, -1))} GND 3V3 "
              f"{_column('GN', range(20, 13, -1))} GND 3V3",
              f"5V GND {_column('GP', range(27, 20, -1))} GND 3V3 "
              f"{_column('GP', range(20, 13, -1))} GND 3V3"),
    Layout("J1", "seen from above, micro USB at the top: the left header",
              f"VIO GND {_column('GP', range(7))} VIO GND {_column('GP', range(7, 14))} GND VIO",
              f"VIO GND {_column('GN', range(7))} VIO GND {_column('GN', range(7, 14))} GND VIO"),
)

_PANEL = {
    "clk": (Pin("25 MHz", "clk25"),),
    "buttons": (*(Pin(label, "button", number) for number, label in enumerate(
        ("F1", "F2", "UP", "DOWN", "LEFT", "RIGHT"))),
        *(Pin(f"SW{number + 1}", "switch", number) for number in range(4))),
    "leds": tuple(Pin(f"D{number}", "led", number) for number in range(8)),
    "rx": (Pin("RXD", "uart", 0, "rx"),),
    "tx": (Pin("TXD", "uart", 0, "tx"),),
}

_ALLOTMENTS = {
    "gcode": Allotment(
        header={"step": "GN21 GN23 GN25", "direction": "GP21 GP23 GP25", "enable": "GN22",
                "limits": "GP26 GN27 GP27", "stop": "GN20", "door": "GP20", "probe": "GN24",
                "motor_fault": "GP22", "spindle": "GN18", "reverse": "GP18", "pwm": "GN26",
                "servo": "GP24", "mist": "GN19", "flood": "GP19",
                # On the left header, whose levels are those of its jumper.
                "second_step": "GN0", "second_direction": "GP0", "second_limit": "GN1"},
        # F1, F2 and UP; SW4
        panel={"buttons": "hold start abort - - - - - - reset", "leds": "moving - alarm fault",
               "rx": "rx", "tx": "tx"}),
    "mill": Allotment(
        header={"axis_x": "GN21 GP21 GN22 GP22", "axis_y": "GN23 GP23 GN24 GP24",
                "axis_z": "GN25 GP25 GN26 GP26"},
        # The jog is UP, DOWN, LEFT, RIGHT, and SW1 and SW2 for Z.
        panel={"buttons": "start stop jog automatic reset", "leds": "leds - busy error ready",
               "rx": "rx", "tx": "tx"}),
    "positioner": Allotment(
        header={"step": "GN21 GN23 GN25", "direction": "GP21 GP23 GP25",
                "enable": "GN22 GN24 GN26", "buzzer": "GP22", "limits": "GP26 GN27 GP27"},
        panel={"buttons": "reset", "leds": "moving limits fault connected",
               "rx": "rx", "tx": "tx"}),
    "single": Allotment(
        header={"coils": "GN21 GP21 GN22 GP22", "enable": "GN23"},
        panel={"buttons": "reset", "leds": "coils - moving fault enable",
               "rx": "rx", "tx": "tx"}),
    "vplotter": Allotment(
        header={"left": "GN21 GP21 GN22 GP22", "right": "GN23 GP23 GN24 GP24",
                "limits": "GN27 GP27", "stop": "GN20", "door": "GP20", "motor_fault": "GP26",
                "pen": "GN25", "servo": "GP25"},
        panel={"buttons": "hold start abort - - - - - - reset", "leds": "moving - alarm fault",
               "rx": "rx", "tx": "tx"}),
}

BOARDS = tuple(Board(
    f"ulx3s-{size}f", "ulx3s", _platform(platform), capacity, _HEADER, _PANEL,
    outputs=Attrs(IO_TYPE="LVCMOS33", DRIVE="4"),
    pulled_up=Attrs(IO_TYPE="LVCMOS33", PULLMODE="UP"),
    allotments=_ALLOTMENTS,
    title=f"ULX3S 2 and 3.0, Lattice LFE5U-{size}F",
    source="its KiCad board file and ulx3s_v20.lpf (github.com/emard/ulx3s)",
    layouts=_LAYOUTS,
    held={Pin("GPIO0 of the ESP32", "esp32", 0, "gpio0"): 1},
    start_up_us=20, flow=ECP5, loader=Loader("ulx3s", "0403:6015"),
) for size, platform, capacity in (
    # The smallest is the same die as the next, and the tools use all of it.
    (12, ULX3S_12F_Platform, Capacity(24_288, 24_288, block_rams=56, multipliers=28)),
    (25, ULX3S_25F_Platform, Capacity(24_288, 24_288, block_rams=56, multipliers=28)),
    (45, ULX3S_45F_Platform, Capacity(43_848, 43_848, block_rams=108, multipliers=72)),
    (85, ULX3S_85F_Platform, Capacity(83_640, 83_640, block_rams=208, multipliers=156))))
