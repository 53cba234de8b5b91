"""Contract of what the machine shows."""


from fresa.panel import Monitor

from .contract import Bits, Case, Component, Contract
from .display import watch_display

__all__ = ["MONITOR", "watch_leds"]


def watch_leds(c: Contract, *, mode: Bits, leds: Bits, jogging: Bits,
               coils: tuple[Bits, Bits, Bits]) -> None:
    """State what the LEDs show."""
    x, y, z = jogging
    c.implication("leds-dark", "In automatic mode the LEDs are dark.", when=mode, then=leds == 0)
    for name, moves, word in [
        ("x", x, coils[0]),
        ("y", ~x & y, coils[1]),
        ("z", ~x & ~y & z, coils[2]),
        ("rest", ~x & ~y & ~z, coils[0]),
    ]:
        c.implication(f"leds-{name}", "At rest the LEDs show the coils of x." if name == "rest" else
                      f"The LEDs show the coils of {name} while it is the first that is jogged.",
                      when=~mode & moves, then=leds == word)


def describe(c: Contract, dut: Monitor) -> None:
    """LEDs in manual mode, the count in automatic mode."""
    watch_leds(c, mode=dut.mode, leds=dut.leds, jogging=dut.jogging,
               coils=(dut.axis_x, dut.axis_y, dut.axis_z))
    watch_display(c, "display", segments=dut.segments, digits=dut.digits, value=dut.count,
                  enable=dut.mode)


MONITOR = Component(make=Monitor, describe=describe, depth=30,
                    cases=(Case({"scan_bits": 3}), Case({"scan_bits": 17}, real=True)))
