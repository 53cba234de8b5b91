"""Bytes to orders and back."""

from fresa.protocol import (
    DecimalReader,
    DecimalWriter,
    LineEnd,
    LineReader,
    NumberError,
    UARTReceiver,
    UARTTransmitter,
)

from ..bench import Run, bench, put
from ..models.protocol import bits


@bench
def uart_transmitter(run: Run) -> str:
    """Bytes onto a line, one after the other without a gap."""
    dut = UARTTransmitter(clock=16, baud=1)
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
    dut = UARTReceiver(clock=16, baud=1)

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
    run.expect("clocks with framing", counts["framing"], 2)
    run.expect("clocks with overrun", counts["overrun"], 2)
    run.expect("a break was shown", counts["line_break"] > 16, True)
    return ("':v' through a disturbance in every bit; a byte without a stop bit and a break came "
            "marked, and the byte after two that were lost")


@bench
def line_reader(run: Run) -> str:
    """Frames to lines: good, too long, damaged, begun afresh; the buffer full."""
    dut = LineReader(length=4, start=b":")
    lines = []

    async def consumer(ctx):
        line = bytearray()
        while True:
            if ctx.get(dut.items.valid) and ctx.get(dut.items.ready):
                item = ctx.get(dut.items.payload)
                if item.end:
                    lines.append((bytes(line), LineEnd(item.byte)))
                    line.clear()
                else:
                    line.append(item.byte)
            await ctx.tick()

    async def test(ctx):
        ctx.set(dut.items.ready, 1)
        for text in (b"no:x12\r", b":12345\r", b":v?:v1\r:\r"):
            for byte in text:
                await put(ctx, dut.bytes, {"byte": byte})
        for byte, error in [(b":", 0), (b"x", 0), (b"9", 1), (b"\r", 0)]:
            await put(ctx, dut.bytes, {"byte": byte[0], "error": error})
        await ctx.tick().repeat(5)
        run.expect("lines", lines, [
            (b"x12", LineEnd.GOOD), (b"", LineEnd.LONG), (b"v1", LineEnd.GOOD),
            (b"", LineEnd.GOOD), (b"", LineEnd.DAMAGED)])

        ctx.set(dut.items.ready, 0)
        for byte in b":0\r:1\r:2\r:3":
            await put(ctx, dut.bytes, {"byte": byte})
        ctx.set(dut.bytes.valid, 1)
        for _ in range(20):  # full, until a line is taken
            run.see(ctx, dut.bytes, ready=0)
            await ctx.tick()
        ctx.set(dut.items.ready, 1)
        await run.until(ctx, dut.bytes, ready=1)

    run.simulate(dut, test, consumer)
    return ("x12, v1 and an empty line were handed on, one too long and one damaged came as that "
            "word only; full, it took no byte until a line was taken")


@bench
def decimal_reader(run: Run) -> str:
    """Numbers of 32 bits out of a line: the ends of the range, and what is none."""
    dut = DecimalReader(is_signed=True)
    good, none, over = NumberError.NONE, NumberError.NO_DIGITS, NumberError.OVERFLOW

    async def test(ctx):
        for text, error, value in [
            (b"1500", good, 1500), (b"-42", good, -42), (b"+007", good, 7),
            (b"2147483647", good, 2**31 - 1), (b"-2147483648", good, -2**31),
            (b"2147483648", over, None), (b"99999999999", over, None), (b"-", none, None),
            (b"", none, None),
        ]:
            for byte in text:
                await put(ctx, dut.items, {"byte": byte})
            ctx.set(dut.items.payload, {"byte": ord(" ")})
            ctx.set(dut.items.valid, 1)
            run.see(ctx, dut.items, ready=0)  # the space stays in the line
            await ctx.tick()
            run.see(ctx, dut.numbers, valid=1)
            number = ctx.get(dut.numbers.payload)
            run.expect(f"error of {text!r}", number.error, error)
            if value is not None:
                run.expect(f"value of {text!r}", number.value, value)
            ctx.set(dut.numbers.ready, 1)
            ctx.set(dut.items.valid, 0)
            await ctx.tick()
            ctx.set(dut.numbers.ready, 0)
            run.see(ctx, dut.numbers, valid=0)

    run.simulate(dut, test)
    return ("5 numbers down to -2147483648 and up to 2147483647 have their values; one more than "
            "that, a sign alone and nothing are refused")


@bench
def decimal_writer(run: Run) -> str:
    """Numbers of 32 bits as digits, to a line that does not always take them."""
    dut = DecimalWriter(is_signed=True)

    async def test(ctx):
        longest = 0
        for number in (205, 0, -7, 2**31 - 1, -2**31, 1_000_000_000, -999_999_999):
            await put(ctx, dut.numbers, number)
            for byte in str(number).encode():
                await run.until(ctx, dut.bytes, valid=1)
                await ctx.tick()  # it holds until it is taken
                run.see(ctx, dut.bytes, valid=1)
                run.expect(f"byte of {number}", ctx.get(dut.bytes.payload), byte)
                ctx.set(dut.bytes.ready, 1)
                await ctx.tick()
                ctx.set(dut.bytes.ready, 0)
            run.see(ctx, dut.bytes, valid=0)
            run.see(ctx, dut.numbers, ready=1)
            longest = max(longest, len(str(number)))
        run.see(ctx, dut, fault=0)
        run.expect("longest", longest, 11)

    run.simulate(dut, test)
    return "7 numbers from -2147483648 to 2147483647, each digit held until it was taken"
