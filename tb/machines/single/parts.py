"""Benches of the parts of `single`: what reads its frames."""

from fresa.protocol import FrameInterpreter, LineEnd

from ...bench import Run, bench, put


@bench
def frame_interpreter(run: Run) -> str:
    """Frames of `single` and their answers: set, requested, refused."""
    dut = FrameInterpreter(greeting=b"hi\r\n", help_text=b"help\r\n")
    end = {"byte": LineEnd.GOOD.value, "end": 1}
    said = bytearray()

    async def listen(ctx):
        ctx.set(dut.bytes.ready, 1)
        while True:
            if ctx.get(dut.bytes.valid):
                said.append(ctx.get(dut.bytes.payload))
            await ctx.tick()

    async def ask(ctx, text, clocks=45):
        said.clear()
        for byte in text:
            await put(ctx, dut.items, {"byte": byte})
        await put(ctx, dut.items, end)
        await ctx.tick().repeat(clocks)
        return bytes(said)

    async def test(ctx):
        await ctx.tick().repeat(14)
        run.expect("greeting", bytes(said), b"hi\r\nhelp\r\n")
        for position, speed in [(9999, 59_999), (8190, 43_690), (5461, 21_845), (16, 32_768)]:
            ctx.set(dut.position, position)
            run.expect("position", await ask(ctx, b"x?", 90), b"x:%d\r\nok\r\n" % position)
            run.expect("answer", await ask(ctx, b"v%d" % speed), b"ok\r\n")
            run.see(ctx, dut, speed=speed)
            run.expect("speed", await ask(ctx, b"V?", 90), b"v:%d\r\nok\r\n" % speed)
            run.expect("answer", await ask(ctx, b"X%d" % position), b"ok\r\n")
            run.see(ctx, dut, target=position)
        run.expect("answer", await ask(ctx, b"v100"), b"ok\r\n")
        for text, answer, sets in [
            (b"x57", b"ok\r\n", {"target": 57}), (b"v?", b"v:100\r\nok\r\n", {}),
            (b"V250", b"ok\r\n", {"speed": 250}), (b"x?", b"x:42\r\nok\r\n", {}),
            (b"v0", b"err range\r\n", {"speed": 250}), (b"x1a", b"err number\r\n", {"target": 57}),
            (b"e0", b"ok\r\n", {"enable": 0}), (b"e", b"err number\r\n", {"enable": 0}),
            (b"f", b"err command\r\n", {}), (b"d", b"help\r\nok\r\n", {}),
        ]:
            ctx.set(dut.position, 42)
            heard = await ask(ctx, text)
            run.see(ctx, dut, **sets)
            run.expect(f"answer to {text!r}", heard, answer)
        said.clear()
        await put(ctx, dut.items, {"byte": LineEnd.LONG.value, "end": 1})
        await ctx.tick().repeat(20)
        run.expect("answer to a long frame", bytes(said), b"err length\r\n")
        run.see(ctx, dut, target=57, speed=250, enable=0, fault=0)

    run.simulate(dut, test, listen)
    return "28 frames, each answered once; those that were refused changed nothing"
