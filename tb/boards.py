# amaranth: UnusedElaboratable=no

"""Designs for engines: machines with their own pins, and boards with theirs."""

from collections.abc import Collection
from dataclasses import replace

from amaranth import ClockDomain, ClockSignal, Const, Module, ResetSignal, Signal, Value
from amaranth.lib import io, wiring

from fresa.panel import debounce_period
from fresa.roles import MachineComponent
from fresa_boards.board import LEDS, Bit, Board
from fresa_boards.nexys2 import NEXYS2_500
from fresa_boards.wiring import check_names, other_levels, simulation_ports, wire

from .design import Design
from .vhdl import REFERENCES

__all__ = ["behind_pins", "board", "component", "described"]


def component(name: str, dut: wiring.Component) -> Design:
    """Return a component as a design: its members by name, and ``rst``, the reset of ``sync``.

    Members of interfaces, such as streams, have their path joined by underscores.
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
    """Return a component with a VHDL reference, by default of its first case there."""
    reference = REFERENCES[name]
    parameters = parameters or dict(reference.cases[0])
    design = component(reference.entity, reference.component(**parameters))
    return replace(design, vhdl=reference.described(parameters))


def board(name: str, machine: MachineComponent, *, debounce: int | None = None,
          scan_bits: int | None = None, inverted: Collection[str] = (), start_up: int = 0,
          on: Board = NEXYS2_500) -> Design:
    """Return a machine on a board, wired as it is built, with the pins of a simulation.

    Its inputs and outputs are named by the machine's allotment, such as ``switches``, ``buttons``,
    ``leds`` and header ports, all with the levels of the board.

    Parameters
    ----------
    name : str
        The machine's name, by which its pins are found.
    machine : MachineComponent
        The machine.
    debounce, scan_bits, inverted, start_up
        See :func:`fresa_boards.wiring.wire`.
    on : Board
        The board.
    """
    allotment = on.allotment(name)
    ports = simulation_ports(on, machine, allotment)
    top = wire(machine, ports, allotment, clock=on.clock, debounce=debounce, scan_bits=scan_bits,
               inverted=inverted, start_up=start_up)
    inputs = {pin: port.i for pin, port in ports.items() if port.direction is io.Direction.Input}
    clk = inputs.pop("clk")
    outputs = {pin: port.o for pin, port in ports.items() if pin not in {"clk", *inputs}}
    return Design(f"{on.family}_{name}", top, clk, inputs=inputs, outputs=outputs,
                  names=check_names(machine, ports, allotment))


def behind_pins(name: str, machine: MachineComponent, *, clock: int, on: Board,
                inverted: Collection[str] = ()) -> Design:
    """Return a machine on a board with what is wired to its pins: contacts, drivers, a line.

    Its inputs and outputs are those of the machine that have a pin there, but for LEDs, by their
    names and with the levels of the machine, and ``reset``; what is between is as it is built.

    Parameters
    ----------
    name, machine, inverted, on
        See :func:`board`.
    clock : int
        The clock in Hz, by which start-up and debouncing take the times of the board.
    """
    design = board(name, machine, debounce=debounce_period(clock), inverted=inverted,
                   start_up=-(-on.start_up_us * clock // 1_000_000), on=on)
    allotment, m = on.allotment(name), Module()
    ports = simulation_ports(on, machine, allotment)
    m.submodules.board = design.top
    inputs, outputs = {}, {}
    for place, bits in allotment.places(machine).items():
        if place == LEDS:
            continue
        turned = other_levels(machine, place, ports[place], bits, inverted)
        for index, (bit, other) in enumerate(zip(bits, turned, strict=True)):
            if place in design.inputs:
                level = _level(inputs, bit) if bit else Const(0)
                m.d.comb += design.inputs[place][index].eq(~level if other else level)
            elif bit:
                level = Value.cast(design.outputs[place][index])
                m.d.comb += _level(outputs, bit).eq(~level if other else level)
    return replace(design, top=m, inputs=inputs, outputs=outputs, names={})


def _level(ports: dict[str, Signal], bit: Bit) -> Value:
    """Give a bit of a port, which is made if there is none."""
    return Value.cast(ports.setdefault(bit.port, Signal(bit.width, name=bit.port))[bit.index])
