# amaranth: UnusedElaboratable=no

"""The VHDL reference of the mill, written from the thesis, and its components.

What the thesis leaves open was taken from the gateware, since both must agree in every clock: the
bit layout of orders and movements, the edge of `start`, the end of a movement at or past its last
step, how a refused order passes through S8, and the dark eighths of a digit. So the sequencer and
the order control have the registers of the gateware, and a mistake in one of these choices would be
in both. The rest is the thesis's: its tables, state numbers and arithmetic.

`REFERENCES` gives the component of each entity, the parameters of the comparison, and a mistake
that it must find.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from amaranth import Cat, Mux
from amaranth.lib import data, wiring

from fresa.drive import AxisDrivers, CoilDriver, FrequencyDivider
from fresa.machines.mill import Z_TRAVEL, Mill, MillTiming
from fresa.motion import (
    AutomaticControl,
    ManualControl,
    MotionSequencer,
    Move,
    NumericalController,
    Order,
    OrderControl,
    StepCounter,
)
from fresa.panel import Monitor, SevenSegment

from ..design import Entity
from ..mistake import Mistake

__all__ = ["FOLDER", "REFERENCES", "Held", "Reference"]

FOLDER = Path(__file__).parent

Parameters = Mapping[str, int | bool]

Held = tuple[Mapping[str, int], int]
"""Levels of inputs, and the number of clocks that they are held."""

_PACE = MillTiming.real()


@dataclass(frozen=True)
class Reference:
    """An entity and its component.

    Attributes
    ----------
    entity : str
        Name of the entity and of its file.
    component : callable
        Makes the component from parameters, which are also the entity's generics.
    cases : tuple of mapping
        Parameters of the comparison, with times so short that much happens in few clocks; the
        first is used for simulation and mistakes.
    mistake : Mistake
        Planted in the gateware: the comparison must find it.
    shows : str
        An output that differs with the mistake.
    real : mapping, optional
        Parameters of the board, if there are any.
    uses : tuple of str
        Entities that it instantiates.
    renamed : mapping of str to str
        See :class:`tb.design.Entity`.
    idle : tuple of str
        Outputs that never change: errors by upsets, which only the gateware can have.
    packed : mapping of str to tuple of int
        Widths of the fields of those inputs that have several, from bit 0.
    directed : tuple of (mapping, int)
        Inputs that reach its states, in order.
    """

    entity: str
    component: Callable[..., wiring.Component]
    cases: tuple[Parameters, ...]
    mistake: Mistake
    shows: str
    real: Parameters | None = None
    uses: tuple[str, ...] = ()
    renamed: Mapping[str, str] = field(default_factory=dict)
    idle: tuple[str, ...] = ()
    packed: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    directed: tuple[Held, ...] = ()

    @property
    def files(self) -> tuple[Path, ...]:
        """Return the VHDL files in the order of analysis."""
        names: dict[str, None] = {}
        for part in self.uses:
            names |= dict.fromkeys(path.stem for path in REFERENCES[part].files)
        return tuple(FOLDER / f"{name}.vhd" for name in (*names, self.entity))

    def described(self, parameters: Parameters) -> Entity:
        """Return the entity with these parameters."""
        return Entity(self.entity, self.files, parameters, self.renamed)


def _widths(struct: type[data.Struct]) -> tuple[int, ...]:
    layout = data.Layout.cast(struct)
    return tuple(layout[name].width for name in layout.members)


_MOVES, _ORDER = {"moves_payload": _widths(Move)}, {"order": _widths(Order)}


def _move(axes: int, direction: int, steps: int) -> int:
    return axes | direction << 3 | steps << 6


def _order(x: int = 0, y: int = 0, *, up: int = 0, down: int = 0) -> int:
    return x | y << 16 | up << 32 | down << 33


def _ordered(x: int = 0, y: int = 0, *, up: int = 0, down: int = 0) -> tuple[Held, ...]:
    """Return a stimulus: orders, each with its movements some clocks later."""
    made = (({"moves_ready": 0}, 3), ({"moves_ready": 1}, 1)) * 3
    return (({"order": _order(x, y, up=up, down=down), "start": 1, "moves_ready": 1}, 3),
            ({"start": 0}, 2), *made, ({}, 4))


def _mill(*, period: int, scan_bits: int, jog_period: int, z_travel: int) -> Mill:
    return Mill(timing=MillTiming(period, scan_bits, jog_period), z_travel=z_travel)


REFERENCES: dict[str, Reference] = {
    "divider": Reference(
        "frequency_divider", FrequencyDivider,
        cases=({"period": 3}, {"period": 3, "reset_less": True}, {"period": 2}, {"period": 1}),
        real={"period": _PACE.period},
        mistake=Mistake("count", lambda right, at: Mux(at("tick"), right - 1, right)),
        shows="tick",
        directed=(({"enable": 1}, 10), ({"enable": 0}, 3), ({"enable": 1}, 2), ({"clear": 1}, 1),
                  ({"clear": 0}, 8), ({"rst": 1}, 1), ({"rst": 0}, 8))),
    "coil": Reference(
        "coil_driver", CoilDriver,
        cases=({"period": 3}, {"period": 2}, {"period": 1}), real={"period": _PACE.period},
        mistake=Mistake("black", lambda right, at: right ^ (at("moved") & at("orange"))),
        shows="coils",
        directed=(({"step": 1, "direction": 1}, 16), ({"direction": 0}, 16), ({"step": 0}, 5),
                  ({"step": 1, "rst": 1}, 4), ({"rst": 0}, 4))),
    "counter": Reference(
        "step_counter", StepCounter, cases=({},),
        mistake=Mistake("count", lambda right, at: right - (right != at("count"))),
        shows="count",
        directed=(({"step": 1, "direction": 0}, 3), ({"direction": 1}, 6), ({"clear": 1}, 2),
                  ({"clear": 0, "direction": 0}, 3), ({"direction": 1}, 40_000), ({"step": 0}, 2))),
    "axes": Reference(
        "axis_drivers", AxisDrivers, uses=("coil",),
        cases=({"period": 3},), real={"period": _PACE.period},
        mistake=Mistake("y.direction", lambda _, at: at("x.direction")),
        shows="axis_y",
        directed=tuple(({"step": n & 7, "direction": n >> 3}, 4) for n in range(64))),
    "order_control": Reference(
        "order_control", OrderControl, uses=("divider",),
        cases=({"period": 2}, {"period": 1}), real={"period": _PACE.period},
        mistake=Mistake("reached", lambda _, at: at("count") > at("steps")),
        shows="moves_ready",
        idle=("fault",), packed=_MOVES,
        directed=(({"moves_valid": 1, "moves_payload": _move(5, 3, 2)}, 3), ({"count": 1}, 2),
                  ({"count": 2}, 3), ({"moves_payload": _move(0, 7, 2)}, 4),
                  ({"moves_payload": _move(7, 0, 0)}, 8), ({"moves_valid": 0}, 4))),
    "automatic": Reference(
        "automatic_control", AutomaticControl, uses=("order_control", "counter"),
        renamed={"select": "selector"}, packed=_MOVES,
        cases=({"period": 2},), real={"period": _PACE.period},
        mistake=Mistake("z.direction", lambda _, at: at("y.direction")),
        shows="at_z", idle=("fault",),
        directed=tuple(held for n in range(4) for held in (
            ({"moves_valid": 1, "moves_payload": _move(7, 2 * n, 2), "select": n}, 2),
            ({"moves_valid": 0, "moved": 7}, 1), ({"moved": 0}, 1), ({"moved": 7}, 1),
            ({"moved": 0}, 6)))),
    "sequencer": Reference(
        "motion_sequencer", MotionSequencer,
        cases=({"z_travel": 2},), real={"z_travel": Z_TRAVEL}, packed=_ORDER,
        mistake=Mistake("ascending_x", lambda right, _: ~right),
        shows="moves_payload", idle=("fault",),
        directed=(*_ordered(3, 3), *_ordered(5, 2), *_ordered(0, 4), *_ordered(), *_ordered(down=1),
                  *_ordered(up=1), *_ordered(up=1, down=1), ({"at_z": 0xFFFE}, 1),
                  *_ordered(5, 2), *_ordered(2, 2), *_ordered(0, 7), *_ordered(up=1),
                  ({"hold": 1}, 2), *_ordered(1, 1), ({"hold": 0}, 1), *_ordered(1, 1))),
    "manual": Reference(
        "manual_control", ManualControl, uses=("divider",),
        cases=({"period": 2}, {"period": 1}),
        mistake=Mistake("direction", lambda right, _: right & 0b011),
        shows="direction",
        directed=(({"jog": 1, "enable": 1}, 4), ({"jog": 0}, 2),
                  *(({"jog": n}, 3) for n in range(64)), ({"enable": 0}, 2), ({"enable": 1}, 4))),
    "display": Reference(
        "seven_segment", SevenSegment, cases=({"scan_bits": 3},),
        real={"scan_bits": _PACE.scan_bits},
        mistake=Mistake("shape", lambda right, at: Mux(at("nibble") == 2, right ^ 1, right)),
        shows="segments",
        directed=(*(({"value": 0x0123 + 0x4444 * n, "enable": 1}, 40) for n in range(4)),
                  ({"enable": 0}, 40))),
    "monitor": Reference(
        "monitor", Monitor, uses=("display",), cases=({"scan_bits": 3},),
        real={"scan_bits": _PACE.scan_bits},
        mistake=Mistake("leds", lambda right, at: Mux(at("jogging")[1], at("axis_z"), right)),
        shows="leds",
        directed=tuple(({"axis_x": 6, "axis_y": 3, "axis_z": 9, "jogging": n & 7, "mode": n >> 3,
                         "count": 0x1234}, 33) for n in range(16))),
    "controller": Reference(
        "numerical_controller", NumericalController,
        uses=("manual", "sequencer", "automatic", "axes"), renamed={"select": "selector"},
        packed=_ORDER,
        cases=({"period": 2, "z_travel": 2, "jog_period": 1},
               {"period": 1, "z_travel": 1, "jog_period": 3}),
        real={"period": _PACE.period, "z_travel": Z_TRAVEL, "jog_period": _PACE.jog_period},
        mistake=Mistake("hold", lambda _, at: at("stopped")),
        shows="axis_x",
        directed=(*(({"jog": n}, 6) for n in range(64)), ({"jog": 0, "mode": 1}, 2),
                  *(held for order in (_order(3, 3), _order(0, 5), _order(down=1), _order(1, 5),
                                       _order(3, 4), _order(up=1), _order(up=1, down=1), _order())
                    for held in (({"order": order, "start": 1, "select": order & 3}, 2),
                                 ({"start": 0}, 40))),
                  ({"order": _order(9, 9), "start": 1}, 12), ({"stop": 1}, 1),
                  ({"stop": 0, "start": 0}, 9), ({"rst": 1}, 1), ({"rst": 0}, 3),
                  ({"start": 1}, 30), ({"start": 0, "mode": 0}, 3))),
    "mill": Reference(
        "mill", _mill, uses=("controller", "monitor"),
        cases=({"period": 2, "scan_bits": 3, "jog_period": 1, "z_travel": 2},),
        real={"period": _PACE.period, "scan_bits": _PACE.scan_bits,
              "jog_period": _PACE.jog_period, "z_travel": Z_TRAVEL},
        mistake=Mistake("controller.order", lambda right, _: Cat(right[:32], right[33], right[32])),
        shows="axis_z"),
}
"""Entities by the name that `tb.contracts` gives the component."""
