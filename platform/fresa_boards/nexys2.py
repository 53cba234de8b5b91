"""Digilent Nexys 2, the board: its pins, its connectors, what its FPGA holds.

Two boards bear the name. They differ in the FPGA and in the pins of LD4 to LD7.

The cathodes and anodes of the display are active low and are declared inverted, as are the strobes
of the parallel port: their ports have `port.invert` set, and a buffer from `amaranth.lib.io` then
lights what it drives with 1. Wire a signal that is active low already to `~port`.

JD7 to JD10 are the pins of LD3 to LD0: of each pair only one can be requested.
"""

import os
import subprocess

from amaranth.build import Attrs, Clock, Connector, Pins, PinsN, Resource, Subsignal
from amaranth_boards.resources import (
    ButtonResources,
    Display7SegResource,
    LEDResources,
    PS2Resource,
    SwitchResources,
    UARTResource,
    VGAResource,
)

from .board import Allotment, Board, Capacity, Layout, Pin
from .ise import ISEPlatform

__all__ = ["BOARDS", "NEXYS2_500", "NEXYS2_1200", "Nexys2Platform", "Nexys2_1200Platform"]


_LVCMOS33 = Attrs(IOSTANDARD="LVCMOS33")


class _Nexys2(ISEPlatform):
    """What both boards have in common."""

    package = "fg320"
    speed = "4"
    prom = "xcf04s"
    default_clk = "clk50"

    _resources = [
        Resource("clk50", 0, Pins("B8", dir="i"), Clock(50e6), _LVCMOS33),
        Resource("clk_socket", 0, Pins("U9", dir="i"), _LVCMOS33),  # empty as shipped

        *SwitchResources(pins="G18 H18 K18 K17 L14 L13 N17 R17", attrs=_LVCMOS33),
        *ButtonResources(pins="B18 D18 E18 H13", attrs=_LVCMOS33),

        Display7SegResource(0,
            a="L18", b="F18", c="D17", d="D16", e="G14", f="J17", g="H14", dp="C17",
            invert=True, attrs=_LVCMOS33),
        Resource("display_7seg_an", 0,                      # digit 0 is the rightmost
            PinsN("F17 H17 C18 F15", dir="o"), _LVCMOS33),

        UARTResource(0, rx="U6", tx="P9", attrs=_LVCMOS33),
        PS2Resource(0, clk="R12", dat="P11", attrs=Attrs(IOSTANDARD="LVCMOS33", PULLUP="TRUE")),
        VGAResource(0,
            r="R9 T8 R8", g="N8 P8 P6", b="U5 U4", hs="T4", vs="U3", attrs=_LVCMOS33),

        Resource("epp", 0,                                  # Digilent's parallel port over USB
            Subsignal("astb",  PinsN("V14", dir="i")),
            Subsignal("dstb",  PinsN("U14", dir="i")),
            Subsignal("write", PinsN("V16", dir="i")),
            Subsignal("wait",  Pins("N9", dir="o")),
            Subsignal("db",    Pins("R14 R13 P13 T12 N11 R11 P10 R10", dir="io")),
            _LVCMOS33),
    ]
    connectors = [
        Connector("pmod", 0, "L15 K12 L17 M15 - - K13 L16 M14 M16 - -"),  # JA
        Connector("pmod", 1, "M13 R18 R15 T17 - - P17 R16 T18 U18 - -"),  # JB
        Connector("pmod", 2, "G15 J16 G13 H16 - - H15 F14 G16 J12 - -"),  # JC
        Connector("pmod", 3, "J13 M18 N18 P18 - - K14 K15 J15 J14 - -"),  # JD; 7 to 10 are LEDs
    ]

    def toolchain_program(self, products, name: str) -> None:
        """Load the bitstream for USB, which lasts until the power goes."""
        djtgcfg = os.environ.get("DJTGCFG", "djtgcfg")
        with products.extract(f"{name}_usb.bit") as bitstream:
            command = [djtgcfg, "prog", "-d", "Nexys2", "-i", "0", "-f", bitstream]
            subprocess.run(command, check=True)


class Nexys2Platform(_Nexys2):
    """Digilent Nexys 2 with the 500 000-gate Spartan-3E."""

    device = "xc3s500e"
    capacity = Capacity(luts=9_312, flip_flops=9_312, block_rams=20, multipliers=20)
    resources = [
        *_Nexys2._resources,
        *LEDResources(pins="J14 J15 K15 K14 E17 P15 F4 R4", attrs=_LVCMOS33),
    ]


class Nexys2_1200Platform(_Nexys2):
    """Digilent Nexys 2 with the 1 200 000-gate Spartan-3E."""

    device = "xc3s1200e"
    capacity = Capacity(luts=17_344, flip_flops=17_344, block_rams=28, multipliers=28)
    resources = [
        *_Nexys2._resources,
        *LEDResources(pins="J14 J15 K15 K14 E16 P16 E4 P4", attrs=_LVCMOS33),
    ]


_OUTPUTS, _PULLED_UP = _LVCMOS33, Attrs(IOSTANDARD="LVCMOS33", PULLUP="TRUE")

# In the order in which a machine is wired. The lower row of JD is the LEDs.
_HEADER = {f"J{'ABCD'[pmod]}{pin}": f"pmod_{pmod}:{pin}"
           for pmod in range(4) for pin in (1, 2, 3, 4, 7, 8, 9, 10) if pmod < 3 or pin < 5}

_PANEL = {
    "clk": (Pin("50 MHz", "clk50"),),
    "switches": tuple(Pin(f"SW{number}", "switch", number) for number in range(8)),
    "buttons": tuple(Pin(f"BTN{number}", "button", number) for number in range(4)),
    "leds": tuple(Pin(f"LD{number}", "led", number) for number in range(8)),
    "segments": tuple(Pin(f"C{part.upper()}", "display_7seg", 0, part)
                      for part in ("a", "b", "c", "d", "e", "f", "g", "dp")),
    "digits": (Pin("AN0 AN1 AN2 AN3", "display_7seg_an"),),
    "rx": (Pin("RXD", "uart", 0, "rx"),),
    "tx": (Pin("TXD", "uart", 0, "tx"),),
}

_ALLOTMENTS = {
    "gcode": Allotment(
        header={"step": "JA1 JA7 JB1", "direction": "JA2 JA8 JB2", "enable": "JA3",
                "limits": "JC1 JC2 JC3", "stop": "JC4", "door": "JC7", "probe": "JC8",
                "motor_fault": "JC9", "spindle": "JB7", "reverse": "JB8", "pwm": "JC10",
                "servo": "JB4",
                "mist": "JB9", "flood": "JB10",
                "second_step": "JA9", "second_direction": "JA10", "second_limit": "JD1"},
        panel={"buttons": "hold start abort reset", "rx": "rx", "tx": "tx",
               "leds": "moving alarm fault"}),
    # A coil word has bit 0, YELLOW, on the lowest pin.
    "mill": Allotment(
        header={"axis_x": "JA1 JA2 JA3 JA4", "axis_y": "JA7 JA8 JA9 JA10",
                "axis_z": "JB1 JB2 JB3 JB4"},
        panel={"switches": "jog - automatic", "buttons": "reset start - stop",
               "leds": "leds - busy error ready", "segments": "segments", "digits": "digits",
               "rx": "rx", "tx": "tx"}),
    # There is no pin for one line that all switches share: it would not say which axis is to stop.
    "positioner": Allotment(
        header={"step": "JA1 JA7 JB1", "direction": "JA2 JA8 JB2", "enable": "JA3 JA9 JB3",
                "buzzer": "JB4", "limits": "JC1 JC2 JC3"},
        panel={"buttons": "reset", "rx": "rx", "tx": "tx",
               "leds": "moving limits fault connected"}),
    "single": Allotment(
        header={"coils": "JA1 JA2 JA3 JA4", "enable": "JA7"},
        panel={"buttons": "reset", "rx": "rx", "tx": "tx",
               "leds": "coils - moving fault enable", "segments": "segments", "digits": "digits"},
        number="position"),
}

# Too large for the smaller part.
_LARGE = {
    "vplotter": Allotment(
        header={"left": "JA1 JA2 JA3 JA4", "right": "JA7 JA8 JA9 JA10", "limits": "JC1 JC2",
                "stop": "JC4", "door": "JC7", "motor_fault": "JC9", "pen": "JB1", "servo": "JB4"},
        panel={"buttons": "hold start abort reset", "rx": "rx", "tx": "tx",
               "leds": "moving alarm fault"}),
}

# Seen from above, the upper row of a socket on the right edge, with pin 1, is the left one.
_LAYOUTS = tuple(
    Layout(f"J{letter}", "components up, the sockets at the right",
              " ".join(f"J{letter}{pin}" for pin in range(1, 5)) + " GND 3V3",
              " ".join(f"J{letter}{pin}" for pin in range(7, 11)) + " GND 3V3")
    for letter in "ABCD")

BOARDS = NEXYS2_500, NEXYS2_1200 = tuple(
    Board(name, "nexys2", platform, platform.capacity, _HEADER, _PANEL, _OUTPUTS, _PULLED_UP,
          allotments, title=f"Digilent Nexys 2, Xilinx {platform.device.upper()}",
          source="Digilent's reference manual and Nexys2_500General.ucf", layouts=_LAYOUTS)
    for name, platform, allotments in [
        ("nexys2-500", Nexys2Platform, _ALLOTMENTS),
        ("nexys2-1200", Nexys2_1200Platform, {**_ALLOTMENTS, **_LARGE})])
"""The two boards as machines see them."""


if __name__ == "__main__":
    from amaranth_boards.test.blinky import Blinky

    Nexys2Platform().build(Blinky(), do_program=True)
