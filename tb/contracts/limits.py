"""Contract of the switches at the ends of axes."""

from amaranth import Cat, Const, Mux

from fresa.drive import divider
from fresa.motion import Limits, limits

from .contract import Bits, Bug, Case, Component, Contract

__all__ = ["LIMITS"]

GATE = "self.direction & self.at_high | ~self.direction & self.at_low"
ON = "on | since | before"


def describe(c: Contract, dut: Limits) -> None:
    """What leads to a switch that is on is blocked, and nothing else, of each axis by itself."""
    up, down = dut.step & dut.direction, dut.step & ~dut.direction
    swapped = Bug(limits, GATE, "self.direction & self.at_low | ~self.direction & self.at_high")
    both = Bug(limits, GATE, "self.at_high | self.at_low")
    c.holds("high-blocks", "No step up is let out while the high switch is pressed, from the clock "
            "in which it is seen.", when=up & dut.high, then=~(dut.allowed & up & dut.high).any(),
            bug=(swapped, Bug(limits, ON, "since | before")))
    c.holds("low-blocks", "No step down is let out while the low switch is pressed, from the clock "
            "in which it is seen.", when=down & dut.low, then=~(dut.allowed & down & dut.low).any(),
            bug=(swapped, Bug(limits, GATE, "self.direction & self.at_high")))
    c.holds("the-others-are-free", "A step is let out unless the switch ahead of it is on, "
            "whatever the others are.", when=up & ~dut.at_high | down & ~dut.at_low,
            then=~((up & ~dut.at_high | down & ~dut.at_low) & ~dut.allowed).any(),
            bug=(both, Bug(limits, GATE, f"({GATE}).any().replicate(self.axes)")))
    c.holds("asked", "What is not asked for is not let out.", when=~dut.step,
            then=~(dut.allowed & ~dut.step).any(), bug=Bug(limits, "self.step & ~(", "~("))

    count = c.signal("divider.count") + dut.period - 1 if dut.period > 1 else Const(0)
    if dut.period > 1:
        c.always("count-in-range", "The divider counts from 1 - period up to 0.",
                 (count >= 0) & (count < dut.period), seen=count == 0,
                 bug=Bug(divider, "with m.If(self.tick | self.clear):", "with m.If(self.clear):"))
    switches: Bits = Cat(dut.low, dut.high)
    on: Bits = Cat(dut.at_low, dut.at_high)
    longest = 2 * dut.period
    settled, let_go, marked = [], [], []
    for bit, (switch, since, before) in enumerate(
            zip(switches, c.signal("since"), c.signal("before"), strict=True)):
        off = c.keep(range(longest + 1), init=longest, name=f"off_{bit}")  # clocks, before this
        c.m.d.sync += off.eq(Mux(switch, 0, off + (off < longest)))
        settled.append(~(switch | (off < dut.period)) | on[bit])
        let_go.append(switch | (off < longest - 1) | ~on[bit])
        marked.append((since & before & (off < count)) | (
            (since == (off < count)) & (before == ((off >= count) & (off < count + dut.period)))))
    c.holds("settles", "A switch counts as on for `period` clocks after it was, at least.",
            when=c.past(switches) & ~switches, then=_all(settled),
            bug=(Bug(limits, "before.eq(since | on)", "before.eq(since)"), Bug(
                limits, "before = Signal.like(on, reset_less=True)", "before = Signal.like(on)")))
    c.holds("lets-go", "A switch counts as off when it was for two periods.",
            when=~switches & on, then=_all(let_go),
            bug=Bug(limits, "before.eq(since | on)", "before.eq(since | on | before)"))
    c.always("marks-are-times", "The marks of each switch say between which ticks it was on.",
             _all(marked), seen=c.signal("before"),
             bug=Bug(limits, "since.eq(since | on)", "since.eq(since | on | before)")
             if dut.period > 1 else Bug(limits, "before.eq(since | on)", "before.eq(~on)"))


def _all(values: list[Bits]) -> Bits:
    return Cat(values).all()


LIMITS = Component(
    make=Limits, describe=describe, depth=12,
    cases=(*(Case({"axes": 2, "period": period}) for period in (3, 2, 1)),
           Case({"axes": 1, "period": 500_000}, real=True)))
