"""The positioner on a Nexys 2."""

from collections.abc import Mapping, Sequence

from amaranth import Cat, Elaboratable, Module, Signal
from amaranth.build import Attrs, Pins, PinsN, Resource
from amaranth.lib import io

from fresa.machines import Positioner
from fresa.machines.positioner import LIMIT_ENDS, PositionerTiming
from fresa.panel import Debouncer

from .nexys2 import request_ports
from .nexys2_common import debounce_period, drive_pins, synchronize, wire_clock

__all__ = ["Nexys2Positioner", "positioner_ports"]


def positioner_ports(platform) -> dict:
    """Request the pins from a Nexys 2, under the names that :class:`Nexys2Positioner` knows.

    STEP, DIR and ENABLE of X are JA1 to JA3, of Y JA7 to JA9, of Z JB1 to JB3; the buzzer is JB4.
    The limit inputs are JC1 to JC3. They are pulled up, and a switch, or its optocoupler, pulls
    them to ground. There is no pin for one line that all switches share: it would not say which
    axis is to stop.
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
    left open, which is full step, and its ENABLE is active low. Where an optocoupler inverts it,
    as on the board of the original, high gives power; where it is wired straight, low does.

    Parameters
    ----------
    ports : mapping of str to PortLike
        ``clk``; inputs ``rx``, ``reset`` (a button, active high) and ``limits`` (3); outputs
        ``tx``, ``buzzer``, ``leds`` (8, active high), and ``motor_x``, ``motor_y`` and
        ``motor_z``, each STEP, DIR, ENABLE.
    debounce : int, optional
        Clocks for which the button must be still.
    enable_low : bool
        ENABLE gives power where it is low.
    normally_closed : bool
        The limit switches are closed, and their pins low, until they are pressed; a wire that is
        broken counts as pressed.
    timing, inverted, backlash, limit_ends
        See :class:`Positioner`.
    """

    def __init__(
        self, ports: Mapping[str, io.PortLike], *, timing: PositionerTiming | None = None,
        debounce: int | None = None, inverted: bool = False, enable_low: bool = False,
        normally_closed: bool = False,
        backlash: Sequence[int] = (0, 0, 0), limit_ends: Sequence[str] = LIMIT_ENDS,
    ) -> None:
        self._ports = ports
        self._rest = 0b011 * inverted | 0b100 * enable_low  # of a motor, high at rest
        self._normally_closed = normally_closed
        self._machine = Positioner(timing=timing, inverted=inverted, backlash=backlash,
                                   limit_ends=limit_ends)
        self._debouncer = Debouncer(
            width=1, period=debounce_period() if debounce is None else debounce)

    def elaborate(self, platform) -> Module:
        m = Module()
        ports = self._ports

        # What comes in
        m.submodules.machine = machine = self._machine
        m.submodules.debouncer = debouncer = self._debouncer
        # The pin of a switch is high where it is open. Nothing, not even an inverter, comes before
        # the flip-flops.
        high = Signal(len(machine.limits))
        m.d.comb += machine.limits.eq(high if self._normally_closed else ~high)
        synchronize(m, "reset", ports["reset"], debouncer.i)
        synchronize(m, "limits", ~ports["limits"], high,
                    init=0 if self._normally_closed else (1 << len(high)) - 1)
        synchronize(m, "rx", ports["rx"], machine.rx, init=1)
        wire_clock(m, ports, debouncer.o)

        # What goes out
        m.submodules.leds = leds = io.Buffer("o", ports["leds"])
        m.d.comb += leds.o.eq(Cat(machine.moving, machine.limits, machine.fault,
                                  machine.connected))
        for index, axis in enumerate("xyz"):
            # The machine inverts STEP and DIR itself.
            pins = Cat(machine.step[index], machine.direction[index],
                       machine.enable[index] ^ (self._rest >> 2))
            drive_pins(m, f"motor_{axis}", ports[f"motor_{axis}"], pins, init=self._rest)
        drive_pins(m, "buzzer", ports["buzzer"], machine.buzzer, init=0)
        drive_pins(m, "tx", ports["tx"], machine.tx, init=1)

        return m
