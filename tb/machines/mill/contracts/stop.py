"""Contract of the stop button on a board: from its pin to those of the motors."""

from amaranth import ClockSignal, DomainRenamer, Module, ResetSignal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from fresa.drive import FULL_STEP
from fresa.machines import MillStation
from fresa.machines.mill import MillTiming
from fresa.motion import SquareGenerator
from fresa_boards.nexys2 import NEXYS2_500
from fresa_boards.wiring import simulation_ports, wire
from tb.contracts.coil import COIL
from tb.contracts.contract import Case, Component, Contract

__all__ = ["STOP"]

SYNCHRONIZER, PINS = 2, 1
"""Clocks from a pin to the machine, and from the machine to a pin."""

BTN3, LD7 = 3, 7


class _Board(wiring.Component):
    """The mill with the pins of a Nexys 2."""

    def __init__(self, *, debounce: int, z_travel: int, side: int, **timing: int) -> None:
        self.timing = MillTiming(**timing)
        self._debounce = debounce
        self._machine = MillStation(source=SquareGenerator(side=side), timing=self.timing,
                                    z_travel=z_travel)
        super().__init__({"switches": In(8), "buttons": In(4), "axis_x": Out(4), "axis_y": Out(4),
                          "axis_z": Out(4), "leds": Out(8)})

    def elaborate(self, platform) -> Module:
        m = Module()
        machine, allotment = self._machine, NEXYS2_500.allotment("mill")
        ports = simulation_ports(NEXYS2_500, machine, allotment)
        top = wire(machine, ports, allotment, clock=NEXYS2_500.clock, debounce=self._debounce)
        m.submodules.board = DomainRenamer("board")(top)
        m.d.comb += [
            ports["clk"].i.eq(ClockSignal()),
            ports["switches"].i.eq(self.switches),
            ports["buttons"].i.eq(self.buttons),
            *(getattr(self, name).eq(ports[name].o)
              for name in ("axis_x", "axis_y", "axis_z", "leds")),
        ]
        return m


def describe(c: Contract, dut: _Board) -> None:
    """When BTN3 has been steady no motor steps, whatever else is done, until reset.

    Which orders there are makes no difference: the stop is behind them all.
    """
    needed, pin, reset = dut.timing.stop_period, dut.buttons[BTN3], ResetSignal("board")
    to_pins = SYNCHRONIZER + needed + 1 + PINS  # clocks

    # What follows from the pin alone
    high = c.keep(range(to_pins + 1), name="high")  # clocks before this in which the pin was high
    with c.m.If(~pin):
        c.m.d.sync += high.eq(0)
    with c.m.Elif(high < to_pins):
        c.m.d.sync += high.eq(high + 1)
    steady = high >= needed
    for _ in range(SYNCHRONIZER):
        steady = c.past(steady)
    kept = c.keep(1, name="kept")
    held = kept | steady
    c.m.d.sync += kept.eq(held & ~reset)
    at_pins = c.past(c.past(held))
    c.implication("steady-level-stops", "When the pin was high for the time of a stop, and for "
                  "that of the way in and out, all motors stand until reset, and LD7 is dark.",
                  when=high == to_pins, then=at_pins & ~dut.leds[LD7])

    machine = "board.machine"
    controller = f"{machine}.mill.controller"
    drivers = c.part(f"{controller}.drivers")
    for index, name in enumerate("xyz"):
        word = getattr(dut, f"axis_{name}")
        changed = word != c.past(word, init=FULL_STEP[0])
        c.implication(f"{name}-stopped", f"From the stop on the pins of {name} keep their levels, "
                      "until reset.",
                      when=at_pins, then=~changed)

        # In the time that this takes
        path = f"{controller}.drivers.{name}"
        c.keeps(path, COIL, reset=reset)
        moved = c.past(c.past(drivers.moved[index]))
        c.invariant(f"{name}-changes-by-steps", f"The pins of {name} change two clocks after a "
                    "step.", changed == moved, cover=changed)
        steps = c.keep(2, name=f"steps_{name}")
        with c.m.If(~pin):
            c.m.d.sync += steps.eq(0)
        with c.m.Elif((high != 0) & changed):
            c.m.d.sync += steps.eq(steps + 1)
        c.invariant(f"{name}-at-most-one-step", f"From where the pin is high and stays so, {name} "
                    "makes at most one step.",
                    steps + ((high != 0) & changed) <= 1, cover=steps == 1)
        rested = c.past(c.past(c.kept[f"{path}:rested"]))
        c.invariant(f"{name}-step-while-high", f"That step of {name} was made while the pin was "
                    "high.",
                    (steps == 0) | (high == to_pins) | (rested + 2 <= high), cover=steps == 1,
                    lemma=True)

    c.invariant("no-glitch-stops", "A pin that was high for less time stops nothing.",
                c.signal(f"{controller}.stopped") == kept, cover=high == needed - 1)

    # What makes it so
    synchronised = c.past(c.past(high))
    c.invariant("watched-in-range", "No more clocks are watched than are needed.",
                high <= to_pins, cover=high == to_pins, lemma=True)
    c.invariant("filter-is-the-pin", "The filter has passed what was steady.",
                c.signal(f"{machine}.stop_filter.level") == steady, cover=steady, lemma=True)
    c.invariant("filter-counts-the-pin", "The filter has counted how long the pin was high.",
                steady | (c.signal(f"{machine}.stop_filter.divider.count") + needed - 1
                          == synchronised), cover=synchronised == 1, lemma=True)
    for path in ("handshake.handshake_state", "source.square_state"):
        state = c.state(f"{machine}.{path}")
        c.invariant(f"{path.rpartition('.')[2].replace('_', '-')}-in-use", "The state machine is "
                    "not in its fault state.",
                    ~state("FAULT") & ~state.is_unused(), cover=kept, lemma=True)


def make(**parameters: int) -> _Board:
    """Make a board of its times."""
    return _Board(**parameters)


STOP = Component(
    make=make, describe=describe, depth=22,
    cases=(Case({"period": 9, "scan_bits": 3, "stop_period": 3, "debounce": 1, "z_travel": 2,
                 "side": 2}),
           Case({"period": 493_214, "scan_bits": 17, "stop_period": 500, "debounce": 500_000,
                 "z_travel": 1152, "side": 2560}, real=True)))
