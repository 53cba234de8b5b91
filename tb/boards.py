# amaranth: UnusedElaboratable=no

"""The designs that engines run: machines by their own pins, and boards by theirs."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from amaranth import ClockDomain, ClockSignal, Elaboratable, Module, ResetSignal, Signal
from amaranth.lib import io, wiring

from fresa.machines import SerialOrders, Single
from fresa.machines.mill import Z_TRAVEL, Mill, MillTiming
from fresa.machines.positioner import LIMIT_ENDS, PositionerTiming
from fresa_boards.nexys2_mill import Nexys2Mill, OrderSource
from fresa_boards.nexys2_positioner import Nexys2Positioner
from fresa_boards.nexys2_single import Nexys2Single

from .design import Design
from .vhdl import REFERENCES

__all__ = ["component", "described", "mill", "nexys2_mill", "nexys2_positioner", "nexys2_single"]


def component(name: str, dut: wiring.Component) -> Design:
    """Return a component as a design: its members by name, and ``rst``, the reset of ``sync``.

    Members that are interfaces, such as streams, are joined to their path by underscores.
    """
    m = Module()
    m.domains.sync = ClockDomain()
    m.submodules.dut = dut
    clk, rst = Signal(name="clk"), Signal(name="rst")
    m.d.comb += [ClockSignal().eq(clk), ResetSignal().eq(rst)]
    inputs, outputs = {"rst": rst}, {}
    for path, member, value in dut.signature.flatten(dut):
        ports = inputs if member.flow is wiring.In else outputs
        # Layouts have views; engines read and write bits.
        ports["_".join(map(str, path))] = value.as_value() if hasattr(value, "as_value") else value
    return Design(name, m, clk, inputs, outputs)


def described(name: str, **parameters: int | bool) -> Design:
    """Return a component that `tb.vhdl` describes, of the first case there if none is given."""
    reference = REFERENCES[name]
    parameters = parameters or dict(reference.cases[0])
    design = component(reference.entity, reference.component(**parameters))
    return replace(design, vhdl=reference.described(parameters))


def mill(*, timing: MillTiming, z_travel: int = Z_TRAVEL, guard: bool = False) -> Design:
    """Return the raw machine. Its VHDL has no guard: it has nothing that could be upset."""
    design = component("mill", Mill(timing=timing, z_travel=z_travel, guard=guard))
    return replace(design, vhdl=REFERENCES["mill"].described({
        "period": timing.period, "scan_bits": timing.scan_bits, "jog_period": timing.jog_period,
        "z_travel": z_travel}))


def nexys2_mill(
    source: OrderSource, *, timing: MillTiming, debounce: int,
    z_travel: int = Z_TRAVEL, guard: bool = False,
) -> Design:
    """Return the mill on a Nexys 2: the wiring that is built, on pins of a simulation.

    Its inputs are ``switches`` and ``buttons``; its outputs ``leds``, ``segments``, ``digits``,
    ``axis_x``, ``axis_y`` and ``axis_z``, all with the levels of the board. `SerialOrders` have
    ``rx`` and ``tx`` besides.
    """
    line: dict[str, tuple[str, int]] = (
        {"rx": ("i", 1), "tx": ("o", 1)} if isinstance(source, SerialOrders) else {})
    ports = _ports({
        "clk": ("i", 1), "switches": ("i", 8), "buttons": ("i", 4),
        "leds": ("o", 8), "segments": ("o", 8), "digits": ("o", 4),
        "axis_x": ("o", 4), "axis_y": ("o", 4), "axis_z": ("o", 4), **line})
    top = Nexys2Mill(ports, source=source, timing=timing, debounce=debounce, z_travel=z_travel,
                     guard=guard)
    return _board("nexys2_mill", top, ports)


def nexys2_single(machine: Single, *, debounce: int, scan_bits: int) -> Design:
    """Return `single` on a Nexys 2, likewise.

    Its inputs are ``button`` and ``rx``; its outputs ``tx``, ``leds``, ``segments``, ``digits``,
    ``coils`` and ``bridge``.
    """
    ports = _ports({
        "clk": ("i", 1), "button": ("i", 1), "rx": ("i", 1), "tx": ("o", 1), "leds": ("o", 8),
        "segments": ("o", 8), "digits": ("o", 4), "coils": ("o", 4), "bridge": ("o", 1)})
    top = Nexys2Single(ports, machine=machine, debounce=debounce, scan_bits=scan_bits)
    return _board("nexys2_single", top, ports)


def nexys2_positioner(
    *, timing: PositionerTiming, debounce: int, inverted: bool = False, enable_low: bool = False,
    normally_closed: bool = False,
    backlash: Sequence[int] = (0, 0, 0), limit_ends: Sequence[str] = LIMIT_ENDS,
) -> Design:
    """Return the positioner on a Nexys 2, likewise.

    Its inputs are ``rx``, ``reset`` and ``limits``, which are 0 where a switch is closed; its
    outputs ``tx``, ``buzzer``, ``leds``, and ``motor_x``, ``motor_y`` and ``motor_z``, each STEP,
    DIR and ENABLE.
    """
    ports = _ports({
        "clk": ("i", 1), "rx": ("i", 1), "reset": ("i", 1), "limits": ("i", 3), "tx": ("o", 1),
        "buzzer": ("o", 1), "leds": ("o", 8), **{f"motor_{name}": ("o", 3) for name in "xyz"}})
    top = Nexys2Positioner(ports, timing=timing, debounce=debounce, inverted=inverted,
                           enable_low=enable_low, normally_closed=normally_closed,
                           backlash=backlash, limit_ends=limit_ends)
    return _board("nexys2_positioner", top, ports)


def _ports(pins: Mapping[str, tuple[str, int]]) -> dict[str, io.SimulationPort]:
    """Make the pins of a board: their directions and widths, those that are active low inverted."""
    return {name: io.SimulationPort(direction, width, name=name,
                                    invert=name in ("segments", "digits", "limits"))
            for name, (direction, width) in pins.items()}


def _board(name: str, top: Elaboratable, ports: Mapping[str, io.SimulationPort]) -> Design:
    inputs = {pin: port.i for pin, port in ports.items() if port.direction is io.Direction.Input}
    clk = inputs.pop("clk")
    outputs = {pin: port.o for pin, port in ports.items() if pin not in {"clk", *inputs}}
    return Design(name, top, clk, inputs=inputs, outputs=outputs)
