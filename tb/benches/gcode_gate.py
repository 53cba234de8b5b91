"""Bench of the gate: lines of G-code that it refuses, and system lines that it carries out."""

import random
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from fresa.protocol import SETTINGS, GCodeGate, GCodeKind, GCodeText
from fresa.protocol.gcode_settings import GCodeSetting

from ..bench import Run, bench, put
from ..models.gcode_gate import GateModel, Levels
from ..models.gcode_line import Item, read_lines

WIDTH = 44
KNOWN = [each for each in SETTINGS if each.number in (0, 20, 21, 22, 31, 100, 110)]
"""An address, which may also be behind the last, has three bits, of which all matter then."""

FASTEST = 400_000
LINES = 300

AT_REST = Levels(locked=False, jogging=False, resting=True, stopped=False, door=False,
                 too_long=False, accepted=True)
LOCKED = replace(AT_REST, locked=True)
MOVING = replace(AT_REST, resting=False)
AT_THE_DOOR = replace(LOCKED, door=True)
FIRST = (
    ("G1X2", AT_REST), ("G1X2", LOCKED), *((text, LOCKED) for text in (
        "", "G", "1", "$C", "$X", "$J=X1", "$N0=G1", "$I=a", "$100=2.5")),
    *((text, AT_THE_DOOR) for text in ("$X", "$H")), ("$X", replace(AT_REST, door=True)),
    *((text, AT_REST) for text in (
        "$H", "$20=1", "$110=300", "$22=1", "$20=1", "$H", "$HX", "$HY", "$HZ", "$22=0", "$22=1",
        "$110=900", "$100=0", "$100=-1", "$100=200000", "$21=0.5", "$$", "$SLP", "$J=1", "$Z",
        "$100=.-60", "$N1=M5", "$I=x")),
    ("$H", replace(AT_REST, door=True)),
    *((text, replace(AT_REST, stopped=True)) for text in ("$X", "$H", "$SLP", "$100=7")),
    *((text, replace(MOVING, jogging=True)) for text in ("$$", "$#", "$J=Y1", "G1", "$G", "")),
    *((text, MOVING) for text in ("$J=X1", "$100=1", "$", "$G", "$X1")),
    ("$N0=G1X2Y3", replace(AT_REST, too_long=True)), ("$C", AT_REST),
    *((text, MOVING) for text in ("G1", "$$", "$H", "$C")),
    *((f"$RST={which}", AT_REST) for which in "$#*"), ("$#", AT_REST), ("$I", AT_REST),
    ("$N", AT_REST))
"""Lines of each kind, in the states in which they are done or refused."""

COMMANDS = ("$", "$$", "$#", "$G", "$I", "$N", "$X", "$H", "$HX", "$HY", "$HZ", "$C", "$SLP",
            "$RST=$", "$RST=#", "$RST=*")
OTHERS = ("$100=", "$=1", "$=", "$Q", "$Q100=1", "$100==1", "$100=X", "$100", "$RST", "$RST=",
          "$RST=$$", "$SL", "$N5", "$I1", "$SLPP", "$RST=1", "$RST=$1", "$GX", "$XRST=$",
          "$RST=$RST=$", "$100=1X", "$X100=1", "$1X=1", "$-100=1", "$100.0=1", "$$1", "$C=",
          "$100=1-60", "$100=--50", "$100=1.5.70", "$100=+-60", "$J", "$J5=1", "$JJ=X1", "$HA",
          "$HXY", "$H1", "$R", "$S", "$5", "$+5", "$.5", "$:", "$/", "$I5", "$XX", "$100=X1=2")
TEXTS = ("$J=X1", "$J=X1 F2", "$J=", "$J=X", "$N0=G1X2", "$N1=M5", "$N0=", "$N1=1", "$I=a 5 $H",
         "$I=")
CODE = "G1X2", "", "G", "1", "X 1 X", "Z-1", "G0G1", "N5"


def some_line(rng: random.Random, settings: Sequence[GCodeSetting]) -> str:
    """Return a line, without its end."""
    kind = rng.random()
    if kind > 0.6:
        return rng.choice([COMMANDS, OTHERS, CODE, TEXTS][int(rng.random() * 4)])
    if kind > 0.5:
        return rng.choice(COMMANDS)
    number = rng.choice([*(each.number for each in settings), 20, 22, 110, 5, 255, 356, 99999999])
    value = rng.choice([
        f"{rng.uniform(0, 1000):.{rng.randint(0, 6)}f}", "0", "1", "1", "0.0005", "0.00049", "7",
        "-1", "-0.5", "1e", "134217.727", "134217.7274", "134217.7275", "200000", "99999999999",
        "16777215", "255000", "255", "4000", "4001", str(rng.randint(0, 9))])
    return f"${number}={value}"


def some_levels(rng: random.Random) -> Levels:
    """Return what the machine may be: at rest most of the time."""
    def likely(share: float) -> bool:
        return rng.random() < share

    return Levels(locked=likely(0.2), jogging=likely(0.15), resting=likely(0.85),
                  stopped=likely(0.1), door=likely(0.2), too_long=likely(0.2),
                  accepted=likely(0.7))


@bench
def g_code_gate(run: Run) -> str:
    """Lines that are passed, refused, and carried out, each as its model has it."""
    done = compare_lines(run, KNOWN, 1, LINES)
    return (f"as in its model in {LINES} lines, of which {done['end 0'] + done['end 0 of a jog']} "
            f"are accepted")


def compare_lines(run: Run, settings: Sequence[GCodeSetting], seed: int, lines: int) -> Counter:
    """Send a gate so many lines, and compare what it does with its model; count all of that.

    Parameters
    ----------
    run : Run
        The run.
    settings : sequence of GCodeSetting
        Those of the gate and of its store. What the store says of those with decimals is random.
    seed : int
        Of all that is random.
    lines : int
        Number of lines: those of `FIRST`, and random ones.
    """
    dut, rng = GCodeGate(width=WIDTH, settings=settings), random.Random(seed)
    # Every bit of limits and of initial values counts, whatever the real ones are.
    known = [each._replace(least=rng.randint(0, 1), most=rng.randint(1 << 20, (1 << 27) - 1),
                           default=rng.randrange(FASTEST if each.number == 110 else 1 << 27))
             if each.decimal else each for each in settings]
    model = GateModel({each.number: each.default for each in known}, {
        each.number: (each.least, each.most, each.decimal, each.default) for each in known},
        FASTEST)
    store, done, counts = dict(model.values), [], Counter()
    now = AT_REST

    async def passed(ctx):
        """Take what is passed; answer a line some clocks after its end."""
        while True:
            takes = rng.random() < 0.6
            ctx.set(dut.passed.ready, takes)
            ended = False
            if takes and ctx.get(dut.passed.valid):
                item = ctx.get(dut.passed.payload)
                ended = item.kind == GCodeKind.END
                if ctx.get(dut.unlock):
                    done.append("unlock")
                letter = chr(item.character)
                done.append(f"end {item.status.value}{' of a jog' * item.system}" if ended
                            else letter.lower() if item.system else letter)
            accepted = now.accepted
            await ctx.tick()
            if ended:
                ctx.set(dut.passed.ready, 0)
                await ctx.tick().repeat(rng.randint(1, 9))
                ctx.set(dut.accepted, accepted)
                ctx.set(dut.answered, 1)
                slot = ctx.get(dut.slot)
                done.extend(text for name, text in (
                    ("keep", f"keep {slot}"), ("restart", "restart"), ("sleep", "sleep"),
                    ("restoring_texts", "texts")) if ctx.get(getattr(dut, name)))
                await ctx.tick()
                ctx.set(dut.answered, 0)

    async def store_around(ctx):
        """Store settings, and take them all after a change."""
        computes = at_before = 0
        while True:
            at = min(ctx.get(dut.write_address), len(known) - 1)
            number, data, trial = known[at].number, ctx.get(dut.data), ctx.get(dut.trial)
            if ctx.get(dut.write):
                store[number] = data
                done.append(f"write {number}={data}")
            values = {**store, number: data} if trial else dict(store)
            computes = computes + 1 if ctx.get(dut.configure) else 0
            over = computes > 3
            if over:
                done.append(f"try {number}={data}" if trial else "as before")
            ctx.set(dut.configured, over)
            ctx.set(dut.refused, over and values[110] > FASTEST)
            address = min(ctx.get(dut.address), len(known) - 1)
            await ctx.tick()
            computes = 0 if over else computes
            ctx.set(dut.configured, 0)
            ctx.set(dut.value, values[known[address].number])
            for name in ("number", "decimal", "least", "most"):
                ctx.set(getattr(dut, name), getattr(known[at_before], name))
            ctx.set(dut.initial, known[at_before].default)
            at_before = at

    async def cycles(ctx):
        """Make lists and homing cycles."""
        while True:
            lists, homes = ctx.get(dut.listing), ctx.get(dut.home)
            if lists:
                done.append(f"list {ctx.get(dut.list).name}")
            if homes:
                done.append(f"home {ctx.get(dut.homes)}")
            if ctx.get(dut.erase):
                done.append(f"erase {ctx.get(dut.erase_address)}")
            if ctx.get(dut.restoring):
                done.append("restored")
            await ctx.tick()
            if lists or homes:
                await ctx.tick().repeat(rng.randint(1, 9))
                through = dut.all_listed if lists else dut.homed
                ctx.set(through, 1)
                await ctx.tick()
                ctx.set(through, 0)

    async def listed(ctx):
        """Take the lines of ``$$``."""
        while True:
            takes = rng.random() < 0.4
            ctx.set(dut.listed.ready, takes)
            if takes and ctx.get(dut.listed.valid):
                line = ctx.get(dut.listed.payload)
                done.append(f"show {line.code}={line.value}")
                decimal = any(each.decimal for each in known if each.number == line.code)
                run.expect("how it is listed", (line.text, line.ends), (
                    GCodeText.DECIMAL_SETTING if decimal else GCodeText.WHOLE_SETTING, 1))
            await ctx.tick()

    def item_of(item: Item) -> dict:
        number, half = dict(item.number), 1 << WIDTH - 1
        if number:  # undefined with overflow
            number["value"] = (number["value"] + half) % (1 << WIDTH) - half
        return {"kind": GCodeKind[item.kind], "status": item.status, "system": item.system,
                "character": ord(item.character or "\0"), "number": number}

    async def offer_end(ctx, end: Item, levels: Levels, *, rests: bool):
        """Offer the end of a line; while `settling`, at times, `resting` is not as it will be."""
        ctx.set(dut.words.payload, item_of(end))
        ctx.set(dut.words.valid, 1)
        settles = rng.randint(2, 30) if rng.random() < 0.2 else 0
        moves = settles + rng.randint(15, 40) if rests and not levels.resting else 0
        clock, taken = 0, False
        while not taken:
            ctx.set(dut.settling, clock < settles)
            ctx.set(dut.resting, (clock >= moves and rests) != (clock < settles))
            *_, taken = await ctx.tick().sample(dut.words.ready)
            clock += 1
        ctx.set(dut.words.valid, 0)

    async def send(ctx, items: list[Item], levels: Levels, *, waits: bool) -> list[str]:
        """Send a line; return what it should do."""
        nonlocal now
        now = levels
        for name in ("locked", "jogging", "stopped", "door", "too_long"):
            ctx.set(getattr(dut, name), getattr(now, name))
        rests = now.resting or (waits and not now.locked and not model.checking)
        ctx.set(dut.waiting, waits)
        *inside, end = items
        for each in inside:
            await put(ctx, dut.words, item_of(each))
            if rng.random() < 0.2:
                await ctx.tick().repeat(rng.randint(1, 4))
        if inside:
            slot = model.slot(items)
            run.see(ctx, dut, writing=slot > 0, **({"slot": slot} if slot else {}))
        await offer_end(ctx, end, levels, rests=rests)
        return model.line(items, replace(now, resting=rests))

    async def test(ctx):
        later = []
        for number in range(lines):
            text, levels = FIRST[number] if number < len(FIRST) else (
                some_line(rng, settings), some_levels(rng))
            items = read_lines(text + "\n")
            if number >= len(FIRST) and rng.random() < 0.03 and not items[-1].status:
                items[-1].status = 11  # bytes are lost
            expected = later + await send(
                ctx, items, levels, waits=number >= len(FIRST) and rng.random() < 0.2)
            at = 1 + max(place for place, each in enumerate(expected) if each.startswith("end"))
            run.expect(f"of {text!r}", list(done), expected[:at])
            run.see(ctx, dut, checking=model.checking, fault=0)
            later = expected[at:]
            counts.update(expected)
            done.clear()
        await ctx.tick().repeat(12)
        run.expect("behind the last line", done, later)

    run.simulate(dut, test, passed, store_around, cycles, listed, deadline=200 * lines)
    return counts
