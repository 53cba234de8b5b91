"""Each order that comes over a line, once."""

from fresa.motion import OrderLedger, Outcome, RequestKind

from ..bench import Run, bench


@bench
def order_ledger(run: Run) -> str:
    """Each order once and in sequence; a request with another number does nothing."""
    dut = OrderLedger(depth=2)
    query, open_, go, up = (RequestKind.QUERY, RequestKind.OPEN, RequestKind.GO, RequestKind.UP)

    async def request(ctx, outcome, kind, session=7, number=0, x=0, good=1, **now):
        ctx.set(dut.requests.p, {"good": good, "value": {
            "kind": kind, "session": session, "number": number, "x": x}})
        ctx.set(dut.requests.valid, 1)
        run.see(ctx, dut.requests, ready=1)
        await ctx.tick()
        ctx.set(dut.requests.valid, 0)
        run.see(ctx, dut.answers, valid=1)
        answer = ctx.get(dut.answers.payload)
        run.expect("outcome", Outcome(answer.outcome), outcome)
        for name, value in now.items():
            run.expect(name, answer[name], value)
        await ctx.tick()
        run.see(ctx, dut.answers, valid=0)

    async def carry_out(ctx, x):
        run.see(ctx, dut.orders, valid=1)
        run.expect("order.x", ctx.get(dut.orders.p.x), x)
        ctx.set(dut.orders.ready, 1)
        await ctx.tick()
        ctx.set(dut.orders.ready, 0)

    async def test(ctx):
        ctx.set(dut.answers.ready, 1)
        await request(ctx, Outcome.MANUAL, open_, manual=1)
        ctx.set(dut.enable, 1)
        await request(ctx, Outcome.CLOSED, go, session=0, number=1)
        await request(ctx, Outcome.OPENED, open_, number=4, session=7, taken=4, done=4)
        await request(ctx, Outcome.TAKEN, go, number=5, x=50, taken=5, done=4)
        await request(ctx, Outcome.AGAIN, go, number=5, x=99, taken=5)
        await request(ctx, Outcome.OPENED, open_, number=0, taken=5)
        await request(ctx, Outcome.DAMAGED, go, number=6, good=0, taken=5)
        await request(ctx, Outcome.UNEXPECTED, go, number=7, taken=5)
        await request(ctx, Outcome.TAKEN, up, number=6, x=60, taken=6)
        await request(ctx, Outcome.FULL, go, number=7, taken=6)
        await request(ctx, Outcome.BUSY, open_, session=8, taken=6)
        run.see(ctx, dut, busy=1)
        await carry_out(ctx, 50)
        await request(ctx, Outcome.TAKEN, go, number=7, x=70, taken=7, done=5)
        run.expect("tool", ctx.get(dut.orders.p.up), 1)
        await carry_out(ctx, 60)
        await carry_out(ctx, 70)
        run.see(ctx, dut, busy=0)
        run.see(ctx, dut.orders, valid=0)
        ctx.set(dut.error, 1)
        await request(ctx, Outcome.REPORTED, query, taken=7, done=7, error=1)
        ctx.set(dut.enable, 0)
        await ctx.tick()
        await request(ctx, Outcome.CLOSED, go, number=8)
        await request(ctx, Outcome.REPORTED, query, taken=0, done=0)

    run.simulate(dut, test)
    return ("orders 5, 6 and 7 of a session, each offered once; 5 again, 7 too early, a damaged 6 "
            "and all but the next did nothing")
