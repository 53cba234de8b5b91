"""`single`: one motor behind a serial line."""

from typing import Any

from fresa.machines.single import FINE, TOP_SPEED, TURN, Single, SingleTiming
from fresa.motion import MAX_ACCELERATION
from fresa.protocol import BAUD
from fresa.protocol.frames import SPEEDS

from ...diagram import Diagram
from ...machine import Coverage, Machine, Option, Options, Recorded, Serve, parts

__all__ = ["MACHINE"]


def make_model(*, timing: SingleTiming, ramp: int = 0, top_speed: int = TOP_SPEED, greeting: bytes,
           help_text: bytes):
    """Make a model, which counts rates in the unit of the ramp, if there is one."""
    from fresa.motion import ramp_rates

    from .model import SingleModel

    rate, modulus = timing.rate * (FINE if ramp else 1), timing.modulus * (FINE if ramp else 1)
    rates = ramp_rates(acceleration=ramp, top=top_speed * rate, modulus=modulus,
                       clock=timing.clock) if ramp else ()
    return SingleModel(bit=timing.bit, modulus=modulus, rate=rate, ramp=rates, greeting=greeting,
                       help_text=help_text)


def _directed(seed: int, clocks: int, **options: Any):
    from .stimulus import directed

    return directed(make_model(**options), seed, clocks)


def _random(seed: int, block: int, rows: int, *, timing: SingleTiming, **options: Any):
    from .stimulus import random_rows

    return random_rows(timing.bit, seed, block, rows)


def _real(clock: int, *, baud: int, turn: int, ramp: int, top_speed: int, **options: Any):
    if top_speed != TOP_SPEED and not ramp:
        raise ValueError("leave out --top-speed: without --ramp every speed is made")
    timing = SingleTiming.real(clock=clock, baud=baud, turn=turn)
    return {"timing": timing, "ramp": ramp, "top_speed": top_speed, **options}


def _figures(clock: int, made: Options, *, baud: int, turn: int, ramp: int, top_speed: int,
             **options: Any):
    timing = made["timing"]
    real = clock / timing.bit
    facts = {"baud_asked": baud, "baud": round(real, 3), "bit_clocks": timing.bit,
             "steps_a_turn": turn, "modulus_clocks": timing.modulus,
             "steps_in_it_at_1_rpm": timing.rate, **options}
    says = (f"clock {clock / 1e6:g} MHz; {real:.0f} baud, {timing.bit} clocks a bit; at 1 rpm "
            f"{timing.rate} steps in {timing.modulus} clocks")
    if ramp:
        facts |= {"ramp_steps_per_s2": ramp, "top_speed_rpm": top_speed}
        says += f"; {ramp} steps/s² up to {top_speed} rpm"
    return facts, says


OPTIONS = (
    Option("baud", "bits a second of the serial line (default: %(default)s)", BAUD, least=1,
           metavar="N"),
    Option("turn", "steps of a turn of the motor, by which rpm are counted; in half steps these "
           "are twice as many for the shaft's own rpm (default: %(default)s)", TURN, least=1,
           most=10_000, metavar="STEPS", serve=True),
    Option("ramp", "speed up and slow down by N steps/s², so that a motor with a load can follow; "
           "0 for none (default: %(default)s)", 0, least=0, most=MAX_ACCELERATION, metavar="N",
           serve=True),
    Option("top_speed", "with --ramp, the speed at which the ramp ends: a higher one is made as "
           "this (default: %(default)s)", TOP_SPEED, least=1, most=SPEEDS - 1, metavar="RPM",
           serve=True),
    Option("full_step", "full steps, both windings on, instead of half steps", False, serve=True),
    Option("unipolar", "coil words for a unipolar motor instead of a bipolar one", False),
)


DIAGRAMS = (
    Diagram(
        "frame-interpreter",
        "The frame `x57`, in which a word is read, a number and the end. The set-point is there "
        "with the clock after the end was taken, and not before; then `ok` and the end of the line "
        "are sent.",
        "frames: items_valid items_ready items_payload.byte items_payload.end "
        "state: dut.interpreter_state_state outputs: target bytes_valid bytes_payload", 1268, 1288,
        radix=("items_payload.byte=hex", "bytes_payload=hex", "target=dec")),
    Diagram(
        "single",
        "The end of the frame `:x5`. With its stop bit the set-point is 5, and the motor is on its "
        "way: the first step is made at once, the others 10 clocks apart, 5987 rpm at the 48 kHz "
        "of this bench, or 11 now and then. `tx` falls when the answer begins.",
        "line: rx tx outputs: moving coils position enable", 11940, 12040,
        radix=("position=dec",)),
)


MACHINE = Machine(
    name="single", order=1,
    about="one stepper, commanded from a terminal on its serial port (docs/single.md)",
    make=Single,
    short={"timing": SingleTiming.real(clock=48_000, baud=3000), "greeting": b"!\r\n",
           "help_text": b"?\r\n"},
    variants={"single-ramp": {
        "timing": SingleTiming.real(clock=240_000, baud=15_000, turn=5), "ramp": 150_000,
        "top_speed": 25_000}},
    benched={"timing": SingleTiming.real(clock=48_000, baud=3000), "greeting": b"hi\r\n",
             "help_text": b"help\r\n"},
    model=make_model, directed=_directed, random=_random,
    without=dict.fromkeys(("netlist", "netlist-icarus"),
                          "it takes block RAMs, of which Yosys has no model"),
    options=OPTIONS, real=_real, figures=_figures,
    serve=Serve("one motor; commands such as  :x100  and Return"),
    diagrams=DIAGRAMS,
    coverage=Coverage(3_000_000, 98, 93),
    recorded=Recorded(sizes={"single": ("", "netlist nexys2-single"),
                             "single-ramp": ("--ramp 1000", "run single-ramp")}),
    **parts(__name__, "contracts", "faults", "fuzz", "netlist", "scenarios",
            "survivors"))
