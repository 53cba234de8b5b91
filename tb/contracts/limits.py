"""Contract of the switches at the ends of axes."""

from amaranth import Cat, Const, Mux

from fresa.motion import Limits

from .contract import Bits, Case, Component, Contract

__all__ = ["LIMITS"]


def describe(c: Contract, dut: Limits) -> None:
    """A step towards a pressed switch is blocked, and no other, independently for each axis."""
    up, down = dut.step & dut.direction, dut.step & ~dut.direction
    c.implication("high-blocks", "No step up passes while the high switch is pressed, from the "
                  "clock in which it is seen.", when=up & dut.high,
                  then=~(dut.allowed & up & dut.high).any())
    c.implication("low-blocks", "No step down passes while the low switch is pressed, from the "
                  "clock in which it is seen.", when=down & dut.low,
                  then=~(dut.allowed & down & dut.low).any())
    c.implication("other-steps-pass", "A step passes unless the switch in its direction is on, "
                  "independently of the others.", when=up & ~dut.at_high | down & ~dut.at_low,
                  then=~((up & ~dut.at_high | down & ~dut.at_low) & ~dut.allowed).any())
    c.implication("step-only-on-request", "A step that is not requested does not pass.",
                  when=~dut.step,
                  then=~(dut.allowed & ~dut.step).any())

    count = c.signal("divider.count") + dut.period - 1 if dut.period > 1 else Const(0)
    if dut.period > 1:
        c.invariant("count-in-range", "The divider counts from 1 - period up to 0.",
                    (count >= 0) & (count < dut.period), cover=count == 0)
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
    c.implication("on-for-period", "A switch counts as on for at least `period` clocks after it "
                  "opens.",
                  when=c.past(switches) & ~switches, then=_all(settled))
    c.implication("off-after-two-periods", "A switch counts as off two periods after it opened.",
                  when=~switches & on, then=_all(let_go))
    c.invariant("marks-are-times", "The marks of a switch give the ticks between which it was on.",
                _all(marked), cover=c.signal("before"))


def _all(values: list[Bits]) -> Bits:
    return Cat(values).all()


LIMITS = Component(
    make=Limits, describe=describe, depth=12,
    cases=(*(Case({"axes": 2, "period": period}) for period in (3, 2, 1)),
           Case({"axes": 1, "period": 500_000}, real=True)))
