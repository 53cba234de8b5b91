# amaranth: UnusedElaboratable=no
# pyright: reportInvalidTypeForm=false

"""The wiring, on a machine whose roles no real one has yet."""

import pytest
from amaranth import Module, Signal
from amaranth.lib import io
from amaranth.lib.wiring import In, Out

from fresa.roles import BUTTON, DIRECTION, LIMIT, RX, STATUS, STEP, STOP, MachineComponent
from fresa_boards.board import Allotment
from fresa_boards.nexys2 import NEXYS2_500
from fresa_boards.wiring import check_names, simulation_ports, wire
from tb.design import Design
from tb.engines import AmaranthEngine

pytestmark = pytest.mark.usefixtures("unused")


class Wires(MachineComponent):
    """Outputs that are inputs."""

    stop: In(1)
    limits: In(2)
    line: In(1)
    step: Out(2)
    direction: Out(1)
    lights: Out(3)

    roles = {"stop": BUTTON, "limits": LIMIT, "line": RX, "step": STEP.resting(0b01),
             "direction": DIRECTION, "lights": STATUS}

    def elaborate(self, platform) -> Module:
        m = Module()
        m.d.comb += [self.step.eq(self.limits), self.direction.eq(self.line),
                     self.lights[0].eq(self.stop), self.lights[2].eq(1)]
        return m


ALLOTMENT = Allotment(header={"limits": "JA1 JA2", "step": "JA3 JA4", "direction": "JA7"},
                      panel={"buttons": "- stop", "rx": "line", "leds": "lights - limits"})
OUTPUTS = ["step", "direction", "leds"]


def engine(allotment=ALLOTMENT, *, machine: Wires | None = None, low: tuple[str, ...] = (),
           **options) -> AmaranthEngine:
    """Run the machine; `low` are pins that the board has inverted."""
    machine = machine or Wires()
    ports = {name: ~port if name in low else port
             for name, port in simulation_ports(NEXYS2_500, machine, allotment).items()}
    top = wire(machine, ports, allotment, clock=50_000_000, debounce=2, **options)
    inputs = {name: port.i for name, port in ports.items() if port.direction is io.Direction.Input}
    return AmaranthEngine(Design(
        "wires", top, inputs.pop("clk"), inputs,
        {name: port.o for name, port in ports.items() if port.direction is io.Direction.Output}))


class TestLevels:
    def test_at_rest_from_the_first_clock_on(self):
        with engine() as it:
            seen = it.apply({"limits": [0b11] * 4, "rx": [1] * 4, "buttons": [0] * 4}, OUTPUTS)
        assert seen["step"].tolist() == [1, 0, 0, 0]  # at rest, then as the machine says
        assert seen["direction"].tolist() == [0, 1, 1, 1]  # the line is high before its pin is seen
        assert set(seen["leds"]) == {0b000100}

    def test_an_input_comes_two_clocks_later_and_an_output_three(self):
        with engine() as it:
            seen = it.apply({"limits": [0b10] + [0b11] * 7, "rx": [1] * 8}, OUTPUTS)
        assert seen["leds"].tolist() == [4, 4, 4 + 16, 4, 4, 4, 4, 4]
        assert seen["step"].tolist() == [1, 0, 0, 1, 0, 0, 0, 0]

    def test_a_contact_passes_the_debouncer(self):
        with engine() as it:
            bounce = it.apply({"buttons": [2] + [0] * 11, "limits": [3] * 12, "rx": [1] * 12},
                              OUTPUTS)
            held = it.apply({"buttons": [2] * 12, "limits": [3] * 12, "rx": [1] * 12}, OUTPUTS)
        assert not (bounce["leds"] & 1).any() and held["leds"][-1] & 1

    def test_a_contact_whose_role_has_no_bounces_passes_the_debouncer_by(self):
        class Fast(Wires):
            roles = {**Wires.roles, "line": STOP}

        allotment = Allotment(header=ALLOTMENT.header,
                              panel={"buttons": "line stop", "leds": "lights"})
        with engine(allotment, machine=Fast()) as it:
            seen = it.apply({"limits": [3] * 12, "buttons": [0, 3] + [0] * 10}, OUTPUTS)
            held = it.apply({"limits": [3] * 12, "buttons": [2] * 12}, OUTPUTS)
        assert seen["direction"].tolist() == [0] * 4 + [1] + [0] * 7
        assert not (seen["leds"] & 1).any() and held["leds"][-1] & 1
        ports = simulation_ports(NEXYS2_500, Fast(), allotment)
        names = check_names(Fast(), ports, allotment)
        assert (names["line"], names["stop"]) == ("buttons[0]", "debouncer.o")

    def test_pins_that_are_on_at_the_other_level(self):
        with engine(inverted=("limits", "step")) as it:
            seen = it.apply({"limits": [0b01] * 8, "rx": [1] * 8}, OUTPUTS)
        assert seen["step"].tolist() == [0b10, 0b11, 0b11] + [0b10] * 5
        assert seen["leds"].tolist() == [4, 4] + [4 + 16] * 6  # a LED is not turned with its pin

    def test_a_board_whose_buttons_and_leds_are_low(self):
        with engine(low=("buttons", "leds")) as it:
            seen = it.apply({"buttons": [3] * 12, "limits": [3] * 12, "rx": [1] * 12}, ["leds"])
            pressed = it.apply({"buttons": [1] * 12, "limits": [3] * 12, "rx": [1] * 12}, ["leds"])
        assert set(seen["leds"]) == {0b111011} and pressed["leds"][-1] == 0b111010


def test_where_checks_find_the_bits_of_a_machine():
    """A contact on a header behind the debouncer; what a LED shows too on its own pin."""
    machine = Wires()
    allotment = Allotment(
        header={"stop": "JA10", "limits": "JA1 JA2", "step": "JA3 JA4", "direction": "JA7"},
        panel={"switches": "-", "rx": "line", "leds": "stop limits lights"})
    names = check_names(machine, simulation_ports(NEXYS2_500, machine, allotment), allotment)
    assert names == {
        "stop": "debouncer.o", "limits[0]": "limits[0]", "limits[1]": "limits[1]",
        "step[0]": "step[0]", "step[1]": "step[1]", "direction": "direction", "line": "rx",
        **{f"lights[{bit}]": f"leds[{bit + 3}]" for bit in range(3)}}
    allotment = Allotment(header={**ALLOTMENT.header, "step": "JA3 JA4"},
                          panel={"buttons": "- stop", "rx": "line", "leds": "step lights"})
    names = check_names(machine, simulation_ports(NEXYS2_500, machine, allotment), allotment)
    assert names["stop"] == "debouncer.level[1]" and names["step[1]"] == "step[1]"


def test_no_pins_for_a_machine():
    with pytest.raises(ValueError, match=r"^nexys2-500 has no pins allotted to lathe$"):
        NEXYS2_500.allotment("lathe")


class TestRoles:
    def test_an_input_without_a_pin_stays_at_rest(self):
        class Quiet(Wires):
            roles = {**Wires.roles, "line": STATUS.resting(1)}

        machine = Quiet()
        allotment = Allotment(header=ALLOTMENT.header, panel={"buttons": "- stop"})
        ports = simulation_ports(NEXYS2_500, machine, allotment)
        top = wire(machine, ports, allotment, clock=50_000_000, debounce=2)
        design = Design("quiet", top, ports["clk"].i, {"limits": ports["limits"].i},
                        {"direction": ports["direction"].o})
        with AmaranthEngine(design) as it:
            assert it.apply({"limits": [3] * 3}, ["direction"])["direction"].tolist() == [0, 1, 1]

    def test_an_input_without_a_pin_is_as_the_allotment_has_it(self):
        machine = Wires()
        allotment = Allotment(header={**ALLOTMENT.header, "limits": "JA1 JA2"},
                              panel={"leds": "lights"}, constant={"stop": 1, "line": 0})
        with engine(allotment, machine=machine) as it:
            seen = it.apply({"limits": [3] * 4}, ["direction", "leds"])
        assert seen["direction"].tolist() == [0] * 4 and set(seen["leds"]) == {0b101}


class TestStartUp:
    @pytest.mark.parametrize("clocks", [1, 7, 8])
    def test_reset_ends_after_so_many_clocks_and_never_comes_back(self, clocks):
        class Counter(Wires):
            def elaborate(self, platform) -> Module:
                m = Module()
                ran = Signal(3)
                m.d.sync += ran.eq(ran | 1)
                m.d.comb += self.lights.eq(ran)
                return m

        with engine(machine=Counter(), start_up=clocks) as it:
            seen = it.apply({"limits": [3] * 60}, ["leds"])
        assert seen["leds"].tolist() == [0] * (clocks + 1) + [1] * (59 - clocks)
