# amaranth: UnusedElaboratable=no

"""Bytes on the pins of a design that runs, against a design that says everything again."""

import random
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tb.boards import component
from tb.engines import AmaranthEngine
from tb.models.protocol import bits
from tb.uart import Listener, SerialLine
from tests.echo import Echo

PERIOD = 16


def edges(data: bytes, period: int, gaps: list[int]) -> list[tuple[int, int]]:
    """Give when the line changes for bytes with so many clocks of silence before each."""
    line = []
    for byte, gap in zip(data, gaps, strict=True):
        line += [1] * gap
        line += [level for bit in bits(byte) for level in [bit] * period]
    return [(clock, level) for clock, (last, level) in enumerate(pairwise([1, *line]))
            if level != last] + [(len(line), 1)]


class TestListener:
    @given(st.binary(max_size=8), st.integers(1, 20), st.data())
    def test_it_reads_what_a_line_says(self, data, period, draw):
        gaps = draw.draw(st.lists(st.integers(0, 40), min_size=len(data), max_size=len(data)))
        listener = Listener(period)
        assert b"".join(listener.hear(*edge) for edge in edges(data, period, gaps)) == data
        assert listener.errors == 0

    def test_a_byte_without_a_stop_bit_is_left_out_and_counted(self):
        listener = Listener(10)
        assert listener.hear(0, 0) == listener.hear(500, 1) == b""
        assert listener.errors == 1
        assert b"".join(listener.hear(500 + clock, level)
                        for clock, level in edges(b"a", 10, [20])) == b"a"

    @given(st.lists(st.tuples(st.integers(0, 30), st.integers(0, 1)), max_size=200))
    def test_any_line_can_be_heard(self, moves):
        listener, clock, heard = Listener(4), 0, b""
        for later, level in moves:
            clock += later
            heard += listener.hear(clock, level)
        assert len(heard) + listener.errors <= clock // 38 + 1


class TestSerialLine:
    def line(self) -> SerialLine:
        design = component("echo", Echo(period=PERIOD))
        return SerialLine(AmaranthEngine(design), PERIOD)

    def test_what_is_sent_comes_back_however_the_clocks_are_cut(self):
        rng, line = random.Random(1), self.line()
        said, heard = b"", b""
        for _ in range(200):
            if rng.random() < 0.2 and len(said) < 40:
                said += (new := rng.randbytes(rng.randrange(4)))
                line.send(new)
            heard += line.run(rng.randrange(1, 300))
        assert len(said) > 30 and heard == said and line.errors == 0

    @pytest.mark.parametrize("cut", [1, 7, 160, 10_000])
    def test_bytes_follow_each_other_without_a_gap(self, cut):
        line, heard = self.line(), b""
        line.send(b"0123456789")  # from the first clock on, before the receiver is ready
        assert line.waiting == 10
        for _ in range(-(-13 * 10 * PERIOD // cut)):
            heard += line.run(cut)
        assert heard == b"0123456789" and line.waiting == 0 and line.errors == 0

    def test_it_runs_exactly_the_clocks_that_it_is_told(self):
        line = self.line()
        line.send(b"abc")
        for clocks in (0, 1, 15, 16, 17, 500):
            before = line._engine.clock
            line.run(clocks)
            assert line._engine.clock == before + clocks

    def test_a_break_cuts_off_a_byte_and_comes_before_what_waits(self):
        line = self.line()
        line.send(b"abc")
        said = line.run(25 * PERIOD)  # into the second
        line.send_break()
        assert said + line.run(60 * 10 * PERIOD) == b"a\x02c"  # so much of it, damaged
