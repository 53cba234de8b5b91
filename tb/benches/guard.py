"""Bench of the guard, with an upset flip-flop, which no pin of the machine can cause."""

from amaranth import Fragment, Module, Signal
from amaranth.lib import wiring

from fresa.motion import GuardedController

from ..bench import Run, bench
from ..plant import WORDS


class UpsetController(wiring.Component):
    """A guarded controller with its pins, and a register in it that a bench may upset.

    A netlist has no such register: so this is a component of its own, and mutants of the guard are
    for its contract alone.

    Attributes
    ----------
    register : Signal
        The counter of steps of X in the controller that drives the motors. It exists once this is
        elaborated.
    """

    def __init__(self, guard: GuardedController) -> None:
        self._guard = guard
        super().__init__(guard.signature)

    def elaborate(self, platform) -> Module:
        m = Module()
        m.submodules.guard = inside = Fragment.get(self._guard, platform)
        wiring.connect(m, wiring.flipped(self), self._guard)
        for part in ("main", "automatic", "x"):
            inside, = (fragment for fragment, name, _ in inside.subfragments if name == part)
        self.register: Signal
        self.register, = (signal for statements in inside.statements.values()
                          for signal in statements._lhs_signals() if signal.name == "count")
        return m


@bench
def guarded_controller(run: Run) -> str:
    """A bit of a count is upset: an error, and no step until a reset."""
    dut = UpsetController(GuardedController(period=3, z_travel=4))

    async def go(ctx, **order):
        ctx.set(dut.mode, 1)
        await run.until(ctx, dut, ready=1)
        ctx.set(dut.order, order)
        ctx.set(dut.start, 1)
        await run.until(ctx, dut, ready=0)
        ctx.set(dut.start, 0)

    async def stands(ctx, x, y, clocks):
        for _ in range(clocks):
            run.see(ctx, dut, error=1, axis_x=WORDS[x], axis_y=WORDS[y], axis_z=WORDS[0])
            await ctx.tick()

    async def test(ctx):
        await ctx.tick()
        ctx.set(dut.select, 1)
        await go(ctx, x=3, y=2)
        await run.until(ctx, dut, ready=1)
        run.see(ctx, dut, error=0, count=3, axis_x=WORDS[3], axis_y=WORDS[2])

        await go(ctx, x=9, y=2)
        await run.until(ctx, dut, count=5)
        run.see(ctx, dut, axis_x=WORDS[1])
        ctx.set(dut.register, 5 ^ 1 << 4)
        run.see(ctx, dut, error=0, count=21)
        await ctx.tick()
        await stands(ctx, 1, 2, 12)

        ctx.set(dut.mode, 0)
        ctx.set(dut.jog, 0b000001)
        await stands(ctx, 1, 2, 8)
        ctx.set(dut.jog, 0)

        ctx.set(run.rst, 1)
        await ctx.tick()
        ctx.set(run.rst, 0)
        run.see(ctx, dut, error=0, axis_x=WORDS[1], axis_y=WORDS[2])
        await go(ctx, x=2, y=0)
        await run.until(ctx, dut, ready=1)
        run.see(ctx, dut, error=0, count=2, axis_x=WORDS[3], axis_y=WORDS[2])

    run.simulate(dut, test, inside=tuple(
        f"guard.{one}.automatic.x.count" for one in ("main", "shadow")))
    return ("the order before arrived; a bit of a count of X was turned: a clock later the error "
            "showed, and no step was made, nor by hand, until a reset")
