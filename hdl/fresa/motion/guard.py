"""Two controllers that watch each other."""

from amaranth import Cat, Fragment, Module, ResetSignal, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from .controller import NumericalController

__all__ = ["GuardedController"]


class GuardedController(wiring.Component):
    """Duplication with comparison: two :class:`NumericalController`, one of which drives no motor.

    Both get the same inputs and behave alike unless a flip-flop of one of them is upset. Every
    clock compares the positions, the difference of the phases, ``ready`` and ``error``. So a step
    too many, too few or at the wrong time differs in the clock in which it is made, and a wrong
    count at once. One clock later no further step is made and ``error`` is set, until a reset.
    Manual mode does not clear it.

    A reset clears it only if the error was set before, in a clock without reset: an upset during a
    reset, or in the clock before, still shows after it. Since a reset moves no motor, the coil
    words need not agree after it: their difference must not change. Keep ``start`` low during that
    reset, and wait a period after the last step: these registers are not reset, and may still
    differ; then the error is set once more.

    Synthesis merges registers that it finds to be equivalent. So those of the second controller are
    marked to be kept. It is stopped a clock later than the first, so that the registers that hold
    the stop are not equivalent either.

    Parameters and members are those of :class:`NumericalController`.
    """

    def __init__(self, *, period: int, z_travel: int, jog_period: int = 1) -> None:
        self.main, self.shadow = (
            NumericalController(period=period, z_travel=z_travel, jog_period=jog_period)
            for _ in range(2))
        super().__init__(self.main.signature)

    def elaborate(self, platform) -> Module:
        m = Module()

        main, shadow = self.main, self.shadow
        m.submodules.main = Fragment.get(main, platform)
        m.submodules.shadow = fragment = Fragment.get(shadow, platform)
        _keep(fragment)

        fault = Signal(reset_less=True)
        seen = Signal(reset_less=True)
        m.d.comb += [
            main.stop.eq(self.stop | fault),
            shadow.stop.eq(self.stop | seen),
            self.error.eq(main.error | fault),
        ]
        for name, member in self.signature.members.items():
            if member.flow is Out and name != "error":
                m.d.comb += getattr(self, name).eq(getattr(main, name))
            elif member.flow is In and name != "stop":
                m.d.comb += [getattr(one, name).eq(getattr(self, name)) for one in (main, shadow)]

        differ = [main.ready != shadow.ready, main.error != shadow.error]
        for name in "xyz":
            apart = Signal(2, name=f"apart_{name}")
            before = Signal(2, name=f"apart_{name}_before", reset_less=True)
            phases = [_phase(getattr(one, f"axis_{name}")) for one in (main, shadow)]
            m.d.comb += apart.eq(phases[0] - phases[1])
            m.d.sync += before.eq(apart)
            here, there = (getattr(one.automatic, f"at_{name}") for one in (main, shadow))
            differ += [apart != before, here != there]

        m.d.sync += [
            fault.eq((Cat(differ).any() | fault) & ~(ResetSignal() & seen)),
            seen.eq(fault & ~ResetSignal()),
        ]

        return m


def _phase(coils) -> Value:
    """Return the row of table 1, from 0, that a coil word is."""
    orange, black = coils[2], coils[3]
    return Value.cast(Cat(black ^ ~orange, black))


def _keep(fragment: Fragment) -> None:
    """Mark all registers in a fragment: ``equivalent_register_removal`` is for XST."""
    for domain, statements in fragment.statements.items():
        if domain != "comb":
            for register in statements._lhs_signals():
                register.attrs.update(keep="true", equivalent_register_removal="no")
    for inside, _, _ in fragment.subfragments:
        _keep(inside)
