"""Contract of the STEP, DIR and ENABLE pins."""

from amaranth import Cat, Mux

from fresa.drive import StepDirDriver

from .coil import watch_spacing
from .contract import Bits, Case, Component, Contract

__all__ = ["STEP_DIR", "watch_driver"]


def describe(c: Contract, dut: StepDirDriver) -> None:
    """The times of a driver module hold for every input, and each pulse is counted once."""
    watch_driver(c, dut)


def watch_driver(c: Contract, dut: StepDirDriver, *, path: str = "") -> None:
    """State that of a driver at any place of a component; `path` is that of its inside.

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

    width: Bits | int = dut.width  # of the pulse that has begun last
    if dut.adjustable:
        width = c.keep(range(dut.width + 1), init=dut.width, name="width_of_it")
        c.assume((dut.width_now >= 1) & (dut.width_now <= dut.width))
        with c.m.If(dut.moved):
            c.m.d.sync += width.eq(dut.width_now)
        c.invariant("width", "A pulse has a time that was wanted.",
                    (width >= 1) & (width <= dut.width), cover=width != dut.width, lemma=True)
    pulses(c, dut, width, since, low, still, alone)
    c.implication("hold", "DIR and ENABLE change only while STEP is low, `hold` clocks after it "
                  "fell.", when=changed,
                  then=~c.past(dut.step_pin) & ~dut.step_pin & (c.past(low) >= dut.hold - 1))
    c.implication("direction-changes-with-step", "DIR changes only for a step, to its direction.",
                  when=dut.direction_pin != c.past(dut.direction_pin),
                  then=c.past(dut.step) & (dut.direction_pin == c.past(dut.direction)))
    c.implication("enable-as-requested", "ENABLE changes only to the requested level.",
                  when=dut.enable_pin != c.past(dut.enable_pin),
                  then=dut.enable_pin == c.past(dut.enable))
    c.invariant("starts-off", "All pins are low at power-up.",
                c.past(1) | ~(dut.step_pin | dut.direction_pin | dut.enable_pin), cover=~c.past(1))
    timer = c.signal(f"{path}wait")
    waiting(c, dut, width, since, low, still, Mux(timer[-1], timer, 0))


def pulses(c: Contract, dut: StepDirDriver, width: Bits | int, since: Bits, low: Bits,
           still: Bits, alone: bool) -> None:
    """State the timing of STEP, and of DIR and ENABLE before it."""
    c.invariant("pulse", "STEP is high for `width` clocks, or as many as `width_now` was in its "
                "clock, after each step that is made, whatever is requested meanwhile, and at no "
                "other time.",
                dut.step_pin == (since < width),
                cover=dut.step_pin)
    if alone:  # a rate that is slower sees to it by itself
        c.implication("low", "STEP was low for `low` clocks before it rises, also after power-up.",
                      when=dut.moved, then=~dut.step_pin & (low >= dut.low - 1))
    c.implication("setup", "DIR and ENABLE are stable for `setup` clocks before STEP rises.",
                  when=dut.moved, then=still >= dut.setup - 1)
    c.implication("direction-as-requested", "STEP rises only with DIR as requested, and with "
                  "ENABLE.",
                  when=dut.moved,
                  then=(dut.direction_pin == dut.direction) & dut.enable & dut.enable_pin)
    c.implication("step-only-on-request", "A step is made only where it is requested, and not in "
                  "a reset.",
                  when=dut.moved, then=dut.step & ~c.rst)
    c.implication("ready-implies-step", "When the driver is ready, a requested step is made.",
                  when=dut.ready & dut.step, then=dut.moved)


def waiting(c: Contract, dut: StepDirDriver, width: Bits | int, since: Bits, low: Bits,
            still: Bits, wait: Bits) -> None:
    """How long anything has to wait, and what the timer has to do with it."""
    high = dut.step_pin
    pause = max(dut.low, dut.hold)
    whole = max(dut.width + pause, dut.setup)
    left = -wait + Mux(high, pause, 0)  # clocks until all is over, after this
    c.invariant("timer-is-time-left", "The timer waits for the time that is left, no more and no "
                "less.",
                (wait <= 0) & (-wait < max(dut.width, pause, dut.setup)) & Mux(
                    high, (since < width) & (wait == since - (width - 1)),
                    (low - wait >= pause - 1) & (still - wait >= dut.setup - 1)), cover=wait == 0)
    wanted = (dut.enable != dut.enable_pin) & (dut.enable == c.past(dut.enable))
    differs = _count(c, wanted, whole, "wanted_for")
    c.invariant("enable-follows-in-time", "ENABLE follows the requested level within `width` and "
                "the longer of `low` and `hold`, or `setup` if that is longer.",
                ~wanted | (differs + 1 + left < whole), cover=wanted & (left == 0))
    right = (dut.direction_pin == dut.direction) & dut.enable_pin
    requested = (dut.step & dut.enable & ~c.rst & (dut.direction == c.past(dut.direction))
             & ~c.past(dut.moved))
    so_far = _count(c, requested, whole + dut.setup, "requested_for")
    c.invariant("made-in-time", "A step that stays requested is made, `setup` after all else at "
                "most.", ~requested | (so_far + left + Mux(right, 0,
                                                           dut.setup) < whole + dut.setup),
                cover=requested & dut.moved)


def _count(c: Contract, condition: Bits, most: int, name: str) -> Bits:
    """Return for how many clocks before this there was `condition`; at most `most`."""
    clocks = c.keep(range(most + 1), name=name)
    c.m.d.sync += clocks.eq(Mux(condition, clocks + (clocks < most), 0))
    return clocks


def _times(width: int, low: int, setup: int, hold: int) -> dict[str, object]:
    return {"width": width, "low": low, "setup": setup, "hold": hold}


STEP_DIR = Component(
    make=StepDirDriver, describe=describe, depth=16,
    cases=(Case({**_times(3, 4, 2, 3), "adjustable": True}),
           Case({**_times(2, 1, 1, 1), "adjustable": True}),
           Case({**_times(12_750, 50, 10, 10), "adjustable": True}, real=True),
           *(Case(_times(*times)) for times in [(2, 4, 2, 3), (2, 1, 2, 3), (1, 1, 4, 1),
                                                (1, 1, 1, 1)]),
           *(Case(_times(*times), real=True) for times in [(95, 95, 33, 33), (25, 25, 33, 33)])))
