"""iCEBreaker 1.0 by 1BitSquared: an iCE40UP5K and three Pmods."""

from amaranth.build import Attrs
from amaranth_boards.icebreaker import ICEBreakerPlatform

from .board import Allotment, Board, Capacity, Layout, Loader, Pin
from .flow import ICE40

__all__ = ["BOARDS"]

_PMODS = ("P1A", "P1B", "P2")

_HEADER = {f"{pmod}{pin}": f"pmod_{number}:{pin}"
           for number, pmod in enumerate(_PMODS) for pin in (1, 2, 3, 4, 7, 8, 9, 10)}

_LAYOUTS = tuple(
    Layout(f"PMOD{pmod[1:]}", view,
              " ".join(f"{pmod}{pin}" for pin in range(1, 5)) + " GND 3V3",
              " ".join(f"{pmod}{pin}" for pin in range(7, 11)) + " GND 3V3")
    for pmod, view in zip(_PMODS, (*["components up, USB at the top"] * 2,
                                   "components up, USB at the left"), strict=True))

_PANEL = {
    "clk": (Pin("12 MHz", "clk12"),),
    "buttons": (Pin("uButton", "button"),),
    "leds": (Pin("R", "led", 0), Pin("G", "led", 1)),
    "rx": (Pin("RXD", "uart", 0, "rx"),),
    "tx": (Pin("TXD", "uart", 0, "tx"),),
}

# Contacts are not on PMOD2: while the part that can be broken off is there, some of its pins are
# pulled down by more than the FPGA pulls them up.
_ALLOTMENTS = {
    "mill": Allotment(
        header={"axis_x": "P1A1 P1A2 P1A3 P1A4", "axis_y": "P1A7 P1A8 P1A9 P1A10",
                "axis_z": "P1B1 P1B2 P1B3 P1B4", "start": "P1B7", "reset": "P1B8"},
        panel={"buttons": "stop", "leds": "error ready", "rx": "rx", "tx": "tx"},
        constant={"automatic": 1, "jog": 0}),
    "positioner": Allotment(
        header={"step": "P1A1 P1A7 P1B1", "direction": "P1A2 P1A8 P1B2",
                "enable": "P1A3 P1A9 P1B3", "buzzer": "P1B4", "limits": "P1B7 P1B8 P1B9"},
        panel={"buttons": "reset", "leds": "fault connected", "rx": "rx", "tx": "tx"}),
    "single": Allotment(
        header={"coils": "P1A1 P1A2 P1A3 P1A4", "enable": "P1A7"},
        panel={"buttons": "reset", "leds": "fault moving", "rx": "rx", "tx": "tx"}),
}

BOARDS = (Board(
    "icebreaker", "icebreaker", ICEBreakerPlatform,
    Capacity(luts=5_280, flip_flops=5_280, block_rams=30, multipliers=8, block_ram_bits=4096),
    _HEADER, _PANEL,
    outputs=Attrs(IO_STANDARD="SB_LVCMOS"),
    pulled_up=Attrs(IO_STANDARD="SB_LVCMOS", PULLUP=1),
    allotments=_ALLOTMENTS,
    title="iCEBreaker 1.0, Lattice iCE40UP5K",
    source="its KiCad board file (github.com/icebreaker-fpga/icebreaker) and icebreaker.pcf "
           "(github.com/YosysHQ/icestorm)",
    layouts=_LAYOUTS, start_up_us=20, flow=ICE40,
    loader=Loader("ice40_generic", "0403:6010", memory=False)),)
