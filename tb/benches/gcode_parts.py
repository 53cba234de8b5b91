"""Parts of a G-code machine: its program, and its interpreter's line, coordinates and units."""

import random
from collections import Counter
from collections.abc import Mapping, Sequence

from fresa.protocol import (
    CoordinateSum,
    GCodeCoordinates,
    GCodeKind,
    GCodeLine,
    GCodeList,
    GCodeLister,
    GCodeText,
    GCodeUnit,
    LineEnd,
    Operand,
    StoredLines,
    StoredProgram,
    ThesisDialect,
    UnitConverter,
)
from fresa.protocol.gcode_modes import LETTERS, AxisUse, GCodeLineState, NonModal

from ..bench import Run, bench, put
from ..models.gcode_coordinates import summed
from ..models.gcode_language import (
    G_CODES,
    M_CODES,
    MAX_LINE_NUMBER,
    OF_JOG,
    Interpreter,
    Modes,
    RefusedLine,
    Word,
    nanometres,
    per_second,
)
from ..models.gcode_line import number, read_lines
from ..models.gcode_list import quotient


def letters(text: str) -> int:
    """Return the flags of letters that have a value."""
    return sum(1 << LETTERS.index(letter) for letter in text)


FRACTIONS = ".1", ".10", ".2", ".3", ".4", ".5", ".6", ".01", ".105"


NON_MODAL = {(4, 0): 1, (10, 0): 2, (28, 0): 3, (28, 10): 4, (30, 0): 3, (30, 10): 4, (53, 0): 5,
             (92, 0): 6, (92, 10): 7}
"""Of codes that count for their line only, as whole parts and hundredths: how a line has them."""


def some_number(rng: random.Random, letter: str) -> str:
    """Return a number that may follow a letter: mostly one that is known, or nearly so."""
    if letter in "GM":
        known = G_CODES if letter == "G" else M_CODES
        code = rng.choice([*known, *known, rng.randrange(130),
                           rng.choice([*known]) + (128 << rng.randrange(16))])
        return str(code) + rng.choice(["", "", "", "", *FRACTIONS])
    return rng.choice([
        "0", "1", "2", "-1", "-0.5", "20", "254", "255", "255.5", "256", "-256", "10000000",
        "10000001", "17179.869183", "17179.869184", "34359.738367", "34359.738368", "-34359.738368",
        "-34359.738369", "99999999999", "-99999999999", f"{rng.uniform(-300, 300):.3f}"])


def expected_line(words: Sequence[Word], given: Mapping[str, int], reach: int
                  ) -> tuple[int, dict[str, int | dict[str, int]]]:
    """Return the error of words by the model, or 0 and the line, of modes before it.

    Parameters
    ----------
    words : sequence of Word
        Those so far.
    given : mapping of str to int
        Modes, as `GCodeModes` has them; others are 0.
    reach : int
        Bits of a length, with its sign.
    """
    model = Interpreter()
    model.modes = Modes(mist=bool(given.get("mist")), flood=bool(given.get("flood")))
    try:
        line = model.read(words)
    except RefusedLine as refused:
        return refused.args[0], {}
    modes, values = line.modes, line.values
    changes = {
        "motion": {"motion": {80: 4}.get(modes.motion, modes.motion % 374)},
        "plane": {"plane": modes.plane}, "distance": {"relative": modes.relative},
        "feed": {"inverse": modes.inverse}, "units": {"inches": modes.inches},
        "system": {"system": modes.system}, "coolant": {"mist": modes.mist, "flood": modes.flood},
        "spindle": {"clockwise": modes.spindle > 0, "counter_clockwise": modes.spindle < 0}}
    axes = {"motion": 1, "non-modal": 2, "length": 3}.get(line.axes, 0)
    return 0, {
        "modes": {**given, **{name: int(mode) for group in line.groups
                              for name, mode in changes.get(group, {}).items()}},
        "letters": letters("".join(values)), "axes": axes or bool({*values} & {*"XYZ"}),
        "non_modal": NON_MODAL.get(line.non_modal or (0, 0), 0),
        "second": line.non_modal in {(30, 0), (30, 10)},
        "cancels": line.tool_length == "cancel", "flow": {-1: 1, 30: 2}.get(line.flow, 0),
        "not_of_jog": bool(line.groups - OF_JOG),
        "zero_feed": values.get("F") == 0,
        "number_too_large": values.get("N", 0) // 10**6 > MAX_LINE_NUMBER,
        "too_long": any(not -(1 << reach - 1) <= value < 1 << reach - 1
                        for letter, value in values.items() if letter in "IJKRXYZ"),
        **{f"{letter.lower()}_whole": 255 if values[letter] < 0 else min(
            values[letter] // 10**6, 255) for letter in "LP" if letter in values}}


@bench
def g_code_line(run: Run) -> str:
    """Words that are taken, one whose group has another, and thousands more."""
    dut, rng, counts = GCodeLine(), random.Random(1), Counter()
    given, words = {}, []

    async def clear(ctx, **modes):
        ctx.set(dut.modes, modes)
        ctx.set(dut.clear, 1)
        await ctx.tick()
        ctx.set(dut.clear, 0)
        given.clear()
        given.update(modes)
        words.clear()

    async def word(ctx, letter, text, error=None):
        said = number(text)
        ctx.set(dut.item, {"kind": GCodeKind.WORD, "character": ord(letter),
                           "number": said | {"value": min(said["value"], (1 << 43) - 1)}})
        await ctx.tick().repeat(2)
        has_value = letter in LETTERS
        run.see(ctx, dut, has_value=has_value)
        if has_value:
            run.see(ctx, dut, index=LETTERS.index(letter))
        ctx.set(dut.take, 1)
        await ctx.tick()
        ctx.set(dut.take, 0)
        words.append(Word(letter, said["value"], bool(said["overflow"])))
        return await see(ctx, error)

    async def see(ctx, wanted=None, **changed):
        error, state = expected_line(words, given, dut.reach)
        run.see(ctx, dut, error=error if wanted is None else wanted)
        if not error:
            run.see(ctx, dut, line=GCodeLineState.const({**state, **changed}).as_bits())
        counts[error] += 1
        return error

    async def test(ctx):
        await clear(ctx)
        for letter, text, error in [("G", "91", 0), ("X", "7", 0), ("G", "90", 21), ("X", "8", 21)]:
            await word(ctx, letter, text, error)
        for first in LETTERS * 40:
            await clear(ctx, motion=rng.choice([0, 1, 2, 3, 4, 8, 9, 10, 11]),
                        plane=rng.randrange(3), system=rng.randrange(6), **{
                            name: rng.randrange(2) for name in (
                                "relative", "inches", "inverse", "clockwise", "counter_clockwise",
                                "mist", "flood")})
            error = 0
            while not error or rng.random() < 0.3:
                letter = rng.choice("GGGGMM" + LETTERS + "AQ" + 2 * first)
                error = await word(ctx, letter, some_number(rng, letter))
            if rng.random() < 0.3:
                await clear(ctx, inches=rng.randrange(2))
                for letter in "GMMXFN":
                    await word(ctx, letter, some_number(rng, letter))
                ctx.set(dut.end_program, 1)
                await ctx.tick()
                ctx.set(dut.end_program, 0)
                await see(ctx, letters=0, axes=0, non_modal=0,
                          modes={"inches": given["inches"], "motion": 1})

    run.simulate(dut, test, deadline=50_000)
    return (f"a mode and a value are taken; a second mode of the group is error 21, which stays; "
            f"as its model in {counts.total()} words, of which {counts[0]} are good")


@bench
def g_code_lister(run: Run) -> str:
    """Modes with and without a feed, the build, and where the probe touched."""
    dut = GCodeLister()
    words = {Operand.FEED: 8_333_333, Operand.SPEED: 1_500_000, Operand.TOOL: 3_000_000,
             Operand.PROBED + 2: -1_000_500}

    async def divider(ctx):
        while True:
            divide, division = ctx.get(dut.divide), ctx.get(dut.division)
            word = words.get(ctx.get(dut.address), 0)
            await ctx.tick()
            ctx.set(dut.divided, divide)
            ctx.set(dut.quotient, divide and quotient(
                word, division.unit.name, inches=division.inches, nearest=division.nearest))

    async def parts(ctx, which):
        ctx.set(dut.list, which)
        ctx.set(dut.start, 1)
        await ctx.tick()
        ctx.set(dut.start, 0)
        listed, done = [], False
        while not done:
            *_, valid, part, done = await ctx.tick().sample(
                dut.parts.valid, dut.parts.payload, dut.done)
            if valid:
                listed.append((part.text.name, part.value))
        return listed

    async def test(ctx):
        ctx.set(dut.parts.ready, 1)
        ctx.set(dut.modes.flood, 1)
        run.expect("modes", [value for _, value in await parts(ctx, GCodeList.MODES)],
                   [0, 54, 17, 21, 90, 94, 5, 8, 3, 500, 2])
        ctx.set(dut.feed_zero, 1)
        run.expect("without a feed", (await parts(ctx, GCodeList.MODES))[-2], ("FEED", 0))
        run.expect("build", [text for text, _ in await parts(ctx, GCodeList.BUILD)],
                   [GCodeText.BUILD.name])
        ctx.set(dut.probed, 1)
        run.expect("probed", await parts(ctx, GCodeList.PROBED),
                   [("PROBED", 0), ("AXIS", 0), ("LAST_PROBED", -1001)])
        run.see(ctx, dut, fault=0)

    run.simulate(dut, test, divider)
    return ("the modes are G0 G54 G17 G21 G90 G94 M5 M8, tool 3, 500 mm/min, 2 rev/min, and 0 "
            "mm/min where that does not hold; "
            "the probe touched at Z -1.001")


@bench
def g_code_coordinates(run: Run) -> str:
    """The target of a line, in a system with an offset; then every sum."""
    dut, rng = GCodeCoordinates(), random.Random(1)

    async def store(ctx, address, value):
        ctx.set(dut.address, address)
        ctx.set(dut.data, value)
        ctx.set(dut.write, 1)
        await ctx.tick()
        ctx.set(dut.write, 0)

    async def test(ctx):
        for axis in range(3):
            await store(ctx, LETTERS.index("X") + axis, 1000 * (axis + 1))
            await store(ctx, Operand.SYSTEM + axis, -10)
            await store(ctx, Operand.OFFSET + axis, 7)
            await store(ctx, Operand.POSITION + axis, 55)
        await store(ctx, Operand.LENGTH, 0)
        ctx.set(dut.line.letters, letters("XY"))
        ctx.set(dut.sum, CoordinateSum.TARGET)
        ctx.set(dut.run, 1)
        await run.until(ctx, dut, done=1, within=40)
        run.see(ctx, dut, beyond=0)
        await ctx.tick()
        ctx.set(dut.run, 0)
        for axis, expected in enumerate((997, 1997, 55)):
            ctx.set(dut.operand_address, Operand.TARGET + axis)
            await ctx.tick()
            run.expect("target", ctx.get(dut.operand), expected)
        for what in [*CoordinateSum] * 3:
            await check(ctx, what)

    async def check(ctx, what):
        words = [0 if rng.random() < 0.2 else rng.getrandbits(bits) - (1 << bits - 1)
                 for bits in [rng.choice([8, 34])] for _ in range(64)]
        for address, value in enumerate(words):
            await store(ctx, address, value)
        given = {letter for letter in "XYZ" if rng.random() < 0.6}
        relative, machine, of_length, second, of_position = (
            rng.random() < share for share in (0.4, 0.3, 0.1, 0.5, 0.5))
        system, p = rng.randrange(6), rng.randrange(7)
        ctx.set(dut.line, {
            "letters": letters("".join(given)), "second": second, "p_whole": p,
            "l_whole": 20 if of_position else 2, "non_modal": NonModal.MACHINE if machine
            else NonModal.NONE, "axes": AxisUse.LENGTH if of_length else AxisUse.MOTION,
            "modes": {"relative": relative, "system": system}})
        ctx.set(dut.sum, what)
        ctx.set(dut.run, 1)
        await ctx.tick()
        await run.until(ctx, dut, done=1, within=40)
        after, sums = summed(
            what.name, words, letters=given, relative=relative, system=system, machine=machine,
            of_length=of_length, second=second, p=p, of_position=of_position)
        run.see(ctx, dut, changed=any(sums), beyond=any(
            not -(1 << 35) <= each < 1 << 35 for each in sums))
        await ctx.tick()
        ctx.set(dut.run, 0)
        for address, expected in enumerate(after):
            ctx.set(dut.operand_address, address)
            ctx.set(dut.address, 63 - address)
            await ctx.tick()
            run.see(ctx, dut, operand=expected, word=after[63 - address])

    run.simulate(dut, test, deadline=50_000)
    return ("X and Y go to their values, shifted by both origins; Z stays; every sum is as in its "
            "model")


def converted(values: Mapping[str, int], *, inches: bool, inverse: bool, was_inverse: bool
              ) -> dict[str, int]:
    """Return the values of a line that are converted, in nm and nm/s."""
    found = {}
    for letter, value in values.items():
        if letter in "IJKRXYZ" and inches:
            found[letter] = nanometres(value, inches=True)
        elif letter == "F" and not inverse:
            found[letter] = per_second(nanometres(value, inches and not was_inverse))
    return found


@bench
def unit_converter(run: Run) -> str:
    """A length in inches and a feed, one that is too long, and a word of a list."""
    dut, rng = UnitConverter(), random.Random(1)
    values = {letter: 0 for letter in LETTERS}
    written = {}

    async def memory(ctx):
        read = 0
        while True:
            ctx.set(dut.word, read)
            read = values[LETTERS[min(ctx.get(dut.address), len(LETTERS) - 1)]]
            if ctx.get(dut.write):
                letter = LETTERS[ctx.get(dut.address)]
                written[letter] = values[letter] = ctx.get(dut.data)
            await ctx.tick()

    async def convert(ctx, inches=1, inverse=0, was_inverse=0, **named):
        values.update(named)
        written.clear()
        ctx.set(dut.line.letters, letters("".join(named)))
        ctx.set(dut.line.modes.inches, inches)
        ctx.set(dut.line.modes.inverse, inverse)
        ctx.set(dut.was_inverse, was_inverse)
        ctx.set(dut.run, 1)
        for _ in range(800):
            if ctx.get(dut.done) or ctx.get(dut.too_long):
                break
            await ctx.tick()
        long = ctx.get(dut.too_long)
        await ctx.tick()
        ctx.set(dut.run, 0)
        await ctx.tick()
        return long

    async def test(ctx):
        run.expect("too long", await convert(ctx, X=1_000_000, F=60_000_000), 0)
        run.expect("inch in nm", written["X"], 25_400_000)
        run.expect("inches a minute in nm/s", written["F"], 25_400_000)
        run.expect("too long", await convert(ctx, X=1 << 40), 1)
        values["F"] = -1500
        ctx.set(dut.division, {"unit": GCodeUnit.LENGTH, "nearest": 1})
        ctx.set(dut.divide, 1)
        await run.until(ctx, dut, divided=1, within=70)
        run.expect("um", ctx.get(dut.data), -2)
        ctx.set(dut.divide, 0)
        for _ in range(60):
            modes = {name: bool(rng.randrange(2)) for name in ("inches", "inverse", "was_inverse")}
            named = {letter: rng.getrandbits(bits) - (1 << bits - 1)
                     for letter in LETTERS if rng.random() < 0.4
                     for bits in [rng.choice([4, 20, 33, 34])]}
            if "F" in named:
                named["F"] = abs(named["F"]) << rng.choice([0, 8])
            expected = converted(named, **modes) | {
                letter: 0 for letter in "IJK" if letter not in named}
            long = any(not -(1 << dut.reach - 1) <= expected[letter] < 1 << dut.reach - 1
                       for letter in "IJKRXYZ" if letter in expected)
            run.expect("too long", await convert(ctx, **modes, **named), int(long))
            if not long:
                run.expect("converted", written, expected)
            unit, word = rng.choice([*GCodeUnit]), rng.getrandbits(34) - (1 << 33)
            inches, nearest = rng.randrange(2), rng.randrange(2)
            values["F"] = word if nearest else abs(word)
            ctx.set(dut.line.letters, 0)
            ctx.set(dut.division, {"unit": unit, "inches": inches, "nearest": nearest})
            ctx.set(dut.divide, 1)
            await run.until(ctx, dut, divided=1, within=70)
            run.see(ctx, dut, data=quotient(values["F"], unit.name, inches=bool(inches),
                                            nearest=bool(nearest)))
            ctx.set(dut.divide, 0)
            await ctx.tick().repeat(2)
        run.see(ctx, dut, fault=0)

    run.simulate(dut, test, memory, deadline=50_000)
    return ("an inch is 25.4 mm, 60 inches a minute are 25.4 mm/s; 2**40 is too long; "
            "-1500 nm are -2 um; as numbers have it in 60 lines and lists")


@bench
def stored_program(run: Run) -> str:
    """A line that is broken, a program of two lines, and the rest of the line."""
    dut = StoredProgram(b"G1\nX2\n")
    given = []

    async def watch(ctx):
        while True:
            *_, valid, ready, item = await ctx.tick().sample(
                dut.items.valid, dut.items.ready, dut.items.payload)
            if valid and ready:
                given.append(LineEnd(item.byte).name if item.end else chr(item.byte))

    async def lines(ctx):
        ctx.set(dut.lines.valid, 1)
        for byte in b"G0 9\n":
            ctx.set(dut.lines.payload, {"byte": byte if byte != 10 else 0, "end": byte == 10})
            await run.until(ctx, dut.lines, ready=1)
            await ctx.tick()
            if byte == ord(" "):
                ctx.set(dut.lines.valid, 0)
                await ctx.tick().repeat(6)
                ctx.set(dut.lines.valid, 1)
        ctx.set(dut.lines.valid, 0)

    async def answers(ctx):
        while True:
            await run.until(ctx, dut.items, valid=1)
            ends = ctx.get(dut.items.payload.end)
            await ctx.tick()
            if ends:
                await ctx.tick()
                ctx.set(dut.answered, 1)
                await ctx.tick()
                ctx.set(dut.answered, 0)

    async def test(ctx):
        ctx.set(dut.items.ready, 1)
        await ctx.tick().repeat(6)
        ctx.set(dut.run, 1)
        await ctx.tick()
        ctx.set(dut.run, 0)
        await run.until(ctx, dut, running=1)
        await run.until(ctx, dut, running=0)
        await ctx.tick().repeat(10)
        run.expect("items", given, ["G", "0", " ", "DAMAGED", "G", "1", "GOOD", "X", "2", "GOOD"])
        run.see(ctx, dut, fault=0)

    run.simulate(dut, test, watch, lines, answers)
    return "a line that had begun was ended, two lines were given, and what came behind dropped"


@bench
def stored_lines(run: Run) -> str:
    """A line is run at the start; one more is kept, and then both are run."""
    dut = StoredLines([b"G54"], length=7)
    given, said = [], []

    async def watch(ctx):
        while True:
            *_, valid, item = await ctx.tick().sample(dut.items.valid, dut.items.payload)
            if valid:
                given.append("end" if item.end else chr(item.byte))

    async def answers(ctx):
        ctx.set(dut.items.ready, 1)
        ctx.set(dut.said.ready, 1)
        ctx.set(dut.replies.ready, 1)
        while True:
            *_, valid, item = await ctx.tick().sample(dut.items.valid, dut.items.payload)
            if valid and item.end:
                ctx.set(dut.answers.valid, 1)
                *_, replied, text = await ctx.tick().sample(dut.replies.valid,
                                                            dut.replies.p.text)
                said.append(text.name if replied else "ok")
                ctx.set(dut.answers.valid, 0)

    async def test(ctx):
        await ctx.tick().repeat(30)
        ctx.set(dut.slot, 2)
        ctx.set(dut.writing, 1)
        for letter in b"G21":
            ctx.set(dut.seen, 1)
            ctx.set(dut.character, letter)
            await ctx.tick()
        ctx.set(dut.seen, 0)
        ctx.set(dut.writing, 0)
        ctx.set(dut.keep, 1)
        await ctx.tick()
        ctx.set(dut.keep, 0)
        ctx.set(dut.slot, 0)
        ctx.set(dut.lines.payload, {"byte": ord("$"), "end": 0})
        ctx.set(dut.lines.valid, 1)
        await ctx.tick()
        ctx.set(dut.lines.payload, {"byte": 0, "end": 1})
        ctx.set(dut.run, 1)
        await ctx.tick()
        ctx.set(dut.run, 0)
        ctx.set(dut.lines.valid, 0)
        await ctx.tick().repeat(40)
        run.expect("items", " ".join(given), "G 5 4 end $ end G 5 4 end G 2 1 end")
        run.expect("answers", said, ["RAN_FIRST", "ok", "RAN_FIRST", "RAN_SECOND"])
        run.see(ctx, dut, fault=0)

    run.simulate(dut, test, watch, answers)
    return "G54 was run at the start, and with G21, which was kept, behind a line"


@bench
def thesis_dialect(run: Run) -> str:
    """A dwell in milliseconds, a motion, and the way home once nothing moves."""
    dut = ThesisDialect(width=28)
    passed = []

    async def offer(ctx):
        for item in read_lines("G4P12\nX1\nG28\nG17\n"):
            await put(ctx, dut.words, {
                "kind": GCodeKind[item.kind], "system": item.system, "status": item.status,
                "character": ord(item.character or "\0"),
                "number": {**item.number, "value": item.number.get("value", 0) % (1 << 28)}})

    async def test(ctx):
        ctx.set(dut.passed.ready, 1)
        for clock in range(90):
            ctx.set(dut.resting, clock > 60)
            *_, valid, out = await ctx.tick().sample(dut.passed.valid, dut.passed.payload)
            ends = valid and out.kind == GCodeKind.END
            ctx.set(dut.answered, ends)
            if ends:
                passed.append("end")
            elif valid and out.character == ord("P"):
                passed.append(f"P{out.number.value}")
            elif valid:
                whole = out.number.whole if out.kind == GCodeKind.WORD else ""
                passed.append(f"{chr(out.character)}{whole}")

    run.simulate(dut, test, offer)
    run.expect("passed", " ".join(passed), "G4 P12000 end X1 M3 end $ H end A17 end")
    return "G4 P12 is 12 ms, a motion has M3, G28 is $H, and G17 a letter that is unknown"
