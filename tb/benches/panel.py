"""Benches of switches and buttons, LEDs and the display."""

from functools import partial

from fresa.panel import ContactFilter, Debouncer, GlitchFilter, Monitor, SevenSegment

from ..bench import Run, bench
from ..models.panel import LIT

SHAPES = {0xFF ^ sum(1 << "abcdefg".index(segment) for segment in lit): digit
          for digit, lit in enumerate(LIT)}
"""Digits by the levels of the cathodes, active low."""


@bench
def debouncer(run: Run) -> str:
    """A contact that bounces, a disturbance, and a clean press."""
    dut = Debouncer(width=2, period=8)

    async def test(ctx):
        for _ in range(12):  # bouncing for 84 clocks
            ctx.set(dut.i, 0b01)
            for _ in range(3):
                run.see(ctx, dut, o=0)
                await ctx.tick()
            ctx.set(dut.i, 0b00)
            for _ in range(4):
                run.see(ctx, dut, o=0)
                await ctx.tick()

        ctx.set(dut.i, 0b01)
        await ctx.tick().repeat(16)
        for _ in range(8):
            run.see(ctx, dut, o=0b01)
            await ctx.tick()

        ctx.set(dut.i, 0b10)  # one released, the other pressed
        await ctx.tick().repeat(16)
        run.see(ctx, dut, o=0b10)
        ctx.set(dut.i, 0b00)
        await ctx.tick().repeat(7)
        ctx.set(dut.i, 0b10)
        for _ in range(24):
            run.see(ctx, dut, o=0b10)
            await ctx.tick()

    run.simulate(dut, test)
    return ("bounces of 3 clocks and a gap of 7 did not pass a debouncer of 8; what held for 16 "
            "did, on each of two inputs by itself")


async def _level(run: Run, dut: ContactFilter | GlitchFilter, ctx, i: int, clocks: int, o: int
                 ) -> None:
    """Hold an input, and expect an output, for some clocks."""
    ctx.set(dut.i, i)
    for _ in range(clocks):
        run.see(ctx, dut, o=o)
        await ctx.tick()


@bench
def contact_filter(run: Run) -> str:
    """A contact that bounces and closes, for a time that is then shorter."""
    dut = ContactFilter(width=1, most=15)
    level = partial(_level, run, dut)

    async def test(ctx):
        ctx.set(dut.period, 8)
        await level(ctx, 1, 8, 0)
        await level(ctx, 0, 1, 0)
        await level(ctx, 1, 13, 0)
        await level(ctx, 0, 1, 0)
        ctx.set(dut.i, 1)
        await ctx.tick().repeat(18)
        ctx.set(run.rst, 1)
        await level(ctx, 1, 4, 1)
        ctx.set(run.rst, 0)
        await level(ctx, 0, 1, 1)
        ctx.set(dut.period, 2)
        await level(ctx, 0, 18, 0)
        await level(ctx, 1, 4, 0)
        await level(ctx, 0, 1, 0)
        ctx.set(dut.i, 1)
        await ctx.tick().repeat(9)
        run.see(ctx, dut, o=1)
        await ctx.tick()

    run.simulate(dut, test)
    return "closings of 13 clocks and of 4 did not pass filters of 8 and of 2, longer ones did"


@bench
def glitch_filter(run: Run) -> str:
    """A contact that closes with bounces, opens, and glitches."""
    dut = GlitchFilter(period=8)

    level = partial(_level, run, dut)

    async def test(ctx):
        for clocks in (1, 3, 7):
            await level(ctx, 1, clocks, 0)
            await level(ctx, 0, 2, 0)
        await level(ctx, 1, 8, 0)
        await level(ctx, 1, 12, 1)
        ctx.set(run.rst, 1)
        await level(ctx, 1, 2, 1)
        ctx.set(run.rst, 0)
        await level(ctx, 0, 1, 1)
        await level(ctx, 0, 4, 0)
        await level(ctx, 1, 7, 0)
        await level(ctx, 0, 9, 0)

    run.simulate(dut, test)
    return ("bounces of 1, 3 and 7 clocks did not pass a filter of 8; the output rose with the 9th "
            "clock of a steady level, kept it through a reset, and fell a clock after it")


@bench
def seven_segment(run: Run) -> str:
    """All 16 digits, one place at a time, dark in between."""
    dut = SevenSegment(scan_bits=4)

    async def test(ctx):
        ctx.set(dut.enable, 1)
        for value in (0x0123, 0x4567, 0x89AB, 0xCDEF):
            ctx.set(dut.value, value)
            lit = [0, 0, 0, 0]
            last = None
            for _ in range(64):
                places = [place for place in range(4) if not ctx.get(dut.digits) >> place & 1]
                run.expect("digits lit at once", len(places) > 1, False)
                if places:
                    place, = places
                    run.expect("dark between two digits", last in (None, place), True)
                    digit = SHAPES.get(ctx.get(dut.segments))
                    run.expect(f"digit {place} of {value:04X}", digit, value >> 4 * place & 15)
                    lit[place] += 1
                last = places[0] if places else None
                await ctx.tick()
            run.expect("turns as long as each other, but for the dark", lit, [12] * 4)
        ctx.set(dut.enable, 0)
        for _ in range(64):
            run.see(ctx, dut, digits=0b1111)
            await ctx.tick()

    run.simulate(dut, test)
    return "0123, 4567, 89AB and CDEF were read back; never two digits lit, dark between any two"


@bench
def monitor(run: Run) -> str:
    """LEDs by hand, the display in automatic mode."""
    dut = Monitor(scan_bits=3)

    async def test(ctx):
        x, y, z = 0b0110, 0b0011, 0b1001
        ctx.set(dut.axis_x, x)
        ctx.set(dut.axis_y, y)
        ctx.set(dut.axis_z, z)
        ctx.set(dut.count, 0x1A2B)
        for jogging, word in enumerate([x, x, y, x, z, x, y, x]):
            ctx.set(dut.jogging, jogging)
            for _ in range(8):
                run.see(ctx, dut, leds=word, digits=0b1111)
                await ctx.tick()

        ctx.set(dut.mode, 1)
        shown = set()
        for _ in range(32):
            run.see(ctx, dut, leds=0)
            for place in range(4):
                if not ctx.get(dut.digits) >> place & 1:
                    shown.add((place, SHAPES.get(ctx.get(dut.segments))))
            await ctx.tick()
        run.expect("places and digits", sorted(shown), [(0, 0xB), (1, 0x2), (2, 0xA), (3, 0x1)])

    run.simulate(dut, test)
    return "by hand the coils of X before Y before Z, and no display; automatic 1A2B, and no LED"
