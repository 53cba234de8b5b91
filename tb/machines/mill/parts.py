"""Benches of the parts of the mill: orders that come over its serial line."""

from fresa.machines import SerialOrders

from ...bench import Run, bench
from ...models.orders import checked
from ...scoreboard import monitor
from ...uart import encode


@bench
def serial_orders(run: Run) -> str:
    """Lines over a serial line to orders, and an answer to each."""
    dut = SerialOrders(period=16)
    received = bytearray()

    async def ask(ctx, digits, answer, *, damage=None):
        text = bytearray(f":{checked(digits)}\r".encode())
        if damage is not None:
            text[damage] ^= 1
        for level in encode(bytes(text), 16):
            ctx.set(dut.rx, level)
            await ctx.tick()
        await ctx.tick().repeat(6000)
        last = [line[:23] for line in bytes(received).splitlines()[-1:]]
        run.expect("answer", last, [f"={answer}".encode()])

    async def test(ctx):
        ctx.set(dut.rx, 1)
        ctx.set(dut.enable, 1)
        await ctx.tick().repeat(9)
        await ask(ctx, "01C0FFEE01" "000000" "00000000", "10C0FFEE01" "000000" "000000")
        await ask(ctx, "02C0FFEE01" "000001" "00800100", "20C0FFEE01" "000001" "000000")
        run.see(ctx, dut.orders, valid=1)
        order = ctx.get(dut.orders.payload)
        run.expect("order", (order.x, order.y), (128, 256))
        ctx.set(dut.orders.ready, 1)
        await ctx.tick()
        ctx.set(dut.orders.ready, 0)
        await ask(ctx, "03C0FFEE01" "000002" "00000000", "90C0FFEE01" "000001" "000001", damage=9)
        run.see(ctx, dut.orders, valid=0)
        await ask(ctx, "03C0FFEE01" "000002" "00000000", "20C0FFEE01" "000002" "000001")
        run.expect("tool", ctx.get(dut.orders.p.up), 1)
        run.expect("answers", received.count(b"\n"), 4)

    run.simulate(dut, test, monitor(run, dut.tx, 16, received), deadline=80_000)
    return "a session opened, order 1 taken, order 2 taken once its line came undamaged"
