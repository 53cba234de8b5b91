# amaranth: UnusedElaboratable=no

"""The thesis' dialect in that of GRBL, against its model."""

import random

import pytest
from amaranth.sim import Simulator

from fresa.protocol import GCodeKind, ThesisDialect
from tb.models.gcode_line import Item, read_lines
from tb.models.thesis import in_grbl

WORDS = ["G0", "G1", "G02", "G3", "G4", "G28", "G90", "G91", "G92", "M0", "M3", "M5", "M4", "G17",
         "G1.5", "G-1", "M30", "X1.5", "Y-2", "Z3", "F100", "P200", "P0.0015", "P-3", "I1", "T1",
         "P99999999999", "G99999999999", "G28.1", "N1", "P0.000999"]


def text_of(seed: int) -> str:
    rng = random.Random(seed)
    lines = ["G28", "G28", "$X", "$100=2", "", "G28X1", "X1G28", "G28M3", "G92X1", "G92",
             "M3G92F1", "X1M5", "X1", "G28 G28", "G"]
    lines += ["".join(rng.choice(WORDS) for _ in range(rng.randint(0, 4))) for _ in range(40)]
    rng.shuffle(lines)
    return "".join(f"{line}\n" for line in lines)


def payload(item: Item) -> dict:
    number = {**item.number}
    if number.get("overflow"):
        number["value"] = 0
    return {"kind": GCodeKind[item.kind], "system": item.system, "status": item.status,
            "character": ord(item.character or "\0"), "number": number}


@pytest.mark.parametrize("seed", range(3))
def test_is_its_model(seed):
    """And homing waits until nothing moves, after all lines are answered."""
    items, rng = read_lines(text_of(seed)), random.Random(seed)
    dut, seen, waiting = ThesisDialect(), [], []

    async def offer(ctx):
        for item in items:
            while rng.random() < 0.3:
                await ctx.tick()
            ctx.set(dut.words.payload, payload(item))
            ctx.set(dut.words.valid, 1)
            while True:
                *_, ready = await ctx.tick().sample(dut.words.ready)
                if ready:
                    break
            ctx.set(dut.words.valid, 0)

    async def take(ctx):
        open_ = 0
        while len(seen) < len(expected):
            ready = rng.random() < 0.6 and not open_
            answered = open_ == 1
            rests = rng.random() < 0.1
            ctx.set(dut.passed.ready, ready)
            ctx.set(dut.answered, answered)
            ctx.set(dut.resting, rests)
            *_, valid, out, fault = await ctx.tick().sample(
                dut.passed.valid, dut.passed.payload, dut.fault)
            assert not fault
            open_ = max(0, open_ - 1)
            waiting.append(rests and not answered and not open_)
            if valid and ready:
                seen.append(out)
                if out.kind == GCodeKind.CHARACTER and out.character == ord("$") and (
                        expected[len(seen)].character == "H"):
                    assert any(waiting)
                if out.kind == GCodeKind.END:
                    open_ = rng.randint(1, 9)
                    waiting.clear()
        ctx.set(dut.passed.ready, 0)

    expected = in_grbl(items)
    simulator = Simulator(dut)
    simulator.add_clock(1e-6)
    simulator.add_testbench(take)
    simulator.add_testbench(offer, background=True)
    simulator.run()
    assert len(seen) == len(expected)
    for out, item in zip(seen, expected, strict=True):
        assert (out.kind.name, out.system, out.status.value) == (
            item.kind, item.system, item.status), item
        if item.kind != "END":
            assert chr(out.character) == item.character, item
        if item.number:
            assert {name: getattr(out.number, name) for name in item.number
                    if name != "value" or not item.number["overflow"]} == {
                        name: value for name, value in item.number.items()
                        if name != "value" or not item.number["overflow"]}, item
