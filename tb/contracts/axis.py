"""Contract of an axis: everything between a target and the pins of a driver module."""

from amaranth import Mux, signed

from fresa.drive import StepDirDriver
from fresa.motion import Axis

from .contract import Bits, Case, Component, Contract
from .rate import watch_spaced
from .step_dir import watch_driver

__all__ = ["AXIS"]


def describe(c: Contract, dut: Axis) -> None:
    """Steps at the pins are requested, and are counted."""
    driver, rate = c.part("driver"), c.part("rate")
    target = (~dut.target_n).as_signed()
    moved, wants, up = dut.moved, c.signal("wants"), c.signal("up")
    towards = Mux(up, dut.high, dut.low)
    rises = dut.step_pin & ~c.past(dut.step_pin)
    c.invariant("compared-before", "A step is wanted, and its direction is, by position and target "
                "of the clock before, in which there were `run`, no load and no step.",
                (wants == c.past(dut.run & ~dut.load & ~moved & (dut.position != target) & ~c.rst))
                & (up == c.past((target >= dut.position) & ~c.rst)), cover=wants)
    c.implication("position-stays-before-step", "Where a step is wanted the position is that of "
                  "the clock before.", when=wants, then=dut.position == c.past(dut.position))
    c.invariant("one-pulse-per-step", "STEP rises in the clock after a step is made, and at no "
                "other time.", rises == c.past(moved), cover=rises)
    c.implication("step-only-toward-target", "A step is made only towards the target of the clock "
                  "before: with `run`, without a load, and not from the target.", when=moved,
                  then=dut.run & ~dut.load & c.past(dut.run & (dut.position != target))
                  & (dut.position == c.past(dut.position)))
    c.invariant("in-position", "`in_position` is 1 where the position is the target, and only "
                "there.", dut.in_position == (dut.position == target), cover=dut.in_position)
    c.implication("direction-toward-target", "STEP rises with DIR as the target was, seen from the "
                  "position.", when=rises,
                  then=dut.direction_pin == c.past(c.past(target > dut.position)))
    c.implication("step-only-enabled", "STEP rises only with ENABLE, where it was requested.",
                  when=rises,
                  then=dut.enable_pin & c.past(dut.enable))
    c.implication("limit-blocks", "No step is made towards a switch that is on.",
                  when=rises, then=~c.past(Mux(c.past(target > dut.position), dut.high, dut.low)))
    due = wants & dut.run & ~dut.load & rate.due
    c.implication("other-steps-pass", "A step that is due is made when the driver is ready, unless "
                  "the switch in its direction is on.",
                  when=due & driver.ready & ~towards, then=moved & ~dut.limit_hit)
    c.implication("limit-hit-excludes-step", "`limit_hit` and a step exclude each other, and a "
                  "step is made only when due.", when=dut.limit_hit | moved,
                  then=~(dut.limit_hit & moved) & (rate.due | ~moved))
    c.implication("limit-hit-when-due", "A step that a switch blocks is reported when it is due, "
                  "if it leads towards the present target, too.",
                  when=due & towards & Mux(up, target > dut.position, target < dut.position),
                  then=dut.limit_hit)
    c.implication("limit-hit-only-ahead", "A switch is reported only if the target is behind it.",
                  when=dut.limit_hit, then=dut.run & ~dut.load & Mux(
                      target > dut.position, dut.high, dut.low) & ~dut.in_position)
    _position(c, dut, moved, up)
    watch_driver(c, driver, path="driver.")
    accumulator = c.signal("rate.accumulator")
    c.invariant("accumulator-in-range", "The accumulator of the rate is in its range.",
                (accumulator >= -dut.modulus) & (accumulator < dut.max_rate),
                cover=accumulator >= 0)
    watch_spaced(c, rate, accumulator + dut.modulus)


def _position(c: Contract, dut: Axis, moved: Bits, up: Bits) -> None:
    """The relation of the position and the pulses."""
    was, up_then = c.past(dut.position), c.past(up)
    change = dut.position - was
    kept = c.past(c.rst | dut.load)
    c.implication("position-changes-with-step", "The position changes only by a step that was "
                  "made, by one, in its direction; by a load; and by a reset.",
                  when=(change != 0) & ~kept,
                  then=c.past(moved) & (change == Mux(up_then, 1, -1)))
    c.implication("load", "A load sets the position.",
                  when=c.past(dut.load & ~c.rst), then=dut.position == c.past(dut.place))

    # A motor, by the pulses, and its load, by the position, with the backlash between them.
    first = c.keep(dut.backlash.shape(), name="first_backlash")
    steady = c.keep(1, init=1, name="steady")
    is_steady = steady & ((dut.backlash == first) | ~c.past(1))
    c.m.d.sync += [first.eq(dut.backlash), steady.eq(is_steady)]
    gap = c.keep(signed(len(dut.backlash) + 2), name="gap")  # motor - load, before the last step
    turned = Mux(c.past(moved), Mux(up_then, 1, -1), 0)
    counted = Mux(kept & ~c.past(dut.load & ~c.rst) | c.past(dut.load), 0, change)
    lost = c.past(c.rst & moved)  # no step is made in a reset
    now = gap + turned - counted
    c.m.d.sync += gap.eq(now)
    way, left = c.signal("backlash.way"), c.signal("backlash.left")
    c.implication("within-the-backlash", "The pulses and the position never differ by more "
                  "than the backlash, at any time: without backlash they are the same.",
                  when=is_steady, then=(now >= 0) & (now <= dut.backlash) & ~lost)
    c.implication("backlash-is-remaining", "What is left of the backlash is what is missing to "
                  "its end.",
                  when=is_steady, then=(left <= dut.backlash) & (now == Mux(way,
                                                                            dut.backlash - left,
                                                                            left)))


def make(*, times: tuple[int, int, int, int], **parameters: int) -> Axis:
    """Make an axis with a driver module of these times."""
    names = ("width", "low", "setup", "hold")
    return Axis(driver=StepDirDriver(**dict(zip(names, times, strict=True))),
                width=parameters.pop("bits"), **parameters)


AXIS = Component(
    make=make, describe=describe, depth=22,
    cases=(Case({"times": (2, 3, 2, 3), "modulus": 15, "max_rate": 2, "max_backlash": 3,
                 "bits": 4}),
           Case({"times": (1, 1, 1, 1), "modulus": 5, "max_rate": 2, "max_backlash": 1,
                 "bits": 3}),
           Case({"times": (95, 95, 33, 33), "modulus": 50_000_000, "max_rate": 1500,
                 "max_backlash": 1023, "bits": 32}, real=True),
           Case({"times": (95, 95, 33, 33), "modulus": 50_000_000, "max_rate": 2047,
                 "max_backlash": 1, "bits": 32}, real=True)))
