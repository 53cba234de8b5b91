"""Benches of the protocol: lines, words, numbers and texts."""

from fresa.protocol import (
    DecimalReader,
    DecimalWriter,
    FixedPoint,
    GCodeActionKind,
    GCodeInterpreter,
    GCodeKind,
    GCodeMessage,
    GCodeReader,
    GCodeReporter,
    GCodeSettingStore,
    GCodeState,
    GCodeStatus,
    HexReader,
    HexWriter,
    LineBuffer,
    LineEnd,
    LineReader,
    NumberError,
    Operand,
    RealtimeCode,
    RealtimeFilter,
    TextSource,
    WordReader,
    setting_index,
)

from ..bench import Run, bench, put
from ..models.orders import checked


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
        for text in (b"no:x12\r", b":12345\r", b":v?:v\xe9\r:\r"):
            for byte in text:
                await put(ctx, dut.bytes, {"byte": byte})
                # An end that is not offered does nothing, damaged or not.
                ctx.set(dut.bytes.payload, {"byte": ord("\r"), "error": 1})
                await ctx.tick()
        for byte, error in [(b":", 0), (b"x", 0), (b"9", 1), (b"\r", 0)]:
            await put(ctx, dut.bytes, {"byte": byte[0], "error": error})
        await ctx.tick().repeat(8)
        run.expect("lines", lines, [
            (b"x12", LineEnd.GOOD), (b"", LineEnd.LONG), (b"v\xe9", LineEnd.GOOD),
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
    return ("two lines and an empty one were handed on, one too long and one damaged came as that "
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


@bench
def word_reader(run: Run) -> str:
    """Words of a line looked up in a table, in either case."""
    table = (b"MOV", b"MOT", b"C", b"CC", b"CONNECT")
    dut = WordReader(table)

    async def test(ctx):
        for text, stop in [(b"mov", " "), (b"MOT", "2"), (b"C", " "), (b"Cc", " "),
                           (b"Connect", " "), (b"MO", " "), (b"CCC", " "), (b"", "-")]:
            for byte in text:
                await put(ctx, dut.items, {"byte": byte})
            ctx.set(dut.items.payload, {"byte": ord(stop)})
            ctx.set(dut.items.valid, 1)
            run.see(ctx, dut.items, ready=0)  # what ends a word stays in the line
            await ctx.tick()
            run.see(ctx, dut.words, valid=1)
            word = ctx.get(dut.words.payload)
            there = text.upper() in table
            run.expect(f"{text!r} is known", word.known, there)
            if there:
                run.expect(f"place of {text!r}", word.index, table.index(text.upper()))
            ctx.set(dut.items.valid, 0)
            ctx.set(dut.words.ready, 1)
            await ctx.tick()
            ctx.set(dut.words.ready, 0)

    run.simulate(dut, test)
    return ("5 words were found in the table, C beside CC and CONNECT; MO, CCC and nothing at all "
            "were not")


@bench
def text_source(run: Run) -> str:
    """Texts by their numbers, to a line that does not always take a byte."""
    texts = (b"ok\r\n", b"err range\r\n", b"?")
    dut = TextSource(texts)

    async def test(ctx):
        for number, every in [(0, 1), (2, 1), (1, 3), (0, 2)]:
            await put(ctx, dut.numbers, number)
            run.see(ctx, dut.bytes, valid=0)
            await ctx.tick()
            for byte in texts[number]:
                for wait in reversed(range(every)):
                    run.see(ctx, dut.bytes, valid=1)
                    run.expect(f"byte of text {number}", ctx.get(dut.bytes.payload), byte)
                    ctx.set(dut.bytes.ready, wait == 0)
                    await ctx.tick()
                ctx.set(dut.bytes.ready, 0)
            run.see(ctx, dut.bytes, valid=0)
        await put(ctx, dut.numbers, 3)  # there is none
        for _ in range(9):
            run.see(ctx, dut.bytes, valid=0)
            run.see(ctx, dut.numbers, ready=1)
            await ctx.tick()

    run.simulate(dut, test)
    return "4 texts whole, a byte a clock if taken so fast; a number without a text sent nothing"


@bench
def hex_reader(run: Run) -> str:
    """Lines with a CRC: one that is right, and what can be wrong with it."""
    dut = HexReader(digits=2)
    right = checked("3C")

    async def test(ctx):
        for line, end, good in [
            (right, LineEnd.GOOD, 1), (right, LineEnd.DAMAGED, 0), (right[:-1], LineEnd.GOOD, 0),
            (right + "0", LineEnd.GOOD, 0), (checked("3D")[:2] + right[2:], LineEnd.GOOD, 0),
            (right.lower(), LineEnd.GOOD, 0), ("", LineEnd.GOOD, 0), (right, LineEnd.GOOD, 1),
        ]:
            for byte in line.encode():
                run.see(ctx, dut.messages, valid=0)
                await put(ctx, dut.items, {"byte": byte})
            await put(ctx, dut.items, {"byte": end.value, "end": 1})
            run.see(ctx, dut.items, ready=0)
            await ctx.tick().repeat(2)  # it holds until it is taken
            run.see(ctx, dut.messages, valid=1)
            message = ctx.get(dut.messages.payload)
            run.expect("good", message.good, good)
            if good:
                run.expect("value", message.value, 0x3C)
            ctx.set(dut.messages.ready, 1)
            await ctx.tick()
            ctx.set(dut.messages.ready, 0)

    run.simulate(dut, test)
    return ("3C twice; damaged, a digit short, a digit long, another digit, small letters and an "
            "empty line are not good")


@bench
def hex_writer(run: Run) -> str:
    """Messages to lines, with their CRC behind them."""
    dut = HexWriter(digits=4, start=b"=")
    sent = (0x09AF, 0x0000, 0xFFFF)

    async def test(ctx):
        for number in sent:
            run.see(ctx, dut.bytes, valid=0)
            await put(ctx, dut.messages, number)
            for place, byte in enumerate(f"={checked(f'{number:04X}')}\r\n".encode()):
                run.see(ctx, dut.messages, ready=0)
                for _ in range(place % 2):  # a byte holds until it is taken
                    await ctx.tick()
                run.see(ctx, dut.bytes, valid=1, payload=byte)
                ctx.set(dut.bytes.ready, 1)
                await ctx.tick()
                ctx.set(dut.bytes.ready, 0)

    run.simulate(dut, test)
    return "09AF, 0000 and FFFF, each with 8 digits of CRC-32, CR and LF"


@bench
def realtime_filter(run: Run) -> str:
    """Real-time commands out of a line that waits."""
    dut, seen = RealtimeFilter(), []

    async def consumer(ctx):
        while True:
            if ctx.get(dut.command):
                seen.append(RealtimeCode(ctx.get(dut.code)).name)
            await ctx.tick()

    async def test(ctx):
        for byte in b"?!~\x18\x85\x91\xa0\x98":  # taken while nothing else is
            await put(ctx, dut.bytes, {"byte": byte})
        ctx.set(dut.bytes.valid, 1)
        for byte, error in [(ord("G"), 0), (ord("?"), 1)]:
            ctx.set(dut.bytes.payload, {"byte": byte, "error": error})
            run.see(ctx, dut.bytes, ready=0)
            run.see(ctx, dut.rest, valid=1)
            await ctx.tick()
        ctx.set(dut.bytes.valid, 0)
        await ctx.tick()
        run.expect("commands", seen, [
            "STATUS", "HOLD", "RESUME", "RESET", "JOG_CANCEL", "FEED_PLUS_10", "FLOOD"])
        known = {*b"\x18!?~\x84\x85\xa0\xa1", *range(0x90, 0x98), *range(0x99, 0x9F)}
        ctx.set(dut.bytes.valid, 1)
        for number in range(1024):  # every byte, with and without an error, waiting or not
            byte, error, ready = number & 0xFF, number >> 8 & 1, number >> 9
            ctx.set(dut.bytes.payload, {"byte": byte, "error": error})
            ctx.set(dut.rest.ready, ready)
            passes = error or (byte < 0x80 and byte not in known)
            run.see(ctx, dut, rest_valid=passes, bytes_ready=ready or not passes)
            if passes:
                run.see(ctx, dut, rest_payload=byte | error << 8)
            await ctx.tick()
            run.see(ctx, dut, command=byte in known and not error)
            if byte in known and not error:
                run.see(ctx, dut, code=byte)

    run.simulate(dut, test, consumer)
    return ("seven commands were taken while others waited, a byte from 0x80 on was dropped; every "
            "byte goes where it belongs")


@bench
def line_buffer(run: Run) -> str:
    """Ends of every kind, a framing error, silence, no room."""
    dut, items = LineBuffer(depth=4, silence=40), bytearray()

    async def consumer(ctx):
        while True:
            if ctx.get(dut.items.valid) and ctx.get(dut.items.ready):
                item = ctx.get(dut.items.payload)
                items.append((b"|", b"", b"#")[item.byte][0] if item.end else item.byte)
            await ctx.tick()

    async def test(ctx):
        ctx.set(dut.items.ready, 1)
        for byte in b"ab\r\nc\rd\n\n":
            await put(ctx, dut.bytes, {"byte": byte})
            await ctx.tick()
        for byte, error in [(b"e", 0), (b"f", 1), (b"g", 0), (b"\n", 0), (b"h", 0)]:
            await put(ctx, dut.bytes, {"byte": byte[0], "error": error})
            await ctx.tick()
        await ctx.tick().repeat(50)
        run.expect("lines", bytes(items), b"ab|c|d||e#h|")
        items.clear()

        ctx.set(dut.items.ready, 0)
        for byte in b"\nij\nkl\nmn\n":  # the first is that of the silence
            await put(ctx, dut.bytes, {"byte": byte})
        run.see(ctx, dut, free=0)
        ctx.set(dut.items.ready, 1)
        await ctx.tick().repeat(30)
        run.see(ctx, dut, free=4)
        for byte in b"op\n":
            await put(ctx, dut.bytes, {"byte": byte})
        await ctx.tick().repeat(8)
        run.expect("lines after an overflow", bytes(items), b"ij|kl##op|")

    run.simulate(dut, test, consumer)
    return ("lines came as they were sent, one that was damaged and two that had no room ended as "
            "damaged, and the next was whole")


@bench
def fixed_point(run: Run) -> str:
    """Digits to numbers of six decimals."""
    dut = FixedPoint()

    async def test(ctx):
        for text, value, whole, hundredths, exact in [
            ("38.2", 38_200_000, 38, 20, 1), ("-0.0000005", -1, 0, 0, 0),
            ("-8796093.022207", 1 - 2**43, 8_796_093, 2, 0), ("99999999", None, 2**24 - 1, 0, 1),
        ]:
            ctx.set(dut.clear, 1)
            await ctx.tick()
            ctx.set(dut.clear, 0)
            ctx.set(dut.decimal, 0)
            ctx.set(dut.negative, text.startswith("-"))
            for character in text.lstrip("-"):
                if character == ".":
                    ctx.set(dut.decimal, 1)
                else:
                    ctx.set(dut.digit, int(character))
                    ctx.set(dut.take, 1)
                    await ctx.tick()
                    ctx.set(dut.take, 0)
            ctx.set(dut.finish, 1)
            await run.until(ctx, dut, within=9, done=1)
            await ctx.tick()
            ctx.set(dut.finish, 0)
            number = ctx.get(dut.number)
            run.expect(f"{text}: overflow", number.overflow, int(value is None))
            if value is not None:
                run.expect(text, number.value, value)
            run.expect(f"{text}: parts", (number.whole, number.hundredths, number.exact),
                       (whole, hundredths, exact))

    run.simulate(dut, test)
    return "four numbers: rounded away from zero, the lowest, and one that does not fit"


@bench
def g_code_reader(run: Run) -> str:
    """Words, comments, errors and system commands."""
    dut, said = GCodeReader(), []

    async def consumer(ctx):
        ctx.set(dut.words.ready, 1)
        while True:
            if ctx.get(dut.words.valid):
                item = ctx.get(dut.words.payload)
                kind, letter = GCodeKind(item.kind), chr(item.character)
                said.append(GCodeStatus(item.status).name if kind == GCodeKind.END else
                            letter if kind == GCodeKind.CHARACTER else
                            f"{letter}{item.number.value}")
            await ctx.tick()

    async def test(ctx):
        for line, expected in [
            (b"g1 x-1.5(to)2y2", "G1000000 X-1520000 Y2000000 GOOD"), (b";only this", "GOOD"),
            (b"X5 Y", "X5000000 NO_NUMBER"), (b"%", "NO_LETTER"),
            (b"$1=25", "$ 1 $1000 = 2 5 =25000 GOOD"),
            (b"$j=x2", "$ J = X2000000 GOOD"),
        ]:
            said.clear()
            for byte in line:
                await put(ctx, dut.items, {"byte": byte, "end": 0})
            await put(ctx, dut.items, {"byte": LineEnd.GOOD.value, "end": 1})
            await ctx.tick().repeat(16)
            run.expect(line.decode(), " ".join(said), expected)

    run.simulate(dut, test, consumer)
    return "six lines: words, comments, an error each, a setting and a jog"


@bench
def g_code_interpreter(run: Run) -> str:
    """A position, a motion, an offset, two lines that are refused, and a probing."""
    dut = GCodeInterpreter()

    async def line(ctx, text: str, *expected: tuple[GCodeActionKind, Operand, int]) -> None:
        for word in text.split():
            whole, _, tenth = word[1:].partition(".")
            hundredths = int(tenth or 0) * 10
            await put(ctx, dut.words, {
                "kind": GCodeKind.WORD, "character": ord(word[0]), "number": {
                    "value": int(whole) * 10**6 + hundredths * 10**4, "whole": int(whole),
                    "hundredths": hundredths, "exact": 1, "integer": not hundredths}})
        await put(ctx, dut.words, {"kind": GCodeKind.END})
        for kind, address, value in expected:
            await run.until(ctx, dut.actions, valid=1)
            ctx.set(dut.operand_address, address)
            await ctx.tick()
            run.expect(f"action of {text}", ctx.get(dut.actions.p.kind), kind)
            run.expect(f"operand of {text}", ctx.get(dut.operand), value)
            if kind == GCodeActionKind.PROBED:
                await put(ctx, dut.position, {"axis": 0, "value": 4 * 10**6})
            ctx.set(dut.actions.ready, 1)
            await ctx.tick()
            ctx.set(dut.actions.ready, 0)
        await run.until(ctx, dut.answers, valid=1)
        run.see(ctx, dut.actions, valid=0)

    async def answer(ctx, code: int) -> None:
        run.see(ctx, dut.answers, payload=code)
        ctx.set(dut.answers.ready, 1)
        await ctx.tick()
        ctx.set(dut.answers.ready, 0)

    async def test(ctx):
        await put(ctx, dut.position, {"axis": 0, "value": 7 * 10**6})
        await line(ctx, "G91 G0 X2", (GCodeActionKind.RAPID, Operand.TARGET, 9 * 10**6))
        await answer(ctx, 0)
        await line(ctx, "G92 X4", (GCodeActionKind.OFFSETS, Operand.ORIGIN, 5 * 10**6))
        await answer(ctx, 0)
        await line(ctx, "G90 G1 X1 F60", (GCodeActionKind.LINE, Operand.TARGET, 6 * 10**6))
        await answer(ctx, 0)
        await line(ctx, "X1 X2")
        await answer(ctx, 25)
        await line(ctx, "G80 X1")
        await answer(ctx, 31)
        await line(ctx, "G38.2 X0", (GCodeActionKind.PROBE, Operand.TARGET, 5 * 10**6),
                   (GCodeActionKind.PROBED, Operand.POSITION, 5 * 10**6))
        await answer(ctx, 0)
        await line(ctx, "G91 G1 X1", (GCodeActionKind.LINE, Operand.TARGET, 5 * 10**6))
        await answer(ctx, 0)
        run.see(ctx, dut, fault=0)

    run.simulate(dut, test)
    return ("three lines done, from the position that was set; two refused, with 25 and 31; "
            "and one from where the probe touched")


@bench
def g_code_reporter(run: Run) -> str:
    """Answers, an alarm, a message, and three reports, one line after the other."""
    dut, text = GCodeReporter(), bytearray()
    numbers: dict[int, int] = {}  # that it shows, by their addresses

    async def consumer(ctx):
        number = 0  # that was read
        ctx.set(dut.bytes.ready, 1)
        while True:
            if ctx.get(dut.bytes.valid):
                text.append(ctx.get(dut.bytes.payload))
            reads, address = ctx.get(dut.number_read), ctx.get(dut.number_address)
            await ctx.tick()
            ctx.set(dut.number, number)
            if reads:
                number = numbers.get(address, 0)

    async def line(ctx) -> str:
        while not text.endswith(b"\n"):
            await ctx.tick()
        found = text.decode("ascii")
        text.clear()
        return found.removesuffix("\r\n")

    async def report(ctx) -> str:
        ctx.set(dut.request, 1)
        await ctx.tick()
        ctx.set(dut.request, 0)
        return await line(ctx)

    async def test(ctx):
        await put(ctx, dut.answers, 0)
        run.expect("answer", await line(ctx), "ok")
        await put(ctx, dut.answers, 33)
        run.expect("answer", await line(ctx), "error:33")
        await put(ctx, dut.alarms, 1)
        run.expect("alarm", await line(ctx), "ALARM:1")
        await put(ctx, dut.messages, GCodeMessage.UNLOCKED)
        run.expect("message", await line(ctx), "[MSG:Caution: Unlocked]")
        ctx.set(dut.state, GCodeState.RUN)
        ctx.set(dut.shown, 0b11)
        numbers.update({8: -1, 9: 12_345})
        ctx.set(dut.free_bytes, 128)
        ctx.set(dut.pins, 0b0101)
        run.expect("report", await report(ctx), "<Run|MPos:-0.001,12.345,0.000|Bf:0,128|FS:0,0"
                                                "|Pn:PY|WCO:0.000,0.000,0.000>")
        ctx.set(dut.pins, 0)
        for percent, value in zip(dut.overrides, (110, 50, 90), strict=True):
            ctx.set(percent, value)
        ctx.set(dut.accessories, 0b0101)
        run.expect("report", await report(ctx), "<Run|MPos:-0.001,12.345,0.000|Bf:0,128|FS:0,0"
                                                "|Ov:110,50,90|A:SF>")
        ctx.set(dut.shown, 0)
        run.expect("report", await report(ctx), "<Run|WPos:-0.001,12.345,0.000|FS:0,0>")

    run.simulate(dut, test, consumer)
    return "seven lines, each whole, the reports with what is due, and of what is to be shown"


@bench
def g_code_setting_store(run: Run) -> str:
    """A setting that is read, tried and written."""
    dut = GCodeSettingStore(values={100: 80_000})

    async def test(ctx):
        at = setting_index(100)
        for address in (dut.address, dut.write_address):
            ctx.set(address, at)
        ctx.set(dut.data, 160_000)
        await ctx.tick()
        run.see(ctx, dut, value=80_000)
        await ctx.tick()
        run.see(ctx, dut, number=100, decimal=1)
        ctx.set(dut.trial, 1)
        run.see(ctx, dut, value=160_000)
        await ctx.tick()
        ctx.set(dut.trial, 0)
        run.see(ctx, dut, value=80_000)
        await ctx.tick()
        ctx.set(dut.write, 1)
        await ctx.tick()
        ctx.set(dut.write, 0)
        await ctx.tick()
        run.see(ctx, dut, value=160_000)
        await ctx.tick()

    run.simulate(dut, test)
    return "$100 is 80, then 160 while that is tried, and when it is written"
