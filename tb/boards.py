# amaranth: UnusedElaboratable=no

"""The designs that engines run: machines by their own pins, and boards by theirs."""

from collections.abc import Sequence
from dataclasses import replace

from amaranth import ClockDomain, ClockSignal, Module, ResetSignal, Signal
from amaranth.lib import io, wiring

from fresa.machines.mill import Z_TRAVEL, Mill, MillPace
from fresa.machines.positioner import GUARDS, PositionerPace
from fresa.motion import SerialOrders
from fresa_boards.nexys2_mill import Nexys2Mill, OrderSource
from fresa_boards.nexys2_positioner import Nexys2Positioner

from .design import Design
from .vhdl import REFERENCES

__all__ = ["component", "described", "mill", "nexys2_mill", "nexys2_positioner"]


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


def mill(*, pace: MillPace, z_travel: int = Z_TRAVEL, guard: bool = False) -> Design:
    """Return the raw machine. Its VHDL has no guard: it has nothing that could be upset."""
    design = component("mill", Mill(pace=pace, z_travel=z_travel, guard=guard))
    return replace(design, vhdl=REFERENCES["mill"].described({
        "period": pace.period, "scan_bits": pace.scan_bits, "jog_period": pace.jog_period,
        "z_travel": z_travel}))


def nexys2_mill(
    source: OrderSource, *, pace: MillPace, debounce: int,
    z_travel: int = Z_TRAVEL, guard: bool = False,
) -> Design:
    """Return the mill on a Nexys 2: the wiring that is built, on pins of a simulation.

    Its inputs are ``switches`` and ``buttons``; its outputs ``leds``, ``segments``, ``digits``,
    ``axis_x``, ``axis_y`` and ``axis_z``, all with the levels of the board. `SerialOrders` have
    ``rx`` and ``tx`` besides.
    """
    serial = isinstance(source, SerialOrders)
    line = [("rx", "i", 1, False), ("tx", "o", 1, False)] if serial else []
    ports = {
        name: io.SimulationPort(direction, width, invert=invert, name=name)
        for name, direction, width, invert in [
            ("clk", "i", 1, False), ("switches", "i", 8, False), ("buttons", "i", 4, False),
            ("leds", "o", 8, False), ("segments", "o", 8, True), ("digits", "o", 4, True),
            ("axis_x", "o", 4, False), ("axis_y", "o", 4, False), ("axis_z", "o", 4, False),
            *line,
        ]
    }
    top = Nexys2Mill(ports, source=source, pace=pace, debounce=debounce, z_travel=z_travel,
                     guard=guard)
    return Design(
        "nexys2_mill", top, ports["clk"].i,
        inputs={name: port.i for name, port in ports.items()
                if port.direction is io.Direction.Input and name != "clk"},
        outputs={name: port.o for name, port in ports.items()
                 if port.direction is io.Direction.Output})


def nexys2_positioner(
    *, pace: PositionerPace, debounce: int, inverted: bool = False,
    backlash: Sequence[int] = (0, 0, 0), guards: Sequence[str] = GUARDS,
) -> Design:
    """Return the positioner on a Nexys 2: the wiring that is built, on pins of a simulation.

    Its inputs are ``rx``, ``reset`` and ``limits``, which are 0 where a switch is pressed; its
    outputs ``tx``, ``buzzer``, ``leds``, and ``motor_x``, ``motor_y`` and ``motor_z``, each STEP,
    DIR and ENABLE.
    """
    inputs = {"rx": 1, "reset": 1, "limits": 3}
    outputs = {"tx": 1, "buzzer": 1, "leds": 8, **{f"motor_{name}": 3 for name in "xyz"}}
    ports = {name: io.SimulationPort("i" if name in inputs else "o", width,
                                     invert=name == "limits", name=name)
             for name, width in {**inputs, **outputs}.items()}
    ports["clk"] = io.SimulationPort("i", 1, name="clk")
    top = Nexys2Positioner(ports, pace=pace, debounce=debounce, inverted=inverted,
                           backlash=backlash, guards=guards)
    return Design("nexys2_positioner", top, ports["clk"].i,
                  inputs={name: ports[name].i for name in inputs},
                  outputs={name: ports[name].o for name in outputs})
