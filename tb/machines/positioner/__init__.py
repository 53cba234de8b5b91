"""`positioner`: three motors behind a serial line."""

from collections.abc import Sequence
from typing import Any

from fresa.clock import CLOCK
from fresa.drive import MAX_PULSE
from fresa.machines.positioner import (
    ENDS,
    LIMIT_ENDS,
    TOP_SPEED,
    Positioner,
    PositionerTiming,
)
from fresa.motion import MAX_BACKLASH
from fresa.protocol import BAUD, bit_period

from ...diagram import Diagram
from ...machine import Coverage, Machine, Option, Options, Recorded, Serve, parts

__all__ = ["MACHINE"]


def make_model(*, timing: PositionerTiming, **options: Any):
    """Make the model of a build."""
    from .model import PositionerModel

    return PositionerModel(timing=timing, bit=_bit(timing), **options)


def _directed(seed: int, clocks: int, *, timing: PositionerTiming, **options: Any):
    from .stimulus import directed

    return directed(_bit(timing), seed, clocks)


def _random(seed: int, block: int, rows: int, *, timing: PositionerTiming, **options: Any):
    from .stimulus import random_rows

    return random_rows(_bit(timing), seed, block, rows)


def _bit(timing: PositionerTiming) -> int:
    return bit_period(timing.clock, timing.baud)


#: Times of the driver modules, in ns: those of the DRV8825, and what they say.
TIMES = {"width_ns": (1900, "STEP is high"), "low_ns": (1900, "STEP is low"),
         "setup_ns": (650, "DIR is still before STEP"), "hold_ns": (650, "DIR is still after STEP")}


def _real(clock: int, *, baud: int, top_speed: int, width_ns: int, low_ns: int, setup_ns: int,
          hold_ns: int, inverted: bool, original: bool, backlash: Sequence[int],
          limit_ends: Sequence[str], **pins: bool):
    timing = PositionerTiming.real(clock=clock, baud=baud, top_speed=top_speed, width_ns=width_ns,
                                   low_ns=low_ns, setup_ns=setup_ns, hold_ns=hold_ns)
    return {"timing": timing, "inverted": inverted, "original": original,
            "backlash": tuple(backlash), "limit_ends": tuple(limit_ends)}


def _inverted(*, enable_low: bool, normally_closed: bool, **options: Any):
    return ["enable"] * enable_low + ["limits"] * normally_closed


def _figures(clock: int, made: Options, *, baud: int, top_speed: int, **options: Any):
    bit = bit_period(clock, baud)
    facts = {"baud_asked": baud, "baud": round(clock / bit, 3), "bit_clocks": bit,
             "top_speed": top_speed, **options}
    return facts, (f"clock {clock / 1e6:g} MHz; {clock / bit:.0f} baud, {bit} clocks a bit; up to "
                   f"{top_speed} steps/s")


OPTIONS = (
    Option("baud", "bits a second of the serial line, 8 301 at least with the default speed: an "
           "answer to STATE must fit into 0.1 s (default: %(default)s)", BAUD, least=1,
           metavar="N"),
    *(Option(name, f"least time for which {says} (default: %(default)s)", time, least=1,
             most=MAX_PULSE * 10**9 // CLOCK, metavar="NS")
      for name, (time, says) in TIMES.items()),
    Option("inverted", "STEP and DIR go through optocouplers that invert them", False),
    Option("original", "send reports and nothing else, as the original does: no answers", False,
           serve=True),
    Option("enable_low", "ENABLE gives power where it is low, as a DRV8825 without an inverter "
           "wants it", False),
    Option("normally_closed", "the limit switches open where they are pressed; a wire that is "
           "broken counts as pressed", False),
    Option("top_speed", "most steps a second of a motor (default: %(default)s)", TOP_SPEED,
           least=1, metavar="N", serve=True),
    Option("backlash", "steps of backlash that each axis takes up at a reversal (default: 0 0 0)",
           (0, 0, 0), least=0, most=MAX_BACKLASH, metavar=("X", "Y", "Z"), serve=True),
    Option("limit_ends", "the end at which the switch of each limit input is, of "
           f"{', '.join(ENDS)} (default: {' '.join(LIMIT_ENDS)})", LIMIT_ENDS,
           metavar=("END1", "END2", "END3"), choices=ENDS, aliases=("--guards",), serve=True),
)


DIAGRAMS = (
    Diagram(
        "positioner-commands",
        "`MOV MOT1 C`, a byte a clock where it is read; two clocks after its last letter a word is "
        "known. With the end of the line the order is there.",
        "line: items_valid items_ready items_payload.byte items_payload.end order: orders_valid "
        "orders_payload.answer orders_payload.command orders_payload.motor "
        "orders_payload.clockwise inside: dut.commands_state_state", 0, 22),
    Diagram(
        "positioning",
        "`MOV` and `GOTO` are refused, the first before `CONNECT`, the second to a point never "
        "stored; each is answered once, and changes nothing. Then a point is stored, and all "
        "motors go there.",
        "inputs: orders_valid orders_payload.command orders_payload.point "
        "outputs: orders_ready connected run target_n_0 answers_valid answers_payload", 0, 14),
    Diagram(
        "reporter",
        "A line that takes a byte every 11 clocks. A report begins at each tick; an answer that "
        "would not be over by then waits. Here one is sent, and the next waits for the report.",
        "inputs: answers_valid answers_ready answers_payload line: bytes_valid bytes_payload "
        "outputs: tick inside: dut.reporter_state_state", 640, 860, radix=("bytes_payload=hex",)),
    Diagram(
        "positioner",
        "`GOTO` has come: X and Y go to (20, -6), X at 1500 steps/s and Y at 200, each DIR before "
        "its first STEP. X takes up 3 steps of backlash, which its position does not count.",
        "x: x.step_pin x.direction_pin x.position y: y.step_pin y.direction_pin "
        "y.position pins: enable moving rx", 9_480, 9_700),
)


MACHINE = Machine(
    name="positioner", order=2,
    about="three axes of a micropositioner, on the same line (docs/positioner.md)",
    make=Positioner,
    short={"timing": PositionerTiming(clock=16_000, baud=1000, top_speed=1500, width=2, low=3,
                                      setup=2, hold=4, settle=30, report=14_000),
           "backlash": (3, 0, 12), "limit_ends": ("X-", "Y+", "X+")},
    benched={"timing": PositionerTiming(clock=16_000, baud=1000, top_speed=1500, width=2, low=2,
                                        setup=2, hold=2, settle=5, report=14_000),
             "backlash": (3, 0, 0), "limit_ends": LIMIT_ENDS},
    model=make_model, directed=_directed, random=_random,
    without=dict.fromkeys(("netlist", "netlist-icarus"),
                          "it takes block RAMs, of which Yosys has no model"),
    options=OPTIONS, real=_real, inverted=_inverted, figures=_figures,
    serve=Serve("three axes; commands such as  CONNECT  and line feed",
                switches=lambda *, limit_ends, **options: limit_ends),
    diagrams=DIAGRAMS,
    # Of the 31 bits of the seconds, in eight places, a run reaches eight.
    coverage=Coverage(6_000_000, 96, 90),
    recorded=Recorded(
        sizes={"positioner": ("", "netlist nexys2-positioner")}, quick_mutants="reporter",
        unmutated="There are none of `positioner` as a whole: nearly all of them would be in its "
                  "parts, and its bench is too short to show each of them once more."),
    **parts(__name__, "contracts", "faults", "fuzz", "netlist", "scenarios",
            "survivors"))
