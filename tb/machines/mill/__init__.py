"""`mill`: the three-axis milling machine."""

from typing import Any

from fresa.machines.mill import Mill, MillTiming

from ...diagram import Diagram
from ...engines import Engine
from ...machine import Coverage, Machine, Recorded, Serve, parts

__all__ = ["MACHINE"]

#: The switch of the board that selects automatic mode, SW7.
AUTOMATIC = 1 << 7


def _model(*, timing: MillTiming, z_travel: int, guard: bool = False):
    from .model import MillModel

    return MillModel(period=timing.period, scan_bits=timing.scan_bits, z_travel=z_travel,
                     jog_period=timing.jog_period)


def _directed(seed: int, clocks: int, **options: Any):
    from .stimulus import directed

    return directed(_model(**options), seed, clocks)


def _random(seed: int, block: int, rows: int, **options: Any):
    from .stimulus import random_rows

    return random_rows(seed, block, rows)


def _vhdl(*, timing: MillTiming, z_travel: int, guard: bool = False):
    """Give the description without a guard: in VHDL nothing can be upset."""
    from ...vhdl import REFERENCES

    return REFERENCES["mill"].described({
        "period": timing.period, "scan_bits": timing.scan_bits, "jog_period": timing.jog_period,
        "z_travel": z_travel})


def _travel_far(engine: Engine) -> None:
    """Order the far corner of the table, and back: random orders do not get that far."""
    engine.set(rst=1, mode=1, up=0, down=0, start=0, stop=0, jog=0)
    engine.run(4)
    engine.set(rst=0)
    for corner in (0xFFFF, 0):
        engine.run(1 << 20, until={"ready": 1})
        engine.set(position_x=corner, position_y=corner, start=1)
        engine.run(4)
        engine.set(start=0)
        for axis in range(4):  # each counter is seen in its turn, also over its upper half
            engine.set(counter_select=axis)
            engine.run(1 << 16)


def _real(clock: int):
    return {"timing": MillTiming.real(clock=clock)}


def _served(clock: int, *, baud: int):
    """Make the mill on a board, with orders from its line."""
    from fresa.machines import MillStation, SerialOrders
    from fresa.panel import debounce_period
    from fresa.protocol import bit_period

    from ...boards import board

    machine = MillStation(source=SerialOrders(period=bit_period(clock, baud)),
                          timing=MillTiming.real(clock=clock))
    return board("mill", machine, debounce=debounce_period(clock))


DIAGRAMS = (
    Diagram(
        "serial-orders",
        "Lines come and answers go, 34 bytes and 33, of 16 clocks a bit here: a session is opened, "
        "order 1 is taken and carried out, order 2 comes damaged, and then undamaged.",
        "line: rx tx orders: orders_valid orders_ready orders_payload.x orders_payload.up "
        "numbers: ledger.taken ledger.done", 0, 45_000),
    Diagram(
        "mill",
        "The whole machine by its own pins: X and Y by hand to the origin; then orders to (5, 2), "
        "the tool down, and a cut to (8, 5). The curves are the positions in steps.",
        "inputs: mode jog start position_x position_y down outputs: ready error axis_x axis_y "
        "axis_z positions: x.count y.count z.count", 0, 115),
)


MACHINE = Machine(
    name="mill", order=0, about="three axes on a board, mills your picture (docs/board.md)",
    make=Mill,
    short={"timing": MillTiming(period=3, scan_bits=4, jog_period=2), "z_travel": 5},
    variants={"mill-guarded": {"guard": True}},
    benched={"timing": MillTiming(period=4, scan_bits=3), "z_travel": 6},
    model=_model, directed=_directed, random=_random, vhdl=_vhdl,
    real=_real,
    serve=Serve("the mill, with SW7 on, for  python -m tools.send  (docs/serial-orders.md)",
                _served, {"switches": AUTOMATIC}),
    diagrams=DIAGRAMS,
    coverage=Coverage(300_000, 98, 98, _travel_far),
    recorded=Recorded(campaign=10**9, sizes={
        "mill": ("--board pins", "netlist mill"),
        "mill-guard": ("--board pins --guard", "netlist mill-guarded"),
        "mill-serial": ("--orders serial", "fuzz mill"),
        "mill-picture": ("--size 400x400 --enlarge", "netlist nexys2-picture")}),
    **parts(__name__, "contracts", "faults", "fuzz", "netlist", "scenarios",
            "survivors"))
