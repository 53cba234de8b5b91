"""Benches of the UART."""

from fresa.protocol import UARTReceiver, UARTTransmitter

from ..bench import Run, bench
from ..models.protocol import bits


@bench
def uart_transmitter(run: Run) -> str:
    """Bytes onto a line, one after the other without a gap."""
    dut = UARTTransmitter(period=16)
    sent = b"x?\r"

    async def source(ctx):
        for byte in sent:
            ctx.set(dut.bytes.payload, byte)
            ctx.set(dut.bytes.valid, 1)
            taken = False
            while not taken:
                taken = ctx.get(dut.bytes.ready)
                await ctx.tick()
        ctx.set(dut.bytes.valid, 0)

    async def test(ctx):
        await run.until(ctx, dut, tx=0)
        for byte in sent:
            for level in bits(byte):
                for _ in range(16):
                    run.see(ctx, dut, tx=level)
                    await ctx.tick()
        for _ in range(40):
            run.see(ctx, dut, tx=1)
            run.see(ctx, dut.bytes, ready=1)
            await ctx.tick()

    run.simulate(dut, test, source)
    return f"{sent!r} in {len(sent)} x 10 bits of 16 clocks, without a gap; then the line is high"


@bench
def uart_receiver(run: Run) -> str:
    """Bytes from a disturbed line; a stop bit missing, a break, bytes lost."""
    dut = UARTReceiver(period=16)

    async def send(ctx, levels):
        for level in levels:
            for clock in range(16):
                ctx.set(dut.rx, level ^ (clock == 8))  # a disturbance in the middle of each bit
                await ctx.tick()
        ctx.set(dut.rx, 1)
        await ctx.tick().repeat(8)

    async def receive(ctx, byte, error):
        run.see(ctx, dut.bytes, valid=1)
        item = ctx.get(dut.bytes.payload)
        run.expect("byte and error", (item.byte, item.error), (byte, error))
        ctx.set(dut.bytes.ready, 1)
        await ctx.tick()
        ctx.set(dut.bytes.ready, 0)
        run.see(ctx, dut.bytes, valid=0)

    async def test(ctx):
        ctx.set(dut.rx, 1)
        await ctx.tick().repeat(4)
        for byte in b":v":
            await send(ctx, bits(byte))
            await receive(ctx, byte, 0)
        await send(ctx, bits(0x33, stop=0))
        await receive(ctx, 0x33, 1)
        await send(ctx, [0] * 12)
        run.see(ctx, dut, line_break=0)  # it is over
        await receive(ctx, 0, 1)
        run.expect("a break was shown", counts["line_break"] > 16, True)
        await send(ctx, [*bits(0x33)[:5], *[0] * 24])  # another, in the middle of a byte
        await receive(ctx, 0x03, 1)
        run.expect("it was shown", counts["line_break"] > 100, True)

        for byte in b"123":
            await send(ctx, bits(byte))
        await receive(ctx, ord("1"), 0)
        await send(ctx, bits(ord("4")))
        await receive(ctx, ord("4"), 1)  # 2 and 3 are lost
        run.see(ctx, dut, fault=0)

    async def alarms(ctx):
        seen = {"framing": 0, "overrun": 0, "line_break": 0}
        while True:
            for name in seen:
                seen[name] += ctx.get(getattr(dut, name))
            counts.update(seen)
            await ctx.tick()

    counts: dict[str, int] = {}
    run.simulate(dut, test, alarms)
    run.expect("clocks with framing", counts["framing"], 3)
    run.expect("clocks with overrun", counts["overrun"], 2)
    return ("':v' through a disturbance in every bit; a byte without a stop bit and a break came "
            "marked, and the byte after two that were lost")
