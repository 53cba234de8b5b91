# amaranth: UnusedElaboratable=no

"""Bytes to levels and back, and on the pins of a design that sends back what it receives."""

import random
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tb.boards import component
from tb.engines import AmaranthEngine
from tb.uart import Decoder, SerialLine, encode
from tests.echo import Echo

PERIOD = 16


def edges(data: bytes, period: int, gaps: list[int]) -> list[tuple[int, int]]:
    """Give when the line changes for bytes with so many idle clocks before each."""
    line = []
    for byte, gap in zip(data, gaps, strict=True):
        line += [1] * gap
        line += encode(bytes([byte]), period)
    return [(clock, level) for clock, (last, level) in enumerate(pairwise([1, *line]))
            if level != last] + [(len(line), 1)]


class TestDecoder:
    @given(st.binary(max_size=8), st.integers(1, 20), st.data())
    def test_bytes_with_gaps(self, data, period, draw):
        gaps = draw.draw(st.lists(st.integers(0, 40), min_size=len(data), max_size=len(data)))
        decoder = Decoder(period)
        assert b"".join(decoder.feed(*edge) for edge in edges(data, period, gaps)) == data
        assert decoder.errors == 0

    def test_a_byte_without_a_stop_bit_is_left_out_and_counted(self):
        decoder = Decoder(10)
        assert decoder.feed(0, 0) == decoder.feed(500, 1) == b""
        assert decoder.errors == 1
        assert b"".join(decoder.feed(500 + clock, level)
                        for clock, level in edges(b"a", 10, [20])) == b"a"

    @given(st.lists(st.tuples(st.integers(0, 30), st.integers(0, 1)), max_size=200))
    def test_any_line_can_be_decoded(self, moves):
        decoder, clock, received = Decoder(4), 0, b""
        for later, level in moves:
            clock += later
            received += decoder.feed(clock, level)
        assert len(received) + decoder.errors <= clock // 38 + 1


class TestSerialLine:
    def line(self) -> SerialLine:
        design = component("echo", Echo(period=PERIOD))
        return SerialLine(AmaranthEngine(design), PERIOD)

    def test_what_is_sent_comes_back_however_the_clocks_are_cut(self):
        rng, line = random.Random(1), self.line()
        sent, received = b"", b""
        for _ in range(200):
            if rng.random() < 0.2 and len(sent) < 40:
                sent += (new := rng.randbytes(rng.randrange(4)))
                line.send(new)
            received += line.run(rng.randrange(1, 300))
        assert len(sent) > 30 and received == sent and line.errors == 0

    @pytest.mark.parametrize("cut", [1, 7, 160, 10_000])
    def test_bytes_follow_each_other_without_a_gap(self, cut):
        line, received = self.line(), b""
        line.send(b"0123456789")  # from the first clock on, before the receiver is ready
        assert line.waiting == 10
        for _ in range(-(-13 * 10 * PERIOD // cut)):
            received += line.run(cut)
        assert received == b"0123456789" and line.waiting == 0 and line.errors == 0

    def test_runs_exactly_so_many_clocks(self):
        line = self.line()
        line.send(b"abc")
        for clocks in (0, 1, 15, 16, 17, 500):
            before = line._engine.clock
            line.run(clocks)
            assert line._engine.clock == before + clocks

    def test_a_break_cuts_off_a_byte_and_comes_before_what_waits(self):
        line = self.line()
        line.send(b"abc")
        sent = line.run(25 * PERIOD)  # into the second
        line.send_break()
        assert sent + line.run(60 * 10 * PERIOD) == b"a\x02c"  # so much of it, damaged
