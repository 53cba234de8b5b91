"""The positioner on a Nexys 2."""

from collections.abc import Mapping, Sequence

from amaranth import Cat, ClockDomain, ClockSignal, Elaboratable, Module, ResetSignal, Signal
from amaranth.build import Attrs, Pins, PinsN, Resource
from amaranth.lib import io
from amaranth.lib.cdc import FFSynchronizer

from fresa.machines import Positioner
from fresa.machines.positioner import GUARDS, PositionerPace
from fresa.panel import Debouncer

from .nexys2 import request_ports
from .nexys2_mill import debounce_period

__all__ = ["Nexys2Positioner", "positioner_ports"]


def positioner_ports(platform) -> dict:
    """Request the pins from a Nexys 2, under the names that :class:`Nexys2Positioner` knows.

    STEP, DIR and ENABLE of X are JA1 to JA3, of Y JA7 to JA9, of Z JB1 to JB3; the buzzer is JB4.
    The limit inputs are JC1 to JC3. They are pulled up, and a switch, or its optocoupler, pulls
    them to ground.
    """
    out = Attrs(IOSTANDARD="LVCMOS33")
    platform.add_resources([
        *(Resource("motor", index, Pins(pins, dir="o", conn=("pmod", pmod)), out)
          for index, (pmod, pins) in enumerate([(0, "1 2 3"), (0, "7 8 9"), (1, "1 2 3")])),
        Resource("buzzer", 0, Pins("4", dir="o", conn=("pmod", 1)), out),
        Resource("limits", 0, PinsN("1 2 3", dir="i", conn=("pmod", 2)),
                 Attrs(IOSTANDARD="LVCMOS33", PULLUP="TRUE")),
    ])
    ports = request_ports(platform, {
        "clk": "clk50", "uart": "uart", "reset": ("button", 0), "limits": "limits",
        "leds": [("led", index) for index in range(8)], "buzzer": "buzzer",
        **{f"motor_{name}": ("motor", index) for index, name in enumerate("xyz")},
    })
    uart = ports.pop("uart")
    return {**ports, "rx": uart.rx, "tx": uart.tx}


class Nexys2Positioner(Elaboratable):
    """The positioner and the pins of a Nexys 2.

    It requests no pin: it is given ports, of a board or of a simulation.

    ===============  ==============================================================
    BTN0             reset: ends movement, forgets points; this place is (0, 0, 0)
    LD0 to LD2       motor 1 to 3 moves
    LD3 to LD5       limit input 1 to 3 is on
    LD6              a register was upset: nothing moves until reset
    LD7              connected
    ===============  ==============================================================

    Every input goes through two flip-flops, and the button through a debouncer; the machine lets
    the limit inputs settle itself. What goes to the motors, the buzzer and the line comes from
    flip-flops in the I/O blocks, a clock after the machine's own. The DRV8825's MODE inputs are
    left open, which is full step, and its ENABLE is active low: like STEP and DIR it goes through
    an inverting optocoupler on the board of the original, where high gives power.

    Parameters
    ----------
    ports : mapping of str to PortLike
        ``clk``; inputs ``rx``, ``reset`` (a button, active high) and ``limits`` (3); outputs
        ``tx``, ``buzzer``, ``leds`` (8, active high), and ``motor_x``, ``motor_y`` and
        ``motor_z``, each STEP, DIR, ENABLE.
    debounce : int, optional
        Clocks for which the button must be still.
    pace, inverted, backlash, guards
        See :class:`Positioner`.
    """

    def __init__(
        self, ports: Mapping[str, io.PortLike], *, pace: PositionerPace | None = None,
        debounce: int | None = None, inverted: bool = False,
        backlash: Sequence[int] = (0, 0, 0), guards: Sequence[str] = GUARDS,
    ) -> None:
        self._ports = ports
        self._inverted = inverted
        self._machine = Positioner(pace=pace, inverted=inverted, backlash=backlash, guards=guards)
        self._debouncer = Debouncer(
            width=1, period=debounce_period() if debounce is None else debounce)

    def elaborate(self, platform) -> Module:
        m = Module()
        ports = self._ports

        m.domains.sync = ClockDomain()
        m.submodules.clk = clk = io.Buffer("i", ports["clk"])
        m.d.comb += ClockSignal().eq(clk.i)

        # What comes in
        m.submodules.machine = machine = self._machine
        m.submodules.debouncer = debouncer = self._debouncer
        for name, inside, idle in [("reset", debouncer.i, 0), ("limits", machine.limits, 0),
                                   ("rx", machine.rx, 1)]:
            m.submodules[name] = buffer = io.Buffer("i", ports[name])
            m.submodules[f"{name}_synchronizer"] = FFSynchronizer(buffer.i, inside, init=idle)
        m.d.comb += ResetSignal().eq(debouncer.o)

        # What goes out
        m.submodules.leds = leds = io.Buffer("o", ports["leds"])
        m.d.comb += leds.o.eq(Cat(machine.moving, machine.limits, machine.fault,
                                  machine.connected))
        off = 0b011 if self._inverted else 0
        for name, value, idle in [
            *((f"motor_{axis}", Cat(machine.step[index], machine.direction[index],
                                    machine.enable[index]), off)
              for index, axis in enumerate("xyz")),
            ("buzzer", machine.buzzer, 0), ("tx", machine.tx, 1),
        ]:
            m.submodules[name] = buffer = io.Buffer("o", ports[name])
            pins = Signal(len(value), name=f"{name}_pins", init=idle, reset_less=True,
                          attrs={"IOB": "TRUE"})
            m.d.sync += pins.eq(value)
            m.d.comb += buffer.o.eq(pins)

        return m
