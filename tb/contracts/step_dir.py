"""Contract of the STEP, DIR and ENABLE pins."""

from amaranth import Cat, Mux

from fresa.drive import StepDirDriver, step_dir

from .coil import watch_spacing
from .contract import Bits, Bug, Case, Component, Contract

__all__ = ["STEP_DIR", "watch_driver"]

READY = "over & ~high & right & power & ~ResetSignal()"
RIGHT = "(sense == self.direction) & (power == self.enable)"
PAUSE = "pause = max(self.low, self.hold)"
TURNS = "(power != self.enable) | (self.step & ~right)"


def describe(c: Contract, dut: StepDirDriver) -> None:
    """The times of a driver module hold for every input, and each pulse is counted once."""
    watch_driver(c, dut)


def watch_driver(c: Contract, dut: StepDirDriver, *, path: str = "") -> None:
    """Promise that of a driver at any place of a component; `path` is that of its inside.

    What the rest of the component never asks for shows no mistake: of those the driver alone has
    them.
    """
    alone = not path
    pause = max(dut.low, dut.hold)
    since = watch_spacing(c, dut.moved, dut.width, "since_rise")  # clocks since STEP rose
    low = _count(c, ~dut.step_pin, pause, "low_for")  # clocks before this for which it is low
    levels = Cat(dut.direction_pin, dut.enable_pin)
    changed = levels != c.past(levels)
    before = c.keep(range(dut.setup + 1), name="still_before")
    still = Mux(changed, 0, before)  # clocks before this for which DIR and ENABLE are as now
    c.m.d.sync += before.eq(Mux(still < dut.setup, still + 1, still))

    pulses(c, dut, since, low, still, alone)
    c.holds("hold", "DIR and ENABLE change only while STEP is low, `hold` clocks after it fell.",
            when=changed, then=~c.past(dut.step_pin) & ~dut.step_pin
            & (c.past(low) >= dut.hold - 1),
            bug=(Bug(step_dir, PAUSE, "pause = 1"),
                 Bug(step_dir, "with m.Elif(high):\n", "with m.Elif(high & right):\n")))
    c.holds("turns-for-a-step", "DIR changes only for a step, to its direction.",
            when=dut.direction_pin != c.past(dut.direction_pin),
            then=c.past(dut.step) & (dut.direction_pin == c.past(dut.direction)),
            bug=(Bug(step_dir, "with m.If(self.step):", "if True:"),
                 Bug(step_dir, "sense = Signal(reset_less=True)", "sense = Signal()")))
    c.holds("power-as-asked", "ENABLE changes only to what is asked for.",
            when=dut.enable_pin != c.past(dut.enable_pin),
            then=dut.enable_pin == c.past(dut.enable),
            bug=(Bug(step_dir, "power.eq(self.enable)", "power.eq(~power)"),
                 Bug(step_dir, "power = Signal(reset_less=True)", "power = Signal()")))
    c.always("starts-off", "All pins are low at power-up.",
             c.past(1) | ~(dut.step_pin | dut.direction_pin | dut.enable_pin), seen=~c.past(1),
             bug=Bug(step_dir, "power = Signal(reset_less=True)",
                     "power = Signal(reset_less=True, init=1)"))
    waiting(c, dut, since, low, still, c.signal(f"{path}wait"))


def pulses(c: Contract, dut: StepDirDriver, since: Bits, low: Bits, still: Bits, alone: bool
           ) -> None:
    """When STEP is high, and what has to be before."""
    c.always("pulse", "STEP is high for `width` clocks after each step that is made, whatever is "
             "asked meanwhile, and at no other time.", dut.step_pin == (since < dut.width),
             seen=dut.step_pin,
             bug=(Bug(step_dir, "wait.eq(1 - self.width)", "wait.eq(1 - self.width - 1)"),
                  Bug(step_dir, "high = Signal(reset_less=True)", "high = Signal()"),
                  *[Bug(step_dir, "self.step & self.ready", "self.step & over")] * alone))
    if alone:  # a rate that is slower sees to it by itself
        c.holds("low", "STEP was low for `low` clocks before it rises, also after power-up.",
                when=dut.moved, then=~dut.step_pin & (low >= dut.low - 1),
                bug=(Bug(step_dir, PAUSE, "pause = self.hold"),
                     Bug(step_dir, "init=1 - longest", "init=0"),
                     Bug(step_dir, READY, "over & right & power & ~ResetSignal()")))
    c.holds("setup", "DIR and ENABLE are as they are for `setup` clocks before STEP rises.",
            when=dut.moved, then=still >= dut.setup - 1,
            bug=Bug(step_dir, "wait.eq(1 - self.setup)", "wait.eq(-self.setup // 2 + 1)"))
    c.holds("right-way", "STEP rises only with DIR as asked for, and with ENABLE.",
            when=dut.moved,
            then=(dut.direction_pin == dut.direction) & dut.enable & dut.enable_pin,
            bug=(Bug(step_dir, RIGHT, "power == self.enable"),
                 Bug(step_dir, RIGHT, "sense == self.direction"),
                 Bug(step_dir, READY, "over & ~high & right & ~ResetSignal()")))
    c.holds("asked", "A step is made only where it is asked for, and not in a reset.",
            when=dut.moved, then=dut.step & ~c.rst,
            bug=(Bug(step_dir, "self.step & self.ready", "self.ready"),
                 Bug(step_dir, READY, "over & ~high & right & power")))
    c.holds("ready-is-kept", "When it is ready the step that is asked for is made.",
            when=dut.ready & dut.step, then=dut.moved,
            bug=Bug(step_dir, "self.step & self.ready", "self.step & self.ready & sense"))


def waiting(c: Contract, dut: StepDirDriver, since: Bits, low: Bits, still: Bits, wait: Bits
            ) -> None:
    """How long anything has to wait, and what the timer has to do with it."""
    high = dut.step_pin
    pause = max(dut.low, dut.hold)
    whole = max(dut.width + pause, dut.setup)
    left = -wait + Mux(high, pause, 0)  # clocks until all is over, after this
    c.always("timer-is-the-time", "The timer waits for no more than the times, and no less.",
             (wait <= 0) & (-wait < max(dut.width, pause, dut.setup)) & Mux(
                 high, (since < dut.width) & (wait == since - (dut.width - 1)),
                 (low - wait >= pause - 1) & (still - wait >= dut.setup - 1)), seen=wait == 0,
             bug=Bug(step_dir, "wait.eq(wait + 1)", "wait.eq(wait + 2)"))
    wanted = (dut.enable != dut.enable_pin) & (dut.enable == c.past(dut.enable))
    differs = _count(c, wanted, whole, "wanted_for")
    c.always("power-follows", "ENABLE follows what is asked for within `width` and the longer of "
             "`low` and `hold`, or `setup` if that is longer.",
             ~wanted | (differs + 1 + left < whole), seen=wanted & (left == 0),
             bug=Bug(step_dir, TURNS, "self.step & ~right"))
    right = (dut.direction_pin == dut.direction) & dut.enable_pin
    asked = (dut.step & dut.enable & ~c.rst & (dut.direction == c.past(dut.direction))
             & ~c.past(dut.moved))
    so_far = _count(c, asked, whole + dut.setup, "asked_for")
    c.always("made-in-time", "A step that stays asked for is made, `setup` after all else at most.",
             ~asked | (so_far + left + Mux(right, 0, dut.setup) < whole + dut.setup),
             seen=asked & dut.moved,
             bug=(Bug(step_dir, TURNS, "power != self.enable"),
                  Bug(step_dir, READY, "over & ~high & right & power & sense & ~ResetSignal()")))


def _count(c: Contract, condition: Bits, most: int, name: str) -> Bits:
    """Return for how many clocks before this there was `condition`; at most `most`."""
    clocks = c.keep(range(most + 1), name=name)
    c.m.d.sync += clocks.eq(Mux(condition, clocks + (clocks < most), 0))
    return clocks


def _times(width: int, low: int, setup: int, hold: int) -> dict[str, object]:
    return {"width": width, "low": low, "setup": setup, "hold": hold}


STEP_DIR = Component(
    make=StepDirDriver, describe=describe, depth=16,
    cases=(*(Case(_times(*times)) for times in [(2, 4, 2, 3), (2, 1, 2, 3), (1, 1, 4, 1),
                                                (1, 1, 1, 1)]),
           *(Case(_times(*times), real=True) for times in [(95, 95, 33, 33), (25, 25, 33, 33)])))
