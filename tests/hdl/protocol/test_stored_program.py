# amaranth: UnusedElaboratable=no

"""A program in the bitstream: whatever comes, what is passed is whole lines, in order."""

import random
import re

import pytest
from amaranth.sim import Simulator

from fresa.protocol import LineEnd, StoredProgram


@pytest.mark.parametrize(("program", "message"), [
    (b"", "number of bytes of a program must be a whole number from 1 to 65536, not 0"),
    (b"G1", "the last line of a program must end with LF"),
    (b"\n" * 65_537, "number of bytes of a program must be a whole number from 1 to 65536, "
                     "not 65537")])
def test_impossible_programs(program, message):
    with pytest.raises(ValueError, match=f"^{re.escape(message)}$"):
        StoredProgram(program)


PROGRAM = b"one\ntwo\nthree\n"


async def clocks(ctx, count: int) -> None:
    """Wait."""
    for _ in range(count):
        await ctx.tick()


class Session:
    """Lines that are offered and taken at random, each answered after a while."""

    def __init__(self, seed: int) -> None:
        self.rng = random.Random(seed)
        self.given: list[tuple[bool, str, int, bool]] = []  # of the program, line, status, refused
        self.dut = StoredProgram(PROGRAM)

    async def offer(self, ctx) -> None:
        """Offer the lines 0 to 59."""
        lines = self.dut.lines
        for letter in "".join(f"{number}\n" for number in range(60)):
            await clocks(ctx, self.rng.choice([1, 1, 1, 2, 40]))
            ends = letter == "\n"
            ctx.set(lines.payload, {"byte": 0 if ends else ord(letter), "end": ends})
            ctx.set(lines.valid, 1)
            while True:
                *_, ready = await ctx.tick().sample(lines.ready)
                if ready:
                    break
            ctx.set(lines.valid, 0)

    async def take(self, ctx) -> None:
        """Take items, and answer each line."""
        items, text = self.dut.items, ""
        while True:
            ctx.set(items.ready, 0)
            await clocks(ctx, self.rng.choice([1, 1, 2, 5]))
            ctx.set(items.ready, 1)
            *_, valid, running, item = await ctx.tick().sample(
                items.valid, self.dut.running, items.payload)
            if not valid:
                continue
            ctx.set(items.ready, 0)
            if not item.end:
                text += chr(item.byte)
                continue
            refused = self.rng.random() < 0.1
            if running and not refused and self.rng.random() < 0.1:
                ctx.set(self.dut.ended, 1)
                await ctx.tick()
                ctx.set(self.dut.ended, 0)
                text += " ended"
            await clocks(ctx, self.rng.randint(1, 9))
            ctx.set(self.dut.answered, 1)
            ctx.set(self.dut.refused, refused)
            await ctx.tick()
            ctx.set(self.dut.answered, 0)
            self.given.append((bool(running), text, item.byte, refused))
            text = ""

    async def run(self, ctx) -> None:
        """Ask for the program now and then."""
        for _ in range(4000):
            ctx.set(self.dut.run, self.rng.random() < 0.004)
            await ctx.tick()
        ctx.set(self.dut.run, 0)
        await clocks(ctx, 600)
        assert not ctx.get(self.dut.fault)

    def simulate(self) -> None:
        simulator = Simulator(self.dut)
        simulator.add_clock(1e-6)
        for process in (self.offer, self.take):
            simulator.add_testbench(process, background=True)
        simulator.add_testbench(self.run)
        simulator.run()


@pytest.mark.parametrize("seed", range(3))
def test_lines_of_either_are_whole_and_in_order(seed):
    session = Session(seed)
    session.simulate()
    program = PROGRAM.decode().split()
    runs, number, broken = 0, 0, 0
    at, ends = 0, True  # in the program, which is not running
    for running, text, status, refused in session.given:
        if running:
            runs += at == 0
            assert text.removesuffix(" ended") == program[at]
            assert status == LineEnd.GOOD.value
            ends = refused or " " in text or at == len(program) - 1
            at = 0 if ends else at + 1
        else:
            assert ends
            assert str(number).startswith(text) if status else text == str(number)
            assert status in (LineEnd.GOOD.value, LineEnd.DAMAGED.value)
            broken += status == LineEnd.DAMAGED.value
            number += 1
    assert runs > 3
    assert number > 15
    assert broken
