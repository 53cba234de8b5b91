# amaranth: UnusedElaboratable=no

"""The loader of blocks: outputs that come while others are set."""

import pytest
from amaranth.sim import Simulator

from fresa.motion import BlockLoader
from fresa.motion.blocks import BLOCK_WORDS, BlockHeader, BlockKind, BlockWord, Outputs


def outputs_block(outputs: dict[str, int], extra: int) -> list[int]:
    """Return the words of a block that sets outputs."""
    header = BlockHeader.const({"kind": BlockKind.OUTPUTS, "outputs": outputs})
    words = [0] * BLOCK_WORDS
    words[BlockWord.HEADER], words[BlockWord.EXTRA] = header.as_bits(), extra
    return words


@pytest.mark.parametrize("rest", range(40, 60))
def test_the_newest_outputs_are_set_whenever_motion_ends(rest):
    """Motion ends, after `rest` clocks, while one block waits for that and another is read."""
    dut = BlockLoader(clock=2_000_000)
    words = [*outputs_block({"clockwise": 1}, 100), *outputs_block({"flood": 1}, 200)]

    async def test(ctx):
        at = 0
        for clock in range(70):
            ctx.set(dut.idle, clock >= rest)
            ctx.set(dut.blocks.valid, at < len(words))
            if at < len(words):
                ctx.set(dut.blocks.payload, {
                    "data": words[at], "last": at % BLOCK_WORDS == BLOCK_WORDS - 1})
                at += ctx.get(dut.blocks.ready)
            await ctx.tick()
        assert at == len(words)
        assert ctx.get(dut.extra) == 200
        assert ctx.get(dut.outputs) == Outputs.const({"flood": 1})

    simulator = Simulator(dut)
    simulator.add_clock(1e-6)
    simulator.add_testbench(test)
    simulator.run()
