"""Contract of the switches at the ends of axes."""

from amaranth import Cat, Const, Mux

from fresa.motion import Limits

from .contract import Bits, Case, Component, Contract

__all__ = ["LIMITS"]


def describe(c: Contract, dut: Limits) -> None:
    """A switch counts as on while it is pressed and until it has settled, each by itself."""
    count = c.signal("divider.count") + dut.period - 1 if dut.period > 1 else Const(0)
    if dut.period > 1:
        c.invariant("count-in-range", "The divider counts from 1 - period up to 0.",
                    (count >= 0) & (count < dut.period), cover=count == 0)
    switches: Bits = Cat(dut.low, dut.high)
    on: Bits = Cat(dut.at_low, dut.at_high)
    c.implication("on-at-once", "A switch counts as on from the clock in which it is seen.",
                  when=switches, then=~(switches & ~on).any())
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
           Case({"axes": 3, "period": 500_000}, real=True)))
